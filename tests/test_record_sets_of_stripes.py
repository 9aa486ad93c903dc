"""Records selected for each level, and single observations: what the fit is, and what the intervals are."""

from __future__ import annotations

import numpy as np
import pytest
import statsmodels.api as sm
import xarray as xr
from scipy.stats import lognorm, ttest_ind
from test_cloud_curves import make_cloud
from test_fragility import make_run

import warpdyn as wd
from warpdyn.answers.fragility.intervals.jackknife import spread_of
from warpdyn.answers.fragility.intervals.strata import strata_of_records
from warpdyn.foundations.core import checks

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]
LEVELS = np.array([0.3, 0.6, 0.9, 1.2, 1.6])
LIMITS = {"light": 0.018}  # at 0.02 times the intensity in the median: a median capacity of 0.9
BETWEEN, WITHIN, OF_STRUCTURES = 0.35, 0.25, 0.2
DISPERSION = float(np.hypot(np.hypot(BETWEEN, WITHIN), OF_STRUCTURES))


def nested_run(seed: int, records: int = 20, structures: int = 8) -> xr.Dataset:
    """Return a run of the same structures under other records at each level."""
    generator = np.random.default_rng(seed)
    shape = LEVELS.size, records, structures
    level = np.broadcast_to(LEVELS[:, None, None], shape)
    factor = BETWEEN * generator.standard_normal((LEVELS.size, records, 1))
    factor = factor + OF_STRUCTURES * generator.standard_normal(structures)
    factor = factor + WITHIN * generator.standard_normal(shape)
    record = np.broadcast_to(np.arange(LEVELS.size * records).reshape(LEVELS.size, records, 1), shape)
    run = make_run((0.02 * level * np.exp(factor)).ravel(), record.ravel(), level.ravel())
    structure = np.broadcast_to(np.arange(structures), shape).ravel()
    return run.assign_coords(structure=("sample", structure))


def single_observations(seed: int, count: int = 60) -> xr.Dataset:
    """Return a run of one observation per record, at a different level for each record."""
    generator = np.random.default_rng(seed)
    level = np.exp(generator.uniform(np.log(0.3), np.log(2.5), count))
    drift = 0.02 * level * np.exp(0.4 * generator.standard_normal(count))
    return make_run(drift, np.arange(count), level)


def probit(level: np.ndarray, exceeds: np.ndarray) -> tuple[float, float]:
    """Return median and dispersion by statsmodels."""
    link = sm.families.Binomial(link=sm.families.links.Probit())
    fit = sm.GLM(exceeds.astype(float), sm.add_constant(np.log(level)), link).fit(tol=1e-12)
    return float(np.exp(-fit.params[0] / fit.params[1])), float(1 / fit.params[1])


@pytest.mark.parametrize("design", ["stripes", "another level for every motion", None])
def test_single_observations_have_the_fit_of_statsmodels(design):
    run = single_observations(1)
    if design is not None:
        run["im_level"].attrs["design"] = design
    curves = wd.fragility(run, LIMITS)
    median, dispersion = probit(run["im_level"].values, run["peak_storey_drift_ratio"].values[:, 0] > 0.018)
    # statsmodels stops where the deviance changes by 1e-12 of itself, whose square root is 1e-6.
    assert float(curves["fragility_median"][0]) == pytest.approx(median, rel=1e-5)
    assert float(curves["fragility_dispersion"][0]) == pytest.approx(dispersion, rel=1e-5)
    assert curves.sizes["stripe"] == 60
    assert curves.attrs["interval_method"].startswith("jackknife over 60 records, less its bias")


def test_single_observations_have_the_fit_of_pyfragility():
    pyfragility = pytest.importorskip("pyFragility")
    run = single_observations(2)
    level, exceeds = run["im_level"].values, run["peak_storey_drift_ratio"].values[:, 0] > 0.018
    order = np.argsort(level)
    best = pyfragility.fit_msa(level[order], exceeds[order].astype(int), np.ones(level.size, dtype=int))
    curves = wd.fragility(run, LIMITS)
    # pyFragility minimises to a gradient of 1e-5 or so.
    np.testing.assert_allclose(
        [float(curves["fragility_median"][0]), float(curves["fragility_dispersion"][0])], best.params, rtol=1e-3
    )


def test_intervals_of_single_observations_cover():
    covered = []
    for seed in range(120):
        curves = wd.fragility(single_observations(seed), LIMITS, replicates=2)
        covered.append(float(curves["fragility_median_lower"][0]) <= 0.9 <= float(curves["fragility_median_upper"][0]))
    # 95 % of 120, less three standard deviations of the binomial count.
    assert np.mean(covered) > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 120)


def test_the_variance_is_that_of_repeated_studies_with_a_record_set_for_each_level():
    medians, variances, covered = [], [], []
    for seed in range(120):
        curves = wd.fragility(nested_run(seed), LIMITS, replicates=2)
        medians.append(np.log(float(curves["fragility_median"][0])))
        variances.append(float(curves["median_variance"][0, :3].sum()))
        covered.append(float(curves["fragility_median_lower"][0]) <= 0.9 <= float(curves["fragility_median_upper"][0]))
    assert "100 records in 5 sets" in curves.attrs["interval_method"]
    # A variance of 120 values has a standard deviation of sqrt(2 / 119) = 13 %: three of them.
    assert np.mean(variances) == pytest.approx(np.var(medians, ddof=1), rel=0.39)
    assert np.mean(covered) > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 120)


def test_the_jackknife_is_the_stratified_one_by_hand():
    run = nested_run(7, records=6, structures=1)
    curves = wd.fragility(run, LIMITS, replicates=2)
    level, record = run["im_level"].values, run["motion_index"].values
    exceeds = run["peak_storey_drift_ratio"].values[:, 0] > 0.018
    variance = 0.0
    for of_level in LEVELS:
        left_out = [
            np.log(probit(level[record != number], exceeds[record != number])[0])
            for number in np.unique(record[level == of_level])
        ]
        variance += 5 / 6 * np.sum((np.array(left_out) - np.mean(left_out)) ** 2)
    # statsmodels stops at 1e-12 of the deviance, and the variance is of differences of some 1e-2.
    assert float(curves["median_variance"].sel(source="record")[0]) == pytest.approx(variance, rel=1e-3)


def test_degrees_of_freedom_of_two_strata_are_those_of_welchs_test():
    # Without each value, a mean has the jackknife variance s^2 / n, as in Welch's test of the difference of two means.
    generator = np.random.default_rng(4)
    first, second = generator.normal(0.0, 3.0, 4), generator.normal(0.0, 1.0, 9)
    estimate = np.array(first.mean() - second.mean())
    left_out = np.concatenate(
        [
            [np.delete(first, place).mean() - second.mean() for place in range(first.size)],
            [first.mean() - np.delete(second, place).mean() for place in range(second.size)],
        ]
    )
    strata = np.repeat([0, 1], [first.size, second.size])
    found = spread_of(estimate, left_out, np.empty((0,)), np.array(0.0), strata)
    welch = ttest_ind(first, second, equal_var=False)
    assert found.freedom == pytest.approx(welch.df, rel=1e-9)  # differences of means that are rounded by 1e-16
    assert found.by_source.sum() == pytest.approx((estimate / welch.statistic) ** 2, rel=1e-9)
    assert welch.df < 0.9 * (first.size + second.size - 2)  # of one stratum


def test_records_that_run_at_every_level_are_one_set():
    assert strata_of_records(np.ones((4, 3), dtype=bool)).tolist() == [0, 0, 0, 0]
    some = np.ones((4, 3), dtype=bool)
    some[2, 1] = False  # a sample that failed
    assert strata_of_records(some).tolist() == [0, 0, 0, 0]


@pytest.mark.parametrize(
    ("level_of_record", "strata"),
    [
        ([0, 0, 1, 1, 2, 2], [0, 0, 1, 1, 2, 2]),
        ([2, 2, 0, 0, 1, 1], [2, 2, 0, 0, 1, 1]),  # by their level
        ([0, 1, 2, 3], [0, 0, 0, 0]),  # single observations
        ([0, 0, 1, 2, 2], [0, 0, 1, 1, 1]),  # a single record goes with the next higher level
        ([0, 0, 1, 1, 2], [0, 0, 1, 1, 1]),  # and the highest with the one below
        ([0, 1, 1], [0, 0, 0]),
    ],
)
def test_records_of_one_level_are_a_set(level_of_record, strata):
    is_run = np.asarray(level_of_record)[:, None] == np.arange(4)
    assert strata_of_records(is_run).tolist() == strata


def test_a_large_cloud_is_refused_with_what_to_use():
    generator = np.random.default_rng(3)
    run = make_run(generator.random(5000), generator.integers(0, 44, 5000), generator.random(5000) + 0.1)
    with pytest.raises(ValueError, match=r"up to 4,096 levels; for a larger cloud use fragility_of_cloud"):
        wd.fragility(run, LIMITS)


# Intensity [g], whether it failed, and demand of eight analyses: Code_Aster's test zzzz233a.
OBSERVED = np.array(
    [
        [0.5, 1, 0.035], [0.45, 0, 0.03], [0.3, 0, 0.028], [0.3, 1, 0.0355],
        [0.15, 0, 0.01], [0.25, 0, 0.02], [0.9, 1, 0.05], [0.4, 1, 0.04],
    ]
)  # fmt: skip


def test_single_observations_of_code_aster():
    level, failed, _ = OBSERVED.T
    run = make_run(np.where(failed == 1, 0.05, 0.01), np.arange(8), level)
    curves = wd.fragility(run, {"failure": 0.03}, replicates=2)
    # The maximum of the likelihood to 8 digits; Code_Aster prints 0.35754513 and 0.40403951, as its search stops early.
    assert float(curves["fragility_median"][0]) == pytest.approx(0.35754191, rel=1e-7)
    assert float(curves["fragility_dispersion"][0]) == pytest.approx(0.40400375, rel=1e-6)


def test_the_deviation_of_a_regression_has_the_divisor_n():
    level, _, demand = OBSERVED.T
    curves = wd.fragility_of_cloud(make_cloud(level, demand), {"failure": 0.0315})
    slope, intercept = np.polyfit(np.log(level), np.log(demand), 1)
    residual = np.log(demand) - intercept - slope * np.log(level)
    assert float(curves["regression_deviation"]) == pytest.approx(np.std(residual), rel=1e-9)
    likelihood = sm.OLS(np.log(demand), sm.add_constant(np.log(level))).fit()
    assert float(curves["regression_deviation"]) == pytest.approx(np.sqrt(likelihood.ssr / likelihood.nobs), rel=1e-9)
    # With n - 1 it would be 0.2829.
    assert float(curves["fragility_dispersion"][0]) == pytest.approx(0.2646, abs=5e-5)


def test_the_dispersion_of_exact_capacities_has_the_divisor_n():
    capacity = OBSERVED[:, 0]
    found = xr.Dataset(
        {"capacity": (("motion", "damage_state"), capacity[:, None], {"units": "g"})}, {"damage_state": ["failure"]}
    )
    curves = wd.fragility_from_capacities(found)
    shape, _, scale = lognorm.fit(capacity, floc=0)  # scipy's maximum likelihood, to its search's tolerance of 1e-4
    assert float(curves["fragility_dispersion"][0]) == pytest.approx(np.log(capacity).std(), rel=1e-12)
    np.testing.assert_allclose(
        [curves["fragility_median"][0], curves["fragility_dispersion"][0]], [scale, shape], rtol=1e-3
    )


def test_single_observations_that_do_not_fit_in_memory_are_refused(monkeypatch):
    # 20 tables of 40 records, 40 levels, 2 places and 1 state in 8 bytes: 512 kB.
    generator = np.random.default_rng(0)
    level = np.exp(generator.normal(size=40))
    run = make_run(0.02 * level, np.arange(40), level)
    monkeypatch.setattr(checks, "free_memory", lambda: 511_000)
    with pytest.raises(ValueError, match="fragility of 40 records at 40 levels needs 512000 bytes"):
        wd.fragility(run, LIMITS)
