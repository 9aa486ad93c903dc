"""The motion of a live ensemble while it arrives: its samples, numbers of packets, and the lag behind real time."""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np

from warpdyn.campaigns.live.packets.packet import Packet
from warpdyn.campaigns.live.packets.receiver import Receiver
from warpdyn.campaigns.live.packets.refused import RefusedPacket
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.plausibility.check import LARGEST_RECORDED

MOST_VALUES = 2**22  # accelerations of the record that are kept: 32 MB, 11 hours of one component at 100 Hz
FIRST_RECORD = 2**14  # samples of the record for which memory is reserved at first
POSIX = 1e8  # time stamps above this are POSIX times [s] (since 1973), so that they can be compared with the clock


class Arriving:
    """The motion so far.

    Args:
        receiver: The receiver of the packets.

    Attributes:
        receiver: The receiver, with the packets so far.
        refused: Number of refused packets.
    """

    def __init__(self, receiver: Receiver) -> None:
        self.receiver, self.refused, self._samples = receiver, 0, 0
        self._record = np.zeros((FIRST_RECORD, len(receiver.tracks)))  # longer than the record so far
        self._is_large = False  # whether a warning of implausibly large accelerations was given
        self._offset: float | None = None  # least difference of clock and time stamps [s]

    @property
    def record(self) -> np.ndarray:
        """Samples of the motion so far [m/s2], shape [time, component]."""
        return self._record[: self._samples]

    @property
    def whole(self) -> np.ndarray:
        """Samples of the motion if it ends here [m/s2], shape [time, component]."""
        receiver, values = self.receiver, self.record
        if receiver.packet_step != receiver.step and receiver.ends_between_samples:
            values = np.concatenate([values, np.zeros_like(values[:1])])  # as GroundMotion.resampled does
        return values

    def accepted(self, packet: Packet) -> Receiver:
        """Return the receiver with a packet; raise a RefusedPacket, and count it, if the packet cannot be used."""
        try:
            receiver = self.receiver.accept(packet)
        except RefusedPacket:
            self.refused += 1
            raise
        difference = time.time() - receiver.end
        is_posix = receiver.end > POSIX
        self._offset = 0.0 if is_posix else min(difference, np.inf if self._offset is None else self._offset)
        return receiver

    def _warn_of_peak(self, values: np.ndarray) -> None:
        """Warn once if these accelerations are larger than those of nearly all records."""
        peak = float(np.abs(values).max(initial=0.0))
        if self._is_large or peak <= LARGEST_RECORDED:
            return
        findings = PlausibilityFindings()
        self._is_large = findings.add("peak_ground_acceleration", peak, " of the motion so far")
        findings.warn()

    def new_samples(self, receiver: Receiver) -> tuple[np.ndarray, Receiver]:
        """Return the samples that a receiver adds to the motion, shape [time, component], and the receiver then."""
        values, rest = receiver.take()
        most = MOST_VALUES // values.shape[1]
        if self._samples + len(values) > most:
            raise RefusedPacket(
                f"packet: the motion would have more than {most} samples, the most that are kept: call finish(), and "
                "begin a new Live"
            )
        return values, rest

    def keep(self, values: np.ndarray, receiver: Receiver) -> None:
        """Append samples to the motion, and keep the receiver from which they were taken."""
        end = self._samples + len(values)
        self._warn_of_peak(values)
        if end > len(self._record):
            room = max(end, 2 * len(self._record))
            self._record = np.concatenate([self.record, np.zeros((room - self._samples, values.shape[1]))])
        self._record[self._samples : end] = values
        self._samples, self.receiver = end, receiver

    def report(self, integrated: float) -> dict[str, object]:
        """Return numbers of packets and samples, the drift of the clock and the lag behind real time [s], by name.

        Args:
            integrated: Time since the first sample up to which the structures are integrated [s].
        """
        receiver = self.receiver
        names = ("duplicate_packets", "late_packets", "overlapping_samples", "interpolated_samples", "gaps_closed")
        return {
            "packets": receiver.packets,
            "refused_packets": self.refused,
            "samples": self._samples,
            **{name: receiver.counts[name] for name in names},
            "gap": receiver.gap,
            "clock_drift": receiver.drift,
            "lag": self.lag(integrated),
        }

    def lag(self, integrated: float) -> float:
        """Return the time between the last integrated sample and now [s]; 0 before the motion begins.

        If time stamps are not POSIX times, the lag is relative to the packet that arrived earliest after its samples;
        after `restore` it is NaN until the next packet.
        """
        begin = self.receiver.begin
        if begin is None:
            return 0.0
        return np.nan if self._offset is None else time.time() - self._offset - begin - integrated

    def restore(self, receiver: Receiver, record: np.ndarray, counted: Mapping[str, int]) -> None:
        """Replace the motion by that of a saved state: its receiver, its record and its number of refused packets."""
        self._samples, self.refused = 0, counted["refused"]
        self._offset = 0.0 if receiver.end > POSIX else None
        self.keep(record, receiver)
