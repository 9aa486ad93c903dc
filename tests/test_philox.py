"""Random numbers against published answers, mpmath's quantiles and the distributions of their own statistics."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp
from random_streams import LEAST_P_VALUE, p_values

from warpdyn.engine.device.random_numbers import Words, normal_of, normal_pair, philox, uniform_of, uniform_pair
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.foundations.core import random_numbers as looked_up
from warpdyn.foundations.core.random_numbers import Purpose, key_of, uniform_rows

pytestmark = pytest.mark.fast

# Random123 1.14, tests/kat_vectors, rows "philox4x32 10": counter, key, answer.
KNOWN = [
    ([0] * 4, [0] * 2, [0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8]),
    ([0xFFFFFFFF] * 4, [0xFFFFFFFF] * 2, [0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD]),
    (
        [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344],
        [0xA4093822, 0x299F31D0],
        [0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1],
    ),
]


@wp.kernel(enable_backward=False)
def known_answers(counter: wp.array(dtype=Words), key: wp.array2d(dtype=wp.uint32), answer: wp.array(dtype=Words)):
    i = wp.tid()
    answer[i] = philox(counter[i], key[i, 0], key[i, 1])


@wp.kernel(enable_backward=False)
def look_up(
    key: wp.uint64,
    sample: wp.array(dtype=wp.uint64),
    counter: wp.array(dtype=wp.uint32),
    uniforms: wp.array(dtype=wp.vec2d),
    normals: wp.array(dtype=wp.vec2d),
):
    i = wp.tid()
    uniforms[i] = uniform_pair(key, sample[i], Purpose.GROUND_MOTION, counter[i])
    normals[i] = normal_pair(key, sample[i], Purpose.GROUND_MOTION, counter[i])


@wp.kernel(enable_backward=False)
def quantiles(probability: wp.array(dtype=wp.float64), normal: wp.array(dtype=wp.float64)):
    normal[wp.tid()] = normal_of(probability[wp.tid()])


@wp.kernel(enable_backward=False)
def of_words(word: wp.array2d(dtype=wp.uint32), uniform: wp.array(dtype=wp.float64)):
    uniform[wp.tid()] = uniform_of(word[wp.tid(), 0], word[wp.tid(), 1])


def test_published_known_answers(measured):
    counter, key, answer = (np.array(rows, dtype=np.uint32) for rows in zip(*KNOWN, strict=True))
    found = wp.zeros(len(KNOWN), dtype=Words, device="cpu")
    counters = wp.array(counter, dtype=Words, device="cpu")
    wp.launch(
        loaded(known_answers), dim=len(KNOWN), inputs=[counters, wp.array(key, device="cpu"), found], device="cpu"
    )
    measured(
        "words of Philox4x32-10 that differ",
        truth="known answers of Random123 (Salmon and others 2011)",
        value=np.count_nonzero(found.numpy() != answer),
        bound=0,
    )
    for row in range(len(KNOWN)):
        np.testing.assert_array_equal(looked_up.philox_blocks(counter[row], key[row]), answer[row])


@pytest.mark.parametrize("seed", [0, 7, 2**64 - 1, 2**64, 10**40])
def test_device_and_host_look_up_the_same_numbers(seed):
    samples = np.array([0, 1, 12345, 2**32 - 1, 2**32, 2**32 + 1, 2**63 + 5], dtype=np.uint64)
    counters = np.array([0, 1, 2, 2**31, 2**32 - 1, 0, 9], dtype=np.uint32)
    uniforms, normals = (wp.full(samples.size, wp.vec2d(np.nan, np.nan), dtype=wp.vec2d, device="cpu") for _ in "ab")
    arguments = [key_of(seed), wp.array(samples, device="cpu"), wp.array(counters, device="cpu"), uniforms, normals]
    wp.launch(loaded(look_up), dim=samples.size, inputs=arguments, device="cpu")
    for found, expected, tolerance in ((uniforms, "uniforms", 0), (normals, "normals", 2e-15)):
        due = [
            getattr(looked_up, expected)(seed, int(sample), Purpose.GROUND_MOTION, int(counter))
            for sample, counter in zip(samples, counters, strict=True)
        ]
        np.testing.assert_allclose(found.numpy(), due, rtol=tolerance, atol=0)


def test_seed_sample_purpose_and_counter_all_tell():
    base = looked_up.uniforms(3, 4, Purpose.STRUCTURE, [0, 1])
    others = [
        looked_up.uniforms(4, 4, Purpose.STRUCTURE, [0, 1]),
        looked_up.uniforms(3 + 2**32, 4, Purpose.STRUCTURE, [0, 1]),
        looked_up.uniforms(3 + 2**64, 4, Purpose.STRUCTURE, [0, 1]),
        looked_up.uniforms(3 + 2**65, 4, Purpose.STRUCTURE, [0, 1]),
        looked_up.uniforms(3, 5, Purpose.STRUCTURE, [0, 1]),
        looked_up.uniforms(3, 4 + 2**32, Purpose.STRUCTURE, [0, 1]),
        looked_up.uniforms(3, 4, Purpose.GROUND_MOTION, [0, 1]),
        looked_up.uniforms(3, 4, Purpose.STRUCTURE, [2, 3]),
    ]
    values = np.ravel([base, *others])
    assert np.unique(values).size == values.size
    with pytest.raises(ValueError, match="at least 0"):
        key_of(-1)


def test_uniforms_leave_out_zero_and_one():
    words = np.array([[0, 0], [0xFFFFFFFF, 0xFFFFFFFF], [0, 1 << 12], [0x80000000, 0]], dtype=np.uint32)
    found = wp.full(len(words), np.nan, dtype=wp.float64, device="cpu")
    wp.launch(loaded(of_words), dim=len(words), inputs=[wp.array(words, device="cpu"), found], device="cpu")
    # All bits of a float64 count: the next number below 1 is 1 - 2^-53.
    np.testing.assert_array_equal(found.numpy(), [2.0**-53, 1 - 2.0**-53, 3 * 2.0**-53, 0.5 + 2.0**-53])


def test_normals_are_the_quantiles():
    # mpmath at 60 digits, of the probabilities as float64 has them: tails, both sides of each seam, near the median.
    rows = [
        (1.1102230246251565e-16, -8.2095361516013868556),
        (1e-30, -11.46402468844361572),
        (1e-15, -7.9413453261709967713),
        (1e-11, -6.7060231554951362961),
        (2e-11, -6.6040775904056342776),
        (1e-05, -4.2648907939228246102),
        (0.001, -3.0902323061678135354),
        (0.0625, -1.5341205443525463117),
        (0.0751, -1.4388253927525399824),
        (0.25, -0.6744897501960817432),
        (0.4999999, -2.5066282747031065135e-7),
        (0.5000000000000001, 2.7829164246717669222e-16),
        (0.75, 0.6744897501960817432),
        (0.925, 1.4395314709384562291),
        (0.999, 3.0902323061678132778),
        (0.9999999999999999, 8.2095361516013868556),
    ]
    probability, due = np.array(rows).T
    found = wp.full(len(rows), np.nan, dtype=wp.float64, device="cpu")
    wp.launch(loaded(quantiles), dim=len(rows), inputs=[wp.array(probability, device="cpu"), found], device="cpu")
    np.testing.assert_allclose(found.numpy(), due, rtol=1e-15, atol=0)


def test_streams_are_independent_standard_normals():
    found = p_values(20_000, 500, seed=1)
    assert min(found.values()) > LEAST_P_VALUE, found


def test_streams_across_a_word_of_the_index():
    found = p_values(2_000, 500, seed=2**70, first=2**32 - 1_000)
    assert min(found.values()) > LEAST_P_VALUE, found


def test_the_tests_of_streams_can_fail():
    found = p_values(2_000, 500, seed=1, neighbour=0, scale=1.01)
    spoiled = ("moment 2", "variances of streams", "correlation of neighbours", "Kolmogorov-Smirnov")
    assert all(found[name] < LEAST_P_VALUE for name in spoiled), found


@pytest.mark.parametrize("columns", [1, 2, 7, 25])
@pytest.mark.parametrize("rows", [1, 2 * 8192, 3 * 8192 + 1])  # of which the threads make 8192 at a time
def test_numbers_made_side_by_side_are_those_of_one_stream(rows, columns):
    expected = np.random.default_rng([3, Purpose.GRID_POINTS]).random((rows, columns), dtype=np.float32)
    assert np.array_equal(uniform_rows(3, Purpose.GRID_POINTS, rows, columns), expected)
