"""Oscillators as the kernels step them, for the study `stability`: growth, limit, period and damping of each method."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import warpdyn as wd
from warpdyn.campaigns.integration.run import prepare
from warpdyn.engine.methods.kinds import MultistepMethod
from warpdyn.engine.methods.table import METHODS

# Of a growth a step: an eigenvalue of a defective matrix is good to the square root of rounding, about 1e-8.
GROWTH_TOLERANCE = 1e-8
LARGEST_FREQUENCY_STEP = 4.0
STEPS_SEEN = 20
# States are taken as this much dependent when least squares no longer tells them apart.
DEPENDENT = 1e-9


def oscillator_states(
    method: str, frequency_step: np.ndarray, damping_ratio: np.ndarray, steps: int, device: str | None, every: int = 1
) -> np.ndarray:
    """Return the states of freely vibrating oscillators from a kernel, blow-ups included.

    Args:
        method: Row of METHODS.
        frequency_step: w h [-], shape [oscillator].
        damping_ratio: zeta [-], shape [oscillator].
        steps: Steps taken.
        device: Warp device.
        every: Steps from one state kept to the next.

    Returns:
        Displacement and velocity over w [m], shape [oscillator, time, 2]; they start from 1 m and 1 m/s, so that both
        motions of an overdamped oscillator are there.
    """
    w = np.asarray(frequency_step, dtype=np.float64)  # the step is 1 s
    oscillator = wd.ShearBuilding([1.0], 1.0, 1.0, damping="storey", damping_coefficient=1.0)
    given = {"stiffness": wd.GivenValues(w**2), "damping_coefficient": wd.GivenValues(2 * damping_ratio * w)}
    load = wd.FreeVibration(float(steps), displacement=1.0, velocity=1.0)
    scene = wd.Scene(oscillator, load, scatter=given, recorders=("drift",))
    # `prepare` instead of `simulate`, which would blank the samples beyond the limit that are needed here.
    run, _ = prepare(scene, structures=w.size, method=method, dtype="float64", device=device, step=1.0)
    _, kept = run.integrate_histories(range(w.size), every, 1.0)
    return np.concatenate([kept["displacement"], kept["velocity"] / w[:, None, None]], axis=2)


def multipliers(states: np.ndarray, stride: np.ndarray | int = 1, *, is_multistep: bool = False) -> np.ndarray:
    """Return the factors by which a number of steps multiplies motions, fitted to states by least squares.

    The state is (u, v/w) and the next u, for methods with an internal acceleration: at most three motions. A multistep
    method has four, and also needs the u after that.
    Each pair of states is scaled to a first one of size 1, so that growth or decay gives none of them more weight.

    Args:
        states: States of `oscillator_states`, shape [oscillator, time, 2].
        stride: Steps, shape [oscillator] or one for all.
        is_multistep: Whether the method is a multistep method.

    Returns:
        Eigenvalues of the map from one state to the state `stride` steps later, shape [oscillator, 3], or [oscillator,
        4] for a multistep method; missing ones are 0.
    """
    stride = np.broadcast_to(stride, len(states))
    # The first states are left out, because a method may begin with steps of another kind.
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
    """Return the spectral radius of the method for each oscillator, the largest growth per step, shape [oscillator]."""
    states = oscillator_states(method, frequency_step, damping_ratio, STEPS_SEEN, device)
    return np.abs(multipliers(states, is_multistep=isinstance(METHODS[method], MultistepMethod))).max(axis=1)


def first_failure(
    fails: Callable[[np.ndarray], np.ndarray], rows: int, low: float, high: float, points: int = 64, passes: int = 3
) -> np.ndarray:
    """Return where in (low, high] something first fails, to (high - low) / points^passes; infinite where it never does.

    Args:
        fails: From trial values, shape [row, point], to where they fail.
        rows: How many limits are looked for at a time.
        low: Below the first trial value.
        high: Last trial value.
        points: Trial values in a pass; the next pass divides the interval before the first that fails.
        passes: Passes.
    """
    start, width, never = np.full(rows, low), high - low, np.zeros(rows, dtype=bool)
    for turn in range(passes):
        width /= points
        failed = fails(start[:, None] + width * np.arange(1, points + 1))
        some = failed.any(axis=1)
        if turn == 0:
            never = ~some
        # A later pass may miss the failure at its last value, by rounding.
        start = start + width * np.where(some, failed.argmax(axis=1), points - 1)
    return np.where(never, np.inf, start + width / 2)


def measured_limits(method: str, damping_ratio: np.ndarray, device: str | None = None) -> np.ndarray:
    """Return the largest w h up to which a kernel does not amplify, for each damping ratio; infinite if above 4."""

    def grows(frequency_step: np.ndarray) -> np.ndarray:
        ratio = np.broadcast_to(damping_ratio[:, None], frequency_step.shape)
        growth = growth_per_step(method, frequency_step.ravel(), ratio.ravel(), device)
        return growth.reshape(frequency_step.shape) > 1 + GROWTH_TOLERANCE

    return first_failure(grows, damping_ratio.size, 0.0, LARGEST_FREQUENCY_STEP)


def accuracy(method: str, frequency_step: np.ndarray, device: str | None = None) -> dict[str, np.ndarray]:
    """Return a method's effect on the period and the amplitude of undamped oscillators.

    Args:
        method: Row of METHODS.
        frequency_step: w h [-], up to where a step turns the motion by half a circle, shape [oscillator].
        device: Warp device.

    Returns:
        `factor` by which a step multiplies the amplitude, `period_elongation` over the period, `damping_ratio` that
        would decay like it, and `amplitude_kept` in a period, each of shape [oscillator].
    """
    # A quarter of a circle at a time, which spreads rounding over as many steps.
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
    """Return the size of (u, v/w) over its first one as steps go by, shape [oscillator, time]; at most 1e300."""
    with np.errstate(over="ignore", invalid="ignore"):
        size = np.linalg.norm(oscillator_states(method, frequency_step, damping_ratio, steps, device, every), axis=2)
        return np.nan_to_num(np.minimum(size / size[:, :1], 1e300), nan=1e300)


def steps_to_grow(frequency_step: np.ndarray, times: float, steps: int, device: str | None = None) -> np.ndarray:
    """Return the number of steps in which undamped oscillators grow by a factor under RK4, shape [oscillator].

    Args:
        frequency_step: w h [-], shape [oscillator].
        times: The factor.
        steps: Steps taken, enough for all.
        device: Warp device.
    """
    size = np.log(sizes("rk4", frequency_step, np.zeros_like(frequency_step), steps, device) / times)
    last = np.argmax(size >= 0, axis=1)[:, None]
    before, after = (np.take_along_axis(size, last - i, axis=1)[:, 0] for i in (1, 0))
    return last[:, 0] - after / (after - before)  # a part of the last step, as the logarithm grows
