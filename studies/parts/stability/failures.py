"""Cases of the study stability that the limit of one oscillator does not cover: chains, laws, accumulated time."""

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

STOREYS, FIRST_PERIOD, DAMPING_RATIO = 20, 2.0, 0.05  # number of storeys, period [s], damping ratio [1]
STIFFNESS = (np.pi / FIRST_PERIOD / np.sin(np.pi / (4 * STOREYS + 2))) ** 2  # storey stiffness over floor mass [1/s2]
CHAIN_STEPS = 4000  # number of integrated steps
CHAIN_DAMPINGS = ("none", "modal", "rayleigh", "stiffness")
BOUC_WEN_LIMIT = relaxation_limit(METHODS["rk4"])
# Elastic amplitude of the free vibrations divided by the yield drift.
DEMAND = 3.0
YIELDING_LAWS = {
    "elastic": {"law": "elastic"},
    "elastic_perfectly_plastic": {"law": "bilinear", "hardening_ratio": 0.0},
    "bouc_wen": {"law": "bouc_wen", "hardening_ratio": 0.0},  # exponent 1: the stiffness decreases from the start
}


def chain(damping: str, step: np.ndarray) -> wd.Scene:
    """Return the scene of uniform chains with unit masses that vibrate freely from a random shape.

    Time is divided by the step of each chain, so that all of them are integrated with a step of 1.


    Args:
        damping: "none"; "modal": 5 % in every mode; "rayleigh": 5 % in modes 1 and 3; "stiffness": 5 % in mode 1 and
            more in higher modes, because the damping matrix is proportional to the stiffness.
        step: Step of each chain [s], shape [chain].
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
    """Integrate chains with RK4, and return the norm of their states divided by the first norm, shape [chain, time].

    A state consists of displacements [m] and velocities [m/s].
    """
    run, _ = prepare(chain(damping, step), structures=step.size, method="rk4", dtype="float64", device=device, step=1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        _, kept = run.integrate_histories(range(step.size), every, 1.0)
        state = np.concatenate([kept["displacement"], kept["velocity"] / step[:, None, None]], axis=2)
        size = np.linalg.norm(state, axis=2)
        return np.nan_to_num(np.minimum(size / size[:, :1], 1e300), nan=1e300)


def chain_limits(damping: str, device: str | None = None) -> tuple[float, float, float]:
    """Return the longest stable step [s] of a chain with RK4: measured, in theory, and by the stability guard."""

    def grows(step: np.ndarray) -> np.ndarray:
        size = chain_sizes(damping, step.ravel(), CHAIN_STEPS // 2, device)
        # Two times are compared with a factor of 2, because displacements and velocities vanish alternately.
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
    """Return z and status of Bouc-Wen storeys that are pushed at 1 m/s from z = 0, integrated by RK4.

    Args:
        ratio: Step divided by its limit, 2.785 uy / (n |v|), shape [storey].
        exponent: Exponent n of the law, shape [storey].
        steps: Number of steps.
        device: Warp device, such as "cpu"; None: the default device.

    Returns:
            z at every step, shape [storey, time], and the status of each storey, shape [storey].
    """
    step = 1e-3
    yield_drift = step * exponent / (BOUC_WEN_LIMIT * ratio)
    # The mass is so large that the force of the storey does not change the velocity.
    storey = wd.ShearBuilding([1e12], 1.0, 1.0, law="bouc_wen", yield_force=1.0, hardening_ratio=0.0)
    given = {"yield_force": wd.GivenValues(yield_drift), "exponent": wd.GivenValues(exponent)}
    scene = wd.Scene(storey, wd.FreeVibration(steps * step, velocity=1.0), scatter=given, recorders=("drift",))
    run, _ = prepare(scene, structures=ratio.size, method="rk4", dtype="float64", device=device, step=step)
    _, kept = run.integrate_histories(range(ratio.size), 1, step)
    status = run.integrate(np.arange(ratio.size))["status"]
    return kept["storey_force"][..., 0] / yield_drift[:, None], status


def unsettled(z: np.ndarray) -> np.ndarray:
    """Return the largest distance of z from its bound 1 in the last quarter of the histories, shape [storey]."""
    return np.abs(z[:, -(z.shape[1] // 4) :] - 1).max(axis=1)


def bouc_wen_limits(exponent: np.ndarray, device: str | None = None) -> np.ndarray:
    """Return the step above which z does not settle, divided by uy / (n |v|), for each exponent."""

    def fails(ratio: np.ndarray) -> np.ndarray:
        z, _ = pushed_bouc_wen(ratio.ravel(), np.repeat(exponent, ratio.shape[1]), 4000, device)
        return (unsettled(z) > 1e-3).reshape(ratio.shape)

    return BOUC_WEN_LIMIT * first_failure(fails, exponent.size, 0.5, 1.5, points=50, passes=2)


def yielding_drift(
    method: str, law: str, frequency_step: np.ndarray, steps: int, device: str | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return drifts and status of free oscillators whose elastic amplitude is DEMAND times the yield drift.

    Args:
        method: Name of an integration method, a key of METHODS.
        law: Name of a storey law, a key of YIELDING_LAWS.
        frequency_step: Initial circular frequency times step, w h [1], shape [oscillator].
        steps: Number of steps.
        device: Warp device, such as "cpu"; None: the default device.

    Returns:
        Drifts divided by the yield drift, shape [oscillator, time], and the status that the kernel reports, shape
        [oscillator].
    """
    how = YIELDING_LAWS[law]
    yield_drift = 1 / (DEMAND * frequency_step)  # for a velocity of 1 m/s and a step of 1 s
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
    """Return the exact peak drift divided by the yield drift: there the work of the force is DEMAND^2 / 2."""
    work = DEMAND**2 / 2
    if law == "elastic":
        return DEMAND
    if law == "elastic_perfectly_plastic":
        return work + 0.5
    return brentq(lambda x: x - 1 + np.exp(-x) - work, work, work + 1, xtol=1e-14)  # z = 1 - exp(-x) until the peak


def clock(step: float, duration: float) -> np.ndarray:
    """Return the start times of the steps [s] in float32, computed by adding the step, as many programs do."""
    return np.add.accumulate(np.append(np.float32(0), np.full(round(duration / step), step, dtype=np.float32)))


def frame_in_numpy(step: float, every: int) -> np.ndarray:
    """Return displacements of the three-storey frame of the study seed_frame [m], by RK4 in float32 in numpy.

    Args:
        step: Integration step [s].
        every: Number of steps between two kept states.

    Returns:
        Displacements, shape [clock, time, dof]. Clock 0 adds the step to the time; clock 1 multiplies the number of the
        step by the step.
    """
    p, load = frame.STRUCTURE.parameters, frame.LOAD
    count = round(load.duration / step)
    zero, one, six = np.zeros((3, 3)), np.eye(3), np.eye(6)
    rates = np.linalg.solve(p["mass"], np.hstack([p["stiffness"], p["damping"]]))
    z = step * np.vstack([np.hstack([zero, one]), -rates])
    push = np.concatenate([np.zeros(3), np.linalg.solve(p["mass"], load.amplitude)])
    # The four stages of RK4 for a linear system are combined: one increment from the state, and one from the load at 0,
    # h/2 and h.
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
    """Return the largest error of the frame over its peak: kernels in both dtypes, and numpy with both clocks.

    The frame is the three-storey frame of the study seed_frame; the clocks are those of `frame_in_numpy`.
    """
    every = round(0.01 / step)
    exact = frame.exact(0.01 * np.arange(round(frame.LOAD.duration / 0.01) + 1))[0]
    accumulated, counted = frame_in_numpy(step, every)
    found = {"float32_accumulated_time": accumulated, "float32_in_numpy": counted}
    for dtype in ("float32", "float64"):
        run, _ = prepare(frame.SCENE, structures=1, method="rk4", dtype=dtype, device=device, step=step)
        found[dtype] = run.integrate_histories([0], every, step)[1]["displacement"][0]
    return {name: np.abs(u - exact).max() / np.abs(exact).max() for name, u in found.items()}
