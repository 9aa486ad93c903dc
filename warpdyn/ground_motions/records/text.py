"""Text of record files: its lines, its numbers, and signs that a number or a line was damaged."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from warpdyn.core.messages import warn_caller

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([ED][+-]?\d+)?", re.IGNORECASE)
# Of a number whose digits are all written 0: what stands before the point, behind it, and the exponent.
_FORM = re.compile(r"[+-]?(0*)(?:\.(0*))?(E[+-]?0+)?")
_TO_FORM = str.maketrans("123456789eDd", "000000000EEE")
_TO_E = str.maketrans("Dd", "EE")
# Among as many numbers or lines, a common form is no chance; writers that drop zeros at the end change every tenth.
FEWEST_ALIKE = 12
LARGEST_SHARE_OF_OTHERS = 0.02


def text_of(path: str | Path) -> str:
    """Return the text of a file, or raise an error that gives the reason why there is none."""
    if Path(path).is_dir():
        raise IsADirectoryError(f"{path}: is a directory, not a file; read_directory reads the .AT2 files in it")
    if not Path(path).is_file():
        raise FileNotFoundError(f"{path}: no such file")
    text = Path(path).read_bytes().decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    if not text.strip():
        raise ValueError(f"{path}: the file is empty")
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


def numbers_of(tokens: Sequence[str], place_of: Callable[[int], str]) -> np.ndarray:
    """Return the numbers of a file, or raise a ValueError that names the place of the first that is none.

    Args:
        tokens: The numbers as text.
        place_of: Returns the place of a token, such as "quake.txt:7", from its index.
    """
    joined = " ".join(tokens)
    # A few patterns stand for all numbers once their digits are written 0, so that few are looked at.
    sound = all(_NUMBER.fullmatch(form) for form in set(joined.translate(_TO_FORM).split(" ")))
    if sound and joined.isascii():
        # Letters for exponents apart from E are Fortran's.
        values = np.fromiter(map(float, joined.translate(_TO_E).split(" ")), np.float64, len(tokens))
        if np.isfinite(values).all():
            return values
    return np.array([number(token, place_of(i)) for i, token in enumerate(tokens)])


def other_forms(tokens: Sequence[str]) -> tuple[str, list[int]]:
    """Return an example of the form that almost all numbers of a file have, and the indices of those that differ.

    The form is the number of digits after the decimal point, and in numbers with an exponent also its digits and those
    before the point. A zero may be written in any form. Where no form is common, no number differs.

    Args:
        tokens: The numbers as text.
    """
    forms = "\n".join(tokens).translate(_TO_FORM).split("\n")
    kinds = {text: _kind(text) for text in set(forms)}
    counts: Counter[tuple] = Counter()
    for text, count in Counter(forms).items():
        counts[kinds[text]] += count
    common, alike = counts.most_common(1)[0]
    if len(tokens) < FEWEST_ALIKE or len(tokens) - alike > max(2, LARGEST_SHARE_OF_OTHERS * len(tokens)):
        return "", []
    wrong = {text for text, kind in kinds.items() if kind != common}
    others = [i for i, text in enumerate(forms) if text in wrong and not _is_plain_zero(tokens[i])] if wrong else []
    return next(token for token, text in zip(tokens, forms, strict=True) if kinds[text] == common), others


def _kind(form: str) -> tuple:
    """Return what numbers of one form have in common, from a number whose digits are all written 0."""
    match = _FORM.fullmatch(form)
    if match is None:
        return (form,)
    before, after, exponent = match.groups()
    digits = None if after is None else len(after)
    return (digits, len(before), exponent.replace("-", "+")) if exponent else (digits,)


def _is_plain_zero(token: str) -> bool:
    return re.fullmatch(r"[+-]?0*(0|\.0+)([ED][+-]?0+)?", token, re.IGNORECASE) is not None


def other_layouts(lines: Sequence[str]) -> list[int]:
    """Return the indices of lines whose numbers do not end where those of almost all other lines do.

    A number that lost its sign or a digit moves what stands behind it. Where numbers do not stand in columns of a
    fixed width, and in the last line, no line differs.

    Args:
        lines: The lines of numbers, without blank ones.
    """
    ends = [tuple(match.end() for match in re.finditer(r"\S+", line)) for line in lines]
    if len(lines) < FEWEST_ALIKE:
        return []
    common, alike = Counter(ends).most_common(1)[0]
    if len(lines) - alike > max(3, LARGEST_SHARE_OF_OTHERS * len(lines)):
        return []
    return [i for i, row in enumerate(ends) if row != (common if i < len(ends) - 1 else common[: len(row)])]


def check_last_value(text: str, values: Sequence[str], path: str | Path) -> None:
    """Raise a ValueError if the last value of a file is cut; warn if that cannot be decided.

    A value that white space follows is complete. If no newline ends the file, its last value must have as many
    characters after the decimal point, exponent included, as all others; if the others differ, it cannot be decided.

    Args:
        text: The file's text.
        values: Its values as text.
        path: The file.
    """
    if text[-1].isspace():
        return
    *others, last = (len(value.partition(".")[2]) for value in values)
    if len(set(others)) == 1 and others[0] > 0:
        if last < others[0]:
            raise ValueError(
                f"{path}: truncated within its last value, {values[-1]!r}: the others have {others[0]} characters "
                "after the decimal point, and no newline ends the file"
            )
        return
    warn_caller(f"{path}: no newline ends the file, so its last value, {values[-1]!r}, may be truncated")
