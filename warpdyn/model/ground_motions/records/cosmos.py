"""Reader of COSMOS strong-motion files (format 1.20)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from warpdyn.foundations.core.checks import one_of
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components import COMPONENTS, azimuth_label, chosen_components
from warpdyn.model.ground_motions.records.parsing.header_checks import check_missing_values
from warpdyn.model.ground_motions.records.text import (
    NumberLines,
    check_count,
    check_forms,
    check_last_value,
    check_peak,
    lines_of,
    number,
    text_of,
)
from warpdyn.model.ground_motions.records.units import checked_step, unit_factor

_TEXT_LINES = re.compile(r"\(Format\s+v\S+\s+with\s+(\d+)\s+text\s+lines\)", re.IGNORECASE)
_VALUES = re.compile(r"^\s*(\d+)\s+(Integer|Real)-header\s+values\s+follow\s+on\s+(\d+)\s+lines", re.IGNORECASE)
_COMMENTS = re.compile(r"^\s*(\d+)\s+Comment\s+line", re.IGNORECASE)
_DATA = re.compile(
    r"^\s*(?P<count>\d+)\s+(?P<quantity>[A-Za-z][\w. -]*?)\s+pts,\s*approx\s+(?P<seconds>[\d.]+)\s+secs,\s*"
    r"units=\s*(?P<unit>[^(,]+?)[.\s]*\((?P<code>\d+)\)\s*,?\s*Format=\s*\((?P<per_line>\d+)[FEGI](?P<width>\d+)",
    re.IGNORECASE,
)
# The specification's tables 2 and 6, and places of values in its headers, counted from 0.
_UNIT_CODES = {2: "g", 4: "cm/s2", 10: "gal"}
_AZIMUTH, _STEP_IN_MS, _PEAK = 53, 61, 63
_ORIENTATIONS = {400: "UP", 401: "DOWN", 402: "VERT", 600: "L", 601: "T", 700: "H1", 701: "H2"}
_UNKNOWN = -999.0


def read_cosmos(path: str | Path, components: str = "horizontal") -> list[GroundMotion]:
    """Read the accelerations of a COSMOS file (.V1C, .V2C), which has one channel or several, but for vertical ones.

    Source: COSMOS, "Strong Motion Data Format", version 1.20 (2001).

    Args:
        path: The file; its name without the suffix and the channel's component name the motions.
        components: "horizontal", "vertical" or "all", by the azimuths of the header.

    Returns:
        The motions [m/s2], with `record` and `component`; velocities and displacements are passed over.

    Raises:
        FileNotFoundError, IsADirectoryError: If there is no such file, or it is a directory.
        ValueError: If a header is not as specified, the unit is none of an acceleration (raw counts), a value is not a
            finite number or is written in another form than the others, the values are not as many, as long or as large
            as the headers tell, the file is cut, or has no such component.
        TypeError: If `path` names no file.

    Example:
        >>> [motion.component for motion in wd.records.read_cosmos("station.V2C")]
        ['090']
    """
    one_of("components", components, COMPONENTS)
    text = text_of(path)
    lines = lines_of(text)
    motions: list[GroundMotion] = []
    at = 0
    while at < len(lines):
        header = _TEXT_LINES.search(lines[at])
        if not header:
            raise ValueError(
                f"{path}:{at + 1}: expected '(Format v01.20 with 13 text lines)', got {lines[at].strip()!r}"
            )
        first, at = at, at + int(header[1])
        integers, at = _header_values(path, lines, at, "Integer")
        reals, at = _header_values(path, lines, at, "Real")
        comments = _expected(path, lines, at, _COMMENTS, "'9 Comment line(s) follow'")
        at += 1 + int(comments[1])
        while True:
            data = _expected(
                path, lines, at, _DATA, "'9000 acceleration pts, approx 90 secs, units=cm/sec2(04), Format='"
            )
            motion, at = _read_data(path, text, lines, at, data, reals)
            if motion is not None:
                orientation = int(integers[_AZIMUTH]) if integers.size > _AZIMUTH else int(_UNKNOWN)
                component = azimuth_label(orientation) or _ORIENTATIONS.get(orientation, "")
                station = re.search(r"Code:\s*(\S+)", " ".join(lines[first : first + 6]))
                location = re.search(r"Location:[ \t]*(.*)", "\n".join(lines[first : first + int(header[1])]))
                parts = (
                    station[1] if station else "",
                    lines[first + 1].strip(),
                    location[1].strip() if location else "",
                )
                record = " ".join(filter(None, parts))
                name = f"{Path(path).stem} {component}".strip()
                motions.append(GroundMotion(*motion, name, str(path), record if component else "", component))
            if at < len(lines) and _DATA.match(lines[at]):
                continue
            if at >= len(lines) or not re.match(r"[\s/&-]*End[- ]of[- ]data", lines[at], re.IGNORECASE):
                raise ValueError(f"{path}: truncated: no line 'End-of-data' follows the values that end at line {at}")
            at += 1
            break
    if not motions:
        raise ValueError(
            f"{path}: this COSMOS file contains velocities or displacements, but no accelerations: take the "
            "acceleration file of the same record ('.acc.V2c')"
        )
    is_chosen = chosen_components(
        [motion.component for motion in motions],
        components,
        [motion.name for motion in motions],
        [motion.record for motion in motions],
        str(path),
    )
    chosen = [motion for motion, is_such in zip(motions, is_chosen, strict=True) if is_such]
    if not chosen:
        raise ValueError(
            f"{path}: none of its {len(motions)} accelerations is {components}; components='all' reads all"
        )
    return chosen


def _expected(path: str | Path, lines: list[str], at: int, pattern: re.Pattern[str], what: str) -> re.Match[str]:
    """Return the match of a line of the header, or raise a ValueError that says what was expected."""
    if at >= len(lines):
        raise ValueError(f"{path}: truncated: ends at line {len(lines)}, where {what} is due")
    match = pattern.search(lines[at])
    if not match:
        raise ValueError(f"{path}:{at + 1}: expected {what}, got {lines[at].strip()!r}")
    return match


def _header_values(path: str | Path, lines: list[str], at: int, kind: str) -> tuple[np.ndarray, int]:
    """Return the integers or reals of a header, and where the lines go on."""
    told = _expected(path, lines, at, _VALUES, f"'100 {kind}-header values follow on 10 lines'")
    if told[2].lower() != kind.lower():
        raise ValueError(f"{path}:{at + 1}: expected the {kind}-header, got {lines[at].strip()!r}")
    last = at + 1 + int(told[3])
    tokens = [(token, i) for i in range(at + 1, min(last, len(lines))) for token in lines[i].split()]
    values = np.array([number(token, f"{path}:{i + 1}") for token, i in tokens])
    check_count(len(values), told[1], f"{path}:{at + 1}: the {kind}-header")
    return values, last


def _read_data(
    path: str | Path, text: str, lines: list[str], at: int, told: re.Match[str], reals: np.ndarray
) -> tuple[tuple[np.ndarray, float] | None, int]:
    """Return values [m/s2] and step [s] of an acceleration, or None of another quantity, and where the lines go on."""
    place = f"{path}:{at + 1}"
    count, per_line, width = (int(told[name]) for name in ("count", "per_line", "width"))
    if per_line < 1 or width < 1:
        raise ValueError(f"{place}: expected a format such as (8F10.5), got {lines[at].strip()[-20:]!r}")
    rows = lines[at + 1 : at + 1 + -(-count // per_line)]
    end = at + 1 + len(rows)
    if told["quantity"].lower().startswith("raw"):
        raise ValueError(
            f"{place}: this COSMOS file contains raw values in {told['unit']}, not accelerations: take the V1 or V2 "
            "file of the same record"
        )
    if not told["quantity"].lower().startswith("acc"):
        return None, end
    code = int(told["code"])
    if code not in _UNIT_CODES:
        raise ValueError(
            f"{place}: unit {told['unit']!r} ({code}) is none of an acceleration: raw records need processing"
        )
    factor = unit_factor(told["unit"], place)
    if factor != unit_factor(_UNIT_CODES[code], place):
        raise ValueError(f"{place}: unit {told['unit']!r} is not that of its code ({code}), {_UNIT_CODES[code]!r}")
    if reals.size <= _PEAK or reals[_STEP_IN_MS] <= 0:
        raise ValueError(f"{path}: the Real-header has no step: its value {_STEP_IN_MS + 1} [ms] must be above 0")
    for i, row in enumerate(rows[:-1]):
        if len(row.rstrip()) != per_line * width:
            raise ValueError(
                f"{path}:{at + 2 + i}: {row.strip()!r} must be {per_line} values of {width} characters, as its "
                "format says"
            )
    # Values of fixed width may follow each other without a blank.
    fields = [" ".join(row[i : i + width] for i in range(0, len(row.rstrip()), width)) for row in rows]
    is_cut = end >= len(lines)
    numbers = NumberLines(path, fields, range(at + 2, end + 1))
    values = numbers.values() if rows else np.zeros(0)
    check_count(len(values), told["count"], place)
    if is_cut:
        check_last_value(text, [token for i in range(len(numbers)) for token in numbers.tokens(i)], path)
    check_forms(numbers)
    check_missing_values(values, lambda i: numbers.place(i // per_line))
    step = checked_step(reals[_STEP_IN_MS] / 1000.0, f"{path}: the step")
    if abs(count * step - float(told["seconds"])) > max(1.0, 2 * step, 0.01 * count * step):
        raise ValueError(
            f"{place}: {count} values {step:g} s apart are not the {told['seconds']} s that this line tells"
        )
    if reals[_PEAK] != _UNKNOWN:
        check_peak(values, reals[_PEAK], f"{path}: value {_PEAK + 1} of the Real-header")
    return (factor * values, step), end
