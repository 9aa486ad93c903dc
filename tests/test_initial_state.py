"""Runs that start from a displacement or a velocity: under forces, and with storeys that yield or slip."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import warpdyn as wd
from warpdyn.truth import piecewise_linear_response

MASS, STIFFNESS = np.array([2.0, 1.0]), np.array([[6.0, -2.0], [-2.0, 4.0]])
START = {"initial_displacement": [0.1, -0.2], "initial_velocity": [0.3, 0.4]}
STATE = np.array([0.1, -0.2]), np.array([0.3, 0.4])
ALL = wd.Histories((0,))


def run(structure, load, method, step, **recorded):
    scene = wd.Scene(structure, load, **recorded)
    return wd.simulate(scene, method=method, step=step, dtype="float64", device="cpu", histories=ALL)


@pytest.mark.parametrize(("method", "error"), [("rk4", 1e-8), ("exact", 1e-12)])
def test_force_history_from_an_initial_state(method, error):
    # RK4 at w h = 0.026 errs by (w h)^4 / 120 = 4e-9 a radian of the second mode, over 5 radians; the other is exact.
    force = np.random.default_rng(0).normal(size=(20, 2))
    load = wd.ForceHistory(force, 0.1, **START)
    found = run(wd.LinearSystem(MASS, np.zeros((2, 2)), STIFFNESS), load, method, 0.01, tail=0.0)
    time = 0.01 * np.arange(191)
    forces = np.stack([np.interp(time, 0.1 * np.arange(20), column) for column in force.T], axis=1)
    truth = piecewise_linear_response(np.diag(MASS), np.zeros((2, 2)), STIFFNESS, forces, 0.01, *STATE)
    np.testing.assert_allclose(found.displacement.values[0], truth[0], rtol=0, atol=error)
    np.testing.assert_allclose(found.velocity.values[0], truth[1], rtol=0, atol=5 * error)
    np.testing.assert_allclose(found.displacement.values[0, 0], STATE[0], rtol=1e-14)  # rounding of the modes


@pytest.mark.parametrize(("method", "error"), [("rk4", 1e-8), ("exact", 1e-11)])
def test_harmonic_force_from_an_initial_state(method, error):
    amplitude, frequency = np.array([1.0, 2.0]), 3.0
    load = wd.HarmonicForce(amplitude, frequency, 2.0, **START)
    found = run(wd.LinearSystem(MASS, np.zeros((2, 2)), STIFFNESS), load, method, 0.01)

    def slope(t, y):
        return np.concatenate([y[2:], (amplitude * np.sin(frequency * t) - STIFFNESS @ y[:2]) / MASS])

    truth = solve_ivp(slope, (0, 2), np.concatenate(STATE), rtol=1e-12, atol=1e-13).y[:2, -1]
    np.testing.assert_allclose(found.displacement.values[0, -1], truth, rtol=0, atol=error)


@pytest.mark.parametrize("method", ["rk4", "newmark_average"])
def test_coulomb_friction_takes_the_same_off_each_half_cycle(method):
    # A mass on a spring that slides on a surface with the friction F loses 2 F / k of its amplitude in each half cycle,
    # and stops when the spring is weaker than the friction (Chopra, Dynamics of Structures, section 2.4).
    stiffness, friction = 100.0, 1.0
    sliding = wd.ShearBuilding(
        1.0, stiffness, 3.0, damping="none", devices=("friction_damper",), slip_force=friction, brace_stiffness=1e4
    )
    load = wd.FreeVibration(5.0, displacement=0.1)
    found = run(sliding, load, method, 1e-3, recorders=("drift", "residual", "energy"))
    drift = found.displacement.values[0, :, 0]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(drift)))) + 1
    due = [-0.08, 0.06, -0.04, 0.02]
    # Before it slips back, the brace is unloaded over 2 F / k of it = 0.2 mm in each half cycle.
    np.testing.assert_allclose(drift[turns[:4]], due, rtol=0, atol=3e-4)
    # It then stands still. All of the spring's energy, 0.5 J, was lost: the work of the friction over the way.
    assert found.hysteretic_energy.item() == pytest.approx(0.5 * stiffness * 0.1**2, rel=1e-4)
    assert abs(found.energy_balance_error.item()) < 1e-3


@pytest.mark.meant_as_given("no_damping", "yield_drift_ratio", "initial_drift_ratio")
def test_bilinear_storeys_released_beyond_yield():
    # Pulled to 3 yield drifts in the first storey and half of one in the second. From there both unload at the initial
    # stiffness: the exact solution is that of a chain whose plastic drifts have been moved by what is yielded already.
    stiffness, strength, hardening = np.array([4e5, 3e5]), np.array([4e3, 3e3]), 0.1
    mass, drift = np.array([1e3, 8e2]), np.array([0.03, 0.005])
    frame = wd.ShearBuilding(
        mass, stiffness, 3.0, law="bilinear", yield_force=strength, hardening_ratio=hardening, damping="none"
    )
    load = wd.FreeVibration(1.0, displacement=np.cumsum(drift))
    found = run(frame, load, "rk4", 1e-3, recorders=("drift", "energy"))
    # The first storey's force at the start: on the hardening line.
    due = strength[0] + hardening * stiffness[0] * (drift[0] - 0.01)
    assert found.storey_force.values[0, 0, 0] == pytest.approx(due, rel=1e-12)
    assert found.storey_force.values[0, 0, 1] == pytest.approx(stiffness[1] * drift[1], rel=1e-12)
    plastic = np.array([0.02, 0.0])

    def slope(t, y):
        """Follow displacements, velocities and plastic drifts: the rule of kinematic hardening as an ODE."""
        q, v, p = y[:2], y[2:4], y[4:]
        rate = np.diff(v, prepend=0.0)
        elastic = (1 - hardening) * stiffness * (np.diff(q, prepend=0.0) - p)
        limit = (1 - hardening) * strength
        yields = (np.abs(elastic) >= limit * (1 - 1e-9)) & (elastic * rate > 0)
        force = hardening * stiffness * np.diff(q, prepend=0.0) + np.clip(elastic, -limit, limit)
        net = np.array([force[1] - force[0], -force[1]])
        return np.concatenate([v, net / mass, np.where(yields, rate, 0.0)])

    start = np.concatenate([np.cumsum(drift), np.zeros(2), plastic])
    truth = solve_ivp(slope, (0, 1), start, max_step=2e-4, rtol=1e-9, atol=1e-12)
    end = np.array([np.interp(0.001 * np.arange(1001), truth.t, row) for row in truth.y[:2]]).T
    # RK4 at 1 ms errs by its order 2 at corners; so does the reference at steps of 0.2 ms.
    np.testing.assert_allclose(found.displacement.values[0], end, rtol=0, atol=2e-5)
    assert abs(found.energy_balance_error.item()) < 1e-4


@pytest.mark.meant_as_given("no_damping", "yield_drift_ratio", "initial_drift_ratio")
@pytest.mark.parametrize("method", ["rk4", "newmark_average"])
def test_bouc_wen_storey_released_beyond_yield(method):
    # dz/du = (1 - z^n) / uy on first loading (A = 1, beta = gamma = 1/2, n = 2): z = tanh(u / uy) there.
    stiffness, strength, hardening, drift = 4e5, 4e3, 0.1, 0.02
    frame = wd.ShearBuilding(
        1e3, stiffness, 3.0, law="bouc_wen", yield_force=strength, hardening_ratio=hardening, exponent=2.0,
        damping="none",
    )  # fmt: skip
    found = run(frame, wd.FreeVibration(1.0, displacement=drift), method, 1e-3, recorders=("drift", "energy"))
    due = hardening * stiffness * drift + (1 - hardening) * strength * np.tanh(drift / (strength / stiffness))
    # The pull is integrated by RK4 in 1,000 increments of 0.002 yield drifts: 1e-13. Rounding adds up 1,000 times.
    assert found.storey_force.values[0, 0, 0] == pytest.approx(due, rel=1e-12)


@pytest.mark.fast
def test_an_initial_state_that_does_not_fit_is_refused():
    chain = wd.ShearBuilding([1.0, 1.0], 100.0, 3.0, damping="none")
    for load, name in (
        (wd.FreeVibration(1.0, displacement=[0.1, 0.2, 0.3]), "FreeVibration.displacement has 3 values"),
        (wd.ForceHistory(np.zeros((3, 2)), 0.1, initial_velocity=[1.0] * 3), "ForceHistory.initial_velocity has 3"),
        (wd.HarmonicForce([1, 1], 1.0, 1.0, initial_displacement=[1.0] * 3), "HarmonicForce.initial_displacement has"),
    ):
        with pytest.raises(ValueError, match=name):
            wd.Scene(chain, load)
    with pytest.raises(ValueError, match="initial_velocity"):
        wd.ForceHistory(np.zeros((3, 2)), 0.1, initial_velocity=np.nan)
