"""Magnetorheological and variable dampers, and skyhook, against responses that were computed without warpdyn."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import warp as wp
from scipy.integrate import solve_ivp
from test_control import TURN, exact
from test_control_analysis import BELOW, DYKE
from validation import relative_difference

import warpdyn as wd

control = wd.control
pytestmark = pytest.mark.filterwarnings("ignore:implausible input")

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
