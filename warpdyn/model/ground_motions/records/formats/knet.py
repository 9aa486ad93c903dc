"""Reader of the ASCII files of K-NET and KiK-net."""

from __future__ import annotations

import re
from dataclasses import replace
from os import PathLike

from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.file_names import record_and_component
from warpdyn.model.ground_motions.records.components.orientations import orientation
from warpdyn.model.ground_motions.records.parsing.fixed_width import (
    Header,
    RecordText,
    block,
    check_end,
    layout_of_lines,
)
from warpdyn.model.ground_motions.records.parsing.header_checks import check_duration, check_printed_peak, stated_step
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.text import number

_HEADER_LINES = 17
_WIDTH_OF_NAMES, _WIDTH_OF_VALUES = 18, 9  # characters
# KiK-net numbers components: 1 to 3 in the borehole, 4 to 6 at the surface.
_DIRECTIONS = {"1": "NS1", "2": "EW1", "3": "UD1", "4": "NS2", "5": "EW2", "6": "UD2"}


def read_knet(path: str | PathLike) -> list[GroundMotion]:
    """Return the record of K-NET or KiK-net: 17 header lines, then whole numbers, which a factor converts to gal.

    The mean of the values is removed: it is the offset of the instrument, which the peak in the header excludes.

    Source: NIED, "Format of the strong-motion data (ASCII)".
    """
    record = RecordText.of(path)
    header = Header(path, "K-NET")
    for i, line in enumerate(record.lines[:_HEADER_LINES]):
        header[line[:_WIDTH_OF_NAMES].strip()] = line[_WIDTH_OF_NAMES:].strip(), record.place(i)
    stated, place = header["Scale Factor"]
    scale = re.fullmatch(r"(\d+\.?\d*)\s*\(gal\)\s*/\s*(\d+\.?\d*)", stated)
    if scale is None or float(scale[2]) == 0 or float(scale[1]) == 0:
        raise damaged(f"{place}: expected a scale factor such as 3920(gal)/6182761, got {stated!r}")
    factor = float(scale[1]) / float(scale[2])
    rate, place = header["Sampling Freq(Hz)"]
    step = stated_step(re.sub(r"\s*Hz$", "", rate, flags=re.IGNORECASE), place, is_rate=True)

    # NIED prints a blank after 8 characters; a blank before the line makes all fields 9 characters wide.
    body = [f" {line}" if line.strip() else "" for line in record.lines[_HEADER_LINES:]]
    if len(record.line(_HEADER_LINES, "its values").rstrip()) % _WIDTH_OF_VALUES == 0:
        body = record.lines[_HEADER_LINES:]
    record = replace(record, lines=[*record.lines[:_HEADER_LINES], *body])
    layout = layout_of_lines(record, _HEADER_LINES, decimals=0)
    last = record.lines[-1].rstrip()
    count = (len(record.lines) - _HEADER_LINES - 1) * layout.per_line + -(-len(last) // layout.width)
    duration, place = header["Duration Time(s)"]
    expected = round(number(duration, place) / step)
    if count != expected:
        problem = "truncated" if count < expected else "too long"
        raise damaged(f"{place}: {problem}: {count} values follow, but {duration} s at {rate} are {expected} values")
    counts, after = block(record, _HEADER_LINES, count, layout)
    check_duration(count, step, duration, place)
    check_end(record, after)
    gal = factor * (counts - counts.mean())
    check_printed_peak(gal, *header["Max. Acc. (gal)"], precision=factor)

    stated, place = header["Dir."]
    component = _DIRECTIONS.get(stated) or orientation(stated.replace("-", "")).label
    if not orientation(component).known_label:
        raise damaged(f"{place}: the direction must be N-S, E-W, U-D or a number from 1 to 6, got {stated!r}")
    _, component = record_and_component(str(path), component, place=str(path))
    name = f"{header['Station Code'][0]} {header['Record Time'][0]}"
    return [record.motion(0.01 * gal, step, component, name)]
