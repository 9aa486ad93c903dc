"""Native functions that Warp lacks, and compiler flags for CPU kernels.

The functions return the larger of two absolute values, and align variables to cache lines. Those that read values of
other GPU threads are in `warp_exchange.py`.
"""

import functools

import numpy as np
import warp as wp

FEWEST_LANES = 8  # smallest number of lanes of a CPU thread with more than one lane
# Templates that Warp's headers use are instantiated when the headers are precompiled. Otherwise the compiler does it
# again for each kernel, which takes 0.1 s; the compiled kernels are the same, byte by byte.
ONCE = "-fpch-instantiate-templates"


def cpu_flags(keeps_lanes: bool = True, fuses: bool = True, inlines: bool = False) -> str:
    """Return the compiler flags for kernels on a CPU: the flags of Warp's configuration, then the flags of warpdyn.

    Products and sums are fused by default, as on a GPU. Vectors use 512-bit registers if the CPU has them; for some
    CPUs the compiler would use 256-bit registers by default, at half the speed. A lane is one of the samples that a CPU
    thread integrates at once, each in one element of a vector register.

    Args:
        keeps_lanes: Whether loops over lanes are the only loops with 8 or more iterations. Then loops with 8 or more
            iterations are not unrolled, so that LLVM's loop vectoriser handles the loops over lanes. If they were
            unrolled, LLVM's SLP vectoriser would handle them: the kernel would run up to 20 % longer and compile
            slowly.
        fuses: Whether products and sums may be fused. In an unrolled loop over lanes, LLVM can fuse a product with one
            sum in some lanes and with another sum in others; then the last bits of a sample depend on its lane.
        inlines: Whether long device functions that occur several times are inlined. Loops over lanes that call a
            function are not computed with vectors.
    """
    as_loops = f" -fno-slp-vectorize -mllvm=-unroll-full-max-count={FEWEST_LANES - 1}" if keeps_lanes else ""
    long_functions = " -mllvm=-inline-threshold=20000" if inlines else ""
    contract = "fast" if fuses else "off"
    return f"{_first_flags()} -ffp-contract={contract} -mprefer-vector-width=512{as_loops}{long_functions}".strip()


def _first_flags() -> str:
    """Return the compiler flags that all kernels on a CPU have."""
    configured = wp.config.cpu_compiler_flags
    # Without configured flags, Warp compiles for the processor of this machine.
    return f"{'-march=native' if configured is None else configured} {ONCE}".strip()


def has_wide_registers() -> bool:
    """Return whether kernels are compiled for 512-bit vector registers on this processor."""
    configured = wp.config.cpu_compiler_flags
    return _has_512_bits() and (configured is None or "-march=native" in configured)


@functools.cache
def _has_512_bits() -> bool:
    # NumPy omits empty lists. "baseline" lists the CPU extensions that this build of NumPy requires.
    known = np.show_config("dicts").get("SIMD Extensions", {})
    names = [*known.get("baseline", []), *known.get("found", [])]
    return any(name == "X86_V4" or name.startswith("AVX512") for name in names)


def module_options(
    max_unroll: int, keeps_lanes: bool = True, fuses: bool = True, inlines: bool = False
) -> dict[str, object]:
    """Return the options of a kernel's Warp module, such as the compiler flags (see `cpu_flags`).

    Loops with up to `max_unroll` iterations are unrolled. Kernels with the same flags share the compiler's precompiled
    header, which takes more than 1 s to compile.
    """
    return {"max_unroll": max_unroll, "cpu_compiler_flags": cpu_flags(keeps_lanes, fuses, inlines)}


def small_options(**others: object) -> dict[str, object]:
    """Return the options of the Warp module of a kernel with little work: only the flags that all kernels have."""
    return {"cpu_compiler_flags": _first_flags(), **others}


# The compiler aligns the stack frame of a function to the strictest alignment among its variables. Without a variable
# that is aligned to a cache line, each row of lanes would cross a line boundary and take twice as long to read. LLVM
# places large, rarely used variables first and the kernel's matrices after them. `lines` is such a variable, so the
# matrices after it are aligned, too. The compiler cannot shrink it, because the index of the written byte is volatile.
@wp.func_native("""
#if !defined(__CUDA_ARCH__)
alignas(64) volatile char lines[32768];
volatile int last = sizeof(lines) - 1;
lines[last] = 0;
#endif
""")
def align_rows():
    """Align the variables of the calling kernel to cache lines of the CPU, so that they are read faster."""


# The larger of two values that are not negative: one instruction on a GPU and two on a CPU (`wp.max`: three). Without
# the absolute value LLVM would write peaks by masked stores, which took 1/4 of the time of a kernel on an AMD CPU
# without AVX-512.
def _larger(absolute_value: str) -> str:
    on_processor = f"a = {absolute_value}(a);\nreturn b > a ? b : a;"
    return f"#if defined(__CUDA_ARCH__)\nreturn fmax(a, b);\n#else\n{on_processor}\n#endif\n"


@wp.func_native(_larger("__builtin_fabsf"))
def larger_float32(a: wp.float32, b: wp.float32) -> wp.float32: ...


@wp.func_native(_larger("__builtin_fabs"))
def larger_float64(a: wp.float64, b: wp.float64) -> wp.float64: ...


LARGER = {"float32": larger_float32, "float64": larger_float64}


# `wp.where(changes, x, old)` for a result that takes the place of `old`. If the value is the old one itself, LLVM uses
# masked stores, which took half of the time of kernels of frames with hinges on an AMD CPU without AVX-512. Canonical
# values have the same bits, except for NaN.
def _updated(canonical: str) -> str:
    on_processor = f"return changes ? x : {canonical}(old);"
    return f"#if defined(__CUDA_ARCH__)\nreturn changes ? x : old;\n#else\n{on_processor}\n#endif\n"


@wp.func_native(_updated("__builtin_canonicalizef"))
def updated_float32(changes: wp.bool, x: wp.float32, old: wp.float32) -> wp.float32: ...


@wp.func_native(_updated("__builtin_canonicalize"))
def updated_float64(changes: wp.bool, x: wp.float64, old: wp.float64) -> wp.float64: ...


UPDATED = {"float32": updated_float32, "float64": updated_float64}


# Read an element of a contiguous one-dimensional array, without reading its stride and without a test for a negative
# index.
@wp.func_native("return values.data[index];")
def element_float32(values: wp.array(dtype=wp.float32), index: wp.int32) -> wp.float32: ...


@wp.func_native("return values.data[index];")
def element_float64(values: wp.array(dtype=wp.float64), index: wp.int32) -> wp.float64: ...


ELEMENT = {"float32": element_float32, "float64": element_float64}


def on_gpu(cuda: str) -> str:
    """Return the C++ source of a function that runs these statements on a GPU and returns `value` on a CPU."""
    return f"#if defined(__CUDA_ARCH__)\n{cuda}\n#else\nreturn value;\n#endif\n"
