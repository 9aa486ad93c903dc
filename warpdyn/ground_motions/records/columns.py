"""Reader of text files with columns of numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from warpdyn.ground_motions.motions import GroundMotion
from warpdyn.ground_motions.records.text import lines_of, number, text_of
from warpdyn.ground_motions.records.units import checked_step, step_of_times, unit_factor


def read_text(path: str | Path, *, unit: str, step: float | None = None) -> GroundMotion:
    """Read a record from one column (acceleration) or two (time [s], acceleration), split by commas or white space.

    Blank lines and lines that start with # or % are skipped. The first sample acts at t = 0, whatever its time.

    Args:
        path: The file; its name without the suffix names the motion.
        unit: Unit of the acceleration, one of `UNITS`.
        step: Sampling step [s]. It is needed for one column; the times of two columns are checked against it.

    Returns:
        The motion [m/s2].

    Raises:
        FileNotFoundError, IsADirectoryError: If there is no such file, or it is a directory.
        ValueError: If the unit is unknown, the file is empty, a value is not a finite number, the columns are not one
            or two, there are fewer than two samples, or the step is missing, not positive or not that of the times.
    """
    factor = unit_factor(unit, "unit")
    if step is not None:
        step = checked_step(step, "step")
    rows: list[list[float]] = []
    for i, line in enumerate(lines_of(text_of(path)), start=1):
        text = line.strip()
        if not text or text[0] in "#%":
            continue
        tokens = text.split(",") if "," in text else text.split()
        rows.append([number(token.strip(), f"{path}:{i}") for token in tokens])
        if len(tokens) > 2 or len(tokens) != len(rows[0]):
            raise ValueError(
                f"{path}:{i}: {len(tokens)} columns; all lines must have 1 (acceleration) or 2 (time first)"
            )
    if len(rows) < 2:
        raise ValueError(f"{path}: a record needs at least 2 samples, found {len(rows)}")
    columns = np.array(rows).T
    if len(columns) == 2:
        step = step_of_times(columns[0], step, str(path))
    elif step is None:
        raise ValueError(f"{path}: one column has no times, so step [s] must be given")
    return GroundMotion(factor * columns[-1], step, Path(path).stem, str(path))
