"""Flexural-shear buildings: a wall that bends and a frame that shears, with one displacement per floor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.law import Law
from warpdyn.foundations.core.checks import real_number, shortened
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.structures.builders.built_structure import BuiltStructure
from warpdyn.model.structures.builders.gravity import geometric_stiffness
from warpdyn.model.structures.builders.storey_springs import axial_forces, storey_springs
from warpdyn.model.structures.lumped.places.storey_values import floor_masses, storey_values
from warpdyn.model.structures.lumped.spring import Spring
from warpdyn.model.structures.lumped.sticks import (
    Stick,
    bending_matrix_with_base_rotation,
    lumped_stick,
    stick_of_period,
)
from warpdyn.model.structures.lumped.structure import MOST_DOFS

ROTATION = "base rotation"
LEAST_RATIO = 50.0  # least frequency of the base rotation alone, over the first one of the building on a fixed base


@with_suggestions
class FlexuralShearBuilding(BuiltStructure):
    """A wall-frame or high-rise building: bending and shear stiffness in parallel, with one displacement per floor.

    Each storey has a beam with the bending stiffness EI (the walls) and a shear spring GA / h between the displacements
    of its floors (the frames). The rotations of the floors have no mass and are eliminated exactly by static
    condensation. The beams remain elastic; the shear springs, and a hinge at the base of the wall, may have any storey
    law.

    Degrees of freedom: "u1", "u2" and so on [m]. Springs: "frame 1", "frame 2" and so on, whose deformation is the
    storey drift [m]. Outputs: "drift 1", "drift 2" and so on (storey drifts [m]); "wall base shear" [N] and "wall base
    moment" [N m] of the beams; if springs are elastic, also "base shear" [N] and "base moment" [N m] of the whole
    building. With a base hinge, the degree of freedom "base rotation" [rad] and the spring "base hinge" (deformation
    [rad], force [N m]) are the first.

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
        base_hinge: Law and parameters of a rotational spring between wall and base, as for a `wd.Spring`, such as
            `{"law": "bilinear", "stiffness": 1e12, "yield_force": 4e8, "hardening_ratio": 0.02}` with a stiffness in
            N m/rad and a yield moment in N m; None: a fixed base. `period` remains that with a fixed base.
        base_inertia: Moment of inertia of the base rotation [kg m2]; None: the one with which the base rotation alone
            has the highest frequency of the building on a fixed base, or 50 times the first one if that is higher. It
            increases the first period by less than 0.1 %.
        force_outputs: Whether the outputs include "base shear" and "base moment" if the shear springs are elastic. They
            are computed from the nominal stiffness; with False, `stiffness` (of the shear springs) may be random.
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
        TypeError: If `law` is neither a name nor a law, or `base_hinge` is not a dictionary.

    Example:
        >>> tower = wd.FlexuralShearBuilding(
        ...     [4e5] * 20, 3.0, period=2.0, alpha0=4.0, damping="modal", damping_ratio=0.03
        ... )
        >>> tower
        FlexuralShearBuilding(20 storeys, T = 2 s, law='elastic', damping='modal')
        >>> tower.modal()["period"].values[:3].round(3)
        array([2.   , 0.546, 0.241])
    """

    names_of_builder = ("stick", "floor_heights")

    def __init__(
        self,
        floor_mass: ArrayLike,
        storey_height: ArrayLike,
        *,
        period: float | None = None,
        alpha0: float | None = None,
        bending_stiffness: ArrayLike | None = None,
        shear_stiffness: ArrayLike | None = None,
        base_hinge: Mapping[str, Any] | None = None,
        base_inertia: float | None = None,
        force_outputs: bool = True,
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
        gravity = None if forces is None else geometric_stiffness(_loads_of(forces), heights)
        wall, inertia = self.stick.bending_matrix, []
        dofs = floors
        if base_hinge is not None:
            wall = bending_matrix_with_base_rotation(heights, self.stick.bending_stiffness)
            springs = [_hinge(base_hinge), *springs]
            inertia = [self._base_inertia(base_inertia, wall[0, 0] + springs[0].stiffness)]
            dofs = [ROTATION, *floors]
            gravity = None if gravity is None else np.pad(gravity, ((1, 0), (1, 0)))
        elif base_inertia is not None:
            raise ValueError("base_inertia needs a base_hinge: give base_hinge=, or remove base_inertia=")
        outputs = {f"drift {storey + 1}": drift for storey, drift in enumerate(drifts)}
        on_floors = wall[-storeys:]
        forces_of_wall = {"shear": on_floors.sum(axis=0), "moment": self.floor_heights @ on_floors}
        resisting = {f"wall base {name}": row for name, row in forces_of_wall.items()}
        if force_outputs and all(spring.law.is_linear for spring in springs):
            # The frame alone: base shear k_1 u_1, base moment sum of GA times drift. Sums over the stiffness matrix
            # would add rounding, which would decide which coefficients are equal and need other kernels.
            modulus = np.append(self.stick.shear_stiffness, 0.0)
            of_frame = {"shear": np.eye(1, storeys)[0] * stiffness[0], "moment": modulus[:-1] - modulus[1:]}
            before = len(wall) - storeys
            resisting |= {
                f"base {name}": forces_of_wall[name] + np.pad(row, (before, 0)) for name, row in of_frame.items()
            }
        outputs |= {name: dict(zip(dofs, row.tolist(), strict=True)) for name, row in resisting.items()}
        super().__init__(
            dict(zip(dofs, [*inertia, *masses.tolist()], strict=True)),
            springs,
            influence=dict.fromkeys(floors, 1.0),
            stiffness_matrix=wall,
            geometric_stiffness=gravity,
            outputs=outputs,
            output_units={
                name: "m" if name.startswith("drift") else "N m" if name.endswith("moment") else "N" for name in outputs
            },
            damping=damping,
            damping_ratio=damping_ratio,
            damping_modes=damping_modes,
            storey_height=heights,
            storey_springs=names,
        )

    def _base_inertia(self, given: float | None, stiffness: float) -> float:
        """Return the moment of inertia of the base rotation [kg m2], which has a rotational stiffness [N m]."""
        if given is not None:
            return real_number("base_inertia [kg m2]", given, above=0)
        periods = self.stick.periods
        return float(stiffness * (min(periods[-1], periods[0] / LEAST_RATIO) / (2 * np.pi)) ** 2)

    def __repr__(self) -> str:
        size = f"{self.floor_heights.size} storeys, T = {self.fundamental_period:.4g} s"
        return f"FlexuralShearBuilding({size}, law={self.law!r}, damping={self.damping!r})"


def _hinge(given: Mapping[str, Any]) -> Spring:
    """Return the rotational spring at the base."""
    if not isinstance(given, Mapping) or not {"name", "direction"}.isdisjoint(given):
        raise TypeError(
            "base_hinge must be a dictionary of the law and its parameters, such as {'law': 'bilinear', 'stiffness': "
            f"1e12, 'yield_force': 4e8, 'hardening_ratio': 0.02}}, got {shortened(given)}"
        )
    return Spring("base hinge", {ROTATION: 1.0}, **given)


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
