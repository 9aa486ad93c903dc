"""Bands of isolators, dampers, stops and tuned mass dampers.

Each band is wider than what is built, so that only a wrong unit or a slip leaves it; the comment above it says where it
comes from.
"""

from __future__ import annotations

from collections.abc import Mapping

from warpdyn.foundations.core.plausible_bands.band import (
    FORCE,
    IN_PERCENT,
    LENGTH,
    MASS,
    STIFFNESS,
    Band,
    Mistakes,
    given_in,
    with_units,
)

_EXPONENT: Mistakes = {"dampers of buildings have exponents of 0.15 to 1": None}
_VELOCITY = {"mm/s": 1e-3, "cm/s": 1e-2}

DEVICE_BANDS: Mapping[str, Band] = {
    # The pendulum's period 2 pi sqrt(R / g) is then 1.3 to 7.8 s; bearings are made for 2 to 6 s.
    "pendulum_radius": Band("radius of the friction pendulum", "m", 0.4, 15.0, given_in(LENGTH)),
    # Of PTFE and its composites on polished steel 0.02 to 0.15 (Constantinou, Mokha and Reinhorn 1990, Journal of
    # Structural Engineering 116), of unlubricated metal up to 0.3.
    "friction_coefficient": Band("friction coefficient of the bearings", "1", 0.005, 0.3, given_in(IN_PERCENT)),
    # Bearings carry the building; vertical accelerations and partial sets of bearings stay within.
    "bearing_weight_over_weight": Band(
        "weight on the bearings over the weight above",
        "1",
        0.1,
        3.0,
        with_units("weight", FORCE) | with_units("mass", MASS, -1),
    ),
    # Isolators are designed for a strength of 0.03 to 0.15 of the weight.
    "isolator_strength_over_weight": Band(
        "yield force of the isolators over the weight above",
        "1",
        2e-3,
        0.6,
        with_units("yield_force", FORCE) | with_units("mass", MASS, -1),
    ),
    # Lead yields after 5 to 30 mm of the bearing's drift, friction after 0.1 to 2 mm.
    "isolator_yield_displacement": Band(
        "displacement at which the isolators yield",
        "m",
        1e-5,
        0.15,
        with_units("stiffness", STIFFNESS, -1) | with_units("yield_force", FORCE),
    ),
    # By the stiffness after yield: isolated buildings have 1.5 to 5 s, machines on springs less.
    "isolated_period": Band(
        "period of the rigid building on its isolators",
        "s",
        0.3,
        15.0,
        with_units("stiffness after yield", STIFFNESS, -0.5) | with_units("mass", MASS, 0.5),
    ),
    "base_mass_over_floor": Band(
        "mass of the base over that of the first floor", "1", 0.02, 50.0, with_units("base_mass", MASS)
    ),
    # A brace is as stiff as its storey, about, so that the joint slips before the storey yields.
    "slip_drift_ratio": Band(
        "drift ratio at which the friction damper slips",
        "1",
        1e-7,
        0.05,
        with_units("brace_stiffness", STIFFNESS, -1) | with_units("slip_force", FORCE),
    ),
    # Makers name 0.15 to 1 (linear); below 0.1 a damper is a friction damper.
    "velocity_exponent": Band("velocity exponent of the viscous damper", "1", 0.1, 1.0, _EXPONENT),
    # It only rounds the force off around rest: far above it, dampers would hardly act; far below, steps get short.
    "linear_velocity": Band("linear_velocity of the viscous damper", "m/s", 1e-4, 0.1, given_in(_VELOCITY)),
    # Concrete stops have 1e9 to 1e10 N/m and storeys 1e7 to 1e9 N/m; a rubber bumper is softer than its storey.
    "stop_stiffness_over_storey": Band(
        "stiffness of the stop over that of its storey", "1", 0.02, 1e5, with_units("contact_stiffness", STIFFNESS)
    ),
    # Of colliding buildings 0.4 to 0.8 (Jankowski 2010, Earthquake Engineering and Structural Dynamics 39).
    "restitution": Band("coefficient of restitution of the stop", "1", 0.1, 1.0, given_in(IN_PERCENT)),
    # Tuned mass dampers weigh 0.5 to 10 % of the first mode's mass.
    "tuned_mass_ratio": Band("mass_ratio of the tuned mass damper", "1", 5e-4, 0.5, given_in(IN_PERCENT)),
    # Den Hartog's optimum is 1 / (1 + mass ratio).
    "tuned_frequency_ratio": Band(
        "frequency_ratio of the tuned mass damper",
        "1",
        0.4,
        2.5,
        {"given as a frequency in Hz or rad/s: it is over the building's first frequency": None},
    ),
    # Den Hartog's optimum is sqrt(3 mu / (8 (1 + mu))): 0.06 to 0.2 of mass ratios of 1 to 12 %.
    "tuned_damping_ratio": Band("damping_ratio of the tuned mass damper", "1", 1e-3, 0.7, given_in(IN_PERCENT)),
}
