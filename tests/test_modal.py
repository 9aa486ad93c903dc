"""Modes and damping against closed forms, published frequencies, and scipy's generalised eigenvalue problem."""

import numpy as np
import pytest
from scipy.linalg import eigh
from validation import relative_difference

from warpdyn.model.structures.modal import (
    chain_stiffness_matrix,
    modal_damping_matrix,
    modal_properties,
    rayleigh_coefficients,
)

pytestmark = pytest.mark.fast

SEED_MASS = np.array([200.0, 150.0, 100.0])
SEED_STIFFNESS = np.array([[40e3, -20e3, 0], [-20e3, 40e3, -20e3], [0, -20e3, 20e3]])
SEED_OMEGA = [5.52942875199533, 14.142135623731, 20.882817921518]


def uniform_chain(storeys):
    """Frequencies over sqrt(k/m) of a uniform shear chain: 2 sin((2 j - 1) pi / (4 n + 2))."""
    return 2 * np.sin((2 * np.arange(1, storeys + 1) - 1) * np.pi / (4 * storeys + 2))


def test_seed_frame(measured):
    modes = modal_properties(SEED_MASS, SEED_STIFFNESS)
    measured(
        "circular frequencies of a three-storey frame",
        truth="published values to 13 digits",
        value=relative_difference(modes["circular_frequency"], SEED_OMEGA),
        bound=1e-12,
    )
    np.testing.assert_allclose(modes["period"], 2 * np.pi / np.array(SEED_OMEGA), rtol=1e-12)
    assert dict(modes.sizes) == {"mode": 3, "dof": 3}
    shape = modes["shape"].values
    for phi, omega in zip(shape, SEED_OMEGA, strict=True):
        np.testing.assert_allclose(SEED_STIFFNESS @ phi, omega**2 * SEED_MASS * phi, atol=1e-8)  # of 4e4
    assert shape.max(axis=1).tolist() == [1, 1, 1]
    assert np.abs(shape).max() == 1
    assert modes["effective_mass"].sum() == pytest.approx(450, rel=1e-13)
    assert modes["effective_mass_ratio"].sum() == pytest.approx(1, rel=1e-13)
    # The modes expand the influence vector: sum of participation times shape is 1 at every DOF.
    np.testing.assert_allclose(modes["participation_factor"] @ modes["shape"], 1, rtol=1e-13)


def test_two_storey_frame_in_the_textbook():
    # Chopra, example 10.4 and 13.2: masses 2m, m; stiffness 2k, k: w^2 = k/2m, 2k/m; shapes (1/2, 1), (-1, 1);
    # participation 4/3, -1/3 for the roof at 1; effective mass 8/3 m, 1/3 m.
    m, k = 3.0, 70.0
    modes = modal_properties([2 * m, m], [[3 * k, -k], [-k, k]])
    np.testing.assert_allclose(modes["circular_frequency"] ** 2, [k / (2 * m), 2 * k / m], rtol=1e-13)
    second = modes["shape"][1] * np.sign(modes["shape"][1, 1])  # both components are the largest, either may be +1
    np.testing.assert_allclose(modes["shape"][0], [0.5, 1], rtol=1e-13)
    np.testing.assert_allclose(second, [-1, 1], rtol=1e-13)
    np.testing.assert_allclose(np.abs(modes["participation_factor"]), [4 / 3, 1 / 3], rtol=1e-13)
    np.testing.assert_allclose(modes["effective_mass"], [8 * m / 3, m / 3], rtol=1e-13)


def test_influence_and_full_mass_matrix():
    # Storey drifts as coordinates: u = T d. The base moves the first coordinate alone, and nothing physical changes.
    transform = np.tri(3)
    floors = modal_properties(SEED_MASS, SEED_STIFFNESS)
    drifts = modal_properties(
        transform.T @ np.diag(SEED_MASS) @ transform, transform.T @ SEED_STIFFNESS @ transform, influence=[1, 0, 0]
    )
    np.testing.assert_allclose(drifts["circular_frequency"], floors["circular_frequency"], rtol=1e-12)
    np.testing.assert_allclose(drifts["effective_mass"], floors["effective_mass"], rtol=1e-10)
    assert np.abs(drifts["shape"]).max(axis=1).values == pytest.approx(1)


def test_every_variable_says_what_it_is():
    modes = modal_properties(SEED_MASS, SEED_STIFFNESS)
    expected = {
        "period": "s",
        "circular_frequency": "rad s-1",
        "shape": "1",
        "participation_factor": "1",
        "effective_mass": "kg",
        "effective_mass_ratio": "1",
    }
    assert {name: modes[name].attrs["units"] for name in modes.data_vars} == expected
    assert all(variable.attrs["long_name"] for variable in modes.variables.values())


@pytest.mark.parametrize("storeys", [1, 2, 5, 60])
def test_uniform_chains(storeys):
    modes = modal_properties(np.full(storeys, 3.0), chain_stiffness_matrix(np.full(storeys, 12.0)))
    # Eigenvalues are good to rounding of the greatest; the least is (2 / 0.026)^2 times smaller at 60 storeys.
    np.testing.assert_allclose(modes["circular_frequency"], 2 * uniform_chain(storeys), rtol=1e-11)


def test_chain_stiffness_resists_storey_drifts():
    k = np.array([[3.0, 5.0, 7.0], [1.0, 2.0, 4.0]])
    displacement = np.array([1.0, 1.0, 1.5])  # drifts 1, 0, 0.5
    expected = k * [1, 0, 0.5]
    force = chain_stiffness_matrix(k) @ displacement
    np.testing.assert_allclose(force, expected - np.pad(expected[:, 1:], ((0, 0), (0, 1))), atol=1e-15)


def test_modal_damping_gives_every_mode_its_ratio():
    rng = np.random.default_rng(5)
    mass, matrix = rng.uniform(1, 3, (6, 4)), chain_stiffness_matrix(rng.uniform(50, 200, (6, 4)))
    ratio = np.array([0.0, 0.02, 0.05, 0.1, 0.5, 1.2])
    damping = modal_damping_matrix(mass, matrix, ratio)
    for m, k, c, zeta in zip(mass, matrix, damping, ratio, strict=True):
        eigenvalue, phi = eigh(k, np.diag(m))
        # Classical: diagonal in the modes, 2 zeta w on the diagonal.
        np.testing.assert_allclose(phi.T @ c @ phi, np.diag(2 * zeta * np.sqrt(eigenvalue)), rtol=0, atol=1e-11)
        np.testing.assert_allclose(c, c.T, atol=1e-13)
    np.testing.assert_allclose(modal_damping_matrix(mass[2], matrix[2], 0.05), damping[2], rtol=1e-14)
    np.testing.assert_allclose(modal_damping_matrix(mass, matrix, 0.05)[2], damping[2], rtol=1e-14)


def test_rayleigh_coefficients():
    low, high, zeta = np.array([3.0, 5.0]), np.array([20.0, 9.0]), np.array([0.05, 0.02])
    a0, a1 = rayleigh_coefficients(low, high, zeta)
    for omega in (low, high):
        np.testing.assert_allclose(a0 / (2 * omega) + a1 * omega / 2, zeta, rtol=1e-14)
    # Chopra, example 11.1: 5 % at 12.57 and 34.33 rad/s gives a0 = 0.9198, a1 = 0.0021 (four digits printed).
    a0, a1 = rayleigh_coefficients(12.57, 34.33, 0.05)
    assert (a0, a1) == (pytest.approx(0.9198, abs=5e-4), pytest.approx(0.0021, abs=5e-5))


def test_bad_input_is_named():
    skew = SEED_STIFFNESS + 1e3 * np.eye(3, k=1)
    free = chain_stiffness_matrix([0.0, 1e3, 1e3])
    for mass, stiffness, influence, message in (
        (SEED_MASS[:2], SEED_STIFFNESS, None, r"stiffness must be square with one row per DOF \(2\)"),
        ([200, 0, 100], SEED_STIFFNESS, None, "mass must be positive definite"),
        ([200, -150, 100], SEED_STIFFNESS, None, "mass must be positive definite"),
        (SEED_MASS, skew, None, r"stiffness must be symmetric; stiffness\[0, 1\] differs from its mirror by 1000"),
        (SEED_MASS, -SEED_STIFFNESS, None, "stiffness must be positive definite"),
        (SEED_MASS, free, None, "stiffness must be positive definite"),
        (SEED_MASS, SEED_STIFFNESS * np.nan, None, r"stiffness\[0, 0\] is nan; every value must be finite"),
        (SEED_MASS, SEED_STIFFNESS, [1, 1], "influence must be finite"),
        (SEED_MASS, SEED_STIFFNESS, [0, 0, 0], "influence must be finite, not all 0"),
    ):
        with pytest.raises(ValueError, match=message):
            modal_properties(mass, stiffness, influence)
    good, bad = np.ones((2, 3)), np.array([[1, 1, 1], [1, 0, 1.0]])
    with pytest.raises(ValueError, match=r"mass\[1, 1\] is 0; it must be finite and above 0"):
        modal_damping_matrix(bad, chain_stiffness_matrix(good), 0.05)
    with pytest.raises(ValueError, match="storey_stiffness must be finite"):
        chain_stiffness_matrix([1.0, np.inf])
    matrix = chain_stiffness_matrix(good)
    with pytest.raises(ValueError, match=r"stiffness_matrix must have shape \(2, 3, 3\)"):
        modal_damping_matrix(good, matrix[0], 0.05)
    with pytest.raises(ValueError, match=r"stiffness_matrix\[1\] must be positive definite"):
        modal_damping_matrix(good, matrix * np.array([1, -1.0])[:, None, None], 0.05)
    with pytest.raises(ValueError, match="stiffness_matrix must be symmetric"):
        modal_damping_matrix(SEED_MASS, skew, 0.05)
    with pytest.raises(ValueError, match="ratio must be finite, 0 or above"):
        modal_damping_matrix(good, matrix, -0.05)
    with pytest.raises(ValueError, match=r"omega_j\[1\] is 0;"):
        rayleigh_coefficients(1.0, [2.0, 0.0], 0.05)
    with pytest.raises(ValueError, match="ratio must be finite and 0 or above"):
        rayleigh_coefficients(1.0, 2.0, np.nan)
