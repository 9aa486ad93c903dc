"""Random numbers for kernels: each is a function of the seed, the sample, the purpose and a counter.

The numbers are equal to those of the NumPy version in `warpdyn.foundations.core.random_numbers`. All arithmetic is in
integers and float64, so that the numbers are the same on each device and for each dtype.
"""

import numpy as np
import warp as wp

from warpdyn.foundations.core.random_numbers import KEY_INCREMENTS, MULTIPLIERS, ROUNDS

Words = wp.types.vector(length=4, dtype=wp.uint32)
Polynomial = wp.types.vector(length=8, dtype=wp.float64)

FIRST_MULTIPLIER, SECOND_MULTIPLIER = (wp.constant(wp.uint64(value)) for value in MULTIPLIERS)
FIRST_INCREMENT, SECOND_INCREMENT = (wp.constant(wp.uint32(value)) for value in KEY_INCREMENTS)

# ln 2 as a sum of two constants: the first has few digits, so that integer multiples of it are exact. And the
# coefficients 2 / (2k + 1).
HIGH_LN2 = wp.constant(wp.float64(float.fromhex("0x1.62e42feep-1")))
LOW_LN2 = wp.constant(wp.float64(float.fromhex("0x1.a39ef35793c76p-33")))
ROOT_HALF = wp.constant(wp.int64(int(np.sqrt(0.5).view(np.int64))))
ARTANH = wp.constant(Polynomial(*(2.0 / (2 * k + 1) for k in range(1, 9))))
TWO_19THS, TWO_21STS = wp.constant(wp.float64(2.0 / 19.0)), wp.constant(wp.float64(2.0 / 21.0))
SPACING = wp.constant(wp.float64(2.0**-52))


@wp.func
def philox(counter: Words, first_key: wp.uint32, second_key: wp.uint32):
    """Return the 4 random words of 32 bits that the generator Philox4x32-10 (Salmon et al. 2011) computes.

    Args:
        counter: 4 words of 32 bits, lowest word first.
        first_key: Lower word of the key.
        second_key: Upper word of the key.
    """
    words = counter
    first = first_key
    second = second_key
    half = wp.uint64(32)
    for _ in range(wp.static(ROUNDS)):
        a = FIRST_MULTIPLIER * wp.uint64(words[0])
        b = SECOND_MULTIPLIER * wp.uint64(words[2])
        words = Words(
            wp.uint32(b >> half) ^ words[1] ^ first,
            wp.uint32(b),
            wp.uint32(a >> half) ^ words[3] ^ second,
            wp.uint32(a),
        )
        first += FIRST_INCREMENT
        second += SECOND_INCREMENT
    return words


@wp.func
def random_words(key: wp.uint64, sample: wp.uint64, purpose: int, counter: wp.uint32):
    """Return 4 random words of 32 bits.

    Args:
        key: Key that `key_of` computes from the seed.
        sample: Index of the sample in the run.
        purpose: Number of the quantity that the words are for; each purpose has its own random numbers.
        counter: Index of the words among the words of this sample and purpose.
    """
    half = wp.uint64(32)
    words = Words(counter, wp.uint32(purpose), wp.uint32(sample), wp.uint32(sample >> half))
    return philox(words, wp.uint32(key), wp.uint32(key >> half))


@wp.func
def uniform_of(high: wp.uint32, low: wp.uint32):
    """Return a uniform number in (0, 1) from two random words; it is an odd multiple of 2^-53, so neither 0 nor 1."""
    bits = (wp.uint64(high) << wp.uint64(20)) | (wp.uint64(low) >> wp.uint64(12))
    return (wp.float64(bits) + wp.float64(0.5)) * SPACING


@wp.func
def uniform_pair(key: wp.uint64, sample: wp.uint64, purpose: int, counter: wp.uint32):
    """Return two uniform random numbers in (0, 1); `random_words` explains the arguments."""
    words = random_words(key, sample, purpose, counter)
    return wp.vec2d(uniform_of(words[0], words[1]), uniform_of(words[2], words[3]))


# Wichura 1988, Algorithm AS 241 (PPND16), Applied Statistics 37(3), 477-484: numerators and denominators of rational
# functions, lowest power first, for numbers near the median, in the tails, and in the far tails.
A, B, C, D, E, F = (wp.constant(Polynomial(*row)) for row in (
    (
        3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3, 1.3731693765509461125e4,
        4.5921953931549871457e4, 6.7265770927008700853e4, 3.3430575583588128105e4, 2.5090809287301226727e3,
    ),
    (
        1.0, 4.2313330701600911252e1, 6.8718700749205790830e2, 5.3941960214247511077e3,
        2.1213794301586595867e4, 3.9307895800092710610e4, 2.8729085735721942674e4, 5.2264952788528545610e3,
    ),
    (
        1.42343711074968357734e0, 4.63033784615654529590e0, 5.76949722146069140550e0, 3.64784832476320460504e0,
        1.27045825245236838258e0, 2.41780725177450611770e-1, 2.27238449892691845833e-2, 7.74545014278341407640e-4,
    ),
    (
        1.0, 2.05319162663775882187e0, 1.67638483018380384940e0, 6.89767334985100004550e-1,
        1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4, 1.05075007164441684324e-9,
    ),
    (
        6.65790464350110377720e0, 5.46378491116411436990e0, 1.78482653991729133580e0, 2.96560571828504891230e-1,
        2.65321895265761230930e-2, 1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7,
    ),
    (
        1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2,
        7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7, 2.04426310338993978564e-15,
    ),
))  # fmt: skip


# Without a loop: a loop inside the loop over lanes would prevent the vectorisation over lanes.
@wp.func
def polynomial(c: Polynomial, x: wp.float64):
    return ((((((c[7] * x + c[6]) * x + c[5]) * x + c[4]) * x + c[3]) * x + c[2]) * x + c[1]) * x + c[0]


@wp.func
def chosen(is_first: bool, first: Polynomial, second: Polynomial):
    c = Polynomial()
    c[0] = wp.where(is_first, first[0], second[0])
    c[1] = wp.where(is_first, first[1], second[1])
    c[2] = wp.where(is_first, first[2], second[2])
    c[3] = wp.where(is_first, first[3], second[3])
    c[4] = wp.where(is_first, first[4], second[4])
    c[5] = wp.where(is_first, first[5], second[5])
    c[6] = wp.where(is_first, first[6], second[6])
    c[7] = wp.where(is_first, first[7], second[7])
    return c


@wp.func
def logarithm(x: wp.float64):
    """Return the natural logarithm of a normal number; a call of the C library would not be vectorised."""
    bits = wp.cast(x, wp.int64)
    exponent = (bits - ROOT_HALF) >> wp.int64(52)
    # x = 2^exponent (1 + f) with 1 + f from sqrt(1/2) to sqrt(2), and log(1 + f) = 2 artanh(s) with s = f / (2 + f).
    f = wp.cast(bits - (exponent << wp.int64(52)), wp.float64) - wp.float64(1.0)
    s = f / (f + wp.float64(2.0))
    square = s * s
    fourth = square * square * square * square
    rest = polynomial(ARTANH, square) + fourth * fourth * (TWO_19THS + square * TWO_21STS)
    half = wp.float64(0.5) * f * f
    # 2 artanh(s) = f - f^2 / 2 + s (f^2 / 2 + the rest); the first term is exact.
    small = s * (half + rest * square) + wp.float64(exponent) * LOW_LN2
    return wp.float64(exponent) * HIGH_LN2 + (f - (half - small))


@wp.func
def normal_of(probability: wp.float64):
    """Return the quantile of the standard normal distribution for a probability in (0, 1).

    All numbers are computed by the same statements with different coefficients, so that a CPU can vectorise over
    samples.
    """
    one = wp.float64(1.0)
    from_median = probability - wp.float64(0.5)
    is_central = wp.abs(from_median) <= wp.float64(0.425)
    tail = wp.sqrt(-logarithm(wp.min(probability, one - probability)))
    x = wp.where(is_central, wp.float64(0.180625) - from_median * from_median, tail - wp.float64(1.6))
    above = polynomial(chosen(is_central, A, C), x)
    below = polynomial(chosen(is_central, B, D), x)
    if tail > wp.float64(5.0):
        above = polynomial(E, tail - wp.float64(5.0))
        below = polynomial(F, tail - wp.float64(5.0))
    factor = wp.where(is_central, from_median, wp.where(from_median < wp.float64(0.0), -one, one))
    return factor * above / below


@wp.func
def normal_pair(key: wp.uint64, sample: wp.uint64, purpose: int, counter: wp.uint32):
    """Return two standard normal random numbers, computed from uniform numbers by the inverse distribution function."""
    uniforms = uniform_pair(key, sample, purpose, counter)
    return wp.vec2d(normal_of(uniforms[0]), normal_of(uniforms[1]))
