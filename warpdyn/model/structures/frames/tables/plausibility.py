"""Find implausible values of the tables of a frame, which are mostly in another unit than those of SI."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.model.structures.frames.tables.plausible_loads import add_loads
from warpdyn.model.structures.frames.tables.plausible_sections import add_sections
from warpdyn.model.structures.frames.tables.plausible_springs import add_offsets, add_springs, add_supports

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame


def warn_of_implausible_tables(frame: Frame) -> None:
    """Give one warning of implausible lengths, sections, springs, masses and gravity loads of a frame.

    A frame with an elastic modulus of 1 is dimensionless, as frames of textbooks, and is not checked.
    """
    if any(row["elastic_modulus"] == 1.0 for row in frame.sections.values()):
        return
    findings, members = PlausibilityFindings(), list(frame.members)
    lengths = np.where(add_offsets(findings, frame), np.nan, frame.geometry.length)
    findings.add_each("member_length", lengths.tolist(), lambda place: f" {members[place]!r}")
    add_sections(findings, frame)
    add_springs(findings, frame)
    add_supports(findings, frame)
    add_loads(findings, frame)
    findings.warn()
