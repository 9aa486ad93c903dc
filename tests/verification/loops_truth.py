"""Independent loops and histories: OpenSees' materials and chains, and loops that are exact for each segment."""

from __future__ import annotations

import functools
import json
from itertools import pairwise

import numpy as np
from opensees import chain_drifts, growing, material_forces

from .devices_truth import CASES
from .el_centro import STEP, el_centro
from .problem import Curve, Outcome
from .solvers import chain

YIELD, STIFFNESS = 1e5, 2e7  # N, N/m: a storey that yields at 5 mm
CYCLES = (0.5, 2, 4, 8)  # yield drifts
DRIFT = growing(YIELD / STIFFNESS * np.array(CYCLES), 100)
TURNS = 100 * np.arange(1, 2 * len(CYCLES) + 1) - 1

HYSTERETIC = {"ductility": (4.0, 10.0), "force_ratio": (1.2, 0.6), "rules": (0.5, 0.4, 0.005, 0.02, 0.3)}
PINCHING4 = {"ductility": (4.0, 7.0, 12.0), "force_ratio": (1.2, 1.3, 0.4), "pinching": (0.5, 0.25, 0.05)}
PINCHING4_DAMAGE = {
    "stiffness": (0.2, 0.1, 0.8, 0.5, 0.6),
    "reloading": (0.1, 0.1, 0.7, 0.6, 0.3),
    "strength": (0.1, 0.15, 1.0, 0.4, 0.4),
}
PEAK_ORIENTED = {"to_capping": 0.02, "post_capping": 0.08, "capping": 1.15, "residual": 0.1, "lasting": 1.0}
STEEL = {"hardening": 0.02, "curvature": 18.0, "isotropic": 0.02, "after": 3.0}


def corners(ductility, ratio) -> list[float]:
    """Return forces and drifts of a backbone, in OpenSees' order of Pinching4 and Hysteretic."""
    return [
        v for d, f in zip((1.0, *ductility), (1.0, *ratio), strict=True) for v in (f * YIELD, d * YIELD / STIFFNESS)
    ]


def material(name: str) -> tuple[str, list[float | str]]:
    """Return OpenSees' material of a problem and its numbers."""
    if name == "hysteretic":
        side = corners(HYSTERETIC["ductility"], HYSTERETIC["force_ratio"])
        return "Hysteretic", [*side, *(-v for v in side), *HYSTERETIC["rules"]]
    if name == "pinching4":
        side = corners(PINCHING4["ductility"], PINCHING4["force_ratio"])
        damage = [v for values in PINCHING4_DAMAGE.values() for v in values]
        return "Pinching4", [*side, *(-v for v in side), *PINCHING4["pinching"] * 2, *damage, 10.0, "energy"]
    if name == "peak_oriented":
        p = PEAK_ORIENTED
        side = [p["to_capping"], p["post_capping"], 1e9, YIELD, p["capping"], p["residual"]]
        return "IMKPeakOriented", [STIFFNESS, *side, *side, *[p["lasting"]] * 4, *[1.0] * 4, 1.0, 1.0]
    if name == "menegotto_pinto":
        p = STEEL
        iso = [p["isotropic"], p["after"]]
        return "Steel02", [YIELD, STIFFNESS, p["hardening"], p["curvature"], 0.925, 0.15, *iso, *iso]
    raise KeyError(name)


@functools.cache
def opensees_loop(name: str) -> Outcome:
    """Forces of OpenSees' material along cycles of growing amplitude."""
    force = material_forces(*material(name), DRIFT)
    return Outcome(force[TURNS], {"loop": (DRIFT, force)})


def flag_case() -> dict:
    """Return a self-centring loop whose forces are exact for each segment."""
    cases = json.loads((CASES / "loops.json").read_text(encoding="utf-8"))["cases"]
    return next(case for case in cases if case["id"] == "self_centring_1")


def flag_path(case: dict, steps: int = 100) -> tuple[np.ndarray, np.ndarray]:
    """Return drifts through the turning points, and rows at which the case has forces, [segment, fraction]."""
    turns = np.array([0.0, *case["turning_points"]])
    along = np.arange(1, steps + 1) / steps
    drift = np.concatenate([a + (b - a) * along for a, b in pairwise(turns)])
    fractions = np.round(np.array(case["fractions_of_segment"]) * steps).astype(int)
    return drift, np.arange(len(turns) - 1)[:, None] * steps + fractions - 1


def flag_loop() -> Outcome:
    """Stored forces of the exact loop."""
    case = flag_case()
    drift, rows = flag_path(case)
    force = np.array(case["force"])
    return Outcome(force[:, -1], {"loop": (drift[rows.ravel()], force.ravel())})


FRAME_MASS, FRAME_STIFFNESS, HEIGHT = 1e5, np.array([1.2e8, 1.0e8, 7e7]), 3.2
FRAME_STRENGTH = np.array([2.4e5, 2.0e5, 1.2e5])
INTERVALS, SUBSTEPS = 750, 20


def rayleigh(stiffness) -> tuple[float, float]:
    """Return the factors of mass and stiffness for 5 % in the first two modes."""
    w = np.sqrt(np.linalg.eigvalsh(chain(stiffness) / FRAME_MASS))
    return 0.1 * w[0] * w[1] / (w[0] + w[1]), 0.1 / (w[0] + w[1])


@functools.cache
def frame(name: str) -> np.ndarray:
    """Return OpenSees' storey drifts of a three-storey frame under the first 15 s of El Centro, 1 ms."""
    of_mass, of_stiffness = rayleigh(FRAME_STIFFNESS)
    gravity = np.zeros(3)
    materials = []
    for k, f in zip(FRAME_STIFFNESS, FRAME_STRENGTH, strict=True):
        if name == "bilinear":
            materials.append(("Steel01", [f, k, 0.03]))
        else:
            materials.append(("Steel02", [f, k, 0.02, 18.0, 0.925, 0.15]))
    damping = (of_mass, of_stiffness * FRAME_STIFFNESS)
    return chain_drifts(
        np.full(3, FRAME_MASS),
        materials,
        damping,
        gravity,
        9.81 * el_centro()[: INTERVALS + 1],
        STEP,
        INTERVALS,
        SUBSTEPS,
    )


def frame_outcome(name: str) -> Outcome:
    """Peaks and last values of the storey drifts."""
    drift = frame(name)
    time = STEP / SUBSTEPS * np.arange(len(drift))
    curve: Curve = (time[::10], drift[::10, 0])
    return Outcome([*np.abs(drift).max(axis=0), *drift[-1]], {"drift of the first storey": curve})
