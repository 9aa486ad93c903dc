"""Plausibility checks of the tables of plane frames; part of the table of checks."""

from __future__ import annotations

import math
from collections.abc import Mapping

from warpdyn.foundations.core.plausibility.check import (
    FORCE,
    LENGTH,
    MASS,
    PERCENT,
    Check,
    G,
    Mistakes,
    given_in,
    one_in,
    with_units,
)
from warpdyn.foundations.core.plausibility.frame_springs_and_loads import CHECKS_OF_SPRINGS_AND_LOADS

# Parameter of frames whose values users give for each structure -> units by mistake.
_UNITS_OF_GIVEN: Mapping[str, Mapping[str, float]] = {
    "elastic_modulus": {"MPa or N/mm2": 1e6, "GPa or kN/mm2": 1e9, "kPa or kN/m2": 1e3, "ksi": 6.894757e6},
    "area": {"mm2": 1e-6, "cm2": 1e-4},
    "second_moment": {"mm4": 1e-12, "cm4": 1e-8},
    "mass": MASS,
}

# Likely mistakes that lead to checked quantities of all structures, for frames, whose stiffnesses users do not give.
FRAME_PERIOD: Mistakes = with_units("masses", MASS, 0.5) | {
    "masses [kg], elastic_modulus [Pa] or second_moment [m4] may be in another unit": lambda value: value > 1,
    "spring_start and spring_end may be in kN m/rad instead of N m/rad": lambda value: value > 1,
}
FRAME_YIELD: Mapping[bool, Mistakes] = {  # of a hinge, and of a brace
    True: with_units("yield_force", {"kN m": 1e3, "MN m": 1e6, "N mm": 1e-3}),
    False: with_units("yield_force", {"kN": 1e3, "MN": 1e6}) | with_units("area", {"mm2": 1e-6, "cm2": 1e-4}, -1),
}

CHECKS_OF_FRAMES: Mapping[str, Check] = {
    # Parts of members between nodes may be short; spans of 100 m are those of bridges.
    "member_length": Check("length of the member", "m", 0.01, 150.0, given_in(LENGTH), typical=5.0),
    # Masonry has 1e9 Pa, steel 2e11 Pa; members that replace rigid parts may be stiffer.
    "elastic_modulus": Check(
        *("elastic_modulus of the section", "Pa", 5e8, 1e13),
        given_in({"MPa or N/mm2": 1e6, "GPa or kN/mm2": 1e9, "kPa or kN/m2": 1e3, "ksi": 6.894757e6}),
        typical=1e11,
    ),
    # Only large values are unusual: sections with a very large area do not change their length.
    "radius_of_gyration": Check(
        *("radius of gyration of the section, (second_moment / area)**0.5,", "m", 0.0, 5.0),
        with_units("second_moment", {"mm4": 1e-12, "cm4": 1e-8}, 0.5)
        | with_units("area", {"mm2": 1e-6, "cm2": 1e-4}, -0.5)
        | {"with area in mm2 and second_moment in mm4": 1e-3, "with area in cm2 and second_moment in cm4": 1e-2},
        typical=0.2,
    ),
    # Only areas that lead to an implausible radius of gyration are compared.
    "area_of_one_section": Check(
        *("area of the section", "1", 0.01, 100.0),
        with_units("area", {"mm2": 1e-6, "cm2": 1e-4}),
        typical=1.0,
    ),
    # The weak axis of steel sections has 0.03 times the second moment of the strong one.
    "second_moment_of_one_section": Check(
        *("second_moment over area**2 of the section", "1", 0.015, 40.0),
        {
            "if multiplied by 100 by mistake (1 cm4 is 1e-8 m4)": 1e-2,
            "if multiplied by 1e4 by mistake (1 cm4 is 1e-8 m4, 1 mm4 is 1e-12 m4)": 1e-4,
            "if divided by 100 by mistake (1 cm4 is 1e-8 m4)": 1e2,
            "if divided by 1e4 by mistake (1 cm4 is 1e-8 m4, 1 mm4 is 1e-12 m4)": 1e4,
            "give a power of ten, such as 1.0, for a rigid member": lambda value: value > 1,
        },
        typical=1.0,
    ),
    # Joints of a perimeter frame have 1 to 10 % of the load of a leaning column.
    "gravity_load_of_one": Check(
        *("gravity_load", "1", 5e-3, 300.0),
        with_units("gravity_load", {"kN or kN/m": 1e3, "MN or MN/m": 1e6})
        | {
            "gravity_load is downward if it is above 0: remove the minus sign": lambda value: value < 0,
            "it may be multiplied by 1,000 twice, or in another unit than the others": lambda value: value > 300,
        },
        typical=1.0,
    ),
    # Gravity loads may be those of the joints only, without the leaning columns.
    "frame_gravity_over_weight": Check(
        *("gravity loads of the frame over its masses times g", "1", 0.0, 30.0),
        with_units("masses", MASS, -1),
        typical=1.0,
    ),
    "frame_weight_over_gravity": Check(
        *("masses of the frame times g over its gravity loads", "1", 0.0, 100.0),
        with_units("gravity_load", {unit: size for unit, size in FORCE.items() if size >= 1e3}, -1),
        typical=1.0,
    ),
    "truss_width_over_length": Check(
        *("width over length, area**0.5 / length, of the inclined truss", "1", 0.0, 0.5),
        with_units("area", {"mm2": 1e-6, "cm2": 1e-4}, 0.5),
        typical=0.05,
    ),
    # A floor with the mass 0 is eliminated, so that the structure has one degree of freedom less than it has floors.
    "frame_floor_mass": Check(
        *("mass", "kg", 1e-3, math.inf),
        {"a mass of 0 has no inertia: give the mass, or remove the entry of masses=": lambda value: value == 0},
    ),
    # As for the floors of shear buildings. Masses of nodes that are not on a rigid floor are not compared: nodes along
    # a member have a small part of its mass.
    "frame_mass_of_neighbours": Check(
        *("mass of a floor over that of a neighbouring one", "1", 0.0, 50.0, one_in(MASS)),
    ),
    # Only values near 1 and near g**2 are checked: frames with a small part of the gravity loads are usual.
    "frame_gravity_over_mass": Check(
        *("gravity loads of the frame over its masses", "m/s2", 2.0, 9 * G),
        {
            "gravity loads may be given in kg, or masses as weights in N: multiply the loads or divide the masses by "
            "9.81": lambda value: value < 2,
            "the frame may carry only 10 % of the loads of its masses": lambda value: 0.7 < value < 1.4,
            "gravity loads may be multiplied by g twice, or masses be divided by g": lambda value: value > 2,
        },
    ),
    "frame_gravity_load": Check(
        *("sum of the gravity loads of the frame", "N", 1.0, 1e11),
        {"gravity_load is downward if it is above 0: remove the minus signs": None},
    ),
    # Steel has 0.38, timber 0.06.
    "shear_over_elastic_modulus": Check(
        *("shear_modulus over elastic_modulus of the section", "1", 0.01, 1.0),
        with_units("shear_modulus", {"MPa or N/mm2": 1e6, "GPa or kN/mm2": 1e9, "kPa or kN/m2": 1e3}),
        typical=0.4,
    ),
    # Areas may be large so that members keep their lengths, so that only a large ratio is unusual.
    "shear_area_over_area": Check(
        *("shear_area over area of the section", "1", 0.0, 100.0),
        with_units("shear_area", {"mm2": 1e-6, "cm2": 1e-4}),
        typical=0.8,
    ),
    # Timber has 300 kg/m3 or more, steel 7,850 kg/m3; the mass of a floor may be included. Sections whose radius of
    # gyration is small are not checked, because their area may be large so that members keep their lengths.
    "mass_over_area": Check(
        *("mass_per_length over area of the section", "kg/m3", 100.0, 1e8),
        with_units("mass_per_length", {"t/m": 1e3, "kN/m of weight": 1e3 / G})
        | with_units("area", {"mm2": 1e-6, "cm2": 1e-4}, -1),
        typical=5000.0,
    ),
    # As above, for elastic moduli of steel.
    "mass_over_area_of_steel": Check(
        *("mass_per_length over area of the section", "kg/m3", 2000.0, math.inf),
        with_units("mass_per_length", {"t/m": 1e3, "kN/m of weight": 1e3 / G}),
        typical=1e5,
    ),
    # Yield strains are 0.001 to 0.002; shear capacities lead to less.
    "capacity_strain": Check(
        *("strain at the capacity of the section", "1", 1e-5, 1.0),
        with_units("the capacity", {"kN or kN m": 1e3, "MN or MN m": 1e6}),
        typical=1e-3,
    ),
    # Steel and concrete members have 0.002 to 0.03; squat members with little reinforcement have less.
    "hinge_yield_rotation": Check(
        *("rotation of the member end at the yield moment of its hinge, M_y L / (6 E I),", "rad", 5e-5, 1.0),
        with_units("yield_force", {"kN m": 1e3, "MN m": 1e6, "N mm": 1e-3}),
        typical=0.01,
    ),
    # Hinges have about 10 times 6 E I / L; connections with less than 0.08 times are pinned (Eurocode 3, part 1-8).
    # There is no upper bound, because stiff hinges are rigid until they yield.
    "hinge_stiffness": Check(
        *("initial stiffness of the hinge over 6 E I / L of the member,", "1", 0.015, math.inf),
        with_units("spring_start or spring_end", {"kN m/rad": 1e3, "MN m/rad": 1e6}),
        typical=10.0,
    ),
    # Yield rotations depend little on the size of members. With the bound 100, a factor of 1,000 is also found if they
    # differ by 10 times.
    "joined_yield_rotations": Check(
        "rotation of a member end at the yield moment of its hinge, M_y L / (6 E I), over that of a hinge that is "
        "joined with it",
        *("1", 0.0, 100.0),
        one_in({"kN m": 1e3, "MN m": 1e6}),
    ),
    # Steel and concrete members have about 0.005 to 0.1 (Lignos and Krawinkler 2011, Journal of Structural Engineering
    # 137; Haselton et al. 2008, PEER 2007/03), brittle members less. 0.3 rad are 17 degrees.
    "hinge_plastic_rotation": Check(
        *("plastic_drift_to_capping of the hinge", "rad", 1e-4, 0.3),
        given_in(PERCENT | {"degrees": math.pi / 180, "mrad": 1e-3}),
        typical=0.03,
    ),
    # Steel members have about 0.03 to 0.6, concrete members up to about 0.1 (the same sources).
    "hinge_post_capping_rotation": Check(
        *("post_capping_drift of the hinge", "rad", 1e-4, 2.0),
        given_in(PERCENT | {"degrees": math.pi / 180, "mrad": 1e-3}),
        typical=0.2,
    ),
    # Steel members have about 0.1 to 0.5, concrete members less. 1.5 rad are 86 degrees.
    "hinge_ultimate_rotation": Check(
        *("ultimate_drift of the hinge", "rad", 1e-4, 1.5),
        given_in(PERCENT | {"degrees": math.pi / 180, "mrad": 1e-3})
        | {"give ultimate_drift=0 for a hinge that never loses its strength": lambda value: value > 1.5},
        typical=0.05,
    ),
    # OpenSees accepts such values, too: all strength is lost on the hardening line. Fracture just before the capping
    # rotation is usual.
    "ultimate_over_capping_rotation": Check(
        "ultimate_drift of the hinge over its capping rotation, yield_force / stiffness + plastic_drift_to_capping,",
        *("1", 0.9, math.inf),
        {
            "the hinge loses all strength before its capping point: give ultimate_drift as the total rotation, or 0 if "
            "the strength is never lost": None
        },
    ),
    # Lambda = lambda theta_p of steel members is 0.2 to 5 rad (Lignos and Krawinkler 2011).
    "hinge_deterioration_rotation": Check(
        *("deterioration drift", "rad", 5e-3, 20.0),
        given_in(PERCENT | {"degrees": math.pi / 180})
        | {
            "it may be the ratio lambda: multiply it by the plastic (or yield) rotation by which its source divides, "
            "or give 0 for no deterioration": lambda value: value > 20
        },
        typical=1.0,
    ),
    # A yield moment is mostly at least twice the moment under gravity. With a dispersion of 0.4, 4 % of the yield
    # moments are below 0.5 times their median, so that few structures of a usual scatter yield under gravity.
    "gravity_over_random_yield": Check(
        "moment (of a brace: force) under gravity over the random yield_force that 5 % of the structures do not reach,",
        *("1", 0.0, 1.0),
        {
            "the scatter of yield_force may be too wide (a dispersion in percent): these structures yield before the "
            "motion": None,
            "random values may be in kN m or MN m": lambda value: value > 50,
        },
    ),
    # Designs and calibrations change masses and sections by less than 100 times; mistakes are mostly other units.
    **{
        f"given_{name}": Check(
            *(f"median of the given values of {name} over the nominal value", "1", 1e-2, 1e2),
            given_in(units) | {"they may be in another unit, or factors, which GivenFactors takes": None},
            typical=1.0,
        )
        for name, units in _UNITS_OF_GIVEN.items()
    },
    # A single small area or second moment may be that of a damaged member.
    **{
        f"one_given_{name}": Check(
            *(f"given {name}", "1", 0.0 if name in ("area", "second_moment") else 1e-2, 1e2),
            given_in(units) | {"it may be in another unit than the values of the other structures": None},
            typical=1.0,
        )
        for name, units in _UNITS_OF_GIVEN.items()
    },
    # Steel has 0.0012 to 0.0025; springs of braces with a short yielding part have less.
    "brace_yield_strain": Check(
        *("strain of the brace at its yield force, F_y / (E A),", "1", 5e-5, 0.05),
        with_units("yield_force", {"kN": 1e3, "MN": 1e6}) | with_units("area", {"mm2": 1e-6, "cm2": 1e-4}, -1),
        typical=2e-3,
    ),
    **CHECKS_OF_SPRINGS_AND_LOADS,
}
