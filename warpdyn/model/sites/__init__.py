"""Ground motions at sites: grids of motions and intensities, and the motions of each building."""

from warpdyn.model.sites.event_grid import read_event_grid
from warpdyn.model.sites.ground_motion_fields import read_ground_motion_field
from warpdyn.model.sites.intensity_fields import scale_records
from warpdyn.model.sites.intensity_grid import read_intensity_grid
from warpdyn.model.sites.motion_grid import MotionGrid, label_samples
from warpdyn.model.sites.random_fields import correlated_fields, within_event_residuals
from warpdyn.model.sites.shakemaps import read_shakemap
from warpdyn.model.sites.spatial_correlations import EspositoIervolino2012, JayaramBaker2009, SpatialCorrelation

__all__ = [
    "EspositoIervolino2012",
    "JayaramBaker2009",
    "MotionGrid",
    "SpatialCorrelation",
    "correlated_fields",
    "label_samples",
    "read_event_grid",
    "read_ground_motion_field",
    "read_intensity_grid",
    "read_shakemap",
    "scale_records",
    "within_event_residuals",
]
