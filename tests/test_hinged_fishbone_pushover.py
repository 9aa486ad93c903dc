"""Pushover of fish-bone frames with hinges: OpenSees' displacement control, plastic mechanisms by hand, equilibrium."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest
import xarray as xr
from frame_cases import fishbone
from hinge_cases import HEIGHTS, reference_model, steel
from labels import check_labels
from opensees_frames import build, controlled, rest_under_gravity

import warpdyn as wd

ROOF = float(HEIGHTS.sum())
WEIGHTS = 9.81 * 50e3 * np.arange(10, 0, -1)  # N, that each storey carries
TRIANGLE = np.cumsum(HEIGHTS) / np.cumsum(HEIGHTS).sum()
# Base shears [N] of the reference model at each twentieth of 1.845 m (5 % of the height) under loads that grow with the
# height, from a separate program; OpenSees differs by at most 7e-8 of the peak.
REFERENCE = (
    277463.76,
    554927.51,
    782096.63,
    811946.16,
    836203.95,
    851863.59,
    867414.29,
    879549.0,
    886635.14,
    881393.21,
    871838.93,
    856387.05,
    835835.33,
    813447.79,
    785873.12,
    758298.45,
    730723.79,
    703149.12,
    675574.45,
)


@pytest.fixture(scope="module")
def pushed() -> xr.Dataset:
    return wd.pushover(reference_model(), np.linspace(0, 0.05 * ROOF, 41)[1:], pattern="triangular")


def test_base_shears_are_those_of_the_reference_model(pushed):
    np.testing.assert_allclose(pushed["dof_load"], TRIANGLE, rtol=1e-12)
    assert pushed.attrs["control"] == "floor 10"
    found = pushed["base_shear"].values[1::2]
    np.testing.assert_allclose(found[:19], REFERENCE, rtol=0, atol=2e-7 * max(REFERENCE))


@pytest.mark.skipif(importlib.util.find_spec("openseespy") is None, reason="openseespy is missing")
def test_rotations_and_moments_of_hinges_are_those_of_opensees(pushed):
    structure = reference_model()
    ops, number, _, hinges = build(structure.frame, structure.hinges, p_delta=True)
    rest_under_gravity(ops)
    loads = {(number[f"J{i + 1}"], 1): float(load) for i, load in enumerate(TRIANGLE)}
    path = pushed["roof_displacement"].values[:32]  # up to 4 % of the height
    names = list(structure.hinge_names)
    assert set(names) == set(hinges)
    factors, rotations, moments = [], [], []
    for factor in controlled(ops, loads, (number["J10"], 1), path):
        factors.append(factor)
        rotations.append([ops.eleResponse(hinges[name], "deformation")[0] for name in names])
        moments.append([ops.eleResponse(hinges[name], "force")[5] for name in names])
    ops.wipe()
    own = -pushed.isel(step=slice(32)).sel(spring=names)  # OpenSees' rotations are positive anticlockwise
    due = {
        "base_shear": -np.array(factors),
        "spring_deformation": np.array(rotations),
        "spring_force": np.array(moments),
    }
    for name, values in due.items():
        largest = np.abs(values).max()
        np.testing.assert_allclose(own[name][:26], values[:26], rtol=0, atol=1e-7 * largest)
        # Then a column reaches its capping moment and others unload. Both programs find this point with other steps.
        np.testing.assert_allclose(own[name], values, rtol=0, atol=3e-4 * largest)
    beams = [name for name in names if name.startswith("B")]
    assert (own["spring_deformation"].sel(spring=beams)[31] > 0.025).sum() >= 3  # beyond the capping rotation


def check_equilibrium(pushed: xr.Dataset) -> None:
    """Check storey shears against loads and P-Delta, and moments of columns and beams at joints."""
    loads = pushed["base_shear"].values[:, None] * pushed["dof_load"].values
    storeys = [f"storey {storey}" for storey in range(1, 11)]
    drifts, shears = (pushed[name].sel(spring=storeys).values for name in ("spring_deformation", "spring_force"))
    expected = np.cumsum(loads[:, ::-1], axis=1)[:, ::-1] + WEIGHTS / HEIGHTS * drifts
    np.testing.assert_allclose(shears, expected, rtol=0, atol=1e-8 * np.abs(shears).max())
    moments = pushed["spring_force"]
    ends = [moments.sel(spring=[f"C{storey} {end}" for storey in range(1, 11)]).values for end in ("start", "end")]
    np.testing.assert_allclose(shears * HEIGHTS, ends[0] + ends[1], rtol=0, atol=1e-8 * np.abs(ends).max())
    joints = (
        ends[1][:, :9] + ends[0][:, 1:] + moments.sel(spring=[f"B{storey} start" for storey in range(1, 10)]).values
    )
    np.testing.assert_allclose(joints, 0.0, atol=1e-8 * np.abs(ends).max())


def test_storey_shears_and_moments_are_in_equilibrium(pushed):
    check_equilibrium(pushed)


def plastic(columns: np.ndarray, beams: np.ndarray, base: float | None = None, **more) -> wd.HingedFishbone:
    """Return the frame with elastic-perfectly-plastic hinges of these strengths [N m]."""
    hinges = {}
    for storey, (column, beam) in enumerate(zip(columns, beams, strict=True), start=1):
        hinges[f"C{storey}", "start"] = hinges[f"C{storey}", "end"] = {
            "law": "elastic_perfectly_plastic",
            "yield_force": column,
        }
        hinges[f"B{storey}", "start"] = {"law": "elastic_perfectly_plastic", "yield_force": beam}
    hinges["C1", "start"] = {"law": "elastic_perfectly_plastic", "yield_force": columns[0] if base is None else base}
    return wd.HingedFishbone(fishbone(), hinges, **more)


@pytest.mark.parametrize("pattern", ["triangular", "uniform", {"floor 10": 1.0}])
def test_a_beam_mechanism_has_the_work_of_its_hinges(pattern):
    """All beams and the base yield: the work of the loads is that of the hinges; the columns are straight (by hand)."""
    columns, beams = np.full(10, 3e7), np.linspace(9e5, 4.5e5, 10)
    structure = plastic(columns, beams, base=3e5, p_delta=False)
    pushed = wd.pushover(structure, np.linspace(0, 0.1 * ROOF, 81)[1:], pattern=pattern)
    arm = float(pushed["dof_load"].values @ np.cumsum(HEIGHTS))
    np.testing.assert_allclose(pushed["base_shear"][40:], (beams.sum() + 3e5) / arm, rtol=1e-6)
    # After the mechanism has formed, the columns turn by the same angle.
    drifts = pushed["spring_deformation"].values[40:, :10]
    np.testing.assert_allclose(np.diff(drifts, axis=0) / HEIGHTS, 0.1 / 80, rtol=1e-4)
    # Every hinge has dissipated its strength times its plastic rotation.
    yielding = ["C1 start", *(f"B{storey} start" for storey in range(1, 11))]
    strength, stiffness = (
        dict(zip(pushed["spring"].values, structure.parameters[name], strict=True))
        for name in ("yield_force", "stiffness")
    )
    last = pushed.isel(step=-1)
    for name in yielding:
        rotation = abs(last["spring_deformation"].sel(spring=name).item()) - strength[name] / stiffness[name]
        dissipated = last["dissipated_energy"].sel(spring=name).item()
        assert dissipated == pytest.approx(strength[name] * rotation, rel=0.02)  # trapezoidal rule over 80 steps
    assert (last["dissipated_energy"][:10] == 0).all()


@pytest.mark.parametrize("has_gravity", [False, True], ids=["plain", "P-Delta"])
@pytest.mark.parametrize("weak", [0, 4, 9])
def test_a_weak_storey_carries_the_moments_of_its_columns(weak, has_gravity):
    """Both ends of a column yield: storey shear times height is the sum of the moments minus P-Delta (by hand)."""
    columns, beams = np.full(10, 2e7), np.full(10, 2e7)
    columns[weak] = 5e5
    structure = plastic(columns, beams, p_delta=has_gravity)
    pushed = wd.pushover(structure, np.linspace(0, 1.0, 6)[1:], pattern="triangular")
    drifts = pushed["spring_deformation"].values[-2:, :10]
    lost = WEIGHTS[weak] * drifts[:, weak] if has_gravity else 0.0  # N m
    expected = (2 * 5e5 - lost) / HEIGHTS[weak] / TRIANGLE[weak:].sum()
    np.testing.assert_allclose(pushed["base_shear"][-2:], expected, rtol=1e-6)
    moves = np.diff(drifts, axis=0)[0]  # the other storeys do not move, or unload
    assert (np.delete(moves, weak) < 1e-8).all()
    assert moves.sum() == pytest.approx(0.2, rel=1e-12)


def test_the_elastic_curve_is_that_of_the_condensed_frame():
    structure = reference_model()
    pushed = wd.pushover(structure, [1e-3], pattern="first_mode")
    one = {name: values[None] for name, values in structure.parameters.items()}
    moved = np.linalg.solve(structure.stiffness_matrices(one)[0], pushed["dof_load"].values)
    assert float(pushed["base_shear"][0]) == pytest.approx(1e-3 / moved[-1], rel=1e-9)
    np.testing.assert_allclose(pushed["displacement"][0], 1e-3 * moved / moved[-1], rtol=1e-9)
    work = 0.5e-3 * float(pushed["base_shear"][0])
    assert np.abs(pushed["dissipated_energy"]).max() < 1e-12 * work


def test_the_base_shear_falls_when_hinges_lose_their_moments():
    """Beams lose their moments at a rotation of 0.03 rad; all forces are in equilibrium afterwards."""

    def brittle(strength, plastic_rotation, post_capping):
        return steel(strength, plastic_rotation, post_capping) | {"ultimate_drift": 0.03}

    pushed = wd.pushover(reference_model(brittle), np.linspace(0, 0.9, 46)[1:], pattern="triangular")
    rotations = np.abs(pushed["spring_deformation"].values[-1, 10:])
    lost = pushed["spring_force"].values[-1, 10:] == 0
    assert lost.sum() >= 1
    assert (rotations[lost] > 0.03).all()
    assert (rotations[~lost] < 0.03).all()
    assert pushed["base_shear"].values[-1] < 0.7 * pushed["base_shear"].values.max()
    check_equilibrium(pushed)


def test_dataset_is_labelled():
    pushed = wd.pushover(reference_model(), [0.0, 0.1])
    check_labels(pushed)
    assert pushed["displacement"].sizes["dof"] == 10
    assert list(pushed["spring"].values[:2]) == ["storey 1", "storey 2"]
