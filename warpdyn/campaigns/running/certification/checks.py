"""Checks of a storey law, damper or stop: along drift paths, in float32 and on a GPU, and in an oscillator."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
import warp as wp

from warpdyn.campaigns.running.certification.exceptions import EXCEPTIONS, checked_exceptions
from warpdyn.campaigns.running.certification.paths import CHORD, STEPS, Storeys
from warpdyn.campaigns.running.certification.report import Check
from warpdyn.campaigns.running.histories import Histories
from warpdyn.campaigns.running.simulate import simulate
from warpdyn.engine.laws.law import StoreyElement
from warpdyn.engine.laws.springs import spring_row
from warpdyn.model.ground_motions.designs import Cloud
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.scene.scene import Scene
from warpdyn.model.structures.shear_building import ShearBuilding

FINER = 4  # factor by which steps are shortened to measure step independence
CONTINUOUS = 0.6  # largest ratio of the force jumps in the finer steps to those in the longer steps
ROUNDING = 1e-9
BEFORE_YIELD = 1 - 1e-6  # largest drift of the check of linearity, divided by the yield drift
LEAST_FORCE = 1e-3  # relative force (by stiffness times scale, or by the largest force) below which jumps do not count
PERIOD, DURATION, INTERVAL = 0.5, 4.0, 0.01  # [s]: of the oscillator and its base motion
INTEGRATION_STEPS, REFERENCE_STEP = (0.01, 0.005, 0.0025, 0.00125), 0.00015625  # s

Answers = Mapping[str, np.ndarray]


class Checks:
    """The list of checks of a storey law, damper or stop; some bounds are wider because it declares an exception."""

    def __init__(self, element: type[StoreyElement]) -> None:
        self.exceptions = {**EXCEPTIONS.get(element.name, {}), **checked_exceptions(element)}
        self.found: list[Check] = []

    def add(self, name: str, measured: float, bound: float, *, is_least: bool = False) -> None:
        """Add a check with its measured value to the list; arguments: see `Check`."""
        bound, reason = self.exceptions.get(name, (bound, ""))
        self.found.append(Check(name, float(measured), bound, is_least, reason))

    def skip(self, name: str, bound: float, reason: str, *, is_least: bool = False) -> None:
        """Add a check whose value was not measured to the list, with the reason."""
        self.found.append(Check(name, np.nan, bound, is_least, reason, is_measured=False))


@np.errstate(invalid="ignore", over="ignore")  # the first check reports values that are not finite
def path_checks(storeys: Storeys, checks: Checks) -> None:
    """Check forces, tangents, memory and energies of storeys along drift paths in float64; add results to `checks`."""
    spring, add = spring_row(storeys.rules), checks.add
    found, size = storeys.answers(storeys.path()), force_size(storeys)
    energy = size * storeys.scale
    add("values that are not finite", sum(int((~np.isfinite(values)).sum()) for values in found.values()), 0)
    if not storeys.element.is_device:
        add("initial stiffness", _initial_stiffness_error(storeys), 1e-2)
    finer = storeys.answers(storeys.path(FINER * STEPS))
    if storeys.element.is_linear or storeys.element.is_linear_until_yield:
        add("linearity", _nonlinearity(storeys), ROUNDING)
    # With a quarter of the step, the change of a continuous force per step is about a quarter; jumps stay the same.
    jumps = [_largest_jump(storeys, each) for each in (found, finer)]
    if not (_ratio_of_jumps(jumps, size) <= CONTINUOUS):  # a steep part of the curve may be shorter than a step
        jumps = [jumps[1], _largest_jump(storeys, storeys.answers(storeys.path(FINER**2 * STEPS)))]
    add("continuity of the force", _ratio_of_jumps(jumps, size), CONTINUOUS)
    add("stiffness bound", (_stiffness_excess(storeys, found) / size).max(), 1e-3)
    way = np.where(np.diff(found["drift"], axis=0, prepend=0.0) < 0, -1.0, 1.0)
    slope = (found["force"] - found["behind"]) / (way * CHORD * storeys.scale)
    # If a step ends on a corner of the curve, the slope before the corner is not the tangent. The tangent of a rate law
    # is the tangent of its differential equation.
    missed = np.abs(found["tangent"] - slope) / storeys.p["stiffness"]
    add("tangent", np.quantile(missed, 0.97), 2e-2 if spring.rate is not None else 1e-4)
    add("kept force", (np.abs(found["held"] - found["force"]) / size).max(), ROUNDING)
    if spring.rate is None:
        add("force of a trial step", (np.abs(found["trial"] - found["force"]) / size).max(), ROUNDING)
    if spring.return_mapping is not None:
        add("memory of a trial step", found["unlike_advance"].max(), 0)
    if spring.memory_on_line is not None:
        lines = found["leaves_line"] == 0
        add("memory on a line", found["unlike_mapping"][lines].max(), ROUNDING)
        # If a straight line of the curve begins or ends within the step, either of the two slopes is correct.
        missed = np.abs(found["tangent_on_line"] - found["tangent"])[lines] / storeys.p["stiffness"].max()
        add("tangent on a line", np.quantile(missed, 0.999), 1e-6)
    add("negative elastic energy", -(found["recoverable"] / energy).min(), ROUNDING)
    done = work(found)
    add("passivity", -(done / energy).min(), 2e-3)
    lost = done - found["recoverable"]
    add("dissipation", ((np.maximum.accumulate(lost, axis=0) - lost) / energy).max(), 0.02)
    difference = (np.abs(finer["force"][FINER - 1 :: FINER] - found["force"]) / size).max()
    add("step independence", difference, 5e-3 if spring.rate is not None else ROUNDING)
    add("rate independence", found["unlike_slower"].max(), ROUNDING)


def precision_checks(storeys: Storeys, checks: Checks, device: str | None = None) -> None:
    """Compare forces in float32 on the CPU, and in float64 on a GPU, with forces in float64 on the CPU; add two checks.

    Args:
        storeys: Storeys of the law.
        checks: List that the checks are added to.
        device: GPU; None: the first GPU, if the machine has one.
    """
    path, size = storeys.path(), force_size(storeys)
    force = storeys.answers(path)["force"]
    single = storeys.answers(path, "float32")["force"]
    checks.add("float32 against float64", (np.abs(single - force) / size).max(), 1e-3)
    gpus = wp.get_cuda_devices()
    gpu = device or (gpus[0].alias if gpus else None)
    if gpu is None:
        checks.skip("GPU against CPU", ROUNDING, "no GPU")
    else:
        on_gpu = storeys.answers(path, device=gpu)["force"]
        checks.add("GPU against CPU", (np.abs(on_gpu - force) / size).max(), ROUNDING)


def oscillator_checks(storeys: Storeys, checks: Checks) -> tuple[np.ndarray, np.ndarray]:
    """Check energy balance and convergence of rk4 for an oscillator with the first storey's law; return its errors.

    Returns:
        Integration steps [s], and the relative error of the displacement for each step [1].
    """
    steps, errors, balance = _oscillator(storeys)
    checks.add("energy balance", balance, 1e-3)
    name, bound = "convergence order of rk4", 1.0  # a smooth law has order 4; a law with corners has order 1 to 2
    if steps[-1] > steps[0] / 4:
        checks.skip(name, bound, "the stability limit is shorter than the steps", is_least=True)
    else:
        is_finite = bool(np.isfinite(errors).all())
        order = np.polyfit(np.log(steps), np.log(np.maximum(errors, 1e-15)), 1)[0] if is_finite else np.nan
        checks.add(name, order, bound, is_least=True)
    return steps, errors


def force_size(storeys: Storeys) -> np.ndarray:
    """Return the largest absolute force of each storey along its drift path [N], shape [storey]."""
    largest = np.abs(storeys.answers(storeys.path())["force"]).max(axis=0)
    return np.maximum(largest, LEAST_FORCE * storeys.stiffest * storeys.scale + 1e-30)


def work(found: Answers) -> np.ndarray:
    """Return the cumulative work on storeys along a path from rest [J] by the trapezoidal rule, [step, storey]."""
    force, drift = (np.concatenate([np.zeros((1, found[name].shape[1])), found[name]]) for name in ("force", "drift"))
    return np.cumsum((force[1:] + force[:-1]) / 2 * np.diff(drift, axis=0), axis=0)


def _initial_stiffness_error(storeys: Storeys) -> float:
    drift = np.full((1, storeys.count), 1e-9 * storeys.scale)
    force = storeys.answers(drift)["force"] / drift
    return float(np.abs(force / storeys.p["stiffness"] - 1).max())


def _nonlinearity(storeys: Storeys) -> float:
    """Return the largest error of force = stiffness * drift in the linear range, relative to the largest such force."""
    path, stiffness, element = storeys.path(), storeys.p["stiffness"][0], storeys.element
    names = () if element.is_linear else {"yield_force", "yield_force_negative"} & storeys.p.keys()
    if names:
        # At the yield drift itself, rounding decides whether a storey yields.
        path *= (
            BEFORE_YIELD * np.min([storeys.p[name][0] for name in names], axis=0) / stiffness / np.abs(path).max(axis=0)
        )
    due = stiffness * path
    return float((np.abs(storeys.answers(path)["force"] - due) / np.abs(due).max(axis=0)).max())


def _rises(found: Answers) -> tuple[np.ndarray, np.ndarray]:
    """Return the rise of the force in the direction of each step [N], and the size of the step [m]: [step, storey]."""
    steps = np.diff(found["drift"], axis=0)
    rises = np.diff(found["force"], axis=0) * np.sign(steps)
    rises[found["force"][1:] == 0] = 0  # a storey whose strength is exhausted loses its force at once
    return rises, np.abs(steps)


def _stiffness_excess(storeys: Storeys, found: Answers) -> np.ndarray:
    """Return how much the force rises in each step above the declared stiffness times the step [N]: [step, storey]."""
    rises, steps = _rises(found)
    return rises - storeys.stiffest * steps


def _largest_jump(storeys: Storeys, found: Answers) -> np.ndarray:
    """Return the largest force jump in a step [N], shape [storey]: a fall, or a rise above the declared stiffness."""
    return np.maximum(_stiffness_excess(storeys, found), -_rises(found)[0]).max(axis=0)


def _ratio_of_jumps(jumps: list[np.ndarray], size: np.ndarray) -> float:
    """Return the largest ratio [1] of force jumps in finer steps, jumps[1], to those in longer steps, jumps[0]."""
    return float((jumps[1] / np.maximum(jumps[0], LEAST_FORCE * size)).max())


def _oscillator(storeys: Storeys) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the errors of rk4 for an oscillator with the first storey's law, against a much shorter step.

    Returns:
        Integration steps [s]; relative error of the displacement for each step [1]; error of the energy balance for the
        reference step [1].
    """
    p = {name: float(values[0, 0]) for name, values in storeys.p.items()}
    stiffness = p.pop("stiffness")
    given: Any = storeys.element(**p)
    kind: dict[str, Any] = {"devices": (given,)} if storeys.element.is_device else {"law": given}
    mass = stiffness * (PERIOD / (2 * np.pi)) ** 2
    time = np.arange(0, DURATION + INTERVAL / 2, INTERVAL)
    wave = np.sin(2 * np.pi * time / (1.3 * PERIOD)) * np.sin(np.pi * time / DURATION) ** 2
    motion = GroundMotion(2.0 * stiffness * storeys.scale / mass * wave, INTERVAL)
    found, taken, balance = [], [], 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        building = ShearBuilding(
            [mass], stiffness, 3.0, damping="storey", damping_coefficient=0.06 * np.sqrt(stiffness * mass), **kind
        )
        scene = Scene(building, Cloud([motion]), recorders=("drift", "energy"), tail=0.0)
        for step in (REFERENCE_STEP, *INTEGRATION_STEPS):
            run = simulate(scene, method="rk4", dtype="float64", step=step, device="cpu", histories=Histories((0,)))
            displacement = run["displacement"].values.reshape(-1)
            found.append(displacement[:: (displacement.size - 1) // (time.size - 1)])
            taken.append(float(run["integration_step"].max()))
            balance = float(np.abs(run["energy_balance_error"]).max()) if step == REFERENCE_STEP else balance
    reference, *others = found
    errors = [np.sqrt(np.mean((each - reference) ** 2) / np.mean(reference**2)) for each in others]
    return np.array(taken[1:]), np.array(errors), balance
