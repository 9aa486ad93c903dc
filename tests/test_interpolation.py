"""Motions that a device interpolates have the values of `numpy.interp`."""

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.engine.kernels import arguments
from warpdyn.engine.kernels.auxiliary.interpolation import interpolated


@pytest.mark.fast
@pytest.mark.parametrize("finer", [2, 3, 8])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_values_between_samples(dtype, finer):
    random = np.random.default_rng(finer)
    motions = [wd.GroundMotion(random.normal(size=size), 0.01) for size in (7, 20, 2)]
    excitation = wd.Cloud(motions)
    timeline = excitation.timeline(None, 0.01, resample=False)
    given = excitation.pack(timeline, 1)
    load = interpolated(arguments.brought("Load", given, dtype, "cpu"), dtype, finer)
    rounding = 4 * np.finfo(dtype).eps
    for motion, first, intervals in zip(motions, load.first.numpy(), load.intervals.numpy(), strict=True):
        size = len(motion.acceleration)
        assert intervals == finer * (size - 1)
        expected = np.interp(np.arange(finer * (size - 1) + 1) / finer, np.arange(size), motion.acceleration)
        np.testing.assert_allclose(load.values.numpy()[first : first + intervals + 1], expected, atol=4 * rounding)
    np.testing.assert_array_equal(load.initial_displacement.numpy(), given["initial_displacement"])
