"""Errors told with the answer: the estimate against the truth, and the plan that keeps a target."""

import numpy as np
import pytest
from matrices import chain_matrix
from method_sources import thorough_unless

import warpdyn as wd
from warpdyn.campaigns.accuracy import pilot
from warpdyn.engine.methods.stability_limits import stability_limit
from warpdyn.engine.methods.table import METHODS
from warpdyn.truth import bilinear_chain_response

pytestmark = pytest.mark.meant_as_given("no_damping")

MASS, STIFFNESS, YIELD_FORCE = np.full(2, 1e5), np.array([6e7, 5e7]), np.array([2e5, 1.4e5])
DAMPERS, STEP = 2e5, 0.02
WAVES = [
    3 * np.exp(-(((np.arange(250) * STEP - 2) / 1.2) ** 2)) * np.random.default_rng(i).normal(size=250)
    for i in range(8)
]
MOTIONS = [wd.GroundMotion(wave, STEP, f"wave {i}") for i, wave in enumerate(WAVES)]
FACTORS = np.linspace(0.7, 1.3, 5)
# Methods that a plan tries by default, and three of them, one of each kind, which need fewer kernels.
ALL, FEW = pilot.CANDIDATES, ("rk4", "stoermer", "newmark_average")


def scene(law="bilinear", recorders=("drift", "residual"), **settings):
    yields = {"yield_force": YIELD_FORCE, "hardening_ratio": 0.05} if law != "elastic" else {}
    building = wd.ShearBuilding(
        MASS, STIFFNESS, 3.0, law=law, damping="storey", damping_coefficient=DAMPERS, **yields, **settings
    )
    scatter = {"stiffness": wd.GivenValues(FACTORS[:, None] * STIFFNESS)}
    return wd.Scene(building, wd.Cloud(MOTIONS), scatter=scatter, recorders=recorders, tail=0.6)


@pytest.fixture(scope="module")
def true_peaks():
    """Peak storey drifts [m] of every sample, event by event, between steps too, shape [sample, storey]."""
    dampers = DAMPERS * chain_matrix(np.ones(2))
    # As the engine sees them: with 0.6 s of free vibration after the motion.
    waves = [np.concatenate([wave, np.zeros(31)]) for wave in WAVES]
    return np.array(
        [
            bilinear_chain_response(
                MASS, factor * STIFFNESS, YIELD_FORCE, 0.05, dampers, -wave[:, None] * MASS, STEP
            ).peak_storey_drift
            for factor in FACTORS
            for wave in waves
        ]
    )


def quantiles(peaks, truth):
    errors = np.abs(peaks - truth).max(axis=1) / truth.max(axis=1)
    return np.quantile(errors, [0.5, 0.95])


@pytest.mark.parametrize("step", [0.02, 0.005])
def test_the_estimate_tells_the_true_error(true_peaks, step):
    run = wd.simulate(scene(), structures=5, step=step, checked_share=1.0, device="cpu")
    told = run["estimated_relative_error"].sel(demand="peak_storey_drift", error_statistic=["median", "95 %"]).values
    true = quantiles(run["peak_storey_drift"].values, true_peaks)
    # Half the step leaves a quarter of an error of order 2, by which the estimate falls short; half is promised.
    assert np.all((told > true / 2) & (told < true * 2)), (told, true)
    assert true[1] > 1e-4  # far above float32's rounding: there is an error to tell


def test_the_estimate_is_of_a_share_of_the_samples_and_of_every_demand():
    run = wd.simulate(scene(recorders=None), structures=5, checked_share=0.01, device="cpu")
    told = run["estimated_relative_error"]
    demands = {
        "peak_storey_drift",
        "peak_floor_acceleration",
        "peak_base_shear",
        "residual_drift_ratio",
        "input_energy",
        "viscous_energy",
        "hysteretic_energy",
    }
    assert set(told["demand"].values) == demands
    assert told["error_statistic"].values.tolist() == ["median", "95 %", "worst"]
    assert np.all(np.isfinite(told))
    assert np.all(told >= 0)
    assert np.all(np.diff(told.values, axis=1) >= 0)
    assert "of 30 samples" in told.attrs["comment"]  # 1 % of 40 would be one
    again = wd.simulate(scene(recorders=None), structures=5, checked_share=0.01, device="cpu")
    assert np.array_equal(told, again["estimated_relative_error"])  # the seed chooses them
    text = wd.summary(run)
    assert "peak_storey_drift" in text
    assert "40 samples" in text
    for share in (0.0, 1.5, -1, "all"):
        with pytest.raises((ValueError, TypeError), match="check"):
            wd.simulate(scene(), structures=5, checked_share=share)


@pytest.mark.parametrize(("target", "candidates"), [(1e-2, FEW), (1e-3, FEW), thorough_unless(False, 1e-2, ALL)])
def test_the_plan_keeps_its_target(true_peaks, target, candidates, monkeypatch):
    monkeypatch.setattr(pilot, "CANDIDATES", candidates)
    choice = wd.plan(scene(), target, device="cpu")
    run = wd.simulate(
        scene(),
        structures=5,
        method=choice.method,
        dtype=choice.dtype,
        longest_step=choice.longest_step,
        device="cpu",
    )
    assert quantiles(run["peak_storey_drift"].values, true_peaks)[1] < target
    table = choice.table
    row = table.isel(candidate=int(np.argmin(table["seconds_per_sample"].values)))
    assert row["method"].item() == choice.method
    assert np.all(table["error"] <= target)


@pytest.mark.parametrize("target", [1e-2, 1e-3])
def test_a_plan_of_stoermer_keeps_its_target(true_peaks, target):
    choice = wd.plan(scene(), target, method="stoermer", device="cpu")
    found = wd.simulate(scene(), structures=5, method="stoermer", longest_step=choice.longest_step, device="cpu")
    assert quantiles(found["peak_storey_drift"].values, true_peaks)[1] < target
    assert choice.longest_step > 0.002  # a shorter step would be safe, but no plan


def test_a_plan_tries_stoermer_if_it_fits(monkeypatch):
    monkeypatch.setattr(pilot, "CANDIDATES", FEW)
    tried = wd.plan(scene(), device="cpu").table["method"].values
    assert set(tried) == set(FEW)
    matrices = np.diag(MASS), DAMPERS * chain_matrix(np.ones(2)), chain_matrix(STIFFNESS)
    system = wd.Scene(wd.LinearSystem(*matrices), wd.Cloud(MOTIONS), recorders=("displacement",), tail=0.6)
    assert set(wd.plan(system, device="cpu").table["method"].values) == {"rk4", "newmark_average"}


def test_a_plan_keeps_stoermer_stable():
    # An error of 5 % allows steps of 10 ms. The second mode, with 58 % of damping, allows 2.2 ms.
    damped = wd.ShearBuilding(MASS, [6e7, 2e9], 3.0, damping="stiffness_proportional", damping_ratio=0.05)
    stiff = wd.Scene(damped, wd.Cloud(MOTIONS), recorders=("drift",), tail=0.6)
    choice = wd.plan(stiff, 0.05, method="stoermer", device="cpu")
    found, true = (
        wd.simulate(stiff, structures=1, device="cpu", **settings)
        for settings in (
            {"method": "stoermer", "longest_step": choice.longest_step},
            {"method": "rk4", "longest_step": 1e-4, "dtype": "float64"},
        )
    )
    stiffness = chain_matrix(np.array([6e7, 2e9]))
    frequencies = np.sqrt(np.linalg.eigvals(stiffness / MASS[:, np.newaxis]).real)
    highest = 0.05 * frequencies.max() / frequencies.min()  # damping ratio of the second mode
    limit = stability_limit(METHODS["stoermer"], highest) / frequencies.max()
    assert choice.longest_step > 5 * limit
    assert 0.7 * limit < found["integration_step"].max() <= limit  # the largest divisor of the step below the limit
    assert quantiles(found["peak_storey_drift"].values, true["peak_storey_drift"].values)[1] < 0.05


def test_simulate_takes_what_the_plan_chooses(true_peaks, monkeypatch):
    monkeypatch.setattr(pilot, "CANDIDATES", FEW)
    run = wd.simulate(scene(), structures=5, target_error=1e-3, device="cpu")
    assert quantiles(run["peak_storey_drift"].values, true_peaks)[1] < 1e-3
    fixed = wd.simulate(scene(), structures=5, target_error=1e-3, method="heun", dtype="float64", device="cpu")
    assert (fixed.attrs["method"], fixed.attrs["dtype"]) == ("heun", "float64")
    assert quantiles(fixed["peak_storey_drift"].values, true_peaks)[1] < 1e-3
    assert fixed["integration_step"].max() < 0.02
    with pytest.raises(ValueError, match="error chooses the step"):
        wd.simulate(scene(), structures=5, target_error=1e-3, step=0.01)
    with pytest.raises(ValueError, match="no method keeps"):
        wd.plan(scene(), 1e-6, method="newmark_average", dtype="float32", device="cpu")
    with pytest.raises(ValueError, match="'exact' does not fit storeys of law 'bilinear'"):
        wd.plan(scene(), method="exact")
    with pytest.raises(TypeError, match="plan\\(\\) takes a Scene"):
        wd.plan("scene")
    motion = wd.GroundMotion([0.0, 1.0, 0.0], 0.02)
    city = wd.Portfolio({"house": wd.Archetype(wd.ShearBuilding(1.0, 100.0, 3.0), 2)})
    with pytest.raises(ValueError, match="needs a scene of one structure, got a Portfolio"):
        wd.plan(wd.Scene(city, wd.OneMotionPerStructure([motion])))


def test_a_plan_takes_as_many_structures_as_motions_are_given_for():
    building = wd.ShearBuilding(1.0, 100.0, 3.0)
    motion = wd.GroundMotion(np.sin(np.arange(50) / 5), 0.02)
    one = wd.Scene(building, wd.OneMotionPerStructure([motion], motion=[0]), tail=0.0, recorders=("drift",))
    choice = wd.plan(one, method="rk4", dtype="float64", device="cpu")
    assert choice.table.attrs["pilot_samples"] == 1


def carried(the_scene):
    return wd.plan(the_scene, 0.02, method="rk4", dtype="float32", device="cpu").carried


def test_a_scene_that_names_less_carries_less():
    values = [f"{part} per sample [values]" for part in ("state", "structure", "method", "recorders")]
    bouc_wen = carried(scene("bouc_wen", recorders=None))
    elastic = carried(scene("elastic", recorders=None))
    fewer = carried(scene("elastic", recorders=("drift",)))
    # Displacement, velocity and z of two storeys; a stiffness in place of three coefficients a storey.
    assert [bouc_wen[name] for name in values[:2]] == [6, 2 * (1 + 3) + 2]
    assert [elastic[name] for name in values[:2]] == [4, 2 * (1 + 1) + 2]
    assert fewer[values[3]] < elastic[values[3]] == bouc_wen[values[3]]
    for less, more in ((elastic, bouc_wen), (fewer, elastic)):
        for name in ("registers per sample, if all values are held [32 bits]", "bytes read and written per sample"):
            assert less[name] < more[name], name
    one_storey = wd.Scene(wd.ShearBuilding(1e5, [6e7], 3.0), wd.Cloud(MOTIONS), recorders=("drift",), tail=0.6)
    assert (
        carried(one_storey)["registers per sample, if all values are held [32 bits]"]
        < fewer["registers per sample, if all values are held [32 bits]"]
    )
    free = wd.Scene(wd.ShearBuilding(1e5, [6e7], 3.0), wd.FreeVibration(5.0, velocity=0.1), recorders=("drift",))
    assert (
        carried(free)["bytes read and written per sample"]
        < 200
        < carried(one_storey)["bytes read and written per sample"]
    )
    assert bouc_wen["samples"] == 40  # five structures under eight motions
