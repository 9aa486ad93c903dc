"""The kernel that moves a biaxial spring along a given path, with the device functions of history kernels."""

import functools

import warp as wp

from warpdyn.engine.device.processor import small_options
from warpdyn.engine.laws.biaxial.functions import biaxial_functions
from warpdyn.engine.laws.springs import Variant


@functools.cache
def biaxial_path_kernel(law: Variant) -> wp.Kernel:
    """Return the kernel for a biaxial law, in double precision; its only thread moves the spring along the path."""
    functions = biaxial_functions(law)
    C, force_of, advance = functions.coefficients, functions.force, functions.memory_after
    coefficient_vector = wp.types.vector(length=C, dtype=wp.float64)
    memory_vector = wp.types.vector(length=functions.memory, dtype=wp.float64)

    @wp.kernel(module="unique", enable_backward=False, module_options=small_options())
    def follow_biaxial_path(
        coefficients: wp.array(dtype=wp.float64),
        path: wp.array2d(dtype=wp.float64),  # [step, component]
        force: wp.array2d(dtype=wp.float64),
    ):
        c = coefficient_vector()
        for q in range(C):
            c[q] = coefficients[q]
        memory = memory_vector()
        last = wp.vec2d()
        for step in range(path.shape[0]):
            now = wp.vec2d(path[step, 0], path[step, 1])
            memory = advance(now, now - last, memory, c)
            found = force_of(now, wp.vec2d(), memory, c)
            force[step, 0] = found[0]
            force[step, 1] = found[1]
            last = now

    return follow_biaxial_path
