"""The kernel that compares measured hysteresis loops with those of many candidates of a storey law.

Each thread moves one candidate along the measured drifts and adds up the differences of forces, so that no loop is
stored.
"""

import functools

import warp as wp

from warpdyn.engine.device.processor import small_options
from warpdyn.engine.laws.devices.viscous_damper import damper_force
from warpdyn.engine.laws.springs import StoreyRules, spring_row


@functools.cache
def loop_misfit_kernel(law: StoreyRules, *, has_damper: bool) -> wp.Kernel:
    """Return the kernel for a storey law, in double precision.

    Args:
        law: Device functions of the law, dampers and stops of the storey.
        has_damper: Whether a viscous damper acts in parallel.
    """
    spring = spring_row(law)
    HAS_MEMORY, HAS_DAMPER, C = spring.memory_after is not None, has_damper, spring.coefficients
    held_of = spring.force_at_accepted_state or spring.force
    advance = spring.memory_after or spring.force
    coefficient_vector = wp.types.vector(length=C, dtype=wp.float64)
    memory_vector = wp.types.vector(length=max(1, spring.memory), dtype=wp.float64)

    @wp.kernel(module="unique", enable_backward=False, module_options=small_options(max_unroll=1))
    def compare_loops(
        coefficients: wp.array2d(dtype=wp.float64),  # [coefficient, candidate]
        longest: wp.array(dtype=wp.float64),  # longest change of the drift in one step of the law [candidate]
        damper: wp.array2d(dtype=wp.float64),  # coefficient, exponent - 1, linear velocity; [3, candidate]
        drift: wp.array(dtype=wp.float64),  # [point]
        velocity: wp.array(dtype=wp.float64),
        measured: wp.array(dtype=wp.float64),
        first: wp.int32,  # the first point that counts
        sums: wp.array(dtype=wp.float64),  # of measured minus computed force [candidate]
        squares: wp.array(dtype=wp.float64),  # of its squares
        peak: wp.array(dtype=wp.float64),  # largest absolute computed force
    ):
        candidate = wp.tid()
        c = coefficient_vector()
        for q in range(C):
            c[q] = coefficients[q, candidate]
        memory = memory_vector()
        last = wp.float64(0.0)
        total = wp.float64(0.0)
        square = wp.float64(0.0)
        largest = wp.float64(0.0)
        for point in range(drift.shape[0]):
            now = drift[point]
            if HAS_MEMORY:
                parts = wp.int32(wp.ceil(wp.abs(now - last) / longest[candidate]))
                if parts < 1:
                    parts = 1
                part = (now - last) / wp.float64(parts)
                for k in range(parts):
                    at = last + wp.float64(k + 1) * part
                    if k == parts - 1:
                        at = now
                    memory = advance(at, part, memory, c)
            force = held_of(now, memory, c)
            if HAS_DAMPER:
                force += damper_force(velocity[point], damper[0, candidate], damper[1, candidate], damper[2, candidate])
            difference = measured[point] - force
            if point >= first:
                total += difference
                square += difference * difference
                largest = wp.max(largest, wp.abs(force))
            last = now
        sums[candidate] = total
        squares[candidate] = square
        peak[candidate] = largest

    return compare_loops
