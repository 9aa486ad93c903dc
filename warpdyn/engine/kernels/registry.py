"""Which parts there are, found by listing the folders that hold them; and what they declare beside their statements.

Nothing here needs warp, and no more than the folder asked for is imported.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
from types import ModuleType

from warpdyn.foundations.core.output_variables import Variable

FOLDERS = ("dampings", "loads", "parts", "stepping", "recorders")


def names_in(folder: str) -> list[str]:
    """Return the names of a folder's modules."""
    package = importlib.import_module(f"{__package__}.{folder}")
    return sorted(each.name for each in pkgutil.iter_modules(package.__path__))


@functools.cache
def parts_in(folder: str) -> tuple[ModuleType, ...]:
    """Return the parts of a folder, in the order in which they stand in a slot."""
    modules = [importlib.import_module(f"{__package__}.{folder}.{name}") for name in names_in(folder)]
    parts = [module for module in modules if hasattr(module, "wanted")]
    return tuple(sorted(parts, key=lambda part: (getattr(part, "order", 0), part.__name__)))


def all_parts() -> tuple[ModuleType, ...]:
    """Return every part there is, in the order in which they stand in a slot."""
    return tuple(part for folder in FOLDERS for part in parts_in(folder))


def recorders() -> dict[str, dict[str, dict[str, Variable]]]:
    """Return the variables that each recorder fills, by the structure's family and the recorder's name."""
    found: dict[str, dict[str, dict[str, Variable]]] = {"chain": {}, "dense": {}}
    for part in parts_in("recorders"):
        for family, variables in getattr(part, "VARIABLES", {}).items():
            found[family][part.__name__.rpartition(".")[2]] = variables
    return found


@functools.cache
def fields() -> dict[str, dict[str, str]]:
    """Return the fields of the structs that kernels take, as parts and skeletons declare them, with types in words.

    Raises:
        ValueError: If two of them disagree on a field's type.
    """
    skeletons = [importlib.import_module(f"{__package__}.skeletons.{name}") for name in names_in("skeletons")]
    declared = [struct for part in (*all_parts(), *skeletons) for struct in getattr(part, "FIELDS", {}).items()]
    declared += [("Output", outputs_of(variables)) for rows in recorders().values() for variables in rows.values()]
    declared += [("Output", outputs_of(getattr(part, "ADAPTIVE", {}))) for part in parts_in("recorders")]
    found: dict[str, dict[str, str]] = {}
    for struct, types in declared:
        for name, type_name in types.items():
            if found.setdefault(struct, {}).setdefault(name, type_name) != type_name:
                raise ValueError(f"{struct}.{name} is {found[struct][name]} to one part and {type_name} to another")
    return found


def outputs_of(variables: dict[str, Variable]) -> dict[str, str]:
    """Return the fields of Output that hold some variables: the last index is the sample's."""
    return {
        name: ("int32" if variable.is_whole else "float") + ("[,]" if variable.dims else "[]")
        for name, variable in variables.items()
    }
