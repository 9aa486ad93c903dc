"""Samples that float32 cannot tell well enough: they are run again in float64."""

from __future__ import annotations

import numpy as np

from warpdyn.core.output_variables import DIVERGED
from warpdyn.integration.dynamics import Arrays
from warpdyn.integration.ensemble import Ensemble
from warpdyn.integration.model import COUNTING_TURNS
from warpdyn.kernels.plan import Plan

# A floor that has moved by so many yield drifts is rounded to parts of them that a storey above it moves by in a step:
# peak drifts were up to 13 % off there, and the more so the shorter the step; below, in one of some thousand samples.
MOST_YIELD_DRIFTS = 300.0


def may_need_float64(plan: Plan) -> bool:
    """Return whether float32 may not tell some samples well enough, which their peak drifts show."""
    return plan.dtype == "float32" and COUNTING_TURNS in plan.law


def beyond_float32(run: Ensemble, samples: np.ndarray, outputs: Arrays) -> np.ndarray:
    """Return which of some samples float32 cannot tell, from their peak drifts, shape [sample].

    Args:
        run: The run.
        samples: The samples.
        outputs: Their outputs, sample last.
    """
    if not may_need_float64(run.plan):
        return np.zeros(samples.size, dtype=bool)
    rows = np.unique(run.row[samples], return_inverse=True)
    parameters = run.model.dynamics.parameters_of(run.drawn, rows[0])
    least = np.nanmin(parameters["yield_force"] / parameters["stiffness"], axis=1)[rows[1]]
    far = outputs["peak_storey_drift"].astype(np.float64).sum(axis=0) > MOST_YIELD_DRIFTS * least
    return far & (outputs["status"] < DIVERGED)


def rerun_in_float64(run: Ensemble, samples: np.ndarray, outputs: Arrays) -> int:
    """Run those of some samples again that float32 cannot tell; return their number.

    What fails in float64 has failed: float32 cannot tell it, and so does not tell it better.

    Args:
        run: The run.
        samples: The samples.
        outputs: Their outputs, sample last, which are overwritten.
    """
    again = np.flatnonzero(beyond_float32(run, samples, outputs))
    if again.size:
        double = run.with_model(run.model.in_float64(run.tolerance, run.queue.device), run.schedule)
        double.state = run.state
        found = double.integrate(samples[again])
        for name, values in outputs.items():
            values[..., again] = found[name]
    return again.size
