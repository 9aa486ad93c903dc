"""Linear systems of which parts move freely: a singular stiffness, infinite periods."""

import numpy as np
import pytest
from scipy.linalg import expm

import warpdyn as wd

# Two carts of 2 kg and 1 kg, joined by a spring of 100 N/m: w^2 = k (1 / m1 + 1 / m2) = 150 rad2/s2, and a free motion.
MASS, STIFFNESS = np.array([2.0, 1.0]), 100.0 * np.array([[1.0, -1.0], [-1.0, 1.0]])
DAMPINGS = {
    "none": np.zeros((2, 2)),
    "between the carts": 0.5 * np.array([[1.0, -1.0], [-1.0, 1.0]]),
    "to the ground": np.diag([0.4, 0.1]),  # couples the modes
}
START = np.array([0.1, 0.0, 0.0, 1.0])


def run(damping, method, step=0.002, dtype="float64"):
    system = wd.LinearSystem(MASS, damping, STIFFNESS)
    scene = wd.Scene(system, wd.FreeVibration(2.0, displacement=START[:2], velocity=START[2:]))
    return wd.simulate(scene, method=method, step=step, dtype=dtype, device="cpu", histories=wd.Histories((0,)))


@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize(("method", "error"), [("rk4", 1e-6), ("exact", 1e-12), ("newmark_average", 5e-3)])
def test_carts_that_are_joined_by_a_spring(method, error, damping):
    # RK4 errs by (w h)^4 / 120 = 3e-9 a radian, average acceleration by (w h)^2 / 12 = 5e-5, over 25 radians of up to
    # 1 m/s.
    damping = DAMPINGS[damping]
    state = np.block([[np.zeros((2, 2)), np.eye(2)], [-STIFFNESS / MASS[:, None], -damping / MASS[:, None]]])
    due = expm(2.0 * state) @ START
    found = run(damping, method)
    np.testing.assert_allclose(found.displacement.values[0, -1], due[:2], rtol=0, atol=error)
    np.testing.assert_allclose(found.velocity.values[0, -1], due[2:], rtol=0, atol=error)
    assert abs(found.energy_balance_error.item()) < 1e-3


def test_the_default_step_follows_from_the_modes_that_vibrate():
    found = run(DAMPINGS["none"], None, step=None)
    period = 2 * np.pi / np.sqrt(150.0)
    assert 0.9 * period / 100 < found.attrs["step"] <= period / 100
    # Momentum is conserved: the centre of mass moves on at 1 / 3 m/s.
    centre = found.displacement.values[0, -1] @ MASS / MASS.sum()
    assert centre == pytest.approx(0.2 / 3 + 2.0 / 3, rel=1e-9)


@pytest.mark.fast
def test_periods_and_refusals():
    system = wd.LinearSystem(MASS, np.zeros((2, 2)), STIFFNESS)
    np.testing.assert_allclose(system.modal()["period"], [np.inf, 2 * np.pi / np.sqrt(150.0)], rtol=1e-12)
    assert system.fundamental_period == np.inf
    with pytest.raises(ValueError, match="eigenvalues of the stiffness are negative"):
        wd.LinearSystem(MASS, np.zeros((2, 2)), -STIFFNESS)
    with pytest.raises(ValueError, match="eigenvalues of the stiffness are all 0"):
        wd.LinearSystem(MASS, np.zeros((2, 2)), np.zeros((2, 2)))
    with pytest.raises(ValueError, match="1 to 32 degrees of freedom, got 33"):
        wd.LinearSystem(np.ones(33), np.eye(33), np.eye(33))
