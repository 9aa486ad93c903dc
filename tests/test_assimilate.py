"""assimilate: filters agree with the exact Kalman filter, quadrature and a published example of the updates."""

from __future__ import annotations

from pathlib import Path

import coverage_of_filters
import numpy as np
import pytest
from scipy import stats
from scipy.linalg import expm

import warpdyn as wd
from warpdyn.campaigns.inference.filters.kalman import square_root_update, stochastic_update

DATA = Path(__file__).parent / "data"
ERRORS = 4.0  # standard errors
MASS, STIFFNESS, DAMPING = [2e5, 1.5e5], [1.2e8, 0.9e8], [4e5, 3e5]
STEP, NOISE, PROCESS, COUNT = 0.02, 0.05, 0.002, 51
TIME = STEP * np.arange(COUNT)
BASE = 3 * np.sin(2 * np.pi * 1.5 * TIME) * np.exp(-0.3 * TIME)
MOTION = wd.GroundMotion(BASE, STEP, "sine")
BUILDING = wd.ShearBuilding(MASS, STIFFNESS, 3.0, damping="storey", damping_coefficient=DAMPING)


def chain(values):
    return np.array([[values[0] + values[1], -values[1]], [-values[1], values[1]]])


def transition(factor=1.0):
    """Exact transition over one step for a load that is linear in time, and the rows of absolute accelerations."""
    inverse = np.diag(1 / np.array(MASS))
    to_acceleration = -inverse @ np.hstack([factor * chain(STIFFNESS), chain(DAMPING)])
    system = np.zeros((6, 6))
    system[:2, 2:4], system[2:4, :4], system[2:4, 4], system[4, 5] = np.eye(2), to_acceleration, -1.0, 1.0
    return expm(system * STEP), to_acceleration


def exact_filter(measured, displacement, velocity):
    """Means, covariance and log-likelihoods of the Kalman filter at each time."""
    over_step, rows = transition()
    mean, covariance, total = np.zeros(4), np.diag(np.array([displacement] * 2 + [velocity] * 2) ** 2), 0.0
    means, logs = [], []
    for place in range(1, len(measured)):
        load = np.array([BASE[place - 1], (BASE[place] - BASE[place - 1]) / STEP])
        mean = over_step[:4, :4] @ mean + over_step[:4, 4:] @ load
        covariance = over_step[:4, :4] @ covariance @ over_step[:4, :4].T + np.diag([0, 0, PROCESS**2, PROCESS**2])
        innovation = rows @ covariance @ rows.T + NOISE**2 * np.eye(2)
        total += stats.multivariate_normal(rows @ mean, innovation).logpdf(measured[place])
        gain = covariance @ rows.T @ np.linalg.inv(innovation)
        mean, covariance = mean + gain @ (measured[place] - rows @ mean), covariance - gain @ rows @ covariance
        means.append(mean)
        logs.append(total)
    return np.array(means), covariance, np.array(logs)


def measured_response(factor, scale=1.0):
    """Accelerations of both floors with a factor of both stiffnesses under the scaled motion, without noise."""
    over_step, rows = transition(factor)
    state, found = np.zeros(4), [np.zeros(2)]
    for place in range(1, COUNT):
        load = scale * np.array([BASE[place - 1], (BASE[place] - BASE[place - 1]) / STEP])
        state = over_step[:4, :4] @ state + over_step[:4, 4:] @ load
        found.append(rows @ state)
    return np.array(found)


@pytest.fixture(scope="module")
def record():
    return np.loadtxt(DATA / "kalman_two_storeys.csv", delimiter=",", skiprows=1)[:COUNT, 1:]


def filtered(record, method, **options):
    options = {"initial_displacement": 0.01, "initial_velocity": 0.1, "velocity_noise": PROCESS} | options
    measured = wd.MeasuredResponse(record, STEP, first=1)
    scene = wd.Scene(BUILDING, MOTION)
    return wd.assimilate(scene, measured, noise=NOISE, method=method, **options)


def states_of(found):
    return np.concatenate([found["displacement"], found["velocity"]], axis=1)


@pytest.mark.fast
def test_updates_have_the_members_of_a_worked_example():
    members = np.array([[1, 0.5], [2, -0.5], [4, 1.5], [3, 0.1]])
    given = members, members @ [[1.0], [2.0]], np.array([4.2]), np.array([[0.8]])
    found = stochastic_update(*given, np.array([[0.3], [-0.7], [0.9], [-0.5]]))
    np.testing.assert_allclose(found[:, 0], [1.93154246, 2.93154246, 3.29202773, 3.18630849], atol=1e-8)
    np.testing.assert_allclose(found[:, 1], [1.1542461, 0.154246101, 1.00277296, 0.23084922], atol=1e-8)
    found = square_root_update(*given)
    np.testing.assert_allclose(found[:, 0], [1.70164149, 2.98340011, 3.2928484, 3.36353115], atol=1e-8)
    np.testing.assert_allclose(found[:, 1], [0.992780767, 0.190667051, 1.00334934, 0.355317225], atol=1e-8)
    kalman = [[0.598497978, -0.150202195], [-0.150202195, 0.179780474]]
    np.testing.assert_allclose(np.cov(found.T), kalman, atol=1e-8)


def test_unscented_filter_is_the_exact_kalman_filter(record):
    means, covariance, logs = exact_filter(record, 0.01, 0.1)
    # Values of a filter in another program, confirmed by dense Gaussian conditioning
    np.testing.assert_allclose(means[-1], [-0.00412065, -0.006649873, 0.07844321, 0.08947217], rtol=2e-6)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance))[:2], [6.383261e-05, 1.009236e-4], rtol=1e-6)
    assert logs[-1] == pytest.approx(104.824434, abs=1e-5)
    found = filtered(record, "unscented_kalman", members=100)
    spread = np.sqrt(np.diag(covariance))
    # RK4 with 20 steps in the shortest period: 1e-5 of the motion, which is 1 % of the posterior deviation
    assert np.max(np.abs(states_of(found) - means) / spread) < 0.02
    last = found.isel(time=-1)
    deviation = [*last["displacement_standard_deviation"].values, *last["velocity_standard_deviation"].values]
    np.testing.assert_allclose(deviation, spread, rtol=1e-3)
    np.testing.assert_allclose(found["log_evidence"], logs, atol=0.02)


@pytest.mark.parametrize("method", ["ensemble_kalman", "square_root_kalman"])
def test_ensemble_filters_agree_with_the_kalman_filter_within_monte_carlo_error(record, method):
    means, covariance, _ = exact_filter(record, 0.01, 0.1)
    found = filtered(record, method, members=400, seed=2)
    spread = np.sqrt(np.diag(covariance))
    # The mean of each of 50 times and 4 states: 4.5 standard errors of an ensemble whose members stay independent
    assert np.max(np.abs(states_of(found)[10:] - means[10:]) / spread) < 4.5 * np.sqrt(2 / 400)
    last = found.isel(time=-1)
    np.testing.assert_allclose(
        last["displacement_standard_deviation"], spread[:2], rtol=ERRORS / np.sqrt(2 * 400) * 1.5
    )
    assert last["effective_sample_size"] == 400


def test_particle_filter_has_the_evidence_of_the_kalman_filter():
    # A record from rest: the filter knows the initial state well enough for 2,000 particles.
    random, (over_step, rows) = np.random.default_rng(8), transition()
    state, data = np.zeros(4), [np.zeros(2)]
    for place in range(1, 21):
        load = np.array([BASE[place - 1], (BASE[place] - BASE[place - 1]) / STEP])
        state = over_step[:4, :4] @ state + over_step[:4, 4:] @ load
        state[2:] += PROCESS * random.standard_normal(2)
        data.append(rows @ state + NOISE * random.standard_normal(2))
    record = np.array(data)
    start = {"initial_displacement": 3e-5, "initial_velocity": 2e-3}
    means, covariance, logs = exact_filter(record, *start.values())
    found = filtered(record, "particle", members=2000, seed=1, **start)
    assert found.attrs["rejuvenation"] == "liu_west"
    effective = found["effective_sample_size"].values
    assert effective.min() > 100
    # Each time adds the variance 1 / effective sample size to the log evidence.
    assert abs(float(found["log_evidence"][-1]) - logs[-1]) < ERRORS * np.sqrt(np.sum(1 / effective))
    spread = np.sqrt(np.diag(covariance))
    assert np.max(np.abs(states_of(found)[-1] - means[-1]) / spread) < ERRORS * np.sqrt(3 / effective[-1])


def test_exact_moves_have_the_posterior_of_quadrature_at_every_time(record):
    # Accelerations of the linear building without process noise, with a factor of both stiffnesses and an offset.
    random, truth, offset = np.random.default_rng(3), 0.93, 0.05

    data = measured_response(truth)[:, 1:] + offset + random.normal(0, 0.2, (COUNT, 1))
    scene = wd.Scene(BUILDING, MOTION, {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.15))})
    measured = wd.MeasuredResponse(data, STEP, floors=[2], first=1)
    found = wd.assimilate(scene, measured, noise=0.2, offset=wd.Normal(0.0, 0.1), members=300, seed=1)
    z = np.linspace(-3.5, 2.5, 161)
    factors = np.exp(0.15 * z)
    difference = np.array([data[1:, 0] - measured_response(each)[1:, 1] for each in factors])
    for place in (9, 24, 49):
        part, count = difference[:, : place + 1], place + 1
        covariance = 0.2**2 * np.eye(count) + 0.1**2  # the offset is common to all times
        logs = stats.multivariate_normal(np.zeros(count), covariance).logpdf(part)
        density = np.exp(logs - logs.max()) * stats.norm.pdf(z)
        evidence = logs.max() + np.log(density.sum() * (z[1] - z[0]))
        mean = density @ factors / density.sum()
        deviation = np.sqrt(density @ (factors - mean) ** 2 / density.sum())
        now = found.isel(time=place)
        effective = float(now["effective_sample_size"])
        # The stages since the beginning have at least 150 effective particles each; up to 8 of them
        assert abs(float(now["log_evidence"]) - evidence) < ERRORS * np.sqrt(8 / 300)
        computed = float(now["parameter_mean"][0]) / STIFFNESS[0]
        assert abs(computed - mean) < ERRORS * deviation / np.sqrt(effective / 2)
        spread = float(now["parameter_standard_deviation"][0]) / STIFFNESS[0]
        # Relative standard error of a deviation of n samples: 1 / sqrt(2 n), with half of the effective size as above
        assert spread == pytest.approx(deviation, rel=ERRORS / np.sqrt(effective))
    assert found.attrs["rejuvenation"] == "metropolis"
    assert found["resampled"].sum() > 0
    assert found["parameter"].values.tolist() == ["stiffness[1]", "stiffness[2]", "sensor_offset[1]"]
    assert wd.posterior_scatter(found, structures=50)["stiffness"].values.shape == (50, 2)


@pytest.mark.parametrize("options", [{}, {"method": "unscented_kalman", "velocity_noise": PROCESS}])
def test_a_scaled_motion_and_a_late_first_time(options):
    scaled = wd.OneMotionPerStructure([MOTION], scale=2.0), wd.GroundMotion(2.0 * BASE, STEP, "sine")
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.15))}
    # Measurements from the tenth time on: the particles are resampled before three of them count.
    measured = wd.MeasuredResponse(measured_response(0.93, 2.0), STEP, first=10)
    one, other = (
        wd.assimilate(wd.Scene(BUILDING, each, scatter), measured, noise=NOISE, members=200, **options)
        for each in scaled
    )
    for name in ("parameter_mean", "parameter_standard_deviation", "log_evidence"):
        np.testing.assert_allclose(one[name], other[name], rtol=1e-9)
    last, truth = one.isel(time=-1), 0.93 * STIFFNESS[0]
    if not options:
        assert one["resampled"].sum() > 0
        assert np.unique(one["stiffness"].values[:, 0]).size > 100  # accepted moves
    # Data without noise: the posterior deviates from the truth by far less than its deviation
    assert abs(float(last["parameter_mean"][0]) - truth) < float(last["parameter_standard_deviation"][0])


def test_filters_of_states_refuse_control():
    control = wd.control.Control(
        [wd.control.Actuator(1)], controller=wd.control.ConstantCommand(value=0.0), sampling_interval=STEP
    )
    scene = wd.Scene(BUILDING, MOTION, control=control)
    measured = wd.MeasuredResponse(np.zeros((COUNT, 2)), STEP)
    with pytest.raises(ValueError, match="without control=, or method='particle' without velocity_noise="):
        wd.assimilate(scene, measured, noise=NOISE, velocity_noise=PROCESS)


@pytest.mark.thorough
def test_particle_filter_of_a_bouc_wen_oscillator_has_the_likelihood_of_a_bootstrap_filter():
    # 100,000 particles of a bootstrap filter in another program: 32.842 +- 0.006; one run of 1,000 varies by 0.18.
    table = np.loadtxt(DATA / "particle_filter_record.csv", delimiter=",", skiprows=1)
    time = table[:, 0]
    base = 3 * np.sin(2 * np.pi * 0.7 * time) * np.exp(-0.12 * time)
    base += 1.5 * np.sin(2 * np.pi * 2.3 * time) * np.exp(-0.2 * time)
    law = wd.laws.BoucWen(yield_force=9000.0, hardening_ratio=0.0, beta=2.0, gamma=1.0, exponent=2.0)
    building = wd.ShearBuilding(1000.0, 9000.0, 3.0, law=law, damping="storey", damping_coefficient=300.0)
    scene = wd.Scene(building, wd.GroundMotion(base, 0.02, "two sines"))
    measured = wd.MeasuredResponse(table[:, 1], 0.02, first=1)
    found = wd.assimilate(scene, measured, noise=0.2, velocity_noise=0.02, members=2000)
    assert abs(float(found["log_evidence"][-1]) - 32.842) < ERRORS * 0.18
    expected = {1: (-0.33424, 0.74165), 2: (0.19353, -1.4806), 3: (0.011445, 1.104)}
    for each, (displacement, velocity) in expected.items():
        now = found.sel(time=each, method="nearest")
        error = ERRORS / np.sqrt(float(now["effective_sample_size"]) / 4)
        assert abs(now["displacement"][0] - displacement) < error * now["displacement_standard_deviation"][0]
        assert abs(now["velocity"][0] - velocity) < error * now["velocity_standard_deviation"][0]


@pytest.mark.thorough
def test_particle_filter_has_the_posterior_of_long_markov_chains():
    # Five parameters of a Bouc-Wen oscillator without process noise: four chains of 40,000 Metropolis steps at each
    # time, and the evidence by importance sampling, computed without warpdyn.
    measured = np.loadtxt(DATA / "bouc_wen_record.csv", delimiter=",", skiprows=2)[:, 1]
    response = wd.MeasuredResponse(measured, coverage_of_filters.STEP, first=1)
    found = wd.assimilate(
        coverage_of_filters.scene(751), response, noise=coverage_of_filters.NOISE, members=500, seed=1
    )
    names = ("damping_coefficient", "stiffness", "beta", "gamma", "exponent")
    expected = {  # time -> log evidence, means and standard deviations
        3: (200.914, (296.44, 9057, 1.5945, 0.82129, 1.7704), (13.94, 72.53, 0.3588, 0.1602, 0.1651)),
        6: (417.724, (300.77, 9018.6, 1.7121, 0.89789, 1.8681), (4.633, 35.87, 0.2155, 0.1327, 0.1044)),
        15: (1018.582, (303.12, 9021.2, 1.7796, 0.97124, 1.9139), (3.874, 16.85, 0.138, 0.09818, 0.0661)),
    }
    for time, (evidence, means, deviations) in expected.items():
        now = found.sel(time=time, method="nearest")
        # About 25 stages with at least 250 effective particles each
        assert abs(float(now["log_evidence"]) - evidence) < ERRORS * np.sqrt(25 / 250)
        # After the moves a stage keeps at most a correlation of 0.11: at least half of the particles are independent.
        error = ERRORS / np.sqrt(float(now["effective_sample_size"]) / 2)
        for name, mean, deviation in zip(names, means, deviations, strict=True):
            one = now.sel(parameter=name)
            assert abs(float(one["parameter_mean"]) - mean) < error * deviation, (time, name)
            assert float(one["parameter_standard_deviation"]) == pytest.approx(deviation, rel=error), (time, name)


@pytest.mark.thorough
def test_ten_seconds_of_the_kalman_filter_and_of_unknown_stiffnesses():
    record = np.loadtxt(DATA / "kalman_two_storeys.csv", delimiter=",", skiprows=1)[:, 1:]
    time = STEP * np.arange(501)
    motion = wd.GroundMotion(3 * np.sin(2 * np.pi * 1.5 * time) * np.exp(-0.3 * time), STEP, "sine")
    given = {"noise": NOISE, "velocity_noise": PROCESS, "initial_displacement": 0.01, "initial_velocity": 0.1}
    given |= {"method": "unscented_kalman", "members": 100}
    response = wd.MeasuredResponse(record, STEP, first=1)
    found = wd.assimilate(wd.Scene(BUILDING, motion), response, **given)
    # Dense Gaussian conditioning: displacements, velocities, log-likelihood; the deviations are stationary.
    deviations = np.array([6.383261e-05, 1.009236e-4, 2.609653e-3, 3.149142e-3])
    expected = {
        2: ([0.002547979, 0.004972916, -0.07380122, -0.1116323], 215.464238),
        5: ([-0.0006163066, -0.001103661, 0.03854455, 0.07249014], 564.722644),
        10: ([-5.939356e-05, -9.857242e-05, 0.002510787, -0.005012688], 1163.0311),
    }
    for at, (means, evidence) in expected.items():
        now = found.sel(time=at, method="nearest")
        spread = [*now["displacement_standard_deviation"].values, *now["velocity_standard_deviation"].values]
        np.testing.assert_allclose(spread, deviations, rtol=1e-3)
        assert np.max(np.abs(np.append(now["displacement"], now["velocity"]) - means) / deviations) < 0.02  # see above
        assert float(now["log_evidence"]) == pytest.approx(evidence, abs=0.02)
    # Two unknown stiffness factors with lognormal priors of 20 %: quadrature of the exact filter. The unscented filter
    # is approximate: the linear updates of the wide prior in the first second shift mean and evidence.
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="storey")}
    found = wd.assimilate(wd.Scene(BUILDING, motion, scatter), response, **given)
    expected = {
        2: ([1.006061, 1.007122], [0.00781707, 0.0111001], 210.111636),
        5: ([1.002186, 1.005378], [0.00706138, 0.0105317], 558.611571),
        10: ([1.003618, 1.00251], [0.00689329, 0.0101874], 1156.83276),
    }
    for at, (means, spread, evidence) in expected.items():
        now = found.sel(time=at, method="nearest")
        assert np.max(np.abs(now["parameter_mean"].values / STIFFNESS - means) / spread) < 0.25
        np.testing.assert_allclose(now["parameter_standard_deviation"].values / STIFFNESS, spread, rtol=0.03)
        assert float(now["log_evidence"]) == pytest.approx(evidence, abs=2.5)
