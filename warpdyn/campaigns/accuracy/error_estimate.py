"""Error estimates of a run: some samples are run again with half the step, in float64."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.settings import LEAST_TOLERANCE
from warpdyn.campaigns.integration.stability_guard import Reruns, integrate_guarded
from warpdyn.campaigns.integration.time_grid import Schedule
from warpdyn.foundations.core.output_variables import DIVERGED
from warpdyn.foundations.core.random_numbers import Purpose
from warpdyn.model.ground_motions.excitation import Assignment

FEWEST_SAMPLES = 30  # with fewer samples, a 95 % quantile is meaningless
# Quantiles of the error over the samples, by name.
STATISTICS = {"median": 0.5, "95 %": 0.95, "worst": 1.0}
# Factor on the number of steps in the second run. For the exact method it is larger (FINER_EXACT): its only error is
# that peaks are evaluated at steps, and half the step may miss the same peak. The second run of an adaptive method also
# has a smaller tolerance, by the factor TIGHTER.
FINER, FINER_EXACT, TIGHTER = 2, 8, 1e-2


def relative_errors(
    run: Ensemble, outputs: dict[str, np.ndarray], chosen: np.ndarray, reruns: Reruns | None = None
) -> dict[str, np.ndarray]:
    """Return the relative error [1] of every demand of chosen samples, from a second run at half the step in float64.

    Multistep methods are compared with RK4 at half the step.

    Args:
        run: Ensemble of samples that were integrated.
        outputs: Outputs of the chosen samples by name; the last dimension is the sample.
        chosen: Indices of the chosen samples in the ensemble.
        reruns: Reruns of earlier samples, which count for the limit on reruns; None: no earlier samples.

    Returns:
        Relative error [1] by demand, shape [sample]: the largest error over storeys (or degrees of freedom), divided by
        the largest value over storeys; NaN for a sample that failed in either run.
    """
    method = run.model.method
    finer = FINER_EXACT if method.kind == "exact" else FINER
    reference = integrate_guarded(_refined(run, chosen, finer), chosen, reruns)
    # Correct for the error of the finer run. Peaks are evaluated at steps, so the order of their error is at most 2.
    order = 1 if method.kind == "explicit" and method.order == 1 else 2
    errors = compare(run, outputs, reference, chosen)
    return {name: error / (1 - finer**-order) for name, error in errors.items()}


def _refined(run: Ensemble, chosen: np.ndarray, finer: int) -> Ensemble:
    """Return an ensemble of the chosen samples in float64 with `finer` times the steps, also in earlier events."""
    schedule = run.restepped(chosen, finer * run.schedule.substeps[chosen])
    is_adaptive = run.model.method.is_adaptive
    tolerance = max(run.tolerance * TIGHTER, LEAST_TOLERANCE["float64"]) if is_adaptive else run.tolerance
    refined = run.with_model(run.model.checking.in_float64(tolerance, run.queue.device), schedule)
    if run.before is not None:
        everything = np.arange(run.before.sample.size)
        refined.resume(integrate_guarded(_refined(run.before, everything, finer), everything))
    return refined


def compare(
    run: Ensemble, outputs: dict[str, np.ndarray], reference: dict[str, np.ndarray], chosen: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the relative error [1] of every demand against a reference run, by name; see `relative_errors`."""
    failed = (outputs["status"] >= DIVERGED) | (reference["status"] >= DIVERGED)
    sizes = dict(reference)
    if "peak_storey_drift" in reference:
        sizes["peak_storey_drift_ratio"] = reference["peak_storey_drift"] / run.heights_of(chosen)
    errors = {}
    for name, variable in run.model.demands.items():
        scale = np.max([_largest(sizes[key]) for key in (name, *variable.scale) if key in sizes], axis=0)
        one, other = outputs[name].astype(np.float64), reference[name]
        # The residual drift is NaN in both runs if the sample collapses in both: the error is then 0.
        difference = _largest(np.where(np.isnan(one) & np.isnan(other), 0.0, one - other))
        with np.errstate(divide="ignore", invalid="ignore"):
            error = np.where(difference == 0, 0.0, difference / scale)
        errors[name] = np.where(failed, np.nan, error)
    return errors


def _largest(values: np.ndarray) -> np.ndarray:
    """Return the largest absolute value of each sample over its storeys or floors; the last axis is the sample."""
    return np.abs(values).reshape(-1, values.shape[-1]).max(axis=0)


class ErrorEstimate:
    """Estimate of the errors of a run: a share of its samples (at least 30) is rerun, and errors are collected.

    Args:
        samples: Number of samples of the run.
        share: Share of the samples that are checked [1].
        seed: Seed of the random choice of samples.
        together: Number of samples that are rerun at a time.
        chosen: Indices of the checked samples, if an estimate for another region of the same run has chosen them.

    Attributes:
        reruns: Reruns of failed samples in the check runs.
    """

    def __init__(self, samples: int, share: float, seed: int, together: int, chosen: np.ndarray | None = None) -> None:
        if chosen is None:
            count = min(samples, max(FEWEST_SAMPLES, int(np.ceil(share * samples))))
            generator = np.random.default_rng([seed, Purpose.CHECKED_SAMPLES])
            chosen = np.sort(generator.choice(samples, count, replace=False))
        self.chosen = chosen
        self.together = together
        self.reruns = Reruns()
        self._waiting: list[tuple[Ensemble, dict[str, np.ndarray]]] = []
        self._errors: list[dict[str, np.ndarray]] = []

    def add(self, run: Ensemble, outputs: dict[str, np.ndarray]) -> None:
        """Add the outputs (last dimension: sample) of a block: of the samples that are checked and did not fail."""
        first, last = np.searchsorted(self.chosen, [run.sample[0], run.sample[-1] + 1])
        own = self.chosen[first:last] - run.sample[0]
        own = own[outputs["status"][own] < DIVERGED]
        if own.size:
            self._waiting.append((run.select(own), {name: values[..., own] for name, values in outputs.items()}))
        if sum(part.sample.size for part, _ in self._waiting) >= self.together:
            self._run_again()

    def _run_again(self) -> None:
        if not self._waiting:
            return
        blocks, outputs = zip(*self._waiting, strict=True)
        self._waiting.clear()
        whole = {name: np.concatenate([part[name] for part in outputs], axis=-1) for name in outputs[0]}
        run = joined(blocks)
        self._errors.append(relative_errors(run, whole, np.arange(run.sample.size), self.reruns))

    def found(self) -> list[dict[str, np.ndarray]]:
        """Return the errors of all samples checked so far: a list of arrays by demand, for `include`."""
        self._run_again()
        return self._errors

    def include(self, errors: list[dict[str, np.ndarray]]) -> None:
        """Add errors that another process found for later samples (result of its method `found`)."""
        self._errors += errors

    def result(self, demands: Sequence[str]) -> xr.Dataset:
        """Return a dataset with `estimated_relative_error` [1], shape [demand, error_statistic].

        The error statistics are the median, the 95 % quantile and the largest error of the checked samples.
        """
        self._run_again()
        demands = list(demands)
        values = np.full((len(demands), len(STATISTICS)), np.nan)
        count = 0
        if self._errors and demands:
            errors = [np.concatenate([part[name] for part in self._errors]) for name in demands]
            count = errors[0].size
            # If a sample fails at half the step, its error counts as infinite.
            ordered = np.where(np.isnan(errors), np.inf, errors)
            values = np.quantile(ordered, list(STATISTICS.values()), axis=1, method="higher").T
        attributes = {
            "long_name": "estimated relative error of the demand over the samples",
            "units": "1",
            "comment": f"of {count} samples, by half the step in float64; relative to the sample's largest value of "
            "the demand over its storeys; residual drifts relative to its peak storey drift ratio if that is recorded, "
            "energies relative to its input energy",
        }
        return xr.Dataset(
            {"estimated_relative_error": (("demand", "error_statistic"), values, attributes)},
            coords={"demand": demands, "error_statistic": list(STATISTICS)},
        )


def joined(parts: Sequence[Ensemble]) -> Ensemble:
    """Return the samples of several ensembles of one run as one ensemble, on the device of the last one."""
    first = parts[0]
    has_rows = bool(first.drawn) or first.before is not None  # otherwise all samples have the same structure
    counts = [len(part.structures) for part in parts] if has_rows else [0] * len(parts)
    starts = np.cumsum([0, *counts[:-1]], dtype=np.int32)
    whole = Ensemble(
        first.model,
        np.concatenate([part.structures for part in parts]),
        {name: np.concatenate([part.drawn[name] for part in parts]) for name in first.drawn},
        np.concatenate([part.rayleigh for part in parts]) if has_rows else first.rayleigh,
        Assignment.joined([part.assignment for part in parts]),
        np.concatenate([part.row + start for part, start in zip(parts, starts, strict=True)]),
        Schedule.joined([part.schedule for part in parts]),
        np.concatenate([part.sample for part in parts]),
        parts[-1].queue,
        joined([part.before for part in parts if part.before is not None]) if first.before is not None else None,
    )
    whole.state = {name: np.concatenate([part.state[name] for part in parts]) for name in first.state}
    return whole
