"""Packets from records and obspy streams."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from warpdyn.campaigns.live.packets.packet import Packet
from warpdyn.campaigns.live.packets.refused import RefusedPacket
from warpdyn.foundations.core.checks import check_kind, whole_number
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.pairs_of_motions import PairOfMotions


def from_motion(motion: GroundMotion | PairOfMotions, samples: int, start: float = 0.0) -> Iterator[Packet]:
    """Yield the packets of a known motion, such as a record that is played back.

    Args:
        motion: The motion.
        samples: Number of samples in a packet; the last packet may have fewer.
        start: Time stamp of the first sample [s].

    Raises:
        ValueError: If `samples` is below 1.
        TypeError: If `motion` is not a GroundMotion or PairOfMotions.

    Example:
        >>> packets = list(wd.packets.from_motion(motions[0], samples=50))
        >>> len(packets), packets[1].start
        (10, 1.0)
    """
    check_kind("from_motion", "a GroundMotion or PairOfMotions", motion, GroundMotion | PairOfMotions)  # type: ignore[arg-type]
    whole_number("samples", samples, 1)
    values = motion.values
    return (
        Packet(values[first : first + samples], start + first * motion.step, motion.step)
        for first in range(0, len(values), samples)
    )


def from_obspy(
    stream: Iterable[Any], components: Sequence[str] = ("",), sensitivity: float | Mapping[str, float] | None = None
) -> Iterator[Packet]:
    """Yield the packets in an obspy stream, in the order of their arrival: one packet for each trace.

    Args:
        stream: The traces, such as `obspy.read(path)`, in the order in which they arrived.
        components: End of the channel name of each component of the scene's motion, such as ("E", "N"); ("",): the
            motion has one component, and all traces belong to it.
        sensitivity: Counts of the digitizer per unit of acceleration, one number or one for each trace id
            ("NET.STA.LOC.CHA"); None: the data are accelerations.

    Raises:
        RefusedPacket: If a trace contains counts and `sensitivity` is missing, or belongs to no component.
        TypeError: If `stream` is not a stream.

    Example:
        >>> import obspy
        >>> trace = obspy.Trace(noise[0], {"station": "STA1", "channel": "HNE", "delta": 0.02})
        >>> [packet.step for packet in wd.packets.from_obspy(obspy.Stream([trace]), components=("E", "N"))]
        [0.02]
    """
    for trace in stream:
        if not hasattr(trace, "stats") or not hasattr(trace, "data"):
            raise TypeError(
                f"from_obspy() takes an obspy Stream, such as obspy.read(path), got an object of type "
                f"{type(trace).__name__}"
            )
        yield from packets_of_trace(trace, components, sensitivity)


def packets_of_trace(
    trace: Any, components: Sequence[str], sensitivity: float | Mapping[str, float] | None
) -> Iterator[Packet]:
    """Yield one packet for each part without gaps of an obspy trace; arguments: see `from_obspy`."""
    place, stats = f"trace {trace.id}", trace.stats
    fitting = [index for index, end in enumerate(components) if stats.channel.upper().endswith(end.upper())]
    if len(fitting) != 1:
        raise RefusedPacket(
            f"{place}: its channel {stats.channel!r} ends in {len(fitting)} of the components {tuple(components)}: "
            "give components= with the end of each channel name, such as ('E', 'N'), and only these channels"
        )
    counts = sensitivity.get(trace.id) if isinstance(sensitivity, Mapping) else sensitivity
    if counts is None and np.asarray(trace.data).dtype.kind in "iu":
        raise RefusedPacket(
            f"{place}: its values are whole numbers, so they are counts of the digitizer: give sensitivity=, the "
            f"counts per m/s2 of this channel, such as sensitivity={{{trace.id!r}: 4.0e5}}"
        )
    component = fitting[0] if len(components) > 1 else None
    for part in trace.split() if np.ma.is_masked(trace.data) else [trace]:
        values = np.asarray(part.data, dtype=np.float64) * float(part.stats.calib)
        values = values if counts is None else values / float(counts)
        yield Packet(values, part.stats.starttime.timestamp, float(part.stats.delta), component)
