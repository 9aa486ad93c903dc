"""Find implausible rigid offsets, springs of member ends and springs of supports of a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.plausibility.table import CHECKS
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.structures.frames.tables.plausible_loads import horizontal_mass
from warpdyn.model.structures.frames.tables.table import column_of

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame

# Members whose length is below this number of radii of gyration are rigid parts of joints or walls.
LEAST_SLENDERNESS = 3.0
LEAST_OF_ONE = 2e-3  # spring of one end over 6 E I / L; below it, its unit is wrong. Pinned connections have 0.005
FEWEST_SPRINGS = 4  # springs that are compared with each other


def add_offsets(findings: PlausibilityFindings, frame: Frame) -> np.ndarray:
    """Add implausibly long rigid end offsets to `findings`; return whether a member has them, shape [member]."""
    columns = [[column_of(frame.members, f"offset_{end}_{axis}") for axis in "xy"] for end in ("start", "end")]
    offsets = np.moveaxis(np.array(columns), -1, 0)  # [member, end, axis]
    between = np.diff(frame.coordinates[frame.ends], axis=1)[:, 0]
    distance = np.hypot(*between.T)
    along = ((offsets[:, 0] - offsets[:, 1]) * between).sum(axis=1) / distance
    longest = np.maximum(np.hypot(offsets[..., 0], offsets[..., 1]).max(axis=1), along)
    over = longest / distance
    names = list(frame.members)
    findings.add_each("frame_offset", over.tolist(), lambda place: f" {names[place]!r}")
    found: np.ndarray = over > CHECKS["frame_offset"].high
    return found


def bending_stiffness(frame: Frame) -> np.ndarray:
    """Return 6 E I / L of all members, the moments of both ends per rotation in double curvature [N m/rad]."""
    found: np.ndarray = 6 * frame.nominal.modulus * frame.nominal.inertia / frame.geometry.length
    return found


def spring_ratios(frame: Frame) -> np.ndarray:
    """Return rotational springs of member ends over 6 E I / L of their members, shape [member, 2].

    NaN: no spring, or a member that is meant to be a rigid part.
    """
    nominal, length = frame.nominal, frame.geometry.length
    springs = frame.geometry.end_springs
    is_slender = length >= LEAST_SLENDERNESS * np.sqrt(nominal.inertia / nominal.area)
    is_counted = ~frame.geometry.is_bar & is_slender & (nominal.inertia > 0)
    bending = np.where(is_counted, bending_stiffness(frame), np.nan)
    return np.where(np.isfinite(springs) & (springs > 0), springs, np.nan) / bending[:, None]


def soft_ends(frame: Frame, ratios: np.ndarray) -> np.ndarray:
    """Return whether the spring of a member end is implausibly soft, shape [member, 2].

    All springs of a frame are softer than usual if columns and beams have them: pinned connections are those of beams.

    Args:
        frame: The frame.
        ratios: Its `spring_ratios`.
    """
    is_soft: np.ndarray = ratios < LEAST_OF_ONE
    of_columns = np.diff(frame.coordinates[frame.ends], axis=1)[:, 0, 1] != 0
    given = np.isfinite(ratios)
    is_in_both = given[of_columns].any() and given[~of_columns].any()
    if given.sum() >= FEWEST_SPRINGS and is_in_both and (ratios[given] < CHECKS["end_spring"].low).all():
        is_soft = given
    return is_soft


def add_springs(findings: PlausibilityFindings, frame: Frame) -> None:
    """Add implausible springs of member ends to `findings`."""
    ratios = spring_ratios(frame)
    names = [f" at the {end} of member {name!r}" for name in frame.members for end in ("start", "end")]
    findings.add_each(
        "end_spring", np.where(soft_ends(frame, ratios), ratios, np.nan).ravel().tolist(), names.__getitem__
    )


def add_supports(findings: PlausibilityFindings, frame: Frame) -> None:
    """Add implausible springs of supports to `findings`."""
    springs = {
        direction: {
            node: float(row[direction])
            for node, row in frame.supports.items()
            if direction in row and row[direction] is not True
        }
        for direction in ("ux", "uy", "rz")
    }
    bending = dict.fromkeys(frame.nodes, 0.0)
    stiffness = bending_stiffness(frame)
    for row, each, ends in zip(frame.members.values(), stiffness, frame.geometry.end_springs, strict=True):
        for node, end in zip((row["start"], row["end"]), ends, strict=True):
            bending[node] += float(each) if row["kind"] == "beam" and end > 0 else 0.0
    for node, spring in springs["rz"].items():
        if bending[node] > 0:
            findings.add("support_rotation_spring", spring / bending[node], f" at node {node!r}")
    if not springs["ux"] and not springs["uy"]:
        return
    weight = horizontal_mass(frame) * STANDARD_GRAVITY
    fixed = {each: any(row.get(each) is True for row in frame.supports.values()) for each in ("ux", "uy")}
    if springs["ux"] and not fixed["ux"] and weight > 0:
        findings.add("support_sway", weight / sum(springs["ux"].values()))
    if not springs["uy"]:
        return
    has_loads = any(row["gravity_load"] for row in (*frame.nodes.values(), *frame.members.values()))
    if has_loads:
        moved = frame.static(gravity=True)["displacement"].sel(direction="uy")
        for node in springs["uy"]:
            findings.add("support_settlement", abs(float(moved.sel(node=node))), f" at node {node!r}")
    elif not fixed["uy"] and weight > 0:
        findings.add("support_settlement", weight / sum(springs["uy"].values()))
