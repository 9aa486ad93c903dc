"""Find the quantity, unit, step and number of samples that headers and column names of text files state."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from os import PathLike

import numpy as np

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.ground_motions.records.parsing.not_a_record import AmbiguousTextError, damaged
from warpdyn.model.ground_motions.records.units import TIME_TOLERANCE, factor_of_unit

_FEWEST_TIMES = 5  # fewer evenly increasing values are not treated as times
_USUAL_STEPS = (0.001, 0.002, 0.0024, 0.0025, 0.004, 0.005, 0.01, 0.02, 0.05, 1 / 64, 1 / 128, 1 / 256)  # s

_WORDS = {
    "acceleration": r"ACC|ACCN|ACCS|ACCEL\w*|ACEL\w*|BESCHLEUNIGUNG\w*|IVME\w*|GROUNDACC\w*|加速度",
    "velocity": r"VEL|VELO|VELOC|VELOCIT\w*|VELOCIDAD\w*|GESCHWINDIGKEIT\w*|HIZ|VITESSE\w*|速度",
    "displacement": r"DIS|DISP|DISPL|DISPLACEMENTS?|DESPLAZ\w*|VERSCHIEBUNG\w*|SPOSTAMENT\w*|DEPLACEMENT\w*|位移|変位",
    "time": r"T|TIMES?|TIEMPO|ZEIT|TEMPO|TEMPS|ZAMAN|时间|時間",
    "frequency": r"FREQ|FREQUENC\w*|FREKANS",
    "period": r"PERIODS?",
    "spectrum": r"PSA|PSV",
    "counts": r"COUNTS?|CTS",
}
_QUANTITIES = {name: re.compile(rf"(?:{pattern})$") for name, pattern in _WORDS.items()}
_SECONDS = r"S(?:EC(?:OND)?S?)?"
_LENGTH = r"(?:[CMN]M|M|IN|INCH(?:ES)?|FT|FEET)"
_UNITS_OF_OTHERS = {
    "velocity": re.compile(rf"(?:{_LENGTH}\s*[/.]\s*{_SECONDS}|{_LENGTH}\s+{_SECONDS}\^?-1|KINE|{_LENGTH}PS)$"),
    "displacement": re.compile(rf"{_LENGTH}$"),
    "time": re.compile(rf"(?:{_SECONDS}|MS|MSEC)$"),
    "frequency": re.compile(r"(?:HZ|RAD/S)$"),
    "counts": re.compile(r"(?:COUNTS?|CTS|DIGITS?|LSB|VOLTS?|V|MV)$"),
}
# Units without a slash, as in column names such as "acc_ms2" -> unit.
_COMPACT = {"MS2": "m/s2", "MPS2": "m/s2", "MSS": "m/s2", "CMS2": "cm/s2", "CMPS2": "cm/s2", "CMSS": "cm/s2"}
_COMPACT |= {"MMS2": "mm/s2", "INS2": "in/s2", "FTS2": "ft/s2"}
_BRACKETS = re.compile(r"[(\[{<]\s*([^()\[\]{}<>]+?)\s*[)\]}>]")

_NUMBER = r"(?P<value>[-+]?(?:\d+\.?\d*|\.\d+)(?:[ED][-+]?\d+)?)"
_BETWEEN = r"\s*(?:[(\[]\s*(?P<unit>[A-Z]+)\s*[)\]])?\s*(?:IS|OF|[:=])?\s*"
_STEPS = re.compile(
    r"(?<![A-Z])(?:DT|DELTA[ _-]?T|TIME[ _-]?(?:STEP|INTERVAL|INCREMENT)|"
    r"(?:SAMPLING|SAMPLE)[ _-]?(?:INTERVAL|PERIOD|STEP|TIME)(?:_S)?|(?:EQUALLY[- ]SPACED )?INTERVALS?)"
    rf"(?![A-Z]){_BETWEEN}{_NUMBER}\s*(?P<after>[A-Z]*)"
)
_RATES = re.compile(
    rf"(?:SAMPLING|SAMPLE)[ _-]?(?:RATE|FREQUENCY|FREQ)(?![A-Z])\.?{_BETWEEN}{_NUMBER}\s*(?P<after>[A-Z]*)"
)
_COUNTS = re.compile(
    r"(?<![A-Z])(?:NPTS|NPT|NDATA|(?:NUMBER|NO\.?|NUM) OF (?:DATA )?(?:POINTS|SAMPLES|DATA|VALUES))"
    r"\s*[:=]?\s*(?P<value>\d+)(?![.\d])"
)
_STATED_UNIT = re.compile(
    r"UNITS?\b\s*(?:OF|IS|ARE|IN|[:=])*\s*(?:SEC\w* AND |ACCELERATION\s*[:=]?\s*)?"
    r"(?P<unit>[^\s,;()\[\]]+(?: S\^?-2)?)"
)
# Words in header lines about other numbers than the samples; such lines are ignored.
_OF_OTHER_NUMBERS = re.compile(
    r"\b(?:PEAK|PGA|PGV|PGD|MAX\w*|MIN\w*|RMS|SENSITIVITY|SCALE|FACTOR|INITIAL|VS30|SHEAR|WAVE|FILTER\w*)\b"
)
_HISTORY = re.compile(
    r"^(?:DATA[ _]?TYPE|TYPE|QUANTITY|CONTENTS?)?\s*[:=]?\s*(?:CORRECTED |RELATIVE |ABSOLUTE |GROUND )*"
    r"(?P<quantity>\S+?)\s*(?:TIME|HISTOR|SERIES|RECORD|DATA|TRACE|IN\b|[(\[:]|$)"
)


@dataclass(frozen=True)
class Statement:
    """Quantity and unit of numbers, as stated by a column name or a header.

    Args:
        quantity: Quantity, such as "acceleration", "velocity" or "time"; "" if it is unknown.
        unit: The unit as written in the file; "" if it is unknown.
        factor: Factor from this unit to m/s2; None if it is not a unit of acceleration.
    """

    quantity: str = ""
    unit: str = ""
    factor: float | None = None


def statement_of_name(name: str) -> Statement:
    """Return the quantity and unit that a column name such as "acc(gal)" or "Velocity [m/s]" states."""
    text = _capitals(name)
    outside = _BRACKETS.sub(" ", text)
    words = [word for word in re.split(r"[\s_.,:;/-]+", outside) if word]
    quantity = next((q for q in _QUANTITIES if any(_QUANTITIES[q].match(word) for word in words)), "")
    in_brackets = [match[1] for match in _BRACKETS.finditer(text)]
    parts = [part for part in re.split(r"[\s_,]+|-(?![\d])", outside) if part]
    at_end = [" ".join(parts[-2:]), parts[-1]] if parts else []
    for unit in (*in_brackets, *at_end):
        if (factor := factor_of_unit(_COMPACT.get(unit, unit))) is not None:
            return Statement(quantity, unit, factor)
    for unit in (*in_brackets, *(at_end if len(parts) > 1 and quantity and "-" not in outside else [])):
        if other := next((q for q, pattern in _UNITS_OF_OTHERS.items() if pattern.match(unit)), ""):
            return Statement(quantity or other, unit)
    return Statement(quantity or ("time" if text in ("S", "SEC", "SECONDS", "MS") else ""))


def statement_of_header(lines: Sequence[str]) -> list[Statement]:
    """Return all quantities and units that the lines of a header state."""
    return [found for line in lines for found in _statements(_capitals(line).strip(" #%*!;\"'"))]


def _statements(line: str) -> Iterator[Statement]:
    if _OF_OTHER_NUMBERS.search(line):
        return
    words = re.split(r"[^\w\u3000-\u9fff]+", line)
    quantities = [q for q in ("acceleration", "velocity", "displacement") if any(map(_QUANTITIES[q].match, words))]
    if stated := _STATED_UNIT.search(line):
        unit = stated["unit"].rstrip(".")
        factor = factor_of_unit(unit)
        other = next((q for q, pattern in _UNITS_OF_OTHERS.items() if pattern.match(unit) and q != "time"), "")
        if factor is not None or other:
            yield Statement(quantities[0] if quantities else other or "acceleration", unit, factor)
            return
    in_words = re.search(r"\bIN (\S+)$", line)
    for unit in (line, *(match[1] for match in _BRACKETS.finditer(line)), *([in_words[1]] if in_words else [])):
        if (factor := factor_of_unit(unit)) is not None:
            yield Statement("acceleration", unit, factor)
            return
    if (
        (history := _HISTORY.match(line))
        and len(quantities) == 1
        and _QUANTITIES[quantities[0]].match(history["quantity"])
    ):
        yield Statement(quantities[0])


def stated_step(lines: Sequence[str]) -> tuple[float, str] | None:
    """Return the step [s] that a header states and the words that state it; None if the header states no step."""
    for line in lines:
        text = _capitals(line)
        for pattern, is_rate in ((_STEPS, False), (_RATES, True)):
            found = pattern.search(text)
            value = float(found["value"].replace("D", "E")) if found else 0.0
            if found and value > 0:
                is_milli = "MS" in (found["unit"], found["after"]) or (found["after"] or "").startswith("MSEC")
                step = 1.0 / value if is_rate else value * (1e-3 if is_milli else 1.0)
                return step, " ".join(found[0].split())
    return None


def stated_count(lines: Sequence[str]) -> int | None:
    """Return the number of samples that a header states; None if the header does not state it."""
    found = next(filter(None, (_COUNTS.search(_capitals(line)) for line in lines)), None)
    return int(found["value"]) if found else None


def check_statements(path: str | PathLike, name: str, lines: Sequence[str], unit: str, factor: float) -> None:
    """Raise a ValueError if the column name or the header states another quantity or unit than acceleration in `unit`.

    Args:
        path: The file.
        name: Name of the column that is read as acceleration; "" if it has no name.
        lines: The other lines of the header.
        unit: The unit as the user gave it.
        factor: Factor from this unit to m/s2.
    """
    of_name = statement_of_name(name)
    where = f"the name of the column, {name!r},"
    if of_name.factor is None and not of_name.quantity:
        of_header = statement_of_header(lines)
        # A header may describe several columns; it is sufficient if one of them agrees with the user's unit.
        if not of_header or any(
            each.quantity == "acceleration" and each.factor in (None, factor) for each in of_header
        ):
            return
        of_name, where = of_header[0], "the header"
    if of_name.quantity not in ("", "acceleration"):
        what = f"{of_name.quantity} in {of_name.unit}" if of_name.unit else of_name.quantity
        raise AmbiguousTextError(
            f"{path}: {where} says {what.lower()}, not acceleration: choose the column of the accelerations with "
            "acceleration_column=, or read the file that contains them"
        )
    if of_name.factor is not None and not math.isclose(of_name.factor, factor, rel_tol=1e-3):
        raise ValueError(
            f"{path}: {where} says {of_name.unit.lower()}, but unit={unit!r} is given, so all values would be "
            f"wrong by a factor of {factor / of_name.factor:.6g}: give unit={of_name.unit.lower()!r}, or correct the "
            "header if it is wrong"
        )


def check_stated_numbers(path: str | PathLike, lines: Sequence[str], step: float, count: int) -> None:
    """Raise a ValueError if a header states another step than `step` [s] or another number of samples than `count`."""
    stated = stated_step(lines)
    if stated is not None and abs(stated[0] - step) > TIME_TOLERANCE * step:
        raise ValueError(
            f"{path}: the header says {stated[1].lower()!r}, but the step is {step:g} s: give step={stated[0]:g}, or "
            "correct the header if it is wrong"
        )
    number = stated_count(lines)
    if number is not None and number != count:
        raise damaged(f"{path}: the header says {number} samples, but {count} follow")


def refuse_times(path: str | PathLike, column: int, values: np.ndarray) -> None:
    """Raise a ValueError if values that are read as accelerations increase evenly, like times or a counter."""
    steps = np.diff(values)
    mean = (values[-1] - values[0]) / max(1, values.size - 1)
    if values.size >= _FEWEST_TIMES and mean > 0 and np.all(np.abs(steps - mean) <= TIME_TOLERANCE * mean):
        raise AmbiguousTextError(
            f"{path}: column {column}, which is read as acceleration, increases evenly by {mean:g} from {values[0]:g} "
            f"to {values[-1]:g}, so it contains times or a counter: choose another column, such as "
            f"acceleration_column={column + 1}. If the acceleration is a ramp, give it to wd.records.from_array"
        )


def refuse_step_as_sample(
    path: str | PathLike, line: int, tokens: Sequence[str], values: np.ndarray, step: float
) -> None:
    """Raise a ValueError if the first number of a column is not a sample but the step or the number of samples.

    If the first number may be the step, but this is uncertain, a warning is given.

    Args:
        path: The file.
        line: Number of the line with the first number, from 1.
        tokens: The first two numbers as text.
        values: All numbers of the column.
        step: The step that the user gave [s].
    """
    remedy = f"give header_lines={line}; if it is a sample, header_lines={line - 1}"
    if math.isclose(values[0], step, rel_tol=1e-6):
        raise AmbiguousTextError(f"{path}:{line}: {tokens[0]!r} is the step, not a sample: {remedy}")
    if tokens[0].isdigit() and 0 < values.size - values[0] <= 3 and values.size > _FEWEST_TIMES:
        raise AmbiguousTextError(f"{path}:{line}: {tokens[0]!r} is the number of samples, not a sample: {remedy}")
    is_usual = any(math.isclose(values[0], usual, rel_tol=1e-6) for usual in _USUAL_STEPS)
    is_written_otherwise = len(tokens[0].partition(".")[2]) != len(tokens[1].partition(".")[2])
    if is_usual and (is_written_otherwise or abs(values[0]) > 20 * abs(values[1])):
        warn_caller(f"{path}:{line}: {tokens[0]!r} may be the step [s], although step={step:g} is given: {remedy}")


def _capitals(text: str) -> str:
    """Return a text in capital letters, without accents; superscripts become ordinary characters."""
    letters = unicodedata.normalize("NFKD", text.replace("\u0131", "i"))
    return "".join(letter for letter in letters if not unicodedata.combining(letter)).upper()
