"""Definitions for datasets: variables, attributes of the intensity measure, and values of the status of a sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

# Values of the attribute `design` of im_level.
STRIPED = "stripes"
OF_SEQUENCE = "of a sequence: see select_event"  # `design` of the levels of a run with all events of a sequence

EARLIER_HISTORY = "earlier_history"  # coordinate of a run of one event of a sequence; the first event has none

# Values of the status variable, with their flag_meanings.
STATUS_MEANINGS = ("ok", "collapsed", "diverged", "unstable_step", "not_converged", "control_failed")
# A drift of more than LARGEST_DRIFT_RATIO storey heights is a numerical blow-up that is still finite, not a collapse.
LARGEST_DRIFT_RATIO = 1e3
LARGEST_EXCLUDED_FRACTION = 0.01  # of samples or pairs; if more of them failed, statistics raise an error
OK, COLLAPSED, DIVERGED, UNSTABLE_STEP, NOT_CONVERGED, CONTROL_FAILED = range(6)


# Values of the variable median_status of fragility curves: where a median lies relative to the levels of the run.
MEDIAN_STATUS, MEDIAN_MEANINGS = "median_status", ("within_levels", "extrapolated", "none")
WITHIN_LEVELS, EXTRAPOLATED, NO_MEDIAN = range(3)

# Kind of each storey (STOREY_KINDS), in runs with isolators or a tuned mass damper: a coordinate along `storey` or, in
# portfolios, along `archetype` and `storey`.
STOREY_KIND, KIND_OF_ARCHETYPES = "storey_kind", "storey_kind_of_archetype"
STOREY_KINDS = ("building", "isolators", "tuned_mass_damper")
KIND_ATTRIBUTES = {
    "long_name": "kind of the storey, and of the floor above it",
    "units": "1",
    "flag_values": np.arange(len(STOREY_KINDS), dtype=np.int8),
    "flag_meanings": " ".join(STOREY_KINDS),
}

# Groups of the degrees of freedom and springs of lumped structures: coordinates `dof_group` and `spring_group`. Places
# in no group are in BUILDING. Places in ADDED_GROUPS do not count in the largest demand of a building.
BUILDING = "building"
ADDED_GROUPS = ("equipment", "absorber", "soil", "contact")


# Names of attributes that describe the intensity measure. The coordinate of the intensities and the dataset have them.
# A `long_name` is only a label: warpdyn does not read it.
MEASURE = "intensity_measure"  # the name by which hazard curves and exchanged files compare measures
PERIOD = "intensity_measure_period"  # [s], a scalar
PERIODS = "intensity_measure_periods"  # [s], if the measure is an average over several periods
DAMPING = "intensity_measure_damping_ratio"  # [1]
KEYS = (MEASURE, PERIOD, PERIODS, DAMPING)
UNNAMED = ("", "intensity measure")  # names of datasets and hazards that do not name their measure
INTENSITIES = ("im_level", "stripe")  # coordinates with the level of each sample or stripe


@dataclass(frozen=True)
class Variable:
    """One variable of a dataset.

    Args:
        dims: Dimension of the variable after `sample`: (), ("storey",), ("floor",) or ("dof",).
        units: Units, a UDUNITS string.
        long_name: The variable in words.
        scale: Names of other variables. An error is divided by the largest value of this variable and those variables.
        is_demand: Whether the variable is an engineering demand, such as a peak drift; errors of demands are estimated.
        is_whole: Whether values are whole numbers.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    scale: tuple[str, ...] = ()
    is_demand: bool = True
    is_whole: bool = False


# The kernels record drifts [m]; the drift ratio is computed from them.
DRIFT_RATIO = Variable(("storey",), "1", "peak absolute storey drift ratio")


def label_of_levels(measure: str) -> str:
    """Return the text "... of the scaled motion": the `long_name` of the coordinate of intensity levels."""
    return f"{measure} of the scaled motion"


def measure_attributes(attributes: Mapping) -> dict[str, object]:
    """Return the entries of `attributes` that describe an intensity measure (its name, periods and damping ratio)."""
    return {key: attributes[key] for key in KEYS if key in attributes}


def measure_of_dataset(dataset: xr.Dataset) -> dict[str, object]:
    """Return the attributes that describe a dataset's intensity measure; an empty dictionary if it has none.

    Args:
        dataset: A run, its statistics, or a dataset computed from these. The attributes of its coordinate of
            intensities are read or, if they do not name a measure, the attributes of the dataset.
    """
    for name in INTENSITIES:
        if name in dataset.variables and dataset[name].attrs.get(MEASURE):
            return measure_attributes(dataset[name].attrs)
    return measure_attributes(dataset.attrs)


def measure_name(dataset: xr.Dataset) -> str:
    """Return the name of a dataset's intensity measure; "intensity measure" if the dataset does not name it."""
    return str(measure_of_dataset(dataset).get(MEASURE) or UNNAMED[1])
