"""Recorded ground motions: readers of files, pairs of components, and usual processing (detrending, filter, trim)."""

from warpdyn.model.ground_motions.records.arrays import from_array, from_dataset
from warpdyn.model.ground_motions.records.at2 import read_at2
from warpdyn.model.ground_motions.records.columns import read_text
from warpdyn.model.ground_motions.records.components.pairing import pairs
from warpdyn.model.ground_motions.records.cosmos import read_cosmos
from warpdyn.model.ground_motions.records.directories import read_directory
from warpdyn.model.ground_motions.records.esm import read_esm
from warpdyn.model.ground_motions.records.fema_p695 import far_field, near_field
from warpdyn.model.ground_motions.records.formats.reading import read
from warpdyn.model.ground_motions.records.obspy_streams import from_obspy
from warpdyn.model.ground_motions.records.processing import band_pass, detrend, trim
from warpdyn.model.ground_motions.records.units import UNITS

__all__ = [
    "UNITS",
    "band_pass",
    "detrend",
    "far_field",
    "from_array",
    "from_dataset",
    "from_obspy",
    "near_field",
    "pairs",
    "read",
    "read_at2",
    "read_cosmos",
    "read_directory",
    "read_esm",
    "read_text",
    "trim",
]
