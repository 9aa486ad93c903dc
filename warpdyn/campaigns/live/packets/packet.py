"""Packets: consecutive samples of a ground acceleration with the time of the first sample, and their checks."""

from __future__ import annotations

import datetime
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.campaigns.live.packets.refused import RefusedPacket
from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.units import STANDARD_GRAVITY

# The largest recorded ground acceleration is below 5 g; larger values are probably in another unit, or counts.
LARGEST_ACCELERATION = 5 * STANDARD_GRAVITY
STEP_TOLERANCE = 1e-3  # relative difference of the stated step of a packet that is a rounded number


@dataclass(frozen=True, eq=False)
class Packet:
    """Consecutive samples of a ground acceleration.

    Args:
        acceleration: Accelerations [m/s2], or in the `unit` of the Live, shape [time] or [time, component].
        start: Time of the first sample [s], such as POSIX time; None: the packet follows the latest sample.
        step: Sampling step [s]; None: the step of the live ensemble.
        component: Index of the only component in the packet, if components arrive separately; None: all components.

    Raises:
        ValueError: If a time or step is not finite, or the step is not above 0.
        TypeError: If an argument is of another type.

    Example:
        >>> wd.packets.Packet([0.1, 0.2, 0.1], start=12.0).acceleration
        [0.1, 0.2, 0.1]
    """

    acceleration: ArrayLike
    start: float | None = None
    step: float | None = None
    component: int | None = None

    def __post_init__(self) -> None:
        if isinstance(self.start, str | datetime.date) or getattr(self.start, "dtype", np.dtype(float)).kind == "M":
            raise TypeError(
                f"Packet.start must be a number of seconds, such as POSIX time, got {self.start!r}: for text with a "
                "time zone give datetime.fromisoformat(text).timestamp(), for a datetime64 in UTC give "
                "(start - np.datetime64(0, 's')) / np.timedelta64(1, 's')"
            )
        if self.start is not None:
            real_number("Packet.start [s]", self.start)
        if self.step is not None:
            real_number("Packet.step [s]", self.step, above=0)


def checked_values(packet: Packet, components: int, factor: float, step: float) -> np.ndarray:
    """Return the accelerations of a packet [m/s2], shape [time, component].

    Args:
        packet: The packet.
        components: Number of components of the motion.
        factor: Factor that converts the values to m/s2.
        step: Sampling step that the packet must have [s].

    Raises:
        RefusedPacket: If the packet is empty, has values that are not finite or implausible, another step or another
            number of components.
    """
    given = packet.acceleration
    if np.ma.is_masked(given):
        raise RefusedPacket(
            "packet: some values are masked, so that samples are missing: give one packet for each part without gaps, "
            "such as those of stream.split()"
        )
    try:
        values = np.asarray(given)
        values = factor * values.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise RefusedPacket(f"packet: the acceleration must be numbers [m/s2]: {error}") from error
    if given is None or not values.size:
        raise RefusedPacket(f"packet: it is empty (acceleration={given!r}): push packets with at least one sample")
    wanted = 1 if packet.component is not None else components
    if values.ndim == 1 and wanted == 1:
        values = values[:, None]
    if values.ndim != 2 or values.shape[1] != wanted or not len(values):
        shape = "[time]" if wanted == 1 else f"[time, {wanted}]"
        raise RefusedPacket(
            f"packet: the acceleration has the shape {np.shape(given)}, but the motion has {components} "
            f"component{'s' if components > 1 else ''}: give values of shape {shape}"
            + (", or Packet(..., component=0) for a single component" if components > 1 else "")
        )
    if packet.component is not None and packet.component not in range(components):
        raise RefusedPacket(
            f"packet: component must be from 0 to {components - 1}, the components of the scene's motion, got "
            f"{packet.component!r}"
        )
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        time, component = bad[0]
        raise RefusedPacket(
            f"packet: acceleration[{time}, {component}] is {values[time, component]} ({len(bad)} of {values.size} "
            "values are not finite): leave these samples out; the live ensemble treats them as a gap"
        )
    peak = float(np.abs(values).max())
    if peak > LARGEST_ACCELERATION:
        raise RefusedPacket(
            f"packet: its peak is {peak:.3g} m/s2 ({peak / STANDARD_GRAVITY:.3g} g), more than any recorded ground "
            f"acceleration ({LARGEST_ACCELERATION:.3g} m/s2): the values may be counts of the digitizer, or in cm/s2. "
            "Remove the response of the instrument, or give unit='cm/s2' to wd.Live"
        )
    if packet.step is not None and abs(packet.step - step) > STEP_TOLERANCE * step:
        raise RefusedPacket(
            f"packet: its step is {packet.step:g} s, but packets with a step of {step:g} s are expected: give "
            f"sampling_step={packet.step:g} to wd.Live, which resamples packets to the step of the scene's motion"
        )
    return values
