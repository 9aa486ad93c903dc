"""Checks of frames: names and sections of members, lengths, unconnected nodes and mechanisms."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from warpdyn.model.structures.frames.tables.table import Rows, check_names_known

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame

SAME_PLACE = 1e-9  # distance of two nodes over the size of the frame
LEAST_EIGENVALUE = 1e-13  # of a stiffness matrix that is scaled to a diagonal of ones; below it, a motion is free
SHIFT = 1e-15  # added to the scaled diagonal, so that a singular matrix can be factorised
ITERATIONS = 4
IN_WORDS = {"ux": "horizontally (ux)", "uy": "vertically (uy)", "rz": "by rotation (rz)"}


def check_tables(nodes: Rows, members: Rows, sections: Rows) -> None:
    """Raise a ValueError if members name unknown nodes or sections, sections lack values, or nodes coincide."""
    xy = np.array([[row["x"], row["y"]] for row in nodes.values()])
    size = max(float(np.ptp(xy, axis=0).max()), 1e-12) if len(xy) else 1.0
    names = list(nodes)
    order = np.lexsort((xy[:, 1], xy[:, 0]))
    for i, first in enumerate(order):
        for second in order[i + 1 :]:
            if xy[second, 0] - xy[first, 0] > SAME_PLACE * size:
                break
            if np.hypot(*(xy[second] - xy[first])) <= SAME_PLACE * size:
                a, b = names[min(first, second)], names[max(first, second)]
                raise ValueError(
                    f"nodes: {a!r} and {b!r} are at the same place ({xy[first, 0]:g}, {xy[first, 1]:g}) m: remove one "
                    "of them; for a hinge or a spring between a member and a joint, give the member a release or a "
                    "spring_start / spring_end"
                )
    for name, row in sections.items():
        if (row["shear_modulus"] > 0) != (row["shear_area"] > 0):
            missing = "shear_area [m2]" if row["shear_modulus"] > 0 else "shear_modulus [Pa]"
            raise ValueError(f"sections: section {name!r} has no {missing}: give it, or leave out both for no shear")
    used: set[str] = set()
    for name, row in members.items():
        check_names_known(f"members: member {name!r}", [row["start"], row["end"]], nodes, "node")
        check_names_known(f"members: member {name!r}", [row["section"]], sections, "section")
        used |= {row["start"], row["end"]}
        if row["start"] == row["end"]:
            raise ValueError(f"members: member {name!r} starts and ends at node {row['start']!r}: its length is 0")
        if row["kind"] == "beam" and not sections[row["section"]]["second_moment"] > 0:
            raise ValueError(
                f"members: member {name!r} is a beam, but its section {row['section']!r} has no second_moment [m4]: "
                "give it, or give the member kind='truss'"
            )
        for end in ("start", "end"):
            has_spring = np.isfinite(row[f"spring_{end}"])
            if row["kind"] == "truss" and (has_spring or row["release"] != "none"):
                raise ValueError(
                    f"members: member {name!r} is a truss, which has no moments: remove its release or spring"
                )
            if has_spring and row["release"] in (end, "both"):
                raise ValueError(
                    f"members: member {name!r} has a release and a spring at its {end}: remove one of them"
                )
    for name in nodes:
        if name not in used:
            raise ValueError(f"nodes: node {name!r} is not connected: no member starts or ends there. Remove the node")


def check_lengths(members: Rows, length: np.ndarray, coordinates: np.ndarray, ends: np.ndarray) -> None:
    """Raise a ValueError if a member has no length between its rigid end offsets, or they point the wrong way."""
    between = coordinates[ends[:, 1]] - coordinates[ends[:, 0]]
    for place, name in enumerate(members):
        whole = float(np.hypot(*between[place]))
        if length[place] <= SAME_PLACE * whole:
            raise ValueError(
                f"members: member {name!r} has no length between its rigid end offsets ({whole:g} m between its nodes)"
                ". Offsets are in m, from the node to the end of the member"
            )


def check_moves(frame: Frame) -> None:
    """Raise a ValueError that names node and direction if a part of the frame can move freely."""
    numbering = frame.numbering
    if not frame.supports:
        raise ValueError("supports: the frame has no support: give supports=, such as {'A': 'fixed'}")
    if not numbering.free.size:
        return
    stiffness = frame.stiffness(frame.nominal, has_springs=True)[numbering.free][:, numbering.free]
    place = free_motion(stiffness.tocsc())
    if place is None:
        return
    name = numbering.names[numbering.free[place]]
    if name in frame.diaphragms:
        raise ValueError(
            f"the frame is a mechanism: diaphragm {name!r} can move horizontally (ux) without resistance. Add a "
            "support, a column or a brace, or remove releases"
        )
    node, _, direction = name.rpartition(" ")
    raise ValueError(
        f"the frame is a mechanism: node {node!r} can move {IN_WORDS[direction]} without resistance. Add a support or "
        "a member, or remove releases"
    )


def free_motion(stiffness: sparse.csc_array) -> int | None:
    """Return the number of the degree of freedom that moves most without resistance, or None if the frame is stable."""
    diagonal = stiffness.diagonal()
    if (diagonal <= 0).any():
        return int(np.argmax(diagonal <= 0))
    root = 1 / np.sqrt(diagonal)
    scaled = sparse.diags_array(root) @ stiffness @ sparse.diags_array(root)
    count, part = connected_components(scaled, directed=False)
    for each in range(count):
        places = np.flatnonzero(part == each)
        block = scaled.tocsc()[places][:, places]
        found = _least_motion(block.tocsc())
        if found is not None:
            return int(places[found])
    return None


def _least_motion(scaled: sparse.csc_array) -> int | None:
    """Return the largest component of the motion with the least eigenvalue if this is 0, by inverse iteration."""
    size = scaled.shape[0]
    try:
        factors = splu((scaled + SHIFT * sparse.eye_array(size)).tocsc())
    except RuntimeError:  # exactly singular
        factors = splu((scaled + 100 * SHIFT * sparse.eye_array(size)).tocsc())
    vector = np.random.default_rng(0).normal(size=size)
    for _ in range(ITERATIONS):
        vector = factors.solve(vector / np.linalg.norm(vector))
        if not np.isfinite(vector).all():
            return 0
    vector /= np.linalg.norm(vector)
    least = float(vector @ (scaled @ vector))
    return int(np.abs(vector).argmax()) if least <= LEAST_EIGENVALUE else None
