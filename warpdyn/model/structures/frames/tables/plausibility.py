"""Find implausible values of the tables of a frame, which are mostly in another unit than those of SI."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
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
    findings.add_each("radius_of_gyration", radii, lambda place: f" {sections[place]!r}")
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
    findings.warn()


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
