"""Storeys of a law with parameters drawn within their declared bounds, and random paths for them."""

from __future__ import annotations

import itertools

import numpy as np

import warpdyn as wd
from warpdyn.engine.laws import LAWS, Parameter

STIFFNESS, YIELD_FORCE = 1.0e7, 1.0e5  # a storey that yields at 10 mm
YIELD_DRIFT = YIELD_FORCE / STIFFNESS


def drawn(name: str, parameter: Parameter, rng: np.random.Generator) -> float:
    """Return a value of a parameter of typical size, now and then at one of its bounds."""
    if name == "yield_force":
        return YIELD_FORCE
    if name == "stiffness_ratio_negative":
        return 1.0  # tests compare with one initial stiffness
    if name == "counts_cycles":
        return 0.0  # alike in all storeys
    if name == "exponent":
        return rng.uniform(0.5, 5)  # of Bouc and Wen: below it RK4 needs shorter steps than these paths have
    if name == "total_slip":
        return rng.uniform(0, 0.9)  # where all of a storey slips it pushes on for hundreds of yield drifts
    if parameter.units == "N":
        return YIELD_FORCE * 10 ** rng.uniform(-1, 1)
    low, high = parameter.low, parameter.high
    if name.startswith("ductility_"):
        return 1 + 3 * rng.random() * (int(name.removesuffix("_negative")[-1]) - 1)
    if name.startswith("force_ratio_"):
        return 1.4 * rng.random()
    if parameter.units == "m":
        return (
            max(low, 0.0) if low == 0 and not parameter.low_open and rng.random() < 0.4 else 10 ** rng.uniform(-2.5, 0)
        )
    if np.isfinite(low) and np.isfinite(high):
        nudge = 1e-3 * (high - low)
        ends = low + nudge * parameter.low_open, high - nudge * parameter.high_open
        return rng.choice([*ends, *rng.uniform(low, high, 3)])
    if np.isfinite(low):
        base = low + (10 ** rng.uniform(-2, 1))
        return low if not parameter.low_open and rng.random() < 0.3 else base
    return rng.uniform(-1, 1)


def _corners_ascend(values: dict[str, float]) -> bool:
    """Return whether the ductilities of a backbone's corners increase on both sides, as laws require."""
    for side in ("", "_negative"):
        corners = [values[name] for i in range(2, 5) if (name := f"ductility_{i}{side}") in values]
        if any(later <= earlier for earlier, later in itertools.pairwise(corners)):
            return False
    return True


def drawn_building(
    law: str, count: int, rng: np.random.Generator, *, is_asymmetric: bool = False, **fixed: float
) -> wd.ShearBuilding:
    """Return a building with `count` storeys, each with different parameters that the law accepts."""
    storeys: list[dict[str, float]] = []
    while len(storeys) < count:
        known = {name: each for name, each in LAWS[law].parameters.items() if not each.optional or is_asymmetric}
        values = {name: drawn(name, parameter, rng) for name, parameter in known.items()} | fixed
        if not _corners_ascend(values):
            continue  # `problem` refuses them, too, at a higher cost
        given = {name: np.array([value]) for name, value in ({"stiffness": STIFFNESS} | values).items()}
        fits = not any(p.violations(given[name]).any() for name, p in known.items())
        if fits and LAWS[law].problem(given) is None:
            storeys.append(values)
    columns = {name: np.array([values[name] for values in storeys]) for name in storeys[0]}
    one = np.ones(count)
    return wd.ShearBuilding(one, STIFFNESS * one, 3.0 * one, law=law, **columns)


def random_paths(count: int, turns: int, steps: int, rng: np.random.Generator) -> np.ndarray:
    """Return reversing drifts [m], shape [step, storey], of all amplitudes and about a drift that varies."""
    sizes = 10 ** rng.uniform(-0.5, 1.2, (turns, count)) * YIELD_DRIFT
    to = sizes * rng.uniform(-1, 1, (turns, count)) + np.cumsum(rng.normal(size=(turns, count)), 0) * YIELD_DRIFT
    to[-1] = 0  # closed
    corners = np.concatenate([np.zeros((1, count)), to])
    along = np.linspace(0, 1, steps, endpoint=False)[:, None]
    parts = [a + (b - a) * along for a, b in itertools.pairwise(corners)]
    return np.concatenate([*parts, corners[-1:]])
