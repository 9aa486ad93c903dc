"""Results of each building of an inventory: probabilities of damage and losses, with their uncertainty."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.answers.fragility.reduced_counts import archetype_counts, counts_over, part_of_scene
from warpdyn.campaigns.reductions.damage.loss_ratios import Ratios, ratios_of_archetypes
from warpdyn.campaigns.reductions.limits import DAMAGE_COUNT
from warpdyn.foundations.core.checks import check_dataset, check_kind
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.thread_pool import cores, in_parts
from warpdyn.model.inventories.stock import BuildingStock

_FUNCTION = "building_results"
PROBABILITY, STANDARD_ERROR = "probability_", "standard_error_"
Losses = Ratios | Mapping[str, Ratios]


def building_results(
    counted: xr.Dataset, stock: BuildingStock, inventory: pd.DataFrame, loss_ratios: Losses | None = None
) -> pd.DataFrame:
    """Return a table with the probabilities of damage and the losses of each building.

    A building's samples are its histories under the motions of the run (the worst of each event, if `DamageCounts` has
    events). All are of the one structure that was drawn for it, so the standard errors are those of the motions alone,
    which count as independent: name the events if two motions are components of one record. For `MotionsAtSites` at
    most as many samples count as independent as there are different earthquakes among the draws, because a repeated
    earthquake gives no new motions at a site; a warning states if the counts have no earthquakes in their attributes.

    A row that represents several buildings (`number`) was simulated once: the probability is that of each of them, and
    the loss, like the replacement cost, is of all of them, in one damage state.

    Args:
        counted: The result of `simulate` with `statistics=[DamageCounts(stock.limits, over="building")]`; of counts
            over ("building", "stripe") or ("building", "event") one level or event, such as `counted.sel(stripe=0.5)`.
        stock: The stock whose portfolio was run.
        inventory: The inventory from which the stock was made, with the user's own columns.
        loss_ratios: Mean loss ratio of each damage state [1], or mean and coefficient of variation, the same for all
            archetypes; or such a mapping for each archetype. None for probabilities alone. `DamageLoss` over buildings
            is not needed.

    Returns:
        One row per building that has an archetype, in the order of the inventory, with its columns and:

        - `building`, its number in the portfolio, and `archetype`;
        - `sample_count`, and `failed_count` of samples that are in no probability;
        - ``probability_<state>`` of being in each damage state, also "none", and ``standard_error_<state>``, which is
          sqrt(p (1 - p) / (n - 1)) for n independent samples; NaN if n is 0 or 1. It is 0 if p is 0 or 1: then all
          samples are alike, but the probability is not exact;
        - with `loss_ratios` the `expected_loss_ratio` [1] and `loss_ratio_standard_deviation` [1] of a sample,
          including the scatter of the ratios, and `expected_loss` and `loss_standard_deviation`, which are these times
          `replacement_cost`, in its currency.

    Raises:
        ValueError: If there are no counts by building, they mix the levels of stripes, the stock or the inventory does
            not match, a column of the inventory has one of these names, ratios do not fit the damage states, or
            buildings have no replacement cost for losses.
        TypeError: If an argument has the wrong type.

    Example:
        >>> counted = wd.simulate(region, statistics=wd.DamageCounts(stock.limits, over="building"))
        >>> results = wd.building_results(counted, stock, inventory, wd.hazus_loss_ratios("RES1"))
        >>> results[["id", "probability_none", "sample_count"]]
          id  probability_none  sample_count
        0  a             0.125             8
        1  b             0.125             8
        2  c             0.500             8
    """
    check_dataset(_FUNCTION, counted, advice="give the result of simulate(..., statistics=...)", argument="counted")
    as_returned = "as wd.inventories.portfolio returns it"
    check_kind(_FUNCTION, "a BuildingStock", stock, BuildingStock, as_returned, argument="stock")
    as_read = "as the readers of wd.inventories return it"
    check_kind(_FUNCTION, "an inventory", inventory, pd.DataFrame, as_read, argument="inventory")
    name = counts_over(_FUNCTION, counted, ("building",))
    _check_run(counted, stock)
    stock.check(inventory)
    states = [str(state) for state in counted["damage_state"].values]
    counts = counted[name].transpose("building", "damage_state").values
    failed = counted[name.replace(DAMAGE_COUNT, "failed_count")].transpose("building", "failure").values
    earthquakes = _earthquakes(counted, name)
    archetype = stock.archetype_index
    if loss_ratios is not None:
        of_archetypes = ratios_of_archetypes(_FUNCTION, list(stock.portfolio.archetypes), states[1:], loss_ratios)
        alike = all(each is of_archetypes[0] for each in of_archetypes)  # then one row is enough for all buildings
        ratios = [
            np.stack([np.append(0.0, getattr(each, name)) for each in of_archetypes[: 1 if alike else None]])
            for name in ("mean", "deviation")
        ]
        cost = stock.replacement_costs(inventory)

    def columns_of(numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Return the results of some buildings of the portfolio."""
        of_each = counts[numbers]
        samples = of_each.sum(axis=1)
        independent = samples if earthquakes is None else np.minimum(samples, earthquakes)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = of_each / samples[:, None]
            error = np.sqrt(share * (1 - share) / np.where(independent > 1, independent - 1, np.nan)[:, None])
        found = {"building": numbers, "archetype": archetype[numbers]}
        found |= {"sample_count": samples, "failed_count": failed[numbers].sum(axis=1)}
        for place, state in enumerate(states):
            found |= {PROBABILITY + state: share[:, place], STANDARD_ERROR + state: error[:, place]}
        if loss_ratios is not None:
            own = ratios if alike else [each[archetype[numbers]] for each in ratios]
            ratio, deviation = _loss_ratios(share, independent, *own)
            found |= {"expected_loss_ratio": ratio, "loss_ratio_standard_deviation": deviation}
            found |= {"expected_loss": ratio * cost[numbers], "loss_standard_deviation": deviation * cost[numbers]}
        return found

    # Number in the portfolio of each row of the inventory; -1 without an archetype.
    number = np.full(len(inventory), -1, np.int32)
    number[stock.rows] = np.arange(stock.rows.size, dtype=np.int32)
    has_one = number >= 0
    order = number[has_one]
    columns = {key: np.empty(order.size, values.dtype) for key, values in columns_of(order[:0]).items()}
    taken = [each for each in columns if each in inventory.columns]
    if taken:
        raise ValueError(
            f"{_FUNCTION}: the inventory has a column {taken[0]!r}, which is one of the results: rename it"
        )

    def fill(part: slice) -> None:
        for key, values in columns_of(order[part]).items():
            columns[key][part] = values

    in_parts(fill, order.size, cores())
    # Without copy=False pandas would copy all columns into tables by type.
    own = pd.DataFrame(columns, copy=False)
    own["archetype"] = pd.Categorical.from_codes(own["archetype"], list(stock.portfolio.archetypes))
    rows = inventory[has_one] if stock.left_out.size else inventory
    found = pd.concat([rows.reset_index(drop=True), own], axis=1)
    found.attrs = {
        key: str(counted.attrs[key]) for key in ("title", "source", "history", "seed") if key in counted.attrs
    }
    return found


def _loss_ratios(
    share: np.ndarray, independent: np.ndarray, mean: np.ndarray, deviation: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean and the standard deviation of the loss ratio of each building's samples.

    Args:
        share: Share of the samples in each damage state, shape [building, damage_state].
        independent: Number of independent samples, shape [building].
        mean: Mean loss ratio of each damage state, of this shape or one row for all buildings.
        deviation: Its standard deviation, of the same shape.
    """
    expected = (share * mean).sum(axis=1)
    between = (share * (mean - expected[:, None]) ** 2).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        variance = between * independent / (independent - 1) + (share * deviation**2).sum(axis=1)
    return expected, np.sqrt(np.where(independent > 1, variance, np.nan))


def _earthquakes(counted: xr.Dataset, name: str) -> int | None:
    """Return the number of different earthquakes among the draws of MotionsAtSites; None for other designs.

    A warning states if it is unknown.

    Args:
        counted: The counts.
        name: Name of the counts by building.
    """
    text, design = str(counted.attrs.get("scene", "")), '{"type":"MotionsAtSites"'
    if "earthquake" in counted[name].coords:  # counts of one earthquake
        return 1
    # Find the earthquakes of the draws without parsing the sites of all buildings before them. Quotes within JSON text
    # are escaped, so no name looks like this key.
    begin, key = text.find(f'"excitation":{design}'), '"earthquake":['
    place = text.find(key, begin) if begin >= 0 else -1
    if place >= 0:
        drawn = json.JSONDecoder().raw_decode(text, place + len(key) - 1)[0]
        return len(set(drawn))
    if not text or design in text:  # events of a sequence have different earthquakes
        warn_caller(
            f"{_FUNCTION}: the number of different earthquakes of the motions is unknown (the counts have no attribute "
            "'scene'), so each sample counts as independent. If earthquakes were drawn repeatedly, standard errors are "
            "too small: give the result of simulate() with its attributes"
        )
    return None


def damage_states(results: pd.DataFrame) -> list[str]:
    """Return the damage states of the probabilities in a table of results, no damage first.

    A user's column may begin with "probability_" too, but has no standard error.
    """
    states = [str(name).removeprefix(PROBABILITY) for name in results if str(name).startswith(PROBABILITY)]
    return [state for state in states if STANDARD_ERROR + state in results]


def _check_run(counted: xr.Dataset, stock: BuildingStock) -> None:
    """Raise a ValueError unless the counts are of the stock's portfolio and one level of intensity."""
    if counted.sizes["building"] != stock.portfolio.buildings:
        raise ValueError(
            f"{_FUNCTION}: the run has {counted.sizes['building']:,} buildings and the stock "
            f"{stock.portfolio.buildings:,}: pass the stock whose portfolio was run"
        )
    run = archetype_counts(counted)
    own = dict(zip(stock.portfolio.archetypes, map(int, stock.portfolio.counts), strict=True))
    if run is not None and list(run.items()) != list(own.items()):
        other = next((name for name in {**run, **own} if run.get(name) != own.get(name)), "")
        found = (
            f"{run.get(other, 0):,} buildings of archetype {other!r} and the stock {own.get(other, 0):,}"
            if other
            else f"the archetypes {', '.join(run)} and the stock {', '.join(own)}"
        )
        raise ValueError(f"{_FUNCTION}: the run has {found}: pass the stock whose portfolio was run")
    excitation = part_of_scene(counted, "excitation", '{"type":"Stripes"')
    if excitation is not None and len(excitation["levels"]) > 1 and "stripe" not in counted.coords:
        raise ValueError(
            f"{_FUNCTION}: the counts mix {len(excitation['levels'])} levels of intensity: use DamageCounts(..., "
            "over=('building', 'stripe')) and give one level, counted.sel(stripe=...)"
        )
