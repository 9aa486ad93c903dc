"""The flag `unreliable` of every run: which samples have it, against the same second run made by hand."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.campaigns.accuracy import reliability
from warpdyn.foundations.core.output_variables import DIVERGED

pytestmark = pytest.mark.meant_as_given("yield_base_shear_coefficient", "yield_drift_ratio")

TIME = np.arange(0, 12, 0.01)
ACCELERATION = 3 * np.random.default_rng(4).normal(size=TIME.size) * np.exp(-(((TIME - 4) / 2) ** 2))
SETTINGS = {"device": "cpu", "longest_step": 0.01}
STRUCTURES = 256
YIELD_FORCE = np.geomspace(1e5, 4e6, STRUCTURES)  # N; the strongest storeys stay linear
YIELD_DRIFT = YIELD_FORCE / (1e5 * (2 * np.pi / 0.3) ** 2)


def scene_of(factor=1.0, excitation=None, law="hysteretic"):
    """Return storeys of 0.3 s and of many strengths: of law "hysteretic" with damage, and a stop on one side."""
    stiffness, sensitive = 1e5 * (2 * np.pi / 0.3) ** 2, {}
    if law == "hysteretic":
        sensitive = {
            "ductility_2": 3.0,
            "force_ratio_2": 1.2,
            "ductility_3": 12.0,
            "force_ratio_3": 0.5,
            "pinching_drift": 0.6,
            "pinching_force": 0.4,
            "damage_by_ductility": 0.02,
            "damage_by_energy": 0.1,
            "devices": ("one_sided_gap",),
            "clearance": 0.01,
            "contact_stiffness": 3 * stiffness,
            "restitution": 0.6,
        }
    else:
        sensitive = {"hardening_ratio": 0.02}
    building = wd.ShearBuilding(
        1e5,
        stiffness,
        3.0,
        law=law,
        yield_force=1e5,
        drift_ratio_capacity=0.02,
        damping="rayleigh",
        damping_ratio=0.03,
        **sensitive,
    )
    motion = wd.GroundMotion(factor * ACCELERATION, 0.01) if excitation is None else excitation
    scatter = {"yield_force": wd.GivenValues(YIELD_FORCE[:, None])}
    if sensitive.get("clearance"):
        scatter["clearance"] = wd.GivenValues(2 * YIELD_DRIFT[:, None])
    return wd.Scene(building, motion, scatter=scatter, recorders=("drift",))


def simulated(scene, **settings):
    """Return a run and its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run = wd.simulate(scene, structures=STRUCTURES, **SETTINGS | settings)
    return run, [str(each.message) for each in caught if "unreliable" in str(each.message)]


def change_by_hand(run, scene, **settings):
    """Return the change of the peak drift in a second run, made by hand."""
    other, _ = simulated(scene, **settings)
    peak, second = (each.peak_storey_drift.values[:, 0].astype(float) for each in (run, other))
    return np.abs(second / peak - 1)


def test_samples_that_change_are_flagged():
    run, messages = simulated(scene_of())
    flags = run.unreliable.values
    change = np.maximum(
        change_by_hand(run, scene_of(1.001), longest_step=0.005), change_by_hand(run, scene_of(), longest_step=0.005)
    )
    # Float32 rounds 1.001 times a motion otherwise than a factor of 1.001: within a tenth of the bound either way.
    stands = run.status.values == 0
    assert (flags[stands & (change > 0.011)] == 1).all()
    assert (flags[stands & (change < 0.009)] == 0).all()
    assert 10 < np.count_nonzero(flags == 1) < STRUCTURES / 4
    assert f"{np.count_nonzero(flags == 1)} of {STRUCTURES} samples are `unreliable`" in messages[0]
    # A run that keeps no samples warns of the same number.
    _, of_statistics = simulated(scene_of(), statistics=wd.DemandMoments("peak_storey_drift_ratio"))
    assert of_statistics == messages


def test_only_a_share_of_a_large_run_is_checked(monkeypatch):
    everything, _ = simulated(scene_of())
    monkeypatch.setattr(reliability, "CHECKED_STEPS", 1.0)
    run, messages = simulated(scene_of())
    is_checked = run.unreliable.values >= 0
    peak = run.peak_storey_drift.values[:, 0]
    is_linear = peak < 0.3 * YIELD_DRIFT
    assert is_linear.any()
    assert is_checked[is_linear].all()  # they need no check
    sensitive = np.count_nonzero(~is_linear)
    # A sixteenth of them; multiples of the golden ratio are spread more evenly than random numbers would be.
    assert abs(np.count_nonzero(is_checked & ~is_linear) - sensitive / 16) < 3 * np.sqrt(sensitive / 16)
    assert np.array_equal(run.unreliable.values[is_checked], everything.unreliable.values[is_checked])
    assert f"{np.count_nonzero(~is_checked)} were not checked" in messages[0]
    # Blocks and threads change none of it.
    divided, _ = simulated(scene_of(), memory=2**26 + 2**16)  # four of them
    assert np.array_equal(run.unreliable.values, divided.unreliable.values)


def test_no_sample_counts_as_linear_if_its_first_peaks_are_not_recorded(monkeypatch):
    monkeypatch.setattr(reliability, "CHECKED_STEPS", 1.0)
    late = replace(scene_of(), record_from=10.0)  # the motion has nearly ended
    run, _ = simulated(late)
    stands = run.status.values < DIVERGED
    assert (run.peak_storey_drift.values[stands, 0] < 0.3 * YIELD_DRIFT[stands]).any()
    is_checked = run.unreliable.values[stands] >= 0
    assert abs(np.count_nonzero(is_checked) - stands.sum() / 16) < 3 * np.sqrt(stands.sum() / 16)


def test_a_structure_that_is_not_sensitive_is_not_run_again(monkeypatch):
    monkeypatch.setattr(reliability, "_run_again", None)
    run, messages = simulated(scene_of(law="bilinear"))
    ended = run.status.values < DIVERGED
    assert (run.unreliable.values[ended] == 0).all()
    assert (run.unreliable.values[~ended] == -1).all()
    assert not messages


def test_the_estimate_of_every_sample_sets_the_flag():
    run, _ = simulated(scene_of(), sample_error=0.02)
    is_off = (run.estimated_relative_error_of_sample.values > 0.02) | (run.sensitive.values == 1)
    assert is_off.any()
    assert np.array_equal(run.unreliable.values == 1, is_off)


def test_each_event_of_a_sequence_has_its_flags():
    first, second = (wd.Cloud([wd.GroundMotion(factor * ACCELERATION, 0.01)]) for factor in (1.0, 0.5))
    sequence = wd.EventSequence({"first": first, "second": second})
    run, _ = simulated(scene_of(excitation=sequence))
    alone, _ = simulated(scene_of())
    assert run.unreliable.dims == ("sample", "event")
    flags = run.unreliable.values
    assert np.array_equal(flags[:, 0] == 1, alone.unreliable.values == 1)
    has_collapsed = run.status.values[:, 0] > 0
    assert has_collapsed.any()
    assert (flags[has_collapsed, 1] == -1).all()  # the second event is not run
    # It begins from the final state of the first one, also of a sample that is linear in it.
    begins_unreliable = (flags[:, 0] == 1) & (run.status.values[:, 1] < DIVERGED) & ~has_collapsed
    assert begins_unreliable.any()
    assert (flags[begins_unreliable, 1] == 1).all()
