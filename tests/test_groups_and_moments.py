"""Groups of structures that a jackknife leaves out, and variances from sums in two parts."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.stats import qmc

from warpdyn.campaigns.reductions.demand_moments import moments
from warpdyn.campaigns.reductions.population import MOST_GROUPS, group_numbers

pytestmark = pytest.mark.fast


@pytest.mark.parametrize(("structures", "size"), [(4, 2), (16, 4), (64, 8), (256, 16), (1024, 32), (2**14, 256)])
def test_groups_of_sobol_points_are_blocks_that_cover_each_parameter_evenly(structures, size):
    # About as many groups as points in each, at most 64 groups.
    group = group_numbers(structures, "sobol")
    np.testing.assert_array_equal(group, np.repeat(np.arange(structures // size), size))
    points = qmc.Sobol(3, scramble=True, seed=5).random(structures)
    for number in {0, 1, structures // size - 1}:
        # One point in each of `size` equal intervals of each parameter, which scattered points do not have.
        for values in points[group == number].T:
            assert sorted(np.floor(size * values)) == list(range(size))


def test_independent_structures_are_dealt_to_the_groups_one_after_the_other():
    np.testing.assert_array_equal(group_numbers(5, "monte_carlo"), np.arange(5))
    np.testing.assert_array_equal(group_numbers(200, "monte_carlo"), np.arange(200) % MOST_GROUPS)


def test_the_variance_of_sums_in_two_parts_contains_their_cross_term():
    # Sums are exact in two parts, the second below the last digit of the first. Of 3 samples with the sum S = t + l and
    # the sum of squares S^2 / 3 + 10 the variance is 5; 2 t l / 3 is 0.5 of the 10.
    total, left_out = 2.0**27, 0.75 * 2.0**-27  # half a unit in the last place of the total is 2^-27
    squares = Fraction(Fraction(total) + Fraction(left_out)) ** 2 / 3 + 10
    first = float(squares)
    rest = float(squares - Fraction(first))
    mean, variance = moments(np.array(3), np.array([total, left_out, first, rest]))
    assert float(mean) == pytest.approx(total / 3, rel=1e-15)
    assert float(variance) == pytest.approx(5.0, rel=1e-12)
