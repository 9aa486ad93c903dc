"""What became of a run's samples, and what a reader of its results must know."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.campaigns.integration.stability_guard import LARGEST_CHANGE, LARGEST_ENERGY_ERROR
from warpdyn.foundations.core.output_variables import COLLAPSED, LARGEST_EXCLUDED_FRACTION, OK, STATUS_MEANINGS
from warpdyn.interfaces.reports.markup import heading, paragraph, table
from warpdyn.interfaces.reports.summary import names_of_storeys

MEANT = {
    "ok": "the building stands when the run ends",
    "collapsed": "a storey drift passed its capacity, or gravity outweighs a storey; counts as exceeding every demand",
    "diverged": "the numbers grew without end; it has no demands",
    "unstable_step": "the step was too long for it; it has no demands",
    "not_converged": "no balance was found in a step; it has no demands",
}


def outcome(run: xr.Dataset) -> list[str]:
    """Return the section on the outcome of the samples of one event, with remarks.

    Args:
        run: What `simulate` returned, of one event, with the dimension `sample`.
    """
    status = decoded_status(run["status"])
    counts = np.bincount(status, minlength=len(STATUS_MEANINGS))
    rows = [
        (name, int(count), f"{count / status.size:.2%}", MEANT[name])
        for name, count in zip(STATUS_MEANINGS, counts, strict=True)
        if count or name == "ok"
    ]
    parts = [heading("Outcome"), table("Status of the samples", ("status", "samples", "share", "meaning"), rows)]
    if "storey_of_collapse" in run:
        storey = run["storey_of_collapse"].values[status == COLLAPSED]
        storeys, collapses = np.unique(storey[storey > 0], return_counts=True)
        if storeys.size:
            pairs = [(names_of_storeys(run, place), count) for place, count in zip(storeys, collapses, strict=True)]
            parts.append(table("Storey that collapsed first", ("storey", "samples"), pairs))
    told = [paragraph(text, is_remark=True) for text in remarks(run, status)]
    return [*parts, heading("Remarks", 3), *(told or [paragraph("None: every check of this page was passed.")])]


def remarks(run: xr.Dataset, status: np.ndarray) -> list[str]:
    """Return sentences on what limits the results of a run.

    Args:
        run: The run, of one event.
        status: Status of its samples, by STATUS_MEANINGS.
    """
    told = []
    failed = int(np.count_nonzero(status > COLLAPSED))
    if failed:
        most = "more" if failed > LARGEST_EXCLUDED_FRACTION * status.size else "no more"
        told.append(
            f"{failed:,} of {status.size:,} samples failed in the integration and have no demands: {most} than the "
            f"{LARGEST_EXCLUDED_FRACTION:.0%} beyond which fragility curves are refused."
        )
    if "energy_balance_error" in run:
        error = np.abs(run["energy_balance_error"].values[status <= COLLAPSED])
        off = int(np.count_nonzero(error > LARGEST_ENERGY_ERROR))
        if off:
            told.append(
                f"{off:,} samples have energies that do not balance within {LARGEST_ENERGY_ERROR:.0%} of what was "
                f"supplied (at worst {error.max():.2g}): their demands may be off, too."
            )
    if "unreliable" in run:
        count = int(np.count_nonzero(run["unreliable"].values == 1))
        if count:
            told.append(
                f"{count:,} samples are unreliable: at half the step, with the motion as it is or times 1.001, a peak "
                f"drift changes by more than {LARGEST_CHANGE:.0%}. Use shares and medians of many samples, not single "
                "ones."
            )
    if "sensitive" in run:
        count = int(np.count_nonzero(run["sensitive"].values == 1))
        if count:
            told.append(
                f"{count:,} samples are sensitive: a thousandth more of the motion changes their peaks more than was "
                "asked for, so that no step makes their answers sure."
            )
    if "estimated_relative_error" not in run and "estimated_relative_error_of_sample" not in run:
        told.append("No sample was run again at a finer step: checked_share= would have estimated what the step errs.")
    steps = run["integration_step"].values[status == OK] if "step" in run.attrs else np.array([])
    shorter = int(np.count_nonzero(steps < 0.999 * float(np.min(run.attrs.get("step", 0)))))
    if shorter:
        told.append(f"{shorter:,} samples took shorter steps than the others, which their stability asked for.")
    return told + _of_fits(run)


def _of_fits(run: xr.Dataset) -> list[str]:
    """Return sentences on damage states whose curves are not plain fits."""
    if "fit_status" not in run or run["fit_status"].dims != ("damage_state",):
        return []
    meanings = str(run["fit_status"].attrs.get("flag_meanings", "")).split()
    found = zip(run["damage_state"].values, run["fit_status"].values, strict=True)
    outcomes = {str(state): meanings[int(code)] for state, code in found if 0 <= int(code) < len(meanings)}
    return [
        f"The fragility curve of {state!r} is no plain fit: {meaning.replace('_', ' ')}."
        for state, meaning in outcomes.items()
        if meaning != "fitted"
    ]
