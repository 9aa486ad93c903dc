"""Independent results of the problems on isolators, dampers, stops and friction; nothing here uses warpdyn."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import gamma

from .problem import Outcome

CASES = Path(__file__).parents[1] / "law_cases"
PENDULUM = {"mass": 1e5, "radius": 2.0, "friction": 0.05, "stiffness": 2e7, "start": 0.75}
BEARING = {"stiffness": 2e7, "yield_force": 1e5, "post_yield": 1.5e6}
BEARING_DRIFTS = (0.02, 0.05, 0.1)
DRIVES = (15.0, 1.5, 1.01, 0.99)
POWERS = (1.0, 0.5, 0.3)
POWER_TIMES = (0.1, 0.2, 0.4)
ABSORBER_MASS, ABSORBER_RATIOS = 0.05, (0.08, 0.2)
MAXWELL_EVERY = 8


def friction_decay() -> Outcome:
    """Turning points -0.07, 0.04, -0.01 of m = 1, k = 100, F = 1.5 from 0.1 m: each half swing loses 2 F/k."""
    shift, start = 0.015, 0.1

    def u(t):
        half = int(t / (np.pi / 10))
        if half >= 3:
            return -0.01
        sign = (-1) ** half
        size, middle = start - 2 * shift * half, sign * shift
        return middle + sign * (size - shift) * np.cos(10 * t - half * np.pi)

    time = np.arange(241) * 0.005
    return Outcome([-0.07, 0.04, -0.01], {"displacement": (time, np.array([u(t) for t in time]))})


def friction_pendulum() -> Outcome:
    """Turning points by the balance of energy of a bilinear force; half periods of sliding pi sqrt(R/g)."""
    p = PENDULUM
    weight = p["mass"] * 9.80665
    slope, strength = weight / p["radius"], p["friction"] * weight
    back = 2 * strength / (p["stiffness"] - slope)
    u, values = p["start"], []
    for _ in range(3):
        inner = strength**2 - 2 * slope * (strength * (u - back) - slope * u**2 / 2)
        u = (np.sqrt(inner) - strength) / slope
        values.append(u)
    return Outcome([*(v * (-1) ** (i + 1) for i, v in enumerate(values))])


def lead_rubber() -> Outcome:
    """Q + k2 U, secant stiffness, 4 Q (U - uy)."""
    p = BEARING
    uy = p["yield_force"] / p["stiffness"]
    strength = p["yield_force"] - p["post_yield"] * uy
    drift = np.array(BEARING_DRIFTS)
    force = strength + p["post_yield"] * drift
    largest = drift[-1]
    corner = largest - 2 * uy
    path = np.array([largest, corner, -largest, -corner, largest])
    curve = [force[-1], force[-1] - 2 * p["yield_force"], -force[-1], 2 * p["yield_force"] - force[-1], force[-1]]
    return Outcome([*force, *(force / drift), *(4 * strength * (drift - uy))], {"loop": (path, np.array(curve))})


def falling_mass() -> Outcome:
    """Parabola to the floor at -2 m, half sine about the static position, parabola (m = 1 kg, k = 100 N/m, 10 m/s2)."""
    touch = (-1 + np.sqrt(1 + 40)) / 10
    speed = 1 + 10 * touch
    # Penetration d: d'' = 10 - 100 d; d = 0.1 (1 - cos 10 t) + speed/10 sin 10 t.
    size = np.hypot(0.1, speed / 10)
    stay = brentq(lambda t: 0.1 + size * np.sin(10 * t - np.arctan2(0.1, speed / 10)), 0.25, 0.45)
    leave = touch + stay

    def z(t):
        if t < touch:
            return -t - 5 * t**2
        if t < leave:
            s = t - touch
            return -2 - (0.1 * (1 - np.cos(10 * s)) + speed / 10 * np.sin(10 * s))
        s = t - leave
        return -2 + speed * s - 5 * s**2

    time = np.arange(241) * 0.005
    return Outcome([touch, leave, z(1.0), z(1.1)], {"height": (time, np.array([z(t) for t in time]))})


def sliding_block() -> Outcome:
    """Block of 1 kg with friction of 1 N under A sin(2 pi t): sticks and slides, events by bisection; 4 to 12 s."""
    w, values = 2 * np.pi, []
    for size in DRIVES:
        t, v, travel = 0.0, 0.0, 0.0
        while t < 12:
            drive = size * np.sin(w * t)
            if v == 0 and abs(drive) <= 1 + 1e-12 and size <= 1:
                break
            if v == 0:
                if abs(drive) <= 1:  # sticks until the drive exceeds 1 N
                    grid = np.linspace(t, t + 1, 4001)[1:]
                    i = int(np.argmax(np.abs(size * np.sin(w * grid)) > 1))
                    t = brentq(
                        lambda s, size=size: abs(size * np.sin(w * s)) - 1, grid[i - 1] if i else t, grid[i], xtol=1e-15
                    )
                sign = np.sign(size * np.sin(w * (t + 1e-9)))
                drive = size * np.sin(w * t)
            start, v0 = t, v

            def speed(s, start=start, v0=v0, sign=sign, size=size):
                return v0 + size / w * (np.cos(w * start) - np.cos(w * s)) - sign * (s - start)

            grid = np.linspace(start, start + 1.5, 6001)[2:]
            crossed = sign * speed(grid) < 0
            i = int(np.argmax(crossed))
            stop = brentq(speed, grid[i - 1], grid[i], xtol=1e-15) if crossed.any() else 12.0
            low, high = max(start, 4.0), min(stop, 12.0)
            if high > low:
                travel += abs(quad(speed, low, high, epsabs=1e-14, limit=200)[0])
            t, v = stop, 0.0
            if abs(size * np.sin(w * stop)) > 1:  # reverses at once
                sign = np.sign(size * np.sin(w * stop))
                t = stop
        values.append(10 * travel / 8)
    return Outcome(values)


def viscous_damper() -> Outcome:
    """m v' = -c v^a: v^(1-a) = v0^(1-a) - (1-a) c t/m; energy of a cycle: lambda c w^a A^(1+a) (FEMA 274, C9-36)."""
    mass, c = 1e5, 5e4
    values = []
    for a in POWERS:
        t = np.array(POWER_TIMES)
        values += [*(np.exp(-c * t / mass) if a == 1 else (1 - (1 - a) * c * t / mass) ** (1 / (1 - a)))]
    energy = []
    for a in POWERS:
        factor = 2 ** (2 + a) * gamma(1 + a / 2) ** 2 / gamma(2 + a)
        energy.append(factor * 2e5 * 8.0**a * 0.05 ** (1 + a))
    return Outcome([*values, *energy])


def maxwell_case(name: str = "maxwell_2") -> dict:
    """Return an imposed motion and the forces of an ODE solver with a relative tolerance of 1e-10."""
    cases = json.loads((CASES / "maxwell.json").read_text(encoding="utf-8"))["cases"]
    return next(case for case in cases if case["id"] == name)


def maxwell_damper() -> Outcome:
    """Stored forces."""
    case = maxwell_case()
    time, force = np.array(case["times"]), np.array(case["force"])
    return Outcome(force[::MAXWELL_EVERY], {"force": (time, force)})


def tuned_mass_damper() -> Outcome:
    """Den Hartog: at g^2 = (1 -+ sqrt(mu/(2 + mu)))/(1 + mu) the amplitude is sqrt(1 + 2/mu) for any damping."""
    mu = ABSORBER_MASS
    values = [np.sqrt(1 + 2 / mu)] * 4
    grid = np.linspace(0.7, 1.25, 111)
    return Outcome(values, {"amplitude, damping ratio 0.2": (grid, amplitude(grid, ABSORBER_RATIOS[1]))})


def fixed_points() -> np.ndarray:
    """Return the two circular frequencies at which the damper does not change the amplitude."""
    mu = ABSORBER_MASS
    return np.sqrt((1 + np.array([-1, 1]) * np.sqrt(mu / (2 + mu))) / (1 + mu))


def amplitude(g, ratio):
    """Return the amplitude of the main mass over the static displacement, frequencies over that of the main mass."""
    mu, f = ABSORBER_MASS, 1 / (1 + ABSORBER_MASS)
    k, c = mu * f**2, 2 * ratio * mu * f
    joint = k + 1j * g * c
    return np.abs((joint - mu * g**2) / ((1 + joint - g**2) * (joint - mu * g**2) - joint**2))
