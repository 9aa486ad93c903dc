"""Names and units of intensity measures: warpdyn's and OpenQuake's."""

from __future__ import annotations

import xarray as xr

from warpdyn.answers.risk.hazard.measures import measure_named, same_measure
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.output_variables import UNNAMED
from warpdyn.foundations.core.units import STANDARD_GRAVITY

# Units of OpenQuake's measures (openquake.hazardlib.imt) that warpdyn has too.
UNITS = {
    "PGA": "g",
    "PGV": "cm s-1",
    "PGD": "cm",
    "IA": "m s-1",
    "CAV": "g s",
    "RSD595": "s",
    "RSD575": "s",
    "RSD2080": "s",
    "SA": "g",
    "AvgSA": "g",
}
# warpdyn's names of those that it calls otherwise.
OWN_NAMES = {"IA": "Arias intensity", "RSD595": "D5-95", "RSD575": "D5-75", "RSD2080": "D20-80"}
# Factors from units of datasets to OpenQuake's.
FACTORS = {
    ("g", "g"): 1.0,
    ("m s-2", "g"): 1 / STANDARD_GRAVITY,
    ("m s-1", "cm s-1"): 100.0,
    ("m", "cm"): 100.0,
    ("m s-1", "m s-1"): 1.0,
    ("m s-1", "g s"): 1 / STANDARD_GRAVITY,
    ("s", "s"): 1.0,
}
# Units of datasets that are read, by OpenQuake's.
READ_UNITS = {"g": "g", "cm s-1": "m s-1", "cm": "m", "m s-1": "m s-1", "g s": "m s-1", "s": "s"}

DAMPING = 5.0  # % of OpenQuake's spectral accelerations
# Of two components; OpenQuake's ground-motion models say which combination they predict, and these are usual.
COMPONENTS = ("", "geometric mean", "RotD50")
_ALLOWED = f"{', '.join(sorted(UNITS.keys() - {'SA'}))} and SA(period in s), such as 'SA(0.3)'"


def openquake_measure(text: str) -> str:
    """Return OpenQuake's name of an intensity measure, such as "SA(0.3)" of "Sa(0.3 s, 5 %)".

    The geometric mean and RotD50 of both components are SA too, since OpenQuake's ground-motion models say which of
    them they predict. SA and AvgSA have a damping ratio of 5 %.

    Args:
        text: The name in a dataset's attribute `intensity_measure`, or OpenQuake's own.

    Raises:
        ValueError: If it is no measure that OpenQuake has.
    """
    if not isinstance(text, str):
        raise ValueError(f"measure must be text, such as 'SA(0.3)', got {text!r}")
    found = measure_named(text)
    if found is None or found.components not in COMPONENTS:
        raise ValueError(f"OpenQuake has no intensity measure {text!r}; allowed as measure= are {_ALLOWED}")
    if found.damping not in (0, DAMPING):
        raise ValueError(
            f"OpenQuake's spectral accelerations have a damping ratio of {DAMPING:g} %, and {text!r} has "
            f"{found.damping:g} %; name the measure that the hazard is in as measure='SA(...)'"
        )
    return f"SA({found.period})" if found.kind == "SA" else found.kind


def openquake_units(measure: str) -> str:
    """Return the UDUNITS string of the unit that OpenQuake has a measure in."""
    return UNITS[measure.partition("(")[0]]


def own_name(measure: str) -> str:
    """Return warpdyn's name of one of OpenQuake's measures; names that warpdyn lacks stay as they are."""
    found = measure_named(measure)
    if found and found.kind == "SA":
        return f"Sa({found.period:.4g} s, {found.damping:g} %)"
    return OWN_NAMES.get(measure, measure)


def measure_of(what: str, dataset: xr.Dataset, given: str | None) -> str:
    """Return OpenQuake's name of the measure of a dataset, or of what the user gave instead.

    Args:
        what: What the dataset is, in errors.
        dataset: The dataset, with the attribute `intensity_measure`.
        given: The user's `measure`; None to take that of the dataset. A warning tells where they are of two measures.

    Raises:
        ValueError: If neither names a measure that OpenQuake has.
    """
    own = dataset.attrs.get("intensity_measure")
    text = own if given is None else given
    if text is None:
        raise ValueError(f"{what}: the dataset has no attribute 'intensity_measure'; give measure=, such as 'SA(0.3)'")
    try:
        name = openquake_measure(text)
    except ValueError as error:
        raise ValueError(f"{what}: {error}") from None
    if given is not None and own is not None and own not in UNNAMED and same_measure(str(own), name) is not True:
        warn_caller(f"{what}: the intensities are of {own!r}, and are written as if they were of {name}")
    return name


def to_openquake(what: str, units: object, measure: str) -> float:
    """Return the factor from a dataset's unit of an intensity to OpenQuake's.

    Args:
        what: What the dataset is, in errors.
        units: The attribute `units` of the intensity.
        measure: OpenQuake's name of the measure.

    Raises:
        ValueError: If the unit is not one of the measure.
    """
    theirs = openquake_units(measure)
    if (units, theirs) not in FACTORS:
        allowed = " or ".join(repr(ours) for ours, other in FACTORS if other == theirs)
        raise ValueError(f"{what}: the intensity is in {units!r}, and {measure} must be in {allowed}")
    return FACTORS[units, theirs]  # type: ignore[index] # the check above


def from_openquake(path: object, measure: str) -> tuple[str, float]:
    """Return the unit that a measure of OpenQuake's is read in, and the factor to it.

    An unknown measure is read as it is, with a warning.
    """
    name = measure.partition("(")[0]
    if name not in UNITS:
        warn_caller(f"{path}: warpdyn does not know the intensity measure {measure!r}; its values are read as they are")
        return "1", 1.0
    ours = READ_UNITS[UNITS[name]]
    return ours, 1 / FACTORS[ours, UNITS[name]]
