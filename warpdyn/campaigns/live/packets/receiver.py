"""The receiver of a live ensemble: it checks packets, joins their components and resamples them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from warpdyn.campaigns.live.packets.packet import Packet, checked_values
from warpdyn.campaigns.live.packets.refused import RefusedPacket
from warpdyn.campaigns.live.packets.track import TIME_TOLERANCE, Track


@dataclass(frozen=True)
class Receiver:
    """Packets that have arrived; every change returns a new object, so that a refused packet changes nothing.

    Args:
        tracks: Samples of each component.
        packet_step: Sampling step of the packets [s].
        step: Step of the motion that the ensemble integrates [s].
        factor: Factor that converts accelerations to m/s2.
        taken: Samples of the packets that were resampled or passed on, the last one included.
        last: Last of these samples, shape [1, component]; empty before the first.
        begin: Time stamp of the first sample of the motion [s]; None before all components have begun.
        packets: Number of accepted packets.
    """

    tracks: tuple[Track, ...]
    packet_step: float
    step: float
    factor: float
    taken: int = 0
    last: np.ndarray | None = None
    begin: float | None = None
    packets: int = 0

    @property
    def end(self) -> float:
        """Time stamp after the last sample of all components that has arrived without a gap before it [s]."""
        return min(track.expected for track in self.tracks)

    @property
    def gap(self) -> float:
        """Length of the first gap after which samples have arrived [s]; 0: none."""
        gaps = [track.waiting[0].first - track.recent.end for track in self.tracks if track.waiting]
        return max(gaps, default=0) * self.packet_step

    @property
    def counts(self) -> Counter[str]:
        """Numbers of repeated, late and interpolated samples or packets of all components, by name."""
        return sum((track.counts for track in self.tracks), Counter())

    @property
    def drift(self) -> float:
        """Largest difference between the time stamps and the number of samples times the step [s]."""
        return max((track.drift for track in self.tracks), key=abs)

    @property
    def ends_between_samples(self) -> bool:
        """Whether the last sample of the packets is between two samples of the motion."""
        end = self.packet_step * (self.taken - 1)
        return bool(np.ceil(end / self.step * (1 - 1e-12)) + 1 > self._new_samples(self.taken))

    def accept(self, packet: Packet) -> Receiver:
        """Return the receiver with the samples of a packet; raise a RefusedPacket if it cannot be used."""
        values = checked_values(packet, len(self.tracks), self.factor, self.packet_step)
        components = range(len(self.tracks)) if packet.component is None else [packet.component]
        tracks = list(self.tracks)
        for column, component in enumerate(components):
            tracks[component] = tracks[component].accept(values[:, column], packet.start)
        return replace(self, tracks=tuple(tracks), packets=self.packets + 1)._aligned()

    def bridge(self) -> Receiver:
        """Return the receiver with the first gap of each component filled by linear interpolation."""
        return replace(self, tracks=tuple(track.bridge() for track in self.tracks))

    def take(self) -> tuple[np.ndarray, Receiver]:
        """Return the samples of the motion that all components have, shape [time, component], and the receiver then."""
        count = min(track.available for track in self.tracks) if self.begin is not None else 0
        if not count:
            return np.zeros((0, len(self.tracks))), self
        pairs = [track.take(count) for track in self.tracks]
        values = np.stack([values for values, _ in pairs], axis=1)
        rest = replace(self, tracks=tuple(track for _, track in pairs), taken=self.taken + count, last=values[-1:])
        if self.packet_step == self.step:
            return values, rest
        return self._resampled(values, count), rest

    def _resampled(self, values: np.ndarray, count: int) -> np.ndarray:
        """Return new samples [m/s2] at the step of the motion, by linear interpolation.

        The result is that of `GroundMotion.resampled` for the whole record, except for the zero that follows a record
        whose last sample is not at a multiple of the new step.
        """
        known = values if self.last is None else np.concatenate([self.last, values])
        first = self.taken + count - len(known)
        old = self.packet_step * np.arange(first, self.taken + count)
        done = 0 if self.taken == 0 else self._new_samples(self.taken)
        new = self.step * np.arange(done, self._new_samples(self.taken + count))
        return np.stack([np.interp(new, old, column) for column in known.T], axis=1)

    def _new_samples(self, count: int) -> int:
        """Return the number of samples of the motion within the first `count` samples of the packets."""
        end = self.packet_step * (count - 1)
        number = int(end / self.step) + 2
        while self.step * (number - 1) > end:  # compared as np.interp does
            number -= 1
        return number

    def _aligned(self) -> Receiver:
        """Return the receiver without the samples of each component before the start of the last component."""
        if self.begin is not None or any(track.begin is None for track in self.tracks):
            return self
        begins = [track.begin for track in self.tracks if track.begin is not None]
        start, tracks = max(begins), []
        for track, begin in zip(self.tracks, begins, strict=True):
            exact = (start - begin) / self.packet_step
            skipped = round(exact)
            if abs(exact - skipped) > TIME_TOLERANCE:
                raise RefusedPacket(
                    f"packet: the components are sampled at different times: one starts {abs(exact - skipped):.3g} "
                    "steps between two samples of another one: resample one of them first"
                )
            if track.available < skipped:
                return self
            tracks.append(track.take(skipped)[1])
        return replace(self, tracks=tuple(tracks), begin=start)
