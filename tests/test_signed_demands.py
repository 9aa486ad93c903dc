"""Demands that have a sign, as residual drift ratios, count by their magnitude."""

import numpy as np
import pytest
import xarray as xr
from test_fragility import synthetic_run

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]


def test_signed_demands_count_by_their_magnitude():
    run, limits = synthetic_run(8), {"light": 0.01, "heavy": 0.03}
    drift = run["peak_storey_drift_ratio"]
    sign = xr.DataArray(np.random.default_rng(3).choice([-1.0, 1.0], drift.shape), dims=drift.dims)
    signed = run.assign(residual_drift_ratio=sign * drift)
    got = wd.fragility(signed, limits, demand="residual_drift_ratio")
    names = ["exceeding_samples", "storey_exceedance_fraction", "fragility_median", "fragility_dispersion"]
    xr.testing.assert_equal(got[names], wd.fragility(run, limits)[names])
    clouds = [wd.fragility_of_cloud(signed, limits, demand=name) for name in ("residual_drift_ratio", drift.name)]
    xr.testing.assert_equal(*(each["fragility_median"] for each in clouds))
