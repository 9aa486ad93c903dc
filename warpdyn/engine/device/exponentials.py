"""Exponentials and logarithms in single precision, written so that a CPU compiler can vectorise loops that call them.

A CPU thread integrates several samples at once, one in each lane of a vector register. The compiler does not vectorise
loops over lanes that call functions of the C library. On a GPU and in double precision the functions of the C library
are used. Arguments of logarithms and powers are 0 or positive normal numbers.
"""

from typing import Any

import warp as wp

# e^r for |r| <= log(2) / 2, in the variable `sum`.
_E_TO_R = """float sum = 1.9875691500e-4f;
sum = sum * r + 1.3981999507e-3f;
sum = sum * r + 8.3334519073e-3f;
sum = sum * r + 4.1665795894e-2f;
sum = sum * r + 1.6666665459e-1f;
sum = sum * r + 5.0000001201e-1f;
sum = sum * r * r + r + 1.0f;
"""


# Cephes' expf (Moshier 1989), error within 1.5 units in the last place: e^x = 2^k e^r with |r| <= log(2) / 2.
@wp.func_native(
    """
#if defined(__CUDA_ARCH__)
return expf(x);
#else
float bounded = x > 88.0f ? 88.0f : x;
bounded = bounded < -87.0f ? -87.0f : bounded;
float k = __builtin_rintf(bounded * 1.44269504f);
float r = bounded - 0.693359375f * k + 2.12194440e-4f * k;
"""
    + _E_TO_R
    + """float value = sum * __builtin_bit_cast(float, ((int)k + 127) << 23);
value = x > 88.0f ? INFINITY : value;
return x < -87.0f ? 0.0f : value;
#endif
"""
)
def exponential(x: wp.float32) -> wp.float32: ...


@wp.func_native("return exp(x);")
def exponential(x: wp.float64) -> wp.float64: ...  # noqa: F811


# e^-x for x >= 0. Because x has a sign that is known, the argument needs only one bound.
@wp.func_native(
    """
#if defined(__CUDA_ARCH__)
return expf(-x);
#else
float bounded = x > 80.0f ? 80.0f : x;
float k = __builtin_rintf(bounded * -1.44269504f);
float r = -bounded - 0.693359375f * k + 2.12194440e-4f * k;
"""
    + _E_TO_R
    + """return sum * __builtin_bit_cast(float, ((int)k + 127) << 23);
#endif
"""
)
def decay(x: wp.float32) -> wp.float32:
    """Return e^-x for x >= 0. For x > 80, return 2e-35, because products of smaller numbers may be subnormal (slow)."""


@wp.func_native("return exp(-x);")
def decay(x: wp.float64) -> wp.float64: ...  # noqa: F811


# Cephes' logf: log x = e log 2 + log(1 + m) with 1 + m from sqrt(1/2) to sqrt(2).
@wp.func_native("""
#if defined(__CUDA_ARCH__)
return logf(x);
#else
int bits = __builtin_bit_cast(int, x);
float m = __builtin_bit_cast(float, (bits & 0x007fffff) | 0x3f000000);
bool small = m < 0.707106781f;
float e = (float)((bits >> 23) - 126 - (small ? 1 : 0));
m = (small ? m + m : m) - 1.0f;
float z = m * m;
float sum = 7.0376836292e-2f;
sum = sum * m - 1.1514610310e-1f;
sum = sum * m + 1.1676998740e-1f;
sum = sum * m - 1.2420140846e-1f;
sum = sum * m + 1.4249322787e-1f;
sum = sum * m - 1.6668057665e-1f;
sum = sum * m + 2.0000714765e-1f;
sum = sum * m - 2.4999993993e-1f;
sum = sum * m + 3.3333331174e-1f;
sum = sum * m * z - 2.12194440e-4f * e - 0.5f * z;
float value = m + sum + 0.693359375f * e;
return x > 0.0f ? value : x - INFINITY;
#endif
""")
def natural_logarithm(x: wp.float32) -> wp.float32: ...


@wp.func_native("return log(x);")
def natural_logarithm(x: wp.float64) -> wp.float64: ...  # noqa: F811


# log(1 + x) / x by a polynomial through Chebyshev points. Error: 2 units in the last place;
# in double precision one unit in the last place of the number 1.
@wp.func_native("""
#if defined(__CUDA_ARCH__)
return log1pf(x);
#else
float sum = 5.253457930e-3f;
sum = sum * x - 2.958850749e-2f;
sum = sum * x + 7.836166769e-2f;
sum = sum * x - 1.367477030e-1f;
sum = sum * x + 1.911143064e-1f;
sum = sum * x - 2.484436929e-1f;
sum = sum * x + 3.331927061e-1f;
sum = sum * x - 4.999950230e-1f;
return (sum * x + 1.0f) * x;
#endif
""")
def logarithm_of_one_and(x: wp.float32) -> wp.float32:
    """Return log(1 + x) for x from 0 to 1."""


@wp.func_native("return log(1.0 + x);")
def logarithm_of_one_and(x: wp.float64) -> wp.float64: ...  # noqa: F811


@wp.func
def power_of(x: Any, exponent: Any):
    """Return x to the power of `exponent`; both are at least 0, and 0 to the power of 0 is 1."""
    zero = type(x)(0.0)
    of_zero = wp.where(exponent == zero, type(x)(1.0), zero)
    return wp.where(x == zero, of_zero, exponential(exponent * natural_logarithm(x)))
