"""Statistics of many streams of random normals, computed on the device that draws them, without storing a number.

`python tests/random_streams.py 1000000 10000 [device]` prints the p-value of each test.
"""

from __future__ import annotations

import sys

import numpy as np
import warp as wp
from scipy import stats
from scipy.special import kolmogorov

from warpdyn.engine.device.random_numbers import normal_pair
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.foundations.core.random_numbers import Purpose, key_of

BINS = 256
BINS_AS_FLOAT = wp.constant(wp.float64(BINS))
Counts = wp.types.vector(length=BINS, dtype=wp.int32)
ROOT_HALF = wp.constant(wp.float64(np.sqrt(0.5)))
LEAST_P_VALUE = 1e-4  # a false alarm in ten thousand runs; fixed seeds give the same answer every time


@wp.kernel(enable_backward=False)
def gather(
    key: wp.uint64,
    first: wp.uint64,
    neighbour: wp.uint64,
    pairs: int,
    scale: wp.float64,
    moments: wp.array2d(dtype=wp.float64),
    product: wp.array(dtype=wp.float64),
    chi_square: wp.array(dtype=wp.float64),
    pooled: wp.array(dtype=wp.int64),
):
    stream = wp.tid()
    sample = first + wp.uint64(stream)
    counts = Counts()
    hermite = wp.vec4d()
    squares = wp.float64(0.0)
    both = wp.float64(0.0)
    one, three, six = wp.float64(1.0), wp.float64(3.0), wp.float64(6.0)
    for pair in range(pairs):
        here = normal_pair(key, sample, Purpose.GROUND_MOTION, wp.uint32(pair))
        there = normal_pair(key, sample + neighbour, Purpose.GROUND_MOTION, wp.uint32(pair))
        for side in range(2):
            x = scale * here[side]
            square = x * x
            both += x * there[side]
            squares += square
            hermite += wp.vec4d(x, square - one, x * (square - three), square * (square - six) + three)
            below = wp.float64(0.5) * wp.erfc(-x * ROOT_HALF)
            bin = wp.min(int(below * BINS_AS_FLOAT), BINS - 1)
            counts[bin] += 1
    expected = wp.float64(2 * pairs) / BINS_AS_FLOAT
    spread = wp.float64(0.0)
    for b in range(BINS):
        wp.atomic_add(pooled, b, wp.int64(counts[b]))
        spread += (wp.float64(counts[b]) - expected) * (wp.float64(counts[b]) - expected) / expected
    for order in range(4):
        moments[order, stream] = hermite[order]
    moments[4, stream] = squares
    product[stream] = both
    chi_square[stream] = spread


def p_values(
    streams: int, length: int, *, seed: int = 0, first: int = 0, neighbour: int = 1, scale: float = 1.0, device="cpu"
) -> dict[str, float]:
    """Return the p-value of each test of `streams` neighbouring streams of `length` standard normals.

    Args:
        streams: Number of streams.
        length: Number of normals in each, which is even.
        seed: Seed of all streams.
        first: Index of the first stream.
        neighbour: Distance of the stream that each is correlated with.
        scale: Factor on the normals; the tests must detect any other than 1.
        device: Warp device.
    """
    moments, product, chi_square = (
        wp.full(shape, np.nan, dtype=wp.float64, device=device) for shape in ((5, streams), streams, streams)
    )
    pooled = wp.zeros(BINS, dtype=wp.int64, device=device)
    arguments = [key_of(seed), first, neighbour, length // 2, scale, moments, product, chi_square, pooled]
    wp.launch(loaded(gather, device), dim=streams, inputs=arguments, device=device)
    hermite, squares, count = moments.numpy()[:4], moments.numpy()[4], streams * length
    # Hermite polynomials of standard normals are uncorrelated, of mean 0 and variance k!.
    scores = hermite.sum(axis=1) / np.sqrt(np.array([1, 2, 6, 24]) * count)
    found = {f"moment {k + 1}": 2 * stats.norm.sf(abs(score)) for k, score in enumerate(scores)}
    # Of each stream, exactly: its mean is normal, its squares add up to a chi-square, and so does its product with a
    # neighbour, over the root of its own squares, to a normal.
    found["means of streams"] = stats.kstest(hermite[0] / np.sqrt(length), "norm").pvalue
    found["variances of streams"] = stats.kstest(squares, stats.chi2(length).cdf).pvalue
    found["correlation of neighbours"] = stats.kstest(product.numpy() / np.sqrt(squares), "norm").pvalue
    # Pearson's statistic of equal bins has this mean and variance exactly.
    mean, variance = BINS - 1, 2 * (BINS - 1) * (1 - 1 / length)
    score = (chi_square.numpy().sum() - streams * mean) / np.sqrt(streams * variance)
    found["chi-square of streams"] = 2 * stats.norm.sf(abs(score))
    # The largest distance at the edges of bins is at most that of Kolmogorov and Smirnov, its p-value so at least.
    cumulative = np.cumsum(pooled.numpy()) / count
    distance = np.abs(cumulative - np.arange(1, BINS + 1) / BINS).max()
    found["Kolmogorov-Smirnov"] = float(kolmogorov(np.sqrt(count) * distance))
    return found


if __name__ == "__main__":
    asked = [int(argument) for argument in sys.argv[1:3]]
    for name, value in p_values(*asked, device=sys.argv[3] if len(sys.argv) > 3 else None).items():
        print(f"{name:<28} p = {value:.4f}")
