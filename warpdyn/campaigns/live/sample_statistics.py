"""Statistics of the samples of a live ensemble, on the device: damage-state counts and quantiles of demands.

Only these statistics are copied to the host. They have the values of `np.quantile` in float64.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warpdyn.campaigns.live.paused_ensemble import PausedEnsemble
from warpdyn.campaigns.reductions.limits import DRIFT, DamageLimits, is_peak
from warpdyn.engine.kernels.kernel_cache import block_size
from warpdyn.engine.kernels.reductions.live_answers import PARTS, STATUSES, answer_kernels
from warpdyn.foundations.core.output_variables import DIVERGED

OF_DRIFT = "peak_storey_drift"  # output that is divided by the storey heights


@dataclass(frozen=True, eq=False)
class Found:
    """Statistics of the samples at one time.

    Args:
        of_status: Number of samples of each status, shape [status].
        in_state: Number of samples without failure in each damage state, shape [damage_state].
        quantiles: Quantiles of each demand among the samples without failure, shape [quantile, ...]; NaN: no sample.
    """

    of_status: np.ndarray
    in_state: np.ndarray
    quantiles: dict[str, np.ndarray]


class SampleStatistics:
    """Kernels, arrays and order of the launches that compute the statistics of a paused ensemble.

    Args:
        paused: The ensemble, whose `output` is read.
        demands: Names of the demands.
        quantiles: Quantiles [1].
        limits: Limits of the damage states; None: no states.
        counted: Storeys or floors that count for the limits of each demand.
        by_radix: Whether keys are sorted by radix; None: on a GPU. A CPU sorts faster by NumPy.
    """

    def __init__(
        self,
        paused: PausedEnsemble,
        demands: list[str],
        quantiles: np.ndarray,
        limits: DamageLimits | None,
        counted: Mapping[str, slice],
        by_radix: bool | None = None,
    ) -> None:
        self.paused, self.quantiles, self.limits = paused, quantiles, limits
        ensemble, self.device, self.size = paused.ensemble, paused.device, paused.ensemble.size
        self.by_radix = self.device != "cpu" if by_radix is None else by_radix
        self._samples_of_structure = self.size // len(ensemble.structures)
        names = [*demands, *(limits.demands if limits else ())]
        self._heights = ensemble.storey_heights if DRIFT in names else np.ones((1, 1))
        # If all heights are equal, order statistics of drifts are divided: the rounded division keeps the order.
        self._of_drift = DRIFT in demands and OF_DRIFT in demands and len(self._heights) == 1
        self._rows: dict[str, slice] = {}  # demand that is sorted -> its rows of `_picked`
        self._values: dict[str, tuple[wp.array, wp.array]] = {}  # demand -> its values, and divisors
        for name in dict.fromkeys(names):
            output = getattr(paused.output, OF_DRIFT if name == DRIFT else name)
            values = output.reshape((output.size // self.size, self.size))
            divisors = self._heights if name == DRIFT else np.ones((1, values.shape[0]))
            self._values[name] = values, wp.array(divisors, dtype=values.dtype, device=self.device)
        end = 0
        for name in demands:
            if not (name == DRIFT and self._of_drift):
                self._rows[name] = slice(end, end + self._values[name][0].shape[0])
                end = self._rows[name].stop
        self._shapes = {name: ensemble.model.shapes[OF_DRIFT if name == DRIFT else name] for name in demands}
        dtypes = {values.dtype for values, _ in self._values.values()}
        self._kernels = {dtype: answer_kernels(_name_of(dtype), self.device) for dtype in dtypes or {wp.float64}}
        # A radix sort needs memory for twice as many keys, and values that are sorted with the keys.
        room = 2 * self.size if self.by_radix else self.size
        self._keys = {dtype: wp.empty(room, dtype=dtype, device=self.device) for dtype in dtypes}
        self._partners = wp.zeros(room if self.by_radix else 1, dtype=wp.int32, device=self.device)
        self._picked = wp.zeros((max(end, 1), 2 * quantiles.size + 1), dtype=wp.float64, device=self.device)
        self._given: wp.array = wp.array(quantiles, dtype=wp.float64, device=self.device)
        states = 1 + (0 if limits is None else len(limits.states))
        self._counts = wp.zeros((PARTS, STATUSES + states), dtype=wp.int32, device=self.device)
        self._states = wp.zeros(self.size, dtype=wp.int32, device=self.device)
        self._counting = self._launches_of_counts(counted)
        # For each row of order statistics: the keys, the launch that writes them, and the one that reads them sorted.
        self._picking = [
            (self._keys[self._values[name][0].dtype], *self._launches_of_row(name, place, row))
            for name, rows in (self._rows.items() if quantiles.size else ())
            for place, row in enumerate(range(rows.start, rows.stop))
        ]

    def find(self) -> Found:
        """Return the statistics of the outputs that the ensemble has written last."""
        self._picked.zero_()
        self._counts.zero_()
        for launch in self._counting:
            launch.launch()
        for keys, write, pick in self._picking:
            write.launch()
            self._sort(keys)
            pick.launch()
        counts = self._counts.numpy().sum(axis=0)
        of_status, in_state = counts[:STATUSES], counts[STATUSES:]
        return Found(of_status, in_state, self._quantiles(self._picked.numpy(), int(of_status[:DIVERGED].sum())))

    def _launches_of_counts(self, counted: Mapping[str, slice]) -> list[wp.Launch]:
        """Return the launches that find the damage states of the samples and count them."""
        launches: list[wp.Launch] = []
        limits = self.limits
        self._bounds: list[wp.array] = []  # a recorded launch has only their addresses
        for name, bounds in zip(limits.demands, limits.values, strict=True) if limits else ():
            values, divisors = self._values[name]
            first, last, _ = counted[name].indices(values.shape[0])
            inputs: list[Any] = [int(not launches), int(not is_peak(name)), first, last, self._samples_of_structure]
            self._bounds.append(wp.array(bounds, dtype=wp.float64, device=self.device))
            inputs += [values, divisors, self._bounds[-1], self._states]
            launches.append(self._launch(self._kernels[values.dtype].states, self.size, inputs))
        counts = next(iter(self._kernels.values())).counts
        return [*launches, self._launch(counts, self.size, [self.paused.output.status, self._states, self._counts])]

    def _launches_of_row(self, name: str, place: int, row: int) -> tuple[wp.Launch, wp.Launch]:
        """Return the launches that write the keys of a demand at one place, and that read the sorted keys."""
        values, divisors = self._values[name]
        keys, kernels = self._keys[values.dtype], self._kernels[values.dtype]
        status = self.paused.output.status
        writing: list[Any] = [row, place, self._samples_of_structure, status, values, divisors, keys, self._picked]
        picking: list[Any] = [row, self._given, self._counts, keys, self._picked]
        return self._launch(kernels.keys, self.size, writing), self._launch(kernels.picks, len(self.quantiles), picking)

    def _launch(self, kernel: wp.Kernel, threads: int, inputs: list) -> wp.Launch:
        """Return a launch that can be repeated, because the arrays are always the same."""
        return wp.launch(
            kernel, threads, inputs, device=self.device, block_dim=block_size(self.device), record_cmd=True
        )

    def _sort(self, keys: wp.array) -> None:
        """Sort the keys of all samples."""
        if self.by_radix:
            wp.utils.radix_sort_pairs(keys, self._partners, self.size)
        else:
            keys.numpy()[: self.size].sort()

    def _quantiles(self, picked: np.ndarray, samples: int) -> dict[str, np.ndarray]:
        """Return the quantiles of each demand from order statistics.

        Args:
            picked: The order statistics next to each quantile, and the number of unknown demands, shape [row, number].
            samples: Number of samples without failure.
        """
        found = {}
        for name, shape in self._shapes.items():
            derived = name == DRIFT and self._of_drift
            rows = picked[self._rows[OF_DRIFT if derived else name]]
            pairs = rows[:, :-1]
            if derived:
                real = np.dtype(self.paused.dtype)
                pairs = (pairs.astype(real) / self._heights[0].astype(real)[:, None]).astype(np.float64)
            values = between(pairs[:, 0::2], pairs[:, 1::2], self.quantiles, samples)
            values[(rows[:, -1] > 0) | (samples == 0)] = np.nan
            found[name] = values.reshape(*reversed(shape), -1).T
        return found


def between(below: np.ndarray, above: np.ndarray, quantiles: np.ndarray, samples: int) -> np.ndarray:
    """Return quantiles by linear interpolation between two order statistics, with the rounding of `np.quantile`.

    Args:
        below: Order statistics below the quantiles, shape [row, quantile].
        above: Order statistics above the quantiles.
        quantiles: The quantiles [1].
        samples: Number of samples.
    """
    position = (samples - 1) * quantiles
    share = position - np.floor(position)
    with np.errstate(invalid="ignore"):  # infinite demands
        difference = above - below
        return np.where(share >= 0.5, above - difference * (1 - share), below + difference * share)


def _name_of(dtype: type) -> str:
    return "float32" if dtype is wp.float32 else "float64"
