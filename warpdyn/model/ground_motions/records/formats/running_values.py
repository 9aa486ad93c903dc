"""Reader of text with several successive values per line, in an unknown format."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from os import PathLike

from warpdyn.foundations.core.messages import amount_of
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.headers import named_component
from warpdyn.model.ground_motions.records.parsing.fixed_width import RecordText
from warpdyn.model.ground_motions.records.parsing.header_checks import check_count, checked_values
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.quantities import check_statements, stated_count, stated_step
from warpdyn.model.ground_motions.records.text import NumberLines, warn_of_layout
from warpdyn.model.ground_motions.records.units import checked_step, unit_factor

FEWEST_LINES = 3  # lines of one layout, so that lines of other layouts may be damaged
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([EeDd][-+]?\d+)?")
_WORD = re.compile(r"(?<![\w.])[^\W\d_]{2,}")  # not after a digit, because a damaged number may contain letters
_NO_WORDS = ("nan", "inf", "infinity", "na", "null", "none")  # texts that are written instead of missing numbers
_ERRORS = re.compile(r"#(N/A|DIV/0!|VALUE!|REF!|NUM!|NAME\?|NULL!)", re.IGNORECASE)
_TOUCHING = re.compile(r"(?<=[\d.])(?=[-+]\d*\.)")  # between touching numbers, as in 0.123-0.456; not after an E


@dataclass(frozen=True)
class Header:
    """Content of a header: its number of lines, and the number of values and the step [s] that it states."""

    lines: int
    count: int | None
    step: float | None


def header_of(record: RecordText) -> Header:
    """Return the header of a text in an unknown format.

    A header consists of lines of words, and may end with a line of one or two numbers: the number of values and the
    step. If these numbers can be neither, a ValueError is raised.
    """
    first = next((i for i, line in enumerate(record.lines) if not _is_words(line)), len(record.lines))
    words = record.lines[:first]
    stated = stated_step(words)
    count, step = stated_count(words), stated[0] if stated else None
    rows = [line for line in record.lines[first:] if line.strip()]
    widths = [len(tokens_of(line)) for line in rows[:4]]
    are_numbers = bool(rows) and all(map(_NUMBER.fullmatch, tokens_of(rows[0])))
    if are_numbers and len(widths) == 4 and widths[0] <= 2 and len(set(widths[1:])) == 1:
        numbers = tokens_of(rows[0])
        total = sum(len(tokens_of(line)) for line in rows[1:])
        whole = [int(token) for token in numbers if token.isdigit()]
        is_count = whole in ([total], [len(rows) - 1]) and not rows[1].strip().isdigit()
        if widths[0] != widths[1] or is_count:
            others = [_float_of(token) for token in numbers if not token.isdigit()]
            if len(whole) > 1 or len(others) > 1 or any(not 0 < other < 1 for other in others):
                raise ValueError(
                    f"{record.place(first)}: this line has another number of values than the next lines, and "
                    f"{rows[0].strip()!r} is neither a number of values nor a step: delete the line if it is a header"
                )
            return Header(first + 1, whole[0] if whole else count, others[0] if others else step)
    return Header(first, count, step)


def check_against_header(motion: GroundMotion, header: Header) -> None:
    """Raise a ValueError if a header states another number of values or another step than the motion has."""
    if header.count is not None:
        check_count(motion.acceleration.size, str(header.count), motion.source)
    if header.step is not None and abs(motion.step - header.step) > 1e-3 * header.step:
        raise damaged(f"{motion.source}: the step is {motion.step:g} s, but the header states {header.step:g} s")


def _is_words(line: str) -> bool:
    """Return whether a line belongs to the header: it is blank, a comment, or has words.

    A line has words if it begins with a word or contains at least as many words as numbers.
    """
    text = line.strip()
    if not text or (text[0] in "#%" and not _ERRORS.match(text)):
        return True
    words = [word for word in _WORD.findall(text) if word.lower() not in _NO_WORDS]
    numbers = [token for token in tokens_of(text) if _NUMBER.fullmatch(token)]
    return bool(words) and (text.startswith(words[0]) or len(numbers) <= len(words))


def read_running_values(path: str | PathLike, *, unit: str, step: float | None = None) -> list[GroundMotion]:
    """Read accelerations with the same number of successive values in each line, except the last line.

    Lines of words may come first, then a line with the number of values or the step.

    Args:
        path: The file; its name without the suffix names the motion.
        unit: Unit of the values.
        step: Step [s]; None: the step that the header states.

    Returns:
        The motion [m/s2], with the component that the header states; the file name is not searched for a component.
    """
    factor = unit_factor(unit, "unit")
    record = RecordText.of(path)
    header = header_of(record)
    places = [i for i in range(header.lines, len(record.lines)) if record.lines[i].strip()]
    _check_separators(record, places)
    rows = [tokens_of(record.lines[i]) for i in places]
    if not rows:
        raise damaged(f"{path}: no values follow the header")
    for i, row in zip(places, rows, strict=True):
        if len(row) > len(rows[0]) or (len(row) < len(rows[0]) and i != places[-1]):
            raise damaged(
                f"{record.place(i)}: {amount_of(len(row), 'value')}, but the first line has {len(rows[0])}: a value is "
                "missing or was added"
            )
    numbers = NumberLines(path, [" ".join(row) for row in rows], [i + 1 for i in places])
    values = checked_values(numbers, record.text)
    words = record.lines[: header.lines]
    check_statements(path, "", words, unit, factor)
    step = step if step is not None else header.step
    if step is None:
        raise ValueError(
            f"{path}: the step of these {values.size} values must be given: wd.records.read(path, unit={unit!r}, "
            "step=0.01)"
        )
    warn_of_layout(numbers, _lines_of_other_layout([record.lines[i] for i in places]))
    component = next(filter(None, map(named_component, words)), "")
    motion = GroundMotion(factor * values, checked_step(step, "step"), record.stem, str(path), "", component)
    check_against_header(motion, header)
    return [motion]


def _check_separators(record: RecordText, places: list[int]) -> None:
    """Raise a ValueError if separators vary, commas may be decimal commas, or asterisks replace a number.

    Args:
        record: Lines of the file.
        places: Indices of the lines of values.
    """
    for i in places:
        if "**" in record.lines[i]:
            raise ValueError(
                f"{record.place(i)}: asterisks replace a value that did not fit its field, so the value is lost: get "
                "the record in another format or unit"
            )
    decimal = next((i for i in places if re.search(r"\d,\d", record.lines[i]) and "." not in record.lines[i]), None)
    if decimal is not None:
        raise ValueError(
            f"{record.place(decimal)}: {record.lines[decimal].strip()[:40]!r} seems to have decimal commas: replace "
            "the commas by points"
        )
    marks = [len(re.findall(r"[,;\t]", record.lines[i])) for i in places[:-1]]
    usual = Counter(marks).most_common(1)[0][0] if marks else 0
    odd = next((i for i, count in zip(places, marks, strict=False) if count != usual), None)
    if odd is None and usual == 0 and places and re.search(r"[,;\t]", record.lines[places[-1]]):
        odd = places[-1]
    if odd is not None:
        raise damaged(
            f"{record.place(odd)}: {record.lines[odd].strip()[:60]!r} has another number of commas, semicolons or tabs "
            "than the other lines"
        )


def _lines_of_other_layout(lines: list[str]) -> list[int]:
    """Return the indices of lines in which numbers end at other columns than in most lines: a sign may be missing.

    The result is empty if there are many such lines, because the layout then varies intentionally.
    """
    ends = [tuple(match.end() for match in re.finditer(r"[\d.](?=[-+\s,;]|$)", line)) for line in lines]
    common, alike = Counter(ends).most_common(1)[0]
    others = [
        i for i, row in enumerate(ends) if row != common and not (i == len(ends) - 1 and row == common[: len(row)])
    ]
    return others if alike >= FEWEST_LINES and len(others) <= max(2, 0.02 * len(lines)) else []


def tokens_of(line: str) -> list[str]:
    """Return the numbers in a line as texts; numbers without a separator, as in "0.1-0.2", are divided at the sign."""
    return re.sub(r"[,;]", " ", _TOUCHING.sub(" ", line)).split()


def _float_of(token: str) -> float:
    return float(token.upper().replace("D", "E"))
