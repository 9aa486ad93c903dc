"""The kernel that computes a trial step of each storey of a building, with the device functions of the storey law."""

import functools

import warp as wp

from warpdyn.engine.device.processor import small_options
from warpdyn.engine.laws.springs import StoreyRules, spring_row


@functools.cache
def storey_step_kernel(law: StoreyRules) -> wp.Kernel:
    """Return the kernel for a storey law, in double precision.

    Each thread computes a trial step of one storey: from the accepted drift and memory and the new drift, it computes
    the new memory, the force [N], the tangent stiffness [N/m] and the recoverable energy [J].
    """
    spring = spring_row(law)
    HAS_MEMORY, C, M = spring.memory_after is not None, spring.coefficients, max(1, spring.memory)
    force_of, tangent_of, recoverable_of = (
        spring.force_at_accepted_state or spring.force,
        spring.tangent,
        spring.elastic_energy,
    )
    advance = spring.memory_after or spring.force
    coefficient_vector = wp.types.vector(length=C, dtype=wp.float64)
    memory_vector = wp.types.vector(length=M, dtype=wp.float64)

    @wp.kernel(module="unique", enable_backward=False, module_options=small_options())
    def try_storey_step(
        coefficients: wp.array2d(dtype=wp.float64),  # [coefficient, storey]
        accepted_drift: wp.array(dtype=wp.float64),
        accepted_memory: wp.array2d(dtype=wp.float64),  # [memory, storey]
        drift: wp.array(dtype=wp.float64),
        memory: wp.array2d(dtype=wp.float64),  # after the step
        force: wp.array(dtype=wp.float64),
        tangent: wp.array(dtype=wp.float64),
        recoverable: wp.array(dtype=wp.float64),
    ):
        storey = wp.tid()
        c = coefficient_vector()
        for q in range(C):
            c[q] = coefficients[q, storey]
        before = memory_vector()
        for q in range(M):
            before[q] = accepted_memory[q, storey]
        now = drift[storey]
        increment = now - accepted_drift[storey]
        after = before
        if HAS_MEMORY:
            after = advance(now, increment, before, c)
        for q in range(M):
            memory[q, storey] = after[q]
        force[storey] = force_of(now, after, c)
        tangent[storey] = tangent_of(now, increment, before, after, c)
        recoverable[storey] = recoverable_of(now, after, c)

    return try_storey_step
