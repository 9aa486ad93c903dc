"""The smaller and the larger of two values, and a value limited by two bounds, for functions that run in kernels.

If one value is NaN, Warp's `wp.min`, `wp.max` and `wp.clamp` return the other value, which takes one instruction on a
GPU and three or four on a CPU. The functions in this module take one instruction per comparison on a CPU, too. If one
value is NaN, they return either of the two values; a sample with NaN has diverged, and its status shows this.
"""

import warp as wp


def _on_either(on_gpu: str, on_processor: str) -> str:
    """Return C++ code that contains one expression for a GPU and other statements for a CPU."""
    return f"#if defined(__CUDA_ARCH__)\nreturn {on_gpu};\n#else\n{on_processor}\n#endif\n"


_MINIMUM = _on_either("fmin(a, b)", "return a < b ? a : b;")
_MAXIMUM = _on_either("fmax(a, b)", "return a > b ? a : b;")
_CLAMPED = _on_either("fmin(fmax(x, low), high)", "x = x > low ? x : low;\nreturn x < high ? x : high;")
_LIMITED = _on_either("fmin(fmax(x, -limit), limit)", "x = x > -limit ? x : -limit;\nreturn x < limit ? x : limit;")


@wp.func_native(_MINIMUM)
def minimum(a: wp.float32, b: wp.float32) -> wp.float32: ...


@wp.func_native(_MINIMUM)
def minimum(a: wp.float64, b: wp.float64) -> wp.float64: ...  # noqa: F811 (Warp's overload)


@wp.func_native(_MAXIMUM)
def maximum(a: wp.float32, b: wp.float32) -> wp.float32: ...


@wp.func_native(_MAXIMUM)
def maximum(a: wp.float64, b: wp.float64) -> wp.float64: ...  # noqa: F811 (Warp's overload)


@wp.func_native(_CLAMPED)
def clamped(x: wp.float32, low: wp.float32, high: wp.float32) -> wp.float32: ...


@wp.func_native(_CLAMPED)
def clamped(x: wp.float64, low: wp.float64, high: wp.float64) -> wp.float64: ...  # noqa: F811 (Warp's overload)


# `clamped(x, -limit, limit)`; Warp compiles -limit as a subtraction from zero, which takes an instruction.
@wp.func_native(_LIMITED)
def limited(x: wp.float32, limit: wp.float32) -> wp.float32: ...


@wp.func_native(_LIMITED)
def limited(x: wp.float64, limit: wp.float64) -> wp.float64: ...  # noqa: F811 (Warp's overload)


# `x` if `sign` is positive, else `-x`.
_FLIPPED = "__uint_as_float(__float_as_uint(x) ^ (__float_as_uint(sign) & 0x80000000u))"


@wp.func_native(_on_either(_FLIPPED, "return __builtin_copysignf(1.0f, sign) * x;"))
def times_sign_of(x: wp.float32, sign: wp.float32) -> wp.float32: ...


@wp.func_native(_on_either("copysign(1.0, sign) * x", "return __builtin_copysign(1.0, sign) * x;"))
def times_sign_of(x: wp.float64, sign: wp.float64) -> wp.float64: ...  # noqa: F811 (Warp's overload)
