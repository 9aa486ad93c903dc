"""Parts of a run: storeys of the building itself, which fragility and damage count, and events of a sequence."""

import warnings

import numpy as np
import pytest
import xarray as xr
from test_simulate import MOTIONS

import warpdyn as wd

LEVELS = [0.2, 0.4, 0.8, 1.6]
LATER = [0.3, 0.6, 1.2]
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
        warnings.filterwarnings("error", "(?s).*the smallest drift ratio at which a sample collapsed")
        wd.fragility(wd.select_storeys(run, 2, 3), limit)


@pytest.mark.parametrize("storeys", [(0, 2), (2, 4), (3, 2), (1.5, 2)])
def test_storeys_that_are_not_there(run, storeys):
    with pytest.raises(ValueError, match=r"must be a whole number of at least 1|which has storeys 1 to 3"):
        wd.select_storeys(run, *storeys)


def made_sequence() -> xr.Dataset:
    """Return a run of stripes after stripes without a simulation: 3 structures, 4 histories before 6 each."""
    first, second = [(0, 0.1), (0, 0.4), (1, 0.1), (1, 0.4)], [(motion, level) for motion in (0, 1) for level in LATER]
    rows = [(structure, *one, *two) for structure in range(3) for one in first for two in second]
    structure, *columns = (np.array(column) for column in zip(*rows, strict=True))
    # A building that a motion of 0.4 has damaged drifts twice as far.
    factor = (1 + 0.1 * structure) * (1 + 0.2 * columns[2])
    drifts = np.column_stack([0.01 * columns[1], 0.01 * factor * columns[3] * np.where(columns[1] == 0.4, 2, 1)])
    status = {"flag_values": np.arange(5), "flag_meanings": "ok collapsed diverged unstable_step not_converged"}
    level = {"long_name": "PGA", "units": "g", "design": "of a sequence: see select_event"}
    of_event = {"long_name": "PGA", "units": "g", "design": "stripes"}
    return xr.Dataset(
        {
            "peak_storey_drift_ratio": (("sample", "event", "storey"), drifts[:, :, None], {"units": "1"}),
            "status": (("sample", "event"), np.zeros((72, 2), dtype=np.int8), status),
            "motion_name": ("motion", ["a", "b"]),
        },
        {
            "sample": np.arange(72, dtype=np.int32),
            "event": ["first", "second"],
            "storey": [1],
            "motion": [0, 1],
            "structure": ("sample", structure.astype(np.int32), {"sampling": "sobol"}),
            "motion_index": (("sample", "event"), np.column_stack(columns[::2]).astype(np.int32)),
            "im_level": (("sample", "event"), np.column_stack(columns[1::2]), level),
            "samples_per_history": ("event", np.array([6, 1], dtype=np.int32)),
            **{f"im_level_{key}": ("event", [value] * 2) for key, value in of_event.items()},
        },
    )


@pytest.mark.fast
@pytest.mark.filterwarnings("ignore:.*:UserWarning")  # two records make no intervals
def test_samples_of_a_later_event_differ_by_the_history_before():
    run = made_sequence()
    first, second = wd.select_event(run, "first"), wd.select_event(run, "second")
    assert "earlier_history" not in first.coords
    np.testing.assert_array_equal(second["earlier_history"], np.repeat(range(12), 6))
    # Each history of the second event begins where the first event with the same number ended.
    before = first.isel(sample=second["earlier_history"].values)
    np.testing.assert_array_equal(before["im_level"], run["im_level"].sel(event="first"))
    level, drift = second["im_level"].values, second["peak_storey_drift_ratio"].values[:, 0]
    counted = [np.mean(drift[level == value] > 0.01) for value in LATER]
    assert counted[0] < counted[1] < counted[2]
    np.testing.assert_allclose(wd.fragility(second, {"moderate": 0.01})["exceedance_fraction"][0], counted)
    # The damaged buildings alone, and the same samples twice, with numbers of their own.
    damaged = second.isel(sample=np.flatnonzero(before["im_level"].values == 0.4))
    fractions = wd.fragility(damaged, {"moderate": 0.01})["exceedance_fraction"][0]
    drift = damaged["peak_storey_drift_ratio"].values[:, 0]
    by_hand = [np.mean(drift[damaged["im_level"].values == value] > 0.01) for value in LATER]
    assert np.mean(by_hand) > np.mean(counted)
    np.testing.assert_allclose(fractions, by_hand)
    twice = xr.concat([second, second], "sample", data_vars="minimal", coords="minimal", compat="equals", join="outer")
    with pytest.raises(ValueError, match=r"72 of 144 samples occur twice.*earlier_history 0"):
        wd.fragility(twice.assign_coords(sample=np.arange(144)), {"moderate": 0.01})
