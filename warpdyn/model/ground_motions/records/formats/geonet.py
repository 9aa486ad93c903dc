"""Reader of the V1A and V2A files of GeoNet, New Zealand."""

from __future__ import annotations

import re
from os import PathLike

import numpy as np

from warpdyn.foundations.core.messages import amount_of, warn_caller
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.orientations import orientation
from warpdyn.model.ground_motions.records.parsing.fixed_width import Layout, RecordText, block, layout_of_lines
from warpdyn.model.ground_motions.records.parsing.header_checks import (
    check_duration,
    check_printed_peak,
    check_time_of_peak,
    printed_precision,
    stated_count,
    stated_step,
)
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.units import unit_factor

_TEXT_LINES = 16
_INTEGERS, _REALS = Layout(10, 8, 0), Layout(10, 8)
_NUMBERS_OF_VALUES = slice(33, 36)  # indices of the numbers of accelerations, velocities and displacements
_ADDED_BEFORE = 31  # index of the number of samples that were added before the record
_TITLE = re.compile(r"\s*(?P<volume>un)?corrected\s+accelerogram\s+(?P<record>\S+)", re.IGNORECASE)
_SITE = re.compile(r"\s*site\s+(?P<site>\S+)\s+\d+\s+\d+\s+\d+[NS]", re.IGNORECASE)
_COUNT = re.compile(r"number\s+of\s+points\s+(?P<count>\d+)\s+duration\s+(?P<duration>\d*\.?\d+)\s*s", re.IGNORECASE)
_STEP = re.compile(r"\bat\s+(?:intervals\s+of\s+)?(?P<step>\d*\.?\d+)\s*s(?:ec)?\b", re.IGNORECASE)
_RAW_UNIT = re.compile(r"in\s+units\s+of\s+(?P<scale>\d*\.?\d+)?\s*(?P<unit>mm/s/s)", re.IGNORECASE)
_COMPONENT = re.compile(r"\s*component\s+(?P<component>\S+)", re.IGNORECASE)
_PEAK = re.compile(
    r"\s*acceleration:\s+peak\s+(?P<peak>[-+]?\d*\.?\d+)\s*(?P<unit>mm/s/s|g)\s+at\s+(?P<time>\d*\.?\d+)\s*s",
    re.IGNORECASE,
)


def is_geonet(first_lines: list[str]) -> bool:
    """Return whether a file is a file of GeoNet: the first lines are a title, and the site with its coordinates."""
    return len(first_lines) > 1 and bool(_TITLE.match(first_lines[0]) and _SITE.match(first_lines[1]))


def read_geonet(path: str | PathLike) -> list[GroundMotion]:
    """Return the accelerations in a V1A (uncorrected) or V2A (corrected) file, which has three components in mm/s2.

    Source: GeoNet, "Strong motion file formats": 16 lines of text, 40 whole numbers and 60 decimal numbers. Then the
    accelerations and, in V2A files, velocities and displacements follow.
    """
    record = RecordText.of(path)
    motions: list[GroundMotion] = []
    at = 0
    while at < len(record.lines):
        motion, at = _component(record, at)
        motions.append(motion)
    if len(motions) != 3:
        warn_caller(
            f"{path}: this GeoNet file has {amount_of(len(motions), 'component')} instead of 3: it may be "
            "truncated. Compare it with a complete copy"
        )
    return motions


def _component(record: RecordText, first: int) -> tuple[GroundMotion, int]:
    """Return the acceleration of the component that starts at line `first`, and the index of the line after it.

    The acceleration is a ground motion in m/s2.
    """
    record.line(first + _TEXT_LINES, "its values")
    title = record.expected(first, _TITLE, "'Uncorrected accelerogram' or 'Corrected accelerogram'")
    site = record.expected(first + 1, _SITE, "'Site', its code and its coordinates")
    counted = record.expected(first + 9, _COUNT, "'Number of points 5800 Duration 115.98 s'")
    stepped = record.expected(first + 10, _STEP, "'at intervals of 0.005 s'")
    oriented = record.expected(first + 12, _COMPONENT, "'Component' and its direction")
    peak = record.expected(first + 13, _PEAK, "'Acceleration: Peak 2394.8 mm/s/s'")
    place, place_of_step = record.place(first + 9), record.place(first + 10)
    count = stated_count(counted["count"], place)
    step = stated_step(stepped["step"], place_of_step)
    raw = _RAW_UNIT.search(record.lines[first + 10])
    if title["volume"] and not raw:
        record.expected(first + 10, _RAW_UNIT, "'in units of 1.00 mm/s/s'")
    scale = float(raw["scale"] or 1) if raw else 1.0
    if not 0 < scale < np.inf:
        raise damaged(f"{place_of_step}: the unit of the values must be above 0 mm/s/s, got {scale:g}")

    integers, after = block(record, first + _TEXT_LINES, 40, _INTEGERS, is_data=False)
    _, after = block(record, after, 60, _REALS, is_data=False)
    numbers = [int(each) for each in integers[_NUMBERS_OF_VALUES]]
    if numbers[0] not in (0, count):
        raise damaged(f"{place}: {count} points, but value 34 of the whole numbers is {numbers[0]}")
    values, after = block(record, after, count, layout_of_lines(record, after))
    if not title["volume"]:
        for number in numbers[1:]:
            if number:
                after = block(record, after, number, layout_of_lines(record, after))[1]
    while after < len(record.lines) and not record.lines[after].strip():
        after += 1
    if after < len(record.lines) and not _TITLE.match(record.lines[after]):
        raise damaged(
            f"{record.place(after)}: expected the header of the next component, got "
            f"{record.lines[after].strip()[:60]!r}: there are more values than the header states"
        )
    check_duration(count, step, counted["duration"], place, printed_precision(stepped["step"]))
    factor = scale * unit_factor("mm/s2", place)
    place = record.place(first + 13)
    check_printed_peak(factor * values / unit_factor(peak["unit"], place), peak["peak"], place, precision=0.1 * scale)
    # Times in corrected records are counted from the start of the uncorrected record; samples were added before it.
    first_time = 0.0 if title["volume"] else float(integers[_ADDED_BEFORE]) * step
    check_time_of_peak(values, step, peak["time"], place, precision=0.1, first=first_time)
    component = orientation(oriented["component"]).known_label
    return record.motion(factor * values, step, component, f"{site['site']} {title['record']}"), after
