"""Ensembles of structural dynamics, integrated in parallel on GPUs and CPUs."""

from warpdyn.designs import Cloud, Individual, Stripes
from warpdyn.filtered_noise import CloughPenzien, FilteredNoise, JenningsEnvelope, KanaiTajimi, WhiteNoise
from warpdyn.fragility import fragility
from warpdyn.intensity import PeakGroundAcceleration, SpectralAcceleration
from warpdyn.motions import ForceHistory, FreeVibration, GroundMotion, HarmonicForce
from warpdyn.plan import Choice, plan
from warpdyn.results import summary
from warpdyn.sample import Factor, Listed, Lognormal, Normal, Uniform, Value
from warpdyn.scene import Scene
from warpdyn.simulate import Histories, simulate
from warpdyn.store import write
from warpdyn.structures import LinearSystem, ShearBuilding

__all__ = [
    "Choice",
    "Cloud",
    "CloughPenzien",
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
    "Scene",
    "ShearBuilding",
    "SpectralAcceleration",
    "Stripes",
    "Uniform",
    "Value",
    "WhiteNoise",
    "fragility",
    "plan",
    "simulate",
    "summary",
    "write",
]
