"""What a run's step and precision cost it: some samples run again at half the step and in float64."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.ensemble import Ensemble
from warpdyn.methods import METHODS
from warpdyn.recorders import DIVERGED, RECORDERS
from warpdyn.results import peak_storey_drift_ratio

FEWEST_SAMPLES = 30  # a 95 % quantile of fewer says little
# Statistics of the error over the samples, as quantiles.
STATISTICS = {"median": 0.5, "95 %": 0.95, "worst": 1.0}
TIGHTER = 1e-2  # an adaptive method's second run has this part of the tolerance


def relative_errors(run: Ensemble, outputs: dict[str, np.ndarray], chosen: np.ndarray) -> dict[str, np.ndarray]:
    """Return the relative error of every demand of some samples, against a run at half the step in float64.

    Args:
        run: The run.
        outputs: Its outputs, of the chosen samples alone, sample last.
        chosen: The samples.

    Returns:
        By demand, the largest error over its storeys (or degrees of freedom) relative to the largest value, shape
        [sample]; NaN for a sample that failed in either run.
    """
    if METHODS[run.plan.method].is_adaptive:
        finer = run.alike(run.schedule, "float64", run.tolerance * TIGHTER)
    else:
        schedule = run.schedule.with_substeps(chosen, 2 * run.schedule.substeps[chosen])
        finer = run.alike(schedule, "float64", run.tolerance)
    return compare(run, outputs, finer.integrate(chosen), chosen)


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
    generator = np.random.Generator(np.random.Philox(np.random.SeedSequence([seed, 2])))
    chosen = np.sort(generator.choice(held, count, replace=False))
    errors = relative_errors(run, {name: values[..., chosen] for name, values in outputs.items()}, chosen)
    values = np.full((len(errors), len(STATISTICS)), np.nan)
    for row, error in enumerate(errors.values()):
        finite = error[np.isfinite(error)]
        if finite.size:
            values[row] = np.quantile(finite, list(STATISTICS.values()))
    attributes = {
        "long_name": "estimated relative error of the demand over the samples",
        "units": "1",
        "comment": f"of {count} samples, against half the step in float64; relative to the sample's largest value "
        "of the demand over its storeys, of residual drifts to its peak storey drift ratio, of energies to its input",
    }
    return xr.Dataset(
        {"estimated_relative_error": (("demand", "error_statistic"), values, attributes)},
        coords={"demand": list(errors), "error_statistic": list(STATISTICS)},
    )
