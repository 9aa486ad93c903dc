"""Names and units of intensity measures in warpdyn and in OpenQuake."""

from __future__ import annotations

import xarray as xr

from warpdyn.answers.risk.hazard.measures import measure_named, same_measure
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.output_variables import UNNAMED
from warpdyn.foundations.core.units import STANDARD_GRAVITY

# OpenQuake's units (openquake.hazardlib.imt) of the measures that warpdyn has, too.
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
# warpdyn's names of measures, if they differ from OpenQuake's.
OWN_NAMES = {"IA": "Arias intensity", "RSD595": "D5-95", "RSD575": "D5-75", "RSD2080": "D20-80"}
# Factors from the unit of a dataset to OpenQuake's unit.
FACTORS = {
    ("g", "g"): 1.0,
    ("m s-2", "g"): 1 / STANDARD_GRAVITY,
    ("m s-1", "cm s-1"): 100.0,
    ("m", "cm"): 100.0,
    ("m s-1", "m s-1"): 1.0,
    ("m s-1", "g s"): 1 / STANDARD_GRAVITY,
    ("s", "s"): 1.0,
}
# Units of datasets that are read from files, by OpenQuake's units.
READ_UNITS = {"g": "g", "cm s-1": "m s-1", "cm": "m", "m s-1": "m s-1", "g s": "m s-1", "s": "s"}

DAMPING = 5.0  # %, of OpenQuake's spectral accelerations
# Combinations of two components that OpenQuake's ground-motion models usually predict.
COMPONENTS = ("", "geometric mean", "RotD50")
_ALLOWED = f"{', '.join(sorted(UNITS.keys() - {'SA'}))} and SA(period in s), such as 'SA(0.3)'"


def openquake_measure(text: str) -> str:
    """Return OpenQuake's name of an intensity measure, such as "SA(0.3)" for "Sa(0.3 s, 5 %)".

    SA is also the name for the geometric mean and RotD50 of two components; the ground-motion model in OpenQuake
    defines which of them it predicts. SA and AvgSA have a damping ratio of 5 %.

    Args:
        text: warpdyn's name, as in the attribute `intensity_measure` of a dataset, or OpenQuake's name.

    Raises:
        ValueError: If OpenQuake does not have the measure.
    """
    if not isinstance(text, str):
        raise ValueError(f"measure must be a name, such as 'SA(0.3)', got {text!r}")
    found = measure_named(text)
    if found is None or found.components not in COMPONENTS:
        raise ValueError(f"OpenQuake has no intensity measure {text!r}; measure= may be {_ALLOWED}")
    name = f"SA({found.period})" if found.kind == "SA" else found.kind
    if found.damping not in (0, DAMPING):
        raise ValueError(
            f"{text!r} has a damping ratio of {found.damping:g} %, but OpenQuake's spectral accelerations have "
            f"{DAMPING:g} %; if the intensities are for {DAMPING:g} %, give measure={name!r}"
        )
    return name


def openquake_units(measure: str) -> str:
    """Return OpenQuake's unit of a measure as a UDUNITS string."""
    return UNITS[measure.partition("(")[0]]


def own_name(measure: str) -> str:
    """Return warpdyn's name of a measure of OpenQuake; unknown names are returned unchanged."""
    found = measure_named(measure)
    if found and found.kind == "SA":
        return f"Sa({found.period:.4g} s, {found.damping:g} %)"
    return OWN_NAMES.get(measure, measure)


def measure_of(what: str, dataset: xr.Dataset, given: str | None) -> str:
    """Return OpenQuake's name of the measure of a dataset, or of the user's `measure`.

    Args:
        what: Name of the dataset in errors.
        dataset: The dataset, with the attribute `intensity_measure`.
        given: The user's `measure`; None: the measure of the dataset. A warning is given if they differ.

    Raises:
        ValueError: If OpenQuake does not have the measure.
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
        warn_caller(f"{what}: the intensities are {own!r} but are written as {name}: check measure=")
    return name


def to_openquake(what: str, units: object, measure: str) -> float:
    """Return the factor from the unit of an intensity in a dataset to OpenQuake's unit.

    Args:
        what: Name of the dataset in errors.
        units: The attribute `units` of the intensity.
        measure: OpenQuake's name of the measure.

    Raises:
        ValueError: If the measure cannot have this unit.
    """
    theirs = openquake_units(measure)
    if (units, theirs) not in FACTORS:
        allowed = " or ".join(repr(ours) for ours, other in FACTORS if other == theirs)
        raise ValueError(f"{what}: the intensity is in {units!r}, but {measure} must be in {allowed}")
    return FACTORS[units, theirs]  # type: ignore[index] # the check above


def from_openquake(path: object, measure: str) -> tuple[str, float]:
    """Return warpdyn's unit of a measure in a file of OpenQuake, and the factor to this unit.

    Values of an unknown measure are read unchanged, with a warning.
    """
    name = measure.partition("(")[0]
    if name not in UNITS:
        warn_caller(
            f"{path}: warpdyn does not know the intensity measure {measure!r}; its values are read without conversion"
        )
        return "1", 1.0
    ours = READ_UNITS[UNITS[name]]
    return ours, 1 / FACTORS[ours, UNITS[name]]
