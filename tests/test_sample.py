"""Scatter: what is drawn has the distributions and correlations asked for, and depends on the seed alone.

Statistical tolerances are five standard errors of the estimate, so that a correct sampler would fail one seed in two
million; the seeds are fixed.
"""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import stats
from scipy.stats import qmc

import warpdyn as wd
from warpdyn.campaigns.integration.sampler import Sampler
from warpdyn.foundations.core import random_numbers as philox
from warpdyn.foundations.core.random_numbers import Purpose
from warpdyn.model.scene.correlation import check_correlation, correlation_factor
from warpdyn.model.scene.scatter import SAMPLING

pytestmark = pytest.mark.fast

STOREYS = 3
BUILDING = wd.ShearBuilding(
    mass=[3e3, 2e3, 1e3],
    stiffness=4e5,
    height=3.0,
    law="bilinear",
    yield_force=2e3,
    hardening_ratio=0.05,
    damping="rayleigh",
    damping_ratio=0.05,
)
N = 40_000


def drawn(scatter, structures=N, seed=1, sampling="monte_carlo", correlation=None, structure=BUILDING):
    return Sampler(structure, scatter, correlation or {}, sampling, structures, seed).draw(np.arange(structures))


# Each distribution beside scipy's of the same meaning.
PAIRS = {
    "normal": (wd.Normal(1.2, 0.1), stats.norm(1.2, 0.1)),
    "lognormal": (wd.Lognormal(1.1, 0.4), stats.lognorm(0.4, scale=1.1)),
    # By its mean and cov: sigma^2 = ln(1 + cov^2), the median is the mean over sqrt(1 + cov^2).
    "from_mean": (wd.Lognormal.from_mean(2.0, 0.5), stats.lognorm(np.sqrt(np.log(1.25)), scale=2 / np.sqrt(1.25))),
    "uniform": (wd.Uniform(0.5, 2.0), stats.uniform(0.5, 1.5)),
}


@pytest.mark.parametrize("name", PAIRS)
def test_distributions_are_scipys(name):
    ours, theirs = PAIRS[name]
    probability = np.array([1e-9, 0.02, 0.3, 0.5, 0.9, 1 - 1e-9])
    # Both evaluate the same closed form; 1e-7 is what 1 - 1e-9 keeps of its last digits.
    np.testing.assert_allclose(
        ours.from_standard_normal(stats.norm.ppf(probability)), theirs.ppf(probability), rtol=1e-7
    )


@pytest.mark.parametrize("sampling", SAMPLING)
@pytest.mark.parametrize("name", PAIRS)
def test_draws_follow_their_distribution(name, sampling):
    ours, theirs = PAIRS[name]
    with np.errstate(all="raise"):
        values = drawn({"yield_force": wd.RandomValue(ours)}, sampling=sampling)["yield_force"][:, 0]
    # Kolmogorov-Smirnov: sqrt(N) D passes 2.7 with probability 1e-6; the other samplings are closer than random.
    assert np.sqrt(N) * stats.kstest(values, theirs.cdf).statistic < 2.7
    assert abs(values.mean() - theirs.mean()) < 5 * theirs.std() / np.sqrt(N)
    kurtosis = float(theirs.stats("k")) + 3
    assert abs(values.var() / theirs.var() - 1) < 5 * np.sqrt((kurtosis - 1) / N)


def test_mean_and_cov_are_those_of_the_draws():
    values = drawn({"yield_force": wd.RandomValue(wd.Lognormal.from_mean(900.0, 0.3))})["yield_force"][:, 0]
    assert values.mean() == pytest.approx(900.0, abs=5 * 270 / np.sqrt(N))
    assert values.std() / values.mean() == pytest.approx(0.3, rel=5 / np.sqrt(N) * 1.2)  # 1.2: the lognormal's tail


def test_factor_multiplies_and_value_replaces():
    result = drawn(
        {
            "mass": wd.RandomFactor(wd.Uniform(0.9, 1.1)),
            "yield_force": wd.RandomValue(wd.Uniform(500, 600)),
            "height": wd.GivenValues(np.full(N, 3.5)),
        }
    )
    factor = result["mass"] / [3e3, 2e3, 1e3]
    # One draw for the building: the same factor at every storey.
    np.testing.assert_allclose(factor, factor[:, :1] * np.ones(3), rtol=1e-15)
    assert factor.min() >= 0.9
    assert factor.max() <= 1.1
    assert factor.std() > 0.05
    assert np.all(result["yield_force"] == result["yield_force"][:, :1])
    assert result["yield_force"].min() >= 500
    assert result["yield_force"].max() <= 600
    assert result["height"].shape == (N, STOREYS)
    assert np.all(result["height"] == 3.5)
    assert set(result) == {"mass", "yield_force", "height"}  # what is not scattered is not drawn
    ratio = drawn({"damping_ratio": wd.RandomFactor(wd.Uniform(0.5, 1.5))})["damping_ratio"]
    assert ratio.shape == (N,)  # one value a building
    assert 0.025 <= ratio.min() < ratio.max() <= 0.075


def test_zero_dispersion_gives_the_nominal_value():
    result = drawn(
        {"mass": wd.RandomFactor(wd.Lognormal(1, 0)), "stiffness": wd.RandomFactor(wd.Normal(1, 0), per="storey")},
        structures=3,
    )
    np.testing.assert_array_equal(result["mass"], [[3e3, 2e3, 1e3]] * 3)
    np.testing.assert_array_equal(result["stiffness"], np.full((3, 3), 4e5))


def assert_correlation(x, y, expected):
    # Fisher: atanh(r) has standard error 1 / sqrt(N - 3).
    found = np.corrcoef(x, y)[0, 1]
    assert abs(np.arctanh(found) - np.arctanh(expected)) < 5 / np.sqrt(N - 3)


def test_correlation_between_storeys():
    for asked in (0.0, 0.4):
        spread = wd.RandomFactor(wd.Lognormal(1, 0.3), per="storey", storey_correlation=asked)
        logs = np.log(drawn({"stiffness": spread})["stiffness"])
        for i, j in ((0, 1), (0, 2), (1, 2)):
            assert_correlation(logs[:, i], logs[:, j], asked)
        np.testing.assert_allclose(logs.std(axis=0), 0.3, rtol=5 / np.sqrt(2 * N))
    common = drawn({"stiffness": wd.RandomFactor(wd.Lognormal(1, 0.3), per="storey", storey_correlation=1.0)})[
        "stiffness"
    ]
    np.testing.assert_allclose(
        common, common[:, :1] * np.ones(3), rtol=1e-7
    )  # root of the rounding at a full correlation


def test_correlation_between_parameters():
    scatter = {
        "mass": wd.RandomFactor(wd.Normal(1, 0.1)),
        "stiffness": wd.RandomFactor(wd.Lognormal(1, 0.2), per="storey", storey_correlation=0.81),
        "yield_force": wd.RandomFactor(wd.Lognormal(1, 0.3), per="storey", storey_correlation=0.49),
        "damping_ratio": wd.RandomFactor(wd.Lognormal(1, 0.4)),
    }
    asked = {("stiffness", "yield_force"): 0.6, ("mass", "damping_ratio"): -0.7, ("damping_ratio", "stiffness"): 0.3}
    result = drawn(scatter, correlation=asked)
    stiffness, strength, damping = (np.log(result[n]) for n in ("stiffness", "yield_force", "damping_ratio"))
    assert_correlation(result["mass"][:, 0], damping, -0.7)
    for i in range(STOREYS):
        assert_correlation(stiffness[:, i], strength[:, i], 0.6)
        # Drawn once for the building, a parameter is as close to every storey.
        assert_correlation(damping, stiffness[:, i], 0.3)
        assert_correlation(damping, strength[:, i], 0.0)
    # At different storeys: times the geometric mean of the storey correlations, sqrt(0.81 x 0.49).
    assert_correlation(stiffness[:, 0], strength[:, 2], 0.6 * 0.63)


@pytest.mark.parametrize("sign", [-1, 1])
def test_full_correlation(sign):
    scatter = {name: wd.RandomFactor(wd.Lognormal(1, 0.2)) for name in ("stiffness", "yield_force")}
    result = drawn(scatter, correlation={("stiffness", "yield_force"): sign})
    first, second = (
        np.log(result[name][:, 0] / nominal) for name, nominal in (("stiffness", 4e5), ("yield_force", 2e3))
    )
    np.testing.assert_allclose(first, sign * second, atol=1e-7)  # root of the rounding of a singular matrix


@given(
    correlation=st.floats(-1, 1),
    of_stiffness=st.floats(0, 1),
    of_strength=st.floats(0, 1),
    per=st.lists(st.sampled_from(["building", "storey"]), min_size=2, max_size=2),
)
@settings(max_examples=60)
def test_factor_of_any_correlation_matrix(correlation, of_stiffness, of_strength, per):
    scatter = {
        name: wd.RandomFactor(wd.Normal(1, 0.1), per=p, storey_correlation=rho if p == "storey" else 0.0)
        for name, p, rho in zip(("stiffness", "yield_force"), per, (of_stiffness, of_strength), strict=True)
    }
    pair = {("stiffness", "yield_force"): correlation}
    # Independent of the engine: the matrix as its definition says, whose least eigenvalue decides whether it exists.
    blocks = [STOREYS if p == "storey" else 1 for p in per]
    rho = [of_stiffness, of_strength]
    own = [np.full((n, n), r) + (1 - r) * np.eye(n) for n, r in zip(blocks, rho, strict=True)]
    both = per == ["storey", "storey"]
    across = np.full(blocks, correlation * (np.sqrt(rho[0] * rho[1]) if both else 1.0))
    if both:
        np.fill_diagonal(across, correlation)
    matrix = np.block([[own[0], across], [across.T, own[1]]])
    least = np.linalg.eigvalsh(matrix)[0]
    if least < -1e-9:
        with pytest.raises(ValueError, match="contradict each other"):
            check_correlation(BUILDING, scatter, pair)
    elif least > -1e-11:
        _, factor = correlation_factor(BUILDING, scatter, pair)
        assert np.all(np.triu(factor, 1) == 0)
        np.testing.assert_allclose(factor @ factor.T, matrix, atol=1e-9)


def test_latin_hypercube_has_one_sample_a_stratum():
    count = 500
    values = drawn(
        {"mass": wd.RandomValue(wd.Uniform(1, 2)), "stiffness": wd.RandomFactor(wd.Uniform(1, 3), per="storey")},
        structures=count,
        sampling="latin_hypercube",
    )
    for column in (values["mass"][:, 0] - 1, *(values["stiffness"] / 4e5 - 1).T / 2):
        assert sorted((column * count).astype(int)) == list(range(count))


def test_sobol_fills_every_elementary_box():
    # A (0, m, 2) net in base 2: 64 points in two dimensions put one in each box of 1/64, whatever its shape.
    values = drawn(
        {"mass": wd.RandomValue(wd.Uniform(1, 2)), "yield_force": wd.RandomValue(wd.Uniform(1, 2))},
        structures=64,
        sampling="sobol",
    )
    x, y = values["mass"][:, 0] - 1, values["yield_force"][:, 0] - 1
    for split in range(7):
        boxes = (x * 2**split).astype(int) * 2 ** (6 - split) + (y * 2 ** (6 - split)).astype(int)
        assert sorted(boxes) == list(range(64))


SCATTER = {
    "mass": wd.RandomFactor(wd.Normal(1, 0.1)),
    "stiffness": wd.RandomFactor(wd.Lognormal(1, 0.2), per="storey", storey_correlation=0.3),
    "damping_ratio": wd.RandomValue(wd.Uniform(0.01, 0.1)),
}


@given(few=st.integers(1, 70), more=st.integers(0, 200), seed=st.integers(0, 2**64), sampling=st.sampled_from(SAMPLING))
@settings(max_examples=60)
def test_samples_depend_on_seed_and_index_alone(few, more, seed, sampling):
    pair = {("stiffness", "mass"): 0.2}
    if sampling == "latin_hypercube":
        more = 0  # its strata depend on their number; the same number gives the same samples
    first, longer = (drawn(SCATTER, n, seed, sampling, pair) for n in (few, few + more))
    for name, values in first.items():
        assert values.tobytes() == longer[name][:few].tobytes()
    other = drawn(SCATTER, few, seed + 1, sampling, pair)
    assert not np.array_equal(other["mass"], first["mass"])


@given(
    count=st.integers(1, 120),
    seed=st.integers(0, 2**64),
    sampling=st.sampled_from(SAMPLING),
    parts=st.lists(st.sets(st.integers(0, 119), min_size=1), min_size=1, max_size=4),
)
@settings(max_examples=60)
def test_any_structures_can_be_drawn_in_any_order(count, seed, sampling, parts):
    sampler = Sampler(BUILDING, SCATTER, {("stiffness", "mass"): 0.2}, sampling, count, seed)
    whole = drawn(SCATTER, count, seed, sampling, {("stiffness", "mass"): 0.2})
    for part in parts:
        chosen = np.array(sorted({index % count for index in part}))
        for name, values in sampler.draw(chosen).items():
            assert values.tobytes() == whole[name][chosen].tobytes()


@pytest.mark.parametrize("variables", [1, 2, 5])
def test_monte_carlo_numbers_are_those_looked_up(variables):
    """Pairs of numbers by seed, index and purpose, from the host's Philox, which is held to its published answers."""
    rows, names = np.array([0, 1, 17, 2**20]), ["mass", "stiffness", "yield_force", "height", "damping_ratio"]
    scatter = {name: wd.RandomValue(wd.Normal(0, 1)) for name in names[:variables]}
    sampler = Sampler(BUILDING, scatter, {}, "monte_carlo", 2**21, 7)
    normals = sampler._normals(rows)
    pairs = philox.normals(7, rows[:, None], Purpose.STRUCTURE, np.arange((variables + 1) // 2))
    # Two inverses of the normal distribution, each within a few units in its last place.
    np.testing.assert_allclose(normals.T, pairs.reshape(rows.size, -1)[:, :variables], rtol=2e-15)


def test_sobol_points_are_scipy_s():
    generator = np.random.default_rng([7, Purpose.POINTS])
    points = qmc.Sobol(1, rng=generator).random_base2(6)[:, 0]
    scatter = {"mass": wd.RandomValue(wd.Uniform(1, 2))}
    values = drawn(scatter, structures=50, seed=7, sampling="sobol")["mass"][:, 0] - 1
    np.testing.assert_allclose(values, points[:50], atol=1e-15)  # to the normal value and back


def test_matrices_are_scaled_whole():
    system = wd.LinearSystem([2.0, 1.0], np.zeros((2, 2)), [[300.0, -100.0], [-100.0, 100.0]])
    result = drawn({"stiffness": wd.RandomFactor(wd.Uniform(0.5, 1.5))}, structures=50, structure=system)["stiffness"]
    assert result.shape == (50,)  # one factor a structure, also where the matrix it scales is zero
    assert 0.5 <= result.min() < result.max() <= 1.5
    scatter = {name: wd.RandomFactor(wd.Lognormal(1, 0.3)) for name in ("mass", "damping", "stiffness")}
    shake = wd.FreeVibration(2.0, velocity=0.1)
    run = wd.simulate(wd.Scene(system, shake, scatter=scatter), structures=2, step=0.001, dtype="float64")
    for sample in range(2):
        of_mass, of_stiffness = (float(run[f"{name}_factor"][sample]) for name in ("mass", "stiffness"))
        scaled = wd.LinearSystem(
            np.diag([2.0, 1.0]) * of_mass, np.zeros((2, 2)), system.parameters["stiffness"] * of_stiffness
        )
        alone = wd.simulate(wd.Scene(scaled, shake), step=0.001, dtype="float64")
        np.testing.assert_allclose(run["peak_displacement"][sample], alone["peak_displacement"][0], rtol=1e-12)
        np.testing.assert_allclose(run["input_energy"][sample], alone["input_energy"][0], atol=1e-15)
        np.testing.assert_allclose(run["energy_balance_error"][sample], alone["energy_balance_error"][0], atol=1e-13)


def test_a_drawn_structure_runs_as_the_structure_of_its_values():
    wave = wd.GroundMotion(4 * np.sin(np.arange(80) * 0.25), 0.02)
    scatter = {
        "mass": wd.RandomFactor(wd.Lognormal(1, 0.2)),
        "yield_force": wd.RandomFactor(wd.Lognormal(1, 0.3), per="storey"),
    }
    run = wd.simulate(wd.Scene(BUILDING, wave, scatter=scatter, tail=1.0), structures=3, dtype="float64", step=0.004)
    for sample in range(3):
        of_sample = run.isel(sample=sample)
        values = {name: of_sample[name].values for name in scatter}
        structure = wd.ShearBuilding(**(dict(BUILDING.parameters) | values), law="bilinear", damping="rayleigh")
        alone = wd.simulate(wd.Scene(structure, wave, tail=1.0), dtype="float64", step=0.004).isel(sample=0)
        for name in ("peak_storey_drift", "peak_floor_acceleration", "hysteretic_energy", "input_energy"):
            # Frequencies of one structure and of many are solved in another order: roundings, grown over 700 steps.
            np.testing.assert_allclose(of_sample[name], alone[name], rtol=1e-9, err_msg=name)
