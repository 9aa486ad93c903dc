"""Reader of SAC and MiniSEED files, with obspy."""

from __future__ import annotations

import io
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.obspy_streams import motions_of_stream
from warpdyn.model.ground_motions.records.parsing.content import is_sac
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged


def read_seismic(path: str | PathLike, data: bytes, unit: str | None, step: float | None) -> list[GroundMotion]:
    """Return the motions in a SAC or MiniSEED file, which obspy reads.

    Args:
        path: The file.
        data: The bytes of the file.
        unit: Unit of the accelerations, which these files do not state.
        step: Step [s], which must equal the step in the file; None: the step in the file.

    Raises:
        ModuleNotFoundError: If obspy is not installed.
        ValueError: If the unit is missing, obspy refuses the file, or it has gaps, other quantities or extrema that
            differ from its header.
    """
    name = "SAC" if is_sac(data) else "MiniSEED"
    try:
        import obspy
    except ImportError as error:
        raise ModuleNotFoundError(f"{path}: this is a {name} file, which obspy reads: pip install obspy") from error
    if unit is None:
        raise ValueError(
            f"{path}: a {name} file does not state the unit of its values: give unit=, such as 'm/s2' or 'nm/s2'. If "
            "the values are counts, remove the response of the instrument first (obspy's remove_response)"
        )
    try:
        stream = obspy.read(io.BytesIO(data), format="SAC" if name == "SAC" else "MSEED")
    except Exception as error:  # obspy's readers raise errors of many classes
        raise ValueError(
            f"{path}: obspy cannot read this {name} file: {error}. Download the file again, or export it in another "
            "format"
        ) from error
    names = [trace.id for trace in stream]
    for trace in stream:
        if names.count(trace.id) > 1:
            raise ValueError(
                f"{path}: the channel {trace.id} has gaps: it has {names.count(trace.id)} parts. Fill them with "
                "obspy's merge, and use wd.records.from_obspy"
            )
        if name == "SAC":
            _check_sac(path, trace)
    motions = motions_of_stream(stream, unit, str(path))
    for motion in motions:
        if step is not None and abs(motion.step - step) > 1e-3 * step:
            raise ValueError(
                f"{path}: step is {step:g} s, but this {name} file states {motion.step:g} s: leave out step="
            )
    if len(motions) == 1:
        return [replace(motions[0], name=Path(path).stem, source=str(path))]
    return [replace(motion, source=str(path)) for motion in motions]


def _check_sac(path: str | PathLike, trace: Any) -> None:
    """Raise a ValueError if a SAC file has uneven times, or its largest or smallest value differs from the header."""
    header = trace.stats.sac
    if not int(header.get("leven", 1)):
        raise ValueError(
            f"{path}: this SAC file has uneven times (LEVEN in its header): interpolate it to "
            f"equal steps first, and give the values to wd.records.from_array"
        )
    for stated, found in ((header.get("depmin"), trace.data.min()), (header.get("depmax"), trace.data.max())):
        # Extreme values in header and data are float32 numbers; SAC writes -12345 for an unknown number.
        if stated is not None and stated != -12345 and np.isfinite(stated) and abs(stated - found) > 1e-5 * abs(stated):
            raise damaged(
                f"{path}: the header of this SAC file states an extremum of {stated:g}, but the values have {found:g}"
            )
