"""Parts of a run: storeys of the building itself, whose drifts fragility and damage are of."""

import warnings

import numpy as np
import pytest
from test_simulate import MOTIONS

import warpdyn as wd

LEVELS = [0.2, 0.4, 0.8, 1.6]
RUBBER = {"displacement_capacity": 0.2, "stiffness": 2e5, "yield_force": 2e3, "post_yield_stiffness": 2e4}


def run_isolated(damped, **rubber):
    building = wd.ShearBuilding(2e3, [2e6, 1.5e6], 3.0, law="bilinear", yield_force=1e4, hardening_ratio=0.1, **damped)
    isolated = building.on_isolators("lead_rubber_bearing", 2e3, **RUBBER | rubber)
    stripes = wd.Stripes(MOTIONS, LEVELS, wd.PeakGroundAcceleration())
    return wd.simulate(wd.Scene(isolated, stripes, collapse_drift_ratio=0.1, tail=1.0), device="cpu")


@pytest.fixture(params=["none", "rayleigh"])
def run(request):
    return run_isolated({} if request.param == "none" else {"damping": "rayleigh", "damping_ratio": 0.05})


@pytest.mark.filterwarnings("ignore:.*:UserWarning")  # three records make no intervals
def test_storeys_of_a_building_on_isolators(run):
    own = wd.select_storeys(run, 2, 3)
    drift = run["peak_storey_drift_ratio"].values
    np.testing.assert_array_equal(own["peak_storey_drift_ratio"], drift[:, 1:])
    np.testing.assert_array_equal(own["peak_floor_acceleration"], run["peak_floor_acceleration"][:, 1:])
    for dim in ("storey", "floor"):
        np.testing.assert_array_equal(own[dim], [1, 2])
        assert own[dim].attrs == run[dim].attrs
    assert "storey_of_peak_drift" not in own
    # Isolators move by a part of their capacity where the building hardly does: counted with them, it is damaged.
    limit = 1.2 * float(drift[:, 1:][run["status"] == 0].max())
    counted = [
        np.mean((drift[here, 1:].max(axis=1) > limit) | (run["status"].values[here] == 1))
        for here in (run["im_level"].values == level for level in LEVELS)
    ]
    right, again = (wd.fragility(part, {"slight": limit})["exceedance_fraction"][0] for part in (own, run))
    wrong = wd.fragility(run, {"slight": limit}, added_storeys=True)["exceedance_fraction"][0]
    np.testing.assert_allclose(right, counted)
    np.testing.assert_array_equal(right, again)
    assert float(right.mean()) < float(wrong.mean()) - 0.2


@pytest.mark.filterwarnings("ignore:.*:UserWarning")  # three records make no intervals
def test_isolators_that_fail_collapse_no_storey_of_the_building():
    run = run_isolated({}, displacement_capacity=0.01)
    failed = run["status"].values == 1
    assert failed.any()
    np.testing.assert_array_equal(run["storey_of_collapse"], np.where(failed, 1, -1))
    np.testing.assert_array_equal(wd.select_storeys(run, 2, 3)["storey_of_collapse"], -1)
    np.testing.assert_array_equal(wd.select_storeys(run, 1, 2)["storey_of_collapse"], run["storey_of_collapse"])
    # The drifts of the building when its isolators fail say nothing of the drift at which it collapses itself.
    limit = {"complete": 0.09}
    assert float(run["peak_storey_drift_ratio"][failed, 1:].max()) < limit["complete"]
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "(?s).*is above the least drift ratio at which samples collapsed")
        wd.fragility(wd.select_storeys(run, 2, 3), limit)


@pytest.mark.parametrize("storeys", [(0, 2), (2, 4), (3, 2), (1.5, 2)])
def test_storeys_that_are_not_there(run, storeys):
    with pytest.raises(ValueError, match=r"must be a whole number of at least 1|which has storeys 1 to 3"):
        wd.select_storeys(run, *storeys)
