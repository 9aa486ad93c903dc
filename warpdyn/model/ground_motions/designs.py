"""Designs of experiments: the ground motions that act on each structure, and their scale factors."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, one_of, real_numbers, shortened, whole_number
from warpdyn.foundations.core.messages import amount_of
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.random_numbers import Purpose, uniforms
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.excitation import Assignment, Excitation
from warpdyn.model.ground_motions.intensities import checked_levels, intensities_of, measure_for
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.measures.one_component import PeakGroundAcceleration
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions, checked_sets, one_list
from warpdyn.model.ground_motions.pairs_of_motions import PairOfMotions, components_of
from warpdyn.model.ground_motions.plausibility import warn_of_duplicates
from warpdyn.model.ground_motions.stripes_errors import named_in_errors

if TYPE_CHECKING:
    from warpdyn.model.structures.structure import Structure

MOST_SHOWN = 10  # motions that the table in notebooks shows
CROSSED = "crossed"  # value of structures_per_motion


class Design(Excitation):
    """Base class of designs. A design assigns ground motions and scale factors to structures."""

    is_design = True
    motions: Sequence[GroundMotion]
    measure: IntensityMeasure
    own_structures: int = 0  # in a nested design, structures per motion; 0: all motions act on the same structures
    _intensities: np.ndarray  # intensity of every motion as recorded [level_units], shape [motion]

    def __repr__(self) -> str:
        count = len(self.motions)
        return f"{type(self).__name__}({count} {'motion' if count == 1 else 'motions'}, {self.measure.name})"

    @property
    def base_components(self) -> int:
        """Number of components of each motion."""
        return len(components_of(self.motions[0]))

    @property
    def intensities(self) -> np.ndarray:
        """Intensity measure of every motion as recorded [g for an acceleration, otherwise SI], shape [motion]."""
        return self._intensities

    @property
    def intensity_units(self) -> str:
        """Units of `intensities`: "g" for accelerations, otherwise SI units."""
        return self.measure.level_units

    def told(self) -> list[tuple[object, ...]]:
        """Return the rows of the table that notebooks show for the design: intensity measure and first motions."""
        units = self.measure.level_units
        rows: list[tuple[object, ...]] = [("intensity measure", f"{self.measure.name} [{units}]")]
        for motion, intensity in list(zip(self.motions, self._intensities, strict=True))[:MOST_SHOWN]:
            pga = motion.peak_ground_acceleration / STANDARD_GRAVITY
            said = f"{motion.duration:.4g} s, PGA {pga:.3g} g, {self.measure.name} {intensity:.3g} {units}"
            rows.append((motion.name, said))
        if len(self.motions) > MOST_SHOWN:
            rows.append((f"... {len(self.motions)} motions", ""))
        return rows


@named_in_errors
@dataclass(frozen=True, eq=False, repr=False)
class Stripes(Design):
    """Ground motions that are scaled to every level of an intensity measure (multiple stripe analysis, MSA).

    Nested design (`structures_per_motion=3`): each motion acts on separate structures. The first 3 structures belong to
    the first motion, the next 3 to the second, and so on. If parameters are random, `simulate(scene)` without
    `structures=` uses 3 structures per motion.

    Crossed design (`structures_per_motion="crossed"`, or `simulate(scene, structures=N)`): every motion acts on every
    structure. Samples are ordered by structure, then motion, then level, so that additional structures add samples at
    the end. Use it to compare motions on the same structures.

    Records selected for each level: `motions` is a list of lists. The first list contains the motions of the first
    level, the second list the motions of the second level, and so on (Jalayer and Cornell 2009, Earthquake Engineering
    and Structural Dynamics 38(8)). The motions of a level are scaled to this level and act on every structure.

    Args:
        motions: Ground motions, or one list of ground motions per level.
        levels: Levels of the intensity measure [g for an acceleration, otherwise SI], increasing, shape [im_level].
        measure: The intensity measure. It must increase with the scale factor, such as SpectralAcceleration(period)
            [g], PeakGroundVelocity() [m/s] or AriasIntensity() [m/s].
        structures_per_motion: Number of structures per motion (nested design); "crossed": crossed design. None: crossed
            design if the run has `structures=N`, otherwise 3 structures per motion if parameters are random.
        motions_of_levels: One list of indices into `motions` per level, if levels have different motions. It follows
            from `motions` if that is a list of lists. None: every motion is scaled to every level.

    Raises:
        ValueError: If there is no motion or no level, the numbers of lists of motions and of levels differ, a
            level is not positive, levels do not increase, the measure does not depend on the scale factor (durations),
            all values of a motion are zero, or `structures_per_motion` is neither a whole number of at least 1 nor
            "crossed".
        TypeError: If a motion is not a GroundMotion, or `measure` is not an intensity measure.

    Example:
        >>> design = wd.Stripes(motions, [0.2, 0.4, 0.8], wd.PeakGroundAcceleration(), structures_per_motion=3)  # g
        >>> wd.Scene(building, design, scatter).structures_given
        24
        >>> wd.Stripes(motions, [0.1, 0.3, 1.0], wd.PeakGroundVelocity()).samples_per_structure  # levels in m/s
        24
        >>> selected = [motions[:4], motions[4:]]  # for each of two levels
        >>> wd.Stripes(selected, [0.2, 0.8], wd.PeakGroundAcceleration()).samples_per_structure
        8
    """

    motions: Sequence[Any]  # GroundMotions, or lists of GroundMotions that the constructor joins to one list
    levels: Sequence[float]
    measure: IntensityMeasure
    structures_per_motion: int | Literal["crossed"] | None = None
    motions_of_levels: Sequence[Sequence[int]] | None = None

    def __post_init__(self) -> None:
        given, of_levels = one_list(self.motions, self.motions_of_levels)
        motions = checked_motions(given, or_pairs=True)
        object.__setattr__(self, "measure", measure_for(motions, self.measure))
        intensities = intensities_of(motions, self.measure)
        units = self.measure.level_units
        levels = checked_levels(self.levels, units)
        if self.measure.power == 0:
            raise ValueError(
                f"{self.measure.name} does not grow with a motion's scale, so no motion can be scaled to a level: "
                "give another measure=, such as SpectralAcceleration(period), or use Cloud(motions, measure)"
            )
        for index, (motion, intensity) in enumerate(zip(motions, intensities, strict=True)):
            if not intensity > 0:
                raise ValueError(
                    f"motion {index} ({motion.name!r}) has {self.measure.name} = {intensity:g} {units}: "
                    "a record of zeros cannot be scaled to a level: remove it from motions="
                )
        if isinstance(self.structures_per_motion, str):
            one_of("structures_per_motion", self.structures_per_motion, (CROSSED,))
        elif self.structures_per_motion is not None:
            own = whole_number("structures_per_motion", self.structures_per_motion, 1)
            object.__setattr__(self, "structures_per_motion", own)
        if of_levels is not None:
            of_levels = checked_sets(of_levels, len(motions), levels)
            if self.own_structures:
                raise ValueError(
                    "structures_per_motion cannot be combined with a list of motions for each level: remove "
                    "structures_per_motion="
                )
        warn_of_duplicates(motions, is_scaled=True)
        object.__setattr__(self, "motions", motions)
        object.__setattr__(self, "levels", levels)
        object.__setattr__(self, "motions_of_levels", of_levels)
        object.__setattr__(self, "_intensities", intensities)

    def __repr__(self) -> str:
        levels = len(self.levels)
        nested = f", {self.own_structures} structures per motion" if self.own_structures else ""
        nested += ", each with its own motions" if self.motions_of_levels else ""
        return f"{super().__repr__()[:-1]} at {levels} {'level' if levels == 1 else 'levels'}{nested})"

    def told(self) -> list[tuple[object, ...]]:
        """Return the rows of the table that notebooks show for the design: levels and motions."""
        nested = [("structures per motion", self.own_structures)] if self.own_structures else []
        return [(f"levels [{self.intensity_units}]", self.levels), *nested, *super().told()]

    def nested(self, structures_per_motion: int) -> Stripes:
        """Return the same design with separate structures for each motion; the motions are not checked again."""
        stripes = copy.copy(self)
        object.__setattr__(stripes, "structures_per_motion", structures_per_motion)
        return stripes

    @property
    def own_structures(self) -> int:  # type: ignore[override] # an attribute of the base class
        """Number of structures per motion in a nested design; 0 in a crossed design."""
        return self.structures_per_motion if isinstance(self.structures_per_motion, int) else 0

    @property
    def is_same_for_all(self) -> bool:  # type: ignore[override] # an attribute of the base class
        """Whether the samples of all structures have the same motions and scale factors (crossed design)."""
        return not self.own_structures

    @property
    def samples_per_structure(self) -> int:
        """Number of samples per structure: levels times motions (crossed design), or levels (nested design)."""
        return len(self.levels) if self.own_structures else self.places[0].size

    @property
    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """Motion index and level index of each sample of one structure in a crossed design, shape [sample]."""
        if self.motions_of_levels is None:
            motions, levels = np.arange(len(self.motions), dtype=np.int32), np.arange(len(self.levels))
            return np.repeat(motions, levels.size), np.tile(levels, motions.size)
        pairs = [(motion, level) for level, of_level in enumerate(self.motions_of_levels) for motion in of_level]
        motion, level = np.array(sorted(pairs)).T
        return motion.astype(np.int32), level

    def check_scaled_to_all(self, function: str) -> None:
        """Raise a ValueError if levels have different motions, because `function` scales each motion to all levels."""
        if self.motions_of_levels is not None:
            raise ValueError(
                f"{function}() scales every motion to many levels, but these Stripes have different motions per level: "
                f"give Stripes or a Cloud with one list of motions, such as Cloud(design.motions, design.measure)"
            )

    @property
    def structures_given(self) -> int:
        """Number of structures in a nested design; 0 in a crossed design, where `simulate` gets the number."""
        return len(self.motions) * self.own_structures

    def check_fits(self, structure: Structure) -> None:
        """Raise a ValueError if the design is nested and the structure is a portfolio."""
        if structure.is_many and self.own_structures:
            raise ValueError(
                "structures_per_motion does not apply to a portfolio, whose archetypes have a `count`: use "
                "OneMotionPerStructure(motions), or remove structures_per_motion="
            )

    def check_structures(self, structures: int) -> None:
        """Raise a ValueError if the design is nested and needs another number of structures than `structures`."""
        if self.own_structures and structures != self.structures_given:
            raise ValueError(
                f"{len(self.motions)} motions with structures_per_motion={self.own_structures} have "
                f"{self.structures_given} structures, got structures={structures}: remove structures="
            )

    def assign(self, structures: np.ndarray, seed: int, event: int = 0) -> Assignment:
        """Return structure, motion and scale factor of each sample, for the structures with the given indices."""
        levels, structures = len(self.levels), np.asarray(structures, dtype=np.int32)
        structure = np.repeat(structures, self.samples_per_structure)
        if self.own_structures:
            motion = np.repeat(structures // np.int32(self.own_structures), levels)
            im_level = np.tile(self.levels, len(structures))
        else:
            of_place, level = self.places
            motion = np.tile(of_place, len(structures))
            im_level = np.tile(np.asarray(self.levels)[level], len(structures))
        scale = self.measure.scale_factors(im_level, self._intensities[motion])
        repeats = levels if self.motions_of_levels is None else 1
        label = self.measure.attributes(), self.intensity_units
        return Assignment(structure, motion, scale, im_level, *label, is_striped=True, repeats=repeats)


@with_suggestions
@dataclass(frozen=True, eq=False, repr=False)
class Cloud(Design):
    """Unscaled ground motions; each motion acts on every structure (cloud analysis).

    Args:
        motions: Ground motions.
        measure: The intensity measure that is recorded for each sample, in g if it is an acceleration.

    Raises:
        ValueError: If `motions` is empty.
        TypeError: If a motion is not a GroundMotion, or `measure` is not an intensity measure.

    Example:
        >>> design = wd.Cloud(motions, wd.PeakGroundVelocity())
        >>> design.samples_per_structure
        8
    """

    motions: Sequence[Any]  # GroundMotions, or PairOfMotions
    measure: IntensityMeasure = PeakGroundAcceleration()  # noqa: RUF009 (frozen)
    is_same_for_all = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "motions", checked_motions(self.motions, or_pairs=True))
        object.__setattr__(self, "measure", measure_for(self.motions, self.measure))
        warn_of_duplicates(self.motions, is_scaled=False)
        object.__setattr__(self, "_intensities", intensities_of(self.motions, self.measure))

    @property
    def samples_per_structure(self) -> int:
        """Number of samples per structure: the number of motions."""
        return len(self.motions)

    def assign(self, structures: np.ndarray, seed: int, event: int = 0) -> Assignment:
        """Return structure, motion and scale factor (1) of each sample: one sample per structure and motion."""
        structure = np.repeat(np.asarray(structures, dtype=np.int32), self.samples_per_structure)
        motion = np.tile(np.arange(len(self.motions), dtype=np.int32), len(structures))
        im_level = self._intensities[motion]
        return Assignment(
            structure, motion, np.ones(structure.size), im_level, self.measure.attributes(), self.measure.level_units
        )


@with_suggestions
@dataclass(frozen=True, eq=False, repr=False)
class OneMotionPerStructure(Design):
    """One ground motion per structure, given or drawn at random, with a scale factor.

    Args:
        motions: Ground motions.
        motion: Index into `motions` for each structure, shape [structure]; None: drawn at random.
        scale: Factor that multiplies the motion [1]: one for all structures, or one per structure, shape [structure].
        measure: The intensity measure that is recorded for each sample, in g if it is an acceleration.

    Raises:
        ValueError: If an index is out of range, a scale is not finite and positive, or `motion` and `scale` have
            different numbers of values.
        TypeError: If a motion is not a GroundMotion, or `measure` is not an intensity measure.

    Example:
        >>> design = wd.OneMotionPerStructure(motions, motion=[0, 3, 3], scale=[1.0, 0.5, 2.0])
        >>> wd.Scene(building, design).structures_given
        3
    """

    motions: Sequence[GroundMotion]
    motion: ArrayLike | None = None
    scale: ArrayLike = 1.0
    measure: IntensityMeasure = PeakGroundAcceleration()  # noqa: RUF009 (frozen)

    def __post_init__(self) -> None:
        motions = checked_motions(self.motions, or_pairs=True)
        object.__setattr__(self, "measure", measure_for(motions, self.measure))
        scale = real_numbers("scale", self.scale)
        if scale.ndim > 1 or not np.all(np.isfinite(scale) & (scale > 0)):
            raise ValueError(
                f"scale must be one factor, or one per sample, each finite and above 0, got {shortened(self.scale)}"
            )
        if self.motion is not None:
            motion = np.atleast_1d(finite_numbers("motion", self.motion))
            if motion.size and not np.any(motion % 1):
                motion = motion.astype(np.int64)
            if not motion.size or motion.ndim != 1 or not np.issubdtype(motion.dtype, np.integer):
                raise ValueError(
                    "motion must be a row of whole numbers, one per sample, such as [0, 0, 1], got "
                    f"{shortened(self.motion)}"
                )
            if motion.min() < 0 or motion.max() >= len(motions):
                raise ValueError(
                    f"motion must be from 0 to {len(motions) - 1}, the indices of the motions, "
                    f"got {motion.min()} to {motion.max()}"
                )
            if scale.ndim and scale.size != motion.size:
                raise ValueError(
                    f"motion has {amount_of(motion.size, 'value')} and scale has {scale.size}: give one value per "
                    "sample for both, or one factor as scale="
                )
            object.__setattr__(self, "motion", motion.astype(np.int32))
        object.__setattr__(self, "motions", motions)
        object.__setattr__(self, "scale", scale)
        object.__setattr__(self, "_intensities", intensities_of(motions, self.measure))

    samples_per_structure = 1

    def check_structures(self, structures: int) -> None:
        """Raise a ValueError if `motion` or `scale` lists values for another number of structures than `structures`."""
        for name, values in (("motion", self.motion), ("scale", self.scale)):
            if values is not None and np.ndim(values) and np.size(values) != structures:
                raise ValueError(
                    f"OneMotionPerStructure.{name} has {amount_of(np.size(values), 'value')}, but the run has "
                    f"{amount_of(structures, 'structure')}: give one value per structure (of a portfolio: per "
                    f"building), or simulate(..., structures={np.size(values)})"
                )

    @property
    def structures_given(self) -> int:
        """Number of structures for which `motion` or `scale` lists values; 0 if neither lists values."""
        given = [np.asarray(values) for values in (self.motion, self.scale) if values is not None]
        return max((values.size for values in given if values.ndim), default=0)

    def of_structures(self, structures: np.ndarray, seed: int) -> OneMotionPerStructure:
        """Return the design for some structures of a run, given by indices; their random motions stay the same."""
        own = self.assign(structures, seed)
        return OneMotionPerStructure(self.motions, own.motion, own.scale, self.measure)

    def assign(self, structures: np.ndarray, seed: int, event: int = 0) -> Assignment:
        """Return the motion and scale factor of each structure with a given index: one sample per structure.

        Motions that are drawn at random differ between the events of an EventSequence.
        """
        index = np.asarray(structures, dtype=np.int32)
        if self.motion is None:
            random = uniforms(seed, index, Purpose.CHOICE_OF_MOTION, event)[:, 0]
            motion = (random * len(self.motions)).astype(np.int32)
        else:
            motion = np.asarray(self.motion)[index]
        scale = np.asarray(self.scale)
        scale = scale[index] if scale.ndim else np.full(index.size, float(scale))
        im_level = self.measure.scaled_levels(scale, self._intensities[motion])
        return Assignment(index, motion, scale, im_level, self.measure.attributes(), self.measure.level_units)


def excitation_of(given: object) -> object:
    """Return the argument `excitation` of a scene; a single ground motion is converted to a Cloud."""
    return Cloud((given,)) if isinstance(given, GroundMotion | PairOfMotions) else given
