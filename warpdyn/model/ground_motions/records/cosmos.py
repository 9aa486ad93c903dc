"""Reader of COSMOS strong-motion files (format 1.20)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from warpdyn.foundations.core.checks import one_of
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.orientations import azimuth_label
from warpdyn.model.ground_motions.records.components.selection import COMPONENTS, select_components
from warpdyn.model.ground_motions.records.parsing.fixed_width import Layout, RecordText, block, check_end
from warpdyn.model.ground_motions.records.parsing.header_checks import check_count, check_printed_peak
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.text import number
from warpdyn.model.ground_motions.records.units import checked_step, unit_factor

_TEXT_LINES = re.compile(r"\(Format\s+v\S+\s+with\s+(\d+)\s+text\s+lines\)", re.IGNORECASE)
_VALUES = {
    kind: re.compile(rf"^\s*(\d+)\s+{kind}-header\s+values\s+follow\s+on\s+(\d+)\s+lines", re.IGNORECASE)
    for kind in ("Integer", "Real")
}
_COMMENTS = re.compile(r"^\s*(\d+)\s+Comment\s+line", re.IGNORECASE)
_DATA = re.compile(
    r"^\s*(?P<count>\d+)\s+(?P<quantity>[A-Za-z][\w. -]*?)\s+pts,\s*approx\s+(?P<seconds>[\d.]+)\s+secs,\s*"
    r"units=\s*(?P<unit>[^(,]+?)[.\s]*\((?P<code>\d+)\)\s*,?\s*Format=\s*(?P<format>\(\d+[FEGI]\d+.*)",
    re.IGNORECASE,
)
_END = re.compile(r"[\s/&-]*End[- ]of[- ]data", re.IGNORECASE)
# Units from tables 2 and 6 of the specification, and indices (from 0) of values in the integer and real headers.
_UNIT_CODES = {2: "g", 4: "cm/s2", 10: "gal"}
_AZIMUTH, _STEP_IN_MS, _PEAK = 53, 61, 63
_ORIENTATIONS = {400: "UP", 401: "DOWN", 402: "VERT", 600: "L", 601: "T", 700: "H1", 701: "H2"}
_UNKNOWN = -999.0
_PEAK_TOLERANCE = 1e-3  # times the peak in the header: largest difference from the peak of the values


def read_cosmos(path: str | Path, components: str = "horizontal") -> list[GroundMotion]:
    """Read the accelerations in a COSMOS file (.V1C, .V2C) with one or more channels; by default, horizontal channels.

    Source: COSMOS, "Strong Motion Data Format", version 1.20 (2001).

    Args:
        path: The file. Motions are named by the file name without suffix and the component of the channel.
        components: "horizontal", "vertical" or "all"; the azimuths in the header decide which channels are read.

    Returns:
        The motions [m/s2], with `record` and `component`; velocities and displacements are skipped.

    Raises:
        FileNotFoundError, IsADirectoryError: If there is no such file, or it is a directory.
        ValueError: If a header is not as specified; if the unit is not a unit of acceleration (raw counts); if a value
            is not a finite number or does not fit the format that the file states; if the number, the duration or the
            peak of the values differs from the headers; if the file is truncated; or if it has no wanted component.
        TypeError: If `path` is not the name of a file.

    Example:
        >>> [motion.component for motion in wd.records.read_cosmos("station.V2C")]
        ['090']
    """
    one_of("components", components, COMPONENTS)
    record = RecordText.of(path)
    motions: list[GroundMotion] = []
    at = 0
    while at < len(record.lines):
        first = at
        at += int(record.expected(at, _TEXT_LINES, "'(Format v01.20 with 13 text lines)'")[1])
        text = record.lines[first:at]
        integers, at = _header_values(record, at, "Integer")
        reals, at = _header_values(record, at, "Real")
        at += 1 + int(record.expected(at, _COMMENTS, "'9 Comment line(s) follow'")[1])
        is_first = True
        while is_first or (at < len(record.lines) and _DATA.match(record.lines[at])):
            is_first = False
            found, at = _acceleration(record, at, reals)
            if found is not None:
                azimuth = int(integers[_AZIMUTH]) if integers.size > _AZIMUTH else int(_UNKNOWN)
                component = azimuth_label(azimuth) or _ORIENTATIONS.get(azimuth, "")
                motions.append(record.motion(*found, component, _record_of(text) if component else ""))
        record.expected(at, _END, "'End-of-data'")
        at += 1
    check_end(record, at)
    if not motions:
        raise ValueError(
            f"{path}: this COSMOS file contains velocities or displacements, but no accelerations: take the "
            "acceleration file of the same record ('.acc.V2c')"
        )
    return select_components(motions, components, path)


def _record_of(text: list[str]) -> str:
    """Return the name of a record from the text header: station, earthquake and location, if they are stated."""
    station = re.search(r"Code:\s*(\S+)", " ".join(text[:6]))
    location = re.search(r"Location:[ \t]*(.*)", "\n".join(text))
    parts = (station[1] if station else "", text[1].strip(), location[1].strip() if location else "")
    return " ".join(filter(None, parts))


def _header_values(record: RecordText, at: int, kind: str) -> tuple[np.ndarray, int]:
    """Return the values of the integer or real header that starts at line `at`, and the index of the line after it."""
    stated = record.expected(at, _VALUES[kind], f"'100 {kind}-header values follow on 10 lines'")
    last = at + 1 + int(stated[2])
    lines = range(at + 1, min(last, len(record.lines)))
    values = np.array([number(token, record.place(i)) for i in lines for token in record.lines[i].split()])
    check_count(len(values), stated[1], f"{record.place(at)}: the {kind}-header")
    return values, last


def _acceleration(record: RecordText, at: int, reals: np.ndarray) -> tuple[tuple[np.ndarray, float] | None, int]:
    """Return the acceleration whose values start at line `at`, and the index of the line after the values.

    The acceleration is a tuple of values [m/s2] and step [s]; it is None for another quantity, such as velocity.
    """
    stated = record.expected(at, _DATA, "'9000 acceleration pts, approx 90 secs, units=cm/sec2(04), Format='")
    place, unit, count = record.place(at), stated["unit"], int(stated["count"])
    layout = Layout.of(stated["format"])
    if layout is None or count < 2:
        raise damaged(f"{place}: expected 2 values or more and a format such as (8F10.5), got {stated[0].strip()!r}")
    quantity = stated["quantity"].lower()
    if quantity.startswith("raw"):
        raise ValueError(
            f"{place}: this COSMOS file contains raw values in {unit}, not accelerations: take the V1 or V2 file of "
            "the same record"
        )
    if not quantity.startswith("acc"):
        return None, min(at + 1 - (-count // layout.per_line), len(record.lines))
    code = int(stated["code"])
    if code not in _UNIT_CODES:
        raise ValueError(f"{place}: {unit!r} ({code}) is not a unit of acceleration: take the V1 or V2 file")
    factor = unit_factor(unit, place)
    if factor != unit_factor(_UNIT_CODES[code], place):
        raise damaged(f"{place}: unit {unit!r} is not that of its code ({code}), {_UNIT_CODES[code]!r}")
    if reals.size <= _PEAK or reals[_STEP_IN_MS] <= 0:
        raise damaged(f"{record.path}: the Real-header has no step: its value {_STEP_IN_MS + 1} [ms] must be above 0")
    values, after = block(record, at + 1, count, layout)
    step = checked_step(reals[_STEP_IN_MS] / 1000.0, f"{record.path}: the step")
    if abs(count * step - float(stated["seconds"])) > max(1.0, 2 * step, 0.01 * count * step):
        raise damaged(
            f"{place}: {count} values at steps of {step:g} s last {count * step:g} s, not the {stated['seconds']} s "
            "that this line states"
        )
    if reals[_PEAK] != _UNKNOWN:
        peak, place = f"{reals[_PEAK]:.10g}", f"{record.path}: value {_PEAK + 1} of the Real-header"
        check_printed_peak(values, peak, place, _PEAK_TOLERANCE * abs(float(reals[_PEAK])))
    return (factor * values, step), after
