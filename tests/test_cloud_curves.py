"""Fragility curves from clouds against pyFragility, fits by hand and known truths, on clouds made by hand."""

import numpy as np
import pyFragility as pf
import pytest
import xarray as xr
from scipy.optimize import minimize
from scipy.special import log_ndtr, ndtr

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]

# The example of pyFragility's fit_cloud.
IM = [0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 1.8, 2.2, 2.6]
EDP = [0.001, 0.0018, 0.002, 0.004, 0.0035, 0.007, 0.006, 0.014, 0.012, 0.03, 0.025, 0.05, 0.04, 0.09]
LIMITS = {"slight": 0.005, "moderate": 0.02, "complete": 0.05}


def make_cloud(im, edp, collapsed=None, record=None, structure=None) -> xr.Dataset:
    """Build a run of a Cloud as warpdyn.simulate writes it."""
    samples = len(im)
    record = np.arange(samples) if record is None else record
    structure = np.zeros(samples, dtype=int) if structure is None else structure
    meanings = "ok collapsed diverged unstable_step not_converged"
    flags = {"flag_values": np.arange(5, dtype=np.int8), "flag_meanings": meanings}
    status = np.zeros(samples, np.int8) if collapsed is None else np.asarray(collapsed).astype(np.int8)
    level = {"units": "g", "long_name": "PGA of the scaled motion", "design": "of a design of clouds"}
    variables = {
        "peak_storey_drift_ratio": (("sample", "storey"), np.column_stack([edp, 0.5 * np.asarray(edp)])),
        "status": ("sample", status, flags),
        "motion_index": ("sample", np.asarray(record)),
        "structure": ("sample", np.asarray(structure)),
        "im_level": ("sample", np.asarray(im, dtype=float), level),
    }
    return xr.Dataset(variables).set_coords(["motion_index", "im_level", "structure"])


def with_collapses(samples=200, collapses=96, seed=2):
    """Return im, drift up to collapse and whether samples collapsed; these are as many as said."""
    rng = np.random.default_rng(seed)
    im = np.exp(rng.normal(-0.4, 0.7, samples))
    edp = np.exp(-3.0 + 1.1 * np.log(im) + rng.normal(0, 0.4, samples))
    least = np.exp(rng.normal(0, 0.1, samples))  # drift at which each collapses, up to a factor
    ratio = np.sort(edp / least)
    least *= 0.5 * (ratio[-collapses - 1] + ratio[-collapses])
    return im, np.minimum(edp, least), edp >= least


def test_a_plain_cloud_is_that_of_pyfragility():
    curves = wd.fragility_of_cloud(make_cloud(IM, EDP), LIMITS)
    theirs = pf.fit_cloud(IM, EDP)
    for state, limit in LIMITS.items():
        summary, own = theirs.lognormal_parameters(threshold=limit), curves.sel(damage_state=state)
        assert own["fragility_median"].item() == pytest.approx(summary.theta, rel=1e-6)
        assert own["fragility_dispersion"].item() == pytest.approx(summary.beta, rel=1e-6)
        intensity = curves["intensity"].values[1:]
        np.testing.assert_allclose(
            own["fragility_curve"].values[1:], theirs.probability(intensity, threshold=limit), atol=1e-6
        )
    together = wd.fragility_of_cloud(make_cloud(IM, EDP), LIMITS, estimator="collapse")
    for name in ("fragility_median", "fragility_dispersion"):  # without a collapse both estimators are one
        np.testing.assert_allclose(together[name], curves[name], rtol=1e-9)


def test_half_of_the_cloud_collapsed_as_a_censored_fit_by_hand():
    im, edp, collapsed = with_collapses()
    assert collapsed.sum() == 96

    def negative(parameters):
        z = (np.log(edp) - parameters[0] - parameters[1] * np.log(im)) / np.exp(parameters[2])
        return -np.where(collapsed, log_ndtr(-z), -0.5 * z * z - parameters[2]).sum()

    best = minimize(negative, [-3, 1, -1], method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-12}).x
    with pytest.warns(UserWarning, match="'complete' is above all demands"):
        curves = wd.fragility_of_cloud(make_cloud(im, edp, collapsed), LIMITS)
    by_hand = np.exp((np.log(list(LIMITS.values())) - best[0]) / best[1])
    np.testing.assert_allclose(curves["fragility_median"], by_hand, rtol=1e-6)
    np.testing.assert_allclose(curves["fragility_dispersion"], np.exp(best[2]) / best[1], rtol=1e-6)
    assert curves["collapsed_samples"] == 96
    # Each record is one sample: the jackknife and the sandwich tell one variance, but for second-order terms.
    for name in ("median", "dispersion"):
        found = curves[f"{name}_variance"].sum("source")
        np.testing.assert_allclose(found, curves[f"{name}_variance_by_sandwich"], rtol=0.15)


def test_a_cloud_with_collapse_is_that_of_pyfragility():
    im, edp, collapsed = with_collapses(seed=7)
    curves = wd.fragility_of_cloud(make_cloud(im, edp, collapsed), LIMITS, estimator="collapse")
    theirs = pf.fit_cloud(im, edp, collapse=collapsed)
    intensity = curves["intensity"].values[1:]
    for state, limit in LIMITS.items():
        expected = theirs.probability(intensity, threshold=limit)
        np.testing.assert_allclose(curves["fragility_curve"].sel(damage_state=state)[1:], expected, atol=1e-5)
        median = curves["fragility_median"].sel(damage_state=state).item()
        assert theirs.probability([median], threshold=limit)[0] == pytest.approx(0.5, abs=1e-5)
    wider = [np.interp(share, expected, np.log(intensity)) for share in ndtr([-1, 1])]
    half = curves["fragility_dispersion"].sel(damage_state="complete").item()
    assert half == pytest.approx(0.5 * (wider[1] - wider[0]), rel=5e-3)  # between points of the curve


def test_censoring_finds_the_regression_that_collapses_hide():
    rng = np.random.default_rng(0)
    im = np.exp(rng.normal(-0.4, 0.7, 1500))
    edp = np.exp(-3.0 + 1.1 * np.log(im) + rng.normal(0, 0.4, im.size))
    curves = wd.fragility_of_cloud(make_cloud(im, np.minimum(edp, 0.04), edp > 0.04), {"slight": 0.02})
    # Standard errors of the three are .019, .022 and .009 with 1,500 samples, as the fit has them.
    assert curves["regression_intercept"].item() == pytest.approx(-3.0, abs=0.08)
    assert curves["regression_slope"].item() == pytest.approx(1.1, abs=0.09)
    assert curves["regression_deviation"].item() == pytest.approx(0.4, abs=0.04)


def test_records_are_the_clusters_of_a_crossed_cloud():
    rng = np.random.default_rng(1)
    records, structures = 30, 20
    im = np.exp(rng.normal(-0.5, 0.6, records))
    record, structure = np.repeat(np.arange(records), structures), np.tile(np.arange(structures), records)
    shared = rng.normal(0, 0.4, records)[record] + rng.normal(0, 0.1, structures)[structure]
    edp = np.exp(-3 + np.log(im)[record] + shared + rng.normal(0, 0.05, record.size))
    curves = wd.fragility_of_cloud(make_cloud(im[record], edp, record=record, structure=structure), {"slight": 0.02})
    variance = curves["median_variance"].sel(damage_state="slight")
    independent = curves["median_variance_if_independent"].item()
    # 600 samples share the scatter of 30 records, .4 of a deviation of .42: ten times the variance and more.
    assert variance.sel(source="record") > 8 * independent
    assert variance.sel(source="structure") > 0
    theirs = pf.fit_cloud(im[record], edp, cluster=record).lognormal_parameters("sandwich", threshold=0.02)
    own = curves["median_variance_by_sandwich"].item() * 29 / 30
    assert np.sqrt(own) == pytest.approx(np.sqrt(theirs.cov[0, 0]) / theirs.theta, rel=1e-4)


BAD = {
    "no positive demand": ({"edp": [0.0, *EDP[1:]]}, {}, "peak_storey_drift_ratio of sample 0 is 0.0"),
    "no positive intensity": ({"im": [0.0, *IM[1:]]}, {}, "im_level of sample 0 is 0.0"),
    "all collapsed": ({"collapsed": [True] * 14}, {}, "0 of 14 samples did not collapse"),
    "one intensity": ({"im": [0.3] * 14}, {}, "at 1 different intensities"),
    "failed": ({"collapsed": [2] * 2 + [0] * 12}, {}, "2 of 14 samples failed \\(2 diverged\\)"),
    "estimator": ({}, {"estimator": "tobit"}, "estimator of a cloud 'tobit'"),
    "several demands": ({}, {"limits": {"slight": {"a": 1.0, "b": 2.0}}}, "the limits are limits of several demands"),
    "not recorded": ({}, {"demand": "peak_base_shear"}, "no 'peak_base_shear'"),
}


def test_an_empty_selection_is_refused():
    with pytest.raises(ValueError, match="the dataset is empty"):
        wd.fragility_of_cloud(make_cloud(im=IM, edp=EDP).isel(sample=[]), LIMITS)


@pytest.mark.parametrize("case", BAD)
def test_bad_input(case):
    changes, arguments, message = BAD[case]
    run = make_cloud(**({"im": IM, "edp": EDP} | changes))
    with pytest.raises(ValueError, match=message):
        wd.fragility_of_cloud(run, **({"limits": LIMITS} | arguments))


def test_a_demand_that_falls_has_no_curve():
    with pytest.warns(UserWarning, match="the demand does not grow with the intensity"):
        curves = wd.fragility_of_cloud(make_cloud(IM, EDP[::-1]), LIMITS)
    assert np.isnan(curves["fragility_median"]).all()
    assert np.isnan(curves["fragility_curve"]).all()


def test_collapses_apart_from_the_rest_are_penalised_and_one_motion_has_no_interval():
    collapsed = np.array(IM) > 1.3
    with pytest.warns(UserWarning, match="collapse is penalised: 4 of 14 samples collapsed"):
        curves = wd.fragility_of_cloud(make_cloud(IM, EDP, collapsed), {"slight": 0.005}, estimator="collapse")
    assert 1.2 < curves["collapse_median"] < 1.5
    with pytest.warns(UserWarning, match="there is only one motion"):
        curves = wd.fragility_of_cloud(make_cloud(IM, EDP, record=[0] * 14), {"slight": 0.005})
    assert np.isfinite(curves["fragility_median"]).all()
    assert np.isnan(curves["fragility_median_lower"]).all()


@pytest.mark.parametrize("estimator", ["censored", "collapse"])
@pytest.mark.parametrize("collapses", [False, True])
def test_extrapolation_beyond_every_demand_is_told_by_both_estimators(estimator, collapses):
    im, edp, collapsed = with_collapses() if collapses else (np.array(IM), np.array(EDP), None)
    standing = edp if collapsed is None else np.asarray(edp)[~np.asarray(collapsed)]
    run, highest = make_cloud(im, edp, collapsed), float(np.max(standing))
    with pytest.warns(UserWarning, match="'far' is above all demands of samples without collapse") as caught:
        wd.fragility_of_cloud(run, {"near": 0.5 * highest, "far": 1.5 * highest}, estimator=estimator)
    (message,) = [str(each.message) for each in caught if "is above all" in str(each.message)]
    assert "extrapolated: add motions of higher intensity" in message
    # The other estimator differs only where something collapsed.
    assert ("estimator='collapse'" in message) == (estimator == "censored" and collapses)
