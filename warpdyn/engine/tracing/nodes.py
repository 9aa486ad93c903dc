"""Nodes of a recorded computation: scalar expressions, and the text of each operation in a kernel."""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

REAL, TRUTH = "real", "truth"  # kinds of values: float64 and bool


class Operation(NamedTuple):
    """An operation on scalars in a recorded computation.

    Args:
        text: Text of the operation in a kernel, with a placeholder for each argument.
        kind: Kind of the result, REAL or TRUTH.
        function: The NumPy function, for constants.
        takes: Kind of the arguments; None: the first is a truth value and the others are real numbers, as in `where`.
    """

    text: str
    kind: str
    function: Callable[..., object]
    takes: str | None = REAL


OPERATIONS = {
    "add": Operation("{} + {}", REAL, np.add),
    "subtract": Operation("{} - {}", REAL, np.subtract),
    "multiply": Operation("{} * {}", REAL, np.multiply),
    "divide": Operation("{} / {}", REAL, np.divide),
    # A factor of -1 costs nothing; Warp writes -x as a subtraction from zero.
    "negative": Operation("wp.float64(-1.0) * {}", REAL, np.negative),
    "absolute": Operation("wp.abs({})", REAL, np.absolute),
    "sqrt": Operation("wp.sqrt({})", REAL, np.sqrt),
    "exp": Operation("wp.exp({})", REAL, np.exp),
    "log": Operation("wp.log({})", REAL, np.log),
    "power": Operation("wp.pow({}, {})", REAL, np.power),
    "ceil": Operation("wp.ceil({})", REAL, np.ceil),
    "floor": Operation("wp.floor({})", REAL, np.floor),
    "rint": Operation("wp.rint({})", REAL, np.rint),
    "minimum": Operation("wp.min({}, {})", REAL, np.minimum),
    "maximum": Operation("wp.max({}, {})", REAL, np.maximum),
    "ndtr": Operation("wp.float64(0.5) * wp.erfc(wp.float64(-0.7071067811865476) * {})", REAL, ndtr),
    "less": Operation("{} < {}", TRUTH, np.less),
    "less_equal": Operation("{} <= {}", TRUTH, np.less_equal),
    "greater": Operation("{} > {}", TRUTH, np.greater),
    "greater_equal": Operation("{} >= {}", TRUTH, np.greater_equal),
    "equal": Operation("{} == {}", TRUTH, np.equal),
    "not_equal": Operation("{} != {}", TRUTH, np.not_equal),
    "isfinite": Operation("wp.isfinite({})", TRUTH, np.isfinite),
    "isnan": Operation("wp.isnan({})", TRUTH, np.isnan),
    "logical_and": Operation("wp.where({}, {}, bool(False))", TRUTH, np.logical_and, TRUTH),
    "logical_or": Operation("wp.where({}, bool(True), {})", TRUTH, np.logical_or, TRUTH),
    "logical_not": Operation("not {}", TRUTH, np.logical_not, TRUTH),
    "where": Operation("wp.where({}, {}, {})", REAL, np.where, None),
}


class Node:
    """A value of a recorded computation; equal operations on the same nodes are represented by one node.

    Args:
        operation: Key of OPERATIONS, "constant", "input", or the name of a device function.
        arguments: Nodes that the operation reads.
        kind: REAL or TRUTH.
        value: The value of a constant, or the text of an input.
        varies: Whether the value may differ between structures.
    """

    __slots__ = ("__weakref__", "arguments", "kind", "operation", "value", "varies")

    def __init__(self, operation: str, arguments: tuple[Node, ...], kind: str, value: object, varies: bool) -> None:
        self.operation, self.arguments, self.kind, self.value = operation, arguments, kind, value
        self.varies = varies

    @property
    def is_constant(self) -> bool:
        """Whether the value of the node is known when the computation is recorded."""
        return self.operation == "constant"


_known: weakref.WeakValueDictionary[tuple[object, ...], Node] = weakref.WeakValueDictionary()


def _node(
    operation: str, arguments: tuple[Node, ...], kind: str, value: object, key: object, varies: bool | None = None
) -> Node:
    place = operation, tuple(map(id, arguments)), kind, key
    found = _known.get(place)
    if found is None:
        varies = any(each.varies for each in arguments) if varies is None else varies
        found = _known[place] = Node(operation, arguments, kind, value, varies)
    return found


def constant(value: object) -> Node:
    """Return the node of a constant, which is a number or a truth value."""
    if isinstance(value, bool | np.bool_):
        return _node("constant", (), TRUTH, bool(value), bool(value))
    number = float(value)  # type: ignore[arg-type]
    return _node("constant", (), REAL, number, number.hex() + str(math.copysign(1.0, number)))


def given(text: str, kind: str = REAL, *, varies: bool = True) -> Node:
    """Return the node of an input, which the kernel reads by this text, such as "z[3]"."""
    return _node("input", (), kind, text, text, varies)


def called(function: str, *arguments: Node) -> Node:
    """Return the node of a call of a device function with these arguments; its result is a real number."""
    return _node(function, tuple(as_real(each) for each in arguments), REAL, None, None)


def as_real(node: Node) -> Node:
    """Return the node of a truth value converted to 1 or 0; return the node of a real number unchanged."""
    return node if node.kind == REAL else apply("where", node, constant(1.0), constant(0.0))


def as_truth(node: Node) -> Node:
    """Return a node for whether a real number differs from 0; return the node of a truth value unchanged."""
    return node if node.kind == TRUTH else apply("not_equal", node, constant(0.0))


def apply(name: str, *arguments: Node) -> Node:
    """Return the node for the result of an operation (a key of OPERATIONS) on nodes.

    Operations on constants are computed at once, and operations without effect, such as adding 0, are omitted.
    """
    operation = OPERATIONS[name]
    if operation.takes is None:
        condition, first, second = as_truth(arguments[0]), *arguments[1:]
        if condition.is_constant:
            return first if condition.value else second
        if first is second:
            return first
        if first.kind == second.kind == TRUTH:
            yes, no = apply("logical_and", condition, first), apply("logical_not", condition)
            return apply("logical_or", yes, apply("logical_and", no, second))
        arguments = condition, as_real(first), as_real(second)
    else:
        convert = as_real if operation.takes == REAL else as_truth
        arguments = tuple(map(convert, arguments))
    if all(each.is_constant for each in arguments):
        with np.errstate(all="ignore"):
            return constant(operation.function(*(each.value for each in arguments)))
    if name == "logical_not" and arguments[0].operation == "logical_not":
        return arguments[0].arguments[0]
    if name in ("logical_and", "logical_or"):
        decided = name == "logical_or"  # value that decides the result alone
        for one, other in (arguments, arguments[::-1]):
            if one.is_constant:
                return one if one.value is decided else other
    if name in ("less", "greater", "not_equal") and arguments[0] is arguments[1]:
        return constant(False)  # NaN is refused before
    if name == "multiply" and any(each.is_constant and each.value == 0 for each in arguments):
        return constant(0.0)
    neutral = {"multiply": 1.0, "add": 0.0}.get(name)
    if neutral is not None:
        for one, other in (arguments, arguments[::-1]):
            if one.is_constant and one.value == neutral:
                return other
    if name in ("divide", "subtract") and arguments[1].is_constant and arguments[1].value == float(name == "divide"):
        return arguments[0]
    return _node(name, arguments, operation.kind, None, None)
