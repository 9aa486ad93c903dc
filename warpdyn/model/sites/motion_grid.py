"""Ground motions at the points of a grid, and the excitation in which buildings get the motions of nearby points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.foundations.core.checks import (
    check_dataset,
    check_kind,
    check_memory,
    one_of,
    real_number,
    unmasked,
    whole_number,
)
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.random_numbers import Purpose, uniform_rows
from warpdyn.foundations.core.thread_pool import cores, in_parts
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.measures.one_component import PeakGroundAcceleration
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.motions_at_sites import MotionsAtSites
from warpdyn.model.inventories.stock import BuildingStock
from warpdyn.model.sites.places import inverse_distance_weights, nearest_points

DRAW, MEAN = "draw", "mean"  # values of the argument `choice`


@with_suggestions
@dataclass(frozen=True, eq=False)
class MotionGrid:
    """Ground motions at the points of a grid in one or several earthquakes.

    Args:
        longitude: Longitudes of the points [degree], shape [point].
        latitude: Latitudes of the points [degree], shape [point].
        motions: The ground motions, each listed once.
        motion: Index into `motions`, shape [point, earthquake, component].
        scale: Factor that multiplies the motion [1], shape [point, earthquake, component].
        points: Names of the points.
        earthquakes: Names of the earthquakes.
        measure: The intensity measure that is recorded for each sample.

    Example:
        >>> longitude, latitude = np.array([-122.3, -122.2]), np.array([37.8, 37.8])
        >>> motion, scale = np.array([[[0]], [[1]]]), np.ones((2, 1, 1))  # by point, earthquake and component
        >>> grid = wd.sites.MotionGrid(longitude, latitude, motions, motion, scale, ["west", "east"], ["quake"])
        >>> grid.at(inventory, stock, draws=25, neighbours=2, reach=20e3).samples_per_structure
        25
    """

    longitude: np.ndarray
    latitude: np.ndarray
    motions: Sequence[GroundMotion]
    motion: np.ndarray
    scale: np.ndarray
    points: Sequence[str]
    earthquakes: Sequence[str]
    measure: IntensityMeasure = PeakGroundAcceleration()  # noqa: RUF009 (frozen)

    def __repr__(self) -> str:
        points, earthquakes, components = self.motion.shape
        both = ", both components" if components == 2 else ""
        return f"MotionGrid({points:,} points, {earthquakes} earthquakes of {len(self.motions)} motions{both})"

    def at(
        self,
        inventory: pd.DataFrame,
        rows: BuildingStock | np.ndarray | None = None,
        *,
        draws: int | None = None,
        neighbours: int = 4,
        choice: str = DRAW,
        reach: float | None = None,
        seed: int = 0,
    ) -> MotionsAtSites:
        """Return the excitation in which buildings get the motions of the nearest grid points.

        Each of the nearest points has a weight in proportion to 1 / distance squared. By default, each draw chooses one
        of these points at random, with its weight as probability, as SimCenter's NearestNeighborEvents does (SimCenter
        uses distances in degrees, warpdyn great-circle distances). Therefore, neighbouring buildings may get motions of
        different points. The draws of a building depend only on the seed and on the building's row in the inventory.

        Args:
            inventory: The buildings, from a reader of `wd.inventories`.
            rows: Order of the buildings. A BuildingStock made from the inventory: the order of its portfolio; an array:
                the inventory row of each building, or a mask of rows; None: all rows of the inventory in their order,
                which is usually not that of a portfolio.
            draws: Number of draws of each building (25 in SimCenter's Bay Area testbed). Draw `i` has the motion of
                earthquake `i`; after the last earthquake, the first follows. None: the number of earthquakes.
            neighbours: Number of nearest points that may be chosen.
            choice: "draw" (one of the points), or "mean" (the motion with the weighted mean of the points' factors;
                all points must have the same motion in an earthquake, as in the result of `scale_records`).
            reach: Largest allowed distance of a building from its nearest point [m]; None: the grid's spacing, i.e. the
                median distance of a point from its third neighbour.
            seed: Seed of the draws.

        Returns:
            The excitation for a Scene whose structure is the portfolio.

        Raises:
            ValueError: If buildings are farther from the grid than `reach`, the stock was made from another inventory,
                or an argument is out of range.
            TypeError: If `inventory` is not a DataFrame.

        Example:
            >>> grid = wd.sites.read_event_grid("records/EventGrid.csv", unit="g")
            >>> design = grid.at(inventory, stock, draws=25, neighbours=2, reach=20e3, seed=1)
            >>> region = wd.Scene(stock.portfolio, design, recorders=("drift",))
        """
        check_kind("MotionGrid.at", "an inventory", inventory, pd.DataFrame, argument="inventory")
        one_of("choice", choice, (DRAW, MEAN))
        count = len(self.earthquakes) if draws is None else whole_number("draws", draws, 1)
        neighbours, seed = whole_number("neighbours", neighbours, 1), whole_number("seed", seed, 0)
        reach = None if reach is None else real_number("reach [m]", reach, above=0)
        if isinstance(rows, BuildingStock):
            rows.check(inventory)
            rows = rows.rows
        # Each building and draw needs a random number and the index of a point.
        check_memory(f"draws={count} of {len(inventory)} buildings", 8 * count * len(inventory), "give fewer draws")
        every = np.arange(len(inventory))
        if rows is not None:
            rows = np.asarray(rows) if isinstance(rows, list | tuple | np.ndarray | pd.Series) else np.zeros(0)
            if rows.ndim != 1 or not rows.size or rows.dtype.kind not in "iub":
                raise TypeError(
                    "MotionGrid.at: rows must be a BuildingStock, the numbers of rows of the inventory (from 0), or a "
                    "mask with True for the rows to use"
                )
        rows = every if rows is None else every[unmasked("rows", rows)]  # `rows` are indices or a mask
        grid = self.longitude, self.latitude
        index, distance = nearest_points("MotionGrid.at", inventory, rows, *grid, neighbours, reach)
        earthquake = np.arange(count) % len(self.earthquakes)
        if choice == MEAN:
            if np.any(self.motion != self.motion[:1]):
                raise ValueError(
                    "MotionGrid.at: choice='mean' needs the same motion at all points in an earthquake, as in a grid "
                    "of scale_records: give choice='draw'"
                )
            scale, weights = np.zeros((rows.size, *self.scale.shape[1:])), inverse_distance_weights(distance)
            for near in range(index.shape[1]):
                scale += weights[:, near, None, None] * self.scale[index[:, near]]
            motion = np.broadcast_to(self.motion[0], scale.shape)
            site = np.broadcast_to(np.arange(rows.size)[:, None], (rows.size, count))
        else:
            motion, scale = self.motion, self.scale
            site = _drawn_points(index, distance, rows, len(inventory), count, seed)
        return MotionsAtSites(self.motions, motion, scale, site, earthquake, self.earthquakes, self.measure)


def _drawn_points(
    index: np.ndarray, distance: np.ndarray, rows: np.ndarray, buildings: int, draws: int, seed: int
) -> np.ndarray:
    """Return the index of the point that each building gets in each draw, shape [building, draw].

    Args:
        index: Indices of the nearest points of each building, shape [building, neighbour].
        distance: Their distances [m], shape [building, neighbour]. A point's probability falls with 1 / distance^2.
        rows: Row of each building in the inventory, shape [building].
        buildings: Number of rows of the inventory.
        draws: Number of draws.
        seed: Seed of the draws.
    """
    # The random numbers of a building depend only on its row in the inventory, not on the other rows.
    random = uniform_rows(seed, Purpose.GRID_POINTS, buildings, draws)
    found = np.empty((rows.size, draws), np.min_scalar_type(index.max()))

    def fill(part: slice) -> None:
        own, near = random[rows[part]], index[part].astype(found.dtype)
        bounds = np.cumsum(inverse_distance_weights(distance[part]), axis=1)[:, :-1]
        found[part] = near[:, :1]
        for bound, point in zip(bounds.T, near[:, 1:].T, strict=True):
            np.copyto(found[part], point[:, None], where=own >= bound[:, None])

    in_parts(fill, rows.size, cores())
    return found


def label_samples(run: xr.Dataset, design: MotionsAtSites) -> xr.Dataset:
    """Return a run with additional coordinates: the draw, earthquake and site of each sample.

    Args:
        run: The result of `simulate`, or some of its samples, for a scene with MotionsAtSites.
        design: The MotionsAtSites of the scene.

    Returns:
        The run with the coordinates `draw_index`, `earthquake_index` and `site_index` along `sample`, and
        `earthquake_name` along `earthquake`. With these, `damage_shares(run, limits, events=run["draw_index"])` gives
        the shares of damaged buildings in each draw; the worse of two components counts.

    Raises:
        ValueError: If the run has more structures than the design.
        TypeError: If an argument is of the wrong kind.

    Example:
        >>> design = wd.MotionsAtSites(motions, [[[0]], [[1]]], 1.0, site=[[0, 0], [1, 1], [1, 0]])
        >>> run = wd.simulate(wd.Scene(stock.portfolio, design, recorders=("drift",)))
        >>> labelled = wd.sites.label_samples(run, design)
        >>> labelled["site_index"].values.tolist()
        [0, 0, 1, 1, 1, 0]
    """
    check_dataset("label_samples", run, "sample", advice="give the result of simulate()", argument="run")
    check_kind("label_samples", "the MotionsAtSites of the run", design, MotionsAtSites, argument="design")
    site = np.asarray(design.site)
    structure, place = np.divmod(run["sample"].values.astype(np.int64), design.samples_per_structure)
    if structure.size and structure.max() >= site.shape[0]:
        raise ValueError(
            f"label_samples: the run has {structure.max() + 1:,} or more structures, but the design has "
            f"{site.shape[0]:,}: give the design of the run's scene"
        )
    draw = place // design.components
    units = {"units": "1"}
    coordinates = {
        "draw_index": (draw, "index of the draw"),
        "earthquake_index": (np.asarray(design.earthquake)[draw], "index along the dimension earthquake"),
        "site_index": (site[structure, draw], "index of the site of the design"),
    }
    labelled = {
        name: ("sample", at.astype(np.int32), units | {"long_name": text}) for name, (at, text) in coordinates.items()
    }
    names = np.array(list(design.names or ()), dtype=str)
    return run.assign_coords(
        labelled | {"earthquake_name": ("earthquake", names, {"long_name": "name of the earthquake"})}
    )
