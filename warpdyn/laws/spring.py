"""What a storey law is to a kernel: scalar device functions, and how its memory moves."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Spring:
    """One storey law: its functions, and how its memory moves.

    Args:
        force: `(drift, memory, coefficients) -> force [N]`.
        evolve: `(drift, memory, coefficients) -> memory` of a return-mapping law, applied once a step to the accepted
            drift. None where no value of the memory is mapped.
        recoverable: `(drift, memory, coefficients) -> elastic energy [J]` that unloading would give back.
        coefficients: Number of coefficients a storey.
        tangent: `(drift, increment, before, after, coefficients) -> d(force)/d(drift) [N/m]` at the end of a step that
            came to `drift` by `increment`, the memory going from `before` to `after`.
        memory: Number of values that the memory has; they are all 0 before the first step. Those with a rate are of
            the order of 1, or grow far beyond it: an adaptive method holds their errors against the larger of the two.
        advance: `(drift, increment, memory, coefficients) -> memory` after such a step, for methods that know no
            velocity within it. None where there is no memory.
        rate: `(velocity, memory, coefficients) -> d(memory)/dt` of a rate law, integrated with the motion. None where
            no value of the memory has one. A row made of several laws may have this and `evolve`: a value that has no
            rate has the rate 0, and `evolve` leaves alone what it does not map.
        held: `(drift, memory, coefficients) -> force [N]` where `evolve` or `advance` have just brought the memory to
            this drift: what is kept there need not be worked out again. None where `force` is as quick.
        glide: `(drift, memory, coefficients) -> memory`, what `evolve` comes to where the storey decides nothing.
        gliding: Number of values, the first of the memory, that `glide` may change; None for all.
        decides: `(drift, memory, coefficients) -> bool` whether the storey turns on its way to a drift, or goes on by
            another rule: what takes long, and is seldom. None, with `glide`, where nothing takes long.
        relaxation: `(velocity, memory, coefficients) -> rate [1/s]` at which the memory settles, at its fastest. A step
            too long for it goes wrong without ever becoming infinite. None where the memory has no rate of its own.
        settles_by_velocity: Whether that rate depends on the velocity alone, so that one look a step tells it.
        relaxation_along: `(increment, memory, coefficients) -> the same times the step`, within the step of `advance`.
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
