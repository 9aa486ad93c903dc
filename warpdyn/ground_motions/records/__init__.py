"""Readers of recorded ground motions: files of several formats, arrays, datasets and the FEMA P-695 package."""

from warpdyn.ground_motions.records.arrays import from_array, from_dataset
from warpdyn.ground_motions.records.at2 import read_at2
from warpdyn.ground_motions.records.columns import read_text
from warpdyn.ground_motions.records.components import pairs
from warpdyn.ground_motions.records.directories import read_directory
from warpdyn.ground_motions.records.far_field import far_field
from warpdyn.ground_motions.records.units import UNITS

__all__ = ["UNITS", "far_field", "from_array", "from_dataset", "pairs", "read_at2", "read_directory", "read_text"]
