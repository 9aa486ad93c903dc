"""The Warp module that contains the kernels of all reductions (counts and sums over samples), and shared functions."""

from collections.abc import Callable

import warp as wp

REALS = {"float32": wp.float32, "float64": wp.float64}
MODULE = "warpdyn_reductions"  # one module, because compiling one kernel takes as long as compiling all


def kernel_named(name: str) -> Callable:
    """Return a decorator that adds a kernel with this name to the module of the reductions; a name may occur once."""
    return wp.kernel(name=name, module=wp.get_module(MODULE), enable_backward=False)


@wp.func
def parts_of(units: int, units_of_part: int):
    """Return the number of parts into which `units` units are divided, with at most `units_of_part` units per part."""
    return (units + units_of_part - 1) // units_of_part
