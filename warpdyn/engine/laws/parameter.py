"""Parameters of structures: their units, bounds and defaults, and the recognition of misspelt names."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from warpdyn.foundations.core.checks import checked_text, real_number, true_or_false

# Units that are refused, and the SI unit to use instead: kernels do not convert units.
NOT_SI = {
    **{f"{prefix}N": "N" for prefix in ("k", "M", "G")},
    **{f"{prefix}Pa": "Pa" for prefix in ("k", "M", "G")},
    **dict.fromkeys(("mm", "cm", "km", "in", "ft"), "m"),
    **dict.fromkeys(("t", "g", "tonne", "tonnes", "lb"), "kg"),
    **dict.fromkeys(("kip", "kips", "lbf"), "N"),
    **dict.fromkeys(("ms", "min", "h"), "s"),
    **dict.fromkeys(("%", "percent"), "1"),
    **dict.fromkeys(("deg", "degree", "degrees"), "rad"),
}


@dataclass(frozen=True)
class Parameter:
    """A parameter of a structure: units, bounds, default and names.

    Args:
        units: UDUNITS string.
        long_name: Description in datasets.
        low: Lower bound [`units`].
        high: Upper bound [`units`].
        low_open: Whether the lower bound itself is forbidden.
        high_open: Whether the upper bound itself is forbidden.
        default: Default value [`units`]; None: the parameter is required.
        often_in_percent: Whether users often give the value in percent; the error message then suggests the ratio.
        opensees: OpenSees' name of the parameter, or the formula for OpenSees' parameter.
        optional: Text for the docstring: the value that is used if an optional parameter is omitted.

    Raises:
        ValueError, TypeError: If a unit is not an SI unit, a bound is not a number, a text is not a string, a flag is
            not True or False, or no value is within the bounds.

    Example:
        >>> stiffness = wd.laws.Parameter("N m-1", "storey stiffness", low=0.0, low_open=True)
        >>> stiffness.allowed
        'finite and above 0'
    """

    units: str
    long_name: str
    low: float = -np.inf
    high: float = np.inf
    low_open: bool = False
    high_open: bool = False
    default: float | None = None
    often_in_percent: bool = False
    opensees: str = ""
    optional: str = ""

    def __post_init__(self) -> None:
        for name in ("units", "long_name", "opensees", "optional"):
            checked_text(f"Parameter.{name}", getattr(self, name))
        for unit in re.findall(r"[A-Za-z%]+", self.units):
            if unit in NOT_SI:
                raise ValueError(
                    f"Parameter.units is {self.units!r}, but values of parameters are in SI units: use "
                    f"{NOT_SI[unit]!r} instead of {unit!r}, and convert the values"
                )
        for name in ("low_open", "high_open", "often_in_percent"):
            true_or_false(f"Parameter.{name}", getattr(self, name))
        for name in ("low", "high", "default"):
            value = getattr(self, name)
            is_open = value is None if name == "default" else isinstance(value, float) and abs(value) == np.inf
            if not is_open:
                real_number(f"Parameter.{name}", value)
        if self.low > self.high or (self.low == self.high and (self.low_open or self.high_open)):
            raise ValueError(f"no value is allowed: low is {self.low:g} and high is {self.high:g}; give low below high")

    def violations(self, values: np.ndarray) -> np.ndarray:
        """Return a mask of the values that are not finite or are outside the bounds of the parameter."""
        below = values <= self.low if self.low_open else values < self.low
        above = values >= self.high if self.high_open else values > self.high
        return ~np.isfinite(values) | below | above

    def first_violation(
        self,
        name: str,
        values: np.ndarray,
        axes: tuple[str, ...],
        structures: np.ndarray | None = None,
        taken: np.ndarray | None = None,
        names: Sequence[str] | None = None,
    ) -> str | None:
        """Return a sentence about the first value outside the bounds and its position along `axes`, or None.

        Args:
            name: Name of the parameter.
            values: Values of the parameter.
            axes: Names of the axes, such as ("structure", "storey").
            structures: Indices of the structures along the first axis; None: 0, 1, 2 ...
            taken: Mask or indices along the last axis of the storeys whose law has the parameter; None: all storeys.
            names: Names along the second of two axes; None: storeys are counted from 1.
        """
        counted = values if taken is None else values[..., taken]
        if not self.violations(np.array([counted.min(), counted.max()])).any():  # the bounds are an interval
            return None
        bad = self.violations(values) & (True if taken is None else taken)
        place = np.argwhere(bad)[0]
        index = place if structures is None else [structures[place[0]], *place[1:]]
        numbers = [i + (axis == "storey") for axis, i in zip(axes, index, strict=True)]
        if names is not None and len(axes) > 1:
            numbers[1] = repr(names[int(index[1])])
        where = ", ".join(f"{axis} {number}" for axis, number in zip(axes, numbers, strict=True))
        value = values[tuple(place)]
        is_percent = self.often_in_percent and structures is None and self.high < value <= 100  # not for random draws
        meant = f"; {value:g} % is {value / 100:g}" if is_percent else ""
        return f"{name} is {value:g}{' at ' if where else ''}{where}; it must be {self.allowed}{meant}"

    @property
    def allowed(self) -> str:
        """The bounds in words, such as "finite and above 0"."""
        bounds = []
        if np.isfinite(self.low):
            bounds.append(f"{'above' if self.low_open else 'at least'} {self.low:g}")
        if np.isfinite(self.high):
            bounds.append(f"{'below' if self.high_open else 'at most'} {self.high:g}")
        return " and ".join(["finite", *bounds])

    @property
    def description(self) -> str:
        """A line for the docstring of a law: meaning, units, bounds, default and OpenSees' name of the parameter."""
        bounds = "" if self.allowed == "finite" else f", {self.allowed.removeprefix('finite and ')}"
        default = f"; {self.optional} by default" if self.optional else ""
        default = default if self.default is None else f"; {self.default:g} by default"
        opensees = f" (OpenSees: {self.opensees})" if self.opensees else ""
        return f"{self.long_name} [{self.units}]{bounds}{default}{opensees}."


def names_of(parameters: Mapping[str, Parameter]) -> dict[str, str]:
    """Return the known names of parameters: {name in warpdyn or OpenSees: name in warpdyn}."""
    theirs: dict[str, str] = {}
    beside: dict[str, str] = {}
    for name, known in parameters.items():
        # "s2 over s1" is a ratio to the first yield point, whose force is `yield_force`.
        own, _, under = known.opensees.partition(" over ")
        theirs |= {word: name for word in re.findall(r"\w+", own) if word not in ("and", "times")}
        if "yield_force" in parameters:
            beside |= dict.fromkeys(re.findall(r"\w+", under), "yield_force")
    return beside | theirs | {name: name for name in parameters}
