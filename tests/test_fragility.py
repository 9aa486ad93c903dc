"""Fragility of a run: what is counted, what is kept out, and the intervals."""

import warnings

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import minimize
from scipy.stats import beta, norm, t

import warpdyn as wd
from warpdyn.answers.fragility.estimators.table import FIT_MEANINGS as FIT_MEANINGS_OF_ESTIMATORS
from warpdyn.answers.fragility.lognormal_fit import FIT_MEANINGS, fit_stripes

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]


def make_run(drift, record, level):
    """Build a run as warpdyn.simulate writes it, from arrays by sample."""
    drift = np.atleast_2d(np.asarray(drift, dtype=np.float64).T).T
    samples = len(drift)
    meanings = "ok collapsed diverged unstable_step not_converged"
    flags = {"flag_values": np.arange(5, dtype=np.int8), "flag_meanings": meanings}
    variables = {
        "peak_storey_drift_ratio": (("sample", "storey"), drift),
        "status": ("sample", np.zeros(samples, np.int8), flags),
        "motion_index": ("sample", np.asarray(record, dtype=np.int32)),
        "im_level": ("sample", np.asarray(level, dtype=np.float64), {"units": "g"}),
        "structure": ("sample", np.arange(samples, dtype=np.int32)),
        "storey": np.arange(1, drift.shape[1] + 1),
    }
    return xr.Dataset(variables).set_coords(["motion_index", "im_level", "structure"])


def with_status(run, samples, code, demand=np.nan):
    """Give some samples another status and demand."""
    status, drift = run["status"].copy(), run["peak_storey_drift_ratio"].copy()
    status[samples], drift[samples] = code, demand
    return run.assign(status=status, peak_storey_drift_ratio=drift)


def synthetic_run(seed, records=30, structures=10, between=0.3, within=0.2, levels=(0.3, 0.6, 0.9, 1.2, 1.5, 2.0)):
    """Two storeys whose drift ratio is 0.02 IM times a lognormal factor of the record and one of the sample."""
    generator = np.random.default_rng(seed)
    record, level, _ = (g.ravel() for g in np.meshgrid(range(records), levels, range(structures), indexing="ij"))
    factor = between * generator.standard_normal(records)[record, None]
    factor = factor + within * generator.standard_normal((record.size, 2))
    return make_run(0.02 * level[:, None] * np.exp(factor) * [1.0, 0.7], record, level)


@pytest.mark.filterwarnings("ignore:damage state")  # too few records for intervals, which are not asked of it
def test_fractions_curves_and_labels():
    run = make_run(
        [[0.01, 0.03], [0.03, 0.01], [0.02, 0.02], [0.05, 0.01], [0.05, 0.05], [0.0, 0.03], [0.1, 0.1], [0.0, 0.01]],
        record=[0, 0, 5, 5, 0, 0, 5, 5],
        level=[0.5, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0, 1.0],
    )
    result = wd.fragility(run, {"light": 0.02, "heavy": 0.04})
    # Counted by hand; 0.02 does not exceed 0.02.
    assert result["exceeding_samples"].values.tolist() == [[3, 3], [1, 2]]
    assert result["valid_samples"].values.tolist() == [4, 4]
    assert result["exceedance_fraction"].values.tolist() == [[0.75, 0.75], [0.25, 0.5]]
    by_storey = result["storey_exceedance_fraction"].transpose("storey", "damage_state", "stripe")
    assert by_storey.values.tolist() == [[[0.5, 0.5], [0.25, 0.5]], [[0.25, 0.75], [0, 0.5]]]
    assert result["damage_limit"].values.tolist() == [0.02, 0.04]
    assert result["stripe"].values.tolist() == [0.5, 1.0]
    # 1 of 4: record 0 has none of 2, record 5 one of 2. Without the one or the other: 1/2 and 0, so that the variance
    # is (1/2) ((1/2 - 1/4)^2 + (0 - 1/4)^2) = 1/16, of 3 independent samples; fewer, since t is 12.7062 for 2 records
    # and 3.1824 for 4 samples: .188, and at least 1.
    bounds = [result[f"exceedance_fraction_{side}"][1, 0].item() for side in ("lower", "upper")]
    np.testing.assert_allclose(bounds, [beta.ppf(0.025, 0.25, 1.75), beta.ppf(0.975, 1.25, 0.75)], rtol=1e-10)
    # Two stripes: the curve passes through both fractions. Phi^-1(1/4) = -.6744897501960817, Phi^-1(1/2) = 0.
    np.testing.assert_allclose(result["fragility_median"], [np.nan, 1.0], atol=1e-9)
    np.testing.assert_allclose(result["fragility_dispersion"], [np.nan, np.log(2) / 0.6744897501960817], atol=1e-9)
    assert result["fit_status"].values.tolist() == [FIT_MEANINGS.index("not_increasing"), 0]


def test_file_round_trip_keeps_every_variable_labelled(tmp_path):
    run = synthetic_run(1)
    result = wd.fragility(run, {"light": 0.01, "heavy": 0.03}, replicates=40, confidence=0.9, seed=3)
    assert result.sizes["replicate"] == 40
    assert {
        "confidence": 0.9,
        "replicates_seed": 3,
        "demand": "peak_storey_drift_ratio",
    }.items() <= result.attrs.items()
    assert "Baker" in result.attrs["fragility_method"]
    for name, variable in result.drop_vars(["damage_state", "source"]).variables.items():
        assert variable.attrs["long_name"], name
        assert variable.attrs["units"] in ("1", "g"), name
        if name != "replicate_median":
            assert (variable.attrs["units"] == "g") == ("9.80665" in variable.attrs.get("comment", "")), name
    assert result["fragility_median"].attrs["units"] == result["stripe"].attrs["units"] == "g"
    for name in ["fragility_median", "fragility_dispersion", "fragility_curve", "storey_fragility_median"]:
        lower, middle, upper = result[f"{name}_lower"], result[name], result[f"{name}_upper"]
        assert ((lower <= middle) & (middle <= upper)).all(), name
    distance = np.log(result["intensity"][1:] / result["fragility_median"]) / result["fragility_dispersion"]
    np.testing.assert_allclose(result["fragility_curve"][:, 1:], norm.cdf(distance.T), atol=1e-14)
    assert (result["fragility_curve"][:, 0] == 0).all()

    together = run.merge(result)
    together.to_netcdf(tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc") as read:
        assert read["im_level"].dims == ("sample",)
        xr.testing.assert_equal(read.load(), together)


def test_collapse_counts_as_exceeding_even_without_a_demand():
    run = synthetic_run(2)
    low = np.flatnonzero((run["im_level"] == 0.3).values)
    collapsed = with_status(with_status(run, low[:3], 1), low[3:7], 1, demand=0.001)
    limits = {"light": 0.02, "heavy": 5.0}  # no drift reaches the second: all that exceeds it collapsed
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = wd.fragility(collapsed, limits)
    (warning,) = caught  # one that lists them
    assert "'heavy' has no lognormal fit: not_increasing" in str(warning.message)
    assert "limit 0.02 of 'light', 5 of 'heavy' is not below 0.001" in str(warning.message)
    assert result["exceeding_samples"].sel(damage_state="heavy").values.tolist() == [7, 0, 0, 0, 0, 0]
    by_storey = result["storey_exceedance_fraction"].sel(damage_state="heavy", stripe=0.3)
    assert by_storey.values.tolist() == [7 / 300, 7 / 300]
    assert result["valid_samples"].values.tolist() == [300] * 6


def test_diverged_and_unstable_samples_are_kept_out():
    run = synthetic_run(3)
    out = np.arange(5, 1800, 100)  # 18 of 1800: exactly the 1 % that is allowed
    marked = with_status(with_status(with_status(run, out[:10], 2), out[10:14], 3), out[14:], 4)
    result = wd.fragility(marked, {"light": 0.02})
    assert result["excluded_samples"].item() == 18
    comment = "diverged: 10, unstable_step: 4, not_converged: 4, control_failed: 0"
    assert result["excluded_samples"].attrs["comment"] == comment
    # The rest alone give the same numbers.
    without = wd.fragility(run.isel(sample=np.setdiff1d(np.arange(1800), out)), {"light": 0.02})
    xr.testing.assert_identical(result.drop_vars("excluded_samples"), without.drop_vars("excluded_samples"))


def test_more_than_one_per_cent_kept_out_is_refused():
    run = synthetic_run(3)
    first = np.flatnonzero((run["motion_index"] == 7).values & (run["im_level"] == 2.0).values)
    second = np.flatnonzero((run["motion_index"] == 4).values & (run["im_level"] == 1.5).values)
    marked = with_status(with_status(run, first, 2), second[:9], 3)
    with pytest.raises(ValueError, match=r"19 of 1800 samples \(1.06 %\).*10 diverged, 9 unstable_step") as raised:
        wd.fragility(marked, {"light": 0.02})
    assert "motion_index 7 (10), 4 (9); and in im_level 2.0 (10), 1.5 (9) g" in str(raised.value)


def test_status_is_read_by_its_meanings():
    run = synthetic_run(4)
    flags = {"flag_values": np.int8([8, 4, 2, 1]), "flag_meanings": "ok unstable_step diverged collapsed"}
    renamed = run.assign(status=("sample", np.full(1800, 8, np.int8), flags))
    plain, other = (wd.fragility(one, {"light": 0.02}) for one in (run, renamed))
    xr.testing.assert_identical(plain, other)


def fit_by_hand(exceeds, level):
    """Return the logarithms of median and dispersion of the curve through samples, by a minimiser of scipy."""

    def cost(parameters):
        score = (np.log(level) - parameters[0]) / np.exp(parameters[1])
        return -np.sum(np.where(exceeds, norm.logcdf(score), norm.logsf(score)))

    return minimize(cost, [0.0, -1.0], method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-12}).x


@pytest.mark.parametrize("over", ["records and structures", "records"])
def test_intervals_equal_a_jackknife_by_hand(over):
    run = synthetic_run(6, records=7, structures=5, within=0.5)
    structure = np.tile(np.arange(5, dtype=np.int32), 42)  # the same five under every record
    run = run.assign_coords(structure=("sample", structure))
    result = wd.fragility(run, {"light": 0.02}, confidence=0.8, intervals_over=over)
    # Samples left out and fitted by hand, one record and one structure at a time.
    worst = run["peak_storey_drift_ratio"].values.max(axis=1)
    record, level = run["motion_index"].values, run["im_level"].values
    whole = fit_by_hand(worst > 0.02, level)
    centre, variance, freedom = whole.copy(), np.zeros(2), 6
    pieces = []
    for index, count in ((record, 7), (structure, 5)) if over != "records" else ((record, 7),):
        kept = [index != one for one in range(count)]
        left = np.array([fit_by_hand(worst[each] > 0.02, level[each]) for each in kept])
        centre += (count - 1) * (whole - left.mean(axis=0))
        pieces.append((count - 1) / count * ((left - left.mean(axis=0)) ** 2).sum(axis=0))
    variance = pieces[0]
    if over != "records":
        # Less the interaction: from the scores of the 35 pairs, whose derivatives are taken numerically.
        pairs, steps = np.empty((7, 5, 2)), 1e-4 * np.eye(2)

        def logarithms(parameters):
            z = (np.log(level) - parameters[0]) / np.exp(parameters[1])
            return np.where(worst > 0.02, norm.logcdf(z), norm.logsf(z))

        def scores(parameters):
            return np.stack([(logarithms(parameters + step) - logarithms(parameters - step)) / 2e-4 for step in steps])

        terms = scores(whole)
        information = -np.stack([(scores(whole + step) - scores(whole - step)).sum(axis=1) / 2e-4 for step in steps])
        for i, j in np.ndindex(7, 5):
            pairs[i, j] = np.linalg.solve(information, terms[:, (record == i) & (structure == j)].sum(axis=1))
        alone = pairs - pairs.mean(axis=0) - pairs.mean(axis=1)[:, None] + pairs.mean(axis=(0, 1))
        interaction = np.minimum(35 / 24 * (alone**2).sum(axis=(0, 1)), np.minimum(*pieces))
        own = pieces[1] - interaction
        variance = pieces[0] + own
        freedom = variance**2 / (pieces[0] ** 2 / 6 + own**2 / 4)
        split = [pieces[0] - interaction, own, interaction]
        found = [result[f"{name}_variance"][0, :3] for name in ("median", "dispersion")]
        np.testing.assert_allclose(np.transpose(found), split, rtol=1e-4)
    half = t.ppf(0.9, freedom) * np.sqrt(variance)
    for number, name in enumerate(("fragility_median", "fragility_dispersion")):
        bounds = [result[f"{name}_{side}"].item() for side in ("lower", "upper")]
        # A minimiser that sees values only finds the place to about the square root of double rounding.
        np.testing.assert_allclose(bounds, np.exp(centre + np.outer([-1, 1], half))[:, number], rtol=1e-5)
    at_median = result.interp(intensity=float(np.exp(whole[0])))
    assert at_median["fragility_curve_lower"].item() < 0.5 < at_median["fragility_curve_upper"].item()


def test_draws_have_the_spread_of_the_intervals():
    run = synthetic_run(6, records=40, structures=5)
    run = run.assign_coords(structure=("sample", np.tile(np.arange(5, dtype=np.int32), 240)))
    result = wd.fragility(run, {"light": 0.02, "heavy": 0.03}, replicates=20000)
    for name in ("median", "dispersion"):
        bounds = [result[f"fragility_{name}_{side}"] for side in ("lower", "upper")]
        found = result[f"replicate_{name}"].quantile([0.025, 0.975], dim="replicate")
        # Quantiles of 20,000 draws are known to 2 % of the half width (two standard errors).
        half = np.log(bounds[1] / bounds[0]).values / 2
        np.testing.assert_allclose(np.log(found), np.log(bounds), atol=0.04 * half.max())
    # The two medians rest on the same records.
    logarithms = np.log(result["replicate_median"].values)
    assert np.corrcoef(logarithms.T)[0, 1] > 0.8


def test_intervals_have_the_width_of_the_estimators_spread(measured):
    records, structures, between, within = 44, 10, 0.35, 0.2
    levels = np.array([0.3, 0.6, 0.9, 1.2, 1.5, 2.0])

    def log_width(run):
        result = wd.fragility(run, {"light": 0.02})
        return float(np.log(result["fragility_median_upper"] / result["fragility_median_lower"]).item())

    # One storey, so that capacity is lognormal with dispersion hypot(.35, .2); records shared over all levels.
    def drift(generator, shape):
        factor = between * generator.standard_normal((*shape, records, 1, 1))
        factor = factor + within * generator.standard_normal((*shape, records, levels.size, structures))
        return 0.02 * levels[:, None] * np.exp(factor)

    exceeding = (drift(np.random.default_rng(20), (1500,)) > 0.02).sum(axis=(1, 3))
    median, *_ = fit_stripes(levels, exceeding, records * structures)
    spread = np.log(median).std()

    record, level, _ = (g.ravel() for g in np.meshgrid(range(records), levels, range(structures), indexing="ij"))
    correlated, independent = [], []
    for seed in range(12):
        drifts = drift(np.random.default_rng(seed), ()).ravel()
        correlated.append(log_width(make_run(drifts, record, level)))
        independent.append(log_width(make_run(drifts, np.arange(record.size), level)))  # each sample its own record
    # Student's t of 43 degrees of freedom is 2.0167. A standard deviation from 44 records is known to 1/sqrt(88) =
    # 11 %, the mean of 12 to 3 %, and 1500 replications to 2 %: three times both.
    measured(
        "widths of 95 % intervals of medians over 44 records, less that of the estimator's spread",
        truth="standard deviation of 1,500 fits to fresh draws of records, times Student's t",
        value=abs(np.mean(correlated) / (2 * 2.0167 * spread) - 1),
        bound=0.11,
    )
    # Independent samples would claim an interval far too narrow.
    assert max(independent) < 0.6 * min(correlated)


def test_the_same_seed_gives_the_same_result_and_another_does_not():
    run, limits = synthetic_run(8), {"light": 0.01, "heavy": 0.03}
    first = wd.fragility(run, limits, seed=1)
    xr.testing.assert_identical(first, wd.fragility(run, limits, seed=1))
    # Neither the order of the samples nor the labels of the records matter beyond their order.
    shuffled = run.isel(sample=np.random.default_rng(0).permutation(1800))
    shuffled = shuffled.assign_coords(motion_index=shuffled["motion_index"] * 3)
    xr.testing.assert_identical(first, wd.fragility(shuffled, limits, seed=1))
    other = wd.fragility(run, limits, seed=2)
    assert (other["replicate_median"] != first["replicate_median"]).all()
    xr.testing.assert_identical(other["fragility_median_lower"], first["fragility_median_lower"])  # no draws


def test_estimators_by_name():
    run, limits = synthetic_run(8), {"light": 0.01, "heavy": 0.03}
    plain, logit, ordinal = (wd.fragility(run, limits, estimator=name) for name in ("lognormal", "logit", "ordinal"))
    # A logistic curve of the same median and standard deviation; the sandwich beside the jackknife over 30 records.
    np.testing.assert_allclose(logit["fragility_median"], plain["fragility_median"], rtol=0.03)
    assert logit.attrs["fragility_shape"] == "loglogistic"
    at = plain["intensity"][150].item()
    middle, scatter = logit["fragility_median"][0].item(), logit["fragility_dispersion"][0].item()
    expected = 1 / (1 + np.exp(-np.pi / np.sqrt(3) * np.log(at / middle) / scatter))
    assert logit["fragility_curve"][0, 150].item() == pytest.approx(expected, rel=1e-12)
    assert np.ptp(ordinal["fragility_dispersion"].values) == 0
    jackknife = plain["median_variance"].sel(source=["record", "structure", "record and structure"]).sum("source")
    np.testing.assert_allclose(plain["median_variance_by_sandwich"], jackknife, rtol=0.15)
    for curves in (logit, ordinal):
        assert (curves["fragility_curve_lower"] <= curves["fragility_curve_upper"]).all()


def test_separated_stripes_have_a_penalised_fit_that_says_so():
    levels = np.array([0.5, 1.0, 1.5, 2.0])
    run = make_run(np.tile([0.01, 0.01, 0.03, 0.03], 11), np.repeat(range(11), 4), np.tile(levels, 11))
    with pytest.warns(UserWarning, match=r"'light': its stripes are separated.*penalised.*between 1 and"):
        curves = wd.fragility(run, {"light": 0.02})
    assert FIT_MEANINGS_OF_ESTIMATORS[curves["fit_status"].item()] == "penalised"
    assert 1.0 < curves["fragility_median"].item() < 1.5
    # None of 11 records exceeds at 1 g: by Clopper and Pearson fewer than 28.5 % do, and at 1.5 g more than 71.5 %.
    assert [curves[f"fragility_median_{side}"].item() for side in ("lower", "upper")] == [1.0, 1.5]
    assert np.isnan(curves["fragility_dispersion_upper"]).all()
    assert np.isnan(curves["median_variance_by_sandwich"]).all()
    # With two records nothing is sure: 0 of 2 leaves up to 84 %.
    with pytest.warns(UserWarning, match="penalised"):
        few = wd.fragility(run.isel(sample=slice(0, 8)), {"light": 0.02})
    assert np.isnan(few["fragility_median_lower"]).all()


def test_one_record_has_no_interval():
    run = synthetic_run(10, records=1, structures=200)
    with pytest.warns(UserWarning, match="one record"):
        result = wd.fragility(run, {"light": 0.02})
    assert np.isfinite(result["fragility_median"]).all()
    for name in ["fragility_median", "fragility_dispersion", "fragility_curve", "storey_fragility_dispersion"]:
        assert result[f"{name}_lower"].isnull().all()
        assert result[f"{name}_upper"].isnull().all()
    assert result["replicate_median"].isnull().all()


def test_no_interval_where_one_record_alone_makes_the_fit():
    # One of 2 records alone exceeds: without it none does.
    levels = np.array([0.5, 1.0, 1.5])
    drift = np.full((2, 3), 0.01)
    drift[0] = [0.01, 0.03, 0.03]
    run = make_run(drift.ravel(), np.repeat(range(2), 3), np.tile(levels, 2))
    with pytest.warns(
        UserWarning, match=r"no interval.*'light' \(worst place\), 'light' \(storey 1\): if one of the records"
    ):
        result = wd.fragility(run, {"light": 0.02})
    assert np.isfinite(result["fragility_median"]).all()
    for name in ("fragility_median_upper", "fragility_curve_lower", "replicate_median"):
        assert result[name].isnull().all()


@pytest.mark.filterwarnings("error")
def test_a_storey_is_fitted_as_if_it_were_the_only_one():
    run, limits = synthetic_run(12), {"light": 0.01, "heavy": 0.025}
    both = wd.fragility(run, limits)
    alone = wd.fragility(run.isel(storey=[1]), limits)
    for name in ["exceedance_fraction", "fragility_median", "fragility_dispersion"]:
        for side in ["", "_lower", "_upper"]:
            expected = alone[f"{name}{side}"].values
            np.testing.assert_array_equal(both[f"storey_{name}{side}"].sel(storey=2), expected)
            assert (both[f"{name}{side}"] != expected).any(), name  # the worst storey is another


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.drop_vars("im_level"), "no 'im_level'.*exceedance_probability.*Stripes"),
        (lambda d: d.drop_vars("motion_index"), "no 'motion_index'"),
        (lambda d: d.drop_vars("status"), "no 'status'"),
        (lambda d: d.drop_vars("peak_storey_drift_ratio"), "no 'peak_storey_drift_ratio'"),
        (lambda d: d.expand_dims("event"), "dimensions.*select_event"),
        (lambda d: d.isel(sample=[]), "empty"),
        (lambda d: d.isel(sample=(d["im_level"] == 0.6).values), "stripe of 0.6 g.*at least 2"),
        (lambda d: d.assign_coords(im_level=d["im_level"] * np.nan), "'im_level' of sample 0 is nan"),
        (lambda d: d.assign_coords(im_level=d["im_level"] * 0), "'im_level' of sample 0 is 0.0"),
        (
            lambda d: d.assign(status=d["status"].astype(np.int8, keep_attrs=False)),
            "flag_meanings.*ok, collapsed and any of diverged, unstable_step",
        ),
        (lambda d: d.assign(status=d["status"].copy(data=np.full(1800, 9))), "'status' of sample 0 is 9"),
        (
            lambda d: d.assign(peak_storey_drift_ratio=d["peak_storey_drift_ratio"].where(d["motion_index"] != 3)),
            r"sample 180 \(motion_index 3 and im_level 0.3\) is 'ok'.*nan.*60 of 1800",
        ),
        (lambda d: d.assign(peak_storey_drift_ratio=-d["peak_storey_drift_ratio"]), "must not be negative"),
    ],
)
def test_bad_runs_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        wd.fragility(change(synthetic_run(13)), {"light": 0.02})


@pytest.mark.parametrize(
    ("limits", "options", "error", "message"),
    [
        ({}, {}, ValueError, "at least one damage state"),
        ([0.01, 0.02], {}, ValueError, "map"),
        ({"light": 0.02, "heavy": 0.01}, {}, ValueError, "'light' has 0.02 and 'heavy' after it 0.01"),
        ({"light": 0.02, "heavy": 0.02}, {}, ValueError, "increase"),
        ({"light": 0.0}, {}, ValueError, "'light' is 0.0"),
        ({"light": np.inf, "heavy": np.inf}, {}, ValueError, "increase"),
        ({"light": 0.02}, {"replicates": 0}, ValueError, "replicates must be a whole number of at least 1"),
        ({"light": 0.02}, {"intervals_over": "structures"}, ValueError, "records and structures"),
        ({"light": 0.02}, {"seed": -1}, ValueError, "seed must be a whole number of at least 0"),
        ({"light": 0.02}, {"confidence": 95}, ValueError, "confidence must be a number between 0 and 1"),
    ],
)
def test_bad_arguments_are_refused(limits, options, error, message):
    with pytest.raises(error, match=message):
        wd.fragility(synthetic_run(13), limits, **options)
