"""Estimated error of each sample due to its step, and the flag `sensitive` for samples that small changes affect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpdyn.campaigns.accuracy.error_estimate import compare, relative_errors
from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.stability_guard import Reruns, integrate_guarded
from warpdyn.foundations.core.output_variables import DIVERGED

SCALED_BY = 1.001  # factor on the motion in the run that detects sensitive samples
UNKNOWN = -1  # value of the flag `sensitive` for a sample that failed
ERROR, SENSITIVE = "estimated_relative_error_of_sample", "sensitive"
ATTRIBUTES: dict[str, dict[str, object]] = {
    ERROR: {
        "long_name": "estimated relative error of the sample's peaks",
        "units": "1",
        "comment": "by half the step in float64, relative to the largest value over the sample's storeys; for the peak "
        "drift (of a LinearSystem: the peak displacement) if it is recorded, otherwise the largest of all demands",
    },
    SENSITIVE: {
        "long_name": "whether a motion scaled by 1.001 changes the peaks by more than the error asked for",
        "units": "1",
        "flag_values": np.array([UNKNOWN, 0, 1], dtype=np.int8),
        "flag_meanings": "unknown no yes",
    },
}
PEAKS = ("peak_storey_drift", "peak_spring_deformation", "peak_displacement")


def fill_sample_errors(
    run: Ensemble, outputs: Arrays, rows: Arrays, asked: float, reruns: tuple[Reruns, Reruns]
) -> tuple[int, int]:
    """Estimate the error of every sample by two more runs, flag sensitive samples, and write both to `rows`.

    Args:
        run: Ensemble of the samples.
        outputs: Outputs of the samples by name; the last dimension is the sample.
        rows: Arrays of the dataset's variables by name, shape [sample, ...].
        asked: Relative error [1] that no sample may exceed.
        reruns: Reruns of failed samples in the run at half the step, and in the run with a scaled motion.

    Returns:
        The number of samples with an error above `asked`, and the number of sensitive samples.
    """
    rows[ERROR][:], rows[SENSITIVE][:] = np.nan, UNKNOWN
    own = np.flatnonzero(outputs["status"] < DIVERGED)
    if not own.size:
        return 0, 0
    part = run.select(own)
    found = {name: values[..., own] for name, values in outputs.items()}
    everything = np.arange(own.size)
    # If a sample fails at half the step, its error counts as infinite.
    error = _worst(relative_errors(part, found, everything, reruns[0]))
    scaled = run.select(own)
    scaled.assignment = replace(scaled.assignment, scale=scaled.assignment.scale * SCALED_BY)
    change = _worst(compare(scaled, found, integrate_guarded(scaled, everything, reruns[1]), everything))
    is_sensitive = change > asked + (SCALED_BY - 1)  # a linear response changes by SCALED_BY - 1
    rows[ERROR][own], rows[SENSITIVE][own] = error, is_sensitive
    return int(np.count_nonzero(error > asked)), int(np.count_nonzero(is_sensitive))


def _worst(errors: Arrays) -> np.ndarray:
    """Return each sample's error of the peak drift, or of all demands if no peak drift is recorded; inf if failed.

    `errors` contains the relative errors [1] by demand, shape [sample]; NaN if one of the two runs failed.
    """
    chosen = next(([errors[name]] for name in PEAKS if name in errors), list(errors.values()))
    return np.max([np.where(np.isnan(each), np.inf, each) for each in chosen], axis=0)
