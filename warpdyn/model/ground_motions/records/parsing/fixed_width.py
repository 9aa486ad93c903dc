"""Text of a record file, its header, and values in fields of a fixed width, as Fortran writes them."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from os import PathLike
from pathlib import Path

import numpy as np

from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.parsing.header_checks import check_missing_values
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.text import NumberLines, lines_of, number, text_of, warn_of_blank_end

_TO_FORM = str.maketrans("123456789d", "000000000D")
_FORMAT = re.compile(
    r"(?P<per_line>\d+)\s*P?,?\s*(?P<kind>[FEGID])\s*(?P<width>\d+)(?:\.(?P<decimals>\d+))?", re.IGNORECASE
)


@dataclass(frozen=True)
class Layout:
    """Layout of the values in a line, such as `8F9.6`: 8 values of 9 characters with 6 decimals.

    Args:
        per_line: Number of values per line; the last line may have fewer.
        width: Number of characters per value.
        decimals: Number of digits after the point; None: it varies; 0: whole numbers without a point.
        indent: Number of blanks before the first value of a line.
        is_scientific: Whether values have one digit before the point and an exponent, such as 1.2345E+1.
    """

    per_line: int
    width: int
    decimals: int | None = None
    indent: int = 0
    is_scientific: bool = False

    @classmethod
    def of(cls, text: str) -> Layout | None:
        """Return the layout that a Fortran format such as "(8f9.6)" describes; None if the text contains no format."""
        found = _FORMAT.search(text)
        if found is None or not int(found["per_line"]) or not int(found["width"]):
            return None
        is_fixed = found["kind"].upper() in "FI"
        decimals = int(found["decimals"] or 0) if is_fixed else None
        return cls(int(found["per_line"]), int(found["width"]), decimals)


class Header(dict[str, tuple[str, str]]):
    """Lines "NAME: value" of a header, as name -> (value, place); reading a missing name raises a ValueError.

    Args:
        path: The file.
        format: Name of the file format, for errors.
    """

    def __init__(self, path: str | PathLike, format: str) -> None:
        self.path, self.format = path, format

    def __missing__(self, name: str) -> tuple[str, str]:
        raise ValueError(
            f"{self.path}: the header of this {self.format} file lacks the line {name!r}: get a complete copy of the "
            "file"
        )

    def starting(self, name: str) -> tuple[str, str]:
        """Return the value and the place (path and line) of the first header line whose name starts with `name`."""
        return self[next((key for key in self if key.startswith(name)), name)]


@dataclass(frozen=True)
class RecordText:
    """The text of a record file as a list of lines; line indices start at 0."""

    path: str | PathLike
    text: str
    lines: list[str]

    @classmethod
    def of(cls, path: str | PathLike) -> RecordText:
        """Return the text of the file at `path`; raise an error if it is not text."""
        text = text_of(path)
        return cls(path, text, lines_of(text))

    @property
    def stem(self) -> str:
        """Name of the file without folder and suffix."""
        return Path(self.path).stem

    def place(self, i: int) -> str:
        """Return the path and the line number (from 1) of line `i`, such as "quake.V1:7", for messages."""
        return f"{self.path}:{i + 1}"

    def line(self, i: int, what: str) -> str:
        """Return line `i`; raise a ValueError if the file ends before this line, which should contain `what`."""
        if i >= len(self.lines):
            raise damaged(f"{self.path}: truncated: the file ends at line {len(self.lines)}, before {what}")
        return self.lines[i]

    def expected(self, i: int, pattern: re.Pattern[str], what: str) -> re.Match[str]:
        """Return the match of a pattern in line `i`; raise a ValueError that names the expected text `what` if none."""
        found = pattern.search(self.line(i, what))
        if found is None:
            raise damaged(f"{self.place(i)}: expected {what}, got {self.lines[i].strip()[:60]!r}")
        return found

    def header(self, format: str, end: int, clean: Callable[[str], str] = str.upper) -> Header:
        """Return the header of a file: the lines "NAME: value" before line `end`, as name -> (value, place).

        Args:
            format: Name of the file format, for errors.
            end: Index of the line after the header.
            clean: Function that converts the name in a line to the key.
        """
        header = Header(self.path, format)
        for i, line in enumerate(self.lines[:end]):
            name, colon, value = line.partition(":")
            if colon:
                header.setdefault(clean(name.strip()), (value.strip(), self.place(i)))
        return header

    def numbers(self, first: int) -> NumberLines:
        """Return all lines from line `first` on that are not blank, as lines of numbers."""
        kept = [i for i in range(first, len(self.lines)) if self.lines[i].strip()]
        return NumberLines(self.path, [self.lines[i] for i in kept], [i + 1 for i in kept])

    def motion(self, values: np.ndarray, step: float, component: str, record: str = "") -> GroundMotion:
        """Return the ground motion with these values [m/s2] and step [s], named by the file and the component."""
        name = f"{self.stem} {component}".strip()
        return GroundMotion(np.array(values), step, name, str(self.path), record.strip(), component)


def block(
    record: RecordText, first: int, count: int, layout: Layout, *, is_data: bool = True
) -> tuple[np.ndarray, int]:
    """Return values in fields of fixed width, which need no blank between them, and the index of the next line.

    Args:
        record: Lines of the file.
        first: Index of the first line of values, from 0.
        count: Number of values.
        layout: Layout of the values in a line.
        is_data: Whether the values are samples of the record, which must not be missing, instead of header numbers.

    Raises:
        ValueError: If there are fewer values, a line is longer or shorter than in the layout, or a field is blank, full
            of asterisks (a number that did not fit) or not a number with the decimals of the layout.
    """
    rows = -(-count // layout.per_line)
    lines = [line.rstrip() for line in record.lines[first : first + rows]]
    for i in range(len(lines) if layout.indent else 0):
        if lines[i][: layout.indent].strip():
            raise damaged(f"{record.place(first + i)}: expected {layout.indent} blanks first, got {lines[i][:40]!r}")
        lines[i] = lines[i][layout.indent :]
    seen: set[tuple[str, int]] = set()
    for i in range(rows):
        if i >= len(lines):
            raise damaged(
                f"{record.path}: truncated: the file ends at line {len(record.lines)} after at most "
                f"{len(lines) * layout.per_line} of the {count} values that its header states"
            )
        fields = layout.per_line if i < rows - 1 else count - (rows - 1) * layout.per_line
        form = lines[i].translate(_TO_FORM), fields
        if form not in seen:
            _check_line(lines[i], fields, layout, record.place(first + i), is_end=first + i == len(record.lines) - 1)
            seen.add(form)
    width = layout.width
    tokens = [line[i : i + width] for line in lines for i in range(0, len(line), width)]
    values = np.array([token.replace("D", "E").replace("d", "e") for token in tokens], dtype=np.float64)
    if not np.isfinite(values).all():
        at = int(np.flatnonzero(~np.isfinite(values))[0])
        raise damaged(f"{record.place(first + at // layout.per_line)}: {tokens[at].strip()!r} is not a finite number")
    if is_data:
        check_missing_values(values, lambda i: record.place(first + i // layout.per_line))
    return values, first + rows


def _check_line(line: str, fields: int, layout: Layout, place: str, *, is_end: bool) -> None:
    """Raise a ValueError unless a line has exactly `fields` fields, each with a right-aligned number."""
    width = layout.width
    row = [line[i : i + width] for i in range(0, len(line), width)]
    for field in row:
        if "*" in field:
            raise ValueError(
                f"{place}: {field.strip()!r} replaces a value that did not fit its field of {width} characters, so the "
                "value is lost: get the record in another format or unit"
            )
        if re.fullmatch(r"\s*[-+]?(nan|inf\w*)\s*", field, re.IGNORECASE):
            raise damaged(f"{place}: {field.strip()!r} is not a finite number")
    if len(row) != fields or (row and len(row[-1]) != width):
        why = "it is the last line, so the file may be truncated" if is_end else "characters are missing or were added"
        raise damaged(
            f"{place}: this line must have {fields} values of {width} characters, got {line.strip()[:60]!r}: {why}"
        )
    for field in row:
        if not _field_pattern(layout.decimals, layout.is_scientific).fullmatch(field):
            number(field.strip(), place)  # raises a clearer error if this is not a number
            digits = "" if layout.decimals is None else f" with {layout.decimals} digits after the point"
            raise damaged(
                f"{place}: expected a number{digits} at the right of its field of {width} characters, got {field!r}"
            )


@cache
def _field_pattern(decimals: int | None, is_scientific: bool) -> re.Pattern[str]:
    # Fortran writes no plus sign before a positive number.
    if is_scientific:
        return re.compile(rf" *-?\d\.\d{{{decimals}}}[EeDd][-+]\d{{1,3}}", re.ASCII)
    if decimals is None:
        return re.compile(r" *-?(\d+\.\d*|\.\d+)([EeDd][-+]\d+)?", re.ASCII)
    return re.compile(r" *-?\d+" if decimals == 0 else rf" *-?\d*\.\d{{{decimals}}}", re.ASCII)


def layout_of_lines(record: RecordText, first: int, decimals: int | None = None) -> Layout:
    """Return the layout of the values that start at a line, from the positions at which the numbers in it end.

    Numbers without a blank between them are separated by their signs or their number of decimals.

    Args:
        record: Lines of the file.
        first: Index of the first line of values, from 0.
        decimals: Number of digits after the point; None: the number of digits of the first value.
    """
    line = record.line(first, "its values").rstrip()
    if decimals is None:
        found = re.match(r" *[-+]?\d*(\.\d*)?(?P<exponent>[EeDd][-+]?\d+)?", line)
        if found is None or not found[0].strip():
            raise damaged(f"{record.place(first)}: expected numbers, got {line.strip()!r}")
        decimals = None if found["exponent"] else len(found[1] or ".") - 1
    pattern = r"[-+]?\d*\.?\d*[EeDd][-+]?\d+" if decimals is None else r"[-+]?\d+"
    pattern = rf"[-+]?\d*\.\d{{{decimals}}}" if decimals else pattern
    ends = [match.end() for match in re.finditer(pattern, line)]
    indent = len(line) % len(ends) if len(ends) > 1 else 0
    if not ends or ends[-1] != len(line) or line[:indent].strip():
        raise damaged(f"{record.place(first)}: expected numbers in columns of the same width, got {line.strip()!r}")
    return Layout(len(ends), len(line) // len(ends), decimals, indent)


def check_end(record: RecordText, next_line: int) -> None:
    """Raise a ValueError if a line from `next_line` on is not blank; warn if the file ends within a line of blanks."""
    rest = [i for i in range(next_line, len(record.lines)) if record.lines[i].strip()]
    if rest:
        raise ValueError(
            f"{record.place(rest[0])}: more follows than the values that the header states: "
            f"{record.lines[rest[0]].strip()[:60]!r}. Delete the line if it does not belong to the record"
        )
    warn_of_blank_end(record.text, record.path)
