"""Figures of buildings, motions and results."""

from warpdyn.plots.buildings import building, pushover_curve
from warpdyn.plots.ensembles import (
    drift_against_intensity,
    drift_over_height,
    fragility_curves,
    hysteresis,
    spectra,
)

__all__ = [
    "building",
    "drift_against_intensity",
    "drift_over_height",
    "fragility_curves",
    "hysteresis",
    "pushover_curve",
    "spectra",
]
