"""The table of plausibility checks: usual values of quantities, and mistakes that lead to unusual values.

Impossible values are errors. A plausibility check warns of possible values that users rarely intend, mostly because of
a wrong unit. The range of usual values is wider than in practice; comments give sources. A check of a building also has
a function that computes the checked quantity from a `BuildingView` (warpdyn/model/scene), the table of its parameters.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.foundations.core.plausibility.check import (
    ACCELERATION,
    ACCELERATION_IN_G,
    DASHPOT,
    FORCE,
    LARGEST_RECORDED,
    LEAST_YIELD_DRIFT_RATIO,
    LENGTH,
    MASS,
    PERCENT,
    STIFFNESS,
    TIME,
    VELOCITY,
    Check,
    G,
    Mistakes,
    given_in,
    one_in,
    over_highest,
    with_units,
)
from warpdyn.foundations.core.plausibility.forces import CHECKS_OF_FORCES
from warpdyn.foundations.core.plausibility.frames import CHECKS_OF_FRAMES
from warpdyn.foundations.core.plausibility.motions_and_targets import CHECKS_OF_MOTIONS
from warpdyn.foundations.core.plausibility.soil_and_footings import CHECKS_OF_FOUNDATIONS

_MASS, _PER_MASS = with_units("mass", MASS, 0.5), with_units("mass", MASS, -1)
_PER_HEIGHT, _PER_STIFFNESS = with_units("height", LENGTH, -1), with_units("stiffness", STIFFNESS, -1)
_YIELD_FORCE, _DISPLACEMENT = with_units("yield_force", FORCE), with_units("displacement", LENGTH)
_GRAVITY_LOAD, _THE_FORCE = with_units("gravity_load", FORCE), with_units("the force", {"kN": 1e3, "MN": 1e6})
_CAPACITY = with_units("capacity", {"kN": 1e3, "MN": 1e6, "g": G})
_PERIOD = with_units("stiffness", STIFFNESS, -0.5) | _MASS
_DAMPER = with_units("damper_coefficient", {"kN (s/m)^exponent": 1e3, "MN (s/m)^exponent": 1e6})
_MOTIONS = with_units("motions", ACCELERATION, -1)
_RATIO = given_in(PERCENT) | {"if given as a drift in mm of a storey of 3 m": 1 / 3000}
_SPREAD: Mistakes = {"with its dispersion or deviation given in percent": None}
_DEVIATIONS: Mistakes = {"they may be deviations from 1: give 1 + deviation": lambda factor: factor < 1}
_DURATION: Mistakes = given_in(TIME) | {"it may be a number of steps": None}
_AS_FREQUENCY: Mistakes = given_in(TIME) | {"it may be a frequency in Hz": lambda value: value >= 10}
_IN_MANY_YEARS: Mistakes = {
    "these may be probabilities in many years, for which there is HazardCurve.from_probabilities": None,
    "they may be return periods: give 1 / period": lambda value: value > 10,
}

# In the order in which a warning lists them: first arguments, then quantities that are computed from arguments.
CHECKS: Mapping[str, Check] = {
    "measured_drift": Check("largest measured drift", "m", 1e-5, 2.0, given_in(LENGTH)),
    # Priors are wide, so the peak of the median candidate may be several times the measured peak.
    **{
        f"measured_{name}": Check(
            *(f"measured peak {name.replace('_', ' ')} over that of the median candidate", "1", 1 / most, most),
            with_units("the measurement", units),
            typical=1.0,
        )
        for name, units, most in (
            ("force", FORCE, 50.0),
            ("storey_force", FORCE, 50.0),
            ("acceleration", ACCELERATION, 7.0),
            ("velocity", VELOCITY, 20.0),
            ("displacement", LENGTH, 20.0),
        )
    },
    "random_factor": Check(
        *("random factor", "1", 0.1, 10.0),
        given_in(PERCENT)
        | {"it may be a value rather than a factor: RandomValue takes it": None}
        | {"for a change of units, multiply the nominal value instead": lambda x: not 2e-3 < x < 500}
        | _SPREAD,
    ),
    "given_factor": Check(
        *("given factor", "1", 0.1, 10.0),
        given_in(PERCENT)
        | {"it may be a deviation from 1: give 1 + deviation": lambda factor: factor < 1}
        | {"it may be a value rather than a factor: GivenValues takes it": lambda factor: factor > 1},
    ),
    "median_given_factor": Check("median of the given factors", "1", 0.6, 3.0, _DEVIATIONS),
    "random_value": Check(
        *("random value over the nominal one", "1", 1e-2, 1e2),
        {
            "it may be a factor rather than a value: RandomFactor takes it": None,
            "it may be in another unit": None,
            **_SPREAD,
        },
    ),
    # One turn is 6.28 rad; slightly more is left for angles such as 400 degrees.
    "incidence_angle": Check("angle of incidence", "rad", 0.0, 7.0, given_in({"degrees": np.pi / 180})),
    "storey_height": Check(
        "storey height", "m", 1.5, 30.0, given_in(LENGTH), of_storeys=lambda b: b.in_own(b["height"])
    ),
    "mass_of_neighbours": Check(
        *("mass of a floor over that of a neighbouring one", "1", 0.0, 50.0, one_in(MASS)),
        of_building=lambda b: b.mass_over_neighbour,
    ),
    "stiffness_of_neighbours": Check(
        *("stiffness of a storey over that of a neighbouring one", "1", 0.0, 200.0, one_in(STIFFNESS)),
        of_building=lambda b: b.over_neighbour("stiffness"),
    ),
    "gravity_load_of_neighbours": Check(
        *("gravity load on a storey over that on a neighbouring one", "1", 0.0, 100.0, one_in(FORCE)),
        of_building=lambda b: b.over_neighbour("gravity_load"),
    ),
    # A pendulum with these radii has a period 2 pi sqrt(R / g) of 1.3 to 7.8 s; bearings are made for 2 to 6 s.
    "pendulum_radius": Check(
        *("radius of the friction pendulum", "m", 0.4, 15.0, given_in(LENGTH)),
        of_storeys=lambda b: b["radius"],
    ),
    # PTFE and its composites on polished steel have 0.02 to 0.15 (Constantinou, Mokha and Reinhorn 1990, Journal of
    # Structural Engineering 116), unlubricated metal up to 0.3.
    "friction_coefficient": Check(
        *("friction coefficient of the bearings", "1", 0.005, 0.3, given_in(PERCENT)),
        of_storeys=lambda b: b.above_0("friction_coefficient"),
    ),
    # Bearings carry the building; the range allows for vertical accelerations and for partial sets of bearings.
    "bearing_weight_over_weight": Check(
        *("weight on the bearings over the weight above", "1", 0.1, 3.0, with_units("weight", FORCE) | _PER_MASS),
        of_storeys=lambda b: b["weight"] / b.weight_above,
    ),
    # Isolators are designed for a strength of 0.03 to 0.15 of the weight.
    "isolator_strength_over_weight": Check(
        *("yield force of the isolators over the weight above", "1", 2e-3, 0.6, _YIELD_FORCE | _PER_MASS),
        of_storeys=lambda b: b.in_isolators(b["yield_force"]) / b.weight_above,
    ),
    # Lead yields after 5 to 30 mm of the bearing's drift, friction after 0.1 to 2 mm.
    "isolator_yield_displacement": Check(
        *("displacement at which the isolators yield", "m", 1e-5, 0.15, _PER_STIFFNESS | _YIELD_FORCE),
        of_storeys=lambda b: b.in_isolators(b["yield_force"]) / b["stiffness"],
    ),
    # Computed from the stiffness after yield. Isolated buildings have 1.5 to 5 s, machines on springs less.
    "isolated_period": Check(
        *("period of the rigid building on its isolators", "s", 0.3, 15.0),
        with_units("stiffness after yield", STIFFNESS, -0.5) | _MASS,
        of_storeys=lambda b: b.isolated_period,
    ),
    "base_mass_over_floor": Check(
        *("mass of the base over that of the first floor", "1", 0.02, 50.0, with_units("base_mass", MASS)),
        of_building=lambda b: b.in_isolators(b["mass"])[:, :-1][:, :1] / b["mass"][:, 1:2],
    ),
    # A brace is about as stiff as its storey, so that the joint slips before the storey yields.
    "slip_drift_ratio": Check(
        *("drift ratio at which the friction damper slips", "1", 1e-7, 0.05),
        with_units("brace_stiffness", STIFFNESS, -1) | with_units("slip_force", FORCE),
        of_storeys=lambda b: b.above_0("slip_force") / b.above_0("brace_stiffness") / b["height"],
    ),
    # Manufacturers give 0.15 to 1 (1: linear); below 0.1 a viscous damper acts like a friction damper.
    "velocity_exponent": Check(
        *("velocity exponent of the viscous damper", "1", 0.1, 1.0),
        {"dampers of buildings have exponents of 0.15 to 1": None},
        of_storeys=lambda b: np.where(b["damper_coefficient"] > 0, b["velocity_exponent"], np.nan),
    ),
    # It only smooths the force near zero velocity. Above the range dampers have little effect; below, steps get short.
    "linear_velocity": Check(
        *("linear_velocity of the viscous damper", "m/s", 1e-4, 0.1, given_in(VELOCITY)),
        of_storeys=lambda b: np.where(b.is_power_damper, b["linear_velocity"], np.nan),
    ),
    # Concrete stops have 1e9 to 1e10 N/m and storeys 1e7 to 1e9 N/m; a rubber bumper is softer than its storey.
    "stop_stiffness_over_storey": Check(
        *("stiffness of the stop over that of its storey", "1", 0.02, 1e5, with_units("contact_stiffness", STIFFNESS)),
        of_storeys=lambda b: b.above_0("contact_stiffness") / b["stiffness"],
    ),
    # Colliding buildings have 0.4 to 0.8 (Jankowski 2010, Earthquake Engineering and Structural Dynamics 39).
    "restitution": Check(
        *("coefficient of restitution of the stop", "1", 0.1, 1.0, given_in(PERCENT)),
        of_storeys=lambda b: np.where(b["contact_stiffness"] > 0, b["restitution"], np.nan),
    ),
    # Tuned mass dampers weigh 0.5 to 10 % of the first mode's mass.
    "tuned_mass_ratio": Check("mass_ratio of the tuned mass damper", "1", 5e-4, 0.5, given_in(PERCENT)),
    # Den Hartog's optimum is 1 / (1 + mass ratio).
    "tuned_frequency_ratio": Check(
        *("frequency_ratio of the tuned mass damper", "1", 0.4, 2.5),
        {"it may be a frequency in Hz or rad/s: divide it by the building's first frequency": None},
    ),
    # Den Hartog's optimum is sqrt(3 mu / (8 (1 + mu))): 0.06 to 0.2 for mass ratios of 1 to 12 %.
    "tuned_damping_ratio": Check("damping_ratio of the tuned mass damper", "1", 1e-3, 0.7, given_in(PERCENT)),
    "displacement_capacity": Check(
        *("displacement capacity", "m", 0.02, 20.0, given_in(LENGTH)),
        of_storeys=lambda b: b.displacement_capacity,
    ),
    "capacity_period": Check(
        *("first period of the chain with this capacity curve", "s", 0.02, 20.0),
        {"with displacement given in mm and capacity in kN": 1e-3}
        | with_units("displacement", {"mm": 1e-3, "cm": 1e-2}, 0.5)
        | with_units("capacity", {"kN": 1e3, "g": G}, -0.5)
        | _MASS,
    ),
    "capacity_yield_drift_ratio": Check(
        *("yield drift ratio of the chain with this capacity curve", "1", LEAST_YIELD_DRIFT_RATIO, 0.05),
        _DISPLACEMENT | _PER_HEIGHT,
    ),
    "capacity_base_shear_coefficient": Check(
        "strength of this capacity curve over the weight", "1", 1e-3, 10.0, _CAPACITY | _PER_MASS
    ),
    "gravity_load_over_weight": Check(
        *("gravity load over mass times g", "1", 0.15, 10.0, _GRAVITY_LOAD | _PER_MASS),
        of_building=lambda b: b["gravity_load"].sum(axis=1) / b.weight_above[:, 0],
    ),
    # Quantities of the springs of lumped structures. Friction slips after 0.1 mm, isolators yield after 5 to 150 mm.
    "spring_yield_deformation": Check(
        *("deformation at which the spring yields", "m", 2e-5, 1.0, _YIELD_FORCE | _PER_STIFFNESS),
    ),
    "spring_yield_rotation": Check(
        *("rotation at which the spring yields", "rad", 1e-5, 0.2),
        with_units("yield_force", {"kN m": 1e3, "MN m": 1e6, "N mm": 1e-3})
        | with_units("stiffness", {"kN m/rad": 1e3, "MN m/rad": 1e6}, -1),
    ),
    "springs_yield_over_weight": Check(
        *("yield forces of all springs over the weight", "1", 2e-3, 200.0, _YIELD_FORCE | _PER_MASS),
    ),
    "spring_deformation_capacity": Check(
        *("deformation capacity of the spring", "m", 5e-4, 5.0),
        with_units("deformation_capacity", LENGTH) | {"if given in percent of a storey of 3 m": 0.03},
    ),
    "spring_clearance": Check("clearance of the spring", "m", 0.0, 2.0, with_units("clearance", LENGTH)),
    # Jankowski (2005) and later papers: 1e8 to 1e10 N/m^1.5 for pounding buildings, up to 1e12 for steel on steel.
    "hertz_stiffness": Check(
        *("Hertz stiffness of the contact", "N m-1.5", 1e7, 1e14),
        given_in({"kN/m^1.5": 1e3, "N/mm^1.5": 1e3**1.5}),
    ),
    # Anagnostopoulos (1988) and later papers: 1e7 to 1e10 N/m for pounding buildings; a rubber bumper has 1e6 N/m.
    "spring_contact_stiffness": Check("stiffness of the contact", "N/m", 2e5, 1e12, given_in(STIFFNESS)),
    # Users may give the mass of a whole building instead of that of a floor.
    "impact_mass_over_masses": Check(
        *("impact_mass of the contact over m1 m2 / (m1 + m2) of its masses", "1", 0.02, 50.0),
        with_units("impact_mass", MASS),
    ),
    # All of the weight that only sliders hold is usually on them; the range allows for vertical accelerations.
    "slider_weight_over_weight": Check(
        *("weight on the sliders over the weight that moves on them", "1", 0.25, 3.0),
        with_units("weight", FORCE) | _PER_MASS,
    ),
    "spring_radius": Check("radius of the slider", "m", 0.4, 15.0, given_in(LENGTH)),
    **CHECKS_OF_FOUNDATIONS,
    **CHECKS_OF_FRAMES,
    **CHECKS_OF_FORCES,
    "plan_side": Check("side of the plan", "m", 2.0, 400.0, given_in(LENGTH)),
    # A uniform rectangle has 0.58; 1 is a mass in the corners.
    "gyration_over_plan": Check(
        *("radius of gyration of a floor over half the diagonal of the plan", "1", 0.1, 1.0),
        with_units("inertia", {"t m2": 1e3, "kN m2 of weight": 1e3 / G}, 0.5)
        | with_units("floor_mass", MASS, -0.5)
        | {"inertia may be the radius of gyration: give mass * radius**2": lambda value: value < 0.1},
    ),
    "first_period": Check(
        *("first period", "s", 0.02, 20.0),
        _PERIOD | given_in(TIME) | {"mass and stiffness may be swapped": lambda period: period > 20},
        of_building=lambda b: b.period,
    ),
    # Buildings with one storey are not checked: they may be oscillators, whose height only divides the drift.
    "first_period_over_height": Check(
        *("first period over height", "s/m", 5e-3, 1.0, _PERIOD | _PER_HEIGHT),
        of_building=lambda b: b.period_over_height,
    ),
    "yield_drift_ratio": Check(
        *("yield drift ratio", "1", LEAST_YIELD_DRIFT_RATIO, 0.05, _YIELD_FORCE | _PER_STIFFNESS | _PER_HEIGHT),
        of_storeys=lambda b: b.in_own(b["yield_force"]) / b["stiffness"] / b["height"],
    ),
    "yield_base_shear_coefficient": Check(
        *("yield force of the first storey over the weight", "1", 1e-3, 10.0, _YIELD_FORCE | _PER_MASS),
        of_building=lambda b: (b.in_own(b["yield_force"]) / b.weight_above)[:, 0],
    ),
    "stability_coefficient": Check(
        *("largest P-Delta coefficient, gravity load over stiffness times height", "1", 1e-4, 1.0),
        _GRAVITY_LOAD | _PER_HEIGHT,
        of_building=lambda b: b.stability_coefficient,
    ),
    "plastic_drift_ratio": Check(
        *("plastic drift to capping over storey height", "1", 1e-3, 0.5, given_in(LENGTH) | _PER_HEIGHT),
        of_storeys=lambda b: b["plastic_drift_to_capping"] / b["height"],
    ),
    "clearance_over_height": Check(
        *("clearance over storey height", "1", 0.0, 0.3, with_units("clearance", LENGTH)),
        of_storeys=lambda b: np.where(b["contact_stiffness"] > 0, b.in_own(b["clearance"]) / b["height"], np.nan),
    ),
    "slip_force_over_weight": Check(
        *("slip force over the weight above", "1", 1e-3, 10.0, given_in(FORCE) | _PER_MASS),
        of_storeys=lambda b: b.above_0("slip_force") / b.weight_above,
    ),
    "damping_ratio": Check(
        *("damping ratio of the first mode", "1", 1e-4, 0.2),
        given_in(PERCENT) | with_units("damping_coefficient", DASHPOT),
        of_building=lambda b: b.damping_ratio if b.damping_ratio.any() else np.full(1, np.nan),
    ),
    "damper_damping_ratio": Check(
        *("damping ratio that the viscous dampers add to the first mode", "1", 1e-3, 2.0),
        with_units("damper_coefficient", DASHPOT),
        of_building=lambda b: b.damper_damping_ratio,
    ),
    "damper_force_over_weight": Check(
        *("force of a viscous damper at 1 m/s over the weight above", "1", 1e-3, 10.0, _DAMPER | _PER_MASS),
        of_storeys=lambda b: b.damper_force / b.weight_above,
    ),
    "no_damping": Check(
        *("damping ratio of the first mode", "1", 1e-4, 0.2),
        {"damping='none' is the default; 5 % of critical is damping='rayleigh', damping_ratio=0.05": None},
        of_building=lambda b: np.where(b.needs_damping, b.damping_ratio, np.nan),
    ),
    "record_step": Check("record step", "s", 5e-4, 0.05, _AS_FREQUENCY | {"with the decimal point misplaced": 0.1}),
    "peak_ground_acceleration": Check(
        *("peak ground acceleration", "m/s2", 1e-4 * G, LARGEST_RECORDED),
        given_in({"m/s2 and read as g": 1 / G} | ACCELERATION),
        typical=0.3 * G,
    ),
    "strongest_motion": Check(
        "peak ground acceleration of the strongest motion", "m/s2", 0.1 * G, 5 * G, given_in(ACCELERATION)
    ),
    "weakest_motions": Check(
        *("peak ground acceleration over that of the next stronger motion of the set", "1", 1 / 3, 1.0),
        {"it may be given in g among motions in m/s2, or in m/s2 and read as cm/s2": None},
    ),
    "record_baseline": Check(
        *("baseline (a straight line fitted to the record) over the peak", "1", 0.0, 0.02),
        {
            "the values may be the time column": lambda ratio: 0.98 < ratio < 1.02,
            "the values may be a velocity or a displacement": lambda ratio: ratio > 0.5 and not 0.98 < ratio < 1.02,
            "the record has an offset, which warpdyn.records.detrend removes": lambda ratio: not 0.98 < ratio < 1.02,
        },
    ),
    "ground_damping_ratio": Check("damping ratio of the filter", "1", 0.02, 2.0, given_in(PERCENT)),
    "scale_factor": Check(
        *("median scale factor", "1", 0.0, 10.0),
        _MOTIONS | with_units("levels", ACCELERATION_IN_G) | with_units("scale", PERCENT),
    ),
    "intensity_level": Check("intensity level", "g", 0.0, 8.0, given_in(ACCELERATION_IN_G)),
    "lowest_intensity_level": Check("lowest intensity level", "g", 0.0, 1.5, given_in(ACCELERATION_IN_G)),
    # Records have up to 3 m/s of PGV, 10 m of PGD, 30 m/s of Arias intensity, 50 m/s of CAV; levels may be higher.
    "velocity_level": Check("level of the peak ground velocity", "m/s", 0.0, 10.0, given_in(VELOCITY)),
    "lowest_velocity_level": Check("lowest level of the peak ground velocity", "m/s", 0.0, 2.0, given_in(VELOCITY)),
    "displacement_level": Check("level of the peak ground displacement", "m", 0.0, 20.0, given_in(LENGTH)),
    "lowest_displacement_level": Check("lowest level of the peak ground displacement", "m", 0.0, 1.5, given_in(LENGTH)),
    "arias_level": Check("level of the Arias intensity", "m/s", 0.0, 200.0, given_in(VELOCITY)),
    "lowest_arias_level": Check("lowest level of the Arias intensity", "m/s", 0.0, 10.0, given_in(VELOCITY)),
    "absolute_velocity_level": Check(
        "level of the cumulative absolute velocity", "m/s", 0.0, 200.0, given_in(VELOCITY)
    ),
    "lowest_absolute_velocity_level": Check(
        "lowest level of the cumulative absolute velocity", "m/s", 0.0, 30.0, given_in(VELOCITY)
    ),
    "scale_factor_to_level": Check(
        "median scale factor", "1", 0.0, 10.0, _MOTIONS | {"the levels may be in another unit": None}
    ),
    "measure_period": Check("period of the intensity measure or spectrum", "s", 5e-3, 20.0, _AS_FREQUENCY),
    "hazard_intensity": Check("first intensity of a hazard curve", "g", 0.0, 1.0, given_in(ACCELERATION_IN_G)),
    "annual_rate": Check(
        "largest annual rate of a hazard curve", "a year", 0.0, 1.0, given_in(PERCENT) | _IN_MANY_YEARS
    ),
    "annual_rate_near_one": Check("annual rate at a hazard curve's first points", "a year", 0.0, 0.9, _IN_MANY_YEARS),
    "event_rate": Check(
        *("largest annual rate of an event", "a year", 0.0, 1.0),
        {"they may be given as return periods: give 1 / period": None},
    ),
    "dispersion": Check("dispersion", "1", 0.05, 2.0, given_in(PERCENT)),
    "return_period": Check(
        *("return period", "year", 0.5, 1e6),
        {"it may be given as an annual rate: give 1 / rate": None, "if given in days": 1 / 365},
    ),
    "hazard_over_highest": over_highest(ACCELERATION_IN_G),
    "hazard_velocity": Check("peak ground velocity of a hazard curve", "m/s", 0.0, 10.0, given_in(VELOCITY)),
    "hazard_velocity_over_highest": over_highest(VELOCITY),
    "hazard_displacement": Check("peak ground displacement of a hazard curve", "m", 0.0, 20.0, given_in(LENGTH)),
    "hazard_displacement_over_highest": over_highest(LENGTH),
    "hazard_arias": Check("Arias intensity of a hazard curve", "m/s", 0.0, 200.0, given_in(VELOCITY)),
    "hazard_arias_over_highest": over_highest(VELOCITY, 2.0),
    "hazard_absolute_velocity": Check(
        "cumulative absolute velocity of a hazard curve", "m/s", 0.0, 200.0, given_in(VELOCITY)
    ),
    "hazard_absolute_velocity_over_highest": over_highest(VELOCITY),
    "initial_drift_ratio": Check("initial drift ratio", "1", 0.0, 0.5, _DISPLACEMENT),
    "initial_velocity": Check(
        "drift ratio that the initial velocity leads to", "1", 0.0, 0.5, with_units("velocity", VELOCITY)
    ),
    "force_over_weight": Check("largest force over the weight", "1", 1e-5, 20.0, _THE_FORCE),
    "drift_ratio_of_force": Check("static drift ratio under the largest force", "1", 5e-6, 0.5, _THE_FORCE),
    "integration_step": Check("integration step", "s", 0.0, 1.0, _AS_FREQUENCY),
    "tail": Check("tail", "s", 0.0, 600.0, _DURATION),
    "record_from": Check("start time of the recorders", "s", 0.0, 600.0, _DURATION),
    "collapse_drift_ratio": Check(
        *("collapse drift ratio", "1", 5e-3, 0.5, _RATIO),
        of_storeys=lambda b: b.in_own(b.drift_ratio_capacity),
    ),
    "drift_limit": Check("drift limit", "1", 2e-4, 0.2, _RATIO),
    "drift_limit_in_metres": Check("limit of a storey drift", "m", 3e-4, 1.0, given_in(LENGTH)),
    "last_acceleration_of_losses": Check(
        "last demand of an acceleration loss function", "m s-2", 5.0, 200.0, given_in(ACCELERATION)
    ),
    "acceleration_limit": Check("floor acceleration limit", "m s-2", 0.5, 100.0, given_in(ACCELERATION)),
    **CHECKS_OF_MOTIONS,
    "pushed_drift_ratio": Check("largest drift over height", "1", 0.0, 0.5, given_in(LENGTH)),
}
