"""Live ensembles: the bits of `simulate` for every division into packets, also after saving, killing and loading."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import time
import weakref
from itertools import pairwise

import netCDF4
import numpy as np
import pytest
import xarray as xr
from scipy.signal import lsim

import warpdyn as wd

STEP = 0.01
TIME = STEP * np.arange(400)
MOTION = wd.GroundMotion(
    6.0 * np.sin(8.0 * TIME) * np.exp(-0.3 * TIME) + np.random.default_rng(1).normal(size=TIME.size), STEP, "station"
)
LIMITS = {"slight": 0.01, "moderate": 0.03}
HOW = {"integration": wd.Integration(method="rk4", step=STEP), "execution": wd.Execution(device="cpu", threads=1)}


def scene(motion: wd.GroundMotion = MOTION, yield_force: float = 1.5e5, **changes: object) -> wd.Scene:
    building = wd.ShearBuilding(
        np.full(2, 1e5), 3e7, 3.0, law="bilinear", yield_force=yield_force, hardening_ratio=0.05, **DAMPED
    )
    scatter = {name: wd.RandomFactor(wd.Lognormal(1.0, 0.3)) for name in ("stiffness", "yield_force")}
    given = {"scatter": scatter, "recorders": ("drift",), "collapse_drift_ratio": 0.07} | changes
    return wd.Scene(building, motion, **given)


DAMPED = {"damping": "stiffness_proportional", "damping_ratio": 0.05}


def live(**changes: object) -> wd.Live:
    return wd.Live(scene(), 20, **{"limits": LIMITS} | HOW | changes)


def same(run: xr.Dataset, other: xr.Dataset) -> bool:
    return all(run[name].equals(other[name]) for name in {*run.variables, *other.variables})


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    return wd.simulate(scene(), structures=20, **HOW)


def pieces(random: np.random.Generator, motion: wd.GroundMotion = MOTION):
    cuts = np.unique([0, *random.integers(1, motion.values.size, random.integers(1, 12)), motion.values.size])
    return [(int(a), motion.acceleration[a:b]) for a, b in pairwise(cuts)]


@pytest.mark.parametrize("seed", range(8))
def test_every_division_into_packets_gives_the_bits_of_simulate(run, seed):
    ensemble = live()
    for first, values in pieces(np.random.default_rng(seed)):
        ensemble.push(values, start=first * STEP)
    assert same(ensemble.finish(), run)
    with pytest.raises(ValueError, match="is finished: make a new Live"):
        ensemble.push([0.1])


def test_samples_collapse_and_others_do_not(run):
    assert set(run["status"].values) == {0, 1}


def test_the_answer_is_that_of_simulate_for_the_record_so_far():
    ensemble = live()
    for first, values in pieces(np.random.default_rng(11)):
        answer = ensemble.push(values, start=first * STEP)
        end = first + len(values)
        if end < 2:
            continue
        record = wd.GroundMotion(MOTION.acceleration[:end], STEP)
        due = wd.simulate(scene(record, tail=0.0), structures=20, **HOW)
        for name in ("peak_storey_drift", "peak_storey_drift_ratio", "status", "time_of_collapse"):
            assert answer[name].values.tobytes() == due[name].values.tobytes()
        assert float(answer["time"]) == pytest.approx((end - 1) * STEP)
        worst = due["peak_storey_drift_ratio"].max("storey").values
        state = np.where(due["status"] == 1, 2, (worst > 0.01).astype(int) + (worst > 0.03))
        np.testing.assert_allclose(answer["damage_probability"], np.bincount(state, minlength=3) / 20)
        quantiles = np.quantile(due["peak_storey_drift_ratio"].values.astype(float), [0.16, 0.5, 0.84], axis=0)
        np.testing.assert_allclose(answer["peak_storey_drift_ratio_quantile"], quantiles)


def test_answers_without_samples_have_the_same_statistics(run):
    whole, light = live(), live(keep_samples=False)
    for first, values in pieces(np.random.default_rng(12)):
        due, answer = (each.push(values, start=first * STEP) for each in (whole, light))
        assert set(due.data_vars) - set(answer.data_vars) == {
            name for name in due.data_vars if "sample" in due[name].dims
        }
        assert set(answer.data_vars) - set(due.data_vars) == {"failed_count", "collapsed_count"}
        for name in ("peak_storey_drift_quantile", "peak_storey_drift_ratio_quantile", "damage_probability", "time"):
            assert answer[name].identical(due[name])
        assert answer["failed_count"].sel(failure="diverged") == 0
        assert answer["collapsed_count"] == (due["status"] == 1).sum()
        assert answer.attrs["packets"] == due.attrs["packets"]
    assert answer["collapsed_count"] > 0
    assert same(light.finish(), run)
    with pytest.raises(TypeError, match="keep_samples must be True or False, got 'no'"):
        live(keep_samples="no")


def test_answers_without_quantiles_have_the_damage_states():
    due, answer = (each.push(MOTION.acceleration) for each in (live(), live(quantiles=[])))
    assert answer.sizes["quantile"] == 0
    assert answer["peak_storey_drift_quantile"].shape == (0, 2)
    assert answer["damage_probability"].equals(due["damage_probability"])


def test_an_answer_keeps_its_values():
    ensemble = live(keep_samples=False)
    first = ensemble.push(MOTION.acceleration[:100])
    kept = first.copy(deep=True)
    ensemble.push(MOTION.acceleration[100:])
    assert first.identical(kept)


@pytest.mark.meant_as_given("yield_drift_ratio", "yield_base_shear_coefficient")
def test_an_elastic_building_has_the_drifts_of_scipy():
    """SciPy's `lsim` is exact for a motion that is linear between its samples; RK4 with 0.01 s errs by 1e-4."""
    ensemble = wd.Live(scene(yield_force=1e12, scatter={}, collapse_drift_ratio=0.5), 1, **HOW)
    mass, stiffness = 1e5, 3e7 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    omega = np.sqrt(3e7 / mass) * 2 * np.sin(np.pi / 10)
    damping = 2 * 0.05 / omega * stiffness
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [-stiffness / mass, -damping / mass]])
    load = np.concatenate([np.zeros(2), -np.ones(2)])[:, None]
    drifts = np.array([[1.0, 0, 0, 0], [-1.0, 1.0, 0, 0]])
    _, found, _ = lsim((system, load, drifts, np.zeros((2, 1))), MOTION.acceleration, TIME)
    for first, values in pieces(np.random.default_rng(5)):
        answer = ensemble.push(values)
        peak = np.abs(found[: first + len(values)]).max(axis=0)
        np.testing.assert_allclose(answer["peak_storey_drift"][0], peak, rtol=1e-3, atol=1e-7)


REFUSED = {
    "NaN": (np.array([0.1, np.nan]), 1.0),
    "wrong step": (wd.packets.Packet([0.1, 0.2], 1.0, 0.02), None),
    "time going back": (np.array([0.1, 0.2]), 0.5),
    "implausible unit": (np.array([300.0]), 1.0),
    "between samples": (np.array([0.1]), 1.004),
    "two components": (np.zeros((3, 2)), 1.0),
}


def test_refused_packets_change_nothing(run):
    ensemble = live()
    ensemble.push(MOTION.acceleration[:100], start=0.0)
    before = {name: array.numpy().copy() for name, array in ensemble.paused.groups[0].state.items()}
    for packet, start in REFUSED.values():
        with pytest.raises(wd.packets.RefusedPacket):
            ensemble.push(packet, start)
    for name, array in ensemble.paused.groups[0].state.items():
        np.testing.assert_array_equal(array.numpy(), before[name])
    answers = list(ensemble.follow([wd.packets.Packet(MOTION.acceleration[100:], 1.0)]))
    assert answers[-1].attrs["refused_packets"] == len(REFUSED)
    assert same(ensemble.finish(), run)


def test_a_packet_has_its_own_start():
    ensemble = wd.Live(scene(), 2, **HOW)
    for other in ({"start": 9.0}, {"step": STEP}, {"component": 0}):
        with pytest.raises(ValueError, match="a Packet has its own start, step and component"):
            ensemble.push(wd.packets.Packet(MOTION.acceleration[:9], 0.0), **other)


def test_follow_warns_of_refused_packets_and_goes_on(run):
    ensemble = live()
    packets = list(wd.packets.from_motion(MOTION, 100, start=7.0))
    packets.insert(2, wd.packets.Packet([np.nan], 9.0))
    with pytest.warns(UserWarning, match="is nan"):
        assert len(list(ensemble.follow(packets, on_refused="warn"))) == 4
    assert same(ensemble.finish(), run)
    with pytest.raises(TypeError, match=r"got NoneType: give, for example, wd.packets.from_socket\(host, port\)"):
        next(live().follow(None))


def test_a_gap_is_bridged_on_request():
    ensemble = live(patience=0.1)
    ensemble.push(MOTION.acceleration[:100], start=0.0)
    ensemble.push(MOTION.acceleration[150:155], start=1.5)
    with pytest.raises(wd.packets.RefusedPacket, match=r"0\.5 s of the motion are missing"):
        ensemble.push(MOTION.acceleration[155:180], start=1.55)
    assert ensemble.bridge().attrs["interpolated_samples"] == 50
    ensemble.push(MOTION.acceleration[155:], start=1.55)
    due = wd.GroundMotion(ensemble.record[:, 0], STEP, "station")
    line = np.interp(np.arange(100, 150), [99, 150], MOTION.acceleration[[99, 150]])
    np.testing.assert_allclose(due.acceleration[100:150], line, rtol=1e-12)
    assert same(ensemble.finish(), wd.simulate(scene(due), structures=20, **HOW))


def test_samples_that_depend_on_the_length_of_the_motion_are_integrated_again(run):
    """The default steps depend on the duration of the motion; here the expected one is much shorter."""
    how = HOW | {"integration": wd.Integration(method="rk4")}
    short = wd.GroundMotion(np.zeros(2), STEP, "station")
    ensemble = wd.Live(scene(short), 20, **how)
    ensemble.push(MOTION.acceleration)
    assert same(ensemble.finish(), wd.simulate(scene(), structures=20, **how))


SCRIPT = """
import sys, time
sys.path.insert(0, sys.argv[1])
from conftest import quick_kernels
from test_live import MOTION, STEP, live, wd
with quick_kernels():
    ensemble = live()
    for first in range(0, 400, 10):
        ensemble.push(MOTION.acceleration[first : first + 10], start=first * STEP)
        wd.save_state(ensemble, sys.argv[2])
        print(first, flush=True)
        time.sleep(0.05)
"""


def test_save_kill_load_and_continue(run, tmp_path):
    path = tmp_path / "state.nc"
    command = [sys.executable, "-c", SCRIPT, os.path.dirname(__file__), str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        while int(process.stdout.readline()) < 120:
            pass
        process.send_signal(signal.SIGKILL)
    ensemble = wd.load_state(live(), path)
    at = len(ensemble.record)
    assert 120 < at < 400
    ensemble.push(MOTION.acceleration[at - 5 :], start=(at - 5) * STEP)  # the server repeats the last packet
    assert same(ensemble.finish(), run)


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (lambda: live(seed=1), "another Live"),
        (lambda: live(patience=3.0), "another Live"),
        (lambda: wd.Live(scene(tail=1.0), 20, limits=LIMITS, **HOW), "another scene"),
        (lambda: wd.Live(scene(wd.GroundMotion(np.zeros(9), STEP)), 20, **HOW), "another scene"),
    ],
)
def test_a_state_of_another_ensemble_is_refused(tmp_path, other, message):
    path = wd.save_state(live(), tmp_path / "state.nc")
    with pytest.raises(ValueError, match=message):
        wd.load_state(other(), path)


def test_a_state_of_another_processor_or_kernel_is_refused(tmp_path, monkeypatch):
    from warpdyn.campaigns.live import saved_state

    path = wd.save_state(live(), tmp_path / "state.nc")
    monkeypatch.setattr(saved_state, "machines_of", lambda execution: ["another GPU"])
    with pytest.raises(ValueError, match="another kind of processor"):
        wd.load_state(live(), path)
    with pytest.raises(ValueError, match="does not contain the state of a Live"):
        wd.load_state(live(), wd.write(xr.Dataset(), tmp_path / "other.nc"))
    (tmp_path / "text.nc").write_text("no state")
    with pytest.raises(ValueError, match=r"text.nc is not a netCDF file .*wd\.save_state"):
        wd.load_state(live(), tmp_path / "text.nc")
    monkeypatch.undo()
    used = live()
    used.push(MOTION.acceleration[:2])
    with pytest.raises(ValueError, match="has already received packets, which would be lost: give a new Live"):
        wd.load_state(used, path)
    assert used.time == STEP
    assert used.finish().attrs["seconds_integrating"] > used._seconds_integrating > 0


def test_states_can_be_copied_exchanged_and_resampled(run):
    ensemble = live()
    ensemble.push(MOTION.acceleration[:200])
    states = ensemble.paused.states()
    assert states["u"].shape == (20, 2)
    other = live()
    other.push(np.concatenate([MOTION.acceleration[:199], MOTION.acceleration[199:200]]))
    order = np.random.default_rng(3).permutation(20)
    other.paused.resample(order)
    np.testing.assert_array_equal(other.paused.states()["z"], states["z"][order])
    drawn = {name: values[order] for name, values in ensemble.paused.ensemble.drawn.items()}
    np.testing.assert_array_equal(other.paused.ensemble.drawn["stiffness"], drawn["stiffness"])
    first, answer = (each.push(MOTION.acceleration[200:]) for each in (ensemble, other))
    for name in ("peak_storey_drift", "status"):
        np.testing.assert_array_equal(answer[name], first[name][order])
    ensemble.paused.set_states(states)
    with pytest.raises(ValueError, match=r"must be finite values of shape \[20, 2\]"):
        ensemble.paused.set_states(states | {"u": np.full((20, 2), np.nan)})


def test_memory_stays_constant():
    """Every packet makes some hundred objects, and leaves none; pandas clears its list of references now and then."""
    ensemble = wd.Live(scene(), 2, **HOW)
    for packet in wd.packets.from_motion(MOTION, 4):  # until all caches are filled
        ensemble.push(packet)
    counts = []
    for _ in range(2):
        gc.collect()
        counts.append(sum(not isinstance(each, weakref.ref) for each in gc.get_objects()))
        for _ in range(50):
            ensemble.push([0.1])
    assert counts[1] - counts[0] < 50


def test_the_lag_behind_real_time_is_reported():
    ensemble = live()
    ensemble.push(MOTION.acceleration[:100], start=time.time() - 3.0)  # it ends 2 s ago
    assert ensemble.lag == pytest.approx(2.0, abs=1.0)
    relative = live()
    relative.push(MOTION.acceleration[:100], start=0.0)
    assert relative.lag == pytest.approx(0.0, abs=1.0)


def test_the_lag_of_a_loaded_state_is_that_of_its_time_stamps(tmp_path):
    for start, due in ((time.time() - 3.0, 2.9), (0.0, np.nan)):
        ensemble = wd.Live(scene(), 2, **HOW)
        ensemble.push(MOTION.acceleration[:10], start=start)
        loaded = wd.load_state(wd.Live(scene(), 2, **HOW), wd.save_state(ensemble, tmp_path / "state.nc"))
        assert loaded.lag == pytest.approx(due, abs=1.0, nan_ok=True)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (lambda: wd.Scene(scene().structure, wd.Stripes([MOTION], [0.3], wd.PeakGroundAcceleration())), "one motion"),
        (lambda: wd.Scene(scene().structure, wd.Cloud([MOTION, wd.GroundMotion(-MOTION.acceleration, STEP)])), "got 2"),
        (lambda: scene(recorders=()), "no recorders"),
        (lambda: scene(record_from=1.0), "record_from"),
    ],
)
def test_a_scene_that_cannot_be_integrated_live_is_refused(given, message):
    with pytest.raises(ValueError, match=message):
        wd.Live(given(), 1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"limits": {"slight": 0.02, "heavy": 0.01}}, "must increase"),
        ({"limits": {"slight": {"peak_floor_acceleration": 3.0}}}, "peak_floor_acceleration"),
        ({"quantiles": (0.5, 1.5)}, "numbers from 0 to 1"),
        ({"unit": "metre"}, "unknown unit"),
        ({"patience": -1.0}, "patience"),
        ({"sampling_step": 0.0}, "sampling_step"),
        ({"sampling_step": 100.0}, "100 samples per second are sampling_step=0.01"),
        ({"integration": wd.Integration(target_error=0.01)}, "wd.plan"),
        ({"integration": wd.Integration(method="dormand_prince54")}, "adaptive steps.*method='rk4'"),
        ({"integration": wd.Integration(step=STEP, resample=True)}, "sampling_step="),
    ],
)
def test_wrong_arguments_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        live(**arguments)


@pytest.mark.parametrize("arguments", [{"limits": np.nan}, {"limits": {"slight": np.nan}}, {"quantiles": (np.nan,)}])
def test_arguments_of_answers_are_checked_before_kernels_compile(arguments, monkeypatch):
    monkeypatch.setattr("warpdyn.campaigns.live.live.build_run", lambda *given: pytest.fail("a run is built"))
    with pytest.raises(ValueError, match="nan"):
        live(**arguments)


def test_a_state_that_has_changed_is_refused(tmp_path):
    first = live()
    first.push(MOTION.acceleration[:100])
    path = wd.save_state(first, tmp_path / "state.nc")
    with netCDF4.Dataset(path, "a") as file:
        values = file["state_0_real"][:]
        values[1, 2] = np.nextafter(values[1, 2], values.dtype.type(2))
        file["state_0_real"][:] = values
    with pytest.raises(ValueError, match="has changed since save_state wrote it"):
        wd.load_state(live(), path)


def test_accelerations_in_another_unit_are_implausible():
    loud = live()
    with pytest.warns(UserWarning, match="peak ground acceleration of the motion so far is 30"):
        loud.push(np.full(3, 30.0))
    loud.push(np.full(3, 30.0))  # one warning is enough
    quiet = live()
    quiet.push(np.full(3, 0.05))
    with pytest.warns(UserWarning, match="strongest motion that has arrived is 0.05"):
        quiet.finish()


def test_simulate_may_use_the_kernel_that_can_pause(run, monkeypatch):
    # On a GPU, it does so for laws with many rules, so that live ensembles have the same bits.
    from dataclasses import replace

    from warpdyn.campaigns.integration import model

    monkeypatch.setattr(model, "as_in_live", lambda plan, *, is_gpu: replace(plan, pauses=True))
    assert same(wd.simulate(scene(), structures=20, **HOW), run)
