"""Reader of component libraries of pelicun, such as FEMA P-58: fragility and repair costs."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from warpdyn.answers.contents.component import ABOVE, ACCELERATION, BELOW, Component, RepairCost
from warpdyn.campaigns.reductions.limits import DRIFT
from warpdyn.foundations.core.checks import shortened
from warpdyn.foundations.core.near_misses import did_you_mean, suggests_names
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.foundations.files.text import read_csv_text

FUNCTION = "read_pelicun_components"
# Demand type of the file -> demand, and factor of each unit to the unit of the demand.
DEMANDS = {
    "Peak Interstory Drift Ratio": (DRIFT, {"unitless": 1.0, "rad": 1.0}),
    "Peak Floor Acceleration": (ACCELERATION, {"g": STANDARD_GRAVITY, "mps2": 1.0}),
}
NEEDED = ("ID", "Demand-Type", "Demand-Unit", "Demand-Offset", "LS1-Theta_0", "LS1-Theta_1")


@suggests_names
def read_pelicun_components(
    fragility: str | os.PathLike, names: Sequence[str], repair: str | os.PathLike | None = None
) -> dict[str, Component]:
    """Read components from the files of a component library of pelicun, such as FEMA P-58.

    pelicun and the Damage and Loss Model Library of SimCenter contain these files (`fragility.csv` and
    `consequence_repair.csv`). warpdyn does not contain them.

    Args:
        fragility: Path of the file of fragility functions.
        names: Identifiers of the components, such as "C.10.11.001a".
        repair: Path of the file of repair consequences, whose rows "<ID>-Cost" are read; None: no costs.

    Returns:
        The components by identifier. Drift ratios belong to the storey. Accelerations with the offset 1 are those of
        the floor above the storey, with the offset 0 those of the floor below. Costs are means per unit [currency of
        the file, such as USD of 2011]: of a normal distribution its first parameter, of a lognormal distribution
        median * exp(deviation^2 / 2).

    Raises:
        ValueError: If an identifier is unknown or incomplete (`Incomplete` = 1), or its demand is neither the drift
            ratio nor the floor acceleration, or a value is wrong. The error names the file and the component.
        FileNotFoundError: If a file does not exist.
        TypeError: If `names` is not a list of identifiers.

    Example:
        >>> text = "ID,Incomplete,Demand-Type,Demand-Unit,Demand-Offset,LS1-Family,LS1-Theta_0,LS1-Theta_1\\n"
        >>> text += "C.1,0,Peak Floor Acceleration,g,1,lognormal,1.5,0.4\\n"
        >>> with open("fragility.csv", "w") as file:
        ...     _ = file.write(text)
        >>> wd.read_pelicun_components("fragility.csv", ["C.1"])["C.1"].place
        'floor_above'
    """
    if isinstance(names, str) or not len(names):
        raise TypeError(f"{FUNCTION}: names must be a list of identifiers, such as ['C.10.11.001a'], got {names!r}")
    functions = _table(fragility, NEEDED)
    costs = None if repair is None else _table(repair, ("ID", "DS1-Theta_0", "DS1-Theta_1"))
    found = {}
    for name in names:
        row = _row_of_component(fragility, functions, name)
        try:
            own = None if costs is None else _row_of_component(repair, costs, f"{name}-Cost")
            found[str(name)] = _component(row, own)
        except ValueError as error:
            raise ValueError(f"{FUNCTION}: component {name!r} of {os.fspath(fragility)}: {error}") from None
    return found


def _table(path: str | os.PathLike, needed: Sequence[str]) -> pd.DataFrame:
    """Return a CSV file as a table of texts, by identifier."""
    text = read_csv_text(FUNCTION, path)
    try:
        table = pd.read_csv(io.StringIO(text), dtype=str, keep_default_na=False)
    except (pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise ValueError(f"{FUNCTION}: {path} is not CSV: {' '.join(str(error).split())}") from None
    for column in needed:
        if column not in table:
            raise ValueError(
                f"{FUNCTION}: {path} has no column {column!r}: give the file fragility.csv and, as repair=, "
                "consequence_repair.csv of the library"
            )
    return table.set_index("ID", drop=False)


def _row_of_component(path: str | os.PathLike | None, table: pd.DataFrame, name: object) -> Mapping[str, str]:
    """Return the row of a component; raise a ValueError if it is unknown or incomplete."""
    if name not in table.index:
        raise ValueError(
            f"{FUNCTION}: {path} has no component {name!r}{did_you_mean(name, table.index.tolist())}; the first of "
            f"{len(table)} is {table.index[0]!r}"
        )
    rows = table.loc[[name]]
    if len(rows) > 1:
        raise ValueError(f"{FUNCTION}: {path} has {len(rows)} rows of the component {name!r}: remove all but one")
    row: Mapping[str, str] = rows.iloc[0].to_dict()
    if row.get("Incomplete", "0").strip() not in ("0", "", "0.0"):
        raise ValueError(
            f"{FUNCTION}: {path}: the component {name!r} is incomplete (Incomplete = 1): values are missing. Give a "
            "Component with your values"
        )
    return row


def _number_in(row: Mapping[str, str], column: str) -> float:
    """Return a number of a row; raise a ValueError that names the column if it is missing."""
    text = row.get(column, "").strip()
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"column {column} must be a number, got {text!r}") from None
    if not np.isfinite(value):
        raise ValueError(f"column {column} must be a finite number, got {text!r}")
    return value


def _component(row: Mapping[str, str], costs: Mapping[str, str] | None) -> Component:
    """Return the component of a row of fragility functions and a row of repair costs."""
    kind = row["Demand-Type"].strip()
    if kind not in DEMANDS:
        raise ValueError(f"the demand {kind!r} is not recorded; allowed: {', '.join(DEMANDS)}")
    demand, factors = DEMANDS[kind]
    unit = row["Demand-Unit"].strip()
    if unit not in factors:
        raise ValueError(f"the unit {unit!r} of the demand is unknown; allowed: {', '.join(factors)}")
    offset = _number_in(row, "Demand-Offset") if row["Demand-Offset"].strip() else 0.0
    if offset not in (0.0, 1.0) or (demand == DRIFT and offset):
        raise ValueError(f"Demand-Offset must be 0, or 1 for floor accelerations, got {offset:g}")
    medians: list[float] = []
    dispersions: list[float] = []
    weights: list[list[float]] = []
    while (state := f"LS{len(medians) + 1}-Theta_0") in row and row[state].strip():
        state = state.removesuffix("-Theta_0")
        family = row.get(f"{state}-Family", "lognormal").strip()
        if family != "lognormal":
            raise ValueError(f"{state}-Family must be 'lognormal', got {family!r}")
        medians.append(factors[unit] * _number_in(row, f"{state}-Theta_0"))
        dispersions.append(_number_in(row, f"{state}-Theta_1"))
        column = f"{state}-DamageStateWeights"
        given = row.get(column, "").strip()
        shares = np.array([_number_in({column: each}, column) for each in given.split("|")] if given else [1.0])
        if abs(shares.sum() - 1) > 1e-3:
            raise ValueError(f"{column} must have the sum 1, got {given!r}")
        weights.append((shares / shares.sum()).tolist())
    place = BELOW if demand == ACCELERATION and offset == 0 else ABOVE
    own, quantity = None, "1"
    if costs is not None:
        own = [_cost(costs, number + 1) for number in range(sum(map(len, weights)))]
        quantity = costs.get("Quantity-Unit", "1").strip() or "1"
    return Component(demand, medians, dispersions, own, weights, place, unit=quantity)


def _cost(row: Mapping[str, str], state: int) -> float | RepairCost:
    """Return the mean cost of a damage state, which is 0 if the file gives none."""
    text = row.get(f"DS{state}-Theta_0", "").strip()
    if not text:
        return 0.0
    family = row.get(f"DS{state}-Family", "").strip()
    if family not in ("normal", "lognormal", ""):
        raise ValueError(f"DS{state}-Family must be 'normal' or 'lognormal', got {family!r}")
    factor = np.exp(0.5 * _number_in(row, f"DS{state}-Theta_1") ** 2) if family == "lognormal" else 1.0
    parts = text.split("|")
    try:
        numbers = [np.array([float(each) for each in part.split(",")]) for part in parts]
    except ValueError:
        raise ValueError(f"DS{state}-Theta_0 must be a number or 'a,b|q1,q2', got {shortened(text)}") from None
    if len(numbers) == 1 and numbers[0].size == 1:
        return float(factor * numbers[0][0])
    if len(numbers) != 2 or numbers[0].size != 2 or numbers[1].size != 2:
        raise ValueError(f"DS{state}-Theta_0 must be a number or 'a,b|q1,q2', got {shortened(text)}")
    return RepairCost((factor * numbers[0]).tolist(), numbers[1].tolist())
