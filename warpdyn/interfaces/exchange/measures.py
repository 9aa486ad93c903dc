"""Conversion of intensity measures between warpdyn and OpenQuake: names and units."""

from __future__ import annotations

import xarray as xr

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.output_variables import UNNAMED
from warpdyn.model.ground_motions.measures.measure import OPENQUAKE_UNITS, IntensityMeasure
from warpdyn.model.ground_motions.measures.names import measure_named, same_measure

DAMPING = 5.0  # damping ratio of the spectral accelerations in OpenQuake [%]
# Combinations of two horizontal components. The name of a measure in OpenQuake does not contain the combination.
COMPONENTS = ("", "geometric mean", "RotD50")
_ALLOWED = f"{', '.join(sorted(OPENQUAKE_UNITS.keys() - {'SA'}))} and SA(period in s), such as 'SA(0.3)'"


def openquake_measure(text: str) -> str:
    """Return the name of an intensity measure in OpenQuake, such as "SA(0.3)" for "Sa(0.3 s, 5 %)".

    OpenQuake uses the name SA for one component, for the geometric mean and for RotD50 of two components. The
    ground-motion model that is chosen in OpenQuake defines which of them it predicts. SA and AvgSA have a damping ratio
    of 5 %.

    Args:
        text: Name of the measure in warpdyn, as in the attribute `intensity_measure` of a dataset, or in OpenQuake.

    Raises:
        ValueError: If OpenQuake does not support the measure.
    """
    return _openquake(text)[0]


def _openquake(text: str) -> tuple[str, IntensityMeasure]:
    """Return the name of an intensity measure in OpenQuake, and the measure as an object."""
    if not isinstance(text, str):
        raise ValueError(f"measure must be a name, got {text!r}: give measure='SA(0.3)' or 'PGA'")
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
    """Return the name in warpdyn of an intensity measure of OpenQuake; an unknown name is returned unchanged."""
    found = measure_named(measure)
    return found.name if found else measure


def measure_of(what: str, dataset: xr.Dataset, given: str | None) -> str:
    """Return the OpenQuake name of the intensity measure of a dataset, or of the argument `measure` of a user.

    Args:
        what: Text that names the dataset in error messages.
        dataset: The dataset, with the attribute `intensity_measure`.
        given: The argument `measure` of the user; None: the attribute of the dataset. If the two differ, a warning is
            issued.

    Raises:
        ValueError: If OpenQuake does not support the measure, or neither the user nor the dataset names one.
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
    """Return the factor that converts intensities of a dataset into the unit that OpenQuake uses for the measure.

    Args:
        what: Text that names the dataset in error messages.
        units: Unit of the intensities in the dataset: their attribute `units`.
        measure: Name of the intensity measure in OpenQuake.

    Raises:
        ValueError: If intensities of this measure cannot have this unit.
    """
    _, found = _openquake(measure)
    try:
        return found.unit_size(units) / OPENQUAKE_UNITS[found.kind][1]
    except ValueError as error:
        raise ValueError(f"{what}: {error}") from None


def from_openquake(path: object, measure: str) -> tuple[str, float]:
    """Return the unit in which warpdyn reads intensities of a measure, and the factor from the unit of OpenQuake to it.

    If warpdyn does not know the measure, the unit is "1", the factor is 1, and a warning is issued.
    """
    found = measure_named(measure)
    if found is None or not found.kind:
        warn_caller(
            f"{path}: warpdyn does not know the intensity measure {measure!r}; its values are read without conversion. "
            "Check that they are in the unit of your levels or hazard curves, or correct its name, such as 'SA(1.0)'"
        )
        return "1", 1.0
    return found.from_openquake()
