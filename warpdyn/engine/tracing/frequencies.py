"""Frequencies in a recorded computation: a separate kernel finds them between two kernels of the computation."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

import numpy as np

from warpdyn.engine.tracing.arrays import NotTraceableError, Traced, nodes_of

PREFIX = "frequency_"  # prefix of the names of arrays that contain frequencies


class Chains(NamedTuple):
    """Masses and stiffnesses of chains whose frequencies are needed, shape [storey]."""

    mass: np.ndarray
    stiffness: np.ndarray


_asked: ContextVar[list[Chains] | None] = ContextVar("asked", default=None)


@contextmanager
def asked_frequencies() -> Iterator[list[Chains]]:
    """Collect the chains whose frequencies a computation needs."""
    found: list[Chains] = []
    token = _asked.set(found)
    try:
        yield found
    finally:
        _asked.reset(token)


def traced_frequencies(mass: Traced, stiffness: Traced) -> Traced:
    """Return the frequencies [rad/s] as values that the computation reads, shape [1, mode]; see `frequencies`."""
    asked = _asked.get()
    if asked is None:
        raise NotTraceableError("frequencies are needed outside of a recorded preparation")
    masses, stiffnesses = np.broadcast_arrays(nodes_of(mass), nodes_of(stiffness))
    wanted = Chains(masses[0], stiffnesses[0])
    same = (n for n, known in enumerate(asked) if all((a == b).all() for a, b in zip(known, wanted, strict=True)))
    place = next(same, len(asked))
    if place == len(asked):
        asked.append(wanted)
    return Traced.inputs(lambda row, mode: f"{PREFIX}{place}[{mode}, s]", 1, wanted.mass.size)
