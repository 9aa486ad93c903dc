"""The larger demand of two components that act separately, against NumPy sample by sample."""

import numpy as np
import pytest

import warpdyn as wd

LEVELS = [0.1, 0.2, 0.4, 0.8, 1.6]
RECORDS, STRUCTURES = 4, 6
COUNT = 500
SETTINGS = {"device": "cpu", "seed": 1}


def motions(order=(0, 1)):
    random = np.random.default_rng(7)
    envelope = np.exp(-(((0.01 * np.arange(COUNT) - 2) / 1) ** 2))
    rows = random.normal(size=(RECORDS, 2, COUNT)) * envelope * np.array([1.0, 0.6])[:, None]
    return [
        wd.GroundMotion(rows[record, place], 0.01, f"{record}{'NE'[place]}", record=f"quake {record}", component=c)
        for record in range(RECORDS)
        for place in order
        for c in "NE"[place]
    ]


def building(**more):
    law = wd.laws.Bilinear(yield_force=[1.5e5, 1e5], hardening_ratio=0.02)
    return wd.ShearBuilding([1e5, 1e5], [3e7, 2e7], 3.0, law=law, damping="rayleigh", damping_ratio=0.05, **more)


SCATTER = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
MEAN = wd.GeometricMean(wd.PeakGroundAcceleration())


@pytest.fixture(scope="module")
def run():
    scene = wd.Scene(building(), wd.Stripes(motions(), LEVELS, MEAN), SCATTER, collapse_drift_ratio=0.03)
    return wd.simulate(scene, structures=STRUCTURES, **SETTINGS)


def table(run, name):
    """Return values as [structure, record, component, level, ...]; samples are sorted so."""
    return run[name].values.reshape(STRUCTURES, RECORDS, 2, len(LEVELS), *run[name].shape[1:])


def test_demands_are_the_larger_ones(run):
    larger = wd.larger_of_components(run, motions())
    assert larger.sizes == {**run.sizes, "sample": run.sizes["sample"] // 2, "motion": RECORDS}
    shape = (STRUCTURES, RECORDS, len(LEVELS))
    status = table(run, "status")
    due = np.where((status == 1).any(axis=2), 1, 0)
    assert {*due.ravel()} == {0, 1}
    np.testing.assert_array_equal(larger["status"].values.reshape(shape), due)
    for name in ("peak_storey_drift_ratio", "peak_floor_acceleration", "peak_base_shear", "input_energy"):
        values = table(run, name)
        np.testing.assert_array_equal(larger[name].values.reshape(*shape, *values.shape[4:]), values.max(axis=2))
    residual, found = table(run, "residual_drift_ratio"), larger["residual_drift_ratio"].values.reshape(*shape, 2)
    is_ok = due == 0
    np.testing.assert_array_equal(np.abs(found[is_ok]), np.abs(residual).max(axis=2)[is_ok])
    assert np.isnan(found[~is_ok]).all()
    times = table(run, "time_of_collapse")
    first = np.where(np.isnan(times), np.inf, times).min(axis=2)
    found = larger["time_of_collapse"].values.reshape(shape)
    np.testing.assert_array_equal(found, np.where(np.isinf(first), np.nan, first))
    storeys = np.take_along_axis(
        table(run, "storey_of_collapse"), np.where(np.isnan(times), np.inf, times).argmin(axis=2)[:, :, None], axis=2
    )[:, :, 0]
    np.testing.assert_array_equal(larger["storey_of_collapse"].values.reshape(shape), storeys)
    np.testing.assert_array_equal(larger["yield_force"].values.reshape(*shape, 2), table(run, "yield_force")[:, :, 0])
    np.testing.assert_array_equal(larger["motion_name"], [f"quake {record}" for record in range(RECORDS)])
    np.testing.assert_array_equal(larger["motion_index"].values.reshape(shape)[0, :, 0], np.arange(RECORDS))
    assert "storey_of_peak_drift" not in larger
    assert {"scene", "fingerprint"}.isdisjoint(larger.attrs)
    assert larger.attrs["history"].endswith("warpdyn.larger_of_components")


def test_fragility_counts_a_record_once(run):
    limits = {"slight": 0.006, "complete": 0.02}
    larger = wd.larger_of_components(run, motions())
    curves, separate = wd.fragility(larger, limits), wd.fragility(run, limits)
    drift = table(run, "peak_storey_drift_ratio").max(axis=(2, 4))
    collapsed = (table(run, "status") == 1).any(axis=2)
    for place, limit in enumerate(limits.values()):
        due = ((drift > limit) | collapsed).mean(axis=(0, 1))
        found = curves["exceedance_fraction"].isel(damage_state=place).values
        np.testing.assert_allclose(found, due, rtol=1e-12)
    # The larger of two demands exceeds a limit at lower levels.
    assert (curves["fragility_median"] < separate["fragility_median"]).all()


def test_the_order_of_samples_and_components_does_not_matter(run):
    due = wd.larger_of_components(run, motions())
    random = np.random.default_rng(3)
    shuffled = wd.larger_of_components(run.isel(sample=random.permutation(run.sizes["sample"])), motions())
    keys = ("structure", "motion_index", "im_level")
    for name in ("peak_storey_drift_ratio", "status"):
        tables = [each.set_index(sample=keys)[name].sortby("sample").values for each in (due, shuffled)]
        np.testing.assert_array_equal(*tables)
    part = wd.larger_of_components(run.isel(sample=run["motion_index"].values >= 2), motions())
    np.testing.assert_array_equal(part["motion_index"], due["motion_index"][due["motion_index"] >= 1])


def test_failures_are_no_collapses(run):
    changed = run.copy(deep=True)
    rows = np.flatnonzero((run["structure"] == 0) & (run["im_level"] == 0.1))  # N and E of four records
    for row, status in zip(rows, (2, 0, 1, 3, 0, 2, 4, 3), strict=True):
        changed["status"][row] = status
    larger = wd.larger_of_components(changed, motions())
    at = larger["status"].values[(larger["structure"] == 0) & (larger["im_level"] == 0.1)]
    np.testing.assert_array_equal(at, [2, 1, 2, 4])


def test_wrong_runs_are_refused(run):
    with pytest.raises(ValueError, match="that are not those of the run, '0N', '0E'"):
        wd.larger_of_components(run, motions()[:4])
    with pytest.raises(ValueError, match="that are not those of the run"):
        wd.larger_of_components(run, motions((1, 0)))
    with pytest.raises(ValueError, match=r"structure 0 at 0\.1 has not one sample for each of .* '0N' and '0E'"):
        wd.larger_of_components(run.isel(sample=slice(1, None)), motions())
    with pytest.raises(ValueError, match="run has no 'motion_name'"):
        wd.larger_of_components(run.drop_vars("motion_name"), motions())
    with pytest.raises(TypeError, match="larger_of_components"):
        wd.larger_of_components("run", motions())
    nested = wd.Stripes(motions(), LEVELS, MEAN, structures_per_motion=2)
    own = wd.simulate(wd.Scene(building(), nested, SCATTER, recorders=("drift",)), **SETTINGS)
    with pytest.raises(ValueError, match='structures_per_motion="crossed"'):
        wd.larger_of_components(own, motions())
    alone = wd.simulate(wd.Scene(building(), wd.Cloud(motions()), recorders=("drift",)), **SETTINGS)
    with pytest.raises(ValueError, match="use a measure of pairs"):
        wd.larger_of_components(alone, motions())
    events = wd.EventSequence({"first": wd.Cloud(motions(), MEAN), "second": wd.Cloud(motions()[:2], MEAN)})
    sequence = wd.simulate(wd.Scene(building(), events, recorders=("drift",)), **SETTINGS)
    with pytest.raises(ValueError, match="select one by select_event"):
        wd.larger_of_components(sequence, motions())


def test_a_cloud_has_one_sample_for_each_record(run):
    cloud = wd.simulate(wd.Scene(building(), wd.Cloud(motions(), MEAN), recorders=("drift",)), **SETTINGS)
    larger = wd.larger_of_components(cloud, motions())
    due = cloud["peak_storey_drift_ratio"].values.reshape(RECORDS, 2, 2).max(axis=1)
    np.testing.assert_array_equal(larger["peak_storey_drift_ratio"], due)
    np.testing.assert_array_equal(larger["im_level"], cloud["im_level"].values[::2])
