"""Fish-bones with elastic columns and bilinear hinges: springs of joints have the results of the general kernel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from frame_cases import fishbone
from hinge_cases import A0
from test_frame_storeys import PEAKS, largest_error

import warpdyn as wd
from warpdyn.campaigns.integration import model
from warpdyn.engine.kernels import build
from warpdyn.engine.kernels.bilinear_hinges import joint_springs
from warpdyn.engine.kernels.hinges.column_storeys import has_joint_springs

pytestmark = pytest.mark.meant_as_given(
    "no_damping",
    "damping_ratio",
    "first_period",
    "strongest_motion",
    "peak_ground_acceleration",
)
DEVICES = ["cpu", *(f"cuda:{number}" for number in range(min(1, wp.get_cuda_device_count())))]
NEVER = 1e8  # N m, a yield moment that no hinge reaches


def bone(
    storeys: int,
    *,
    has_base_hinge: bool = True,
    ratio: float = 0.02,
    has_elastic_top: bool = False,
    never: float = NEVER,
    drift_capacity: float | None = None,
) -> wd.HingedFishbone:
    """Return a fish-bone with elastic columns; the hinge of its top beam is elastic, or does not yield."""
    arguments = fishbone(storeys).description()
    for name, row in arguments["members"].items():
        if name.startswith("C"):
            row.pop("spring_end")
            if name != "C1" or not has_base_hinge:
                row.pop("spring_start")
    hinges = {(f"B{level}", "start"): hinge(8e5 / level, ratio) for level in range(1, storeys)}
    if not has_elastic_top:
        hinges[f"B{storeys}", "start"] = hinge(never, ratio)
    if has_base_hinge:
        hinges["C1", "start"] = hinge(1e6, ratio)
    damping = A0 * np.diag([50e3] * storeys)
    return wd.HingedFishbone(wd.Frame(**arguments), hinges, damping_matrix=damping, drift_capacity=drift_capacity)


def hinge(strength: float, ratio: float) -> dict:
    return {"law": "bilinear", "yield_force": strength, "hardening_ratio": ratio}


def scene_of(structure: wd.HingedFishbone, **more) -> wd.Scene:
    wave = np.convolve(np.random.default_rng(3).normal(size=400), np.ones(8) / 3, "same")
    motions = [wd.GroundMotion(scale * wave, 0.01, f"noise x {scale}") for scale in (0.3, 2.0, 6.0)]
    recorders = ("output", "spring", "acceleration")
    return wd.Scene(structure, wd.Cloud(motions), **{"recorders": recorders, "tail": 0.0} | more)


def plans_of(monkeypatch) -> list:
    plans, fitted = [], build.fitted
    monkeypatch.setattr(model, "fitted", lambda plan, is_gpu: plans.append(plan) or fitted(plan, is_gpu))
    return plans


@pytest.mark.parametrize(
    ("has_base_hinge", "method", "most_solutions"),
    [
        (True, "leapfrog", joint_springs.MOST_SOLUTIONS),
        (False, "leapfrog", joint_springs.MOST_SOLUTIONS),
        (True, "rk4", joint_springs.MOST_SOLUTIONS),
        (True, "leapfrog", 1),  # the first solution, then joint by joint
        (True, "rk4", 1),
    ],
)
def test_springs_of_joints_equal_the_general_kernel(has_base_hinge, method, most_solutions, new_kernels, monkeypatch):
    monkeypatch.setattr(joint_springs, "MOST_SOLUTIONS", most_solutions)
    plans = plans_of(monkeypatch)
    structure, general = (bone(4, has_base_hinge=has_base_hinge, has_elastic_top=each) for each in (False, True))
    settings = {"device": "cpu", "method": method, "step": 0.0025, "dtype": "float64"}
    found, expected = (wd.simulate(scene_of(each), **settings) for each in (structure, general))
    assert [has_joint_springs(plan) for plan in plans] == [True, False]
    assert found["status"].values.tolist() == expected["status"].values.tolist() == [0, 0, 0]
    yields = found["peak_spring_force"].values > 1.0001 * np.append([NEVER] * 4, found_yield_moments(structure))
    assert yields[-1].sum() >= 3  # hinges yield
    for name in PEAKS:
        # Moments balance to 1e-9 of the largest one of columns in each step.
        assert largest_error(expected, found, name) < 1e-7, name


def test_a_hinge_that_never_yields_does_not_loosen_the_tolerance():
    settings = {"device": "cpu", "step": 0.005}
    found, expected = (
        wd.simulate(scene_of(bone(4, never=1e12, has_elastic_top=each)), **settings) for each in (False, True)
    )
    for name in PEAKS:
        # float32: both kernels balance moments to 5e-5 of the largest one in each step.
        assert largest_error(expected, found, name) < 1e-4, name


@pytest.mark.parametrize(("storeys", "capacity"), [(1, 0.005), (2, 0.02)])
def test_collapse_and_residual_drifts_are_those_of_the_general_kernel(storeys, capacity):
    recorders = {"recorders": ("drift", "spring", "residual"), "tail": 1.0}
    structures = (bone(storeys, drift_capacity=capacity, has_elastic_top=each) for each in (False, True))
    settings = {"device": "cpu", "method": "leapfrog", "step": 0.005, "dtype": "float64"}
    found, expected = (wd.simulate(scene_of(each, **recorders), **settings) for each in structures)
    assert set(expected["status"].values) == {0, 1}  # some collapse
    for name in ("status", "time_of_collapse"):
        np.testing.assert_allclose(found[name].values, expected[name].values, rtol=1e-9, err_msg=name)
    for name in ("residual_deformation", "peak_storey_drift_ratio", "peak_spring_deformation"):
        scale = np.nanmax(np.abs(expected[name].values))
        np.testing.assert_allclose(found[name].values, expected[name].values, rtol=0, atol=1e-7 * scale, err_msg=name)


def test_a_state_without_equilibrium_is_reported(new_kernels, monkeypatch):
    monkeypatch.setattr(joint_springs, "MOST_SOLUTIONS", 1)
    monkeypatch.setattr(joint_springs, "MOST_SWEEPS", 1)
    settings = {"device": "cpu", "method": "leapfrog", "step": 0.0025, "dtype": "float64", "on_unstable": "flag"}
    result = wd.simulate(scene_of(bone(3)), **settings)
    assert result["status"].values[0] == 0  # remains elastic
    assert result["status"].values[-1] == 4  # not_converged


def found_yield_moments(structure: wd.HingedFishbone) -> np.ndarray:
    return np.array([float(spring.parameters["yield_force"]) for spring in structure.springs[len(structure.line) :]])


def test_bits_of_a_sample_do_not_depend_on_its_neighbours():
    scene = scene_of(bone(3))
    first, *others = scene.excitation.motions
    shorter = wd.GroundMotion(first.acceleration[:300], first.step, first.name)  # ends before the others
    scene = replace(scene, excitation=wd.Cloud([shorter, *others]))
    settings = {"device": "cpu", "method": "leapfrog", "step": 0.005}
    together = wd.simulate(scene, **settings)
    for place, each in enumerate(scene.excitation.motions):
        alone = wd.simulate(replace(scene, excitation=wd.Cloud([each])), **settings)
        for name in PEAKS:
            np.testing.assert_array_equal(alone[name].values[0], together[name].values[place], err_msg=name)


def test_moments_of_hinges_are_in_equilibrium_and_on_their_laws():
    """The sum of the moments of beams and base is the sum of storey shears times heights."""
    structure = bone(2, ratio=0.0)
    result = wd.simulate(
        scene_of(structure, recorders=("spring",)),
        device="cpu",
        method="leapfrog",
        step=0.005,
        dtype="float64",
        histories=wd.Histories([2]),
    )
    force = result["spring_force"].isel(history=0)
    for spring in structure.springs[2:-1]:
        moments = force.sel(spring=spring.name).values
        strength = float(spring.parameters["yield_force"])
        # Elastic-perfectly-plastic: the yield moment is reached and never passed.
        assert np.nanmax(np.abs(moments)) == pytest.approx(strength, rel=1e-9)
    # Column shears from the moments of beams and base: the sum of all joint moments equals the sum of shear x height.
    heights = np.array([4.5, 3.6])
    of_hinges = force.isel(spring=slice(2, None)).sel(spring=["C1 start", "B1 start", "B2 start"]).values
    signs = np.array([1.0, -1.0, -1.0])  # beams act on joints with the opposite of the moment of their hinges
    of_shears = force.isel(spring=slice(0, 2)).values @ heights
    largest = np.nanmax(np.abs(of_shears))
    base_and_beams = of_hinges @ signs
    np.testing.assert_allclose(base_and_beams, of_shears, rtol=0, atol=1e-8 * largest)


@pytest.mark.skipif(len(DEVICES) == 1, reason="no GPU")
def test_a_gpu_gives_the_results_of_a_cpu():
    settings = {"method": "leapfrog", "step": 0.0025, "dtype": "float64"}
    expected, found = (wd.simulate(scene_of(bone(6)), device=each, **settings) for each in DEVICES)
    for name in PEAKS:
        np.testing.assert_allclose(found[name].values, expected[name].values, rtol=1e-7, err_msg=name)


@pytest.mark.parametrize(("method", "storeys"), [("rk4", 2), ("rk4", 3), ("leapfrog", 2)])
def test_live_ensembles_have_the_bits_of_simulate(method, storeys):
    motion = wd.GroundMotion(6.0 * np.sin(7.0 * np.arange(0, 1.6, 0.02)), 0.02, "sine")
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="spring")}
    scene = wd.Scene(bone(storeys), motion, scatter, recorders=("spring",))
    how = {"integration": wd.Integration(method=method), "execution": wd.Execution(device="cpu", threads=1)}
    live = wd.Live(scene, 3, **how)
    for packet in wd.packets.from_motion(motion, 7):
        live.push(packet)
    found, expected = live.finish(), wd.simulate(scene, structures=3, **how)
    for name in ("peak_spring_deformation", "peak_spring_force"):
        np.testing.assert_array_equal(found[name].values, expected[name].values, err_msg=name)
