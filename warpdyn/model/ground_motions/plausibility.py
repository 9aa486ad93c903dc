"""Plausibility checks of ground motions: unit, step, baseline, and records that occur twice in a set."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.motions import GroundMotion

if TYPE_CHECKING:
    from warpdyn.model.ground_motions.filtered_noise import FilteredNoise

FEWEST_IN_A_SET = 5  # a set with fewer motions is not searched for motions that are much weaker than all others
BESIDE = np.array([1, -1, 2, -2, 4, -4, 8, -8, 16, -16])  # distances from the peak of the compared values [samples]
PEAK_FACTOR = 3.0  # approximate ratio of the peak to the standard deviation of a Gaussian process
DUPLICATE = 1e-3  # largest difference of two copies of a record, divided by the peak


def add_motions(findings: PlausibilityFindings, motions: Sequence[GroundMotion], where: str = "") -> None:
    """Add motions with an implausible step, peak acceleration or baseline to `findings`.

    Args:
        findings: Implausible values found so far.
        motions: The motions.
        where: Words that follow the name of a motion in the warning, such as " of event 'mainshock'".
    """

    def named(index: int) -> str:
        return f" of motion {index} ({motions[index].name!r}){where}"

    peaks = np.array([motion.peak_ground_acceleration for motion in motions])
    loud = np.flatnonzero(peaks > 0).tolist()  # motions of zeros are not checked, because they are intended
    findings.add_each("record_step", [motion.step for motion in motions], named)
    findings.add_each("peak_ground_acceleration", peaks[loud].tolist(), lambda place: named(loud[place]))
    baselines = [motions[index].baseline_over_peak for index in loud]
    findings.add_each("record_baseline", baselines, lambda place: named(loud[place]))


def add_weakest_motions(findings: PlausibilityFindings, motions: Sequence[GroundMotion], where: str = "") -> None:
    """Add the few motions that are much weaker than all other motions of a set to `findings`.

    The unit of these motions may be wrong. They are added in two cases: their peaks would be within the range of the
    other motions if their values were in g, or the next stronger motion is more than 9.8 times stronger.
    """
    motions = [motion for motion in motions if motion.peak_ground_acceleration > 0]
    if len(motions) < FEWEST_IN_A_SET:
        return
    ordered = sorted(motions, key=lambda motion: motion.peak_ground_acceleration)
    peaks = np.array([motion.peak_ground_acceleration for motion in ordered])
    few = len(motions) // FEWEST_IN_A_SET
    place = int(np.argmin(peaks[:few] / peaks[1 : few + 1]))
    weak, others = peaks[: place + 1], peaks[place + 1 :]
    were_in_g = others[0] <= STANDARD_GRAVITY * weak[-1] and STANDARD_GRAVITY * weak[0] <= others[-1]
    if were_in_g or others[0] > STANDARD_GRAVITY * weak[-1]:
        findings.add("weakest_motions", weak[-1] / others[0], f" of motion {ordered[place].name!r}{where}")


def warn_of_implausible_motions(motions: Sequence[GroundMotion], periods: ArrayLike = ()) -> None:
    """Give one warning of implausible periods [s], and of motions with an implausible step, peak or baseline."""
    findings = PlausibilityFindings()
    add_motions(findings, motions)
    add_weakest_motions(findings, motions)
    for period in np.asarray(periods, dtype=np.float64):
        findings.add("measure_period", period)
    findings.warn()


def warn_of_duplicates(motions: Sequence[GroundMotion], *, is_scaled: bool) -> None:
    """Warn if a set of motions contains the same record twice, even if one copy has fewer digits.

    Args:
        motions: The motions.
        is_scaled: Whether motions are scaled to levels. If so, multiples of the same record count as the same record.
    """
    alike: dict[tuple[float, int, int], list[int]] = {}
    shapes: list[np.ndarray] = []
    for index, motion in enumerate(motions):
        peak = motion.peak_ground_acceleration
        shape = motion.values.ravel() / (peak if is_scaled and peak > 0 else 1.0)
        shapes.append(shape)
        alike.setdefault((motion.step, shape.size, int(np.abs(shape).argmax())), []).append(index)
    first_of: dict[int, int] = {}
    for (_, _, place), group in alike.items():
        if len(group) > 1:
            first_of |= _copies(shapes, group, place)
    found = [(motions[first_of[index]].name, motions[index].name) for index in sorted(first_of)]
    if found:
        (first, second), rest = found[0], f" (and {len(found) - 1} more such)" if len(found) > 1 else ""
        warn_caller(
            f"motions {first!r} and {second!r}{rest} are the same record twice, so statistics would count it twice: "
            "remove one of the two from motions="
        )


def _copies(shapes: Sequence[np.ndarray], group: Sequence[int], place: int) -> dict[int, int]:
    """Return index of a copy -> index of the first motion with the same record.

    Args:
        shapes: Accelerations of all motions, divided by their peak if motions are scaled.
        group: Indices of motions of equal length with the peak at the same sample.
        place: Index of the sample with the peak.
    """
    first_of: dict[int, int] = {}
    by_digest: dict[bytes, int] = {}
    for index in group:
        first = by_digest.setdefault(blake2b(shapes[index].tobytes()).digest(), index)
        if first != index:
            first_of[index] = first
    # Compare values near the peak first, because they distinguish most records.
    single = list(by_digest.values())
    beside = np.clip(place + BESIDE, 0, shapes[single[0]].size - 1)
    probes = np.array([shapes[index][beside] for index in single])
    near = DUPLICATE * np.array([np.abs(shapes[index]).max() for index in single])
    order = np.argsort(probes[:, 0])
    ends = np.searchsorted(probes[order, 0], probes[order, 0] + near.max(), side="right")
    for i, end in enumerate(ends):
        one, others = order[i], order[i + 1 : end]
        for other in others[(np.abs(probes[others] - probes[one]) <= near.max()).all(axis=1)]:
            first, copy = sorted((int(one), int(other)))
            if _is_copy(shapes[single[first]], shapes[single[copy]], near[copy]):
                first_of[single[copy]] = min(single[first], first_of.get(single[copy], single[first]))
    return first_of


def _is_copy(shape: np.ndarray, other: np.ndarray, near: float) -> bool:
    return bool(np.abs(shape - other).max() <= near)


def peak_of_noise(noise: FilteredNoise) -> float:
    """Return the approximate peak acceleration of filtered noise [m/s2]."""
    process = noise.spectrum.recursion(noise.interval)
    return float(PEAK_FACTOR * np.linalg.norm(process.output @ process.start) * noise.envelope_at_nodes().max())
