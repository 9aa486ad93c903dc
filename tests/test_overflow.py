"""Values beyond the largest number of float32: refused, or blank, and never 0."""

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.engine.kernels.arguments import check_held

MOTION = wd.GroundMotion(np.sin(0.3 * np.arange(100)), 0.01)
RATES = {"bouc_wen": {"hardening_ratio": 0.05, "exponent": 1.0}, "bilinear": {"hardening_ratio": 0.05}}


def storey(law, yield_force):
    return wd.ShearBuilding(1e4, 1e7, 3.0, law=law, yield_force=yield_force, **RATES[law])


@pytest.mark.meant_as_given("yield_base_shear_coefficient", "yield_drift_ratio", "no_damping")
def test_energies_beyond_float32_are_blank():
    # Half a yield force times a yield drift is 5e40 J, and float32 ends at 3.4e38.
    scene = wd.Scene(storey("bouc_wen", 1e24), MOTION, recorders=("drift", "energy"))
    with pytest.warns(UserWarning, match="energies of 1 of 1 samples are beyond the largest number of their type"):
        found = wd.simulate(scene, device="cpu")
    elastic = wd.simulate(wd.Scene(wd.ShearBuilding(1e4, 1e7, 3.0), MOTION, recorders=("drift",)), device="cpu")
    assert np.isnan(found.energy_balance_error.item())
    assert np.isnan(found.hysteretic_energy.item())
    # A storey that never yields; rounding of a thousand steps.
    np.testing.assert_allclose(found.peak_storey_drift, elastic.peak_storey_drift, rtol=1e-3)


@pytest.mark.meant_as_given("yield_base_shear_coefficient", "yield_drift_ratio", "no_damping")
def test_a_parameter_beyond_float32_is_refused():
    scene = wd.Scene(storey("bouc_wen", 1e39), MOTION, recorders=("drift",))
    with pytest.raises(ValueError, match=r"exceeds the largest number of float32, 3\.4e\+38: .* dtype='float64'"):
        wd.simulate(scene, device="cpu")


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, 3.4e38, 0.0])
def test_what_float32_holds_is_taken(value):
    check_held("coefficients", np.array([1.0, value]), np.dtype("float32"))
    check_held("coefficients", np.array([1.0, 1e300]), np.dtype("float64"))
