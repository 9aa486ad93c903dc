"""NumPy functions that can be recorded. A user's function that uses other functions or arguments is not recorded."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from warpdyn.engine.tracing.arrays import (
    FUNCTIONS,
    NotTraceableError,
    Traced,
    accumulated,
    boxed,
    mapped,
    nodes_of,
    reduced,
    stacked,
    traced,
)


def _concatenate(values: Any, axis: int = 0) -> Traced:
    return Traced(np.concatenate([nodes_of(each) for each in values], axis=axis))


def _where(condition: Any, yes: Any, no: Any) -> Traced:
    return Traced(mapped("where", condition, yes, no))


def _difference(a: Any, *, axis: int = -1, prepend: Any = None, append: Any = None) -> Traced:
    nodes = nodes_of(a)
    for other, is_first in ((prepend, True), (append, False)):
        if other is not None:
            shape = list(nodes.shape)
            shape[axis] = 1
            edge = np.broadcast_to(nodes_of(other), shape)
            nodes = np.concatenate([edge, nodes] if is_first else [nodes, edge], axis=axis)
    moved = np.moveaxis(nodes, axis, 0)
    found = mapped("subtract", Traced(moved[1:]), Traced(moved[:-1]))
    return Traced(np.moveaxis(found, 0, axis))


def _constant_like(value: float) -> Callable[..., Traced]:
    def fill(a: Any, fill_value: Any = value, *, dtype: Any = np.float64) -> Traced:
        if np.dtype(dtype) not in (np.float64, bool):
            raise NotTraceableError(f"values of type {np.dtype(dtype)} are not recorded")
        return Traced(np.broadcast_to(nodes_of(fill_value), np.shape(a)).copy())

    return fill


def _clip(
    a: Any,
    a_min: Any = None,
    a_max: Any = None,
    *,
    min: Any = None,
    max: Any = None,
) -> Traced:
    low, high = a_min if min is None else min, a_max if max is None else max
    found = traced(a)
    if low is not None:
        found = Traced(mapped("maximum", found, low))
    return found if high is None else Traced(mapped("minimum", found, high))


def _sorted(a: Any, axis: int = -1) -> Traced:
    """Return recorded values in increasing order along an axis, by exchanges of neighbours."""
    rows = [Traced(boxed(each)) for each in np.moveaxis(nodes_of(a), axis, 0)]
    for last in range(len(rows) - 1, 0, -1):
        for place in range(last):
            pair = rows[place], rows[place + 1]
            rows[place], rows[place + 1] = Traced(mapped("minimum", *pair)), Traced(mapped("maximum", *pair))
    return stacked(rows, axis)


def _taken_along(values: Any, indices: Any, axis: int = -1) -> Traced:
    """Return the values at recorded indices along an axis; the kernel compares each index with all positions."""
    rows, places = np.moveaxis(nodes_of(values), axis, 0), np.moveaxis(nodes_of(indices), axis, 0)
    found = np.broadcast_to(rows[0], places.shape)
    for place in range(1, len(rows)):
        is_here = mapped("equal", Traced(places), float(place))
        found = mapped("where", Traced(is_here), Traced(rows[place]), Traced(found))
    return Traced(np.moveaxis(found, 0, axis))


def _cumulative(a: Any, axis: int | None = None) -> Traced:
    if axis is None and np.ndim(a) > 1:
        raise NotTraceableError("sums over all axes are not recorded")
    return accumulated("add", a, axis or 0)


def _is_in(values: Any, allowed: Any) -> Traced:
    found = Traced(mapped("equal", values, np.ravel(allowed)[0]))
    for each in np.ravel(allowed)[1:]:
        found = Traced(mapped("logical_or", found, Traced(mapped("equal", values, each))))
    return found


def _broadcast_arrays(*values: Any) -> list[Traced]:
    return [Traced(each.copy()) for each in np.broadcast_arrays(*(nodes_of(each) for each in values))]


FUNCTIONS |= {
    np.where: _where,
    np.stack: stacked,
    np.concatenate: _concatenate,
    np.diff: _difference,
    np.clip: _clip,
    np.isin: _is_in,
    np.broadcast_arrays: _broadcast_arrays,
    np.broadcast_to: lambda array, shape: Traced(np.broadcast_to(nodes_of(array), shape).copy()),
    np.zeros_like: _constant_like(0.0),
    np.ones_like: _constant_like(1.0),
    np.empty_like: _constant_like(np.nan),
    np.full_like: _constant_like(np.nan),
    np.shape: lambda values: values.shape,
    np.ndim: lambda values: values.ndim,
    np.size: lambda values: values.size,
    np.ravel: lambda values: values.ravel(),
    np.reshape: lambda values, shape: values.reshape(shape),
    np.transpose: lambda values, axes=None: values.transpose() if axes is None else values.transpose(axes),
    np.flip: lambda values, axis=None: Traced(np.flip(values.nodes, axis)),
    np.copy: lambda values: values.copy(),
    np.sort: _sorted,
    np.take_along_axis: _taken_along,
    np.sum: lambda a, axis=None, *, keepdims=False: reduced("add", a, axis, keepdims),
    np.round: lambda a: Traced(mapped("rint", a)),
    np.max: lambda a, axis=None, *, keepdims=False: reduced("maximum", a, axis, keepdims),
    np.min: lambda a, axis=None, *, keepdims=False: reduced("minimum", a, axis, keepdims),
    np.cumsum: _cumulative,
    np.any: lambda a, axis=None: traced(a).any(axis),
    np.all: lambda a, axis=None: traced(a).all(axis),
}
