"""Kernels for the answers of live ensembles: damage states, their counts, and order statistics of demands.

All arrays of samples have the sample as the last index, as the kernels that integrate histories write them.
"""

import functools
import threading
from dataclasses import dataclass

import warp as wp

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.kernels.reductions.module import REALS
from warpdyn.foundations.core.output_variables import COLLAPSED, DIVERGED, STATUS_MEANINGS

# Partial counts, which the host adds: threads that run at the same time count in different places.
PARTS = 256
STATUSES = len(STATUS_MEANINGS)
MAKING = threading.Lock()  # several threads may ask for the kernels, but a module accepts each kernel only once


@dataclass(frozen=True)
class AnswerKernels:
    """The kernels of answers, for one number type.

    Args:
        states: Raises the damage state of each sample to the number of limits that its largest demand exceeds.
        counts: Counts the samples of each status, and the samples without failure in each damage state.
        keys: Writes the demands at one place as keys to be sorted; failed samples become infinite, the last keys.
        picks: Reads the two order statistics next to each quantile from sorted keys.
    """

    states: wp.Kernel
    counts: wp.Kernel
    keys: wp.Kernel
    picks: wp.Kernel


def answer_kernels(dtype: str, device: str) -> AnswerKernels:
    """Return the kernels of answers for "float32" or "float64", compiled for a device."""
    with MAKING:
        kernels = _made(dtype)
    loaded(kernels.counts, device)  # the kernels share a module
    return kernels


@functools.cache
def _made(dtype: str) -> AnswerKernels:
    real = REALS[dtype]
    module = wp.get_module(f"warpdyn_live_answers_{dtype}")
    module.options.update({"enable_backward": False, **module_options(max_unroll=1)})

    @wp.kernel(name=f"raise_states_{dtype}", module=module, enable_backward=False)
    def raise_states(
        is_first: int,  # 1 for the first demand with limits, whose states replace those of the last answer
        is_absolute: int,  # 1 to take absolute values, 0 for demands that are not negative
        first: int,  # first place (storey or floor) that counts
        last: int,  # the place after the last one that counts
        samples_of_structure: int,
        demand: wp.array2d(dtype=real),  # [place, sample]
        divisor: wp.array2d(dtype=real),  # [structure or 1, place]
        limits: wp.array(dtype=wp.float64),  # [state], increasing; NaN: no limit
        states: wp.array(dtype=int),  # [sample]
    ):
        sample = wp.tid()
        row = wp.min(sample // samples_of_structure, divisor.shape[0] - 1)
        worst = real(0.0)
        is_known = bool(True)
        for place in range(first, last):
            value = demand[place, sample] / divisor[row, place]
            if is_absolute == 1:
                value = wp.abs(value)
            if wp.isnan(value):
                is_known = False
            worst = wp.max(worst, value)
        state = int(0)
        if is_known:
            for number in range(limits.shape[0]):
                if wp.float64(worst) > limits[number]:
                    state = number + 1
        if is_first == 0:
            state = wp.max(state, states[sample])
        states[sample] = state

    @wp.kernel(name="count_outcomes", module=module, enable_backward=False)
    def count_outcomes(
        status: wp.array(dtype=wp.int8),  # [sample]
        states: wp.array(dtype=int),  # [sample]
        counts: wp.array2d(dtype=int),  # [part, status and damage state], 0 before
    ):
        sample = wp.tid()
        part = sample % wp.static(PARTS)
        outcome = int(status[sample])
        wp.atomic_add(counts, part, outcome, 1)
        if outcome < wp.static(DIVERGED):
            state = states[sample]
            if outcome == wp.static(COLLAPSED):
                state = counts.shape[1] - wp.static(STATUSES + 1)  # the heaviest state
            wp.atomic_add(counts, part, wp.static(STATUSES) + state, 1)

    @wp.kernel(name=f"write_keys_{dtype}", module=module, enable_backward=False)
    def write_keys(
        row: int,  # row of `picked`
        place: int,
        samples_of_structure: int,
        status: wp.array(dtype=wp.int8),  # [sample]
        demand: wp.array2d(dtype=real),  # [place, sample]
        divisor: wp.array2d(dtype=real),  # [structure or 1, place]
        keys: wp.array(dtype=real),  # [sample]
        picked: wp.array2d(dtype=wp.float64),  # [row, order statistic]; the last one counts unknown demands, 0 before
    ):
        sample = wp.tid()
        key = real(wp.inf)
        if int(status[sample]) < wp.static(DIVERGED):
            value = demand[place, sample] / divisor[wp.min(sample // samples_of_structure, divisor.shape[0] - 1), place]
            if wp.isnan(value):
                wp.atomic_add(picked, row, picked.shape[1] - 1, wp.float64(1.0))
            else:
                key = value
        keys[sample] = key

    @wp.kernel(name=f"pick_{dtype}", module=module, enable_backward=False)
    def pick(
        row: int,
        quantiles: wp.array(dtype=wp.float64),
        counts: wp.array2d(dtype=int),
        keys: wp.array(dtype=real),  # [sample], sorted
        picked: wp.array2d(dtype=wp.float64),
    ):
        number = wp.tid()
        last = int(-1)  # index of the last sample that has not failed
        for part in range(wp.static(PARTS)):
            for outcome in range(wp.static(DIVERGED)):
                last += counts[part, outcome]
        below = int(wp.floor(wp.float64(last) * quantiles[number]))
        below = wp.clamp(below, 0, wp.max(last, 0))
        picked[row, 2 * number] = wp.float64(keys[below])
        picked[row, 2 * number + 1] = wp.float64(keys[wp.min(below + 1, wp.max(last, 0))])

    return AnswerKernels(raise_states, count_outcomes, write_keys, pick)
