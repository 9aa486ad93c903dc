"""Kernels of reductions: damage states, counts of states, and sums that do not depend on the order of terms.

A row is a structure, a draw or a sample; it consists of units (samples or groups of samples). A part is a range of the
units of a row. A launch processes every `step`-th part from `first` on. On a CPU each thread processes its own range of
parts (`step` is 1); on a GPU each thread processes one part.
"""

import functools
import threading
from dataclasses import dataclass

import warp as wp

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.kernels.reductions.module import MODULE, REALS
from warpdyn.engine.kernels.reductions.states import counts_kernel, states_kernel, zeros_kernel
from warpdyn.engine.kernels.reductions.sums import (
    least_kernel,
    losses_kernel,
    ratios_kernel,
    sums_kernel,
    totals_kernel,
)


@dataclass(frozen=True)
class Reductions:
    """The kernels of reductions.

    A row is a structure, a draw or a sample; it consists of units (samples or groups of samples). A cell is the set of
    all samples with the same labels.

    Args:
        ratios: Storey drift ratios of samples; one kernel per dtype.
        states: Number of limits that the response exceeds, at each place and for the largest value; one kernel per
            dtype.
        least: Smallest peak response among collapsed samples; one kernel per dtype.
        sums: Sums of the responses of each unit of a row; one kernel per dtype.
        counts: Counts of units for each cell and damage state or failure.
        zeros: Sets damage states to 0.
        losses: Mean loss of each unit, and its variance due to random loss ratios.
        totals: Adds the sums of rows exactly to the sums of cells.
    """

    ratios: dict[str, wp.Kernel]
    states: dict[str, wp.Kernel]
    least: dict[str, wp.Kernel]
    sums: dict[str, wp.Kernel]
    counts: wp.Kernel
    zeros: wp.Kernel
    losses: wp.Kernel
    totals: wp.Kernel


MAKING = threading.Lock()  # several threads may call `reductions`, but a module accepts each kernel only once


def reductions() -> Reductions:
    """Return the kernels of reductions, which share one Warp module."""
    with MAKING:
        return _made()


@functools.cache
def _made() -> Reductions:
    module = wp.get_module(MODULE)
    module.options.update({"enable_backward": False, **module_options(max_unroll=1)})
    of_reals = [
        {dtype: make(dtype) for dtype in REALS} for make in (ratios_kernel, states_kernel, least_kernel, sums_kernel)
    ]
    return Reductions(*of_reals, counts_kernel(), zeros_kernel(), losses_kernel(), totals_kernel())
