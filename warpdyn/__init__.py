"""Ensembles of structural dynamics, integrated in parallel on GPUs and CPUs."""

from warpdyn.damage import damage_shares
from warpdyn.designs import Cloud, Individual, Stripes
from warpdyn.filtered_noise import CloughPenzien, FilteredNoise, JenningsEnvelope, KanaiTajimi, WhiteNoise
from warpdyn.fragility import fragility
from warpdyn.hazus import hazus_drift_limits
from warpdyn.histories import Histories
from warpdyn.intensity import (
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
from warpdyn.modal import modal_table
from warpdyn.motions import ForceHistory, FreeVibration, GroundMotion, HarmonicForce
from warpdyn.plan import Choice, plan
from warpdyn.portfolio import Archetype, Portfolio
from warpdyn.pushover import pushover, storey_hysteresis
from warpdyn.response_spectra import response_spectra
from warpdyn.results import summary
from warpdyn.scatter import Factor, Listed, Lognormal, Normal, Uniform, Value
from warpdyn.scene import Scene
from warpdyn.selections import of_archetype, of_event, of_storeys
from warpdyn.sequences import Sequence
from warpdyn.simulate import simulate
from warpdyn.simulate_portfolio import simulate_portfolio
from warpdyn.store import write
from warpdyn.structures import LinearSystem, ShearBuilding

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
