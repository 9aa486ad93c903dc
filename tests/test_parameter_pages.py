"""The pages on sensitivity and calibration: their numbers agree with SciPy, an independent loop and scaling."""

import warnings
from itertools import pairwise

import numpy as np
import pytest
from pages import RunPage, run_page
from scipy.stats import spearmanr

pytestmark = pytest.mark.as_shipped  # the pages run for seconds
STEPS = 200  # Runge-Kutta steps between two points of the loop


def page_of(name: str) -> RunPage:
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)  # the page warns of nothing
        return run_page(name)


@pytest.fixture(scope="module")
def sensitivity() -> RunPage:
    return page_of("how_to/sensitivity.md")


@pytest.fixture(scope="module")
def calibration() -> RunPage:
    return page_of("how_to/calibration.md")


def bouc_wen(drift: np.ndarray, k: float, fy: float, ratio: float, n: float) -> np.ndarray:
    """Return the forces [N] of a Bouc-Wen spring with beta = gamma = 0.5, by the midpoint rule."""
    z, forces = 0.0, [0.0]
    for begin, end in pairwise(drift):
        du = (end - begin) / STEPS

        def rate(z: float, du: float = du) -> float:
            return (1.0 - abs(z) ** n * (0.5 + 0.5 * np.sign(du * z))) * k / fy

        for _ in range(STEPS):
            z += du * rate(z + 0.5 * du * rate(z))
        forces.append(ratio * k * end + (1.0 - ratio) * fy * z)
    return np.array(forces)


def test_parameters_of_the_loop_are_found(calibration: RunPage) -> None:
    found = calibration.variables
    truth = np.array(list(found["true"].values()))
    exact = bouc_wen(found["drift"], *truth)
    # The random errors are 4 kN; the forces themselves differ by 1e-4 of the yield force, 22 N (points 2.5 mm apart).
    errors = found["measured"] - exact
    drawn = np.random.default_rng(1).normal(0.0, 4e3, exact.size)
    np.testing.assert_allclose(errors, drawn, atol=30.0)
    deviation = found["fit"].x * found["start"] - truth
    assert np.all(np.abs(deviation) < 3.0 * np.sqrt(np.diag(found["covariance"])) * found["start"])
    # The error of the best set, and its place among all sets, from the independent loop.
    best = found["best"]
    computed = [
        np.sqrt(np.mean((bouc_wen(found["drift"], *row) - found["measured"]) ** 2)) for row in found["sets"][best]
    ]
    np.testing.assert_allclose(found["errors"][best], computed, rtol=2e-3)
    assert found["errors"].min() == found["errors"][best[0]]
    assert found["errors"].size == 20_000


def test_ranking_agrees_with_rank_correlations_and_scaling(sensitivity: RunPage) -> None:
    found = sensitivity.variables
    names, table = found["names"], found["table"]
    for level, ranked in found["ranked"].items():
        rows = table[table["level"] == level]
        correlations = {
            name: np.mean([spearmanr(each[name], each["drift"])[0] for _, each in rows.groupby("record")])
            for name in names
        }
        by_rank = sorted(names, key=lambda name: -abs(correlations[name]))
        by_exponent = [name for name in ranked.index if name != "record"]
        assert {*by_rank[:2]} == {*by_exponent[:2]} == {"mass", "stiffness"}
        for name in by_rank[:2]:
            assert np.sign(correlations[name]) == np.sign(ranked.loc[name, "exponent"])
        # The drift does not change if mass, stiffness and yield force have the same factor.
        assert abs(ranked.loc[["mass", "stiffness", "yield_force"], "exponent"].sum()) < 0.02
    # An elastic structure with a flat displacement spectrum has exponents of 0.5 and -0.5, with a flat acceleration
    # spectrum 1 and -1; yield force has none.
    elastic = found["ranked"][found["levels"][0]]["exponent"]
    assert 0.5 < elastic["mass"] < 1.1
    assert -1.1 < elastic["stiffness"] < -0.5
    assert abs(elastic["yield_force"]) < 0.05


def test_shares_of_variance_agree_with_a_regression_on_columns_of_records(sensitivity: RunPage) -> None:
    found = sensitivity.variables
    for level, ranked in found["ranked"].items():
        rows = found["table"][found["table"]["level"] == level]
        x, y = np.log(rows[found["names"]].values), np.log(rows["drift"].values)
        records = rows["record"].values[:, None] == np.unique(rows["record"].values)
        coefficients = np.linalg.lstsq(np.column_stack([x, records]), y, rcond=None)[0]
        np.testing.assert_allclose(ranked.loc[found["names"], "exponent"], coefficients[:4], rtol=1e-4, atol=1e-4)
        means = np.array([y[column].mean() for column in records.T])
        between = np.var(means[np.argmax(records, axis=1)]) / np.var(y)
        np.testing.assert_allclose(ranked.loc["record", "share of variance [%]"], 100 * between, rtol=1e-4)
