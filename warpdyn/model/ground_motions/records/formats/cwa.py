"""Reader of the text files of the Central Weather Administration (CWA), Taiwan."""

from __future__ import annotations

import re
from os import PathLike

import numpy as np

from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.parsing.fixed_width import Layout, RecordText, block
from warpdyn.model.ground_motions.records.parsing.header_checks import check_duration, check_printed_peak, stated_step
from warpdyn.model.ground_motions.records.units import step_of_times, unit_factor

_NEEDED = ("StationCode", "StartTime(GMT+08)", "RecordLength(sec)", "SampleRate(Hz)", "AmplitudeUnit", "Data")


def is_cwa(first_lines: list[str]) -> bool:
    """Return whether a file begins as those of CWA do."""
    return first_lines[0].startswith("#Earthquake Information")


def read_cwa(path: str | PathLike) -> list[GroundMotion]:
    """Read the three components of a file of CWA: lines of "#NAME: value", then columns of times and accelerations.

    Source: CWA, Geophysical Database Management System, text format of strong-motion records.

    Args:
        path: The file; its name and the components name the motions.

    Raises:
        ValueError: If the header lacks a line, the unit is not that of an acceleration, the times, the duration or the
            peaks are not those of the header, or a line does not have four numbers.
    """
    record = RecordText.of(path)
    is_header = [not line.strip() or line.startswith("#") for line in record.lines]
    first = is_header.index(False) if False in is_header else len(record.lines)
    header = {}
    for i, line in enumerate(record.lines[:first]):
        name, _, value = line.lstrip("#").partition(":")
        header[name.strip()] = value.strip(), record.place(i)
    for name in _NEEDED:
        if name not in header:
            raise ValueError(f"{path}: the header of this CWA file lacks the line '#{name}'")
    unit, place = header["AmplitudeUnit"]
    factor = unit_factor(unit.split(".")[0], place)
    step = stated_step(*header["SampleRate(Hz)"], is_rate=True)
    layout = Layout.of(header["Data"][0])
    if layout is None or layout.per_line != 4:
        raise ValueError(f"{header['Data'][1]}: expected four columns, such as 4F10.3, got {header['Data'][0]!r}")

    count = len(record.lines) - first
    if count < 2:
        raise ValueError(f"{path}: truncated: the file ends at line {len(record.lines)}, before its values")
    table = block(record, first, 4 * count, layout)[0].reshape(count, 4)
    step_of_times(table[:, 0], step, str(path))
    check_duration(count, step, *header["RecordLength(sec)"])
    motions = []
    for i, component in enumerate("UNE", start=1):
        largest, place = header.get(f"AmplitudeMAX. {component}", ("", str(path)))
        if peaks := re.findall(r"-?\d+\.\d+", largest):
            check_printed_peak(table[:, i], max(peaks, key=lambda peak: abs(float(peak))), place, precision=1e-3)
        name = f"{header['StationCode'][0]} {header['StartTime(GMT+08)'][0]}"
        values = factor * np.array(table[:, i])
        motions.append(GroundMotion(values, step, f"{record.stem} {component}", str(path), name, component))
    return motions
