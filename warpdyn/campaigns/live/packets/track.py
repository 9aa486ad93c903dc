"""The order of the samples of one component: gaps, late, repeated and contradicting packets, and clock drift."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from warpdyn.campaigns.live.packets.refused import RefusedPacket

SECONDS_REMEMBERED = 60.0  # accepted samples that are kept to recognise repeated packets [s]
# A packet may start this share of a step before or after its place. Clocks of loggers are exact to much less than a
# step; a larger difference is neither the next sample nor a whole gap.
TIME_TOLERANCE = 0.25
MOST_DRIFT = 0.01  # relative difference of clock and sampling rate at which the step must be wrong
FARTHEST = 600.0  # longest gap before a packet [s]: strong motions are shorter, so that its time stamp must be wrong
SAMPLES_OF_DRIFT = 1.0  # least difference [step] that counts as such a drift


@dataclass(frozen=True)
class Segment:
    """Consecutive samples.

    Args:
        first: Index of the first sample in the motion.
        values: Accelerations [m/s2], shape [time].
    """

    first: int
    values: np.ndarray

    @property
    def end(self) -> int:
        """Index after the last sample."""
        return self.first + len(self.values)


@dataclass(frozen=True)
class Track:
    """The samples of one component that have arrived; every change returns a new object.

    Args:
        step: Sampling step [s].
        patience: Time [s] of signal after a gap that is kept while the missing samples may still arrive.
        longest_gap: Longest gap [s] that is then filled by linear interpolation.
        begin: Time stamp of the first sample [s]; None before the first packet.
        expected: Time stamp at which the next sample is expected [s].
        recent: Last accepted samples, which repeated packets are compared with.
        fresh: Accepted samples that have not been taken.
        waiting: Segments after a gap, in order.
        counts: Numbers of repeated, late and filled samples or packets, by name.
    """

    step: float
    patience: float
    longest_gap: float
    begin: float | None = None
    expected: float = 0.0
    recent: Segment = field(default_factory=lambda: Segment(0, np.zeros(0)))
    fresh: tuple[np.ndarray, ...] = ()
    waiting: tuple[Segment, ...] = ()
    counts: Counter[str] = field(default_factory=Counter)

    @property
    def drift(self) -> float:
        """Difference between the time stamps and the number of samples times the step [s]; above 0: late stamps."""
        return 0.0 if self.begin is None else self.expected - self.begin - self.recent.end * self.step

    @property
    def available(self) -> int:
        """Number of samples that can be taken."""
        return sum(map(len, self.fresh))

    def accept(self, values: np.ndarray, start: float | None) -> Track:
        """Return the track with the samples of a packet.

        Args:
            values: Accelerations [m/s2], shape [time].
            start: Time stamp of the first sample [s]; None: the packet follows the latest sample, also after a gap.

        Raises:
            RefusedPacket: If the packet contradicts earlier ones, goes back in time, starts between two samples or
                far ahead, or ends more than `patience` after a gap that is too long to be filled.
        """
        if self.begin is None:
            start = 0.0 if start is None else start
            return replace(self, begin=start, expected=start)._append(values)
        if start is None:
            latest = self.waiting[-1].end if self.waiting else self.recent.end
            start = self.expected + (latest - self.recent.end) * self.step
        shift, place = self._place(start)
        segment = Segment(shift + self.recent.end, values)
        if shift == 0:
            moved = replace(self, expected=self.expected + place)
            return moved._append(values)._join()
        if shift < 0:
            return self._overlapping(segment)._join()
        if shift * self.step > max(FARTHEST, self.longest_gap + self.patience):
            raise RefusedPacket(
                f"packet: it starts {shift * self.step:.6g} s after the next expected sample (time stamps {start:.6f} "
                f"s and {self.expected:.6f} s), which is longer than a strong motion: its start may be in another "
                "unit than seconds. Correct start=; if the station was silent, call live.finish() and make a new Live"
            )
        return self._later(segment)._join()._without_gap()

    def bridge(self) -> Track:
        """Return the track with the gap before the waiting samples filled by linear interpolation, however long."""
        if not self.waiting:
            return self
        return self._filled()._join()

    def take(self, count: int) -> tuple[np.ndarray, Track]:
        """Return the next `count` samples, shape [time], and the track without them."""
        values = np.concatenate(self.fresh) if self.fresh else np.zeros(0)
        rest = values[count:]
        return values[:count], replace(self, fresh=(rest,) if len(rest) else ())

    def _place(self, start: float) -> tuple[int, float]:
        """Return the number of samples between the expected and the given start, and the rest [s]."""
        exact = (start - self.expected) / self.step
        shift = round(exact)
        if abs(exact - shift) > TIME_TOLERANCE:
            raise RefusedPacket(
                f"packet: it starts {abs(exact):.3g} steps {'after' if exact > 0 else 'before'} the next expected "
                f"sample (time stamps {start:.6f} s and {self.expected:.6f} s, step {self.step:g} s), and not at a "
                "whole number of steps: correct its start or its step"
            )
        rest = (exact - shift) * self.step
        index = self.recent.end + shift
        drift = self.drift + rest
        if abs(drift) > max(SAMPLES_OF_DRIFT * self.step, MOST_DRIFT * abs(index) * self.step):
            found = self.step + drift / max(1, index)
            raise RefusedPacket(
                f"packet: the time stamps drift by {drift:.3g} s in {index * self.step:.4g} s, so that the sampling "
                f"step is {found:.6g} s and not {self.step:g} s: give the scene a motion with this step"
            )
        return shift, rest

    def _append(self, values: np.ndarray) -> Track:
        """Return the track with accepted samples at its end."""
        most = max(1, round(SECONDS_REMEMBERED / self.step))
        end = self.recent.end + len(values)
        kept = np.concatenate([self.recent.values, values])[-most:]
        expected = self.expected + len(values) * self.step
        return replace(self, recent=Segment(end - len(kept), kept), fresh=(*self.fresh, values), expected=expected)

    def _overlapping(self, segment: Segment) -> Track:
        """Return the track with the new samples of a segment that begins before the next expected sample."""
        if segment.first < self.recent.first:
            back = (self.recent.end - segment.first) * self.step
            known = len(self.recent.values) * self.step
            raise RefusedPacket(
                f"packet: its time goes back by {back:.4g} s, but only the last {known:.4g} s can be compared: it is "
                "much too late, or its clock was set back. Remove this packet"
            )
        shared = min(segment.end, self.recent.end) - segment.first
        _compare(segment, self.recent)
        if segment.end <= self.recent.end:
            return replace(self, counts=self.counts + Counter(duplicate_packets=1))
        counted = replace(self, counts=self.counts + Counter(overlapping_samples=shared))
        return counted._append(segment.values[shared:])

    def _later(self, segment: Segment) -> Track:
        """Return the track with a segment after a gap among the waiting ones."""
        for other in self.waiting:
            _compare(segment, other)
        if any(other.first <= segment.first and segment.end <= other.end for other in self.waiting):
            return replace(self, counts=self.counts + Counter(duplicate_packets=1))
        is_late = bool(self.waiting) and segment.first < self.waiting[-1].first
        counts = self.counts + Counter(late_packets=int(is_late))
        waiting = tuple(sorted((*self.waiting, segment), key=lambda each: each.first))
        return replace(self, waiting=waiting, counts=counts)

    def _join(self) -> Track:
        """Return the track with those waiting samples appended that now follow without a gap."""
        track, is_late = self, False
        while track.waiting and track.waiting[0].first <= track.recent.end:
            segment, *rest = track.waiting
            known = track.recent.end - segment.first
            track = replace(track, waiting=tuple(rest))
            is_late = True
            if known < len(segment.values):
                track = track._append(segment.values[known:])
        return replace(track, counts=track.counts + Counter(gaps_closed=1)) if is_late else track

    def _without_gap(self) -> Track:
        """Return the track with a short gap filled, if its samples have not arrived within `patience`."""
        if not self.waiting or (self.waiting[-1].end - self.waiting[0].first) * self.step <= self.patience:
            return self
        gap = (self.waiting[0].first - self.recent.end) * self.step
        if gap > self.longest_gap * (1 + 1e-9):
            raise RefusedPacket(
                f"packet: {gap:.4g} s of the motion are missing after {self.expected:.6f} s and have not "
                f"arrived within patience={self.patience:g} s: push the missing samples, call live.bridge() to "
                f"interpolate them linearly, or give longest_gap={gap:.4g} to wd.Live to interpolate such gaps; "
                "live.finish() ends the motion before the gap"
            )
        return self._filled()._join()._without_gap()

    def _filled(self) -> Track:
        """Return the track with the samples of the first gap, by linear interpolation."""
        missing = self.waiting[0].first - self.recent.end
        before, after = self.recent.values[-1], self.waiting[0].values[0]
        values = before + (after - before) * np.arange(1, missing + 1) / (missing + 1)
        counts = self.counts + Counter(interpolated_samples=missing)
        return replace(self, counts=counts)._append(values)


def _compare(segment: Segment, known: Segment) -> None:
    """Raise a RefusedPacket if two segments have different values at the same time."""
    first, end = max(segment.first, known.first), min(segment.end, known.end)
    if first >= end:
        return
    own = segment.values[first - segment.first : end - segment.first]
    other = known.values[first - known.first : end - known.first]
    if not np.array_equal(own, other):
        raise RefusedPacket(
            f"packet: {np.count_nonzero(own != other)} of {len(own)} samples that have arrived before have other "
            "values now: its time stamp may be wrong, or its clock was set back"
        )
