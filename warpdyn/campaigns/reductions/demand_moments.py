"""Moments (mean, variance) and largest values of a demand, computed during the run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from warpdyn.campaigns.reductions.cells import Cells, Coordinates, Variables
from warpdyn.campaigns.reductions.merging import Reducer
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.statistic import Statistic, failures
from warpdyn.campaigns.reductions.tally import FAILURES, Block, Sums, Tally
from warpdyn.campaigns.reductions.workers import Workers
from warpdyn.foundations.core.near_misses import with_suggestions

SPLITTER = 2.0**27 + 1.0  # splits a float64 number into two halves whose products are exact (Dekker 1971)


@with_suggestions
@dataclass(frozen=True, eq=False)
class DemandMoments(Statistic):
    """Mean and variance of a demand over the samples that neither collapsed nor failed.

    Args:
        demand: Variable that the scene records, such as "peak_storey_drift_ratio". If a sample has several values
            (storeys or floors), the largest absolute value counts.
        each_place: Whether the moments at each storey (or floor) are also computed, in addition to those of the largest
            value.
        over: Dimensions of the moments, such as "building" or ("archetype", "motion"); see `Statistic`.
        labels: Labels of structures, by names that `over` contains; see `Statistic`.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count for the largest value.

    Raises:
        ValueError: If `labels` has a name that is not in `over`; when a run begins, if the scene does not record the
            demand.
        TypeError: If `over` is neither a name nor a list of names, or `labels` is not a mapping.

    Example:
        >>> found = wd.simulate(scene, structures=3, statistics=wd.DemandMoments("peak_base_shear", over="stripe"))
        >>> (found["peak_base_shear_mean_by_stripe"] / 1e3).round().values  # kN
        array([173., 248., 295., 316., 343., 409.])
    """

    demand: str
    each_place: bool = False

    def reducer(self, population: Population) -> SumsReducer:
        """Return the reducer that adds the samples of a run to the moments."""
        return SumsReducer(self, population)


@with_suggestions
@dataclass(frozen=True, eq=False)
class LargestDemand(Statistic):
    """The largest value of a demand over the samples that neither collapsed nor failed.

    Args:
        demand: Variable that the scene records. If a sample has several values (storeys or floors), the largest
            absolute value counts.
        each_place: Whether the largest value at each storey (or floor) is also computed.
        over: Dimensions of the largest demand, such as "building" or ("archetype", "motion"); see `Statistic`.
        labels: Labels of structures, by names that `over` contains; see `Statistic`.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count for the largest value.

    Raises:
        ValueError: If `labels` has a name that is not in `over`; when a run begins, if the scene does not record the
            demand.
        TypeError: If `over` is neither a name nor a list of names, or `labels` is not a mapping.

    Example:
        >>> found = wd.simulate(scene, structures=3, statistics=wd.LargestDemand("peak_storey_drift_ratio"))
        >>> round(float(found["peak_storey_drift_ratio_largest"]), 3)
        0.046
    """

    demand: str
    each_place: bool = False

    def reducer(self, population: Population) -> SumsReducer:
        """Return the reducer that finds the largest values of a run's samples."""
        return SumsReducer(self, population)


class SumsReducer(Reducer):
    """Reducer that sums a demand and its square over the samples of a run, and finds its largest value, by cell.

    Args:
        statistic: The statistic: DemandMoments or LargestDemand.
        population: Structures, motions and levels of the samples.
    """

    def __init__(self, statistic: DemandMoments | LargestDemand, population: Population) -> None:
        self.population, self.demand = population, statistic.demand
        self.is_largest, self._added = isinstance(statistic, LargestDemand), statistic.added_storeys
        cells = statistic.cells(population)
        own = dict(added_storeys=self._added, each_period=statistic.each_place)
        dims = population.demand(self.demand, **own).dims
        if statistic.each_place and not dims:
            raise ValueError(
                f"each_place=True needs a demand with a value for each storey or floor, but {self.demand} has one "
                "value for the structure: remove each_place="
            )
        self.dims, self._has_places = dims if statistic.each_place else (), bool(dims)
        self.needs = cells.needs([self.demand])
        self.begin(cells)

    def begin(self, cells: Cells) -> None:
        """Start with empty counts and sums for the given cells of the statistic."""
        self.lengths = tuple(map(self.population.length_along, self.dims))
        places = math.prod(self.lengths) if self.dims else 0
        self.cells = cells
        self.tally = Tally(cells, places + 1, 2)  # two states: ok and collapsed
        self.sums = [Sums(cells) for _ in range(places + 1)]  # for each place, and for the largest value of all places

    @property
    def sums_by_cell(self) -> list[Sums]:
        """The sums for each storey or floor, and for the largest value of all storeys or floors."""
        return self.sums

    def add(self, block: Block, workers: Workers) -> None:
        """Add the samples of a block (structures of a run that are integrated together) to the counts and sums."""
        places = block.demand(self.demand).shape[1] if self.dims else 0  # a building may have fewer storeys than others
        none = workers.no_states((places + 1, block.samples))
        self.tally.add(block, none, workers)
        for place in range(places):
            self.sums[place].add(block, self.demand, True, place, workers)
        counted = self.population.counted_places(self.demand, block.structures, added_storeys=self._added)
        self.sums[-1].add(block, self.demand, not self._has_places, -1, workers, counted=counted)

    def variables(self) -> tuple[Variables, Coordinates]:
        """Return the moments or largest values, and the numbers of samples, as variables for the dataset."""
        cells, counts = self.cells, self.tally.counts
        variables, coordinates = outcomes(self, counts[-1])
        self._name(variables, "", cells.dims, [self.sums[-1]], counts[-1:])
        if self.dims:
            self._name(variables, f"{self.dims[0]}_", (*self.dims, *cells.dims), self.sums[:-1], counts[:-1])
            scene = self.population.scene
            numbered = scene.structure.numbered(scene.recorders)
            numbered |= scene.floor_spectra.coordinate if scene.floor_spectra else {}
            coordinates |= {name: each for name, each in numbered.items() if name in self.dims}
        return variables, coordinates

    def _name(
        self, variables: Variables, before: str, dims: tuple[str, ...], sums: Sequence[Sums], counts: np.ndarray
    ) -> None:
        """Compute the statistics of some storeys or floors, and add them to `variables`.

        Args:
            variables: Variables of the dataset, which are extended.
            before: Beginning of the variable names: "storey_", "floor_", or "" for the largest value.
            dims: Dimensions of the variables.
            sums: Sums of each storey or floor.
            counts: Numbers of samples of each storey or floor, by cell and outcome.
        """
        demand = self.population.demand(self.demand, each_period=True)
        units, long_name = demand.units, demand.long_name
        shape, totals = self.cells.shape, np.stack([each.totals for each in sums])
        number = counts[..., 0]

        def put(what: str, values: np.ndarray, units: str) -> None:
            table = values.reshape(*self.lengths, *shape) if before else values.reshape(shape)
            said = {"long_name": f"{what} of {long_name}, of samples that stand", "units": units}
            variables[f"{before}{self.demand}_{what}{self.cells.suffix}"] = (dims, table, said)

        if self.is_largest:
            put("largest", np.where(number > 0, totals[..., -1], np.nan), units)
        else:
            mean, variance = moments(number, totals)
            put("mean", mean, units)
            put("variance", variance, "1" if units == "1" else f"({units})2")


def moments(count: np.ndarray, totals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean and the unbiased variance; NaN if there are too few samples.

    The variance is a difference of two large sums; it is computed with twice as many digits as float64.

    Args:
        count: Number of samples, of any shape.
        totals: Sums from `Sums.totals`, with the shape of `count` and a last axis for the kind of sum.
    """
    number = count.astype(np.float64)
    total, left_out, squares, left_out_of_squares = (totals[..., place] for place in range(4))
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(count > 0, (total + left_out) / number, np.nan)
        square, error = exact_product(total, total)
        share = square / number
        back, error_of_back = exact_product(share, number)
        rest = (square - back) - error_of_back + error + 2.0 * total * left_out
        spread = (squares - share) + (left_out_of_squares - rest / number)
        variance = np.where(count > 1, np.maximum(spread, 0.0) / (number - 1.0), np.nan)
    return mean, variance


def exact_product(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the product of two numbers and its rounding error (Dekker 1971, Numerische Mathematik 18)."""
    product = one * other
    high, others_high = (SPLITTER * each - (SPLITTER * each - each) for each in (one, other))
    low, others_low = one - high, other - others_high
    return product, ((high * others_high - product) + high * others_low + low * others_high) + low * others_low


def outcomes(reducer: SumsReducer, counts: np.ndarray) -> tuple[Variables, Coordinates]:
    """Return the numbers of samples that are ok, collapsed and failed, as variables for the dataset.

    `counts` contains the number of samples, shape [cell, outcome].
    """
    cells = reducer.cells
    variables, coordinates = failures(cells, counts[:, -len(FAILURES) :])
    for place, (name, text) in enumerate((("standing_count", "stand"), ("collapsed_count", "collapsed"))):
        said = {"long_name": f"samples that {text}", "units": "1"}
        variables[f"{name}{cells.suffix}"] = (cells.dims, counts[:, place].reshape(cells.shape), said)
    return variables, coordinates | cells.coordinates
