"""Eigenvalues of damped structures whose undamped modes are known, against those of NumPy for the state matrix."""

import numpy as np
import pytest

from warpdyn.engine.kernels.modes import damped_modes
from warpdyn.engine.kernels.modes.damped_modes import damped_motions
from warpdyn.engine.methods.undamped_modes import undamped

STRUCTURES, DOFS = 18, 7  # more than a thread of the kernel computes at once


def chains():
    """Return mass and stiffness matrices of shear chains with unequal storeys."""
    random = np.random.default_rng(1)
    mass = random.uniform(0.8, 1.2, (STRUCTURES, DOFS))[:, :, None] * np.eye(DOFS) * 1e5
    storeys = random.uniform(0.8, 1.2, (STRUCTURES, DOFS)) * 2e8
    drifts = np.eye(DOFS) - np.eye(DOFS, k=-1)
    return mass, np.einsum("ki,sk,kj->sij", drifts, storeys, drifts)


def expected_of(mass, damping, stiffness):
    """Return eigenvalues in the order of their imaginary and real parts, and the largest rates without stiffness."""
    found = []
    for m, c, k in zip(mass, damping, stiffness, strict=True):
        inverse = np.linalg.inv(m)
        state = np.block([[np.zeros_like(m), np.eye(DOFS)], [-inverse @ k, -inverse @ c]])
        found.append(np.linalg.eigvals(state))
    return np.array(found), np.linalg.eigvals(np.linalg.inv(mass) @ damping).real.max(axis=1)


def in_order(eigenvalues):
    return np.array([sorted(each, key=lambda one: (round(one.imag, 6), one.real)) for each in eigenvalues])


def dampings(mass, stiffness):
    one_damper = np.zeros_like(mass)
    one_damper[:, 0, 0] = 1.0
    return {
        "none": 0.0 * mass,
        "rayleigh": 0.3 * mass + 0.002 * stiffness,
        "overdamped": 500.0 * mass,
        "unequal": 4e4 * np.eye(DOFS) + 0.0 * mass,
        "other stiffness": 0.002 * (stiffness + 2e6 * np.eye(DOFS)),
        "a strong damper": 3e7 * one_damper,
    }


@pytest.mark.parametrize("name", dampings(*chains()))
def test_eigenvalues_are_those_of_the_state_matrix(name):
    mass, stiffness = chains()
    damping = dampings(mass, stiffness)[name]
    found, rate = damped_motions(mass, damping, stiffness, *undamped(mass, stiffness))
    expected, highest = expected_of(mass, damping, stiffness)
    # Rounding of eigenvalues: 1e-15 of the largest one times the condition of the modes (below 100).
    np.testing.assert_allclose(in_order(found), in_order(expected), rtol=0, atol=1e-13 * np.abs(expected).max())
    np.testing.assert_allclose(rate, highest, rtol=1e-12, atol=1e-12)


def test_damping_rates_with_coupled_masses():
    mass, stiffness = chains()
    mass = mass + 2e4
    damping = dampings(mass, stiffness)["unequal"]
    found, rate = damped_motions(mass, damping, stiffness, *undamped(mass, stiffness))
    expected, highest = expected_of(mass, damping, stiffness)
    np.testing.assert_allclose(in_order(found), in_order(expected), rtol=0, atol=1e-13 * np.abs(expected).max())
    np.testing.assert_allclose(rate, highest, rtol=1e-12)


def test_weak_coupling_needs_no_state_matrix(monkeypatch):
    monkeypatch.setattr(damped_modes, "state_eigenvalues", None)
    mass, stiffness = chains()
    for name in ("none", "rayleigh", "unequal", "other stiffness"):
        damped_motions(mass, dampings(mass, stiffness)[name], stiffness, *undamped(mass, stiffness))


def test_strong_coupling_of_some_structures_leaves_the_others():
    mass, stiffness = chains()
    every = dampings(mass, stiffness)
    mixed = every["unequal"].copy()
    mixed[2] = every["a strong damper"][2]
    modes = undamped(mass, stiffness)
    found, _ = damped_motions(mass, mixed, stiffness, *modes)
    alone, _ = damped_motions(mass, every["unequal"], stiffness, *modes)
    others = np.delete(np.arange(STRUCTURES), 2)
    np.testing.assert_array_equal(found[others], alone[others])
    expected, _ = expected_of(mass, mixed, stiffness)
    # As above; the smallest eigenvalue is 1/100 of the largest one.
    np.testing.assert_allclose(in_order(found)[2], in_order(expected)[2], rtol=1e-11)
