"""Posterior samples of fragility curves against an integration on a grid."""

import sys

import numpy as np
import pytest
import xarray as xr
from scipy.special import ndtr
from scipy.stats import lognorm

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]

LEVELS = np.array([0.1, 0.2, 0.3, 0.45, 0.7, 1.1])
LIMITS = {"slight": 0.01, "complete": 0.02}


def make_run(records=44, structures=1, within=0.0, seed=1) -> xr.Dataset:
    """Build a run on stripes as warpdyn.simulate writes it."""
    rng = np.random.default_rng(seed)
    record, structure, level = (
        part.ravel() for part in np.meshgrid(np.arange(records), np.arange(structures), LEVELS, indexing="ij")
    )
    of_record = rng.normal(0, 0.4, records)
    own = rng.normal(0, within, (records, structures))
    drift = 0.03 * level * np.exp(of_record[record] + own[record, structure])
    meanings = "ok collapsed diverged unstable_step not_converged"
    flags = {"flag_values": np.arange(5, dtype=np.int8), "flag_meanings": meanings}
    variables = {
        "peak_storey_drift_ratio": (("sample", "storey"), drift[:, None]),
        "status": ("sample", np.zeros(drift.size, np.int8), flags),
        "motion_index": ("sample", record),
        "structure": ("sample", structure),
        "im_level": ("sample", level, {"units": "g"}),
    }
    return xr.Dataset(variables).set_coords(["motion_index", "im_level", "structure"])


def on_a_grid(run, limit, effect, prior=None):
    """Return mean and standard deviation of ln median and dispersion, integrated on a grid of both."""
    drift, level = run["peak_storey_drift_ratio"].values[:, 0], run["im_level"].values
    k = np.array([(drift[level == each] > limit).sum() for each in LEVELS])
    n = np.array([(level == each).sum() for each in LEVELS])
    median, dispersion = np.meshgrid(np.linspace(0.15, 1.2, 320), np.linspace(0.1, 1.2, 250), indexing="ij")
    p = np.clip(ndtr(np.log(LEVELS / median[..., None]) / dispersion[..., None]), 1e-15, 1 - 1e-15)
    logarithm = (k * np.log(p) + (n - k) * np.log1p(-p)).sum(axis=-1) / effect
    if prior is not None:
        logarithm += prior.logpdf(dispersion)
    weight = np.exp(logarithm - logarithm.max())
    weight /= weight.sum()
    values = np.stack([np.log(median), dispersion])
    mean = (weight * values).sum(axis=(1, 2))
    return mean, np.sqrt((weight * (values - mean[:, None, None]) ** 2).sum(axis=(1, 2)))


@pytest.mark.parametrize("prior", [None, lognorm(0.15, scale=0.6)])
def test_the_posterior_is_that_of_a_grid(prior):
    run, limit = make_run(), 0.02
    priors = None if prior is None else {"dispersion": prior}
    drawn = wd.fragility_posterior(run, {"complete": limit}, priors=priors, draws=2000).isel(damage_state=0)
    mean, deviation = on_a_grid(run, limit, drawn["design_effect"].item(), prior)
    draws = np.stack([np.log(drawn["replicate_median"]), drawn["replicate_dispersion"]])
    assert drawn["effective_draws"] > 100
    error = deviation / np.sqrt(drawn["effective_draws"].item())
    assert (np.abs(draws.mean(axis=1) - mean) < 4.5 * error).all()  # once in 70,000
    np.testing.assert_allclose(draws.std(axis=1), deviation, rtol=0.3)
    assert drawn["fragility_median_lower"] < drawn["fragility_median"] < drawn["fragility_median_upper"]


def test_structures_of_one_record_do_not_narrow_the_posterior():
    alone, many = (
        wd.fragility_posterior(make_run(structures=n, within=0.01), {"slight": 0.01}, draws=1000) for n in (1, 30)
    )
    # Thirty structures that are nearly one hold as much as one: the widths of both are within a fifth or so.
    assert many["design_effect"] > 20
    widths = [float(np.log(each["replicate_median"]).std()) for each in (alone, many)]
    assert widths[1] == pytest.approx(widths[0], rel=0.3)


def test_bad_input(monkeypatch):
    run = make_run()
    with pytest.raises(ValueError, match="prior 'theta'"):
        wd.fragility_posterior(run, LIMITS, priors={"theta": lognorm(0.3)})
    with pytest.raises(TypeError, match="prior of 'median' must be a distribution"):
        wd.fragility_posterior(run, LIMITS, priors={"median": 0.3})
    with pytest.warns(UserWarning, match="'complete' has no posterior.*no_exceedance"):
        drawn = wd.fragility_posterior(run, {"slight": 0.01, "complete": 5.0}, draws=100)
    assert np.isnan(drawn["fragility_median"].sel(damage_state="complete"))
    monkeypatch.setitem(sys.modules, "pyFragility", None)
    with pytest.raises(ImportError, match=r"warpdyn\[estimators\]"):
        wd.fragility_posterior(run, LIMITS)
