"""Text of record files: lines of numbers, and checks for damaged numbers and lines."""

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
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([ED][+-]?\d+)?", re.IGNORECASE)
# Form of a number, i.e. the number with all digits replaced by 0: before the point, after the point, and exponent.
_FORM = re.compile(r"[+-]?(0*)(?:\.(0*))?(E[+-]?0+)?")
_TO_FORM = bytes.maketrans(b"123456789eDd", b"000000000EEE")
_TO_E = bytes.maketrans(b"Dd", b"EE")
# 12 numbers of the same form are not a coincidence. If a program drops final zeros, every tenth number is shorter.
FEWEST_ALIKE = 12
LARGEST_SHARE_OF_OTHERS = 0.02


def text_of(path: str | PathLike) -> str:
    """Return the text of a file; if the file is not text, raise an error that names the kind of file."""
    data = bytes_of(path)
    refuse_other_content(path, data)
    text = decoded(data)
    refuse_other_text(path, text)
    return text


def lines_of(text: str) -> list[str]:
    """Return the lines of a text as a list, without blank lines at its end."""
    return text.rstrip().split("\n")  # str.splitlines would also split at form feeds


def number(token: str, place: str) -> float:
    """Return the number that a text contains; raise a ValueError that names its place if it is not a finite number."""
    # The pattern rejects "nan", "inf" and "1_000", which float() accepts.
    value = float(re.sub("[dD]", "E", token)) if _NUMBER.fullmatch(token) and token.isascii() else np.nan
    if not np.isfinite(value):
        raise damaged(f"{place}: {token!r} is not a finite number")
    return value


class NumberLines:
    """The lines of numbers in a file.

    Lines that differ only in their digits have the same form; each form is checked once.

    Args:
        path: The file.
        lines: The lines, without blank lines and comments.
        line_numbers: Number of each line in the file, from 1.
        mark: Character that separates numbers; None: white space.
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
        """Return the path and the line number of line `i`, such as "quake.txt:7", for messages."""
        return f"{self.path}:{self.line_numbers[i]}"

    def tokens(self, i: int) -> list[str]:
        """Return the numbers in line `i` as texts."""
        return self._split(self.lines[i])

    def widths(self) -> dict[int, int]:
        """Return number of columns -> index of the first line with this number of columns."""
        widths = {form: len(cells) for form, cells in self._cells.items()}
        if len(set(widths.values())) == 1:
            return {next(iter(widths.values())): 0}
        return {widths[form]: i for i, form in reversed(list(enumerate(self._forms)))}

    def values(self, columns: Sequence[int] | None = None) -> np.ndarray:
        """Return all numbers, shape [value]; if `columns` are given, shape [column, line].

        Raises:
            ValueError: If a value is not a finite number, or a value is missing between two separators.
        """
        if all(_NUMBER.fullmatch(cell) for cells in self._cells.values() for cell in cells):
            is_fortran = b"D" in self._text or b"d" in self._text  # exponents with the letter D
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
        """Return whether `is_such` is true for at least one line; it is called with all digits replaced by 0."""
        return any(is_such(form.decode("ascii")) for form in self._cells)

    def other_forms(self, column: int | None = None) -> tuple[str, str, str] | None:
        """Return the place and the text of the first number whose form differs from almost all others, and an example.

        The form is the number of digits after the decimal point. In a number with an exponent, it also includes the
        digits before the point and of the exponent. If all zeros are written in another form, they are not reported.
        None: no form is common, or all numbers have it.

        Args:
            column: Index of the column to check; None: all columns.
        """
        which = slice(None) if column is None else slice(column, column + 1)
        # If most numbers are written with a zero before the point, such as "0.5", then ".5" has lost a digit.
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
        # Programs abbreviate all zeros, and people abbreviate zeros at both ends of a record. A single abbreviated zero
        # elsewhere is a damaged number.
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
        """Indices of the lines whose numbers end at other positions than in almost all other lines.

        If a number loses its sign or a digit, the numbers after it are shifted. The last line may be shorter. If the
        file has no columns of fixed width, the list is empty.
        """
        tabs = [i for i, line in enumerate(self.lines) if "\t" in line] if b"\t" in self._text else []
        if 0 < len(tabs) <= 2 and len(self) >= FEWEST_ALIKE:
            return tabs  # a tab may have replaced a sign or a digit
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
        """Return the indices of one or two lines with more blanks than all others: a blank may have replaced a sign."""
        counts: Counter[int] = Counter()
        for form, count in self._counts.items():
            counts[form.rstrip().count(b" ")] += count
        common, alike = counts.most_common(1)[0]
        if len(self) < FEWEST_ALIKE or not 0 < len(self) - alike <= 2:
            return []
        return [i for i, form in enumerate(self._forms) if form.rstrip().count(b" ") > common]


_ZERO = re.compile(r"[+-]?0*(0|\.0+)([ED][+-]?0+)?", re.IGNORECASE)


def _kind(form: str, has_zeros: bool) -> tuple:
    """Return the properties that numbers of one form share: digits after the point, plus sign, and further ones.

    Args:
        form: A number whose digits are all replaced by 0.
        has_zeros: Whether numbers of the file have a zero before the point, as in "0.5".
    """
    match = _FORM.fullmatch(form)
    if match is None:
        return (form,)
    before, after, exponent = match.groups()
    digits = None if after is None else len(after)
    if exponent:
        return digits, form[0] == "+", len(before), exponent.replace("-", "+")
    return digits, form[0] == "+", has_zeros and not before


def check_forms(numbers: NumberLines) -> None:
    """Raise a ValueError if the form of a number differs from all others; warn if the layout of a line differs."""
    if other := numbers.other_forms():
        place, token, example = other
        raise damaged(
            f"{place}: {token!r} is written in another form than the file's other values, such as {example!r}: it may "
            "have lost a digit or its point"
        )
    warn_of_layout(numbers, numbers.other_layouts)


def warn_of_layout(numbers: NumberLines, lines: Sequence[int]) -> None:
    """Warn that numbers in these lines (indices) are at other positions than in most lines; the first line is named."""
    if lines:
        warn_caller(
            f"{numbers.place(lines[0])}: the values of this line are not in the columns of the other lines: one may "
            "have lost its sign or a digit. Compare the line with the source"
        )


def warn_of_blank_end(text: str, path: str | PathLike) -> None:
    """Warn if a text ends with blanks instead of a newline, because the file may be truncated."""
    if text[-1] != "\n" and not text.rpartition("\n")[2].strip():
        warn_caller(f"{path}: the file ends within a line of blanks, so it may be truncated: download it again")


def check_last_value(text: str, values: Sequence[str], path: str | PathLike) -> None:
    """Raise a ValueError if the last value of a file is incomplete; warn if it may be incomplete.

    A value is complete if a newline follows it. Blanks after the last newline are an incomplete line. If the file does
    not end with a newline, its last value must have as many characters after the decimal point (including the exponent)
    as all other values. If the other values vary in this number of characters, the last value may be incomplete if it
    is shorter than every other value.

    Args:
        text: The text of the file.
        values: The values of the file as texts.
        path: The file.
    """
    if text[-1].isspace():
        warn_of_blank_end(text, path)
        return
    *others, last = (len(value.partition(".")[2]) for value in values)
    if len(set(others)) == 1 and others[0] > 0:
        if last < others[0]:
            raise ValueError(
                f"{path}: truncated within its last value, {values[-1]!r}: the others have {others[0]} characters "
                "after the decimal point, and no newline ends the file: download it again"
            )
        return
    shortest = min((len(value.lstrip("+-")) for value in values[:-1]), default=0)
    if len(values[-1].lstrip("+-")) < shortest:
        warn_caller(
            f"{path}: no newline ends the file, and its last value, {values[-1]!r}, has fewer characters than any "
            "other: the file may be truncated, so download it again"
        )
