"""Names and units of intensity measures in warpdyn and in OpenQuake."""

from __future__ import annotations

import xarray as xr

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.output_variables import UNNAMED
from warpdyn.model.ground_motions.measures.measure import OPENQUAKE_UNITS, IntensityMeasure
from warpdyn.model.ground_motions.measures.names import measure_named, same_measure

DAMPING = 5.0  # % of OpenQuake's spectral accelerations
# Combinations of two components; OpenQuake's name of a measure does not contain the combination.
COMPONENTS = ("", "geometric mean", "RotD50")
_ALLOWED = f"{', '.join(sorted(OPENQUAKE_UNITS.keys() - {'SA'}))} and SA(period in s), such as 'SA(0.3)'"


def openquake_measure(text: str) -> str:
    """Return OpenQuake's name of an intensity measure, such as "SA(0.3)" for "Sa(0.3 s, 5 %)".

    SA is also the name for the geometric mean and RotD50 of two components; the ground-motion model in OpenQuake
    defines which of them it predicts. SA and AvgSA have a damping ratio of 5 %.

    Args:
        text: warpdyn's name, as in the attribute `intensity_measure` of a dataset, or OpenQuake's name.

    Raises:
        ValueError: If OpenQuake does not have the measure.
    """
    return _openquake(text)[0]


def _openquake(text: str) -> tuple[str, IntensityMeasure]:
    """Return OpenQuake's name of a measure, and the measure."""
    if not isinstance(text, str):
        raise ValueError(f"measure must be a name, such as 'SA(0.3)', got {text!r}")
    found = measure_named(text)
    if found is None or not found.kind or found.components not in COMPONENTS:
        raise ValueError(f"OpenQuake has no intensity measure {text!r}; give measure= as one of {_ALLOWED}")
    name = f"SA({found.parameters[1]})" if found.kind == "SA" else found.kind
    if found.parameters and found.parameters[0] != DAMPING:
        raise ValueError(
            f"{text!r} has a damping ratio of {found.parameters[0]:g} %, but OpenQuake's spectral accelerations have "
            f"{DAMPING:g} %; if the intensities are for {DAMPING:g} %, give measure={name!r}"
        )
    return name, found


def own_name(measure: str) -> str:
    """Return warpdyn's name of one of OpenQuake's measures; names that warpdyn lacks are returned unchanged."""
    found = measure_named(measure)
    return found.name if found else measure


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
        ValueError: If the measure cannot be in this unit.
    """
    _, found = _openquake(measure)
    try:
        return found.unit_size(units) / OPENQUAKE_UNITS[found.kind][1]
    except ValueError as error:
        raise ValueError(f"{what}: {error}") from None


def from_openquake(path: object, measure: str) -> tuple[str, float]:
    """Return the unit in which an intensity is read, and the factor to it from OpenQuake's unit.

    The intensities of an unknown measure are read unchanged, with a warning.
    """
    found = measure_named(measure)
    if found is None or not found.kind:
        warn_caller(
            f"{path}: warpdyn does not know the intensity measure {measure!r}; its values are read without conversion. "
            "Check that they are in the unit of your levels or hazard curves, or correct its name, such as 'SA(1.0)'"
        )
        return "1", 1.0
    return found.from_openquake()
