"""Warnings of measurements in other units: implausible drifts and durations, or peaks far from the computed ones."""

from __future__ import annotations

import numpy as np

from warpdyn.campaigns.inference.loops import LoopMisfit
from warpdyn.campaigns.inference.measured import MeasuredLoop, MeasuredResponse
from warpdyn.campaigns.inference.priors import Prior
from warpdyn.campaigns.inference.responses import ResponseMisfit
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.model.scene.scene import Scene


def warn_of_implausible_measurement(
    measured: MeasuredLoop | MeasuredResponse,
    scene: Scene | None,
    prior: Prior | None,
    misfit: LoopMisfit | ResponseMisfit | None,
) -> None:
    """Give one warning of an implausible drift or duration, or of a peak far from that of the median candidate.

    Args:
        measured: The measurement.
        scene: The scene of a MeasuredResponse.
        prior: Prior of the parameters; None: no parameter is unknown, and peaks are not compared.
        misfit: Misfit of candidates.
    """
    findings = PlausibilityFindings()
    values = measured.force if isinstance(measured, MeasuredLoop) else measured.values
    if isinstance(measured, MeasuredLoop):
        findings.add("measured_drift", float(np.abs(measured.drift).max()))
        quantity = "measured_force"
    else:
        quantity = f"measured_{measured.quantity}"
        motions = [] if scene is None else getattr(scene.excitation, "motions", [])
        if len(motions):
            lasting, of_motion = (len(values) - 1) * measured.step, float(motions[0].duration)
            where = f" (the measurement lasts {lasting:.4g} s, the motion {of_motion:.4g} s)"
            findings.add("measured_duration", lasting / of_motion, where)
    if prior is not None and misfit is not None:
        middle = prior.values(np.zeros((1, prior.variables)))
        if prior.allowed(middle)[0]:
            computed = float(misfit(middle)[2][0])
            peak = float(np.abs(values[measured.first :]).max())
            if np.isfinite(computed) and computed > 0 and peak > 0:
                findings.add(quantity, peak / computed)
    findings.warn()
