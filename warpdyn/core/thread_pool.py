"""Work on many structures in parts that fit in a processor's cache, on several threads."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

STRUCTURES_AT_A_TIME = 2**13

Result = TypeVar("Result")


def in_parts(
    work: Callable[[slice], Result], structures: int, threads: int, at_a_time: int = STRUCTURES_AT_A_TIME
) -> list[Result]:
    """Return the result of every part, in order; raise the error of the first part that fails.

    Args:
        work: Function from a part of the structures to its result.
        structures: How many structures there are.
        threads: CPU threads.
        at_a_time: Structures of a part.
    """
    parts = [slice(first, min(first + at_a_time, structures)) for first in range(0, structures, at_a_time)]
    if len(parts) == 1:
        return [work(parts[0])]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, parts))
