"""The triple friction pendulum in one direction: forces and cycles of the series of three sliders."""

from __future__ import annotations

import re

import numpy as np
import pytest

import warpdyn as wd

SET = {
    "outer_radii": (1.25, 1.25),
    "inner_radii": (0.36, 0.36),
    "outer_friction": (0.052, 0.14),
    "inner_friction": 0.012,
}
WEIGHT = 2e6  # N


def forces_along(path: list[float], **changed: object) -> np.ndarray:
    """Return the forces over the weight."""
    bearing = wd.laws.triple_pendulum(weight=WEIGHT, **SET | changed)
    storey = wd.ShearBuilding(1e5, bearing["stiffness"], 3.0, law=bearing["law"])
    return wd.storey_hysteresis(storey, path)["storey_force"].values[:, 0] / WEIGHT


@pytest.mark.parametrize("yield_displacement", [1e-4, 1e-6])
def test_backbone_is_that_of_the_regimes(yield_displacement):
    # From the formulas of the regimes; a series of three sliders gives the same values.
    path = [0.02, 0.0288, 0.1, 0.17048, 0.25, 0.35048]
    due = [0.03977778, 0.052, 0.0962236, 0.14, 0.171808, 0.212]
    found = forces_along([0.0, *path], yield_displacement=yield_displacement)[1:]
    np.testing.assert_allclose(found, due, atol=5e-9)


def test_corners_and_energy_of_a_cycle():
    # Corners after the rigid reversal, which takes twice the yield displacement here.
    tiny = 1e-7
    corners = {0.2424: 0.087808, -0.04096: -0.088192, -0.3: -0.191808}
    corners |= {-0.2424: -0.087808, 0.04096: 0.088192, 0.3: 0.191808}
    path = [0.0, 0.3, *corners]
    found = forces_along(path, yield_displacement=tiny)
    np.testing.assert_allclose(found[2:], list(corners.values()), atol=1e-6)
    # A full path between the corners has the energy of the cycle.
    dense = np.interp(np.linspace(1, 7, 60001), np.arange(len(path)), path)
    force = forces_along([0.0, *dense], yield_displacement=tiny)
    energy = np.sum((force[2:] + force[1:-1]) / 2 * np.diff(dense))
    assert energy == pytest.approx(0.05791653, rel=1e-4)


def test_equal_outer_friction_has_one_corner_less():
    bearing = wd.laws.triple_pendulum(weight=WEIGHT, **SET | {"outer_friction": (0.1, 0.1)})
    assert isinstance(bearing["law"], wd.laws.Trilinear)
    found = forces_along([0.0, (0.1 - 0.012) * 0.72, 0.2], outer_friction=(0.1, 0.1))
    np.testing.assert_allclose(found[1:], [0.1, 0.1 + (0.2 - 0.088 * 0.72) / 2.5], rtol=1e-9)


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"outer_friction": (0.14, 0.052)}, "count the surfaces so that surface 1 slides before surface 4"),
        ({"inner_radii": (1.5, 0.36)}, "inner_radii are 1.5 and 0.36 m; they must be below the outer_radii"),
        ({"outer_radii": 1.25}, "outer_radii must be two values above 0 [m], got 1.25"),
        ({"yield_displacement": 0.05}, "yield_displacement is 0.05 m; it must be below"),
        ({"inner_friction": 0.0}, "inner_friction"),
    ],
)
def test_mistakes(changed, text):
    with pytest.raises(ValueError, match=re.escape(text)):
        wd.laws.triple_pendulum(weight=WEIGHT, **SET | changed)
