"""How many buildings are in each damage state, where each structure that is run stands for some number of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.core.checks import finite_numbers
from warpdyn.core.output_variables import OK
from warpdyn.kernels.auxiliary import reductions
from warpdyn.reduction.cells import Cells
from warpdyn.reduction.limits import BUILDING_NUMBER
from warpdyn.reduction.population import Population
from warpdyn.reduction.statistic import Variables
from warpdyn.reduction.tally import LEAST_SAMPLES, Block, Sums, Workers


def checked_number(given: ArrayLike, population: Population) -> np.ndarray:
    """Return the number of buildings of each structure, or raise a ValueError that says what is wrong with it."""
    number = finite_numbers("DamageCounts: number", given)
    if number.shape != (population.structures,) or np.any(number <= 0):
        raise ValueError(
            f"DamageCounts: number must be above 0 for each of the {population.structures} "
            f"{population.structure_dim}s, got shape {number.shape}"
            + (f" and a least value of {number.min():g}" if number.size else "")
        )
    return number


class NumberSums:
    """Add up the buildings that samples stand for, by cell and damage state.

    They are added in the order of the run's structures, whatever the blocks and threads, and so have the same bits;
    whole numbers are exact.

    Args:
        cells: The cells.
        number: Buildings that each structure stands for, shape [structure].
        states: Number of damage states, no damage included.
    """

    def __init__(self, cells: Cells, number: np.ndarray, states: int) -> None:
        self.cells, self.number, self.states = cells, number, states
        self._sums = [Sums(cells) for _ in range(states + 1)]  # the last is of samples that failed
        # The "loss" that the kernel finds of a unit is then the number of its state.
        places = np.arange(states, dtype=np.float64)
        self._ratios = np.stack([places, np.zeros(states)], axis=1)[None]

    def add(self, block: Block, states: np.ndarray, workers: Workers) -> None:
        """Add the samples of a block.

        Args:
            block: The block.
            states: State of each sample that is ok, shape [place, sample], the worst place last.
            workers: The threads.
        """
        rows = block.rows(self.cells)
        order, start, cell_of_unit = rows.units()
        units, count = cell_of_unit.size, rows.structure.size
        status, state = np.empty(count * units, dtype=np.int8), np.zeros((count * units, 2))
        kind, value = np.zeros(count, dtype=np.int32), np.ones(count)
        given = block.status, states, order, start, self._ratios, kind, value, status, state

        def find(first: int, last: int, thread: int) -> None:
            reductions.launch(reductions.losses_kernel(), first, last, rows.samples, *given)

        workers.share(find, 0, count, LEAST_SAMPLES // rows.samples + 1)
        outcome = np.where(status == OK, state[:, 0], self.states)
        number = np.repeat(self.number[rows.structure], units)
        of_units = replace(rows, samples=units, cell_of_place=cell_of_unit, unit=np.arange(units))
        all_ok = np.full(count * units, OK, dtype=np.int8)
        for place, sums in enumerate(self._sums):
            is_here = outcome == place
            if is_here.any():  # zeros would change nothing
                values = np.where(is_here, number, 0.0)[:, None]
                found = Block(block.structures, block.event, {"status": all_ok, "number": values})
                sums.add(found, "number", True, 0, workers, of_units)

    def variables(self) -> Variables:
        """Return the buildings in each damage state, and those whose samples failed."""
        cells = self.cells
        table = np.stack([(sums.totals[:, 0] + sums.totals[:, 1]).reshape(cells.shape) for sums in self._sums], axis=-1)
        said = {"units": "1", "long_name": "buildings that the samples in the damage state stand for"}
        failed = {"units": "1", "long_name": "buildings that the samples which failed stand for"}
        return {
            f"{BUILDING_NUMBER}{cells.suffix}": ((*cells.dims, "damage_state"), table[..., :-1], said),
            f"failed_{BUILDING_NUMBER}{cells.suffix}": (cells.dims, table[..., -1], failed),
        }
