"""The largest displacement of an oscillator under a ground motion: by matrix exponentials, and by integration."""

from __future__ import annotations

from math import factorial

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

import warpdyn as wd

INSTANTS_PER_PERIOD = 100
TERMS = 14  # of the exponential between neighbouring instants, where the next one is 0.06^14 / 14! = 1e-28


def largest_displacement(motion: wd.GroundMotion, period: float, damping_ratio: float) -> float:
    """Return the largest displacement [m] for a base acceleration linear between its values and zero after them.

    The displacement is exact at 100 instants in a period and at every value. Where it may grow enough before the next
    instant to be the largest, Brent's method finds the maximum between the neighbouring instants.
    """
    # With q' = root q + a and q(0) = 0, the displacement is -Im(q) / damped frequency. The first row of the exponential
    # of this matrix maps (q, a, slope of a) to q a time later.
    frequency = 2 * np.pi / period
    root = frequency * complex(-damping_ratio, np.sqrt((1 - damping_ratio) * (1 + damping_ratio)))
    generator = np.array([[root, 1, 0], [0, 0, 1], [0, 0, 0]])
    acceleration, step = motion.acceleration, motion.step
    slope = np.diff(acceleration) / step
    decay, constant, linear = expm(generator * step)[0]
    states = np.zeros((3, acceleration.size), dtype=complex)
    states[0, 1:] = lfilter([1], [1, -decay], constant * acceleration[:-1] + linear * slope)
    states[1, :-1], states[2, :-1] = acceleration[:-1], slope  # and nothing after the last sample
    largest_acceleration = root.imag * np.abs(acceleration).max() / frequency**2  # in units of q

    def tops(state: np.ndarray, span: float, peak: float) -> float:
        """Return the largest displacement within a time after each state, if it is larger than the largest so far."""
        count = int(np.ceil(INSTANTS_PER_PERIOD * span / period))
        gap = span / count
        onward = expm(generator * gap)
        taylor = [np.linalg.matrix_power(generator, n)[0] / factorial(n) for n in range(TERMS, -1, -1)]
        for k in range(count + 1):
            displacement = np.abs(state[0].imag)
            peak = max(peak, displacement.max())
            # The curvature at a top is at most omega^2 u + PGA, and the nearest instant within half a gap.
            gain = (frequency * gap) ** 2 / 8 * (peak + largest_acceleration)
            for i in np.flatnonzero(displacement > peak - 1.1 * gain):
                polynomial = [(row @ state[:, i]).imag for row in taylor]
                found = minimize_scalar(
                    lambda t, p=polynomial: -abs(np.polyval(p, t)),
                    bounds=(-gap if k > 0 else 0.0, gap if k < count else 0.0),
                    method="bounded",
                    options={"xatol": 1e-9 * gap},
                )
                peak = max(peak, -found.fun)
            state = onward @ state
        return peak

    peak = tops(states[:, :-1], step, 0.0)
    # The first instant of rest comes within half a damped period.
    return tops(states[:, -1:], 0.51 * 2 * np.pi / root.imag, peak) / root.imag


def integrated_displacement(motion: wd.GroundMotion, period: float, damping_ratio: float) -> float:
    """Return the same from DOP853, one run a step of the record, extrema located by its events."""
    frequency, last = 2 * np.pi / period, motion.acceleration.size - 1
    state, peak = np.zeros(2), 0.0
    for i in range(last + 1):
        ends = motion.acceleration[i : i + 2] if i < last else np.zeros(2)
        span = motion.step if i < last else period

        def rate(t, y, ends=ends, span=span):
            ground = ends[0] + (ends[1] - ends[0]) * t / span
            return [y[1], -ground - 2 * damping_ratio * frequency * y[1] - frequency**2 * y[0]]

        run = solve_ivp(
            rate, (0, span), state, "DOP853", rtol=1e-11, atol=1e-14, events=lambda t, y: y[1], max_step=period / 20
        )
        peak = max(peak, *np.abs([*(y[0] for y in run.y_events[0]), *run.y[0]]))
        state = run.y[:, -1]
    return peak
