"""Rare events of scenes: first passage of a linear and of a yielding oscillator, random structures, and collapse.

The probabilities of the linear oscillator were computed by importance sampling in a separate NumPy program (20,000
samples), those of the yielding oscillator by 5,000,000 histories of a separate program in C.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

import warpdyn as wd
from warpdyn.answers.reliability import densities
from warpdyn.answers.reliability.densities import LinearEvents
from warpdyn.foundations.core.random_numbers import Purpose, normals

MASS, HEIGHT = 1e5, 3.0  # kg, m
DRIFT = "peak_storey_drift"
STEPPED = wd.Integration(method="rk4", step=0.005)
LINEAR = {0.125: (0.0402, 0.0012), 0.155: (0.00172911, 1.2e-05), 0.19: (1.56003e-05, 9.1e-08)}  # m, standard error
DUCTILITY, OF_YIELDING = 4.0, (0.000674, 1.2e-05)
YIELD_DRIFT = 0.02  # m


def oscillator(period, **law):
    omega = 2 * np.pi / period
    return wd.ShearBuilding(
        mass=MASS,
        stiffness=MASS * omega**2,
        height=HEIGHT,
        damping="storey",
        damping_coefficient=2 * 0.05 * omega * MASS,
        **law,
    )


NOISE = wd.FilteredNoise(wd.WhiteNoise(0.01), 20.0, 0.02)


def scene(structure=None, noise=NOISE, **given):
    return wd.Scene(structure or oscillator(1.0), noise, recorders=("drift",), tail=0.0, **given)


def limit_state(limit, **given):
    return wd.SceneLimitState(scene(**given), limit, demand=DRIFT, integration=STEPPED)


def score(found, exact, error):
    """Return the standard score of the logarithm of an estimate, with the error of the exact probability."""
    variance = np.log1p(float(found["coefficient_of_variation"]) ** 2 + (error / exact) ** 2)
    return np.log(float(found["probability"]) / exact) / np.sqrt(variance)


def noise_normals(samples, seed=5):
    nodes = np.arange(NOISE.intervals + 1)[:, None]
    return np.array([normals(seed, i, Purpose.GROUND_MOTION, nodes)[:, 0, 0] for i in range(samples)])


def test_values_are_those_of_the_random_motions_of_a_run():
    motions = [NOISE.motion(sample, seed=5) for sample in range(6)]
    run = wd.simulate(scene(noise=wd.Cloud(motions)), integration=STEPPED)
    values = limit_state(0.1)(noise_normals(6))
    assert values == pytest.approx(0.1 - run[DRIFT].values[:, 0], rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("spectrum", [wd.KanaiTajimi(0.01, 15.0, 0.6), wd.CloughPenzien(0.01, 15.0, 0.6, 1.5, 0.6)])
def test_motions_of_filtered_noise(spectrum):
    from warpdyn.model.scene.normal_variables.noise import NoiseOfNormals, variables_of_noise

    noise = wd.FilteredNoise(spectrum, 4.0, 0.02, wd.JenningsEnvelope(1.0, 2.0, 0.5))
    states = variables_of_noise(noise) // (noise.intervals + 1)
    counters = np.arange(-(-states // 2) * (noise.intervals + 1)).reshape(noise.intervals + 1, -1)
    drawn = np.array(
        [
            normals(3, i, Purpose.GROUND_MOTION, counters).reshape(len(counters), -1)[:, :states].ravel()
            for i in range(3)
        ]
    )
    found = NoiseOfNormals.of(noise, drawn).values
    expected = [noise.motion(i, seed=3).acceleration for i in range(3)]
    assert found == pytest.approx(np.array(expected), rel=1e-12, abs=1e-12)


def test_values_are_those_of_given_structures():
    spread = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2)), "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.1))}
    correlated = {"scatter": spread, "correlation": {("stiffness", "mass"): 0.5}}
    of_noise = noise_normals(2)
    drawn = np.array([[1.0, 2.0], [-0.5, 0.3]])
    values = limit_state(0.1, **correlated)(np.hstack([drawn, of_noise]))
    of_mass = 0.5 * drawn[:, 0] + np.sqrt(0.75) * drawn[:, 1]
    for sample in range(2):
        omega = 2 * np.pi
        structure = wd.ShearBuilding(
            mass=MASS * np.exp(0.1 * of_mass[sample]),
            stiffness=MASS * omega**2 * np.exp(0.2 * drawn[sample, 0]),
            height=HEIGHT,
            damping="storey",
            damping_coefficient=2 * 0.05 * omega * MASS,
        )
        run = wd.simulate(scene(structure, NOISE.motion(sample, seed=5)), integration=STEPPED)
        assert values[sample] == pytest.approx(0.1 - float(run[DRIFT][0, 0]), rel=1e-5)


def test_a_value_does_not_depend_on_other_samples_of_the_call():
    random = limit_state(0.1, scatter={"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.3))})
    drawn = np.random.default_rng(1).standard_normal((8, random.variables))
    drawn[4:, 0] += 3.0  # other structures change the median of the call
    together = random(drawn)
    assert np.array_equal(together[:2], random(drawn[:2]))
    assert np.array_equal(together[6:], random(drawn[6:]))


@pytest.mark.parametrize("limit", LINEAR)
def test_importance_sampling_of_a_linear_oscillator(limit):
    found = wd.importance_sampling(limit_state(limit), samples=2000, seed=3)
    assert abs(score(found, *LINEAR[limit])) < 2
    assert float(found["coefficient_of_variation"]) < 0.03  # plain Monte Carlo at 1.6e-5: 5.7
    assert found.attrs["peaks_recorded"] == "at the ends of integration steps of 0.005 s"


@pytest.mark.thorough  # its kernels take most of the time
@pytest.mark.parametrize(("drift", "exact", "error"), [(0.016, 0.0834, 0.00072), (0.022, 0.00160581, 1.1e-5)])
def test_importance_sampling_of_several_storeys_under_filtered_noise_with_an_envelope(drift, exact, error):
    """The first storey of three; the drift ratios of the others are small, because they are very high."""
    damped = dict(damping="rayleigh", damping_ratio=0.05, damping_modes=(1, 2))
    building = wd.ShearBuilding([1.2e5, 1.2e5, 1.0e5], [1.6e8, 1.3e8, 1.0e8], [HEIGHT, 1000.0, 1000.0], **damped)
    noise = wd.FilteredNoise(wd.KanaiTajimi(0.01, 15.0, 0.6), 14.0, 0.02, wd.JenningsEnvelope(2.0, 4.0, 0.5))
    with wd.meant_as_given("storey_height", "first_period_over_height"):
        tested = wd.SceneLimitState(scene(building, noise), drift / HEIGHT, integration=STEPPED)
        found = wd.importance_sampling(tested, samples=2000, seed=3)
    assert abs(score(found, exact, error)) < 2.5
    assert float(found["coefficient_of_variation"]) < 0.05


def test_a_large_batch_of_events_counts_as_several_batches(monkeypatch):
    events = LinearEvents(np.eye(3), np.array([1.0, 1.5, 2.0]))
    normals = np.random.default_rng(1).standard_normal((50, 3))
    number = (np.abs(normals) > events.distances).sum(axis=1)
    monkeypatch.setattr(densities, "BATCH", 7)
    with np.errstate(divide="ignore"):
        expected = np.log(number / (2 * ndtr(-events.distances)).sum())
    np.testing.assert_allclose(events.log_ratio(normals), expected, rtol=1e-12)


def test_subset_simulation_of_a_linear_oscillator():
    tested = limit_state(0.155)
    scores = [score(wd.subset_simulation(tested, samples=500, seed=seed), *LINEAR[0.155]) for seed in range(3)]
    assert np.abs(scores).max() < 2.5
    assert abs(np.mean(scores)) < 2 / np.sqrt(3)


def test_subset_simulation_of_a_yielding_oscillator():
    omega = 2 * np.pi / 0.6
    law = wd.laws.Bilinear(yield_force=MASS * omega**2 * YIELD_DRIFT, hardening_ratio=0.05)
    noise = wd.FilteredNoise(wd.KanaiTajimi(0.006, 15.0, 0.6), 10.0, 0.01)
    yielding = scene(oscillator(0.6, law=law), noise)
    tested = wd.SceneLimitState(
        yielding, DUCTILITY * YIELD_DRIFT, demand=DRIFT, integration=wd.Integration(method="rk4", step=0.0025)
    )
    found = [wd.subset_simulation(tested, samples=500, seed=seed) for seed in range(3)]
    scores = [score(each, *OF_YIELDING) for each in found]
    assert np.abs(scores).max() < 2.5
    assert abs(np.mean(scores)) < 2 / np.sqrt(3)
    with pytest.raises(ValueError, match=r"linear up to the limit.*use subset_simulation"):
        wd.importance_sampling(tested, samples=200)


def test_random_structures_under_one_motion():
    # Under a slowly increasing acceleration, the drift is about mass * acceleration / stiffness, so that a drift above
    # 55 mm means a stiffness below a limit. Its probability follows from the lognormal distribution.
    ramp = wd.GroundMotion(np.append(np.linspace(0.0, 1.0, 501), 1.0), 0.01, "ramp")
    spread = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    structure = oscillator(1.0)
    tested = wd.SceneLimitState(
        wd.Scene(structure, ramp, spread, recorders=("drift",), tail=0.0), 0.055, demand=DRIFT, integration=STEPPED
    )
    assert tested.variables == 1
    grid = np.linspace(-6, 0, 241)
    values = tested(grid[:, None])
    boundary = np.interp(0.0, values, grid)  # the limit state increases with the stiffness
    exact = ndtr(boundary)
    assert 1e-6 < exact < 1e-2
    found = wd.importance_sampling(tested, samples=1000, seed=1)
    assert abs(score(found, exact, 0.0)) < 2


def test_collapse_is_the_first_passage_of_the_capacity():
    of_drift = limit_state(0.125)
    drawn = np.random.default_rng(2).standard_normal((64, of_drift.variables)) * 1.3
    passes = of_drift(drawn) < 0
    assert 0 < passes.sum() < 64
    ends = scene(oscillator(1.0, drift_capacity=0.125))
    of_collapse = wd.SceneLimitState(ends, np.inf, integration=STEPPED)
    values = of_collapse(drawn)
    assert np.array_equal(values < 0, passes)
    assert values[~passes] == pytest.approx(1 - (0.125 - of_drift(drawn)[~passes]) / 0.125, rel=1e-5)
    assert of_collapse.attributes["demand"] == "collapse"


def test_scenes_that_are_refused():
    motions = wd.Cloud([NOISE.motion(0)])
    spread = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    with pytest.raises(TypeError, match="needs a scene of one structure under FilteredNoise"):
        wd.SceneLimitState(scene(noise=wd.Cloud([NOISE.motion(i) for i in range(2)]), scatter=spread), 0.1)
    with pytest.raises(ValueError, match="nothing is random under one ground motion"):
        wd.SceneLimitState(scene(noise=motions), 0.1)
    with pytest.raises(ValueError, match="lists given values, which have no distribution"):
        wd.SceneLimitState(scene(scatter={"mass": wd.GivenValues([MASS])}), 0.1)
    with pytest.raises(ValueError, match="has no collapse limit"):
        wd.SceneLimitState(scene(), np.inf)
    with pytest.raises(ValueError, match="limit must be"):
        wd.SceneLimitState(scene(), -0.1)
    with pytest.raises(TypeError, match="takes a Scene"):
        wd.SceneLimitState(oscillator(1.0), 0.1)
    with pytest.warns(UserWarning, match="limit=2 is implausible for a drift ratio: 2 % is 0.02"):
        wd.SceneLimitState(scene(), 2.0, integration=STEPPED)
    with pytest.raises(ValueError, match="has no 'peak_floor_acceleration'"):
        wd.SceneLimitState(scene(), 0.1, demand="peak_floor_acceleration", integration=STEPPED)
    with pytest.raises(ValueError, match=r"parameters are random \(stiffness\): use subset_simulation"):
        wd.importance_sampling(limit_state(0.1, scatter=spread))
    with pytest.raises(ValueError, match=r"normals must have the shape \[sample, 1001\]"):
        limit_state(0.1)(np.zeros(3))
    with pytest.raises(ValueError, match=r"mass = -8e\+04 at 6 standard deviations.*Rare events need.*Truncated"):
        limit_state(0.1, scatter={"mass": wd.RandomFactor(wd.Normal(1.0, 0.3))})
