"""What a storey law is to a kernel: scalar device functions, and how its memory changes."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Spring:
    """One storey law, or one of its variants: its device functions, and how much they read and keep.

    A law with memory is a rate law, whose memory has a rate that is integrated with the motion, or a
    return-mapping law, whose memory follows from the drift and the memory at the last accepted step.
    A storey of many return-mapping laws moves along a straight line most of the time; for these
    `memory_on_line`, `tangent_on_line` and `leaves_line` say so, and kernels work out the rules only where a storey
    leaves its line.

    Args:
        force: `(drift, memory, coefficients) -> force [N]`, the memory being that of the last
            accepted step for return-mapping laws.
        return_mapping: `(drift, memory, coefficients) -> memory` of a return-mapping law, applied once a
            step to the accepted drift. None where no value of the memory is mapped.
        elastic_energy: `(drift, memory, coefficients) -> elastic energy [J]` that unloading would give
            back.
        coefficients: Number of coefficients a storey.
        tangent: `(drift, increment, before, after, coefficients) -> d(force)/d(drift) [N/m]` at the
            end of a step that came to `drift` by `increment`, the memory going from `before` to
            `after`.
        memory: Number of values that the memory has; they are all 0 before the first step. Those
            with a rate are of the order of 1, or grow far beyond it: an adaptive method holds their
            errors against the larger of the two.
        memory_after: `(drift, increment, memory, coefficients) -> memory` after such a step, for methods
            that know no velocity within it. None where there is no memory.
        rate: `(velocity, memory, coefficients) -> d(memory)/dt` of a rate law. None where no value
            of the memory has one. A row made of several laws may have this and `return_mapping`: a value
            that has no rate has the rate 0, and `return_mapping` leaves alone what it does not map.
        force_at_accepted_state: `(drift, memory, coefficients) -> force [N]` where the memory has just been brought to
            this drift: a force that is kept there need not be worked out again. None where `force`
            is as quick.
        memory_on_line: `(drift, memory, coefficients) -> memory` at a drift on the storey's line: what
            `return_mapping` comes to there, at less cost. None where `return_mapping` costs little.
        values_on_line: Number of values, the first of the memory, that may change along a line; None for
            all.
        tangent_on_line: `(drift, memory, coefficients) -> d(force)/d(drift) [N/m]` at a drift on the storey's line:
            what `tangent` comes to there, at less cost. Before anything has moved it is the initial stiffness, unless
            the first step leaves the line wherever it leads. None with `memory_on_line`.
        leaves_line: `(drift, memory, coefficients) -> bool`, true if a step to this drift leaves the
            storey's line: it turns, or passes a corner. None with `memory_on_line`.
        relaxation_rate: `(velocity, memory, coefficients) -> rate [1/s]` at which a deviation of the
            memory decays, at its fastest. A step too long for it goes wrong without ever becoming
            infinite. None where the memory has no rate.
        relaxes_by_velocity: Whether that rate depends on the velocity alone, so that one look a
            step tells it.
        relaxation_over_step: `(increment, memory, coefficients) -> that rate times the step`, within
            the step of `memory_after`.
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
    memory_on_line: Callable | None = None
    values_on_line: int | None = None
    tangent_on_line: Callable | None = None
    leaves_line: Callable | None = None
    relaxation_rate: Callable | None = None
    relaxes_by_velocity: bool = False
    relaxation_over_step: Callable | None = None
