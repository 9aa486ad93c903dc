"""Find implausible masses and gravity loads of a frame, and static loads, which are mostly in another unit than SI."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.plausibility.check import LIGHTEST_PENTHOUSE
from warpdyn.foundations.core.units import STANDARD_GRAVITY

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame
    from warpdyn.model.structures.frames.tables.table import Rows

# Gravity loads over masses [m/s2] if both are in kg or both are weights, and if loads are multiplied by g twice, with
# the largest relative difference from each ratio. Users take g as 9.81 or 10 m/s2, also one value for masses and the
# other for loads. Near 1 this difference is small: frames with 10 % of the loads of their masses have a ratio of 0.981.
SUSPECTS = {
    1.0: 0.01,
    10 / STANDARD_GRAVITY: 0.003,
    STANDARD_GRAVITY**2: 0.015,
    10 * STANDARD_GRAVITY: 0.015,
    100.0: 0.015,
}
# Gravity loads over masses that are weights [m/s2]: with the loads of leaning columns, and if the period is too long.
NEAR_WEIGHT = {"complete": (0.7, 1.4), "long_period": (0.85, 1.2)}
# First periods of frames are 1 to 2.7 times 0.0724 s (height / m)**0.8 (ASCE 7, steel moment frames). If masses are
# given as weights, periods are 9.81**0.5 = 3.1 times as long.
CODE_PERIOD, CODE_EXPONENT, LONGEST_PERIOD = 0.0724, 0.8, 4.0
MOST_CARRIED = 0.7  # share of the weight of the masses that joints and beams carry in frames with leaning columns
MOST_ON_LEANING = 3.0  # gravity loads of leaning columns over the weight of the masses
SMALL_MOTION = 5e-6  # displacement over the size of the frame; loads are compared with masses if it is smaller
LARGEST_MODEL = 2.0  # m; smaller frames are models, whose loads are small
FEWEST_LOADS = 3  # loads whose median is compared with each of them


def add_loads(findings: PlausibilityFindings, frame: Frame) -> None:
    """Add implausible masses and gravity loads of a frame to `findings`."""
    nodal = {name: row["gravity_load"] for name, row in frame.nodes.items()}
    per_length = [row["gravity_load"] for row in frame.members.values()]
    loads = sum(nodal.values()) + float(np.abs(frame.geometry.length) @ per_length)  # N
    mass = horizontal_mass(frame)
    findings.add("frame_gravity_load", loads if loads else np.nan)
    if mass > 0 and loads > 0:
        is_other = findings.add("frame_gravity_over_weight", loads / (mass * STANDARD_GRAVITY))
        is_other |= findings.add("frame_weight_over_gravity", mass * STANDARD_GRAVITY / loads)
        on_leaning = sum(nodal[name] for name in leaning_nodes(frame))
        _add_weights(findings, frame, loads / mass, is_complete=on_leaning > loads / 2)
        if not is_other:
            _add_leaning(findings, on_leaning, loads - on_leaning, mass * STANDARD_GRAVITY)
    at_nodes = np.abs([load for load in nodal.values() if load])
    is_model = np.ptp(frame.coordinates, axis=0).max() < LARGEST_MODEL
    if not mass and at_nodes.size and not is_model and not _are_unit_loads(at_nodes):
        findings.add("node_gravity_load", float(at_nodes.max()))
    given = np.abs([load for load in per_length if load])
    if given.size and not _are_unit_loads(given):
        findings.add("member_gravity_load", float(np.median(given)))
    _add_masses(findings, frame)
    _add_single_loads(findings, frame)


def horizontal_mass(frame: Frame) -> float:
    """Return the sum of the horizontal masses of a frame [kg]."""
    given = sum(row.get("ux", 0.0) for row in frame.masses.values())
    return given + float(frame.geometry.length @ frame.geometry.mass_per_length)


def leaning_nodes(frame: Frame) -> list[str]:
    """Return the nodes of leaning columns: no end of a member at the node has a moment, and a member is vertical."""
    has_moment, is_upright = set(), set()
    has_end = ~frame.geometry.is_bar[:, None] & (frame.geometry.end_springs > 0)
    for row, ends in zip(frame.members.values(), has_end, strict=True):
        start, end = row["start"], row["end"]
        has_moment |= {name for name, has in zip((start, end), ends, strict=True) if has}
        if frame.nodes[start]["x"] == frame.nodes[end]["x"] and not ends.any():
            is_upright |= {start, end}
    return [name for name in frame.nodes if name in is_upright and name not in has_moment]


def _add_weights(findings: PlausibilityFindings, frame: Frame, ratio: float, *, is_complete: bool) -> None:
    """Add the ratio of gravity loads to masses to `findings` if one of them may be in kg or N instead of N or kg.

    Args:
        findings: Implausible values found so far.
        frame: The frame.
        ratio: Gravity loads over masses [m/s2].
        is_complete: Whether the loads include those of leaning columns, and thus most loads of the masses.
    """
    is_suspect = any(abs(ratio / suspect - 1) < near for suspect, near in SUSPECTS.items())
    low, high = NEAR_WEIGHT["complete" if is_complete else "long_period"]
    if is_suspect or (low < ratio < high and (is_complete or _has_long_period(frame))):
        findings.add("frame_gravity_over_mass", ratio)


def _has_long_period(frame: Frame) -> bool:
    """Return whether the first period of a frame with rigid floors is long for its height."""
    height = float(np.ptp(frame.coordinates[:, 1]))
    if not frame.diaphragms or height <= 0:
        return False
    try:
        period = float(frame.modal(modes=1)["period"][0])
    except ValueError:  # for example masses in the vertical direction only
        return False
    return period > LONGEST_PERIOD * CODE_PERIOD * height**CODE_EXPONENT


def _add_leaning(findings: PlausibilityFindings, on_leaning: float, others: float, weight: float) -> None:
    """Add gravity loads of leaning columns, or of the other members, that are too small to `findings`.

    Args:
        findings: Implausible values found so far.
        on_leaning: Sum of the gravity loads of leaning columns [N].
        others: Sum of the other gravity loads [N].
        weight: Weight of the masses [N].
    """
    if on_leaning <= 0 or others <= 0:
        return
    if others < MOST_CARRIED * weight:
        findings.add("leaning_gravity_load", on_leaning / (weight - others))
    if on_leaning < MOST_ON_LEANING * weight:
        findings.add("gravity_over_leaning", others / on_leaning)


def _are_unit_loads(sizes: np.ndarray) -> bool:
    """Return whether loads are unit loads or a pattern.

    Their sum is 1, or the largest is a power of ten, or all are multiples of the smallest, which is a power of ten.
    """

    def is_power(value: float) -> bool:
        return abs(np.log10(value) - round(np.log10(value))) < 1e-9

    smallest, largest = float(sizes.min()), float(sizes.max())
    multiples = sizes / smallest
    are_multiples = bool((np.abs(multiples - np.round(multiples)) < 1e-6).all())
    return (is_power(smallest) and are_multiples) or is_power(largest) or abs(float(sizes.sum()) - 1.0) < 2e-3


def warn_of_small_static_loads(
    frame: Frame, nodal: Rows, on_members: Iterable[Mapping[str, Any]], displacement: np.ndarray
) -> None:
    """Warn if static loads lead to very small displacements, mostly because they are in kN.

    Patterns of unit loads are meant, and a frame with an elastic modulus of 1 is dimensionless.

    Args:
        frame: The frame.
        nodal: Forces on nodes.
        on_members: Loads on members.
        displacement: Displacements and rotations of the nodes, shape [node, 3].
    """
    given = [value for row in nodal.values() for value in row.values()]
    given += [row[key] for row in on_members for key in ("qx", "qy", "px", "py")]
    sizes = np.abs([value for value in given if value])
    if not sizes.size or _are_unit_loads(sizes) or (frame.nominal.modulus == 1.0).any():
        return
    findings = PlausibilityFindings()
    moved = float(np.abs(displacement[:, :2]).max()) / float(np.ptp(frame.coordinates, axis=0).max())
    weight = horizontal_mass(frame) * STANDARD_GRAVITY
    is_small = findings.add("static_displacement", moved if moved > 0 else np.nan)
    if moved < SMALL_MOTION and weight > 0 and not is_small:
        findings.add("static_load_over_weight", float(sizes.sum()) / weight)
    findings.warn()


def _add_single_loads(findings: PlausibilityFindings, frame: Frame) -> None:
    """Add gravity loads that differ much from others, or are upward among downward ones, to `findings`.

    The load of a node is compared with the loads above and below it if these are at least 3 together, otherwise with
    the loads of all nodes.
    """
    line_of = dict(zip(frame.nodes, frame.coordinates[:, 0].tolist(), strict=True))
    nodal = {name: row["gravity_load"] for name, row in frame.nodes.items() if row["gravity_load"]}
    lines: dict[float, list[float]] = {}
    for name, load in nodal.items():
        lines.setdefault(line_of[name], []).append(load)
    per_length = {name: row["gravity_load"] for name, row in frame.members.items() if row["gravity_load"]}
    for kind, unit, loads in (("node", "N", nodal), ("member", "N/m", per_length)):
        for name, load in loads.items():
            line = lines[line_of[name]] if kind == "node" else []
            is_line = len(line) >= FEWEST_LOADS
            compared = line if is_line else list(loads.values())
            median = float(np.median(compared))
            if len(compared) >= FEWEST_LOADS and median > 0:
                of = "nodes above and below" if is_line else f"all {kind}s"
                words = f" of {kind} {name!r} ({load:.6g} {unit}) over the median of {of} ({median:.6g} {unit})"
                findings.add("gravity_load_of_one", load / median, words)


def _add_masses(findings: PlausibilityFindings, frame: Frame) -> None:
    """Add masses of 0, and masses of rigid floors that differ much from those of their neighbours, to `findings`."""
    for name, row in frame.masses.items():
        if not any(row.values()):
            kind = "floor" if name in frame.diaphragms else "node"
            findings.add("frame_floor_mass", 0.0, f" of {kind} {name!r}")
    moved = {name: row.get("ux", 0.0) for name, row in frame.masses.items()}
    of_floors = {
        floor: sum(moved.get(name, 0.0) for name in (floor, *frame.diaphragms[floor])) for floor in frame.floors
    }
    heavy = [(floor, mass) for floor, mass in of_floors.items() if mass > 0]
    pairs = list(pairwise(heavy))
    ratios = [max(lower[1] / upper[1], upper[1] / lower[1]) for lower, upper in pairs]
    if pairs and pairs[-1][1][1] < pairs[-1][0][1] and ratios[-1] < LIGHTEST_PENTHOUSE:
        ratios[-1] = np.nan
    places = [f" ({lower[0]!r}: {lower[1]:.6g} kg, {upper[0]!r}: {upper[1]:.6g} kg)" for lower, upper in pairs]
    findings.add_each("frame_mass_of_neighbours", ratios, places.__getitem__)
