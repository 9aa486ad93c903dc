"""Sobol indices, tornado diagrams and correlation ratios agree with closed forms and an independent reference result.

The reference (indices and tornado of a building with three storeys) was computed by exact steps of the elastic building
in NumPy, for four scrambled Sobol sequences of 8,192 base samples each; its standard errors are below 0.0007.
"""

import warnings

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import norm, qmc

import warpdyn as wd
from warpdyn.answers.sensitivity.correlation_ratios import _ratios, _with_half_width
from warpdyn.answers.sensitivity.structure_outputs import StructureOutputs

# As given by the reference: input, first-order index, total index, drift ratio at the lower and the upper bound.
REFERENCE = {
    "mass": (0.3429, 0.4099, 0.00245353, 0.00487566),
    "stiffness (storey 1)": (0.3496, 0.3995, 0.00591459, 0.00282382),
    "stiffness (storey 2)": (0.1487, 0.1793, 0.00519088, 0.00314448),
    "stiffness (storey 3)": (0.005004, 0.007583, 0.00361862, 0.00334558),
    "damping_ratio": (0.06683, 0.09736, 0.0040052, 0.00302809),
}
NOMINAL, MEAN, DEVIATION = 0.0034474256, 0.00408904, 0.00152502
SCATTER = {
    "mass": wd.RandomFactor(wd.Uniform(0.85, 1.15)),
    "stiffness": wd.RandomFactor(wd.Uniform(0.75, 1.25), per="storey"),
    "damping_ratio": wd.RandomValue(wd.Uniform(0.02, 0.08)),
}
PGA = wd.PeakGroundAcceleration()
HOW = wd.Integration(method="rk4", step=0.005, dtype="float64")
NOISE = [
    wd.GroundMotion(row, 0.02, f"noise {place}")
    for place, row in enumerate(np.random.default_rng(1).normal(size=(6, 400)))
]
LEVELS = np.geomspace(0.2, 3.2, 13).tolist()  # g
LIMITS = {"slight": 0.003, "extensive": 0.008}


def building(**how) -> wd.ShearBuilding:
    masses, stiffnesses = [1.2e5, 1.2e5, 1.0e5], [1.6e8, 1.3e8, 1.0e8]
    return wd.ShearBuilding(masses, stiffnesses, 3.0, damping="rayleigh", damping_ratio=0.05, **how)


def sine(scatter: dict) -> wd.Scene:
    time = np.arange(0, 8.005, 0.01)
    motion = wd.GroundMotion(1.5 * np.sin(2 * np.pi * 2.0 * time), 0.01, "sine")
    return wd.Scene(building(), motion, scatter, recorders=("drift",), tail=0.0)


def striped(scatter: dict) -> wd.Scene:
    return wd.Scene(building(), wd.Stripes(NOISE, LEVELS, PGA), scatter, recorders=("drift",))


def test_sobol_indices_are_those_of_the_reference():
    found = wd.sobol_indices(sine(SCATTER), base_structures=2048, integration=HOW)
    assert found["input"].values.tolist() == list(REFERENCE)
    expected = np.array(list(REFERENCE.values()))
    # Six seeds of 2,048 base structures have standard deviations of up to 0.0016.
    np.testing.assert_allclose(found["first_order"], expected[:, 0], atol=0.005)
    np.testing.assert_allclose(found["total"], expected[:, 1], atol=0.005)
    assert float(found["output_mean"]) == pytest.approx(MEAN, rel=2e-3)
    assert float(found["output_deviation"]) == pytest.approx(DEVIATION, rel=5e-3)
    for name, column in (("first_order", 0), ("total", 1)):
        assert (found[f"{name}_lower"].values < expected[:, column]).all()
        assert (found[f"{name}_upper"].values > expected[:, column]).all()


def test_a_tornado_has_the_outputs_of_the_reference():
    found = wd.tornado(sine(SCATTER), quantiles=(0.0, 1.0), integration=HOW)
    expected = np.array(list(REFERENCE.values()))[:, 2:]
    np.testing.assert_allclose(found["output"], expected, rtol=2e-5)
    assert float(found["median_output"]) == pytest.approx(NOMINAL, rel=2e-5)
    np.testing.assert_allclose(found["ratio"], expected / NOMINAL, rtol=4e-5)
    np.testing.assert_allclose(found["swing"], np.abs(expected[:, 1] - expected[:, 0]), rtol=1e-3)
    assert np.isnan(found["ratio_lower"]).all()  # one motion has no variability


def test_correlation_ratios_of_a_run_are_first_order_indices_of_the_reference():
    run = wd.simulate(sine(SCATTER), structures=4096, seed=3, integration=HOW)
    found = wd.correlation_ratios(run)
    assert found["input"].values.tolist() == list(REFERENCE)
    expected = np.array(list(REFERENCE.values()))[:, 0]
    # Within classes of 1/31 of the structures, the mean output changes: this is 3 % of the ratio of a linear effect.
    np.testing.assert_allclose(found["correlation_ratio"], expected, atol=0.012)
    assert found.attrs["estimator"] == "eta squared"


@pytest.mark.fast
def test_correlation_ratios_of_the_ishigami_function_are_its_first_order_indices():
    x = np.random.default_rng(1).uniform(-np.pi, np.pi, (3, 60_000))
    y = np.sin(x[0]) + 7 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])
    np.testing.assert_allclose(_ratios(x, y[:, None])[:, 0], [0.313905191, 0.442411145, 0.0], atol=0.01)
    few = [_ratios(x[:, begin : begin + 100], y[begin : begin + 100, None])[2] for begin in range(0, 60_000, 100)]
    assert abs(np.mean(few)) < 4 * np.std(few) / np.sqrt(600)  # no bias of a parameter without effect


@pytest.mark.fast
def test_correlation_ratios_of_a_sobol_sequence_have_half_the_error_of_the_estimate_for_random_points():
    exact, errors = np.array([0.313905191, 0.442411145, 0.0]), {False: [], True: []}
    for seed in range(10):
        x = np.pi * (2 * qmc.Sobol(3, rng=np.random.default_rng(seed)).random(4096).T - 1)
        y = np.sin(x[0]) + 7 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])
        for is_even, found in errors.items():
            found.append(_ratios(x, y[:, None], is_even=is_even)[:, 0] - exact)
    worst = {is_even: np.abs(np.mean(found, axis=0)).max() for is_even, found in errors.items()}
    assert worst[True] < 0.006 < worst[False]


@pytest.mark.fast
@pytest.mark.meant_as_given("first_period", "collapse_drift_ratio", "strongest_motion", "peak_ground_acceleration")
def test_correlation_ratios_of_noise_have_no_bias_of_parameters_without_effect():
    """Random noise scatters demands independently of the Sobol sequence: eta squared would be 10 / 256 too large."""
    noise = wd.FilteredNoise(wd.WhiteNoise(0.01), duration=4.0, interval=0.02)
    scatter = {name: wd.RandomFactor(wd.Lognormal(1.0, 1e-3)) for name in ("mass", "stiffness", "damping_ratio")}
    building = wd.ShearBuilding(3e5, [2e8], 3.0, damping="rayleigh", damping_ratio=0.05)
    scene, found = wd.Scene(building, noise, scatter, recorders=("drift",)), []
    for seed in range(5):
        ratios = wd.correlation_ratios(wd.simulate(scene, structures=256, seed=seed))
        assert ratios.attrs["estimator"] == "epsilon squared"
        found.append(ratios["correlation_ratio"].values)
    # 11 classes: each ratio has a standard deviation of about sqrt(2 * 10) / 256 = 0.017, the mean of 15 of 0.0045.
    assert abs(np.mean(found)) < 0.018


@pytest.mark.fast
def test_structures_with_different_motions_are_known():
    def outputs(motion, level=(0, 0, 0, 0)):
        counts = 2, max(motion) + 1, max(level) + 1
        rows = (np.array(each) for each in ((0, 1, 0, 1), motion, level))
        return StructureOutputs("", np.zeros(1), {}, *rows, counts, np.zeros(counts[2]), np.zeros(4))

    assert outputs((0, 0, 1, 1)).have_equal_motions
    assert outputs((0, 1, 1, 0)).have_equal_motions
    assert not outputs((0, 1, 2, 3)).have_equal_motions
    assert not outputs((0, 0, 1, 0)).have_equal_motions
    assert not outputs((0, 0, 0, 0), (0, 0, 1, 0)).have_equal_motions


@pytest.mark.fast
def test_intervals_of_correlation_ratios_cover_the_exact_indices():
    exact, covered = np.array([0.313905191, 0.442411145, 0.0]), np.zeros(3)
    for seed in range(60):
        x = np.random.default_rng(seed).uniform(-np.pi, np.pi, (3, 512))
        y = np.sin(x[0]) + 7 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])
        centre, half = _with_half_width(x, y[:, None], 0.95)
        covered += np.abs(centre[:, 0] - exact) <= half[:, 0]
    # 52 of 60 is three standard deviations below 95 %.
    assert (covered >= 52).all(), covered


@pytest.mark.fast
@pytest.mark.parametrize(("inputs", "structures"), [(4, 64), (8, 128), (8, 512)])
def test_inputs_without_effect_have_small_correlation_ratios_for_points_of_a_sobol_sequence(inputs, structures):
    worst = []
    for seed in range(12):
        x = qmc.Sobol(inputs, rng=np.random.default_rng(seed)).random(structures).T
        outputs = norm.ppf(np.clip(x.T, 1e-9, 1 - 1e-9))  # each is one input alone
        ratios = _ratios(x, outputs)
        worst.append(ratios[~np.eye(inputs, dtype=bool)].max())
        assert np.diag(ratios).min() > 0.85
    assert max(worst) < 0.25, worst


def test_inputs_without_effect_have_small_correlation_ratios_or_the_run_is_refused():
    scatter = {
        "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.08)),
        "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 1e-4), per="storey"),
        "damping_ratio": wd.RandomValue(wd.Uniform(0.05, 0.05001)),
    }
    refused, ratios = [], []
    for seed in range(12):
        run = wd.simulate(sine(scatter), structures=64, seed=seed, integration=HOW)
        try:
            ratios.append(wd.correlation_ratios(run)["correlation_ratio"])
        except ValueError as error:
            refused.append(str(error))
    assert ratios
    assert refused  # points in 5 dimensions repeat a pattern between two inputs for some seeds
    for message in refused:
        assert "though the two were drawn independently" in message
        assert "give simulate(scene, structures=512)" in message
    assert min(float(each.sel(input="mass")) for each in ratios) > 0.85
    assert max(float(each.drop_sel(input="mass").max()) for each in ratios) < 0.25
    many = wd.correlation_ratios(wd.simulate(sine(scatter), structures=256, integration=HOW))["correlation_ratio"]
    assert float(many.drop_sel(input="mass").max()) < 0.1


@pytest.mark.fast
def test_correlated_parameters_have_overlapping_correlation_ratios():
    both = {
        "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.08)),
        "damping_ratio": wd.RandomValue(wd.Uniform(0.05, 0.05001)),
    }
    scene = wd.Scene(building(), sine({}).excitation, both, {("mass", "damping_ratio"): 0.9}, recorders=("drift",))
    found = wd.correlation_ratios(wd.simulate(scene, structures=128, integration=HOW))["correlation_ratio"]
    assert float(found.sel(input="damping_ratio")) > 0.5  # it has no effect, but the mass has


@pytest.mark.fast
def test_a_parameter_whose_bounds_both_increase_the_output_has_a_swing():
    # The sine has 2 Hz; so has the building, at half of the range of its stiffness: both bounds detune it.
    first = 1 / building().fundamental_period
    tuned = {"stiffness": wd.RandomFactor(wd.Uniform(0.6 * (2 / first) ** 2, 1.4 * (2 / first) ** 2))}
    found = wd.tornado(sine(tuned))
    low, high = found["output"].values[0]
    median = float(found["median_output"])
    assert median > max(low, high)
    assert float(found["swing"][0]) == pytest.approx(median - min(low, high), rel=1e-12)


@pytest.mark.fast
def test_quantiles_at_a_bound_that_a_distribution_lacks_are_refused_by_name():
    scatter = {"damping_ratio": SCATTER["damping_ratio"], "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    with pytest.raises(ValueError, match=r"distribution of 'mass', Lognormal.* has no lower bound.*give quantiles="):
        wd.tornado(sine(scatter), quantiles=(0.0, 1.0))
    with pytest.raises(ValueError, match=r"distribution of 'mass', Lognormal.* has no upper bound.*give quantiles="):
        wd.tornado(sine(scatter), quantiles=(0.05, 1.0))


@pytest.mark.fast
def test_an_input_without_effect_has_indices_and_bounds_of_0_without_raw_warnings():
    # The height has no effect on the drift in metres.
    scatter = {
        "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.2)),
        "height": wd.RandomFactor(wd.Lognormal(1.0, 0.1)),
    }
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = wd.sobol_indices(sine(scatter), demand="peak_storey_drift", base_structures=32)
    for name in ("first_order", "total"):
        for end in ("", "_lower", "_upper"):
            assert float(found[name + end].sel(input="height")) == 0.0
        assert np.isfinite(found[f"{name}_lower"].sel(input="mass"))
    assert found.attrs["interval_method"].startswith("BCa bootstrap")
    with pytest.raises(ValueError, match=r"base_structures must be .*32"):
        wd.sobol_indices(sine(scatter), base_structures=16)
    still = {"height": scatter["height"]}
    with pytest.raises(ValueError, match=r"the output at 0.2 g is the same for all structures"):
        wd.sobol_indices(striped(still), demand="peak_storey_drift", base_structures=32)


@pytest.mark.fast
def test_a_correlated_parameter_is_one_input_of_all_storeys():
    own = wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="storey", storey_correlation=0.5)
    scene = sine({"stiffness": own, "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.1), only=(1, 2))})
    found = wd.sobol_indices(scene, base_structures=64, integration=HOW)
    assert found["input"].values.tolist() == ["stiffness", "mass"]
    assert found.attrs["structures"] == 64 * 4
    swings = wd.tornado(scene, quantiles=(0.5, 0.975), integration=HOW)
    stiffer = wd.ShearBuilding(
        building().parameters["mass"],
        building().parameters["stiffness"] * np.exp(0.2 * norm.ppf(0.975)),
        3.0,
        damping="rayleigh",
        damping_ratio=0.05,
    )
    drift = wd.simulate(wd.Scene(stiffer, sine({}).excitation, recorders=("drift",), tail=0.0), integration=HOW)
    expected = float(drift["peak_storey_drift_ratio"].max())
    assert float(swings["output"].sel(input="stiffness", bound="high")) == pytest.approx(expected, rel=1e-12)
    assert float(swings["ratio"].sel(input="stiffness", bound="low")) == 1.0


def fitted_median(exceeding: np.ndarray) -> float:
    """Return the median of a lognormal curve of largest binomial likelihood, by SciPy's minimiser."""

    def loss(parameters: np.ndarray) -> float:
        share = np.clip(norm.cdf((np.log(LEVELS) - parameters[0]) / np.exp(parameters[1])), 1e-300, 1 - 1e-16)
        return -float((exceeding * np.log(share) + (len(NOISE) - exceeding) * np.log1p(-share)).sum())

    found = minimize(loss, [0.0, -0.5], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12, "maxiter": 4000})
    return float(np.exp(found.x[0]))


def test_swings_of_fragility_medians_are_those_of_fits_by_scipy_with_a_jackknife_over_motions():
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.3)), "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    with wd.meant_as_given("scale_factor"):
        found = wd.tornado(striped(scatter), limits=LIMITS, quantiles=(0.1, 0.9), integration=HOW)
    factors = np.exp(0.3 * norm.ppf([0.5, 0.1, 0.9]))
    run = wd.simulate(striped({"stiffness": wd.GivenFactors(factors)}), integration=HOW)
    drift = run["peak_storey_drift_ratio"].max("storey").values.reshape(3, -1)
    level = np.searchsorted(LEVELS, run["im_level"].values.reshape(3, -1)[0])
    medians = np.array(
        [
            [fitted_median(np.bincount(level[row > limit], minlength=len(LEVELS))) for limit in LIMITS.values()]
            for row in drift
        ]
    )
    np.testing.assert_allclose(found["median_output"], medians[0], rtol=1e-5)
    np.testing.assert_allclose(found["output"].sel(input="stiffness"), medians[1:], rtol=1e-5)
    lower, upper = found["ratio_lower"], found["ratio_upper"]
    known = np.isfinite(lower.values)
    assert known.sum() > known.size / 2
    assert (lower.values[known] <= found["ratio"].values[known]).all()
    assert (upper.values[known] >= found["ratio"].values[known]).all()


def test_intervals_of_a_tornado_are_those_of_a_jackknife_of_the_mean_drifts():
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.3))}
    scene = wd.Scene(building(), wd.Cloud(NOISE), scatter, recorders=("drift",))
    found = wd.tornado(scene, quantiles=(0.1, 0.9), confidence=0.9, integration=HOW)
    given = {"stiffness": wd.GivenFactors(np.exp(0.3 * norm.ppf([0.5, 0.1])))}
    run = wd.simulate(wd.Scene(building(), wd.Cloud(NOISE), given, recorders=("drift",)), integration=HOW)
    drift = run["peak_storey_drift_ratio"].max("storey").values.reshape(2, 6)
    ratio = drift[1].mean() / drift[0].mean()
    left = [np.log(np.delete(drift[1], each).mean() / np.delete(drift[0], each).mean()) for each in range(6)]
    half = 2.015048 * np.sqrt(5 / 6 * ((left - np.mean(left)) ** 2).sum())  # Student's t of 5 degrees of freedom
    low = found.sel(bound="low", input="stiffness")
    assert float(low["ratio"]) == pytest.approx(ratio, rel=1e-10)
    assert float(low["ratio_lower"]) == pytest.approx(ratio * np.exp(-half), rel=1e-6)
    assert float(low["ratio_upper"]) == pytest.approx(ratio * np.exp(half), rel=1e-6)


def test_indices_of_each_stripe_and_each_state_have_their_dimension():
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.3)), "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.1))}
    found = wd.sobol_indices(striped(scatter), base_structures=32, integration=HOW)
    assert found["total"].dims == ("input", "stripe")
    assert found["stripe"].values.tolist() == LEVELS
    # Drifts of an elastic building are proportional to the level, so that all stripes have the same indices.
    np.testing.assert_allclose(found["total"], np.repeat(found["total"].values[:, :1], len(LEVELS), axis=1), rtol=1e-9)
    run = wd.simulate(striped(scatter), structures=64, integration=HOW)
    of_medians = wd.correlation_ratios(run, limits=LIMITS)
    assert of_medians["correlation_ratio"].dims == ("input", "damage_state")


@pytest.mark.fast
def test_invalid_scenes_and_arguments_are_refused_before_they_run():
    factor = wd.RandomFactor(wd.Lognormal(1.0, 0.2))
    with pytest.raises(ValueError, match=r"base_structures must be a power of 2.*give 64 or 128"):
        wd.sobol_indices(sine(SCATTER), base_structures=100)
    with pytest.raises(ValueError, match="no random parameter"):
        wd.sobol_indices(sine({}))
    with pytest.raises(ValueError, match="lists given values"):
        wd.tornado(sine({"mass": wd.GivenFactors([1.0, 2.0])}))
    correlated = wd.Scene(building(), NOISE[0], {"mass": factor, "stiffness": factor}, {("mass", "stiffness"): 0.5})
    with pytest.raises(ValueError, match=r"mass and stiffness are correlated.*correlation_ratios\(\)"):
        wd.sobol_indices(correlated)
    with pytest.raises(ValueError, match="quantiles must be a low and a high probability"):
        wd.tornado(sine(SCATTER), quantiles=(0.9, 0.1))
    with pytest.raises(TypeError, match="under OneMotionPerStructure"):
        wd.tornado(wd.Scene(building(), wd.OneMotionPerStructure(NOISE), {"mass": factor}))
    with pytest.raises(ValueError, match="remove structures_per_motion="):
        wd.tornado(wd.Scene(building(), wd.Stripes(NOISE, LEVELS, PGA, structures_per_motion=2), {"mass": factor}))
    with pytest.raises(TypeError, match="takes a Scene"):
        wd.sobol_indices(building())


@pytest.mark.fast
def test_runs_without_an_output_per_structure_are_refused():
    factor = {"mass": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    scene = wd.Scene(building(), NOISE[0], factor, recorders=("drift",))
    few = wd.simulate(scene, structures=8)
    with pytest.raises(ValueError, match="at least 32 structures, got 8"):
        wd.correlation_ratios(few)
    with pytest.raises(ValueError, match="need Stripes with at least 2 levels"):
        wd.correlation_ratios(few, limits=LIMITS)
    with pytest.raises(ValueError, match="do not give keep_inputs=False"):
        wd.correlation_ratios(wd.simulate(scene, structures=32, keep_inputs=False))
    alone = wd.simulate(wd.Scene(building(), NOISE[0], {"mass": wd.GivenFactors(np.ones(32))}, recorders=("drift",)))
    with pytest.raises(ValueError, match="has no random parameters"):
        wd.correlation_ratios(alone)
    collapsing = wd.Scene(building(), NOISE[0], factor, recorders=("drift",), collapse_drift_ratio=1e-4)
    with wd.meant_as_given("collapse_drift_ratio"), pytest.raises(ValueError, match=r"samples collapsed.*give limits="):
        wd.tornado(collapsing)
    with (
        wd.meant_as_given("drift_limit"),
        pytest.raises(ValueError, match=r"structures have no output.*no_exceedance.*add levels"),
    ):
        wd.tornado(striped(factor), limits={"far": 0.9})
    still = wd.Scene(building(), NOISE[0], {"height": wd.RandomFactor(wd.Lognormal(1.0, 0.1))}, recorders=("drift",))
    with pytest.raises(ValueError, match="the output is the same for all structures"):
        wd.sobol_indices(still, demand="peak_storey_drift", base_structures=32)
