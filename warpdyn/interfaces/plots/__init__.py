"""Figures of buildings, ground motions and results.

Each function returns a new figure. If axes are given as `ax`, it draws into them and returns them instead. A notebook
shows the figure if the call is the last line of a cell.
"""

from warpdyn.interfaces.plots.analyses.record_selection import record_selection
from warpdyn.interfaces.plots.analyses.sensitivity import sensitivity
from warpdyn.interfaces.plots.analyses.state_dependent import state_dependent_fragility
from warpdyn.interfaces.plots.analyses.surface import fragility_surface
from warpdyn.interfaces.plots.animation.sway import animate
from warpdyn.interfaces.plots.buildings import building, pushover_curve
from warpdyn.interfaces.plots.clouds import cloud_regression
from warpdyn.interfaces.plots.drifts import (
    drift_against_intensity,
    drift_distributions,
    drift_over_height,
    residual_drifts,
)
from warpdyn.interfaces.plots.fragility import fragility_comparison, fragility_curves
from warpdyn.interfaces.plots.frames import frame
from warpdyn.interfaces.plots.ground_motions import ground_motions, spectra
from warpdyn.interfaces.plots.histories import histories, hysteresis
from warpdyn.interfaces.plots.incremental import capacities, ida_curves
from warpdyn.interfaces.plots.maps import damage_map
from warpdyn.interfaces.plots.risk import disaggregation, hazard_and_rates, loss_exceedance, vulnerability

__all__ = [
    "animate",
    "building",
    "capacities",
    "cloud_regression",
    "damage_map",
    "disaggregation",
    "drift_against_intensity",
    "drift_distributions",
    "drift_over_height",
    "fragility_comparison",
    "fragility_curves",
    "fragility_surface",
    "frame",
    "ground_motions",
    "hazard_and_rates",
    "histories",
    "hysteresis",
    "ida_curves",
    "loss_exceedance",
    "pushover_curve",
    "record_selection",
    "residual_drifts",
    "sensitivity",
    "spectra",
    "state_dependent_fragility",
    "vulnerability",
]
