"""Independent results of the problems with one degree of freedom; nothing here uses warpdyn."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from .el_centro import STEP, el_centro
from .problem import Outcome
from .solvers import linear_history, peak, refined

TIMES_U = (0.06, 0.12, 0.19, 0.25, 0.31, 0.38, 0.44)
TIMES_V = (0.03, 0.09, 0.16, 0.22, 0.28, 0.35, 0.41, 0.47)
SPECTRUM = ((0.5, 0.02), (1.0, 0.02), (2.0, 0.02), (2.0, 0.0), (2.0, 0.05))  # period [s], damping ratio
GRAVITY = 386.4  # in/s2
RAMPS = ((1.0, (0.75, 1.5)), (0.5, (0.375, 0.75)))  # rise time over the period, times over pi [s]
RESONANCE_TIMES = tuple(np.pi * np.array([0.05, 0.5, 2, 20]))
SLOW_TIMES = (2.5, 5.0, 11.255)
BASE_TIMES = (0.4, 0.5, 2.0)


def critical_damping() -> Outcome:
    """u = p0/(c w) [e^(-w t) (1 + w t) - cos w t] for w = sqrt(k/m) = frequency of the force, c = 2 m w."""
    w, size = 50.0, 5.0 / (1000.0 * 50.0)

    def u(t):
        return size * (np.exp(-w * t) * (1 + w * t) - np.cos(w * t))

    def v(t):
        return size * w * (np.sin(w * t) - w * t * np.exp(-w * t))

    time = np.arange(501) * 1e-3
    return Outcome([*u(np.array(TIMES_U)), *v(np.array(TIMES_V))], {"displacement": (time, u(time))})


def el_centro_spectrum() -> Outcome:
    """Peak displacements between the samples: 40 exact steps in each interval, parabola at the largest."""
    values = []
    for period, ratio in SPECTRUM:
        w = 2 * np.pi / period
        force = refined(-GRAVITY * el_centro()[:, None], 40)
        u = linear_history([[1.0]], [[2 * ratio * w]], [[w**2]], force, STEP / 40)[0][:, 0]
        values.append((peak(u), np.abs(u[::40]).max(), w))
    between = [row[0] for row in values]
    pseudo = [(d * w, d * w**2 / GRAVITY) for d, _, w in values[:3]]
    at_samples = [row[1] for row in values]
    return Outcome([*between, *(p for p, _ in pseudo), *(a for _, a in pseudo), *at_samples])


def ramp_force() -> Outcome:
    """Undamped oscillator under a force that rises linearly to p0 over tr (Chopra, section 4.5), over p0/k."""
    w, values, curves = 2.0, [], {}
    for share, times in RAMPS:
        rise = share * np.pi

        def u(t, rise=rise):
            during = t / rise - np.sin(w * t) / (w * rise)
            after = 1 - (np.sin(w * t) - np.sin(w * (t - rise))) / (w * rise)
            return np.where(t <= rise, during, after)

        largest = 1 + abs(np.sin(np.pi * share)) / (np.pi * share)
        values += [*u(np.pi * np.array(times)), largest]
        time = np.pi * np.arange(1001) / 500
        curves["rise time T" if share == 1 else "rise time T/2"] = (time, u(time))
    return Outcome(values, curves)


def resonance() -> Outcome:
    """Closed form with a dashpot; matrix exponential of displacement, velocity and force with a Maxwell damper."""
    m, k, c, w, p0, brace = 1.0, 100.0, 1.0, 10.0, 10.0, 1e4
    ratio = c / (2 * m * w)
    damped = w * np.sqrt(1 - ratio**2)

    def u(t):
        decay = np.exp(-ratio * w * t) * (np.cos(damped * t) + ratio * w / damped * np.sin(damped * t))
        return p0 / (c * w) * (decay - np.cos(w * t))

    # displacement, velocity, damper force, sin(w t), cos(w t)
    system = np.zeros((5, 5))
    system[0, 1] = 1
    system[1, :4] = [-k / m, 0, -1 / m, p0 / m]
    system[2, 1], system[2, 2] = brace, -brace / c
    system[3, 4], system[4, 3] = w, -w
    start = np.array([0, 0, 0, 0, 1.0])
    maxwell = [(expm(system * t) @ start)[0] for t in RESONANCE_TIMES]
    time = np.arange(2001) * 20 * np.pi / 2000
    return Outcome([*u(np.array(RESONANCE_TIMES)), *maxwell], {"displacement": (time, u(time))})


def slow_sine() -> Outcome:
    """Chopra, equation 3.2.2 with the steady state of section 3.2 and the free vibration from rest."""
    k, period, w = 2.0, 0.8, 2 * np.pi / 5
    natural, values = 2 * np.pi / period, []
    mass, time = k / natural**2, np.arange(6001) * 0.002
    for ratio in (0.0, 0.05):
        stretch, drag = k - mass * w**2, 2 * ratio * mass * natural * w
        steady = 2.0 / (stretch + 1j * drag)  # of exp(i w t); the force is the imaginary part
        c, d = steady.real, steady.imag
        damped = natural * np.sqrt(1 - ratio**2)
        a, b = -d, -(c * w + ratio * natural * d) / damped

        def u(t, c=c, d=d, a=a, b=b, ratio=ratio, damped=damped):
            free = np.exp(-ratio * natural * t) * (a * np.cos(damped * t) + b * np.sin(damped * t))
            return free + c * np.sin(w * t) + d * np.cos(w * t)

        values += [*u(np.array(SLOW_TIMES))]
    return Outcome(values, {"displacement, damping ratio 0.05": (time, u(time))})


def linear_base_motion() -> Outcome:
    """One matrix exponential for each straight piece of the base acceleration."""
    w, ratio = 2 * np.pi, 0.05
    base = np.interp(np.arange(201) * 0.05, [0, 0.1, 0.25, 0.4, 0.5], [0, 3.0, -2.0, 1.0, 0.0])
    u = linear_history([[1.0]], [[2 * ratio * w]], [[w**2]], -base[:, None], 0.05)[0][:, 0]
    fine = refined(-base[:, None], 20)
    dense = linear_history([[1.0]], [[2 * ratio * w]], [[w**2]], fine, 0.0025)[0][:, 0]
    time = 0.0025 * np.arange(801)
    found = [u[round(t / 0.05)] for t in BASE_TIMES]
    return Outcome(2 * found, {"displacement": (time, dense[:801])})
