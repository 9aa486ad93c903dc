"""Reader of PEER .AT2 files."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from warpdyn.ground_motions.motions import GroundMotion
from warpdyn.ground_motions.records.text import check_last_value, lines_of, number, text_of
from warpdyn.ground_motions.records.units import ALLOWED_UNITS, checked_step, unit_factor

_AT2_UNITS = re.compile(r"UNITS\s+OF\s+(\S+)", re.IGNORECASE)
_AT2_SIZES = (
    re.compile(r"NPTS\s*=\s*(?P<count>[^\s,]+)\s*,?\s*DT\s*=\s*(?P<step>[^\s,]+)", re.IGNORECASE),
    re.compile(r"^\s*(?P<count>[^\s,]+)[\s,]+(?P<step>[^\s,]+)\s+NPTS\s*,\s*DT", re.IGNORECASE),
)


def read_at2(path: str | Path) -> GroundMotion:
    """Read a record in the PEER .AT2 format, with either style of header.

    The third of the four header lines names the unit ("... IN UNITS OF G"), the fourth the number of values and the
    step ("NPTS= 1000, DT= .0200 SEC", or "4096 0.0100 NPTS, DT" in older files). The values follow, any number a line.

    Args:
        path: The file; its name without the suffix names the motion.

    Returns:
        The motion [m/s2].

    Raises:
        FileNotFoundError, IsADirectoryError: If there is no such file, or it is a directory.
        ValueError: If the file is empty, the header does not name a known unit, a number of values and a step, a value
            is not a finite number, there are fewer or more values than the header says, or the last one is cut. If no
            newline ends the file and its values have no common format, a warning says that this cannot be decided.
    """
    text = text_of(path)
    lines = lines_of(text)
    if len(lines) < 4:
        raise ValueError(f"{path}: an AT2 file has 4 header lines, this file ends at line {len(lines)}")
    unit = _AT2_UNITS.search(lines[2])
    if not unit:
        raise ValueError(f"{path}:3: expected 'UNITS OF' and one of {ALLOWED_UNITS}, got {lines[2].strip()!r}")
    factor = unit_factor(unit[1].rstrip(".,;:"), f"{path}:3")
    sizes = next(filter(None, (style.search(lines[3]) for style in _AT2_SIZES)), None)
    if not sizes:
        raise ValueError(f"{path}:4: expected 'NPTS= 9, DT= .02 SEC' or '9 .02 NPTS, DT', got {lines[3].strip()!r}")
    if not re.fullmatch(r"[+-]?\d+", sizes["count"]) or int(sizes["count"]) < 2:
        raise ValueError(f"{path}:4: NPTS must be a whole number of at least 2, got {sizes['count']!r}")
    count = int(sizes["count"])
    step = checked_step(number(sizes["step"], f"{path}:4"), f"{path}:4: DT")

    tokens = [(token, i) for i, line in enumerate(lines[4:], start=5) for token in line.split()]
    values = [number(token, f"{path}:{i}") for token, i in tokens]
    if len(values) < count:
        raise ValueError(f"{path}: truncated: holds {len(values)} of the {count} values that its header announces")
    if len(values) > count:
        raise ValueError(f"{path}: holds {len(values)} values, more than the {count} that its header announces")
    check_last_value(text, [token for token, _ in tokens], path)
    return GroundMotion(factor * np.array(values), step, Path(path).stem, str(path))
