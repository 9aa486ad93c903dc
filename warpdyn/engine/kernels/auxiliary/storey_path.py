"""The kernel that moves single storeys along given drift paths, with the device functions of a storey law.

The kernel records the force [N] and the dissipated energy [J] of each storey at each step.
"""

import functools

import warp as wp

from warpdyn.engine.device.processor import small_options
from warpdyn.engine.kernels.plan import DTYPES
from warpdyn.engine.laws.springs import StoreyRules, spring_row


@functools.cache
def storey_path_kernel(law: StoreyRules, dtype_name: str) -> wp.Kernel:
    """Return the kernel for a storey law; each thread moves one storey through all steps of its drift path."""
    spring, dtype = spring_row(law), DTYPES[dtype_name]
    HAS_MEMORY, C = spring.memory_after is not None, spring.coefficients
    force_of, held_of, recoverable_of = (
        spring.force,
        spring.force_at_accepted_state or spring.force,
        spring.elastic_energy,
    )
    advance = spring.memory_after or spring.force
    coefficient_vector = wp.types.vector(length=C, dtype=dtype)
    memory_vector = wp.types.vector(length=max(1, spring.memory), dtype=dtype)

    @wp.kernel(module="unique", enable_backward=False, module_options=small_options())
    def follow_storey_path(
        coefficients: wp.array2d(dtype=dtype),  # [coefficient, storey]
        drift: wp.array2d(dtype=dtype),  # [step, storey]
        force: wp.array2d(dtype=dtype),
        dissipated: wp.array2d(dtype=dtype),
    ):
        storey = wp.tid()
        c = coefficient_vector()
        for q in range(C):
            c[q] = coefficients[q, storey]
        memory = memory_vector()
        last_drift = dtype(0.0)
        last_force = force_of(last_drift, memory, c)
        work = dtype(0.0)
        for step in range(drift.shape[0]):
            now = drift[step, storey]
            if HAS_MEMORY:
                memory = advance(now, now - last_drift, memory, c)
            restoring = held_of(now, memory, c)
            work += dtype(0.5) * (restoring + last_force) * (now - last_drift)
            force[step, storey] = restoring
            dissipated[step, storey] = work - recoverable_of(now, memory, c)
            last_drift = now
            last_force = restoring

    return follow_storey_path
