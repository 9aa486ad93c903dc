"""Plausibility checks of soil, footings, and the springs and dashpots of foundations; part of the table of checks."""

from __future__ import annotations

from collections.abc import Mapping

from warpdyn.foundations.core.plausibility.check import (
    DASHPOT,
    FORCE,
    LENGTH,
    MASS,
    STIFFNESS,
    VELOCITY,
    Check,
    G,
    given_in,
    with_units,
)

CHECKS_OF_FOUNDATIONS: Mapping[str, Check] = {
    "soil_density": Check(
        *("density of the soil", "kg/m3", 800.0, 4000.0),
        given_in({"t/m3": 1e3, "kN/m3 of weight": 1e3 / G}),
    ),
    # Peat has 30 m/s, intact rock up to 3,500 m/s.
    "soil_shear_wave_velocity": Check(
        *("shear-wave velocity of the soil", "m/s", 25.0, 5000.0),
        given_in({"km/s": 1e3} | VELOCITY),
    ),
    # The density times the squared velocities above.
    "soil_shear_modulus": Check(
        *("shear modulus of the soil", "N/m2", 5e5, 1e11),
        given_in({"MPa": 1e6, "kPa": 1e3, "GPa": 1e9}),
        typical=5e7,
    ),
    "footing_size": Check("dimension of the footing", "m", 0.0, 500.0, given_in(LENGTH)),
    # Measured and computed ratios are 1 to 2; 5 is a stiff tower on soft clay.
    "period_on_soil": Check(
        *("first period on soil over that on a fixed base", "1", 0.0, 5.0),
        {"the springs may be given in kN/m and kN m (or MN/m and MN m): give N/m and N m": None},
    ),
    # About 0.8 B / Vs: half-widths B of 1 to 30 m, shear-wave velocities Vs of 50 to 3,500 m/s.
    "sway_dashpot_over_stiffness": Check(
        *("sway_dashpot over sway_stiffness", "s", 1e-4, 2.0),
        with_units("sway_dashpot", DASHPOT) | with_units("sway_stiffness", STIFFNESS, -1),
    ),
    "foundation_mass_over_building": Check(
        *("foundation_mass over the mass of the structure", "1", 5e-3, 20.0),
        with_units("foundation_mass", MASS),
    ),
    # Springs at the footing's base: rocking over sway stiffness is about the squared half-width. A slab with 1/10 of
    # all masses has 0.03, floors with their own inertia up to 0.5.
    "rocking_inertia_over_masses": Check(
        *("rocking_inertia over all masses times (rocking_stiffness / sway_stiffness)", "1", 1e-3, 20.0),
        with_units("rocking_inertia", {"t m2": 1e3, "kN m2 of weight": 1e3 / G}),
    ),
    # Part of the weight may be carried by other foundations.
    "uplift_weight_over_weight": Check(
        *("weight of FoundationUplift over the masses of structure and foundation times g", "1", 0.5, 2.0),
        with_units("weight", FORCE),
    ),
}
