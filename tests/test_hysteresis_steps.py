"""storey_hysteresis: coarse drifts of Bouc-Wen storeys give the forces of SciPy's integration of the law."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import warpdyn as wd

STIFFNESS, YIELD_FORCE, HARDENING, EXPONENT = 2.2e7, 1.8e5, 0.05, 2.0
TURNS = (0.06, -0.06, 0.03)


def building() -> wd.ShearBuilding:
    law = {"law": "bouc_wen", "yield_force": YIELD_FORCE, "hardening_ratio": HARDENING, "exponent": EXPONENT}
    return wd.ShearBuilding([1e5], [STIFFNESS], 3.0, **law)


def forces_by_scipy() -> list[float]:
    """Return the forces at the turns: dz/du = (1 - |z|^n (1 + sign(z du)) / 2) / u_y."""
    yield_drift, z, start, forces = YIELD_FORCE / STIFFNESS, 0.0, 0.0, []
    for end in TURNS:
        direction = np.sign(end - start)

        def slope(u: float, z: np.ndarray, direction: float = direction) -> np.ndarray:
            return (1 - np.abs(z) ** EXPONENT * (1 + np.sign(z * direction)) / 2) / yield_drift

        z = solve_ivp(slope, (start, end), [z], rtol=1e-11, atol=1e-12).y[0, -1]
        forces.append(HARDENING * STIFFNESS * end + (1 - HARDENING) * YIELD_FORCE * z)
        start = end
    return forces


@pytest.mark.parametrize("points", [1, 3, 40])
def test_forces_do_not_depend_on_the_distance_of_the_drifts(points):
    path, start = [0.0], 0.0
    for end in TURNS:  # with one point per turn, a step has up to 15 yield drifts
        path += np.linspace(start, end, points + 1)[1:].tolist()
        start = end
    found = wd.storey_hysteresis(building(), path)["storey_force"].values[points::points, 0]
    np.testing.assert_allclose(found, forces_by_scipy(), rtol=1e-8)  # Runge-Kutta steps of 1/4 yield drift


@pytest.mark.fast
@pytest.mark.filterwarnings("ignore:implausible input")
def test_drifts_in_another_unit_are_refused():
    with pytest.raises(ValueError, match=r"yield drifts, more than.*give drifts in m"):
        wd.storey_hysteresis(building(), [0.0, 1e6])


def test_parameter_sets_have_the_forces_of_single_buildings():
    path = 0.06 * np.sin(np.linspace(0, 7, 50))
    ratios = np.linspace(0.0, 0.1, 70)  # more sets than a building has storeys
    found = wd.storey_hysteresis(building(), path, scatter={"hardening_ratio": wd.GivenValues(ratios)})
    assert found["storey_force"].dims == ("structure", "step", "storey")
    law = {"law": "bouc_wen", "yield_force": YIELD_FORCE, "exponent": EXPONENT}
    for place in (0, 41, 69):  # all sets have one yield drift, so that their steps are those of a single building
        alone = wd.ShearBuilding([1e5], [STIFFNESS], 3.0, hardening_ratio=ratios[place], **law)
        expected = wd.storey_hysteresis(alone, path)
        for name in ("storey_force", "dissipated_energy"):
            scale = float(np.abs(expected[name]).max())
            np.testing.assert_allclose(found[name][place], expected[name], rtol=0, atol=1e-12 * scale)
    np.testing.assert_array_equal(found["hardening_ratio"][:, 0], ratios)
