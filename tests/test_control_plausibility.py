"""Force limits and damper coefficients in another unit give one warning; usual actuators give none."""

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.campaigns.integration.time_grid import build_timeline
from warpdyn.model.scene.plausibility import warn_of_implausible

pytestmark = pytest.mark.fast
control = wd.control

WAVE = np.sin(0.08 * np.arange(500)) * np.exp(-0.005 * np.arange(500))
MOTION = wd.GroundMotion(3.0 * WAVE / WAVE.max(), 0.01, "peak of 3 m/s2")
WEAK = wd.GroundMotion(0.2 * MOTION.values, 0.01, "weak")
DAMPED = {"damping": "rayleigh", "damping_ratio": 0.02}
# Palacios-Quinonero et al. (2012), Mathematical Problems in Engineering 2012, 636878, table 1: 20 storeys.
STIFFNESS = np.repeat([8.62e8, 5.54e8, 4.54e8, 2.91e8, 2.56e8, 1.72e8], [5, 6, 3, 3, 2, 1])
TALL = wd.ShearBuilding(1.1e6, STIFFNESS, 4.0, **DAMPED)
FORCES = np.repeat([4.8e6, 2.4e6, 1.2e6], [5, 9, 6])  # N, of the actuators of each storey


def mass_damper():
    """Return a building with one degree of freedom and a mass damper of 2 %."""
    springs = [
        wd.Spring("storey", {"x": 1.0}, stiffness=4e6),
        wd.Spring("damper", {"d": 1.0, "x": -1.0}, stiffness=8e4),
    ]
    return wd.LumpedStructure({"x": 1e5, "d": 2e3}, springs, **DAMPED)


def scene(structure, actuators, motions=(MOTION,), design=None):
    forces = control.Regulator(np.zeros((len(actuators), 2 * structure.dofs)))
    laws = {"regulator": forces}
    if isinstance(actuators[0], control.VariableDamper):
        laws = {"controller": control.OnOffSkyhook(low=0.0, high=actuators[0].high)}
    loop = control.Control(actuators, sampling_interval=0.01, **laws)
    return wd.Scene(structure, design or wd.Cloud(list(motions)), control=loop)


def warn(*arguments, **options):
    warn_of_implausible(scene(*arguments, **options))


def tendons(factor):
    return [control.Actuator(storey, force_limit=factor * FORCES[storey - 1]) for storey in (1, 5, 20)]


@pytest.mark.parametrize(
    ("structure", "actuators", "message"),
    [
        (
            TALL,
            tendons(1e-3),
            "at actuator 3 is 0.000727.* .usual: at least 0.005.: with force_limit given in kN, .*0.727",
        ),
        (TALL, tendons(1e-6), "with force_limit given in MN, it would be 0.727"),
        (mass_damper(), [control.Actuator("damper", force_limit=2.0)], "force_limit given in kN, it would be 0.34"),
        (
            mass_damper(),
            [control.VariableDamper("damper", high=2.0)],
            "that the VariableDampers with high= add to a mode is .*usual: at least 0.001.: with high given in kN s/m",
        ),
        (
            TALL,
            [control.VariableDamper(storey, high=6e3) for storey in (1, 2)],
            "with high given in kN s/m, it would be",
        ),
    ],
)
def test_an_actuator_in_another_unit_gets_one_warning(structure, actuators, message):
    with pytest.warns(UserWarning, match=message) as caught:
        warn(structure, actuators)
    assert len(caught) == 1


def test_usual_actuators_get_no_warning(recwarn):
    warn(TALL, tendons(1.0))
    warn(TALL, tendons(0.02))  # weak ones
    warn(TALL, [control.Actuator(1)])  # without a limit
    warn(mass_damper(), [control.Actuator("damper", force_limit=600.0)])  # 0.3 m/s2
    warn(mass_damper(), [control.VariableDamper("damper", high=2e3)])
    warn(TALL, [control.VariableDamper(storey, high=6e6) for storey in (1, 2)])
    # The weakest motion decides, also after its scaling: a force limit may be meant for it.
    warn(TALL, tendons(4e-3), [MOTION, WEAK])
    warn(TALL, tendons(2e-3), design=wd.Stripes([MOTION], [0.03, 0.3], wd.PeakGroundAcceleration()))
    pushed = wd.ForceHistory(np.full((200, 20), 1e4), 0.05)
    warn(TALL, tendons(1e-3), design=pushed)  # forces of other sizes than those of earthquakes
    car = wd.QuarterCar(300.0, 60.0, 16e3, 300.0, 190e3)
    road = wd.SineRoad(amplitude=0.01, wavelength=0.5).motion(speed=20.0, duration=1.0, step=0.001)
    warn(car, [control.Actuator("suspension", force_limit=100.0)], [road])  # 0.3 % of the peak, which the tyre isolates
    assert not recwarn.list


NOISE = wd.FilteredNoise(wd.KanaiTajimi(0.02, 15.0, 0.6), duration=10.0, interval=0.01)
FREE = wd.FreeVibration(10.0, displacement=0.01 * np.arange(1, 21))
STRUCK = wd.FreeVibration(10.0, velocity=np.full(20, 0.3))


@pytest.mark.parametrize(
    ("design", "of"),
    [
        (NOISE, "the peak of the noise"),
        (FREE, "that of the free vibration in the first mode"),
        (STRUCK, "that of the free vibration in the first mode"),
    ],
)
def test_a_force_limit_in_kilonewtons_is_found_without_a_record(design, of, recwarn):
    with wd.meant_as_given("initial_velocity", "initial_drift_ratio"):
        warn(TALL, tendons(1.0), design=design)
        assert not recwarn.list
        with pytest.warns(UserWarning, match=f"over {of}, at actuator 3 is .*: with force_limit given in kN") as caught:
            warn(TALL, tendons(1e-3), design=design)
    assert len(caught) == 1


def test_the_force_limit_of_a_live_run_is_compared_with_a_weak_earthquake(recwarn):
    """The motion is a placeholder. The wrong unit ends the call after the checks of the scene, before kernels."""
    for motion in (MOTION, WEAK, wd.GroundMotion(1e-3 * MOTION.values, 0.01, "placeholder")):
        with pytest.raises(ValueError, match="furlong"):
            wd.Live(scene(TALL, tendons(1.0), [motion]), 1, unit="furlong/s2")
        assert not recwarn.list
        meant = "over 0.981 m/s2 .a weak earthquake., at actuator 3 is .*with force_limit given in kN"
        with pytest.warns(UserWarning, match=meant), pytest.raises(ValueError, match="furlong"):
            wd.Live(scene(TALL, tendons(1e-3), [motion]), 1, unit="furlong/s2")


OSCILLATOR = wd.ShearBuilding(1e5, 4e6, 3.0, **DAMPED)
CRITICAL = 2 * np.sqrt(1e5 * 4e6)  # N s/m, 2 sqrt(k m)


def commanded(actuator, controller):
    return wd.Scene(
        OSCILLATOR, MOTION, control=control.Control([actuator], controller=controller, sampling_interval=0.01)
    )


@pytest.mark.parametrize(
    ("actuator", "make", "size", "message"),
    [
        (
            control.Actuator(1),
            lambda value: control.SkyhookDamper(coefficient=value),
            0.2 * CRITICAL,
            "coefficient of SkyhookDamper adds to a mode is 0.0002 .*given in kN s/m, it would be 0.2,",
        ),
        (
            control.VariableDamper(1, high=CRITICAL),
            lambda value: control.ConstantCommand(value=value),
            0.2 * CRITICAL,
            "value of ConstantCommand adds to a mode is 0.0002 .*with value given in kN s/m, it would be 0.2,",
        ),
        (  # N: 0.2 g; 0.1 g is the reference
            control.Actuator(1),
            lambda value: control.ConstantCommand(value=value),
            0.2 * 9.80665 * 1e5,
            "ConstantCommand gives the free ends of .* is 0.002 .*with value given in kN, it would be 2,",
        ),
    ],
)
def test_commands_in_kilonewtons_are_warned_of(actuator, make, size, message, recwarn):
    warn_of_implausible(commanded(actuator, make(size)))
    warn_of_implausible(commanded(actuator, make(0.0)))  # no control
    assert not recwarn.list
    with pytest.warns(UserWarning, match=message) as caught:
        warn_of_implausible(commanded(actuator, make(1e-3 * size)))
    assert len(caught) == 1


def test_a_magnetorheological_damper_of_a_laboratory_has_no_effect_on_a_building(recwarn):
    passive = control.ConstantCommand(value=2.25)
    prototype = control.MRDamper(1)
    names = ("dashpot_0", "dashpot_0_per_volt", "stiffness_0", "dashpot_1", "dashpot_1_per_volt", "stiffness_1")
    scaled = {name: 200 * getattr(prototype, name) for name in (*names, "alpha", "alpha_per_volt")}
    warn_of_implausible(commanded(control.MRDamper(1, **scaled), passive))
    assert not recwarn.list
    # 1.1 kN on 100 t is 0.011 m/s2, 0.4 % of the peak of the motion.
    with pytest.warns(UserWarning, match=r"MRDamper at its .* is 0.003.*laboratory prototype: multiply dashpot_0, .*"):
        warn_of_implausible(commanded(prototype, passive))


def test_a_sampling_interval_is_checked_before_kernels_compile():
    loop = control.Control(
        [control.Actuator(1)], controller=control.SkyhookDamper(coefficient=1e5), sampling_interval=0.013
    )
    given = wd.Scene(OSCILLATOR, MOTION, control=loop)
    with pytest.raises(ValueError, match=r"neither a multiple nor a whole fraction .*give sampling_interval=0.01,"):
        build_timeline(given, lambda: pytest.fail("the kernel of frequencies would be compiled"))


def test_the_added_damping_ratio_is_that_of_an_oscillator():
    """The damping ratio of one degree of freedom is c / (2 sqrt(k m)); a damper just below the bound is reported."""
    oscillator = wd.ShearBuilding(1e5, 4e6, 3.0, **DAMPED)
    critical = 2 * np.sqrt(1e5 * 4e6)
    warn(oscillator, [control.VariableDamper(1, high=1.001e-3 * critical)])
    with pytest.warns(UserWarning, match=r"add to a mode is 0.000999 "):
        warn(oscillator, [control.VariableDamper(1, high=0.999e-3 * critical)])


def test_a_delay_in_milliseconds_is_warned_of():
    regulator = control.Regulator(np.zeros((1, 2 * TALL.dofs)))
    actuator = control.Actuator(1, force_limit=FORCES[0])

    def delayed(delay):
        loop = control.Control([actuator], sampling_interval=0.01, delay=delay, regulator=regulator)
        warn_of_implausible(wd.Scene(TALL, MOTION, control=loop))

    delayed(0.1)
    with pytest.warns(UserWarning, match=r"delay of the control over the first period .*with delay given in ms"):
        delayed(10.0)


SLOW = wd.ShearBuilding(1e5, 1e5, 3.0, **DAMPED)  # 6.3 s


@pytest.mark.parametrize(
    ("delay", "duration", "message"),
    [
        (0.1, 5.0, None),
        (0.9, 5.0, None),
        (2.0, 5.0, "delay of the control is 2 s .usual: at most 1 s.: if given in ms, it would be 0.002 s"),
        (0.9, 0.8, "delay of the control, at least as long as the run of 0.8 s, is 0.9 s .*: if given in ms"),
    ],
)
def test_a_delay_longer_than_a_second_or_the_run_is_warned_of(delay, duration, message, recwarn):
    motion = wd.GroundMotion(3.0 * np.sin(np.arange(int(duration / 0.01) + 1) / 10), 0.01)
    regulator = control.Regulator(np.zeros((1, 2)))
    loop = control.Control([control.Actuator(1)], sampling_interval=0.01, delay=delay, regulator=regulator)
    given = wd.Scene(SLOW, motion, control=loop, tail=0.0)
    if message is None:
        warn_of_implausible(given)
        assert not recwarn.list
        return
    with pytest.warns(UserWarning, match=message) as caught:
        warn_of_implausible(given)
    assert len(caught) == 1


@pytest.mark.parametrize(
    ("delay", "interval", "message"),
    [
        (20.0, 0.01, "delay=20 s is 2000 sampling intervals, .*: if 20 is in ms, give delay=0.02$"),
        (25.0, 0.01, "delay=25 s is 2500 sampling intervals, .*: if 25 is in ms, give delay=0.03$"),
        (20.0, 0.03, "delay=20 s is not a multiple of .* in seconds: if 20 is in ms, give delay=0.03$"),
        (0.015, 0.01, "give delay=0.02, or a shorter sampling_interval$"),
    ],
)
def test_a_delay_that_may_be_in_milliseconds_is_refused_with_its_unit(delay, interval, message):
    with pytest.raises(ValueError, match=message):
        control.Control(
            [control.Actuator(1)],
            controller=control.SkyhookDamper(coefficient=1e5),
            sampling_interval=interval,
            delay=delay,
        )


@pytest.mark.parametrize("make", [control.OnOffSkyhook, control.ContinuousSkyhook])
def test_a_controller_whose_high_coefficient_is_in_another_unit_is_warned_of(make, recwarn):
    damper = control.VariableDamper(1, high=CRITICAL)
    warn_of_implausible(commanded(damper, make(low=0.0, high=0.2 * CRITICAL)))
    assert not recwarn.list
    meant = "high coefficient of the controller adds .* is 0.0002 .*with high of the controller given in kN s/m, .* 0.2"
    with pytest.warns(UserWarning, match=meant) as caught:
        warn_of_implausible(commanded(damper, make(low=0.0, high=2e-4 * CRITICAL)))
    assert len(caught) == 1


def sensed(**sensors):
    """Return an oscillator of 1 s (omega = 6.32 rad/s) under a motion of 3 m/s2, whose sensors have errors."""
    forces = control.Regulator(np.zeros((1, 3)))  # of displacements, velocities and accelerations
    loop = control.Control([control.Actuator(1)], regulator=forces, sampling_interval=0.01, **sensors)
    return wd.Scene(OSCILLATOR, MOTION, control=loop)


@pytest.mark.parametrize("name", ["noise", "resolution"])
@pytest.mark.parametrize(
    ("kind", "usual", "wrong", "meant"),
    [
        ("displacement", 1e-4, 0.1, "0.075 m, is 1.33.*with {} given in mm, it would be 0.00133"),  # 3 / 40 m
        ("velocity", 1e-2, 1.0, "0.474 m/s, is 2.1.*with {} given in mm/s, .*, or with {} given in cm/s, .* 0.0211"),
        ("acceleration", 0.05, 5.0, "3 m/s2, is 1.66.*with {} given in mm/s2, .*, or with {} given in mg, .* 0.016"),
    ],
)
def test_errors_of_sensors_in_another_unit_are_warned_of(name, kind, usual, wrong, meant, recwarn):
    warn_of_implausible(sensed(**{name: {kind: usual}}))
    assert not recwarn.list
    with pytest.warns(UserWarning, match=f"{name} of {kind} over .* response, {meant.replace('{}', name)}") as caught:
        warn_of_implausible(sensed(**{name: {kind: wrong}}))
    assert len(caught) == 1
