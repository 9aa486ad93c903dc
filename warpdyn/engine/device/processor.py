"""Functions in native code that Warp lacks: maxima in one instruction, aligned rows, values of other threads."""

import functools

import numpy as np
import warp as wp

FEWEST_LANES = 8  # of a thread that has several


def cpu_flags(keeps_lanes: bool = True) -> str:
    """Return the compiler's flags for kernels on a processor: those that Warp is configured with, and warpdyn's.

    Products and sums are fused, as a GPU does by itself; and rows take registers of 512 bits where there are any, of
    which the compiler makes no use on some processors by default, at half the speed.

    Args:
        keeps_lanes: Whether no loops but those over lanes have 8 rounds and more. Then these are kept as loops for the
            compiler's part that makes vector instructions of loops: short ones would be unrolled before, and what
            another part (SLP) makes of that takes up to a fifth longer to run, and long to compile.
    """
    configured = wp.config.cpu_compiler_flags
    # Without any, Warp itself compiles for the processor at hand.
    own = "-march=native" if configured is None else configured
    as_loops = f" -fno-slp-vectorize -mllvm=-unroll-full-max-count={FEWEST_LANES - 1}" if keeps_lanes else ""
    return f"{own} -ffp-contract=fast -mprefer-vector-width=512{as_loops}".strip()


def has_wide_registers() -> bool:
    """Return whether kernels on this machine's processor are compiled for vector registers of 512 bits."""
    configured = wp.config.cpu_compiler_flags
    return _has_512_bits() and (configured is None or "-march=native" in configured)


@functools.cache
def _has_512_bits() -> bool:
    # NumPy leaves out a list that is empty, and names under "baseline" what it was built for.
    known = np.show_config("dicts").get("SIMD Extensions", {})
    names = [*known.get("baseline", []), *known.get("found", [])]
    return any(name == "X86_V4" or name.startswith("AVX512") for name in names)


def module_options(max_unroll: int, keeps_lanes: bool = True) -> dict[str, object]:
    """Return the options of the module that a kernel is compiled in, whose loops are unrolled up to so many rounds.

    Kernels with the same flags share the compiler's precompiled header, which takes more than a second.
    """
    return {"max_unroll": max_unroll, "cpu_compiler_flags": cpu_flags(keeps_lanes)}


# A processor's frame is aligned for its most demanding variable. Without one of a cache line, every row of lanes in
# it would straddle two, and take twice as long to read. LLVM lays out first what is large for how often it is used,
# and the matrices are laid one after another behind it: if it is this, they are aligned too. It stays large because
# the compiler does not know which of its bytes is written.
@wp.func_native("""
#if !defined(__CUDA_ARCH__)
alignas(64) volatile char lines[32768];
volatile int last = sizeof(lines) - 1;
lines[last] = 0;
#endif
""")
def align_rows():
    """Align the calling kernel's variables to cache lines."""


# The larger of two values that are not negative: one instruction on a GPU, two on a processor, where warp's own
# maximum takes three. Without the absolute value LLVM would write a peak back by a masked store, where a value is
# larger. That took a quarter of all the time on an AMD processor without AVX-512.
def _larger(absolute_value: str) -> str:
    on_processor = f"a = {absolute_value}(a);\nreturn b > a ? b : a;"
    return f"#if defined(__CUDA_ARCH__)\nreturn fmax(a, b);\n#else\n{on_processor}\n#endif\n"


@wp.func_native(_larger("__builtin_fabsf"))
def larger_float32(a: wp.float32, b: wp.float32) -> wp.float32: ...


@wp.func_native(_larger("__builtin_fabs"))
def larger_float64(a: wp.float64, b: wp.float64) -> wp.float64: ...


LARGER = {"float32": larger_float32, "float64": larger_float64}


# Reads an element of a contiguous array of one dimension, without its stride and without a test for a negative index.
@wp.func_native("return values.data[index];")
def element_float32(values: wp.array(dtype=wp.float32), index: wp.int32) -> wp.float32: ...


@wp.func_native("return values.data[index];")
def element_float64(values: wp.array(dtype=wp.float64), index: wp.int32) -> wp.float64: ...


ELEMENT = {"float32": element_float32, "float64": element_float64}


def _on_gpu(cuda: str) -> str:
    return f"#if defined(__CUDA_ARCH__)\n{cuda}\n#else\nreturn value;\n#endif\n"


# Values of the other threads that share a sample, 0 from beyond the first and the last section. All threads of a warp
# take part, so all must come by.
_BELOW = _on_gpu("""
value = __shfl_up_sync(0xffffffff, value, 1, threads);
return section == 0 ? 0 : value;""")
_ABOVE = _on_gpu("""
value = __shfl_down_sync(0xffffffff, value, 1, threads);
return section == threads - 1 ? 0 : value;""")
_ACROSS = _on_gpu("""
for (int distance = 1; distance < threads; distance *= 2)
    value = fmax(value, __shfl_xor_sync(0xffffffff, value, distance));
return value;""")
_TOGETHER = _on_gpu("""
for (int distance = 1; distance < threads; distance *= 2)
    value += __shfl_xor_sync(0xffffffff, value, distance);
return value;""")


@wp.func_native(_BELOW)
def below_float32(value: wp.float32, section: wp.int32, threads: wp.int32) -> wp.float32: ...


@wp.func_native(_ABOVE)
def above_float32(value: wp.float32, section: wp.int32, threads: wp.int32) -> wp.float32: ...


@wp.func_native(_ACROSS)
def across_float32(value: wp.float32, threads: wp.int32) -> wp.float32: ...


@wp.func_native(_TOGETHER)
def together_float32(value: wp.float32, threads: wp.int32) -> wp.float32: ...


@wp.func_native(_BELOW)
def below_float64(value: wp.float64, section: wp.int32, threads: wp.int32) -> wp.float64: ...


@wp.func_native(_ABOVE)
def above_float64(value: wp.float64, section: wp.int32, threads: wp.int32) -> wp.float64: ...


@wp.func_native(_ACROSS)
def across_float64(value: wp.float64, threads: wp.int32) -> wp.float64: ...


@wp.func_native(_TOGETHER)
def together_float64(value: wp.float64, threads: wp.int32) -> wp.float64: ...


@wp.func_native(
    _on_gpu("""
for (int distance = 1; distance < 32; distance *= 2)
    value = max(value, __shfl_xor_sync(0xffffffff, value, distance));
return value;""")
)
def across_warp(value: wp.int32) -> wp.int32:
    """Return the largest of a warp's values."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
__syncwarp();
#endif
""")
def see_neighbours():
    """Let a thread read what the others of its warp have written to memory."""


# dtype -> the value of the section below, of that above, the largest and the sum of all.
NEIGHBOURS = {
    "float32": (below_float32, above_float32, across_float32, together_float32),
    "float64": (below_float64, above_float64, across_float64, together_float64),
}
