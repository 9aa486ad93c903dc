"""Cases in which the limit of one oscillator misleads, for the study `stability`: chains, storey laws, summed time."""

from __future__ import annotations

import numpy as np
import seed_frame as frame
from scipy.optimize import brentq

import warpdyn as wd
from parts.stability.oscillator import first_failure
from warpdyn.campaigns.integration.run import prepare
from warpdyn.engine.methods.stability_limits import relaxation_limit, stability_limit
from warpdyn.engine.methods.table import METHODS
from warpdyn.model.structures.modal import rayleigh_coefficients

STOREYS, FIRST_PERIOD, DAMPING_RATIO = 20, 2.0, 0.05
STIFFNESS = (np.pi / FIRST_PERIOD / np.sin(np.pi / (4 * STOREYS + 2))) ** 2  # of a storey, over a floor's mass
CHAIN_STEPS = 4000
CHAIN_DAMPINGS = ("none", "modal", "rayleigh", "stiffness")
BOUC_WEN_LIMIT = relaxation_limit(METHODS["rk4"])
# Elastic amplitude over yield drift: how far beyond yielding the free vibrations go.
DEMAND = 3.0
YIELDING_LAWS = {
    "elastic": {"law": "elastic"},
    "elastic_perfectly_plastic": {"law": "bilinear", "hardening_ratio": 0.0},
    "bouc_wen": {"law": "bouc_wen", "hardening_ratio": 0.0},  # exponent 1: it softens from the start
}


def chain(damping: str, step: np.ndarray) -> wd.Scene:
    """Return uniform chains of unit masses from a random shape, in units of time in which each one's step is 1.

    Args:
        damping: "none"; 5 % as "modal" in every mode, as "rayleigh" in modes 1 and 3, as "stiffness" in mode 1 and
            more in all others, since the damping matrix follows the stiffness alone.
        step: Step of each chain [s].
    """
    given = {"stiffness": wd.GivenValues(STIFFNESS * step**2)}
    if damping in ("modal", "rayleigh"):
        modes = (1, 3) if damping == "rayleigh" else None
        how = {"damping": damping, "damping_ratio": DAMPING_RATIO, "damping_modes": modes}
    else:
        how = {"damping": "storey", "damping_coefficient": 0.0}
        per_stiffness = 0.0 if damping == "none" else 2 * DAMPING_RATIO / (2 * np.pi / FIRST_PERIOD)
        given["damping_coefficient"] = wd.GivenValues(per_stiffness * STIFFNESS * step)
    building = wd.ShearBuilding(np.ones(STOREYS), STIFFNESS, 3.0, **how)
    shape = np.random.default_rng(2).standard_normal(STOREYS)
    return wd.Scene(building, wd.FreeVibration(float(CHAIN_STEPS), shape), scatter=given, recorders=("drift",))


def chain_sizes(damping: str, step: np.ndarray, every: int, device: str | None = None) -> np.ndarray:
    """Return the size of chains' displacements [m] and velocities [m/s] over the first, under RK4, [chain, time]."""
    run, _ = prepare(chain(damping, step), structures=step.size, method="rk4", dtype="float64", device=device, step=1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        _, kept = run.integrate_histories(range(step.size), every, 1.0)
        state = np.concatenate([kept["displacement"], kept["velocity"] / step[:, None, None]], axis=2)
        size = np.linalg.norm(state, axis=2)
        return np.nan_to_num(np.minimum(size / size[:, :1], 1e300), nan=1e300)


def chain_limits(damping: str, device: str | None = None) -> tuple[float, float, float]:
    """Return the longest stable step [s] of a chain under RK4: as measured, in theory, and by the stability guard."""

    def grows(step: np.ndarray) -> np.ndarray:
        size = chain_sizes(damping, step.ravel(), CHAIN_STEPS // 2, device)
        # Both are needed, because displacements and velocities vanish alternately.
        return (size[:, 2] > 2 * size[:, 1]).reshape(step.shape)

    measured = first_failure(grows, 1, 0.01, 0.04, points=32)[0]
    scene = chain(damping, np.ones(1))
    w = scene.structure.modal()["circular_frequency"].values
    of_mass, of_stiffness = {
        "rayleigh": rayleigh_coefficients(w[0], w[2], DAMPING_RATIO),
        "stiffness": (0.0, 2 * DAMPING_RATIO / w[0]),
    }.get(damping, (0.0, 0.0))
    ratio = np.full(w.size, DAMPING_RATIO) if damping == "modal" else (of_mass / w + of_stiffness * w) / 2
    theory = min(stability_limit(METHODS["rk4"], z) / each for z, each in zip(ratio, w, strict=True))
    _, vibration = prepare(scene, structures=1, method="rk4", dtype="float64", device=device, step=1.0)
    return measured, theory, vibration.stable_step[0]


def pushed_bouc_wen(
    ratio: np.ndarray, exponent: np.ndarray, steps: int, device: str | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return z of Bouc-Wen storeys pushed at 1 m/s from z = 0 under RK4, shape [storey, time], and their status.

    Args:
        ratio: Step over its limit, 2.785 uy / (n |v|), shape [storey].
        exponent: n, shape [storey].
        steps: Steps taken.
        device: Warp device.
    """
    step = 1e-3
    yield_drift = step * exponent / (BOUC_WEN_LIMIT * ratio)
    # The mass is so large that the storey's force does not slow it.
    storey = wd.ShearBuilding([1e12], 1.0, 1.0, law="bouc_wen", yield_force=1.0, hardening_ratio=0.0)
    given = {"yield_force": wd.GivenValues(yield_drift), "exponent": wd.GivenValues(exponent)}
    scene = wd.Scene(storey, wd.FreeVibration(steps * step, velocity=1.0), scatter=given, recorders=("drift",))
    run, _ = prepare(scene, structures=ratio.size, method="rk4", dtype="float64", device=device, step=step)
    _, kept = run.integrate_histories(range(ratio.size), 1, step)
    status = run.integrate(np.arange(ratio.size))["status"]
    return kept["storey_force"][..., 0] / yield_drift[:, None], status


def unsettled(z: np.ndarray) -> np.ndarray:
    """Return the largest distance of z from its bound, 1, in the last quarter of its histories, shape [storey]."""
    return np.abs(z[:, -(z.shape[1] // 4) :] - 1).max(axis=1)


def bouc_wen_limits(exponent: np.ndarray, device: str | None = None) -> np.ndarray:
    """Return the step from which z does not settle, as a multiple of uy / (n |v|), for each exponent."""

    def fails(ratio: np.ndarray) -> np.ndarray:
        z, _ = pushed_bouc_wen(ratio.ravel(), np.repeat(exponent, ratio.shape[1]), 4000, device)
        return (unsettled(z) > 1e-3).reshape(ratio.shape)

    return BOUC_WEN_LIMIT * first_failure(fails, exponent.size, 0.5, 1.5, points=50, passes=2)


def yielding_drift(
    method: str, law: str, frequency_step: np.ndarray, steps: int, device: str | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return drifts over the yield drift of free oscillators whose elastic amplitude is DEMAND, and their status.

    Args:
        method: Row of METHODS.
        law: Row of YIELDING_LAWS.
        frequency_step: Initial w h [-], shape [oscillator].
        steps: Steps taken.
        device: Warp device.

    Returns:
        Drifts, shape [oscillator, time], and what the kernel itself says, shape [oscillator].
    """
    how = YIELDING_LAWS[law]
    yield_drift = 1 / (DEMAND * frequency_step)  # at 1 m/s and a step of 1 s
    given = {"stiffness": wd.GivenValues(frequency_step**2)}
    if law != "elastic":
        how = how | {"yield_force": 1.0}
        given["yield_force"] = wd.GivenValues(frequency_step**2 * yield_drift)
    storey = wd.ShearBuilding([1.0], 1.0, 1.0, **how)
    scene = wd.Scene(storey, wd.FreeVibration(float(steps), velocity=1.0), scatter=given, recorders=("drift",))
    count = frequency_step.size
    run, _ = prepare(scene, structures=count, method=method, dtype="float64", device=device, step=1.0)
    _, kept = run.integrate_histories(range(count), 1, 1.0)
    return kept["displacement"][..., 0] / yield_drift[:, None], run.integrate(np.arange(count))["status"]


def exact_peak(law: str) -> float:
    """Return the peak drift of these oscillators over the yield drift: where the work done is DEMAND^2 / 2."""
    work = DEMAND**2 / 2
    if law == "elastic":
        return DEMAND
    if law == "elastic_perfectly_plastic":
        return work + 0.5
    return brentq(lambda x: x - 1 + np.exp(-x) - work, work, work + 1, xtol=1e-14)  # z = 1 - exp(-x) up to the peak


def clock(step: float, duration: float) -> np.ndarray:
    """Return float32 times that a step was added to, as often coded, at the start of each step [s]."""
    return np.add.accumulate(np.append(np.float32(0), np.full(round(duration / step), step, dtype=np.float32)))


def frame_in_numpy(step: float, every: int) -> np.ndarray:
    """Return displacements of the seed frame under RK4 in float32, written in numpy, with two clocks [m].

    Args:
        step: Integration step [s].
        every: Steps from one state kept to the next.

    Returns:
        By time added up step by step, and by the step's number times the step, shape [clock, time, dof].
    """
    p, load = frame.STRUCTURE.parameters, frame.LOAD
    count = round(load.duration / step)
    zero, one, six = np.zeros((3, 3)), np.eye(3), np.eye(6)
    rates = np.linalg.solve(p["mass"], np.hstack([p["stiffness"], p["damping"]]))
    z = step * np.vstack([np.hstack([zero, one]), -rates])
    push = np.concatenate([np.zeros(3), np.linalg.solve(p["mass"], load.amplitude)])
    # The four stages of a linear system in one: an increment from the state, and from the load at 0, h/2 and h.
    of_state = (z @ (six + z / 2 @ (six + z / 3 @ (six + z / 4)))).astype(np.float32)
    of_load = [six + z @ (six + z / 2 @ (six + z / 2)), 4 * six + 2 * z + z @ z / 2, six]
    half, w = np.float32(step / 2), np.float32(load.circular_frequency)
    number = np.arange(count, dtype=np.float32)
    clocks = np.stack([clock(step, load.duration)[:count], number * np.float32(step)])
    increment = sum(
        np.sin(w * (clocks + stage * half))[..., None] * (step / 6 * matrix @ push).astype(np.float32)
        for stage, matrix in enumerate(of_load)
    ).transpose(1, 2, 0)
    state, change = np.zeros((6, 2), np.float32), np.zeros((6, 2), np.float32)
    kept = np.zeros((count // every + 1, 3, 2))
    for i in range(count):
        np.dot(of_state, state, out=change)
        change += increment[i]
        state += change
        if (i + 1) % every == 0:
            kept[(i + 1) // every] = state[:3]
    return kept.transpose(2, 0, 1)


def frame_errors(step: float, device: str | None = None) -> dict[str, float]:
    """Return largest errors over the peak of the seed frame: kernels in both dtypes, and numpy with both clocks."""
    every = round(0.01 / step)
    exact = frame.exact(0.01 * np.arange(round(frame.LOAD.duration / 0.01) + 1))[0]
    accumulated, counted = frame_in_numpy(step, every)
    found = {"float32_accumulated_time": accumulated, "float32_in_numpy": counted}
    for dtype in ("float32", "float64"):
        run, _ = prepare(frame.SCENE, structures=1, method="rk4", dtype=dtype, device=device, step=step)
        found[dtype] = run.integrate_histories([0], every, step)[1]["displacement"][0]
    return {name: np.abs(u - exact).max() / np.abs(exact).max() for name, u in found.items()}
