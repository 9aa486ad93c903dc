"""Ensembles of structural dynamics, integrated in parallel on GPUs and CPUs."""

from warpdyn.accuracy.pilot import Choice, plan
from warpdyn.core.netcdf import write
from warpdyn.ground_motions.designs import Cloud, Individual, Stripes
from warpdyn.ground_motions.event_sequences import Sequence
from warpdyn.ground_motions.filtered_noise import (
    CloughPenzien,
    FilteredNoise,
    JenningsEnvelope,
    KanaiTajimi,
    WhiteNoise,
)
from warpdyn.ground_motions.intensity_measures import (
    AriasIntensity,
    AverageSpectralAcceleration,
    CumulativeAbsoluteVelocity,
    PeakGroundAcceleration,
    PeakGroundDisplacement,
    PeakGroundVelocity,
    SignificantDuration,
    SpectralAcceleration,
    intensity_measures,
)
from warpdyn.ground_motions.motions import ForceHistory, FreeVibration, GroundMotion, HarmonicForce
from warpdyn.ground_motions.response_spectra import response_spectra
from warpdyn.portfolio.portfolio import Archetype, Portfolio
from warpdyn.portfolio.simulate_portfolio import simulate_portfolio
from warpdyn.running.histories import Histories
from warpdyn.running.labels import summary
from warpdyn.running.pushover import pushover, storey_hysteresis
from warpdyn.running.selections import of_archetype, of_event, of_storeys
from warpdyn.running.simulate import simulate
from warpdyn.scene.scatter import Factor, Listed, Lognormal, Normal, Uniform, Value
from warpdyn.scene.scene import Scene
from warpdyn.statistics.damage_shares import damage_shares
from warpdyn.statistics.fragility_curves import fragility
from warpdyn.structures.hazus import hazus_drift_limits
from warpdyn.structures.modal import modal_table
from warpdyn.structures.shear_building import LinearSystem, ShearBuilding

__all__ = [
    "Archetype",
    "AriasIntensity",
    "AverageSpectralAcceleration",
    "Choice",
    "Cloud",
    "CloughPenzien",
    "CumulativeAbsoluteVelocity",
    "Factor",
    "FilteredNoise",
    "ForceHistory",
    "FreeVibration",
    "GroundMotion",
    "HarmonicForce",
    "Histories",
    "Individual",
    "JenningsEnvelope",
    "KanaiTajimi",
    "LinearSystem",
    "Listed",
    "Lognormal",
    "Normal",
    "PeakGroundAcceleration",
    "PeakGroundDisplacement",
    "PeakGroundVelocity",
    "Portfolio",
    "Scene",
    "Sequence",
    "ShearBuilding",
    "SignificantDuration",
    "SpectralAcceleration",
    "Stripes",
    "Uniform",
    "Value",
    "WhiteNoise",
    "damage_shares",
    "fragility",
    "hazus_drift_limits",
    "intensity_measures",
    "modal_table",
    "of_archetype",
    "of_event",
    "of_storeys",
    "plan",
    "pushover",
    "response_spectra",
    "simulate",
    "simulate_portfolio",
    "storey_hysteresis",
    "summary",
    "write",
]
