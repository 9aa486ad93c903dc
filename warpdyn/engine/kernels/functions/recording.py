"""Functions with which a kernel writes rarely used values to memory instead of keeping them in registers.

Arguments are structs of arrays, which are passed without copying; vectors and matrices would be copied.
"""

import math
from typing import Any

import warp as wp


@wp.func
def keep_state(
    history: Any, row: int, step: int, every: int, dof: int, displacement: Any, velocity: Any, acceleration: Any
):
    """Write displacement, velocity and acceleration of a degree of freedom at the start of a step to the history.

    Only every `every`-th step is recorded; `row` is the index of the sample in the history.
    """
    if step % every == 0:
        if step / every < history.displacement.shape[1]:
            history.displacement[row, step / every, dof] = displacement
            history.velocity[row, step / every, dof] = velocity
            history.acceleration[row, step / every, dof] = acceleration


@wp.func
def keep_force(history: Any, row: int, step: int, every: int, storey: int, force: Any):
    """Write the restoring force [N] of a storey at the start of a step to the history.

    Only every `every`-th step is recorded; `row` is the index of the sample in the history.
    """
    if step % every == 0:
        if step / every < history.storey_force.shape[1]:
            history.storey_force[row, step / every, storey] = force


@wp.func
def keep_spring(history: Any, row: int, step: int, every: int, spring: int, deformation: Any, force: Any):
    """Write a spring's deformation and force at a step's start to the history, if the step is recorded."""
    if step % every == 0:
        if step / every < history.spring_force.shape[1]:
            history.spring_deformation[row, step / every, spring] = deformation
            history.spring_force[row, step / every, spring] = force


@wp.func
def keep_actuator(history: Any, row: int, step: int, every: int, actuator: int, force: Any, stroke: Any, command: Any):
    """Write force, stroke and command of an actuator at a step's start to the history, if the step is recorded."""
    if step % every == 0:
        if step / every < history.control_force.shape[1]:
            history.control_force[row, step / every, actuator] = force
            history.actuator_stroke[row, step / every, actuator] = stroke
            history.actuator_command[row, step / every, actuator] = command


# cos(x) as a polynomial in x^2, exact to the last digit for |x| <= pi/2; the library's cosine also needs memory.
COSINE = wp.constant(
    wp.types.vector(length=12, dtype=wp.float64)(*((-1.0) ** k / math.factorial(2 * k) for k in range(12)))
)
HALF_TURN = wp.constant(wp.float64(math.pi))


@wp.func
def hann(position: Any):
    """Return the Hann window 1 - cos(2 pi x) = 2 cos^2(pi (x - 1/2)) at a position x from 0 to 1; its mean is 1."""
    angle = type(position)(HALF_TURN) * (position - type(position)(0.5))
    # Written out: with a loop here, a processor's compiler would not vectorise over samples.
    square = angle * angle
    cosine = type(position)(COSINE[11])
    cosine = cosine * square + type(position)(COSINE[10])
    cosine = cosine * square + type(position)(COSINE[9])
    cosine = cosine * square + type(position)(COSINE[8])
    cosine = cosine * square + type(position)(COSINE[7])
    cosine = cosine * square + type(position)(COSINE[6])
    cosine = cosine * square + type(position)(COSINE[5])
    cosine = cosine * square + type(position)(COSINE[4])
    cosine = cosine * square + type(position)(COSINE[3])
    cosine = cosine * square + type(position)(COSINE[2])
    cosine = cosine * square + type(position)(COSINE[1])
    cosine = cosine * square + type(position)(COSINE[0])
    return type(position)(2.0) * cosine * cosine


@wp.func
def weight_in_mean(step: Any, since: int, steps: int):
    """Return the weight of step number `since` (0 is the first) in a mean over `steps` steps under a Hann window.

    The window removes the remaining free vibration from the mean, at any phase (Harris 1978, Proc. IEEE 66(1)).
    """
    # A choice of two values, not a branch, so that a processor vectorises over samples.
    weight = hann((type(step)(since) + type(step)(0.5)) / type(step)(steps)) / type(step)(steps)
    return wp.where(steps > 1, weight, type(step)(1.0))


@wp.func
def add_to_mean(mean: Any, storey: int, column: int, part: Any, since: int):
    """Add a weighted value to mean[storey, column]; the first value (`since` = 0) replaces the old content."""
    if since > 0:
        part += mean[storey, column]
    mean[storey, column] = part


@wp.func
def balance_error(error: Any, supplied: Any):
    """Return the unaccounted energy divided by the largest supplied energy.

    The result is 0 if no energy was supplied, and NaN if one of the energies is NaN.
    """
    # A maximum ignores NaN, so `supplied` is 0 if energies exceed the range of the number type.
    if supplied == type(error)(0.0) and wp.isfinite(error):
        return type(error)(0.0)
    return error / supplied


@wp.func
def worst_storey(output: Any, structures: Any, sample: int, structure: int, storeys: int):
    """Return the largest peak drift ratio of a sample, and write the number of its storey to the outputs (from 1)."""
    largest = output.peak_storey_drift[0, sample] * structures.inverse_height[0, structure]
    worst = int(0)
    for i in range(1, storeys):
        ratio = output.peak_storey_drift[i, sample] * structures.inverse_height[i, structure]
        if ratio > largest:
            largest = ratio
            worst = i
    output.storey_of_peak_drift[sample] = worst + 1
    return largest
