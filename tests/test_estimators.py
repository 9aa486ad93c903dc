"""Estimators of fragility curves against pyFragility, statsmodels and arithmetic by hand, on counts made by hand."""

import warnings

import numpy as np
import pyFragility as pf
import pytest
import statsmodels.api as sm
from scipy.optimize import minimize
from scipy.special import expit, ndtr
from scipy.stats import norm
from validation import difference, relative_difference

from warpdyn.answers.fragility.estimators import ESTIMATORS, FIT_MEANINGS, estimator_of
from warpdyn.answers.fragility.estimators.binomial import PROBIT, penalised_likelihood
from warpdyn.answers.fragility.maximum_likelihood.newton import covariance_of_influences

pytestmark = pytest.mark.fast

WOOD_FRAMES = pf.datasets.load_msa_wood_frame()
# Counts in four states at six intensities: the example of pyFragility's fit_damage_states.
ORDINAL_LEVELS = np.array([0.2, 0.4, 0.7, 1.0, 1.5, 2.2])
IN_STATE = np.array([[38, 2, 0, 0], [30, 8, 2, 0], [18, 14, 7, 1], [8, 14, 13, 5], [2, 9, 16, 13], [0, 3, 12, 25]])
EXCEEDING = np.cumsum(IN_STATE[:, ::-1], axis=1)[:, ::-1][:, 1:].T  # [damage_state, im_level]
STATUS = {name: number for number, name in enumerate(FIT_MEANINGS)}


def capacities(records: int = 11, seed: int = 3) -> np.ndarray:
    """Return capacities of three damage states [g], shape [record, structure, damage_state]."""
    rng = np.random.default_rng(seed)
    logarithm = np.log([0.3, 0.5, 0.8]) + rng.normal(0, 0.4, (records, 1, 1)) + rng.normal(0, 0.2, (1, 8, 1))
    return np.exp(logarithm + rng.normal(0, 0.1, (records, 8, 1)))


def robust(name: str, counts: np.ndarray, total: int, levels: np.ndarray = ORDINAL_LEVELS) -> np.ndarray:
    """Return the cluster-robust covariance of the logarithms, shape [damage_state, 2, 2], without n / (n - 1)."""
    estimator, records = ESTIMATORS[name], len(counts)
    median, dispersion, _ = estimator.fit(levels, counts.sum(axis=0), records * total)
    cells = np.moveaxis(counts, 1, -1)[:, None]  # [record, group, im_level, damage_state]
    valid = np.full((records, 1, levels.size), total)
    influences, _ = estimator.influences(levels, cells, valid, median, dispersion)
    return np.moveaxis(covariance_of_influences(influences[:, 0]), -1, 0) * (records - 1) / records


def by_record() -> tuple[np.ndarray, int]:
    """Return exceedances, shape [record, damage_state, im_level], and the structures of each record."""
    return (capacities()[..., None] < ORDINAL_LEVELS).sum(axis=1), 8


@pytest.mark.parametrize("building", WOOD_FRAMES.buildings)
def test_probit_and_logit_of_collapse_counts_are_those_of_two_other_programs(building, measured):
    levels, counts = WOOD_FRAMES.im, WOOD_FRAMES.counts[building].to_numpy()
    for name, link in (("lognormal", sm.families.links.Probit()), ("logit", sm.families.links.Logit())):
        median, dispersion, outcome = ESTIMATORS[name].fit(levels, counts[None], 45)
        assert outcome[0] == STATUS["fitted"]
        ours = ESTIMATORS[name].shape.probability(levels, median, dispersion)
        table = np.column_stack([counts, 45 - counts])
        glm = sm.GLM(table, sm.add_constant(np.log(levels)), family=sm.families.Binomial(link=link)).fit(tol=1e-12)
        theirs = pf.fit_binomial(levels, counts, np.full(16, 45.0), link="probit" if name == "lognormal" else name)
        # Maxima of one likelihood: statsmodels and pyFragility stop at relative changes of 1e-8.
        np.testing.assert_allclose(ours, glm.predict(), atol=1e-6)
        np.testing.assert_allclose(ours, theirs.probability(levels), atol=1e-6)
        for program, due in (("statsmodels", glm.predict()), ("pyFragility", theirs.probability(levels))):
            measured(
                f"lognormal and loglogistic collapse curves of three wood frames compared with {program}",
                truth=f"probabilities of its fit to the same published counts ({program})",
                value=difference(ours, due),
                bound=1.1e-6,  # 1e-6, and a relative 1e-7 of probabilities up to 1
            )


def test_ordinal_curves_are_those_of_pyfragility(measured):
    theirs = pf.fit_damage_states(ORDINAL_LEVELS, counts=IN_STATE)
    median, dispersion, outcome = ESTIMATORS["ordinal"].fit(ORDINAL_LEVELS, EXCEEDING, 40)
    assert (outcome == STATUS["fitted"]).all()
    measured(
        "medians of ordinal curves, which cannot cross",
        truth="pyFragility's fit_damage_states",
        value=relative_difference(median, np.exp(-theirs.params[:3] / theirs.params[3])),
        bound=1e-6,
    )
    np.testing.assert_allclose(dispersion, 1 / theirs.params[3], rtol=1e-6)


def test_ordinal_curves_do_not_cross_where_single_ones_do():
    levels, total = np.array([0.2, 0.4, 0.8, 1.6]), 20
    exceeding = np.array([[6, 9, 12, 16], [0, 3, 12, 16]])
    alone, together = (ESTIMATORS[name].fit(levels, exceeding, total) for name in ("lognormal", "ordinal"))
    fine = np.geomspace(0.05, 5, 400)
    curve = ESTIMATORS["lognormal"].shape.probability
    apart = [np.subtract(*curve(fine, fit[0][:, None], fit[1][:, None])) for fit in (alone, together)]
    assert apart[0].min() < -0.01
    assert apart[1].min() >= 0


def test_ordinal_leaves_out_states_without_a_curve_and_joins_equal_ones():
    none, every = np.zeros_like(EXCEEDING[:1]), np.full_like(EXCEEDING[:1], 40)
    wide = np.concatenate([every, EXCEEDING[:1], EXCEEDING[:1], EXCEEDING[1:], none])
    median, dispersion, outcome = ESTIMATORS["ordinal"].fit(ORDINAL_LEVELS, wide, 40)
    plain = ESTIMATORS["ordinal"].fit(ORDINAL_LEVELS, EXCEEDING, 40)
    np.testing.assert_allclose(median[1:5], plain[0][[0, 0, 1, 2]], rtol=1e-9)
    np.testing.assert_allclose(dispersion[1:5], plain[1][0], rtol=1e-9)
    assert outcome[0] == STATUS["all_exceeding"]
    assert outcome[-1] == STATUS["no_exceedance"]
    assert np.isnan(median[[0, -1]]).all()
    with pytest.raises(ValueError, match="a heavier damage state must not have more"):
        ESTIMATORS["ordinal"].fit(ORDINAL_LEVELS, EXCEEDING[::-1], 40)


def test_many_rows_are_fitted_as_each_alone():
    counts, total = by_record()
    weights = np.random.default_rng(0).multinomial(11, np.full(11, 1 / 11), size=20)
    rows = np.einsum("wr,rsl->wsl", weights, counts)
    for estimator in ESTIMATORS.values():
        whole = estimator.fit(ORDINAL_LEVELS, rows, 11 * total)
        near = estimator.fit(ORDINAL_LEVELS, rows, 11 * total, (whole[0][0], whole[1][0]))
        each = [estimator.fit(ORDINAL_LEVELS, row, 11 * total) for row in rows]
        for number in range(3):
            np.testing.assert_allclose(whole[number], [one[number] for one in each], rtol=1e-8)
            np.testing.assert_allclose(whole[number], near[number], rtol=1e-8)


def penalised_by_hand(levels, exceeding, total, is_logit):
    """Return median and dispersion at the maximum of the likelihood times Jeffreys' prior, by a simplex search."""

    def negative(parameters):
        score = (np.log(levels) - parameters[0]) / np.exp(parameters[1])
        p = np.clip(expit(score) if is_logit else ndtr(score), 1e-300, 1 - 1e-16)
        density = p * (1 - p) if is_logit else norm.pdf(score)
        design = np.column_stack([np.ones(len(levels)), np.log(levels)])
        information = design.T @ ((total * density**2 / (p * (1 - p)))[:, None] * design)
        likelihood = exceeding * np.log(p) + (total - exceeding) * np.log1p(-p)
        return -likelihood.sum() - 0.5 * np.linalg.slogdet(information)[1]

    best = minimize(negative, [np.log(0.5), np.log(0.1)], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12})
    return np.exp(best.x[0]), np.exp(best.x[1]) * (np.pi / np.sqrt(3) if is_logit else 1)


@pytest.mark.parametrize("exceeding", [[0, 0, 0, 11, 11, 11], [0, 0, 5, 11, 11, 11], [0, 0, 0, 0, 0, 4]])
def test_separated_stripes_have_a_penalised_curve(exceeding):
    levels = np.array([0.1, 0.2, 0.3, 0.4, 0.6, 0.8])
    for name in ("lognormal", "logit"):
        median, dispersion, outcome = ESTIMATORS[name].fit(levels, [exceeding], 11)
        assert FIT_MEANINGS[outcome[0]] == "penalised"
        by_hand = penalised_by_hand(levels, np.array(exceeding), 11, name == "logit")
        np.testing.assert_allclose([median[0], dispersion[0]], by_hand, rtol=1e-5)  # the simplex stops at 1e-9 of ln


def test_penalised_curve_of_many_structures_is_steep():
    levels = np.array([0.2, 0.4, 0.6, 0.8])
    few, many = (ESTIMATORS["lognormal"].fit(levels, [[0, 0, n, n]], n) for n in (11, 2816))
    for median, _, _ in (few, many):
        assert median[0] == pytest.approx(np.sqrt(0.4 * 0.6), rel=1e-3)  # the prior is symmetric about the gap
    assert many[1][0] < 0.6 * few[1][0]


def test_a_trial_without_information_is_rejected_without_a_warning_of_numpy():
    position, exceeding = np.linspace(-1, 1, 5), np.array([[0, 0, 0, 5.0, 5.0]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # All scores are beyond 50: normal densities and the determinant of the information are 0.
        value, *_ = penalised_likelihood(PROBIT, position, np.array([[300.0, 100.0]]), exceeding, 5 - exceeding)
    assert value == -np.inf


def test_stripes_without_information_have_no_curve():
    levels = np.array([0.2, 0.4, 0.6])
    for name in ("lognormal", "logit"):
        median, _, outcome = ESTIMATORS[name].fit(levels, [[0, 0, 0], [9, 9, 9], [6, 4, 2]], 9)
        assert [FIT_MEANINGS[each] for each in outcome] == ["no_exceedance", "all_exceeding", "not_increasing"]
        assert np.isnan(median).all()


@pytest.mark.parametrize("name", ["lognormal", "logit"])
def test_cluster_robust_covariance_is_that_of_two_other_programs(name, measured):
    counts, total = by_record()
    ours = robust(name, counts, total)
    im, record = np.tile(ORDINAL_LEVELS, 11), np.repeat(np.arange(11), 6)
    model = sm.Probit if name == "lognormal" else sm.Logit
    for state in range(3):
        k = counts[:, state].ravel()
        exceeds = np.concatenate([np.repeat([1.0, 0.0], [each, total - each]) for each in k])
        groups = {"groups": np.repeat(record, total), "use_correction": False}
        design = sm.add_constant(np.log(np.repeat(im, total)))
        theirs = model(exceeds, design).fit(disp=0, tol=1e-12, cov_type="cluster", cov_kwds=groups)
        intercept, slope = theirs.params
        change = np.array([[-1 / slope, intercept / slope**2], [0.0, -1 / slope]])  # of both logarithms
        # The same formula, at parameters that agree within 1e-8.
        measured(
            "cluster-robust covariances of curves, records as clusters",
            truth="statsmodels' cluster-robust covariance",
            value=relative_difference(ours[state], change @ theirs.cov_params() @ change.T),
            bound=1e-5,
        )
        if name == "lognormal":  # pyFragility's parameters are then median and dispersion
            other = pf.fit_binomial(im, k, np.full(66, float(total)), cluster=record)
            change = np.diag(1 / other.params)
            np.testing.assert_allclose(ours[state], change @ other.covariance("sandwich") @ change.T, rtol=1e-4)


def test_ordinal_covariance_is_that_of_pyfragility():
    counts, total = by_record()
    ours = robust("ordinal", counts, total)
    rows = np.concatenate([np.full((11, 1, 6), total), counts, np.zeros((11, 1, 6))], axis=1)
    in_state = -np.diff(rows, axis=1).transpose(0, 2, 1).reshape(66, 4)
    theirs = pf.fit_damage_states(np.tile(ORDINAL_LEVELS, 11), counts=in_state, cluster=np.repeat(np.arange(11), 6))
    *alpha, slope = theirs.params
    for state in range(3):
        change = np.zeros((2, 4))
        change[0, state], change[:, 3] = -1 / slope, (alpha[state] / slope**2, -1 / slope)
        np.testing.assert_allclose(ours[state], change @ theirs.covariance("sandwich") @ change.T, rtol=1e-4)


def test_variances_of_independent_samples_are_those_of_pyfragility():
    counts, total = by_record()
    sums = counts.sum(axis=0)
    cells, valid = np.moveaxis(sums, 0, -1)[None, None], np.full((1, 1, 6), 11 * total)
    fits = {name: estimator.fit(ORDINAL_LEVELS, sums, 11 * total)[:2] for name, estimator in ESTIMATORS.items()}
    _, ours = ESTIMATORS["lognormal"].influences(ORDINAL_LEVELS, cells, valid, *fits["lognormal"])
    for state in range(3):
        theirs = pf.fit_binomial(ORDINAL_LEVELS, sums[state], np.full(6, 11.0 * total))
        np.testing.assert_allclose(ours[:, state], np.diag(theirs.covariance("mle")) / theirs.params**2, rtol=1e-4)
    _, ours = ESTIMATORS["ordinal"].influences(ORDINAL_LEVELS, cells, valid, *fits["ordinal"])
    rows = np.concatenate([np.full((1, 6), 11 * total), sums, np.zeros((1, 6))])
    theirs = pf.fit_damage_states(ORDINAL_LEVELS, counts=-np.diff(rows, axis=0).T)
    np.testing.assert_allclose(ours[1], theirs.covariance("mle")[3, 3] / theirs.params[3] ** 2, rtol=1e-4)


def test_one_cluster_has_no_robust_covariance():
    assert np.isnan(covariance_of_influences(np.ones((1, 2)))).all()


def test_unknown_estimator():
    with pytest.raises(ValueError, match="estimator 'probbit'"):
        estimator_of("probbit")
