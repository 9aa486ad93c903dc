"""Check that a frame is a fish-bone (one column line with half-beams), and read the laws of its hinges."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from warpdyn.foundations.core.checks import shortened
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.model.structures.frames.fishbone import levels_of
from warpdyn.model.structures.frames.reduction import gravity_on_supports

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame

ENDS = ("start", "end")
WHO = "HingedFishbone"


class Storey(NamedTuple):
    """The members of a storey by index, and their ends: 0 for the start of the member, 1 for its end."""

    column: int
    lower: int
    upper: int
    beam: int
    inner: int

    @property
    def places(self) -> tuple[tuple[int, int], ...]:
        """(member, end) of the lower and upper end of the column and of the half-beam at its joint."""
        return (self.column, self.lower), (self.column, self.upper), (self.beam, self.inner)


def checked_line(frame: Frame) -> list[Storey]:
    """Return the storeys of a fish-bone frame from the base to the roof, or raise an error that names a member."""
    if frame.geometric_kind != "string":
        raise ValueError(f"{WHO}: give the frame geometric_stiffness='string': P-Delta acts on storey drifts")
    levels, floors = levels_of(frame, WHO)
    names = list(frame.members)
    found: list[Storey] = []
    joint = -1
    for level, floor in zip(levels, floors, strict=True):
        if len(level.columns) != 1 or len(level.beams) != 1:
            raise ValueError(
                f"{WHO}: floor {floor!r} has {len(level.columns)} columns below it and {len(level.beams)} beams, but a "
                "fish-bone has one column and one half-beam: give wd.fishbone(frame), or Frame.lumped for an elastic "
                "frame"
            )
        column, beam = level.columns[0], level.beams[0]
        lower = int(np.argmin(frame.coordinates[frame.ends[column], 1]))
        if joint >= 0 and frame.ends[column, lower] != joint:
            raise ValueError(f"{WHO}: column {names[column]!r} does not continue the column line below it")
        joint = int(frame.ends[column, 1 - lower])
        if joint not in frame.ends[beam]:
            raise ValueError(f"{WHO}: beam {names[beam]!r} does not start at the column line")
        inner = int(frame.ends[beam, 0] != joint)
        found.append(Storey(column, lower, 1 - lower, beam, inner))
        _check_supports(frame, found[-1], names)
        _check_members(frame, found[-1], names)
    return found


def check_gravity(frame: Frame) -> None:
    """Raise an error if a gravity load with P-Delta acts on a node that is supported vertically."""
    held = gravity_on_supports(frame)
    if held:
        raise ValueError(
            f"{WHO}: p_delta=True, but the gravity_load of node {held[0]!r} has no P-Delta effect, because the node is "
            "supported vertically: put the load on a leaning column, a line of members with kind='truss' from a "
            "pinned support to each floor"
        )


def base_turn(frame: Frame, line: list[Storey]) -> bool | float:
    """Return the rotational stiffness of the base [N m/rad]: True if it cannot rotate, 0 if it is pinned."""
    base = list(frame.nodes)[frame.ends[line[0].column, line[0].lower]]
    return frame.supports[base].get("rz", 0.0)


def _check_supports(frame: Frame, storey: Storey, names: list[str]) -> None:
    nodes = list(frame.nodes)
    joint, far = nodes[frame.ends[storey.column, storey.upper]], nodes[frame.ends[storey.beam, 1 - storey.inner]]
    for node, what in ((joint, "joint"), (far, "end of half-beam")):
        if frame.supports.get(node, {}) != {"uy": True}:
            raise ValueError(
                f"{WHO}: node {node!r} ({what}) must have the support 'roller': columns do not shorten, "
                "and a half-beam ends at mid-span"
            )
    others = [name for name, row in frame.members.items() if far in (row["start"], row["end"])]
    if others != [names[storey.beam]]:
        raise ValueError(f"{WHO}: node {far!r} at the end of half-beam {names[storey.beam]!r} has other members")
    if far in frame.masses and any(frame.masses[far].values()):
        raise ValueError(f"{WHO}: node {far!r} has a mass: give masses to diaphragms")


def _check_members(frame: Frame, storey: Storey, names: list[str]) -> None:
    geometry = frame.geometry
    for member in (storey.column, storey.beam):
        row = frame.members[names[member]]
        if any(row[f"offset_{end}_{axis}"] for end in ENDS for axis in "xy"):
            raise ValueError(f"{WHO}: member {names[member]!r} has rigid offsets, which are not supported")
        if (geometry.end_springs[member] == 0).any():
            raise ValueError(f"{WHO}: member {names[member]!r} has a release: give a spring with a stiffness")
    if np.isfinite(geometry.end_springs[storey.beam, 1 - storey.inner]):
        raise ValueError(f"{WHO}: half-beam {names[storey.beam]!r} has a spring at mid-span: remove it")


def checked_hinges(frame: Frame, line: list[Storey], given: object) -> dict[tuple[str, str], dict[str, Any]]:
    """Return {(member, end): parameters with the law}, or raise an error that names a wrong hinge."""
    if isinstance(given, Mapping) and not given:
        raise ValueError(
            "hinges is empty: give at least one hinge, such as {('C1', 'start'): {'law': 'bilinear', 'yield_force': "
            "5e6, 'hardening_ratio': 0.02}}, or use Frame.lumped for a frame without hinges"
        )
    if not isinstance(given, Mapping):
        raise TypeError(
            "hinges must be a dictionary, such as {('C1', 'start'): {'law': 'bilinear', 'yield_force': 5e6, "
            f"'hardening_ratio': 0.02}}}}, got {shortened(given)}"
        )
    names = list(frame.members)
    known = {(names[member], ENDS[end]): (member, end) for storey in line for member, end in storey.places}
    found = {}
    for place, row in given.items():
        if place not in known:
            member = place[0] if isinstance(place, tuple) and place else place
            raise ValueError(
                f"hinges: {place!r} is not an end of a column, or of a half-beam at its joint"
                f"{did_you_mean(str(member), names)}; give (member, 'start' or 'end')"
            )
        if np.isinf(frame.geometry.end_springs[known[place]]):
            raise ValueError(
                f"hinges: the end {place!r} has no spring: give member {place[0]!r} spring_{place[1]}= the initial "
                "stiffness of the hinge [N m/rad], a finite number"
            )
        if not isinstance(row, Mapping) or "law" not in row:
            raise ValueError(f"hinges: {place!r} needs a dictionary with 'law', got {shortened(row)}")
        if "stiffness" in row:
            raise ValueError(f"hinges: remove stiffness of {place!r}: it is spring_{place[1]} of member {place[0]!r}")
        found[place] = {str(name): value for name, value in row.items()}
    return found
