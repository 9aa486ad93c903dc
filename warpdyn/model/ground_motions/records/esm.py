"""Reader of the ASCII files of the Engineering Strong Motion database (ESM)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.parsing.fixed_width import RecordText
from warpdyn.model.ground_motions.records.parsing.header_checks import (
    check_count,
    check_printed_peak,
    checked_values,
)
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.text import number
from warpdyn.model.ground_motions.records.units import checked_step, unit_factor

_HEADER_LINES = 64
_PEAK_TOLERANCE = 1e-3  # times the peak in the header: largest difference from the peak of the values


def read_esm(path: str | Path) -> GroundMotion:
    """Read a record in the ASCII format of ESM (and of ITACA): 64 lines of "NAME: value", then one value per line.

    Source: Luzi et al., "Engineering Strong-Motion database: user manual", header format DYNA 1.2.

    Args:
        path: The file; its name without the suffix names the motion.

    Returns:
        The motion [m/s2], with the network, station and event as its `record` and the stream as its `component`.

    Raises:
        FileNotFoundError, IsADirectoryError: If there is no such file, or it is a directory.
        ValueError: If the header lacks a line or describes another quantity than acceleration; if a value is not a
            finite number or has another form than the other values; if the number of values or the peak differs from
            the header; or if the last value is incomplete.
        TypeError: If `path` is not the name of a file.

    Example:
        >>> wd.records.read_esm("XX.STA1..HNN.ASC").component
        'HNN'
    """
    record = RecordText.of(path)
    if len(record.lines) <= _HEADER_LINES:
        raise damaged(
            f"{path}: an ESM file has {_HEADER_LINES} header lines, this file ends at line {len(record.lines)}"
        )
    for i, line in enumerate(record.lines[:_HEADER_LINES]):
        if ":" not in line:
            raise damaged(f"{record.place(i)}: expected 'NAME: value', got {line.strip()!r}")
    header = record.header("ESM", _HEADER_LINES)
    kind, place = header["DATA_TYPE"]
    if kind.upper() != "ACCELERATION":
        raise ValueError(
            f"{place}: DATA_TYPE must be ACCELERATION, got {kind!r}: take the acceleration file of the same record "
            "('.ACC.')"
        )
    factor = unit_factor(*header["UNITS"])
    stated, place = header["SAMPLING_INTERVAL_S"]
    step = checked_step(number(stated, place), f"{place}: the step")
    numbers = record.numbers(_HEADER_LINES)
    check_count(sum(len(numbers.tokens(i)) for i in range(len(numbers))), *header["NDATA"])
    values = checked_values(numbers, record.text)
    if numbers.has_line(lambda line: line.lstrip(" -").startswith(".")):
        i = next(i for i, line in enumerate(numbers.lines) if line.lstrip(" -").startswith("."))
        raise damaged(
            f"{numbers.place(i)}: {numbers.lines[i].strip()!r} has no digit before its point, which ESM always prints: "
            "a digit is lost"
        )
    peak, place = header.get("PGA_CM/S^2", ("", ""))
    if peak:
        check_printed_peak(100.0 * factor * values, peak, place, _PEAK_TOLERANCE * abs(number(peak, place)))
    names = [header.get(name, ("", ""))[0] for name in ("NETWORK", "STATION_CODE", "EVENT_ID")]
    stream = header.get("STREAM", ("", ""))[0].upper()
    return replace(record.motion(factor * values, step, stream, " ".join(filter(None, names))), name=record.stem)
