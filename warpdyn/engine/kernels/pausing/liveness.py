"""Find the variables of a kernel that live across its interval loop, from the syntax tree of its source text.

A scalar lives across the loop if an iteration may read it before it sets it, or if the statements after the loop read
it. A vector or matrix, whose elements are set one by one, lives across the loop if the loop changes it.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Sequence

from warpdyn.engine.kernels.composing.source_text import names_of

LOOP_VARIABLE, PHASE = (
    "interval",
    "interval_from",
)  # variables of the interval loop, and of the loop of phases around it


def interval_loop(function: ast.FunctionDef) -> int:
    """Return the position of the interval loop among the statements of a kernel.

    Raises:
        ValueError: If the kernel has no interval loop.
    """
    for place, statement in enumerate(function.body):
        if isinstance(statement, ast.For) and getattr(statement.target, "id", "") == LOOP_VARIABLE:
            return place
        if isinstance(statement, ast.While) and PHASE in {name.id for name in names_of(statement.test)}:
            return place
    raise ValueError(f"kernel {function.name} has no loop over intervals, so it cannot pause")


def live_names(function: ast.FunctionDef, loop: int) -> set[str]:
    """Return the names whose values at the start of an iteration of the loop can affect the iteration or its results.

    Args:
        function: Syntax tree of the kernel.
        loop: Position of the interval loop among its statements.
    """
    after = _before_all(function.body[loop + 1 :], set(), set())
    return _before(function.body[loop], after, after)


def set_in(statements: Iterable[ast.stmt]) -> set[str]:
    """Return the names of variables that these statements set, as a whole or one element at a time."""
    found: set[str] = set()
    for statement in statements:
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                found.add(node.id)
            elif isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store):
                root: ast.expr = node
                while isinstance(root, ast.Subscript):
                    root = root.value
                if isinstance(root, ast.Name):
                    found.add(root.id)
    return found


def _before_all(statements: Sequence[ast.stmt], after: set[str], left: set[str]) -> set[str]:
    """Return the names that live before a sequence of statements.

    Args:
        statements: The statements.
        after: Names that live after the last statement.
        left: Names that live after the innermost loop around the statements, to which `break` jumps.
    """
    for statement in reversed(statements):
        after = _before(statement, after, left)
    return after


def _before(statement: ast.stmt, after: set[str], left: set[str]) -> set[str]:
    """Return the names that live before a statement; arguments: see `_before_all`."""
    if isinstance(statement, ast.If):
        read = _names_read(statement.test)
        return read | _before_all(statement.body, after, left) | _before_all(statement.orelse, after, left)
    if isinstance(statement, ast.For | ast.While):
        head = _names_read(statement.iter if isinstance(statement, ast.For) else statement.test)
        own = _stored(statement.target) if isinstance(statement, ast.For) else set()
        live = after | head
        while True:  # an iteration may follow another one
            more = live | (_before_all(statement.body, live, after) - own)
            if more == live:
                return live
            live = more
    if isinstance(statement, ast.Break):
        return left
    if isinstance(statement, ast.Assign):
        kills = set().union(*(_stored(target) for target in statement.targets))
        read = _names_read(statement.value).union(*(_names_read(target) for target in statement.targets))
        return (after - kills) | read
    return after | _names_read(statement)


def _stored(target: ast.expr) -> set[str]:
    """Return the variables that an assignment to a target sets as a whole."""
    return {name.id for name in names_of(target) if isinstance(name.ctx, ast.Store)}


def _names_read(syntax: ast.AST) -> set[str]:
    """Return the variables that an expression or a simple statement reads; the target of `x[i] = 1` counts as read."""
    read = {name.id for name in names_of(syntax) if isinstance(name.ctx, ast.Load)}
    if isinstance(syntax, ast.AugAssign):
        read |= {name.id for name in names_of(syntax.target)}
    return read
