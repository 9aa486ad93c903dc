"""Reader of the text files of the Central Weather Administration (CWA), Taiwan."""

from __future__ import annotations

import re
from os import PathLike

from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.parsing.fixed_width import Layout, RecordText, block
from warpdyn.model.ground_motions.records.parsing.header_checks import check_duration, check_printed_peak, stated_step
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.units import step_of_times, unit_factor


def is_cwa(first_lines: list[str]) -> bool:
    """Return whether a file is a text file of CWA, judging by its first line."""
    return first_lines[0].startswith("#Earthquake Information")


def read_cwa(path: str | PathLike) -> list[GroundMotion]:
    """Return the three components in a file of CWA: lines of "#NAME: value", then columns of times and accelerations.

    Source: CWA, Geophysical Database Management System, text format of strong-motion records.
    """
    record = RecordText.of(path)
    is_header = [not line.strip() or line.startswith("#") for line in record.lines]
    first = is_header.index(False) if False in is_header else len(record.lines)
    header = record.header("CWA", first, str)
    unit, place = header["#AmplitudeUnit"]
    factor = unit_factor(unit.split(".")[0], place)
    step = stated_step(*header["#SampleRate(Hz)"], is_rate=True)
    columns, place = header["#Data"]
    layout = Layout.of(columns)
    if layout is None or layout.per_line != 4:
        raise damaged(f"{place}: expected four columns, such as 4F10.3, got {columns!r}")

    count = len(record.lines) - first
    if count < 2:
        raise damaged(f"{path}: truncated: the file ends at line {len(record.lines)}, before its values")
    times, *components = block(record, first, 4 * count, layout)[0].reshape(count, 4).T
    step_of_times(times, step, str(path))
    check_duration(count, step, *header["#RecordLength(sec)"])
    name = f"{header['#StationCode'][0]} {header['#StartTime(GMT+08)'][0]}"
    motions = []
    for component, values in zip("UNE", components, strict=True):
        largest, place = header.get(f"#AmplitudeMAX. {component}", ("", str(path)))
        if peaks := re.findall(r"-?\d+\.\d+", largest):
            check_printed_peak(values, max(peaks, key=lambda peak: abs(float(peak))), place, precision=1e-3)
        motions.append(record.motion(factor * values, step, component, name))
    return motions
