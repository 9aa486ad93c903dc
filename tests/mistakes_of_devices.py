"""Mistakes in isolators, dampers and stops, in the form of `mistakes`."""

from mistakes import ISOLATORS, building, run

PENDULUM = {"law": "friction_pendulum", "base_mass": 2e5, "displacement_capacity": 0.5, "stiffness": 4e8}
PENDULUM |= {"friction_coefficient": 0.06, "radius": 2.2}  # carrying 7.845e6 N, which is the weight on the bearings
FRICTION = {"devices": ("friction_damper",), "slip_force": 3e5, "brace_stiffness": 2e8}
VISCOUS = {"devices": ("viscous_damper",), "damper_coefficient": 6e5, "velocity_exponent": 0.4}
STOP = {"devices": ("gap",), "clearance": 0.05, "contact_stiffness": 1e9, "restitution": 0.6}


def isolated(**changes):
    return run(building().on_isolators(**ISOLATORS | changes))


def on_pendulums(**changes):
    return run(building().on_isolators(**PENDULUM | changes))


def with_devices(devices, **changes):
    return run(building(**devices | changes))


def tuned(*arguments, **named):
    return run(building().with_tuned_mass_damper(*arguments, **named))


SOUND = {
    "friction pendulums": on_pendulums,
    "lead-rubber bearings with dampers": lambda: isolated(damper_coefficient=4e5),
    "friction dampers": lambda: with_devices(FRICTION),
    "friction dampers in one storey": lambda: with_devices(
        FRICTION, slip_force=[3e5, 0, 0], brace_stiffness=[2e8, 0, 0]
    ),
    "viscous dampers of a power": lambda: with_devices(VISCOUS),
    "viscous dampers in one storey": lambda: with_devices(VISCOUS, damper_coefficient=[6e5, 0, 0]),
    "stops": lambda: with_devices(STOP),
    "a tuned mass damper": lambda: tuned(0.02, 0.97, 0.1, displacement_capacity=0.8),
    "a tuned mass damper without damping": lambda: tuned(0.02, 0.97, 0.0),
}
# With 8e5 kg above the isolators, that is 7.845e6 N; 2 pi sqrt(M / k) is the period of the rigid building.
DEVICES = {
    "radius of pendulums in mm": (
        lambda: on_pendulums(radius=2200.0),
        "radius of the friction pendulum at storey 1 is 2200 m (usual: 0.4 to 15 m)",
        "given in mm, it would be 2.2 m",
    ),
    "radius of pendulums in cm": (lambda: on_pendulums(radius=220.0), "is 220 m", "given in cm, it would be 2.2 m"),
    "radius of pendulums in feet": (lambda: on_pendulums(radius=30.0), "is 30 m", "given in feet, it would be 9.14 m"),
    "friction in percent": (lambda: on_pendulums(friction_coefficient=6.0), ValueError, "friction_coefficient is 6"),
    "friction of half a percent in percent": (
        lambda: on_pendulums(friction_coefficient=0.8),
        "friction coefficient of the bearings at storey 1 is 0.8 ",
        "given in percent, it would be 0.008",
    ),
    "weight on bearings in kN": (
        lambda: on_pendulums(weight=7845.0),
        "weight on the bearings over the weight above at storey 1 is 0.000999959",  # 7845 / 7845320
        "with weight given in kN, it would be 1",
    ),
    "weight on bearings as a mass": (
        lambda: on_pendulums(weight=800.0),
        "weight on the bearings over the weight above",
        "with weight given in tonnes",
    ),
    "stiffness of bearings in kN/m": (
        lambda: isolated(post_yield_stiffness=7.6e3),
        "period of the rigid building on its isolators at storey 1 is 64.4641 s",  # 2 pi sqrt(8e5 / 7.6e3)
        "with stiffness after yield given in kN/m or N/mm, it would be 2.04 s",
    ),
    "stiffness of elastic isolators in kN/mm": (
        lambda: run(building().on_isolators("elastic", base_mass=2e5, displacement_capacity=0.5, stiffness=7.6)),
        "period of the rigid building on its isolators",
        "kN/mm or MN/m, it would be 2.04 s",
    ),
    "yield force of bearings in kN": (
        lambda: isolated(yield_force=580.0),
        "yield force of the isolators over the weight above at storey 1 is 7.39294e-05",  # 580 / 7845320
        "with yield_force given in kN, it would be 0.0739",
    ),
    "stiffness before yield in kN/m": (
        lambda: isolated(stiffness=7.6e4, post_yield_stiffness=7.6e3),
        "displacement at which the isolators yield at storey 1 is 7.63158 m",
        "kN/m or N/mm, it would be 0.00763 m",
    ),
    "base mass in tonnes": (
        lambda: isolated(base_mass=200.0),
        "mass of the base over that of the first floor is 0.001",
        "with base_mass given in tonnes, it would be 1",
    ),
    "dampers of isolators in kN s/m": (
        lambda: isolated(damper_coefficient=400.0),
        "force of a viscous damper at 1 m/s over the weight above at storey 1",
        "given in kN (s/m)^exponent",
    ),
    "capacity of isolators in cm": (lambda: isolated(displacement_capacity=50.0), "displacement capacity", "in cm"),
    "braces of friction dampers in kN/m": (
        lambda: with_devices(FRICTION, brace_stiffness=2e5),
        "drift ratio at which the friction damper slips at storey 2 is 0.46875",  # 3e5 / 2e5 / 3.2
        "with brace_stiffness given in kN/m or N/mm, it would be 0.000469",
    ),
    "an exponent of nearly a friction damper": (
        lambda: with_devices(VISCOUS, velocity_exponent=0.04),
        "velocity exponent of the viscous damper at storey 1 is 0.04",
        "exponents of 0.15 to 1",
    ),
    "linear velocity in mm/s": (
        lambda: with_devices(VISCOUS, linear_velocity=10.0),
        "linear_velocity of the viscous damper at storey 1 is 10 m/s",
        "given in mm/s, it would be 0.01 m/s",
    ),
    "stiffness of stops in kN/mm": (
        lambda: with_devices(STOP, contact_stiffness=1e3),
        "stiffness of the stop over that of its storey at storey 1",
        "with contact_stiffness given in kN/mm or MN/m",
    ),
    "restitution of percent": (lambda: with_devices(STOP, restitution=60.0), ValueError, "restitution is 60", "0.6"),
    "hardly any restitution": (lambda: with_devices(STOP, restitution=0.01), "restitution of the stop at storey 1"),
    "mass ratio of a percent of a percent": (lambda: tuned(2e-4), "mass_ratio of the tuned mass damper is 0.0002"),
    "mass ratio in percent": (lambda: tuned(2.0), ValueError, "mass_ratio is 2", "2 % is 0.02"),
    "frequency of a tuned mass damper in Hz": (
        lambda: tuned(0.02, 6.5),
        "frequency_ratio of the tuned mass damper is 6.5 ",
        "divide it by the building's first frequency",
    ),
    "damping of a tuned mass damper in percent": (
        lambda: tuned(0.02, 0.97, 10.0),
        "damping_ratio of the tuned mass damper is 10 ",
        "given in percent, it would be 0.1",
    ),
    "room of a tuned mass damper in mm": (
        lambda: tuned(0.02, displacement_capacity=500.0),
        "displacement capacity at storey 4 is 500 m",
        "given in mm, it would be 0.5 m",
    ),
}
