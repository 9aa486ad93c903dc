"""Frequencies of many chains from the kernel: closed forms, scipy, and exact counts of eigenvalues in fractions."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import warp as wp
from scipy.linalg import eigh_tridiagonal
from validation import relative_difference

from warpdyn.engine.kernels.auxiliary.frequencies import circular_frequencies, frequencies_kernel
from warpdyn.engine.kernels.kernel_cache import loaded

# All that the algorithm does to a frequency is to multiply, divide and add what is positive, some 10 times a storey.
ROUNDING = 1e-14


def random_chains(storeys, count, seed, spread=1e3):
    random = np.random.default_rng([seed, storeys])
    mass = random.uniform(1e3, 1e5, (count, storeys))
    return mass, 1e8 * spread ** random.uniform(-0.5, 0.5, (count, storeys))


def count_below(mass, stiffness, eigenvalue):
    """Return how many eigenvalues are below a number: the negative pivots of K - x M (Sylvester), without rounding."""
    above, count, pivot = [*stiffness[1:], Fraction(0)], 0, None
    for m, k, k_above in zip(mass, stiffness, above, strict=True):
        pivot = k + k_above - eigenvalue * m - (k**2 / pivot if pivot is not None else 0)
        count += pivot < 0
    return count


@pytest.mark.parametrize("storeys", [1, 2, 3, 5, 60])
def test_uniform_chains(storeys, measured):
    mass, stiffness = np.full((2, storeys), 3.0), np.full((2, storeys), 12.0)
    stiffness[1] *= 100
    closed = 2 * np.sin((2 * np.arange(1, storeys + 1) - 1) * np.pi / (4 * storeys + 2))
    measured(
        "circular frequencies of uniform chains of 1 to 60 storeys, by the kernel",
        truth="closed form, 2 sqrt(k / m) sin((2 i - 1) pi / (4 n + 2))",
        value=relative_difference(circular_frequencies(mass, stiffness), np.outer([2, 20], closed)),
        bound=ROUNDING,
    )


@pytest.mark.parametrize("storeys", [1, 2, 3, 5, 20, 60])
def test_random_chains_are_scipy_s(storeys):
    mass, stiffness = random_chains(storeys, 37, 0)
    found = circular_frequencies(mass, stiffness)
    assert found.shape == mass.shape
    for m, k, omega in zip(mass, stiffness, found, strict=True):
        diagonal, beside = (k + np.append(k[1:], 0)) / m, -k[1:] / np.sqrt(m[:-1] * m[1:])
        # It is scipy that errs: by the rounding of the greatest eigenvalue, of the least the more.
        error = 1e-12 * np.max(diagonal) / omega
        assert np.all(np.abs(omega - np.sqrt(np.abs(eigh_tridiagonal(diagonal, beside, eigvals_only=True)))) < error)


@pytest.mark.parametrize(("storeys", "spread"), [(1, 1e3), (2, 1e3), (5, 1e3), (12, 1e12), (60, 1e3)])
def test_every_frequency_is_where_exact_counts_say(storeys, spread):
    """Nothing is rounded here but the frequency itself: from just below to just above it there is one eigenvalue."""
    mass, stiffness = random_chains(storeys, 1, 1, spread)
    [omega] = circular_frequencies(mass, stiffness)
    chain = [[Fraction(value) for value in values[0].tolist()] for values in (mass, stiffness)]
    near = Fraction(ROUNDING)
    for mode in range(0, storeys, max(1, storeys // 12)):
        exact = Fraction(float(omega[mode]))
        assert count_below(*chain, (exact * (1 - near)) ** 2) == mode
        assert count_below(*chain, (exact * (1 + near)) ** 2) == mode + 1


def test_frequencies_that_are_alike_or_of_light_appendages():
    weak = np.ones((1, 12))
    weak[:, ::2] = 1e-9  # pairs of floors on soft storeys: six frequencies within 1e-9 of each other
    found = circular_frequencies(np.ones((1, 12)), weak)[0]
    np.testing.assert_allclose(found[6:], np.sqrt(2), rtol=2e-9)
    light = np.array([[1.0, 1.0, 1e-20]])
    found = circular_frequencies(light, np.ones((1, 3)))[0]
    # The light mass moves by itself at 1e10 rad/s, and the others as if it were not there.
    np.testing.assert_allclose(found, [0.6180339887498949, 1.618033988749895, 1e10], rtol=ROUNDING)


def test_a_chain_s_frequencies_do_not_depend_on_those_beside_it():
    mass, stiffness = random_chains(7, 50, 2)
    stiffness[10:12] = np.linspace(1, 1e9, 7)  # which take more iterations
    whole = circular_frequencies(mass, stiffness)
    for part in (slice(0, 1), slice(9, 13), slice(17, 50)):
        assert circular_frequencies(mass[part], stiffness[part]).tobytes() == whole[part].tobytes()


def test_the_kernel_writes_every_value():
    mass, stiffness = (np.ascontiguousarray(values.T) for values in random_chains(4, 16, 3))
    found = np.full((4, 16), np.nan)
    arrays = [wp.array(values, copy=False, device="cpu") for values in (mass, stiffness, found)]
    wp.launch(loaded(frequencies_kernel(16, 16)), dim=1, inputs=[4, *arrays], device="cpu")
    assert np.all(np.diff(found, axis=0) > 0)
