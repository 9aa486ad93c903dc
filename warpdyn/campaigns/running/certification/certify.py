"""`certify`: a battery of checks of a storey law or a device."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
import warp as wp

from warpdyn.campaigns.running.certification.exceptions import EXCEPTIONS
from warpdyn.campaigns.running.certification.paths import CHORD, Storeys
from warpdyn.campaigns.running.certification.report import Certificate, Check
from warpdyn.campaigns.running.histories import Histories
from warpdyn.campaigns.running.simulate import simulate
from warpdyn.engine.laws import Device, Law
from warpdyn.engine.laws.springs import spring_row
from warpdyn.foundations.core.checks import real_number
from warpdyn.model.ground_motions.designs import Cloud
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.scene.scene import Scene
from warpdyn.model.structures.shear_building import ShearBuilding

YIELD_DRIFT, STIFFNESS = 0.01, 1.0e7  # m, N/m: of laws whose parameters do not decide them
PATHS = 12  # random paths of a law with one value for each parameter
FINER = 4  # factor of the steps by which step independence is measured
PERIOD, DURATION, INTERVAL = 0.5, 4.0, 0.01  # s: of the oscillator of the dynamic checks and its base motion
STEPS, REFERENCE = (0.01, 0.005, 0.0025, 0.00125), 0.00015625  # s: integration steps of the convergence check

Answers = Mapping[str, np.ndarray]


def certify(
    law: Law | Device, *, stiffness: float | None = None, drift: float | None = None, device: str | None = None
) -> Certificate:
    """Check a storey law or a device: continuity, passivity, energy, steps, rates, number types and processors.

    Args:
        law: The law or device with its parameters; of parameters with several values, all are checked.
        stiffness: Storey stiffness [N/m]. None: a yield force over 0.01 m, or else 1e7.
        drift: Scale of the paths [m], such as the yield drift; their largest drifts are 16 times as large. None: the
            first force among the parameters over the stiffness, or the largest length among them.
        device: GPU whose forces are compared with those of the CPU, such as "cuda:0". None: the first GPU, if any.

    Returns:
        A report. It prints a table of checks; `passed` is True if all checks passed; `figure()` draws loops, energies
        and convergence. Nothing is raised if a check fails.

    Raises:
        TypeError: If `law` is not an object of a law or device.
        ValueError: If its parameters contradict each other.

    Example:
        >>> wd.laws.certify(wd.laws.Bilinear(yield_force=1e5, hardening_ratio=0.05)).passed
        True
    """
    if not isinstance(law, Law | Device):
        raise TypeError(f"certify takes a law with its parameters, such as wd.laws.Elastic(), got {law!r}")
    storeys = _storeys(law, stiffness, drift)
    return certificate(repr(law), storeys, device)


def certificate(name: str, storeys: Storeys, device: str | None = None) -> Certificate:
    """Return the report on storeys of a law.

    Args:
        name: The law as text.
        storeys: Storeys that take the paths.
        device: GPU to compare with; None for the first, if any.
    """
    exceptions = {**EXCEPTIONS.get(storeys.element.name, {}), **storeys.element.exceptions}
    found = storeys.answers(storeys.path())
    checks: list[Check] = []

    def add(check: str, measured: float, bound: float, *, is_least: bool = False, reason: str = "") -> None:
        bound, reason = exceptions.get(check, (bound, reason))
        checks.append(Check(check, float(measured), bound, is_least, reason))

    spring = spring_row(storeys.rules)
    size = np.maximum(np.abs(found["force"]).max(axis=0), 1e-3 * storeys.stiffest * storeys.scale)
    energy = size * storeys.scale
    add("values that are not finite", sum(int((~np.isfinite(values)).sum()) for values in found.values()), 0)
    if not storeys.element.is_device:
        add("initial stiffness", _initial_stiffness_error(storeys), 1e-2)
    chord = _jumps(found) / (storeys.stiffest * CHORD * storeys.scale)
    add("continuity of the force", np.quantile(chord, 0.999), 100)
    add("stiffness bound", (_stiffness_excess(storeys, found) / size).max(), 1e-3)
    missed = np.abs(found["tangent"] - _slope(storeys, found)) / storeys.p["stiffness"]
    add("tangent", np.quantile(missed, 0.97), 2e-2 if spring.rate is not None else 1e-4)
    if spring.rate is None:
        add("force of a trial step", (np.abs(found["trial"] - found["force"]) / size).max(), 1e-9)
    add("elastic energy", -(found["recoverable"] / energy).min(), 1e-9)
    work = _work(found)
    add("passivity", -(work / energy).min(), 2e-3)
    fall = np.maximum.accumulate(work - found["recoverable"], axis=0) - (work - found["recoverable"])
    add("dissipation", (fall / energy).max(), 0.02)
    finer = storeys.answers(storeys.path(FINER * 120))
    steps = np.abs(finer["force"][FINER - 1 :: FINER] - found["force"]) / size
    add("step independence", steps.max(), 5e-3 if spring.rate is not None else 1e-9)
    add("rate independence", found["unlike_slower"].max() / max(1.0, storeys.scale), 1e-9)
    single = storeys.answers(storeys.path(), "float32")
    add("float32 against float64", (np.abs(single["force"] - found["force"]) / size).max(), 1e-3)
    gpu = device or _first_gpu()
    on_gpu = (
        (np.abs(storeys.answers(storeys.path(), device=gpu)["force"] - found["force"]) / size).max() if gpu else np.nan
    )
    add("GPU against CPU", on_gpu, 1e-9, reason="" if gpu else "no GPU")
    taken, errors, balance = _dynamics(storeys)
    add("energy balance", balance, 1e-3)
    reason = "the stability limit is shorter than the steps" if taken[-1] > taken[0] / 4 else ""
    order = np.nan if reason else np.polyfit(np.log(taken), np.log(np.maximum(errors, 1e-15)), 1)[0]
    add("convergence order of rk4", order, 1.3, is_least=True, reason=reason)
    shown = storeys.answers(storeys.cycles())
    drawn = (shown["drift"], shown["force"], _work(shown), shown["recoverable"])
    drift, force, done, elastic = (values[:, 0] for values in drawn)
    return Certificate(name, tuple(checks), drift, force, done, elastic, taken, errors)


def _storeys(law: Law | Device, stiffness: float | None, drift: float | None) -> Storeys:
    """Return storeys with the parameters of a law, and the scale of their paths."""
    values = {name: np.atleast_1d(value) for name, value in law.values().items()}
    forces = [values[name].max() for name, known in law.parameters.items() if known.units == "N"]
    lengths = [values[name].max() for name, known in law.parameters.items() if known.units == "m"]
    if stiffness is None:
        stiffness = forces[0] / YIELD_DRIFT if forces and not law.is_device else STIFFNESS
    stiffness = real_number("stiffness", stiffness, above=0)
    count = max([PATHS, *(value.size for value in values.values())])
    count = count if all(count % value.size == 0 for value in values.values()) else max(v.size for v in values.values())
    p = {name: np.resize(value, (1, count)).astype(float) for name, value in values.items()}
    p["stiffness"] = np.full((1, count), stiffness)
    if problem := law.problem(p):
        raise ValueError(f"{problem}; the stiffness is {stiffness:g} N/m: give certify(..., stiffness=...)")
    if drift is None:
        stiffest = float(np.max(law.stiffest(p)))
        of_force = forces[0] / (stiffest if law.is_device else stiffness) if forces and stiffest > 0 else YIELD_DRIFT
        drift = of_force if forces or not lengths else max(lengths)
    return Storeys(type(law), p, real_number("drift", drift, above=0))


def _first_gpu() -> str | None:
    """Return the first GPU, or None."""
    gpus = wp.get_cuda_devices()
    return gpus[0].alias if gpus else None


def _initial_stiffness_error(storeys: Storeys) -> float:
    drift = np.full((1, storeys.count), 1e-9 * storeys.scale)
    force = storeys.answers(drift)["force"] / drift
    return float(np.abs(force / storeys.p["stiffness"] - 1).max())


def _jumps(found: Answers) -> np.ndarray:
    """Return changes of the force over a chord [N]; a storey that is exhausted may lose its force at once."""
    return np.where(found["force"] == 0, 0.0, np.abs(found["force"] - found["behind"]))


def _slope(storeys: Storeys, found: Answers) -> np.ndarray:
    way = np.where(np.diff(found["drift"], axis=0, prepend=0.0) < 0, -1.0, 1.0)
    return (found["force"] - found["behind"]) / (way * CHORD * storeys.scale)


def _stiffness_excess(storeys: Storeys, found: Answers) -> np.ndarray:
    """Return the rise of the force in each step beyond that of the declared stiffness [N]."""
    steps = np.diff(found["drift"], axis=0)
    rises = np.diff(found["force"], axis=0) * np.sign(steps)
    rises[found["force"][1:] == 0] = 0  # a storey that is exhausted loses its force at once
    return rises - storeys.stiffest * np.abs(steps)


def _work(found: Answers) -> np.ndarray:
    """Return the work done along a path from rest [J], by the trapezoidal rule."""
    force, drift = (np.concatenate([np.zeros((1, found[name].shape[1])), found[name]]) for name in ("force", "drift"))
    return np.cumsum((force[1:] + force[:-1]) / 2 * np.diff(drift, axis=0), axis=0)


def _dynamics(storeys: Storeys) -> tuple[np.ndarray, np.ndarray, float]:
    """Return steps [s], errors of an oscillator's displacement at these steps, and the error of its energy balance."""
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
        for step in (REFERENCE, *STEPS):
            run = simulate(scene, method="rk4", dtype="float64", step=step, device="cpu", histories=Histories((0,)))
            displacement = run["displacement"].values.reshape(-1)
            found.append(displacement[:: (displacement.size - 1) // (time.size - 1)])
            taken.append(float(run["integration_step"].max()))
            balance = float(np.abs(run["energy_balance_error"]).max()) if step == REFERENCE else balance
    reference, *others = found
    errors = [np.sqrt(np.mean((each - reference) ** 2) / np.mean(reference**2)) for each in others]
    return np.array(taken[1:]), np.array(errors), balance
