"""The study of how the time of a run grows: what it prints, of times that are known."""

import sys

import numpy as np
import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "studies"))
from parts.growth.axes import axes, exponent, steps_of_cost

pytestmark = pytest.mark.fast


def test_exponent_is_that_of_the_upper_half():
    sizes = np.array([1.0, 2, 4, 8, 16, 32])
    assert exponent(sizes, np.maximum(4.0, sizes)) == pytest.approx(1.0)  # a floor below, in proportion above
    assert exponent(sizes, 3.0 * sizes**1.5) == pytest.approx(1.5)


def test_cliffs_stand_between_neighbours():
    assert list(steps_of_cost(np.array([1, 2, 4]), np.array([1.0, 3.0, 1.5]))) == [(1, 2, 3.0), (2, 4, 0.5)]


def test_axes_reach_what_is_asked_for():
    sizes = axes(2**24)
    assert (sizes["samples"][0].samples, sizes["samples"][-1].samples) == (2**8, 2**24)
    assert (sizes["storeys"][0].storeys, sizes["storeys"][-1].storeys) == (1, 60)
    assert (sizes["motions"][0].motions, sizes["motions"][-1].motions) == (1, 10_000)
    for axis in ("storeys", "steps", "motions"):  # as much work at each size, but where a run has its least samples
        work = [size.storey_steps for size in sizes[axis] if size.samples > 256]
        assert max(work) < 1.1 * min(work)
