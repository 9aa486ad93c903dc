"""The portfolio made from an inventory: archetypes, drift ratio limits, and the inventory row of each building."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from warpdyn.foundations.core.checks import check_kind, one_of, shortened
from warpdyn.foundations.core.messages import amount_of, warn_caller
from warpdyn.foundations.core.near_misses import did_you_mean, suggests_names
from warpdyn.model.inventories.rules import HazusRule, Rule, named_by
from warpdyn.model.inventories.table import named_rows
from warpdyn.model.scene.portfolio import Archetype, Portfolio, named as of_archetype
from warpdyn.model.scene.scatter import Scatter
from warpdyn.model.structures.hazus import DESIGN_LEVELS, building_types, hazus_drift_limits
from warpdyn.model.structures.shear_building import ShearBuilding

REFUSE, LEAVE_OUT = "refuse", "leave out"  # values of the argument `unknown` of `portfolio`


@dataclass(frozen=True, eq=False)
class BuildingStock:
    """The portfolio that was made from an inventory, with drift ratio limits and the inventory row of each building.

    Args:
        portfolio: The portfolio, with one building per inventory row that has an archetype.
        limits: Archetype -> damage state -> storey drift ratio limit [1], for `damage_shares`.
        rows: Inventory row of each building of the portfolio, counted from 0, shape [building].
        left_out: Inventory rows without an archetype, counted from 0.
        inventory_ids: Ids of all inventory rows, in the order of the inventory.

    Example:
        >>> stock = wd.inventories.portfolio(inventory)
        >>> stock.portfolio.buildings, stock.limits["C1L high 2"]["slight"]
        (3, 0.005)
        >>> stock.buildings(inventory)["id"].tolist()  # in the order of the portfolio
        ['a', 'b', 'c']
        >>> stock.replacement_values(inventory)["C1L high 2"]
        4000000.0
    """

    portfolio: Portfolio
    limits: Mapping[str, Mapping[str, float]]
    rows: np.ndarray
    left_out: np.ndarray
    inventory_ids: pd.api.extensions.ExtensionArray

    def __repr__(self) -> str:
        left = f", {self.left_out.size:,} buildings left out" if self.left_out.size else ""
        return f"BuildingStock({self.portfolio!r}{left})"

    @property
    def id(self) -> np.ndarray:
        """Id of each building of the portfolio, as in the inventory, shape [building]."""
        return self.inventory_ids.to_numpy()[self.rows]

    @property
    def archetype_index(self) -> np.ndarray:
        """Index of the archetype of each building in the portfolio, shape [building]."""
        return np.repeat(np.arange(len(self.portfolio.archetypes), dtype=np.int32), self.portfolio.counts)

    def buildings(self, inventory: pd.DataFrame) -> pd.DataFrame:
        """Return the inventory rows of the portfolio's buildings, in the order of the portfolio (by archetype).

        Use columns of this table for arguments with one value per building. The columns of the inventory itself are in
        another order.

        Args:
            inventory: The inventory from which the stock was made.

        Raises:
            ValueError: If the stock was made from another inventory, with other ids.

        Example:
            >>> labels = {"kind": stock.buildings(inventory)["structure_type"]}
            >>> by_kind = wd.DamageCounts(stock.limits, over="kind", labels=labels)
        """
        self.check(inventory)
        found = inventory.iloc[self.rows]
        # The new index marks the order of the portfolio, even if the inventory has the same order.
        return found.set_axis(pd.Index(found.index.to_numpy(), name=found.index.name))

    def check(self, inventory: pd.DataFrame) -> None:
        """Raise an error if the stock was not made from this inventory, i.e. if ids or the number of rows differ.

        Args:
            inventory: The inventory.

        Raises:
            ValueError: If the number of rows or an id differs.
            TypeError: If `inventory` is not a DataFrame.
        """
        check_kind("BuildingStock", "a DataFrame", inventory, pd.DataFrame, argument="inventory")
        if "id" not in inventory:
            raise ValueError(
                f"the inventory has no column 'id', only {', '.join(map(str, inventory.columns))}: give the inventory "
                "from which this stock was made"
            )
        missing = self.rows.size and self.rows.max() >= len(inventory)
        if missing or len(inventory) != self.rows.size + self.left_out.size:
            raise ValueError(
                f"the inventory has {amount_of(len(inventory), 'row')}, but the stock was made from one with "
                f"{self.rows.size + self.left_out.size:,}: give that inventory"
            )
        if self.inventory_ids.equals(inventory["id"].array):
            return  # equal ids; the comparison below would select rows and convert text, which takes longer
        found, own = inventory["id"].to_numpy()[self.rows], self.id
        differs = found != own
        if differs.any():
            place = int(np.flatnonzero(differs)[0])
            one, other = found[place : place + 1].tolist()[0], own[place : place + 1].tolist()[0]
            if (found.astype(str) == own.astype(str)).all():
                raise ValueError(
                    f"the ids of the inventory are of type {type(one).__name__}, such as {one!r}, and those of the "
                    f"stock are of type {type(other).__name__}, such as {other!r}: give the inventory as the reader "
                    "returned it"
                )
            raise ValueError(
                f"the stock was made from another inventory: {amount_of(int(differs.sum()), 'different id')}, such as "
                f"{one!r} in row {self.rows[place]}, which was {other!r}: give the inventory of this stock"
            )

    def replacement_costs(self, inventory: pd.DataFrame) -> np.ndarray:
        """Return the replacement cost of each building in the portfolio, for `DamageLoss`, shape [building].

        Args:
            inventory: The inventory from which the stock was made.

        Raises:
            ValueError: If replacement costs are missing or below 0. The message gives their number and some ids.
        """
        self.check(inventory)
        if "replacement_cost" not in inventory:
            raise ValueError(
                "replacement_costs: the inventory has no column replacement_cost: name it by columns= of the reader"
            )
        cost = inventory["replacement_cost"].to_numpy(dtype=np.float64)[self.rows]
        missing = np.isnan(cost)
        if missing.any():
            named = named_rows(self.buildings(inventory), missing)
            raise ValueError(
                f"replacement_costs: {named} of {cost.size:,} buildings have no replacement cost: add the costs, or "
                "remove these buildings before portfolio()"
            )
        if np.any(cost < 0):
            named = named_rows(self.buildings(inventory), cost < 0, "replacement_cost")
            raise ValueError(
                f"replacement_costs: {named} of {cost.size:,} buildings have a replacement cost below 0: correct the "
                "costs"
            )
        return cost

    def replacement_values(self, inventory: pd.DataFrame) -> dict[str, float]:
        """Return archetype -> sum of the replacement costs of its buildings, for `portfolio_losses`.

        Args:
            inventory: The inventory from which the stock was made.

        Raises:
            ValueError: As in `replacement_costs`.
        """
        cost = self.replacement_costs(inventory)
        sums = np.bincount(self.archetype_index, cost, minlength=len(self.portfolio.archetypes))
        return dict(zip(self.portfolio.archetypes, sums.tolist(), strict=True))


@suggests_names
def portfolio(
    inventory: pd.DataFrame,
    archetype_of: Rule | None = None,
    *,
    archetypes: Mapping[str, Archetype] | None = None,
    limits: Mapping[str, Mapping[str, float]] | None = None,
    building: Callable[[str, str, int], ShearBuilding] = ShearBuilding.from_hazus,
    scatter: Scatter | None = None,
    correlation: Mapping[tuple[str, str], float] | None = None,
    unknown: str = REFUSE,
) -> BuildingStock:
    """Return the portfolio of an inventory: each building gets an archetype.

    Each row of the inventory is one building of the portfolio, even if its `number` of buildings is larger: all
    buildings of the row have the same response history. Use the number as a weight of the results. For shares of
    buildings, give `DamageCounts(number=...)` or `damage_shares(number=...)`. For losses, the replacement cost of a row
    is the cost of all its buildings. Plan areas do not affect drifts, because masses, stiffnesses and strengths of
    Hazus buildings are in proportion to the area.

    Args:
        inventory: The result of a reader of `wd.inventories`, or some of its rows.
        archetype_of: Rule that gives the archetype of each building. None: `HazusRule()`, from structure type, storeys
            and year. A mapping: structure type -> name of the archetype. A function: it gets the inventory and returns
            the name of each building's archetype, or None if it has no archetype. A name is a key of `archetypes`, or a
            Hazus type with design level and storeys, such as "C1M high 5".
        archetypes: Name -> your archetype; its `count` is replaced by the number of buildings with this name.
        limits: Name of the archetype -> damage state -> storey drift ratio limit [1].
        building: Function that returns the building of a Hazus archetype from its type, design level and storeys, such
            as `lambda *of: wd.ShearBuilding.from_hazus(*of, law="hysteretic")`.
        scatter: Scatter of Hazus archetypes, as in an Archetype.
        correlation: Correlation of pairs of scattered parameters [1], as in an Archetype.
        unknown: Treatment of buildings without an archetype: "refuse" (raise an error) or "leave out" (give a warning).
            The message counts these buildings and names some.

    Returns:
        The portfolio, the limits, and the inventory row of each building. Archetypes are in the order of Hazus' table
        (HazusRule), of the mapping, or of the alphabet (function).

    Raises:
        ValueError: If buildings have no archetype, for example because their type is missing or unknown or has other
            numbers of storeys; or if a name is not an archetype.
        TypeError: If an argument is of the wrong kind.

    Example:
        >>> stock = wd.inventories.portfolio(wd.inventories.read_r2d("buildings.csv"))
        >>> list(stock.portfolio.archetypes)
        ['W1 moderate 1', 'C1M high 5']
    """
    if not isinstance(inventory, pd.DataFrame) or "id" not in inventory:
        raise TypeError(
            f"portfolio() takes an inventory, got {type(inventory).__name__}: give the result of a reader, such as "
            "wd.inventories.from_table(table)"
        )
    for argument, given in {"scatter": scatter, "correlation": correlation, "archetypes": archetypes}.items():
        if given is not None and not isinstance(given, Mapping):
            raise TypeError(f"portfolio: {argument} must be a mapping, got {shortened(given)}")
    one_of("choice for unknown=", unknown, (REFUSE, LEAVE_OUT))
    if isinstance(archetype_of, type):
        raise TypeError(
            f"portfolio: archetype_of is the class {archetype_of.__name__} itself: give archetype_of="
            f"{archetype_of.__name__}()"
        )
    own, own_limits = archetypes or {}, limits or {}
    for name, one in own.items():
        if not isinstance(one, Archetype):
            raise TypeError(
                f"portfolio: archetypes[{name!r}] must be an Archetype, such as Archetype(building), got {one!r}"
            )
    named = named_by(HazusRule() if archetype_of is None else archetype_of, inventory)
    is_known = named.code >= 0
    if not is_known.all():
        count = np.count_nonzero(~is_known)
        problem = f"{count:,} of {len(inventory):,} buildings have no archetype: {'; '.join(named.reasons)}"
        if unknown == REFUSE or count == len(inventory):
            raise ValueError(f"portfolio: {problem}. Complete the inventory or the rule, or give unknown={LEAVE_OUT!r}")
        warn_caller(
            f"portfolio: {problem}. These buildings are left out; complete the inventory or the rule to include them"
        )
    counts = np.bincount(named.code[is_known], minlength=len(named.names))
    made: dict[str, Archetype] = {}
    found_limits: dict[str, Mapping[str, float]] = {}
    for name, count in zip(named.names, counts.tolist(), strict=True):
        with of_archetype(name):
            if name in own:
                one = own[name]
                made[name] = Archetype(one.building, count, one.scatter, one.correlation)
            else:
                kind, level, storeys = named.hazus.get(name) or _hazus_parts(name, own)
                made[name] = Archetype(building(kind, level, storeys), count, scatter or {}, correlation or {})
                found_limits[name] = hazus_drift_limits(kind, level)
        if name in own_limits:
            found_limits[name] = own_limits[name]
    # If there are few archetypes, their codes fit into 16 bits; the stable sort of 16-bit numbers takes linear time.
    small = np.int16 if len(made) < 2**15 else np.int32
    order = np.argsort(np.where(is_known, named.code, len(made)).astype(small), kind="stable")
    rows, left_out = np.split(order, [int(is_known.sum())])
    # Copy the ids, because the user may change the inventory in place.
    return BuildingStock(Portfolio(made), found_limits, rows, left_out, inventory["id"].array.copy())


def _hazus_parts(name: str, own: Mapping[str, object]) -> tuple[str, str, int]:
    """Return building type, design level and number of storeys that a name such as "C1M high 5" contains.

    Args:
        name: The name of an archetype.
        own: The user's archetypes by name, for the suggestion of a similar name in the error.
    """
    parts = name.split(" ")
    if len(parts) == 3 and parts[0] in building_types() and parts[1] in DESIGN_LEVELS and parts[2].isdigit():
        return parts[0], parts[1], int(parts[2])
    raise ValueError(
        f"portfolio: the name {name!r} must be a key of archetypes={did_you_mean(name, list(own))}, or a Hazus type "
        "with design level and storeys, such as 'C1M high 5'"
    )
