"""Sums in whole numbers against Python's fractions: the same bits in every order, and what is left out is bounded."""

import warnings
from fractions import Fraction

import numpy as np
import pytest
import warp as wp

from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.kernels.reductions.exact_sums import ExactSums
from warpdyn.engine.kernels.reductions.table import reductions


def sums_of(values):
    """Return the sums of some values, in one cell."""
    sums, rows = ExactSums.of_nothing(1), np.zeros((len(values), 1, 5))
    rows[:, 0, 0], rows[:, 0, 4] = values, values
    order, cell = np.arange(len(values), dtype=np.int32), np.zeros(len(values), dtype=np.int32)
    start, unit = np.array([0, len(values)], dtype=np.int32), np.zeros(1, dtype=np.int32)
    given = [1, 1, order, start, rows, cell, unit, sums.bins, sums.largest]
    wp.launch(loaded(reductions().totals), dim=1, inputs=[0, 1, 1, *given], device="cpu")
    return sums


def merged(parts):
    """Return the sums of several, added one to the other."""
    total = ExactSums.of_nothing(1)
    for part in parts:
        total.include(np.zeros(1, dtype=int), part)
    return total


RANGES = {
    "alike": (0, 1),
    "of both signs": (-5, 5),
    "far apart": (-300, 300),
    "below the least normal number": (-1074, -1000),
    "up to the largest": (900, 1013),
}


@pytest.mark.parametrize("span", RANGES)
def test_sums_are_exact_in_every_order(span):
    draw = np.random.default_rng(7)
    least, most = RANGES[span]
    for _ in range(20):
        count = int(draw.integers(1, 200))
        values = np.ldexp(draw.uniform(0.5, 1, count), draw.integers(least, most, count))
        values *= 1 if span == "alike" else draw.choice([-1, 1], count)
        first = sums_of(values)
        for parts in (1, 2, 7):
            places = np.array_split(draw.permutation(count), parts)
            again = merged([sums_of(values[place]) for place in places])
            assert again.bins.tobytes() == first.bins.tobytes()
            assert again.totals.tobytes() == first.totals.tobytes()
        total, left_out, *_, largest = first.totals[0].tolist()
        truth = sum(map(Fraction, values.tolist()))
        # Each term is cut 90 bits below the first bit of the largest; two numbers of float64 hold 106 bits of the rest.
        # Of numbers below the least normal one, what rounding leaves out of the sum may itself be none.
        bound = count * Fraction(float(np.abs(values).max())) / 2**90 + abs(truth) / 2**105 + Fraction(5e-324)
        assert abs(Fraction(total) + Fraction(left_out) - truth) <= bound
        assert largest == values.max()


def test_terms_that_cancel_leave_what_is_small():
    values = np.array([1e10, 3.0**-20, -1e10, 2.0**-40])
    total, left_out, *_ = sums_of(values).totals[0].tolist()
    truth = Fraction(3.0**-20) + Fraction(2.0**-40)
    assert abs(Fraction(total) + Fraction(left_out) - truth) <= Fraction(1e10) / 2**88


def test_nothing_and_what_is_not_finite():
    assert sums_of(np.zeros(3)).totals[0, :4].tolist() == [0.0] * 4
    assert ExactSums.of_nothing(2).totals[:, 0].tolist() == [0.0, 0.0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isinf(sums_of(np.array([1.0, np.inf])).totals[0, 0])  # as a square beyond the largest number


def test_as_many_terms_as_a_run_may_have_do_not_overflow():
    # 2^31 samples, each with a sum and what rounding left out of it, all of whose bits are set.
    sums = sums_of(np.array([2.0 - 2.0**-52]))
    for _ in range(32):  # doubled as often
        sums.include(slice(None), sums)
    total, left_out, *_ = sums.totals[0].tolist()
    assert (total, left_out) == (2.0**32 * (2.0 - 2.0**-52), 0.0)
