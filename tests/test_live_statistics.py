"""Statistics of live ensembles: computed on the device, with the values of `np.quantile` and of counts by NumPy."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

import warpdyn as wd
from warpdyn.campaigns.integration.run import prepare
from warpdyn.campaigns.live.paused_ensemble import PausedEnsemble
from warpdyn.campaigns.live.sample_statistics import SampleStatistics
from warpdyn.campaigns.reductions.limits import DamageLimits

SAMPLES, QUANTILES = 1001, np.array([0.0, 0.05, 0.16, 0.5, 0.84, 1.0])
LIMITS = DamageLimits.of(
    {"slight": {"peak_storey_drift_ratio": 0.005}, "moderate": {"residual_drift_ratio": 0.004}}
    | {"heavy": {"peak_storey_drift_ratio": 0.02, "residual_drift_ratio": 0.01}}
)
DEMANDS = ["peak_storey_drift", "peak_storey_drift_ratio", "peak_floor_acceleration", "residual_drift_ratio"]
COUNTED = {"peak_storey_drift_ratio": slice(None), "residual_drift_ratio": slice(1, 3)}


def paused(dtype: str, random_heights: bool) -> PausedEnsemble:
    """Return an ensemble whose outputs are random numbers; 20 % of its samples have failed, and some collapsed."""
    building = wd.ShearBuilding(np.full(3, 2e5), 2e8, [4.0, 3.0, 3.1], damping="storey", damping_coefficient=1e6)
    scatter = {"height": wd.RandomFactor(wd.Lognormal(1.0, 0.1))} if random_heights else {}
    recorders = ("drift", "acceleration", "residual")
    scene = wd.Scene(building, wd.GroundMotion(np.zeros(9), 0.01), scatter, recorders=recorders)
    ensemble, _ = prepare(scene, structures=SAMPLES, device="cpu", method="rk4", dtype=dtype, step=0.01)
    found, random = PausedEnsemble(ensemble), np.random.default_rng(7)
    for name, shape in ensemble.model.shapes.items():
        array = getattr(found.output, name)
        values = random.lognormal(-4.0, 1.0, (*reversed(shape), SAMPLES))
        if "residual" in name:
            values *= random.choice([-0.1, 0.1], values.shape)
        array.assign(values.astype(wp.dtype_to_numpy(array.dtype)))
    status = random.choice(np.arange(6), SAMPLES, p=[0.7, 0.1, 0.1, 0.05, 0.03, 0.02])
    found.output.status.assign(status.astype(np.int8))
    return found


def demands_of(ensemble: PausedEnsemble) -> dict[str, np.ndarray]:
    """Return the demands by NumPy, shape [sample, ...], in the number type of the run."""
    rows = ensemble.read_outputs()
    heights = ensemble.ensemble.storey_heights.astype(ensemble.dtype)
    return rows | {"peak_storey_drift_ratio": rows["peak_storey_drift"] / heights}


@pytest.mark.parametrize("by_radix", [False, True])
@pytest.mark.parametrize("random_heights", [False, True])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_statistics_are_those_of_numpy(dtype, random_heights, by_radix):
    ensemble = paused(dtype, random_heights)
    statistics = SampleStatistics(ensemble, DEMANDS, QUANTILES, LIMITS, COUNTED, by_radix=by_radix)
    found, rows = statistics.find(), demands_of(ensemble)
    status = rows["status"]
    ended = status < 2
    np.testing.assert_array_equal(found.of_status, np.bincount(status, minlength=6))
    for name in DEMANDS:
        due = np.quantile(rows[name][ended].astype(np.float64), QUANTILES, axis=0)
        np.testing.assert_array_equal(found.quantiles[name], due)
    worst = rows["peak_storey_drift_ratio"].max(axis=1).astype(float)
    residual = np.abs(rows["residual_drift_ratio"][:, 1:3]).max(axis=1).astype(float)
    state = np.where((worst > 0.02) | (residual > 0.01), 3, np.where(residual > 0.004, 2, (worst > 0.005).astype(int)))
    state[status == 1] = 3
    np.testing.assert_array_equal(found.in_state, np.bincount(state[ended], minlength=4))
    assert found.in_state.min() > 0
    again = statistics.find()
    np.testing.assert_array_equal(again.in_state, found.in_state)
    np.testing.assert_array_equal(again.quantiles[DEMANDS[0]], found.quantiles[DEMANDS[0]])


def test_unknown_and_infinite_demands_and_failed_samples():
    ensemble = paused("float32", False)
    drift = ensemble.output.peak_storey_drift.numpy()
    status = ensemble.output.status.numpy()
    ok, alone = np.flatnonzero(status == 0), np.flatnonzero(status > 1)[0]
    drift[0, ok[:2]] = [np.nan, 1.0]
    drift[1, ok[:400]] = np.inf
    statistics = SampleStatistics(ensemble, DEMANDS[:2], QUANTILES[1:5], LIMITS, COUNTED)
    found, rows = statistics.find(), demands_of(ensemble)
    for name in DEMANDS[:2]:
        assert np.isnan(found.quantiles[name][:, 0]).all()
        with np.errstate(invalid="ignore"):
            due = np.quantile(rows[name][status < 2].astype(np.float64), QUANTILES[1:5], axis=0)
        np.testing.assert_array_equal(found.quantiles[name], due)
    # A sample with an unknown demand exceeds no limit of this demand.
    assert found.in_state.sum() == np.count_nonzero(status < 2)
    status[:] = 2
    failed = statistics.find()
    assert np.isnan(failed.quantiles["peak_storey_drift"]).all()
    assert failed.in_state.sum() == 0
    assert failed.of_status.tolist() == [0, 0, SAMPLES, 0, 0, 0]
    status[alone] = 1  # the only sample
    one = statistics.find()
    assert one.in_state.tolist() == [0, 0, 0, 1]
    np.testing.assert_array_equal(one.quantiles["peak_storey_drift"], np.tile(drift[:, alone].astype(float), (4, 1)))
