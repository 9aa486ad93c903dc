"""Plausibility checks of forces, wind and actuators; part of the table of checks."""

from __future__ import annotations

import math
from collections.abc import Mapping

from warpdyn.foundations.core.plausibility.check import (
    DASHPOT,
    LENGTH,
    PERCENT,
    TIME,
    VELOCITY,
    Check,
    G,
    given_in,
    with_units,
)

_SPEED = {"km/h": 1 / 3.6, "mph": 0.44704, "knots": 1852 / 3600}
_LONG_TIME = TIME | {"minutes": 60.0, "hours": 3600.0}

LEAST_EFFECT = 5e-3  # acceleration due to an actuator over that due to the excitation; smaller ones count as none

# The bounds are far outside of what engineers use. They find other units and exchanged values, not rare structures.
CHECKS_OF_WIND: Mapping[str, Check] = {
    "wind_speed": Check("mean wind speed", "m/s", 0.5, 80.0, given_in(_SPEED), typical=30.0),
    # The reference is mostly 10 m above open country: above the speed on low floors in a city, below that on towers.
    "wind_reference_speed": Check(
        *("reference_speed over the mean wind speed at the highest floor", "1", 0.15, 2.5),
        with_units("reference_speed", _SPEED),
        typical=1.0,
    ),
    "wind_height": Check("height of the floor above the ground", "m", 0.5, 1000.0, given_in(LENGTH), typical=20.0),
    "wind_height_over_floor_below": Check(
        *("height of a floor over that of the floor before it", "1", 1.0, 50.0),
        {
            "floors may be listed from the top down: list them from the ground up": lambda value: value < 1,
            "one of them may be in another unit than the others": lambda value: value > 1,
        },
    ),
    # Exponents a of the power law U ~ z^a are 0.1 (sea) to 0.4 (centres of cities).
    "wind_profile_exponent": Check(
        *("exponent of a power law through the mean wind speeds at the lowest and highest floor", "1", -0.1, 1.0),
        {
            "height and mean_speed may be exchanged": lambda value: value > 1,
            "mean_speed may be listed from the top down: list it from the ground up": lambda value: value < 0,
        },
    ),
    "wind_area": Check(
        *("area of the face of the floor", "m2", 0.1, 2e4),
        given_in({"mm2": 1e-6, "cm2": 1e-4, "square feet": 0.3048**2}),
        typical=100.0,
    ),
    "wind_drag_coefficient": Check(
        *("drag coefficient", "1", 0.1, 5.0),
        given_in(PERCENT) | {"area and drag_coefficient may be exchanged": lambda value: value > 5},
    ),
    "wind_decay_coefficient": Check("decay coefficient of the coherence", "1", 1.0, 50.0, given_in(PERCENT)),
    "air_density": Check(
        *("density of the air", "kg/m3", 0.6, 1.5), given_in({"g/cm3": 1e3, "g/m3": 1e-3, "N/m3 of weight": 1 / G})
    ),
    "turbulence_intensity": Check(
        *("standard deviation of the turbulence over the mean wind speed", "1", 0.02, 0.6),
        given_in(PERCENT)
        | {
            "parameters of the spectrum may be in another unit, exchanged, or of another quantity (friction_velocity "
            "instead of standard_deviation)": None
        },
    ),
    "turbulence_length": Check(
        *("length of the turbulence spectrum", "m", 5.0, 5000.0), given_in({"km": 1e3} | LENGTH), typical=150.0
    ),
    "wind_step": Check("sampling step of the wind forces", "s", 0.0, 1.0, given_in(TIME), typical=0.1),
    "wind_duration": Check("duration of the wind forces", "s", 10.0, 4e4, given_in(_LONG_TIME), typical=600.0),
}

CHECKS_OF_ACTUATORS: Mapping[str, Check] = {
    # Servo-hydraulic actuators have 0.3 to 1.
    "actuator_damping_ratio": Check("damping_ratio of the actuator", "1", 1e-3, 5.0, given_in(PERCENT), typical=0.7),
    "actuator_stroke_limit": Check("stroke_limit of the actuator", "m", 0.0, 10.0, given_in(LENGTH), typical=0.3),
    "actuator_frequency": Check(
        *("frequency of the actuator", "Hz", 0.01, 5e3),
        given_in({"kHz": 1e3}) | {"it may be a time constant: give time_constant=": lambda value: value < 0.01},
        typical=10.0,
    ),
    "actuator_time_constant": Check(
        *("time_constant of the actuator", "s", 1e-5, 5.0),
        given_in(TIME) | {"it may be a frequency in Hz: give frequency= and damping_ratio=": lambda value: value > 5},
        typical=0.02,
    ),
}

# Kind of sensor -> units in which users give its noise or resolution by mistake.
_UNITS_OF_SENSORS: Mapping[str, Mapping[str, float]] = {
    "displacement": {"mm": 1e-3, "cm": 1e-2},
    "velocity": VELOCITY,
    "acceleration": {"mg": 1e-3 * G, "cm/s2 (gal)": 1e-2, "mm/s2": 1e-3},
}

CHECKS_OF_CONTROL: Mapping[str, Check] = {
    # Sensors resolve 1e-5 to 1e-2 of the peak of the response, which is often larger than the expected one.
    **{
        f"{name}_of_{kind}": Check(
            *(f"{words} of {kind} over the expected peak of the response,", "1", 0.0, 1.0),
            with_units(name.removeprefix("sensor_"), units),
            typical=1e-3,
        )
        for name, words in (("sensor_noise", "noise"), ("sensor_resolution", "resolution"))
        for kind, units in _UNITS_OF_SENSORS.items()
    },
    # Smaller forces have no effect on a building. Actuators in the storeys of a 20-storey building have 2 to 9 m/s2
    # (Palacios-Quinonero et al. 2012, Mathematical Problems in Engineering 2012, 636878, table 1). The force over the
    # weight of the structure is not checked: it may be 1e-5 for mass dampers, as for actuators with a limit in kN.
    "actuator_acceleration": Check(
        *("acceleration that force_limit gives the free ends of the actuator, over", "1", LEAST_EFFECT, math.inf),
        with_units("force_limit", {"kN": 1e3, "MN": 1e6}),
        typical=1.0,
    ),
    # The prototype has 1 kN, full-scale dampers have 200 kN (Yang et al. 2002, Engineering Structures 24).
    "mr_damper_acceleration": Check(
        "acceleration that the hysteretic force of the MRDamper at its voltage_limit gives its free ends, over",
        *("1", LEAST_EFFECT, math.inf),
        {
            "the default parameters are those of a laboratory prototype: multiply dashpot_0, dashpot_0_per_volt, "
            "stiffness_0, dashpot_1, dashpot_1_per_volt, stiffness_1, alpha and alpha_per_volt by one factor": None
        },
    ),
    "constant_force_acceleration": Check(
        *("acceleration that the value of ConstantCommand gives the free ends of the actuator, over", "1"),
        *(LEAST_EFFECT, math.inf),
        with_units("value", {"kN": 1e3, "MN": 1e6}),
        typical=0.3,
    ),
    # Delays of computers and valves are 1 to 100 ms.
    "control_delay_over_period": Check(
        *("delay of the control over the first period of the structure", "1", 0.0, 1.0),
        with_units("delay", {"ms": 1e-3}),
        typical=0.02,
    ),
    # Only delays of at most one period are compared with 1 s and with the duration of the run.
    "control_delay": Check(
        *("delay of the control", "s", 0.0, 1.0),
        given_in({"ms": 1e-3}),
        typical=0.02,
    ),
    # Dampers that add less have no effect. There is no upper bound, because a closed valve locks a damper.
    "variable_damper_ratio": Check(
        *("largest damping ratio that the VariableDampers with high= add to a mode", "1", 1e-3, math.inf),
        with_units("high", DASHPOT),
        typical=0.2,
    ),
    "constant_damper_ratio": Check(
        *("largest damping ratio that the value of ConstantCommand adds to a mode", "1", 1e-3, math.inf),
        with_units("value", DASHPOT),
        typical=0.2,
    ),
    "high_command_ratio": Check(
        *("largest damping ratio that the high coefficient of the controller adds to a mode", "1", 1e-3, math.inf),
        with_units("high of the controller", DASHPOT),
        typical=0.2,
    ),
    # Car bodies and seats have 0.2 to 1.
    "skyhook_ratio": Check(
        *("largest damping ratio that the coefficient of SkyhookDamper adds to a mode", "1", 1e-3, math.inf),
        with_units("coefficient", DASHPOT),
        typical=0.5,
    ),
}

CHECKS_OF_FORCES: Mapping[str, Check] = {
    "phase": Check(
        *("absolute value of the phase", "rad", 0.0, 2 * math.pi),
        given_in({"degrees": math.pi / 180}),
        typical=1.0,
    ),
    # Forces that are linear between samples are 19 % too small at a frequency of 1 / (4 step).
    "force_step_over_period": Check(
        *("sampling step of the force histories over the first period", "1", 0.0, 0.25),
        with_units("step", TIME)
        | {"the histories have too few samples for vibrations at the first period: give a shorter step=": None},
    ),
    # The eigenvalues depend on gains over masses; a regulator whose effect is smaller than this is useless.
    "regulator_effect": Check(
        *("largest change of an eigenvalue of the structure by the regulator, over the largest one,", "1", 1e-6, 1e9),
        {
            "force_weight may be too large or state_weight too small: with state_weight='energy' and forces in N, "
            "force_weight is often 1e-12 to 1e-6": None
        },
    ),
    **CHECKS_OF_WIND,
    **CHECKS_OF_ACTUATORS,
    **CHECKS_OF_CONTROL,
}
