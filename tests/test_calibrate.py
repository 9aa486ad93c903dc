"""calibrate: posteriors and evidences agree with closed forms, quadrature and long Markov chains computed elsewhere."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import stats

import warpdyn as wd

# Standard errors by which an estimate may differ: a correct one exceeds them once in 16,000 draws.
ERRORS = 4.0


def agrees(found: float, expected: float, *errors: float) -> bool:
    return bool(abs(found - expected) < ERRORS * np.sqrt(np.sum(np.square(errors))))


def linear_regression(parameters: int, count: int, noise: float):
    rows, columns = np.arange(1, count + 1)[:, None], np.arange(1, parameters + 1)[None]
    matrix, data = np.cos(rows * columns / 3), np.sin(rows[:, 0])

    def log_likelihood(p):
        computed = np.stack(list(p.values()), axis=1) @ matrix.T
        return stats.norm.logpdf(data, computed, noise).sum(axis=1)

    return log_likelihood


@pytest.mark.fast
@pytest.mark.parametrize(
    ("shape", "deviation", "evidence", "mean", "spread"),
    [
        ((4, 20, 0.5), 1.0, -32.23551756, 0.080421, 0.15362),
        ((10, 40, 0.1), 2.0, -998.4747793, 0.0712283, 0.022178),
    ],
)
def test_linear_model_has_the_evidence_of_the_closed_form(shape, deviation, evidence, mean, spread):
    priors = {f"theta{i}": wd.Normal(0.0, deviation) for i in range(shape[0])}
    found = wd.sample_posterior(linear_regression(*shape), priors, candidates=1000, seed=1)
    assert agrees(found["log_evidence"], evidence, found["log_evidence_standard_error"])
    first = found.sel(parameter="theta0")
    assert agrees(first["posterior_mean"], mean, first["posterior_mean_standard_error"])
    assert first["posterior_standard_deviation"] == pytest.approx(spread, rel=0.12)  # 4 / sqrt(2 * 1000 samples)
    np.testing.assert_allclose(found["log_mean_weight"].sum(), found["log_evidence"])


MEASURED = {
    "first": ([0.3860, 0.3922, 0.4157, 0.3592, 0.3615], 0.0191),
    "second": ([2.3614, 2.5877, 2.7070, 2.3875, 2.7272], 0.1309),
    "ratio": ([1.68245252, 1.71103903, 1.57876073, 1.58722342, 1.61878479], 0.0809),
}


def modal_data(*names):
    """Log-likelihood of eigenvalues and of the first mode of two unit masses (Yuen 2010, section 2.2.3)."""

    def log_likelihood(p):
        half, product = (p["q1"] + 2 * p["q2"]) / 2, p["q1"] * p["q2"]
        root = np.sqrt(half**2 - product)
        computed = {"first": half - root, "second": half + root}
        computed["ratio"] = (p["q1"] + p["q2"] - computed["first"]) / p["q2"]
        data = ((computed[name], *MEASURED[name]) for name in names)
        return sum(stats.norm.logpdf(np.array(y)[:, None], value, noise).sum(axis=0) for value, y, noise in data)

    return log_likelihood


@pytest.mark.fast
@pytest.mark.parametrize(
    ("names", "evidence", "mean", "correlation"),
    [
        (("first",), 8.771815454, [1.4245568, 0.93724619], -0.759364),  # a ridge
        (("first", "second"), 8.501941699, [1.4663769, 0.73318846], -0.990926),  # two modes of equal mass
        (("first", "ratio"), 12.51307617, [1.0086023, 0.99067248], 0.00757757),
    ],
)
def test_modal_data_have_the_evidence_of_quadrature(names, evidence, mean, correlation):
    priors = {"q1": wd.Uniform(0.2, 3.0), "q2": wd.Uniform(0.2, 2.0)}
    found = wd.sample_posterior(modal_data(*names), priors, candidates=1500, seed=3)
    assert agrees(found["log_evidence"], evidence, found["log_evidence_standard_error"])
    for each, expected, error in zip(
        found["posterior_mean"].values, mean, found["posterior_mean_standard_error"].values, strict=True
    ):
        assert agrees(each, expected, error)
    # 4 standard errors of a correlation, with at least 300 independent samples
    bound = ERRORS * (1 - correlation**2) / np.sqrt(300)
    assert np.corrcoef(found["q1"], found["q2"])[0, 1] == pytest.approx(correlation, abs=bound)


DRIFT = 0.02 * np.sin(np.linspace(0, 4 * np.pi, 41))


@pytest.fixture(scope="module")
def elastic():
    """A loop of an elastic storey with noise, and its exact posterior for a normal prior of the stiffness."""
    noise, offset = 2e4, 3e4
    force = 2e7 * DRIFT + offset + np.random.default_rng(5).normal(0, noise, DRIFT.size)
    prior_mean, prior_deviation, of_offset = 1.8e7, 2e6, 5e4
    matrix = np.column_stack([DRIFT, np.ones_like(DRIFT)])
    prior = np.diag([prior_deviation**2, of_offset**2])
    covariance = matrix @ prior @ matrix.T + noise**2 * np.eye(DRIFT.size)
    evidence = stats.multivariate_normal(matrix @ [prior_mean, 0.0], covariance).logpdf(force)
    gain = prior @ matrix.T @ np.linalg.inv(covariance)
    mean = np.array([prior_mean, 0.0]) + gain @ (force - matrix @ [prior_mean, 0.0])
    posterior = wd.calibrate(
        "elastic",
        wd.MeasuredLoop(DRIFT, force),
        {"stiffness": wd.Normal(prior_mean, prior_deviation)},
        noise=noise,
        offset=wd.Normal(0.0, of_offset),
        candidates=1000,
    )
    return posterior, evidence, mean, np.sqrt(np.diag(prior - gain @ matrix @ prior))


def test_loop_of_an_elastic_storey_has_the_exact_posterior(elastic):
    posterior, evidence, mean, deviation = elastic
    assert agrees(posterior["log_evidence"], evidence, posterior["log_evidence_standard_error"])
    errors = posterior["posterior_mean_standard_error"].values
    assert all(map(agrees, posterior["posterior_mean"].values, mean, errors))
    np.testing.assert_allclose(posterior["posterior_standard_deviation"], deviation, rtol=0.12)
    assert posterior["parameter"].values.tolist() == ["stiffness", "sensor_offset[1]"]
    assert posterior["tempering_exponent"].values[-1] == 1.0


def test_posterior_is_the_scatter_of_a_scene(elastic):
    posterior = elastic[0]
    np.testing.assert_array_equal(wd.posterior_scatter(posterior)["stiffness"].values, posterior["stiffness"])
    few = wd.posterior_scatter(posterior, structures=40)
    building = wd.ShearBuilding(1e5, 2e7, 3.0, damping="rayleigh", damping_ratio=0.05)
    assert wd.Scene(building, wd.FreeVibration(1.0, 0.01), few).structures_given == 40
    assert set(few["stiffness"].values) <= set(posterior["stiffness"].values)
    with pytest.raises(ValueError, match="has 1000 samples"):
        wd.posterior_scatter(posterior, structures=2000)


def test_evidence_compares_laws(elastic):
    posterior = elastic[0]
    worse = posterior.assign(log_evidence=posterior["log_evidence"] - 5.0)
    found = wd.compare_evidence({"worse": worse, "better": posterior})
    assert found["model"].values.tolist() == ["better", "worse"]
    np.testing.assert_allclose(found["log_bayes_factor"], [0.0, -5.0])
    np.testing.assert_allclose(found["probability"], [1 / (1 + np.exp(-5)), 1 / (1 + np.exp(5))])
    with pytest.warns(UserWarning, match="order is uncertain"):
        wd.compare_evidence({"one": posterior, "two": posterior})
    other = posterior.assign_attrs(measurement="another test")
    with pytest.raises(ValueError, match="different measurements"):
        wd.compare_evidence({"one": posterior, "two": other})
    of_times = posterior.assign(log_evidence=("time", np.zeros(3)))
    with pytest.raises(ValueError, match=r"filtered is a result of assimilate.*give results of calibrate"):
        wd.compare_evidence({"one": posterior, "filtered": of_times})


def test_measurements_are_the_same_only_if_their_counted_values_are():
    loop = [0.0, 0.01, 0.0, -0.01, 0.0], [0.0, 2e5, -1e5, -2e5, 1e5]
    values = np.arange(8.0)
    of_loop = [wd.MeasuredLoop(*loop, **more) for more in ({}, {"first": 1}, {"velocity": loop[0]})]
    of_loop.append(wd.MeasuredLoop(loop[0], [0.0, 2e5, -1e5, -2e5, 1.1e5]))
    more = ({}, {"first": 1}, {"floors": [2]}, {"quantity": "velocity"}, {"step": 0.03})
    of_floors = [wd.MeasuredResponse(values, **{"step": 0.02} | each) for each in more]
    of_floors.append(wd.MeasuredResponse(values + 1e-12, 0.02))
    assert len({each.identity for each in (*of_loop, *of_floors)}) == 10
    changed = np.concatenate([[5.0], values[1:]])
    assert of_floors[1].identity == wd.MeasuredResponse(changed, 0.02, first=1).identity


def test_misfit_of_a_bouc_wen_loop_is_that_of_the_law():
    # dz/du = (1 - |z|^n (1 + sign(z du)) / 2) / u_y by SciPy, at points that are far apart.
    from scipy.integrate import solve_ivp

    from warpdyn.campaigns.inference.loops import LoopMisfit

    stiffness, strength, hardening = 1e7, 1e5, 0.1
    drift, exponents = np.array([0.0, 0.03, -0.02, 0.04]), np.array([1.0, 2.7, 6.0])
    loop = wd.MeasuredLoop(drift, [0.0, 1e5, -1e5, 1e5], first=1)
    storey = wd.ShearBuilding(
        1.0, stiffness, 1.0, law="bouc_wen", yield_force=strength, hardening_ratio=hardening, exponent=2.7
    )
    sums, squares, peak = LoopMisfit(storey, loop, wd.Execution(device="cpu"))({"exponent": exponents[:, None]})
    for place, n in enumerate(exponents):
        z, forces = 0.0, []
        for start, end in itertools.pairwise(drift):
            way = np.sign(end - start)

            def slope(u, z, way=way, n=n):
                return (1 - np.abs(z) ** n * (1 + np.sign(z * way)) / 2) * stiffness / strength

            z = solve_ivp(slope, (start, end), [z], rtol=1e-10, atol=1e-12).y[0, -1]
            forces.append(hardening * stiffness * end + (1 - hardening) * strength * z)
        difference = loop.force[1:] - forces
        # Steps of a quarter yield drift: 1e-4 of the yield force
        assert sums[place, 0] == pytest.approx(difference.sum(), abs=3e-4 * strength)
        assert squares[place, 0] == pytest.approx(np.square(difference).sum(), rel=1e-3)
        assert peak[place] == pytest.approx(np.abs(forces).max(), rel=1e-4)


def test_response_of_an_oscillator_has_the_posterior_of_quadrature():
    # Free vibration from an initial displacement: x'' of the closed form, with unknown stiffness and noise.
    mass, ratio, step = 1e5, 0.03, 0.05
    time = np.arange(41) * step

    def acceleration(stiffness):
        omega = np.sqrt(stiffness / mass)
        damped = omega * np.sqrt(1 - ratio**2)
        wave = np.cos(damped * time) + ratio * omega / damped * np.sin(damped * time)
        displacement = 0.02 * np.exp(-ratio * omega * time) * wave
        velocity = -0.02 * omega**2 / damped * np.exp(-ratio * omega * time) * np.sin(damped * time)
        return -(omega**2) * displacement - 2 * ratio * omega * velocity

    measured = acceleration(4e6) + np.random.default_rng(2).normal(0, 0.1, time.size)
    building = wd.ShearBuilding(mass, 4e6, 3.0, damping="stiffness_proportional", damping_ratio=ratio)
    prior = wd.Lognormal(1.1, 0.2)
    scene = wd.Scene(building, wd.FreeVibration(2.0, 0.02), {"stiffness": wd.RandomFactor(prior)})
    found = wd.calibrate(
        scene, wd.MeasuredResponse(measured, step), noise=wd.Lognormal(0.15, 0.5), candidates=400, seed=4
    )
    z, y = np.meshgrid(np.linspace(-2.5, 1.5, 401), np.linspace(-3, 3, 201), indexing="ij")
    stiffness, noise = 4e6 * 1.1 * np.exp(0.2 * z[:, 0]), 0.15 * np.exp(0.5 * y[0])
    squares = np.array([np.square(measured - acceleration(each)).sum() for each in stiffness])
    logs = -time.size * (0.5 * np.log(2 * np.pi) + np.log(noise)) - 0.5 * squares[:, None] / noise**2
    density = np.exp(logs - logs.max()) * stats.norm.pdf(z) * stats.norm.pdf(y)
    cell = (z[1, 0] - z[0, 0]) * (y[0, 1] - y[0, 0])
    evidence = logs.max() + np.log(density.sum() * cell)
    mean = (density.sum(axis=1) @ stiffness) / density.sum()
    assert agrees(found["log_evidence"], evidence, found["log_evidence_standard_error"])
    first = found.sel(parameter="stiffness")
    assert agrees(first["posterior_mean"], mean, first["posterior_mean_standard_error"])


@pytest.mark.thorough
def test_column_has_the_posterior_of_long_markov_chains():
    # Four chains of 20,000 steps of an adaptive Metropolis sampler, and importance sampling of the evidence.
    loop = wd.MeasuredLoop.example()
    priors = {
        "stiffness": wd.Lognormal(1.2e7, 0.5),
        "yield_force": wd.Lognormal(1.6e5, 0.3),
        "hardening_ratio": wd.Truncated(wd.Normal(0.02, 0.05), low=0.0),
        "exponent": wd.Lognormal(1.0, 0.5),
    }
    found = wd.calibrate("bouc_wen", loop, priors, noise=wd.Lognormal(1.5e4, 0.5), candidates=1000)
    # The reference has the prior without truncation; its posterior is far above 0.
    assert agrees(found["log_evidence"] + stats.norm.logcdf(0.4), -6453.93, found["log_evidence_standard_error"], 0.01)
    expected = {
        "stiffness": (8.633e6, 3.5e3, 2.32e5),
        "yield_force": (1.2235e5, 35.0, 2.24e3),
        "hardening_ratio": (0.15001, 9.4e-5, 0.00634),
        "exponent": (3.38, 0.013, 0.8),
        "noise_standard_deviation": (31112.0, 14.0, 934.0),
    }
    for name, (mean, error, deviation) in expected.items():
        one = found.sel(parameter=name)
        assert agrees(one["posterior_mean"], mean, error, one["posterior_mean_standard_error"])
        assert one["posterior_standard_deviation"] == pytest.approx(deviation, rel=0.15)
