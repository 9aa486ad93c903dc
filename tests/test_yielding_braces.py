"""Braces that yield in tension and compression, in frames with hinges."""

from __future__ import annotations

import functools

import frame_cases
import numpy as np
import pytest
from hinge_cases import motion

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given(
    "no_damping", "damping_ratio", "first_period", "strongest_motion", "weakest_motions", "peak_ground_acceleration"
)
AREAS = {"D1": 6.0e-3, "D2": 5.0e-3, "D3": 3.0e-3}  # m2
YIELD_STRESS, HARDENING_RATIO = 260e6, 0.02
LENGTH = np.hypot(9.15, 3.96)
DAMPING = (0.26679765, 0.00093328278)  # factors of the mass [1/s] and of the initial stiffness of the floors [s]

# Motion and level: peak storey drift ratios, peak floor accelerations [m/s2], mean drift ratios of the last 5 s,
# largest elongation of brace D1 [m] and its largest force [N], by RK4 with Newton's method at 0.0005 s; OpenSeesPy
# agrees with the drifts within 7e-6 of their largest value.
HISTORIES = {
    ("pulse_1", 0.3): (
        (0.002476024, 0.002554989, 0.002504061),
        (0.7047645, 1.357339, 1.98305),
        (-7.48843e-06, -7.81286e-06, -7.73359e-06),
        0.008566714,
        1031082,
    ),
    ("pulse_1", 2): (
        (0.01113299, 0.007180636, 0.007179653),
        (2.433484, 2.841843, 3.443639),
        (0.00201452, 0.00207488, 0.00241276),
        0.03979941,
        1624604,
    ),
    ("pulse_1", 6): (
        (0.04343801, 0.02466708, 0.01896794),
        (6.607602, 7.568095, 4.458984),
        (-0.0127924, -0.0125809, -0.0128995),
        0.1571576,
        1907107,
    ),
    ("LOS270", 0.2): (
        (0.003673345, 0.003454789, 0.003745486),
        (1.658804, 2.307024, 3.058865),
        (-4.24095e-06, -4.43081e-06, -4.39161e-06),
        0.01276773,
        1536713,
    ),
    ("LOS270", 1): (
        (0.01306644, 0.01048799, 0.01086434),
        (4.636009, 3.566128, 3.565008),
        (-0.00278712, -0.00269423, -0.000940428),
        0.04679294,
        1641439,
    ),
    ("LOS270", 5): (
        (0.05166003, 0.03820232, 0.03642898),
        (13.58965, 8.502752, 4.621836),
        (0.0186229, 0.017919, 0.0166178),
        0.1869886,
        1978916,
    ),
}


def brace(name: str) -> dict[str, object]:
    return {"law": "bilinear", "yield_force": YIELD_STRESS * AREAS[name], "hardening_ratio": HARDENING_RATIO}


def braced(**more) -> wd.HingedFrame:
    """Return three storeys with a brace in each, whose columns are elastic and pinned at the base."""
    frame = frame_cases.braced()
    elastic = frame.lumped()
    stiffness = elastic.stiffness_matrices({key: each[None] for key, each in elastic.parameters.items()})[0]
    damping = DAMPING[0] * np.diag(elastic.nominal_mass) + DAMPING[1] * stiffness
    return wd.HingedFrame(frame, {(name, "axial"): brace(name) for name in AREAS}, damping_matrix=damping, **more)


@functools.cache
def run(of: str, dtype: str, step: float):
    names = [each for each in HISTORIES if each[0] == of]
    scene = wd.Scene(braced(), wd.Cloud([motion(*each) for each in names]), recorders=("spring", "acceleration"))
    histories = wd.Histories(range(len(names)))
    return wd.simulate(scene, method="rk4", step=step, dtype=dtype, device="cpu", histories=histories), names


@pytest.mark.parametrize(
    ("name", "dtype"),
    [
        pytest.param(name, dtype, marks=() if (name[0], dtype) == ("pulse_1", "float32") else pytest.mark.thorough)
        for name in HISTORIES
        for dtype in ("float32", "float64")
    ],
    ids=str,
)
def test_histories_agree_with_an_independent_program(name, dtype):
    result, names = run(name[0], dtype, 0.0025)
    place = names.index(name)
    found = result.isel(sample=place)
    drifts, accelerations, residual, elongation, force = HISTORIES[name]
    tolerance = 1e-3 if dtype == "float64" else 2e-3
    assert found["status"].item() == 0
    peaks = found["peak_spring_deformation"]
    np.testing.assert_allclose(peaks.values[:3] / 3.96, drifts, rtol=tolerance)
    np.testing.assert_allclose(found["peak_acceleration"].values, accelerations, rtol=0.01)
    end = 30.0 if name[0] == "LOS270" else 20.0
    history = result["spring_deformation"].isel(history=place).sel(time=slice(end - 5, end))
    np.testing.assert_allclose(history.values[:, :3].mean(axis=0) / 3.96, residual, atol=tolerance * max(drifts))
    assert found["peak_spring_force"].sel(spring="D1 axial").item() == pytest.approx(force, rel=tolerance)
    # The elongation that is recorded lacks that of the elastic part, which is 100 times as stiff as the brace.
    elastic = force / (100 * 200e9 * AREAS["D1"] / LENGTH)
    assert peaks.sel(spring="D1 axial").item() + elastic == pytest.approx(elongation, rel=tolerance)


def test_pushover_yields_storey_by_storey():
    """By hand: without P-Delta, each storey is its brace and the columns, which are much softer."""
    structure = braced(p_delta=False)
    pushed = wd.pushover(structure, np.linspace(0.0, 0.25, 26))
    forces = pushed["spring_force"].sel(spring=["D1 axial", "D2 axial", "D3 axial"]).values
    elongations = pushed["spring_deformation"].sel(spring=["D1 axial", "D2 axial", "D3 axial"]).values
    for brace_name, force, elongation in zip(AREAS, forces.T, elongations.T, strict=True):
        stiffness = 200e9 * AREAS[brace_name] / LENGTH
        whole = elongation + force / (100 * stiffness)
        strength = YIELD_STRESS * AREAS[brace_name]
        elastic = np.abs(stiffness * whole)
        kinked = np.sign(whole) * np.minimum(elastic, strength + HARDENING_RATIO * (elastic - strength))
        np.testing.assert_allclose(force, kinked, rtol=1e-6, atol=1e-6 * strength)
    assert forces[-1, 0] > YIELD_STRESS * AREAS["D1"]  # in tension
    assert forces[-1, 1] < 0  # compression


def test_a_scene_of_braces_is_rebuilt_from_its_json():
    scene = wd.Scene(braced(), wd.Cloud([motion("pulse_1", 1)]), recorders=("spring",))
    again = wd.Scene.from_json(scene.to_json(), motions=[motion("pulse_1", 1)])
    assert again.to_json() == scene.to_json()
    assert again.structure.description()["hinges"][0] == {"member": "D1", "end": "axial", **brace("D1")}


@pytest.mark.fast
@pytest.mark.parametrize(
    ("hinges", "said"),
    [
        ({("C1_1", "axial"): brace("D1")}, "needs a member with kind='truss'; 'C1_1' is a beam or a column"),
        ({("D1", "start"): brace("D1")}, "has kind='truss' and no moments.*'axial'"),
        ({("D1", "middle"): brace("D1")}, "is not an end: give 'start', 'end' or, for a truss, 'axial'"),
        ({("D1", "axial"): {"law": "takeda", "yield_force": 1e6}}, "is not a law of braces.*Buckling is not modelled"),
        ({("D1", "axial"): brace("D1") | {"stiffness": 1e8}}, "remove stiffness.*elastic_modulus \\* area / length"),
        ({("D1", "axial"): {"law": "bilinear", "yield_force": -1.0, "hardening_ratio": 0.02}}, "yield_force"),
        ({("D1", "axial"): {"yield_force": 1e6}}, "needs a dictionary with 'law'"),
    ],
)
def test_mistakes_name_the_brace(hinges, said):
    with pytest.raises(ValueError, match=said):
        wd.HingedFrame(frame_cases.braced(), hinges)


@pytest.mark.fast
def test_area_of_braces_that_yield_is_not_random():
    with pytest.raises(ValueError, match="initial stiffness of braces that yield belongs to the frame"):
        wd.Scene(
            braced(), wd.Cloud([motion("pulse_1", 1)]), {"area": wd.RandomFactor(wd.Lognormal(1.0, 0.1))},
            recorders=("spring",),
        )  # fmt: skip
