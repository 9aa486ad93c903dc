"""Motions of obspy's streams, which obspy reads from K-NET, KiK-net, MiniSEED, SAC and more."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from warpdyn.ground_motions.motions import GroundMotion
from warpdyn.ground_motions.records.units import checked_step, unit_factor


def from_obspy(stream: Iterable[Any], unit: str | None = None) -> list[GroundMotion]:
    """Return the motions of an obspy stream, one a trace, vertical ones among them.

    A trace's values are its data times its calibration. Nothing is corrected: K-NET's values have an offset, which
    `detrend` removes.

    Args:
        stream: The stream, such as `obspy.read("AKT0131103111446.EW")`, with pip install "obspy>=1.4".
        unit: Unit of the values, one of `UNITS`; it may be left out for K-NET and KiK-net, which obspy reads in m/s2.

    Returns:
        The motions [m/s2], named by the traces, with the station and start as `record` and the channel as `component`.

    Raises:
        TypeError: If this is no stream.
        ValueError: If there is no trace, the unit is unknown or missing, a trace has gaps, or a value is not finite.

    Example:
        >>> import obspy
        >>> stream = obspy.Stream([obspy.Trace(100 * noise[0], {"station": "STA1", "channel": "HNN", "delta": 0.02})])
        >>> [motion.component for motion in wd.records.from_obspy(stream, unit="gal")]
        ['HNN']
    """
    motions = []
    for trace in stream:
        if not hasattr(trace, "stats") or not hasattr(trace, "data"):
            raise TypeError(f"from_obspy() takes an obspy Stream, got one of {type(trace).__name__}")
        stats = trace.stats
        if unit is None and "knet" not in stats:
            raise ValueError(f"trace {trace.id}: unit must be given: a trace does not tell it")
        if np.ma.is_masked(trace.data):
            raise ValueError(f"trace {trace.id} has gaps: fill them, or split the stream")
        factor = unit_factor(unit, f"trace {trace.id}") if unit is not None else 1.0
        values = factor * float(stats.calib) * np.asarray(trace.data, dtype=np.float64)
        record = f"{stats.network}.{stats.station}.{stats.location} {stats.starttime}"
        step = checked_step(float(stats.delta), f"trace {trace.id}: step")
        motions.append(GroundMotion(values, step, trace.id, "obspy", record, stats.channel.upper()))
    if not motions:
        raise ValueError("the stream has no traces")
    return motions
