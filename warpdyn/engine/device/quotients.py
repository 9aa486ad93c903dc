"""The reciprocal of a value, for kernels that compute many of them.

On a GPU `1 / x` in float32 is correctly rounded, which takes about 9 instructions. The instruction for reciprocals has
an error of at most one unit in the last place (NVIDIA, PTX ISA, `rcp.approx`); values below 1.2e-38 count as zero.
"""

import warp as wp

_APPROXIMATE = """
#if defined(__CUDA_ARCH__)
float result;
asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(result) : "f"(x));
return result;
#else
return 1.0f / x;
#endif
"""


@wp.func_native(_APPROXIMATE)
def reciprocal(x: wp.float32) -> wp.float32: ...


@wp.func_native("return 1.0 / x;")
def reciprocal(x: wp.float64) -> wp.float64: ...  # noqa: F811 (Warp's overload)
