"""Eigenvalues and eigenvectors of many symmetric matrices, and checks of eigenvalues without them, against NumPy."""

import numpy as np
import pytest

from warpdyn.engine.kernels.modes.symmetric_matrices import MOST_ROWS, eigenvectors
from warpdyn.engine.methods.undamped_modes import have_only_eigenvalues_above, inverses, scaled_stiffness

# Rounding of both algorithms, in the size of the largest eigenvalue: some times 1e-16 times the number of rows.
ROUNDING = 1e-14


def random_matrices(count, rows):
    values = np.random.default_rng(rows).normal(size=(count, rows, rows))
    return values + values.transpose(0, 2, 1)


def special_matrices():
    """Return matrices of 5 rows that are diagonal, tridiagonal or divided, or that have equal eigenvalues."""
    tridiagonal = 2 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1)
    divided = random_matrices(1, 5)[0]
    divided[:2, 2:] = divided[2:, :2] = 0.0
    reflected = np.eye(5) - 2 * np.full((5, 5), 0.2)
    return np.stack([np.zeros((5, 5)), np.eye(5), np.diag([3.0, -1, 2, 2, 0]), tridiagonal, divided, reflected])


def is_close(matrices):
    values, vectors = eigenvectors(matrices)
    expected = np.linalg.eigvalsh(matrices)
    size = np.maximum(np.abs(expected).max(axis=1), 1e-300)
    assert (np.abs(values - expected) <= ROUNDING * size[:, None]).all()
    products = np.abs(matrices @ vectors - vectors * values[:, None, :])
    assert (products <= ROUNDING * size[:, None, None]).all()
    between = vectors.transpose(0, 2, 1) @ vectors
    np.testing.assert_allclose(between, np.broadcast_to(np.eye(matrices.shape[1]), between.shape), atol=ROUNDING)


@pytest.mark.parametrize("rows", [1, 2, 3, 10, MOST_ROWS, MOST_ROWS + 1])
def test_eigenvalues_of_random_matrices_of_any_number(rows):
    for count in (1, 16, 37):
        is_close(random_matrices(count, rows))


def test_eigenvalues_of_special_matrices():
    is_close(special_matrices())
    is_close(1e9 * special_matrices())


def test_all_frequencies_of_a_uniform_shear_chain():
    storeys = 10
    matrix = 2 * np.eye(storeys) - np.eye(storeys, k=1) - np.eye(storeys, k=-1)
    matrix[-1, -1] = 1.0
    mode = np.arange(1, storeys + 1)
    expected = 4 * np.sin((2 * mode - 1) * np.pi / (4 * storeys + 2)) ** 2
    turned = np.linalg.qr(np.random.default_rng(2).normal(size=(storeys, storeys)))[0]
    for each in (matrix, turned @ matrix @ turned.T):
        found, _ = eigenvectors(each[None])
        np.testing.assert_allclose(found[0], expected, rtol=1e-12)  # 180, the ratio of the eigenvalues, times rounding


def test_no_bit_of_a_matrix_depends_on_the_others():
    matrices = np.concatenate([random_matrices(20, 5), special_matrices()])
    whole = eigenvectors(matrices)
    for place in range(len(matrices)):
        for expected, found in zip(whole, eigenvectors(matrices[[place]]), strict=True):
            np.testing.assert_array_equal(found[0], expected[place])


def test_eigenvalues_above_a_limit():
    random = np.random.default_rng(0)
    basis = np.linalg.qr(random.normal(size=(20, 6, 6)))[0]
    eigenvalues = random.uniform(1.0, 2.0, (20, 6))
    eigenvalues[7, 3] = 1e-3
    matrices = (basis * eigenvalues[:, None, :]) @ basis.transpose(0, 2, 1)
    limits = np.zeros(20)
    assert have_only_eigenvalues_above(matrices, limits)
    limits[7] = 1e-3 - 1e-14  # rounding: 1e-15
    assert have_only_eigenvalues_above(matrices, limits)
    limits[7] = 1e-3 + 1e-14
    assert not have_only_eigenvalues_above(matrices, limits)
    assert not have_only_eigenvalues_above(np.full((1, 2, 2), np.nan), np.zeros(1))


def test_scaling_by_diagonal_and_other_masses():
    mass = np.random.default_rng(1).uniform(1e4, 3e4, (3, 4))[:, :, None] * np.eye(4)
    stiffness = random_matrices(3, 4)
    coupled = mass + 1e3
    for each in (mass, coupled):
        lower, scaled = scaled_stiffness(each, stiffness)
        whole = np.linalg.inv(lower)
        np.testing.assert_allclose(whole @ whole.transpose(0, 2, 1), each, rtol=1e-13, atol=1e-9)
        np.testing.assert_allclose(whole @ scaled @ whole.transpose(0, 2, 1), stiffness, rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(inverses(each) @ each, np.broadcast_to(np.eye(4), (3, 4, 4)), atol=1e-14)
    with pytest.raises(np.linalg.LinAlgError):
        scaled_stiffness(-mass, stiffness)
