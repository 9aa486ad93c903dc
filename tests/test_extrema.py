"""Functions of one or two values in kernels against NumPy: extrema, bounds, reciprocals and updated values."""

import numpy as np
import pytest
import warp as wp

from warpdyn.engine.device.extrema import clamped, limited, maximum, minimum
from warpdyn.engine.device.processor import updated_float32, updated_float64
from warpdyn.engine.device.quotients import reciprocal

DEVICES = ["cpu", *(f"cuda:{number}" for number in range(min(1, wp.get_cuda_device_count())))]


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


@wp.kernel(module="unique", enable_backward=False)
def updated_values(
    changes: wp.array[wp.bool],
    a: wp.array[wp.float32],
    b: wp.array[wp.float64],
    kept_a: wp.array[wp.float32],
    kept_b: wp.array[wp.float64],
):
    i = wp.tid()
    kept_a[i] = updated_float32(changes[i], wp.float32(7.0), a[i])
    kept_b[i] = updated_float64(changes[i], wp.float64(7.0), b[i])


@pytest.mark.parametrize("device", DEVICES)
def test_updated_values_have_the_bits_of_the_old_or_the_new_value(device):
    values = np.array([-np.inf, -2.5, -1e-310, -1e-40, -0.0, 0.0, 1e-40, 1e-310, 1.1, np.inf])
    changes = np.arange(values.size) % 4 == 1
    given = [wp.array(values.astype(number), device=device) for number in (np.float32, np.float64)]
    kept = [wp.full(values.size, np.nan, dtype=each.dtype, device=device) for each in given]
    wp.launch(updated_values, values.size, [wp.array(changes, device=device), *given], kept, device=device)
    for found, old in zip(kept, given, strict=True):
        expected = np.where(changes, old.numpy().dtype.type(7.0), old.numpy())
        np.testing.assert_array_equal(found.numpy().view(np.uint8), expected.view(np.uint8))


@wp.kernel(module="unique", enable_backward=False)
def reciprocals_and_limited_values(
    x: wp.array[wp.float32], inverse: wp.array[wp.float32], inside: wp.array[wp.float32]
):
    i = wp.tid()
    inverse[i] = reciprocal(x[i])
    inside[i] = limited(x[i], wp.float32(2.0))


@pytest.mark.parametrize("device", DEVICES)
def test_reciprocals_and_limited_values(device):
    values = (np.random.default_rng(1).lognormal(0, 8, 1000) * np.tile([1, -1], 500)).astype(np.float32)
    inverse, inside = (wp.full(1000, np.nan, dtype=wp.float32, device=device) for _ in range(2))
    given = wp.array(values, device=device)
    wp.launch(reciprocals_and_limited_values, 1000, inputs=[given], outputs=[inverse, inside], device=device)
    # One unit in the last place: 2^-23 of a value at most.
    np.testing.assert_allclose(inverse.numpy(), 1 / values.astype(np.float64), rtol=2.0**-23)
    np.testing.assert_array_equal(inside.numpy(), np.clip(values, -2, 2))
