"""The kernel of `certify`, the check of a storey law: it calls all device functions of the law along drift paths."""

import functools

import warp as wp

from warpdyn.engine.device.processor import small_options
from warpdyn.engine.kernels.plan import DTYPES
from warpdyn.engine.laws.springs import StoreyRules, spring_row

FASTER = 3.0  # rate independence: ratio of the two velocities at which the memory rates are compared
#: The results at each step: the force just before the end of the step and at its end, the force at an accepted state,
#: the force of a trial step, the tangent, the elastic energy, the difference between `return_mapping` and
#: `memory_after`, the difference between `memory_on_line` and `memory_after`, whether the storey leaves its line, the
#: tangent on the line, and the difference of memory rates at two velocities.
ANSWERS = (
    "behind", "force", "held", "trial", "tangent", "recoverable", "unlike_advance", "unlike_mapping", "leaves_line",
    "tangent_on_line", "unlike_slower",
)  # fmt: skip


@functools.cache
def storey_answers_kernel(rules: StoreyRules, dtype: str) -> wp.Kernel:
    """Return the kernel that moves storeys along drift paths and calls all functions of their law at each step."""
    spring = spring_row(rules)
    number = DTYPES[dtype]
    C, MEMORY, LINE_VALUES = spring.coefficients, max(1, spring.memory), spring.values_on_line or spring.memory
    ADVANCES, MAPS, HAS_LINES, HAS_RATE = (
        function is not None
        for function in (spring.memory_after, spring.return_mapping, spring.memory_on_line, spring.rate)
    )
    force_of, recoverable_of, tangent_of = spring.force, spring.elastic_energy, spring.tangent
    held_of = spring.force_at_accepted_state or force_of
    advance, mapped_memory, rate_of, memory_on_line, leaves_line, tangent_on_line = (
        function or force_of
        for function in (
            spring.memory_after,
            spring.return_mapping,
            spring.rate,
            spring.memory_on_line,
            spring.leaves_line,
            spring.tangent_on_line,
        )
    )
    coefficient_vector = wp.types.vector(length=C, dtype=number)
    memory_vector = wp.types.vector(length=MEMORY, dtype=number)

    # Loops stay rolled: most of the time is compilation.
    @wp.kernel(module="unique", enable_backward=False, module_options=small_options(max_unroll=1))
    def follow(
        coefficients: wp.array2d(dtype=number),
        drift: wp.array2d(dtype=number),
        chord: number,
        result: wp.array3d(dtype=number),
    ):
        storey = wp.tid()
        c = coefficient_vector()
        for q in range(C):
            c[q] = coefficients[q, storey]
        memory = memory_vector()
        last = number(0.0)
        for step in range(drift.shape[0]):
            now = drift[step, storey]
            way = wp.where(now < last, -chord, chord)
            after = memory
            for k in range(2):
                # A chord ends at the step: the law is not asked for drifts beyond it.
                at = now - number(1 - k) * way
                if ADVANCES:
                    after = advance(at, at - last, memory, c)
                result[k, step, storey] = force_of(at, after, c)
            result[2, step, storey] = held_of(now, after, c)
            # Force of a trial stage: with the memory at the start of the step.
            result[3, step, storey] = force_of(now, memory, c)
            result[4, step, storey] = tangent_of(now, now - last, memory, after, c)
            result[5, step, storey] = recoverable_of(now, after, c)
            result[6, step, storey] = number(0.0)
            if MAPS:
                mapped = mapped_memory(now, memory, c)
                for m in range(MEMORY):
                    result[6, step, storey] += wp.abs(mapped[m] - after[m])
            result[7, step, storey] = number(0.0)
            result[8, step, storey] = number(1.0)
            result[9, step, storey] = result[4, step, storey]
            if HAS_LINES:  # Warp needs a constant condition in a separate `if`
                if not leaves_line(now, memory, c):
                    on_line = memory_on_line(now, memory, c)
                    result[8, step, storey] = number(0.0)
                    result[9, step, storey] = tangent_on_line(now, memory, c)
                    for m in range(LINE_VALUES):
                        result[7, step, storey] += wp.abs(on_line[m] - after[m])
            result[10, step, storey] = number(0.0)
            if HAS_RATE:
                slow = rate_of(now - last, memory, c)
                fast = rate_of(number(FASTER) * (now - last), memory, c)
                for m in range(MEMORY):
                    result[10, step, storey] += wp.abs(fast[m] / number(FASTER) - slow[m])
            memory = after
            last = now

    return follow
