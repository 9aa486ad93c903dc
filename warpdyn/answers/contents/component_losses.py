"""Losses by storey from components: expected repair costs of every sample, by storey and by component."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from warpdyn.answers.contents.component import Component
from warpdyn.answers.contents.storey_demands import checked_components, checked_run, demand_of_storeys
from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.risk.curves.curve_set import check_hazard
from warpdyn.answers.risk.hazard_curves import Hazard, branches_of
from warpdyn.answers.risk.integrals.linear import loss_of_year
from warpdyn.answers.risk.losses import expected_annual_loss
from warpdyn.foundations.core.checks import check_dataset, finite_numbers, real_number, shortened
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.output_variables import COLLAPSED, OK, STRIPED, measure_of_dataset
from warpdyn.foundations.core.units import unit_attributes

_MONEY = {"comment": "in the currency of the costs"}
_LOSSES, _ANNUAL = "component_losses", "component_annual_losses"


@suggests_names
def component_losses(
    run: xr.Dataset,
    components: Mapping[str, Component],
    quantities: Mapping[str, ArrayLike],
    replacement_value: float,
) -> xr.Dataset:
    """Return the expected repair cost of every sample, by storey and by component.

    Given the demands of a sample, the expected cost of a component in a storey is the sum over its damage states:
    quantity times probability of the state times mean cost per unit. If costs fall with the quantity (`RepairCost`),
    the quantity is that expected in this damage state in all storeys together. A collapsed sample costs the replacement
    value, which no storey and no component contains. If repair is more expensive than the replacement value, the
    building is replaced, and all costs of the sample are reduced by the same factor. The cost of a failed sample is
    NaN.

    Source: FEMA P-58-1 (2018), "Seismic Performance Assessment of Buildings", volume 1 (fragility and consequence
    functions). This function computes expected costs and does not sample damage states.

    Args:
        run: A run of a ShearBuilding (or of a structure with storeys) with the demands of the components.
        components: Names and Component objects.
        quantities: Quantity of each component in each storey [units of the component], shape [storey], or one number
            for every storey.
        replacement_value: Cost to replace the building [currency].

    Returns:
        `repair_cost(sample)`, `repair_cost_by_storey(sample, storey)` and `repair_cost_by_component(sample, component)`
        [currency], and `loss_ratio(sample)`, the cost over the replacement value [1]. For a run on stripes also means
        over the samples of each level, the expected losses: `mean_cost_by_storey(intensity, storey)`,
        `mean_cost_by_component(intensity, component)`, `mean_cost_of_collapse(intensity)`, and the vulnerability
        function `mean_loss_ratio(intensity)`. `component_annual_losses` and `expected_annual_loss` integrate them over
        a hazard curve.

    Raises:
        TypeError: If `run` is not a Dataset, or components or quantities are not dictionaries.
        ValueError: If the run lacks a demand, a component has no quantity or an unknown name, a quantity is negative or
            has another number of storeys, or more than 1 % of the samples failed.

    Example:
        >>> partition = wd.Component("peak_storey_drift_ratio", [0.005, 0.01], [0.4, 0.3], costs=[2700.0, 6800.0])
        >>> ceiling = wd.Component("peak_floor_acceleration", [9.0], [0.3], costs=[500.0])  # m/s2
        >>> parts = {"partition": partition, "ceiling": ceiling}
        >>> losses = wd.component_losses(run, parts, {"partition": 4, "ceiling": [10, 12]}, replacement_value=5e5)
        >>> losses["repair_cost_by_storey"].dims
        ('sample', 'storey')
    """
    known = checked_components(_LOSSES, components)
    run, status = checked_run(_LOSSES, run)
    value = real_number("replacement_value", replacement_value, above=0)
    storeys = run.sizes["storey"]
    amounts = _checked_quantities(known, quantities, storeys)
    costs = np.empty((len(known), storeys, status.size))
    for place, (name, component) in enumerate(known.items()):
        demand = demand_of_storeys(_LOSSES, run, name, component, status, amounts[name] > 0)
        demand = np.where((amounts[name] > 0)[:, None], demand, 0.0)
        damaged = amounts[name][:, None, None] * component.probabilities(demand)  # [storey, sample, damage_state]
        costs[place] = (damaged * component.costs_of(damaged.sum(axis=0))).sum(axis=-1)
    whole = costs.sum(axis=(0, 1))
    if (status == OK).any() and np.median(whole[status == OK]) > value:
        warn_caller(
            f"{_LOSSES}: in more than half of the samples, repair costs exceed the replacement value of {value:g}: "
            "check the quantities (in units of the component, such as 100 m2) and replacement_value="
        )
    with np.errstate(invalid="ignore", divide="ignore"):
        costs *= np.where(whole > value, value / whole, 1.0)
    costs[..., status == COLLAPSED] = 0.0
    costs[..., status > COLLAPSED] = np.nan
    total = np.where(status == COLLAPSED, value, costs.sum(axis=(0, 1)))
    by_storey, by_component = costs.sum(axis=0).T, costs.sum(axis=1).T
    text = "expected repair cost"
    result = xr.Dataset(
        {
            "repair_cost": variable("sample", total, text, **_MONEY),
            "repair_cost_by_storey": variable(("sample", "storey"), by_storey, f"{text} of the storey", **_MONEY),
            "repair_cost_by_component": variable(
                ("sample", "component"), by_component, f"{text} of the component", **_MONEY
            ),
            "loss_ratio": variable("sample", total / value, "repair cost over the replacement value"),
        },
        attrs={"replacement_value": value},
    )
    names = ("sample", "storey", "im_level", "motion_index")
    result = result.assign_coords({name: run[name] for name in names if name in run.coords})
    result = result.assign_coords(component=("component", np.array(list(known)), {"long_name": "component"}))
    if "im_level" not in run or run["im_level"].attrs.get("design") != STRIPED:
        return result
    levels, stripe = np.unique(run["im_level"].values, return_inverse=True)
    rows = [np.flatnonzero((stripe == place) & (status <= COLLAPSED)) for place in range(levels.size)]
    collapsed = np.where(status == COLLAPSED, value, 0.0)
    of_level = {"long_name": "intensity of the stripe"} | unit_attributes(str(run["im_level"].attrs.get("units", "g")))
    of_storey, of_component, of_collapse, of_all = (
        np.array([each[row].mean(axis=0) if row.size else np.nan * each[0] for row in rows])
        for each in (by_storey, by_component, collapsed, total / value)
    )
    means = {
        "mean_cost_by_storey": variable(("intensity", "storey"), of_storey, f"mean {text} of the storey", **_MONEY),
        "mean_cost_by_component": variable(
            ("intensity", "component"), of_component, f"mean {text} of the component", **_MONEY
        ),
        "mean_cost_of_collapse": variable("intensity", of_collapse, "mean cost of collapse", **_MONEY),
        "mean_loss_ratio": variable("intensity", of_all, "mean loss ratio of the stripe"),
    }
    found = result.assign(means).assign_coords(intensity=("intensity", levels, of_level))
    return found.assign_attrs(measure_of_dataset(run))


@suggests_names
def component_annual_losses(losses: xr.Dataset, hazard: Hazard, *, confidence: float = 0.95) -> xr.Dataset:
    """Return expected annual losses by storey and by component, with intervals.

    The expected annual loss is the integral of the mean cost over the hazard curve, as in `expected_annual_loss`. It is
    computed for each record, from the mean costs of the record's samples at each level. The expected loss is the mean
    over the records, and its interval is that of the mean of independent records by Student's t. It contains the
    variability among records and structures, but not the scatter of repair costs. If the levels have different records,
    as those of `RecordSelection.stripes`, or there is one record, losses have no intervals.

    Args:
        losses: The result of `component_losses` for a run on stripes.
        hazard: The hazard, of the same intensity measure as the stripes.
        confidence: Probability that the intervals cover the true value [1].

    Returns:
        `expected_annual_loss`, `annual_loss_by_storey(storey)`, `annual_loss_by_component(component)` and
        `annual_loss_of_collapse` [currency/year], each with `_lower` and `_upper` (NaN without intervals). The sum over
        the storeys (or components) and the loss by collapse is the expected annual loss.

    Raises:
        TypeError: If `losses` is not a Dataset, or `hazard` is not a HazardCurve or HazardLogicTree.
        ValueError: If the losses are not of a run on stripes, all samples of a record failed at a level, or the hazard
            has another unit or measure.

    Example:
        >>> partition = wd.Component("peak_storey_drift_ratio", [0.005, 0.01], [0.4, 0.3], costs=[2700.0, 6800.0])
        >>> losses = wd.component_losses(run, {"partition": partition}, {"partition": 10}, replacement_value=5e5)
        >>> annual = wd.component_annual_losses(losses, hazard)
        >>> by_storey = float(annual["annual_loss_by_storey"].sum() + annual["annual_loss_of_collapse"])
        >>> bool(np.isclose(by_storey, annual["expected_annual_loss"]))
        True
    """
    needed = ("repair_cost_by_storey", "repair_cost_by_component")
    check_dataset(_ANNUAL, losses, *needed, advice="give the result of component_losses()", argument="losses")
    if not {"intensity", "im_level", "motion_index"} <= losses.variables.keys():
        raise ValueError(
            f"{_ANNUAL}: these are not losses of a run on stripes: simulate Stripes(motions, levels, measure)"
        )
    tree = branches_of(_ANNUAL, hazard)
    check_confidence(confidence)
    units = str(losses["intensity"].attrs.get("units", "g"))
    check_hazard(_ANNUAL, tree, units, str(losses.attrs.get("intensity_measure", "")))
    expected_annual_loss(losses, hazard)  # its checks and warnings
    levels, value = losses["intensity"].values, float(losses.attrs["replacement_value"])
    total = losses["repair_cost"].values
    collapse = np.where(np.isnan(total), np.nan, total - losses["repair_cost_by_storey"].values.sum(axis=1))
    columns = np.column_stack(
        [losses["repair_cost_by_storey"].values, losses["repair_cost_by_component"].values, collapse, total]
    )
    records, record = np.unique(losses["motion_index"].values, return_inverse=True)
    level = np.searchsorted(levels, losses["im_level"].values)
    is_complete = np.unique(np.stack([record, level]), axis=1).shape[1] == records.size * levels.size
    if not is_complete:  # the levels have different records: the mean of each level
        records, record = records[:1], np.zeros_like(record)
    valid = np.isfinite(total)
    each = np.empty((records.size, columns.shape[1]))
    for place in range(records.size):
        rows = [np.flatnonzero((record == place) & (level == number) & valid) for number in range(levels.size)]
        if not all(row.size for row in rows):
            which = f"motion {records[place]} has" if is_complete else "the motions have"
            raise ValueError(
                f"{_ANNUAL}: {which} no valid sample at {levels[[not r.size for r in rows]][0]:g} {units}: all samples "
                "failed; correct the scene, or leave out this motion or level"
            )
        mean = np.array([columns[row].mean(axis=0) for row in rows]) / value
        integrals = np.array([[loss_of_year(one, levels, row) for row in mean.T] for one in tree.curves])
        each[place] = value * (tree.weights @ integrals)
    centre = each.mean(axis=0)
    half = np.full(centre.shape, np.nan)
    if records.size > 1:
        half = stdtrit(records.size - 1, 0.5 + 0.5 * confidence) * each.std(axis=0, ddof=1) / np.sqrt(records.size)
    storeys = losses.sizes["storey"]
    parts: dict[str, tuple[Any, Any, str]] = {
        "annual_loss_by_storey": ("storey", slice(0, storeys), "expected annual loss of the storey"),
        "annual_loss_by_component": ("component", slice(storeys, -2), "expected annual loss of the component"),
        "annual_loss_of_collapse": ((), -2, "expected annual loss by collapse"),
        "expected_annual_loss": ((), -1, "expected annual loss"),
    }
    bounds = {"": centre, "_lower": np.maximum(centre - half, 0.0), "_upper": centre + half}
    found = {
        f"{name}{suffix}": variable(dims, values[chosen], f"{words}{suffix.replace('_', ', ')}", **_MONEY)
        for name, (dims, chosen, words) in parts.items()
        for suffix, values in bounds.items()
    }
    coordinates = {name: losses[name] for name in ("storey", "component") if name in losses.coords}
    about = {
        "intensity_measure": tree.measure,
        "confidence": float(confidence),
        "interval_method": "t distribution of the mean over the records" if is_complete else "none",
    }
    return xr.Dataset(found, coordinates, about)


def _checked_quantities(
    components: Mapping[str, Component], quantities: Mapping[str, ArrayLike], storeys: int
) -> dict[str, np.ndarray]:
    """Return the quantity of each component in each storey, shape [storey], after a check."""
    if not isinstance(quantities, Mapping):
        raise TypeError(f"{_LOSSES}: quantities must be a dictionary of names and numbers, got {shortened(quantities)}")
    if quantities.keys() != components.keys():
        missing, unknown = components.keys() - quantities.keys(), quantities.keys() - components.keys()
        what = f"no quantity of {sorted(missing)}" if missing else f"the unknown components {sorted(unknown)}"
        raise ValueError(f"{_LOSSES}: quantities have {what}: give one quantity for each of {', '.join(components)}")
    found = {}
    for name, given in quantities.items():
        values = finite_numbers(f"{_LOSSES}: quantities[{name!r}]", given)
        if values.shape not in ((), (storeys,)) or values.min() < 0:
            raise ValueError(
                f"{_LOSSES}: quantities[{name!r}] must be a number of at least 0, or one for each of the {storeys} "
                f"storeys, got {shortened(given)}"
            )
        found[name] = np.broadcast_to(values, (storeys,)).astype(np.float64)
    return found
