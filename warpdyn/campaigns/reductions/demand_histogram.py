"""Histograms and quantiles of a demand, computed during the run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.campaigns.reductions.cells import Cells, Coordinates, Variables
from warpdyn.campaigns.reductions.limits import DRIFT
from warpdyn.campaigns.reductions.merging import Reducer
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.statistic import Statistic, failures
from warpdyn.campaigns.reductions.tally import Block, Tally, find_states, searched
from warpdyn.campaigns.reductions.workers import Workers
from warpdyn.foundations.core.checks import finite_numbers, shortened
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.plausibility import warn_of_implausible_limits

MOST_EDGES = 10_000


@with_suggestions
@dataclass(frozen=True, eq=False)
class DemandHistogram(Statistic):
    """Histogram of a demand, i.e. the number of samples in each bin, and quantiles that follow from it.

    The first bin contains the values up to the first edge, the last bin those above the last edge. A value equal to an
    edge is in the bin below the edge, so that the sum over the bins above an edge is the number of samples that exceed
    the edge. Collapsed samples are in the last bin.

    Args:
        demand: Variable that the scene records. If a sample has several values (storeys or floors), the largest
            absolute value counts.
        edges: Edges of the bins [units of the demand], increasing, shape [edge].
        quantiles: Probabilities of the quantiles [1], between 0 and 1. A quantile is interpolated within its bin, and
            the edges of the bin are its bounds. A quantile in the last bin is NaN, with an infinite upper bound.
        over: Dimensions of the counts, such as "building" or ("archetype", "motion"); see `Statistic`.
        labels: Labels of structures, by names that `over` contains; see `Statistic`.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count for the largest value.

    Raises:
        ValueError: If the edges do not increase, a quantile is not between 0 and 1, or `labels` has a name that is not
            in `over`; when a run begins, if the scene does not record the demand.
        TypeError: If `over` is neither a name nor a list of names, or `labels` is not a mapping.

    Example:
        >>> asked = wd.DemandHistogram("peak_storey_drift_ratio", np.geomspace(1e-4, 0.1, 61), quantiles=(0.5, 0.84))
        >>> found = wd.simulate(scene, structures=3, statistics=asked)
        >>> found["peak_storey_drift_ratio_quantile"].round(3).values
        array([0.005, 0.014])
    """

    demand: str
    edges: ArrayLike
    quantiles: Sequence[float] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        edges = np.atleast_1d(finite_numbers("edges", self.edges))
        if edges.ndim > 1 or not 2 <= edges.size <= MOST_EDGES or np.any(np.diff(edges) <= 0):
            raise ValueError(
                f"edges must be a row of 2 to {MOST_EDGES} numbers that increase, such as [0, 0.005, 0.01], "
                f"got {shortened(self.edges)}"
            )
        quantiles = np.atleast_1d(finite_numbers("quantiles", self.quantiles))
        if quantiles.ndim > 1 or np.any((quantiles <= 0) | (quantiles >= 1)):
            raise ValueError(
                "quantiles must be a row of probabilities between 0 and 1, such as (0.16, "
                f"0.5, 0.84), got {self.quantiles!r}"
            )
        object.__setattr__(self, "edges", edges)
        object.__setattr__(self, "quantiles", tuple(quantiles.tolist()))

    def reducer(self, population: Population) -> HistogramReducer:
        """Return the reducer that counts the samples of a run in the bins."""
        return HistogramReducer(self, population)


class HistogramReducer(Reducer):
    """Reducer that counts samples by bin of a demand and by cell (combination of indices along the dimensions).

    Args:
        statistic: The statistic.
        population: Structures, motions and levels of the samples.
    """

    def __init__(self, statistic: DemandHistogram, population: Population) -> None:
        self.population, self.demand, cells = population, statistic.demand, statistic.cells(population)
        self.edges, self.quantiles = np.asarray(statistic.edges), np.array(statistic.quantiles)
        self._searched, self._added = searched(self.edges[None]), statistic.added_storeys
        self._is_absolute = bool(population.demand(self.demand, added_storeys=self._added).dims)
        if self.demand == DRIFT:
            warn_of_implausible_limits({" of the last edge": float(self.edges[-1])})
        self.needs = cells.needs([self.demand])
        self.begin(cells)

    def begin(self, cells: Cells) -> None:
        """Start with empty counts for the given cells of the statistic."""
        self.cells, self.tally = cells, Tally(cells, 1, self.edges.size + 1)

    def add(self, block: Block, workers: Workers) -> None:
        """Add the samples of a block to the counts of the bins."""
        states = workers.no_states((1, block.samples))
        kind = np.zeros(len(block.structures), dtype=np.int32)
        counted = self.population.counted_places(self.demand, block.structures, added_storeys=self._added)
        given = block, self.demand, self._searched, kind, states, workers
        find_states(*given, counted=counted, is_absolute=self._is_absolute)
        self.tally.add(block, states, workers)

    def variables(self) -> tuple[Variables, Coordinates]:
        """Return the numbers of samples in the bins and the quantiles, as variables for the dataset."""
        cells, demand, bins = self.cells, self.population.demand(self.demand), self.edges.size + 1
        table = self.tally.counts[-1][:, :bins].reshape(*cells.shape, bins)
        variables, coordinates = failures(cells, self.tally.counts[-1][:, bins:])
        dim = f"{self.demand}_bin"
        said: dict[str, object] = {"long_name": f"samples by {demand.long_name}, collapsed ones in the last bin"}
        variables[f"{self.demand}_histogram{cells.suffix}"] = ((*cells.dims, dim), table, said | {"units": "1"})
        lower, upper = np.append(-np.inf, self.edges), np.append(self.edges, np.inf)
        if self._is_absolute:
            lower[0] = min(0.0, self.edges[0])
        for what, values in (("lower", lower), ("upper", upper)):
            text = {"long_name": f"{what} edge of the bin", "units": demand.units}
            coordinates[f"{dim}_{what}"] = (dim, values, text)
        if self.quantiles.size:
            for name, values, what in zip(
                ("quantile", "quantile_lower", "quantile_upper"),
                quantiles_of(table, lower, upper, self.quantiles),
                ("quantile", "lower bound of the quantile", "upper bound of the quantile"),
                strict=True,
            ):
                text = {"long_name": f"{what} of {demand.long_name}", "units": demand.units}
                variables[f"{self.demand}_{name}{cells.suffix}"] = ((*cells.dims, "quantile"), values, text)
            probability = {"long_name": "probability of not being exceeded", "units": "1"}
            coordinates["quantile"] = ("quantile", self.quantiles, probability)
        return variables, coordinates | cells.coordinates


def quantiles_of(
    counts: np.ndarray, lower: np.ndarray, upper: np.ndarray, probabilities: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return quantiles from a histogram, and the lower and upper edges of their bins; NaN in cells without samples.

    The quantile of probability p is the smallest value that at least the share p of the samples does not exceed. The
    value is interpolated linearly within its bin.

    Args:
        counts: Number of samples in each bin, shape [..., bin].
        lower, upper: Edges of the bins [units of the demand], shape [bin].
        probabilities: Probabilities of the quantiles [1], shape [quantile].

    Returns:
        Quantiles, lower edges and upper edges, each of shape [..., quantile].
    """
    cumulated = counts.cumsum(axis=-1)
    total = cumulated[..., -1:]
    # Rank of the sample that is the quantile, from 1. The factor removes the rounding error of the product.
    rank = np.maximum(np.ceil(probabilities * total * (1.0 - 1e-15)), 1.0)
    place = np.minimum((cumulated[..., None, :] < rank[..., None]).sum(axis=-1), counts.shape[-1] - 1)
    inside = np.take_along_axis(counts, place, axis=-1)
    before = np.take_along_axis(cumulated, place, axis=-1) - inside
    bounds = np.where(total > 0, lower[place], np.nan), np.where(total > 0, upper[place], np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        found = bounds[0] + (bounds[1] - bounds[0]) * (rank - before) / inside
    return np.where(np.isfinite(found), found, np.nan), *bounds
