"""Components of a record: labels of directions, names of files, and pairs of horizontal components."""

from warpdyn.model.ground_motions.records.components.file_names import (
    numbered_record,
    record_and_component,
    records_and_components,
)
from warpdyn.model.ground_motions.records.components.headers import (
    component_of_header,
    named_component,
    record_of_header,
)
from warpdyn.model.ground_motions.records.components.orientations import (
    Orientation,
    angle_between,
    azimuth_label,
    is_vertical,
    orientation,
)
from warpdyn.model.ground_motions.records.components.pairing import instrument_of, pairs
from warpdyn.model.ground_motions.records.components.selection import COMPONENTS, chosen_components, select_components

__all__ = [
    "COMPONENTS",
    "Orientation",
    "angle_between",
    "azimuth_label",
    "chosen_components",
    "component_of_header",
    "instrument_of",
    "is_vertical",
    "named_component",
    "numbered_record",
    "orientation",
    "pairs",
    "record_and_component",
    "record_of_header",
    "records_and_components",
    "select_components",
]
