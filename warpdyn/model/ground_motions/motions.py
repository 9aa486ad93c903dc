"""Ground motions, i.e. sampled ground accelerations, and checks of lists of motions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from warpdyn.foundations.core.checks import checked_text, real_number, real_numbers, shortened
from warpdyn.foundations.core.description import fingerprint, html_table
from warpdyn.foundations.core.frozen_values import FrozenArrays
from warpdyn.foundations.core.messages import amount_of
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.excitation import Sampled, resampled_columns

FEWEST_CROSSINGS = 10  # a motion that crosses its baseline fewer times is not treated as a record
MOST_DRIFT = 8.0  # velocity of the baseline over velocity of the rest of the motion; 0.2 % of white noise exceed it


@with_suggestions
@dataclass(frozen=True, eq=False, repr=False)
class GroundMotion(FrozenArrays):
    """One component of a ground acceleration, linear between its samples and zero after its end.

    Args:
        acceleration: Ground acceleration [m/s2], shape [time]; the first value acts at t = 0.
        step: Sampling step of the record [s].
        name: Name of the motion in results.
        source: Source of the motion, such as a file or a package.
        record: Name of the record, which all components of one instrument and earthquake share; "" if it is unknown.
        component: Component, such as "090", "N" or "UP"; "" if it is unknown.

    Raises:
        ValueError: If the acceleration is not a finite 1-D array of at least two values, or some are masked, or the
            step is not finite and positive.
        TypeError: If a name is not text.

    Example:
        >>> time = np.arange(0, 10, 0.01)
        >>> motion = wd.GroundMotion(3.0 * np.sin(2 * np.pi * time), 0.01, "sine")
        >>> motion.duration, motion.peak_ground_acceleration
        (9.99, 3.0)
        >>> motion
        GroundMotion('sine', 9.99 s at steps of 0.01 s, PGA 0.3059 g (3 m/s2))
    """

    acceleration: np.ndarray
    step: float
    name: str = "motion"
    source: str = ""
    record: str = ""
    component: str = ""

    def __post_init__(self) -> None:
        for name in ("name", "source", "record", "component"):
            object.__setattr__(self, name, checked_text(f"GroundMotion.{name}", getattr(self, name)))
        acceleration = real_numbers(f"motion {self.name!r}: acceleration", self.acceleration, "m s-2")
        if acceleration.ndim != 1 or acceleration.size < 2:
            raise ValueError(
                f"motion {self.name!r}: acceleration must be one row of at least 2 values, got shape "
                f"{acceleration.shape}"
            )
        bad = np.flatnonzero(~np.isfinite(acceleration))
        if bad.size:
            raise ValueError(
                f"motion {self.name!r}: acceleration[{bad[0]}] is {acceleration[bad[0]]} ({bad.size} of "
                f"{acceleration.size} values are not finite); every value must be finite: correct the record"
            )
        acceleration.flags.writeable = False
        object.__setattr__(self, "acceleration", acceleration)
        step = real_number(f"motion {self.name!r}: step [s]", self.step, above=0)
        real_number(f"motion {self.name!r}: step times the number of samples [s]", step * acceleration.size)
        object.__setattr__(self, "step", step)

    def __repr__(self) -> str:
        # The peak is shown in both units, so that the user notices a record that was read in a wrong unit.
        return f"GroundMotion({self.name!r}, {self.duration:.6g} s at steps of {self.step:g} s, PGA {self._peak_text})"

    @property
    def values(self) -> np.ndarray:
        """Sampled ground accelerations [m/s2], shape [time]."""
        return self.acceleration

    @property
    def label(self) -> str:
        """Name of the motion in datasets."""
        return self.name

    def resampled(self, step: float) -> GroundMotion:
        """Return the motion with another sampling step, by linear interpolation.

        Args:
            step: Step of the new samples [s].

        Raises:
            ValueError: If the step is not above 0, or there would be more than 2^26 samples.
        """
        return replace(self, acceleration=resampled_columns(self.values, self.step, step)[:, 0], step=step)

    def lengthened(self, samples: int) -> GroundMotion:
        """Return the motion with zeros after its end, so that it has at least this number of samples."""
        if samples <= self.acceleration.size:
            return self
        added = np.zeros(samples - self.acceleration.size)
        return replace(self, acceleration=np.append(self.acceleration, added))

    def description(self) -> dict[str, object]:
        """Return the motion as a dictionary for JSON: names, step, and number of samples and their digest (hash)."""
        said = {"name": self.name, "source": self.source, "step": self.step, "samples": self.acceleration.size}
        said["digest"] = self._digest[:16]
        return said | ({"record": self.record, "component": self.component} if self.record else {})

    @cached_property
    def own_fingerprint(self) -> str:
        """Hash of the names, the step and the samples; a run with many motions reads it instead of the samples."""
        return fingerprint(self.name, self.source, self.record, self.component, self._digest)

    @cached_property
    def _digest(self) -> str:
        return fingerprint(self.acceleration, self.step)

    def _repr_html_(self) -> str:
        rows = {
            "duration": f"{self.duration:.6g} s, {self.acceleration.size:,} samples every {self.step:g} s",
            "PGA": self._peak_text,
            "record": f"{self.record}, component {self.component}" if self.record else "",
            "source": self.source,
        }
        return html_table(f"Ground motion {self.name!r}", [(name, text) for name, text in rows.items() if text])

    @property
    def _peak_text(self) -> str:
        peak = self.peak_ground_acceleration
        return f"{peak / STANDARD_GRAVITY:.4g} g ({peak:.4g} m/s2)"

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return (self.acceleration.size - 1) * self.step

    @cached_property
    def peak_ground_acceleration(self) -> float:
        """Largest absolute ground acceleration [m/s2]."""
        return float(np.abs(self.acceleration).max())

    @cached_property
    def baseline_over_peak(self) -> float:
        """Peak of the straight line fitted to the record, divided by the peak of the record [1].

        The value is 0 if the record has no offset. An offset is assumed if the velocity of the line is more than
        MOST_DRIFT times the velocity of the motion minus the line. Pulses and other motions that do not oscillate about
        the line count as motions without offset.
        """
        a = self.acceleration
        # With times from -1 to 1, the mean and the slope of the line can be computed separately.
        place = np.linspace(-1.0, 1.0, a.size)
        line = a.mean() + place * (a @ place) / (place @ place)
        rest = a - line
        if np.count_nonzero(rest[1:] * rest[:-1] < 0) < FEWEST_CROSSINGS:
            return 0.0
        drift, swing = np.abs(np.cumsum(line)).max(), np.abs(np.cumsum(rest)).max()
        return float(np.abs(line).max() / self.peak_ground_acceleration) if drift > MOST_DRIFT * swing else 0.0


def checked_motions(
    motions: GroundMotion | Sequence[GroundMotion], *, or_pairs: bool = False
) -> tuple[GroundMotion, ...]:
    """Return one or several ground motions as a tuple; raise an error if an object is not a GroundMotion.

    Args:
        motions: The motions.
        or_pairs: Whether pairs of motions are allowed, too.
    """
    kinds: tuple[type, ...] = (GroundMotion,)
    if or_pairs:
        from warpdyn.model.ground_motions.pairs_of_motions import PairOfMotions  # it imports this module

        kinds = (GroundMotion, PairOfMotions)
    if isinstance(motions, kinds):
        return (motions,)  # type: ignore[return-value] # or a pair
    if not isinstance(motions, Iterable) or isinstance(motions, str | bytes | range | np.ndarray | Mapping):
        raise TypeError(f"motions must be GroundMotions, such as [motion, motion], got {shortened(motions)}")
    motions = tuple(motions)
    if not motions:
        raise ValueError("motions is empty: give at least one GroundMotion")
    for index, motion in enumerate(motions):
        if not isinstance(motion, kinds):
            like = f"motions[{index}].components" if hasattr(motion, "components") else "those of wd.records.read(path)"
            raise TypeError(
                f"motions[{index}] is a {type(motion).__name__}; every motion must be a GroundMotion, such as {like}"
            )
    return motions


def one_list(motions: object, of_levels: object) -> tuple[Any, Any]:
    """Return one list of all motions, and the indices of each level's motions, from one list of motions per level.

    Motions with the same name and the same samples become one motion, even if they are in several lists.

    Args:
        motions: One list of motions per level; any other value is returned unchanged.
        of_levels: Argument `motions_of_levels` of Stripes; it must be None if `motions` is a list of lists.

    Returns:
        The list of all motions, and one tuple of indices into it per level.
    """
    if not isinstance(motions, list | tuple) or not any(isinstance(each, list | tuple) for each in motions):
        return motions, of_levels
    if of_levels is not None:
        raise ValueError("a list of motions for each level already sets motions_of_levels: remove motions_of_levels=")
    known: dict[tuple[str, str], int] = {}
    found: list[GroundMotion] = []
    numbers: list[tuple[int, ...]] = []
    for place, of_level in enumerate(motions):
        if not isinstance(of_level, list | tuple) or not all(isinstance(each, GroundMotion) for each in of_level):
            raise TypeError(f"motions[{place}] must be a list of GroundMotions, like those of other levels")
        keys = [(each.name, str(each.description()["digest"])) for each in of_level]
        for key, motion in zip(keys, of_level, strict=True):
            if key not in known:
                known[key] = len(found)
                found.append(motion)
        numbers.append(tuple(known[key] for key in keys))
    return found, tuple(numbers)


def checked_sets(of_levels: Sequence[Sequence[int]], motions: int, levels: np.ndarray) -> tuple[tuple[int, ...], ...]:
    """Return the indices of the motions of each level as tuples; raise a ValueError if they are invalid.

    Args:
        of_levels: Indices of motions, one list per level.
        motions: Number of motions.
        levels: Levels of the intensity measure, shape [level].
    """
    if len(of_levels) != levels.size:
        raise ValueError(
            f"there are motions for {amount_of(len(of_levels), 'level')}, but levels has {levels.size}: give one list "
            "of motions for each level"
        )
    found = tuple(tuple(int(number) for number in of_level) for of_level in of_levels)
    for level, numbers in zip(levels, found, strict=True):
        if not numbers or len(set(numbers)) < len(numbers) or min(numbers) < 0 or max(numbers) >= motions:
            raise ValueError(
                f"the motions of level {level:g} are {list(numbers)}: give at least one index for each level, each "
                f"from 0 to {motions - 1} and without repetition"
            )
    return found


def motion_names(motions: Sequence[Sampled]) -> tuple:
    """Return the variable `motion_name` of a dataset (dimension, names, attributes)."""
    names = [motion.label for motion in motions]
    return "motion", np.array(names, dtype=str), {"long_name": "name of the motion"}


def motion_numbers(count: int) -> tuple:
    """Return the coordinate `motion` of a dataset (dimension, numbers 0 to count - 1, attributes)."""
    return "motion", np.arange(count, dtype=np.int32), {"long_name": "index of the motion", "units": "1"}
