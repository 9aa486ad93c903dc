"""calibrate refuses or warns of wrong measurements, priors and sample sizes before any kernel runs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import warpdyn as wd

pytestmark = pytest.mark.fast

DRIFT = 0.02 * np.sin(np.linspace(0, 4 * np.pi, 41))
LOOP = wd.MeasuredLoop(DRIFT, 1e7 * DRIFT)
RESPONSE = wd.MeasuredResponse(np.sin(np.arange(40)), 0.02, floors=[1])
PRIORS = {"stiffness": wd.Lognormal(1e7, 0.3), "yield_force": wd.Lognormal(1e5, 0.3), "hardening_ratio": 0.05}
BUILDING = wd.ShearBuilding([1e5, 1e5], 4e7, 3.0)
WAVE = wd.GroundMotion(np.sin(np.arange(50) * 0.3), 0.02, name="wave")
STIFFNESS = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
SCENE = wd.Scene(BUILDING, WAVE, STIFFNESS)


def calibrated(model="bilinear", measured=LOOP, priors=PRIORS, noise=1e4, **options):
    return wd.calibrate(model, measured, priors, noise=noise, **options)


def without(name):
    return {key: each for key, each in PRIORS.items() if key != name}


WRONG = {
    "nan in the force": (
        lambda: wd.MeasuredLoop(DRIFT, np.where(DRIFT > 0.01, np.nan, 1.0)),
        "every value must be finite",
    ),
    "other length": (lambda: wd.MeasuredLoop(DRIFT, DRIFT[1:]), "force has 40 values and drift has 41"),
    "constant drift": (lambda: wd.MeasuredLoop(np.zeros(5), np.arange(5.0)), "a loop needs values that change"),
    "too few points": (lambda: wd.MeasuredLoop([0.0, 1.0], [0.0, 1.0]), "at least 3 values"),
    "first beyond the end": (lambda: wd.MeasuredLoop(DRIFT, DRIFT, first=40), "give a smaller first"),
    "nan in a response": (lambda: wd.MeasuredResponse([0.0, np.nan, 1.0], 0.02), "every value must be finite"),
    "unknown quantity": (lambda: wd.MeasuredResponse(np.zeros(9), 0.02, quantity="accelerations"), "'acceleration'"),
    "floors of other length": (lambda: wd.MeasuredResponse(np.zeros(9), 0.02, floors=[1, 2]), "names 2 floors"),
    "floor twice": (lambda: wd.MeasuredResponse(np.zeros((9, 2)), 0.02, floors=[1, 1]), "a floor twice"),
    "floor 0": (lambda: wd.MeasuredResponse(np.zeros(9), 0.02, floors=[0]), "at least 1"),
    "sensor above the roof": (
        lambda: calibrated(SCENE, wd.MeasuredResponse(np.zeros(9), 0.02, floors=[3]), None),
        "sensor is on floor 3, but the structure has 2 floors",
    ),
    "step of the sensors": (
        lambda: calibrated(SCENE, wd.MeasuredResponse(np.zeros(9), 0.03, floors=[1]), None),
        "not a multiple of the step of the motion",
    ),
    "priors beside a scene": (lambda: calibrated(SCENE, RESPONSE), "remove priors="),
    "scene without priors": (lambda: calibrated(wd.Scene(BUILDING, WAVE), RESPONSE, None), "no parameter has a prior"),
    "several motions": (
        lambda: calibrated(
            wd.Scene(
                BUILDING,
                wd.Cloud(
                    [
                        WAVE,
                        WAVE.scaled(2.0)
                        if hasattr(WAVE, "scaled")
                        else wd.GroundMotion(np.cos(np.arange(50)), 0.02, "other"),
                    ]
                ),
                STIFFNESS,
            ),
            RESPONSE,
            None,
        ),
        "one structure under one motion",
    ),
    "given values": (
        lambda: calibrated(wd.Scene(BUILDING, WAVE, {"mass": wd.GivenValues([1e5, 2e5])}), RESPONSE, None),
        "must be RandomFactor or RandomValue",
    ),
    "law with a response": (lambda: calibrated("bilinear", RESPONSE), "needs a Scene"),
    "scene with a loop": (lambda: calibrated(SCENE, LOOP), "needs a storey law"),
    "no measurement": (lambda: calibrated(measured=DRIFT), "takes a MeasuredLoop or a MeasuredResponse"),
    "unknown parameter": (
        lambda: calibrated(priors=PRIORS | {"yield_forces": wd.Lognormal(1.0, 0.1)}),
        "has no parameter 'yield_forces' \\(did you mean 'yield_force'",
    ),
    "parameter of another law": (lambda: calibrated(priors=PRIORS | {"exponent": 1.0}), "has no parameter 'exponent'"),
    "missing parameter": (
        lambda: calibrated(priors=without("stiffness")),
        "stiffness of the law 'bilinear' is missing",
    ),
    "prior out of bounds": (
        lambda: calibrated(priors=PRIORS | {"hardening_ratio": wd.Normal(0.02, 0.05)}),
        "with a probability of 0.34: give another prior, such as wd.Truncated",
    ),
    "prior of a factor out of bounds": (
        lambda: calibrated(
            wd.Scene(BUILDING, WAVE, {"stiffness": wd.RandomFactor(wd.Normal(1.0, 0.5))}), RESPONSE, None
        ),
        "outside of the bounds of stiffness",
    ),
    "discrete prior": (
        lambda: calibrated(priors=PRIORS | {"yield_force": wd.Empirical([1e5, 2e5])}),
        "values are discrete",
    ),
    "no distribution": (lambda: calibrated(priors=PRIORS | {"yield_force": "1e5"}), "distribution must be"),
    "negative noise": (lambda: calibrated(noise=-1.0), "noise .* above 0"),
    "noise below 0": (lambda: calibrated(noise=wd.Normal(1.0, 1.0)), "prior of noise"),
    "few candidates": (lambda: calibrated(candidates=50), "candidates must be a whole number of at least 100"),
    "few candidates for the parameters": (
        lambda: wd.sample_posterior(len, {f"p{i}": wd.Normal(0.0, 1.0) for i in range(9)}, candidates=150),
        "need at least 180",
    ),
    "viscous damper without velocity": (
        lambda: calibrated(
            wd.ShearBuilding(1.0, 1e7, 3.0, devices=[wd.laws.ViscousDamper(damper_coefficient=1e4)]),
            priors={"damper_coefficient": wd.Lognormal(1e4, 0.5)},
        ),
        "velocity=",
    ),
    "velocity without a damper": (
        lambda: calibrated(measured=wd.MeasuredLoop(DRIFT, 1e7 * DRIFT, velocity=DRIFT)),
        "no viscous damper",
    ),
    "two storeys": (lambda: calibrated(BUILDING, priors={"stiffness": wd.Lognormal(1e7, 0.3)}), "loop of one storey"),
    "likelihood of NaN": (
        lambda: wd.sample_posterior(lambda p: p["x"] * np.nan, {"x": wd.Normal(0.0, 1.0)}, candidates=100),
        "returned NaN",
    ),
    "likelihood of another shape": (
        lambda: wd.sample_posterior(lambda p: 0.0, {"x": wd.Normal(0.0, 1.0)}, candidates=100),
        "returned the shape \\(\\)",
    ),
    "impossible prior": (
        lambda: wd.sample_posterior(lambda p: p["x"] - np.inf, {"x": wd.Normal(0.0, 1.0)}, candidates=100),
        "likelihood of all 100 samples of the prior is 0",
    ),
    "one model": (lambda: wd.compare_evidence({"one": 1}), "at least two models"),
    "no posterior": (lambda: wd.posterior_scatter(1), "takes a Dataset"),
    "random sets of a loop": (
        lambda: wd.storey_hysteresis(BUILDING, [0.0, 0.01], scatter=STIFFNESS),
        "give the parameter sets as wd.GivenValues",
    ),
    "sets of different numbers": (
        lambda: wd.storey_hysteresis(
            BUILDING, [0.0, 0.01], scatter={"mass": wd.GivenValues([1e5] * 2), "stiffness": wd.GivenValues([4e7] * 3)}
        ),
        "different numbers of structures",
    ),
    "set out of bounds": (
        lambda: wd.storey_hysteresis(BUILDING, [0.0, 0.01], scatter={"stiffness": wd.GivenValues([4e7, -1.0])}),
        "structure 1, storey 1; it must be finite and above 0",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input_is_refused(case):
    call, message = WRONG[case]
    with pytest.raises((ValueError, TypeError), match=message):
        call()


def test_impossible_candidates_have_the_likelihood_zero():
    # gamma above beta has no Bouc-Wen storey: the share of the prior that is allowed is P(|gamma| < beta) = 3 / 4.
    from warpdyn.campaigns.inference.models import calibrated_storey
    from warpdyn.campaigns.inference.priors import Prior

    priors = {"stiffness": 1e7, "yield_force": 1e5, "hardening_ratio": 0.05}
    priors |= {"beta": wd.Uniform(0.5, 1.0), "gamma": wd.Uniform(-1.0, 1.0)}
    prior = Prior(*calibrated_storey("bouc_wen", priors), {})
    values = prior.values(np.random.default_rng(1).standard_normal((4000, 2)))
    allowed = prior.allowed(values)
    np.testing.assert_array_equal(
        allowed, ((values["gamma"] <= values["beta"]) & (values["gamma"] > -values["beta"]))[:, 0]
    )
    assert allowed.mean() == pytest.approx(0.75, abs=0.028)  # 4 standard errors


def test_parameters_with_a_correlation_of_1_are_one_variable():
    from warpdyn.campaigns.inference.priors import Prior

    building = wd.ShearBuilding(1e5, 1e7, 3.0, law="bilinear", yield_force=1e5, hardening_ratio=0.0)
    scatter = {name: wd.RandomFactor(wd.Lognormal(1.0, 0.3)) for name in ("stiffness", "yield_force")}
    prior = Prior(building, scatter, {("stiffness", "yield_force"): 1.0})
    assert prior.variables == 1
    values = prior.values(np.array([[0.0], [1.0]]))
    np.testing.assert_allclose(values["stiffness"] / values["yield_force"], 100.0)
    np.testing.assert_allclose(values["stiffness"][:, 0], [1e7, 1e7 * np.exp(0.3)])


def test_systematic_resampling_has_the_published_indices():
    # The weights and indices of a worked example; the effective sample size is 1 / sum of w^2.
    from warpdyn.campaigns.inference.resampling import effective_sample_size, systematic

    weights = np.array([0.05, 0.30, 0.02, 0.18, 0.25, 0.08, 0.10, 0.02])
    np.testing.assert_array_equal(systematic(weights, 0.35), [0, 1, 1, 3, 3, 4, 4, 6])
    assert effective_sample_size(weights) == pytest.approx(4.887586, abs=5e-7)
    values = np.array([3, -1, 8, 0.5, 2, -4, 1, 6])
    means = [values[systematic(weights, (i + 0.5) / 4000)].mean() for i in range(4000)]
    assert np.var(means) == pytest.approx(0.3859375, rel=2e-3)  # 4,000 points of the uniform number
    assert np.mean(means) == pytest.approx(weights @ values, abs=1e-3)


def test_priors_of_scipy_are_accepted():
    found = wd.sample_posterior(
        lambda p: stats.norm.logpdf(p["x"], 2.0, 0.5), {"x": stats.gumbel_r(loc=1.0, scale=1.0)}, candidates=300
    )
    assert float(found["posterior_mean"][0]) == pytest.approx(1.9, abs=0.2)
