"""Rewrite the device functions that a user writes in a class body as Warp needs them.

Users write `c.yield_force`, `memory.slip`, `2 * drift` and `return force, slip`. Warp needs vector elements and numbers
of the kernel's dtype: `c[0]`, `memory[0]`, `type(drift)(2.0) * drift`, and one vector with all memory values.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Mapping
from types import ModuleType
from typing import Any

from warpdyn.engine.laws.written.checks import (
    RETURNS_MEMORY,
    VECTORS,
    argument_names,
    at,
    check_function,
    returned,
    unknown,
)
from warpdyn.engine.laws.written.measured import MEASURED
from warpdyn.engine.laws.written.source import Captured, Written, captured, device_function
from warpdyn.foundations.core.near_misses import did_you_mean

QUICKER = {("min", 2): "minimum", ("max", 2): "maximum", ("clamp", 3): "clamped"}  # faster than Warp's own on CPUs
EXTREMA = "warpdyn.engine.device.extrema"
MOST_MULTIPLIED = 4  # x**4 is written as x*x*x*x
PYTHON = ("abs", "min", "max", "range", "type", "int", "bool", "True", "False")  # Python names that Warp supports
AFTER = "memory_after_step"
MEASURED_VALUES = "measured"  # argument of the device function of a controller


def written(
    functions: Mapping[str, Captured], memory: tuple[str, ...], available: tuple[str, ...], hidden: str
) -> Written:
    """Check the device functions of a law, and return them as rewritten for Warp.

    Args:
        functions: The functions in the class body: {name: function}.
        memory: Names of the memory values.
        available: Names of the coefficients that the functions may read.
        hidden: Name of the coefficient that only warpdyn's default functions read, or "".

    Raises:
        TypeError: If a function breaks a rule.
    """
    read = {
        each.attr
        for function in functions.values()
        for each in ast.walk(function.node)
        if isinstance(each, ast.Attribute) and getattr(each.value, "id", None) == "c"
    }
    coefficients = tuple(name for name in available if name in read) + ((hidden,) if hidden else ())
    book = _Book(dict(functions), memory, coefficients, available)
    texts: dict[str, str] = {}
    while waiting := [name for name in book.functions if name not in texts]:
        for name in waiting:
            function = book.functions[name]
            check_function(function, memory)
            texts[name] = _Rewriting(function, book).text()
    named = tuple((name, name) for name in functions)
    return Written("\n\n\n".join(texts.values()) + "\n", named, tuple(sorted(book.imports)), coefficients, memory)


class _Book:
    """The device functions of a law, the functions that they call, and the names that the functions may use."""

    def __init__(
        self,
        functions: dict[str, Captured],
        memory: tuple[str, ...],
        coefficients: tuple[str, ...],
        available: tuple[str, ...],
    ) -> None:
        self.functions, self.memory, self.coefficients, self.available = functions, memory, coefficients, available
        self.imports: set[tuple[str, str, str]] = set()

    def imported(self, module: str, name: str) -> str:
        """Record that the rewritten text needs a function of warpdyn, and return the function's name in the text."""
        self.imports.add((f"quick_{name}", module, name))
        return f"quick_{name}"


class _Rewriting(ast.NodeTransformer):
    """Rewrites one device function of a user as Warp needs it."""

    def __init__(self, function: Captured, book: _Book) -> None:
        self.function, self.book, self.node = function, book, copy.deepcopy(function.node)
        self.arguments = argument_names(self.node)
        names = [each for each in ast.walk(self.node) if isinstance(each, ast.Name)]
        self.local = {*self.arguments, *(name.id for name in names if isinstance(name.ctx, ast.Store))}
        loops = [each.target for each in ast.walk(self.node) if isinstance(each, ast.For)]
        self.counters = {target.id for target in loops if isinstance(target, ast.Name)}
        scalars = [name for name in self.arguments if name not in VECTORS]
        self.number = scalars[0] if scalars else f"{'c' if 'c' in self.arguments else self.arguments[0]}[0]"
        self.counts = False  # inside an index or a count, where numbers are integers

    def text(self) -> str:
        """Return the rewritten source text of the function."""
        node = self.node
        node.decorator_list, node.returns = [], None
        for argument in (*node.args.posonlyargs, *node.args.args):
            argument.annotation = ast.Name("Any", ast.Load())
        if ast.get_docstring(node) is not None:
            node.body = node.body[1:]
        node.body = [line for each in node.body for line in _statements(self.visit(each))]
        return ast.unparse(ast.fix_missing_locations(node))

    def visit_Return(self, node: ast.Return) -> Any:
        name, memory = self.function.name, self.book.memory
        if name not in RETURNS_MEMORY or not memory:
            return self.generic_visit(node)
        values = [self.visit(value) for value in returned(node)]
        first, rest = values[: RETURNS_MEMORY[name]], values[RETURNS_MEMORY[name] :]
        lines = [f"{AFTER} = type({'memory' if 'memory' in self.arguments else 'before'})()"]
        lines += [f"{AFTER}[{place}] = {ast.unparse(value)}" for place, value in enumerate(rest)]
        lines.append(f"return {', '.join([*map(ast.unparse, first), AFTER])}")
        return ast.parse("\n".join(lines)).body

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        if isinstance(node.value, bool) or not isinstance(node.value, int | float) or self.counts:
            return node
        return _expression(f"type({self.number})({float(node.value)!r})")

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        value = getattr(node.operand, "value", None)
        if isinstance(node.op, ast.USub) and isinstance(value, int | float) and not isinstance(value, bool):
            return self.visit_Constant(ast.Constant(-value))
        self.generic_visit(node)
        return node

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        if getattr(node.value, "id", None) == "c":
            raise at(node, f"{self.function.name} reads {ast.unparse(node)}: name the coefficient, as in c.stiffness")
        node.value = self.visit(node.value)
        node.slice = self._counted(node.slice)
        return node

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        return self._counted(node) if self._has_counter(node) else self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        if self._has_counter(node):
            return self._counted(node)
        power = getattr(node.right, "value", None) if isinstance(node.op, ast.Pow) else None
        self.generic_visit(node)
        if not isinstance(node.op, ast.Pow):
            return node
        if isinstance(power, int) and 2 <= power <= MOST_MULTIPLIED and isinstance(node.left, ast.Name | ast.Subscript):
            return _expression(f"({' * '.join([ast.unparse(node.left)] * power)})")
        return _expression(f"wp.pow({ast.unparse(node.left)}, {ast.unparse(node.right)})")

    def visit_Call(self, node: ast.Call) -> ast.expr:
        name = ast.unparse(node.func)
        if name in ("type", "int", "range") or (isinstance(node.func, ast.Call) and name.startswith("type(")):
            node.args = [self._counted(argument) for argument in node.args]
            return node
        if name == "float":
            return _expression(f"type({self.number})({ast.unparse(self.visit(node.args[0]))})")
        node.args = [self.visit(argument) for argument in node.args]
        plain = name.removeprefix("wp.") if self._is_warp(node.func) or name in ("min", "max") else ""
        if quicker := QUICKER.get((plain, len(node.args))):
            node.func = ast.Name(self.book.imported(EXTREMA, quicker), ast.Load())
        else:
            node.func = self.visit(node.func)
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        name = getattr(node.value, "id", None)
        if name == "c" and "c" in self.arguments:
            if node.attr not in self.book.available:
                raise at(node, f"{self.function.name}: {unknown('coefficient', node.attr, self.book.available)}")
            return _expression(f"c[{self.book.coefficients.index(node.attr)}]")
        if name == MEASURED_VALUES and name in self.arguments:
            if node.attr not in MEASURED:
                hint = did_you_mean(node.attr, list(MEASURED))
                raise at(
                    node,
                    f"{self.function.name} reads {ast.unparse(node)}, which is not measured{hint}; measured are "
                    f"{', '.join(MEASURED)}",
                )
            return node
        if name in self.local:
            if node.attr not in self.book.memory:
                raise at(node, f"{self.function.name}: {unknown('memory value', node.attr, self.book.memory)}")
            return _expression(f"{name}[{self.book.memory.index(node.attr)}]")
        if self._is_warp(node):
            root = node
            while isinstance(root.value, ast.Attribute):
                root = root.value
            root.value = ast.Name("wp", ast.Load())
            return node
        return self._outer(node)

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id in self.local or isinstance(node.ctx, ast.Store):
            return node
        if node.id in self.book.functions:
            return node
        return self._outer(node)

    def _outer(self, node: ast.Name | ast.Attribute) -> ast.expr:
        """Return the expression that replaces a name whose value is defined outside of the class.

        Raises:
            TypeError: If the name is not defined, or if a kernel cannot use its value.
        """
        words = ast.unparse(node)
        root, *attributes = words.split(".")
        if root not in self.function.values:
            raise at(
                node,
                f"{self.function.name} reads {words}, which is not defined: use an argument, a coefficient such as "
                "c.stiffness, a number, or a device function",
            )
        value = self.function.values[root]
        try:
            for attribute in attributes:
                value = getattr(value, attribute)
        except AttributeError:
            raise at(node, f"{self.function.name} reads {words}, which does not exist: correct the name") from None
        if isinstance(value, int | float):
            return self.visit_Constant(ast.Constant(int(value) if self.counts else value))
        if (function := device_function(value)) is not None:
            module = function.__module__
            if module.startswith("warpdyn."):
                return ast.Name(self.book.imported(module, function.__name__), ast.Load())
            self.book.functions[root] = captured(root, function)
            return ast.Name(root, ast.Load())
        if root in PYTHON and not attributes:
            return node
        hint = f": use wp.{attributes[-1]}" if attributes and callable(value) else ""
        hint = hint or (": decorate it with @wp.func" if callable(value) else ": use a number or a coefficient")
        raise at(node, f"{self.function.name} reads {words} ({type(value).__name__}), which a kernel cannot use{hint}")

    def _is_warp(self, node: ast.expr) -> bool:
        while isinstance(node, ast.Attribute):
            node = node.value
        held = self.function.values.get(getattr(node, "id", ""))
        return isinstance(held, ModuleType) and held.__name__ == "warp" and getattr(node, "id", "") not in self.local

    def _has_counter(self, node: ast.AST) -> bool:
        inner = {name.id for name in ast.walk(node) if isinstance(name, ast.Name)}
        return bool(inner & self.counters) and not inner - self.counters

    def _counted(self, node: Any) -> Any:
        before, self.counts = self.counts, True
        found = self.generic_visit(node) if isinstance(node, ast.Compare | ast.BinOp) else self.visit(node)
        self.counts = before
        return found


def _expression(text: str) -> ast.expr:
    return ast.parse(text, mode="eval").body


def _statements(found: Any) -> list[ast.stmt]:
    return found if isinstance(found, list) else [found]
