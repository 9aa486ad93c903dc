"""Storey-based losses: losses by storey drifts and by floor accelerations, summed over the building for each sample."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.demands import refuse_portfolio
from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.campaigns.running.joining.duplicates import check_samples
from warpdyn.campaigns.running.selections import without_added_storeys
from warpdyn.foundations.core.checks import check_dataset, finite_numbers, real_number
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.output_variables import (
    COLLAPSED,
    LARGEST_EXCLUDED_FRACTION,
    STRIPED,
    measure_of_dataset,
)
from warpdyn.foundations.core.plausibility import warn_of_implausible_limits
from warpdyn.foundations.core.units import STANDARD_GRAVITY, unit_attributes

LossFunction: TypeAlias = tuple[ArrayLike, ArrayLike]
_FUNCTION = "storey_losses"
# Allowed units of a run's demands, with the factor to the unit of the loss function (the first unit in each row).
FACTORS = {
    "peak_storey_drift_ratio": {"1": 1.0, "percent": 0.01, "%": 0.01, "rad": 1.0},
    "peak_floor_acceleration": {"m s-2": 1.0, "m/s2": 1.0, "g": STANDARD_GRAVITY, "cm s-2": 0.01},
}
SMALL_DRIFT_RATIO = 0.01  # the first drift ratio of a loss function is checked for plausibility only above this value


@suggests_names
def storey_losses(
    run: xr.Dataset,
    drift_loss: LossFunction | None = None,
    acceleration_loss: LossFunction | None = None,
    *,
    collapse_loss: float = 1.0,
) -> xr.Dataset:
    """Return the loss ratio of every sample: the sum of losses by storey drifts and by floor accelerations.

    A storey loss function is the expected repair cost of a storey's components as a function of a demand, divided by
    the replacement value of the building. It is linear between its points and constant above the last point. The loss
    of a collapsed sample is `collapse_loss`, which is also an upper bound for all samples. The loss of a failed sample
    is NaN. Storeys of isolators or of a tuned mass damper, and the floors above them, have no losses.

    Source: Ramirez and Miranda (2009), "Building-specific loss estimation methods and tools for simplified
    performance-based earthquake engineering", Blume Center report 171, chapter 3.

    Args:
        run: A run of a ShearBuilding with the recorders "drift" and, for `acceleration_loss`, "acceleration".
        drift_loss: Two arrays: peak storey drift ratios [1], shape [point], and losses of a storey at these ratios [1],
            shape [point], or [storey, point] if storeys differ. The first loss must be 0, and losses must not decrease.
        acceleration_loss: Two arrays of the same shapes: peak floor accelerations [m/s2] and losses of a floor [1]. If
            the run's accelerations are in g (attribute `units`), they are converted.
        collapse_loss: Loss of a collapsed sample [1].

    Returns:
        `loss_ratio(sample)` [1] and, for samples without collapse, its parts `drift_loss_ratio(sample, storey)` and
        `acceleration_loss_ratio(sample, floor)`. For a run on stripes also `mean_loss_ratio(intensity)`,
        `coefficient_of_variation(intensity)` (of all samples of the stripe, with divisor n - 1) and
        `collapsed_share(intensity)`; `plots.vulnerability` draws these.

    Raises:
        TypeError: If `run` is not a Dataset.
        ValueError: If no loss function is given; if a demand is not recorded, or its units cannot be converted; if
            points do not increase; if losses decrease, do not begin at 0 or are above 1; if `collapse_loss` is above 1;
            if the run has several archetypes or events, or no samples; or if more than 1 % of the samples failed.

    Example:
        >>> drift_loss = [0.0, 0.004, 0.01, 0.03], [0.0, 0.02, 0.1, 0.3]  # of each of two equal storeys
        >>> losses = wd.storey_losses(run, drift_loss, acceleration_loss=([0.0, 3.0, 12.0], [0.0, 0.0, 0.06]))
        >>> losses["mean_loss_ratio"].round(2).values  # at the level of each stripe
        array([0.01, 0.02, 0.04, 0.09, 0.17, 0.32])
    """
    check_dataset(_FUNCTION, run, "status", advice="give the result of simulate()", argument="run")
    refuse_portfolio(_FUNCTION, run)
    run = without_added_storeys(run)
    if "event" in run.dims:
        raise ValueError(f"{_FUNCTION}: the run has several events: select one, select_event(run, name)")
    if not run.sizes.get("sample", 0):
        raise ValueError(f"{_FUNCTION}: the run has no samples: give a run with at least one sample")
    check_samples(_FUNCTION, run)
    worst = real_number("collapse_loss", collapse_loss, above=0)
    if worst > 1:
        raise ValueError(
            f"collapse_loss is {worst:g}; it is a share of the replacement value, at most 1 (100 % is 1.0)"
        )
    given = {
        "drift": ("peak_storey_drift_ratio", "storey", drift_loss),
        "acceleration": ("peak_floor_acceleration", "floor", acceleration_loss),
    }
    if drift_loss is None and acceleration_loss is None:
        raise ValueError(
            f"{_FUNCTION} needs drift_loss, acceleration_loss or both: give drift_loss=(drift ratios, losses)"
        )
    status = decoded_status(run["status"])
    failed = status > COLLAPSED
    if failed.sum() > LARGEST_EXCLUDED_FRACTION * status.size:
        raise ValueError(
            f"{failed.sum()} of {status.size} samples failed; at most {100 * LARGEST_EXCLUDED_FRACTION:g} % may fail: "
            "simulate with a smaller step= or another method="
        )
    variables: dict[str, tuple] = {}
    total = np.zeros(status.size)
    for recorder, (demanded, dim, function) in given.items():
        if function is None:
            continue
        if demanded not in run:
            raise ValueError(f"{_FUNCTION}: the run has no {demanded}: add {recorder!r} to Scene(recorders=...)")
        demand = _in_units_of_losses(run[demanded]) * run[demanded].transpose("sample", dim).values.astype(np.float64)
        part = _losses_at(f"{recorder}_loss", function, demand)
        if recorder == "drift":
            points = np.asarray(function[0], dtype=np.float64)
            first = float(points[points > 0][0])  # only the first positive point: later points may be large
            if first > SMALL_DRIFT_RATIO:
                warn_of_implausible_limits({" of the first loss of drift_loss": first})
        else:
            warn_of_implausible_limits({"": float(np.max(function[0]))}, "last_acceleration_of_losses")
        part[status != 0] = np.nan
        name = f"{recorder}_loss_ratio"
        variables[name] = variable(("sample", dim), part, f"loss of the {dim} by its {recorder}")
        total += part.sum(axis=1)
    total = np.where(status == COLLAPSED, worst, np.minimum(total, worst))
    total[failed] = np.nan
    variables["loss_ratio"] = variable("sample", total, "loss over the replacement value")
    coordinates = {name: run[name] for name in ("sample", "storey", "floor", "im_level") if name in run.coords}
    result = xr.Dataset(variables)
    result = result.assign_coords({name: v for name, v in coordinates.items() if set(v.dims) <= set(result.dims)})
    if "im_level" not in run or run["im_level"].attrs.get("design") != STRIPED:
        return result
    levels, stripe = np.unique(run["im_level"].values, return_inverse=True)
    rows = [total[(stripe == i) & ~failed] for i in range(levels.size)]
    mean = np.array([row.mean() if row.size else np.nan for row in rows])
    spread = np.array([row.std(ddof=1) if row.size > 1 else np.nan for row in rows])
    with np.errstate(invalid="ignore", divide="ignore"):
        variation = np.where(mean > 0, spread / mean, np.nan)
    collapsed = [
        (status[(stripe == i) & ~failed] == COLLAPSED).mean() if rows[i].size else np.nan for i in range(levels.size)
    ]
    units = str(run["im_level"].attrs.get("units", "g"))
    of_stripe = {"long_name": "intensity of the stripe"} | unit_attributes(units)
    return (
        result.assign(
            mean_loss_ratio=variable("intensity", mean, "mean loss ratio of the stripe"),
            coefficient_of_variation=variable("intensity", variation, "coefficient of variation of the loss ratio"),
            collapsed_share=variable("intensity", np.array(collapsed), "share of the stripe that collapsed"),
        )
        .assign_coords(intensity=("intensity", levels, of_stripe))
        .assign_attrs(measure_of_dataset(run))
    )


def _in_units_of_losses(demand: xr.DataArray) -> float:
    """Return the factor that converts a demand of the run to the units of its loss function."""
    units = str(demand.attrs.get("units", next(iter(FACTORS[str(demand.name)]))))
    factors = FACTORS[str(demand.name)]
    if units not in factors:
        raise ValueError(
            f"{_FUNCTION}: {demand.name} is in {units!r}; allowed are {', '.join(map(repr, factors))}: convert the "
            "values and the attribute units"
        )
    return factors[units]


def _losses_at(what: str, function: LossFunction, demand: np.ndarray) -> np.ndarray:
    """Return the loss [1] at each demand by interpolation, of the shape of `demand`, after a check of the function.

    If a demand is NaN, because the building does not have this storey, its loss is 0.

    Args:
        what: Name of the argument, for messages.
        function: The loss function: demands and losses at these demands.
        demand: Demands [units of the loss function], shape [sample, storey or floor].
    """
    if not isinstance(function, tuple | list) or len(function) != 2:
        raise ValueError(
            f"{what} must be a pair of demands and the losses at them, such as ([0, 0.01, 0.03], [0, 0.1, 0.3])"
        )
    points, losses = finite_numbers(f"{what}: demands", function[0]), finite_numbers(f"{what}: losses", function[1])
    if points.ndim != 1 or points.size < 2 or points[0] < 0 or np.any(np.diff(points) <= 0):
        raise ValueError(f"{what}: demands must be a row of at least 2 increasing numbers of at least 0, got {points}")
    places = demand.shape[1]
    if losses.shape not in ((points.size,), (places, points.size)):
        raise ValueError(
            f"{what}: losses must have the shape [{points.size}] of the demands or [{places}, {points.size}], one row "
            f"per storey or floor, got {list(losses.shape)}"
        )
    table = np.broadcast_to(losses, (places, points.size))
    if np.any(table[:, 0] != 0):
        raise ValueError(
            f"{what}: the first loss must be 0, got {table[:, 0].max():g} at a demand of {points[0]:g}: begin with a "
            "demand that causes no loss"
        )
    if np.any(np.diff(table, axis=1) < 0):
        place, point = (int(i) for i in np.argwhere(np.diff(table, axis=1) < 0)[0])
        raise ValueError(
            f"{what}: losses must not fall, but go from {table[place, point]:g} at a demand of {points[point]:g} to "
            f"{table[place, point + 1]:g} at {points[point + 1]:g}: give the cumulative loss at each demand"
        )
    if np.any(table > 1):
        raise ValueError(
            f"{what}: losses must be shares of the replacement value of the building, at most 1 (2 % is 0.02), got "
            f"{table.max():g}"
        )
    each = [np.interp(np.nan_to_num(demand[:, i]), points, table[i]) for i in range(places)]
    return np.stack(each, axis=1)
