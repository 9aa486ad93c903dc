"""Reductions of samples: damage states, counts of states, and sums that do not depend on the order of terms.

Rows are structures, draws or samples, and a part is some of a row's units. A launch takes every `step`-th part from
`first` on: on a processor one thread takes a range of them (step 1) and others take other ranges; on a GPU each thread
takes one.
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
    """The kernels.

    Args:
        ratios: Storey drift ratios of samples, by type of their drifts.
        states: Number of bounds that each sample's demand exceeds, per place and at the worst, by type of the demand.
        least: The least of the largest demands of collapsed samples, by type of the demand.
        sums: Sums of the demands of each row by cell, in the order of its samples, by type of the demand.
        counts: Counts of units (samples, or the worst of some of a row's) by cell and outcome.
        zeros: Sets states to 0.
        losses: The loss of each unit, and its variance by the scatter of the loss ratio.
        totals: Exact sums of cells, to which those of rows are added.
    """

    ratios: dict[str, wp.Kernel]
    states: dict[str, wp.Kernel]
    least: dict[str, wp.Kernel]
    sums: dict[str, wp.Kernel]
    counts: wp.Kernel
    zeros: wp.Kernel
    losses: wp.Kernel
    totals: wp.Kernel


MAKING = threading.Lock()  # several threads may ask for them, and a module accepts each kernel once


def reductions() -> Reductions:
    """Return the kernels; they share one Warp module."""
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
