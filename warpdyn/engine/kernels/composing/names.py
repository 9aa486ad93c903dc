"""Find the names in the functions of kernel parts: variables that are read, assigned or changed, and slots.

A part is a module or class whose functions contribute statements to a kernel, at places called slots.
"""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from warpdyn.engine.kernels.composing.source_text import SLOT, bodies_of, parsed, source_of

# Arguments of a kernel -> their structs; a part may write to fields of the last two.
STRUCTS = {
    "control": "Control",
    "samples": "Samples",
    "structures": "Structure",
    "loads": "Load",
    "output": "Output",
    "history": "History",
}
WRITTEN = ("output", "history")
Lines = dict[str, int]  # name -> first line of the function in which it occurs


class Body(NamedTuple):
    """The names in one function of a kernel part, with the lines in which they occur."""

    reads: Lines
    assigned: Lines  # variables that are set, as in `x = 1`
    changed: Lines  # variables that are changed, as in `x[i] = 1` or `x += 1`
    loops: Lines  # loop variables
    slots: Lines  # slots in the function
    fields: dict[tuple[str, str], int]  # (argument of the kernel, field) -> line
    faults: dict[str, int]  # message of another mistake -> line


@functools.cache
def facts_of(part: Any, skeleton: str) -> dict[str, Body]:
    """Return the names in each function of a kernel part: {slot: names}.

    Branches that do not exist with this skeleton (the function with the time loop) are ignored.
    """
    flags = dict.fromkeys(("EXPLICIT_CHAIN", "IMPLICIT_CHAIN", "EXPLICIT_LUMPED", "DENSE", "PROPAGATED"), False)
    flags = flags | {skeleton.upper(): True} if skeleton.upper() in flags else {}
    return {slot: names_in_function(function, flags) for slot, function in bodies_of(part).items()}


def names_in_function(function: Callable, flags: Mapping[str, bool]) -> Body:
    """Return the names in a function, without names in branches that never run; `flags` is {condition: its value}."""
    text = source_of(function)
    definition = parsed(text)
    body = Body({}, {}, {}, {}, {}, {}, {})
    lines = text.splitlines()

    def add(found: dict[Any, int], name: Any, node: ast.AST) -> None:
        found.setdefault(name, node.lineno)

    def see(node: ast.AST) -> None:
        match node:
            case ast.Name():
                add(body.reads, node.id, node)
            case ast.If():
                is_true = _settled(node.test, flags)
                if is_true is None:
                    see(node.test)
                for each in (node.body if is_true is not False else []) + (node.orelse if is_true is not True else []):
                    see(each)
            case ast.IfExp():
                is_true = _settled(node.test, flags)
                for each in (node.test,) * (is_true is None) + (node.body,) * (is_true is not False):
                    see(each)
                if is_true is not True:
                    see(node.orelse)
            case ast.For():
                for name in ast.walk(node.target):
                    if isinstance(name, ast.Name):
                        add(body.loops, name.id, name)
                for each in (node.iter, *node.body):
                    see(each)
            case ast.Assign() | ast.AugAssign() | ast.AnnAssign():
                for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                    for each in getattr(target, "elts", [target]):
                        see_target(each, is_new=not isinstance(node, ast.AugAssign))
                if node.value is not None:
                    see(node.value)
            case ast.Expr(value=ast.Call(func=ast.Name(id="slot"))):
                found = SLOT.match(lines[node.lineno - 1])
                if found is None:
                    add(body.faults, 'calls slot() in another form: write `slot("name")` alone on one line', node)
                else:
                    add(body.slots, found[2], node)
            case ast.Return() | ast.FunctionDef() | ast.Import() | ast.ImportFrom() | ast.ClassDef():
                add(
                    body.faults,
                    f"has a `{type(node).__name__.lower()}` statement, which the kernel cannot contain: write "
                    "the slot without it",
                    node,
                )
            case ast.Attribute(value=ast.Name(id=name)) if name in STRUCTS:
                add(body.fields, (name, node.attr), node)
            case ast.Expr(value=ast.Constant()):
                pass
            case _:
                for each in ast.iter_child_nodes(node):
                    see(each)

    def see_target(target: ast.expr, *, is_new: bool) -> None:
        if isinstance(target, ast.Name):
            add(body.assigned if is_new else body.changed, target.id, target)
            return
        inside = target
        while isinstance(inside, ast.Subscript):
            see(inside.slice)
            inside = inside.value
        if isinstance(inside, ast.Name):
            add(body.changed, inside.id, target)
        else:
            see(inside)
            root = inside.value if isinstance(inside, ast.Attribute) else inside
            if not (isinstance(root, ast.Name) and root.id in WRITTEN):
                add(body.faults, f"sets {ast.unparse(inside)}, which is an input of the kernel: set a variable", target)

    for statement in definition.body:
        see(statement)
    return body


def live_nodes(node: ast.AST, flags: Mapping[str, bool]) -> Iterator[ast.AST]:
    """Yield a node of a syntax tree and all nodes inside it, except in branches that never run.

    The dictionary `flags` contains the values of conditions in the source of a kernel: {name: value}.
    """
    yield node
    is_true = _settled(node.test, flags) if isinstance(node, ast.If | ast.IfExp) else None
    for field, value in ast.iter_fields(node):
        if (field == "body" and is_true is False) or (field == "orelse" and is_true is True):
            continue
        for each in value if isinstance(value, list) else [value]:
            if isinstance(each, ast.AST):
                yield from live_nodes(each, flags)


def _settled(test: ast.expr, flags: Mapping[str, bool]) -> bool | None:
    """Return the value of a condition if the flags {name: value} determine it, else None."""
    match test:
        case ast.Name(id=name):
            return flags.get(name)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            found = _settled(operand, flags)
            return None if found is None else not found
        case ast.BoolOp(op=op, values=values):
            decides = isinstance(op, ast.Or)
            settled = [_settled(value, flags) for value in values]
            return decides if decides in settled else None if None in settled else not decides
        case _:
            return None
