"""Section of a report on the status of the samples of a run, with remarks on limitations of its results."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.campaigns.integration.stability_guard import LARGEST_CHANGE, LARGEST_ENERGY_ERROR
from warpdyn.foundations.core.messages import amount_of
from warpdyn.foundations.core.output_variables import COLLAPSED, LARGEST_EXCLUDED_FRACTION, OK, STATUS_MEANINGS
from warpdyn.interfaces.reports.markup import Part, heading, paragraph, remark, table
from warpdyn.interfaces.reports.summary import collapses_of_springs, names_of_storeys

MEANINGS = {
    "ok": "the building is standing at the end of the run",
    "collapsed": "a storey drift or a spring's deformation exceeded its capacity, or gravity exceeds a storey's "
    "stiffness; counts as exceeding every demand",
    "diverged": "the displacements grew without bound; the sample has no demands",
    "unstable_step": "the step was too long; the sample has no demands",
    "not_converged": "a step had no equilibrium; the sample has no demands",
}


def outcome(run: xr.Dataset) -> list[Part]:
    """Return the section of a report on the status of the samples of one event, with remarks on the results.

    Args:
        run: Result of `simulate` for one event, with the dimension `sample`.
    """
    status = decoded_status(run["status"])
    counts = np.bincount(status, minlength=len(STATUS_MEANINGS))
    rows = [
        (name, int(count), f"{count / status.size:.2%}", MEANINGS[name])
        for name, count in zip(STATUS_MEANINGS, counts, strict=True)
        if count or name == "ok"
    ]
    parts = [heading("Outcome"), table("Status of the samples", ("status", "samples", "share", "meaning"), rows)]
    if "storey_of_collapse" in run:
        storey = run["storey_of_collapse"].values[status == COLLAPSED]
        storeys, collapses = np.unique(storey[storey > 0], return_counts=True)
        if storeys.size:
            pairs = [(names_of_storeys(run, number), count) for number, count in zip(storeys, collapses, strict=True)]
            parts.append(table("Storey that collapsed first", ("storey", "samples"), pairs))
    if "spring_of_collapse" in run:
        pairs = collapses_of_springs(run)
        parts += [table("Spring that collapsed first", ("spring", "samples"), pairs)] if pairs else []
    found = [remark(text) for text in remarks(run, status)]
    return [*parts, heading("Remarks", 3), *(found or [paragraph("No remarks: the run passed every check.")])]


def remarks(run: xr.Dataset, status: np.ndarray) -> list[str]:
    """Return sentences that describe limitations of the results of a run; an empty list if there is no limitation.

    Args:
        run: Result of `simulate`, for one event.
        status: Status of each sample as a number (index in STATUS_MEANINGS), shape [sample].
    """
    found = []
    failed = int(np.count_nonzero(status > COLLAPSED))
    if failed:
        most = "more" if failed > LARGEST_EXCLUDED_FRACTION * status.size else "not more"
        found.append(
            f"{failed:,} of {status.size:,} samples failed in the integration and have no demands. This is {most} than "
            f"{LARGEST_EXCLUDED_FRACTION:.0%}, the limit for fragility curves."
        )
    if "energy_balance_error" in run:
        error = np.abs(run["energy_balance_error"].values[status <= COLLAPSED])
        off = int(np.count_nonzero(error > LARGEST_ENERGY_ERROR))
        if off:
            found.append(
                f"In {amount_of(off, 'sample')} the energies do not balance within {LARGEST_ENERGY_ERROR:.0%} of the "
                f"energy supplied (largest error {error.max():.2g}). Their demands may be wrong, too."
            )
    if "unreliable" in run:
        count = int(np.count_nonzero(run["unreliable"].values == 1))
        if count:
            found.append(
                f"{amount_of(count, 'sample')} flagged unreliable: a peak drift changes by more than "
                f"{LARGEST_CHANGE:.0%} if the step is halved, with the motion unchanged or multiplied by 1.001. Use "
                "shares and medians of many samples, not single samples."
            )
    if "sensitive" in run:
        count = int(np.count_nonzero(run["sensitive"].values == 1))
        if count:
            found.append(
                f"{amount_of(count, 'sample')} flagged sensitive: increasing the motion by 0.1 % changes their peaks "
                "by more than the target error, so no step can guarantee these results. Use shares and medians of many "
                "samples."
            )
    if "estimated_relative_error" not in run and "estimated_relative_error_of_sample" not in run:
        found.append("No sample was run again with a finer step: checked_share= estimates the error of the step.")
    steps = run["integration_step"].values[status == OK] if "step" in run.attrs else np.array([])
    shorter = int(np.count_nonzero(steps < 0.999 * float(np.min(run.attrs.get("step", 0)))))
    if shorter:
        found.append(f"{amount_of(shorter, 'sample')} needed shorter steps than the others to remain stable.")
    return found + _fit_remarks(run)


def _fit_remarks(run: xr.Dataset) -> list[str]:
    """Return a sentence for each damage state whose fragility curve is not a regular fit (penalised, or missing)."""
    if "fit_status" not in run or run["fit_status"].dims != ("damage_state",):
        return []
    meanings = str(run["fit_status"].attrs.get("flag_meanings", "")).split()
    found = zip(run["damage_state"].values, run["fit_status"].values, strict=True)
    outcomes = {str(state): meanings[int(code)] for state, code in found if 0 <= int(code) < len(meanings)}
    return [
        f"The fragility curve of {state!r} is not a regular fit: {meaning.replace('_', ' ')}."
        for state, meaning in outcomes.items()
        if meaning != "fitted"
    ]
