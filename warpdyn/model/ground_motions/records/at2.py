"""Reader of PEER .AT2 files."""

from __future__ import annotations

import re
from dataclasses import replace
from os import PathLike
from pathlib import Path

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.file_names import record_and_component
from warpdyn.model.ground_motions.records.components.headers import component_of_header, record_of_header
from warpdyn.model.ground_motions.records.parsing.fixed_width import RecordText
from warpdyn.model.ground_motions.records.parsing.header_checks import check_count, checked_values
from warpdyn.model.ground_motions.records.parsing.not_a_record import NotARecordError, damaged
from warpdyn.model.ground_motions.records.text import number
from warpdyn.model.ground_motions.records.units import ALLOWED_UNITS, checked_step, unit_factor

# In the header, the name of the unit ends at the end of a line or sentence, or before words about a filter.
_UNITS = re.compile(r"UNITS\s+OF\s+(.*?)\s*(?:[.,;:(]|\bFILTER|\bHP\b|$)", re.IGNORECASE)
_OTHER_QUANTITY = re.compile(r"\b(VELOCITY|DISPLACEMENT)\b", re.IGNORECASE)
_SIZES = (
    re.compile(
        r"NPTS\s*=\s*(?P<count>[^\s,]+)\s*,?\s*DT\s*=\s*(?P<step>[-+.\d]+(?:[ED][-+]?\d+)?|[^\s,]+)(?P<rest>.*)",
        re.IGNORECASE,
    ),
    re.compile(r"^\s*(?P<count>[^\s,]+)[\s,]+(?P<step>[^\s,]+)\s+NPTS\s*,\s*DT(?P<rest>.*)", re.IGNORECASE),
)
_STEP_UNITS = {"": 1.0, "S": 1.0, "SEC": 1.0, "SECS": 1.0, "SECOND": 1.0, "SECONDS": 1.0, "MS": 1e-3, "MSEC": 1e-3}


def read_at2(path: str | Path) -> GroundMotion:
    """Read a record in the PEER .AT2 format, with either style of header.

    The third of the four header lines names the unit ("... IN UNITS OF G"). The fourth line contains the number of
    values and the step ("NPTS= 1000, DT= .0200 SEC", or "4096 0.0100 NPTS, DT" in older files). The values follow, with
    any number of values per line.

    Args:
        path: The file; its name without the suffix names the motion.

    Returns:
        The motion [m/s2]. `record` and `component` are read from line 2 of the file, otherwise from the file's name;
        "" if neither contains them.

    Raises:
        FileNotFoundError, IsADirectoryError: If the file does not exist, or is a directory.
        ValueError: If the file is empty or contains velocities or displacements; if the header lacks a known unit, the
            number of values or the step; if a value is not a finite number, or has another form than all other values
            (a decimal point or digit may be lost); if the number of values differs from the number in the header; or if
            the last value is incomplete.
        TypeError: If `path` is not the name of a file.

    Warns:
        UserWarning: If the layout of a line differs from all other lines (a sign may be lost), the last value may be
            incomplete, or line 2 and the name of the file contain different components.

    Example:
        >>> motion = wd.records.read_at2("RSN6_IMPVALL.I_I-ELC180.AT2")
        >>> motion.step, len(motion.acceleration)
        (0.01, 200)
    """
    motion = read_at2_and_header(path)
    record, label = record_and_component(Path(path).name, motion.component, place=str(path))
    return replace(motion, record=record or motion.record, component=label)


def read_at2_and_header(path: str | PathLike) -> GroundMotion:
    """Return the motion in an AT2 file, with record and component as in line 2 of the file ("" if they are missing)."""
    record = RecordText.of(path)
    if len(record.lines) < 4:
        raise damaged(f"{path}: an AT2 file has 4 header lines, this file ends at line {len(record.lines)}")
    factor = _unit_of(record.lines[2], record.place(2))
    count, step = _sizes_of(record.lines[3], record.place(3))
    numbers = record.numbers(4)
    check_count(sum(len(numbers.tokens(i)) for i in range(len(numbers))), count, record.place(3))
    values = checked_values(numbers, record.text)
    title = record.lines[1]
    return GroundMotion(
        factor * values, step, record.stem, str(path), record_of_header(title), component_of_header(title)
    )


def _unit_of(line: str, place: str) -> float:
    """Return the factor that converts the unit named in a header line to m/s2; raise an error if it has no unit."""
    quantity = _OTHER_QUANTITY.search(line)
    if quantity and not re.search(r"\bACC", line, re.IGNORECASE):
        raise NotARecordError(
            f"{place}: the file contains a {quantity[1].lower()} history, not an acceleration: take the .AT2 file of "
            f"the same record. Got {line.strip()!r}"
        )
    unit = _UNITS.search(line)
    if not unit:
        raise damaged(f"{place}: expected 'UNITS OF' and one of {ALLOWED_UNITS}, got {line.strip()!r}")
    return unit_factor(unit[1], place)


def _sizes_of(line: str, place: str) -> tuple[str, float]:
    """Return the number of values (as text) and the step [s] that the fourth header line contains."""
    sizes = next(filter(None, (style.search(line) for style in _SIZES)), None)
    if not sizes:
        raise damaged(f"{place}: expected 'NPTS= 9, DT= .02 SEC' or '9 .02 NPTS, DT', got {line.strip()!r}")
    unit = re.match(r"[\s(]*+([A-Z]*+)(?!\s*[-+]?\.?\d)", sizes["rest"], re.IGNORECASE)
    word = unit[1].upper() if unit else None
    if word is None or word not in _STEP_UNITS:
        raise damaged(f"{place}: DT must be in SEC or MSEC, got {line.strip()!r}")
    factor = _STEP_UNITS[word]
    step = checked_step(number(sizes["step"], place), f"{place}: DT")
    if "." not in sizes["step"] and "E" not in sizes["step"].upper() and factor == 1.0:
        warn_caller(f"{place}: DT= {sizes['step']} s has no decimal point, which may be lost: check the step")
    return sizes["count"].removeprefix("+"), step * factor
