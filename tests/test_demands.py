"""Damage states by any demand of a run, and by several at once."""

import numpy as np
import pytest
import xarray as xr
from test_fragility import make_run, synthetic_run

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]


def with_floors(run, seed=0):
    """Add floor accelerations [m/s2] in single precision and base shears that have nothing to do with the drifts."""
    generator = np.random.default_rng(seed)
    level = run["im_level"].values
    floors = 4.0 * level[:, None] * np.exp(0.4 * generator.standard_normal((level.size, 3)))
    attributes = {"units": "m s-2"}
    return run.assign(
        peak_floor_acceleration=(("sample", "floor"), floors.astype(np.float32), attributes),
        peak_base_shear=("sample", floors[:, 0] * 1e5, {"units": "N"}),
        floor=("floor", [1, 2, 3]),
    )


def test_floor_accelerations():
    run = with_floors(synthetic_run(1))
    curves = wd.fragility(run, {"contents": 3.0}, demand="peak_floor_acceleration")
    floors = run["peak_floor_acceleration"].values.astype(np.float64)
    for level, fraction in zip(curves["stripe"].values, curves["exceedance_fraction"].values[0], strict=True):
        here = run["im_level"].values == level
        assert fraction == pytest.approx((floors[here].max(axis=1) > 3).mean(), abs=1e-12)
        second = curves["floor_exceedance_fraction"].sel(stripe=level, floor=2, damage_state="contents")
        assert second.item() == pytest.approx((floors[here, 1] > 3).mean(), abs=1e-12)
    assert curves["damage_limit"].attrs["units"] == "m s-2"
    assert curves.attrs["demand"] == "peak_floor_acceleration"


def test_a_demand_without_places():
    run = with_floors(synthetic_run(1))
    curves = wd.fragility(run, {"base": 3e5}, demand="peak_base_shear")
    first = wd.fragility(run, {"base": 3.0}, demand="peak_floor_acceleration")["floor_fragility_median"].sel(floor=1)
    assert curves["fragility_median"].item() == pytest.approx(first.item(), rel=1e-3)  # rounded to single precision
    assert not [name for name in curves.data_vars if str(name).startswith("storey_")]


def test_the_worst_of_several_demands():
    run = with_floors(synthetic_run(1))
    limits = {
        "light": {"peak_storey_drift_ratio": 0.02, "peak_floor_acceleration": 5.0},
        "heavy": {"peak_storey_drift_ratio": 0.04},
        "lost": {"peak_floor_acceleration": 12.0},
    }
    curves = wd.fragility(run, limits)
    drift, floors = (run[name].values.max(axis=1) for name in ("peak_storey_drift_ratio", "peak_floor_acceleration"))
    lost = floors > 12
    heavy = (drift > 0.04) | lost
    light = (drift > 0.02) | (floors > 5) | heavy
    for level in curves["stripe"].values:
        here = run["im_level"].values == level
        counted = curves["exceeding_samples"].sel(stripe=level).values.tolist()
        assert counted == [int(state[here].sum()) for state in (light, heavy, lost)]
    assert curves["damage_limit"].dims == ("limited_demand", "damage_state")
    assert np.isnan(curves["damage_limit"].sel(limited_demand="peak_floor_acceleration", damage_state="heavy"))
    assert "units" not in curves["damage_limit"].attrs  # drifts and accelerations have none in common
    assert curves["demand_units"].sel(limited_demand="peak_floor_acceleration").item() == "m s-2"


def test_a_limit_is_compared_in_the_precision_of_the_demand():
    # 0.1 as a float32 is above 0.1: it exceeds the limit, and the next one below does not.
    above, below = np.float32(0.1), np.nextafter(np.float32(0.1), np.float32(0))
    run = make_run([[above], [below], [above], [below]], [0, 0, 1, 1], [0.1, 0.2, 0.1, 0.2])
    run = run.assign(peak_storey_drift_ratio=run["peak_storey_drift_ratio"].astype(np.float32))
    with pytest.warns(UserWarning, match="no lognormal fit"):
        curves = wd.fragility(run, {"light": 0.1})
    assert curves["exceeding_samples"].values.tolist() == [[2, 0]]


def test_levels_in_other_units_than_g():
    run = synthetic_run(3)
    in_metres = run.assign_coords(im_level=("sample", run["im_level"].values, {"units": "m s-1", "long_name": "PGV"}))
    curves, plain = (wd.fragility(each, {"light": 0.02}) for each in (in_metres, run))
    assert curves["fragility_median"].attrs == {"long_name": "median capacity, worst place", "units": "m s-1"} | {
        "comment": "NaN without a lognormal fit of the stripes"
    }
    xr.testing.assert_equal(curves["fragility_median"], plain["fragility_median"])


@pytest.mark.parametrize(
    ("limits", "options", "message"),
    [
        ({"light": 0.02}, {"demand": "peak_drift"}, "no 'peak_drift': add its recorder.*peak_base_shear"),
        ({"light": {}}, {}, "'light' are empty"),
        ({"light": {"peak_base_shear": -1.0}}, {}, "'light' is -1.0"),
        ({"light": [0.01, 0.02]}, {}, "must be one number"),
        ({"light": {"peak_base_shear": 2.0}, "heavy": {"peak_base_shear": 1.0}}, {}, "must increase.*peak_base_shear"),
        ({"light": 0.02}, {"demand": "status"}, "is not a demand"),
    ],
)
def test_limits_that_fit_no_demand_are_refused(limits, options, message):
    with pytest.raises(ValueError, match=message):
        wd.fragility(with_floors(synthetic_run(1)), limits, **options)


def test_structures_dealt_out_by_a_sobol_sequence_stay_in_their_runs():
    from warpdyn.answers.fragility.stripe_counts import structure_groups

    structure = np.repeat(np.arange(64), 10)
    record = np.tile(np.arange(10), 64)
    is_crossed, count, group = structure_groups(structure, record, 10, "sobol")
    assert (is_crossed, count) == (True, 8)
    assert (group == structure // 8).all()  # runs of 2^3
    assert structure_groups(structure, record, 10, "monte_carlo")[1] == 64
    assert structure_groups(np.arange(640), record, 10, "monte_carlo")[:2] == (
        False,
        1,
    )  # each structure under one record
