"""The hinges of a frame, joined to those of its fish-bone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from warpdyn.foundations.core.checks import shortened
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.foundations.core.plausibility import PlausibilityFindings, meant_as_given
from warpdyn.foundations.core.plausibility.frames import CHECKS_OF_FRAMES
from warpdyn.model.structures.frames.fishbone import fishbone, levels_of
from warpdyn.model.structures.frames.frame import Frame
from warpdyn.model.structures.frames.hinges.plausibility import STRONG_ROTATION
from warpdyn.model.structures.frames.tables.plausible_springs import bending_stiffness

ENDS = ("start", "end")
SUMMED = ("yield_force",)
BY_STIFFNESS = ("hardening_ratio",)  # the other parameters are means weighted by the yield moments
WHO = "HingedFishbone.from_frame()"
End = tuple[str, str]


def joined_hinges(frame: Frame, hinges: object) -> tuple[Frame, dict[End, dict[str, Any]]]:
    """Return the fish-bone of a frame with end springs for its hinges, and the laws of the hinges.

    Args:
        frame: Frame with rigid floors.
        hinges: Laws of hinges by member and end; see `HingedFishbone`.

    Raises:
        ValueError: If a hinge is at no end of a member with a spring, only some ends of a floor's beams or of a
            storey's columns have hinges, or these hinges have different laws or parameters.
    """
    given = _hinges_by_end(frame, hinges)
    levels, _ = levels_of(frame, WHO)
    findings = PlausibilityFindings()
    bone = fishbone(frame)
    arguments = bone.description()
    names, found = list(frame.members), dict[End, dict[str, Any]]()
    for place, level in enumerate(levels, start=1):
        columns = [(names[member], member) for member in level.columns]
        for kind, end in enumerate(ENDS):
            ends = []
            for name, member in columns:
                y = frame.coordinates[frame.ends[member], 1]
                ends.append((name, ENDS[int(y.argmin()) if kind == 0 else int(y.argmax())]))
            joined = _joined_hinge(frame, given, ends, f"columns of storey {place}", findings)
            if joined is not None:
                found[f"C{place}", end] = joined[1]
        beams = [(names[member], end) for member in level.beams for end in ENDS]
        joined = _joined_hinge(frame, given, beams, f"beams of floor {place}", findings)
        if joined is not None:
            stiffness, found[f"B{place}", "start"] = joined
            _put_in_series(arguments, f"B{place}", stiffness)
    findings.warn()
    with meant_as_given(*CHECKS_OF_FRAMES):  # the warning of the given frame
        return Frame(**arguments), found


def _put_in_series(arguments: dict[str, Any], beam: str, stiffness: float) -> None:
    """Give a half-beam an end spring [N m/rad] and a higher bending stiffness; together they are as stiff as before."""
    row, section = arguments["members"][beam], arguments["sections"][beam]
    length = arguments["nodes"][row["end"]]["x"] - arguments["nodes"][row["start"]]["x"]
    total = 3 * section["elastic_modulus"] * section["second_moment"] / length
    if stiffness <= total:
        raise ValueError(
            f"{WHO}: the springs of the beams behind {beam!r} are not stiffer than the beams with these springs "
            f"({stiffness:g} and {total:g} N m/rad): give beams equal hinges at both ends"
        )
    section["second_moment"] *= 1 / (1 - total / stiffness)
    row["spring_start"] = stiffness


def _hinges_by_end(frame: Frame, given: object) -> dict[End, dict[str, Any]]:
    """Return the hinges, or raise an error that names a wrong one."""
    if not isinstance(given, Mapping) or not given:
        raise ValueError(
            f"{WHO}: hinges must be a dictionary with at least one hinge, such as {{('C1', 'start'): {{'law': "
            f"'bilinear', 'yield_force': 5e6, 'hardening_ratio': 0.02}}}}, got {shortened(given)}"
        )
    names, found = list(frame.members), {}
    for place, row in given.items():
        is_end = isinstance(place, tuple) and len(place) == 2 and place[0] in names and place[1] in ENDS
        if not is_end:
            member = place[0] if isinstance(place, tuple) and place else place
            raise ValueError(
                f"{WHO}: {place!r} is not an end of a member{did_you_mean(str(member), names)}; give (member, 'start' "
                "or 'end')"
            )
        stiffness = frame.geometry.end_springs[names.index(place[0]), ENDS.index(place[1])]
        if np.isinf(stiffness) or stiffness <= 0:
            raise ValueError(
                f"{WHO}: the end {place!r} has no spring: give member {place[0]!r} spring_{place[1]}= the initial "
                "stiffness of the hinge [N m/rad], a finite number"
            )
        if not isinstance(row, Mapping) or "law" not in row:
            raise ValueError(f"{WHO}: {place!r} needs a dictionary with 'law', got {shortened(row)}")
        found[place] = dict(row)
    return found


def _joined_hinge(
    frame: Frame,
    given: Mapping[End, Mapping[str, Any]],
    ends: Sequence[End],
    what: str,
    findings: PlausibilityFindings,
) -> tuple[float, dict[str, Any]] | None:
    """Return the stiffness [N m/rad] and the law of one hinge in place of several; None if no end has a hinge.

    Yield rotations of their members that differ implausibly are added to `findings`: the sum of the yield moments would
    hide one in another unit.
    """
    rows = [given.get(end) for end in ends]
    if not any(rows):
        return None
    for end, row in zip(ends, rows, strict=True):
        if row is None:
            raise ValueError(f"{WHO}: {what}: the end {end!r} has no hinge, but others have: give all ends hinges")
    first: Mapping[str, Any] = rows[0] or {}
    for end, row in zip(ends, rows, strict=True):
        if row is not None and (row["law"] != first["law"] or set(row) != set(first)):
            raise ValueError(
                f"{WHO}: {what}: the hinges {ends[0]!r} and {end!r} have different laws or parameters, so that one "
                "hinge cannot represent them: give them the same law with the same parameters"
            )
    names = list(frame.members)
    stiffness = np.array([frame.geometry.end_springs[names.index(member), ENDS.index(end)] for member, end in ends])
    values = {name: np.array([row[name] for row in rows if row is not None]) for name in first if name != "law"}
    strength = values.get("yield_force", stiffness)
    if "yield_force" in values and (strength > 0).all():  # HingedFishbone refuses others
        with np.errstate(divide="ignore"):
            rotations = strength / bending_stiffness(frame)[[names.index(member) for member, _ in ends]]
        usual = np.where(rotations < STRONG_ROTATION, rotations, np.nan)
        if np.isfinite(usual).any():
            weak, strong = int(np.nanargmin(usual)), int(np.nanargmax(usual))
            pair = f" ({what}; {ends[strong]!r}: {strength[strong]:.6g} N m, {ends[weak]!r}: {strength[weak]:.6g} N m)"
            findings.add("joined_yield_rotations", usual[strong] / usual[weak], pair)
    joined: dict[str, Any] = {"law": first["law"]}
    for name, each in values.items():
        weights = stiffness if name in BY_STIFFNESS else strength
        joined[name] = float(each.sum() if name in SUMMED else (each * weights).sum() / weights.sum())
    return float(stiffness.sum()), joined
