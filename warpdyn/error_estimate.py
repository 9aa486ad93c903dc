"""What a run's step and precision cost it: some samples run again at half the step and in float64."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.ensemble import Ensemble
from warpdyn.guard import integrate_guarded
from warpdyn.methods import METHODS
from warpdyn.prepare import LEAST_TOLERANCE
from warpdyn.random_numbers import CHECKED, generator_of
from warpdyn.recorders import DIVERGED, RECORDERS
from warpdyn.results import peak_storey_drift_ratio

FEWEST_SAMPLES = 30  # a 95 % quantile of fewer says little
# Statistics of the error over the samples, as quantiles.
STATISTICS = {"median": 0.5, "95 %": 0.95, "worst": 1.0}
# The second run has this many times the steps. The exact method errs only in what it sees of a peak, which half the
# step may miss in the same way; an adaptive one has a tighter tolerance, too.
FINER, FINER_EXACT, TIGHTER = 2, 8, 1e-2


def relative_errors(run: Ensemble, outputs: dict[str, np.ndarray], chosen: np.ndarray) -> dict[str, np.ndarray]:
    """Return the relative error of every demand of some samples, by a run at half the step in float64.

    Args:
        run: The run.
        outputs: Its outputs, of the chosen samples alone, sample last.
        chosen: The samples.

    Returns:
        By demand, the largest error over its storeys (or degrees of freedom) relative to the largest value, shape
        [sample]; NaN for a sample that failed in either run.
    """
    method = METHODS[run.plan.method]
    finer = FINER_EXACT if method.kind == "exact" else FINER
    schedule = run.schedule.with_substeps(chosen, finer * run.schedule.substeps[chosen])
    tolerance = max(run.tolerance * TIGHTER, LEAST_TOLERANCE["float64"]) if method.is_adaptive else run.tolerance
    reference = integrate_guarded(run.alike(schedule, "float64", tolerance), chosen, "substep")
    # What the finer run still errs itself: peaks are seen at steps, so that no method's are of more than order 2.
    order = 1 if method.kind == "explicit" and method.order == 1 else 2
    errors = compare(run, outputs, reference, chosen)
    return {name: error / (1 - finer**-order) for name, error in errors.items()}


def compare(
    run: Ensemble, outputs: dict[str, np.ndarray], reference: dict[str, np.ndarray], chosen: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the relative error of every demand against a reference's outputs, as `relative_errors` does."""
    failed = (outputs["status"] >= DIVERGED) | (reference["status"] >= DIVERGED)
    sizes = dict(reference)
    if "peak_storey_drift" in reference:
        structure = run.assignment.structure[chosen]
        sizes["peak_storey_drift_ratio"] = peak_storey_drift_ratio(run.scene, reference, run.drawn, structure)
    errors = {}
    for recorder in run.scene.record:
        for name, variable in RECORDERS[run.plan.family][recorder].items():
            if not variable.is_demand:
                continue
            scale = np.max([_largest(sizes[key]) for key in (name, *variable.scale) if key in sizes], axis=0)
            difference = _largest(outputs[name].astype(np.float64) - reference[name])
            with np.errstate(divide="ignore", invalid="ignore"):
                error = np.where(difference == 0, 0.0, difference / scale)
            errors[name] = np.where(failed, np.nan, error)
    return errors


def _largest(values: np.ndarray) -> np.ndarray:
    """Return the largest size over every axis but the last, that of the samples."""
    return np.abs(values).reshape(-1, values.shape[-1]).max(axis=0)


def estimate_errors(run: Ensemble, outputs: dict[str, np.ndarray], share: float, seed: int) -> xr.Dataset:
    """Return the estimated relative error of every demand, from a share of the samples (at least 30) run again.

    Args:
        run: The run.
        outputs: Its outputs, sample last.
        share: Share of the samples.
        seed: Seed of their choice.

    Returns:
        `estimated_relative_error` over `demand` and `error_statistic` (median, 95 % and worst).
    """
    total = outputs["status"].size
    held = np.flatnonzero(outputs["status"] < DIVERGED)
    count = min(held.size, max(FEWEST_SAMPLES, int(np.ceil(share * total))))
    generator = generator_of(seed, CHECKED)
    chosen = np.sort(generator.choice(held, count, replace=False))
    demands = [
        name for recorder in run.scene.record for name, v in RECORDERS[run.plan.family][recorder].items() if v.is_demand
    ]
    values = np.full((len(demands), len(STATISTICS)), np.nan)
    if count:
        errors = relative_errors(run, {name: values[..., chosen] for name, values in outputs.items()}, chosen)
        # A sample that fails at half the step counts as one of infinite error.
        ordered = [np.where(np.isnan(errors[name]), np.inf, errors[name]) for name in demands]
        values = np.quantile(ordered, list(STATISTICS.values()), axis=1, method="higher").T
    attributes = {
        "long_name": "estimated relative error of the demand over the samples",
        "units": "1",
        "comment": f"of {count} samples, by half the step in float64; relative to the sample's largest value of the "
        "demand over its storeys, of residual drifts to its peak storey drift ratio if that is recorded, of energies "
        "to its input energy",
    }
    return xr.Dataset(
        {"estimated_relative_error": (("demand", "error_statistic"), values, attributes)},
        coords={"demand": demands, "error_statistic": list(STATISTICS)},
    )
