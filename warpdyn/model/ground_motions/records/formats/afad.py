"""Reader of the text files of AFAD, Turkey, with three components."""

from __future__ import annotations

import re
from os import PathLike

from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.orientations import orientation
from warpdyn.model.ground_motions.records.parsing.fixed_width import RecordText
from warpdyn.model.ground_motions.records.parsing.header_checks import (
    check_count,
    check_printed_peak,
    checked_values,
    stated_step,
)
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.units import unit_factor

_TITLE = re.compile(r"\s*strong\s+ground\s+motion\s+records?\s+of\s+t\S*r\S*", re.IGNORECASE)
_DIRECTIONS = re.compile(r"\s*([NSEWUDZ]-?[NSEWUDZ]?)\s+([NSEWUDZ]-?[NSEWUDZ]?)\s+([NSEWUDZ]-?[NSEWUDZ]?)\s*")
_PEAK = re.compile(r"\(([^)]+)\)\s*([-+]?\d*\.?\d+)")


def is_afad(first_lines: list[str]) -> bool:
    """Return whether a file is a text file of AFAD, judging by its first lines."""
    return bool(_TITLE.match(first_lines[0]))


def read_afad(path: str | PathLike) -> list[GroundMotion]:
    """Return the three components in a text file of AFAD: a header of "NAME : value", then one column per component.

    Source: AFAD, Turkish National Strong Motion Network, text files of the database TR-NSMN.
    """
    record = RecordText.of(path)
    directions = next((i for i, line in enumerate(record.lines) if _DIRECTIONS.fullmatch(line)), None)
    if directions is None:
        raise damaged(f"{path}: this AFAD file has no line with the components, such as 'N-S  E-W  U-D'")
    header = record.header("AFAD", directions)
    name_of_peaks = next((name for name in header if "PGA" in name), "RAW PGA VALUES (gal)")
    peaks, place = header[name_of_peaks]
    if "(GAL)" not in name_of_peaks:
        raise damaged(f"{place}: expected 'RAW PGA VALUES (gal)', which names the unit, got {name_of_peaks!r}")
    step = stated_step(*header["SAMPLING INTERVAL (SEC)"])

    numbers = record.numbers(directions + 1)
    for width, i in numbers.widths().items():
        if width != 3:
            raise damaged(f"{numbers.place(i)}: expected 3 values, one per component, got {width}")
    check_count(len(numbers), *header["NUMBER OF DATA"])
    table = checked_values(numbers, record.text, range(3))
    stated = {_label(name): peak for name, peak in _PEAK.findall(peaks)}
    earthquake = f"{header['STATION ID'][0]} {header['RECORD TIME'][0]}"
    motions = []
    for values, token in zip(table, record.lines[directions].split(), strict=True):
        component = _label(token)
        peak = stated.get(component)
        if peak is None:
            raise damaged(f"{place}: expected the peak of the component {token}, got {peaks!r}")
        check_printed_peak(values, peak, place, precision=1e-6)
        motions.append(record.motion(unit_factor("gal", place) * values, step, component, earthquake))
    return motions


def _label(name: str) -> str:
    """Return the label of a component without hyphens, such as "NS" for "N-S"."""
    return orientation(name.replace("-", "")).label
