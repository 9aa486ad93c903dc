"""Sets of fragility curves: numbers of a user, limits of the intensities, and curves of any shape in files."""

import numpy as np
import pytest
from fragility_parameters import curves
from scipy.stats import lognorm
from test_cloud_curves import make_cloud, with_collapses

import warpdyn as wd
from warpdyn.answers.risk.curves.curve_set import CurveSet
from warpdyn.answers.risk.integrals.intensity_limits import IntensityLimits
from warpdyn.answers.risk.integrals.lognormal import LognormalShape

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]

HAZARD = wd.HazardCurve([0.01, 0.1, 1.0], [0.1, 5e-3, 1e-4])
STATES = {"slight": (0.2, 0.3), "complete": (0.5, 0.6)}
LEVELS = np.array([0.05, 0.2, 0.7])


def test_curves_of_numbers_and_of_a_dataset_are_the_same():
    read = CurveSet.from_dataset("test", curves(STATES))
    made = CurveSet(("slight", "complete"), LognormalShape(), np.array([0.2, 0.5]), np.array([0.3, 0.6]))
    tree = wd.HazardLogicTree([HAZARD], [1.0])
    np.testing.assert_array_equal(made.rates(tree), read.rates(tree))
    for number, (median, dispersion) in enumerate(STATES.values()):
        expected = lognorm.cdf(LEVELS, dispersion, scale=median)
        np.testing.assert_allclose(made.probability(LEVELS)[number], expected, rtol=1e-12)
    assert (made.place_of("test", None), made.place_of("test", "slight")) == (1, 0)


def test_limits_clip_the_intensities_of_a_set():
    limits = IntensityLimits(no_damage=0.1, maximum=0.5)
    made = CurveSet(("slight",), LognormalShape(), np.array([0.2]), np.array([0.3]), limits=limits)
    expected = [0.0, 0.5, lognorm.cdf(0.5, 0.3, scale=0.2)]
    np.testing.assert_allclose(made.probability(LEVELS)[0], expected, rtol=1e-12)


def test_two_states_of_one_name_are_refused():
    twice = curves(STATES).assign_coords(damage_state=["slight", "slight"])
    with pytest.raises(ValueError, match="annual_rates: two damage states have the same name: slight, slight"):
        wd.annual_rates(twice, HAZARD)


def test_curves_of_a_cloud_with_collapses_are_written_at_intensities(tmp_path):
    cloud = make_cloud(*with_collapses())
    fitted = wd.fragility_of_cloud(cloud, {"slight": 0.02, "complete": 0.05}, estimator="collapse")
    levels = [0.2, 0.5, 1.0, 1.5]
    given = {"intensities": levels, "measure": "PGA"}
    with pytest.raises(ValueError, match="of demand and collapse, but OpenQuake's continuous functions are lognormal"):
        wd.write_nrml_fragility({"A": fitted}, tmp_path / "model.xml", measure="PGA")
    path = wd.write_nrml_fragility({"A": fitted}, tmp_path / "model.xml", format="discrete", **given)
    read = wd.read_nrml_fragility(path)["A"]["exceedance_fraction"].values
    for row, expected in zip(read, fitted["fragility_curve"].values, strict=True):
        # The dataset's curve at 401 intensities, on a line between them.
        np.testing.assert_allclose(row, np.interp(levels, fitted["intensity"], expected), atol=1e-3)


def test_curves_of_a_cloud_with_collapses_have_losses_and_conditional_probabilities():
    cloud = make_cloud(*with_collapses())
    fitted = wd.fragility_of_cloud(cloud, {"slight": 0.02, "complete": 0.05}, estimator="collapse")
    at = [np.interp(0.7, fitted["intensity"], each) for each in fitted["fragility_curve"].values]
    hazard = wd.HazardCurve(HAZARD.intensity, HAZARD.annual_rate, measure="PGA")
    target = wd.check_risk_target(fitted, hazard, 0.7)
    assert float(target["conditional_probability"]) == pytest.approx(at[1], abs=1e-3)
    losses = wd.vulnerability(fitted, {"slight": 0.1, "complete": 1.0}, intensity=[0.7])
    assert losses["mean_loss_ratio"].item() == pytest.approx(0.1 * (at[0] - at[1]) + at[1], abs=2e-3)
