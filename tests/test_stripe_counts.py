"""Samples counted by record and stripe: what is refused before it is counted, and numbers of records with gaps."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
import xarray as xr
from test_fragility import make_run, synthetic_run

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]


def test_levels_of_their_own_are_refused_before_they_are_counted():
    # A table of 44 records, 64 groups of structures and 100,000 levels would take 2 GB.
    samples, generator = 100_000, np.random.default_rng(1)
    run = make_run(generator.random(samples), generator.integers(0, 44, samples), generator.random(samples) + 0.1)
    run["structure"] = run["structure"] % 1000
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match="100000 values for 100000 pairs of record and level"):
            wd.fragility(run, {"light": 0.02})
        assert tracemalloc.get_traced_memory()[1] < 100e6  # some ten columns of 100,000 numbers, with room
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("of", ["motion_index", "structure"])
def test_numbers_with_gaps_and_far_from_0_are_counted_as_those_without(of):
    run, limits = synthetic_run(8), {"light": 0.01}
    first = wd.fragility(run, limits)
    for numbers in (3 * run[of] + 7, 10_000_000 * run[of].astype(np.int64), run[of].astype("U8")):
        again = wd.fragility(run.assign_coords({of: numbers}), limits)
        if numbers.dtype.kind == "U":  # in the order of letters: replicates are drawn in another one
            again, first = (each[["fragility_median", "fragility_median_lower"]] for each in (again, first))
            xr.testing.assert_allclose(again, first, rtol=1e-9)  # sums in another order
        else:
            xr.testing.assert_identical(again, first)
