"""Exceedance probabilities of independent samples: the first passage of an oscillator, and SciPy's binomial test."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter, ss2tf
from scipy.stats import binomtest

import warpdyn as wd

OMEGA, ZETA, DENSITY, MASS = 2 * np.pi, 0.05, 0.005, 1e5  # rad/s, 1, m2/s3, kg
DEVIATION = np.sqrt(np.pi * DENSITY / (2 * ZETA * OMEGA**3))  # m, of the stationary displacement
DURATION, INTERVAL = 20.0, 0.01  # s
NAMES = ("exceedance_probability_lower", "exceedance_probability", "exceedance_probability_upper")
LIMITS = {"low": 2.5 * DEVIATION, "high": 3.0 * DEVIATION}


def oscillator(**capacity):
    dashpot = 2 * ZETA * OMEGA * MASS
    return wd.ShearBuilding(MASS, MASS * OMEGA**2, 3.0, damping="storey", damping_coefficient=dashpot, **capacity)


def simulated(structure, structures=2000):
    noise = wd.FilteredNoise(wd.WhiteNoise(DENSITY), DURATION, INTERVAL)
    scene = wd.Scene(structure, noise, recorders=("drift",), tail=0.0)
    return wd.simulate(scene, structures=structures, seed=1, device="cpu")


@pytest.fixture(scope="module")
def run():
    return simulated(oscillator())


def shares_by_filter(samples):
    """Return the shares of oscillators that exceed each limit, from SciPy's exact filter of linear noise."""
    matrix, load = np.array([[0.0, 1.0], [-(OMEGA**2), -2 * ZETA * OMEGA]]), np.array([[0.0], [1.0]])
    system = matrix, load, np.array([[1.0, 0.0]]), np.zeros((1, 1))
    numerator, denominator = ss2tf(*cont2discrete(system, INTERVAL, method="foh")[:4])
    steps = round(DURATION / INTERVAL)
    noise = np.random.default_rng(5).normal(size=(samples, steps)) * np.sqrt(2 * np.pi * DENSITY / INTERVAL)
    peaks = np.abs(lfilter(numerator[0], denominator, noise, axis=1)).max(axis=1)
    return np.array([np.mean(peaks > limit) for limit in LIMITS.values()])


def test_first_passage_agrees_with_a_filter(run):
    found = wd.exceedance_probability(run, LIMITS, demand="peak_storey_drift")
    expected, other = found["exceedance_probability"].values, 4000
    of_filter = shares_by_filter(other)
    error = np.sqrt(of_filter * (1 - of_filter) * (1 / 2000 + 1 / other))
    assert (np.abs(expected - of_filter) < 3 * error).all()
    assert (error < 0.02).all()
    # A Poisson process of upcrossings of independent peaks is far off, at this damping: peaks come in clumps.
    rate = OMEGA / np.pi * np.exp(-0.5 * np.array([2.5, 3.0]) ** 2)
    assert (expected < 1 - np.exp(-rate * DURATION) - 0.15).all()


def test_times_of_peaks_are_stated(run):
    found = wd.exceedance_probability(run, LIMITS, demand="peak_storey_drift")
    assert found.attrs["peaks_recorded"] == "at the ends of integration steps of 0.01 s"  # T/100
    without = wd.exceedance_probability(run.drop_vars("integration_step"), LIMITS, demand="peak_storey_drift")
    assert without.attrs["peaks_recorded"] == "at the ends of integration steps"


def test_intervals_are_those_of_scipy(run):
    for confidence in (0.95, 0.8):
        found = wd.exceedance_probability(run, LIMITS, demand="peak_storey_drift", confidence=confidence)
        for state, limit in LIMITS.items():
            count = int((run["peak_storey_drift"].values > np.float32(limit)).sum())
            bounds = binomtest(count, 2000).proportion_ci(confidence, method="exact")
            values = [float(found[name].sel(damage_state=state)) for name in NAMES]
            np.testing.assert_allclose(values, [bounds.low, count / 2000, bounds.high], rtol=1e-9)
            assert int(found["exceeding_samples"].sel(damage_state=state)) == count
    never = wd.exceedance_probability(run, {"never": 1.0}, demand="peak_storey_drift")
    # No sample of n: the upper bound is 1 - 0.025^(1/n).
    np.testing.assert_allclose([float(never[name][0]) for name in NAMES], [0, 0, 1 - 0.025 ** (1 / 2000)], rtol=1e-9)


def test_a_collapse_is_an_exceedance(run):
    ended = simulated(oscillator(drift_capacity=LIMITS["high"]))
    collapses = wd.exceedance_probability(ended, {"collapse": np.inf})
    passages = wd.exceedance_probability(run, {"high": LIMITS["high"]}, demand="peak_storey_drift")
    assert int(collapses["exceeding_samples"][0]) == int(passages["exceeding_samples"][0]) > 0
    assert float(ended["time_of_collapse"].max()) <= DURATION + INTERVAL


def test_samples_that_share_motions_are_refused(run):
    motions = [
        wd.GroundMotion(row, 0.02, str(i)) for i, row in enumerate(np.random.default_rng(1).normal(size=(4, 200)))
    ]
    spread = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.1))}
    crossed = wd.simulate(wd.Scene(oscillator(), wd.Cloud(motions), spread, recorders=("drift",)), structures=3)
    limits = {"low": 0.001}
    with pytest.raises(
        ValueError, match=r"12 samples of 3 structures and 4 motions.*not independent.*select one struct"
    ):
        wd.exceedance_probability(crossed, limits)
    one = crossed.isel(sample=crossed["structure"].values == 0)
    assert int(wd.exceedance_probability(one, limits)["valid_samples"]) == 4
    stripes = wd.Stripes(motions[:1], [0.1, 0.2], wd.PeakGroundAcceleration())
    two = wd.simulate(wd.Scene(oscillator(), stripes, recorders=("drift",)))
    with pytest.raises(ValueError, match=r"2 samples of 1 structures and 1 motions.*select one level"):
        wd.exceedance_probability(two, limits)
    assert int(wd.exceedance_probability(two.isel(sample=[0]), limits)["valid_samples"]) == 1
    with pytest.raises(ValueError, match="the run is empty"):
        wd.exceedance_probability(run.isel(sample=[]), limits)
    with pytest.raises(ValueError, match="has no 'peak_floor_acceleration'"):
        wd.exceedance_probability(run, {"low": 3.0}, demand="peak_floor_acceleration")
    failed = run.assign(status=run["status"].copy(data=np.where(np.arange(2000) < 30, 2, run["status"].values)))
    with pytest.raises(ValueError, match="30 of 2000 samples failed"):
        wd.exceedance_probability(failed, limits)


def test_runs_without_intensity_levels_are_sent_to_this_function(run):
    with pytest.raises(ValueError, match=r"no 'im_level'.*use wd.exceedance_probability\(run, limits\)"):
        wd.fragility(run, {"low": 0.005})
    noise = wd.FilteredNoise(wd.WhiteNoise(DENSITY), DURATION, INTERVAL)
    with pytest.raises(TypeError, match=r"motions = \[noise.motion\(i, seed=1\)"):
        wd.capacities(wd.Scene(oscillator(), noise), {"low": 0.005})
