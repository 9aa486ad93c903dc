"""Lists of all parts of kernels, of their output variables and of the fields of kernel arguments.

A part is a module in one of FOLDERS, or a user's recorder; it contributes statements to the source of a kernel. This
module does not import Warp, and imports a folder only when its parts are needed.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
import re
from types import ModuleType
from typing import Any

from warpdyn.engine.kernels.composing.source_text import name_of, place_of
from warpdyn.engine.kernels.composing.user_recorders import TABLE, USERS
from warpdyn.foundations.core.output_variables import Variable

STRUCTS = ("Control", "Samples", "Structure", "Load", "Output", "History")  # arguments of a kernel
TYPE = re.compile(r"(float|float64|int32|int8|uint64)(\[,*\])?")
FOLDERS = (
    "dampings",
    "control",
    "loads",
    "parts",
    "lumped",
    "stepping",
    "hinges",
    "grids",
    "bilinear_hinges",
    "recorders",
)


def names_in(folder: str) -> list[str]:
    """Return the names of the modules in a folder such as "loads", sorted."""
    package = importlib.import_module(f"{__package__}.{folder}")
    return sorted(each.name for each in pkgutil.iter_modules(package.__path__))


@functools.cache
def _modules_in(folder: str) -> tuple[ModuleType, ...]:
    modules = [importlib.import_module(f"{__package__}.{folder}.{name}") for name in names_in(folder)]
    parts = [module for module in modules if hasattr(module, "wanted")]
    return tuple(sorted(parts, key=lambda part: (getattr(part, "order", 0), part.__name__)))


def parts_in(folder: str) -> tuple[Any, ...]:
    """Return the parts in a folder such as "loads", sorted by their attribute `order`, then by name.

    In the folder "recorders", the users' recorders follow the recorders of warpdyn.
    """
    return _modules_in(folder) + (tuple(USERS.values()) if folder == "recorders" else ())


def skeletons() -> tuple[ModuleType, ...]:
    """Return the modules of all skeletons; a skeleton is the function with the time loop of a kernel."""
    return tuple(importlib.import_module(f"{__package__}.skeletons.{name}") for name in names_in("skeletons"))


def all_parts() -> tuple[Any, ...]:
    """Return the parts of all folders, in the order of FOLDERS and sorted within each folder as in `parts_in`."""
    return tuple(part for folder in FOLDERS for part in parts_in(folder))


@functools.cache
def recorders() -> dict[str, dict[str, dict[str, Variable]]]:
    """Return the output variables of all recorders: {family of the structure: {recorder: {name: variable}}}."""
    for part in _modules_in("recorders"):
        for family, variables in getattr(part, "VARIABLES", {}).items():
            TABLE[family][name_of(part)] = variables
    return TABLE


@functools.cache
def fields(users: tuple[type, ...]) -> dict[str, dict[str, str]]:
    """Return the fields of the argument structs that parts and skeletons of kernels declare: {struct: {field: type}}.

    A type is a text: "float[,]" is a two-dimensional array of the kernel's number type.

    Args:
        users: Recorders of users; Output contains their variables.

    Raises:
        ValueError: If a struct or a type is unknown, or if two parts declare a field with different types.
    """
    found: dict[str, dict[str, str]] = {struct: {} for struct in STRUCTS}
    origin: dict[tuple[str, str], ModuleType] = {}
    modules = [part for folder in FOLDERS for part in _modules_in(folder)]
    for part in (*modules, *skeletons(), *users):
        declared = list(getattr(part, "FIELDS", {}).items())
        variables = [*getattr(part, "VARIABLES", {}).values(), getattr(part, "ADAPTIVE", {})]
        for struct, types in declared + [("Output", outputs_of(each)) for each in variables]:
            if struct not in found:
                raise ValueError(
                    f"{place_of(part, 'FIELDS')}: unknown struct {struct!r}; choose one of {', '.join(found)}"
                )
            for name, type_name in types.items():
                if not TYPE.fullmatch(type_name):
                    raise ValueError(
                        f"{place_of(part, 'FIELDS')}: {struct}.{name} has the unknown type {type_name!r}; "
                        'write "float" (the kernel\'s number type), "float64", "int32", "int8" or "uint64", '
                        'for an array followed by "[]", "[,]" or "[,,]"'
                    )
                if found[struct].setdefault(name, type_name) != type_name:
                    raise ValueError(
                        f"{place_of(part, 'FIELDS')}: {struct}.{name} has the type {type_name!r}, but "
                        f"{found[struct][name]!r} in {place_of(origin[struct, name], 'FIELDS')}; choose another name"
                    )
                origin.setdefault((struct, name), part)
    return found


def outputs_of(variables: dict[str, Variable]) -> dict[str, str]:
    """Return the fields {name: type} of the struct Output for output variables; the last index is the sample.

    The order of the indices is the reverse of that in the dataset.
    """
    return {
        name: ("int32" if variable.is_whole else "float") + f"[{',' * len(variable.dims)}]"
        for name, variable in variables.items()
    }
