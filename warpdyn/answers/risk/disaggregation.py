"""Disaggregation of annual rates of damage states: contributions of intensities and of records."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.risk.curves.curve_set import CurveSet, check_hazard
from warpdyn.answers.risk.curves.curve_warnings import EXTRAPOLATED_SHARE, warn_of_extrapolation
from warpdyn.answers.risk.hazard_curves import Hazard, HazardLogicTree, branches_of
from warpdyn.foundations.core.checks import check_dataset, real_number, whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names

MISSED_SHARE = 0.1  # a warning is given if a larger share of a rate comes from intensities outside the bins
MOST_BINS = 10**5


@suggests_names
def disaggregate(
    curves: xr.Dataset, hazard: Hazard, *, bins: int = 40, lowest: float | None = None, highest: float | None = None
) -> xr.Dataset:
    """Return the contribution of each bin (range) of intensities to the annual rate of each damage state.

    Args:
        curves: Fragility curves, as in `annual_rates`.
        hazard: The hazard, of the same intensity measure as the curves; for a logic tree, the mean over its branches.
        bins: Number of bins, of equal width in ln(intensity).
        lowest: Lower edge of the first bin [units of the hazard]; None: the first point of the hazard.
        highest: Upper edge of the last bin [units of the hazard]; None: the last point of the hazard.

    Returns:
        For each bin: `annual_rate_of_bin(damage_state, intensity)` [1/year]; `contribution(damage_state, intensity)`,
        the share of the bin in the annual rate [1]; `contribution_density(damage_state, intensity)`, this share divided
        by the width of the bin in ln(intensity) [1]. The coordinate `intensity` is the middle of the bin,
        `intensity_lower` and `intensity_upper` are its edges. For each damage state: `annual_rate` [1/year];
        `modal_intensity`, the middle of the bin with the largest contribution; `share_below_bins` and
        `share_above_bins`, the shares of the rate from intensities outside the bins [1]. A warning names damage states
        for which these shares are together above 10 %.

    Raises:
        TypeError, ValueError: As in `annual_rates`; if the edges do not increase.

    Example:
        >>> wd.disaggregate(curves, hazard)["modal_intensity"].round(2).values  # g
        array([0.53, 1.13])
    """
    tree = branches_of("disaggregate", hazard)
    found = CurveSet.from_dataset("disaggregate", curves, tree)
    return contributions(found, tree, bins=bins, lowest=lowest, highest=highest)


def contributions(
    found: CurveSet, tree: HazardLogicTree, *, bins: int, lowest: float | None = None, highest: float | None = None
) -> xr.Dataset:
    """Return the result of `disaggregate` for checked fragility curves and a checked hazard."""
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
            f"disaggregate: {', '.join(missed)} comes from intensities outside the bins ({low:.3g} to {high:.3g} "
            f"{tree.units}), so modal_intensity may be wrong: choose lowest=, highest= and a hazard curve that reach "
            "further"
        )
    middle = np.sqrt(edges[:-1] * edges[1:])
    state, along, units = "damage_state", ("damage_state", "intensity"), tree.units
    density = share / np.diff(np.log(edges))
    return xr.Dataset(
        {
            "annual_rate": variable(state, whole, "annual rate of the damage state", units="year-1"),
            "annual_rate_of_bin": variable(along, rate, "annual rate from the bin's intensities", units="year-1"),
            "contribution": variable(along, share, "share of the annual rate from the bin's intensities"),
            "contribution_density": variable(
                along, density, "share of the annual rate per unit of the logarithm of the intensity"
            ),
            "modal_intensity": variable(
                state, middle[np.argmax(share, axis=1)], "middle of the bin that contributes most", units=units
            ),
            "share_below_bins": variable(state, below / whole, "share from intensities below the bins"),
            "share_above_bins": variable(state, above / whole, "share from intensities above the bins"),
            "intensity_lower": variable("intensity", edges[:-1], "lower edge of the bin", units=units),
            "intensity_upper": variable("intensity", edges[1:], "upper edge of the bin", units=units),
        },
        {
            state: (state, np.array(found.names), {"long_name": "damage state"}),
            "intensity": variable("intensity", middle, "middle of the bin of intensities", units=units),
        },
        {"intensity_measure": tree.measure or found.measure, "rate_method": found.limited.method},
    )


def rates_by_record(capacities: xr.Dataset, hazard: Hazard) -> xr.Dataset:
    """Return the annual rate of each damage state directly from capacities, and the contribution of each record.

    No curve is fitted: the rate is the mean, over structures and records, of the annual rate at which their capacity is
    exceeded. A capacity above the highest level (infinite) counts with a rate of 0. A capacity below the lowest level
    (0) counts with the rate of the upper bound of its bracket. Failed searches (NaN) do not count. A warning names
    damage states whose rate depends on such capacities, or is extrapolated beyond the hazard curve.

    Args:
        capacities: `capacity(structure, motion, damage_state)`, the intensity at which each state is first reached,
            with its bracket `capacity_lower` and `capacity_upper`.
        hazard: The hazard, of the same intensity measure; for a logic tree, the mean over its branches.

    Returns:
        `annual_rate(damage_state)` [1/year], with the bounds `annual_rate_lower` and `annual_rate_upper` that the
        brackets allow; `standard_error(damage_state)` due to the choice of records [1/year], NaN for one record;
        `record_annual_rate(motion, damage_state)` [1/year] and `contribution(motion, damage_state)`, the share of each
        record in the rate [1]; `censored_share` and `failed_share(damage_state)`, the shares of capacities above the
        highest level and of failed searches [1].

    Raises:
        TypeError: If `capacities` is not a Dataset, or `hazard` is not a HazardCurve or HazardLogicTree.
        ValueError: If variables are missing, a capacity is negative, all searches of a state failed under a record, or
            the hazard has another unit or measure.

    Example:
        >>> by_record = wd.rates_by_record(wd.capacities(scene, limits, highest=4.0), hazard)
        >>> contribution = by_record["contribution"].sel(damage_state="complete")
        >>> contribution.argmax("motion").item()  # the record that contributes most
        1
    """
    name, dims = "rates_by_record", ("motion", "structure", "damage_state")
    needed = "capacity", "capacity_lower", "capacity_upper"
    check_dataset(
        name, capacities, *needed, advice="give the result of capacities(scene, limits)", argument="capacities"
    )
    tree = branches_of(name, hazard)
    given = capacities["capacity"]
    if set(given.dims) != set(dims):
        raise ValueError(
            f"{name}: capacity must have the dimensions {', '.join(dims)}, got {given.dims}: "
            "give the result of capacities() for one scene"
        )
    measure = str(capacities.attrs.get("intensity_measure", ""))
    check_hazard(name, tree, str(given.attrs.get("units", "g")), measure)
    capacity, lower, upper = (capacities[each].transpose(*dims).values.astype(np.float64) for each in needed)
    states = [str(state) for state in capacities["damage_state"].values]
    failed, censored, below = np.isnan(capacity), np.isposinf(capacity), capacity == 0
    if np.any(capacity < 0):
        raise ValueError(
            f"{name}: a capacity is {np.nanmin(capacity):g}; every capacity must be at least "
            "0: give the result of capacities() without changes"
        )
    for motion, place in np.argwhere(failed.all(axis=1)):
        raise ValueError(
            f"{name}: damage state {states[place]!r} has no known capacity under motion "
            f"{motion}, because all its histories failed: run capacities() with a smaller step= or another method="
        )
    capacity = np.where(below, upper, capacity)
    # A lower bound of 0 has no rate: use the smallest intensity of the hazard instead.
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
        added = (np.nanmean(np.where(which, rates(lower) - rates(capacity), 0.0), axis=1)).mean(axis=0)
        for i in np.flatnonzero(added > EXTRAPOLATED_SHARE * rate):
            warn_caller(
                f"annual rate by record: {float(f'{100 * shares[i]:.2g}'):g} % of the capacities of {states[i]!r} are "
                f"{what}, so the rate of {rate[i]:.3g} per year may be up to {added[i]:.2g} higher. "
                + ("Raise capacities(..., highest=)" if which is censored else "Run capacities() at lower levels")
            )
    state, of_record, of_rate = "damage_state", ("motion", "damage_state"), "annual rate of reaching the damage state"
    rows = {
        "annual_rate": (rate, of_rate),
        "annual_rate_lower": (bounds[0], f"{of_rate}, least by the capacities' brackets"),
        "annual_rate_upper": (bounds[1], f"{of_rate}, largest by the capacities' brackets"),
        "standard_error": (error, "standard error of the annual rate over the records"),
    }
    by_record = "annual rate by the capacities under the record"
    censored_share, failed_share = (which.mean(axis=(0, 1)) for which in (censored, failed))
    return xr.Dataset(
        {key: variable(state, values, words, units="year-1") for key, (values, words) in rows.items()}
        | {
            "censored_share": variable(state, censored_share, "share of the capacities above the highest level"),
            "failed_share": variable(state, failed_share, "share of the capacities whose search failed"),
            "record_annual_rate": variable(of_record, record, by_record, units="year-1"),
            "contribution": variable(of_record, contribution, "share of the record in the rate"),
        },
        {key: capacities[key] for key in (state, "motion") if key in capacities.coords},
        {"intensity_measure": tree.measure, "rate_method": "mean rate of exceedance of the capacities"},
    )


def _rates_beyond(tree: HazardLogicTree, capacity: np.ndarray) -> np.ndarray:
    """Return mean annual rates [1/year], [2, damage_state], of capacities that are beyond the hazard points.

    The first row contains capacities below the first point of the hazard curve, the second row capacities above the
    last point. Other capacities count with a rate of 0.
    """
    found = np.zeros((2, capacity.shape[-1]))
    for weight, each in zip(tree.weights, tree.curves, strict=True):
        for side, beyond in enumerate((capacity < each.intensity[0], capacity > each.intensity[-1])):
            found[side] += weight * np.where(beyond, each.rate_of(capacity), 0.0).mean(axis=(0, 1))
    return found
