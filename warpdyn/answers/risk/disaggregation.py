"""What intensities, and what records, contribute to the annual rates of damage states."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.answers.risk.annual_rates import EXTRAPOLATED_SHARE, warn_of_extrapolation
from warpdyn.answers.risk.curves import Curves, check_hazard, curves_of
from warpdyn.answers.risk.hazard_curves import Hazard, HazardLogicTree, branches_of
from warpdyn.foundations.core.checks import check_dataset, real_number, whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names

MISSED_SHARE = 0.1  # of a rate that comes from outside of the bins: with more a warning is given

MOST_BINS = 10**5


@suggests_names
def disaggregate(
    curves: xr.Dataset, hazard: Hazard, *, bins: int = 40, lowest: float | None = None, highest: float | None = None
) -> xr.Dataset:
    """Return what each range of intensities contributes to the annual rate of each damage state.

    Args:
        curves: As of `annual_rates`.
        hazard: The hazard of the curves' intensity measure; the mean over the branches of a logic tree is taken.
        bins: Number of bins, equal in the logarithm of the intensity.
        lowest: Lower edge of the first bin [units of the hazard]; by default the first point of the hazard.
        highest: Upper edge of the last bin [units of the hazard]; by default the last point of the hazard.

    Returns:
        `annual_rate_of_bin(damage_state, intensity)` [1/year], `contribution(damage_state, intensity)`, its share of
        the whole rate [1], `contribution_density(damage_state, intensity)`, that share over the width of the bin in
        logarithms [1], by the middle `intensity` of the bins, whose edges are `intensity_lower` and `intensity_upper`;
        `modal_intensity(damage_state)`, the middle of the bin that contributes most, and `share_below_bins` and
        `share_above_bins(damage_state)`. A warning names states of which more than 10 % comes from outside of the bins.

    Raises:
        TypeError, ValueError: As of `annual_rates`; if the edges do not increase.

    Example:
        >>> wd.disaggregate(curves, hazard)["modal_intensity"].round(2).values  # g
        array([0.53, 1.13])
    """
    tree = branches_of("disaggregate", hazard)
    return contributions(curves_of("disaggregate", curves, tree), tree, bins=bins, lowest=lowest, highest=highest)


def contributions(
    found: Curves, tree: HazardLogicTree, *, bins: int, lowest: float | None = None, highest: float | None = None
) -> xr.Dataset:
    """Return what `disaggregate` does, of curves and a hazard that are checked."""
    bins = whole_number("bins", bins, 2, MOST_BINS)
    low = min(each.intensity[0] for each in tree.curves) if lowest is None else real_number("lowest", lowest, above=0)
    high = (
        max(each.intensity[-1] for each in tree.curves) if highest is None else real_number("highest", highest, above=0)
    )
    if not low < high:
        raise ValueError(f"highest must be above lowest, got {high:g} and {low:g}")
    edges = np.geomspace(low, high, bins + 1)
    rate, below, above = 0.0, 0.0, 0.0
    for weight, each in zip(tree.weights, tree.curves, strict=True):
        own, own_below, own_above = found.rates_by_bin(each, edges)
        rate, below, above = rate + weight * own, below + weight * own_below, above + weight * own_above
    whole = np.sum(rate, axis=-1) + below + above
    share = rate / whole[:, None]
    missed = [
        f"{float(f'{100 * part:.2g}'):g} % of {name!r}"
        for name, part in zip(found.names, (below + above) / whole, strict=True)
        if part > MISSED_SHARE
    ]
    if missed:
        warn_caller(
            f"disaggregate: {', '.join(missed)} comes from intensities outside of the bins ({low:.3g} to {high:.3g} "
            f"{tree.units}), so that the mode is that of the rest: take bins, and a hazard curve, that reach further"
        )
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
        {"intensity_measure": tree.measure or found.measure, "rate_method": found.shape.method},
    )


def rates_by_record(capacities: xr.Dataset, hazard: Hazard) -> xr.Dataset:
    """Return the annual rate of each damage state from capacities, without a fitted curve, and each record's part.

    The rate is the mean over structures and records of the rate at which their capacity is exceeded. An infinite
    capacity, which was not reached up to the highest level, counts with a rate of 0; one below the lowest level (0)
    with that of the upper end of its bracket; one whose search failed (NaN) is left out. Warnings tell of those that
    matter, and of rates that are extrapolated.

    Args:
        capacities: `capacity(structure, motion, damage_state)`, the intensity at which each state is first reached,
            with its bracket `capacity_lower` and `capacity_upper`.
        hazard: The hazard of the capacities' intensity measure; the mean over the branches of a logic tree is taken.

    Returns:
        `annual_rate(damage_state)` [1/year], with `annual_rate_lower` and `annual_rate_upper`, within which it lies
        whatever the capacities in their brackets; `standard_error(damage_state)` over the records, as a sample of
        records [1/year], NaN of one record; `record_annual_rate` [1/year] and `contribution(motion, damage_state)`, the
        share of each record in the rate [1]; `censored_share` and `failed_share(damage_state)`, the shares of the
        capacities above the highest level and of those whose search failed [1].

    Raises:
        TypeError: If `capacities` is no Dataset or `hazard` no hazard.
        ValueError: If variables are missing, a capacity is negative, a state has no known capacity under a record, or
            the hazard is of another unit or measure.

    Example:
        >>> by_record = wd.rates_by_record(wd.capacities(scene, limits, highest=4.0), hazard)
        >>> contribution = by_record["contribution"].sel(damage_state="complete")
        >>> contribution.argmax("motion").item()  # the record that contributes most
        1
    """
    name, dims = "rates_by_record", ("motion", "structure", "damage_state")
    needed = "capacity", "capacity_lower", "capacity_upper"
    check_dataset(
        name, capacities, *needed, advice="give what capacities(scene, limits) returned", argument="capacities"
    )
    tree = branches_of(name, hazard)
    if set(capacities["capacity"].dims) != set(dims):
        raise ValueError(f"{name}: capacity must lie along {', '.join(dims)}, got {capacities['capacity'].dims}")
    check_hazard(
        name,
        tree,
        str(capacities["capacity"].attrs.get("units", "g")),
        str(capacities.attrs.get("intensity_measure", "")),
    )
    capacity, lower, upper = (capacities[each].transpose(*dims).values.astype(np.float64) for each in needed)
    states = [str(state) for state in capacities["damage_state"].values]
    failed, censored, below = np.isnan(capacity), np.isposinf(capacity), capacity == 0
    if np.any(capacity < 0):
        raise ValueError(f"{name}: a capacity is {np.nanmin(capacity):g}; none can be below 0")
    for motion, place in np.argwhere(failed.all(axis=1)):
        raise ValueError(f"{name}: damage state {states[place]!r} has no known capacity under motion {motion}")
    capacity = np.where(below, upper, capacity)
    # A bracket that reaches down to no motion at all is exceeded as often as the hazard's least intensity.
    lower = np.maximum(lower, min(each.intensity[0] for each in tree.curves))

    def rates(values: np.ndarray) -> np.ndarray:
        return np.where(failed, np.nan, tree.rate_of(np.where(failed, np.inf, values)))

    record = np.nanmean(rates(capacity), axis=1)
    rate = record.mean(axis=0)
    bounds = [np.nanmean(rates(ends), axis=1).mean(axis=0) for ends in (upper, lower)]
    error = record.std(axis=0, ddof=1) / np.sqrt(len(record)) if len(record) > 1 else np.full(rate.shape, np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        contribution = record / record.sum(axis=0)
        outside = _rates_beyond(tree, np.where(failed, np.inf, capacity)) / rate
    warn_of_extrapolation(tuple(states), np.nan_to_num(np.array(outside)), tree.curves, "annual rate by record")
    for which, what in ((censored, "above the highest level"), (below, "below the lowest level")):
        shares = which.mean(axis=(0, 1))
        # What the brackets of these capacities alone may add to the rate.
        added = (np.nanmean(np.where(which, rates(lower) - rates(capacity), 0.0), axis=1)).mean(axis=0)
        for i in np.flatnonzero(added > EXTRAPOLATED_SHARE * rate):
            warn_caller(
                f"annual rate by record: {float(f'{100 * shares[i]:.2g}'):g} % of the capacities of {states[i]!r} are "
                f"{what}; the rate of {rate[i]:.3g} a year may be up to {added[i]:.2g} larger by that"
            )
    state, per_year, unit = "damage_state", {"units": "year-1"}, {"units": "1"}
    of_rate = "annual rate of reaching the damage state"
    rows = {
        "annual_rate": (rate, per_year | {"long_name": of_rate}),
        "annual_rate_lower": (bounds[0], per_year | {"long_name": f"{of_rate}, least by the capacities' brackets"}),
        "annual_rate_upper": (bounds[1], per_year | {"long_name": f"{of_rate}, largest by the capacities' brackets"}),
        "standard_error": (error, per_year | {"long_name": "standard error of the annual rate over the records"}),
        "censored_share": (
            censored.mean(axis=(0, 1)),
            unit | {"long_name": "share of the capacities above the highest level"},
        ),
        "failed_share": (
            failed.mean(axis=(0, 1)),
            unit | {"long_name": "share of the capacities whose search failed"},
        ),
    }
    of_records = {
        "record_annual_rate": (record, per_year | {"long_name": "annual rate by the capacities under the record"}),
        "contribution": (contribution, unit | {"long_name": "share of the record in the rate"}),
    }
    return xr.Dataset(
        {key: (state, values, about) for key, (values, about) in rows.items()}
        | {key: (("motion", state), values, about) for key, (values, about) in of_records.items()},
        {key: capacities[key] for key in (state, "motion") if key in capacities.coords},
        {"intensity_measure": tree.measure, "rate_method": "mean rate of exceedance of the capacities"},
    )


def _rates_beyond(tree: HazardLogicTree, capacity: np.ndarray) -> np.ndarray:
    """Return the mean rate by capacities below the first and above the last point of the hazard, shape [2, state]."""
    found = np.zeros((2, capacity.shape[-1]))
    for weight, each in zip(tree.weights, tree.curves, strict=True):
        for side, beyond in enumerate((capacity < each.intensity[0], capacity > each.intensity[-1])):
            found[side] += weight * np.where(beyond, each.rate_of(capacity), 0.0).mean(axis=(0, 1))
    return found
