"""Moments, largest values, histograms and quantiles that are named before a run, against numpy on the full table."""

import math

import numpy as np
import pytest
from labels import check_labels
from reduced_runs import (
    CITY,
    MARKS,
    PGA,
    assert_made_of,
    scene_of,
    simulate,
    small_blocks,
    statistics_of,
    with_failures,
)
from test_simulate import MOTIONS

import warpdyn as wd
from warpdyn.campaigns.reductions.demand_histogram import quantiles_of
from warpdyn.campaigns.reductions.demand_moments import moments
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.tally import Block, Sums, Tally, find_states, searched
from warpdyn.campaigns.reductions.workers import Threads

pytestmark = MARKS
DRIFT, RESIDUAL, SHEAR = "peak_storey_drift_ratio", "residual_drift_ratio", "input_energy"
# Sums of a few dozen numbers in float64, by numpy pairwise and here with what rounding leaves out, differ by some 1e-15
# of the sum of squares, which is a few times the variance here.
MOST_DIFFERENCE = 1e-12
CELLS = np.array(["a", "b", "c", "b", "a", "a", "c"])
CASES = [
    ("crossed", (), SHEAR),
    ("crossed", ("motion", "stripe"), DRIFT),
    ("crossed", ("structure",), RESIDUAL),
    ("nested", ("motion",), DRIFT),
    ("one motion", ("cell", "motion"), "peak_floor_acceleration"),
    ("sequence", ("event", "motion"), DRIFT),
    ("city crossed", ("archetype", "stripe"), DRIFT),
    ("city crossed", ("building",), "hysteretic_energy"),
    ("city cloud", ("cell", "motion"), RESIDUAL),
]


def labels_of(design, over):
    return {"cell": np.resize(CELLS, CITY.buildings if design.startswith("city") else 21)} if "cell" in over else {}


def values_of(event, demand, chosen):
    """Return the largest absolute value of each chosen sample that stands, and its values by place."""
    of_place = event[demand].values[chosen][event["status"].values[chosen] == 0].astype(np.float64)
    if of_place.ndim == 1:
        return of_place, None
    return np.fmax.reduce(np.abs(of_place), axis=1), of_place


@pytest.mark.parametrize(("design", "over", "demand"), CASES, ids=[f"{d} {' '.join(o)} {v}" for d, o, v in CASES])
def test_moments_and_largest_are_those_of_the_full_table(design, over, demand, monkeypatch):
    scene, labels = scene_of(design), labels_of(design, over)
    run = simulate(scene)
    each_place = run[demand].ndim > (2 if "event" in run.dims else 1)
    how = {"over": over, "labels": labels, "each_place": each_place}
    asked = [wd.DemandMoments(demand, **how), wd.LargestDemand(demand, **how)]
    found = simulate(scene, statistics=asked)
    suffix = "_by_" + "_".join(over) if over else ""

    def agree(got, before, values):
        count = values.size
        mean, variance, largest = (got[f"{before}{demand}_{what}{suffix}"] for what in ("mean", "variance", "largest"))
        if count:
            np.testing.assert_allclose(mean, values.mean(), rtol=MOST_DIFFERENCE, atol=1e-15 * np.abs(values).max())
            assert largest == values.max()
        else:
            assert np.isnan([mean, variance, largest]).all()
        if count > 1:
            least = MOST_DIFFERENCE * values.mean() ** 2  # of the squares that are subtracted
            np.testing.assert_allclose(variance, values.var(ddof=1), rtol=MOST_DIFFERENCE, atol=least * 1e-3)
        else:
            assert np.isnan(variance)

    def check(got, event, chosen):
        worst, of_place = values_of(event, demand, chosen)
        agree(got, "", worst)
        assert got[f"standing_count{suffix}"] == worst.size
        assert got[f"collapsed_count{suffix}"] == np.count_nonzero(event["status"].values[chosen] == 1)
        if each_place:
            (dim,) = {"storey", "floor"} & set(found.dims)
            for place in range(of_place.shape[1]):
                row = of_place[:, place]
                agree(got.isel({dim: place}), f"{dim}_", row[~np.isnan(row)])

    assert_made_of(found, run, over, labels, check)
    check_labels(found)
    small_blocks(monkeypatch, 40)
    for threads in (1, 2):
        again = simulate(scene, statistics=asked, threads=threads)
        assert statistics_of(again).identical(statistics_of(found)), threads


@pytest.mark.parametrize(
    ("design", "over"), [("crossed", ("stripe",)), ("city one motion", ("archetype",)), ("cloud", ())]
)
def test_histograms_and_quantiles_are_those_of_the_full_table(design, over, monkeypatch):
    with_failures(monkeypatch, 0.01)
    scene, edges, probabilities = scene_of(design), np.linspace(0.0, 0.019, 39), (0.05, 0.5, 0.84)
    run = simulate(scene)
    asked = wd.DemandHistogram(DRIFT, edges, quantiles=probabilities, over=over)
    found = simulate(scene, statistics=asked)
    suffix = "_by_" + "_".join(over) if over else ""

    def check(got, event, chosen):
        status = event["status"].values[chosen]
        values = np.fmax.reduce(event[DRIFT].values[chosen].astype(np.float64), axis=1)
        values = np.where(status == 1, np.inf, values)[status <= 1]
        counts = got[f"{DRIFT}_histogram{suffix}"].values
        above = [np.count_nonzero(values > edge) for edge in edges]
        np.testing.assert_array_equal(counts[::-1].cumsum()[::-1][1:], above)
        assert counts.sum() == values.size
        for probability in probabilities:
            at = got.sel(quantile=probability)
            lower, upper = (float(at[f"{DRIFT}_quantile_{what}{suffix}"]) for what in ("lower", "upper"))
            truth = np.quantile(values, probability, method="inverted_cdf")
            assert lower < truth <= upper
            quantile = float(at[f"{DRIFT}_quantile{suffix}"])
            assert lower <= quantile <= upper if np.isfinite(upper) else np.isnan(quantile)

    assert_made_of(found, run, over, {}, check)
    check_labels(found)
    small_blocks(monkeypatch, 40)
    assert statistics_of(simulate(scene, statistics=asked, threads=2)).identical(statistics_of(found))


def test_quantiles_of_given_counts():
    lower, upper = np.array([0.0, 1.0, 2.0]), np.array([1.0, 2.0, np.inf])
    found, least, most = quantiles_of(np.array([[4, 4, 0], [0, 0, 3], [0, 0, 0]]), lower, upper, np.array([0.25, 0.75]))
    np.testing.assert_array_equal(found, [[0.5, 1.5], [np.nan] * 2, [np.nan] * 2])
    np.testing.assert_array_equal(least, [[0.0, 1.0], [2.0, 2.0], [np.nan] * 2])
    np.testing.assert_array_equal(most, [[1.0, 2.0], [np.inf] * 2, [np.nan] * 2])


class Recording(Threads):
    """Threads that launch nothing, and note the least lengths of their parts."""

    def __init__(self):
        super().__init__(4)
        self.least = []

    def run(self, kernel, first, last, arguments, least=1, most=0, together=1):
        self.least.append(least)


@pytest.mark.fast
@pytest.mark.parametrize("levels", [1, 5, 2**15 // 3, 2**15 // 3 + 1])
def test_a_thread_has_enough_samples_to_pay_for_its_launch(levels):
    # 2^15 samples, and at most one structure more.
    samples = 3 * levels
    population = Population(scene_of(wd.Stripes(MOTIONS, np.linspace(0.8, 3.2, levels), PGA)), 2)
    cells, workers = wd.DemandMoments("demand").cells(population), Recording()
    values = {"status": np.zeros(2 * samples, np.int8), "demand": np.ones((2 * samples, 1))}
    block, states = Block(np.arange(2), 0, values), workers.no_states((1, 2 * samples))
    Tally(cells, 1, 2).add(block, states, workers)
    Sums(cells).add(block, "demand", True, 0, workers)
    find_states(block, "demand", searched(np.array([[0.5]])), np.zeros(2, int), states, workers)
    of_counts, of_sums, _, of_states = workers.least
    workers.close()
    for least in (of_counts, of_sums, of_states):
        assert 2**15 <= least * samples <= 2**15 + samples


class Unwritten(Threads):
    """Threads whose memory is full of NaN until it is written, and is kept."""

    def __init__(self):
        super().__init__(1)
        self.given = []

    def empty(self, shape, dtype):
        self.given.append(np.full(shape, np.nan, dtype))
        return self.given[-1]


def test_sums_of_rows_use_all_of_their_memory():
    values = {"status": np.zeros(9, np.int8), "demand": np.arange(9.0).reshape(9, 1)}
    sums, workers = Sums(wd.DemandMoments("demand").cells(Population(scene_of("cloud"), 3))), Unwritten()
    sums.add(Block(np.arange(3), 0, values), "demand", True, 0, workers)
    workers.close()
    assert sums.totals.tolist() == [[36.0, 0.0, 204.0, 0.0, 8.0]]  # of 0 to 8, and of their squares
    (given,) = workers.given
    assert np.isfinite(given).all()


@pytest.mark.parametrize("scatter", [1.0, 1e-3, 1e-6])
def test_moments_of_many_samples_by_exact_sums(scatter, measured):
    # 150,000 samples of 50,000 structures, in blocks of two sizes and by 1 and 2 threads; the truth by math.fsum.
    scene, count = scene_of("cloud"), 50_000
    values = (1.0 + scatter * np.random.default_rng(1).standard_normal((3 * count, 1))).astype(np.float32)
    population = Population(scene, count)
    found = []
    for block, threads in ((count, 1), (1_777, 2)):
        sums, workers = Sums(wd.DemandMoments("demand").cells(population)), Threads(threads)
        for first in range(0, count, block):
            part = slice(3 * first, 3 * min(first + block, count))
            numbers = np.arange(first, min(first + block, count))
            rows = {"status": np.zeros(3 * numbers.size, np.int8), "demand": values[part]}
            sums.add(Block(numbers, 0, rows), "demand", True, -1, workers)
        workers.close()
        found.append(sums.totals)
    assert found[0].tobytes() == found[1].tobytes()
    mean, variance = (float(each[0]) for each in moments(np.array([3 * count]), found[0]))
    exact = values[:, 0].astype(np.float64).tolist()
    true_mean = math.fsum(exact) / len(exact)
    assert mean == pytest.approx(true_mean, rel=1e-15)
    # About a mean that is rounded by at most 1e-16, squares are off by 1e-32.
    true_variance = math.fsum((each - true_mean) ** 2 for each in exact) / (len(exact) - 1)
    measured(
        "variances of 150,000 samples that are reduced during a run",
        truth="math.fsum, which sums exactly",
        value=abs(variance / true_variance - 1),
        bound=1e-12,
    )
