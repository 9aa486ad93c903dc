"""The design of a region: every structure under the motions of sites near it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import is_row_of_text, real_numbers, shortened, unmasked
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.ground_motions.designs import Design, intensities_of
from warpdyn.model.ground_motions.excitation import Assignment
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.measures.one_component import PeakGroundAcceleration
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions


@with_suggestions
@dataclass(frozen=True, eq=False, repr=False)
class MotionsAtSites(Design):
    """Every structure under the motions of a site near it, for each of some draws.

    Sites have a motion (or both components of one) with a factor in each earthquake. A draw is an earthquake and, of
    each structure, a site. Samples are ordered by structure, then draw, then component. `wd.sites` makes the design of
    files: EventGrid.csv, ShakeMaps and ground motion fields.

    Args:
        motions: Ground motions.
        motion: Index into `motions` at each site in each earthquake, shape [site, earthquake, component].
        scale: Factor on it [1], of this shape or one that broadcasts to it; 0 where there is no shaking.
        site: Site of each structure in each draw, shape [structure, draw].
        earthquake: Earthquake of each draw, shape [draw]; None for one after the other, and the first again after the
            last.
        names: Names of the earthquakes; None to number them.
        measure: The intensity measure that labels the samples, in g where it is an acceleration.

    Raises:
        ValueError: If a shape does not fit, an index is out of range, or a factor is not finite or below 0.
        TypeError: If a motion is no GroundMotion, or the measure is none.

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
                f"scale has shape {scale.shape}, which does not go with {motion.shape} of motion"
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
            raise ValueError(f"earthquake has {earthquake.size} values, and site has {draws} draws")
        if self.names is not None and not is_row_of_text(self.names):
            raise TypeError(f"names must be a name of each earthquake, got {shortened(self.names)}")
        names = tuple(map(str, range(earthquakes) if self.names is None else self.names))
        if len(names) != earthquakes:
            raise ValueError(f"names has {len(names)} values, and motion has {earthquakes} earthquakes")
        values = {"motions": motions, "motion": motion, "scale": scale, "names": names, "earthquake": earthquake}
        # Millions of structures with many draws each: as few bytes as hold the numbers of the sites.
        values |= {"site": site.astype(np.min_scalar_type(sites - 1), copy=False)}
        values |= {"_intensities": intensities_of(motions, self.measure)}
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        structures, draws = np.shape(self.site)
        sites, earthquakes, components = np.shape(self.motion)
        said = f"{structures:,} structures at {sites:,} sites, {draws} draws of {earthquakes} earthquakes"
        return f"MotionsAtSites({said}{', both components' if components == 2 else ''})"

    @property
    def components(self) -> int:
        """Motions that a structure has in each draw."""
        return np.shape(self.motion)[2]

    @property
    def samples_per_structure(self) -> int:
        """Number of draws times that of components."""
        return np.shape(self.site)[1] * self.components

    @property
    def structures_given(self) -> int:
        """How many structures have sites."""
        return np.shape(self.site)[0]

    def check_structures(self, structures: int) -> None:
        """Raise a ValueError unless so many structures have sites."""
        if structures != self.structures_given:
            raise ValueError(f"MotionsAtSites.site has {self.structures_given} rows for {structures} structures")

    def of_structures(self, structures: np.ndarray, seed: int) -> MotionsAtSites:
        """Return the design of some structures of a run, given by their indices."""
        part = object.__new__(MotionsAtSites)  # all else is checked, and shared
        for name, value in vars(self).items():
            object.__setattr__(part, name, value[structures] if name == "site" else value)
        return part

    def assign(self, structures: np.ndarray, seed: int, event: int = 0) -> Assignment:
        """Return the samples of each of these structures, given by their indices."""
        index = np.asarray(structures, dtype=np.int32)
        site, earthquake = np.asarray(self.site)[index], np.asarray(self.earthquake)
        motion = np.asarray(self.motion)[site, earthquake].ravel()
        scale = np.asarray(self.scale)[site, earthquake].ravel().astype(np.float64)
        structure = np.repeat(index, self.samples_per_structure)
        im_level = self.measure.scaled_levels(scale, self._intensities[motion])
        return Assignment(structure, motion, scale, im_level, self.measure.attributes(), self.measure.level_units)


def _indices(what: str, values: ArrayLike, ndim: int, count: int, axes: str) -> np.ndarray:
    """Return whole numbers below a count as an array of some axes; raise a ValueError if they are not."""
    array = unmasked(what, values) if isinstance(values, np.ndarray) else real_numbers(what, values)
    if array.dtype.kind == "f" and array.size and np.all(np.isfinite(array)) and not np.any(array % 1):
        array = array.astype(np.int64)
    if array.ndim != ndim or array.dtype.kind not in "iu" or not array.size:
        raise ValueError(f"{what} must be whole numbers of the shape {axes}, got {array.dtype} {array.shape}")
    if array.min() < 0 or array.max() >= count:
        raise ValueError(f"{what} must lie from 0 to {count - 1}, got {array.min()} to {array.max()}")
    return array if array.dtype == np.int32 or ndim == 2 else array.astype(np.int32)
