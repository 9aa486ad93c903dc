"""Numbers with units (pint), pandas and xarray objects as arguments give the model of plain SI numbers."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import warpdyn as wd

pint = pytest.importorskip("pint")
pytestmark = pytest.mark.fast

UNITS = pint.UnitRegistry()
STEP = 0.01


def quantity(values, unit):
    return UNITS.Quantity(np.array(values), unit)


MOTION = wd.GroundMotion([0.0, 1.0, 0.5], STEP, "a")
PGA, PGV = wd.PeakGroundAcceleration(), wd.PeakGroundVelocity()
# Each argument: how it is given and read, SI values (intensities in g), and the same values with another unit.
ARGUMENTS = {
    "mass": (lambda v: building(mass=v), [1e5, 9e4], ([100.0, 90.0], "tonne")),
    "stiffness": (lambda v: building(stiffness=v), [4e7, 3e7], ([40.0, 30.0], "MN/m")),
    "height": (lambda v: building(height=v), [3.0, 2.7], ([300.0, 270.0], "cm")),
    "yield_force": (lambda v: building(yield_force=v), [3e5, 2e5], ([300.0, 200.0], "kN")),
    "hardening_ratio": (lambda v: building(hardening_ratio=v), [0.05, 0.02], ([5.0, 2.0], "percent")),
    "acceleration": (
        lambda v: wd.GroundMotion(v, STEP, "a").acceleration, [0.0, 0.5, -0.25], ([0.0, 50.0, -25.0], "cm/s^2"),
    ),
    "levels in g": (lambda v: wd.Stripes([MOTION], v, PGA).levels, [0.1, 1.0], ([0.980665, 9.80665], "m/s^2")),
    "levels in m/s": (lambda v: wd.Stripes([MOTION], v, PGV).levels, [0.1, 1.0], ([10.0, 100.0], "cm/s")),
    "hazard": (
        lambda v: wd.HazardCurve(v, [1e-2, 1e-4], measure="PGA").intensity, [0.1, 1.0], ([0.980665, 9.80665], "m/s^2"),
    ),
}  # fmt: skip


def building(**changed):
    given = {"mass": 1e5, "stiffness": [4e7, 3e7], "height": 3.0, "yield_force": [3e5, 2e5], "hardening_ratio": 0.05}
    law = wd.laws.Bilinear(**{name: (given | changed)[name] for name in ("yield_force", "hardening_ratio")})
    rest = {name: (given | changed)[name] for name in ("mass", "stiffness", "height")}
    with wd.meant_as_given("no_damping"):
        made = wd.ShearBuilding(**rest, law=law)
    return made.description()[next(iter(changed))]


@pytest.mark.parametrize("name", ARGUMENTS)
def test_quantities_are_converted_to_si(name):
    give, expected, (values, unit) = ARGUMENTS[name]
    many = quantity(values, unit)
    for given in (many, list(many), xr.DataArray(many, dims="x")):
        np.testing.assert_allclose(give(given), expected, rtol=1e-14, atol=0)  # a product or two in float64


@pytest.mark.parametrize("name", ARGUMENTS)
def test_series_and_labelled_arrays_are_numbers(name):
    give, expected, _ = ARGUMENTS[name]
    frame = pd.DataFrame({"a": expected}, index=range(10, 10 + len(expected)))
    for given in (frame["a"], xr.DataArray(expected, dims="x"), xr.Dataset({"a": ("x", expected)})["a"]):
        np.testing.assert_array_equal(give(given), expected)


@pytest.mark.parametrize("name", ARGUMENTS)
def test_quantities_of_another_dimension_are_refused(name):
    give, _, (values, _) = ARGUMENTS[name]
    with pytest.raises(ValueError, match=r"must have a unit such as .*, but has kelvin: correct the unit"):
        give(quantity(values, "K"))


def test_single_numbers():
    step = UNITS.Quantity(np.array(10.0), "ms")
    for given in (step, xr.DataArray(STEP), xr.DataArray(step), np.array(STEP)):
        assert wd.GroundMotion([0.0, 1.0], given, "a").step == pytest.approx(STEP, rel=1e-15)
    with pytest.raises(ValueError, match=r"step \[s\] must have a unit such as s, but has meter"):
        wd.GroundMotion([0.0, 1.0], UNITS.Quantity(1.0, "m"), "a")


def test_a_unit_is_never_dropped():
    """The values of GivenValues are those of any parameter, so that their unit cannot be checked."""
    with pytest.raises(ValueError, match=r"takes plain numbers here: .* values\.to_base_units\(\)\.magnitude"):
        wd.GivenValues(quantity([300.0, 200.0], "kN"))
