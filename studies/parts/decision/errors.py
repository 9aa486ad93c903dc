"""Errors of fragility medians, caused by the integration and by the sampling of structures, with computing times."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from p695_fragility import DRIFT_LIMITS, build_scene
from tqdm import tqdm

import warpdyn as wd
from warpdyn.answers.fragility.estimators.table import estimator_of
from warpdyn.answers.fragility.stripe_counts import count_stripes
from warpdyn.campaigns.reductions.limits import DamageLimits

# A crossed design runs the same structures under every record. A nested design draws separate structures per record.
DESIGNS = ("crossed, Monte Carlo", "crossed, Sobol", "nested, Sobol")


@dataclass(frozen=True)
class Choices:
    """Values of the settings that the chart compares.

    Args:
        methods: Integration methods.
        steps: Longest integration steps [s].
        dtypes: Number types.
        structures: Numbers of structures in the crossed designs.
        structures_per_motion: Numbers of structures per record in the nested design.
        replications: Number of seeds with which the sampling error is estimated.
        structures_of_truth: Number of structures of the reference.
        step_of_truth: Longest step of the reference [s].
        structures_of_steps: Number of structures with which integration errors are measured.
    """

    methods: Sequence[str] = ("rk4", "stoermer", "newmark_average")
    steps: Sequence[float] = (0.02, 0.01, 0.005, 0.0025, 0.00125)
    dtypes: Sequence[str] = ("float32", "float64")
    structures: Sequence[int] = (1, 4, 16, 64, 256)
    structures_per_motion: Sequence[int] = (1, 2, 3, 4, 16)
    replications: int = 12
    structures_of_truth: int = 10000
    step_of_truth: float = 0.00125
    structures_of_steps: int = 64


@dataclass(frozen=True)
class Plan:
    """Design of the samples with its size: number of structures, or of structures per record in a nested design."""

    design: str
    size: int

    def scene(self, base: wd.Scene) -> wd.Scene:
        """Return the scene with this design, from a scene with any design."""
        sampling = "monte_carlo" if "Monte" in self.design else "sobol"
        excitation = base.excitation
        if "nested" in self.design:
            excitation = replace(excitation, structures_per_motion=self.size)
        return replace(base, excitation=excitation, sampling=sampling, recorders=("drift",))

    def run(self, base: wd.Scene, **terms: object) -> xr.Dataset:
        """Run the scene with this design, and return the result of `simulate`."""
        structures = {} if "nested" in self.design else {"structures": self.size}
        return wd.simulate(self.scene(base), **structures, keep_inputs=False, **terms)

    def histories(self, base: wd.Scene) -> int:
        """Return the number of response histories of this design."""
        pairs = self.size * len(base.excitation.motions)
        return pairs * len(base.excitation.levels)


def log_medians(run: xr.Dataset) -> np.ndarray:
    """Return ln(median capacity in g) of every damage state of a run, shape [damage_state]."""
    counts = count_stripes(run, DamageLimits.of(DRIFT_LIMITS))
    median, _, _ = estimator_of("lognormal").fit(counts.levels, counts.total[-1], counts.trials)
    return np.log(median)


def size_of(errors: np.ndarray) -> float:
    """Return the root mean square of errors of ln(median); infinite if a median could not be fitted."""
    return float(np.sqrt(np.mean(np.where(np.isfinite(errors), errors, np.inf) ** 2)))


def plans_of(choices: Choices) -> list[Plan]:
    """Return a `Plan` for each design and each of its sizes."""
    sizes = {design: choices.structures_per_motion if "nested" in design else choices.structures for design in DESIGNS}
    return [Plan(design, size) for design in DESIGNS for size in sizes[design]]


def timed(run: Callable[[], xr.Dataset]) -> tuple[xr.Dataset, float]:
    """Run twice, because the first run may compile kernels; return the faster run and its wall time [s]."""
    runs = []
    for _ in range(2):
        began = time.perf_counter()
        result = run()
        runs.append((result, time.perf_counter() - began))
    return min(runs, key=lambda pair: pair[1])


def truth_of(base: wd.Scene, choices: Choices, device: str | None, seed: int) -> np.ndarray:
    """Return the reference of ln(median), from many structures in float64 at a converged step, shape [damage_state]."""
    plan = Plan("crossed, Sobol", choices.structures_of_truth)
    return log_medians(
        plan.run(base, seed=seed + 1000, device=device, dtype="float64", longest_step=choices.step_of_truth)
    )


def errors_of(choices: Choices, device: str | None, seed: int, truth: np.ndarray | None = None) -> xr.Dataset:
    """Return a dataset of the errors and computing times [s] of every design, method, dtype and step.

    Args:
        choices: Values of the settings that are compared.
        device: Warp device, such as "cpu"; None: the default device.
        seed: Seed of the random draws.
        truth: ln(median) of the reference, from a run on another device; None: the reference is computed.
    """
    base, plans = build_scene(), plans_of(choices)
    truth = truth_of(base, choices, device, seed) if truth is None else truth
    steps = Plan("crossed, Sobol", choices.structures_of_steps)
    fine = {"dtype": "float64", "longest_step": choices.step_of_truth / 2, "seed": seed, "device": device}
    best = log_medians(steps.run(base, **fine))

    shape = len(choices.methods), len(choices.dtypes), len(choices.steps)
    integration = np.full(shape, np.nan)
    wall, kernels = np.full((*shape, len(plans)), np.nan), np.full((*shape, len(plans)), np.nan)
    for i, j, k in tqdm(np.ndindex(shape), total=integration.size, desc="integration", unit="point", disable=None):
        terms = {"method": choices.methods[i], "dtype": choices.dtypes[j], "longest_step": choices.steps[k]}
        integration[i, j, k] = size_of(log_medians(steps.run(base, seed=seed, device=device, **terms)) - best)
        for number, plan in enumerate(plans):
            run, wall[i, j, k, number] = timed(lambda plan=plan, terms=terms: plan.run(base, device=device, **terms))
            kernels[i, j, k, number] = run.attrs["seconds_in_kernels"]
    sampling, default = [], np.full(len(plans), np.nan)
    for number, plan in enumerate(tqdm(plans, desc="sampling", unit="design", disable=None)):
        found = [
            log_medians(plan.run(base, seed=seed + 1 + each, device=device)) for each in range(choices.replications)
        ]
        sampling.append(size_of(np.array(found) - truth))
        default[number] = timed(lambda plan=plan: plan.run(base, device=device))[1]
    default_error = size_of(log_medians(steps.run(base, seed=seed, device=device)) - best)

    dims = ("method", "dtype", "step")
    words = "root mean square over the damage states of the error of ln(median)"
    variables = {
        "integration_error": (dims, integration, {"long_name": f"{words}, from the integration", "units": "1"}),
        "sampling_error": ("plan", sampling, {"long_name": f"{words}, from the structures sampled", "units": "1"}),
        "seconds": ((*dims, "plan"), wall, {"long_name": "wall time of simulate", "units": "s"}),
        "seconds_in_kernels": ((*dims, "plan"), kernels, {"long_name": "time of the kernels", "units": "s"}),
        "seconds_by_default": (
            "plan",
            default,
            {"long_name": "wall time by the default method", "units": "s"},
        ),
        "integration_error_by_default": ((), default_error, {"long_name": f"{words}, by default", "units": "1"}),
        "true_log_median": ("damage_state", truth, {"long_name": "ln of the true median in g", "units": "1"}),
        "histories": ("plan", [plan.histories(base) for plan in plans], {"long_name": "histories", "units": "1"}),
    }
    coordinates = {
        "method": list(choices.methods),
        "dtype": list(choices.dtypes),
        "step": ("step", list(choices.steps), {"long_name": "longest integration step", "units": "s"}),
        "design": ("plan", [plan.design for plan in plans]),
        "size": ("plan", [plan.size for plan in plans]),
        "damage_state": list(DRIFT_LIMITS),
    }
    return xr.Dataset(variables, coordinates)


def precision_point(
    base: wd.Scene, precision: float, truth: np.ndarray, device: str | None, seeds: Sequence[int]
) -> dict[str, float]:
    """Return error and shortest wall time [s] of `fragility_to`, which chooses its samples, with compiled kernels.

    Args:
        base: The scene.
        precision: Target for half of the width of the confidence interval of a median, divided by the median [1].
        truth: ln(median) of the reference, shape [damage_state].
        device: Warp device, such as "cpu"; None: the default device.
        seeds: Seeds of the replications.
    """
    found, seconds = [], []
    for seed in seeds:
        began = time.perf_counter()
        curves = wd.fragility_to(base, DRIFT_LIMITS, precision, device=device, seed=seed)
        seconds.append(time.perf_counter() - began)
        found.append(np.log(curves["fragility_median"].values))
    error = size_of(np.array(found) - truth)
    return {"precision": precision, "precision_error": error, "precision_seconds": min(seconds)}


def record_error(base: wd.Scene, structures: int, device: str | None, seed: int) -> float:
    """Return the standard error of ln(median) that is caused by the choice of the records.

    The value is the root mean square over the damage states.
    """
    curves = wd.fragility(Plan("crossed, Sobol", structures).run(base, seed=seed, device=device), DRIFT_LIMITS)
    of_records = curves["median_variance"].sel(source=["record", "record and structure"]).sum("source")
    return float(np.sqrt(of_records.mean()))
