"""Points of a scrambled Sobol sequence at any indices, bit-identical to those of SciPy's `qmc.Sobol`.

SciPy generates points only in order, and not in several threads. This module computes a point from its index. The
binary digits of a point are the exclusive or of a random shift and of one direction number for each bit that is set in
the Gray code of the index (Antonov and Saleev 1979, An economic method of computing LP-tau sequences, USSR Comput.
Math. Math. Phys. 19). The initial direction numbers (Joe and Kuo 2008, Constructing Sobol sequences with better
two-dimensional projections, SIAM J. Sci. Comput. 30) are read from SciPy's file, without the import of `scipy.stats`,
which takes a third of a second. The scrambling is the linear matrix scrambling with a shift of Matousek (1998, On the
L2-discrepancy for anchored boxes, J. Complexity 14).
"""

from __future__ import annotations

from functools import cache, lru_cache
from importlib.resources import files

import numpy as np

BITS = 30  # binary digits of a coordinate (SciPy's default); the sequence ends after 2^30 points
TABLE_BITS = 10  # a table has one column for each value of 10 bits of the index of a point


class SobolPoints:
    """The first `count` points of a scrambled Sobol sequence; several threads may compute points in any order.

    Args:
        dimensions: Number of coordinates of a point.
        generator: Source of the random scrambling.
        count: Number of points.

    Raises:
        ValueError: If SciPy has no direction numbers for the dimensions, or the sequence ends before `count`.

    Example:
        >>> SobolPoints(2, np.random.default_rng(0), 8).at(np.arange(4)).shape
        (4, 2)
    """

    def __init__(self, dimensions: int, generator: np.random.Generator, count: int) -> None:
        most = len(_polynomials()[0])
        if dimensions > most:
            raise ValueError(
                f"a Sobol sequence has at most {most} variables, and the scatter has {dimensions}: choose "
                "sampling='monte_carlo'"
            )
        if count > 2**BITS:
            raise ValueError(
                f"a Sobol sequence ends after 2^{BITS} points, but {count} points are needed: choose "
                "sampling='monte_carlo'"
            )
        generator = generator.spawn(1)[0]  # the following draws give the same random bits as in SciPy
        bits = generator.integers(2, size=(dimensions, BITS), dtype=np.uint32)
        scrambling = np.tril(generator.integers(2, size=(dimensions, BITS, BITS), dtype=np.uint32), -1)
        scrambling |= np.eye(BITS, dtype=np.uint32)
        digits = scrambling @ _direction_bits(dimensions) % 2  # [dimension, digit, bit of the Gray code]
        numbers = np.einsum("dij,i->jd", digits, 1 << np.arange(BITS - 1, -1, -1, dtype=np.uint32))[..., np.newaxis]
        self._tables = [(bits @ (1 << np.arange(BITS, dtype=np.uint32)))[:, np.newaxis]]
        for bit in range((count - 1).bit_length()):
            if bit and bit % TABLE_BITS == 0:
                self._tables.append(np.zeros((dimensions, 1), np.uint32))
            self._tables[-1] = np.concatenate([self._tables[-1], self._tables[-1] ^ numbers[bit]], axis=1)

    @property
    def digits(self) -> np.ndarray:
        """Binary digits of the random shift and of the direction number of each bit, shape [1 + bit, dimension]."""
        shift = self._tables[0][:, 0]
        rows = [shift]
        for place, table in enumerate(self._tables):
            bits = (table.shape[1] - 1).bit_length()
            rows += [table[:, 2**bit] ^ (shift if place == 0 else 0) for bit in range(bits)]
        return np.array(rows, np.uint32)

    def at(self, indices: np.ndarray) -> np.ndarray:
        """Return the points with these indices (all below `count`), shape [index, dimension], values in [0, 1).

        Values of successive indices are contiguous in memory.
        """
        code = indices ^ (indices >> 1)
        words, last = self._tables[0].take(code % 2**TABLE_BITS, axis=1), code.max(initial=0)
        for place, table in enumerate(self._tables[1:], 1):
            if last >> (place * TABLE_BITS):  # otherwise, these bits of all indices are 0
                words ^= table.take((code >> (place * TABLE_BITS)) % 2**TABLE_BITS, axis=1)
        return (words * 2.0**-BITS).T


@cache
def _polynomials() -> tuple[np.ndarray, np.ndarray]:
    """Return the primitive polynomial of each dimension, and its initial direction numbers, shape [dimension, bit]."""
    with np.load(str(files("scipy") / "stats" / "_sobol_direction_numbers.npz")) as read:
        return read["poly"], read["vinit"]


@lru_cache(maxsize=4)
def _direction_bits(dimensions: int) -> np.ndarray:
    """Return the binary digits of the direction numbers without scrambling, [dimension, digit (highest first), bit]."""
    polynomials, first = (values[:dimensions] for values in _polynomials())
    numbers = np.ones((dimensions, BITS), np.int64)  # valid for the first dimension, whose polynomial has degree 0
    degrees = np.frexp(polynomials)[1] - 1
    for degree in np.unique(degrees[1:]):
        rows = np.flatnonzero(degrees == degree)
        found = numbers[rows]
        found[:, :degree] = first[rows, :degree]
        for bit in range(degree, BITS):
            found[:, bit] = found[:, bit - degree]
            for k in range(1, degree + 1):
                is_term = polynomials[rows] >> (degree - k) & 1
                found[:, bit] ^= is_term * (found[:, bit - k] << k)
        numbers[rows] = found
    places = np.arange(BITS - 1, -1, -1)
    return ((numbers << places)[:, np.newaxis] >> places[:, np.newaxis] & 1).astype(np.uint32)
