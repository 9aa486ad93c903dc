"""Capped hinges without deterioration: fast rules against the general law of Ibarra, Medina and Krawinkler."""

from __future__ import annotations

import numpy as np
import pytest
from hinge_cases import motion, reference_model, steel

import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of

pytestmark = pytest.mark.meant_as_given(
    "no_damping", "damping_ratio", "first_period", "strongest_motion", "peak_ground_acceleration"
)
MOTIONS = [motion("pulse_2", 5), motion("LOS270", 6), motion("pulse_1", 10)]
# An energy capacity that no history spends: the law has the general rules, but deteriorates by less than 1e-9.
NEGLIGIBLE = {"post_capping_deterioration_drift": 1e9}


def scene_of(plastic: float, post_capping: float, **more: float) -> wd.Scene:
    """Return frames whose hinges cap after a share of the plastic rotation of the reference model."""

    def hinge(strength: float, to_capping: float, after: float) -> dict:
        return steel(strength, plastic * to_capping, post_capping * after) | more

    return wd.Scene(reference_model(hinge), wd.Cloud(MOTIONS), recorders=("spring", "residual"))


@pytest.mark.parametrize(
    ("plastic", "post_capping", "changes"),
    [
        (1.0, 1.0, {}),
        (0.2, 0.1, {"ultimate_drift": 0.04}),  # residual moments, unloading from them, and loss of strength
        pytest.param(1.0, 0.1, {"residual_force_ratio": 0.0}, marks=pytest.mark.thorough),
    ],
)
def test_fast_rules_equal_the_general_law(plastic, post_capping, changes):
    fast, general = (scene_of(plastic, post_capping, **changes, **more) for more in ({}, NEGLIGIBLE))
    laws = [str(dynamics_of(scene).law) for scene in (fast, general)]
    assert laws == ["ibarra_medina_krawinkler_capped", "ibarra_medina_krawinkler_bilinear"]
    settings = {"device": "cpu", "method": "leapfrog", "step": 0.005, "dtype": "float64", "on_unstable": "flag"}
    found, due = (wd.simulate(scene, **settings) for scene in (fast, general))
    np.testing.assert_array_equal(found["status"].values, due["status"].values)
    for name in ("peak_spring_deformation", "peak_spring_force", "residual_deformation"):
        np.testing.assert_allclose(found[name].values, due[name].values, rtol=1e-5, atol=1e-9)


def test_a_hardening_line_that_could_be_too_steep_keeps_the_general_law():
    assert str(dynamics_of(scene_of(0.02, 1.0, ultimate_drift=0.0)).law) == "ibarra_medina_krawinkler_bilinear"
