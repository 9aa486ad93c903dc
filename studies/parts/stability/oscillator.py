"""Behaviour of oscillators in the kernels: growth, stability limit, period and damping of each method."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import warpdyn as wd
from warpdyn.campaigns.integration.run import prepare
from warpdyn.engine.methods.kinds import MultistepMethod
from warpdyn.engine.methods.table import METHODS

# Tolerance of a growth per step. The computed eigenvalue of a defective matrix is accurate to the square root of the
# rounding error, about 1e-8.
GROWTH_TOLERANCE = 1e-8
LARGEST_FREQUENCY_STEP = 4.0  # largest investigated w h [1]
STEPS_SEEN = 20  # number of steps from which the growth is computed
# Ratio of singular values below which the states of an oscillator count as linearly dependent.
DEPENDENT = 1e-9


def oscillator_states(
    method: str, frequency_step: np.ndarray, damping_ratio: np.ndarray, steps: int, device: str | None, every: int = 1
) -> np.ndarray:
    """Return the states of freely vibrating oscillators from a kernel, also if they grow without bound.

    Args:
        method: Name of an integration method, a key of METHODS.
        frequency_step: Circular frequency times step, w h [1], shape [oscillator].
        damping_ratio: Damping ratio zeta [1], shape [oscillator].
        steps: Number of steps.
        device: Warp device, such as "cpu"; None: the default device.
        every: Number of steps between two kept states.

    Returns:
        Displacement, and velocity divided by w [m], shape [oscillator, time, 2]. They start from 1 m and 1 m/s, so that
        both motions of an overdamped oscillator occur.
    """
    w = np.asarray(frequency_step, dtype=np.float64)  # the step is 1 s
    oscillator = wd.ShearBuilding([1.0], 1.0, 1.0, damping="storey", damping_coefficient=1.0)
    given = {"stiffness": wd.GivenValues(w**2), "damping_coefficient": wd.GivenValues(2 * damping_ratio * w)}
    load = wd.FreeVibration(float(steps), displacement=1.0, velocity=1.0)
    scene = wd.Scene(oscillator, load, scatter=given, recorders=("drift",))
    # `simulate` would set the samples beyond the stability limit to NaN, but this study needs them.
    run, _ = prepare(scene, structures=w.size, method=method, dtype="float64", device=device, step=1.0)
    _, kept = run.integrate_histories(range(w.size), every, 1.0)
    return np.concatenate([kept["displacement"], kept["velocity"] / w[:, None, None]], axis=2)


def multipliers(states: np.ndarray, stride: np.ndarray | int = 1, *, is_multistep: bool = False) -> np.ndarray:
    """Return the factors by which a number of steps multiplies motions, fitted to states by least squares.

    The fitted state consists of u, v/w and the next u, because methods with an internal acceleration have up to three
    motions. A multistep method has four motions, so the state also contains the u after the next. Each pair of states
    is divided by the norm of the first one, so that growth or decay does not change the weight of a pair.

    Args:
        states: States of `oscillator_states`, shape [oscillator, time, 2].
        stride: Number of steps between two states, shape [oscillator], or one number for all oscillators.
        is_multistep: True if the method is a multistep method.

    Returns:
        Eigenvalues of the map from a state to the state `stride` steps later, shape [oscillator, 3], or [oscillator, 4]
        for a multistep method; missing ones are 0.
    """
    stride = np.broadcast_to(stride, len(states))
    # The first states are omitted, because some methods begin with different steps.
    skipped = 4 if is_multistep else 1
    place = skipped + stride[:, None] * np.arange((states.shape[1] - skipped - 1) // stride.max() + 1)
    u, v = (np.take_along_axis(states[..., i], place, axis=1) for i in (0, 1))
    rows = [u[:, :-2], v[:, :-2], u[:, 1:-1], u[:, 2:]] if is_multistep else [u[:, :-1], v[:, :-1], u[:, 1:]]
    state = np.stack(rows, axis=1)
    size = np.linalg.norm(state[..., :-1], axis=1, keepdims=True)
    size[size == 0] = 1.0
    before, after = state[..., :-1] / size, state[..., 1:] / size
    return np.linalg.eigvals(after @ np.linalg.pinv(before, rcond=DEPENDENT))


def growth_per_step(
    method: str, frequency_step: np.ndarray, damping_ratio: np.ndarray, device: str | None = None
) -> np.ndarray:
    """Return the largest growth per step (spectral radius) of a method for each oscillator, shape [oscillator]."""
    states = oscillator_states(method, frequency_step, damping_ratio, STEPS_SEEN, device)
    return np.abs(multipliers(states, is_multistep=isinstance(METHODS[method], MultistepMethod))).max(axis=1)


def first_failure(
    fails: Callable[[np.ndarray], np.ndarray], rows: int, low: float, high: float, points: int = 64, passes: int = 3
) -> np.ndarray:
    """Return the smallest value in (low, high] at which something fails, or infinity if it does not fail.

    The result is accurate to (high - low) / points^passes.


    Args:
        fails: Function that returns whether trial values fail; argument and result have the shape [row, point].
        rows: Number of limits that are searched at the same time.
        low: Lower bound of all trial values.
        high: Largest trial value.
        points: Number of trial values in a pass. The next pass divides the interval before the first value that fails.
        passes: Number of passes.
    """
    start, width, never = np.full(rows, low), high - low, np.zeros(rows, dtype=bool)
    for turn in range(passes):
        width /= points
        failed = fails(start[:, None] + width * np.arange(1, points + 1))
        some = failed.any(axis=1)
        if turn == 0:
            never = ~some
        # Because of rounding, a later pass may find no failure; then its last value is used.
        start = start + width * np.where(some, failed.argmax(axis=1), points - 1)
    return np.where(never, np.inf, start + width / 2)


def measured_limits(method: str, damping_ratio: np.ndarray, device: str | None = None) -> np.ndarray:
    """Return the largest w h at which a kernel does not amplify motions, for each damping ratio; infinite above 4."""

    def grows(frequency_step: np.ndarray) -> np.ndarray:
        ratio = np.broadcast_to(damping_ratio[:, None], frequency_step.shape)
        growth = growth_per_step(method, frequency_step.ravel(), ratio.ravel(), device)
        return growth.reshape(frequency_step.shape) > 1 + GROWTH_TOLERANCE

    return first_failure(grows, damping_ratio.size, 0.0, LARGEST_FREQUENCY_STEP)


def accuracy(method: str, frequency_step: np.ndarray, device: str | None = None) -> dict[str, np.ndarray]:
    """Return the changes of period and amplitude of undamped oscillators that a method causes.

    Args:
        method: Name of an integration method, a key of METHODS.
        frequency_step: Circular frequency times step, w h [1], shape [oscillator]; a step must be less than half a
            cycle.
        device: Warp device, such as "cpu"; None: the default device.

    Returns:
        `factor`: amplitude after a step divided by the amplitude before. `period_elongation`: relative error of the
        period. `damping_ratio`: damping ratio of an exact oscillator with the same decay. `amplitude_kept`: amplitude
        after a period divided by the amplitude before. Each has the shape [oscillator].
    """
    # A stride of about a quarter of a cycle distributes rounding errors over several steps.
    stride = np.maximum(1, np.round(np.pi / 2 / frequency_step)).astype(int)
    states = oscillator_states(method, frequency_step, np.zeros_like(frequency_step), 6 * int(stride.max()), device)
    found = multipliers(states, stride)
    principal = np.abs(found - np.exp(1j * frequency_step * stride)[:, None]).argmin(axis=1)
    multiplier = np.take_along_axis(found, principal[:, None], axis=1)[:, 0]
    logarithm, phase = np.log(np.abs(multiplier)) / stride, np.abs(np.angle(multiplier)) / stride
    return {
        "factor": np.exp(logarithm),
        "period_elongation": frequency_step / phase - 1,
        "damping_ratio": -logarithm / np.hypot(logarithm, phase),
        "amplitude_kept": np.exp(logarithm * 2 * np.pi / frequency_step),
    }


def sizes(
    method: str, frequency_step: np.ndarray, damping_ratio: np.ndarray, steps: int, device: str | None, every: int = 1
) -> np.ndarray:
    """Return the norm of (u, v/w) divided by the first norm, at most 1e300, shape [oscillator, time]."""
    with np.errstate(over="ignore", invalid="ignore"):
        size = np.linalg.norm(oscillator_states(method, frequency_step, damping_ratio, steps, device, every), axis=2)
        return np.nan_to_num(np.minimum(size / size[:, :1], 1e300), nan=1e300)


def steps_to_grow(frequency_step: np.ndarray, times: float, steps: int, device: str | None = None) -> np.ndarray:
    """Return the number of steps in which undamped oscillators grow by a factor with RK4, shape [oscillator].

    Args:
        frequency_step: Circular frequency times step, w h [1], shape [oscillator].
        times: Factor of the growth.
        steps: Number of integrated steps; all oscillators must reach the factor within it.
        device: Warp device, such as "cpu"; None: the default device.
    """
    size = np.log(sizes("rk4", frequency_step, np.zeros_like(frequency_step), steps, device) / times)
    last = np.argmax(size >= 0, axis=1)[:, None]
    before, after = (np.take_along_axis(size, last - i, axis=1)[:, 0] for i in (1, 0))
    return last[:, 0] - after / (after - before)  # interpolated in the last step, linearly in the logarithm
