"""Sobol points by index: SciPy's, bit for bit."""

import numpy as np
import pytest
from scipy.stats import qmc

from warpdyn.model.scene import sobol_points
from warpdyn.model.scene.sobol_points import BITS, DIMENSIONS, SobolPoints

pytestmark = pytest.mark.fast


# The dimensions from 2 on take polynomials of degrees 1, 2, 3, ...; the last row of the table is of degree 18.
@pytest.mark.parametrize("dimensions", [1, 2, 3, 14, 300])
def test_points_are_scipy_s(dimensions):
    expected = qmc.Sobol(dimensions, rng=np.random.default_rng([5, dimensions])).random(2**11)
    points = SobolPoints(dimensions, np.random.default_rng([5, dimensions]))
    np.testing.assert_array_equal(points.at(np.arange(2**11)), expected)
    chosen = np.random.default_rng(1).integers(2**11, size=50)
    np.testing.assert_array_equal(points.at(chosen), expected[chosen])


def test_late_points_are_scipy_s():
    # Beyond 2^20, where the indices' bits are in the last of three tables.
    sequence = qmc.Sobol(3, rng=np.random.default_rng(2))
    sequence.fast_forward(2**22 + 2**10 - 3)
    points = SobolPoints(3, np.random.default_rng(2))
    np.testing.assert_array_equal(points.at(np.arange(2**22 + 2**10 - 3, 2**22 + 2**10 + 5)), sequence.random(8))


def test_every_polynomial_of_the_table_is_understood():
    numbers = sobol_points._direction_numbers(DIMENSIONS)
    np.testing.assert_array_equal(numbers, qmc.Sobol(DIMENSIONS, scramble=False)._sv)


def test_direction_numbers_can_be_had_without_the_table(monkeypatch):
    # As with a SciPy that keeps its table elsewhere. With fewer bits, the numbers are the first ones, cut off.
    numbers = sobol_points._direction_numbers(40)
    monkeypatch.setattr(sobol_points, "_direction_numbers", sobol_points._direction_numbers.__wrapped__)  # not kept
    monkeypatch.setattr(sobol_points, "BITS", 12)
    monkeypatch.setattr(sobol_points.scipy, "__file__", "elsewhere/__init__.py")
    np.testing.assert_array_equal(sobol_points._direction_numbers(40), numbers[:, :12] >> (BITS - 12))


def test_too_many_variables_and_points_are_refused():
    with pytest.raises(ValueError, match=f"at most {DIMENSIONS} variables, and the scatter has {DIMENSIONS + 1}"):
        SobolPoints(DIMENSIONS + 1, np.random.default_rng(0))
    with pytest.raises(ValueError, match=rf"ends after 2\^30 points, and the one of index {2**30} is asked for"):
        SobolPoints(1, np.random.default_rng(0)).at(np.array([0, 2**30]))
