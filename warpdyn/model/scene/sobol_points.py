"""Points of a scrambled Sobol sequence, each a function of the seed and its own index.

They are those of SciPy's `qmc.Sobol`, to the bit, whose package takes a third of a second to import and whose points
come in order only. A point is the sum without carry of the direction numbers that the bits of its index in Gray code
name (Antonov and Saleev 1979, An economic method of computing LP-tau sequences, USSR Comput. Math. Math. Phys. 19). The
direction numbers are those of Joe and Kuo (2008, Constructing Sobol sequences with better two-dimensional projections,
SIAM J. Sci. Comput. 30), scrambled by random lower triangular matrices and a random shift (Matousek 1998, On the
L2-discrepancy for anchored boxes, J. Complexity 14).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import scipy

BITS = 30  # of a coordinate, and so of an index
DIMENSIONS = 21201  # of the table of direction numbers
# Bits of an index that one table is for: a row of a table is the sum of all direction numbers that they name.
BITS_OF_A_TABLE = 10


class SobolPoints:
    """A scrambled Sobol sequence, whose points can be had in any order and by several threads at a time.

    Args:
        dimensions: Coordinates of a point.
        generator: Source of the random scrambling.

    Raises:
        ValueError: If there are more dimensions than direction numbers are known for.

    Example:
        >>> SobolPoints(2, np.random.default_rng(0)).at(np.arange(4)).shape
        (4, 2)
    """

    def __init__(self, dimensions: int, generator: np.random.Generator) -> None:
        if dimensions > DIMENSIONS:
            raise ValueError(
                f"a Sobol sequence has at most {DIMENSIONS} variables, and the scatter has {dimensions}: choose "
                "sampling='monte_carlo'"
            )
        generator = generator.spawn(1)[0]  # as SciPy does with one that it is given
        shift = generator.integers(2, size=(dimensions, BITS), dtype=np.uint32) @ _powers()
        rows = np.tril(generator.integers(2, size=(dimensions, BITS, BITS), dtype=np.uint32), -1) @ _powers()[::-1]
        # A bit of a scrambled number is the parity of the bits that its row names: its own, and some of those before.
        named = _direction_numbers(dimensions)[:, :, np.newaxis] & (rows | _powers()[::-1])[:, np.newaxis, :]
        for half in (16, 8, 4, 2, 1):  # the lowest bit becomes the parity of all
            named ^= named >> half
        numbers = (named & 1) @ _powers()[::-1]
        self._tables = []
        for first in range(0, BITS, BITS_OF_A_TABLE):
            table = shift[np.newaxis] if first == 0 else np.zeros((1, dimensions), np.uint32)
            for bit in range(first, min(first + BITS_OF_A_TABLE, BITS)):
                table = np.concatenate([table, table ^ numbers[:, bit]])
            self._tables.append(table)

    def at(self, indices: np.ndarray) -> np.ndarray:
        """Return the points of some indices, shape [index, dimension], in [0, 1).

        Args:
            indices: The indices.

        Raises:
            ValueError: If one is 2^30 or more, where the sequence ends.
        """
        if indices.size and indices.max() >= 2**BITS:
            raise ValueError(
                f"a Sobol sequence ends after 2^{BITS} points, and the one of index {indices.max()} is asked for"
            )
        code = indices ^ (indices >> 1)
        words, last = self._tables[0][code % 2**BITS_OF_A_TABLE], code.max(initial=0)
        for place, table in enumerate(self._tables[1:], 1):
            if last >> (place * BITS_OF_A_TABLE):  # else the table adds nothing
                words ^= table[(code >> (place * BITS_OF_A_TABLE)) % 2**BITS_OF_A_TABLE]
        return words * 2.0**-BITS


def _powers() -> np.ndarray:
    return np.uint32(1) << np.arange(BITS, dtype=np.uint32)


@cache
def _direction_numbers(dimensions: int) -> np.ndarray:
    """Return the direction numbers of each dimension and bit of an index, as whole numbers below 2^30.

    They are kept, as reading them takes 10 ms, and a run asks for them several times.
    """
    try:
        with np.load(Path(scipy.__file__).parent / "stats" / "_sobol_direction_numbers.npz") as table:
            polynomials, first_numbers = table["poly"][:dimensions], table["vinit"][:dimensions]
    except (OSError, KeyError):  # another SciPy may keep its table elsewhere
        return _direction_numbers_of_points(dimensions)
    # Joe and Kuo (2008), equations (2) and (3). A polynomial of degree s over the field of 0 and 1 is held as a whole
    # number, the factor of x^s first. The first dimension has none, and its numbers m are all 1.
    m = np.ones((dimensions, BITS), dtype=np.int64)
    degrees = np.floor(np.log2(polynomials)).astype(int)
    for degree in sorted(set(degrees[1:].tolist())):
        those = np.flatnonzero(degrees == degree)
        factors, row = polynomials[those], list(first_numbers[those, :degree].T)
        for _ in range(degree, BITS):
            number = row[-degree].copy()
            for back in range(1, degree + 1):
                number ^= (factors >> (degree - back) & 1) * row[-back] << back
            row.append(number)
        m[those] = np.transpose(row)
    return (m << np.arange(BITS - 1, -1, -1, dtype=np.int64)).astype(np.uint32)


def _direction_numbers_of_points(dimensions: int) -> np.ndarray:
    """Return the direction numbers by SciPy's points of the indices 2^k, whose Gray code has the bits k and k - 1.

    To skip the points between them takes some seconds.
    """
    from scipy.stats import qmc

    sequence = qmc.Sobol(dimensions, scramble=False, bits=BITS)
    numbers: list[np.ndarray] = []
    for bit in range(BITS):
        sequence.fast_forward(2**bit - sequence.num_generated)
        [point] = sequence.random(1)
        found = (point * 2.0**BITS).astype(np.uint32)
        numbers.append(found ^ numbers[-1] if numbers else found)
    return np.stack(numbers, axis=1)
