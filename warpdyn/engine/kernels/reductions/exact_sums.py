"""Sums that do not depend on the order of their terms.

Each float64 term is divided into pieces of 30 bits. The positions of the pieces are fixed, counted from the smallest
number of float64. Pieces at the same position are added exactly, as integers. A cell (the set of samples with the same
labels) keeps four sums: those of the highest position of all of its terms and of the three positions below it. The
terms are therefore rounded more than 90 bits below the first bit of the largest term, whatever their order, and blocks
of a run can be added as they finish (Demmel and Nguyen 2015, IEEE Transactions on Computers 64(7), describe a similar
method with floating-point numbers).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

PIECES, WIDTH = 4, 30  # a sum of 2^33 pieces of 30 bits fits in an int64
FRACTION = 52  # bits of the significand of float64 after the first bit
LEAST_EXPONENT = 1074  # the smallest positive number of float64 is 2^-1074
BYTES_PER_CELL = 8 * (2 * (1 + PIECES) + 1)
MASK = 2**WIDTH - 1


@wp.func
def raise_top(own: int, cell: int, which: int, bins: wp.array3d(dtype=wp.int64)):
    """Move the highest position of one sum of a cell up to the piece `own`; its lowest pieces are dropped.

    `which` is 0 for the sum of values and 1 for the sum of squares.
    """
    moved = own - int(bins[cell, which, 0])
    for number in range(wp.static(PIECES)):
        piece = wp.static(PIECES) - number
        kept = wp.int64(0)
        if piece > moved:
            kept = bins[cell, which, piece - moved]
        bins[cell, which, piece] = kept
    bins[cell, which, 0] = wp.int64(own)


@wp.func
def add_exactly(value: wp.float64, cell: int, which: int, bins: wp.array3d(dtype=wp.int64)):
    """Add a value to one sum of a cell; `which` is 0 for the sum of values and 1 for the sum of squares."""
    bits = wp.cast(value, wp.uint64)
    exponent = int((bits >> wp.uint64(wp.static(FRACTION))) & wp.uint64(2047))
    digits = bits & wp.uint64(wp.static(2**FRACTION - 1))
    if exponent > 0:
        digits = digits | wp.uint64(wp.static(2**FRACTION))
    # The rounding error of an infinite sum is not a number, and is not added.
    if digits > wp.uint64(0) and not wp.isnan(value):
        first = wp.max(exponent, 1) + wp.static(FRACTION - 1)  # place of the first digit
        own = first // wp.static(WIDTH)
        if own > int(bins[cell, which, 0]):
            raise_top(own, cell, which, bins)
        piece = 1 + int(bins[cell, which, 0]) - own
        inside = wp.uint64(first - wp.static(WIDTH) * own)
        mask = wp.uint64(wp.static(2**WIDTH - 1))
        sign = wp.cast(bits, wp.int64) >> wp.int64(63)  # -1 of negative values
        high = wp.int64(digits >> (wp.uint64(wp.static(FRACTION)) - inside))
        shifted = digits << wp.uint64(wp.static(2 * WIDTH - FRACTION))
        middle = wp.int64((shifted >> (wp.uint64(wp.static(WIDTH)) - inside)) & mask)
        low = wp.int64((shifted << inside) & mask)
        if piece <= wp.static(PIECES):
            bins[cell, which, piece] = bins[cell, which, piece] + ((high ^ sign) - sign)
        if piece + 1 <= wp.static(PIECES):
            bins[cell, which, piece + 1] = bins[cell, which, piece + 1] + ((middle ^ sign) - sign)
        if piece + 2 <= wp.static(PIECES):
            bins[cell, which, piece + 2] = bins[cell, which, piece + 2] + ((low ^ sign) - sign)


@dataclass(frozen=True, eq=False)
class ExactSums:
    """The sum of values, the sum of squares (both as integers) and the largest value of each cell.

    A cell is the set of all samples with the same labels. Sums are divided into pieces of 30 bits.

    Args:
        bins: Position of the highest piece, then the sums of the pieces from this position down; for values and for
            squares. Shape [cell, 2, 1 + piece]; `add_exactly` fills it.
        largest: Largest value, shape [cell].
    """

    bins: np.ndarray
    largest: np.ndarray

    @classmethod
    def of_nothing(cls, cells: int) -> ExactSums:
        """Return sums without terms for `cells` cells (sets of samples); their largest value is -infinity."""
        return cls(np.zeros((cells, 2, 1 + PIECES), dtype=np.int64), np.full(cells, -np.inf))

    @property
    def totals(self) -> np.ndarray:
        """The sums as float64, shape [cell, 5].

        The columns of the array are: sum, its rounding error, sum of squares, its rounding error, and largest value.
        """
        found = np.empty((len(self.bins), 5))
        for which in range(2):
            found[:, 2 * which], found[:, 2 * which + 1] = as_floats(self.bins[:, which])
        found[:, 4] = self.largest
        return found

    def of_cells(self, cells: np.ndarray) -> ExactSums:
        """Return the sums of the cells with these indices."""
        return ExactSums(self.bins[cells], self.largest[cells])

    def include(self, cells: np.ndarray | slice, other: ExactSums) -> None:
        """Add the sums in `other` to the cells with the indices `cells`; an index must not occur twice."""
        own = self.bins[cells]
        top = np.maximum(own[..., :1], other.bins[..., :1])
        self.bins[cells] = np.concatenate([top, _moved(own, top) + _moved(other.bins, top)], axis=-1)
        self.largest[cells] = np.maximum(self.largest[cells], other.largest)


def as_floats(bins: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Convert sums of pieces, shape [cell, 1 + piece], to float64 sums and their rounding errors, each of shape [cell].

    A piece consists of 30 bits of a sum; the first number of each cell is the position of its highest piece.
    """
    top, pieces = bins[:, 0], bins[:, 1:].copy()
    for place in range(PIECES - 1, 0, -1):  # carry the bits above 30 to the next piece
        pieces[:, place - 1] += pieces[:, place] >> WIDTH
        pieces[:, place] &= MASK
    exact = [pieces[:, 0] >> WIDTH, pieces[:, 0] & MASK, *(pieces[:, place] for place in range(1, PIECES))]
    total, left_out = np.zeros(len(bins)), np.zeros(len(bins))
    for place, piece in enumerate(exact):
        total, rest = _two_sum(total, piece * 2.0 ** (WIDTH * (PIECES - place)))
        left_out = left_out + rest
    total, left_out = _two_sum(total, left_out)
    exponent = (WIDTH * (top - PIECES + 1) - LEAST_EXPONENT).astype(np.int32)
    with np.errstate(over="ignore"):
        return np.ldexp(total, exponent), np.ldexp(left_out, exponent)


def _two_sum(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rounded sum of two arrays and its rounding error (Knuth's two-sum)."""
    total = one + other
    part = total - one
    return total, (one - (total - part)) + (other - part)


def _moved(bins: np.ndarray, top: np.ndarray) -> np.ndarray:
    """Return the sums of the pieces, shape [..., piece], counted from another highest position `top`."""
    moved = top - bins[..., :1]
    found = np.zeros((*bins.shape[:-1], PIECES), dtype=np.int64)
    for piece in range(PIECES):
        for by in range(piece + 1):
            found[..., piece] += np.where(moved[..., 0] == by, bins[..., 1 + piece - by], 0)
    return found
