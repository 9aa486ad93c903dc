"""Laws with degradation, written from the equations of the theory manual, as in `theory_equations.py`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from theory_equations import Parameters

PARTS = 10  # parts of a step between two stored points, as in the study that stored them


def finely(law: Callable[[np.ndarray, Parameters], np.ndarray]) -> Callable[[np.ndarray, Parameters], np.ndarray]:
    """Return a law that follows each step in PARTS equal parts, and returns the forces at the steps."""

    def along(drift: np.ndarray, p: Parameters) -> np.ndarray:
        places = np.arange((drift.size - 1) * PARTS + 1) / PARTS
        return law(np.interp(places, np.arange(drift.size), drift), p)[::PARTS]

    return along


@finely
def hysteretic(drift: np.ndarray, p: Parameters) -> np.ndarray:
    mu, r = ([1.0, p[f"{name}_2"], p[f"{name}_3"]] for name in ("ductility", "force_ratio"))

    def backbone(x: float) -> float:
        return float(np.interp(x, [0.0, *mu], [0.0, *r]))

    area = 2 * float(np.trapezoid([0.0, *r], [0.0, *mu]))
    found, target, zero = np.zeros_like(drift), {1.0: 1.0, -1.0: 1.0}, {1.0: 0.0, -1.0: 0.0}
    force, last, work, before = 0.0, 0.0, 0.0, 0.0
    for i, u in enumerate(drift[1:], start=1):
        way = float(np.sign(u - last))
        x, f, was = way * u, way * force, way * last
        soft = {s: min(t ** p["unloading_exponent"], t / max(backbone(t), 1.0)) for s, t in target.items()}
        if way == -before and f <= 0:
            damage = 0.0
            if target[-way] > 1:
                damage = p["damage_by_ductility"] * (target[-way] - 1)
                damage += p["damage_by_energy"] * (work - 0.5 * soft[-way] * f * f) / area
            target[way] = max(target[way] * (1 + damage), 1.0)
            zero[way] = was - f * soft[-way]
        aim, start = target[way], zero[way]
        if x >= aim:
            new, target[way] = backbone(x), x
        elif x < start:
            new = min(f + (x - was) / soft[-way], 0.0)
        else:
            top = backbone(aim)
            bend = start + p["pinching_drift"] * (aim - (1 - p["pinching_force"]) * soft[way] * top - start)
            new = float(np.interp(x, [start, bend, aim], [0.0, p["pinching_force"] * top, top]))
            new = min(new, f + (x - was) / soft[way])
        work += 0.5 * (force + way * new) * (u - last)
        force, last, before = way * new, u, way
        found[i] = force
    return found


class Deterioration:
    """Energies of Ibarra, Medina and Krawinkler's laws, in yield drifts and forces, without negative side."""

    def __init__(self, p: Parameters) -> None:
        self.capacity = {
            mode: p.get(f"{name}_deterioration_drift", 0.0) / 0.01 or np.inf
            for mode, name in {"S": "strength", "C": "post_capping", "K": "unloading", "A": "reloading"}.items()
        }
        self.energy = self.energy_before = 0.0
        self.stiffness = 1.0

    def share(self, mode: str) -> float:
        """Return beta at a change of the sign of the force."""
        spent = max(self.energy - self.energy_before, 0.0)
        return min(spent / (self.capacity[mode] - self.energy), 1.0)

    def turn(self, force: float) -> None:
        """Reduce the unloading stiffness of a storey that turns back."""
        elastic = 0.5 * force**2 / self.stiffness
        spent = max(self.energy - self.energy_before - elastic, 0.0)
        share = min(spent / (self.capacity["K"] - self.energy + elastic), 1.0)
        least = min(force**2 / max(2 * (self.energy - self.energy_before), 1e-30), self.stiffness)
        self.stiffness = max((1 - share) * self.stiffness, least)


def imk_backbone(p: Parameters) -> tuple[float, float, float, float]:
    """Return hardening slope, falling slope, capping line at zero drift, and residual force."""
    top, reach = p["capping_force_ratio"], p["plastic_drift_to_capping"] / 0.01
    falling = top / (p["post_capping_drift"] / 0.01)
    return (top - 1) / reach, falling, top + falling * (1 + reach), p["residual_force_ratio"]


@finely
def imk_bilinear(drift: np.ndarray, p: Parameters) -> np.ndarray:
    hardening, falling, height, residual = imk_backbone(p)
    state = Deterioration(p)
    yields, slope, capping = ({1.0: value, -1.0: value} for value in (1.0, hardening, height))
    found, force, last, on_backbone, yielded = np.zeros_like(drift), 0.0, 0.0, False, False
    for i, u in enumerate(drift[1:], start=1):
        way = float(np.sign(u - last))
        x, was, f = way * u, way * last, way * force
        if on_backbone and f < 0:
            on_backbone = False
            state.turn(f)
        new = f + state.stiffness * (x - was)
        if yielded and not on_backbone and f <= 0 <= new:
            yields[way] *= 1 - state.share("S")
            slope[way] *= 1 - state.share("S")
            capping[way] *= 1 - state.share("C")
            state.energy_before = state.energy
        fall = falling * (yields[way] - residual) / (1 - residual)
        bound = min(yields[way] + slope[way] * (x - yields[way]), capping[way] - fall * x)
        bound = max(bound, residual)
        if new > bound:
            new, on_backbone, yielded = bound, True, True
        state.energy += 0.5 * (f + new) * (x - was)
        force, last = way * new, u
        found[i] = force
    return found


def _imk_peaks(drift: np.ndarray, p: Parameters) -> np.ndarray:
    """Return the force of the peak-oriented law, or with `pinching_force_ratio` that of the pinching law."""
    hardening, falling, height, residual = imk_backbone(p)
    state, pinches = Deterioration(p), "pinching_force_ratio" in p
    yields, capping, peak = ({1.0: value, -1.0: value} for value in (1.0, height, 1.0))
    latest = {1.0: (1.0, 1.0), -1.0: (1.0, 1.0)}  # last peak of each side: drift and force
    found, force, last, phase = np.zeros_like(drift), 0.0, 0.0, "elastic"
    points: list[tuple[float, float]] = []  # of the reloading line

    def backbone(x: float, way: float) -> float:
        line = yields[way] + hardening * yields[way] * (x - yields[way])
        return max(min(line, capping[way] - falling * x), residual)

    side = 1.0
    for i, u in enumerate(drift[1:], start=1):
        way = float(np.sign(u - last))
        x, was, f = way * u, way * last, way * force
        if phase == "loads" and way != side:
            phase = "unloads"
            peak[-way], latest[-way] = max(peak[-way], -was), (-was, -f)
            state.turn(f)
        new = f + state.stiffness * (x - was)
        if phase == "elastic" and x > 1:
            phase, side, points = "loads", way, [(0.0, 0.0)]
        if phase == "unloads" and f <= 0 <= new:
            zero = was - f / state.stiffness
            yields[way] *= 1 - state.share("S")
            capping[way] *= 1 - state.share("C")
            peak[way] *= 1 + state.share("A")
            state.energy_before = state.energy
            phase, side, points = "loads", way, [(zero, 0.0)]
            top = backbone(peak[way], way)
            if pinches:
                bend = (1 - p["pinching_drift_ratio"]) * (peak[way] - top / state.stiffness)
                if bend > zero:
                    at_bend = p["pinching_force_ratio"] * top * (bend - zero) / (peak[way] - zero)
                    points.append((bend, at_bend))
            (start, low), (far, high) = points[-1], latest[way]
            # The last peak comes first if the line to it is the steeper one.
            if far > start and low < high < top and (high - low) / (far - start) > (top - low) / (peak[way] - start):
                points.append((far, high))
            points.append((peak[way], top))
        if phase == "loads":
            new = backbone(x, way)
            if x <= peak[way] and len(points) > 1:
                new = float(np.interp(x, *np.transpose(points)))
        state.energy += 0.5 * (f + new) * (x - was)
        force, last = way * new, u
        found[i] = force
    return found


@finely
def pinching4(drift: np.ndarray, p: Parameters) -> np.ndarray:
    """Return the force of a storey with damage by energy whose drifts stay below the last corner."""
    mu = [1.0, *(p[f"ductility_{j}"] for j in (2, 3, 4))]
    r = [1.0, *(p[f"force_ratio_{j}"] for j in (2, 3, 4))]

    def backbone(x: float) -> float:
        return float(np.interp(x, [0.0, *mu], [0.0, *r]))

    capacity = p["energy_factor"] * float(np.trapezoid([0.0, *r], [0.0, *mu]))
    found, peak, points = np.zeros_like(drift), {1.0: 1.0, -1.0: 1.0}, None
    lost = {"stiffness": 0.0, "reloading": 0.0, "strength": 0.0}
    force, last, work, before = 0.0, 0.0, 0.0, 0.0
    for i, u in enumerate(drift[1:], start=1):
        way = float(np.sign(u - last))
        x, was, f = way * u, way * last, way * force
        if way == -before:
            far, use = max(peak.values()), max(work - 0.5 * f * f / (1 - lost["stiffness"]), 0.0) / capacity
            secant = (1 - lost["strength"]) * max(backbone(each) / each for each in peak.values())
            found_losses = {}
            for kind in lost:
                of_drift = p[f"{kind}_damage_by_drift"] * (far / mu[3]) ** p[f"{kind}_damage_drift_exponent"]
                of_use = p[f"{kind}_damage_by_use"] * use ** p[f"{kind}_damage_use_exponent"]
                found_losses[kind] = min(of_drift + of_use * (use > 0), p[f"{kind}_damage_limit"])
            lost = found_losses
            lost["stiffness"] = min(lost["stiffness"], max(1 - secant, 0.0))
            aim = peak[way] * (1 + lost["reloading"])
            if points is None:  # it turns on the backbone
                peak[-way] = max(peak[-way] * (1 + lost["reloading"]), -was)
            strength, stiff = 1 - lost["strength"], 1 - lost["stiffness"]
            low = strength * p["unloading_force"] * (r[3] if peak[way] > mu[2] else r[2])
            top = strength * backbone(aim)
            bend = min(p["reloading_drift"] * aim, aim - (1 - p["reloading_force"]) * top / stiff)
            points = [(was, f), (was + (low - f) / stiff, low), (bend, p["reloading_force"] * top), (aim, top)]
        if points is None or x > points[-1][0]:
            new, points = (1 - lost["strength"]) * backbone(abs(x)) * np.sign(x), None
        else:
            new = float(np.interp(x, *np.transpose(points)))
        new = min(new, f + (x - was))
        work += 0.5 * (f + new) * (x - was)
        force, last, before = way * new, u, way
        found[i] = force
    return found


LAWS: dict[str, Callable[[np.ndarray, Parameters], np.ndarray]] = {
    "hysteretic": hysteretic,
    "pinching4": pinching4,
    "ibarra_medina_krawinkler_bilinear": imk_bilinear,
    "ibarra_medina_krawinkler_peak_oriented": finely(_imk_peaks),
    "ibarra_medina_krawinkler_pinching": finely(_imk_peaks),
}
