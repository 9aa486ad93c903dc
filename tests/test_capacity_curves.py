"""Fragility curves from capacities against pyFragility, fits by hand and known truths, on capacities made by hand."""

import warnings

import numpy as np
import pyFragility as pf
import pytest
import xarray as xr
from scipy.optimize import minimize
from scipy.special import ndtr

import warpdyn as wd

pytestmark = pytest.mark.fast

STATES = ("slight", "complete")


def made(structures=6, motions=20, seed=0, between=0.3):
    """Return capacities [g], shape [structure, motion, damage_state]."""
    rng = np.random.default_rng(seed)
    of_motion, of_structure = rng.normal(0, between, (1, motions, 1)), rng.normal(0, 0.1, (structures, 1, 1))
    scatter = rng.normal(0, 0.15, (structures, motions, 1))
    return np.exp(np.log([0.4, 1.2]) + of_motion + of_structure + scatter)


def dataset(capacity, lower=None, upper=None) -> xr.Dataset:
    """Return capacities as warpdyn.capacities does."""
    dims = ("structure", "motion", "damage_state")
    parts = {"capacity": capacity, "capacity_lower": lower, "capacity_upper": upper}
    variables = {name: (dims, values, {"units": "g"}) for name, values in parts.items() if values is not None}
    attrs = {"intensity_measure": "Sa(0.5 s)"}
    return xr.Dataset(variables, {"damage_state": list(STATES)}, attrs)


def bracketed(capacity, width=0.02, highest=np.inf):
    """Return capacities that are known to a relative width, and up to a highest level."""
    step = np.log1p(width)
    lower = np.exp(np.floor(np.log(capacity) / step) * step)
    upper = lower * (1 + width)
    above = upper > highest
    lower, upper = np.where(above, highest, lower), np.where(above, np.inf, upper)
    return dataset(np.where(above, np.inf, np.sqrt(lower * upper)), lower, upper)


def test_known_capacities_have_their_moments():
    capacity = made()
    curves = wd.fragility_from_capacities(dataset(capacity))
    logarithm = np.log(capacity).reshape(-1, 2)
    np.testing.assert_allclose(curves["fragility_median"], np.exp(logarithm.mean(axis=0)), rtol=1e-12)
    np.testing.assert_allclose(curves["fragility_dispersion"], logarithm.std(axis=0), rtol=1e-9)
    narrow = wd.fragility_from_capacities(bracketed(capacity, width=1e-8))
    for name in ("fragility_median", "fragility_dispersion", "fragility_median_lower", "fragility_median_upper"):
        np.testing.assert_allclose(narrow[name], curves[name], rtol=1e-7)


def test_one_structure_of_several_can_be_selected():
    capacity = made()
    drawn = np.repeat(np.arange(6)[:, None], 20, axis=1)
    several = dataset(capacity).assign_coords(drawn_structure=(("structure", "motion"), drawn, {"sampling": "sobol"}))
    curves = wd.fragility_from_capacities(several.isel(structure=2))
    np.testing.assert_allclose(curves["fragility_median"], np.exp(np.log(capacity[2]).mean(axis=0)), rtol=1e-12)


def test_censored_capacities_are_those_of_pyfragility():
    capacity = made(structures=1, motions=40)
    highest, motion = 1.3, np.arange(40)
    censored = capacity > highest
    lower = np.where(censored, highest, capacity)
    curves = wd.fragility_from_capacities(
        dataset(np.where(censored, np.inf, capacity), lower, np.where(censored, np.inf, capacity))
    )
    for place, state in enumerate(STATES):
        theirs = pf.fit_ida(lower[0, :, place], censored=censored[0, :, place], cluster=motion)
        own = curves.sel(damage_state=state)
        estimates = [own["fragility_median"].item(), own["fragility_dispersion"].item()]
        np.testing.assert_allclose(estimates, theirs.params, rtol=1e-5)
        variances = np.diag(theirs.covariance("sandwich")) / theirs.params**2 * 40 / 39  # of both logarithms
        found = [own[f"{name}_variance_by_sandwich"].item() for name in ("median", "dispersion")]
        np.testing.assert_allclose(found, variances, rtol=1e-3)  # their derivatives are numeric
    np.testing.assert_array_equal(curves["censored_capacities"], censored.sum(axis=(0, 1)))


def test_wide_brackets_have_their_exact_likelihood():
    capacity = made()
    found = bracketed(capacity, width=0.5, highest=2.0)
    low, high = (np.log(found[f"capacity_{side}"].values.reshape(-1, 2)) for side in ("lower", "upper"))
    curves = wd.fragility_from_capacities(found)
    for place in range(2):

        def negative(parameters, place=place):
            centre, deviation = parameters[0], np.exp(parameters[1])
            inside = ndtr((high[:, place] - centre) / deviation) - ndtr((low[:, place] - centre) / deviation)
            return -np.log(np.maximum(inside, 1e-300)).sum()

        best = minimize(negative, [0.0, -1.0], method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-12}).x
        assert curves["fragility_median"][place].item() == pytest.approx(np.exp(best[0]), rel=1e-6)
        assert curves["fragility_dispersion"][place].item() == pytest.approx(np.exp(best[1]), rel=1e-6)


def test_intervals_cover_and_the_variance_is_split_among_records_and_structures():
    # A capacity is that of a motion, a structure and both: the truth is 0.4 g, of 22 motions and 8 structures.
    tries, covered, split = 100, 0, []
    for seed in range(tries):
        curves = wd.fragility_from_capacities(dataset(made(8, 22, seed)), replicates=1)
        covered += bool(curves["fragility_median_lower"][0] <= 0.4 <= curves["fragility_median_upper"][0])
        split.append(curves["median_variance"].sel(damage_state="slight").values)
    # Of 100 intervals that cover with 95 %, fewer than 86 do so once in 5,000 times.
    assert covered >= 86
    # Variances of a mean of 22 motions (.3), 8 structures (.1) and their pairs (.15); the mean of 100 is known to 6 %.
    np.testing.assert_allclose(np.mean(split, axis=0), [0.3**2 / 22, 0.1**2 / 8, 0.15**2 / 176], rtol=0.25)


def test_states_without_a_curve():
    capacity = made()
    found = bracketed(capacity, highest=capacity[..., 1].min() * 0.9)
    with pytest.warns(UserWarning, match="'complete' has no fit \\(no_exceedance\\); no capacity was reached"):
        curves = wd.fragility_from_capacities(found)
    assert np.isnan(curves["fragility_median"].sel(damage_state="complete"))
    assert np.isnan(curves["fragility_curve"].sel(damage_state="complete")).all()
    same = np.full((2, 3, 2), 0.5) * np.array([1.0, 2.0])
    with pytest.warns(UserWarning, match="all brackets have a level in common"):
        wd.fragility_from_capacities(bracketed(same))
    one = np.where(np.arange(120).reshape(6, 20, 1) == 7, [0.5, 0.5], np.inf)  # of 120 capacities one was reached
    with pytest.warns(
        UserWarning, match="no fit \\(separated\\); 99 % of the capacities are above the highest level: raise"
    ):
        wd.fragility_from_capacities(
            dataset(one, np.where(np.isinf(one), 0.52, 0.49), np.where(np.isinf(one), np.inf, 0.52))
        )
    far = bracketed(capacity, highest=float(np.quantile(capacity[..., 1], 0.3)))
    with pytest.warns(UserWarning, match=r"'complete': the median of 1\.\d* g is an extrapolation, above the highest"):
        curves = wd.fragility_from_capacities(far)
    assert np.isfinite(curves["fragility_median"]).all()
    with pytest.warns(UserWarning, match="there is only one motion"):
        curves = wd.fragility_from_capacities(dataset(capacity[:, :1]))
    assert np.isnan(curves["fragility_median_lower"]).all()


def test_failed_searches_are_left_out_if_they_are_few():
    capacity = made(10, 20)
    found = bracketed(capacity)
    for name in ("capacity", "capacity_lower", "capacity_upper"):
        found[name][3, 4] = np.nan
    curves = wd.fragility_from_capacities(found)
    assert curves["excluded_pairs"] == 1
    found["capacity"][:2], found["capacity_lower"][:2] = np.nan, np.nan
    with pytest.raises(ValueError, match="41 of 200 pairs of a structure and a motion have no capacity"):
        wd.fragility_from_capacities(found)


def test_bad_input():
    capacity = made()
    with pytest.raises(ValueError, match="must be positive and increase; a capacity that was not reached needs"):
        wd.fragility_from_capacities(dataset(np.where(capacity > 1, np.inf, capacity)))
    with pytest.raises(ValueError, match="structure 0, motion 0, damage state 'slight' lies between -"):
        wd.fragility_from_capacities(dataset(-capacity))
    with pytest.raises(ValueError, match="capacity has dimensions"):
        wd.fragility_from_capacities(dataset(capacity).rename(motion="record"))
    with pytest.raises(TypeError, match="fragility_from_capacities"):
        wd.fragility_from_capacities(capacity)


@pytest.mark.parametrize("structures", [2, 4, 6, 16])
@pytest.mark.filterwarnings("ignore:.*groups of structures tell little")
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_replicates_agree_with_the_stated_intervals_however_few_the_structures(structures):
    draws, capacity = 1000, made(structures, 40, seed=3)
    # The heavier state's capacities differ by structure alone, so that degrees of freedom differ from state to state.
    capacity[..., 1] *= np.exp(np.random.default_rng(5).normal(0, 0.3, structures))[:, None]
    curves = wd.fragility_from_capacities(dataset(capacity), replicates=draws)
    # The share of 1000 draws beyond a bound of 2.5 % has a standard error of sqrt(.025 .975 / 1000) = .0049; 16 bounds
    # lie within 4 of them but once in 1000 times. Draws on a bound are of those that were cut there.
    margin = 4 * np.sqrt(0.025 * 0.975 / draws)
    for name in ("median", "dispersion"):
        drawn = curves[f"replicate_{name}"]
        low, high = (curves[f"fragility_{name}_{side}"] for side in ("lower", "upper"))
        assert np.isfinite(drawn).all()
        assert (drawn > 0).all()
        inside = 1 - 1e-12, 1 + 1e-12
        for strictly, with_cut in (
            (drawn < low * inside[0], drawn < low * inside[1]),
            (drawn > high * inside[1], drawn > high * inside[0]),
        ):
            assert (strictly.mean("replicate") < 0.025 + margin).all()
            assert (with_cut.mean("replicate") > 0.025 - margin).all()
        # Four times the estimate, about a centre that is the estimate less its bias, or the interval where it is wider.
        centre = np.sqrt(low * high)
        assert (drawn <= np.maximum(4 * centre, high) * inside[1]).all()
        assert (drawn >= np.minimum(centre / 4, low) * inside[0]).all()
    rates = wd.annual_rates(curves, wd.HazardCurve([0.05, 0.2, 0.8, 3.0, 9.0], [2e-2, 2e-3, 1e-4, 2e-6, 5e-8]))
    assert np.isfinite(rates["annual_rate_upper"]).all()


def test_few_groups_of_structures_are_told_once():
    capacity = made(3, 40, seed=3)
    capacity *= np.array([0.5, 1.0, 2.0])[:, None, None]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        wd.fragility_from_capacities(dataset(capacity))
    (warning,) = caught
    assert "there are only 3 groups of structures" in str(warning.message)
    assert "simulate at least 8 groups" in str(warning.message)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wd.fragility_from_capacities(dataset(made(16, 40)))
