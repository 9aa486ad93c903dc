"""Matrices of buildings that twist: three degrees of freedom per floor, frames and walls at positions in plan.

Degrees of freedom of each floor: displacements ux and uy of a reference point, the origin of the coordinates in plan,
and the rotation theta about the vertical axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, shortened
from warpdyn.foundations.core.frozen_values import FrozenArrays, freeze_arrays
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.structures.lumped.places.storey_values import floor_masses


@dataclass(frozen=True, eq=False)
class TorsionalMatrices(FrozenArrays):
    """Mass matrix, spring directions and influence of a building that twists; see `torsional_matrices`.

    Args:
        names: Names of the degrees of freedom: "ux1", "uy1", "theta1", "ux2" and so on, from the first floor up.
        mass: Mass matrix [kg], [kg m] or [kg m2], shape [dof, dof].
        directions: Coefficients of the deformation of each spring [1] or [m], shape [storey, frame, dof]: the
            deformation is their scalar product with the displacements.
        influence: Displacement of each degree of freedom per unit displacement of the ground in x and y [1], shape
            [dof, 2].
    """

    names: tuple[str, ...]
    mass: np.ndarray
    directions: np.ndarray
    influence: np.ndarray

    def __post_init__(self) -> None:
        freeze_arrays(vars(self))

    def stiffness(self, frame_stiffness: ArrayLike) -> np.ndarray:
        """Return the elastic stiffness matrix [N/m], [N] or [N m], shape [dof, dof].

        Args:
            frame_stiffness: Storey stiffness of each frame [N/m], shape [frame] or [storey, frame].

        Raises:
            ValueError: If a value is not finite, or there is not one value per frame.
        """
        given = finite_numbers("frame_stiffness [N/m]", frame_stiffness)
        shape = self.directions.shape[:2]
        if given.shape not in (shape, shape[1:]):
            raise ValueError(
                f"frame_stiffness must have shape {shape[1:]} or {shape} ([frame] or [storey, frame]), got shape "
                f"{given.shape}"
            )
        return np.einsum("sfi,sf,sfj->ij", self.directions, np.broadcast_to(given, shape), self.directions)


@suggests_names
def torsional_matrices(
    floor_mass: ArrayLike,
    plan: ArrayLike,
    frames: Sequence[tuple[float, float, float]],
    *,
    mass_centre: ArrayLike | None = None,
    inertia: ArrayLike | None = None,
) -> TorsionalMatrices:
    """Return mass matrix, spring directions and influence of a building with three degrees of freedom per floor.

    A frame with the angle q through the point (x, y) has, in each storey, a spring with the deformation (ux - y theta)
    cos(q) + (uy + x theta) sin(q) of the floor above, less that of the floor below.

    Args:
        floor_mass: Floor masses from the first floor up [kg], shape [floor].
        plan: Ends of the rectangular plan [m], shape [2, 2]: [[x from, x to], [y from, y to]]. The origin is the
            reference point of all coordinates; it may be outside the plan.
        frames: Position x, y [m] and angle from the x axis [rad] of each frame or wall, which must be inside the plan;
            0 for a frame along x, pi / 2 for one along y.
        mass_centre: Centre of mass x, y [m], inside the plan, shape [2] or [floor, 2]; None: the centre of the plan.
        inertia: Moment of inertia about the vertical axis through the centre of mass [kg m2], one value or shape
            [floor]; None: that of a uniform rectangle, m (a^2 + b^2) / 12.

    Returns:
        The matrices; multiply `directions` by the storey stiffnesses, or use them as directions of nonlinear springs.

    Raises:
        ValueError: If a value is not finite, is out of its range, a frame or centre of mass is outside the plan, or a
            shape is wrong.

    Example:
        >>> frames = [(0.0, 4.0, 0.0), (0.0, -4.0, 0.0), (-9.0, 0.0, np.pi / 2), (9.0, 0.0, np.pi / 2)]
        >>> matrices = torsional_matrices([1.5e5, 1.2e5], [[-10.0, 10.0], [-6.0, 6.0]], frames)
        >>> matrices.names
        ('ux1', 'uy1', 'theta1', 'ux2', 'uy2', 'theta2')
        >>> matrices.directions[1, 0]  # the frame at y = 4 m in the second storey
        array([-1.,  0.,  4.,  1.,  0., -4.])
    """
    masses = floor_masses(floor_mass)
    floors = masses.size
    ends = finite_numbers("plan [m]", plan)
    if ends.shape != (2, 2) or np.any(ends[:, 1] <= ends[:, 0]):
        raise ValueError(
            f"plan must be [[x from, x to], [y from, y to]] in metres, such as [[-10.0, 10.0], [-6.0, 6.0]], got "
            f"{shortened(plan)}"
        )
    centres = _centres(mass_centre, ends, floors)
    sides = ends[:, 1] - ends[:, 0]
    moments = masses * (sides @ sides) / 12
    if inertia is not None:
        given = finite_numbers("inertia [kg m2]", inertia)
        if given.shape not in ((), (floors,)) or np.any(given <= 0):
            raise ValueError(
                f"inertia must be above 0, one value or one per floor ({floors}), got {given.tolist()} kg m2"
            )
        moments = np.broadcast_to(given, (floors,))
    one_floor = np.array([_direction(frame, place, ends) for place, frame in enumerate(frames)])
    if not one_floor.size:
        raise ValueError("frames is empty: give at least one frame (x, y, angle)")
    mass = np.zeros((3 * floors, 3 * floors))
    directions = np.zeros((floors, len(one_floor), 3 * floors))
    for floor in range(floors):
        dofs = slice(3 * floor, 3 * floor + 3)
        m, (xc, yc) = masses[floor], centres[floor]
        polar = moments[floor] + m * (xc**2 + yc**2)
        mass[dofs, dofs] = [[m, 0, -m * yc], [0, m, m * xc], [-m * yc, m * xc, polar]]
        directions[floor, :, dofs] = one_floor
        if floor:
            directions[floor, :, 3 * floor - 3 : 3 * floor] = 0.0 - one_floor
    influence = np.tile([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], (floors, 1))
    names = tuple(f"{name}{floor + 1}" for floor in range(floors) for name in ("ux", "uy", "theta"))
    return TorsionalMatrices(names, mass, directions, influence)


def _centres(given: ArrayLike | None, ends: np.ndarray, floors: int) -> np.ndarray:
    """Return the centre of mass of each floor, shape [floor, 2]."""
    centres = ends.mean(axis=1) if given is None else finite_numbers("mass_centre [m]", given)
    if centres.shape not in ((2,), (floors, 2)):
        raise ValueError(f"mass_centre must be x, y of all floors or of each floor, got shape {centres.shape}")
    centres = np.broadcast_to(centres, (floors, 2))
    for floor, centre in enumerate(centres):
        _check_inside(f"mass_centre of floor {floor + 1}", centre, ends)
    return centres


def _direction(frame: tuple[float, float, float], place: int, ends: np.ndarray) -> np.ndarray:
    """Return the coefficients of ux, uy and theta of a floor in the displacement of a frame along its plane."""
    values = finite_numbers(f"frames[{place}]", frame)
    if values.shape != (3,):
        raise ValueError(f"frames[{place}] must be x [m], y [m] and angle [rad], got {frame!r}")
    x, y, angle = values
    if abs(angle) > 2 * np.pi:
        raise ValueError(f"the angle of frames[{place}] is {angle:g} rad; give radians: np.radians({angle:g})")
    _check_inside(f"frames[{place}]", values[:2], ends)
    cosine, sine = (0.0 if abs(part) < 1e-15 else part for part in (np.cos(angle), np.sin(angle)))
    return np.array([cosine, sine, x * sine - y * cosine])


def _check_inside(what: str, point: np.ndarray, ends: np.ndarray) -> None:
    outside = (point < ends[:, 0]) | (point > ends[:, 1])
    if outside.any():
        axis = int(np.flatnonzero(outside)[0])
        raise ValueError(
            f"{what} has {'xy'[axis]} = {point[axis]:g} m, outside the plan from "
            f"{ends[axis, 0]:g} to {ends[axis, 1]:g} m: correct the position, or plan="
        )
