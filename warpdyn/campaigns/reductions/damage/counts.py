"""Numbers of samples in each damage state, counted during the run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.reductions.cells import Cells, Coordinates, Variables
from warpdyn.campaigns.reductions.damage.building_numbers import NumberSums, checked_number
from warpdyn.campaigns.reductions.limits import (
    DAMAGE_COUNT,
    DRIFT,
    LEAST_DRIFT,
    NO_DAMAGE,
    DamageLimits,
    Limit,
    limits_by_archetype,
)
from warpdyn.campaigns.reductions.merging import Reducer
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.statistic import Statistic, failures
from warpdyn.campaigns.reductions.tally import FAILURES, Block, Sums, Tally, find_states, searched
from warpdyn.campaigns.reductions.workers import LEAST_SAMPLES, Workers
from warpdyn.engine.kernels.reductions.table import reductions
from warpdyn.foundations.core.checks import real_numbers
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.plausibility import warn_of_implausible_limits

if TYPE_CHECKING:
    from warpdyn.campaigns.reductions.damage.losses import DamageLoss


@with_suggestions
@dataclass(frozen=True, eq=False)
class DamageCounts(Statistic):
    """Number of samples in each damage state.

    A sample is in the most severe state whose limit its demand exceeds at the worst storey or floor, in "none" if it
    exceeds no limit, and in the most severe state of all if it collapsed. Pass the result to `fragility` or
    `damage_shares` instead of a run.

    Args:
        limits: Limits of the damage states [units of the demand], in the form that `fragility` uses; for a portfolio,
            the limits of each archetype, in the form that `damage_shares` uses.
        demand: Name of the demand to which limits that are plain numbers apply. If a demand has a sign, such as the
            residual drift ratio, its absolute value is compared.
        events: Event of each motion, shape [motion]. Only the worst of a structure's samples in an event counts, as in
            `damage_shares`; for MotionsAtSites, only the worst in each draw. With `events=[motion.record for motion in
            design.motions]` both components of a record count as one. None: every motion counts separately.
        each_place: Whether the states at each storey (or floor) are also counted, in addition to the worst.
        number: Number of buildings that each structure represents [1], shape [structure]: column `number` of an
            inventory, in the order of the portfolio (`stock.buildings(inventory)["number"]`). The counts remain numbers
            of samples; the variable `number_of_buildings_by_...`, which `damage_shares` reads, contains the numbers of
            buildings. None: every structure is one building.
        over: Dimensions of the counts, such as "building" or ("archetype", "motion"); see `Statistic`. For
            fragility curves use ("motion", "stripe", "structure_group").
        labels: Labels of structures, by names that `over` contains; see `Statistic`.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count for the worst; see `Statistic`.
    Raises:
        ValueError: If `labels` has a name that is not in `over`. When a run begins: if a limit is not positive and
            finite, limits do not increase, or the scene does not record the demand.
        TypeError: If `over` is neither a name nor a list of names, or `labels` is not a mapping.

    Example:
        >>> counts = wd.simulate(scene, structures=3, statistics=wd.DamageCounts({"slight": 0.005}, over="stripe"))
        >>> counts["damage_count_by_stripe"].sel(damage_state="slight").values
        array([ 0,  0,  6, 19, 24, 24])
    """

    limits: Mapping[str, Limit] | Mapping[str, Mapping[str, float]]
    demand: str = DRIFT
    events: Sequence[str] | Sequence[int] | None = None
    each_place: bool = False
    number: ArrayLike | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.number is not None:
            object.__setattr__(self, "number", real_numbers("DamageCounts: number", self.number))

    def reducer(self, population: Population) -> Reducer:
        """Return the reducer that counts the samples of a run by damage state."""
        counted = DamageReducer(self, population)
        return counted if self.number is None else NumberReducer(counted, checked_number(self.number, population))


@dataclass(frozen=True, eq=False)
class Bounds:
    """Limits of damage states in the form that kernels use.

    Args:
        states: Names of the damage states, "none" first.
        demands: Names of the demands that have limits.
        given: For each demand, the limits [units of the demand], shape [kind, state]; NaN: no limit. A kind is an
            archetype; a scene of one structure has one kind.
        by_archetype: Whether each archetype has separate limits.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count.
    """

    states: list[str]
    demands: tuple[str, ...]
    given: list[np.ndarray]
    by_archetype: bool
    added_storeys: bool = False

    @staticmethod
    def of(statistic: DamageCounts | DamageLoss, population: Population) -> Bounds:
        """Return the limits of a statistic after a check; for a portfolio, the limits of each archetype."""
        limits: Mapping = statistic.limits
        demand, added = statistic.demand, statistic.added_storeys
        if population.portfolio is None:
            checked = DamageLimits.of(limits, demand)
            if NO_DAMAGE in checked.states:
                raise ValueError(f"{NO_DAMAGE!r} is the state of samples that exceed no limit: remove it from limits")
            rows = [values[None] for values in checked.values]
            found = Bounds([NO_DAMAGE, *checked.states], checked.demands, rows, False, added)
        else:
            states, table = limits_by_archetype(list(population.portfolio.archetypes), limits)
            if demand == DRIFT:
                of_all = {f" of {s!r} of {name!r}": value for name in limits for s, value in limits[name].items()}
                warn_of_implausible_limits(of_all)
            found = Bounds(states, (demand,), [table], True, added)
        for name in found.demands:
            population.demand(name, added_storeys=added)
        return found

    @cached_property
    def values(self) -> tuple[bytes, ...]:
        """All limits as bytes, by which statistics with equal limits are recognised."""
        return tuple(rows.tobytes() for rows in self.given)

    @cached_property
    def compared(self) -> list[np.ndarray]:
        """Limits for each demand, one row per archetype; a state without a limit has that of the next heavier one."""
        found = []
        for rows in self.given:
            filled = np.where(np.isnan(rows), np.inf, rows)
            found.append(searched(np.minimum.accumulate(filled[:, ::-1], axis=1)[:, ::-1]))
        return found

    def variable(self, population: Population) -> tuple[Variables, Coordinates]:
        """Return the limits as a variable for the dataset, and the coordinates of its dimensions."""
        states = {"damage_state": ("damage_state", np.array(self.states), {"long_name": "damage state"})}
        padded = [np.concatenate([np.zeros((len(rows), 1)), rows], axis=1) for rows in self.given]
        said = {"long_name": "limit above which a sample is in the damage state", "demand": ", ".join(self.demands)}
        said |= {"units": population.demand(self.demands[0]).units} if len(self.demands) == 1 else {}
        if self.by_archetype:
            return {"damage_limit": (("archetype", "damage_state"), padded[0], said)}, states
        if len(self.demands) == 1:
            return {"damage_limit": ("damage_state", padded[0][0], said)}, states
        names = ("limited_demand", np.array(self.demands), {"long_name": "variable of the run"})
        table = np.stack([rows[0] for rows in padded])
        return {"damage_limit": (("limited_demand", "damage_state"), table, said)}, states | {"limited_demand": names}


def states_of(block: Block, bounds: Bounds, population: Population, workers: Workers, *, each_place: bool) -> Any:
    """Return the damage state of each sample of a block that is ok, shape [storey or floor, sample].

    Places are storeys or floors, if `each_place`; the last place is the worst of all. The result is computed once for
    all statistics with the same limits.
    """

    def find() -> Any:
        places = block.demand(bounds.demands[0]).shape[1] if each_place else 0
        states = workers.no_states((places + 1, block.samples))
        kind = population.archetype[block.structures]
        for name, rows in zip(bounds.demands, bounds.compared, strict=True):
            counted = population.counted_places(name, block.structures, added_storeys=bounds.added_storeys)
            find_states(block, name, rows, kind, states, workers, counted=counted, each_place=each_place)
        return states

    return block.shared((bounds.demands, each_place, bounds.added_storeys, bounds.values), find)


class DamageReducer(Reducer):
    """Reducer that counts samples by damage state and by cell (combination of indices along the dimensions).

    Args:
        statistic: The statistic.
        population: Structures, motions and levels of the samples.
    """

    def __init__(self, statistic: DamageCounts, population: Population) -> None:
        self.population, self.bounds = population, Bounds.of(statistic, population)
        cells = statistic.cells(population, statistic.events)
        demands = [population.demand(name) for name in self.bounds.demands]
        dims = demands[0].dims
        self.dim = dims[0] if statistic.each_place and len(demands) == 1 and dims else ""
        if statistic.each_place and not self.dim:
            raise ValueError(
                "each_place=True needs limits of one demand with a value for each storey or "
                "floor: give such limits, or remove each_place="
            )
        self.needs = cells.needs(self.bounds.demands)
        self.begin(cells)

    def begin(self, cells: Cells) -> None:
        """Start with empty counts for the given cells of the statistic."""
        places = self.population.scene.structure.length_along(self.dim) if self.dim else 0
        self.cells, self.tally = cells, Tally(cells, places + 1, len(self.bounds.states))
        self._least: dict[Workers, Any] = {}  # least drift ratio at which a sample collapsed
        self._least_included = np.inf

    def partial(self) -> Arrays:
        """Return the counts of all cells that contain samples, and the least drift ratio of collapse, for `include`."""
        return super().partial() | {"least_drift": np.array(self._least_drift)}

    def include(self, part: Arrays) -> None:
        """Add a result of `partial` from another reducer, for structures that are not counted yet."""
        super().include(part)
        self._least_included = min(self._least_included, float(part["least_drift"]))

    def add(self, block: Block, workers: Workers) -> None:
        """Add the samples of a block (structures of a run that are integrated together) to the counts."""
        states = states_of(block, self.bounds, self.population, workers, each_place=bool(self.dim))
        self.tally.add(block, states, workers)
        if DRIFT not in self.bounds.demands or self.population.portfolio is not None:
            return
        added = self.bounds.added_storeys
        # If isolators do not count, it is unknown whether an isolator or a storey of the building collapsed.
        if self.population.counted_places(DRIFT, block.structures, added_storeys=added) is None:
            self._find_least(block, workers)

    def _find_least(self, block: Block, workers: Workers) -> None:
        """Update the least drift ratio at which a sample collapsed, from the samples of a block."""
        if workers not in self._least:
            self._least[workers] = workers.kept(np.full(workers.threads, np.inf))
        drift, least = block.demand(DRIFT), self._least[workers]

        def arguments(thread: int) -> tuple:
            return block.status, drift, least, thread

        workers.run(reductions().least[block.type_of(DRIFT)], 0, block.samples, arguments, LEAST_SAMPLES)

    @property
    def _least_drift(self) -> float:
        found = (float(workers.read(each).min()) for workers, each in self._least.items())
        return min([self._least_included, *found])

    def variables(self) -> tuple[Variables, Coordinates]:
        """Return the counts by damage state, the numbers of failed samples and the limits, as dataset variables."""
        cells, population, states = self.cells, self.population, len(self.bounds.states)
        variables, coordinates = self.bounds.variable(population)
        table = self.tally.counts.reshape(-1, *cells.shape, states + len(FAILURES))
        said: dict[str, object] = {"long_name": "samples in the damage state, by the worst place", "units": "1"}
        # These attributes are read by the functions that fit fragility curves.
        said |= {"demand": ", ".join(self.bounds.demands)}
        said |= {"demand_units": ", ".join(population.demand(name).units for name in self.bounds.demands)}
        said |= {"structures_of_motions": "the same" if population.is_crossed else "their own"}
        variables[f"{DAMAGE_COUNT}{cells.suffix}"] = ((*cells.dims, "damage_state"), table[-1, ..., :states], said)
        if self.dim:
            dims = (*cells.dims, self.dim, "damage_state")
            at_each = said | {"long_name": f"samples in the damage state at the {self.dim}"}
            places = np.moveaxis(table[:-1, ..., :states], 0, -2)
            variables[f"{self.dim}_{DAMAGE_COUNT}{cells.suffix}"] = (dims, places, at_each)
            numbered = population.scene.structure.numbered(population.scene.recorders)
            coordinates |= {name: each for name, each in numbered.items() if name == self.dim}
        failed, failure = failures(cells, table[-1, ..., states:])
        least = self._least_drift
        if np.isfinite(least):
            text = {"long_name": "least storey drift ratio at which a sample collapsed", "units": "1"}
            variables[LEAST_DRIFT] = ((), least, text)
        return variables | failed, coordinates | failure | cells.coordinates


class NumberReducer(Reducer):
    """Reducer that counts samples by damage state, and sums the numbers of buildings that the samples represent.

    Args:
        counted: The reducer that counts the samples.
        number: Number of buildings that each structure represents, shape [structure].
    """

    def __init__(self, counted: DamageReducer, number: np.ndarray) -> None:
        self.counted, self.needs, self._number = counted, counted.needs, number
        self.begin(counted.cells)

    def begin(self, cells: Cells) -> None:
        """Start with empty counts and sums for the given cells of the statistic."""
        self.counted = copy(self.counted)
        self.counted.begin(cells)
        self.cells, self.tally = cells, self.counted.tally
        self.sums = NumberSums(cells, self._number, len(self.counted.bounds.states))

    @property
    def sums_by_cell(self) -> list[Sums]:
        """The sums of buildings in each damage state, followed by the sum of all buildings."""
        return self.sums.sums

    def partial(self) -> Arrays:
        """Return the count and the sums of each cell that contains samples, as arrays by name; see `include`."""
        return super().partial() | self.counted.partial()

    def include(self, part: Arrays) -> None:
        """Add a result of `partial` from another reducer, for structures that are not counted yet."""
        self.counted.include(part)
        self.include_sums(part)

    def add(self, block: Block, workers: Workers) -> None:
        """Add the samples of a block to the counts, and their buildings to the sums."""
        self.counted.add(block, workers)
        states = states_of(block, self.counted.bounds, self.counted.population, workers, each_place=False)
        self.sums.add(block, states, workers)

    def variables(self) -> tuple[Variables, Coordinates]:
        """Return the counts of samples and the numbers of buildings, as variables for the dataset."""
        variables, coordinates = self.counted.variables()
        failed = self.counted.tally.counts[-1][:, len(self.counted.bounds.states) :].sum(axis=1)
        return variables | self.sums.variables(failed), coordinates
