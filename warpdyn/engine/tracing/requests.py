"""Requests of a recorded computation: natural frequencies and decay rates that separate kernels compute for it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, NamedTuple

import numpy as np

from warpdyn.engine.tracing.arrays import NotTraceableError, Traced, nodes_of
from warpdyn.engine.tracing.nodes import Node

PREFIX = "result_"  # prefix of the names of arrays that contain results
FREQUENCIES, DECAY = "frequencies", "decay"  # kinds of a request


class Request(NamedTuple):
    """Values that a separate kernel computes for each structure.

    Args:
        kind: FREQUENCIES of a chain with mass and stiffness; or slowest DECAY of a chain with mass, stiffness, factor
            of the mass in the damping matrix, and dashpots.
        inputs: Recorded values that the kernel reads, each of shape [row].
        rows: Number of results.
        level: 0 if the inputs depend on no other request; else 1 more than the largest level of the requests on which
            they depend.
    """

    kind: str
    inputs: tuple[np.ndarray, ...]
    rows: int
    level: int


_asked: ContextVar[list[Request] | None] = ContextVar("asked", default=None)


@contextmanager
def requests() -> Iterator[list[Request]]:
    """Collect the requests that a computation makes while it is recorded; yield the list of them."""
    found: list[Request] = []
    token = _asked.set(found)
    try:
        yield found
    finally:
        _asked.reset(token)


def request(kind: str, rows: int, *values: Any) -> Traced:
    """Return the results of a request as recorded values, shape [1, row].

    Args:
        kind: FREQUENCIES or DECAY.
        rows: Number of results.
        values: Inputs, each of shape [1, row].
    """
    asked = _asked.get()
    if asked is None:
        raise NotTraceableError(f"{kind} are needed outside of a recorded preparation")
    inputs = tuple(nodes_of(each)[0] for each in values)
    same = (
        place
        for place, known in enumerate(asked)
        if known.kind == kind and all(np.array_equal(a, b) for a, b in zip(known.inputs, inputs, strict=True))
    )
    place = next(same, len(asked))
    if place == len(asked):
        read = _requests_below(node for array in inputs for node in array)
        asked.append(Request(kind, inputs, rows, max((asked[each].level + 1 for each in read), default=0)))
    return Traced.inputs(lambda row, result: f"{PREFIX}{place}[{result}, s]", 1, rows)


def _requests_below(nodes: Iterable[Node]) -> set[int]:
    """Return the indices of the requests on whose results these nodes depend."""
    waiting, seen, found = list(nodes), set[Node](), set[int]()
    while waiting:
        node = waiting.pop()
        if node in seen:
            continue
        seen.add(node)
        waiting += node.arguments
        if node.operation == "input" and str(node.value).startswith(PREFIX):
            found.add(int(str(node.value).removeprefix(PREFIX).split("[")[0]))
    return found
