"""Numbers of buildings in each damage state, if each structure that is integrated represents several buildings."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.campaigns.reductions.cells import Cells, Variables
from warpdyn.campaigns.reductions.limits import BUILDING_NUMBER
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.rows import Rows
from warpdyn.campaigns.reductions.tally import Block, Sums
from warpdyn.campaigns.reductions.workers import LEAST_SAMPLES, Workers
from warpdyn.engine.kernels.reductions.table import reductions
from warpdyn.foundations.core.checks import finite_numbers
from warpdyn.foundations.core.output_variables import OK


def checked_number(given: ArrayLike, population: Population) -> np.ndarray:
    """Return the number of buildings that each structure represents, or raise a ValueError if it is invalid.

    The result has the shape [structure]; every number must be above 0.
    """
    number = finite_numbers("DamageCounts: number", given)
    if number.shape != (population.structures,) or np.any(number <= 0):
        raise ValueError(
            f"DamageCounts: number must be above 0 for each of the {population.structures} "
            f"{population.structure_dim}s, got shape {number.shape}"
            + (f" and a least value of {number.min():g}" if number.size else "")
        )
    return number


def losses_of_units(
    block: Block, rows: Rows, states: Any, ratios: np.ndarray, kind: np.ndarray, value: np.ndarray, workers: Workers
) -> tuple[Block, Rows]:
    """Return the losses of the units (samples that count as one) of a block as a block, and their assignment to cells.

    A unit is a sample or, if the statistic has events, the worst sample of a structure in an event.

    Args:
        block: The block of samples.
        rows: Assignment of the samples to the cells of a statistic.
        states: State of each sample that is ok, shape [place, sample]; the last place is the worst of all.
        ratios: Mean and variance of the loss ratio, shape [kind, state, 2]; the same array for all blocks.
        kind: Kind (archetype) of each row's structure, shape [row].
        value: Replacement value of each row's structure, shape [row].
        workers: The CPU threads or the GPU that compute the losses.
    """
    order, start, cell_of_unit = rows.places.units
    units, count = cell_of_unit.size, rows.structure.size
    status, loss = workers.empty((count * units,), np.int8), workers.empty((count * units, 2), np.float64)
    order, start, ratios = (workers.constant(values) for values in (order, start, ratios))
    kind, value = workers.array(kind.astype(np.int32)), workers.array(value)
    each = workers.units_of_part(units)
    given = each, rows.samples, block.status, states, order, start, ratios, kind, value, status, loss
    least = LEAST_SAMPLES // rows.samples + 1
    workers.run(reductions().losses, 0, count * -(-units // each), lambda thread: given, least)
    of_units = replace(rows, places=rows.places.of_units)
    return Block(block.structures, block.event, {"status": status, "loss": loss}), of_units


class NumberSums:
    """Sums of the buildings that the samples represent, by cell and damage state.

    The sums are exact, so that they do not depend on the order of the samples. The kernel that sums losses computes
    them: the "loss" of a unit (a sample, or the worst sample of an event) is its number of buildings if it is in the
    damage state, else 0.

    Args:
        cells: Cells of the statistic.
        number: Number of buildings that each structure represents, shape [structure].
        states: Number of damage states, including no damage.
    """

    def __init__(self, cells: Cells, number: np.ndarray, states: int) -> None:
        self.cells, self.number = cells, number
        self._of_states, self._of_all = [Sums(cells) for _ in range(states)], Sums(cells)
        self._ratios = [np.stack([row, np.zeros(states)], axis=1)[None] for row in np.eye(states)]

    @property
    def sums(self) -> list[Sums]:
        """The sums for each damage state, followed by the sum for all units in any state."""
        return [*self._of_states, self._of_all]

    def add(self, block: Block, states: Any, workers: Workers) -> None:
        """Add the buildings of a block's samples to the sums.

        Args:
            block: The block.
            states: State of each sample that is ok, shape [place, sample]; the last place is the worst of all.
            workers: The CPU threads or the GPU that add.
        """
        rows = block.rows(self.cells)
        kind, number = np.zeros(rows.structure.size, dtype=np.int32), self.number[rows.structure]
        for ratios, sums in zip(self._ratios, self._of_states, strict=True):
            found, of_units = losses_of_units(block, rows, states, ratios, kind, number, workers)
            sums.add(found, "loss", True, 0, workers, of_units)
        # For the sum of all units, every unit counts as ok and undamaged, even if it failed.
        all_ok = Block(block.structures, block.event, {"status": workers.array(np.full(block.samples, OK, np.int8))})
        undamaged = workers.no_states((1, block.samples))
        found, of_units = losses_of_units(all_ok, rows, undamaged, self._ratios[0], kind, number, workers)
        self._of_all.add(found, "loss", True, 0, workers, of_units)

    def variables(self, failed: np.ndarray) -> Variables:
        """Return the number of buildings in each damage state and of failed samples, as variables for the dataset.

        Args:
            failed: Number of samples that failed, shape [cell].
        """
        cells = self.cells
        of_states = np.stack([_sums_of(sums) for sums in self._of_states], axis=-1)
        # The rest represents failed samples. Without failures it is set to 0, because sums of fractions are rounded.
        rest = np.where(failed > 0, _sums_of(self._of_all) - of_states.sum(axis=-1), 0.0)
        said = {"units": "1", "long_name": "buildings represented by the samples in the damage state"}
        of_failed = {"units": "1", "long_name": "buildings represented by the samples that failed"}
        table = of_states.reshape(*cells.shape, len(self._of_states))
        return {
            f"{BUILDING_NUMBER}{cells.suffix}": ((*cells.dims, "damage_state"), table, said),
            f"failed_{BUILDING_NUMBER}{cells.suffix}": (cells.dims, rest.reshape(cells.shape), of_failed),
        }


def _sums_of(sums: Sums) -> np.ndarray:
    """Return the sums by cell of the statistic, corrected by the rounding errors of the additions, shape [cell]."""
    totals = sums.totals
    return totals[:, 0] + totals[:, 1]
