"""Mistakes that a new user made in a review: each message names the mistake, and no wrong remedy."""

import warnings

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.engine.laws.parameter import Parameter
from warpdyn.foundations.core.plausibility.table import CHECKS

TIME = 0.01 * np.arange(2000)
BUILDING = wd.ShearBuilding(1e5, 1e5 * (2 * np.pi) ** 2, 3.0, damping="stiffness_proportional", damping_ratio=0.05)

pytestmark = pytest.mark.fast


def warnings_of(function) -> str:
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        function()
    return " ".join(str(each.message) for each in found)


def test_a_hazard_curve_with_swapped_arguments():
    with pytest.raises(ValueError, match="the arguments seem to be swapped"):
        wd.HazardCurve([0.1, 1e-2, 1e-3, 1e-5], [0.01, 0.1, 0.4, 3.0])


def test_return_periods_in_the_place_of_rates():
    with pytest.raises(ValueError, match=r"of return periods in years, give 1 / return_period"):
        wd.HazardCurve([0.01, 0.1, 0.4, 3.0], [10.0, 100.0, 475.0, 2475.0])
    told = warnings_of(lambda: wd.HazardCurve([0.01, 0.1, 0.4, 3.0], [2475.0, 475.0, 100.0, 10.0]))
    assert "they may be return periods: give 1 / period" in told


def test_a_capacity_curve_with_swapped_arguments():
    with pytest.raises(ValueError, match="they seem to be swapped"):
        wd.ShearBuilding.from_capacity([2.4e6, 3e6], [0.035, 0.12], storeys=4, mass=2.6e5, height=3.2, law="bilinear")


def test_mass_and_stiffness_swapped():
    finding = CHECKS["first_period"].finding(198.7, "", 20.0)
    assert "mass and stiffness may be swapped" in finding
    assert "swapped" not in CHECKS["first_period"].finding(0.001, "", 20.0)


def test_a_step_is_called_a_frequency_only_if_it_may_be_one():
    assert "frequency in Hz" not in CHECKS["record_step"].finding(0.1, "", 0.05)
    assert "with the decimal point misplaced, it would be 0.01 s" in CHECKS["record_step"].finding(0.1, "", 0.05)
    assert "frequency in Hz" in CHECKS["record_step"].finding(200.0, "", 0.05)


def test_a_time_column_in_the_place_of_the_record():
    told = warnings_of(lambda: wd.simulate(wd.Scene(BUILDING, wd.GroundMotion(TIME, 0.01)), device="cpu"))
    assert "the values may be the time column" in told
    assert "detrend" not in told


def test_resampling_without_a_filter():
    # 9 Hz in steps of 0.1 s look like 1 Hz, the frequency of the building: the drift is many times too large.
    motion = wd.GroundMotion(2 * np.sin(2 * np.pi * 9 * TIME), 0.01)
    right = wd.simulate(wd.Scene(BUILDING, motion), device="cpu")["peak_storey_drift_ratio"]
    with pytest.warns(UserWarning, match=r"without a filter: their frequencies above 5 Hz appear as lower ones"):
        wrong = wd.simulate(wd.Scene(BUILDING, motion), step=0.1, resample=True, device="cpu")
    assert float(wrong["peak_storey_drift_ratio"].max()) > 10 * float(right.max())


def test_stable_steps_that_are_not_accurate():
    stiff = wd.ShearBuilding(1e5, 2.4e11, 3.0, damping="stiffness_proportional", damping_ratio=0.05)
    scene = wd.Scene(stiff, wd.GroundMotion(np.sin(9 * TIME), 0.01))
    told = warnings_of(lambda: wd.simulate(scene, method="rk4", step=0.01, device="cpu"))
    assert "No action is needed" not in told
    assert "They are stable, but not accurate: see the next warning" in told
    assert "the step is too long for the first period" in told


@pytest.mark.parametrize(("units", "right"), [("kN", "N"), ("kN m-1", "N"), ("mm", "m"), ("%", "1"), ("g", "kg")])
def test_parameters_in_other_units(units, right):
    with pytest.raises(ValueError, match=f"use '{right}' instead of"):
        Parameter(units, "capacity")
