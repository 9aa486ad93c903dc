"""Exponentials, logarithms and powers of kernels against numpy's in double precision."""

import numpy as np
import pytest
import warp as wp

from warpdyn.engine.device.exponentials import decay, exponential, logarithm_of_one_and, natural_logarithm, power_of
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.kernels.plan import DTYPES

pytestmark = pytest.mark.fast


def results(x, y, exponent, dtype_name):
    """Return e^x, log y and y^exponent, then e^-|x| and log(1 + y) of y up to 1, of values along an array."""
    dtype = DTYPES[dtype_name]

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(x: wp.array(dtype=dtype), y: wp.array(dtype=dtype), q: dtype, result: wp.array2d(dtype=dtype)):
        i = wp.tid()
        result[0, i] = exponential(x[i])
        result[1, i] = natural_logarithm(y[i])
        result[2, i] = power_of(y[i], q)
        result[3, i] = decay(wp.abs(x[i]))
        result[4, i] = logarithm_of_one_and(wp.where(y[i] > type(q)(1.0), type(q)(1.0), y[i]))

    given = [wp.array(np.asarray(values, dtype_name), dtype=dtype, device="cpu") for values in (x, y)]
    result = wp.full((5, len(x)), np.nan, dtype=dtype, device="cpu")
    wp.launch(loaded(evaluate), dim=len(x), inputs=[*given, exponent, result], device="cpu")
    return result.numpy()


@pytest.mark.parametrize("dtype_name", DTYPES)
def test_against_numpy(dtype_name):
    x = np.linspace(-86.9, 87.9, 100_001).astype(dtype_name)
    y = np.geomspace(1e-37, 1e38, x.size).astype(dtype_name)
    y[:1000] = np.linspace(0.7, 1.5, 1000)  # where a logarithm is about 0
    y[1000:2000] = np.linspace(1e-3, 1.0, 1000)
    exponentials, logarithms, powers, decays, of_one_and = results(x, y, 0.7, dtype_name)
    ulp = np.finfo(dtype_name).eps
    np.testing.assert_allclose(exponentials, np.exp(x.astype(float)), rtol=2 * ulp)
    np.testing.assert_allclose(logarithms, np.log(y.astype(float)), rtol=2 * ulp, atol=ulp / 8)
    least = 1e-34 if dtype_name == "float32" else 0.0
    np.testing.assert_allclose(decays, np.exp(-np.abs(x.astype(float))), rtol=2 * ulp, atol=least)
    small = np.minimum(y.astype(float), 1.0)
    absolute = {"float32": 0.0, "float64": ulp}[dtype_name]
    np.testing.assert_allclose(of_one_and, np.log1p(small), rtol=2 * ulp, atol=absolute)
    # A product of up to 62 is rounded before the exponential is taken of it.
    np.testing.assert_allclose(powers, y.astype(float) ** float(np.asarray(0.7, dtype_name)), rtol=100 * ulp)


@pytest.mark.parametrize("dtype_name", DTYPES)
def test_at_the_ends(dtype_name):
    x, y = [-np.inf, -800.0, 800.0, np.inf, np.nan], [0.0, 1.0, np.nan, 1.0, 1.0]
    exponentials, logarithms, powers, decays, of_one_and = results(x, y, 0.5, dtype_name)
    np.testing.assert_array_equal(exponentials, [0, 0, np.inf, np.inf, np.nan])
    np.testing.assert_array_equal(logarithms, [-np.inf, 0, np.nan, 0, 0])
    np.testing.assert_array_equal(powers, [0, 1, np.nan, 1, 1])
    assert np.all(decays[:4] < 1e-34)
    assert np.isnan(decays[4])
    assert of_one_and[0] == 0
    assert np.isnan(of_one_and[2])
    assert results([0.0], [0.0], 0.0, dtype_name)[2, 0] == 1
