"""Controlled structures in kernels against responses that were computed without warpdyn."""

from typing import Any

import numpy as np
import pytest
import warp as wp
from scipy.linalg import expm
from validation import difference, relative_difference

import warpdyn as wd

control = wd.control
CPU = wd.Execution(device="cpu")
pytestmark = pytest.mark.filterwarnings("ignore:implausible input")


def exact(step, method="rk4"):
    return {"integration": wd.Integration(method=method, dtype="float64", step=step), "execution": CPU}


def peaks(run):
    return {name: run[name].values.ravel() for name in run.data_vars if name.startswith("peak_")}


# An oscillator of 1 Hz with an active mass damper in its second "storey"; the regulator's weights are those of the
# displacement and the velocity of the oscillator.
MASS, DAMPER_MASS, TURN = 1e5, 2e3, 2 * np.pi
STIFFNESS, DAMPER_STIFFNESS = MASS * TURN**2, DAMPER_MASS * (0.98 * TURN) ** 2
OSCILLATOR = wd.ShearBuilding(
    [MASS, DAMPER_MASS],
    [STIFFNESS, DAMPER_STIFFNESS],
    3.0,
    damping="storey",
    damping_coefficient=[2 * 0.01 * MASS * TURN, 2 * 0.08 * DAMPER_MASS * 0.98 * TURN],
)
TIME = np.arange(0.0, 20.005, 0.01)
SHAKE = wd.GroundMotion(1.5 * np.sin(TURN * 1.05 * TIME) * np.exp(-0.15 * TIME), 0.01, "decaying sine")
OF_DAMPER = control.lqr(
    OSCILLATOR, [control.Actuator(2)], force_weight=2e-5, state_weight=np.diag([STIFFNESS, 0.0, MASS, 0.0]) / 2
)
# Peak displacement of the oscillator, stroke of the damper, force, absolute acceleration of the oscillator.
OF_CASES = {
    "no limits": ({}, 0.0, [0.12202693, 1.3454395, 19456.29, 4.870236]),
    "limit of the force": ({"force_limit": 2000.0}, 0.0, [0.18279284, 1.0552965, 2000.0, 7.218523]),
    "delay of 3 samples": ({}, 0.03, [0.12256908, 1.3648851, 19852.21, 4.979332]),
}
RECOMPUTED = "computed without warpdyn with fine steps, to 7 digits"


def of_damper(case, **more):
    limits, delay, _ = OF_CASES[case]
    loop = control.Control([control.Actuator(2, **limits)], regulator=OF_DAMPER, sampling_interval=0.01, delay=delay)
    scene = wd.Scene(OSCILLATOR, wd.Cloud([SHAKE]), recorders=("drift", "acceleration"), tail=0.0, control=loop)
    return wd.simulate(scene, **exact(0.01 / 40), **more)


@pytest.mark.parametrize(
    "case",
    [name if name != "delay of 3 samples" else pytest.param(name, marks=pytest.mark.thorough) for name in OF_CASES],
)
def test_active_mass_damper(case, measured):
    run = of_damper(case)
    due = OF_CASES[case][-1]
    found = [*run["peak_storey_drift"].values[0], run["peak_control_force"].values.item()]
    found.append(run["peak_floor_acceleration"].values[0, 0])
    value = relative_difference(found, due)
    measured("peaks with an active mass damper", truth=RECOMPUTED, value=value, bound=1e-5)
    assert (run["limited_share"].item() > 0.5) == ("limit" in case and case != "no limits")


@pytest.mark.thorough
def test_histories_of_the_active_mass_damper():
    run = of_damper("limit of the force", histories=wd.Histories([0]))
    at = run.sel(time=[5.0, 10.0])
    np.testing.assert_allclose(at["displacement"].values[0, :, 0], [0.0883767, -0.0760325], rtol=2e-6)
    np.testing.assert_allclose(at["actuator_stroke"].values.ravel(), [0.569509, 0.430775], rtol=2e-6)
    np.testing.assert_array_equal(at["control_force"].values.ravel(), [2000.0, -2000.0])
    np.testing.assert_array_equal(at["control_force"].values, at["actuator_command"].values)


# --- observers, delay, noise, resolution -------------------------------------------------------------------------
FRAME = wd.ShearBuilding([1e5, 8e4], [4e7, 3e7], 3.0, damping="storey", damping_coefficient=2e5)
OBSERVED = control.lqg(
    FRAME,
    [control.Actuator(1)],
    force_weight=1e-8,
    sampling_interval=0.02,
    ground_noise=1e-2,
    sensor_noise={"acceleration": 0.05, "velocity": 0.01},
)


def observed(*, duration, step=0.001, noise=1e-14, resolution=1e-14, displacement=0.01, samples=1, **more):
    """Run a free vibration with acceleration feedback that acts one sample late; peaks are those of the last sample."""
    loop = control.Control(
        [control.Actuator(1)],
        regulator=OBSERVED,
        sampling_interval=0.02,
        delay=0.02,
        noise={"velocity": noise, "acceleration": 2 * noise},
        resolution={kind: resolution for kind in ("displacement", "velocity", "acceleration")},
    )
    start = wd.FreeVibration(displacement=[displacement, 2 * displacement], velocity=[0.0, 0.0], duration=duration)
    late = max(0.0, duration - 0.02)
    scene = wd.Scene(FRAME, start, recorders=("drift",), record_from=late, control=loop)
    return wd.simulate(scene, structures=samples, **exact(step), **more)


def matrices():
    """Return the matrices that advance structure and force by a sample, and those of the absolute accelerations."""
    system = control.state_space(FRAME, [control.Actuator(1)])
    held = np.zeros((5, 5))
    held[:4, :4], held[:4, 4:] = system.dynamics, system.input
    whole = expm(0.02 * held)[:4]
    inverse = np.linalg.inv(system.mass)
    of_state = -inverse @ np.hstack([system.stiffness, system.damping])
    return whole[:, :4], whole[:, 4:], of_state, inverse @ np.array([[1.0], [0.0]])


@pytest.fixture(scope="module")
def sampled_displacements():
    """Displacements of the sampled loop at its sampling instants, advanced by matrix exponentials."""
    growth, driven, of_state, of_force = matrices()
    state, estimate, force, queued = np.array([0.01, 0.02, 0, 0]), np.zeros(OBSERVED.states), np.zeros(1), np.zeros(1)
    found = []
    for sample in range(51):
        found.append(state[:2])
        acceleration = of_state @ state + of_force @ force if sample else np.zeros(2)  # none before the first step
        values = np.concatenate([state, acceleration])
        asked = -(OBSERVED.gain @ values + OBSERVED.estimate_gain @ estimate)
        force, queued = queued, asked
        estimate = OBSERVED.growth @ estimate + OBSERVED.correction @ values + OBSERVED.input @ force
        state = growth @ state + driven @ force
    return np.array(found)


def test_lqg_with_delay_is_the_sampled_loop(sampled_displacements, measured):
    run = observed(duration=1.0, histories=wd.Histories([0]))
    measured(
        "free vibration with LQG control by accelerations and a delay",
        truth="the sampled loop, advanced by matrix exponentials",
        value=difference(run["displacement"].values[0, ::20], sampled_displacements) / 0.02,
        bound=1e-6,
    )


def test_order_of_convergence_of_a_controlled_structure(sampled_displacements):
    errors = []
    for every in (5, 10):
        run = observed(duration=1.0, step=0.02 / every, histories=wd.Histories([0]))
        errors.append(difference(run["displacement"].values[0, ::every], sampled_displacements))
    # rk4 has order 4; accelerations are measured in its last stage, at the end of the step, with an error of order 3
    assert 2.8 <= np.log2(errors[0] / errors[1]) <= 4.6


@pytest.mark.meant_as_given("sensor_noise_of_velocity", "sensor_noise_of_acceleration")  # noise alone
def test_sensor_noise_has_its_variance():
    growth, driven, of_state, of_force = matrices()
    states = OBSERVED.states
    size = 4 + states + 2  # structure, observer, acting and queued command
    x, s, acting, queued = slice(0, 4), slice(4, 4 + states), size - 2, size - 1
    rows = np.vstack([np.eye(4), of_state])
    direct = np.vstack([np.zeros((4, 1)), of_force])[:, 0]
    loop, noise = np.zeros((size, size)), np.zeros((size, 6))
    loop[x, x], loop[x, queued], loop[acting, queued] = growth, driven[:, 0], 1.0
    loop[s, x], loop[s, s] = OBSERVED.correction @ rows, OBSERVED.growth
    loop[s, acting] = OBSERVED.correction @ direct
    loop[s, queued] += OBSERVED.input[:, 0]
    loop[queued, x], loop[queued, acting] = -(OBSERVED.gain @ rows)[0], -(OBSERVED.gain @ direct)[0]
    loop[queued, s] = -OBSERVED.estimate_gain[0]
    noise[s], noise[queued] = OBSERVED.correction, -OBSERVED.gain[0]
    spread = np.diag([0.0, 0.0, 1e-2, 1e-2, 2e-2, 2e-2]) ** 2
    covariance = np.zeros((size, size))
    for _ in range(150):  # 3 s
        covariance = loop @ covariance @ loop.T + noise @ spread @ noise.T
    due = covariance[acting, acting]
    run = observed(duration=3.0, noise=1e-2, displacement=1e-9, samples=1024)
    force = run["peak_control_force"].values[:, 0]
    assert np.mean(force**2) == pytest.approx(due, rel=4 * np.sqrt(2 / 1024))  # four standard errors
    again = observed(duration=3.0, noise=1e-2, displacement=1e-9, samples=8)
    np.testing.assert_array_equal(again["peak_control_force"].values[:, 0], force[:8])


@pytest.mark.meant_as_given(
    "sensor_resolution_of_displacement", "sensor_resolution_of_velocity", "sensor_resolution_of_acceleration"
)
def test_rounded_sensors():
    run = observed(duration=1.0, resolution=1e3)  # all sensor values are rounded to 0
    assert run["peak_control_force"].item() == 0.0
    assert run["status"].item() == 0


class Fails(control.Controller):
    """A controller that returns a command that is not finite, or one beyond the limit of the actuator."""

    force: float = wd.laws.parameter("N", "force while the velocity of the first floor is positive")
    until: float = wd.laws.parameter("s", "time after which the command is not finite", low=0.0)
    memory = ("last",)

    @wp.func
    def command(measured: Any, memory: Any, c: Any):
        if measured.time > c.until:
            return wp.sqrt(-1.0 - measured.time), memory.last
        if measured.velocity[0] > 0:
            return -c.force, memory.last + 1
        return c.force, memory.last


FAILURES = {  # force, time of NaN, limits -> reason and the earliest time
    "not finite": (1e3, 1.995, {"force_limit": 1e4, "stroke_limit": 1.0}, 1, 2.0),
    "beyond its limit": (2e4, 50.0, {"force_limit": 1e4, "stroke_limit": 1.0}, 2, 0.0),
    "stroke": (1e3, 50.0, {"force_limit": 1e4, "stroke_limit": 1e-4}, 3, None),
}


@pytest.mark.parametrize("case", FAILURES)
def test_a_control_that_fails_is_reported(case):
    force, until, limits, reason, at = FAILURES[case]
    loop = control.Control(
        [control.Actuator(1, **limits)],
        controller=Fails(force=force, until=until),
        sampling_interval=0.01,
        on_limit="fail",
    )
    scene = wd.Scene(FRAME, wd.Cloud([SHAKE]), recorders=("drift",), control=loop)
    with pytest.warns(UserWarning, match="1 of 1 samples is flagged control_failed"):
        run = wd.simulate(scene, **exact(0.005))
    status = run["status"]
    assert status.attrs["flag_meanings"].split()[status.item()] == "control_failed"
    assert run["control_failure"].item() == reason
    assert np.isnan(run["peak_storey_drift"]).all()
    time = run["time_of_control_failure"].item()
    assert time == pytest.approx(at) if at is not None else 0 < time < 2


def test_a_wrong_controller_is_refused():
    with pytest.raises(TypeError, match="controller Nothing: its device function is missing"):

        class Nothing(control.Controller):
            gain: float = wd.laws.parameter("1", "gain")

    with pytest.raises(TypeError, match=r"reads measured.speed, which is not measured"):

        class Misspelt(control.Controller):
            gain: float = wd.laws.parameter("1", "gain")

            @wp.func
            def command(measured: Any, memory: Any, c: Any):
                return c.gain * measured.speed

    with pytest.raises(TypeError, match="returns 1 value, but must return 2: command, last"):

        class Forgetful(control.Controller):
            gain: float = wd.laws.parameter("1", "gain")
            memory = ("last",)

            @wp.func
            def command(measured: Any, memory: Any, c: Any):
                return c.gain * measured.rate

    with pytest.raises(TypeError, match="ClippedOptimal has no parameter 'volts'"):
        control.ClippedOptimal(volts=2.0)
    with pytest.raises(ValueError, match="voltage is -2"):
        control.ClippedOptimal(voltage=-2.0)


def test_energies_balance_with_actuators():
    loop = control.Control(
        [control.Actuator(1, force_limit=1e4, stroke_limit=1.0)],
        controller=Fails(force=5e3, until=50.0),
        sampling_interval=0.01,
        on_limit="fail",
    )
    scene = wd.Scene(FRAME, wd.Cloud([SHAKE]), recorders=("energy",), control=loop)
    run = wd.simulate(scene, **exact(0.0025))
    assert abs(run["energy_balance_error"].item()) < 1e-6
    assert run["actuator_work"].item() < 0  # the force opposes the velocity
