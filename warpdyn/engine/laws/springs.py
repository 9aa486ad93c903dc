"""Sets of device functions of storey laws (variants), and combinations of variants.

The arguments of a device function are the storey drift [m], the memory and the coefficients of the law, both as short
vectors; it returns, for example, a force [N]. The coefficients are computed once per structure, so that the time loop
needs no divisions.

The plan of a kernel contains an object of one of the classes below. The objects consist of names and texts, so that
they can be compared, hashed and pickled; `spring_row` imports Warp and returns the functions.
"""

from __future__ import annotations

import functools
import importlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from warpdyn.engine.laws.spring import Spring
    from warpdyn.engine.laws.written.source import Written


@dataclass(frozen=True)
class Variant:
    """One set of device functions of a storey law, damper or stop; several laws may share a set.

    Args:
        name: Unique name of the variant.
        coefficients: Names of the coefficients that the functions read, in their order.
        module: Module whose table SPRINGS contains the functions; "" if they are written in a class body.
        written: The device functions from a class body.
    """

    name: str
    coefficients: tuple[str, ...]
    module: str = ""
    written: Written | None = None

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True)
class SideBySide:
    """A storey law and a damper or stop that act in parallel in a storey; their forces are added.

    Args:
        first: The law of the storey.
        second: The damper or stop.
    """

    first: StoreyRules
    second: Variant

    def __str__(self) -> str:
        return f"{self.first}+{self.second}"


@dataclass(frozen=True)
class OneOrOther:
    """The laws of a building whose storeys have different laws.

    Args:
        first: The law of the storeys whose first coefficient is 0.
        other: The law of the other storeys; or another OneOrOther, whose first coefficient selects the law.
    """

    first: Variant
    other: Variant | OneOrOther

    def __str__(self) -> str:
        return f"{self.first}|{self.other}"


StoreyRules = Variant | SideBySide | OneOrOther


def is_mixed(rules: StoreyRules) -> bool:
    """Return whether the storeys of a building have different laws; dampers and stops do not matter."""
    return isinstance(rules, OneOrOther) or (isinstance(rules, SideBySide) and is_mixed(rules.first))


def number_of_coefficients(rules: StoreyRules) -> int:
    """Return the number of coefficients that device functions read."""
    if isinstance(rules, SideBySide):
        return number_of_coefficients(rules.first) + len(rules.second.coefficients)
    if isinstance(rules, OneOrOther):
        return 1 + max(len(rules.first.coefficients), number_of_coefficients(rules.other))
    return len(rules.coefficients)


@functools.cache
def spring_row(rules: StoreyRules) -> Spring:
    """Return the device functions of a variant, or of laws combined with dampers or stops; each is made only once.

    Raises:
        TypeError: If built-in device functions read a different number of coefficients than their law provides.
    """
    if isinstance(rules, SideBySide):
        from warpdyn.engine.laws.combined_springs import side_by_side

        return side_by_side(str(rules), spring_row(rules.first), spring_row(rules.second))
    if isinstance(rules, OneOrOther):
        from warpdyn.engine.laws.combined_springs import one_or_other

        return one_or_other(str(rules), spring_row(rules.first), spring_row(rules.other))
    if rules.written is not None:
        from warpdyn.engine.laws.written.device_functions import written_spring

        return written_spring(rules.name, rules.written)
    spring: Spring = importlib.import_module(rules.module).SPRINGS[rules.name]
    if spring.coefficients != len(rules.coefficients):
        raise TypeError(
            f"device functions {rules.name!r} read {spring.coefficients} coefficients, but their law "
            f"names {len(rules.coefficients)} ({', '.join(rules.coefficients)}): correct `coefficients` of the "
            f"Spring in {rules.module}, or the names in the law"
        )
    return spring
