"""Variables of a dataset and their labels, its intensity measure, and what a sample's status can be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

# Value of the attribute `design` of im_level for stripes; other designs have another value.
STRIPED = "stripes"
OF_SEQUENCE = "of a sequence: see select_event"  # design of the levels of all events together

# Values of the status variable, with their flag_meanings.
STATUS_MEANINGS = ("ok", "collapsed", "diverged", "unstable_step", "not_converged")
# A drift beyond this many storey heights is a numerical blow-up that has not become infinite yet, not a collapse.
LARGEST_DRIFT_RATIO = 1e3
LARGEST_EXCLUDED_FRACTION = 0.01  # of samples or pairs that failed; with more of them statistics are refused
OK, COLLAPSED, DIVERGED, UNSTABLE_STEP, NOT_CONVERGED = range(5)


# Values of the variable median_status of fragility curves: where a median lies among the intensities that were run.
MEDIAN_STATUS, MEDIAN_MEANINGS = "median_status", ("within_levels", "extrapolated", "none")
WITHIN_LEVELS, EXTRAPOLATED, NO_MEDIAN = range(3)

# The kind of each storey of a run that has isolators or a tuned mass damper, along `storey`; of a portfolio along
# `archetype` and `storey`.
STOREY_KIND, KIND_OF_ARCHETYPES = "storey_kind", "storey_kind_of_archetype"
STOREY_KINDS = ("building", "isolators", "tuned_mass_damper")
KIND_ATTRIBUTES = {
    "long_name": "kind of the storey, and of the floor above it",
    "units": "1",
    "flag_values": np.arange(len(STOREY_KINDS), dtype=np.int8),
    "flag_meanings": " ".join(STOREY_KINDS),
}


# How a dataset names its intensity measure: attributes of the coordinate of the intensities, beside its `units`, and of
# the dataset itself. A `long_name` is a label for people: nothing is read from it.
MEASURE = "intensity_measure"  # the name, as hazard curves and exchanged files compare it
PERIOD = "intensity_measure_period"  # [s], a scalar
PERIODS = "intensity_measure_periods"  # [s], of an average over several
DAMPING = "intensity_measure_damping_ratio"  # [1]
KEYS = (MEASURE, PERIOD, PERIODS, DAMPING)
UNNAMED = ("", "intensity measure")  # what datasets and hazards that name none say
INTENSITIES = ("im_level", "stripe")  # coordinates with a level of each sample or stripe


@dataclass(frozen=True)
class Variable:
    """One variable of a dataset.

    Args:
        dims: Its dimension beside `sample`: (), ("storey",), ("floor",) or ("dof",).
        units: UDUNITS string.
        long_name: In words.
        scale: Other variables of the dataset that its error is divided by where they are larger.
        is_demand: Whether it is a demand, whose error is estimated.
        is_whole: Whether it is a whole number.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    scale: tuple[str, ...] = ()
    is_demand: bool = True
    is_whole: bool = False


DRIFT_RATIO = Variable(("storey",), "1", "peak absolute storey drift ratio")  # of what the kernels record as drift


def label_of_levels(measure: str) -> str:
    """Return the `long_name` of the levels of a measure."""
    return f"{measure} of the scaled motion"


def measure_attributes(attributes: Mapping) -> dict[str, object]:
    """Return those of some attributes that name an intensity measure."""
    return {key: attributes[key] for key in KEYS if key in attributes}


def measure_of_dataset(dataset: xr.Dataset) -> dict[str, object]:
    """Return the attributes of a dataset that name its intensity measure; nothing if it names none.

    Args:
        dataset: A run, its statistics, or what was computed from them. The coordinate of the intensities decides; the
            attributes of the dataset itself are read if it has no such coordinate or that names no measure.
    """
    for name in INTENSITIES:
        if name in dataset.variables and dataset[name].attrs.get(MEASURE):
            return measure_attributes(dataset[name].attrs)
    return measure_attributes(dataset.attrs)


def measure_name(dataset: xr.Dataset) -> str:
    """Return the name of a dataset's intensity measure; "intensity measure" if it names none."""
    return str(measure_of_dataset(dataset).get(MEASURE) or UNNAMED[1])
