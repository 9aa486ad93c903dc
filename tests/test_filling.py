"""Memory of a GPU is filled by a kernel, here in the memory of the processor."""

import numpy as np
import pytest
import warp as wp

from warpdyn.engine.device.filling import as_words, filling_kernel, word_of
from warpdyn.engine.kernels import kernel_cache


@pytest.mark.parametrize("dtype", [wp.float32, wp.float64, wp.int32])
def test_memory_is_filled_with_blank_values(dtype):
    array = wp.array(np.ones((3, 5)), dtype=dtype, device="cpu")
    value = 7 if dtype is wp.int32 else np.nan
    words = as_words(array)
    wp.launch(kernel_cache.loaded(filling_kernel()), words.size, [words, word_of(value)], device="cpu")
    np.testing.assert_array_equal(array.numpy(), np.full((3, 5), value))
