"""The class Spring: the device functions of a storey law, as kernels call them."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Spring:
    """Device functions of one variant of a law, and the numbers of its coefficients and memory values.

    The memory of a rate law follows a differential equation, which is integrated with the motion. The memory of a
    return-mapping law follows from the drift and the memory at the last accepted step. With most laws of many rules, a
    storey moves along a straight line in most steps; `memory_on_line`, `tangent_on_line` and `leaves_line` allow
    kernels to evaluate all rules only if a storey leaves its line.

    Args:
        force: `(drift, memory, coefficients) -> force [N]`. For return-mapping laws the memory is the memory at the
            last accepted step.
        return_mapping: `(drift, memory, coefficients) -> memory` of a return-mapping law, applied to the drift of each
            accepted step. None if no memory value is mapped.
        elastic_energy: `(drift, memory, coefficients) -> elastic energy [J]` that unloading would return.
        coefficients: Number of coefficients per storey.
        tangent: `(drift, increment, before, after, coefficients) -> d(force)/d(drift) [N/m]` at the end of a step that
            reached `drift` by `increment`; the memory changed from `before` to `after`.
        memory: Number of memory values; all are 0 before the first step. Values with a rate should be of the order of 1
            or larger: adaptive methods compare their errors with the larger of 1 and the value.
        memory_after: `(drift, increment, memory, coefficients) -> memory` after a step that reached `drift` by
            `increment`, for methods without a velocity within the step. None if the law has no memory.
        rate: `(velocity, memory, coefficients) -> d(memory)/dt` of a rate law, else None. A combination of two laws may
            have `rate` and `return_mapping`: each leaves the memory values of the other law unchanged.
        force_at_accepted_state: `(drift, memory, coefficients) -> force [N]` if the memory already belongs to this
            drift, so that a stored force need not be computed again. None if `force` is as fast.
        force_after_mapping: `(drift, memory, coefficients) -> force [N]` for multistep methods, which evaluate the
            force once per step and only after the memory has followed the drift; for laws whose `force` contains the
            mapping. None if this function would not be faster than `force_at_accepted_state`.
        memory_on_line: `(drift, memory, coefficients) -> memory` at a drift on the storey's line: the result of
            `return_mapping` there, at less cost. None if `return_mapping` costs little.
        values_on_line: Number of memory values, from the first, that may change along a line; None for all.
        tangent_on_line: `(drift, memory, coefficients) -> d(force)/d(drift) [N/m]` at a drift on the storey's line: the
            result of `tangent` there, at less cost. Before the first step it is the initial stiffness, unless the first
            step always leaves the line. None if `memory_on_line` is None.
        leaves_line: `(drift, memory, coefficients) -> bool`: whether a step to this drift leaves the storey's line, by
            a reversal or at a corner. None if `memory_on_line` is None.
        relaxation_rate: `(velocity, memory, coefficients) -> rate [1/s]`, the largest rate at which a deviation of the
            memory decays. A step that is too long for this rate gives wrong results that stay finite. None if the
            memory has no rate.
        relaxes_by_velocity: Whether `relaxation_rate` needs to be computed only once per step, for example because it
            depends only on the velocity.
        relaxation_over_step: `(increment, memory, coefficients) ->` relaxation rate times the duration of the step, for
            the step of `memory_after`.
        viscous_force: `(drift, velocity, memory, coefficients) -> force [N]` that is added to `force`; only springs of
            lumped structures use it. None if the force does not depend on the velocity.
        memory_at_velocity: `(drift, velocity, memory, coefficients) -> memory`, applied to each accepted step of a
            lumped structure's springs. None if no memory value depends on drift and velocity.
        line: `(drift, memory, coefficients) -> slope [N/m], least drift, largest drift, side`: the straight line
            through an accepted state, and the drifts between which it holds. Side is the direction in which a yielding
            spring moves (1 or -1): it leaves the line when it turns back, so the limit on the other side is its present
            drift. Side is 0 if the line is elastic. A line that is unknown has a largest drift below the least drift,
            which is then the present drift. Only hinges of frames use it. None for laws without straight lines.
        memory_along_line: `(drift, force, memory, coefficients) -> memory` after the spring has moved on this line to a
            drift at which it has this force. None if `line` is None.
    """

    force: Callable
    return_mapping: Callable | None
    elastic_energy: Callable
    coefficients: int
    tangent: Callable
    memory: int = 0
    memory_after: Callable | None = None
    rate: Callable | None = None
    force_at_accepted_state: Callable | None = None
    force_after_mapping: Callable | None = None
    memory_on_line: Callable | None = None
    values_on_line: int | None = None
    tangent_on_line: Callable | None = None
    leaves_line: Callable | None = None
    relaxation_rate: Callable | None = None
    relaxes_by_velocity: bool = False
    relaxation_over_step: Callable | None = None
    viscous_force: Callable | None = None
    memory_at_velocity: Callable | None = None
    line: Callable | None = None
    memory_along_line: Callable | None = None
