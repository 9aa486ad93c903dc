"""Check the device functions that a user writes in the class body of a law, without compiling them."""

from __future__ import annotations

import ast
from collections.abc import Collection, Mapping

from warpdyn.engine.laws.written.source import Captured

STEP = ("drift", "memory", "c")
#: Arguments of the device functions that warpdyn calls.
ARGUMENTS = {
    "follow": STEP,
    "force": STEP,
    "return_mapping": STEP,
    "elastic_energy": STEP,
    "tangent": ("drift", "increment", "before", "after", "c"),
    "memory_after": ("drift", "increment", "memory", "c"),
    "rate": ("velocity", "memory", "c"),
    "relaxation_rate": ("velocity", "memory", "c"),
    "memory_on_line": STEP,
    "tangent_on_line": STEP,
    "leaves_line": STEP,
}
#: Arguments of the device function of a controller.
OF_CONTROLLERS = {"command": ("measured", "memory", "c")}
#: Functions that return memory values -> number of values that they return before the memory values.
RETURNS_MEMORY = {"command": 1, "follow": 1, "return_mapping": 0, "memory_after": 0, "rate": 0, "memory_on_line": 0}
VECTORS = ("memory", "before", "after", "c", "measured")
LINES = ("memory_on_line", "tangent_on_line", "leaves_line")
PATHS = "follow(drift, memory, c), or rate(velocity, memory, c) with force(drift, memory, c)"


def check_set_of_functions(names: Collection[str], memory: tuple[str, ...]) -> None:
    """Raise a TypeError if a device function of a law is missing, or if two of its functions contradict each other.

    Args:
        names: Names of the device functions in the class body.
        memory: Names of the memory values of the law.
    """
    found = set(names)
    if "follow" in found:
        if more := found & {"force", "return_mapping", "memory_after", "rate"}:
            raise TypeError(
                f"follow already returns force and memory: remove {', '.join(sorted(more))}, or remove follow"
            )
    elif "force" not in found:
        raise TypeError(f"its force is missing: define {PATHS}")
    elif {"rate", "return_mapping"} <= found:
        raise TypeError("it defines rate and return_mapping: define only one of them")
    elif memory and not found & {"rate", "return_mapping"}:
        raise TypeError(f"no function changes its memory ({', '.join(memory)}): define follow(drift, memory, c)")
    if not memory and (unused := found & {"rate", "return_mapping", "memory_after", "relaxation_rate"}):
        raise TypeError(f"{min(unused)} needs memory values: declare them in the class, for example memory = ('slip',)")
    if found & set(LINES) and not set(LINES) <= found:
        raise TypeError(f"{', '.join(LINES)} belong together: define all three, or none of them")


def check_memory(memory: object) -> None:
    """Raise a TypeError if the attribute `memory` of a law is not a tuple of different names."""
    names = memory if isinstance(memory, tuple) else ()
    is_names = isinstance(memory, tuple) and all(isinstance(name, str) and name.isidentifier() for name in names)
    if not is_names or len(set(names)) != len(names):
        raise TypeError(f"memory must be a tuple of different names, such as memory = ('slip',), got {memory!r}")


def check_function(function: Captured, memory: tuple[str, ...]) -> None:
    """Raise a TypeError if the arguments, assignments or returned values of a device function are wrong.

    Args:
        function: The device function.
        memory: Names of the memory values of the law.
    """
    node, name = function.node, function.name
    arguments = argument_names(node)
    expected = (ARGUMENTS | OF_CONTROLLERS).get(name)
    if expected is not None and arguments != expected:
        raise TypeError(f"{name} must have the arguments ({', '.join(expected)}), got ({', '.join(arguments)})")
    for each in ast.walk(node):
        if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store) and each.id in arguments:
            raise at(each, f"{name} assigns to its argument {each.id}: use another name")
        written = each.value if isinstance(each, ast.Attribute | ast.Subscript) else None
        if written is not None and not isinstance(each.ctx, ast.Load) and getattr(written, "id", "") in arguments:  # type: ignore[attr-defined]
            new = f"return the new values, as in `return force, {', '.join(memory) or 'slip'}`"
            instead = "compute other coefficients in derived(p)" if getattr(written, "id", "") == "c" else new
            raise at(each, f"{name} changes {ast.unparse(each)}: {instead}")
        if isinstance(each, ast.FunctionDef | ast.Lambda | ast.ListComp | ast.Try | ast.With) and each is not node:
            raise at(each, f"{name} contains {type(each).__name__}, which a kernel cannot run: rewrite it without it")
    if not _always_returns(node.body):
        raise TypeError(f"{name} does not return a value on every path: end each branch with return")
    if expected is None:
        return
    count = len(memory) + RETURNS_MEMORY[name] if name in RETURNS_MEMORY else 1
    values = (
        ["command" if name in OF_CONTROLLERS else "force"] * RETURNS_MEMORY.get(name, 0) + [*memory]
        if name in RETURNS_MEMORY
        else [f"its {name}"]
    )
    for each in ast.walk(node):
        if isinstance(each, ast.Return):
            found = len(returned(each))
            if found != count:
                raise at(
                    each,
                    f"{name} returns {found} value{'s' * (found != 1)}, but must return {count}: {', '.join(values)}",
                )


def argument_names(node: ast.FunctionDef) -> tuple[str, ...]:
    """Return the names of the positional arguments of a function."""
    return tuple(argument.arg for argument in (*node.args.posonlyargs, *node.args.args))


def returned(node: ast.Return) -> list[ast.expr]:
    """Return the expressions that a return statement returns; an empty list if it returns nothing."""
    if node.value is None:
        return []
    return list(node.value.elts) if isinstance(node.value, ast.Tuple) else [node.value]


def at(node: ast.AST, text: str) -> TypeError:
    """Return a TypeError with this text and the line number of a syntax node in the author's file or notebook cell."""
    return TypeError(f"{text} (line {getattr(node, 'lineno', 1)})")


def _always_returns(body: list[ast.stmt]) -> bool:
    last = body[-1]
    if isinstance(last, ast.If):
        return bool(last.orelse) and _always_returns(last.body) and _always_returns(last.orelse)
    return isinstance(last, ast.Return)


def unknown(kind: str, name: str, known: Mapping[str, object] | tuple[str, ...]) -> str:
    """Return a sentence about an unknown coefficient or memory value (`kind`), with the known names."""
    from warpdyn.foundations.core.near_misses import did_you_mean

    listed = ", ".join(known) or "(none)"
    remedy = "return it from derived(p)" if kind == "coefficient" else "add it to memory = (...)"
    return f"unknown {kind} {name!r}{did_you_mean(name, list(known))}; known: {listed}. Correct the name, or {remedy}"
