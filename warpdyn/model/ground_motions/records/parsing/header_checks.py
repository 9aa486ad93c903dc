"""Checks of a record: number of values, peak and duration against its header, and markers of missing values."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

import numpy as np

from warpdyn.foundations.core.messages import amount_of
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.text import NumberLines, check_forms, check_last_value, number
from warpdyn.model.ground_motions.records.units import checked_step

# Numbers that files contain instead of missing values: 999, -9999, 99999.9, -999.25, 1E20, 1.7E+38 (SMC), 3.4E+38.
_MARKER = re.compile(r"9{3,}(\.[09]+)?|999\.25|1e\+[23]\d|1\.70*(e\+38)|3\.40\d+e\+38")
# Bounds of a step [s]. Recorders take 20 to 1000 samples per second, and broadband channels at least 1.
SHORTEST_STEP, LONGEST_STEP = 2e-4, 1.0
# A marker is more than this factor larger than all other values; the peak of a record, such as 999 gal, is not.
FARTHEST_PEAK = 3.0
FEWEST_OTHERS = 10  # with fewer other values, a value is not treated as a marker


def check_missing_values(values: np.ndarray, place_of: Callable[[int], str]) -> None:
    """Raise a ValueError if the largest values are markers of missing values, such as 9999 among values below 10.

    Args:
        values: The values in the unit of the file.
        place_of: Function that returns the file and line of a value from its index.
    """
    if values.size == 0:
        return
    sizes = np.abs(values)
    first = int(np.argmax(sizes))
    peak = float(sizes[first])
    if not _MARKER.fullmatch(f"{peak:.10g}"):
        return
    others = sizes[sizes < peak]
    if others.size >= FEWEST_OTHERS and peak > FARTHEST_PEAK * float(others.max()):
        count = int(np.sum(sizes == peak))
        raise ValueError(
            f"{place_of(first)}: the value {values[first]:.10g} ({amount_of(count, 'time')} in the file) marks a "
            f"missing value, since all others are at most {others.max():g}: replace it, or get the record without gaps"
        )


def checked_values(numbers: NumberLines, text: str, columns: Sequence[int] | None = None) -> np.ndarray:
    """Return the numbers in lines of text, after checks for damage; shape [value], or [column, line] for `columns`.

    Args:
        numbers: The lines of numbers.
        text: Text of the whole file.
        columns: Indices of the columns to read; None: all numbers, one after the other.

    Raises:
        ValueError: If a value is not a finite number, is written in another form than other values (such as a different
            number of decimals), or marks a missing value; or if the last value is incomplete.
    """
    values = numbers.values(columns) if len(numbers) else np.zeros(0)
    check_last_value(text, [token for i in range(len(numbers)) for token in numbers.tokens(i)], numbers.path)
    check_forms(numbers)

    def line_of(value: int) -> int:
        if columns is not None:
            return value
        ends = np.cumsum([len(numbers.tokens(i)) for i in range(len(numbers))])
        return int(np.searchsorted(ends, value, side="right"))

    for row in np.atleast_2d(values):
        check_missing_values(row, lambda value: numbers.place(line_of(value)))
    return values


def check_count(found: int, stated: str, place: str) -> None:
    """Raise a ValueError if the number of values, `found`, differs from the number in the header, `stated`."""
    expected = stated_count(stated, place)
    if found != expected:
        kind = "truncated" if found < expected else "too long"
        raise damaged(f"{place}: {kind}: {found} values follow, not the {expected} that the header states")


def printed_precision(text: str) -> float:
    """Return the unit in the last decimal place of a printed number: 0.001 for "-0.083", 0.01 for "1.234E+01"."""
    mantissa, _, exponent = text.strip().lower().replace("d", "e").partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def check_printed_peak(values: np.ndarray, stated: str, place: str, precision: float = 0.0) -> None:
    """Raise a ValueError if the largest absolute value differs from the peak that the header states.

    The tolerance is one unit in the last place of both numbers, because programs either round or truncate.

    Args:
        values: The values, in the unit of the stated peak.
        stated: The peak as printed in the header; 0: the header does not state a peak.
        place: File and line of the header.
        precision: Unit in the last place of the values, if the peak in the header has more digits than the values.
    """
    expected, peak = abs(number(stated.strip(), place)), float(np.abs(values).max())
    tolerance = printed_precision(stated) + precision
    if expected != 0 and abs(peak - expected) > tolerance * (1 + 1e-6):
        raise ValueError(
            f"{place}: the header states a peak of {expected:g}, but the largest value is {peak:g}: the header or the "
            "values are damaged. Get another copy of the file"
        )


def check_time_of_peak(
    values: np.ndarray, step: float, stated: str, place: str, precision: float = 0.0, first: float = 0.0
) -> None:
    """Raise a ValueError if the header states the peak at a time at which the values have no peak.

    Args:
        values: The values.
        step: Step [s].
        stated: Time of the peak [s] as printed in the header; the first value may be at time 0 or at one step.
        place: File and line of the header.
        precision: Unit in the last place of the values; values within this distance of the largest count as peaks.
        first: Time that is added to the stated time, because it is counted from another zero [s].
    """
    time = number(stated, place) + first
    sizes = np.abs(values)
    at = np.flatnonzero(sizes >= sizes.max() - precision * (1 + 1e-6))
    allowed = 1.01 * step + 0.51 * printed_precision(stated)
    if time > first and not np.any(np.abs((at + 0.5) * step - time) <= allowed):
        raise damaged(
            f"{place}: the header states the peak at {time:g} s, but the largest value is at {int(at[0]) * step:g} s: "
            "the step is wrong, or values are missing or in another order"
        )


def check_duration(count: int, step: float, stated: str, place: str, precision: float = 0.0) -> None:
    """Raise a ValueError if the number of values times the step differs from the duration in the header.

    The duration in a header is the time of the last value, or one step more.

    Args:
        count: Number of values.
        step: Step [s].
        stated: The duration as printed in the header [s].
        place: File and line of the header.
        precision: Unit in the last place of the step [s].
    """
    expected = number(stated, place)
    allowed = 0.51 * step + printed_precision(stated) + 0.5 * precision * count
    if expected > 0 and abs((count - 0.5) * step - expected) > allowed:
        raise damaged(
            f"{place}: the header states a duration of {expected:g} s, but {count} values at steps of {step:g} s last "
            f"{(count - 1) * step:g} s"
        )


def stated_count(text: str, place: str) -> int:
    """Return the number of values that the text of a header states; raise a ValueError if it is not at least 2."""
    if not re.fullmatch(r"\s*\d{1,9}\s*", text, re.ASCII) or int(text) < 2:
        raise damaged(f"{place}: the number of values must be a whole number of at least 2, got {text.strip()!r}")
    return int(text)


def stated_step(text: str, place: str, *, is_rate: bool = False) -> float:
    """Return the step [s] that a header states; if `is_rate` is True, the header states the sampling rate [Hz]."""
    found = number(text.strip(), place)
    if found <= 0:
        raise damaged(f"{place}: the {'sampling rate' if is_rate else 'step'} must be above 0, got {text.strip()!r}")
    step = checked_step(1.0 / found if is_rate else found, f"{place}: the step")
    if not SHORTEST_STEP <= step <= LONGEST_STEP:
        raise damaged(
            f"{place}: a step of {step:g} s is not that of a strong-motion record ({SHORTEST_STEP:g} to "
            f"{LONGEST_STEP:g} s)"
        )
    return step
