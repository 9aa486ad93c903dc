"""Flexural-shear buildings: a wall that bends and a frame that shears, with one displacement per floor."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.law import Law
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.structures.builders.built_structure import BuiltStructure
from warpdyn.model.structures.builders.gravity import geometric_stiffness
from warpdyn.model.structures.builders.storey_springs import (
    axial_forces,
    floor_masses,
    storey_springs,
    storey_values,
)
from warpdyn.model.structures.lumped.sticks import Stick, lumped_stick, stick_of_period
from warpdyn.model.structures.lumped.structure import MOST_DOFS


@with_suggestions
class FlexuralShearBuilding(BuiltStructure):
    """A wall-frame or high-rise building: bending and shear stiffness in parallel, with one displacement per floor.

    Each storey has a beam with the bending stiffness EI (the walls) and a shear spring GA / h between the displacements
    of its floors (the frames). The rotations of the floors have no mass and are eliminated exactly by static
    condensation. The beams remain elastic; the shear springs may have any storey law. A nonlinear hinge of the wall is
    not part of this model.

    Degrees of freedom: "u1", "u2" and so on [m]. Springs: "frame 1", "frame 2" and so on, whose deformation is the
    storey drift [m]. Outputs: "drift 1", "drift 2" and so on (storey drifts [m]); "wall base shear" [N] and "wall base
    moment" [N m] of the beams; if springs are elastic, also "base shear" [N] and "base moment" [N m] of the whole
    building.

    Sources: Miranda and Taghavi (2005), "Approximate floor acceleration demands in multistory buildings"; Xiong, Lu,
    Guan and co-authors (2016), "A nonlinear computational model for regional seismic simulation of tall buildings".

    Args:
        floor_mass: Floor masses from the first floor up [kg], shape [floor].
        storey_height: Storey heights from the ground up [m], one value or shape [storey].
        period: First period of the elastic building without P-Delta [s]; needs `alpha0`. The stiffness is calibrated so
            that the building has exactly this period.
        alpha0: Lateral stiffness ratio H sqrt(GA / EI) [1]: 0 to about 2 for shear walls, 1.5 to 6 for dual systems, 5
            to 20 for moment frames.
        bending_stiffness: Bending stiffness EI [N m2], one value or shape [storey]; instead of `period` and `alpha0`.
        shear_stiffness: Shear stiffness GA [N], one value or shape [storey]; instead of `period` and `alpha0`.
        law: Storey law of the shear springs: its name, its class, or an object with its parameters.
        gravity_load: Vertical load of each floor [N], shape [floor], or "weight" for the weight of the floor masses;
            None: no P-Delta.
        damping: Inherent damping, as for a LumpedStructure: "none", "rayleigh", "mass_proportional",
            "stiffness_proportional" or "modal".
        damping_ratio: Viscous damping ratio [1].
        damping_modes: The two modes of Rayleigh damping, counted from 1; None: 1 and 2.
        **parameters: Parameters of a law that is given by name, such as `yield_force` [N], and
            `deformation_capacity` [m]: one value or one per storey.

    Raises:
        ValueError: If a value is out of its range, a length is wrong, neither a period nor stiffnesses are given, or
            both are given, or the building buckles.
        TypeError: If `law` is neither a name nor a law.

    Example:
        >>> tower = wd.FlexuralShearBuilding(
        ...     [4e5] * 20, 3.0, period=2.0, alpha0=4.0, damping="modal", damping_ratio=0.03
        ... )
        >>> tower
        FlexuralShearBuilding(20 storeys, T = 2 s, law='elastic', damping='modal')
        >>> tower.modal()["period"].values[:3].round(3)
        array([2.   , 0.546, 0.241])
    """

    def __init__(
        self,
        floor_mass: ArrayLike,
        storey_height: ArrayLike,
        *,
        period: float | None = None,
        alpha0: float | None = None,
        bending_stiffness: ArrayLike | None = None,
        shear_stiffness: ArrayLike | None = None,
        law: str | Law | type[Law] = "elastic",
        gravity_load: ArrayLike | str | None = None,
        damping: str = "none",
        damping_ratio: float | None = None,
        damping_modes: tuple[int, int] | None = None,
        **parameters: ArrayLike,
    ) -> None:
        masses = floor_masses(floor_mass)
        storeys = masses.size
        if storeys > MOST_DOFS:
            raise ValueError(f"floor_mass has {storeys} floors; at most {MOST_DOFS} are possible: combine storeys")
        heights = storey_values("storey_height", storey_height, storeys, "m")
        self.stick = _stick(masses, heights, period, alpha0, bending_stiffness, shear_stiffness)
        self.floor_heights = np.cumsum(heights)
        self.floor_heights.flags.writeable = False
        floors = [f"u{floor}" for floor in range(1, storeys + 1)]
        drifts = [{floor: 1.0} | ({floors[storey - 1]: -1.0} if storey else {}) for storey, floor in enumerate(floors)]
        names = [f"frame {storey + 1}" for storey in range(storeys)]
        stiffness = self.stick.storey_shear_stiffness
        springs = storey_springs("FlexuralShearBuilding", names, drifts, stiffness, law, parameters)
        forces = axial_forces(gravity_load, masses)
        outputs = {f"drift {storey + 1}": drift for storey, drift in enumerate(drifts)}
        resisting = {"wall base": self.stick.bending_matrix}
        if springs[0].law.is_linear:
            resisting["base"] = self.stick.stiffness
        for name, matrix in resisting.items():
            outputs[f"{name} shear"] = dict(zip(floors, matrix.sum(axis=0).tolist(), strict=True))
            outputs[f"{name} moment"] = dict(zip(floors, (self.floor_heights @ matrix).tolist(), strict=True))
        super().__init__(
            dict(zip(floors, masses.tolist(), strict=True)),
            springs,
            stiffness_matrix=self.stick.bending_matrix,
            geometric_stiffness=None if forces is None else geometric_stiffness(_loads_of(forces), heights),
            outputs=outputs,
            damping=damping,
            damping_ratio=damping_ratio,
            damping_modes=damping_modes,
        )

    def __repr__(self) -> str:
        return (
            f"FlexuralShearBuilding({self.dofs} storeys, T = {self.fundamental_period:.4g} s, law={self.law!r}, "
            f"damping={self.damping!r})"
        )


def _stick(
    masses: np.ndarray,
    heights: np.ndarray,
    period: float | None,
    alpha0: float | None,
    bending: ArrayLike | None,
    shear: ArrayLike | None,
) -> Stick:
    """Return the stick of a period and stiffness ratio, or of given stiffnesses."""
    of_period = {"period": period, "alpha0": alpha0}
    of_stiffness = {"bending_stiffness": bending, "shear_stiffness": shear}
    given = [name for name, value in {**of_period, **of_stiffness}.items() if value is not None]
    if given not in (list(of_period), list(of_stiffness)):
        raise ValueError(
            f"give period= and alpha0=, or bending_stiffness= and shear_stiffness=; got {', '.join(given) or 'neither'}"
        )
    if period is not None and alpha0 is not None:
        if alpha0 == 0:
            raise ValueError(
                "alpha0 is 0, so that the shear springs have no stiffness: give a small value, such as 0.01"
            )
        return stick_of_period(period, heights, masses, alpha0)
    assert bending is not None
    assert shear is not None
    storey_values("shear_stiffness", shear, masses.size, "N")
    return lumped_stick(heights, bending, shear, masses)


def _loads_of(forces: np.ndarray) -> np.ndarray:
    """Return the vertical loads of floors [N] from the axial forces of storeys [N]."""
    return forces - np.append(forces[1:], 0.0)
