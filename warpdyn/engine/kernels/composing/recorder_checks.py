"""Checks of users' recorders: they write only their own variables, and their indices fit the shapes.

Warp does not check indices in a kernel. A wrong index would read or overwrite other values, or end the process.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from warpdyn.engine.kernels.composing.names import WRITTEN, live_nodes
from warpdyn.engine.kernels.composing.part_checks import functions_with_slots, refuse
from warpdyn.engine.kernels.composing.source_text import bodies_of, name_of, parsed, source_of
from warpdyn.engine.kernels.composing.user_recorders import Recorder
from warpdyn.engine.kernels.registry import recorders

OF_LANES = ("row", "row64", "indices", "matrix")  # types whose last index is the lane
OTHER_INDICES = ("i", "g", "k", "m", "j")  # loop variables, which are never the index of a sample


def check_recorder(
    recorder: type[Recorder], home: Any, wanted: Sequence[Any], values: Mapping[str, Any], family: str
) -> None:
    """Check which variables a user's recorder writes, and the indices of its variables.

    Args:
        recorder: The class of the recorder.
        home: The module of the skeleton.
        wanted: The parts of the kernel.
        values: Values of the names of constants and types in the kernel.
        family: The family of the structure, "chain", "lumped" or "dense".

    Raises:
        ValueError: If the recorder writes a variable of another recorder, or if an index is wrong.
    """
    flags = {name: bool(value) for name, value in values.items() if name.isupper() and isinstance(value, bool | int)}
    types = {name: kind for name, kind in _types(home, wanted, flags).items() if hasattr(values.get(kind), "_shape_")}
    for slot, function in bodies_of(recorder).items():
        nodes = [node for each in parsed(source_of(function)).body for node in live_nodes(each, flags)]
        for line, fault in _faults(recorder, nodes, wanted, values, family, types):
            refuse(recorder, slot, line, fault)


def _faults(
    recorder: type[Recorder],
    nodes: Sequence[ast.AST],
    wanted: Sequence[Any],
    values: Mapping[str, Any],
    family: str,
    types: Mapping[str, str],
) -> Iterator[tuple[int, str]]:
    """Yield the line and the description of each mistake in the nodes of a function."""
    own = recorder.VARIABLES.get(family, {})
    owners = _owners(recorder, wanted, family)
    within = {id(node.value) for node in nodes if isinstance(node, ast.Attribute | ast.Subscript)}
    read = {id(node.value) for node in nodes if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Load)}
    assigned = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    for node in nodes:
        match node:
            case ast.Name(id=name) if name in WRITTEN and id(node) not in within:
                yield node.lineno, f"uses {name} as a whole; write {name}. and the name of one of its variables"
            case ast.Attribute(value=ast.Name(id=argument), attr=field) if argument in WRITTEN:
                is_own = argument == "output" and field in own
                if not is_own and id(node) not in read:
                    why = "which is not in its VARIABLES"
                    if field in owners:
                        why = f"a variable of recorder {owners[field][0]!r}"
                    listed = ", ".join(f"output.{name}" for name in own) or f"no variable of the family {family!r}"
                    yield node.lineno, f"writes {argument}.{field}, {why}; it may write {listed}"
                elif not is_own and field in owners and not owners[field][1]:
                    owner = owners[field][0]
                    yield node.lineno, f"reads output.{field}, but the scene has no recorder {owner!r}; add it"
            case ast.Subscript() if id(node) not in within:
                root, indices = _indexed(node)
                match root:
                    case ast.Name(id=name) if name in types:
                        fault = _fault_of_index(name, types[name], indices, values)
                    case ast.Attribute(value=ast.Name(id="output"), attr=field) if field in own:
                        count = values["STOREYS"] if own[field].dims else 0
                        fault = _fault_of_output(field, count, indices, values, assigned, family)
                    case _:
                        fault = ""
                if fault:
                    yield node.lineno, fault


def _fault_of_index(name: str, type_name: str, indices: Sequence[ast.expr], values: Mapping[str, Any]) -> str:
    """Return the mistake in the indices of a variable of the kernel; "" if they are right."""
    shape, text = values[type_name]._shape_, f"{name}[{', '.join(map(ast.unparse, indices))}]"
    meant = ", ".join(("i", "j")[-len(shape) :])
    if len(indices) != len(shape):
        return f"indexes {text}, but {name} has {len(shape)} ind{'ex' if len(shape) == 1 else 'ices'}: {name}[{meant}]"
    words = [ast.unparse(each) for each in indices]
    if type_name in OF_LANES and (words[-1] != "j" and (words[-1] in OTHER_INDICES or _is_number(indices[-1], values))):
        return f"indexes {text}, but the last index of {name} is the lane: {name}[{meant}]"
    if type_name == "matrix" and words[0] in ("g", "j"):
        return f"indexes {text}, but the first index of {name} is the storey in the thread: {name}[i, j]"
    for index, size in zip(indices, shape, strict=True):
        if fault := _out_of_range(index, size, values):
            return f"indexes {text}, {fault}"
    return ""


def _fault_of_output(
    field: str,
    count: int,
    indices: Sequence[ast.expr],
    values: Mapping[str, Any],
    assigned: set[str],
    family: str,
) -> str:
    """Return the mistake in the indices of a variable of the recorder; `count` is 0 for one value per sample."""
    words = [ast.unparse(each) for each in indices]
    storey = "g" if family == "chain" else "i"
    meant = f"write output.{field}[{storey}, o]" if count else f"write output.{field}[o]"
    text = f"indexes output.{field}[{', '.join(words)}]"
    if len(indices) != 1 + (count > 0):
        dims = "one value per storey and sample" if count else "one value per sample"
        return f"{text}, but it has {dims} by VARIABLES; {meant}"
    if words[-1] not in {"o", *assigned} and "samples.order[" not in words[-1]:
        return f"{text}, but its last index is the column of the sample; {meant}"
    if not count:
        return ""
    if words[0] in ({"i", "j", "o"} if family == "chain" else {"j", "o"}) - assigned:
        return f"{text}, but its first index is the storey in the building; {meant}"
    fault = _out_of_range(indices[0], count, values)
    return f"{text}, {fault}" if fault else ""


def _out_of_range(index: ast.expr, size: int, values: Mapping[str, Any]) -> str:
    """Return the mistake of a constant index; "" if the index is within the size or not a constant."""
    if not _is_number(index, values):
        return ""
    number = _number(index, values)
    return "" if 0 <= number < size else f"but the index {number} is not in 0 to {size - 1}"


def _is_number(index: ast.expr, values: Mapping[str, Any]) -> bool:
    """Return whether an index consists of numbers and whole constants of the kernel, such as `N - 1`."""
    allowed = (ast.Constant, ast.Name, ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop, ast.expr_context)
    nodes = list(ast.walk(index))
    names = [node.id for node in nodes if isinstance(node, ast.Name)]
    return all(isinstance(node, allowed) for node in nodes) and all(isinstance(values.get(name), int) for name in names)


def _number(index: ast.expr, values: Mapping[str, Any]) -> int:
    return int(eval(ast.unparse(index), {}, dict(values)))


def _indexed(node: ast.Subscript) -> tuple[ast.expr, list[ast.expr]]:
    """Return what is indexed and the indices: (x, [i, j]) for both `x[i, j]` and `x[i][j]`."""
    found: list[ast.expr] = []
    inside: ast.expr = node
    while isinstance(inside, ast.Subscript):
        of_this = inside.slice.elts if isinstance(inside.slice, ast.Tuple) else [inside.slice]
        found, inside = [*of_this, *found], inside.value
    return inside, found


def _owners(recorder: type[Recorder], wanted: Sequence[Any], family: str) -> dict[str, tuple[str, bool]]:
    """Return, for each variable of other recorders, the recorder and whether this kernel has the variable."""
    present = {name_of(part) for part in wanted}
    found: dict[str, tuple[str, bool]] = {}
    for of_family, table in recorders().items():
        for name, variables in table.items():
            for variable in variables if name != recorder.part_name else ():
                is_present = name in present and of_family == family
                if is_present or variable not in found:
                    found[variable] = (name, is_present)
    return found


def _types(home: Any, wanted: Sequence[Any], flags: Mapping[str, bool]) -> dict[str, str]:
    """Return {variable: function} for the variables that are set to the result of a function, as in `x = matrix()`."""
    functions = [*functions_with_slots(home), *(each for part in wanted for each in bodies_of(part).values())]
    found: dict[str, str] = {}
    for function in functions:
        for node in live_nodes(parsed(source_of(function)), flags):
            match node:
                case ast.Assign(targets=[ast.Name(id=name)], value=ast.Call(func=ast.Name(id=type_name), args=[])):
                    found[name] = type_name
    return found
