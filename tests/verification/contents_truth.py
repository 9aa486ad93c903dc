"""Independent results of the problems with floor spectra and rigid blocks; nothing here uses warpdyn."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from .problem import Outcome
from .solvers import linear_history, peak

GRAVITY = 9.80665
MASS, STIFFNESS, MASS_FACTOR, STIFFNESS_FACTOR = 1e5, (8e7, 6e7), 0.5, 0.002
PERIODS = (0.1, 0.2, 0.4, 0.8)
STEP, DURATION = 2.5e-4, 6.0  # of the motion
HALF_WIDTH, HALF_HEIGHT, W_OVER_P, AMPLITUDES = 0.25, 1.0, 5.0, (1.5, 2.5)
FRICTION, PERIOD, RATIOS = 0.12, 0.8, (1.5, 3.0, 6.0)


def base_acceleration(time: np.ndarray) -> np.ndarray:
    """Return 3 sin(2 pi t / 0.4) exp(-0.5 t) [m/s2]."""
    return 3.0 * np.sin(2 * np.pi * time / 0.4) * np.exp(-0.5 * time)


def floor_spectra() -> Outcome:
    """Matrix exponentials of the building, then of each oscillator under the floor acceleration at 0.1 ms."""
    parts = 2.5
    step = STEP / parts
    coarse = np.arange(round(DURATION / STEP) + 1) * STEP
    time = np.arange(round(DURATION / step) + 1) * step
    ground = np.interp(time, coarse, base_acceleration(coarse))
    k1, k2 = STIFFNESS
    mass = MASS * np.eye(2)
    stiffness = np.array([[k1 + k2, -k2], [-k2, k2]])
    damping = MASS_FACTOR * mass + STIFFNESS_FACTOR * stiffness
    u, v = linear_history(mass, damping, stiffness, -ground[:, None] * np.diag(mass), step)
    floors = -(u @ stiffness + v @ damping) / MASS
    values = []
    for floor in (0, 1):
        for period in PERIODS:
            w = 2 * np.pi / period
            moved, _ = linear_history([[1.0]], [[0.1 * w]], [[w**2]], -floors[:, floor : floor + 1], step)
            values.append(w**2 * peak(moved[:, 0]))
    return Outcome(values, {"spectrum of floor 2": (np.array(PERIODS), np.array(values[4:]))})


def rocking() -> Outcome:
    """DOP853 between impacts, which are found as events; one sine cycle, then rest."""
    alpha = np.arctan2(HALF_WIDTH, HALF_HEIGHT)
    p = np.sqrt(0.75 * GRAVITY / np.hypot(HALF_WIDTH, HALF_HEIGHT))
    w, values = W_OVER_P * p, []
    cycle = 2 * np.pi / w
    for amplitude in AMPLITUDES:
        size = amplitude * np.tan(alpha)  # over gravity
        t, side, state, pieces = np.arcsin(1 / amplitude) / w, -1.0, [0.0, 0.0], []
        while t < 3.0:

            def rates(now, y, s=side, size=size):
                a = size * np.sin(w * now) if now < cycle else 0.0
                return [y[1], -(p**2) * (np.sin(s * alpha - y[0]) + a * np.cos(s * alpha - y[0]))]

            def impact(now, y, s=side):
                return s * y[0]

            impact.terminal, impact.direction = True, -1
            end = cycle if t < cycle - 1e-12 else 3.0
            found = solve_ivp(rates, (t, end), state, "DOP853", events=impact, rtol=1e-11, atol=1e-13, max_step=0.01)
            pieces.append(found)
            t, state = found.t[-1], found.y[:, -1]
            if found.t_events[0].size:
                restitution = 1 - 1.5 * np.sin(alpha) ** 2
                state, side = [0.0, restitution * state[1]], -side
                if abs(state[1]) < 1e-3:
                    break
        rotation = np.concatenate([each.y[0] for each in pieces])
        values.append(peak(rotation) / alpha)
    return Outcome(values)


def sliding() -> Outcome:
    """Rest displacement under half a sine: v(t) = (mu g / w)(n (cos w t0 - cos w t) - w (t - t0)) until v = 0."""
    w, values = 2 * np.pi / PERIOD, []
    limit = FRICTION * GRAVITY
    for n in RATIOS:
        start, half = np.arcsin(1 / n) / w, np.pi / w

        def velocity(t, n=n, start=start):
            return limit / w * (n * (np.cos(w * start) - np.cos(w * t)) - w * (t - start))

        def distance(t, n=n, start=start):
            t0 = start
            return (
                limit
                / w
                * (n * (np.cos(w * t0) * (t - t0) - (np.sin(w * t) - np.sin(w * t0)) / w) - w * (t - t0) ** 2 / 2)
            )

        if velocity(half) > 0:  # it slides on after the pulse
            values.append(distance(half) + velocity(half) ** 2 / (2 * limit))
        else:
            values.append(distance(brentq(velocity, 1.01 * start + 0.5 * (half - start), half)))
    return Outcome(values)
