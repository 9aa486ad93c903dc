"""Refusal of text records whose commas may be decimal commas."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from warpdyn.foundations.core.messages import amount_of
from warpdyn.model.ground_motions.records.parsing.not_a_record import AmbiguousTextError

if TYPE_CHECKING:
    from warpdyn.model.ground_motions.records.text import NumberLines

_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([ED][+-]?\d+)?", re.IGNORECASE)


def refuse_decimal_commas(numbers: NumberLines, mark: str | None, above: str, *, is_stated: bool) -> None:
    """Raise an AmbiguousTextError if commas may be decimal commas.

    Args:
        numbers: Lines of numbers.
        mark: Separator of the columns; None: white space.
        above: The line above the first number, which may contain the names of the columns.
        is_stated: Whether the user gave the separator.
    """
    place, first = numbers.place(0), numbers.lines[0].strip()
    if mark != ",":
        if any(map(_DECIMAL_COMMA.fullmatch, numbers.tokens(0))):
            raise AmbiguousTextError(f"{place}: {first!r} seems to have decimal commas: give decimal_comma=True")
        return
    if is_stated or above.count(",") == first.count(","):
        return
    if all(_DECIMAL_COMMA.fullmatch(token) for line in numbers.lines for token in line.split()):
        raise AmbiguousTextError(
            f"{place}: {first!r} may be a number with a decimal comma (give decimal_comma=True) or columns of whole "
            'numbers (give delimiter=",")'
        )
    names, columns = above.count(",") + 1, len(numbers.tokens(0))
    if above.strip() and columns == 2 * names and not any("." in line for line in numbers.lines):
        raise AmbiguousTextError(
            f"{place}: {columns} columns, but {amount_of(names, 'name')} in the line above: the numbers seem to have "
            "decimal commas. Save the file with decimal points, or with semicolons between columns and give "
            "decimal_comma=True"
        )
