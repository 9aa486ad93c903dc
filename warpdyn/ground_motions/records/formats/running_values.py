"""Reader of values that run on from line to line, several per line, without a format of their own."""

from __future__ import annotations

import re
from os import PathLike

import numpy as np

from warpdyn.ground_motions.motions import GroundMotion
from warpdyn.ground_motions.records.formats.fixed_width import RecordText
from warpdyn.ground_motions.records.formats.header_checks import check_missing_values
from warpdyn.ground_motions.records.text import NumberLines, check_forms, check_last_value
from warpdyn.ground_motions.records.units import checked_step, unit_factor

FEWEST_LINES = 3  # of as many values; fewer may as well be columns
_COUNT = re.compile(r"\b(?:npts?|n\s*points?|no\.?\s*of\s*points|number\s+of\s+(?:points|data|samples|values))\s*[=:]?\s*(\d+)", re.I)
_STEP = re.compile(r"\b(?:dt|delta|time\s*step|sampling\s*interval|step)\b[^=:\d.]*[=:]?\s*(\d*\.\d+|\d+e-\d+)\s*(ms)?", re.I)
_OTHER_QUANTITY = re.compile(r"\b(velocity|displacement|spectr\w+)\b", re.IGNORECASE)
_TOUCHING = re.compile(r"(?<=[\d.])(?=[-+]\d*\.)")  # 0.123-0.456: a sign behind a digit, and not behind an E


def lines_of_values(record: RecordText) -> int:
    """Return the number of the first line of values, from 0, behind a header of lines with other words.

    Args:
        record: The text.
    """
    return next((i for i, line in enumerate(record.lines) if _is_numbers(line)), len(record.lines))


def _is_numbers(line: str) -> bool:
    tokens = _TOUCHING.sub(" ", line).replace(",", " ").split()
    return bool(tokens) and all(re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([EeDd][-+]?\d+)?", token) for token in tokens)


def read_running_values(path: str | PathLike, *, unit: str, step: float | None = None) -> list[GroundMotion]:
    """Read accelerations that run on from line to line, as many per line throughout, except in the last line.

    Lines of words may stand before them. If these state the number of values or the step ("NPTS= 4000, DT= .01"), both
    are compared with what follows.

    Args:
        path: The file; its name without the suffix names the motion.
        unit: Unit of the values.
        step: Step [s]; the one that the header states by default.

    Raises:
        ValueError: If the header states another number of values or another step, the step is missing, lines have
            different numbers of values, a value is not a finite number, or the last one is cut.
    """
    factor = unit_factor(unit, "unit")
    record = RecordText.of(path)
    first = lines_of_values(record)
    head = record.lines[:first]
    # A line of one or two numbers before longer lines is their number, their step, or both.
    per_line = [len(_tokens(line)) for line in record.lines[first : first + 4]]
    if len(per_line) > 2 and per_line[0] < min(per_line[1:]) and per_line[0] <= 2:
        head = record.lines[: first + 1]
        first += 1
    for i, line in enumerate(head):
        if (other := _OTHER_QUANTITY.search(line)) and not re.search(r"\bacc", line, re.IGNORECASE):
            raise ValueError(f"{record.place(i)}: the values are of a {other[1].lower()}, not of an acceleration")
    places = [i + 1 for i in range(first, len(record.lines)) if record.lines[i].strip()]
    lines = [" ".join(_tokens(record.lines[i - 1])) for i in places]
    numbers = NumberLines(path, lines, places)
    values = numbers.values() if lines else np.zeros(0)
    widths = [len(_tokens(line)) for line in lines]
    wrong = [i for i in range(len(lines) - 1) if widths[i] != widths[0]]
    if wrong or widths[-1] > widths[0]:
        i = wrong[0] if wrong else len(lines) - 1
        raise ValueError(
            f"{numbers.place(i)}: {widths[i]} values, where the first line has {widths[0]}: a value is missing or was added"
        )
    stated, found_step = _stated(record, head)
    if stated is not None and stated != values.size:
        kind = "truncated" if values.size < stated else "too long"
        raise ValueError(f"{path}: {kind}: {values.size} values follow, not the {stated} that the header states")
    if step is None and found_step is None:
        raise ValueError(f"{path}: the step of these {values.size} values must be given: wd.records.read(path, unit, step=0.01)")
    step = checked_step(step, "step") if step is not None else found_step
    if found_step is not None and step is not None and abs(step - found_step) > 1e-3 * found_step:
        raise ValueError(f"{path}: step is {step:g} s, but the header states {found_step:g} s")
    check_last_value(record.text, [token for line in lines for token in line.split()], path)
    check_forms(NumberLines(path, [record.lines[i - 1] for i in places], places) if _has_blanks(record, places) else numbers)
    check_missing_values(values, lambda i: numbers.place(i // widths[0]))
    return [GroundMotion(factor * values, float(step or 0), record.stem, str(path))]


def _tokens(line: str) -> list[str]:
    return _TOUCHING.sub(" ", line).replace(",", " ").split()


def _has_blanks(record: RecordText, places: list[int]) -> bool:
    """Return whether all numbers are apart, so that their columns show a lost sign."""
    return not any("," in record.lines[i - 1] or _TOUCHING.search(record.lines[i - 1]) for i in places)


def _stated(record: RecordText, head: list[str]) -> tuple[int | None, float | None]:
    """Return the number of values and the step [s] that a header states."""
    count = next((int(found[1]) for line in head if (found := _COUNT.search(line))), None)
    step = next(
        (float(found[1]) * (1e-3 if found[2] else 1.0) for line in head if (found := _STEP.search(line))), None
    )
    if head and _is_numbers(head[-1]):
        for token in _tokens(head[-1]):
            value = float(token.upper().replace("D", "E"))
            if token.isdigit():
                count = int(token)
            elif 0 < value < 1:
                step = value
            else:
                raise ValueError(
                    f"{record.place(len(head) - 1)}: this line has fewer numbers than the others, and {token!r} is neither "
                    "a number of values nor a step: delete the line if it is a header"
                )
    return count, step
