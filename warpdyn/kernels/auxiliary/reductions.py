"""Reductions of samples: the damage state of each, counts of states, and sums in a fixed order.

Rows are structures, or samples one by one. A launch takes every `step`-th of them from `first` on: on a processor one
thread takes a range of them (step 1) and others take other ranges; on a GPU each thread takes one.
"""

import functools
import threading
from collections.abc import Callable
from dataclasses import dataclass

import warp as wp

from warpdyn.core.output_variables import COLLAPSED, DIVERGED, OK, STATUS_MEANINGS
from warpdyn.device.processor import ELEMENT, element_float64, module_options
from warpdyn.kernels.auxiliary.exact_sums import add_exactly

SUMS = 5  # sum, what its rounding left out, the same of squares, and the largest value
REALS = {"float32": wp.float32, "float64": wp.float64}
MODULE = "warpdyn_reductions"  # one of all, since a compiler takes as long for one kernel as for all


@dataclass(frozen=True)
class Reductions:
    """The kernels.

    Args:
        ratios: Storey drift ratios of samples, by type of their drifts.
        states: How many bounds each sample's demand is above, at each place and the worst, by type of the demand.
        least: The least of collapsed samples' largest demands, likewise.
        sums: Sums of the demands of each row by cell, in the order of its samples, likewise.
        counts: Counts of units (samples, or the worst of some of a row's) by cell and outcome.
        zeros: Nothing, in place of states.
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


MAKING = threading.Lock()  # statistics ask for them side by side, and a module takes each kernel once


def reductions() -> Reductions:
    """Return the kernels, which have a module in common."""
    with MAKING:
        return _made()


@functools.cache
def _made() -> Reductions:
    module = wp.get_module(MODULE)
    module.options.update({"enable_backward": False, **module_options(max_unroll=1)})
    of_reals = [{dtype: make(dtype) for dtype in REALS} for make in (_ratios, _states, _least, _sums)]
    return Reductions(*of_reals, _counts(), _zeros(), _losses(), _totals())


def _kernel(name: str) -> Callable:
    """Return what makes a kernel of the module in common, of which each needs a name of its own."""
    return wp.kernel(name=name, module=wp.get_module(MODULE), enable_backward=False)


@wp.func
def bounds_below(value: wp.float64, bounds: wp.array(dtype=wp.float64), first: int, half: int):
    """Return how many of 2 half - 1 bounds a value is above, by a binary search without branches."""
    found = int(0)
    step = half
    while step > 0:
        found += wp.where(value > element_float64(bounds, first + found + step - 1), step, 0)
        step = step // 2
    return found


def _ratios(dtype: str) -> wp.Kernel:
    real = REALS[dtype]

    @_kernel(f"find_ratios_{dtype}")
    def find_ratios(
        first: int,
        last: int,
        step: int,
        samples: int,  # of a structure
        drift: wp.array2d(dtype=real),  # [sample, place]
        height: wp.array2d(dtype=real),  # [structure or 1, place]
        ratio: wp.array2d(dtype=real),  # [sample, place]
    ):
        for sample in range(first + wp.tid(), last, step):
            structure = wp.min(sample // samples, height.shape[0] - 1)
            for place in range(ratio.shape[1]):
                ratio[sample, place] = drift[sample, place] / height[structure, place]

    return find_ratios


def _states(dtype: str) -> wp.Kernel:
    real, element = REALS[dtype], ELEMENT[dtype]

    @_kernel(f"find_states_{dtype}")
    def find_states(
        first: int,
        last: int,
        step: int,
        samples: int,  # in a row
        rows: int,  # of a structure
        places: int,
        is_absolute: int,  # 1 to take absolute values, 0 for demands that are not negative
        each_place: int,  # 1 to keep the states of every place besides the worst
        structure: wp.array(dtype=int),  # number of each
        status: wp.array(dtype=wp.int8),
        demand: wp.array(dtype=real),  # [sample, place]
        half: int,  # of the bounds of a kind and one more, a power of 2
        bounds: wp.array(dtype=wp.float64),  # [kind, bound], increasing
        kind: wp.array(dtype=int),  # of each structure
        states: wp.array2d(dtype=wp.uint16),  # [place, sample], the worst last; raised where they are lower
        bad: wp.array(dtype=int),  # by thread, a structure with a sample that is ok without a demand
        thread: int,
    ):
        column = states.shape[0] - 1
        for row in range(first + wp.tid(), last, step):
            of_row = kind[row // rows] * (2 * half - 1)
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
                    bad[thread] = structure[row // rows]
                reached = bounds_below(worst, bounds, of_row, half)
                states[column, sample] = wp.max(states[column, sample], wp.uint16(reached))

    return find_states


@wp.func
def parts_of(units: int, units_of_part: int):
    """Return how many parts of so many units there are."""
    return (units + units_of_part - 1) // units_of_part


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


def _counts() -> wp.Kernel:
    @_kernel("count_states")
    def count_states(
        first: int,  # of the parts: some units of a row
        last: int,
        step: int,
        units_of_part: int,
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
        parts = parts_of(cell_of_unit.shape[0], units_of_part)
        for part in range(first + wp.tid(), last, step):
            row = part // parts
            first_unit = (part - row * parts) * units_of_part
            for unit in range(first_unit, wp.min(first_unit + units_of_part, cell_of_unit.shape[0])):
                cell = cell_of_row[row] + cell_of_unit[unit]
                for place in range(places + 1):
                    outcome = worst_outcome(
                        row * samples, start[unit], start[unit + 1], order, status, states, place, top
                    )
                    column = place
                    if place == places:
                        column = counts.shape[0] - 1
                    wp.atomic_add(counts, column, cell, outcome, wp.int64(1))

    return count_states


def _zeros() -> wp.Kernel:
    @_kernel("clear_states")
    def clear_states(first: int, last: int, step: int, states: wp.array(dtype=wp.uint16)):
        for place in range(first + wp.tid(), last, step):
            states[place] = wp.uint16(0)

    return clear_states


def _losses() -> wp.Kernel:
    @_kernel("find_losses")
    def find_losses(
        first: int,  # of the parts: some units of a row
        last: int,
        step: int,
        units_of_part: int,
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
        parts = parts_of(units, units_of_part)
        for part in range(first + wp.tid(), last, step):
            row = part // parts
            first_unit = (part - row * parts) * units_of_part
            for unit in range(first_unit, wp.min(first_unit + units_of_part, units)):
                place = row * units + unit
                outcome = worst_outcome(row * samples, start[unit], start[unit + 1], order, status, states, column, top)
                if outcome > top:
                    status_of_unit[place] = wp.int8(outcome - top + wp.static(DIVERGED - 1))
                    loss[place, 0] = wp.float64(0.0)
                    loss[place, 1] = wp.float64(0.0)
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


def _least(dtype: str) -> wp.Kernel:
    real = REALS[dtype]

    @_kernel(f"find_least_{dtype}")
    def find_least(
        first: int,
        last: int,
        step: int,
        status: wp.array(dtype=wp.int8),
        demand: wp.array2d(dtype=real),  # [sample, place]
        least: wp.array(dtype=wp.float64),  # by thread; lowered
        thread: int,
    ):
        for sample in range(first + wp.tid(), last, step):
            if status[sample] == wp.int8(wp.static(COLLAPSED)):
                worst = demand[sample, 0]
                known = wp.isfinite(worst)
                for place in range(1, demand.shape[1]):
                    value = demand[sample, place]
                    known = known and wp.isfinite(value)
                    worst = wp.max(worst, value)
                if known:
                    wp.atomic_min(least, thread, wp.float64(worst))

    return find_least


def _sums(dtype: str) -> wp.Kernel:
    real = REALS[dtype]

    @_kernel(f"add_samples_{dtype}")
    def add_samples(
        first: int,  # of the parts: some units of a row
        last: int,
        step: int,
        units_of_part: int,
        origin: int,  # row that is the first of the sums
        samples: int,
        is_signed: int,  # 1 to take values as they are, 0 for the largest absolute one of all places
        place: int,  # -1 for the worst of all
        structure: wp.array(dtype=int),  # number of each row's
        status: wp.array(dtype=wp.int8),
        demand: wp.array2d(dtype=real),  # [sample, place]
        order: wp.array(dtype=int),  # samples of a row, unit by unit
        start: wp.array(dtype=int),  # of each unit in that order, and the end of the last one
        sums: wp.array3d(dtype=wp.float64),  # [row, unit, sum]
        bad: wp.array(dtype=int),
        thread: int,
    ):
        units = start.shape[0] - 1
        parts = parts_of(units, units_of_part)
        for part in range(first + wp.tid(), last, step):
            row = part // parts
            first_unit = (part - row * parts) * units_of_part
            for of_unit in range(first_unit, wp.min(first_unit + units_of_part, units)):
                total = wp.float64(0.0)
                left_out = wp.float64(0.0)
                squares = wp.float64(0.0)
                left_out_of_squares = wp.float64(0.0)
                largest = -wp.float64(wp.inf)
                for number in range(start[of_unit], start[of_unit + 1]):
                    sample = row * samples + order[number]
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
                            bad[thread] = structure[row]
                        after = total + value
                        left_out += rounded_off(total, value, after)
                        total = after
                        square = value * value
                        after_squares = squares + square
                        left_out_of_squares += rounded_off(squares, square, after_squares)
                        squares = after_squares
                        largest = wp.max(largest, value)
                sums[row - origin, of_unit, 0] = total
                sums[row - origin, of_unit, 1] = left_out
                sums[row - origin, of_unit, 2] = squares
                sums[row - origin, of_unit, 3] = left_out_of_squares
                sums[row - origin, of_unit, 4] = largest

    return add_samples


def _totals() -> wp.Kernel:
    @_kernel("add_rows")
    def add_rows(
        first: int,  # of the parts: some units of a group of rows; all rows of a cell are in one group
        last: int,
        step: int,
        units_of_part: int,
        order: wp.array(dtype=int),  # of rows, group by group
        start: wp.array(dtype=int),  # of each group in that order, and the end of the last one
        sums: wp.array3d(dtype=wp.float64),  # [row, unit, sum]
        cell_of_row: wp.array(dtype=int),
        cell_of_unit: wp.array(dtype=int),
        bins: wp.array3d(dtype=wp.int64),  # [cell, values or squares, uppermost piece and sums of pieces]
        largest: wp.array(dtype=wp.float64),  # [cell]
    ):
        units = cell_of_unit.shape[0]
        parts = parts_of(units, units_of_part)  # of a group
        for part in range(first + wp.tid(), last, step):
            group = part // parts
            first_unit = (part - group * parts) * units_of_part
            last_unit = wp.min(first_unit + units_of_part, units)
            for number in range(start[group], start[group + 1]):
                row = order[number]
                for unit in range(first_unit, last_unit):
                    cell = cell_of_row[row] + cell_of_unit[unit]
                    for which in range(2):
                        add_exactly(sums[row, unit, 2 * which], cell, which, bins)
                        add_exactly(sums[row, unit, 2 * which + 1], cell, which, bins)
                    largest[cell] = wp.max(largest[cell], sums[row, unit, 4])

    return add_rows
