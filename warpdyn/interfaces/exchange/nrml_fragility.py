"""Writer of fragility curves as fragility models of OpenQuake (NRML 0.5)."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.stats import norm

from warpdyn.answers.fragility.estimators import LOGNORMAL
from warpdyn.answers.risk.curves.curve_set import CurveSet, extrapolated
from warpdyn.answers.risk.integrals.intensity_limits import MINIMUM, NO_DAMAGE
from warpdyn.foundations.core.checks import finite_numbers, one_of, real_number
from warpdyn.interfaces.exchange import nrml
from warpdyn.interfaces.exchange.exceedance import CHECKED_POINTS, LEAST_CHECKED, check_exceedance, check_order
from warpdyn.interfaces.exchange.measures import measure_of, to_openquake
from warpdyn.interfaces.exchange.text_files import checked_path

FUNCTION = "write_nrml_fragility"
# By default, the minimum intensity in the file has an exceedance probability of 1e-6, and the maximum one of 0.999.
# Intensities below the minimum contribute almost nothing to an annual rate, even with a steep hazard curve. Above the
# maximum, OpenQuake keeps the probability constant.
LEAST_PROBABILITY, GREATEST_PROBABILITY = 1e-6, 0.999


def write_nrml_fragility(
    curves: Mapping[str, xr.Dataset],
    path: str | os.PathLike,
    *,
    format: str = "continuous",
    intensities: ArrayLike | None = None,
    measure: str | None = None,
    minimum_intensity: float | None = None,
    maximum_intensity: float | None = None,
    no_damage_limit: float | None = None,
    loss_type: str = "structural",
    description: str | None = None,
    overwrite: bool = False,
) -> Path:
    """Write fragility curves as a fragility model of OpenQuake (NRML 0.5).

    Continuous functions are lognormal. For a median m and a dispersion b, the file contains the arithmetic mean of the
    capacity, m exp(b^2 / 2), and its standard deviation, mean sqrt(exp(b^2) - 1). Discrete functions contain the
    probabilities of exceedance at given intensities. OpenQuake interpolates linearly between these intensities, uses
    the probability 0 below the first one, and the last probability above the last one.

    Curves that cross, decrease or exceed 1 raise an error, although OpenQuake accepts them. Two lognormal curves with
    different dispersions always cross at some intensity. An error is raised only if, between the minimum and the
    maximum intensity, the heavier state is more probable than the lighter one by more than 0.001. If discrete functions
    cross by less, the file contains the same probability for both.

    Args:
        curves: For each taxonomy, the result of `fragility`. All taxonomies need the same damage states, with the
            lightest first. Variables: `fragility_median(damage_state)` [g or SI] and
            `fragility_dispersion(damage_state)` [1]; to write the exceedance fractions of stripes (intensity levels),
            `exceedance_fraction(damage_state, stripe)` [1].
        path: Path of the file that is written; its name ends in ".xml".
        format: "continuous" (lognormal functions) or "discrete" (probabilities at intensities).
        intensities: Increasing intensities of discrete functions [unit of the curves]; the file contains the
            probabilities of the fitted curves at them. None: the levels of the stripes, with the fraction of samples
            that exceeded each state.
        measure: OpenQuake's name of the intensity measure, such as "SA(0.3)", "PGA" or "AvgSA". None: the measure of
            the curves; SA and AvgSA need a damping ratio of 5 %. Values are written in OpenQuake's unit (g, cm/s).
        minimum_intensity: Lowest intensity (minIML) of continuous functions [unit of the curves]. None: the attribute
            `minimum_intensity` of the curves, which `read_nrml_fragility` sets. Without this attribute: the intensity
            at which the probability of exceeding the lightest state is 1e-6.
        maximum_intensity: Highest intensity (maxIML) of continuous functions [unit of the curves]; above it OpenQuake
            keeps the probability constant. None: the attribute `maximum_intensity` of the curves. Without this
            attribute: the intensity at which every state is exceeded with a probability of at least 0.999.
        no_damage_limit: Intensity at and below which there is no damage [unit of the curves]. None: the attribute
            `no_damage_limit` of the curves. Without this attribute, discrete functions and functions with the attribute
            `minimum_intensity` have no limit; the limit of other functions is their `minimum_intensity`.
        loss_type: "structural", "nonstructural", "contents" or another loss type of OpenQuake.
        description: Description of the model. None: the attribute `fragility_method` of the curves, which describes the
            fit.
        overwrite: If True, replace an existing file of any content. If False, replace only a fragility model that
            warpdyn wrote.

    Returns:
        Path of the written file.

    Raises:
        ValueError: If a state has no fitted curve; if curves of a continuous model are not lognormal; if curves cross;
            if damage states differ between taxonomies; if probabilities decrease or are not from 0 to 1; if intensities
            do not increase; or if OpenQuake does not accept the measure, its unit or a name. The error names taxonomy,
            state and intensity.
        TypeError: If `curves` is not a mapping of taxonomies to datasets.
        OSError: If the file cannot be written, or exists with other content and `overwrite` is False.

    Example:
        >>> path = wd.write_nrml_fragility({"CR/LFM/HEX:2": curves}, "fragility.xml")
        >>> list(wd.read_nrml_fragility(path))
        ['CR/LFM/HEX:2']
    """
    path = checked_path(FUNCTION, path, ".xml")
    nrml.check_by_taxonomy(FUNCTION, curves, "curves")
    one_of("format", format, ("continuous", "discrete"))
    one_of("loss_type", loss_type, nrml.LOSS_TYPES)
    if format == "continuous" and intensities is not None:
        raise ValueError(
            f"{FUNCTION}: continuous functions have no intensities: remove intensities=, or give format='discrete'"
        )
    if format == "discrete" and not (minimum_intensity is None and maximum_intensity is None):
        raise ValueError(
            f"{FUNCTION}: discrete functions have no minimum and maximum intensity: remove minimum_intensity= and "
            "maximum_intensity=, and choose the range by intensities=[...]"
        )
    points = "exceedance_fraction" if format == "discrete" and intensities is None else ""
    sets = {
        taxonomy: CurveSet.from_dataset(f"taxonomy {taxonomy!r}", dataset, points=points)
        for taxonomy, dataset in curves.items()
    }
    first, *rest = curves
    states = list(sets[first].names)
    nrml.check_state_names(FUNCTION, states)
    for taxonomy in rest:
        own = sets[taxonomy].names
        if list(own) != states:
            raise ValueError(
                f"{FUNCTION}: taxonomy {taxonomy!r} has the damage states {', '.join(own)}, but {first!r} has "
                f"{', '.join(states)}; all taxonomies of a model need the same states: write two files"
            )

    default = f"warpdyn: {curves[first].attrs.get('fragility_method', 'fragility curves')}"
    beyond = {taxonomy: extrapolated(dataset, tuple(states)) for taxonomy, dataset in curves.items()}
    marked = [f"{taxonomy}: {', '.join(found)}" for taxonomy, found in beyond.items() if found]
    default += f". Extrapolated medians: {'; '.join(marked)}" if marked else ""
    text = nrml.checked_description(FUNCTION, description, default)
    root, model = nrml.model("fragilityModel", loss_type, text)
    ElementTree.SubElement(model, "limitStates").text = " ".join(states)
    for taxonomy, dataset in curves.items():
        what = f"taxonomy {taxonomy!r}"
        function = ElementTree.SubElement(model, "fragilityFunction", id=taxonomy, format=format)
        imt = measure_of(what, dataset, measure)
        if not points and "fragility_median" not in dataset:
            raise ValueError(
                f"{what}: the dataset has no fragility_median(damage_state); pass the result of fragility()"
            )
        factor = to_openquake(what, dataset["stripe" if points else "fragility_median"].attrs.get("units"), imt)
        if format == "continuous":
            bounds = minimum_intensity, maximum_intensity, no_damage_limit
            _add_continuous(function, what, dataset, sets[taxonomy], imt, factor, bounds)
        else:
            _add_discrete(function, what, sets[taxonomy], imt, factor, intensities, no_damage_limit)
    return nrml.write_xml(FUNCTION, path, root, overwrite)


def _add_continuous(
    function: ElementTree.Element,
    what: str,
    dataset: xr.Dataset,
    curves: CurveSet,
    imt: str,
    factor: float,
    bounds: tuple[float | None, ...],
) -> None:
    """Add a continuous function to its XML element: intensity limits, and mean and standard deviation of each state."""
    check_order(what, curves)
    if curves.shape.name != LOGNORMAL.name:
        raise ValueError(
            f"{what}: the curves are {curves.shape.name}, but OpenQuake's continuous functions are lognormal: give "
            "format='discrete' and intensities=[...]"
        )
    median, dispersion, units = curves.median, curves.dispersion, curves.units
    low, high = norm.ppf(LEAST_PROBABILITY), norm.ppf(GREATEST_PROBABILITY)
    defaults = (np.min(median * np.exp(low * dispersion)), np.max(median * np.exp(high * dispersion)))
    names = ("minimum_intensity", "maximum_intensity", "no_damage_limit")
    least, greatest, limit = (
        None if value is None else real_number(f"{FUNCTION}: {name}", value, above=0)
        for name, value in zip(names, bounds, strict=True)
    )
    is_given = any(value is not None for value in bounds)
    own = curves.limits
    is_of_file = least is None and MINIMUM in dataset.attrs  # a file may lack noDamageLimit
    least = own.minimum if is_of_file else least or defaults[0]
    greatest = greatest or (own.maximum if np.isfinite(own.maximum) else defaults[1])
    if limit is None:
        limit = own.no_damage if is_of_file or NO_DAMAGE in dataset.attrs else least
    if not greatest > least:
        raise ValueError(
            f"{what}: maximum_intensity ({greatest:g} {units}) must be above minimum_intensity ({least:g} {units}): "
            "give a larger maximum_intensity= or a smaller minimum_intensity="
        )
    # The user must give limits on either side of the medians; limits that were read from a file may be above a median.
    if is_given and (not max(least, limit) < median[0] or not greatest > median[-1]):
        raise ValueError(
            f"{what}: minimum_intensity ({least:g} {units}) and no_damage_limit ({limit:g}) must be below the smallest "
            f"median, and maximum_intensity ({greatest:g}) above the largest; the medians are {median[0]:g} to "
            f"{median[-1]:g} {units}: change these arguments, or remove them to use limits around the medians"
        )
    levels = np.geomspace(max(least, limit) or LEAST_CHECKED * greatest, greatest, CHECKED_POINTS)
    check_exceedance(what, curves, levels, curves.shape.probability(levels, median, dispersion))
    function.set("shape", "logncdf")
    named = {"noDamageLimit": limit, "minIML": least, "maxIML": greatest}
    ElementTree.SubElement(function, "imls", {"imt": imt} | {n: repr(float(v * factor)) for n, v in named.items()})
    for state, m, b in zip(curves.names, median * factor, dispersion, strict=True):
        mean = float(m * np.exp(b**2 / 2))
        stddev = float(mean * np.sqrt(np.expm1(b**2)))
        ElementTree.SubElement(function, "params", ls=state, mean=repr(mean), stddev=repr(stddev))


def _add_discrete(
    function: ElementTree.Element,
    what: str,
    curves: CurveSet,
    imt: str,
    factor: float,
    intensities: ArrayLike | None,
    no_damage_limit: float | None,
) -> None:
    """Add a discrete function to its XML element: its intensities, and the probabilities of each state at them."""
    if intensities is None:
        assert curves.table is not None
        _, levels, probability = curves.table
        _check_levels(what, levels)
    else:
        check_order(what, curves)
        levels = finite_numbers("intensities", intensities)
        _check_levels(what, levels)
        probability = curves.probability(levels)
    check_exceedance(what, curves, levels, probability)
    probability = np.minimum.accumulate(probability, axis=0)
    attributes = {"imt": imt}
    own = curves.limits.no_damage
    if no_damage_limit is None and own > 0:
        attributes["noDamageLimit"] = repr(own * factor)
    elif no_damage_limit is not None:
        limit = real_number(f"{FUNCTION}: no_damage_limit", no_damage_limit, above=0)
        if not limit < levels[0]:
            raise ValueError(
                f"{what}: no_damage_limit ({limit:g}) must be below the first intensity, {levels[0]:g}: give a smaller "
                "no_damage_limit="
            )
        attributes["noDamageLimit"] = repr(limit * factor)
    ElementTree.SubElement(function, "imls", attributes).text = nrml.row(levels * factor)
    for state, values in zip(curves.names, probability, strict=True):
        ElementTree.SubElement(function, "poes", ls=state).text = nrml.row(values)


def _check_levels(what: str, levels: np.ndarray) -> None:
    if levels.ndim != 1 or levels.size < 2 or not (levels > 0).all() or (np.diff(levels) <= 0).any():
        raise ValueError(
            f"{what}: a discrete function needs at least 2 increasing intensities above 0, got {levels.tolist()}: give "
            "intensities=[...]"
        )
