"""The module of all reductions: what its kernels have in common."""

from collections.abc import Callable

import warp as wp

REALS = {"float32": wp.float32, "float64": wp.float64}
MODULE = "warpdyn_reductions"  # one of all, since a compiler takes as long for one kernel as for all


def kernel_named(name: str) -> Callable:
    """Return what makes a kernel of the module, of which each needs a name of its own."""
    return wp.kernel(name=name, module=wp.get_module(MODULE), enable_backward=False)


@wp.func
def parts_of(units: int, units_of_part: int):
    """Return how many parts of so many units there are."""
    return (units + units_of_part - 1) // units_of_part
