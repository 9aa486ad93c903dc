"""Reductions of samples on a CPU: the damage state of each, counts of states, and sums in a fixed order.

Each call takes some rows of samples, so that threads share a block; rows are structures, or samples one by one.
"""

import functools

import warp as wp

from warpdyn.core.output_variables import COLLAPSED, DIVERGED, OK, STATUS_MEANINGS
from warpdyn.device.processor import ELEMENT, element_float64, module_options
from warpdyn.kernels.kernel_cache import loaded

SUMS = 5  # sum, what its rounding left out, the same of squares, and the largest value
REALS = {"float32": wp.float32, "float64": wp.float64}
OPTIONS = {"module": "unique", "enable_backward": False, "module_options": module_options(max_unroll=1)}


@wp.func
def bounds_below(value: wp.float64, bounds: wp.array(dtype=wp.float64), first: int, half: int):
    """Return how many of 2 half - 1 bounds a value is above, by a binary search without branches."""
    found = int(0)
    step = half
    while step > 0:
        found += wp.where(value > element_float64(bounds, first + found + step - 1), step, 0)
        step = step // 2
    return found


@functools.cache
def states_kernel(dtype: str) -> wp.Kernel:
    """Return the kernel that finds how many bounds each sample's demand is above, at each place and the worst."""
    real, element = REALS[dtype], ELEMENT[dtype]

    @wp.kernel(**OPTIONS)
    def find_states(
        first: int,
        last: int,
        samples: int,  # in a row
        places: int,
        is_absolute: int,  # 1 to take absolute values, 0 for demands that are not negative
        each_place: int,  # 1 to keep the states of every place besides the worst
        status: wp.array(dtype=wp.int8),
        demand: wp.array(dtype=real),  # [sample, place]
        half: int,  # of the bounds of a kind and one more, a power of 2
        bounds: wp.array(dtype=wp.float64),  # [kind, bound], increasing
        kind: wp.array(dtype=int),  # of each row
        states: wp.array2d(dtype=wp.uint16),  # [place, sample], the worst last; raised where they are lower
        bad: wp.array(dtype=int),  # by thread, a sample that is ok without a demand
        thread: int,
    ):
        column = states.shape[0] - 1
        for row in range(first, last):
            of_row = kind[row] * (2 * half - 1)
            for number in range(samples):
                sample = row * samples + number
                worst = wp.float64(0.0)
                wrong = int(0)
                for place in range(places):
                    value = wp.float64(element(demand, sample * places + place))
                    if is_absolute == 1:
                        value = wp.abs(value)
                    wrong += wp.where(value >= wp.float64(0.0) and value < wp.float64(wp.inf), 0, 1)
                    worst = wp.max(worst, value)
                    if each_place == 1:
                        reached = bounds_below(value, bounds, of_row, half)
                        states[place, sample] = wp.max(states[place, sample], wp.uint16(reached))
                if wrong > 0 and status[sample] == wp.int8(wp.static(OK)):
                    bad[thread] = sample
                reached = bounds_below(worst, bounds, of_row, half)
                states[column, sample] = wp.max(states[column, sample], wp.uint16(reached))

    return find_states


@wp.func
def worst_outcome(
    origin: int,  # first sample of the row
    first: int,
    last: int,
    order: wp.array(dtype=int),
    status: wp.array(dtype=wp.int8),
    states: wp.array2d(dtype=wp.uint16),
    place: int,
    top: int,  # the last state
):
    """Return the worst state of some samples of a row, or what a failure is counted as."""
    worst = int(0)
    failed = int(0)
    for number in range(first, last):
        sample = origin + order[number]
        outcome = int(status[sample])
        if outcome >= wp.static(DIVERGED):
            if failed == 0 or outcome < failed:
                failed = outcome
        elif outcome == wp.static(COLLAPSED):
            worst = top
        else:
            worst = wp.max(worst, int(states[place, sample]))
    # A failed sample leaves the worst unknown, unless another one reached the last state.
    if failed > 0 and worst < top:
        worst = top + failed - wp.static(DIVERGED - 1)
    return worst


@functools.cache
def counts_kernel() -> wp.Kernel:
    """Return the kernel that counts units (samples, or the worst of some of a row's) by cell and outcome."""

    @wp.kernel(**OPTIONS)
    def count_states(
        first: int,
        last: int,
        samples: int,
        status: wp.array(dtype=wp.int8),
        states: wp.array2d(dtype=wp.uint16),  # [place, sample], the worst last
        cell_of_row: wp.array(dtype=int),
        cell_of_unit: wp.array(dtype=int),
        order: wp.array(dtype=int),  # samples of a row, unit by unit
        start: wp.array(dtype=int),  # of each unit in that order, and the end of the last one
        counts: wp.array3d(dtype=wp.int64),  # [place, cell, outcome]; states, and after them failures by status
    ):
        places = states.shape[0] - 1
        top = counts.shape[2] - 1 - wp.static(len(STATUS_MEANINGS) - DIVERGED)
        for row in range(first, last):
            for unit in range(cell_of_unit.shape[0]):
                cell = cell_of_row[row] + cell_of_unit[unit]
                for place in range(places + 1):
                    outcome = worst_outcome(
                        row * samples, start[unit], start[unit + 1], order, status, states, place, top
                    )
                    column = place
                    if place == places:
                        column = counts.shape[0] - 1
                    counts[column, cell, outcome] += wp.int64(1)

    return count_states


@functools.cache
def losses_kernel() -> wp.Kernel:
    """Return the kernel that finds the loss of each unit, and its variance by the scatter of the loss ratio."""

    @wp.kernel(**OPTIONS)
    def find_losses(
        first: int,
        last: int,
        samples: int,
        status: wp.array(dtype=wp.int8),
        states: wp.array2d(dtype=wp.uint16),
        order: wp.array(dtype=int),
        start: wp.array(dtype=int),
        ratios: wp.array3d(dtype=wp.float64),  # [kind, state, mean and variance]
        kind: wp.array(dtype=int),  # of each row
        value: wp.array(dtype=wp.float64),  # of each row
        status_of_unit: wp.array(dtype=wp.int8),  # [row, unit]; collapsed units have a loss as others
        loss: wp.array2d(dtype=wp.float64),  # [row and unit, mean and variance]
    ):
        units = start.shape[0] - 1
        top = ratios.shape[1] - 1
        column = states.shape[0] - 1
        for row in range(first, last):
            for unit in range(units):
                place = row * units + unit
                outcome = worst_outcome(row * samples, start[unit], start[unit + 1], order, status, states, column, top)
                if outcome > top:
                    status_of_unit[place] = wp.int8(outcome - top + wp.static(DIVERGED - 1))
                else:
                    status_of_unit[place] = wp.int8(wp.static(OK))
                    loss[place, 0] = value[row] * ratios[kind[row], outcome, 0]
                    loss[place, 1] = value[row] * value[row] * ratios[kind[row], outcome, 1]

    return find_losses


@wp.func
def rounded_off(before: wp.float64, value: wp.float64, after: wp.float64):
    """Return what rounding left out of a sum (Knuth's two-sum)."""
    part = after - before
    return (before - (after - part)) + (value - part)


@functools.cache
def sums_kernel(dtype: str) -> wp.Kernel:
    """Return the kernel that adds up the demands of each row by cell, in the order of its samples."""
    real = REALS[dtype]

    @wp.kernel(**OPTIONS)
    def add_samples(
        first: int,
        last: int,
        origin: int,  # row that is the first of the sums
        samples: int,
        is_signed: int,  # 1 to take values as they are, 0 for the largest absolute one of all places
        place: int,  # -1 for the worst of all
        status: wp.array(dtype=wp.int8),
        demand: wp.array2d(dtype=real),  # [sample, place]
        unit: wp.array(dtype=int),  # of each sample of a row
        sums: wp.array3d(dtype=wp.float64),  # [row, unit, sum]
        bad: wp.array(dtype=int),
        thread: int,
    ):
        for row in range(first, last):
            place_of_row = row - origin
            for number in range(sums.shape[1]):
                for which in range(wp.static(SUMS - 1)):
                    sums[place_of_row, number, which] = wp.float64(0.0)
                sums[place_of_row, number, 4] = -wp.float64(wp.inf)
            for number in range(samples):
                sample = row * samples + number
                if status[sample] == wp.int8(wp.static(OK)):
                    value = wp.float64(0.0)
                    if place >= 0:
                        value = wp.float64(demand[sample, place])
                    else:
                        value = wp.float64(demand[sample, 0])
                        if is_signed == 0:
                            value = wp.abs(value)
                            for other in range(1, demand.shape[1]):
                                value = wp.max(value, wp.abs(wp.float64(demand[sample, other])))
                    if not wp.isfinite(value):
                        bad[thread] = sample
                    of_unit = unit[number]
                    for which in range(2):
                        term = value
                        if which == 1:
                            term = value * value
                        before = sums[place_of_row, of_unit, 2 * which]
                        after = before + term
                        sums[place_of_row, of_unit, 2 * which] = after
                        sums[place_of_row, of_unit, 2 * which + 1] += rounded_off(before, term, after)
                    sums[place_of_row, of_unit, 4] = wp.max(sums[place_of_row, of_unit, 4], value)

    return add_samples


def launch(kernel: wp.Kernel, *arguments: object) -> None:
    """Run a kernel in the calling thread."""
    wp.launch(loaded(kernel), dim=1, inputs=list(arguments), device="cpu")
