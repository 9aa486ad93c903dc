"""Error of each sample due to its step, and whether it is sensitive to small changes of the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpdyn.campaigns.accuracy.error_estimate import compare, relative_errors
from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.stability_guard import Reruns, integrate_guarded
from warpdyn.foundations.core.output_variables import DIVERGED

SCALED_BY = 1.001  # factor on the motion in the run that detects sensitive samples
UNKNOWN = -1  # flag of a failed sample
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
    """Write the estimated error and the flag `sensitive` of every sample.

    Return the number of samples with an error above `asked`, and the number of sensitive samples.

    Args:
        run: The samples.
        outputs: Outputs of the samples; the last dimension is the sample.
        rows: Arrays of the dataset to fill, with one row per sample.
        asked: Relative error asked for.
        reruns: Reruns of earlier samples, with half the step and with a scaled motion.
    """
    rows[ERROR][:], rows[SENSITIVE][:] = np.nan, UNKNOWN
    own = np.flatnonzero(outputs["status"] < DIVERGED)
    if not own.size:
        return 0, 0
    part = run.select(own)
    found = {name: values[..., own] for name, values in outputs.items()}
    everything = np.arange(own.size)
    # A sample that fails with half the step has an infinite error.
    error = _worst(relative_errors(part, found, everything, reruns[0]))
    scaled = run.select(own)
    scaled.assignment = replace(scaled.assignment, scale=scaled.assignment.scale * SCALED_BY)
    change = _worst(compare(scaled, found, integrate_guarded(scaled, everything, reruns[1]), everything))
    is_sensitive = change > asked + (SCALED_BY - 1)  # a linear response changes by SCALED_BY - 1
    rows[ERROR][own], rows[SENSITIVE][own] = error, is_sensitive
    return int(np.count_nonzero(error > asked)), int(np.count_nonzero(is_sensitive))


def _worst(errors: Arrays) -> np.ndarray:
    """Return the error of the peak drift if it is recorded, otherwise the largest error; infinite if a run failed."""
    chosen = next(([errors[name]] for name in PEAKS if name in errors), list(errors.values()))
    return np.max([np.where(np.isnan(each), np.inf, each) for each in chosen], axis=0)
