"""Arrays for tracing: NumPy functions accept them instead of ndarrays, and their operations are recorded."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np

from warpdyn.engine.tracing.nodes import OPERATIONS, TRUTH, Node, apply, constant, given

# NumPy name of an operation -> equivalent operation that is recorded.
SAME = {
    "bitwise_and": "logical_and",
    "bitwise_or": "logical_or",
    "invert": "logical_not",
    "fabs": "absolute",
    "true_divide": "divide",
}
# NumPy function -> function that records it; filled by `numpy_functions`.
FUNCTIONS: dict[Callable, Callable] = {}
_conditions: ContextVar[list[Node] | None] = ContextVar("conditions", default=None)


class NotTraceableError(TypeError):
    """A function uses an array in a way that cannot be recorded, such as a branch that depends on the values."""


@contextmanager
def conditions() -> Iterator[list[Node]]:
    """Yield a list that collects the conditions which a function tests by `np.any` or `np.all`, such as bounds.

    While the function is recorded, no condition is known; `np.any` returns False and `np.all` returns True.
    """
    found: list[Node] = []
    token = _conditions.set(found)
    try:
        yield found
    finally:
        _conditions.reset(token)


class Traced(np.lib.mixins.NDArrayOperatorsMixin):
    """An array of recorded values; each element is a node of the recorded computation.

    Args:
        nodes: The array of nodes.
    """

    __array_priority__ = 1000

    def __init__(self, nodes: np.ndarray) -> None:
        self.nodes = nodes

    @classmethod
    def inputs(cls, text: Callable[..., str], *shape: int, varies: bool = True) -> Traced:
        """Return an array of values that a kernel reads from its arguments.

        Args:
            text: Function of the index that returns the text of an element in the kernel, such as "z[3]".
            shape: Shape of the array.
            varies: Whether the values may differ between structures.
        """
        nodes = np.empty(shape, object)
        for index in np.ndindex(*shape):
            nodes[index] = given(text(*index), varies=varies)
        return cls(nodes)

    shape = property(lambda self: self.nodes.shape)
    ndim = property(lambda self: self.nodes.ndim)
    size = property(lambda self: self.nodes.size)

    @property
    def dtype(self) -> np.dtype:
        """The type that the recorded values have in a kernel: bool for truth values, else float64."""
        return np.dtype(bool if self.size and self.nodes.flat[0].kind == TRUTH else np.float64)

    T = property(lambda self: Traced(self.nodes.T))

    def __len__(self) -> int:
        return len(self.nodes)

    def __iter__(self) -> Iterator[Traced]:
        return (self[place] for place in range(len(self)))

    def __getitem__(self, index: Any) -> Traced:
        return Traced(boxed(self.nodes[_known_index(index)]))

    def __setitem__(self, index: Any, values: Any) -> None:
        if isinstance(index, Traced):
            raise NotTraceableError("values are set where a condition is true: use numpy.where")
        self.nodes[_known_index(index)] = nodes_of(values)

    def __bool__(self) -> bool:
        if self.size == 1 and self.nodes.flat[0].is_constant:
            return bool(self.nodes.flat[0].value)
        raise NotTraceableError("a branch depends on the values of structures: use numpy.where")

    def __float__(self) -> float:
        raise NotTraceableError("a number is needed, which differs between structures")

    def __array__(self, *arguments: object, **named: object) -> np.ndarray:
        raise NotTraceableError("an array is needed, whose values differ between structures")

    def reshape(self, *shape: Any) -> Traced:
        """Return the recorded values in another shape."""
        return Traced(self.nodes.reshape(*shape))

    def ravel(self) -> Traced:
        """Return the recorded values as an array of one dimension."""
        return Traced(self.nodes.ravel())

    def transpose(self, *axes: Any) -> Traced:
        """Return the recorded values with permuted axes."""
        return Traced(self.nodes.transpose(*axes))

    def astype(self, dtype: Any, copy: bool = True) -> Traced:
        """Return the recorded values in another type, float64 or bool; truth values become 1 and 0 in float64.

        A change from float64 to bool, and other types, are not recorded: they raise a NotTraceableError.
        """
        if np.dtype(dtype) == np.float64:
            return self * 1.0 if self.dtype == bool else self.copy()
        if np.dtype(dtype) != self.dtype:
            raise NotTraceableError(f"values of type {np.dtype(dtype)} are not recorded")
        return self.copy()

    def copy(self) -> Traced:
        """Return a copy of the array of recorded values."""
        return Traced(self.nodes.copy())

    def sum(self, axis: Any = None, keepdims: bool = False) -> Traced:
        """Return the recorded sums along an axis; None: over all axes."""
        return reduced("add", self, axis, keepdims)

    def max(self, axis: Any = None, keepdims: bool = False) -> Traced:
        """Return the recorded largest values along an axis; None: over all axes."""
        return reduced("maximum", self, axis, keepdims)

    def min(self, axis: Any = None, keepdims: bool = False) -> Traced:
        """Return the recorded least values along an axis; None: over all axes."""
        return reduced("minimum", self, axis, keepdims)

    def any(self, axis: Any = None) -> Any:
        """Return whether any value along an axis is true, as recorded values.

        If `axis` is None, assume that no value is true: return False, and let `conditions` collect the condition that
        one is true, under which the recording is not valid.
        """
        return _asked(self, is_any=True) if axis is None else reduced("logical_or", self, axis, False)

    def all(self, axis: Any = None) -> Any:
        """Return whether all values along an axis are true, as recorded values.

        If `axis` is None, assume that all values are true: return True, and let `conditions` collect the condition that
        not all are true, under which the recording is not valid.
        """
        return _asked(self, is_any=False) if axis is None else reduced("logical_and", self, axis, False)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        raise NotTraceableError(f"the attribute {name} of an array is not recorded")

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **named: Any) -> Any:
        name = SAME.get(ufunc.__name__, ufunc.__name__)
        if name == "square":
            return Traced(mapped("multiply", inputs[0], inputs[0]))
        if name == "positive":
            return inputs[0]
        if name == "power" and np.ndim(inputs[1]) == 0 and not isinstance(inputs[1], Traced) and inputs[1] == 2:
            return Traced(mapped("multiply", inputs[0], inputs[0]))
        if name == "expm1" and method == "__call__":
            return _expm1(inputs[0])
        if name not in OPERATIONS:
            raise NotTraceableError(f"numpy.{ufunc.__name__} is not recorded")
        known = {"reduce": {"axis", "keepdims"}, "accumulate": {"axis"}, "__call__": {"where", "out"}}
        if others := named.keys() - known.get(method, set()):
            raise NotTraceableError(f"arguments of numpy.{ufunc.__name__} are not recorded: {', '.join(others)}")
        if method == "reduce":
            return reduced(name, inputs[0], named.get("axis", 0), bool(named.get("keepdims")))
        if method == "accumulate":
            return accumulated(name, inputs[0], named.get("axis", 0))
        if method != "__call__":
            raise NotTraceableError(f"numpy.{ufunc.__name__}.{method} is not recorded")
        found = mapped(name, *inputs)
        where, [out] = named.pop("where", True), named.pop("out", (None,))
        if where is not True:
            rest = constant(np.nan) if out is None else nodes_of(out)
            found = mapped("where", where, Traced(found), Traced(np.asarray(rest)))
        if isinstance(out, Traced):
            out.nodes[...] = found
            return out
        return Traced(found)

    def __array_function__(self, function: Callable, types: Any, given: Any, named: Any) -> Any:
        if function not in FUNCTIONS:
            raise NotTraceableError(f"numpy.{function.__name__} is not recorded")
        record = FUNCTIONS[function]
        try:
            _signature(record).bind(*given, **named)
        except TypeError as error:
            raise NotTraceableError(f"arguments of numpy.{function.__name__} are not recorded: {error}") from error
        return record(*given, **named)


@functools.cache
def _signature(record: Callable) -> inspect.Signature:
    return inspect.signature(record)


def nodes_of(values: Any) -> np.ndarray:
    """Return numbers or recorded values as an array of nodes, with the shape of the values."""
    if isinstance(values, Traced):
        return values.nodes
    if isinstance(values, list | tuple) and any(isinstance(each, Traced) for each in values):
        return stacked(values).nodes
    array = np.asarray(values)
    nodes = np.empty(array.shape, object)
    for index in np.ndindex(array.shape):
        nodes[index] = constant(array[index])
    return nodes


def traced(values: Any) -> Traced:
    """Return numbers or recorded values as an array of recorded values."""
    return values if isinstance(values, Traced) else Traced(nodes_of(values))


def is_traced(*values: Any) -> bool:
    """Return whether any of these values is an array of recorded values (Traced)."""
    return any(isinstance(each, Traced) for each in values)


def may_be_true(condition: Any) -> bool:
    """Return whether a condition may be true for some structure.

    A recorded condition may be true unless it is a constant, because its value is unknown while it is recorded.
    """
    if not isinstance(condition, Traced):
        return bool(np.any(condition))
    return any(not each.is_constant or each.value for each in condition.nodes.ravel())


def boxed(value: Any) -> np.ndarray:
    if isinstance(value, np.ndarray):
        return value
    box = np.empty((), object)
    box[()] = value
    return box


def _known_index(index: Any) -> Any:
    if isinstance(index, Traced) or (isinstance(index, tuple) and is_traced(*index)):
        raise NotTraceableError("values are selected by a condition: use numpy.where")
    return index


def mapped(name: str, *values: Any) -> np.ndarray:
    """Return the nodes of an operation that is applied to each element of several arrays, after broadcasting."""
    arrays: list[Any] = np.broadcast_arrays(*(nodes_of(each) for each in values))  # type: ignore[assignment] # a tuple
    found = np.empty(arrays[0].shape, object)
    for index in np.ndindex(found.shape):
        found[index] = apply(name, *(array[index] for array in arrays))
    return found


def _along(values: Any, axis: Any) -> tuple[np.ndarray, tuple[int, ...]]:
    nodes = nodes_of(values)
    axes = range(nodes.ndim) if axis is None else (axis,) if isinstance(axis, int | np.integer) else axis
    return nodes, tuple(int(each) % nodes.ndim for each in axes)


def reduced(name: str, values: Any, axis: Any, keepdims: bool = False) -> Traced:
    nodes, axes = _along(values, axis)
    kept = [each for each in range(nodes.ndim) if each not in axes]
    rows = nodes.transpose(*kept, *axes).reshape(*(nodes.shape[each] for each in kept), -1)
    found = np.empty(rows.shape[:-1], object)
    for index in np.ndindex(found.shape):
        first, *others = rows[index]
        for other in others:
            first = apply(name, first, other)
        found[index] = first
    return Traced(np.expand_dims(found, axes) if keepdims else found)


def accumulated(name: str, values: Any, axis: int) -> Traced:
    nodes = np.moveaxis(nodes_of(values), axis, 0)
    found = nodes.copy()
    for place in range(1, len(found)):
        found[place, ...] = mapped(name, Traced(boxed(found[place - 1])), Traced(boxed(found[place])))
    return Traced(np.moveaxis(found, 0, axis))


def _asked(values: Any, *, is_any: bool) -> bool:
    nodes = nodes_of(values).ravel()
    if all(each.is_constant for each in nodes):
        return any(each.value for each in nodes) if is_any else all(each.value for each in nodes)
    found = _conditions.get()
    if found is None:
        raise NotTraceableError("a branch depends on whether any structure has a property")
    for each in nodes:
        found.append(each if is_any else apply("logical_not", each))
    return not is_any


def stacked(values: Any, axis: int = 0) -> Traced:
    return Traced(np.stack([nodes_of(each) for each in values], axis=axis))


def _expm1(values: Any) -> Any:
    """Return exp(x) - 1 as recorded values, without loss of digits for small x.

    Kahan's formula is used, because kernels have no function for it.
    """
    power: Any = np.exp(traced(values))
    less = power - 1.0
    # The quotient is (exp(y) - 1) / y for y = log(exp(x) as rounded), which is close to x.
    small = np.where(power == 1.0, values, less * values / np.log(power))
    return np.where(np.isfinite(power), np.where(less == -1.0, -1.0, small), power)
