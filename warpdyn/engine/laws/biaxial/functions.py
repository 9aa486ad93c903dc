"""Sets of device functions of biaxial laws, and of springs with different biaxial laws.

Deformations, velocities and forces are vectors of two values.
"""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpdyn.engine.laws.springs import OneOrOther, StoreyRules


@dataclass(frozen=True)
class BiaxialFunctions:
    """Device functions of a biaxial law, and the numbers of its coefficients and memory values.

    Args:
        force: `(deformation, velocity, memory, coefficients) -> force [N]`. For laws with `mapping`, the memory is that
            of the last accepted step.
        memory_after: `(deformation, increment, memory, coefficients) -> memory` after a slow step that reached
            `deformation` along a straight path.
        elastic_energy: `(deformation, memory, coefficients) -> elastic energy [J]` of each component.
        coefficients: Number of coefficients.
        memory: Number of memory values; all are 0 before the first step.
        rate: `(velocity, memory, coefficients) -> d(memory)/dt` of laws that follow a differential equation, else None.
        relaxation_rate: `(velocity, memory, coefficients) -> rate [1/s]` at which a deviation of the memory decays.
        mapping: `(deformation, memory, coefficients) -> memory` after an accepted step, else None.
    """

    force: Callable
    memory_after: Callable
    elastic_energy: Callable
    coefficients: int
    memory: int
    rate: Callable | None = None
    relaxation_rate: Callable | None = None
    mapping: Callable | None = None


@wp.func
def keeps_both(driver: Any, memory: Any, c: Any):
    return memory


@wp.func
def moves_not(velocity: Any, memory: Any, c: Any):
    return type(memory)()


@wp.func
def relaxes_not(velocity: Any, memory: Any, c: Any):
    return velocity[0] - velocity[0]


@functools.cache
def biaxial_functions(rules: StoreyRules) -> BiaxialFunctions:
    """Return the device functions of a biaxial law, or of springs with several biaxial laws; each is made only once."""
    if not isinstance(rules, OneOrOther):
        functions: BiaxialFunctions = importlib.import_module(rules.module).SPRINGS[rules.name]  # type: ignore[union-attr]
        return functions
    return _one_or_other(str(rules), biaxial_functions(rules.first), biaxial_functions(rules.other))


def _one_or_other(rules: str, one: BiaxialFunctions, other: BiaxialFunctions) -> BiaxialFunctions:
    """Return the functions of springs that have the first law if their first coefficient is 0, else the other law."""
    C = max(one.coefficients, other.coefficients)
    name = "biaxial_" + rules.replace("|", "_or_")

    def own_coefficients(c: Any):
        own = type(c)()
        for q in range(C):
            own[q] = c[1 + q]
        return own

    own = _device_function(f"{name}_own_coefficients", own_coefficients)

    def of_three(of_one: Callable, of_other: Callable) -> Callable:
        def chosen(driver: Any, memory: Any, c: Any):
            if c[0] == type(c[0])(0.0):
                return of_one(driver, memory, own(c))
            return of_other(driver, memory, own(c))

        return chosen

    def of_four(of_one: Callable, of_other: Callable) -> Callable:
        def chosen(deformation: Any, driver: Any, memory: Any, c: Any):
            if c[0] == type(c[0])(0.0):
                return of_one(deformation, driver, memory, own(c))
            return of_other(deformation, driver, memory, own(c))

        return chosen

    found: dict[str, Any] = {}
    for field in ("force", "memory_after"):
        pair = getattr(one, field), getattr(other, field)
        found[field] = _device_function(f"{name}_{field}", of_four(*pair))
    pair = one.elastic_energy, other.elastic_energy
    found["elastic_energy"] = _device_function(f"{name}_elastic_energy", of_three(*pair))
    for field, absent in {"rate": moves_not, "relaxation_rate": relaxes_not, "mapping": keeps_both}.items():
        pair = getattr(one, field), getattr(other, field)
        if pair != (None, None):
            found[field] = _device_function(f"{name}_{field}", of_three(pair[0] or absent, pair[1] or absent))
    return BiaxialFunctions(coefficients=1 + C, memory=max(one.memory, other.memory), **found)


def _device_function(name: str, function: Callable) -> Callable:
    """Return a device function with this name; names must be unique, because Warp identifies functions by them."""
    function.__qualname__ = name
    return wp.func(function)
