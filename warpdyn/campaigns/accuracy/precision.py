"""Reruns in float64 of samples for which float32 is too inaccurate."""

from __future__ import annotations

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.model import Model
from warpdyn.foundations.core.output_variables import DIVERGED

# If a floor moves by more than this number of yield drifts, float32 is too inaccurate for laws that count reversals:
# after 100 yield drifts, float32 rounds the displacement (relative error 6e-8) by 6e-6 yield drifts, and this rounding
# alone may reverse the drift of the storey above. Measured errors of storeys were up to 200 % after 1,000 yield drifts,
# 17 % after 200, and 0.006 % after less than 100 (steps from 5 to 0.2 ms).
MOST_YIELD_DRIFTS = 100.0


def may_need_float64(model: Model) -> bool:
    """Return whether float32 may be too inaccurate for some samples: a float32 model whose law counts reversals."""
    return model.plan.dtype == "float32" and model.dynamics.counts_reversals


def beyond_float32(run: Ensemble, samples: np.ndarray, outputs: Arrays) -> np.ndarray:
    """Return for which samples float32 is too inaccurate, shape [sample].

    If peaks are recorded only from a later time on, or if a user's law has no yield force, all samples that did not
    fail count as too inaccurate, because the largest movement in yield drifts is unknown.

    Args:
        run: Ensemble that contains the samples.
        samples: Indices of the samples in the ensemble.
        outputs: Outputs of the samples by name; the last dimension is the sample.
    """
    if not may_need_float64(run.model):
        return np.zeros(samples.size, dtype=bool)
    ended = outputs["status"] < DIVERGED
    rows = np.unique(run.row[samples], return_inverse=True)
    parameters = run.model.dynamics.parameters_of(run.drawn, rows[0])
    if run.scene.record_from > 0 or "yield_force" not in parameters:
        return ended
    weaker = np.fmin(parameters["yield_force"], parameters.get("yield_force_negative", np.inf))
    least = np.nanmin(weaker / parameters["stiffness"], axis=1)[rows[1]]
    far = outputs[run.model.dynamics.peak[0]].astype(np.float64).sum(axis=0) > MOST_YIELD_DRIFTS * least
    return far & ended


def rerun_in_float64(run: Ensemble, samples: np.ndarray, outputs: Arrays) -> int:
    """Rerun in float64 those samples for which float32 is too inaccurate; return their number.

    The outputs of these samples are overwritten. A sample that fails in float64 counts as failed. Arguments: see
    `beyond_float32`.
    """
    again = np.flatnonzero(beyond_float32(run, samples, outputs))
    if again.size:
        part = run.select(samples[again])
        double = part.with_model(part.model.in_float64(part.tolerance, part.queue.device), part.schedule)
        double.state = part.state
        found = double.integrate(np.arange(again.size))
        for name, values in outputs.items():
            values[..., again] = found[name]
    return again.size
