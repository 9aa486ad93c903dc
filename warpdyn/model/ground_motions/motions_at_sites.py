"""The excitation of a region: every structure has the ground motions of nearby sites."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import is_row_of_text, real_numbers, shortened, unmasked
from warpdyn.foundations.core.messages import amount_of
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.ground_motions.designs import Design
from warpdyn.model.ground_motions.excitation import Assignment, MotionTable
from warpdyn.model.ground_motions.intensities import intensities_of
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.measures.one_component import PeakGroundAcceleration
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions


@with_suggestions
@dataclass(frozen=True, eq=False, repr=False)
class MotionsAtSites(Design):
    """Ground motions at sites; in each draw, every structure has the motion of one nearby site.

    In each earthquake, a site has one motion, or both components of a record, with a scale factor. A draw is the choice
    of an earthquake and of one site per structure. Samples are ordered by structure, then draw, then component.
    `wd.sites` makes this excitation from EventGrid.csv, ShakeMaps and ground motion fields.

    Args:
        motions: Ground motions.
        motion: Index into `motions` at each site in each earthquake, shape [site, earthquake, component].
        scale: Factor that multiplies the motion [1], with the shape of `motion` or broadcast to it; 0: no shaking.
        site: Index of the site of each structure in each draw, shape [structure, draw].
        earthquake: Index of the earthquake of each draw, shape [draw]; None: 0, 1, 2 and so on; after the last
            earthquake the first follows.
        names: Names of the earthquakes; None: numbers.
        measure: The intensity measure that is recorded for each sample, in g if it is an acceleration.

    Raises:
        ValueError: If a shape is wrong, an index is out of range, or a factor is not finite or below 0.
        TypeError: If a motion is not a GroundMotion, or `measure` is not an intensity measure.

    Example:
        >>> site = [[0], [1], [1]]  # of three structures at two sites
        >>> design = wd.MotionsAtSites(motions, [[[0]], [[1]]], 1.0, site)
        >>> design.structures_given
        3
    """

    motions: Sequence[GroundMotion]
    motion: ArrayLike
    scale: ArrayLike
    site: ArrayLike
    earthquake: ArrayLike | None = None
    names: Sequence[str] | None = None
    measure: IntensityMeasure = PeakGroundAcceleration()  # noqa: RUF009 (frozen)

    def __post_init__(self) -> None:
        motions = checked_motions(self.motions)
        motion = _indices("motion", self.motion, 3, len(motions), "[site, earthquake, component]")
        sites, earthquakes, _ = motion.shape
        scale = unmasked("scale", self.scale) if isinstance(self.scale, np.ndarray) else self.scale
        if not isinstance(scale, np.ndarray) or scale.dtype.kind != "f":  # broadcast arrays stay views
            scale = real_numbers("scale", self.scale)
        try:
            scale = np.broadcast_to(scale, motion.shape)
        except ValueError:
            raise ValueError(
                f"scale has shape {scale.shape}, and motion has shape {motion.shape}: give one factor, or "
                "one for each value of motion"
            ) from None
        bad = ~(np.isfinite(scale) & (scale >= 0))
        if bad.any():
            place = tuple(np.argwhere(bad)[0].tolist())
            raise ValueError(f"scale{list(place)} is {scale[place]}: factors must be finite and at least 0")
        site = _indices("site", self.site, 2, sites, "[structure, draw]")
        draws = site.shape[1]
        drawn = np.arange(draws) % earthquakes if self.earthquake is None else self.earthquake
        earthquake = _indices("earthquake", drawn, 1, earthquakes, "[draw]")
        if earthquake.size != draws:
            raise ValueError(
                f"earthquake has {amount_of(earthquake.size, 'value')}, and site has {amount_of(draws, 'draw')}: give "
                "one earthquake per draw"
            )
        if self.names is not None and not is_row_of_text(self.names):
            raise TypeError(f"names must be a list with the name of each earthquake, got {shortened(self.names)}")
        names = tuple(map(str, range(earthquakes) if self.names is None else self.names))
        if len(names) != earthquakes:
            raise ValueError(
                f"names has {amount_of(len(names), 'value')}, and motion has {amount_of(earthquakes, 'earthquake')}: "
                "give one name per earthquake"
            )
        values = {"motions": motions, "motion": motion, "scale": scale, "names": names, "earthquake": earthquake}
        # The smallest integer type for the sites, because a region has millions of structures with many draws.
        values |= {"site": site.astype(np.min_scalar_type(sites - 1), copy=False)}
        values |= {"_intensities": intensities_of(motions, self.measure)}
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        structures, draws = np.shape(self.site)
        sites, earthquakes, components = np.shape(self.motion)
        text = f"{structures:,} structures at {sites:,} sites, {draws} draws of {earthquakes} earthquakes"
        return f"MotionsAtSites({text}{', both components' if components == 2 else ''})"

    @property
    def components(self) -> int:
        """Number of components: motions of a structure in each draw, 1 or 2."""
        return np.shape(self.motion)[2]

    @property
    def samples_per_structure(self) -> int:
        """Number of draws times number of components."""
        return np.shape(self.site)[1] * self.components

    @property
    def structures_given(self) -> int:
        """Number of structures for which `site` lists sites."""
        return np.shape(self.site)[0]

    def check_structures(self, structures: int) -> None:
        """Raise a ValueError if the number of structures differs from that of the rows of `site`."""
        if structures != self.structures_given:
            raise ValueError(
                f"MotionsAtSites.site has {amount_of(self.structures_given, 'row')}, but the run has "
                f"{amount_of(structures, 'structure')}: give one row per structure (of a portfolio: per "
                f"building), or simulate(..., structures={self.structures_given})"
            )

    def of_structures(self, structures: np.ndarray, seed: int) -> MotionsAtSites:
        """Return the excitation for the structures of a run with these indices."""
        part = object.__new__(MotionsAtSites)  # without checks: other values are shared
        for name, value in vars(self).items():
            object.__setattr__(part, name, value[structures] if name == "site" else value)
        return part

    def assign(self, structures: np.ndarray, seed: int, event: int = 0) -> Assignment:
        """Return the samples of the structures with these indices."""
        index = np.asarray(structures, dtype=np.int32)
        site, earthquake = np.asarray(self.site)[index], np.asarray(self.earthquake)
        motion = np.asarray(self.motion)[site, earthquake].ravel()
        scale = np.asarray(self.scale)[site, earthquake].ravel().astype(np.float64)
        structure = np.repeat(index, self.samples_per_structure)
        im_level = self.measure.scaled_levels(scale, self._intensities[motion])
        return Assignment(structure, motion, scale, im_level, self.measure.attributes(), self.measure.level_units)

    def motion_table(self) -> MotionTable:
        """Return the motions of all sites and earthquakes, and which of them are those of each structure."""
        motion, scale = np.ravel(self.motion), np.ravel(self.scale).astype(np.float64)
        level = self.measure.scaled_levels(scale, self._intensities[motion])
        attributes, units = self.measure.attributes(), self.measure.level_units
        entries = Assignment(np.zeros(0, np.int32), motion, scale, level, attributes, units)
        components = self.components
        offset = np.add.outer(np.asarray(self.earthquake) * components, np.arange(components)).ravel()
        return MotionTable(entries, np.asarray(self.site), offset, np.shape(self.motion)[1] * components)


def _indices(what: str, values: ArrayLike, ndim: int, count: int, axes: str) -> np.ndarray:
    """Return indices below `count` as an array with these axes, or raise a ValueError."""
    array = unmasked(what, values) if isinstance(values, np.ndarray) else real_numbers(what, values)
    if array.dtype.kind == "f" and array.size and np.all(np.isfinite(array)) and not np.any(array % 1):
        array = array.astype(np.int64)
    if array.ndim != ndim or array.dtype.kind not in "iu" or not array.size:
        raise ValueError(f"{what} must be whole numbers of the shape {axes}, got {array.dtype} {array.shape}")
    if array.min() < 0 or array.max() >= count:
        raise ValueError(f"{what} must be from 0 to {count - 1}, got {array.min()} to {array.max()}")
    return array if array.dtype == np.int32 or ndim == 2 else array.astype(np.int32)
