"""Results for each building of an inventory: probabilities of damage and losses, with their uncertainty."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.answers.fragility.reduced_counts import archetype_counts, counts_over, part_of_scene
from warpdyn.campaigns.reductions.damage.loss_ratios import Ratios, ratios_of_archetypes
from warpdyn.campaigns.reductions.limits import DAMAGE_COUNT, DRIFT
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
    """Return a table with the probabilities of damage and the losses of each building of an inventory.

    The samples of a building are its histories under the motions of the run (if `DamageCounts` has `events`: the worst
    motion of each event). All samples of a building have the same random structure, so standard errors contain only the
    variability among motions, which count as independent. If two motions are components of one record, give
    `DamageCounts(events=...)`. For `MotionsAtSites`, the number of independent samples is at most the number of
    different earthquakes among the draws, because a repeated earthquake gives no new motions at a site. If the counts
    have no earthquakes in their attributes, a warning is given.

    A row of the inventory that represents several buildings (column `number`) is simulated once. Its probabilities
    apply to each of these buildings. Its loss, like its replacement cost, is the loss of all of them, in the same
    damage state.

    Args:
        counted: The result of `simulate` with `statistics=[DamageCounts(stock.limits, over="building")]`. From counts
            over ("building", "stripe") or ("building", "event"), select one level or event: `counted.sel(stripe=0.5)`.
        stock: The stock whose portfolio was run.
        inventory: The inventory from which the stock was made, with the user's own columns.
        loss_ratios: Loss ratio of each damage state: its mean [1], or (mean, coefficient of variation). Either one such
            mapping for all archetypes, or such a mapping for each archetype. None: no losses are computed. The run
            needs no `DamageLoss`.

    Returns:
        One row per building that has an archetype, in the order of the inventory, with its columns and:

        - `building`, the index of the building in the portfolio, and `archetype`;
        - `sample_count`, the number of samples, and `failed_count`, the number of failed samples, which are not
          counted;
        - ``probability_<state>``, the probability of being in each damage state (also "none"), and its
          ``standard_error_<state>``, sqrt(p (1 - p) / (n - 1)) for n independent samples: NaN if n is 0 or 1, and 0 if
          p is 0 or 1, although such a probability is not exact either;
        - if `loss_ratios` are given: `expected_loss_ratio` [1], the mean over the samples, and
          `loss_ratio_standard_deviation`
          [1], which includes the scatter of the loss ratios; both times `replacement_cost` are `expected_loss` and
          `loss_standard_deviation`, in the currency of the costs.

    Raises:
        ValueError: If the dataset has no counts by building; if the counts mix levels of stripes or have other limits
            than the stock; if the stock or the inventory belongs to another run; if a column of the inventory has the
            name of a result; if loss ratios are missing for a damage state; or if losses are requested and buildings
            have no replacement cost.
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
    check_run_of_stock(_FUNCTION, counted, stock)
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
        """Return the results (columns by name) of the buildings with the given indices in the portfolio."""
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

    # Index in the portfolio of the building in each row of the inventory; -1 if the row has no archetype.
    number = np.full(len(inventory), -1, np.int32)
    number[stock.rows] = np.arange(stock.rows.size, dtype=np.int32)
    has_one = number >= 0
    order = number[has_one]
    columns = {key: np.empty(order.size, values.dtype) for key, values in columns_of(order[:0]).items()}
    taken = [each for each in columns if each in inventory.columns]
    if taken:
        raise ValueError(
            f"{_FUNCTION}: the inventory has a column {taken[0]!r}, but a result has the same name: rename the column"
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
    """Return the mean and standard deviation of the loss ratio [1] of each building, shape [building].

    Args:
        share: Share of each building's samples in each damage state, shape [building, damage_state].
        independent: Number of independent samples of each building, shape [building].
        mean: Mean loss ratios, shape [building or 1, damage_state].
        deviation: Standard deviations of the loss ratios, of the same shape.
    """
    expected = (share * mean).sum(axis=1)
    between = (share * (mean - expected[:, None]) ** 2).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        variance = between * independent / (independent - 1) + (share * deviation**2).sum(axis=1)
    return expected, np.sqrt(np.where(independent > 1, variance, np.nan))


def _earthquakes(counted: xr.Dataset, name: str) -> int | None:
    """Return the number of different earthquakes among the draws of MotionsAtSites; None for other designs.

    Args:
        counted: The statistics of the run.
        name: Name of the damage counts.
    """
    text, design = str(counted.attrs.get("scene", "")), '{"type":"MotionsAtSites"'
    if "earthquake" in counted[name].coords:  # counts of one earthquake
        return 1
    # Find the earthquakes of the draws without parsing the sites of all buildings, which come before them in the JSON.
    # Quotes within JSON texts are escaped, so no name can be confused with this key.
    begin, key = text.find(f'"excitation":{design}'), '"earthquake":['
    place = text.find(key, begin)  # -1 for another design: the search begins at -1, the last character
    if place != -1:
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
    """Return the names of the damage states whose probabilities are in a table of results; no damage is first.

    A user's column may also begin with "probability_", but it has no corresponding column "standard_error_...".
    """
    states = [str(name).removeprefix(PROBABILITY) for name in results if str(name).startswith(PROBABILITY)]
    return [state for state in states if STANDARD_ERROR + state in results]


def check_run_of_stock(function: str, counted: xr.Dataset, stock: BuildingStock) -> None:
    """Raise a ValueError unless the counts belong to the portfolio of the stock and to one level of intensity.

    Args:
        function: Name of the public function, for messages.
        counted: The counts.
        stock: The stock.
    """
    if counted.sizes["building"] != stock.portfolio.buildings:
        raise ValueError(
            f"{function}: the run has {counted.sizes['building']:,} buildings and the stock "
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
        raise ValueError(f"{function}: the run has {found}: pass the stock whose portfolio was run")
    _check_limits(function, counted, stock)
    excitation = part_of_scene(counted, "excitation", '{"type":"Stripes"')
    if excitation is not None and len(excitation["levels"]) > 1 and "stripe" not in counted.coords:
        raise ValueError(
            f"{function}: the counts mix {len(excitation['levels'])} levels of intensity: use DamageCounts(..., "
            "over=('building', 'stripe')) and give one level, counted.sel(stripe=...)"
        )


def _check_limits(function: str, counted: xr.Dataset, stock: BuildingStock) -> None:
    """Raise a ValueError if damage states were counted with other limits than those of the stock.

    Counts without the variable `damage_limit`, and archetypes without limits in the stock, are not checked.
    """
    if "damage_limit" not in counted:
        return
    table, names = counted["damage_limit"], list(stock.portfolio.archetypes)
    states = [str(state) for state in counted["damage_state"].values][1:]
    remedy = "run the scene with DamageCounts(stock.limits, ...), or use wd.damage_shares for other limits"
    if table.attrs.get("demand", DRIFT) != DRIFT:
        raise ValueError(
            f"{function}: the counts have limits of {table.attrs['demand']}, but the limits of the stock are drift "
            f"ratios: {remedy}"
        )
    for name in names:
        limits = stock.limits.get(name, {})
        row = table.sel(archetype=name) if "archetype" in table.coords else table
        if "archetype" in row.dims:
            row = row.isel(archetype=names.index(name))
        own = np.array([limits.get(state, np.nan) for state in states])
        used = row.values[1:]
        differs = ~np.isclose(used, own, rtol=1e-9, atol=0.0, equal_nan=True)
        if limits and differs.any():
            place = int(differs.argmax())
            raise ValueError(
                f"{function}: the counts have the limit {used[place]:g} for {states[place]!r} of archetype {name!r}, "
                f"but the stock has {own[place]:g}: {remedy}"
            )
