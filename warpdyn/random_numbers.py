"""Random numbers by index: those of a structure are the same whichever others are drawn beside it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

NUMBERS_A_COUNT = 4  # Philox4x64 makes so many doubles for each step of its counter
# What a stream of numbers is for; each purpose has a stream of its own, so that one more draws on none of the others.
SCATTER, MOTIONS, CHECKED, PILOT = range(4)


def generator_of(seed: int, purpose: int, skipped: int = 0) -> np.random.Generator:
    """Return a purpose's generator, some of its numbers skipped at no cost."""
    philox = np.random.Philox(np.random.SeedSequence([seed, purpose]))
    philox.advance(skipped // NUMBERS_A_COUNT)
    generator = np.random.Generator(philox)
    generator.random(skipped % NUMBERS_A_COUNT)
    return generator


def uniform_rows(seed: int, purpose: int, rows: np.ndarray, columns: int) -> np.ndarray:
    """Return some rows of an endless table of random numbers from 0 to 1.

    Args:
        seed: Seed of the table.
        purpose: Which of the seed's tables.
        rows: Indices of the rows, increasing, shape [row].
        columns: Width of the table.
    """
    found = np.empty((rows.size, columns))
    for part in consecutive(rows):
        found[part] = generator_of(seed, purpose, int(rows[part.start]) * columns).random(found[part].shape)
    return found


def consecutive(rows: np.ndarray) -> list[slice]:
    """Return the parts of an increasing row of indices within which each is the last one plus 1."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(rows) != 1) + 1, [rows.size]])
    return [slice(int(a), int(b)) for a, b in pairwise(edges) if b > a]
