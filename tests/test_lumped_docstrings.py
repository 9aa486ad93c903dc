"""Docstrings of the formulas for lumped-parameter structures: complete, with units, errors and examples."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator
from typing import Any

import pytest
from public_names import problems

from warpdyn.model.structures.lumped.foundations.footing import RectangularFooting, Soil

pytestmark = pytest.mark.fast
LUMPED = "warpdyn.model.structures.lumped"
MODULES = (
    f"{LUMPED}.flexural_shear",
    f"{LUMPED}.sticks",
    f"{LUMPED}.contact",
    f"{LUMPED}.tanks",
    f"{LUMPED}.inerters",
    f"{LUMPED}.torsion",
    f"{LUMPED}.foundations.pais_kausel",
    f"{LUMPED}.foundations.gazetas",
    f"{LUMPED}.foundations.period_on_soil",
    f"{LUMPED}.foundations.cones",
)
INTERNAL = ("check_footing", "frequencies")  # public within the package only


def public_functions() -> Iterator[tuple[str, Any]]:
    """Yield each public function of the modules by its full name."""
    for name in MODULES:
        module = importlib.import_module(name)
        for key, element in vars(module).items():
            if (
                inspect.isfunction(element)
                and not key.startswith("_")
                and key not in INTERNAL
                and element.__module__ == name
            ):
                yield f"{name}.{key}", element


FUNCTIONS = dict(public_functions())


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_formula_is_documented(name: str) -> None:
    assert problems(name, FUNCTIONS[name]) == []


@pytest.mark.parametrize("element", [RectangularFooting, Soil])
def test_a_class_is_documented(element: type) -> None:
    assert problems(element.__name__, element) == []


@pytest.mark.parametrize("name", MODULES)
def test_each_module_has_public_functions(name: str) -> None:
    assert any(full.startswith(name) for full in FUNCTIONS)
