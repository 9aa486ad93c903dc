"""Independent results of the problems on integration methods: their formulas in NumPy, and roots of |R| = 1."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from .problem import Outcome
from .solvers import chain, linear_history, modal_damping, newmark

CHOPRA = {"mass": 0.2533, "stiffness": 10.0, "damping": 2 * 0.05 * np.sqrt(10.0 * 0.2533), "step": 0.1}
TENTHS = tuple(np.arange(1, 11) / 10)
NEAR_TIMES = (0.5, 0.7, 1.0)
ELONGATION_STEPS = (0.05, 0.1, 0.2)  # over the period
BATHE_MASS, BATHE_STIFFNESS = np.diag([2.0, 1.0]), np.array([[6.0, -2.0], [-2.0, 4.0]])
BATHE_STEP, BATHE_STEPS = 0.28, 12
DAMPED = (0.0, 0.05, 0.2)
SINE_MASS, SINE_STIFFNESS = 25910.0, 1e7


def chopra_force(samples: int = 11) -> np.ndarray:
    """Return the half sine of Chopra's examples 5.1 to 5.6 at 0.1 s, shape [time]."""
    time = 0.1 * np.arange(samples)
    return np.where(time <= 0.6, 10 * np.sin(np.pi * time / 0.6), 0)


def newmark_examples() -> Outcome:
    """Newmark's formulas with beta 1/4 and 1/6."""
    p, values, curves = CHOPRA, [], {}
    for name, beta in (("average acceleration", 1 / 4), ("linear acceleration", 1 / 6)):
        force = chopra_force()[:, None]
        u, v, a = newmark([[p["mass"]]], [[p["damping"]]], [[p["stiffness"]]], force, p["step"], beta)
        values += [*u[1:, 0], *v[1:, 0], *a[1:, 0]]
        curves[name] = (0.1 * np.arange(11), v[:, 0])
    return Outcome(values, curves)


def near_resonance() -> Outcome:
    """Newmark's formulas, and the closed form for the exact displacements."""
    w, step = 6 * np.pi, 0.01
    time = step * np.arange(101)
    u, _, a = newmark([[1.0]], [[0.0]], [[w**2]], np.sin(1.1 * w * time)[:, None], step, 1 / 4)
    rows = [round(t / step) for t in NEAR_TIMES]
    return Outcome([*u[rows, 0], *a[rows, 0]], {"displacement": (time, u[:, 0])})


def period_elongation() -> Outcome:
    """cos(angle of a step) = 1 - x^2/2 / (1 + beta x^2), x = w h, for gamma = 1/2."""
    values = []
    for beta in (1 / 4, 1 / 6, 0.0):
        for share in ELONGATION_STEPS:
            x = 2 * np.pi * share
            values.append(x / np.arccos(1 - 0.5 * x**2 / (1 + beta * x**2)) - 1)
    return Outcome(values)


POLYNOMIALS = {  # stability function of the linear test equation, highest power first
    "heun": [1 / 2, 1, 1],
    "kutta3": [1 / 6, 1 / 2, 1, 1],
    "rk4": [1 / 24, 1 / 6, 1 / 2, 1, 1],
    "dormand_prince5": [1 / 600, 1 / 120, 1 / 24, 1 / 6, 1 / 2, 1, 1],
}


def stability_limits() -> Outcome:
    """1/(pi sqrt(1 - 4 beta)) for Newmark's methods; for Runge-Kutta methods, the first root of |R(q)| = 1."""
    values = [1 / (np.pi * np.sqrt(1 - 4 * beta)) for beta in (0.0, 1 / 6)]
    for polynomial in POLYNOMIALS.values():
        for ratio in DAMPED:
            root = complex(-ratio, np.sqrt(1 - ratio**2))

            def excess(x, polynomial=polynomial, root=root):
                return abs(np.polyval(polynomial, root * x)) - 1

            # |R|^2 - 1 = x^4/4 for heun without damping: unstable for every step.
            grid = np.linspace(0.02, 5, 2000)
            grows = np.array([excess(x) > 1e-13 for x in grid])
            first = int(grows.argmax())
            values.append(0.0 if first == 0 else brentq(excess, grid[first - 1], grid[first], xtol=1e-14))
    return Outcome(values)


def wilson(mass, stiffness, force, step, theta=1.4):
    """Return displacements [time, dof] by Wilson's method without damping (Bathe, table 9.3)."""
    u, v, a = (np.zeros_like(force) for _ in range(3))
    a[0] = np.linalg.solve(mass, force[0])
    long = theta * step
    effective = stiffness + 6 / long**2 * mass
    for i in range(len(force) - 1):
        target = force[i] + theta * (force[i + 1] - force[i])
        ahead = np.linalg.solve(effective, target + mass @ (6 / long**2 * u[i] + 6 / long * v[i] + 2 * a[i]))
        later = 6 / long**2 * (ahead - u[i]) - 6 / long * v[i] - 2 * a[i]
        a[i + 1] = a[i] + (later - a[i]) / theta
        v[i + 1] = v[i] + step / 2 * (a[i] + a[i + 1])
        u[i + 1] = u[i] + step * v[i] + step**2 / 6 * (a[i + 1] + 2 * a[i])
    return u


def bathe_two_dofs() -> Outcome:
    """The formulas of central differences, of Wilson's and Newmark's methods, and the matrix exponential."""
    force = np.tile([0.0, 10.0], (BATHE_STEPS + 1, 1))
    none = np.zeros((2, 2))
    found = [
        newmark(BATHE_MASS, none, BATHE_STIFFNESS, force, BATHE_STEP, 0.0)[0],
        wilson(BATHE_MASS, BATHE_STIFFNESS, force, BATHE_STEP),
        newmark(BATHE_MASS, none, BATHE_STIFFNESS, force, BATHE_STEP, 1 / 4)[0],
        linear_history(BATHE_MASS, none, BATHE_STIFFNESS, force, BATHE_STEP)[0],
    ]
    time = BATHE_STEP * np.arange(BATHE_STEPS + 1)
    names = ("central difference", "Wilson", "Newmark", "exact")
    values = np.concatenate([u[1:].T.ravel() for u in found])
    return Outcome(values, {name: (time, u[:, 0]) for name, u in zip(names, found, strict=True) if name != "Wilson"})


def sine_force() -> np.ndarray:
    """Return the base acceleration of Chopra's example 16.1 at 0.1 s, zero from 1 s on."""
    time = 0.1 * np.arange(21)
    return np.where(time < 0.999, 1.93 * np.sin(2 * np.pi * time), 0)


def two_modes(count: int):
    """Return frequencies, shapes and participation factors of the first modes of the five-storey building."""
    from scipy.linalg import eigh

    eigenvalues, shapes = eigh(chain(np.full(5, SINE_STIFFNESS)), SINE_MASS * np.eye(5))
    shapes = shapes[:, :count]
    return np.sqrt(eigenvalues[:count]), shapes, shapes.sum(axis=0) * SINE_MASS


def newmark_two_modes() -> Outcome:
    """Linear acceleration for two modes, average acceleration for all, matrix exponential for the same samples."""
    base = sine_force()
    w, shapes, share = two_modes(2)
    u = newmark(np.eye(2), np.diag(0.1 * w), np.diag(w**2), -base[:, None] * share, 0.1, 1 / 6)[0] @ shapes[4]
    mass, stiffness = SINE_MASS * np.eye(5), chain(np.full(5, SINE_STIFFNESS))
    damping = modal_damping(mass, stiffness, 0.05)
    force = -base[:, None] * np.full(5, SINE_MASS)
    average = newmark(mass, damping, stiffness, force, 0.1, 1 / 4)[0][:, 4]
    exact = linear_history(mass, damping, stiffness, force, 0.1)[0][:, 4]
    time = 0.1 * np.arange(21)
    return Outcome([u[-1], average[-1], exact[-1]], {"two modes": (time, u), "all modes, exact": (time, exact)})
