"""Kernels that compute drift ratios and losses, and their sums over all samples with the same labels (a cell)."""

import warp as wp

from warpdyn.engine.kernels.reductions.exact_sums import add_exactly
from warpdyn.engine.kernels.reductions.module import REALS, kernel_named, parts_of
from warpdyn.engine.kernels.reductions.states import worst_outcome
from warpdyn.foundations.core.output_variables import COLLAPSED, DIVERGED, OK

SUMS = 5  # sum and its rounding error, sum of squares and its rounding error, largest value


def ratios_kernel(dtype: str) -> wp.Kernel:
    """Return the kernel that divides the storey drifts of samples by the storey heights."""
    real = REALS[dtype]

    @kernel_named(f"find_ratios_{dtype}")
    def find_ratios(
        first: int,
        last: int,
        step: int,
        samples: int,  # number of samples of a structure
        drift: wp.array2d(dtype=real),  # [sample, place]
        height: wp.array2d(dtype=real),  # [structure or 1, place]
        ratio: wp.array2d(dtype=real),  # [sample, place]
    ):
        for sample in range(first + wp.tid(), last, step):
            structure = wp.min(sample // samples, height.shape[0] - 1)
            for place in range(ratio.shape[1]):
                ratio[sample, place] = drift[sample, place] / height[structure, place]

    return find_ratios


def least_kernel(dtype: str) -> wp.Kernel:
    """Return the kernel that finds the smallest peak response among the collapsed samples."""
    real = REALS[dtype]

    @kernel_named(f"find_least_{dtype}")
    def find_least(
        first: int,
        last: int,
        step: int,
        status: wp.array(dtype=wp.int8),
        demand: wp.array2d(dtype=real),  # [sample, place]
        least: wp.array(dtype=wp.float64),  # smallest peak so far, [thread]
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


def losses_kernel() -> wp.Kernel:
    """Return the kernel that computes the mean loss of each unit, and its variance due to random loss ratios.

    A unit is a sample or a group of samples.
    """

    @kernel_named("find_losses")
    def find_losses(
        first: int,  # first part; a part is a range of units of one row
        last: int,
        step: int,
        units_of_part: int,
        samples: int,
        status: wp.array(dtype=wp.int8),
        states: wp.array2d(dtype=wp.uint16),
        order: wp.array(dtype=int),
        start: wp.array(dtype=int),
        ratios: wp.array3d(dtype=wp.float64),  # [kind, state, mean and variance]
        kind: wp.array(dtype=int),  # kind of the structure, [row]
        value: wp.array(dtype=wp.float64),  # replacement value, [row]
        status_of_unit: wp.array(dtype=wp.int8),  # [row, unit]; collapsed units have a loss, too
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
    """Return the rounding error of the sum after = before + value (Knuth's two-sum)."""
    part = after - before
    return (before - (after - part)) + (value - part)


def sums_kernel(dtype: str) -> wp.Kernel:
    """Return the kernel that adds up the responses of the samples in each unit of a row, in the order of the samples.

    A row is a structure, a draw or a sample; it consists of units (samples or groups of samples).
    """
    real = REALS[dtype]

    @kernel_named(f"add_samples_{dtype}")
    def add_samples(
        first: int,  # first part; a part is a range of units of one row
        last: int,
        step: int,
        units_of_part: int,
        origin: int,  # number of the row whose sums are the first in `sums`
        samples: int,
        is_signed: int,  # 1: signed values; 0: the largest absolute value of all places
        place: int,  # -1: the largest value of the places that count
        first_counted: int,
        last_counted: int,  # the place after the last one that counts
        structure: wp.array(dtype=int),  # number of the structure, [row]
        status: wp.array(dtype=wp.int8),
        demand: wp.array2d(dtype=real),  # [sample, place]
        order: wp.array(dtype=int),  # samples of a row, unit by unit
        # Position of the first sample of each unit in `order`, and the end of the last unit.
        start: wp.array(dtype=int),
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
                            value = wp.float64(demand[sample, first_counted])
                            if is_signed == 0:
                                value = wp.abs(value)
                                for other in range(first_counted + 1, last_counted):
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


def totals_kernel() -> wp.Kernel:
    """Return the kernel that adds the sums of rows exactly to the sums of cells (see `exact_sums`).

    A row is a structure, a draw or a sample; a cell is the set of all samples with the same labels.
    """

    @kernel_named("add_rows")
    def add_rows(
        first: int,  # first part; a part is some units of some rows of a group. All rows of a cell are in one group
        last: int,
        step: int,
        units_of_part: int,
        copies: int,  # number of copies of the cells; each copy adds some rows of a group
        order: wp.array(dtype=int),  # rows, group by group
        start: wp.array(dtype=int),  # position of the first row of each group in `order`, and the end of the last group
        sums: wp.array3d(dtype=wp.float64),  # [row, unit, sum]
        cell_of_row: wp.array(dtype=int),
        cell_of_unit: wp.array(dtype=int),
        bins: wp.array3d(dtype=wp.int64),  # [copy and cell, values or squares, uppermost piece and sums of pieces]
        largest: wp.array(dtype=wp.float64),  # [copy and cell]
    ):
        units = cell_of_unit.shape[0]
        parts = parts_of(units, units_of_part)  # number of parts of a group
        of_copy = bins.shape[0] // copies
        for part in range(first + wp.tid(), last, step):
            group_and_copy = part // parts
            group = group_and_copy // copies
            copy = group_and_copy - group * copies
            first_unit = (part - group_and_copy * parts) * units_of_part
            last_unit = wp.min(first_unit + units_of_part, units)
            for number in range(start[group] + copy, start[group + 1], copies):
                row = order[number]
                for unit in range(first_unit, last_unit):
                    cell = cell_of_row[row] + cell_of_unit[unit] + copy * of_copy
                    for which in range(2):
                        add_exactly(sums[row, unit, 2 * which], cell, which, bins)
                        add_exactly(sums[row, unit, 2 * which + 1], cell, which, bins)
                    largest[cell] = wp.max(largest[cell], sums[row, unit, 4])

    return add_rows
