"""Points of a scrambled Sobol sequence at any indices, bit-identical to those of SciPy's `qmc.Sobol`.

SciPy generates points only in order, and not in several threads. This module computes a point from its index. The
binary digits of a point are the exclusive or of a random shift and of one direction number for each bit that is set in
the Gray code of the index (Antonov and Saleev 1979, An economic method of computing LP-tau sequences, USSR Comput.
Math. Math. Phys. 19). The shift is point 0. The direction numbers follow from the points with the indices 1, 2, 4, ...,
which SciPy reaches by `fast_forward`.
"""

from __future__ import annotations

import numpy as np

BITS = 30  # of a coordinate, SciPy's default; a sequence ends after 2^30 points
TABLE_BITS = 10  # a table contains one row for each value of 10 bits of an index


class SobolPoints:
    """The first `count` points of a scrambled Sobol sequence; several threads may read them in any order.

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
        from scipy.stats import qmc  # its import takes a third of a second

        most = qmc.Sobol.MAXDIM
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
        sequence = qmc.Sobol(dimensions, rng=generator, bits=BITS)

        def next_digits() -> np.ndarray:
            return (sequence.random(1)[0] * 2.0**BITS).astype(np.uint32)

        shift = next_digits()
        number = np.zeros(dimensions, np.uint32)
        self._tables = [shift[np.newaxis]]
        for bit in range((count - 1).bit_length()):
            if bit and bit % TABLE_BITS == 0:
                self._tables.append(np.zeros((1, dimensions), np.uint32))
            if bit:
                sequence.fast_forward(2**bit - sequence.num_generated)
            number ^= next_digits() ^ shift  # the Gray code of 2^k has the bits k and k - 1
            self._tables[-1] = np.concatenate([self._tables[-1], self._tables[-1] ^ number])

    @property
    def digits(self) -> np.ndarray:
        """The binary digits of the shift and the direction number of each bit of a Gray code, [1 + bit, dimension]."""
        shift = self._tables[0][0]
        rows = [shift]
        for place, table in enumerate(self._tables):
            bits = (len(table) - 1).bit_length()
            rows += [table[2**bit] ^ (shift if place == 0 else 0) for bit in range(bits)]
        return np.array(rows, np.uint32)

    def at(self, indices: np.ndarray) -> np.ndarray:
        """Return the points with these indices (all below `count`), shape [index, dimension], values in [0, 1)."""
        code = indices ^ (indices >> 1)
        words, last = self._tables[0][code % 2**TABLE_BITS], code.max(initial=0)
        for place, table in enumerate(self._tables[1:], 1):
            if last >> (place * TABLE_BITS):  # otherwise the table adds nothing
                words ^= table[(code >> (place * TABLE_BITS)) % 2**TABLE_BITS]
        return words * 2.0**-BITS
