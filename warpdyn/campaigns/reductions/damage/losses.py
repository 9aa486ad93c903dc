"""Losses that follow from the damage states of samples, summed during the run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.campaigns.reductions.cells import Cells, Coordinates, Variables
from warpdyn.campaigns.reductions.damage.building_numbers import losses_of_units
from warpdyn.campaigns.reductions.damage.counts import Bounds, states_of
from warpdyn.campaigns.reductions.damage.loss_ratios import Ratios, ratios_of_archetypes
from warpdyn.campaigns.reductions.demand_moments import moments
from warpdyn.campaigns.reductions.limits import DRIFT, Limit
from warpdyn.campaigns.reductions.merging import Reducer
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.statistic import Statistic, failures
from warpdyn.campaigns.reductions.tally import Block, Sums, Tally
from warpdyn.campaigns.reductions.workers import Workers
from warpdyn.foundations.core.checks import finite_numbers
from warpdyn.foundations.core.near_misses import with_suggestions


@with_suggestions
@dataclass(frozen=True, eq=False)
class DamageLoss(Statistic):
    """Sum, mean and variance of the losses that follow from the damage states of the samples.

    The loss of a sample is its replacement value times the mean loss ratio of its damage state, and 0 without damage.
    The variables `loss_scatter_variance...` contain the variance that the scatter of the loss ratios adds to a sum, if
    this scatter is independent from sample to sample.

    Args:
        limits: Limits of the damage states [units of the demand]; see `DamageCounts`.
        loss_ratios: Loss ratio of each damage state: its mean [1], or (mean, coefficient of variation). For a
            portfolio: one such mapping for all archetypes, or such a mapping for each archetype.
        replacement_values: Replacement value [currency] of each structure (in a portfolio: of each building), shape
            [structure], or one value for all; 1 gives loss ratios. For an inventory use
            `stock.replacement_costs(inventory)`, because the rows of the inventory are in another order than the
            buildings of the portfolio. The cost of a row is the value of all buildings that it represents, so do not
            multiply it by `number`; all these buildings are in the same damage state.
        demand: Name of the demand to which limits that are plain numbers apply.
        events: Event of each motion, shape [motion]; only the worst of a structure's samples in an event counts, see
            `DamageCounts`. None: every motion counts separately.
        over: Dimensions of the sums, such as "building" or ("archetype", "event"); see `Statistic`.
        labels: Labels of structures, by names that `over` contains; see `Statistic`.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count for the worst; see `Statistic`.

    Raises:
        ValueError: If `labels` has a name that is not in `over`. When a run begins: for the reasons of `DamageCounts`,
            or if a state has no loss ratio or a structure no replacement value.
        TypeError: If `over` is neither a name nor a list of names, or `labels` is not a mapping.

    Example:
        >>> costs = stock.replacement_costs(inventory)
        >>> asked = wd.DamageLoss(stock.limits, wd.hazus_loss_ratios("RES1"), costs, over="motion")
        >>> losses = wd.simulate(region, statistics=asked)["loss_sum_by_motion"]  # of all buildings together
        >>> float(losses.mean().round())
        50750.0
    """

    limits: Mapping[str, Limit] | Mapping[str, Mapping[str, float]]
    loss_ratios: Ratios | Mapping[str, Ratios]
    replacement_values: ArrayLike = 1.0
    demand: str = DRIFT
    events: Sequence[str] | Sequence[int] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "replacement_values", finite_numbers("replacement_values", self.replacement_values))

    def reducer(self, population: Population) -> LossReducer:
        """Return the reducer that sums the losses of a run's samples."""
        return LossReducer(self, population)


class LossReducer(Reducer):
    """Reducer that sums the losses of samples by cell (combination of indices along the dimensions).

    Args:
        statistic: The statistic.
        population: Structures, motions and levels of the samples.
    """

    def __init__(self, statistic: DamageLoss, population: Population) -> None:
        self.population, self.bounds = population, Bounds.of(statistic, population)
        cells = statistic.cells(population, statistic.events)
        states = self.bounds.states[1:]
        names = [""] if population.portfolio is None else list(population.portfolio.archetypes)
        found = ratios_of_archetypes("DamageLoss", names, states, statistic.loss_ratios)
        of_each = [np.stack([ratios.mean, ratios.deviation**2], axis=-1) for ratios in found]
        self._ratios = np.concatenate([np.zeros((len(names), 1, 2)), np.stack(of_each)], axis=1)
        values = finite_numbers("replacement_values", statistic.replacement_values)
        below = values[values < 0]
        if values.shape not in ((), (population.structures,)) or below.size:
            got = f"{below.size} below 0, such as {below[0]:g}" if below.size else f"shape {values.shape}"
            raise ValueError(
                f"replacement_values must be one value, or one for each of the {population.structures} "
                f"{population.structure_dim}s, at least 0; got {got}"
            )
        self._values = np.ascontiguousarray(np.broadcast_to(values, population.structures))
        self.needs = cells.needs(self.bounds.demands)
        self.begin(cells)

    def begin(self, cells: Cells) -> None:
        """Start with empty counts and sums for the given cells of the statistic."""
        self.cells, self.tally = cells, Tally(cells, 1, len(self.bounds.states))
        self.losses, self.scatter = Sums(cells), Sums(cells)

    @property
    def sums_by_cell(self) -> tuple[Sums, Sums]:
        """The sums of the losses, and the sums of the variances that the scatter of the loss ratios adds."""
        return self.losses, self.scatter

    def add(self, block: Block, workers: Workers) -> None:
        """Add the losses of a block's samples to the sums."""
        states = states_of(block, self.bounds, self.population, workers, each_place=False)
        self.tally.add(block, states, workers)
        rows = block.rows(self.cells)
        kind, value = self.population.archetype[rows.structure], self._values[rows.structure]
        found, of_units = losses_of_units(block, rows, states, self._ratios, kind, value, workers)
        self.losses.add(found, "loss", True, 0, workers, of_units)
        self.scatter.add(found, "loss", True, 1, workers, of_units)

    def variables(self) -> tuple[Variables, Coordinates]:
        """Return sum, mean and variance of the losses, and the numbers of samples, as variables for the dataset."""
        cells, states = self.cells, len(self.bounds.states)
        table = self.tally.counts[-1]
        variables, coordinates = failures(cells, table[:, states:])
        count = table[:, :states].sum(axis=1)
        losses, scatter = self.losses.totals, self.scatter.totals
        mean, variance = moments(count, losses)
        total, of_scatter = (each[:, 0] + each[:, 1] for each in (losses, scatter))
        money = {"units": "1", "comment": "in the unit of replacement_values"}
        for name, values, text in (
            ("loss_sum", total, "sum of the losses of the samples"),
            ("loss_mean", mean, "mean loss of a sample"),
            ("loss_variance", variance, "variance of the loss of a sample, with mean loss ratios"),
            ("loss_scatter_variance", of_scatter, "variance of the sum by the scatter of the loss ratios"),
            ("counted_count", count, "samples with a loss, collapsed ones included"),
        ):
            said = money if name.startswith("loss") else {"units": "1"}
            variables[f"{name}{cells.suffix}"] = (cells.dims, values.reshape(cells.shape), said | {"long_name": text})
        return variables, coordinates | cells.coordinates
