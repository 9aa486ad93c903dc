"""What intensities, and what records, contribute to the annual rates of damage states."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.core.checks import check_dataset, real_number, whole_number
from warpdyn.risk.annual_rates import SOURCE
from warpdyn.risk.curves import check_hazard, curves_of
from warpdyn.risk.hazard_curves import Hazard, branches_of
from warpdyn.risk.integrals import rates_by_bin


def disaggregate(
    curves: xr.Dataset, hazard: Hazard, *, bins: int = 40, lowest: float | None = None, highest: float | None = None
) -> xr.Dataset:
    """Return what each range of intensities contributes to the annual rate of each damage state.

    Args:
        curves: What `fragility` returned.
        hazard: The hazard of the curves' intensity measure; the mean over the branches of a logic tree is taken.
        bins: Number of bins, equal in the logarithm of the intensity.
        lowest: Lower edge of the first bin [units of the hazard]; by default the first point of the hazard.
        highest: Upper edge of the last bin; by default the last point of the hazard.

    Returns:
        `annual_rate_of_bin(damage_state, intensity)` [1/year], `contribution(damage_state, intensity)`, its share of
        the whole rate [1], `contribution_density(damage_state, intensity)`, that share over the width of the bin in
        logarithms [1], by the middle `intensity` of the bins, whose edges are `intensity_lower` and `intensity_upper`;
        `modal_intensity(damage_state)`, the middle of the bin that contributes most, and `share_below_bins` and
        `share_above_bins(damage_state)`.

    Raises:
        TypeError, ValueError: As of `annual_rates`; if the edges do not increase.

    Example:
        >>> wd.disaggregate(curves, hazard)["modal_intensity"]
    """
    tree = branches_of("disaggregate", hazard)
    found = curves_of("disaggregate", curves, tree)
    bins = whole_number("bins", bins, 2)
    low = min(each.intensity[0] for each in tree.curves) if lowest is None else real_number("lowest", lowest, above=0)
    high = (
        max(each.intensity[-1] for each in tree.curves) if highest is None else real_number("highest", highest, above=0)
    )
    if not low < high:
        raise ValueError(f"highest must be above lowest, got {high:g} and {low:g}")
    edges = np.geomspace(low, high, bins + 1)
    rate, below, above = 0.0, 0.0, 0.0
    for weight, each in zip(tree.weights, tree.curves, strict=True):
        own, own_below, own_above = rates_by_bin(each, edges, found.median, found.dispersion)
        rate, below, above = rate + weight * own, below + weight * own_below, above + weight * own_above
    whole = np.sum(rate, axis=-1) + below + above
    share = rate / whole[:, None]
    middle = np.sqrt(edges[:-1] * edges[1:])
    state, along, unit = "damage_state", ("damage_state", "intensity"), {"units": "1"}
    length = {"units": tree.units}
    return xr.Dataset(
        {
            "annual_rate": (state, whole, {"units": "year-1", "long_name": "annual rate of the damage state"}),
            "annual_rate_of_bin": (
                along,
                rate,
                {"units": "year-1", "long_name": "annual rate from the bin's intensities"},
            ),
            "contribution": (along, share, unit | {"long_name": "share of the annual rate from the bin's intensities"}),
            "contribution_density": (
                along,
                share / np.diff(np.log(edges)),
                unit | {"long_name": "share of the annual rate per unit of the logarithm of the intensity"},
            ),
            "modal_intensity": (
                state,
                middle[np.argmax(share, axis=1)],
                length | {"long_name": "middle of the bin that contributes most"},
            ),
            "share_below_bins": (state, below / whole, unit | {"long_name": "share from intensities below the bins"}),
            "share_above_bins": (state, above / whole, unit | {"long_name": "share from intensities above the bins"}),
            "intensity_lower": ("intensity", edges[:-1], length | {"long_name": "lower edge of the bin"}),
            "intensity_upper": ("intensity", edges[1:], length | {"long_name": "upper edge of the bin"}),
        },
        {
            state: (state, np.array(found.names), {"long_name": "damage state"}),
            "intensity": ("intensity", middle, length | {"long_name": "middle of the bin of intensities"}),
        },
        {"intensity_measure": tree.measure or found.measure, "rate_method": SOURCE},
    )


def rates_by_record(capacities: xr.Dataset, hazard: Hazard) -> xr.Dataset:
    """Return the annual rate of each damage state from capacities, without a fitted curve, and each record's part.

    The rate is the mean over structures and records of the rate at which their capacity is exceeded.

    Args:
        capacities: `capacity(structure, motion, damage_state)`, the intensity at which each state is first reached; NaN
            or infinite where it was not up to the highest level, which then counts with a rate of 0. With
            `capacity_lower` and `capacity_upper`, the brackets, the rate has bounds.
        hazard: The hazard of the capacities' intensity measure; the mean over the branches of a logic tree is taken.

    Returns:
        `annual_rate(damage_state)` [1/year]; `standard_error(damage_state)` over the records, as a sample of records
        [1/year], NaN of one record; `record_annual_rate` and `contribution(motion, damage_state)`, the share of each
        record in the rate [1]; `censored_share(damage_state)`, the share of the capacities that are unknown; and with
        brackets `annual_rate_lower` and `annual_rate_upper(damage_state)`, within which the rate lies whatever the
        capacities in their brackets.

    Raises:
        TypeError: If `capacities` is no Dataset or `hazard` no hazard.
        ValueError: If variables are missing, a capacity is not positive, or the hazard is of another unit or measure.

    Example:
        >>> by_record = wd.rates_by_record(wd.capacities(scene, limits), hazard)
        >>> by_record["contribution"].sel(damage_state="complete").argmax()
    """
    name, dims = "rates_by_record", ("motion", "structure", "damage_state")
    check_dataset(name, capacities, "capacity", advice="give what capacities(scene, limits) returned")
    tree = branches_of(name, hazard)
    if set(capacities["capacity"].dims) != set(dims):
        raise ValueError(f"{name}: capacity must lie along {', '.join(dims)}, got {capacities['capacity'].dims}")
    units = str(capacities["capacity"].attrs.get("units", "g"))
    check_hazard(name, tree, units, str(capacities.attrs.get("intensity_measure", "")))

    def rates(variable: str) -> np.ndarray:
        values = capacities[variable].transpose(*dims).values.astype(np.float64)
        known = np.where(np.isnan(values), np.inf, values)
        if variable == "capacity_lower":
            # A bracket that reaches down to no motion at all is exceeded as often as the hazard's least intensity;
            # where the lower end is unknown, so is the bound.
            known = np.maximum(known, min(each.intensity[0] for each in tree.curves))
            return np.where(np.isnan(values), np.nan, tree.rate_of(known))
        if np.any(known <= 0):
            raise ValueError(f"{name}: every {variable} must be above 0")
        return tree.rate_of(known)

    pair = rates("capacity")
    record = pair.mean(axis=1)
    rate = record.mean(axis=0)
    censored = ~np.isfinite(capacities["capacity"].transpose(*dims).values)
    state, per_year = "damage_state", {"units": "year-1"}
    with np.errstate(invalid="ignore", divide="ignore"):
        contribution = record / record.sum(axis=0)
    error = record.std(axis=0, ddof=1) / np.sqrt(len(record)) if len(record) > 1 else np.full(rate.shape, np.nan)
    variables = {
        "annual_rate": (state, rate, per_year | {"long_name": "annual rate of reaching the damage state"}),
        "standard_error": (
            state,
            error,
            per_year | {"long_name": "standard error of the annual rate over the records"},
        ),
        "record_annual_rate": (
            ("motion", state),
            record,
            per_year | {"long_name": "annual rate by the capacities under the record"},
        ),
        "contribution": (
            ("motion", state),
            contribution,
            {"units": "1", "long_name": "share of the record in the rate"},
        ),
        "censored_share": (
            state,
            censored.mean(axis=(0, 1)),
            {"units": "1", "long_name": "share of the capacities that are above the highest level"},
        ),
    }
    if "capacity_lower" in capacities and "capacity_upper" in capacities:
        for suffix, source in (("lower", "capacity_upper"), ("upper", "capacity_lower")):
            long_name = f"annual rate of reaching the damage state, {suffix} bound by the brackets of the capacities"
            variables[f"annual_rate_{suffix}"] = (
                state,
                rates(source).mean(axis=(0, 1)),
                per_year | {"long_name": long_name},
            )
    coordinates = {key: capacities[key] for key in (state, "motion") if key in capacities.coords}
    attributes = {"intensity_measure": tree.measure, "rate_method": "mean rate of exceedance of the capacities"}
    return xr.Dataset(variables, coordinates, attributes)
