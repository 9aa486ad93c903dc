"""Kernels for damage states: find the damage state of each sample, and count samples per cell and state.

The damage state is the number of limits that the response of a sample exceeds. A cell is the set of all samples with
the same labels.
"""

import warp as wp

from warpdyn.engine.device.processor import ELEMENT, element_float64
from warpdyn.engine.kernels.reductions.module import REALS, kernel_named, parts_of
from warpdyn.foundations.core.output_variables import COLLAPSED, DIVERGED, OK, STATUS_MEANINGS


@wp.func
def bounds_below(value: wp.float64, bounds: wp.array(dtype=wp.float64), first: int, half: int):
    """Return how many of the 2 half - 1 bounds from bounds[first] on a value exceeds.

    The bounds increase. The search is binary, without branches; `half` is a power of 2.
    """
    found = int(0)
    step = half
    while step > 0:
        found += wp.where(value > element_float64(bounds, first + found + step - 1), step, 0)
        step = step // 2
    return found


def states_kernel(dtype: str) -> wp.Kernel:
    """Return the kernel that counts the limits which the response of a sample exceeds (its damage state).

    The kernel counts these limits for the largest response of all places (storeys or floors) and, if requested, at each
    place.
    """
    real, element = REALS[dtype], ELEMENT[dtype]

    @kernel_named(f"find_states_{dtype}")
    def find_states(
        first: int,
        last: int,
        step: int,
        samples: int,  # number of samples in a row
        rows: int,  # number of rows of a structure
        places: int,
        first_counted: int,  # first storey or floor that counts for the worst state
        last_counted: int,  # the place after the last one that counts
        is_absolute: int,  # 1 to take absolute values, 0 for demands that are not negative
        each_place: int,  # 1: keep the states of every place, too; 0: only the worst
        structure: wp.array(dtype=int),  # number of the structure
        status: wp.array(dtype=wp.int8),
        demand: wp.array(dtype=real),  # [sample, place]
        half: int,  # (number of bounds of a kind + 1) / 2, a power of 2
        bounds: wp.array(dtype=wp.float64),  # [kind, bound], increasing
        kind: wp.array(dtype=int),  # kind of each structure
        states: wp.array2d(dtype=wp.uint16),  # [place, sample], the worst last; only increased
        bad: wp.array(dtype=int),  # [thread]: number of a structure with a sample that is ok but has no demand, or -1
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
                    if place >= first_counted and place < last_counted:
                        worst = wp.max(worst, value)
                    if each_place == 1:
                        reached = bounds_below(value, bounds, of_row, half)
                        states[place, sample] = wp.max(states[place, sample], wp.uint16(reached))
                if wrong > 0 and status[sample] == wp.int8(wp.static(OK)):
                    bad[thread] = structure[row // rows]
                reached = bounds_below(worst, bounds, of_row, half)
                states[column, sample] = wp.max(states[column, sample], wp.uint16(reached))

    return find_states


def zeros_kernel() -> wp.Kernel:
    """Return the kernel that sets all damage states to 0."""

    @kernel_named("clear_states")
    def clear_states(first: int, last: int, step: int, states: wp.array(dtype=wp.uint16)):
        for place in range(first + wp.tid(), last, step):
            states[place] = wp.uint16(0)

    return clear_states


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
    """Return the worst damage state of some samples of a structure, or a number that represents their failure.

    The samples are `origin + order[first]` to `origin + order[last - 1]`. A collapsed sample is in the last state,
    `top`. If a sample has failed and no other sample is in the last state, the result is above `top`.
    """
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
    # The state of a failed sample is unknown. This does not matter if another sample is in the last state.
    if failed > 0 and worst < top:
        worst = top + failed - wp.static(DIVERGED - 1)
    return worst


def counts_kernel() -> wp.Kernel:
    """Return the kernel that counts units (samples or groups of samples) for each cell and damage state or failure."""

    @kernel_named("count_states")
    def count_states(
        first: int,  # first part; a part is a range of units of one row
        last: int,
        step: int,
        units_of_part: int,
        samples: int,
        status: wp.array(dtype=wp.int8),
        states: wp.array2d(dtype=wp.uint16),  # [place, sample], the worst last
        cell_of_row: wp.array(dtype=int),
        cell_of_unit: wp.array(dtype=int),
        order: wp.array(dtype=int),  # samples of a row, unit by unit
        # Position of the first sample of each unit in `order`, and the end of the last unit.
        start: wp.array(dtype=int),
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
