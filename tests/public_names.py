"""The public names of warpdyn, and what their docstrings and their source say of arguments and errors."""

from __future__ import annotations

import ast
import functools
import inspect
import re
import textwrap
from collections.abc import Iterator
from types import FunctionType, ModuleType
from typing import Any

import warpdyn as wd

MODULES = ("inventories", "kernels", "laws", "plots", "records", "sites", "truth")
# Methods that users call; the others serve the rooms of the package, and follow the names that they are called by.
METHODS = {
    "FilteredNoise": ["motion"],
    "GroundMotion": ["resampled"],
    "HazardCurve": ["from_probabilities", "from_openquake_csv", "from_usgs", "rate_of", "intensity_of"],
    "HazardLogicTree": ["rate_of"],
    "JenningsEnvelope": ["at"],
    "KanaiTajimi": ["spectral_density"],
    "LinearSystem": ["modal"],
    "Lognormal": ["from_mean"],
    "Scene": ["to_json", "from_json"],
    "ShearBuilding": ["from_hazus", "from_capacity", "from_periods", "on_isolators", "with_tuned_mass_damper", "modal"],
    "SpectralAcceleration": ["value", "values"],
    "inventories.BuildingStock": ["buildings", "check", "replacement_costs", "replacement_values"],
    "sites.MotionGrid": ["at"],
    "sites.SpatialCorrelation": ["correlation"],
}
RAISED = ("ValueError", "TypeError")
# Errors that checks could raise, but that what is given cannot bring about, with the reason.
NEVER_RAISED = {
    "ShearBuilding.modal": {
        "ValueError"
    },  # a building whose storeys buckle, or have no stiffness, is refused when made
    "plots.building": {"ValueError"},  # as of ShearBuilding.modal
    "laws.StoreyElement": {"ValueError"},  # it and the next three have no parameter to be wrong
    "laws.Law": {"ValueError"},
    "laws.Device": {"ValueError"},
    "laws.Elastic": {"ValueError"},
}
# Arguments of arrays that are no quantities: indices, rows and ids, and names of structures.
NO_QUANTITIES = {"motion", "site", "earthquake", "record", "rows", "left_out", "id", "labels"}
QUANTITY = re.compile(r"float|ArrayLike|ndarray")
# A unit in brackets: a unit's symbol, "1" or "-" of a ratio, or of what the units are ("units of the curves").
UNIT = re.compile(
    r"(?<!shape )\[(?:[-1%]|(?:the )?units?\b[^\]]*|currency[^\]]*|`units?`|"
    r"(?:1/)?(?:N|kg|m2?|s|g|rad|Hz|km|year|degree)\b[^\]]*)\]"
)
SECTION = re.compile(r"^(Args|Attributes|Returns|Raises|Example):$", re.MULTILINE)


def _public_names() -> Iterator[tuple[str, Any]]:
    """Give every public name of the package and of its modules that is a class or a function, with what it is."""
    for name in wd.__all__:
        if not isinstance(getattr(wd, name), ModuleType):
            yield name, getattr(wd, name)
    for module in MODULES:
        room = getattr(wd, module)
        for name in getattr(room, "__all__", ["source"]):
            yield f"{module}.{name}", getattr(room, name)


EVERY = dict(_public_names())
CALLABLE = {name: each for name, each in EVERY.items() if callable(each)}
CALLED = CALLABLE | {f"{name}.{method}": getattr(EVERY[name], method) for name in METHODS for method in METHODS[name]}


def sections(element: Any) -> dict[str, str]:
    """Return the sections of a docstring by their names, the text before the first one under ""."""
    parts = SECTION.split(inspect.getdoc(element) or "")
    named = zip(parts[1::2], parts[2::2], strict=True)
    return {"": parts[0]} | {name: textwrap.dedent(text.strip("\n")) for name, text in named}


def arguments(element: Any) -> dict[str, str]:
    """Return what a docstring says of each argument (of `first, last: ...` the same of both)."""
    found = {}
    for entry in re.split(r"\n(?=\S)", sections(element).get("Args", "")):
        names, colon, text = entry.partition(": ")
        if colon:
            found |= {name.strip().lstrip("*"): " ".join(text.split()) for name in names.split(",")}
    return found


def parameters(element: Any) -> dict[str, inspect.Parameter]:
    """Return the parameters of a function or of a class's constructor."""
    signature = inspect.signature(element)
    return {name: each for name, each in signature.parameters.items() if name not in ("self", "cls")}


def raised(element: Any) -> set[str]:
    """Return which errors of RAISED the source raises: itself, or in functions of warpdyn that it calls by name."""
    if not isinstance(element, type):
        return _raised(inspect.unwrap(getattr(element, "__func__", element)))
    constructors = [vars(each).get(name) for each in element.__mro__ for name in ("__init__", "__post_init__")]
    return set().union(*(_raised(inspect.unwrap(each)) for each in constructors if isinstance(each, FunctionType)))


@functools.cache
def _raised(function: FunctionType, above: tuple[str, ...] = ()) -> frozenset[str]:
    """Return which errors of RAISED a function's source raises, but for those of functions that are being asked."""
    if not function.__module__.startswith("warpdyn") or function.__qualname__ in above:
        return frozenset()
    found, called = _source_of(function)
    return found.union(*(_raised(each, (*above, function.__qualname__)) for each in called))


@functools.cache
def _source_of(function: FunctionType) -> tuple[frozenset[str], tuple[FunctionType, ...]]:
    """Return which errors of RAISED a function's source raises itself, and the functions that it calls by name."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    except OSError:  # what `dataclass` writes has no source
        return frozenset(), ()
    found, called = set(), []
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and isinstance(node.exc.func, ast.Name):
            found |= {node.exc.func.id} & set(RAISED)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            called.append(inspect.unwrap(function.__globals__.get(node.func.id, print)))
    return frozenset(found), tuple(each for each in called if isinstance(each, FunctionType))


def problems(name: str, element: Any) -> list[str]:
    """Return what the docstring of a class, a function or a method lacks, a sentence each."""
    told, given = sections(element), arguments(element)
    found = []
    if not re.match(r"[A-Z][^\n]*\.(\n\n|\n?$)", told[""]):
        found.append("it begins with no paragraph of one line that is a sentence")
    is_method = name in CALLED and name not in CALLABLE  # the example of its class shows what it does
    if not is_method and ">>> " not in told.get("Example", ""):
        found.append("it has no example")
    for argument, parameter in parameters(element).items():
        if argument not in given:
            found.append(f"it does not describe {argument}")
        elif _is_quantity(argument, parameter) and not UNIT.search(given[argument]):
            found.append(f"it has no unit for {argument}")
    if not any(each.kind is each.VAR_KEYWORD for each in parameters(element).values()):
        found += [f"it describes {argument}, which is none" for argument in given.keys() - parameters(element).keys()]
    missing = {each for each in raised(element) if each not in told.get("Raises", "")} - NEVER_RAISED.get(name, set())
    return found + [f"it does not say when it raises {each}" for each in sorted(missing)]


def _is_quantity(argument: str, parameter: inspect.Parameter) -> bool:
    """Return whether an argument takes numbers that have units, by its annotation."""
    is_named = parameter.kind is parameter.VAR_KEYWORD
    return not is_named and argument not in NO_QUANTITIES and bool(QUANTITY.search(str(parameter.annotation)))
