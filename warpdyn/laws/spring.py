"""What a storey law is to a kernel: scalar device functions, and how its memory changes."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Spring:
    """One storey law, or one of its variants: its device functions, and the sizes of what they read
    and keep.

    A law with memory is a rate law, whose memory has a rate that is integrated with the motion, or a
    return-mapping law, whose memory follows from the drift and the memory at the last accepted step.
    A storey of many return-mapping laws moves along a straight line most of the time; for these
    `glide` and `decides` say so, and kernels work out the rules only where a storey leaves its line.

    Args:
        force: `(drift, memory, coefficients) -> force [N]`, the memory being that of the last
            accepted step for return-mapping laws.
        evolve: `(drift, memory, coefficients) -> memory` of a return-mapping law, applied once a
            step to the accepted drift. None where no value of the memory is mapped.
        recoverable: `(drift, memory, coefficients) -> elastic energy [J]` that unloading would give
            back.
        coefficients: Number of coefficients a storey.
        tangent: `(drift, increment, before, after, coefficients) -> d(force)/d(drift) [N/m]` at the
            end of a step that came to `drift` by `increment`, the memory going from `before` to
            `after`.
        memory: Number of values that the memory has; they are all 0 before the first step. Those
            with a rate are of the order of 1, or grow far beyond it: an adaptive method holds their
            errors against the larger of the two.
        advance: `(drift, increment, memory, coefficients) -> memory` after such a step, for methods
            that know no velocity within it. None where there is no memory.
        rate: `(velocity, memory, coefficients) -> d(memory)/dt` of a rate law. None where no value
            of the memory has one. A row made of several laws may have this and `evolve`: a value
            that has no rate has the rate 0, and `evolve` leaves alone what it does not map.
        held: `(drift, memory, coefficients) -> force [N]` where the memory has just been brought to
            this drift: a force that is kept there need not be worked out again. None where `force`
            is as quick.
        glide: `(drift, memory, coefficients) -> memory` at a drift on the storey's line: what
            `evolve` comes to there, at less cost. None where `evolve` costs little.
        gliding: Number of values, the first of the memory, that may change along a line; None for
            all.
        decides: `(drift, memory, coefficients) -> bool`, true if a step to this drift leaves the
            storey's line: it turns, or passes a corner. None with `glide`.
        relaxation: `(velocity, memory, coefficients) -> rate [1/s]` at which a deviation of the
            memory decays, at its fastest. A step too long for it goes wrong without ever becoming
            infinite. None where the memory has no rate.
        settles_by_velocity: Whether that rate depends on the velocity alone, so that one look a
            step tells it.
        relaxation_along: `(increment, memory, coefficients) -> that rate times the step`, within
            the step of `advance`.
    """

    force: Callable
    evolve: Callable | None
    recoverable: Callable
    coefficients: int
    tangent: Callable
    memory: int = 0
    advance: Callable | None = None
    rate: Callable | None = None
    held: Callable | None = None
    glide: Callable | None = None
    gliding: int | None = None
    decides: Callable | None = None
    relaxation: Callable | None = None
    settles_by_velocity: bool = False
    relaxation_along: Callable | None = None
