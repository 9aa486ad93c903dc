"""Reader of the ASCII files of the Engineering Strong Motion database (ESM)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.parsing.header_checks import check_missing_values
from warpdyn.model.ground_motions.records.text import (
    NumberLines,
    check_count,
    check_forms,
    check_last_value,
    check_peak,
    lines_of,
    number,
    text_of,
)
from warpdyn.model.ground_motions.records.units import checked_step, unit_factor

_HEADER_LINES = 64
_NEEDED = ("SAMPLING_INTERVAL_S", "NDATA", "UNITS", "DATA_TYPE")


def read_esm(path: str | Path) -> GroundMotion:
    """Read a record in the ASCII format of ESM (and of ITACA): 64 lines of "NAME: value", then a value a line.

    Source: Luzi et al., "Engineering Strong-Motion database: user manual", header format DYNA 1.2.

    Args:
        path: The file; its name without the suffix names the motion.

    Returns:
        The motion [m/s2], with the network, station and event as its `record` and the stream as its `component`.

    Raises:
        FileNotFoundError, IsADirectoryError: If there is no such file, or it is a directory.
        ValueError: If the header lacks a line or tells no acceleration, a value is not a finite number or is written in
            another form than the others, their number is not that of the header, the largest is not the header's peak,
            or the last one is cut.
        TypeError: If `path` names no file.

    Example:
        >>> wd.records.read_esm("XX.STA1..HNN.ASC").component
        'HNN'
    """
    text = text_of(path)
    lines = lines_of(text)
    if len(lines) <= _HEADER_LINES:
        raise ValueError(f"{path}: an ESM file has {_HEADER_LINES} header lines, this file ends at line {len(lines)}")
    header: dict[str, tuple[str, str]] = {}
    for i, line in enumerate(lines[:_HEADER_LINES], start=1):
        name, colon, value = line.partition(":")
        if not colon:
            raise ValueError(f"{path}:{i}: expected 'NAME: value', got {line.strip()!r}")
        header[name.strip().upper()] = value.strip(), f"{path}:{i}"
    missing = [name for name in _NEEDED if name not in header]
    if missing:
        raise ValueError(f"{path}: the header has no {', '.join(missing)}")
    kind, place = header["DATA_TYPE"]
    if kind.upper() != "ACCELERATION":
        raise ValueError(
            f"{place}: DATA_TYPE must be ACCELERATION, got {kind!r}: take the acceleration file of the same record "
            "('.ACC.')"
        )
    factor = unit_factor(*header["UNITS"])
    step = checked_step(number(*header["SAMPLING_INTERVAL_S"]), f"{header['SAMPLING_INTERVAL_S'][1]}: the step")

    rows = [(line, i) for i, line in enumerate(lines[_HEADER_LINES:], start=_HEADER_LINES + 1) if line.strip()]
    numbers = NumberLines(path, [line for line, _ in rows], [i for _, i in rows])
    values = numbers.values()
    check_count(len(values), *header["NDATA"])
    check_last_value(text, [token for i in range(len(numbers)) for token in numbers.tokens(i)], path)
    check_forms(numbers)
    if numbers.has_line(lambda line: line.lstrip(" -").startswith(".")):
        i = next(i for i, line in enumerate(numbers.lines) if line.lstrip(" -").startswith("."))
        raise ValueError(
            f"{numbers.place(i)}: {numbers.lines[i].strip()!r} has no digit before its point, which ESM always prints: "
            "a digit is lost"
        )
    check_missing_values(values, numbers.place)
    peak, place = header.get("PGA_CM/S^2", ("", ""))
    if peak:
        check_peak(100.0 * factor * values, number(peak, place), place)
    told = [header.get(name, ("", ""))[0] for name in ("NETWORK", "STATION_CODE", "EVENT_ID", "STREAM")]
    record = " ".join(filter(None, told[:3]))
    return GroundMotion(factor * np.asarray(values), step, Path(path).stem, str(path), record, told[3].upper())
