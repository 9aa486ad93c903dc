"""Arrays of recorded values: NumPy functions accept them in place of arrays and record what they compute."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np

from warpdyn.engine.tracing.nodes import OPERATIONS, TRUTH, Node, apply, constant, given

# NumPy names of operations whose results are other operations.
SAME = {
    "bitwise_and": "logical_and",
    "bitwise_or": "logical_or",
    "invert": "logical_not",
    "fabs": "absolute",
    "fmin": "minimum",
    "fmax": "maximum",
    "true_divide": "divide",
}
_conditions: ContextVar[list[Node] | None] = ContextVar("conditions", default=None)


class NotTraceableError(TypeError):
    """A function uses an array in a way that cannot be recorded, such as a branch that depends on its values."""


@contextmanager
def conditions() -> Iterator[list[Node]]:
    """Collect the conditions that a function tests by `np.any`, such as checks of bounds; each counts as false."""
    found: list[Node] = []
    token = _conditions.set(found)
    try:
        yield found
    finally:
        _conditions.reset(token)


class Traced(np.lib.mixins.NDArrayOperatorsMixin):
    """An array of recorded values.

    Args:
        nodes: The values, an array of nodes.
    """

    __array_priority__ = 1000

    def __init__(self, nodes: np.ndarray) -> None:
        self.nodes = nodes

    @classmethod
    def inputs(cls, text: Callable[..., str], *shape: int, varies: bool = True) -> Traced:
        """Return values that a kernel reads; `text(*index)` is the text of each.

        Args:
            text: Text of an element.
            shape: Shape.
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
        """The type that the values have in a kernel."""
        return np.dtype(bool if self.size and self.nodes.flat[0].kind == TRUTH else np.float64)

    T = property(lambda self: Traced(self.nodes.T))

    def __len__(self) -> int:
        return len(self.nodes)

    def __iter__(self) -> Iterator[Traced]:
        return (self[place] for place in range(len(self)))

    def __getitem__(self, index: Any) -> Traced:
        return Traced(_boxed(self.nodes[_known_index(index)]))

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
        """Return the values in another shape."""
        return Traced(self.nodes.reshape(*shape))

    def ravel(self) -> Traced:
        """Return the values as a row."""
        return Traced(self.nodes.ravel())

    def transpose(self, *axes: Any) -> Traced:
        """Return the values with permuted axes."""
        return Traced(self.nodes.transpose(*axes))

    def astype(self, dtype: Any, copy: bool = True) -> Traced:
        """Return the values unchanged: recorded values have only one real type."""
        if np.issubdtype(dtype, np.integer):
            raise NotTraceableError("integers are not recorded")
        return Traced(self.nodes.copy())

    def copy(self) -> Traced:
        """Return a copy."""
        return Traced(self.nodes.copy())

    def sum(self, axis: Any = None, keepdims: bool = False) -> Traced:
        """Return sums."""
        return _reduced("add", self, axis, keepdims)

    def max(self, axis: Any = None, keepdims: bool = False) -> Traced:
        """Return the largest values."""
        return _reduced("maximum", self, axis, keepdims)

    def min(self, axis: Any = None, keepdims: bool = False) -> Traced:
        """Return the least values."""
        return _reduced("minimum", self, axis, keepdims)

    def any(self) -> bool:
        """Collect the condition that any value is true, and return False; only inside of `conditions`."""
        return _asked(self, is_any=True)

    def all(self) -> bool:
        """Collect the condition that a value is not true, and return True; only inside of `conditions`."""
        return _asked(self, is_any=False)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **named: Any) -> Any:
        name = SAME.get(ufunc.__name__, ufunc.__name__)
        if name == "square":
            return Traced(_mapped("multiply", inputs[0], inputs[0]))
        if name == "positive":
            return inputs[0]
        if name == "power" and np.ndim(inputs[1]) == 0 and not isinstance(inputs[1], Traced) and inputs[1] == 2:
            return Traced(_mapped("multiply", inputs[0], inputs[0]))
        if name == "expm1" and method == "__call__":
            return _expm1(inputs[0])
        if name not in OPERATIONS:
            raise NotTraceableError(f"numpy.{ufunc.__name__} is not recorded")
        if method == "reduce":
            return _reduced(name, inputs[0], named.get("axis", 0), bool(named.get("keepdims")))
        if method == "accumulate":
            return _accumulated(name, inputs[0], named.get("axis", 0))
        if method != "__call__":
            raise NotTraceableError(f"numpy.{ufunc.__name__}.{method} is not recorded")
        found = _mapped(name, *inputs)
        where, [out] = named.pop("where", True), named.pop("out", (None,))
        if where is not True:
            rest = constant(np.nan) if out is None else nodes_of(out)
            found = _mapped("where", where, Traced(found), Traced(np.asarray(rest)))
        if isinstance(out, Traced):
            out.nodes[...] = found
            return out
        return Traced(found)

    def __array_function__(self, function: Callable, types: Any, given: Any, named: Any) -> Any:
        if function not in FUNCTIONS:
            raise NotTraceableError(f"numpy.{function.__name__} is not recorded")
        return FUNCTIONS[function](*given, **named)


def nodes_of(values: Any) -> np.ndarray:
    """Return values as an array of nodes."""
    if isinstance(values, Traced):
        return values.nodes
    if isinstance(values, list | tuple) and any(isinstance(each, Traced) for each in values):
        return _stack(values).nodes
    array = np.asarray(values)
    nodes = np.empty(array.shape, object)
    for index in np.ndindex(array.shape):
        nodes[index] = constant(array[index])
    return nodes


def traced(values: Any) -> Traced:
    """Return values as an array of recorded values."""
    return values if isinstance(values, Traced) else Traced(nodes_of(values))


def is_traced(*values: Any) -> bool:
    """Return whether any of these values is recorded."""
    return any(isinstance(each, Traced) for each in values)


def may_be_true(condition: Any) -> bool:
    """Return whether a condition is true anywhere; a recorded condition may be true unless it is a constant."""
    if not isinstance(condition, Traced):
        return bool(np.any(condition))
    return any(not each.is_constant or each.value for each in condition.nodes.ravel())


def _boxed(value: Any) -> np.ndarray:
    if isinstance(value, np.ndarray):
        return value
    box = np.empty((), object)
    box[()] = value
    return box


def _known_index(index: Any) -> Any:
    if isinstance(index, Traced) or (isinstance(index, tuple) and is_traced(*index)):
        raise NotTraceableError("values are selected by a condition: use numpy.where")
    return index


def _mapped(name: str, *values: Any) -> np.ndarray:
    """Return an operation on each element of arrays that broadcast."""
    arrays: list[Any] = np.broadcast_arrays(*(nodes_of(each) for each in values))  # type: ignore[assignment] # a tuple
    found = np.empty(arrays[0].shape, object)
    for index in np.ndindex(found.shape):
        found[index] = apply(name, *(array[index] for array in arrays))
    return found


def _along(values: Any, axis: Any) -> tuple[np.ndarray, tuple[int, ...]]:
    nodes = nodes_of(values)
    axes = range(nodes.ndim) if axis is None else (axis,) if isinstance(axis, int | np.integer) else axis
    return nodes, tuple(int(each) % nodes.ndim for each in axes)


def _reduced(name: str, values: Any, axis: Any, keepdims: bool = False) -> Traced:
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


def _accumulated(name: str, values: Any, axis: int) -> Traced:
    nodes = np.moveaxis(nodes_of(values), axis, 0)
    found = nodes.copy()
    for place in range(1, len(found)):
        found[place, ...] = _mapped(name, Traced(_boxed(found[place - 1])), Traced(_boxed(found[place])))
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


def _stack(values: Any, axis: int = 0, **named: Any) -> Traced:
    return Traced(np.stack([nodes_of(each) for each in values], axis=axis))


def _concatenate(values: Any, axis: int = 0, **named: Any) -> Traced:
    return Traced(np.concatenate([nodes_of(each) for each in values], axis=axis))


def _where(condition: Any, yes: Any, no: Any) -> Traced:
    return Traced(_mapped("where", condition, yes, no))


def _difference(values: Any, n: int = 1, axis: int = -1, prepend: Any = None, append: Any = None) -> Traced:
    nodes = nodes_of(values)
    for other, is_first in ((prepend, True), (append, False)):
        if other is not None:
            shape = list(nodes.shape)
            shape[axis] = 1
            edge = np.broadcast_to(nodes_of(other), shape)
            nodes = np.concatenate([edge, nodes] if is_first else [nodes, edge], axis=axis)
    moved = np.moveaxis(nodes, axis, 0)
    found = _mapped("subtract", Traced(moved[1:]), Traced(moved[:-1]))
    return Traced(np.moveaxis(found, 0, axis))


def _constant_like(value: float) -> Callable[..., Traced]:
    def fill(like: Any, fill_value: Any = value, **named: Any) -> Traced:
        return Traced(np.broadcast_to(nodes_of(fill_value), np.shape(like)).copy())

    return fill


def _full_like(like: Any, fill_value: Any, **named: Any) -> Traced:
    return _constant_like(0.0)(like, fill_value)


def _clip(values: Any, low: Any = None, high: Any = None, **named: Any) -> Traced:
    found = traced(values)
    if low is not None:
        found = Traced(_mapped("maximum", found, low))
    return found if high is None else Traced(_mapped("minimum", found, high))


def _expm1(values: Any) -> Traced:
    """Return exp(x) - 1 without loss of digits for small x, by Kahan's formula: kernels have no function for it."""
    power: Any = np.exp(traced(values))
    less = power - 1.0
    # The quotient is (exp(y) - 1) / y for y = log(exp(x) as rounded), which is close to x.
    small = np.where(power == 1.0, values, less * values / np.log(power))
    return _where(less == -1.0, -1.0, small)


def _sorted(values: Any, axis: int = -1, **named: Any) -> Traced:
    """Return values in increasing order, by exchanges of neighbours."""
    rows = np.moveaxis(nodes_of(values), axis, 0).copy()
    for last in range(len(rows) - 1, 0, -1):
        for place in range(last):
            pair = Traced(_boxed(rows[place])), Traced(_boxed(rows[place + 1]))
            rows[place], rows[place + 1] = _mapped("minimum", *pair), _mapped("maximum", *pair)
    return Traced(np.moveaxis(rows, 0, axis))


def _taken_along(values: Any, indices: Any, axis: int = -1) -> Traced:
    """Return the values at recorded indices along an axis, by comparisons with each index."""
    rows, places = np.moveaxis(nodes_of(values), axis, 0), np.moveaxis(nodes_of(indices), axis, 0)
    found = np.broadcast_to(rows[0], places.shape)
    for place in range(1, len(rows)):
        is_here = _mapped("equal", Traced(places), float(place))
        found = _mapped("where", Traced(is_here), Traced(rows[place]), Traced(found))
    return Traced(np.moveaxis(found, 0, axis))


def _is_in(values: Any, allowed: Any, **named: Any) -> Traced:
    found = Traced(_mapped("equal", values, np.ravel(allowed)[0]))
    for each in np.ravel(allowed)[1:]:
        found = Traced(_mapped("logical_or", found, Traced(_mapped("equal", values, each))))
    return found


def _broadcast_arrays(*values: Any, **named: Any) -> list[Traced]:
    return [Traced(each.copy()) for each in np.broadcast_arrays(*(nodes_of(each) for each in values))]


FUNCTIONS: dict[Callable, Callable] = {
    np.where: _where,
    np.stack: _stack,
    np.concatenate: _concatenate,
    np.diff: _difference,
    np.clip: _clip,
    np.isin: _is_in,
    np.broadcast_arrays: _broadcast_arrays,
    np.broadcast_to: lambda values, shape, **named: Traced(np.broadcast_to(nodes_of(values), shape).copy()),
    np.zeros_like: _constant_like(0.0),
    np.ones_like: _constant_like(1.0),
    np.empty_like: _constant_like(np.nan),
    np.full_like: _full_like,
    np.shape: lambda values: values.shape,
    np.ndim: lambda values: values.ndim,
    np.size: lambda values: values.size,
    np.ravel: lambda values, **named: values.ravel(),
    np.reshape: lambda values, shape, **named: values.reshape(shape),
    np.transpose: lambda values, axes=None: values.transpose() if axes is None else values.transpose(axes),
    np.flip: lambda values, axis=None: Traced(np.flip(values.nodes, axis)),
    np.copy: lambda values, **named: values.copy(),
    np.sort: _sorted,
    np.take_along_axis: _taken_along,
    np.sum: lambda values, axis=None, keepdims=False, **named: _reduced("add", values, axis, keepdims),
    np.round: lambda values, decimals=0, **named: Traced(_mapped("rint", values)),
    np.max: lambda values, axis=None, keepdims=False, **named: _reduced("maximum", values, axis, keepdims),
    np.min: lambda values, axis=None, keepdims=False, **named: _reduced("minimum", values, axis, keepdims),
    np.nanmin: lambda values, axis=None, keepdims=False, **named: _reduced("minimum", values, axis, keepdims),
    np.cumsum: lambda values, axis=0, **named: _accumulated("add", values, axis),
    np.any: lambda values, **named: _asked(values, is_any=True),
    np.all: lambda values, **named: _asked(values, is_any=False),
}
