"""Random numbers that depend only on seed, sample, purpose and a counter, not on the order of computation.

Philox4x32-10 (Salmon, Moraes, Dror and Shaw 2011, Parallel random numbers: as easy as 1, 2, 3, SC11) computes four
random 32-bit words from a counter of four words and a key of two words. In warpdyn the key is the seed, and the counter
consists of a running number, the purpose, and the index of the sample (two words). Therefore, a sample's random numbers
do not depend on how samples are divided among blocks, threads or devices. `warpdyn.engine.device.random_numbers` has
the same functions for kernels.
"""

from __future__ import annotations

import hashlib
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from warpdyn.foundations.core.thread_pool import cores, in_parts

# Salmon et al. 2011: number of rounds, multipliers of a round, and increments of the key between rounds.
ROUNDS, MULTIPLIERS, KEY_INCREMENTS = 10, (0xD2511F53, 0xCD9E8D57), (0x9E3779B9, 0xBB67AE85)
WORD = 2**32


class Purpose(IntEnum):
    """The purpose of a random number; numbers of different purposes are independent.

    Numbers that are drawn once per run, one after the other, come from a NumPy generator with the seed (seed, purpose).
    """

    STRUCTURE = 0  # parameters of a structure; `sample` is then the index of the structure
    CHOICE_OF_MOTION = 1
    GROUND_MOTION = 2
    POINTS = 3  # Sobol and Latin hypercube points, once per run
    CHECKED_SAMPLES = 4  # once per run
    PILOT_SAMPLES = 5  # once per plan
    LADDERS = 6  # first levels of the search for capacities; `sample` is then the index of the (motion, structure) pair
    GRID_POINTS = 7  # grid points of buildings, once per design
    RECORDS_OF_EARTHQUAKES = 8  # once per grid
    BETWEEN_EARTHQUAKES = 9  # residuals of intensity fields, once for all fields
    WITHIN_EARTHQUAKES = 10
    WIND = 17  # amplitudes of harmonics of the turbulence; the index is that of the force history
    SENSOR_NOISE = 16  # of a controlled structure; the counter is that of the sampling instant
    ROAD = 11  # phases of waves in a road profile; the index is that of the profile
    RARE_EVENTS = 12  # samples of subset simulation and importance sampling, once per call
    SYNTHETIC_PARAMETERS = 13  # parameters of synthetic motions; `sample` is then the index of the motion
    SYNTHETIC_NOISE = 14  # white noise of synthetic motions, as above
    RECORD_SELECTION = 15  # simulated spectra, once per target


def key_of(seed: int) -> int:
    """Return the 64-bit key of a seed: the seed if it is below 2^64, otherwise its hash."""
    if seed < 0:
        raise ValueError(f"seed must be at least 0, got {seed}")
    if seed < 2**64:
        return int(seed)
    seed = int(seed)
    return int.from_bytes(hashlib.sha256(seed.to_bytes((seed.bit_length() + 7) // 8, "little")).digest()[:8], "little")


def uniform_rows(seed: int, purpose: Purpose, rows: int, columns: int) -> np.ndarray:
    """Return the first rows x columns numbers of NumPy's generator with seed (seed, purpose), shape [row, column].

    The numbers are float32 in [0, 1). Each use of a seed has a different `purpose`, so that numbers of different uses
    are independent. Several threads compute the numbers; the result is the same as with one thread.
    """
    found = np.empty((rows, columns), np.float32)
    words = np.random.SeedSequence([seed, purpose])

    def fill(part: slice) -> None:
        # The generator makes two numbers from 64 bits. Each part but the last has an even number of rows, so that the
        # next part begins with the first number of such a pair.
        stream = np.random.PCG64(words).advance(part.start * columns // 2)
        np.random.Generator(stream).random(dtype=np.float32, out=found[part])

    in_parts(fill, rows, cores())
    return found


def philox_blocks(counter: ArrayLike, key: ArrayLike) -> np.ndarray:
    """Return the random 32-bit words that the generator Philox4x32-10 computes from counters and a key.

    Args:
        counter: Words of the counters, the least significant first, shape [4, ...].
        key: Words of the key, the least significant first, shape [2].

    Returns:
        Random words as uint32, shape [4, ...].
    """
    words = [np.asarray(word, dtype=np.uint64) for word in np.asarray(counter)]
    keys = [int(word) for word in np.asarray(key)]
    low, shift = np.uint64(WORD - 1), np.uint64(32)
    for _ in range(ROUNDS):
        products = [words[0] * np.uint64(MULTIPLIERS[0]), words[2] * np.uint64(MULTIPLIERS[1])]
        words = [
            (products[1] >> shift) ^ words[1] ^ np.uint64(keys[0]),
            products[1] & low,
            (products[0] >> shift) ^ words[3] ^ np.uint64(keys[1]),
            products[0] & low,
        ]
        keys = [(word + more) % WORD for word, more in zip(keys, KEY_INCREMENTS, strict=True)]
    return np.array(words, dtype=np.uint32)


def uniforms(seed: int, sample: ArrayLike, purpose: Purpose, counter: ArrayLike) -> np.ndarray:
    """Return two uniform random numbers per counter. They are odd multiples of 2^-53, so never exactly 0 or 1.

    Args:
        seed: Seed of the run.
        sample: Index of each sample in the run, shape [...].
        purpose: Purpose of the numbers.
        counter: Position in the sample's sequence of numbers, 0 to 2^32 - 1, shape [...].

    Returns:
        Numbers in (0, 1), shape [..., 2]; `sample` and `counter` are broadcast.
    """
    counter, key = np.asarray(counter, dtype=np.uint64), key_of(seed)
    sample, word = np.asarray(sample, dtype=np.uint64), np.uint64(WORD)
    parts = np.uint64(purpose), sample % word, sample // word
    counters = np.stack(np.broadcast_arrays(counter, *parts))
    words = philox_blocks(counters, (key % WORD, key // WORD)).astype(np.uint64)
    bits = (words[0::2] << np.uint64(20)) | (words[1::2] >> np.uint64(12))
    return np.moveaxis((bits.astype(np.float64) + 0.5) * 2.0**-52, 0, -1)


def normals(seed: int, sample: ArrayLike, purpose: Purpose, counter: ArrayLike) -> np.ndarray:
    """Return two standard normal random numbers per counter: the normal quantiles of `uniforms`."""
    return ndtri(uniforms(seed, sample, purpose, counter))
