"""Reader of text files with columns of numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np

from warpdyn.foundations.core.checks import one_of, true_or_false, whole_number
from warpdyn.foundations.core.messages import amount_of, warn_caller
from warpdyn.foundations.core.near_misses import did_you_mean, suggests_names
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.file_names import record_and_component
from warpdyn.model.ground_motions.records.components.headers import named_component
from warpdyn.model.ground_motions.records.parsing.decimal_commas import refuse_decimal_commas
from warpdyn.model.ground_motions.records.parsing.header_checks import check_missing_values
from warpdyn.model.ground_motions.records.parsing.not_a_record import AmbiguousTextError
from warpdyn.model.ground_motions.records.quantities import (
    check_stated_numbers,
    check_statements,
    refuse_step_as_sample,
    refuse_times,
    stated_step,
)
from warpdyn.model.ground_motions.records.text import (
    FEWEST_ALIKE,
    NumberLines,
    check_last_value,
    text_of,
    warn_of_layout,
)
from warpdyn.model.ground_motions.records.units import TIME_TOLERANCE, checked_step, step_of_times, unit_factor

TIME_UNITS = {"s": 1.0, "ms": 1e-3}
# Ratio of the mean difference of successive values in a line to that of successive lines. Below this ratio, a line
# contains successive values of one record. If columns are different quantities, the ratio is 1 or more.
SUCCESSIVE_VALUES = 0.7
SLOWEST_STEP = 0.5  # s; records have steps of .001 to .05 s, and times in milliseconds differ by 1 to 50
# Pattern of a word in a header: one letter, two successive letters, or a unit such as "m/s2"; not "1.5E-3" or "O.5".
_HEADER_WORD = re.compile(r"[^\W\d_]$|.*[^\W\d_]{2}|[^\W\d_]/[^\W\d_]")
# Text that spreadsheets and programs write for a missing number.
_MISSING = re.compile(
    r"\s*(?:#(?:N/A|DIV/0!|VALUE!|REF!|NUM!|NAME\?|NULL!|NV|WERT!)|[-+]?(?:NAN|INF(?:INITY)?)|N/?A|NULL|NONE)[\s,;]*",
    re.IGNORECASE,
)


@suggests_names
def read_text(
    path: str | PathLike,
    *,
    unit: str,
    step: float | None = None,
    acceleration_column: int | str | None = None,
    time_column: int | str | None = None,
    time_unit: str | None = None,
    delimiter: str | None = None,
    decimal_comma: bool = False,
    header_lines: int | None = None,
) -> GroundMotion:
    """Read a record from a text file with a column of accelerations and, usually, a column of times.

    If there is one column, it contains the accelerations. If there are two, the first contains the times, or an index
    if `step` is given. Blank lines, lines that start with # or %, and lines of words before the first number are
    skipped. The first sample acts at t = 0, even if its time in the file is different.

    Args:
        path: The file; its name without the suffix names the motion.
        unit: Unit of the acceleration, one of `UNITS`.
        step: Sampling step [s]. It is required if there is no column of times; otherwise it is compared with the times.
        acceleration_column: Column of accelerations: its number, from 0, or its name in the last line before the
            numbers. It is required if there are more than two columns; then times are read only if `time_column` is
            given.
        time_column: Column of times: its number, from 0, or its name.
        time_unit: Unit of the times, "s" or "ms"; None: seconds, with a warning if the times cannot be in seconds.
        delimiter: Separator of the columns; None: the semicolon, comma or white space in the first line of numbers.
        decimal_comma: Whether numbers have decimal commas, such as 0,5.
        header_lines: Number of lines to skip before the first number; None: lines of words are skipped.

    Returns:
        The motion [m/s2]. `component` is read from the column's name ("NS", "acc_EW (gal)"), otherwise from the header,
        otherwise from the file's name. If no component is found, `record` and `component` are "".

    Raises:
        FileNotFoundError, IsADirectoryError: If the file does not exist, or is a directory.
        ValueError: If the unit is unknown, the file is empty, or a value is not a finite number; if the column of
            accelerations is ambiguous, lines contain several successive values or have different numbers of columns, or
            commas may be decimal commas; if there are fewer than two samples, or the last value is incomplete; if the
            step is missing, not above 0 or differs from the times; if the header or the column's name contains another
            unit, step, number of samples or quantity; or if the values are times, or the first value is the step or the
            number of samples.
        TypeError: If `path` is not the name of a file.

    Example:
        >>> motion = wd.records.read_text("quake.csv", unit="g", time_column="time", acceleration_column="acceleration")
        >>> motion.step, motion.name
        (0.01, 'quake')
    """
    columns = ColumnChoice(acceleration_column, time_column, time_unit, delimiter, decimal_comma, header_lines)
    motion = read_columns(path, unit, step, columns)
    if motion.record:
        return motion
    record, component = record_and_component(Path(path).name, motion.component, place=str(path))
    return replace(motion, record=(record or motion.name) if component else "", component=component)


@dataclass(frozen=True)
class ColumnChoice:
    """The arguments of `read_text` that define which columns are read, and how."""

    acceleration_column: int | str | None = None
    time_column: int | str | None = None
    time_unit: str | None = None
    delimiter: str | None = None
    decimal_comma: bool = False
    header_lines: int | None = None


def read_columns(path: str | PathLike, unit: str, step: float | None, chosen: ColumnChoice) -> GroundMotion:
    """Return the motion in a text file, with the component that the column's name or the header contains.

    If the component is in the column's name, `record` is the file's name without suffix; otherwise it is "".
    """
    factor = unit_factor(unit, "unit")
    if step is not None:
        step = checked_step(step, "step")
    if chosen.time_unit is not None:
        one_of("time_unit", chosen.time_unit, TIME_UNITS)
    table = _table_of(path, chosen.delimiter, chosen.decimal_comma, chosen.header_lines)
    if chosen.time_column is None and not isinstance(chosen.acceleration_column, str):
        _refuse_successive_values(table, chosen.acceleration_column)
    time, acceleration = _chosen_columns(table, chosen.time_column, chosen.acceleration_column)

    numbers = table.numbers
    columns = [acceleration] if time is None else [acceleration, time]
    values = numbers.values(columns)
    if values.shape[1] < 2:
        raise ValueError(
            f"{path}: a record needs at least 2 samples, found {values.shape[1]}: give a file with more lines of values"
        )
    if table.count == 1 and chosen.header_lines is None and step is not None:
        first = [numbers.tokens(i)[0] for i in (0, 1)]
        refuse_step_as_sample(path, numbers.line_numbers[0], first, values[0], step)
    _check_damage(table, columns)
    check_missing_values(values[0], numbers.place)
    name = table.names[acceleration] if table.names else ""
    check_statements(path, name, table.header, unit, factor)
    refuse_times(path, acceleration, values[0])
    if time is not None:
        step = _step_of_column(table, time, values[1], step, chosen.time_unit)
    else:
        _refuse_gaps(table)
        if step is None:
            stated = stated_step(table.header)
            hint = f": the header says {stated[1].lower()!r}, so step={stated[0]:g}" if stated else ""
            raise ValueError(f"{path}: a single column has no times, so step= [s] must be given{hint}")
    check_stated_numbers(path, table.header, step, values.shape[1])
    of_column = record_and_component(re.sub(r"[(\[{].*?[)\]}]", "", name))[1]
    component = of_column or next(filter(None, map(named_component, table.header)), "")
    stem = Path(path).stem
    return GroundMotion(factor * values[0], step, stem, str(path), stem if of_column else "", component)


@dataclass(frozen=True)
class _Table:
    """The content of a text file: lines of numbers, header lines, and names of the columns."""

    path: str | PathLike
    text: str
    numbers: NumberLines
    names: list[str]  # names of the columns; empty if the header does not contain names
    header: list[str]  # comments, and lines before the first number except the line of names
    count: int  # number of columns


def _table_of(path: str | PathLike, delimiter: str | None, decimal_comma: bool, header_lines: int | None) -> _Table:
    true_or_false("decimal_comma", decimal_comma)
    text = text_of(path)
    lines = text.rstrip().split("\n")
    if delimiter is not None and not (isinstance(delimiter, str) and re.fullmatch(r"[^\w.+\-\n]", delimiter)):
        raise ValueError(f"delimiter must be one character that is not part of a number, got {delimiter!r}")
    if decimal_comma and delimiter == ",":
        raise ValueError("delimiter is ',', so numbers cannot have decimal commas: remove decimal_comma=")
    first = whole_number("header_lines", header_lines, 0) if header_lines is not None else 0
    while first < len(lines) and (_is_skipped(lines[first]) or (header_lines is None and _is_header(lines[first]))):
        first += 1
    if first >= len(lines):
        raise ValueError(
            f"{path}: a record needs at least 2 samples, found 0: give a file with lines of numbers, without words in "
            "them"
        )
    if header_lines is not None and _is_header(lines[first]):
        raise ValueError(f"{path}:{first + 1}: a line of words, not of numbers: header_lines= must be larger, or None")
    above = next((line for line in lines[first - 1 :: -1] if line.strip()), "") if first else ""
    mark = delimiter or next((mark for mark in (";" if decimal_comma else ";,") if mark in lines[first]), None)
    mark = None if mark is not None and mark.isspace() and mark != "\t" else mark
    numbers = NumberLines(path, lines[first:], range(first + 1, len(lines) + 1), mark)
    is_commented = numbers.has_line(_is_skipped)
    if is_commented:
        kept = [i for i in range(first, len(lines)) if not _is_skipped(lines[i])]
        numbers = NumberLines(path, [lines[i] for i in kept], [i + 1 for i in kept], mark)
    if decimal_comma:
        if (point := next((i for i, line in enumerate(numbers.lines) if "." in line), None)) is not None:
            raise ValueError(
                f"{numbers.place(point)}: has a decimal point, but decimal_comma is True: remove decimal_comma="
            )
        numbers = NumberLines(path, [line.replace(",", ".") for line in numbers.lines], numbers.line_numbers, mark)
    elif "," in lines[first]:
        refuse_decimal_commas(numbers, mark, above, is_stated=delimiter is not None)
    widths = numbers.widths()
    count = len(numbers.tokens(0))
    if len(widths) > 1:
        other, i = next((width, i) for width, i in widths.items() if width != count)
        is_rest = i == len(numbers) - 1 and other < count
        hint = "; if each line has several successive values, use wd.records.read or from_array" if is_rest else ""
        raise ValueError(
            f"{numbers.place(i)}: {amount_of(other, 'column')}, but the first line has {count}: correct the line, or "
            f"give delimiter= or header_lines={hint}"
        )
    names = _names_of(above.strip(" \t#%"), count, mark)
    header = [line for line in lines[:first] if not names or line is not above]
    header += [line for line in lines[first:] if line.strip() and _is_skipped(line)] if is_commented else []
    return _Table(path, text, numbers, names, header, count)


def _names_of(line: str, count: int, mark: str | None) -> list[str]:
    """Return the names of columns in a header line; an empty list if the line does not have `count` names.

    Columns are separated by the character `mark` or, if it is None, by white space.
    """
    if re.match(r"\W*\w[\w ]*[:=]", line):
        return []  # a statement such as "units: cm/s2" is not a name
    if mark is not None:
        ways = [[name.strip(" \t\"'") for name in line.split(mark)]]
    else:
        # Examples of lines: "t a", "Time [s]  Velocity [m/s]" and "Time (s) Velocity (m/s)".
        ways = (
            [line.split()]
            if count == 1
            else [line.split(), re.split(r"\s{2,}|\t", line), re.findall(r"[^\s(\[]+(?:\s*[(\[][^)\]]*[)\]])?", line)]
        )
    return next((names for names in ways if len(names) == count), [])


def _is_skipped(line: str) -> bool:
    is_such = not line or line[0] in "#%" or (line[0] in " \t" and (not line.strip() or line.lstrip()[0] in "#%"))
    return is_such and not _MISSING.fullmatch(line)


def _is_header(line: str) -> bool:
    """Return whether a line contains only words, i.e. neither a number nor a damaged number."""
    words = re.split(r"[\s,;()\[\]]+", line.strip(" \t\"',;()[]"))
    return not _MISSING.fullmatch(line) and all(_HEADER_WORD.match(word) for word in words)


def _refuse_successive_values(table: _Table, acceleration: int | None) -> None:
    """Raise a ValueError if each line seems to contain several successive values of one record, as in many formats.

    This is assumed if the mean difference to the next value (in the same line, or at the start of the next line) is
    much smaller than the mean difference to the value below.
    """
    if table.count < (3 if acceleration is None else 2) or len(table.numbers) < FEWEST_ALIKE:
        return
    values = table.numbers.values(range(table.count)).T
    along = np.abs(np.diff(values, axis=1)).mean()
    to_next_line = np.abs(values[1:, 0] - values[:-1, -1]).mean()
    down = np.abs(np.diff(values, axis=0)).mean()
    if max(along, to_next_line) < SUCCESSIVE_VALUES * down:
        raise ValueError(
            f"{table.numbers.place(0)}: each line seems to have {table.count} successive values of one record, so that "
            f"a column would be every {table.count}th value: read the file with wd.records.read, or give "
            f"numpy.loadtxt(path, skiprows={table.numbers.line_numbers[0] - 1}).ravel() to from_array"
        )


def _chosen_columns(table: _Table, time: int | str | None, acceleration: int | str | None) -> tuple[int | None, int]:
    """Return the index of the column of times (or None) and the index of the column of accelerations, from 0."""
    count = table.count
    named = f" ({', '.join(table.names)})" if table.names else ""
    if acceleration is None:
        if count > 2 or time is not None:
            raise AmbiguousTextError(
                f"{table.numbers.place(0)}: {count} columns{named}: give acceleration_column= and time_column=, by "
                "number, from 0, or by name"
            )
        return (0, 1) if count == 2 else (None, 0)
    chosen = []
    for what, column in (("acceleration_column", acceleration), ("time_column", time)):
        if column is None:
            continue
        if isinstance(column, str):
            if table.names.count(column) != 1:
                found = f"the names are{named}" if named else "there is no line of names before the numbers"
                hint = did_you_mean(column, table.names)
                raise ValueError(f"{table.path}: {what} {column!r} is not the name of one column{hint}; {found}")
            chosen.append(table.names.index(column))
        else:
            if whole_number(what, column, 0) >= count:
                raise ValueError(f"{table.path}: {what} must be at most {count - 1}, counted from 0, got {column}")
            chosen.append(int(column))
    if len(set(chosen)) < len(chosen):
        raise ValueError(
            f"{table.path}: acceleration_column and time_column are the same column: give two different columns"
        )
    return (chosen[1] if time is not None else None), chosen[0]


def _refuse_gaps(table: _Table) -> None:
    """Raise a ValueError if a line between two values contains no value, because a sample may be missing there.

    Spreadsheets write "#N/A" or an empty cell for a missing sample. In a file without times, all later samples would be
    read one step too early. If every second line is blank, no sample is missing.
    """
    at = np.array(table.numbers.line_numbers)
    steps = np.diff(at)
    if steps.max(initial=1) == 1 or (steps.min() == steps.max() and not _lines_between(table)):
        return
    i = int(at[int(np.argmax(steps > steps.min()))])  # number (from 1) of the line before the first gap
    found = table.text.split("\n")[i].strip()
    what = f"{found[:40]!r} is" if found else "a blank line is"
    raise ValueError(
        f"{table.path}:{i + 1}: {what} between two values. If a sample is missing here, all later samples would come "
        "one step early: replace the line by a value, or delete it if no sample is missing"
    )


def _lines_between(table: _Table) -> bool:
    """Return whether any line between the first and the last value contains text that is not a value."""
    lines, at = table.text.split("\n"), table.numbers.line_numbers
    values = set(at)
    return any(lines[i - 1].strip() for i in range(at[0], at[-1]) if i not in values)


def _check_damage(table: _Table, columns: list[int]) -> None:
    """Raise a ValueError or warn if the text of a number seems to be damaged, for example by a lost digit."""
    numbers = table.numbers
    is_ended = table.text.endswith("\n")
    last = [] if is_ended else [numbers.tokens(i)[-1] for i in range(len(numbers))]
    check_last_value(table.text, last, table.path)
    for column in columns:
        if other := numbers.other_forms(column):
            place, token, example = other
            warn_caller(
                f"{place}: {token!r} is written in another form than the column's other numbers, such as {example!r}: "
                "it may have lost a digit or its point. Compare the line with its source"
            )
    moved, end = numbers.other_layouts, len(numbers)
    while moved and moved[-1] == end - 1 and len(numbers.lines[end - 1]) > len(numbers.lines[0]):
        moved, end = moved[:-1], end - 1  # not damaged: the last times may have one more digit
    warn_of_layout(numbers, moved)


def _step_of_column(table: _Table, column: int, times: np.ndarray, step: float | None, time_unit: str | None) -> float:
    """Return the step of the times in a column [s].

    Raises:
        ValueError: If the column contains sample numbers instead of times and `step` is missing, if times are uneven,
            or if their step differs from `step`.
    """
    tokens = [table.numbers.tokens(i)[column] for i in (0, 1)]
    is_index = all(map(str.isdigit, tokens)) and times[0] in (0, 1) and bool(np.all(np.diff(times) == 1))
    if is_index and time_unit is None:
        if step is None:
            raise AmbiguousTextError(
                f"{table.path}: column {column} counts the samples ({', '.join(tokens)}, ...), so step [s] must "
                "be given; if these are times, give time_unit"
            )
        return step
    if time_unit is None and table.names and re.search(r"\b(ms|msec|milliseconds?)\b", table.names[column], re.I):
        raise AmbiguousTextError(
            f"{table.path}: the times are in {table.names[column]!r}: give time_unit='ms' (or 's')"
        )
    seconds = times * TIME_UNITS[time_unit or "s"]
    mean = float(seconds[-1] - seconds[0]) / (seconds.size - 1)
    if step is not None and abs(step - mean) > TIME_TOLERANCE * mean > 0:
        raise ValueError(f"{table.path}: step={step:g} s, but the times are {mean:.6g} s apart: leave out step=")
    found = step_of_times(seconds, step, str(table.path))
    if time_unit is None and step is None and found >= SLOWEST_STEP:
        warn_caller(
            f"{table.path}: the times are {found:g} s apart, too far for a record: give time_unit='ms' if they are in "
            "milliseconds, or time_unit='s' if they are right"
        )
    return found
