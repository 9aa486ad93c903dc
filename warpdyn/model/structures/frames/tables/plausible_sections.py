"""Find implausible sections of a frame: radii of gyration, second moments, masses, shear stiffnesses and capacities."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.plausibility.table import CHECKS

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame

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
SIMILAR_AREA = 3.0  # largest ratio of areas of sections whose second moments are compared
APART = 5.0  # least ratio to the second_moment / area**2 of every other section
STEEL_SHAPE = 6.0  # second_moment / area**2 of deep steel sections, which have 2 to 9
STEEL_MODULUS = (1.9e11, 2.2e11)  # Pa
# Largest area over second_moment**0.5 of sections whose area is real: flat bars of 20:1 have 20.
MOST_AREA_OVER_RADIUS = 20.0


def add_sections(findings: PlausibilityFindings, frame: Frame) -> None:
    """Add implausible moduli, areas, second moments, masses and capacities of sections to `findings`."""
    sections = list(frame.sections)
    moduli = [row["elastic_modulus"] for row in frame.sections.values()]
    findings.add_each("elastic_modulus", moduli, lambda place: f" {sections[place]!r}")
    radii = [float(np.sqrt(row["second_moment"] / row["area"])) for row in frame.sections.values()]
    _add_second_moments(findings, frame, _add_radii(findings, frame, np.array(radii)))
    _add_masses(findings, frame, radii)
    # Vertical and horizontal bars may be leaning columns and links, whose areas are large so that lengths stay equal.
    members = list(frame.members)
    along = np.diff(frame.coordinates[frame.ends], axis=1)[:, 0]
    braces = np.flatnonzero(frame.geometry.is_bar & along.all(axis=1))
    widths = np.sqrt(frame.nominal.area[braces]) / frame.geometry.length[braces]
    findings.add_each("truss_width_over_length", widths.tolist(), lambda place: f" {members[braces[place]]!r}")
    _add_shear_and_capacities(findings, frame)


def _add_radii(findings: PlausibilityFindings, frame: Frame, radii: np.ndarray) -> np.ndarray:
    """Add implausibly large radii of gyration, and areas that differ much from those of other sections, to `findings`.

    An area that is a power of ten is meant to be rigid. The area of a member between two nodes of a rigid floor has no
    effect.

    Args:
        findings: Implausible values found so far.
        frame: The frame.
        radii: Radii of gyration of its sections, 0 for those of trusses [m].

    Returns:
        Radii of gyration, NaN for sections that `findings` already names.
    """
    names = list(frame.sections)
    floor_of = {node: floor for floor, nodes in frame.diaphragms.items() for node in nodes}
    stretched = {
        row["section"]
        for row in frame.members.values()
        if floor_of.get(row["start"], 0) != floor_of.get(row["end"], 1) and row["kind"] == "beam"
    }
    area, inertia = (np.array([row[key] for row in frame.sections.values()]) for key in ("area", "second_moment"))
    own, is_other = radii, np.zeros(len(radii), dtype=bool)
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
    found: np.ndarray = np.where(is_other | (radii > CHECKS["radius_of_gyration"].high), np.nan, own)
    return found


def _add_second_moments(findings: PlausibilityFindings, frame: Frame, radii: np.ndarray) -> None:
    """Add second moments that do not fit the area of their section and other sections to `findings`.

    Second moments over squared areas of sections with similar areas are compared. Beams are often rigid on purpose, so
    that only those of columns can be too large. Second moments of leaning columns are often small on purpose, so that
    only those of sections that are joined with others can be too small. A power of ten is that of a rigid member.
    """
    names, of_beams = list(frame.sections), [row["section"] for row in frame.members.values() if row["kind"] == "beam"]
    area, inertia = (np.array([row[key] for row in frame.sections.values()]) for key in ("area", "second_moment"))
    compared = np.isin(names, of_beams) & (inertia > 0)
    shape = np.where(compared, inertia / area**2, np.nan)
    is_round = np.log10(np.where(inertia > 0, inertia, 1.0)) % 1 == 0
    is_usual = compared & ~is_round & (radii >= USUAL_RADII[0]) & (radii <= USUAL_RADII[1])
    upright, joined = _upright_and_joined(frame)
    for place in np.flatnonzero(compared):
        name, others = names[place], np.flatnonzero(is_usual & (np.arange(len(names)) != place))
        if is_round[place] or np.isnan(radii[place]):
            continue
        if others.size >= FEWEST_OTHERS:
            median, of = float(np.exp(np.median(np.log(shape[others])))), "the median of others"
            similar = area[place] / np.median(area[others])
            is_known = 1 / SIMILAR_AREA <= similar <= SIMILAR_AREA
            is_known &= not shape[others].min() / APART < shape[place] < shape[others].max() * APART
        else:
            median, of = STEEL_SHAPE, "that of deep steel sections"
            is_known = shape[place] > STEEL_SHAPE  # concrete and timber have 0.1
        over = shape[place] / median
        if is_known and name in (upright if over > 1 else joined):
            words = f" {name!r} ({inertia[place]:.4g} m4, {area[place]:.4g} m2) over {of} ({median:.3g})"
            findings.add("second_moment_of_one_section", over, words)


def _upright_and_joined(frame: Frame) -> tuple[set[str], set[str]]:
    """Return the sections of members that are not horizontal, and those that are rigidly joined with another one."""
    upright, at_nodes = set(), dict.fromkeys(frame.nodes, frozenset[str]())
    for row, springs in zip(frame.members.values(), frame.geometry.end_springs, strict=True):
        if row["kind"] != "beam":
            continue
        if frame.nodes[row["start"]]["y"] != frame.nodes[row["end"]]["y"]:
            upright.add(row["section"])
        for end, spring in zip(("start", "end"), springs, strict=True):
            if spring > 0:
                at_nodes[row[end]] |= {row["section"]}
    return upright, set().union(*(each for each in at_nodes.values() if len(each) > 1))


def _add_masses(findings: PlausibilityFindings, frame: Frame, radii: list[float]) -> None:
    """Add masses per length that do not fit the area of their section to `findings`.

    A mass of 0 is the default: the masses are on the floors.
    """
    names, densities, of_steel = list(frame.sections), [], []
    for row, radius in zip(frame.sections.values(), radii, strict=True):
        is_known = row["mass_per_length"] > 0 and radius > LEAST_RADIUS
        density = row["mass_per_length"] / row["area"] if is_known else np.nan
        is_real = radius > 0 and row["area"] / radius**2 <= MOST_AREA_OVER_RADIUS
        is_steel = is_real and STEEL_MODULUS[0] <= row["elastic_modulus"] <= STEEL_MODULUS[1]
        densities.append(density)
        of_steel.append(density if is_steel and density >= CHECKS["mass_over_area"].low else np.nan)
    findings.add_each("mass_over_area", densities, lambda place: f" {names[place]!r}")
    findings.add_each("mass_over_area_of_steel", of_steel, lambda place: f" {names[place]!r} of steel")


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
