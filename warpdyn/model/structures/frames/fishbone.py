"""Fish-bone frames: one column line and one half-beam per floor, from a frame with rigid floors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.plausibility import meant_as_given
from warpdyn.foundations.core.plausibility.frames import CHECKS_OF_FRAMES
from warpdyn.model.structures.frames.frame import Frame

RIGID_AREA = 1e3  # area of the column line over the sum of the columns, so that it is nearly axially rigid
SAME = 1e-6  # largest relative difference of lengths and end springs of columns that count as equal


@dataclass
class Level:
    """The members of a storey and of the floor above it, by index."""

    columns: list[int] = field(default_factory=list)
    leaning: list[int] = field(default_factory=list)
    beams: list[int] = field(default_factory=list)


@suggests_names
def fishbone(frame: Frame) -> Frame:
    """Return the fish-bone frame of a frame with rigid floors (generic frame; elastic).

    All joints of a floor have one rotation, and columns do not shorten. The columns of a storey become one column with
    the sum of their stiffnesses and of their end springs. The beams of a floor become one half-beam with a roller at
    its end, whose rotational stiffness is the sum of the moments of all beam ends for a unit rotation of all joints: 12
    E I / L for a beam without springs, offsets and shear deformation. All gravity loads act on a leaning column, as do
    columns with hinges at both ends (a pinned base of a single column is a hinge).

    A frame with equal bays, axially rigid members and outer columns with half of the inner stiffness sways exactly as
    its fish-bone. Otherwise the fish-bone is stiffer than the frame, because its joints have equal rotations and no
    vertical displacements. Frames for which this is not true are refused: see Raises.

    Sources: Ogawa, Kamura and Inoue (1999); Nakashima, Ogawa and Inoue (2002), "Generic frame model for simulation of
    earthquake responses of steel moment frames".

    Args:
        frame: A frame with diaphragms; its members are columns between adjacent floors, beams within a floor and
            leaning columns (vertical trusses).

    Returns:
        The fish-bone: nodes "J0", "J1" (joints), "R1" (rollers) and "L0", "L1" (leaning column) and so on; members "C1"
        (columns), "B1" (half-beams) and "L1"; the same diaphragms and horizontal masses.

    Raises:
        ValueError: If the frame has no rigid floors, an inclined member, a member that skips a floor, columns with
            different supports, lengths or end springs (relative to E I / L) in a storey, rigid end offsets of columns,
            a horizontal or rotational support of a floor, geometric_stiffness="consistent", or p_delta="no".
        TypeError: If `frame` is not a Frame.

    Example:
        >>> bone = wd.fishbone(portal)
        >>> bone
        Frame(3 nodes, 2 members, 3 degrees of freedom)
        >>> (bone.modal()["period"] / portal.modal()["period"]).values.round(3)
        array([0.999])
    """
    check_kind("fishbone", "a Frame", frame, Frame, argument="frame")
    levels, floors = levels_of(frame)
    _refuse_other_p_delta(frame, levels)
    heights = [0.0, *(frame.level_of(floor) - _base(frame) for floor in floors)]
    width = _half_bay(frame)
    nodes: dict[str, Any] = {"J0": (0.0, 0.0)}
    members: dict[str, Any] = {}
    sections: dict[str, Any] = {}
    supports: dict[str, Any] = {"J0": _base_support(frame, levels[0])}
    gravity = _gravity_of_floors(frame, floors)
    has_leaning = any(gravity)
    if has_leaning:
        nodes["L0"], supports["L0"] = (2 * width, 0.0), "pinned"
    modulus = float(frame.nominal.modulus.max())
    sections["leaning"] = {"elastic_modulus": modulus, "area": float(frame.nominal.area.sum())}
    diaphragms: dict[str, list[str]] = {}
    for place, (level, floor) in enumerate(zip(levels, floors, strict=True), start=1):
        names = (f"J{place}", f"R{place}", f"L{place}")
        y = heights[place]
        nodes |= {names[0]: (0.0, y), names[1]: (width, y)}
        supports |= {names[0]: "roller", names[1]: "roller"}
        sections[f"C{place}"], members[f"C{place}"] = _column_line(frame, level, modulus, place)
        turning = _floor_stiffness(frame, level)
        inertia = turning * width / (3 * modulus)
        if turning <= 0:
            raise ValueError(f"fishbone(): no beam of floor {floor!r} resists a rotation of its joints")
        sections[f"B{place}"] = {"elastic_modulus": modulus, "area": 1.0, "second_moment": inertia}
        members[f"B{place}"] = {"start": names[0], "end": names[1], "section": f"B{place}"}
        diaphragms[floor] = list(names[:2])
        if has_leaning:
            nodes[names[2]] = {"x": 2 * width, "y": y, "gravity_load": gravity[place - 1]}
            members[f"L{place}"] = {"start": f"L{place - 1}", "end": names[2], "section": "leaning", "kind": "truss"}
            diaphragms[floor].append(names[2])
    masses = _masses_of_floors(frame, floors)
    with meant_as_given(*CHECKS_OF_FRAMES):  # the warning of the given frame
        return Frame(nodes, members, sections, supports=supports, diaphragms=diaphragms, masses=masses)


def _base(frame: Frame) -> float:
    return float(min(frame.nodes[name]["y"] for name in frame.supports))


def levels_of(frame: Frame, who: str = "fishbone()") -> tuple[list[Level], list[str]]:
    """Return the members of each storey with the floor above, and the moving floors from the lowest to the highest."""
    free = set(frame.numbering.free_names)
    floors = [floor for floor in frame.floors if floor in free]
    if not floors:
        raise ValueError(f"{who}: the frame has no rigid floors: give diaphragms= with the nodes of each floor")
    level_of = {node: place for place, floor in enumerate(floors, start=1) for node in frame.diaphragms[floor]}
    found = [Level() for _ in floors]
    for index, (name, row) in enumerate(frame.members.items()):
        ends = [row["start"], row["end"]]
        for node in ends:
            if node not in level_of and node not in frame.supports:
                raise ValueError(f"{who}: node {node!r} of member {name!r} is neither on a rigid floor nor supported")
            if node in level_of and not {"ux", "rz"}.isdisjoint(frame.supports.get(node, {})):
                raise ValueError(
                    f"{who}: the support of node {node!r} on a rigid floor would be lost: remove its ux and rz"
                )
        low, high = sorted(level_of.get(node, 0) for node in ends)
        x = frame.coordinates[frame.ends[index], 0]
        if low == high and low:
            found[low - 1].beams.append(index)
        elif high - low == 1 and abs(x[1] - x[0]) <= 1e-6 * frame.geometry.length[index]:
            _refuse_offsets(name, row)
            is_leaning = row["kind"] == "truss" or all(_is_hinged(frame, index))
            which = found[high - 1].leaning if is_leaning else found[high - 1].columns
            which.append(index)
        else:
            raise ValueError(
                f"{who}: member {name!r} is neither a beam within a floor nor a column between adjacent floors: a "
                "fish-bone has no braces and no columns over several storeys"
            )
    for floor, level in zip(floors, found, strict=True):
        if not level.columns:
            raise ValueError(f"{who}: the storey below floor {floor!r} has no column that resists its drift")
    return found, floors


def _is_hinged(frame: Frame, index: int) -> list[bool]:
    """Return whether the start and the end of a member have no moment: a hinge, or the only member at a pinned base."""
    found = []
    for end, node in enumerate(frame.ends[index]):
        support = frame.supports.get(list(frame.nodes)[node], {})
        is_alone = int((frame.ends == node).sum()) == 1 and not support.get("rz")
        found.append(bool(frame.geometry.end_springs[index, end] == 0) or is_alone)
    return found


def _refuse_offsets(name: str, row: Mapping[str, Any]) -> None:
    for column in ("offset_start_x", "offset_start_y", "offset_end_x", "offset_end_y"):
        if row[column]:
            raise ValueError(
                f"fishbone(): column {name!r} has the rigid end offset {column} = {row[column]:g} m, which a fish-bone "
                "cannot have: remove it, and increase second_moment instead"
            )


def _refuse_other_p_delta(frame: Frame, levels: list[Level]) -> None:
    """Raise a ValueError if the geometric stiffness is not that of vertical strings with all gravity loads."""
    if frame.geometric_kind != "string":
        raise ValueError(
            f"fishbone(): geometric_stiffness={frame.geometric_kind!r} cannot be transferred, because a leaning column "
            "carries all gravity loads: give the frame geometric_stiffness='string'"
        )
    names = list(frame.members)
    for index in (index for level in levels for index in (*level.columns, *level.leaning)):
        if frame.members[names[index]]["p_delta"] == "no":
            raise ValueError(
                f"fishbone(): column {names[index]!r} has p_delta='no', but a leaning column carries all gravity "
                "loads: give all columns p_delta='yes'"
            )


def _column_line(frame: Frame, level: Level, modulus: float, place: int) -> tuple[dict[str, float], dict[str, Any]]:
    """Return section and member of the column line: sums of EI, of shear stiffness and of end springs."""
    taken = level.columns
    nominal, geometry = frame.nominal, frame.geometry
    _refuse_different_lengths(frame, [*taken, *level.leaning])
    _refuse_different_springs(frame, taken)
    bending = nominal.modulus[taken] * nominal.inertia[taken]
    section = {
        "elastic_modulus": modulus,
        "area": RIGID_AREA * float(nominal.area[taken].sum()),
        "second_moment": float(bending.sum()) / modulus,
    }
    if geometry.shear[taken].any():
        flexible = geometry.shear[taken] > 0
        if not flexible.all():
            raise ValueError(f"fishbone(): only some columns of storey {place} have a shear stiffness: give it to all")
        stiffness = float((nominal.modulus[taken] / geometry.shear[taken]).sum())
        section |= {"shear_modulus": modulus, "shear_area": stiffness / modulus}
    member: dict[str, Any] = {"start": f"J{place - 1}", "end": f"J{place}", "section": f"C{place}"}
    for end in ("start", "end"):
        member[f"spring_{end}"] = float(_springs_at(frame, taken, end).sum())
    return section, member


def _refuse_different_lengths(frame: Frame, columns: list[int]) -> None:
    names = list(frame.members)
    lengths = frame.geometry.length[columns]
    for place in np.flatnonzero(np.abs(lengths - lengths[0]) > SAME * lengths[0]):
        raise ValueError(
            f"fishbone(): columns {names[columns[0]]!r} and {names[columns[place]]!r} of a storey have the lengths "
            f"{lengths[0]:g} and {lengths[place]:g} m: a fish-bone has one column per storey"
        )


def _refuse_different_springs(frame: Frame, columns: list[int]) -> None:
    """Raise a ValueError unless the end springs of columns are in proportion to E I / L."""
    names = list(frame.members)
    bending = frame.nominal.modulus[columns] * frame.nominal.inertia[columns] / frame.geometry.length[columns]
    for end, words in (("start", "lower"), ("end", "upper")):
        ratios = _springs_at(frame, columns, end) / bending
        # A relative difference of infinite or zero ratios: of ratio / (1 + ratio), which is 1 or 0.
        with np.errstate(invalid="ignore"):
            fixity = np.where(np.isinf(ratios), 1.0, ratios / (1 + ratios))
        for place in np.flatnonzero(np.abs(fixity - fixity[0]) > SAME * (1 - np.minimum(fixity, fixity[0]))):
            raise ValueError(
                f"fishbone(): the springs (or hinges) at the {words} ends of columns {names[columns[0]]!r} and "
                f"{names[columns[place]]!r} are {ratios[0]:g} and {ratios[place]:g} times E I / L: give all columns of "
                "a storey the same ratio, or hinges at both ends (leaning column)"
            )


def _springs_at(frame: Frame, columns: list[int], end: str) -> np.ndarray:
    """Return the springs at the lower ("start") or upper ("end") ends of columns [N m/rad], shape [column]."""
    y = frame.coordinates[frame.ends[columns], 1]
    lower = np.argmin(y, axis=1)
    springs = frame.geometry.end_springs[columns]
    found: np.ndarray = springs[np.arange(len(columns)), lower if end == "start" else 1 - lower]
    return found


def _floor_stiffness(frame: Frame, level: Level) -> float:
    """Return the sum of the moments of all beam ends for a unit rotation of all joints [N m/rad]."""
    turned = np.zeros(6)
    turned[[2, 5]] = 1.0
    stiffness = frame.stiffness_of_members(frame.nominal)[level.beams]
    return float(np.einsum("i,mij,j->", turned, stiffness, turned))


def _half_bay(frame: Frame) -> float:
    """Return half of the mean length of beams [m]."""
    x = frame.coordinates[frame.ends, 0]
    spans = np.abs(x[:, 1] - x[:, 0])
    return float(spans[spans > 0].mean() / 2) if (spans > 0).any() else 1.0


def _base_support(frame: Frame, level: Level) -> dict[str, bool | float]:
    """Return the support of the column line: that of all columns, or the sum of their rotational springs."""
    lower = [frame.ends[i][np.argmin(frame.coordinates[frame.ends[i], 1])] for i in level.columns]
    names = [list(frame.nodes)[node] for node in lower]
    turns = [frame.supports[name].get("rz", 0.0) for name in names]
    if all(turn is True for turn in turns):
        return {"ux": True, "uy": True, "rz": True}
    if any(turn is True for turn in turns):
        fixed, other = (names[[turn is True for turn in turns].index(value)] for value in (True, False))
        raise ValueError(
            f"fishbone(): the rotation of base {fixed!r} is fixed, but that of {other!r} is not: columns of a fish-bone"
            " have equal rotations. Give all bases the same support"
        )
    total = float(sum(float(turn) for turn in turns))
    return {"ux": True, "uy": True} | ({"rz": total} if total else {})


def _gravity_of_floors(frame: Frame, floors: list[str]) -> list[float]:
    """Return the gravity loads of nodes and members at each floor [N]."""
    found = {node: row["gravity_load"] for node, row in frame.nodes.items()}
    for place, row in enumerate(frame.members.values()):
        half = row["gravity_load"] * frame.geometry.length[place] / 2
        found[row["start"]] += half
        found[row["end"]] += half
    return [float(sum(found[node] for node in frame.diaphragms[floor])) for floor in floors]


def _masses_of_floors(frame: Frame, floors: list[str]) -> dict[str, float]:
    """Return the horizontal masses of the floors [kg], with half of the columns above and below."""
    diagonal = np.asarray(frame.mass().sum(axis=0)).ravel() if frame.member_mass == "lumped" else None
    if diagonal is None:
        raise ValueError("fishbone(): consistent masses cannot be transferred: give the frame member_mass='lumped'")
    return {floor: float(diagonal[frame.numbering.names.index(floor)]) for floor in floors}
