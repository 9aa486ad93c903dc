"""Device functions for random base motions, which a kernel generates interval by interval and does not store.

`warpdyn.model.ground_motions.filtered_noise` describes the random process. Arguments and results are vectors with one
value per lane (one of the samples that a thread integrates at once). Copying the vectors once per interval costs
little, and the compiler vectorises the loops over lanes on a CPU.
"""

import functools
from types import SimpleNamespace

import warp as wp

from warpdyn.engine.device.random_numbers import normal_pair
from warpdyn.engine.kernels.loads import LOADS
from warpdyn.engine.kernels.plan import DTYPES, Plan, row_types, structs
from warpdyn.foundations.core.random_numbers import Purpose


@functools.cache
def noise_of(plan: Plan) -> SimpleNamespace:
    """Return the types and the function for random base motions in the kernel of a plan.

    Returns:
        `Processes`, the type of the states of the random processes, [state, lane]; `Numbers`, the type of the indices
        of the samples; and `over_interval`, the function that computes the motions in an interval. A lane is one of the
        samples that a thread integrates at once.
    """
    dtype, types, LANES = DTYPES[plan.dtype], structs(plan.dtype), plan.lanes
    STATES = max(1, LOADS[plan.load].noise_states)
    PAIRS, IS_WHITE = (STATES + 1) // 2, STATES == 1
    row, row64, indices = row_types(plan)
    Processes = wp.types.matrix(shape=(STATES, LANES), dtype=wp.float64)
    Numbers = wp.types.vector(length=LANES, dtype=wp.uint64)
    # Positions of the parts of the process in `loads.noise`.
    GROWTH, KICK, START = 0, STATES * STATES, 2 * STATES * STATES
    OUTPUT, ENVELOPE = 3 * STATES * STATES, 3 * STATES * STATES + STATES

    @wp.func
    def at_node(loads: types.Load, key: wp.uint64, number: Numbers, node: int, before: Processes):
        """Return the states of the random processes at the start of an interval, from those one interval earlier."""
        after = Processes()
        first = row64()
        second = row64()
        for i in range(STATES):
            for k in range(STATES):
                left = loads.noise[GROWTH + i * STATES + k]
                for j in range(LANES):
                    after[i, j] += left * before[k, j]
        kick = KICK
        if node == 0:
            kick = START
        # A rolled loop: unrolled, the pairs would need too many registers of a GPU.
        pairs = int(PAIRS)
        for pair in range(pairs):
            for j in range(LANES):
                drawn = normal_pair(key, number[j], Purpose.GROUND_MOTION, wp.uint32(node * PAIRS + pair))
                first[j] = drawn[0]
                second[j] = drawn[1]
            for i in range(STATES):
                added = loads.noise[kick + i * STATES + 2 * pair]
                for j in range(LANES):
                    after[i, j] += added * first[j]
                if not IS_WHITE:
                    added = loads.noise[kick + i * STATES + 2 * pair + 1]
                    for j in range(LANES):
                        after[i, j] += added * second[j]
        return after

    @wp.func
    def acceleration(loads: types.Load, node: int, processes: Processes):
        """Return the base accelerations of all lanes at the start of interval `node` [m/s2]."""
        total = row64()
        for k in range(STATES):
            share = loads.noise[OUTPUT + k] * loads.noise[ENVELOPE + node]
            for j in range(LANES):
                total[j] += share * processes[k, j]
        return total

    @wp.func
    def over_interval(
        loads: types.Load,
        key: wp.uint64,
        number: Numbers,
        interval: int,
        run: indices,
        scale: row,
        processes: Processes,
    ):
        """Return the random motions of all lanes in an interval, and the states of the random processes at its end.

        Args:
            loads: The load.
            key: Key of the random numbers, computed from the seed.
            number: Index of each sample in the run.
            interval: Index of the interval.
            run: Number of intervals in the run of each sample.
            scale: Factor on each motion.
            processes: The states at the start of the interval, which the call for the previous interval returned.

        Returns:
            The acceleration at the start of the interval and its change over the interval [m/s2], as `loads.sampled`
            does; and the states at the end of the interval.
        """
        begin = row()
        change = row()
        here = processes
        last = loads.intervals[0]
        if interval == 0:
            here = at_node(loads, key, number, 0, Processes())
        if interval <= last:
            seen = acceleration(loads, interval, here)
            for j in range(LANES):
                begin[j] = dtype(seen[j]) * scale[j]
                # A run that ends with its motion uses the last value; in a longer run the motion is zero from here on.
                if interval == last and run[j] != last:
                    begin[j] = dtype(0.0)
        after = here
        if interval < last:
            after = at_node(loads, key, number, interval + 1, here)
            seen = acceleration(loads, interval + 1, after)
            for j in range(LANES):
                change[j] = dtype(seen[j]) * scale[j] - begin[j]
        return begin, change, after

    return SimpleNamespace(Processes=Processes, Numbers=Numbers, over_interval=over_interval)
