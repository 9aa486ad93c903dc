"""Independent results of the problems on yielding storeys: closed forms, SciPy, stored event-exact solutions."""

from __future__ import annotations

import numpy as np
from opensees import chain_drifts
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from .el_centro import STEP, el_centro
from .methods_truth import CHOPRA, chopra_force
from .problem import Outcome

EPP_TIMES = (0.1, 0.2, 0.3, 0.5, 1.0)
STRENGTHS = (0.5, 0.25, 0.125)
ELASTIC_PEAK = 2.2469819  # in, of the oscillator of 0.5 s and 5 %
EXPONENTS = (1, 2, 3, 5, 10)
TURNS = (2.0, -2.0, 2.0, -2.0)
AISC_LOADS = (100.0, 150.0, 200.0)  # kip
COLUMN = {"length": 336.0, "stiffness": 3 * 29000.0 * 484.0 / 336.0**3}
INCH = 0.0254


def newmark_elastoplastic() -> Outcome:
    """Average acceleration with Newton iterations and return mapping, 0.1 s."""
    p, h = CHOPRA, CHOPRA["step"]
    force = chopra_force()
    u, v, a, plastic = 0.0, 0.0, 0.0, 0.0
    found = []
    for target in force[1:]:
        ahead = u
        for _ in range(50):
            acceleration = 4 / h**2 * (ahead - u) - 4 / h * v - a
            velocity = 2 / h * (ahead - u) - v
            elastic = p["stiffness"] * (ahead - plastic)
            spring, tangent = (elastic, p["stiffness"]) if abs(elastic) <= 7.5 else (np.sign(elastic) * 7.5, 0.0)
            residual = target - p["mass"] * acceleration - p["damping"] * velocity - spring
            if abs(residual) < 1e-13:
                break
            ahead += residual / (4 / h**2 * p["mass"] + 2 / h * p["damping"] + tangent)
        plastic = ahead - spring / p["stiffness"]
        u, v, a = ahead, velocity, acceleration
        found.append((u, v, a))
    table = np.array(found).T
    return Outcome(table.ravel(), {"displacement": (0.1 * np.arange(11), np.append(0, table[0]))})


def step_and_free() -> Outcome:
    """Closed forms, m = 1, k = 100, yield at 1 N and 0.01 m: step force 0.75 N; free vibration from 0.3 m/s."""
    w, uy = 10.0, 0.01

    def u(t):
        first = np.arccos(1 - uy / 0.0075) / w
        speed = 0.0075 * w * np.sin(w * first)
        top = first + speed / 0.25  # decelerated by (1 - 0.75) N / 1 kg
        highest = uy + speed**2 / 0.5
        if t <= first:
            return 0.0075 * (1 - np.cos(w * t))
        if t <= top:
            return uy + speed * (t - first) - 0.125 * (t - first) ** 2
        return highest - 0.0025 * (1 - np.cos(w * (t - top)))  # about the new rest position

    plain = 0.01 + (0.3**2 - 0.1**2) / 2  # 1 N stops what is left of the energy
    # bilinear with a = 0.1: (v0^2 - (w uy)^2)/2 = F (u - uy) + 5 (u - uy)^2
    left, slope = 0.04, 10.0
    more = (-1.0 + np.sqrt(1 + 2 * slope * left)) / slope
    time = np.arange(201) * 0.005
    values = [*(u(t) for t in EPP_TIMES), 0.02, plain, uy + more, 0.04, 0.9 * more]
    return Outcome(values, {"displacement under the step force": (time, np.array([u(t) for t in time]))})


def el_centro_strengths() -> Outcome:
    """Event-exact solutions between samples (yield and unloading by bisection), stored; curve by OpenSees at 2 ms."""
    peaks, permanent = (1.6249427, 1.746087, 2.0646153), (0.22727761, 1.160527, 1.2070274)
    values = []
    for share, peak, rest in zip(STRENGTHS, peaks, permanent, strict=True):
        values += [peak, peak / (share * ELASTIC_PEAK), rest]
    k = (2 * np.pi / 0.5) ** 2
    material = ("ElasticPP", [k, 0.25 * ELASTIC_PEAK * INCH])
    dashpot = 2 * 0.05 * np.sqrt(k)
    drift = chain_drifts([1.0], [material], (0.0, [dashpot]), [0.0], 9.81 * el_centro()[:751], STEP, 750, 10)[:, 0]
    return Outcome(
        [ELASTIC_PEAK, *values], {"displacement, f = 0.25": (STEP / 10 * np.arange(len(drift)), drift / INCH)}
    )


def bouc_wen_rate(x, z, n, direction):
    """Return dz/dx for beta = gamma = 1/2, x over the yield displacement, for a direction of motion of 1 or -1."""
    return 1 - 0.5 * np.abs(z) ** n * (1 + np.sign(z) * direction)


def bouc_wen_curves() -> Outcome:
    """x = int dz/(1 - z^n) for monotonic loading; DOP853 for the cycles."""
    from scipy.integrate import quad

    values = []
    for n in EXPONENTS:
        values.append(brentq(lambda z, n=n: quad(lambda s: 1 / (1 - s**n), 0, z, epsabs=1e-14)[0] - 1, 0.1, 0.999999))
    z, x, work, path = 0.0, 0.0, 0.0, [(0.0, 0.0)]
    ends = []
    for turn in TURNS:
        direction = np.sign(turn - x)

        def rate(s, y, direction=direction):
            return [direction * bouc_wen_rate(s, y[0], 2, direction), direction * y[0]]

        length = abs(turn - x)
        run = solve_ivp(
            rate, (0, length), [z, work], "DOP853", rtol=1e-12, atol=1e-14, max_step=0.01, dense_output=True
        )
        path += [(x + direction * s, run.sol(s)[0]) for s in np.linspace(0, length, 41)[1:]]
        (z, work), x = run.y[:, -1], turn
        ends.append((z, work))
    return Outcome([*values, *(e[0] for e in ends), *(e[1] for e in ends)], {"loop": tuple(np.array(path).T)})


def bouc_wen_free() -> Outcome:
    """DOP853 with an event at each turning point; m = 1, k = 100, uy = 0.01, v0 = 0.3."""

    def rate(t, y):
        z = y[2]
        return [y[1], -z, (y[1] - 0.5 * z**2 * (abs(y[1]) * np.sign(z) + y[1])) / 0.01]

    def stops(t, y):
        return y[1]

    run = solve_ivp(
        rate, (0, 6), [0, 0.3, 0], "DOP853", rtol=1e-11, atol=1e-14, events=stops, max_step=0.005, dense_output=True
    )
    time = np.arange(601) * 0.01
    return Outcome(run.y_events[0][:6, 0], {"displacement": (time, run.sol(time)[0])})


def p_delta() -> Outcome:
    """u = H/(k - P/L) of a column; periods 2 pi sqrt(m/(k - P/L))."""
    k, length = COLUMN["stiffness"], COLUMN["length"]
    left = [k - load / length for load in AISC_LOADS]
    return Outcome([*(1 / each for each in left), *(2 * np.pi / np.sqrt(each) for each in left)])
