"""Expected annual loss of each building of an inventory, from a hazard curve or from the rates of events."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.answers.fragility.building_results import check_run_of_stock
from warpdyn.answers.fragility.reduced_counts import counts_over
from warpdyn.answers.risk.curves.curve_set import check_hazard
from warpdyn.answers.risk.curves.curve_warnings import warn_of_extrapolated_loss
from warpdyn.answers.risk.event_losses import checked_event_rates
from warpdyn.answers.risk.hazard_curves import Hazard, HazardLogicTree, branches_of
from warpdyn.answers.risk.integrals.linear import begin_of, loss_of_year
from warpdyn.campaigns.reductions.damage.loss_ratios import Ratios, ratios_of_archetypes
from warpdyn.foundations.core.checks import check_dataset, check_kind
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.output_variables import measure_of_dataset
from warpdyn.model.inventories.stock import BuildingStock

_FUNCTION = "building_annual_losses"
COLUMNS = ("building", "archetype", "annual_loss_ratio", "expected_annual_loss")
LARGEST_END = 0.05  # share of the annual loss at the ends of the levels above which a warning is given
Losses = Ratios | Mapping[str, Ratios]


@suggests_names
def building_annual_losses(
    counted: xr.Dataset,
    stock: BuildingStock,
    inventory: pd.DataFrame,
    loss_ratios: Losses,
    *,
    hazard: Hazard | None = None,
    event_rates: ArrayLike | None = None,
) -> pd.DataFrame:
    """Return the expected annual loss of each building of an inventory; their sum is that of the portfolio.

    With a hazard curve, the mean loss ratio of a building, linear between the levels of the stripes, is integrated over
    the curve, as in `expected_annual_loss`: it is 0 below the lowest and constant above the highest level. With rates
    of events, it is the sum over the events of the rate times the mean loss ratio. A sample is in exactly one damage
    state, and failed samples do not count. A warning is given if levels beyond the first or last level decide more than
    5 % of the portfolio's annual loss, or if more than 1 % of it is from intensities beyond the points of the hazard.

    Args:
        counted: The result of `simulate` with `statistics=wd.DamageCounts(stock.limits, over=...)`: over=("building",
            "stripe") for a hazard curve; over=("building", "event") or ("building", "motion") for rates of events.
        stock: The stock whose portfolio was run.
        inventory: The inventory from which the stock was made, with the column `replacement_cost`.
        loss_ratios: Loss ratio of each damage state: its mean [1], or (mean, coefficient of variation). Either one such
            mapping for all archetypes, or such a mapping for each archetype.
        hazard: The hazard of all buildings, of the intensity measure of the stripes.
        event_rates: Annual rate of each event (or motion) [1/year], shape [event], as in `event_losses`.

    Returns:
        One row per building that has an archetype, in the order of the inventory, with its columns and: `building`, the
        index in the portfolio; `archetype`; `annual_loss_ratio` [1/year]; and `expected_annual_loss`, the ratio times
        the replacement cost [currency/year].

    Raises:
        TypeError: If an argument is of another class.
        ValueError: If not exactly one of `hazard` and `event_rates` is given; if the counts have other dimensions or
            were made with other limits than `stock.limits`; if the stock, the inventory or the hazard does not fit; if
            a building has no valid sample at a level or in an event; or if costs, loss ratios or rates are invalid.

    Example:
        >>> levels = wd.Stripes(motions, [0.1, 0.3, 0.9, 2.0], wd.PeakGroundAcceleration())  # g
        >>> asked = wd.DamageCounts(stock.limits, over=("building", "stripe"))
        >>> counted = wd.simulate(wd.Scene(stock.portfolio, levels, recorders=("drift",)), statistics=asked)
        >>> ratios = wd.hazus_loss_ratios("RES1")
        >>> annual = wd.building_annual_losses(counted, stock, inventory, ratios, hazard=hazard)
        >>> annual[["id", "expected_annual_loss"]].round(-1)
          id  expected_annual_loss
        0  a                  10.0
        1  b                  10.0
        2  c                  80.0
    """
    check_dataset(_FUNCTION, counted, advice="give the result of simulate(..., statistics=...)", argument="counted")
    check_kind(_FUNCTION, "a BuildingStock", stock, BuildingStock, "as wd.inventories.portfolio returns it")
    check_kind(_FUNCTION, "an inventory", inventory, pd.DataFrame, "as the readers of wd.inventories return it")
    if (hazard is None) == (event_rates is None):
        raise ValueError(f"{_FUNCTION}: give either hazard= or event_rates=")
    choices = (("building", "stripe"),) if event_rates is None else (("building", "event"), ("building", "motion"))
    name = counts_over(_FUNCTION, counted, *choices)
    (along,) = (str(dim) for dim in counted[name].dims if dim not in ("building", "damage_state"))
    check_run_of_stock(_FUNCTION, counted.isel({along: 0}), stock)
    stock.check(inventory)
    taken = [each for each in COLUMNS if each in inventory.columns]
    if taken:
        raise ValueError(
            f"{_FUNCTION}: the inventory has a column {taken[0]!r}, but a result has the same name: rename the column"
        )
    states = [str(state) for state in counted["damage_state"].values]
    counts = counted[name].transpose("building", along, "damage_state").values
    samples = counts.sum(axis=-1)
    if not samples.all():
        building, place = (int(each) for each in np.argwhere(samples == 0)[0])
        raise ValueError(
            f"{_FUNCTION}: building {building} has no valid sample in {along} {counted[along].values[place]}: simulate "
            "with a smaller step=, or remove this building"
        )
    archetypes = list(stock.portfolio.archetypes)
    of_archetypes = ratios_of_archetypes(_FUNCTION, archetypes, states[1:], loss_ratios)
    means = np.stack([np.append(0.0, each.mean) for each in of_archetypes])[stock.archetype_index]
    ratio = np.einsum("bas,bs->ba", counts, means) / samples
    cost = stock.replacement_costs(inventory)
    if hazard is not None:
        weights = _weights(counted, hazard, ratio, cost)
    else:
        assert event_rates is not None
        totals = xr.DataArray(
            cost @ ratio, dims=along, coords={along: counted[along]} if along in counted.coords else {}
        )
        weights = checked_event_rates(_FUNCTION, totals, event_rates)
    annual = ratio @ weights
    number = np.full(len(inventory), -1, np.int32)
    number[stock.rows] = np.arange(stock.rows.size, dtype=np.int32)
    order = number[number >= 0]
    columns = {"building": order, "annual_loss_ratio": annual[order], "expected_annual_loss": (annual * cost)[order]}
    own = pd.DataFrame(columns)
    own.insert(1, "archetype", pd.Categorical.from_codes(stock.archetype_index[order], archetypes))
    return pd.concat([inventory[number >= 0].reset_index(drop=True), own], axis=1)


def _weights(counted: xr.Dataset, hazard: Hazard, ratio: np.ndarray, cost: np.ndarray) -> np.ndarray:
    """Return the weight of the loss ratio at each level in the annual loss ratio [1/year], shape [stripe].

    The integral of a function that is linear between the levels is linear in its values.

    Args:
        counted: The counts.
        hazard: The hazard.
        ratio: Mean loss ratio of each building at each level [1], shape [building, stripe].
        cost: Replacement cost of each building [currency], shape [building].
    """
    tree = branches_of(_FUNCTION, hazard)
    levels = counted["stripe"].values.astype(np.float64)
    units = str(counted["stripe"].attrs.get("units", "g"))
    check_hazard(_FUNCTION, tree, units, str(measure_of_dataset(counted).get("intensity_measure", "")))
    if levels.size < 2:
        raise ValueError(f"{_FUNCTION}: a hazard curve needs at least 2 levels of Stripes, got {levels.size}")
    each = [[loss_of_year(curve, levels, row) for row in np.eye(levels.size)] for curve in tree.curves]
    weights = tree.weights @ np.array(each)
    _warn_of_ends(tree, levels, units, cost @ ratio, float(cost @ ratio @ weights))
    return weights


def _warn_of_ends(tree: HazardLogicTree, levels: np.ndarray, units: str, loss: np.ndarray, whole: float) -> None:
    """Warn if the loss at the lowest level, above the highest level or beyond the hazard points is a large part.

    Args:
        tree: The hazard.
        levels: Levels [units], shape [stripe].
        units: Units of the levels.
        loss: Loss of the portfolio at each level [currency], shape [stripe].
        whole: Expected annual loss of the portfolio [currency/year].
    """
    if not whole > 0:
        return
    first = loss[0] * float(tree.rate_of(begin_of(tree.curves[0], levels))) / whole
    last = loss[-1] * float(tree.rate_of(levels[-1])) / whole
    if first > LARGEST_END:
        warn_caller(
            f"{_FUNCTION}: levels below {levels[0]:g} {units} count as free of loss, although the loss at this level "
            f"is {100 * first:.0f} % of the annual loss: add lower levels to Stripes"
        )
    if last > LARGEST_END:
        warn_caller(
            f"{_FUNCTION}: the loss ratio above {levels[-1]:g} {units} is constant, although these levels are "
            f"{100 * last:.0f} % of the annual loss: add higher levels to Stripes"
        )
    warn_of_extrapolated_loss(_FUNCTION, tree, levels, loss, whole)
