"""The bands in which quantities of buildings, motions and runs usually lie, and likely mistakes of each.

Bounds refuse what cannot be; a band is of what is seldom meant: a value outside is most often given in another unit.
"""

from __future__ import annotations

from collections.abc import Mapping

from warpdyn.foundations.core.plausible_bands.band import (
    ACCELERATION,
    FORCE,
    IN_PERCENT,
    LARGEST_RECORDED,
    LENGTH,
    MASS,
    STIFFNESS,
    TAKEN_FOR_G,
    TIME,
    Band,
    Mistakes,
    given_in,
    given_one_in,
    with_units,
)
from warpdyn.foundations.core.plausible_bands.devices import DEVICE_BANDS
from warpdyn.foundations.core.units import STANDARD_GRAVITY

# The top storeys of FEMA's Hazus buildings without seismic design yield at 9.5e-5; forces in kN lead to 5e-5 at most.
LEAST_YIELD_DRIFT_RATIO = 7e-5
# Slope of the highest hazard of any site in logarithms, by which a factor of the intensity is one of the rate.
HIGHEST_HAZARD_SLOPE = 1.7
_PERIOD = with_units("stiffness", STIFFNESS, -0.5) | with_units("mass", MASS, 0.5)
_FACTOR: Mistakes = with_units("motions", ACCELERATION, -1) | {
    f"with levels given in {unit}": ours / STANDARD_GRAVITY for unit, ours in ACCELERATION.items() if unit != "g"
}
_FACTOR |= {"with levels given in m/s2": 1 / STANDARD_GRAVITY}
_LEVEL: Mistakes = {f"given in {unit}": ours / STANDARD_GRAVITY for unit, ours in ACCELERATION.items() if unit != "g"}
_LEVEL |= {"given in m/s2": 1 / STANDARD_GRAVITY}
VELOCITY = {"cm/s": 1e-2, "mm/s": 1e-3}
_IN_VELOCITIES = given_in(VELOCITY)
_RATIO = given_in(IN_PERCENT) | {"given as a drift in mm of a storey of 3 m": 1 / 3000}
_SPREAD: Mistakes = {"with its dispersion or deviation given in percent": None}
_AS_FREQUENCY: Mistakes = {"given as a frequency in Hz": None}
_DAMPED: Mistakes = {"damping='none' is the default; 5 % of critical is damping='rayleigh', damping_ratio=0.05": None}
_IN_MANY_YEARS: Mistakes = {"given as probabilities in many years: HazardCurve.from_probabilities takes these": None}
_WITH_ONE: Mistakes = {"with one of them in another unit than the others": None}
_IN_50_YEARS: Mistakes = {
    "with probabilities in 50 years given as annual rates (see HazardCurve.from_probabilities)": 1 / 50
}
G = STANDARD_GRAVITY


def _over_highest(units: Mapping[str, float], power: float = 1.0) -> Band:
    """Return the band of a hazard over the highest one, of a measure that goes by a power of the acceleration."""
    given = {f"with intensities given in {unit}": f ** (HIGHEST_HAZARD_SLOPE / power) for unit, f in units.items()}
    words = "annual rate of the hazard curve over the highest of any site at the same intensity"
    return Band(words, "1", 0.0, 1.0, given | _IN_50_YEARS)


def _of_hazard(words: str, unit: str, high: float, units: Mapping[str, float]) -> Band:
    return Band(f"{words} of a hazard curve", unit, 0.0, high, given_in(units))


# By name: words, unit, least and largest usual value, likely mistakes with the factor that undoes each. Inputs stand
# first: what follows from them is told after them.
BANDS: Mapping[str, Band] = {
    "random_factor": Band(
        "random factor",
        "1",
        0.1,
        10.0,
        given_in(IN_PERCENT) | {"as a value rather than a factor: RandomValue takes it": None} | _SPREAD,
    ),
    "random_value": Band(
        "random value over the nominal one",
        "1",
        1e-2,
        1e2,
        {"as a factor rather than a value: RandomFactor takes it": None, "given in another unit": None} | _SPREAD,
    ),
    "storey_height": Band("storey height", "m", 1.5, 30.0, given_in(LENGTH)),
    "mass_of_neighbours": Band(
        "mass of a floor over that of a neighbouring one", "1", 0.0, 50.0, given_one_in(MASS) | _WITH_ONE
    ),
    "stiffness_of_neighbours": Band(
        "stiffness of a storey over that of a neighbouring one", "1", 0.0, 200.0, given_one_in(STIFFNESS) | _WITH_ONE
    ),
    "gravity_load_of_neighbours": Band(
        "gravity load on a storey over that on a neighbouring one", "1", 0.0, 100.0, given_one_in(FORCE) | _WITH_ONE
    ),
    **DEVICE_BANDS,
    "displacement_capacity": Band("displacement capacity", "m", 0.02, 20.0, given_in(LENGTH)),
    "capacity_period": Band(
        "first period of the chain with this capacity curve",
        "s",
        0.02,
        20.0,
        {"with displacement given in mm and capacity in kN": 1e-3}
        | with_units("displacement", {"mm": 1e-3, "cm": 1e-2}, 0.5)
        | with_units("capacity", {"kN": 1e3, "g": G}, -0.5)
        | with_units("mass", MASS, 0.5),
    ),
    "capacity_yield_drift_ratio": Band(
        "yield drift ratio of the chain with this capacity curve",
        "1",
        LEAST_YIELD_DRIFT_RATIO,
        0.05,
        with_units("displacement", LENGTH) | with_units("height", LENGTH, -1),
    ),
    "capacity_base_shear_coefficient": Band(
        "strength of this capacity curve over the weight",
        "1",
        1e-3,
        10.0,
        with_units("capacity", {"kN": 1e3, "MN": 1e6, "g": G}) | with_units("mass", MASS, -1),
    ),
    "gravity_load_over_weight": Band(
        "gravity load over mass times g",
        "1",
        0.15,
        10.0,
        with_units("gravity_load", FORCE) | with_units("mass", MASS, -1),
    ),
    "first_period": Band("first period", "s", 0.02, 20.0, _PERIOD | given_in(TIME)),
    "first_period_over_height": Band(
        "first period over height", "s/m", 5e-3, 1.0, _PERIOD | with_units("height", LENGTH, -1)
    ),
    "yield_drift_ratio": Band(
        "yield drift ratio",
        "1",
        LEAST_YIELD_DRIFT_RATIO,
        0.05,
        with_units("yield_force", FORCE) | with_units("stiffness", STIFFNESS, -1) | with_units("height", LENGTH, -1),
    ),
    "yield_base_shear_coefficient": Band(
        "yield force of the first storey over the weight",
        "1",
        1e-3,
        10.0,
        with_units("yield_force", FORCE) | with_units("mass", MASS, -1),
    ),
    "stability_coefficient": Band(
        "largest P-Delta coefficient, gravity load over stiffness times height",
        "1",
        1e-4,
        1.0,
        with_units("gravity_load", FORCE) | with_units("height", LENGTH, -1),
    ),
    "plastic_drift_ratio": Band(
        "plastic drift to capping over storey height",
        "1",
        1e-3,
        0.5,
        given_in(LENGTH) | with_units("height", LENGTH, -1),
    ),
    "clearance_over_height": Band("clearance over storey height", "1", 0.0, 0.3, with_units("clearance", LENGTH)),
    "slip_force_over_weight": Band(
        "slip force over the weight above", "1", 1e-3, 10.0, given_in(FORCE) | with_units("mass", MASS, -1)
    ),
    "damping_ratio": Band(
        "damping ratio of the first mode",
        "1",
        1e-4,
        0.2,
        given_in(IN_PERCENT) | with_units("damping_coefficient", {"kN s/m": 1e3, "MN s/m": 1e6}),
    ),
    "damper_damping_ratio": Band(
        "damping ratio that the viscous dampers add to the first mode",
        "1",
        1e-3,
        2.0,
        with_units("damper_coefficient", {"kN s/m": 1e3, "MN s/m": 1e6}),
    ),
    "damper_force_over_weight": Band(
        "force of a viscous damper at 1 m/s over the weight above",
        "1",
        1e-3,
        10.0,
        with_units("damper_coefficient", {"kN (s/m)^exponent": 1e3, "MN (s/m)^exponent": 1e6})
        | with_units("mass", MASS, -1),
    ),
    "no_damping": Band("damping ratio of the first mode", "1", 1e-4, 0.2, _DAMPED),
    "record_step": Band("record step", "s", 5e-4, 0.05, given_in(TIME) | _AS_FREQUENCY),
    "peak_ground_acceleration": Band(
        "peak ground acceleration", "m/s2", 1e-4 * G, LARGEST_RECORDED, TAKEN_FOR_G | given_in(ACCELERATION), 0.3 * G
    ),
    "strongest_motion": Band(
        "peak ground acceleration of the strongest motion", "m/s2", 0.1 * G, 5 * G, given_in(ACCELERATION)
    ),
    "weakest_motions": Band(
        "peak ground acceleration over that of the next stronger motion of the set",
        "1",
        1 / 3,
        1.0,
        {"given in g among motions in m/s2, or in m/s2 and read as cm/s2": None},
    ),
    "record_baseline": Band(
        "baseline (a straight line fitted to the record) over the peak",
        "1",
        0.0,
        0.02,
        {"an offset is left in the record, which warpdyn.records.detrend takes out": None},
    ),
    "ground_damping_ratio": Band("damping ratio of the filter", "1", 0.02, 2.0, given_in(IN_PERCENT)),
    "scale_factor": Band("median scale factor", "1", 0.0, 10.0, _FACTOR | with_units("scale", IN_PERCENT)),
    "intensity_level": Band("intensity level", "g", 0.0, 8.0, _LEVEL),
    "lowest_intensity_level": Band("lowest intensity level", "g", 0.0, 1.5, _LEVEL),
    # Of records the largest PGV is some 3 m/s, PGD 10 m, Arias intensity 30 m/s and CAV 50 m/s; levels go beyond.
    "velocity_level": Band("level of the peak ground velocity", "m/s", 0.0, 10.0, _IN_VELOCITIES),
    "lowest_velocity_level": Band("lowest level of the peak ground velocity", "m/s", 0.0, 2.0, _IN_VELOCITIES),
    "displacement_level": Band("level of the peak ground displacement", "m", 0.0, 20.0, given_in(LENGTH)),
    "lowest_displacement_level": Band("lowest level of the peak ground displacement", "m", 0.0, 1.5, given_in(LENGTH)),
    "arias_level": Band("level of the Arias intensity", "m/s", 0.0, 200.0, _IN_VELOCITIES),
    "lowest_arias_level": Band("lowest level of the Arias intensity", "m/s", 0.0, 10.0, _IN_VELOCITIES),
    "absolute_velocity_level": Band("level of the cumulative absolute velocity", "m/s", 0.0, 200.0, _IN_VELOCITIES),
    "lowest_absolute_velocity_level": Band(
        "lowest level of the cumulative absolute velocity", "m/s", 0.0, 30.0, _IN_VELOCITIES
    ),
    "scale_factor_to_level": Band(
        "median scale factor",
        "1",
        0.0,
        10.0,
        with_units("motions", ACCELERATION, -1) | {"with levels given in another unit": None},
    ),
    "measure_period": Band(
        "period of the intensity measure or spectrum", "s", 5e-3, 20.0, given_in(TIME) | _AS_FREQUENCY
    ),
    "hazard_intensity": Band("first intensity of a hazard curve", "g", 0.0, 1.0, _LEVEL),
    "annual_rate": Band(
        "largest annual rate of a hazard curve", "a year", 0.0, 1.0, given_in(IN_PERCENT) | _IN_MANY_YEARS
    ),
    "annual_rate_near_one": Band("annual rate at a hazard curve's first points", "a year", 0.0, 0.9, _IN_MANY_YEARS),
    "event_rate": Band(
        "largest annual rate of an event",
        "a year",
        0.0,
        1.0,
        {"given as return periods, of which it takes 1 / period": None},
    ),
    "dispersion": Band("dispersion", "1", 0.05, 2.0, given_in(IN_PERCENT)),
    "return_period": Band(
        "return period",
        "year",
        0.5,
        1e6,
        {"given as an annual rate, of which it takes 1 / rate": None, "given in days": 1 / 365},
    ),
    "hazard_over_highest": _over_highest(
        {u: ours / G for u, ours in {"m/s2": 1.0, **ACCELERATION}.items() if u != "g"}
    ),
    "hazard_velocity": _of_hazard("peak ground velocity", "m/s", 10.0, VELOCITY),
    "hazard_velocity_over_highest": _over_highest(VELOCITY),
    "hazard_displacement": _of_hazard("peak ground displacement", "m", 20.0, LENGTH),
    "hazard_displacement_over_highest": _over_highest(LENGTH),
    "hazard_arias": _of_hazard("Arias intensity", "m/s", 200.0, VELOCITY),
    "hazard_arias_over_highest": _over_highest(VELOCITY, 2.0),
    "hazard_absolute_velocity": _of_hazard("cumulative absolute velocity", "m/s", 200.0, VELOCITY),
    "hazard_absolute_velocity_over_highest": _over_highest(VELOCITY),
    "initial_drift_ratio": Band("initial drift ratio", "1", 0.0, 0.5, with_units("displacement", LENGTH)),
    "initial_velocity": Band(
        "drift ratio that the initial velocity leads to",
        "1",
        0.0,
        0.5,
        with_units("velocity", {"mm/s": 1e-3, "cm/s": 1e-2}),
    ),
    "force_over_weight": Band(
        "largest force over the weight",
        "1",
        1e-5,
        20.0,
        with_units("the force", {"kN": 1e3, "MN": 1e6}),
    ),
    "drift_ratio_of_force": Band(
        "drift ratio that the largest force leads to at rest",
        "1",
        5e-6,
        0.5,
        with_units("the force", {"kN": 1e3, "MN": 1e6}),
    ),
    "integration_step": Band("integration step", "s", 0.0, 1.0, given_in(TIME) | _AS_FREQUENCY),
    "tail": Band("tail", "s", 0.0, 600.0, given_in(TIME) | {"given in steps": None}),
    "record_from": Band("start time of the recorders", "s", 0.0, 600.0, given_in(TIME) | {"given in steps": None}),
    "collapse_drift_ratio": Band("collapse drift ratio", "1", 5e-3, 0.5, _RATIO),
    "drift_limit": Band("drift limit", "1", 2e-4, 0.2, _RATIO),
    "drift_limit_in_metres": Band("limit of a storey drift", "m", 3e-4, 1.0, given_in(LENGTH)),
    "last_acceleration_of_losses": Band(
        "last demand of an acceleration loss function", "m s-2", 5.0, 200.0, given_in(ACCELERATION)
    ),
    "acceleration_limit": Band("floor acceleration limit", "m s-2", 0.5, 100.0, given_in(ACCELERATION)),
    "pushed_drift_ratio": Band("largest drift over height", "1", 0.0, 0.5, given_in(LENGTH)),
}
