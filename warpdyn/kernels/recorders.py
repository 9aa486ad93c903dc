"""What is kept while a kernel runs, where it is touched too rarely to deserve registers: in memory, as it comes.

These functions take structs of arrays, which cost nothing to pass; matrices of state would be copied.
"""

from typing import Any

import warp as wp

from warpdyn.kernels.loads import TURN


@wp.func
def keep_state(
    history: Any, row: int, step: int, every: int, dof: int, displacement: Any, velocity: Any, acceleration: Any
):
    """Keep the state at a step's start, if it is one of those asked for."""
    if step % every == 0:
        if step / every < history.displacement.shape[1]:
            history.displacement[row, step / every, dof] = displacement
            history.velocity[row, step / every, dof] = velocity
            history.acceleration[row, step / every, dof] = acceleration


@wp.func
def keep_force(history: Any, row: int, step: int, every: int, storey: int, force: Any):
    """Keep a storey's restoring force at a step's start, if it is one of those asked for."""
    if step % every == 0:
        if step / every < history.storey_force.shape[1]:
            history.storey_force[row, step / every, storey] = force


@wp.func
def add_to_mean(mean: Any, storey: int, column: int, value: Any, since: int, steps: int):
    """Add the value of one of `steps` steps, `since` the first, to a mean under a Hann window.

    The window takes out what is left of the free vibration, whatever its phase (Harris 1978, Proc. IEEE 66(1)).
    """
    part = value
    if steps > 1:
        turn = type(value)(TURN) * (type(value)(since) + type(value)(0.5)) / type(value)(steps)
        part = value * (type(value)(1.0) - wp.cos(turn)) / type(value)(steps)
    if since > 0:
        part += mean[storey, column]
    mean[storey, column] = part


@wp.func
def balance_error(error: Any, supplied: Any):
    """Return the unaccounted energy relative to the most that was supplied; 0 where nothing was."""
    if supplied == type(error)(0.0):
        return type(error)(0.0)
    return error / supplied
