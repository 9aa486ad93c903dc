"""Components of a record: labels of directions, names of files, and pairs of horizontal components."""

from warpdyn.ground_motions.records.components.file_names import record_and_component
from warpdyn.ground_motions.records.components.orientations import (
    Orientation,
    azimuth_label,
    is_vertical,
    orientation,
)
from warpdyn.ground_motions.records.components.pairing import COMPONENTS, pairs

__all__ = [
    "COMPONENTS",
    "Orientation",
    "azimuth_label",
    "is_vertical",
    "orientation",
    "pairs",
    "record_and_component",
]
