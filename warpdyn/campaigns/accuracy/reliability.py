"""Flag `unreliable`: sensitive samples are run again at half the step, also with a slightly scaled motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpdyn.campaigns.accuracy.precision import rerun_in_float64
from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.model import Model
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.integration.stability_guard import LARGEST_CHANGE
from warpdyn.foundations.core.output_variables import COLLAPSED, DIVERGED

UNRELIABLE = "unreliable"
NOT_CHECKED, NO, YES = -1, 0, 1
# Two check runs, as (factor on the number of steps, factor on the motion). The run with a scaled motion detects samples
# at a bifurcation, whose response to the scaled motion differs. In a test with 20,160 samples of
# `tests/random_scenes.py`, 44 samples had errors above 5 %: 43 of them changed by more than 2 % and were flagged; the
# other one, with an error of 40 %, changed by 1.3 %. In total, 1.7 % of all samples were flagged.
OTHER_RUNS = ((2, 1.001), (2, 1.0))
# Changes are divided by the storey's peak, or by this share of the sample's largest peak if that is larger.
LEAST_SHARE_OF_LARGEST = 0.1
# A sample counts as linear if its drifts are below this share of the yield drift and of the clearance. The share is
# below a third, because trilinear storeys crack at a third of their yield force or more.
LINEAR_UNTIL = 0.3
# If the steps times storeys of a run are at most CHECKED_STEPS (a few seconds), all sensitive samples are checked. In a
# larger run only a share of them is checked, and the others are flagged as not checked.
CHECKED_STEPS, LEAST_CHECKED_SHARE = 1e8, 1 / 16
GOLDEN = 0x9E3779B97F4A7C15  # 2^64 divided by the golden ratio: its multiples are spread evenly over 64 bits
ATTRIBUTES: dict[str, object] = {
    "long_name": "whether the sample's peak drifts are unreliable",
    "units": "1",
    "flag_values": np.array([NOT_CHECKED, NO, YES], dtype=np.int8),
    "flag_meanings": "not_checked no yes",
    "comment": "yes: at half the step, with the motion unchanged or times 1.001, a peak drift changes by more than "
    f"{100 * LARGEST_CHANGE:g} %; no: it does not, or structures of this kind are not sensitive to the step. An event "
    "that begins from the final state of an unreliable or unchecked sample has its flag",
}


def is_checked(model: Model) -> bool:
    """Return whether samples of a model must be checked, because a small change may change their peak drifts a lot."""
    return model.dynamics.is_sensitive


def checked_share(run: Run, event: int) -> float:
    """Return the share [1] of sensitive samples that are checked in an event; it depends only on the whole run."""
    timeline = run.model.timeline
    steps = float(np.mean(timeline.intervals * timeline.substeps)) * run.model.plan.dofs * run.samples_by_event[event]
    return max(LEAST_CHECKED_SHARE, min(1.0, CHECKED_STEPS / max(steps, 1.0)))


def sensitive_samples(run: Ensemble, samples: np.ndarray, outputs: Arrays) -> np.ndarray:
    """Return which samples may have left their linear range and did not fail, shape [sample].

    If peaks are recorded only from a later time on, these are all samples that did not fail, because earlier peaks are
    unknown. Arguments: see `reliability`.
    """
    rows, of_sample = np.unique(run.row[samples], return_inverse=True)
    parameters = run.model.dynamics.parameters_of(run.drawn, rows)
    limits = []
    for name in ("yield_force", "yield_force_negative"):
        if name in parameters:
            limits.append(parameters[name] / parameters["stiffness"])
    if "clearance" in parameters:
        limits.append(parameters["clearance"])
    linear = outputs["status"] == 0
    if limits and run.scene.record_from == 0:
        least = LINEAR_UNTIL * np.fmin.reduce(limits)[of_sample].T
        linear &= ~(outputs[run.model.dynamics.peak[0]] > least).any(axis=0)
    else:
        linear[:] = False
    return ~linear & (outputs["status"] < DIVERGED)


def reliability(
    run: Ensemble, samples: np.ndarray, outputs: Arrays, share: float, sensitive: np.ndarray | None = None
) -> np.ndarray:
    """Return the flag `unreliable` of samples, shape [sample]: YES, NO or NOT_CHECKED.

    Args:
        run: Ensemble that contains the samples.
        samples: Indices of the samples in the ensemble.
        outputs: Outputs of the samples by name; the last dimension is the sample.
        share: Share of the sensitive samples that are checked [1].
        sensitive: Result of `sensitive_samples` for these samples; None: this function computes it.
    """
    flags = np.where(outputs["status"] < DIVERGED, NO, NOT_CHECKED).astype(np.int8)
    if not is_checked(run.model):
        return flags
    sensitive = sensitive_samples(run, samples, outputs) if sensitive is None else sensitive
    number = run.sample[samples].astype(np.uint64) * np.uint64(GOLDEN)
    is_chosen = (number >> np.uint64(11)) < share * 2.0**53
    flags[sensitive & ~is_chosen] = NOT_CHECKED
    chosen = np.flatnonzero(sensitive & is_chosen)
    if not chosen.size:
        return flags
    part = run.select(samples[chosen])  # select once, because the host may have to prepare these samples
    for finer, factor in OTHER_RUNS:
        again = _run_again(part, finer, factor)
        is_far = _largest_change(run.model.dynamics.peak[0], outputs, chosen, again) > LARGEST_CHANGE
        flags[chosen[is_far]] = YES
        chosen = chosen[~is_far]
        if not chosen.size:
            break
        part = part.select(np.flatnonzero(~is_far))
    return flags


def with_earlier(flags: np.ndarray, earlier: np.ndarray) -> np.ndarray:
    """Return the flags of an event's samples: a sample is not more reliable than the state from which it begins.

    Args:
        flags: Flags `unreliable` computed from the event alone, shape [sample].
        earlier: Flags of the same samples in the previous event, shape [sample].
    """
    found = np.where((flags == NO) & (earlier == NOT_CHECKED), NOT_CHECKED, flags)
    return np.where((flags != NOT_CHECKED) & (earlier == YES), YES, found).astype(np.int8)


def _run_again(run: Ensemble, finer: int, factor: float) -> Arrays:
    """Return the outputs of all samples, integrated with `finer` times the steps and a motion scaled by `factor`.

    Returns the outputs by name; the last dimension is the sample.
    """
    everything = np.arange(run.size)
    part = run.select(everything)
    part.assignment = replace(part.assignment, scale=part.assignment.scale * factor)
    part.schedule = part.restepped(everything, finer * part.schedule.substeps)
    # A sample that fails in this run counts as unreliable. It is not run again at a shorter step, because the limit on
    # reruns would depend on the block.
    outputs = part.integrate(everything)
    rerun_in_float64(part, everything, outputs)
    return outputs


def _largest_change(name: str, outputs: Arrays, chosen: np.ndarray, again: Arrays) -> np.ndarray:
    """Return the largest relative change of a peak [1], shape [sample]; infinite if a rerun failed.

    Args:
        name: Name of the peak, such as "peak_storey_drift".
        outputs: Outputs of all samples by name; the last dimension is the sample.
        chosen: Indices of the samples that were run again.
        again: Outputs of the chosen samples in the second run.
    """
    peak, other = (np.abs(each.astype(np.float64)) for each in (outputs[name][:, chosen], again[name]))
    largest = peak.max(axis=0)
    # The peaks of a collapsed sample end when one storey exceeds its limit, so the peaks of its other storeys depend on
    # the time of collapse: compare their changes with the largest peak.
    both_collapse = (outputs["status"][chosen] == COLLAPSED) & (again["status"] == COLLAPSED)
    scale = np.where(both_collapse, largest, np.maximum(peak, LEAST_SHARE_OF_LARGEST * largest))
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.where(peak == other, 0.0, np.abs(other - peak) / scale).max(axis=0)
    return np.where((again["status"] >= DIVERGED) | np.isnan(change), np.inf, change)
