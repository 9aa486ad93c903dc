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
    """Return mean, standard deviation and kurtosis of ln median and dispersion, integrated on a grid of both."""
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
    away = values - mean[:, None, None]
    variance = (weight * away**2).sum(axis=(1, 2))
    return mean, np.sqrt(variance), (weight * away**4).sum(axis=(1, 2)) / variance**2


def check_width(drawn, deviation, kurtosis):
    """Assert that draws are as wide as they should be, within 4.5 of their own standard errors: once in 150,000.

    The variance of n independent draws has the relative standard error sqrt((kurtosis - 1) / n), their deviation half
    of it. Squares of a chain are less correlated than its values, so that as many draws count for them at least.
    """
    error = 0.5 * np.sqrt((kurtosis - 1.0) / drawn["effective_draws"].item())
    draws = np.stack([np.log(drawn["replicate_median"]), drawn["replicate_dispersion"]])
    assert (np.abs(draws.std(axis=1) / deviation - 1.0) < 4.5 * error).all()
    assert (4.5 * error < 0.2).all()  # enough draws for the check to tell something


@pytest.mark.parametrize("prior", [None, lognorm(0.15, scale=0.6)])
def test_the_posterior_is_that_of_a_grid(prior):
    run, limit = make_run(), 0.02
    priors = None if prior is None else {"dispersion": prior}
    drawn = wd.fragility_posterior(run, {"complete": limit}, priors=priors, draws=8000).isel(damage_state=0)
    mean, deviation, kurtosis = on_a_grid(run, limit, drawn["design_effect"].item(), prior)
    draws = np.stack([np.log(drawn["replicate_median"]), drawn["replicate_dispersion"]])
    error = deviation / np.sqrt(drawn["effective_draws"].item())
    assert (np.abs(draws.mean(axis=1) - mean) < 4.5 * error).all()  # once in 70,000
    check_width(drawn, deviation, kurtosis)
    assert drawn["fragility_median_lower"] < drawn["fragility_median"] < drawn["fragility_median_upper"]


def test_structures_of_one_record_do_not_narrow_the_posterior():
    runs = [make_run(structures=n, within=0.01) for n in (1, 30)]
    deviations = []
    for run in runs:
        drawn = wd.fragility_posterior(run, {"slight": 0.01}, draws=8000).isel(damage_state=0)
        _, deviation, kurtosis = on_a_grid(run, 0.01, drawn["design_effect"].item())
        check_width(drawn, deviation, kurtosis)
        deviations.append(deviation)
    assert drawn["design_effect"] > 20
    # Thirty structures that are nearly one hold as much as one. At a level at most a share of 0.04 of the records has
    # structures on both sides of the limit (+-2 x 0.01 at a density of 1 / (0.4 sqrt(2 pi))), by which counts differ.
    np.testing.assert_allclose(deviations[1], deviations[0], rtol=0.04)


@pytest.mark.parametrize("draws", [100, 1000])
def test_an_improper_posterior_is_reported(draws):
    # Three records, with flat priors: the likelihood does not fall to 0 along ln median = a + b dispersion.
    run, limits = make_run(records=3, seed=3), {"complete": 0.02}
    with pytest.warns(UserWarning, match="of damage state 'complete' is improper.*give priors=.*dispersion"):
        drawn = wd.fragility_posterior(run, limits, draws=draws)
    assert all(np.isnan(drawn[name]).all() for name in ("fragility_median", "replicate_dispersion", "effective_draws"))
    priors = {"median": lognorm(0.5, scale=0.5), "dispersion": lognorm(0.3, scale=0.4)}
    drawn = wd.fragility_posterior(run, limits, priors=priors, draws=draws)
    assert 0.2 < drawn["fragility_median"].item() < 1.2
    assert drawn["effective_draws"].item() > 10


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
    with pytest.raises(ImportError, match='pip install "pyFragility>='):
        wd.fragility_posterior(run, LIMITS)
