"""Plausibility checks of wind forces; part of the table of checks."""

from __future__ import annotations

from collections.abc import Mapping

from warpdyn.foundations.core.plausibility.check import LENGTH, PERCENT, TIME, Check, G, given_in, with_units

_SPEED = {"km/h": 1 / 3.6, "mph": 0.44704, "knots": 1852 / 3600}
_LONG_TIME = TIME | {"minutes": 60.0, "hours": 3600.0}

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
