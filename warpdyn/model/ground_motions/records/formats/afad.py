"""Reader of the text files of AFAD, Turkey, with three components."""

from __future__ import annotations

import re
from os import PathLike

from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components import orientation
from warpdyn.model.ground_motions.records.parsing.fixed_width import RecordText
from warpdyn.model.ground_motions.records.parsing.header_checks import (
    check_missing_values,
    check_printed_peak,
    stated_count,
    stated_step,
)
from warpdyn.model.ground_motions.records.text import NumberLines, check_forms, check_last_value
from warpdyn.model.ground_motions.records.units import unit_factor

_TITLE = re.compile(r"\s*strong\s+ground\s+motion\s+records?\s+of\s+t\S*r\S*", re.IGNORECASE)
_DIRECTIONS = re.compile(r"\s*([NSEWUDZ]-?[NSEWUDZ]?)\s+([NSEWUDZ]-?[NSEWUDZ]?)\s+([NSEWUDZ]-?[NSEWUDZ]?)\s*")
_PEAK = re.compile(r"\(([^)]+)\)\s*([-+]?\d*\.?\d+)")


def is_afad(first_lines: list[str]) -> bool:
    """Return whether a file begins as AFAD's files do."""
    return bool(_TITLE.match(first_lines[0]))


def read_afad(path: str | PathLike) -> list[GroundMotion]:
    """Read the three components of a text file of AFAD: a header of "NAME : value", then a column per component.

    Source: AFAD, Turkish National Strong Motion Network, text files of the database TR-NSMN.

    Args:
        path: The file; its name and the components name the motions.

    Raises:
        ValueError: If the header lacks a line, the unit is not that of an acceleration, the number or the peaks of the
            values are not those of the header, a value is not a finite number or is written in another form than the
            others, or the file is cut.
    """
    record = RecordText.of(path)
    directions = next((i for i, line in enumerate(record.lines) if _DIRECTIONS.fullmatch(line)), None)
    if directions is None:
        raise ValueError(f"{path}: this AFAD file has no line with the components, such as 'N-S  E-W  U-D'")
    header: dict[str, tuple[str, str]] = {}
    for i, line in enumerate(record.lines[:directions]):
        name, colon, value = line.partition(":")
        if colon:
            header[name.strip().upper()] = value.strip(), record.place(i)
    peaks = next(((name, value) for name, value in header.items() if "PGA" in name), None)
    for name in ("NUMBER OF DATA", "SAMPLING INTERVAL (SEC)", "STATION ID", "RECORD TIME"):
        if name not in header:
            raise ValueError(f"{path}: the header of this AFAD file lacks the line {name!r}")
    if peaks is None:
        raise ValueError(
            f"{path}: the header of this AFAD file lacks the line 'RAW PGA VALUES (gal)', which names the unit"
        )
    if "(GAL)" not in peaks[0]:
        raise ValueError(f"{peaks[1][1]}: expected 'RAW PGA VALUES (gal)', which names the unit, got {peaks[0]!r}")
    factor = unit_factor("gal", peaks[1][1])
    count = stated_count(*header["NUMBER OF DATA"])
    step = stated_step(*header["SAMPLING INTERVAL (SEC)"])

    lines = record.lines[directions + 1 :]
    numbers = NumberLines(path, lines, range(directions + 2, len(record.lines) + 1))
    widths = numbers.widths() if lines else {3: 0}
    if set(widths) != {3}:
        other, i = next((width, i) for width, i in widths.items() if width != 3)
        raise ValueError(f"{numbers.place(i)}: expected 3 values, one per component, got {other}")
    if len(lines) != count:
        kind, place = "truncated" if len(lines) < count else "too long", header["NUMBER OF DATA"][1]
        raise ValueError(
            f"{place}: {kind}: {len(lines)} lines of values follow, not the {count} that the header states"
        )
    table = numbers.values(range(3))
    check_last_value(record.text, [token for i in range(count) for token in numbers.tokens(i)], path)
    check_forms(numbers)
    stated = {orientation(name).label: peak for name, peak in _PEAK.findall(peaks[1][0])}
    name = f"{header['STATION ID'][0]} {header['RECORD TIME'][0]}"
    motions = []
    for i, token in enumerate(record.lines[directions].split()):
        component = orientation(token.replace("-", "")).label
        check_missing_values(table[i], numbers.place)
        peak = stated.get(component) or stated.get(orientation(token).label)
        if peak is None:
            raise ValueError(f"{peaks[1][1]}: expected the peak of the component {token}, got {peaks[1][0]!r}")
        check_printed_peak(table[i], peak, peaks[1][1], precision=1e-6)
        motions.append(GroundMotion(factor * table[i], step, f"{record.stem} {component}", str(path), name, component))
    return motions
