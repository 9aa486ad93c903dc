"""The last sample of a force history acts at its instant: recorded accelerations and energies see it."""

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.truth import piecewise_linear_response

# A mass of 1 kg on a spring so weak that it hardly counts: a = F / m within k u = 2e-7 of it.
LINEAR = wd.LinearSystem([1.0], [[0.0]], [[1e-4]])
METHODS = ("rk4", "velocity_verlet", "central_difference_lagged", "dormand_prince54", "newmark_average", "exact")


def chain():
    return wd.ShearBuilding(1.0, 1e-4, 3.0, damping="none")


def run(structure, force, interval, method="rk4", step=None, dtype="float64", **kept):
    kept = {"tail": 1.0, "recorders": ("acceleration",)} | kept
    histories = kept.pop("histories", None)
    scene = wd.Scene(structure, wd.ForceHistory(force, interval), **kept)
    return wd.simulate(scene, method=method, step=step, dtype=dtype, device="cpu", histories=histories)


def peak(found):
    [name] = [name for name in found if name in ("peak_acceleration", "peak_floor_acceleration")]
    return found[name].values.ravel()


@pytest.mark.meant_as_given("no_damping", "first_period", "force_over_weight", "drift_ratio_of_force")
@pytest.mark.parametrize("structure", [LINEAR, chain], ids=["full matrices", "chain"])
@pytest.mark.parametrize("method", METHODS)
def test_peak_acceleration_has_the_last_force_at_any_step(method, structure):
    structure = structure() if callable(structure) else structure
    for step in (0.1, 0.01):
        for last in ([], [[0.0]]):  # with or without a sample of zero after it
            found = run(structure, [[0.0], [1.0], *last], 0.1, method, step)
            assert peak(found) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.meant_as_given("no_damping", "first_period", "force_over_weight", "drift_ratio_of_force")
@pytest.mark.parametrize("structure", [LINEAR, chain], ids=["full matrices", "chain"])
def test_history_has_the_last_force_at_its_instant_and_none_after_it(structure):
    structure = structure() if callable(structure) else structure
    found = run(structure, [[0.0], [1.0]], 0.1, step=0.05, histories=wd.Histories((0,)))
    acceleration = found["acceleration"].values[0, :, 0]
    np.testing.assert_allclose(acceleration[:4], [0.0, 0.5, 1.0, 0.0], atol=1e-5)


@pytest.mark.meant_as_given("no_damping")
def test_release_of_a_force_that_the_spring_balances():
    # A slow force that ends at its largest value: before the release nothing moves, and then a = k u / m.
    mass, stiffness, force = 100.0, 4e4, 200.0  # 20 rad/s
    storey = wd.ShearBuilding(mass, stiffness, 3.0, damping="none")
    ramp = force * np.linspace(0, 1, 1001)[:, None] ** 2
    for method in ("rk4", "newmark_average", "exact"):
        found = run(storey, ramp, 0.01, method, 0.0025)
        # The ramp takes 30 periods: what it makes the mass swing is 2 F / (k (w T)^2) = 5e-5 of the drift.
        assert peak(found) == pytest.approx(force / mass, rel=1e-3)


MASS, STIFFNESS = np.array([2000.0, 1500.0, 1000.0]), np.array([1.2e6, 9e5, 5e5])


def matrix(of):
    return np.diag(of + np.append(of[1:], 0)) - np.diag(of[1:], 1) - np.diag(of[1:], -1)


@pytest.mark.meant_as_given("no_damping")
@pytest.mark.parametrize("method", ["rk4", "velocity_verlet", "newmark_average"])
def test_energy_put_in_by_a_force_that_ends_other_than_in_zero(method):
    force = 1e3 * np.random.default_rng(0).normal(size=(60, 3))
    frame = wd.ShearBuilding(MASS, STIFFNESS, 3.0, damping="none")
    fine = 2e-4
    time = fine * np.arange(round(59 * 0.02 / fine) + 1)
    forces = np.stack([np.interp(time, 0.02 * np.arange(60), column) for column in force.T], axis=1)
    velocity = piecewise_linear_response(np.diag(MASS), np.zeros((3, 3)), matrix(STIFFNESS), forces, fine)[1]
    power = (forces * velocity).sum(axis=1)
    due = np.trapezoid(power, dx=fine)
    errors = []
    for step in (0.004, 0.002):
        found = run(frame, force, 0.02, method, step, recorders=("energy",))
        errors.append(abs(found.input_energy.item() / due - 1))
        # 45 rad/s: (w h)^2 / 12 of the phase, 0.3 %, and as much of the energies.
        assert abs(found.energy_balance_error.item()) < 5e-3
    # Without the last force, the error is of first order: half of it with half the step.
    assert errors[1] < max(errors[0] / 3, 1e-5)
