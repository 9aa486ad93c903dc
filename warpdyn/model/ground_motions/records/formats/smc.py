"""Reader of the SMC files of the United States Geological Survey."""

from __future__ import annotations

import re
from os import PathLike

import numpy as np

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.orientations import azimuth_label, orientation
from warpdyn.model.ground_motions.records.parsing.fixed_width import Layout, RecordText, block, check_end
from warpdyn.model.ground_motions.records.parsing.header_checks import stated_step
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.parsing.uneven import at_equal_steps

_TITLE = re.compile(
    r"\s*(?P<kind>\d)\s+(?P<title>(un)?corrected\s+accelerogram|velocity|displacement|.*spectr\w+)", re.IGNORECASE
)
_TEXT_LINES = 11
_INTEGERS, _REALS = Layout(8, 10, 0), Layout(5, 15)
_VALUES = Layout(8, 10, 4, is_scientific=True)
# Indices (from 0) of values in the integer and real headers, and numbers that are written for unknown values.
_UP_ANGLE, _AZIMUTH, _COMMENTS, _COUNT, _RATE = 12, 13, 15, 16, 1
_MAXIMUM, _MINIMUM = 29, 31
_UNKNOWN_REAL, _LARGEST_KNOWN = 1.7e38, 1e30
_STATION = re.compile(r"station\s*=\s*(?P<station>.*?)\s*component\s*=\s*(?P<component>.*)", re.IGNORECASE)
_KINDS = {"1": "acceleration", "2": "acceleration", "3": "velocity", "4": "displacement", "5": "response spectra"}


def is_smc(first_lines: list[str]) -> bool:
    """Return whether a file is an SMC file: the first lines are its kind, and a line with an asterisk."""
    return bool(_TITLE.match(first_lines[0])) and len(first_lines) > 1 and first_lines[1].strip() == "*"


def read_smc(path: str | PathLike, step: float | None = None) -> list[GroundMotion]:
    """Return the acceleration in an SMC file: 11 lines of text, 98 header numbers, comments, values in cm/s2.

    Source: U.S. Geological Survey, "SMC-format data files".
    """
    record = RecordText.of(path)
    title = record.expected(0, _TITLE, "'2 CORRECTED ACCELEROGRAM'")
    quantity = _KINDS.get(title["kind"], title["title"].lower())
    if quantity != "acceleration" or "accelerogram" not in title["title"].lower():
        raise ValueError(
            f"{record.place(0)}: this SMC file contains {quantity} ({title['title'].lower()}), not accelerations: take "
            "the file '2 CORRECTED ACCELEROGRAM' of the same record"
        )
    integers, after = block(record, _TEXT_LINES, 48, _INTEGERS, is_data=False)
    reals, after = block(record, after, 50, _REALS, is_data=False)
    for _ in range(int(integers[_COMMENTS])):
        if not record.line(after, "its comments").startswith("|"):
            raise damaged(
                f"{record.place(after)}: expected a comment, '|', since the header states {integers[_COMMENTS]:.0f} of "
                f"them, got {record.lines[after].strip()[:40]!r}"
            )
        after += 1
    count = int(integers[_COUNT])
    if count < 2:
        raise damaged(f"{path}: value 17 of the whole numbers, the number of values, must be at least 2, got {count}")
    is_uneven = reals[_RATE] == _UNKNOWN_REAL  # the file then contains pairs of time and acceleration
    values, end = block(record, after, count, _VALUES)
    if is_uneven and len(record.lines) == end + 1:
        warn_caller(
            f"{record.place(end)}: this line follows the {count} numbers that the header states, and is "
            "left out. Delete the line, or correct the number in the header"
        )
    else:
        check_end(record, end)
    if is_uneven:
        if count % 2:
            raise damaged(f"{path}: {count} numbers cannot be pairs of times and values")
        times, values = values[::2], values[1::2]
        _check_extrema(record, values, times, reals)
        values, found = at_equal_steps(times, values, step, path)
    else:
        found = stated_step(f"{reals[_RATE]:.10g}", f"{path}: value 2 of the decimal numbers", is_rate=True)
        _check_extrema(record, values, found * np.arange(values.size), reals)
    station, component = _names(record, integers)
    return [record.motion(0.01 * values, found, component, station)]


def _check_extrema(record: RecordText, values: np.ndarray, times: np.ndarray, reals: np.ndarray) -> None:
    """Raise a ValueError if the largest or smallest value, or its time, differs from the header.

    The tolerances allow for values with 5 digits, and for times in the header that are rounded to a sample.
    """
    precision = 1e-4 * float(np.abs(values).max())
    for at, found in ((_MAXIMUM, values.max()), (_MINIMUM, values.min())):
        stated, time = float(reals[at]), float(reals[at - 1])
        if abs(stated) >= _LARGEST_KNOWN:
            continue
        if abs(stated - found) > precision:
            raise damaged(
                f"{record.path}: value {at + 1} of the decimal numbers states an extremum of {stated:g} cm/s2, but the "
                f"values have {found:g}"
            )
        near = times[np.abs(values - found) <= precision]
        if abs(time) < _LARGEST_KNOWN and np.abs(near - time).min() > 1.01 * float(np.diff(times).max()):
            raise damaged(
                f"{record.path}: value {at} of the decimal numbers states an extremum at {time:g} s, but it is at "
                f"{near[0]:g} s: the sampling rate is wrong, or values are missing"
            )


def _names(record: RecordText, integers: np.ndarray) -> tuple[str, str]:
    """Return the name of the record, which all components of one sensor share, and the label of the component."""
    up, azimuth = int(integers[_UP_ANGLE]), int(integers[_AZIMUTH])
    found = next((match for line in record.lines[:_TEXT_LINES] if (match := _STATION.search(line))), None)
    label = orientation(found["component"].strip() if found else "")
    component = label.known_label
    if up in (0, 180):
        component = "UP" if up == 0 else "DOWN"
    elif up == 90 and label.kind != "horizontal":
        component = azimuth_label(azimuth)
    event = " ".join(record.lines[3].split())
    return " ".join(filter(None, [found["station"] if found else "", event])), component
