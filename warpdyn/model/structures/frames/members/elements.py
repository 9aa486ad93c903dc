"""Matrices of plane beam-columns and bars, for all members of a frame and, if sections are random, many structures.

Local degrees of freedom of a member: axial displacement, transverse displacement and rotation at its start, and then
those at its end. Arrays have the shape [..., member, 6, 6]; the first dimensions are those of the section properties.

Sources: Przemieniecki, "Theory of Matrix Structural Analysis"; McGuire, Gallagher and Ziemian, "Matrix Structural
Analysis".
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

ROTATIONS = [2, 5]  # places of the rotations among the local degrees of freedom
TRANSLATIONS = [0, 1, 3, 4]


@dataclass(frozen=True)
class Sections:
    """Section properties of all members; arrays of shape [..., member], or [1, member] if all structures share them.

    Attributes:
        modulus: Elastic modulus E [Pa].
        area: Area A [m2].
        inertia: Second moment of area I [m4].
    """

    modulus: np.ndarray
    area: np.ndarray
    inertia: np.ndarray

    def select(self, members: np.ndarray) -> Sections:
        """Return the properties of the given members (indices)."""
        return Sections(*(each[..., members] for each in (self.modulus, self.area, self.inertia)))


@dataclass(frozen=True)
class Geometry:
    """Properties of all members that are not random; arrays of shape [member] unless stated otherwise.

    Attributes:
        length: Length between the ends of the deformable part [m].
        to_local: Matrix from the displacements of both nodes to those of the member's ends in local axes, shape
            [member, 6, 6]; it includes rigid end offsets.
        shear: Elastic modulus over shear stiffness, E / (G A_s) [1/m2]; 0 without shear deformation.
        end_springs: Stiffness of the rotational springs at both ends [N m/rad], shape [member, 2]; infinite for a rigid
            connection, 0 for a hinge.
        is_bar: Whether the member has only an axial force.
        mass_per_length: Mass [kg/m].
    """

    length: np.ndarray
    to_local: np.ndarray
    shear: np.ndarray
    end_springs: np.ndarray
    is_bar: np.ndarray
    mass_per_length: np.ndarray

    def select(self, members: np.ndarray) -> Geometry:
        """Return the properties of the given members (indices)."""
        return Geometry(*(getattr(self, field.name)[members] for field in fields(self)))


def local_axes(start: np.ndarray, end: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return lengths [m] and matrices to local displacements of the ends, shape [member, 6, 6].

    Args:
        start: Coordinates of the start nodes [m], shape [member, 2].
        end: Coordinates of the end nodes [m], shape [member, 2].
        offsets: Rigid offsets from node to member end [m], shape [member, 2 (start, end), 2 (x, y)].
    """
    axis = end + offsets[:, 1] - start - offsets[:, 0]
    length = np.hypot(axis[:, 0], axis[:, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        cos, sin = (axis / length[:, None]).T
    matrix = np.zeros((len(length), 6, 6))
    for place in range(2):
        x, y, rotation = 3 * place, 3 * place + 1, 3 * place + 2
        dx, dy = offsets[:, place].T
        # The end moves by (ux - dy r, uy + dx r).
        matrix[:, x, x], matrix[:, x, y] = cos, sin
        matrix[:, y, x], matrix[:, y, y] = -sin, cos
        matrix[:, x, rotation] = -dy * cos + dx * sin
        matrix[:, y, rotation] = dy * sin + dx * cos
        matrix[:, rotation, rotation] = 1.0
    return length, matrix


def beam_stiffness(geometry: Geometry, sections: Sections) -> np.ndarray:
    """Return the stiffness matrices of members without releases in local axes (Timoshenko)."""
    length = geometry.length
    axial = sections.modulus * sections.area / length
    phi = shear_ratio(geometry, sections)
    bending = np.where(geometry.is_bar, 0.0, sections.modulus * sections.inertia / ((1 + phi) * length**3))
    found = np.zeros((*np.broadcast_shapes(axial.shape, bending.shape), 6, 6))
    found[..., 0, 0] = found[..., 3, 3] = axial
    found[..., 0, 3] = found[..., 3, 0] = -axial
    near, far = (4 + phi) * length**2, (2 - phi) * length**2
    _fill(found, bending, 12.0, 6 * length, near, far)
    return found


def shear_ratio(geometry: Geometry, sections: Sections) -> np.ndarray:
    """Return phi = 12 E I / (G A_s L^2) [1], 0 without shear deformation, shape [..., member]."""
    found: np.ndarray = 12 * sections.inertia * geometry.shear / geometry.length**2
    return found


def stiffness_coefficients(geometry: Geometry, sections: Sections) -> np.ndarray:
    """Return the stiffness of members between their end springs (Timoshenko), shape [..., member, 4].

    The coefficients are EA / L [N/m], and moments per rotation of the ends relative to the chord [N m/rad]: start by
    start, start by end, and end by end. In series with springs of the stiffnesses s, the moments of the member's ends,
    near = (4 + phi) EI / ((1 + phi) L) and far = (2 - phi) EI / ((1 + phi) L), decrease by r = s / (s + near).
    """
    length = geometry.length
    # Without shear deformation, arrays with one value for each member take the place of those of each structure.
    phi = shear_ratio(geometry, sections) if geometry.shear.any() else np.zeros(length.shape)
    near = np.where(geometry.is_bar, 0.0, (4 + phi) / ((1 + phi) * length)) * (sections.modulus * sections.inertia)
    carried = (2 - phi) / (4 + phi)  # far over near
    square = carried**2
    springs = geometry.end_springs.T
    start = _share_of_spring(springs[0], near)
    end = start if np.array_equal(*springs) else _share_of_spring(springs[1], near)
    eased = 1 - end
    near /= 1 - (1 - start) * eased * square
    axial = sections.modulus * sections.area / length
    # Values of successive structures are contiguous in memory, as those of drawn properties.
    shape = np.broadcast_shapes(near.shape, axial.shape)
    found = np.moveaxis(np.empty((length.size, 4, *shape[:-1])), (0, 1), (-2, -1))
    found[..., 0] = axial
    of_start = near * start
    np.multiply(of_start, 1 - eased * square, out=found[..., 1])
    of_start *= end
    np.multiply(of_start, carried, out=found[..., 2])
    found[..., 3] = found[..., 1] if end is start else near * end * (1 - (1 - start) * square)
    return found


def _share_of_spring(spring: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return s / (s + near): 1 for a rigid connection or a member without bending stiffness, 0 for a hinge."""
    if np.isinf(spring).all():
        return np.ones(spring.shape)
    with np.errstate(invalid="ignore"):
        return np.where(np.isinf(spring) | (near <= 0), 1.0, spring / (spring + near))


def deformations_of(geometry: Geometry) -> np.ndarray:
    """Return elongation and rotations of both ends relative to the chord, per displacement of the nodes.

    The shape is [member, 3, 6].
    """
    local = np.zeros((len(geometry.length), 3, 6))
    local[:, 0, [0, 3]] = -1.0, 1.0
    for end, rotation in enumerate(ROTATIONS):
        local[:, 1 + end, 1], local[:, 1 + end, 4] = 1 / geometry.length, -1 / geometry.length
        local[:, 1 + end, rotation] = 1.0
    found: np.ndarray = local @ geometry.to_local
    return found


def geometric_stiffness_of(geometry: Geometry, kind: str, phi: np.ndarray) -> np.ndarray:
    """Return the geometric stiffness matrices for a tension of 1 N in local axes, shape [..., member, 6, 6].

    Args:
        geometry: The members.
        kind: "string" (P-Delta) or "consistent" (P-Delta and the curvature of members, P-delta); bars are strings.
        phi: Ratio of shear deformation, see `shear_ratio`.
    """
    length = geometry.length
    found, curved = (np.zeros((*phi.shape, 6, 6)) for _ in range(2))
    _fill(found, 1 / length, 1.0, 0.0, 0.0, 0.0)
    _fill(
        curved,
        1 / (length * (1 + phi) ** 2),
        6 / 5 + 2 * phi + phi**2,
        length / 10,
        length**2 * (2 / 15 + phi / 6 + phi**2 / 12),
        -(length**2) * (1 / 30 + phi / 6 + phi**2 / 12),
    )
    return np.where((geometry.is_bar | (kind == "string"))[:, None, None], found, curved)


def _fill(
    found: np.ndarray,
    factor: np.ndarray,
    transverse: np.ndarray | float,
    coupling: np.ndarray | float,
    near: np.ndarray | float,
    far: np.ndarray | float,
) -> None:
    """Write the 4 x 4 pattern of a beam into the local matrices."""
    found[..., 1, 1] = found[..., 4, 4] = factor * transverse
    found[..., 1, 4] = found[..., 4, 1] = -factor * transverse
    for column in ROTATIONS:
        found[..., 1, column] = found[..., column, 1] = factor * coupling
        found[..., 4, column] = found[..., column, 4] = -factor * coupling
        found[..., column, column] = factor * near
    found[..., 2, 5] = found[..., 5, 2] = factor * far


def mass_of(geometry: Geometry, kind: str, phi: np.ndarray) -> np.ndarray:
    """Return the mass matrices in local axes without rotary inertia, shape [..., member, 6, 6].

    Args:
        geometry: The members.
        kind: "lumped" or "consistent" (with the shapes of Timoshenko beams).
        phi: Ratio of shear deformation, see `shear_ratio`.
    """
    length, total = geometry.length, geometry.mass_per_length * geometry.length
    found = np.zeros((*phi.shape, 6, 6))
    if kind == "lumped":
        for place in TRANSLATIONS:
            found[..., place, place] = total / 2
        return found
    linear = np.zeros_like(found)
    for first, last in ((0, 3), (1, 4)):
        linear[..., first, first] = linear[..., last, last] = total / 3
        linear[..., first, last] = linear[..., last, first] = total / 6
    factor = total / (1 + phi) ** 2
    own, far = 13 / 35 + 7 * phi / 10 + phi**2 / 3, 9 / 70 + 3 * phi / 10 + phi**2 / 6
    near_moment = (11 / 210 + 11 * phi / 120 + phi**2 / 24) * length
    far_moment = (13 / 420 + 3 * phi / 40 + phi**2 / 24) * length
    own_turn = (1 / 105 + phi / 60 + phi**2 / 120) * length**2
    far_turn = (1 / 140 + phi / 60 + phi**2 / 120) * length**2
    for row, column, value in (
        (1, 1, own),
        (4, 4, own),
        (1, 4, far),
        (1, 2, near_moment),
        (4, 5, -near_moment),
        (1, 5, -far_moment),
        (2, 4, far_moment),
        (2, 2, own_turn),
        (5, 5, own_turn),
        (2, 5, -far_turn),
    ):
        found[..., row, column] = found[..., column, row] = factor * value
    for row, column in ((0, 0), (3, 3), (0, 3), (3, 0)):
        found[..., row, column] = linear[..., row, column]
    return np.where(geometry.is_bar[:, None, None], linear, found)


@dataclass(frozen=True)
class EndConditions:
    """Members between rotational springs, in series: the rotations of the member's ends are eliminated exactly.

    Attributes:
        ends: Displacements of the member's ends per displacement of the joints, shape [..., member, 6, 6].
        relief: Rotations of the member's ends per moment that fixes them [rad/(N m)], shape [..., member, 2, 2].
    """

    ends: np.ndarray
    relief: np.ndarray


def end_conditions(geometry: Geometry, stiffness: np.ndarray) -> EndConditions:
    """Return how the ends of members move if their joints move; `stiffness` is that of `beam_stiffness`.

    A spring with the stiffness s carries the moment of the member's end: s (joint - end) = moment. The equation is
    divided by s + 4 EI/L, so that it also applies to a hinge (s = 0) and a rigid connection (s infinite).
    """
    shape = stiffness.shape[:-2]
    ends = np.zeros(stiffness.shape)
    ends[...] = np.eye(6)
    relief = np.zeros((*shape, 2, 2))
    rotational = stiffness[..., ROTATIONS, :][..., :, ROTATIONS]
    reference = rotational[..., 0, 0]
    has_springs = ~np.isinf(geometry.end_springs).all(axis=-1) & ~geometry.is_bar
    has_springs &= (reference > 0).all(axis=tuple(range(reference.ndim - 1)))
    if not has_springs.any():
        return EndConditions(ends, relief)
    springs = geometry.end_springs[has_springs]
    reference = reference[..., has_springs, None]
    with np.errstate(invalid="ignore"):
        rigid = np.where(np.isinf(springs), 1.0, springs / (springs + reference))
    soft = (1 - rigid) / reference
    identity = np.eye(2)
    matrix = rigid[..., :, None] * identity + soft[..., :, None] * rotational[..., has_springs, :, :]
    of_moves = stiffness[..., has_springs, :, :][..., ROTATIONS, :][..., :, TRANSLATIONS]
    moved = np.zeros((*matrix.shape[:-1], 6))
    moved[..., TRANSLATIONS] = -soft[..., :, None] * of_moves
    for row, column in enumerate(ROTATIONS):
        moved[..., row, column] = rigid[..., row]
    solved = np.linalg.solve(matrix, moved)
    for row, place in enumerate(ROTATIONS):
        ends[..., has_springs, place, :] = solved[..., row, :]
    relief[..., has_springs, :, :] = np.linalg.solve(matrix, -soft[..., :, None] * identity)
    return EndConditions(ends, relief)


def fixed_end_forces(
    geometry: Geometry, sections: Sections, member: int, load: tuple[float, float], at: float | None
) -> np.ndarray:
    """Return the forces on the ends of a member that is fixed at both ends, under a load in local axes, shape [6].

    Args:
        geometry: The members.
        sections: Section properties, shape [member].
        member: Index of the member.
        load: Axial and transverse load: [N/m] along the whole member, or [N] at one place.
        at: Distance of a point load from the start [m]; None: a uniform load.
    """
    length, (axial, transverse) = geometry.length[member], load
    if at is None:
        ends, moment = length / 2, length**2 / 12
        first = (axial * ends, transverse * ends, transverse * moment)
        return -np.array([*first, axial * ends, transverse * ends, -transverse * moment])
    a, b = at, length - at
    phi = 0.0 if geometry.is_bar[member] else 12 * sections.inertia[member] * geometry.shear[member] / length**2
    start = a * b * (b + phi * length / 2) / (length**2 * (1 + phi))
    end = a * b * (a + phi * length / 2) / (length**2 * (1 + phi))
    if geometry.is_bar[member]:
        start = end = 0.0
    shear = b / length + (start - end) / length
    first = (axial * b / length, transverse * shear, transverse * start)
    return -np.array([*first, axial * a / length, transverse * (1 - shear), -transverse * end])
