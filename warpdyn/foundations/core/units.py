"""Standard gravity, units of variables, and the conversion of numbers with units (of the package pint) to SI units."""

from __future__ import annotations

import re
from typing import Any

STANDARD_GRAVITY = 9.80665  # m/s2, exact by definition (CGPM 1901)
# Comment of every variable in g, because UDUNITS reads "g" as gram.
IN_G = f"g is standard gravity, {STANDARD_GRAVITY} m s-2"


def unit_attributes(units: str, comment: str = "") -> dict[str, str]:
    """Return the attributes of a variable: `units` (a UDUNITS string, or "g") and, unless it is empty, `comment`."""
    words = "; ".join(part for part in (IN_G if units == "g" else "", comment) if part)
    return {"units": units} | ({"comment": words} if words else {})


# Unit in the description of an argument -> its powers of mass, length and time; an angle has no dimension.
DIMENSIONS = {
    "kg": (1, 0, 0),
    "m": (0, 1, 0),
    "s": (0, 0, 1),
    "N": (1, 1, -2),
    "g": (0, 1, -2),
    "rad": (0, 0, 0),
    "1": (0, 0, 0),
    "Hz": (0, 0, -1),
}
_BASES = ("[mass]", "[length]", "[time]")


def has_units(values: object) -> bool:
    """Return whether a value is a quantity of pint, a list that contains one, or an xarray array of quantities."""
    if isinstance(values, list | tuple):
        return any(map(has_units, values))
    inner = getattr(values, "data", None) if hasattr(values, "dims") else values
    return hasattr(inner, "to_base_units") and hasattr(inner, "dimensionality")


def without_units(what: str, values: Any, units: str | None) -> Any:
    """Return quantities of pint as numbers in SI units (in g if `units` is "g"); return other values unchanged.

    NumPy would drop the unit of a quantity, so that 300 kN would become 300 N.

    Args:
        what: Name of the argument, which may end in its unit in brackets: "step [s]".
        values: Value of the argument.
        units: Unit of the argument, such as "N m-1"; None: the unit in brackets at the end of `what`.

    Raises:
        ValueError: If a quantity has another dimension than the argument, or the unit of the argument is not known.
    """
    if not has_units(values):
        return values
    if isinstance(values, list | tuple):
        return [without_units(what, each, units) for each in values]
    quantity = values.data if hasattr(values, "dims") else values
    bracket = re.search(r"\[([^\]]+)\]$", what)
    if units is None and bracket is not None:
        units = bracket[1]
    expected = _powers(units)
    if units is None or expected is None:
        raise ValueError(
            f"{what} has the unit {quantity.units}, but takes plain numbers here: convert to SI units and give "
            "values.to_base_units().magnitude"
        )
    found = dict(quantity.dimensionality)
    if found != {base: power for base, power in zip(_BASES, expected, strict=True) if power}:
        raise ValueError(
            f"{what} must have a unit such as {units}, but has {quantity.units}: correct the unit of the quantity"
        )
    converted = quantity.to_base_units().magnitude
    return converted / STANDARD_GRAVITY if units == "g" else converted


def _powers(units: str | None) -> tuple[int, ...] | None:
    """Return the powers of mass, length and time of a unit such as "N m-1" or "m/s2"; None if the unit is unknown."""
    total = [0, 0, 0]
    for slash, symbol, power in re.findall(r"(/?)\s*([A-Za-z]+|1)\^?(-?\d+)?", units or "?"):
        if symbol not in DIMENSIONS:
            return None
        sign = -1 if slash else 1
        total = [all_ + sign * int(power or 1) * each for all_, each in zip(total, DIMENSIONS[symbol], strict=True)]
    return tuple(total) if units and re.search(r"\w", units) else None
