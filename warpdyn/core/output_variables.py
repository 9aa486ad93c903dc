"""Variables of a dataset and their labels, and what a sample's status can be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

# Value of the attribute `design` of im_level for stripes; other designs have another value.
STRIPED = "stripes"

# Values of the status variable, with their flag_meanings.
STATUS_MEANINGS = ("ok", "collapsed", "diverged", "unstable_step", "not_converged")
# A drift beyond this many storey heights is a numerical blow-up that has not become infinite yet, not a collapse.
LARGEST_DRIFT_RATIO = 1e3
LARGEST_EXCLUDED_FRACTION = 0.01  # of samples or pairs that failed; with more of them statistics are refused
OK, COLLAPSED, DIVERGED, UNSTABLE_STEP, NOT_CONVERGED = range(5)


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


_OF_SCALED_MOTION = " of the scaled motion"


def label_of_levels(measure: str) -> str:
    """Return the `long_name` of `im_level`, of which `measure_of_levels` reads the measure."""
    return f"{measure}{_OF_SCALED_MOTION}"


def measure_of_levels(attributes: Mapping[str, object]) -> str:
    """Return the name of the intensity measure that the attributes of `im_level` say.

    Args:
        attributes: The attributes, with the `long_name`.
    """
    return str(attributes.get("long_name", "intensity measure")).removesuffix(_OF_SCALED_MOTION)
