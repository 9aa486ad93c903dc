"""Find implausible values of the tables of a frame, which are mostly in another unit than those of SI."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.plausibility.check import LIGHTEST_PENTHOUSE
from warpdyn.foundations.core.units import STANDARD_GRAVITY

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame

# Gravity loads over masses [m/s2] if both are in kg or both are weights, and if loads are multiplied by g twice, with
# the largest relative difference from each ratio. Users take g as 9.81 or 10 m/s2, also one value for masses and the
# other for loads. Near 1 this difference is small: frames with 10 % of the loads of their masses have such ratios.
SUSPECTS = {
    1.0: 0.015,
    STANDARD_GRAVITY / 10: 0.003,
    10 / STANDARD_GRAVITY: 0.003,
    STANDARD_GRAVITY**2: 0.015,
    10 * STANDARD_GRAVITY: 0.015,
    100.0: 0.015,
}
# Smallest radius of gyration [m] of the sections whose mass is compared with their area. A smaller radius may be due to
# an area that is 100 or more times as large as the real one so that members keep their lengths.
LEAST_RADIUS = 0.05
# Radii of gyration of usual sections [m]. A section beyond them is compared with the median of the usual ones.
USUAL_RADII = (0.01, 3.0)
# Sections with a larger second moment, up to this factor on the median, and a usual area are meant to be rigid.
MOST_AREA, MOST_INERTIA = 100.0, 1e5
AREA_UNITS = (1e-4, 1e-6)  # cm2 and mm2 in m2
MOST_CORRECTED_AREA = 5.0  # of an area in m2 over those of other sections, or their ratio to it
FEWEST_OTHERS = 2  # sections with whose median another one is compared
FEWEST_LOADS = 3  # loads whose median is compared with each of them


def warn_of_implausible_tables(frame: Frame) -> None:
    """Give one warning of implausible lengths, moduli, sections, masses of members, and gravity loads of a frame.

    A frame with an elastic modulus of 1 is dimensionless, as frames of textbooks, and is not checked.
    """
    modulus = {name: row["elastic_modulus"] for name, row in frame.sections.items()}
    if 1.0 in modulus.values():
        return
    findings = PlausibilityFindings()
    members, sections = list(frame.members), list(frame.sections)
    findings.add_each("member_length", frame.geometry.length.tolist(), lambda place: f" {members[place]!r}")
    findings.add_each("elastic_modulus", list(modulus.values()), lambda place: f" {sections[place]!r}")
    radii = [float(np.sqrt(row["second_moment"] / row["area"])) for row in frame.sections.values()]
    _add_radii(findings, frame, np.array(radii))
    # A mass of 0 is the default: the masses are on the floors.
    densities = [
        row["mass_per_length"] / row["area"] if row["mass_per_length"] > 0 and radius > LEAST_RADIUS else np.nan
        for row, radius in zip(frame.sections.values(), radii, strict=True)
    ]
    findings.add_each("mass_over_area", densities, lambda place: f" {sections[place]!r}")
    # Vertical and horizontal bars may be leaning columns and links, whose areas are large so that lengths stay equal.
    along = np.diff(frame.coordinates[frame.ends], axis=1)[:, 0]
    braces = np.flatnonzero(frame.geometry.is_bar & along.all(axis=1))
    widths = np.sqrt(frame.nominal.area[braces]) / frame.geometry.length[braces]
    findings.add_each("truss_width_over_length", widths.tolist(), lambda place: f" {members[braces[place]]!r}")
    _add_shear_and_capacities(findings, frame)
    nodal = sum(row["gravity_load"] for row in frame.nodes.values())
    per_length = [row["gravity_load"] for row in frame.members.values()]
    loads = nodal + float(np.abs(frame.geometry.length) @ per_length)  # N
    mass = sum(row.get("ux", 0.0) for row in frame.masses.values())
    mass += float(frame.geometry.length @ frame.geometry.mass_per_length)
    findings.add("frame_gravity_load", loads if loads else np.nan)
    if mass > 0 and loads > 0:
        findings.add("frame_gravity_over_weight", loads / (mass * STANDARD_GRAVITY))
        findings.add("frame_weight_over_gravity", mass * STANDARD_GRAVITY / loads)
        if any(abs(loads / mass / suspect - 1) < near for suspect, near in SUSPECTS.items()):
            findings.add("frame_gravity_over_mass", loads / mass)
    _add_masses(findings, frame)
    _add_loads(findings, frame)
    findings.warn()


def _add_radii(findings: PlausibilityFindings, frame: Frame, radii: np.ndarray) -> None:
    """Add implausibly large radii of gyration, and areas that differ much from those of other sections, to `findings`.

    An area that is a power of ten is meant to be rigid. The area of a member between two nodes of a rigid floor has no
    effect.

    Args:
        findings: Implausible values found so far.
        frame: The frame.
        radii: Radii of gyration of its sections, 0 for those of trusses [m].
    """
    names = list(frame.sections)
    floor_of = {node: floor for floor, nodes in frame.diaphragms.items() for node in nodes}
    stretched = {
        row["section"]
        for row in frame.members.values()
        if floor_of.get(row["start"], 0) != floor_of.get(row["end"], 1) and row["kind"] == "beam"
    }
    area, inertia = (np.array([row[key] for row in frame.sections.values()]) for key in ("area", "second_moment"))
    usual = (radii >= USUAL_RADII[0]) & (radii <= USUAL_RADII[1])
    if usual.sum() >= FEWEST_OTHERS:
        median = float(np.median(area[usual]))
        over, stiffer = area / median, inertia / np.median(inertia[usual])
        is_rigid = (radii > USUAL_RADII[1]) & (over <= MOST_AREA) & (stiffer <= MOST_INERTIA)
        radii = np.where(is_rigid, np.nan, radii)
        units = np.array(AREA_UNITS)[:, None]
        corrected = np.sqrt(inertia / (area * units))
        explained = (corrected >= USUAL_RADII[0]) & (corrected <= USUAL_RADII[1])
        # Areas that are 1,000 times as large are meant to be rigid, too.
        explained &= (over * units >= 1 / MOST_CORRECTED_AREA) & (over * units <= MOST_CORRECTED_AREA)
        explained = explained.any(axis=0)
        is_other = explained & (radii < USUAL_RADII[0]) & np.array([name in stretched for name in names])
        is_other &= np.log10(area) % 1 != 0
        if 2 * is_other.sum() < usual.sum():
            for place in np.flatnonzero(is_other):
                words = f" {names[place]!r} ({area[place]:.4g} m2) over the median of others ({median:.4g} m2)"
                findings.add("area_of_one_section", over[place], words)
    findings.add_each("radius_of_gyration", radii.tolist(), lambda place: f" {names[place]!r}")


def _add_loads(findings: PlausibilityFindings, frame: Frame) -> None:
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


def _add_shear_and_capacities(findings: PlausibilityFindings, frame: Frame) -> None:
    """Add implausible shear stiffnesses and capacities of sections to `findings`.

    The strain at a capacity is N / (E A), V / (E A) or M r / (E I) with the radius of gyration r. The section with the
    largest strain is checked: leaning columns may have a very large area.
    """
    for name, row in frame.sections.items():
        if row["shear_area"] > 0:
            ratio = row["shear_modulus"] / row["elastic_modulus"]
            findings.add("shear_over_elastic_modulus", ratio, f" {name!r}")
            findings.add("shear_area_over_area", row["shear_area"] / row["area"], f" {name!r}")
    for kind in ("axial", "shear", "moment"):
        strains = {}
        for name, row in frame.sections.items():
            size = np.sqrt(row["second_moment"] * row["area"]) if kind == "moment" else row["area"]
            capacity = row[f"{kind}_capacity"]
            if size > 0 and np.isfinite(capacity):
                strains[name] = capacity / (row["elastic_modulus"] * size)
        largest = max(strains, key=strains.__getitem__, default="")
        if largest and strains[largest] < 1:  # larger capacities are meant to be infinite
            findings.add("capacity_strain", strains[largest], f" {largest!r} ({kind}_capacity)")
