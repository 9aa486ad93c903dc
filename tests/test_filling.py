"""Memory of a GPU is filled by a kernel, here in the memory of the processor."""

import numpy as np
import pytest
import warp as wp

from warpdyn.engine.device.filling import as_words, filling_kernel, word_of
from warpdyn.engine.kernels import kernel_cache


@pytest.mark.parametrize(("dtype", "value"), [(wp.float32, np.nan), (wp.float64, np.nan), (wp.int32, -1), (wp.int8, 3)])
def test_memory_is_filled_with_blank_values(dtype, value):
    array = wp.array(np.ones((3, 5)), dtype=dtype, device="cpu")
    words = as_words(array)
    kernel = kernel_cache.loaded(filling_kernel(words.dtype))
    wp.launch(kernel, words.size, [words, word_of(value)], device="cpu")
    np.testing.assert_array_equal(array.numpy(), np.full((3, 5), value))
