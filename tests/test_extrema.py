"""The smaller and the larger of two values, and a value within bounds, in kernels: held to NumPy's."""

import numpy as np
import pytest
import warp as wp

from warpdyn.engine.device.extrema import clamped, maximum, minimum


@wp.kernel(module="unique", enable_backward=False)
def extrema_of_pairs_32(a: wp.array[wp.float32], b: wp.array[wp.float32], out: wp.array2d[wp.float32]):
    i = wp.tid()
    out[0, i] = minimum(a[i], b[i])
    out[1, i] = maximum(a[i], b[i])
    out[2, i] = clamped(a[i], wp.float32(-1.0), b[i])


@wp.kernel(module="unique", enable_backward=False)
def extrema_of_pairs_64(a: wp.array[wp.float64], b: wp.array[wp.float64], out: wp.array2d[wp.float64]):
    i = wp.tid()
    out[0, i] = minimum(a[i], b[i])
    out[1, i] = maximum(a[i], b[i])
    out[2, i] = clamped(a[i], wp.float64(-1.0), b[i])


@pytest.mark.parametrize(("kernel", "number"), [(extrema_of_pairs_32, np.float32), (extrema_of_pairs_64, np.float64)])
def test_extrema_are_numpys(kernel, number):
    values = np.array([-np.inf, -2.5, -1.0, -1e-30, 0.0, 1e-30, 1.0, 2.5, np.inf], number)
    a, b = (pairs.ravel() for pairs in np.meshgrid(values, values[values >= -1.0]))
    out = wp.full((3, a.size), np.nan, dtype=kernel.adj.args[0].type.dtype, device="cpu")
    wp.launch(kernel, a.size, inputs=[wp.array(a, device="cpu"), wp.array(b, device="cpu"), out], device="cpu")
    # Each is one of the values compared, so no tolerance.
    np.testing.assert_array_equal(out.numpy(), [np.minimum(a, b), np.maximum(a, b), np.clip(a, -1.0, b)])
