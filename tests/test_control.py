"""Controlled structures in kernels against responses that were computed without warpdyn."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import warp as wp
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from test_control_analysis import BELOW, DYKE
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


# Force loops of the damper under x = 0.015 sin(2 pi 2.5 t), fourth cycle: voltage -> greatest force (absolute value)
# and energy per cycle. A heavy oscillator in free vibration prescribes the motion.
HEAVY = 1e10  # kg: the damper's force changes its motion by less than 1e-6
LOOPS = {0.0: (622.08765, 26.766029), 2.0: (1574.7172, 82.038618), 2.25: (1691.2011, 88.743396)}


def loop_of(voltage, step, cycles, damper=None, **more):
    swing = 2.5 * TURN
    body = wd.ShearBuilding(HEAVY, HEAVY * swing**2, 10.0)
    start = wd.FreeVibration(displacement=[0.0], velocity=[0.015 * swing], duration=0.4 * cycles)
    loop = control.Control(
        [damper or control.MRDamper(1, first_voltage=voltage)],
        controller=control.ConstantCommand(value=voltage),
        sampling_interval=step,
    )
    scene = wd.Scene(body, start, recorders=("drift",), control=loop, record_from=0.4 * (cycles - 1))
    return wd.simulate(scene, **exact(step), **more)


def energy_of_fourth_cycle(voltage, step):
    return -np.diff([loop_of(voltage, step, cycles)["actuator_work"].item() for cycles in (3, 4)]).item()


def test_force_loops_of_a_magnetorheological_damper(measured):
    found, due = [], []
    for voltage, (force, energy) in LOOPS.items():
        found += [loop_of(voltage, 1e-4, 4)["peak_control_force"].item(), energy_of_fourth_cycle(voltage, 1e-4)]
        due += [force, energy]
    measured(
        "force loops of a magnetorheological damper",
        truth="modified Bouc-Wen model, computed without warpdyn, to 8 digits",
        value=relative_difference(found, due),
        bound=1e-5,
    )


SOFT = dict(dashpot_0=784.0, stiffness_0=3610.0, dashpot_1=14649.0, stiffness_1=840.0, offset=0.0245, alpha=12441.0)
SOFT |= dict(slope=58.0, dashpot_0_per_volt=1803.0, dashpot_1_per_volt=34622.0, alpha_per_volt=38430.0)


def integrated_energy(gamma, beta):
    """Return the energy of the first cycle at 0 V, integrated by SciPy."""
    p = SOFT | {"gamma": gamma, "beta": beta}

    def rates(t, state):
        y, z, _ = state
        x, v = 0.015 * np.sin(2.5 * TURN * t), 0.015 * 2.5 * TURN * np.cos(2.5 * TURN * t)
        inner = p["alpha"] * z + p["dashpot_0"] * v + p["stiffness_0"] * (x - y)
        inner /= p["dashpot_0"] + p["dashpot_1"]
        w = v - inner
        loop = -gamma * abs(w) * z * abs(z) - beta * w * z**2 + p["slope"] * w
        force = p["dashpot_1"] * inner + p["stiffness_1"] * (x - p["offset"])
        return inner, loop, force * v

    return solve_ivp(rates, (0.0, 0.4), np.zeros(3), method="LSODA", rtol=1e-10, atol=1e-13).y[2, -1]


@pytest.mark.parametrize(("gamma", "beta"), [(136320.0, 2059020.0), (2059020.0, 136320.0)])
def test_unequal_loop_parameters_and_order_of_convergence(gamma, beta):
    # Velocities change their sign within a step, which limits the order to 2.
    due, errors = integrated_energy(gamma, beta), []
    for steps in (100, 200):
        damper = control.MRDamper(1, gamma=gamma, beta=beta, **SOFT)
        errors.append(abs(-loop_of(0.0, 0.4 / steps, 1, damper=damper)["actuator_work"].item() / due - 1))
    assert errors[1] < 1e-4
    assert 1.5 <= np.log2(errors[0] / errors[1]) <= 3.0


@pytest.mark.thorough
def test_points_of_force_loops():
    for voltage, due in {0.0: (478.0764, -622.08765, 473.14311), 2.25: (1547.3931, -1691.2011, 1544.8379)}.items():
        run = loop_of(voltage, 2.5e-4, 4, histories=wd.Histories([0]))
        force = -run["control_force"].values[0, -1601:, 0]
        np.testing.assert_allclose([force.max(), force.min(), force[0]], due, rtol=1e-6)


class Dyke(control.Controller):
    """Passive or clipped-optimal control of a magnetorheological damper, written by a user."""

    voltage: float = wd.laws.parameter("V", "greatest voltage", low=0.0)
    passive: float = wd.laws.parameter("1", "1: constant voltage", low=0.0, high=1.0, default=0.0)

    @wp.func
    def command(measured: Any, memory: Any, c: Any):
        if c.passive > 0.5:
            return c.voltage
        if (measured.desired - measured.force) * measured.force > 0:
            return c.voltage
        return 0.0


# Peak displacements, drifts, accelerations of the three floors, and force of the damper.
OF_BUILDING = {
    "passive-off": (
        *(0.002113122, 0.003581051, 0.004546666, 0.002113122, 0.001536848, 0.001042089),
        *(4.195486, 4.896402, 7.25123, 259.474),
    ),
    "passive-on": (
        *(0.0007884213, 0.001953248, 0.003057349, 0.0007884213, 0.001574037, 0.00110718),
        *(2.818353, 4.996201, 7.704163, 982.0237),
    ),
    "clipped-optimal": (
        *(0.001357494, 0.002097838, 0.002682178, 0.001357494, 0.001266006, 0.0009113321),
        *(8.153227, 8.659892, 6.341494, 860.5287),
    ),
}
EL_CENTRO = Path(__file__).parent / "data" / "el_centro.csv"


def of_building(case, controller, step=1e-4):
    acceleration = 9.81 * np.loadtxt(EL_CENTRO, skiprows=3)
    motion = wd.GroundMotion(acceleration, 0.004, "El Centro 1940, 5 times faster")
    regulator = control.lqr(DYKE, BELOW, force_weight=1e-7, acceleration_weight=[0.0, 0.0, 1.0])
    loop = control.Control(
        [control.MRDamper("first", offset=0.0, first_voltage=2.25 * (case == "passive-on"))],
        regulator=control.Regulator(-regulator.gain),  # the damper pushes the first floor in the positive direction
        controller=controller,
        sampling_interval=0.001,
    )
    recorders = ("displacement", "spring", "acceleration")
    scene = wd.Scene(DYKE, wd.Cloud([motion]), recorders=recorders, tail=0.0, control=loop)
    run = wd.simulate(scene, **exact(step))
    names = ("peak_displacement", "peak_spring_deformation", "peak_acceleration", "peak_control_force")
    return np.concatenate([run[name].values.ravel() for name in names])


def test_three_storey_building_with_a_magnetorheological_damper(measured):
    worst = 0.0
    for case, due in OF_BUILDING.items():
        controller = Dyke(voltage=0.0 if case == "passive-off" else 2.25, passive=float(case != "clipped-optimal"))
        worst = max(worst, relative_difference(of_building(case, controller), due))
    measured(
        "three-storey building with a magnetorheological damper: peaks without and with clipped-optimal control",
        truth="computed without warpdyn with steps of 0.02 ms; within 2 to 4 % of the table of Dyke and others (1996)",
        value=worst,
        bound=1e-3,
    )


@pytest.mark.thorough
def test_the_controllers_of_warpdyn_give_the_same_peaks():
    found = of_building("clipped-optimal", control.ClippedOptimal(voltage=2.25))
    np.testing.assert_allclose(found, OF_BUILDING["clipped-optimal"], rtol=1e-3)
    found = of_building("passive-on", control.ConstantCommand(value=2.25))
    np.testing.assert_allclose(found, OF_BUILDING["passive-on"], rtol=1e-3)


RATIOS = np.array([0.5, 0.8, 1.0, 1.2, np.sqrt(2.0), 2.0, 4.0])


def transmitted(controller, actuator, passive, interval, duration=30.0):
    """Return the ratio of absolute to base acceleration in the steady state, of an oscillator of 1 Hz."""
    time = np.arange(0.0, duration + interval / 2, interval)
    motions = [wd.GroundMotion(np.cos(TURN * ratio * time), interval, f"{ratio:.3f}") for ratio in RATIOS]
    body = wd.ShearBuilding(1e3, 1e3 * TURN**2, 3.0, damping="storey", damping_coefficient=2 * passive * TURN * 1e3)
    loop = control.Control([actuator], controller=controller, sampling_interval=interval)
    scene = wd.Scene(
        body, wd.Cloud(motions), recorders=("acceleration",), record_from=duration - 4.0, tail=0.0, control=loop
    )
    return wd.simulate(scene, **exact(interval))["peak_floor_acceleration"].values.ravel()


def transfer(skyhook, passive):
    due = 1 + (2 * passive * RATIOS) ** 2
    return np.sqrt(due / ((1 - RATIOS**2) ** 2 + (2 * (skyhook + passive) * RATIOS) ** 2))


def test_skyhook_has_its_transfer_function(measured):
    worst = 0.0
    for skyhook, passive in ((0.3, 0.0), (0.7, 0.0), (0.5, 0.1)):
        ideal = control.SkyhookDamper(coefficient=2 * skyhook * TURN * 1e3)
        coarse, fine = (transmitted(ideal, control.Actuator(1), passive, interval) for interval in (0.002, 0.001))
        due = transfer(skyhook, passive)
        order = np.log2(np.abs(coarse / due - 1).max() / np.abs(fine / due - 1).max())
        assert order == pytest.approx(1.0, abs=0.1)  # commands are held: an error of first order in the interval
        worst = max(worst, relative_difference(2 * fine - coarse, due))
    truth = "closed form of a skyhook damper with a passive damper in parallel"
    measured(
        "transfer function of skyhook control, extrapolated to continuous control", truth=truth, value=worst, bound=1e-3
    )


def simulated(low, high, interval, steps, ratio):
    """Return the peak after 4 s of a continuous skyhook on an oscillator of 1 Hz, integrated by RK4 in NumPy."""
    base = np.cos(TURN * ratio * interval * np.arange(steps + 1))

    def slope(x, v, ground, coefficient):
        return np.array([v, -(TURN**2) * x - coefficient / 1e3 * v - ground])

    state, speed, peak, h = np.zeros(2), 0.0, 0.0, interval
    for k in range(steps):
        v = state[1]
        absolute = v + speed  # velocity of the base: acceleration is linear between its samples
        c = min(max(high * absolute / v, low), high) if absolute * v > 0 else low
        middle = (base[k] + base[k + 1]) / 2
        k1 = slope(*state, base[k], c)
        k2 = slope(*(state + h / 2 * k1), middle, c)
        k3 = slope(*(state + h / 2 * k2), middle, c)
        k4 = slope(*(state + h * k3), base[k + 1], c)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        speed += h * middle
        peak = max(peak, abs(state[0])) if (k + 1) * h >= 4.0 else peak
    return peak


def test_semi_active_dampers(measured):
    # Equal lowest and highest coefficients: a passive damper.
    coefficient = 2 * 0.3 * TURN * 1e3
    damper = control.VariableDamper(1, low=coefficient, high=coefficient)
    same = control.ContinuousSkyhook(low=coefficient, high=coefficient)
    value = relative_difference(transmitted(same, damper, 0.0, 0.001), transfer(0.0, 0.3))
    measured(
        "transfer function of a variable damper with a constant coefficient",
        truth="closed form of a viscous damper",
        value=value,
        bound=2e-4,  # peaks are read at steps: 250 per period at the highest frequency
    )
    low, high, interval, ratio = 200.0, 8e3, 0.005, 1.3
    time = np.arange(0.0, 8.0 + interval / 2, interval)
    body = wd.ShearBuilding(1e3, 1e3 * TURN**2, 3.0, damping="storey", damping_coefficient=0.0)
    loop = control.Control(
        [control.VariableDamper(1, low=low, high=high)],
        controller=control.ContinuousSkyhook(low=low, high=high),
        sampling_interval=interval,
    )
    motion = wd.GroundMotion(np.cos(TURN * ratio * time), interval, "cosine")
    scene = wd.Scene(body, wd.Cloud([motion]), recorders=("acceleration",), record_from=4.0, tail=0.0, control=loop)
    run = wd.simulate(scene, **exact(interval))
    assert run["peak_actuator_stroke"].item() == pytest.approx(simulated(low, high, interval, 1600, ratio), rel=1e-9)


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
