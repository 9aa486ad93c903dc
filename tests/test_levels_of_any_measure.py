"""Stripes of measures that are no acceleration, from the scene to capacities, curves, figures and files."""

from __future__ import annotations

import functools
import re
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import cumulative_simpson, trapezoid
from scipy.signal import StateSpace, lsim

import warpdyn as wd

G = 9.80665
MASS, STIFFNESS, HEIGHT, DAMPING_RATIO = 1e5, 4e6, 3.0, 0.05
OSCILLATOR = wd.ShearBuilding(
    MASS, STIFFNESS, HEIGHT, law="elastic", damping="stiffness_proportional", damping_ratio=DAMPING_RATIO
)
LIMITS = {"slight": 0.005, "complete": 0.02}
STEP = 0.02
TIME = STEP * np.arange(400)


def motion(number: int) -> wd.GroundMotion:
    """Return a motion of its own frequencies, smooth enough for a fine grid to have its integrals."""
    random = np.random.default_rng(number)
    waves = sum(
        random.uniform(0.2, 0.6) * np.sin(2 * np.pi * random.uniform(0.3, 3.0) * TIME + random.uniform(0, 6))
        for _ in range(12)
    )
    return wd.GroundMotion(waves * np.sin(np.pi * TIME / TIME[-1]) ** 2, STEP, f"motion {number}")


MOTIONS = [motion(number) for number in range(8)]
FINE = STEP / 50 * np.arange(50 * (TIME.size - 1) + 1)


def fine(of: wd.GroundMotion) -> np.ndarray:
    return np.interp(FINE, TIME, of.acceleration)


def velocity(of: wd.GroundMotion) -> np.ndarray:
    return cumulative_simpson(fine(of), x=FINE, initial=0)


# Each measure by scipy on a grid of 1/50 of the step, with its unit and the power of the scale that it goes with.
MEASURES = {
    "PGV": (wd.PeakGroundVelocity(), lambda of: np.abs(velocity(of)).max(), "m s-1", 1),
    "PGD": (
        wd.PeakGroundDisplacement(),
        lambda of: np.abs(cumulative_simpson(velocity(of), x=FINE, initial=0)).max(),
        "m",
        1,
    ),
    "Arias": (wd.AriasIntensity(), lambda of: np.pi / (2 * G) * trapezoid(fine(of) ** 2, FINE), "m s-1", 2),
    "CAV": (wd.CumulativeAbsoluteVelocity(), lambda of: trapezoid(np.abs(fine(of)), FINE), "m s-1", 1),
}


def peak_drift_ratio(of: wd.GroundMotion) -> float:
    """Return the oscillator's largest drift ratio under a motion as recorded, by scipy, exact between samples."""
    frequency = np.sqrt(STIFFNESS / MASS)
    matrix = [[0, 1], [-(frequency**2), -2 * DAMPING_RATIO * frequency]]
    system = StateSpace(matrix, [[0], [-1]], [[1, 0]], [[0]])
    longer = np.append(FINE, FINE[-1] + FINE[1:2000])  # free vibration
    acceleration = np.append(fine(of), np.zeros(1999))
    return float(np.abs(lsim(system, acceleration, longer)[1]).max() / HEIGHT)


@functools.cache
def peaks() -> np.ndarray:
    """Return the oscillator's largest drift ratio under each motion."""
    return np.array([peak_drift_ratio(each) for each in MOTIONS])


def expected_capacities(name: str) -> np.ndarray:
    """Return the level at which each limit is passed under each motion, shape [damage_state, motion]."""
    _, value, _, power = MEASURES[name]
    own = np.array([value(each) for each in MOTIONS])
    return np.array([own * (limit / peaks()) ** power for limit in LIMITS.values()])


def scene(name: str, levels) -> wd.Scene:
    return wd.Scene(OSCILLATOR, wd.Stripes(MOTIONS, levels, MEASURES[name][0]))


@pytest.fixture(scope="module", params=MEASURES)
def measured(request):
    """Return a measure's name, the levels of stripes and the run."""
    # Levels between capacities that stand apart, so that no count hangs on rounding or on the step.
    expected = np.sort(expected_capacities(request.param).ravel())
    apart = np.flatnonzero(expected[1:] > 1.05 * expected[:-1])
    levels = np.sqrt(expected[apart] * expected[apart + 1])
    return request.param, levels, wd.simulate(scene(request.param, levels), device="cpu", dtype="float64")


pytestmark = pytest.mark.meant_as_given("scale_factor_to_level")


def test_demands_and_fractions_are_those_of_the_scaled_motions(measured):
    name, levels, run = measured
    _, value, units, power = MEASURES[name]
    assert run["im_level"].attrs["units"] == units
    assert "comment" not in run["im_level"].attrs
    own = np.array([value(each) for each in MOTIONS])
    drift = peaks()[:, None] * (levels / own[:, None]) ** (1 / power)
    # The fine grids see a peak to (w h)^2 / 8, with waves up to 3 Hz and steps of .4 ms; the run has its own step.
    np.testing.assert_allclose(run["peak_storey_drift_ratio"].values.ravel(), drift.ravel(), rtol=2e-3)
    curves = wd.fragility(run, LIMITS, estimator="ordinal")
    assert curves["stripe"].attrs["units"] == curves["fragility_median"].attrs["units"] == units
    fraction = (expected_capacities(name)[:, :, None] < levels).mean(axis=1)
    np.testing.assert_allclose(curves["exceedance_fraction"], fraction, atol=1e-12)


def test_capacities_are_those_of_the_transfer_function(measured):
    name, levels, _ = measured
    _, _, units, power = MEASURES[name]
    given = scene(name, [*levels, 2 * levels[-1]])
    found = wd.capacities(given, LIMITS, device="cpu", dtype="float64", tolerance=1e-3)
    assert found["capacity"].attrs["units"] == units
    # Brackets of a thousandth, and the errors named above.
    expected = expected_capacities(name).T
    np.testing.assert_allclose(found["capacity"].values[0], expected, rtol=1e-3 + 2e-3 * power)
    curves = wd.fragility_from_capacities(found)
    assert curves["fragility_median"].attrs["units"] == units
    np.testing.assert_allclose(
        curves["fragility_median"], np.exp(np.log(expected).mean(axis=0)), rtol=1e-3 + 2e-3 * power
    )


def test_figures_name_the_unit(measured):
    name, levels, run = measured
    measure, _, units, _ = MEASURES[name]
    label = f"{measure.name} [{units}]"
    curves = wd.fragility(run, LIMITS, estimator="ordinal")
    assert wd.plots.fragility_curves(curves).axes[0].get_xlabel() == label
    assert wd.plots.ida_curves(run).axes[0].get_ylabel() == label
    assert wd.plots.drift_against_intensity(run).axes[0].get_xlabel() == label
    drawn = wd.plots.drift_distributions({"it": run}, level=levels[3])
    assert drawn.axes[0].get_title() == f"{measure.name} = {levels[3]:g} {units}"
    with pytest.raises(ValueError, match=re.escape(f" {units}") + "$"):
        wd.plots.drift_distributions({"it": run})
    found = wd.capacities(scene(name, levels), LIMITS, device="cpu", dtype="float64")
    assert wd.plots.capacities(found).axes[0].get_ylabel() == label


def test_files_have_the_unit_of_their_reader(measured, tmp_path):
    name, levels, run = measured
    # OpenQuake has PGV in cm/s, PGD in cm, Arias intensities in m/s and CAV in g s (openquake.hazardlib.imt).
    imt, factor = {"PGV": ("PGV", 100), "PGD": ("PGD", 100), "Arias": ("IA", 1), "CAV": ("CAV", 1 / G)}[name]
    curves = wd.fragility(run, LIMITS, estimator="ordinal")
    path = wd.write_nrml_fragility({"A": curves}, tmp_path / "model.xml", format="discrete")
    imls = next(each for each in ElementTree.parse(path).iter() if each.tag.endswith("imls"))
    assert imls.attrib["imt"] == imt
    np.testing.assert_allclose([float(value) for value in imls.text.split()], factor * levels, rtol=1e-12)
    again = wd.read_nrml_fragility(path)["A"]
    np.testing.assert_allclose(again["stripe"], levels, rtol=1e-12)
    # pelicun knows PGV in mps and PGD in m; what it does not know is left out.
    table = pd.read_csv(wd.write_pelicun_demands(run, tmp_path / "demands.csv", level=levels[3]), index_col=0)
    columns = {
        column: table[column].iloc[0] for column in table if not any(of in column for of in ("PFA", "PID", "RID"))
    }
    assert columns == {"PGV": {"1-PGV-0-1": "mps"}, "PGD": {"1-PGD-0-1": "m"}}.get(name, {})
    for column in columns:
        np.testing.assert_allclose(table[column].iloc[1:].astype(float), levels[3], rtol=1e-12)


def test_a_target_precision_is_reached_in_metres_per_second():
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.1))}
    given = wd.Scene(OSCILLATOR, wd.Stripes(MOTIONS, [0.5], wd.PeakGroundVelocity()), scatter)
    with pytest.warns(UserWarning, match="the precision is limited by the 8 records"):
        curves = wd.fragility_to(given, LIMITS, precision=0.2, device="cpu")
    assert curves["fragility_median"].attrs["units"] == "m s-1"
    # The scatter of the stiffness moves each capacity, and the median of all by less than its interval.
    expected = np.exp(np.log(expected_capacities("PGV")).mean(axis=1))
    assert np.all(curves["fragility_median_lower"] < expected)
    assert np.all(curves["fragility_median_upper"] > expected)


def test_shares_of_a_portfolio_are_by_stripes_of_any_unit():
    # Two buildings that are the oscillator.
    buildings = wd.Portfolio({"A": wd.Archetype(OSCILLATOR, 2)})
    levels = np.quantile(expected_capacities("PGV"), [0.2, 0.4, 0.6, 0.8])
    run = wd.simulate(
        wd.Scene(buildings, wd.Stripes(MOTIONS, levels, wd.PeakGroundVelocity())), method="rk4", device="cpu"
    )
    shares = wd.damage_shares(run, {"A": LIMITS})
    assert shares["stripe"].attrs["units"] == "m s-1"
    assert "comment" not in shares["stripe"].attrs
    slight = (expected_capacities("PGV")[0][:, None] < levels).astype(float)
    np.testing.assert_allclose(1 - shares["damage_share"].sel(damage_state="none"), slight)
