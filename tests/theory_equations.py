"""Storey laws written from the equations of the theory manual, to compare with curves of the device functions.

Each function returns the force over the yield force along drifts over the yield drift. Between two drifts the path is
straight.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

Parameters = Mapping[str, float]
PARTS = 40  # parts of a step, for laws with a differential equation


def clip(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


def springs(drift: np.ndarray, slope: float, parts: list[tuple[float, float]]) -> np.ndarray:
    """Return the force of an elastic spring and of elastic-perfectly plastic springs (stiffness, yield drift)."""
    total = slope * drift
    for stiffness, limit in parts:
        plastic = 0.0
        for i, u in enumerate(drift):
            plastic = clip(plastic, u - limit, u + limit)
            total[i] += stiffness * (u - plastic)
    return total


def bilinear(drift: np.ndarray, p: Parameters) -> np.ndarray:
    hardening = p.get("hardening_ratio", 0.0)
    return springs(drift, hardening, [(1 - hardening, 1.0)])


def multilinear(drift: np.ndarray, p: Parameters) -> np.ndarray:
    corners = 3 if "ductility_3" in p else 2
    mu, r = ([1.0, *(p[f"{name}_{j}"] for j in range(2, corners + 1))] for name in ("ductility", "force_ratio"))
    slopes = [1.0, *((r[j + 1] - r[j]) / (mu[j + 1] - mu[j]) for j in range(corners - 1)), p["hardening_ratio"]]
    return springs(drift, slopes[-1], [(slopes[j] - slopes[j + 1], mu[j]) for j in range(corners)])


def lead_rubber_bearing(drift: np.ndarray, p: Parameters) -> np.ndarray:
    after = p["post_yield_stiffness"] / 1e7
    return springs(drift, after, [(1 - after, 1.0)])


def friction_pendulum(drift: np.ndarray, p: Parameters) -> np.ndarray:
    restoring, friction = p["weight"] / p["radius"] / 1e7, p["friction_coefficient"] * p["weight"] / 1e5
    return springs(drift, restoring, [(1 - restoring, friction / (1 - restoring))])


def friction_damper(drift: np.ndarray, p: Parameters) -> np.ndarray:
    brace, slip = p["brace_stiffness"] / 1e7, p["slip_force"] / 1e5
    return springs(drift, 0.0, [(brace, slip / brace)])


def stop(drift: np.ndarray, p: Parameters) -> np.ndarray:
    found, least, returned = np.zeros_like(drift), 0.0, p["restitution"] ** 2
    for i, u in enumerate(drift):
        pressed = max(abs(u) - p["clearance"] / 0.01, 0.0)
        least = clip(least, (1 - returned) * pressed, pressed)
        found[i] = np.sign(u) * p["contact_stiffness"] / 1e7 / returned * (pressed - least)
    return found


def one_sided_stop(drift: np.ndarray, p: Parameters) -> np.ndarray:
    return np.where(drift > 0, stop(np.maximum(drift, 0.0), p), 0.0)


def self_centring(drift: np.ndarray, p: Parameters) -> np.ndarray:
    found, gap, alpha = np.zeros_like(drift), 0.0, p["hardening_ratio"]
    for i, u in enumerate(drift):
        side = -1.0 if u < 0 else 1.0
        gap = side * clip(side * gap, max(abs(u) - 1.0, 0.0), max(abs(u) - (1 - p["flag_height"]), 0.0))
        found[i] = alpha * u + (1 - alpha) * (u - gap)
    return found


def menegotto_pinto(drift: np.ndarray, p: Parameters) -> np.ndarray:
    alpha, found = p["hardening_ratio"], np.zeros_like(drift)
    way, turn, turned, last, height, most, least, level = 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, -1.0, 1.0
    for i, x in enumerate(drift):
        if i and (x - last) * way < 0:
            way, turn, turned = -way, last, height
            most, least = max(most, last), min(least, last)
            range_of_turns = (most - least) / (2 * p["isotropic_hardening_ductility"])
            level = 1 + p["isotropic_hardening"] * range_of_turns**0.8
        span = level - way * turned
        excursion = abs((most if way > 0 else -least) - way * turn - span)
        lost = p["curvature_reduction"] * excursion / (p["curvature_reduction_ductility"] + excursion)
        power = p["transition_curvature"] * (1 - lost)
        ratio = way * (x - turn) / span
        height = turned + way * span * ratio / (1 + ratio**power) ** (1 / power)
        last = x
        found[i] = alpha * x + (1 - alpha) * height
    return found


def baber_noori(drift: np.ndarray, p: Parameters) -> np.ndarray:
    """Return the force of Bouc-Wen's and of Baber and Noori's law, by the midpoint rule."""
    alpha, beta, gamma, n = p["hardening_ratio"], 0.5, 0.5, 1.0

    def slopes(z: float, e: float, way: float) -> tuple[float, float]:
        growth = max(1 - p.get("growth_loss", 0.0) * e, 0.0)
        nu, eta = 1 + p.get("strength_loss", 0.0) * e, 1 + p.get("stiffness_loss", 0.0) * e
        flow = growth - nu * abs(z) ** n * (gamma + beta * np.sign(way * z))
        zeta1 = p.get("total_slip", 0.0) * (1 - np.exp(-p.get("pinching_rate", 0.0) * e))
        spread = p.get("pinching_spread", 0.1) + p.get("pinching_spread_rate", 0.0) * e
        zeta2 = spread * (p.get("pinching_coupling", 0.5) + zeta1)
        bound = (growth / (nu * (beta + gamma))) ** (1 / n)
        apart = (z * way - p.get("pinching_level", 0.0) * bound) / zeta2
        return (1 - zeta1 * np.exp(-(apart**2))) * flow / eta, (1 - alpha) * z

    z, e, found = 0.0, 0.0, np.zeros_like(drift)
    for i in range(1, drift.size):
        step = (drift[i] - drift[i - 1]) / PARTS
        way = np.sign(step)
        for _ in range(PARTS):
            dz, de = slopes(z, e, way)
            dz, de = slopes(z + step / 2 * dz, e + step / 2 * de, way)
            z, e = z + step * dz, e + step * de
        found[i] = alpha * drift[i] + (1 - alpha) * z
    return found


def peak_oriented(drift: np.ndarray, p: Parameters) -> np.ndarray:
    """Return the force of Clough's and of Takeda's law without cracking; cycles have no partial unloading."""
    alpha, exponent = p["hardening_ratio"], p.get("unloading_exponent", 0.0)

    def backbone(x: float) -> float:
        return min(x, 1 - alpha + alpha * x)

    found, peaks, force, last, origin = np.zeros_like(drift), {1.0: 1.0, -1.0: 1.0}, 0.0, 0.0, 0.0
    for i, u in enumerate(drift[1:], start=1):
        way = np.sign(u - last)
        x, before, f = way * u, way * last, way * force
        if f < 0:
            far = peaks[-way]
            slope = max(far**-exponent, backbone(far) / far)
            crossing = before - f / slope
            if x <= crossing:
                force, last = way * slope * (x - crossing), u
                found[i] = force
                continue
            origin = crossing
        if x >= peaks[way]:
            peaks[way], f = x, backbone(x)
        else:
            f = backbone(peaks[way]) * (x - origin) / (peaks[way] - origin)
        force, last = way * f, u
        found[i] = force
    return found


def saws(drift: np.ndarray, p: Parameters) -> np.ndarray:
    """Return the force of a wall whose cycles have no partial unloading from the envelope."""
    top = p["drift_at_peak_force"] / 0.01
    rise, fall, pinch = p["hardening_ratio"], p["softening_ratio"], p["pinching_stiffness_ratio"]
    level, stiff = p["pinching_force_ratio"], p.get("unloading_stiffness_ratio", 1.0)

    def curve(x: float) -> float:
        return (1 + rise * x) * (1 - np.exp(-x))

    def envelope(x: float) -> float:
        return curve(x) if x <= top else curve(top) - fall * (x - top)

    grid = np.linspace(1e-6, top, 2_000_001)
    cross = float(grid[np.argmax(curve(grid) > level + pinch * grid)])
    found, far, on_curve = np.zeros_like(drift), {1.0: 0.0, -1.0: 0.0}, True
    force, last, left = 0.0, 0.0, 0.0
    for i, u in enumerate(drift[1:], start=1):
        way = np.sign(u - last)
        x = way * u
        f = way * force + stiff * (x - way * last)
        if on_curve and abs(x) <= 1.05 * cross:
            f = np.sign(x) * envelope(abs(x))
        elif on_curve or (way == left and x > far[way]):
            f, on_curve, left = envelope(x), False, way
            far[way] = x
        elif way != left:
            bound = level + pinch * x
            aim = p["reloading_drift_ratio"] * far[way]
            if x > cross and far[way] > 0 and x < aim:
                target = envelope(aim) if far[way] > top else min(curve(aim), curve(top))
                bound = max(bound, target - min(aim ** -p["reloading_exponent"], stiff) * (aim - x))
            elif x > cross:
                bound = envelope(x)
            on_envelope = x > cross and envelope(x) <= bound
            if on_envelope:
                bound = envelope(x)
            if f >= bound:
                f, left = bound, 0.0
                if on_envelope and x > far[way]:
                    left, far[way] = way, x
        force, last = way * f, u
        found[i] = force
    return found


LAWS: dict[str, Callable[[np.ndarray, Parameters], np.ndarray]] = {
    "elastic": lambda drift, _: drift.copy(),
    "elastic_perfectly_plastic": bilinear,
    "bilinear": bilinear,
    "trilinear": multilinear,
    "quadrilinear": multilinear,
    "self_centring": self_centring,
    "menegotto_pinto": menegotto_pinto,
    "bouc_wen": baber_noori,
    "baber_noori": baber_noori,
    "peak_oriented": peak_oriented,
    "takeda": peak_oriented,
    "saws": saws,
    "lead_rubber_bearing": lead_rubber_bearing,
    "friction_pendulum": friction_pendulum,
    "friction_damper": friction_damper,
    "gap": stop,
    "one_sided_gap": one_sided_stop,
}
