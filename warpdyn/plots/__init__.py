"""Figures of buildings, motions and results."""

from warpdyn.plots.buildings import building, pushover
from warpdyn.plots.ensembles import (
    drift_against_intensity,
    drift_over_height,
    fragility_curves,
    hysteresis,
    response_spectra,
)

__all__ = [
    "building",
    "drift_against_intensity",
    "drift_over_height",
    "fragility_curves",
    "hysteresis",
    "pushover",
    "response_spectra",
]
