"""Sobol points by index: bit for bit those of SciPy."""

import numpy as np
import pytest
from scipy.stats import qmc

from warpdyn.model.scene import sobol_points
from warpdyn.model.scene.sobol_points import SobolPoints

pytestmark = pytest.mark.fast


# The direction numbers of dimensions from 2 on come from polynomials of degrees 1, 2, 3, ...
@pytest.mark.parametrize("dimensions", [1, 2, 3, 14, 300])
def test_points_are_scipy_s(dimensions):
    expected = qmc.Sobol(dimensions, rng=np.random.default_rng([5, dimensions])).random(2**11)
    points = SobolPoints(dimensions, np.random.default_rng([5, dimensions]), 2**11)
    np.testing.assert_array_equal(points.at(np.arange(2**11)), expected)
    chosen = np.random.default_rng(1).integers(2**11, size=50)
    np.testing.assert_array_equal(points.at(chosen), expected[chosen])


@pytest.mark.parametrize("count", [1, 2, 3, 1024, 1025])
def test_the_number_of_points_does_not_change_a_point(count):
    expected = qmc.Sobol(2, rng=np.random.default_rng(4)).random(2**11)[:count]
    np.testing.assert_array_equal(SobolPoints(2, np.random.default_rng(4), count).at(np.arange(count)), expected)


def test_late_points_are_scipy_s():
    # Beyond 2^20 the indices' bits are in the last of three tables.
    first = 2**22 + 2**10 - 3
    sequence = qmc.Sobol(3, rng=np.random.default_rng(2))
    sequence.fast_forward(first)
    points = SobolPoints(3, np.random.default_rng(2), first + 8)
    np.testing.assert_array_equal(points.at(np.arange(first, first + 8)), sequence.random(8))


def test_as_many_variables_as_there_are_direction_numbers(monkeypatch):
    numbers = tuple(values[:3] for values in sobol_points._polynomials())
    monkeypatch.setattr(sobol_points, "_polynomials", lambda: numbers)  # all 21201 take seconds
    expected = qmc.Sobol(3, rng=np.random.default_rng(0)).random(4)
    np.testing.assert_array_equal(SobolPoints(3, np.random.default_rng(0), 4).at(np.arange(4)), expected)
    with pytest.raises(ValueError, match="at most 3 variables, and the scatter has 4"):
        SobolPoints(4, np.random.default_rng(0), 4)


def test_too_many_variables_and_points_are_refused():
    most = qmc.Sobol.MAXDIM
    with pytest.raises(ValueError, match=f"at most {most} variables, and the scatter has {most + 1}"):
        SobolPoints(most + 1, np.random.default_rng(0), 1)
    with pytest.raises(ValueError, match=rf"ends after 2\^30 points, but {2**30 + 1} points are needed"):
        SobolPoints(1, np.random.default_rng(0), 2**30 + 1)
