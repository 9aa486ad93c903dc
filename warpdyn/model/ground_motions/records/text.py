"""Text of record files: lines of numbers, and signs that a number or a line was damaged."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cached_property
from os import PathLike

import numpy as np

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.ground_motions.records.parsing.content import (
    bytes_of,
    decoded,
    refuse_other_content,
    refuse_other_text,
)

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([ED][+-]?\d+)?", re.IGNORECASE)
# Of a number whose digits are all written 0: what stands before the point, behind it, and the exponent.
_FORM = re.compile(r"[+-]?(0*)(?:\.(0*))?(E[+-]?0+)?")
_TO_FORM = bytes.maketrans(b"123456789eDd", b"000000000EEE")
_TO_E = bytes.maketrans(b"Dd", b"EE")
# Among as many numbers or lines, a common form is no chance; writers that drop zeros at the end change every tenth.
FEWEST_ALIKE = 12
LARGEST_SHARE_OF_OTHERS = 0.02


def text_of(path: str | PathLike) -> str:
    """Return the text of a file, or raise an error that names what the file is instead."""
    data = bytes_of(path)
    refuse_other_content(path, data)
    text = decoded(data)
    refuse_other_text(path, text)
    return text


def lines_of(text: str) -> list[str]:
    """Return the lines of a text, without blank ones at its end."""
    return text.rstrip().split("\n")  # str.splitlines would also split at form feeds


def number(token: str, place: str) -> float:
    """Return a number, or raise a ValueError that names its place."""
    # The pattern refuses what float() accepts but no record means: "nan", "inf", "1_000".
    value = float(re.sub("[dD]", "E", token)) if _NUMBER.fullmatch(token) and token.isascii() else np.nan
    if not np.isfinite(value):
        raise ValueError(f"{place}: {token!r} is not a finite number")
    return value


class NumberLines:
    """Lines of numbers of a file.

    Lines that differ in their digits alone are looked at once, which makes a careful look as quick as a plain one.

    Args:
        path: The file.
        lines: The lines, without blank ones and comments.
        line_numbers: Where each line stands in the file, from 1.
        mark: What separates numbers; white space by default.
    """

    def __init__(
        self, path: str | PathLike, lines: Sequence[str], line_numbers: Sequence[int], mark: str | None = None
    ) -> None:
        self.path, self.lines, self.line_numbers, self.mark = path, lines, line_numbers, mark
        self._text = "\n".join(lines).encode("ascii", "replace")
        self._forms = self._text.translate(_TO_FORM).split(b"\n")
        self._counts = Counter(self._forms)
        self._cells = {form: self._split(form.decode("ascii")) for form in self._counts}

    def _split(self, line: str) -> list[str]:
        return line.split() if self.mark is None else [token.strip() for token in line.split(self.mark)]

    def __len__(self) -> int:
        return len(self.lines)

    def place(self, i: int) -> str:
        """Return file and line, such as "quake.txt:7", of line `i`."""
        return f"{self.path}:{self.line_numbers[i]}"

    def tokens(self, i: int) -> list[str]:
        """Return the numbers of line `i` as text."""
        return self._split(self.lines[i])

    def widths(self) -> dict[int, int]:
        """Return how many numbers the lines have, each with the first line that has so many."""
        widths = {form: len(cells) for form, cells in self._cells.items()}
        if len(set(widths.values())) == 1:
            return {next(iter(widths.values())): 0}
        return {widths[form]: i for i, form in reversed(list(enumerate(self._forms)))}

    def values(self, columns: Sequence[int] | None = None) -> np.ndarray:
        """Return the numbers: all in a row, or some columns, shape [column, line].

        Raises:
            ValueError: If one is not a finite number, or of all in a row one is missing between separators.
        """
        if all(_NUMBER.fullmatch(cell) for cells in self._cells.values() for cell in cells):
            is_fortran = b"D" in self._text or b"d" in self._text  # the letter of an exponent
            text = self._text.translate(_TO_E) if is_fortran else self._text
            if columns is None:
                values = np.fromstring(text if self.mark is None else text.replace(self.mark.encode(), b" "), sep=" ")
            else:
                lines = text.decode("ascii").split("\n") if is_fortran else self.lines
                values = np.loadtxt(lines, delimiter=self.mark, comments=None, usecols=columns, ndmin=2).T
            if np.isfinite(values).all():
                return values
        if columns is None:
            return np.array([number(token, self.place(i)) for i in range(len(self)) for token in self.tokens(i)])
        rows = [[number(self.tokens(i)[j], self.place(i)) for j in columns] for i in range(len(self))]
        return np.array(rows).T

    def has_line(self, is_such: Callable[[str], bool]) -> bool:
        """Return whether some line is such a one; its digits are written 0."""
        return any(is_such(form.decode("ascii")) for form in self._cells)

    def other_forms(self, column: int | None = None) -> tuple[str, str, str] | None:
        """Return the place and text of the first number in another form than almost all others, and one of those.

        The form is the number of digits after the decimal point, and in numbers with an exponent also its digits and
        those before the point. Zeros may all be written in another form. Where no form is common, no number differs.

        Args:
            column: The column to look at; all of them by default.
        """
        which = slice(None) if column is None else slice(column, column + 1)
        # Where most numbers such as "0.5" are written with their zero, ".5" has lost a digit.
        zeros_written = len(re.findall(rb"(?<![\d.])0\.\d", self._text))
        has_zeros = 0 < zeros_written >= len(re.findall(rb"(?<![\d.])\.\d", self._text))
        kinds = {form: [_kind(cell, has_zeros) for cell in cells[which]] for form, cells in self._cells.items()}
        if len({kind for row in kinds.values() for kind in row}) == 1:
            return None
        counts: Counter[tuple] = Counter()
        for form, count in self._counts.items():
            for kind in kinds[form]:
                counts[kind] += count
        common, alike = counts.most_common(1)[0]
        total = counts.total()
        if total < FEWEST_ALIKE or not 0 < total - alike <= max(2, LARGEST_SHARE_OF_OTHERS * total):
            return None
        others = {form for form, row in kinds.items() if any(kind != common for kind in row)}
        found = [
            (i, token)
            for i, form in enumerate(self._forms)
            if form in others
            for token, kind in zip(self.tokens(i)[which], kinds[form], strict=True)
            if kind != common
        ]
        zeros = [(i, token) for i, token in found if _ZERO.fullmatch(token)]
        # Writers abbreviate all zeros, and hands those at the ends; a single one between is what is left of a number.
        if len(zeros) > 2 or all(i in (0, len(self) - 1) for i, _ in zeros):
            found = [each for each in found if each not in zeros]
        if not found:
            return None
        return self.place(found[0][0]), found[0][1], self._example(kinds, common, which)

    def _example(self, kinds: dict[bytes, list[tuple]], common: tuple, which: slice) -> str:
        i, j = next((i, kinds[form].index(common)) for i, form in enumerate(self._forms) if common in kinds[form])
        return self.tokens(i)[which][j]

    @cached_property
    def other_layouts(self) -> list[int]:
        """The lines whose numbers do not end where those of almost all other lines do.

        A number that lost its sign or a digit moves what stands behind it. The last line may be shorter. Where numbers
        do not stand in columns of a fixed width, no line differs.
        """
        tabs = [i for i, line in enumerate(self.lines) if "\t" in line] if b"\t" in self._text else []
        if 0 < len(tabs) <= 2 and len(self) >= FEWEST_ALIKE:
            return tabs  # in the place of a sign or a digit
        ends = {form: tuple(match.end() for match in re.finditer(r"\S+", form.decode("ascii"))) for form in self._cells}
        if len(set(ends.values())) == 1:
            return []
        counts: Counter[tuple] = Counter()
        for form, count in self._counts.items():
            counts[ends[form]] += count
        common, alike = counts.most_common(1)[0]
        if len(self) < FEWEST_ALIKE or len(self) - alike > max(3, LARGEST_SHARE_OF_OTHERS * len(self)):
            return self._more_blanks()
        wrong = {form for form, row in ends.items() if row != common}
        last = ends[self._forms[-1]]
        rows = [i for i, form in enumerate(self._forms) if form in wrong] if wrong else []
        return [i for i in rows if i != len(self) - 1 or last != common[: len(last)]]

    def _more_blanks(self) -> list[int]:
        """The one or two lines with more blanks than all others have, as where one replaced a sign."""
        counts: Counter[int] = Counter()
        for form, count in self._counts.items():
            counts[form.rstrip().count(b" ")] += count
        common, alike = counts.most_common(1)[0]
        if len(self) < FEWEST_ALIKE or not 0 < len(self) - alike <= 2:
            return []
        return [i for i, form in enumerate(self._forms) if form.rstrip().count(b" ") > common]


_ZERO = re.compile(r"[+-]?0*(0|\.0+)([ED][+-]?0+)?", re.IGNORECASE)


def _kind(form: str, has_zeros: bool) -> tuple:
    """Return what numbers of one form have in common, from a number whose digits are all written 0."""
    match = _FORM.fullmatch(form)
    if match is None:
        return (form,)
    before, after, exponent = match.groups()
    digits = None if after is None else len(after)
    if exponent:
        return digits, form[0] == "+", len(before), exponent.replace("-", "+")
    return digits, form[0] == "+", has_zeros and not before


def check_forms(numbers: NumberLines) -> None:
    """Raise a ValueError at a number of another form than the rest; warn of a line that is laid out otherwise."""
    if other := numbers.other_forms():
        place, token, example = other
        raise ValueError(
            f"{place}: {token!r} is written in another form than the file's other values, such as {example!r}: it may "
            "have lost a digit or its point"
        )
    warn_of_layout(numbers, numbers.other_layouts)


def warn_of_layout(numbers: NumberLines, lines: Sequence[int]) -> None:
    """Warn of the first of some lines whose numbers do not stand where those of other lines do."""
    if lines:
        warn_caller(
            f"{numbers.place(lines[0])}: the values of this line do not stand in the columns of the others: one may "
            "have lost its sign or a digit"
        )


def check_last_value(text: str, values: Sequence[str], path: str | PathLike) -> None:
    """Raise a ValueError if the last value of a file is cut; warn if it may be.

    A value that white space follows is complete, but blanks after the last newline are a line that is cut. If no
    newline ends the file, its last value must have as many characters after the decimal point, exponent included, as
    all others; if the others differ, it may be cut where it has fewer characters than each of them.

    Args:
        text: The file's text.
        values: Its values as text.
        path: The file.
    """
    if text[-1].isspace():
        if text[-1] != "\n" and not text.rpartition("\n")[2].strip():
            warn_caller(f"{path}: ends within a line of blanks, so it may be truncated")
        return
    *others, last = (len(value.partition(".")[2]) for value in values)
    if len(set(others)) == 1 and others[0] > 0:
        if last < others[0]:
            raise ValueError(
                f"{path}: truncated within its last value, {values[-1]!r}: the others have {others[0]} characters "
                "after the decimal point, and no newline ends the file"
            )
        return
    shortest = min((len(value.lstrip("+-")) for value in values[:-1]), default=0)
    if len(values[-1].lstrip("+-")) < shortest:
        warn_caller(
            f"{path}: no newline ends the file, and its last value, {values[-1]!r}, has fewer characters than any "
            "other: it may be truncated"
        )
