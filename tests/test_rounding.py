"""Storeys for which the rounding of float32 decides when they turn back, against float64."""

from dataclasses import replace

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.campaigns.accuracy import precision
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.foundations.core.output_variables import NOT_CONVERGED

STRUCTURES, STOREYS, PERIOD = 48, 3, 0.03


def stiff_deteriorating_scene():
    """Return three storeys that move by thousands of yield drifts, with viscous dampers."""
    random = np.random.default_rng(3)

    def drawn(low, high):
        return np.exp(random.uniform(np.log(low), np.log(high), (STRUCTURES, 1))) * np.ones((1, STOREYS))

    mass = 1e5
    stiffness = mass * (2 * np.pi / PERIOD) ** 2 / (2 * np.sin(np.pi / (4 * STOREYS + 2))) ** 2
    yield_force = drawn(0.02, 0.1) * STOREYS * mass * 9.81 * np.array([1.0, 1.0, 0.8])
    plastic = yield_force / stiffness * drawn(0.5, 100)
    listed = {
        "yield_force": yield_force,
        "plastic_drift_to_capping": plastic,
        "post_capping_drift": plastic * drawn(1, 20),
        "residual_force_ratio": drawn(0.01, 0.4),
        "damper_coefficient": 0.1 * stiffness * PERIOD / (2 * np.pi) * drawn(0.05, 2),
    }
    for of in ("strength", "post_capping", "unloading"):
        listed[f"{of}_deterioration_drift"] = plastic * drawn(5, 100)
    building = wd.ShearBuilding(
        np.full(STOREYS, mass),
        stiffness,
        3.0,
        law="ibarra_medina_krawinkler_bilinear",
        devices=("viscous_damper",),
        velocity_exponent=1.0,
        capping_force_ratio=1.1,
        **{name: values[0] for name, values in listed.items()},
    )
    time = np.arange(0, 8, 0.01)
    motion = wd.GroundMotion(3 * random.normal(size=time.size) * np.exp(-(((time - 4) / 2) ** 2)), 0.01)
    scatter = {name: wd.GivenValues(values) for name, values in listed.items()}
    return wd.Scene(building, motion, scatter=scatter, recorders=("drift",))


@pytest.mark.as_shipped
@pytest.mark.meant_as_given("first_period_over_height", "yield_drift_ratio", "plastic_drift_ratio")
def test_what_float32_cannot_tell_runs_in_float64():
    # At a four hundredth of the period, storeys that had lost all strength in float32 alone were up to 13 % off.
    scene = stiff_deteriorating_scene()
    settings = {"structures": STRUCTURES, "longest_step": PERIOD / 400, "device": "cpu"}
    with pytest.warns(UserWarning, match="they were run again in float64"):
        found = wd.simulate(scene, **settings)
    exact = wd.simulate(scene, dtype="float64", **settings)
    largest = exact.peak_storey_drift.max("storey")
    error = (np.abs(found.peak_storey_drift - exact.peak_storey_drift).max("storey") / largest).values
    yield_drift = (scene.scatter["yield_force"].values / scene.structure.parameters["stiffness"]).min(axis=1)
    far = exact.peak_storey_drift.sum("storey").values / yield_drift
    assert np.count_nonzero(far > 1000) > STRUCTURES / 2  # of so many yield drifts
    assert error[far > 310].max() < 1e-6  # they come out of the same kernel, and are rounded once
    assert np.quantile(error, 0.99) < 1e-3


@pytest.mark.as_shipped
@pytest.mark.meant_as_given("first_period_over_height", "yield_drift_ratio", "plastic_drift_ratio")
def test_damage_before_the_recorded_peaks_counts(monkeypatch):
    # Peaks from 6 s on may not show that storeys moved by thousands of yield drifts before: whatever they are, samples
    # are run again.
    monkeypatch.setattr(precision, "MOST_YIELD_DRIFTS", np.inf)
    scene = replace(stiff_deteriorating_scene(), record_from=6.0)
    settings = {"structures": STRUCTURES, "longest_step": PERIOD / 400, "device": "cpu"}
    with pytest.warns(UserWarning, match="they were run again in float64"):
        found = wd.simulate(scene, **settings)
    exact = wd.simulate(scene, dtype="float64", **settings)
    # They come out of the same kernel, and are rounded once.
    np.testing.assert_allclose(found.peak_storey_drift, exact.peak_storey_drift, rtol=1e-6)


@pytest.mark.meant_as_given("no_damping")
def test_a_law_that_counts_reversals_needs_no_yield_force(monkeypatch):
    # An elastic building stands for a user's law: all of its samples are run again.
    monkeypatch.setattr(precision, "may_need_float64", lambda model: model.plan.dtype == "float32")
    motion = wd.GroundMotion(np.sin(np.arange(0, 4, 0.01)), 0.01)
    scene = wd.Scene(wd.ShearBuilding(1e5, 4e7, 3.0), motion, recorders=("drift",))
    with pytest.warns(UserWarning, match="1 of 1 samples have displacements too large for float32"):
        found = wd.simulate(scene, method="rk4", device="cpu")
    exact = wd.simulate(scene, method="rk4", device="cpu", dtype="float64")
    # One kernel gives both, and its results are rounded once to float32.
    np.testing.assert_allclose(found.peak_storey_drift, exact.peak_storey_drift, rtol=2.0**-23)


def isolated_scene(**damage):
    """Return two hysteretic storeys with stops on one side, on lead-rubber isolators that move by some 0.4 m."""
    building = wd.ShearBuilding(
        1e5,
        [2.6e9, 1e9],
        3.0,
        law="hysteretic",
        yield_force=[6.3e5, 4e5],
        ductility_2=3.64,
        force_ratio_2=1.28,
        ductility_3=16.3,
        force_ratio_3=0.84,
        pinching_drift=0.75,
        pinching_force=0.64,
        unloading_exponent=0.29,
        damping="rayleigh",
        damping_ratio=0.028,
        devices=("one_sided_gap",),
        clearance=0.001,
        contact_stiffness=[5.4e10, 2.1e10],
        restitution=0.64,
        **damage,
    )
    bearings = {"stiffness": 7.2e7, "yield_force": 1.33e5, "post_yield_stiffness": 3.6e6}
    isolated = building.on_isolators("lead_rubber_bearing", 1e5, 2.0, **bearings)
    records = [wd.records.far_field()[number] for number in (12, 30)]
    motions = [wd.GroundMotion(each.acceleration[: int(20 / each.step)], each.step, each.name) for each in records]
    return wd.Scene(isolated, wd.Stripes(motions, [1.0], wd.SpectralAcceleration(1.0)), recorders=("drift",))


@pytest.mark.as_shipped
@pytest.mark.meant_as_given("yield_base_shear_coefficient", "yield_drift_ratio", "first_period_over_height")
def test_isolated_storeys_with_damage_run_in_float64():
    # In float32, storeys on isolators were up to 200 % wrong: their drifts are differences of places 0.4 m away, each
    # rounded to 3e-8 m, and each reversal that rounding makes pushes the drift that they aim at farther away.
    scene = isolated_scene(damage_by_ductility=0.0044, damage_by_energy=0.095)
    settings = {"method": "rk4", "longest_step": 2e-4, "device": "cpu"}
    with pytest.warns(UserWarning, match="they were run again in float64"):
        found = wd.simulate(scene, **settings)
    exact = wd.simulate(scene, dtype="float64", **settings)
    # One kernel gives both, and its results are rounded once to float32.
    np.testing.assert_allclose(found.peak_storey_drift, exact.peak_storey_drift, rtol=2.0**-23)


@pytest.mark.meant_as_given("first_period_over_height", "yield_drift_ratio", "plastic_drift_ratio")
def test_what_fails_in_float64_has_failed_whatever_is_recorded(monkeypatch):
    scene = replace(stiff_deteriorating_scene(), recorders=("acceleration",))
    original = Ensemble.integrate
    again = []

    def fail(self, chosen):
        if self.plan.dtype == "float32":
            return original(self, chosen)
        again.extend(chosen)
        outputs = {name: values.T for name, values in self.model.blank_outputs(chosen.size).items()}
        outputs["status"][:] = NOT_CONVERGED
        return outputs

    monkeypatch.setattr(Ensemble, "integrate", fail)
    with pytest.warns(UserWarning, match="have displacements too large for float32|flagged not_converged") as caught:
        failed = wd.simulate(scene, structures=STRUCTURES, longest_step=PERIOD / 100, device="cpu")
    assert len(caught) == 2
    assert len(again) > STRUCTURES / 2  # that many move by more than 1,000 yield drifts, as above
    assert "peak_storey_drift" not in failed
    assert np.flatnonzero(failed.status == NOT_CONVERGED).tolist() == sorted(again)
    assert np.isnan(failed.peak_floor_acceleration.values[again]).all()
