"""Static analysis of frames: displacements, reactions, member forces and buckling."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import splu

from warpdyn.foundations.core.checks import real_number
from warpdyn.model.structures.frames.members.elements import (
    ROTATIONS,
    fixed_end_forces,
)
from warpdyn.model.structures.frames.members.forces import INCLUDES_GRAVITY
from warpdyn.model.structures.frames.tables.columns import DIRECTIONS, FORCES
from warpdyn.model.structures.frames.tables.table import Rows, check_names_known, column_of

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame

MOST_ITERATIONS = 100  # of axial forces
CONVERGED = 1e-12  # change of axial forces over the largest one
NEGLIGIBLE = 1e-12  # inverse buckling factor relative to the largest one
ACTIONS = ("axial", "shear", "moment")


def load_vector(frame: Frame, nodal: Rows, *, has_gravity: bool = False) -> np.ndarray:
    """Return the forces on nodes and diaphragms [N] or [N m] at the independent degrees of freedom, shape [dof]."""
    numbering = frame.numbering
    found = np.zeros(len(numbering.names))
    index = {name: place for place, name in enumerate(frame.nodes)}
    for name, row in nodal.items():
        if name in frame.diaphragms:
            if row["fy"] or row["mz"]:
                raise ValueError(f"loads: diaphragm {name!r} can only have the horizontal force fx: load its nodes")
            found[numbering.names.index(name)] += row["fx"]
            continue
        for axis, force in enumerate(FORCES):
            found[numbering.places[index[name], axis]] += row[force]
    if has_gravity:
        np.subtract.at(found, numbering.places[:, 1], column_of(frame.nodes, "gravity_load"))
    stiffness = frame.stiffness(frame.nominal).diagonal()
    for place in np.flatnonzero((found != 0) & (stiffness <= 0)):
        node = numbering.names[place].rpartition(" ")[0]
        raise ValueError(
            f"loads: node {node!r} has a moment mz, but no member resists its rotation: remove mz, or a release"
        )
    return found


def member_forces_fixed(frame: Frame, loads: Sequence[Mapping[str, Any]], *, has_gravity: bool = False) -> np.ndarray:
    """Return the forces on the fixed ends of members in local axes under member loads, shape [member, 6]."""
    index = {name: place for place, name in enumerate(frame.members)}
    found = np.zeros((len(index), 6))
    geometry = frame.geometry
    every = list(loads)
    if has_gravity:
        every += [
            {"member": name, "qx": 0.0, "qy": -row["gravity_load"], "px": 0.0, "py": 0.0, "at": None}
            for name, row in frame.members.items()
            if row["gravity_load"]
        ]
    for load in every:
        place = index[load["member"]]
        axes = geometry.to_local[place][:2, :2]
        if load["qx"] or load["qy"]:
            local = axes @ [load["qx"], load["qy"]]
            found[place] += fixed_end_forces(geometry, frame.nominal, place, tuple(local), None)
        if load["px"] or load["py"]:
            if not 0 <= load["at"] <= geometry.length[place]:
                raise ValueError(
                    f"member_loads: at = {load['at']:g} m on member {load['member']!r} is outside its length of "
                    f"{geometry.length[place]:g} m"
                )
            local = axes @ [load["px"], load["py"]]
            found[place] += fixed_end_forces(geometry, frame.nominal, place, tuple(local), load["at"])
    for bar in np.flatnonzero(geometry.is_bar).tolist():  # a bar carries its loads as a simply supported beam
        found[bar, ROTATIONS] = 0.0
        found[bar, [1, 4]] = _simple_shears(frame, bar, every)
    return found


def _simple_shears(frame: Frame, place: int, loads: Sequence[Mapping[str, Any]]) -> np.ndarray:
    name, length = list(frame.members)[place], frame.geometry.length[place]
    axes = frame.geometry.to_local[place][:2, :2]
    found = np.zeros(2)
    for load in loads:
        if load["member"] == name:
            found -= (axes @ [load["qx"], load["qy"]])[1] * length / 2
            if load["at"] is not None:
                share = load["at"] / length
                found -= (axes @ [load["px"], load["py"]])[1] * np.array([1 - share, share])
    return found


def prescribed(frame: Frame, settlements: Mapping[str, Mapping[str, float]]) -> np.ndarray:
    """Return the displacements of supports [m] or [rad], shape [dof]."""
    found = np.zeros(len(frame.numbering.names))
    check_names_known("settlements", list(settlements), frame.nodes, "node")
    index = {name: place for place, name in enumerate(frame.nodes)}
    for node, row in settlements.items():
        for direction, value in row.items():
            if direction not in DIRECTIONS or frame.supports.get(node, {}).get(direction) is not True:
                raise ValueError(
                    f"settlements: node {node!r} is not fixed in {direction!r}: only fixed directions "
                    f"({', '.join(DIRECTIONS)}) can have a settlement"
                )
            place = frame.numbering.places[index[node], DIRECTIONS.index(direction)]
            found[place] = real_number(f"settlements: {direction} of node {node!r}", value)
    return found


def solve(
    frame: Frame,
    nodal: Rows,
    on_members: Sequence[Mapping[str, Any]],
    settlements: Mapping[str, Mapping[str, float]],
    *,
    has_gravity: bool = False,
    has_p_delta: bool = False,
) -> xr.Dataset:
    """Return the result of `Frame.static`."""
    forces = load_vector(frame, nodal, has_gravity=has_gravity)
    fixed = member_forces_fixed(frame, on_members, has_gravity=has_gravity)
    moved = prescribed(frame, settlements)
    axial = np.zeros(len(frame.members))
    displacement, ends = _linear(frame, forces, fixed, moved, axial)
    if has_p_delta:
        for _ in range(MOST_ITERATIONS):
            new = (ends[:, 3] - ends[:, 0]) / 2
            if np.abs(new - axial).max() <= CONVERGED * max(np.abs(new).max(), np.finfo(float).tiny):
                break
            axial = new
            _refuse_buckled(frame, axial)
            displacement, ends = _linear(frame, forces, fixed, moved, axial)
        else:
            raise ValueError("static(p_delta=True): the axial forces do not converge: the frame is close to buckling")
    found = _dataset(frame, forces, displacement, ends)
    found.attrs[INCLUDES_GRAVITY] = int(has_gravity)
    return found


def _linear(
    frame: Frame, forces: np.ndarray, fixed: np.ndarray, moved: np.ndarray, axial: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements, shape [dof], and forces on member ends in local axes, shape [member, 6]."""
    numbering, geometry = frame.numbering, frame.geometry
    local, conditions = frame.bent(frame.nominal)
    # Rotations of member ends at springs and releases under the load alone.
    turned = np.zeros((len(axial), 6))
    turned[:, ROTATIONS] = np.einsum("mij,mj->mi", conditions.relief, fixed[:, ROTATIONS])
    own = fixed + np.einsum("mij,mj->mi", local, turned)
    matrix = frame.stiffness(frame.nominal)
    if axial.any():
        matrix = matrix + frame.geometric(axial)
    equivalent = np.zeros(len(numbering.names))
    np.add.at(equivalent, numbering.of_members, np.einsum("mji,mj->mi", geometry.to_local, own))
    displacement = moved.copy()
    right = forces - equivalent - matrix @ moved
    free = numbering.free
    if free.size:
        displacement[free] = splu(matrix[free][:, free].tocsc()).solve(right[free])
    joints = np.einsum("mij,mj->mi", geometry.to_local, displacement[numbering.of_members])
    at_ends = np.einsum("mij,mj->mi", conditions.ends, joints)
    ends = own + np.einsum("mij,mj->mi", local, at_ends)
    if axial.any():
        softening = frame.local_geometric(axial, conditions)
        ends = ends + np.einsum("mij,mj->mi", softening, joints)
    return displacement, ends


def _dataset(frame: Frame, forces: np.ndarray, displacement: np.ndarray, ends: np.ndarray) -> xr.Dataset:
    numbering = frame.numbering
    held = -forces.copy()
    np.add.at(held, numbering.of_members, np.einsum("mji,mj->mi", frame.geometry.to_local, ends))
    reaction = np.zeros((len(frame.nodes), 3))
    index = {name: place for place, name in enumerate(frame.nodes)}
    for node, support in frame.supports.items():
        for direction in support:
            axis = DIRECTIONS.index(direction)
            reaction[index[node], axis] = held[numbering.places[index[node], axis]]
    # The reaction of a diaphragm with several supports acts at the first one.
    seen: set[int] = set()
    for node, support in frame.supports.items():
        place = int(numbering.places[index[node], 0])
        if "ux" in support and place in seen:
            reaction[index[node], 0] = 0.0
        seen.add(place)
    values = displacement[numbering.places]
    long_names = {
        "displacement": "displacement of the node (ux, uy in m, rz in rad)",
        "reaction": "force of the support on the frame (ux, uy in N, rz in N m)",
        "end_force": "force on the member's end in its local axes (N, moment in N m)",
    }
    found = xr.Dataset(
        {
            "displacement": (("node", "direction"), values, {"long_name": long_names["displacement"], "units": "m"}),
            "reaction": (("node", "direction"), reaction, {"long_name": long_names["reaction"], "units": "N"}),
            "end_force": (
                ("member", "end", "action"),
                ends.reshape(-1, 2, 3),
                {"long_name": long_names["end_force"], "units": "N"},
            ),
            "axial_force": (
                "member",
                (ends[:, 3] - ends[:, 0]) / 2,
                {"long_name": "mean axial force, tension positive", "units": "N"},
            ),
        }
    )
    return found.assign_coords(
        node=list(frame.nodes),
        direction=list(DIRECTIONS),
        member=list(frame.members),
        end=["start", "end"],
        action=list(ACTIONS),
    )


def gravity_forces(frame: Frame) -> np.ndarray:
    """Return the axial forces of members under the gravity loads, tension positive [N], shape [member]."""
    if not has_gravity(frame):
        return np.zeros(len(frame.members))
    return np.asarray(solve(frame, {}, [], {}, has_gravity=True)["axial_force"].values)


def has_gravity(frame: Frame) -> bool:
    """Return whether the tables contain gravity loads."""
    return any(row["gravity_load"] for rows in (frame.nodes, frame.members) for row in rows.values())


def needs_gravity(frame: Frame, what: str, instead: str = "") -> None:
    """Raise a ValueError if the tables contain no gravity load."""
    if not has_gravity(frame):
        other = f", or give {instead} to neglect gravity" if instead else ""
        raise ValueError(
            f"{what}: the frame has no gravity loads: give the column gravity_load in the table of nodes [N] or "
            f"members [N/m]{other}"
        )


def buckling(frame: Frame, nodal: Rows, on_members: Sequence[Mapping[str, Any]], count: int) -> np.ndarray:
    """Return the result of `Frame.buckling_factors`."""
    if nodal or on_members:
        axial = np.asarray(solve(frame, nodal, on_members, {})["axial_force"].values)
    else:
        needs_gravity(frame, "buckling_factors()")
        axial = frame.gravity
    found = factors_of(frame, axial)
    if not found.size:
        raise ValueError("buckling_factors(): the loads compress no member, so that the frame cannot buckle")
    return found[:count]


def factors_of(frame: Frame, axial: np.ndarray) -> np.ndarray:
    """Return the positive factors on axial forces at which the frame buckles, increasing [1]."""
    free = frame.numbering.free
    elastic = frame.stiffness(frame.nominal)[free][:, free]
    softening = -frame.geometric(axial)[free][:, free]
    taken = np.flatnonzero(np.abs(softening).sum(axis=0))
    if not taken.size:
        return np.zeros(0)
    # Only the displacements that the geometric stiffness affects: the inverse of the stiffness condensed to them.
    columns = sparse.csc_array(elastic)
    factors = splu(columns)
    right = np.zeros((free.size, taken.size))
    right[taken, np.arange(taken.size)] = 1.0
    flexibility = factors.solve(right)[taken]
    flexibility = (flexibility + flexibility.T) / 2
    condensed = softening.toarray()[np.ix_(taken, taken)]
    # K_g x = mu K x with mu = 1 / factor; F = inverse of the condensed K: K_g x = mu F^-1 x.
    root = np.linalg.cholesky(flexibility)
    inverse = eigh(root.T @ condensed @ root, eigvals_only=True)[::-1]
    return 1 / inverse[inverse > NEGLIGIBLE * np.abs(inverse).max()]


def _refuse_buckled(frame: Frame, axial: np.ndarray) -> None:
    found = factors_of(frame, axial)
    if found.size and found[0] <= 1:
        raise ValueError(
            f"static(p_delta=True): the loads are {1 / found[0]:.4g} times the buckling load of the elastic frame "
            f"(buckling factor {found[0]:.4g}): reduce them, or stiffen the frame"
        )


def refuse_gravity_above_buckling(frame: Frame, what: str, instead: str = "") -> None:
    """Raise a ValueError if the gravity loads of the tables exceed the buckling load."""
    needs_gravity(frame, what, instead)
    found = factors_of(frame, frame.gravity)
    if found.size and found[0] <= 1:
        raise ValueError(
            f"{what}: gravity is {1 / found[0]:.4g} times the buckling load of the elastic frame (buckling factor "
            f"{found[0]:.4g}): check the units of gravity_load [N], elastic_modulus [Pa] and springs [N m/rad], reduce "
            "the gravity loads, or stiffen the frame"
        )
