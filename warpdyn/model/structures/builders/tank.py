"""Liquid storage tanks: Housner's impulsive and sloshing masses as a lumped structure."""

from __future__ import annotations

import numpy as np

from warpdyn.foundations.core.checks import check_kind, real_number
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.structures.builders.built_structure import BuiltStructure
from warpdyn.model.structures.lumped.spring import Spring
from warpdyn.model.structures.lumped.tanks import TankModel


@with_suggestions
class HousnerTank(BuiltStructure):
    """A tank on rigid ground: an impulsive mass that moves with the wall, and a sloshing (convective) mass.

    Degrees of freedom: "impulsive" and "convective" [m], relative to the ground; springs have the same names. Outputs
    are forces of the springs (without those of dashpots, which are smaller by a factor of about twice the damping ratio
    and act when the springs' forces are small): "base shear" [N], "wall moment" [N m] above the base, and "foundation
    moment" [N m] below it, which includes the pressure of the liquid on the base.

    Source: Housner (1963), "The dynamic behavior of water tanks".

    Args:
        liquid: Masses, heights and frequency, from `wd.housner_cylinder` or `wd.housner_rectangle`.
        impulsive_period: Period of the impulsive mass on the flexible wall [s].
        impulsive_damping_ratio: Damping ratio of the impulsive mass [1].
        convective_damping_ratio: Damping ratio of sloshing [1].
        wall_mass: Mass of wall and roof that moves with the impulsive mass [kg].
        wall_height: Height of the centre of this mass above the base [m]; needed with `wall_mass`.
        force_outputs: Whether there are outputs. They are computed from the nominal stiffness; with False, `stiffness`
            may be random.

    Raises:
        ValueError: If a value is not finite or is out of its range, or `wall_height` is missing.
        TypeError: If `liquid` is of another class.

    Example:
        >>> tank = wd.HousnerTank(wd.housner_cylinder(radius=10.0, depth=8.0), impulsive_period=0.15)
        >>> tank.modal()["period"].values.round(3)
        array([4.931, 0.15 ])
    """

    names_of_builder = ("liquid",)

    def __init__(
        self,
        liquid: TankModel,
        *,
        impulsive_period: float,
        impulsive_damping_ratio: float = 0.05,
        convective_damping_ratio: float = 0.005,
        wall_mass: float = 0.0,
        wall_height: float | None = None,
        force_outputs: bool = True,
    ) -> None:
        check_kind("HousnerTank", "the result of wd.housner_cylinder(...)", liquid, TankModel)
        wall = real_number("wall_mass [kg]", wall_mass, least=0)
        if wall > 0 and wall_height is None:
            raise ValueError("wall_height is missing: wall_mass needs it; give wall_height= in m above the base")
        wall_level = real_number("wall_height [m]", 0.0 if wall_height is None else wall_height, least=0)
        frequencies = {
            "impulsive": 2 * np.pi / real_number("impulsive_period [s]", impulsive_period, above=0),
            "convective": liquid.convective_frequency,
        }
        ratios = {
            "impulsive": real_number("impulsive_damping_ratio", impulsive_damping_ratio, least=0),
            "convective": real_number("convective_damping_ratio", convective_damping_ratio, least=0),
        }
        masses = {"impulsive": liquid.impulsive_mass + wall, "convective": liquid.convective_mass}
        moments = {  # of the masses, above the base and below it
            "wall": (liquid.impulsive_height, liquid.convective_height),
            "foundation": (liquid.impulsive_height_with_base, liquid.convective_height_with_base),
        }
        stiffness = {name: mass * frequencies[name] ** 2 for name, mass in masses.items()}
        outputs = {"base shear": dict(stiffness)}
        for name, (of_impulsive, of_convective) in moments.items():
            level = (liquid.impulsive_mass * of_impulsive + wall * wall_level) / masses["impulsive"]
            arms = {"impulsive": level, "convective": of_convective}
            outputs[f"{name} moment"] = {each: stiffness[each] * arms[each] for each in masses}
        self.liquid = liquid
        super().__init__(
            masses,
            [
                Spring(
                    name,
                    {name: 1.0},
                    stiffness=stiffness[name],
                    damping_coefficient=2 * ratios[name] * frequencies[name] * mass,
                )
                for name, mass in masses.items()
            ],
            outputs=outputs if force_outputs else None,
            output_units={name: "N m" if "moment" in name else "N" for name in outputs} if force_outputs else None,
        )

    def __repr__(self) -> str:
        periods = 2 * np.pi * np.sqrt(self.parameters["mass"] / self.parameters["stiffness"])
        return f"HousnerTank(impulsive period {periods[0]:.4g} s, convective period {periods[1]:.4g} s)"
