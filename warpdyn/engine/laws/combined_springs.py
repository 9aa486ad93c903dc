"""Functions in kernels for combinations: a law with a damper or gap in the same storey, and storeys of several laws.

A storey with a damper or stop has the coefficients and the memory of the law, followed by those of the damper or stop.
If the laws of the storeys differ, the first coefficient of a storey selects its law, and the coefficients of this law
follow.
"""

from collections.abc import Callable
from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import maximum
from warpdyn.engine.laws.spring import Spring


@wp.func
def stands_still(driver: Any, memory: Any, c: Any):
    return type(memory)()


@wp.func
def is_kept(driver: Any, memory: Any, c: Any):
    return memory


@wp.func
def is_kept_over(drift: Any, increment: Any, memory: Any, c: Any):
    return memory


@wp.func
def never_leaves_line(driver: Any, memory: Any, c: Any):
    return bool(False)


@wp.func
def never_settles(driver: Any, memory: Any, c: Any):
    return type(driver)(0.0)


@wp.func
def has_no_force(drift: Any, velocity: Any, memory: Any, c: Any):
    return type(drift)(0.0)


# If only one of two laws has a function, these functions replace the missing function of the other law. All except the
# last four have the arguments (driver, memory, coefficients).
ABSENT = {
    "force": None,
    "force_at_accepted_state": None,  # the trial force
    "elastic_energy": None,
    "return_mapping": is_kept,
    "memory_on_line": None,  # the mapped memory
    "tangent_on_line": None,  # the tangent with the mapped memory
    "leaves_line": never_leaves_line,
    "rate": stands_still,
    "relaxation_rate": never_settles,
    "relaxation_over_step": never_settles,
    "memory_after": is_kept_over,
    "tangent": None,
    "viscous_force": has_no_force,
    "memory_at_velocity": is_kept_over,
}
OF_MEMORY = ("return_mapping", "memory_on_line", "rate", "memory_after")
SUMS = ("force", "force_at_accepted_state", "elastic_energy", "tangent_on_line")


def _function_name(rules: str) -> str:
    """Return the common prefix of the names of a combination's functions, such as "bilinear_beside_gap"."""
    return rules.replace("+", "_beside_").replace("|", "_or_")


def _device_function(name: str, function: Callable) -> Callable:
    """Return a Warp device function with this name; names must be unique, because Warp identifies functions by name."""
    function.__qualname__ = name
    return wp.func(function)


def _instead(field: str, spring: Spring, name: str) -> Callable | None:
    """Return the replacement for the function `field` that `spring` does not have, but the other law has."""
    mapped, tangent = spring.return_mapping or is_kept, spring.tangent

    # This replacement does not use the increment of the drift. Only rate laws would need it, and they have no lines.
    def tangent_where_mapped(drift: Any, memory: Any, c: Any):
        return tangent(drift, type(drift)(0.0), memory, mapped(drift, memory, c), c)

    if field == "force_at_accepted_state":
        return spring.force
    if field == "memory_on_line":
        return mapped
    if field == "tangent_on_line":
        return _device_function(f"{name}_tangent_where_mapped", tangent_where_mapped)
    return ABSENT[field]


def _row(name: str, one: Spring, other: Spring, combine: Callable, coefficients: int, memory: int) -> Spring:
    """Return the device functions of a combination of two laws.

    Args:
        name: Prefix of the names of the functions.
        one: Device functions of the first law.
        other: Device functions of the second law.
        combine: Function that makes the combined function of a field of `Spring`, from the functions of both laws.
        coefficients: Number of coefficients per storey.
        memory: Number of memory values per storey.
    """
    functions: dict[str, Any] = {}
    for field in ABSENT:
        pair = getattr(one, field), getattr(other, field)
        functions[field] = None
        if pair != (None, None):
            of_one = pair[0] or _instead(field, one, f"{name}_first")
            of_other = pair[1] or _instead(field, other, f"{name}_second")
            functions[field] = _device_function(f"{name}_{field}", combine(field, of_one, of_other))
    settling = [spring.relaxes_by_velocity for spring in (one, other) if spring.relaxation_rate is not None]
    return Spring(
        **functions, coefficients=coefficients, memory=memory, relaxes_by_velocity=bool(settling) and all(settling)
    )


def side_by_side(rules: str, one: Spring, other: Spring) -> Spring:
    """Return the device functions of a storey with a law and a damper or stop in parallel: their forces are added.

    `one` contains the functions of the law, `other` those of the damper or stop, and `rules` is the name of the
    combination.
    """
    FIRST_C, C, FIRST_M, M = one.coefficients, other.coefficients, one.memory, other.memory
    name = _function_name(rules)

    # The values of the first law are at the start of the vectors. The values of the other law are copied to the start
    # of new vectors.
    def coefficients_of_other(c: Any):
        own = type(c)()
        for q in range(C):
            own[q] = c[FIRST_C + q]
        return own

    def memory_of_other(memory: Any):
        own = type(memory)()
        for m in range(M):
            own[m] = memory[FIRST_M + m]
        return own

    def joined(first: Any, second: Any):
        both = type(first)()
        for m in range(FIRST_M):
            both[m] = first[m]
        for m in range(M):
            both[FIRST_M + m] = second[m]
        return both

    c_of, memory_of, join = (
        _device_function(f"{name}_{part.__name__}", part) for part in (coefficients_of_other, memory_of_other, joined)
    )

    def combine(field: str, of_one: Callable, of_other: Callable) -> Callable:
        def added(driver: Any, memory: Any, c: Any):
            return of_one(driver, memory, c) + of_other(driver, memory_of(memory), c_of(c))

        def largest(driver: Any, memory: Any, c: Any):
            return maximum(of_one(driver, memory, c), of_other(driver, memory_of(memory), c_of(c)))

        def moved(driver: Any, memory: Any, c: Any):
            return join(of_one(driver, memory, c), of_other(driver, memory_of(memory), c_of(c)))

        def advanced(drift: Any, increment: Any, memory: Any, c: Any):
            first = of_one(drift, increment, memory, c)
            return join(first, of_other(drift, increment, memory_of(memory), c_of(c)))

        def tangents(drift: Any, increment: Any, before: Any, after: Any, c: Any):
            first = of_one(drift, increment, before, after, c)
            return first + of_other(drift, increment, memory_of(before), memory_of(after), c_of(c))

        def either(driver: Any, memory: Any, c: Any):
            return of_one(driver, memory, c) or of_other(driver, memory_of(memory), c_of(c))

        if field == "leaves_line":
            return either
        if field in OF_MEMORY:
            return advanced if field == "memory_after" else moved
        if field == "tangent":
            return tangents
        return added if field in SUMS else largest

    return _row(name, one, other, combine, FIRST_C + C, FIRST_M + M)


def one_or_other(rules: str, one: Spring, other: Spring) -> Spring:
    """Return the device functions of storeys with different laws.

    A storey has the first law if its first coefficient is 0, otherwise the other law. `rules` is the name of the
    combination.
    """
    C = max(one.coefficients, other.coefficients)
    name = _function_name(rules)

    def own_coefficients(c: Any):
        own = type(c)()
        for q in range(C):
            own[q] = c[1 + q]
        return own

    own = _device_function(f"{name}_own_coefficients", own_coefficients)

    # A storey has the same law in all samples, so the threads of a GPU take the same branch.
    def combine(field: str, of_one: Callable, of_other: Callable) -> Callable:
        def chosen(driver: Any, memory: Any, c: Any):
            if c[0] == type(driver)(0.0):
                return of_one(driver, memory, own(c))
            return of_other(driver, memory, own(c))

        def advanced(drift: Any, increment: Any, memory: Any, c: Any):
            if c[0] == type(drift)(0.0):
                return of_one(drift, increment, memory, own(c))
            return of_other(drift, increment, memory, own(c))

        def tangents(drift: Any, increment: Any, before: Any, after: Any, c: Any):
            if c[0] == type(drift)(0.0):
                return of_one(drift, increment, before, after, own(c))
            return of_other(drift, increment, before, after, own(c))

        if field in ("memory_after", "viscous_force", "memory_at_velocity"):
            return advanced
        return tangents if field == "tangent" else chosen

    return _row(name, one, other, combine, 1 + C, max(one.memory, other.memory))
