"""Hand-written CUDA (shear_chain.cu): RK4, one sample per thread, with its whole state in registers.

The code does the same as warpdyn's kernel with the recorder of drifts, or with the default recorders. It does not
locate the largest drift ratio, does not record residual drifts and does not test for divergence. It has no other
features. Above 20 storeys in float32 and 10 in float64, its variables no longer fit in registers. The time is measured
by events, with all data on the device.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from peers.case import HEIGHT, TIMED_FOR, Case, Measured
from peers.compiled import load, macros_of

FLAGS = ("-std=c++17", "-arch=native", "-O3", "-Xcompiler", "-fPIC")


def prepare(cases: Sequence[Case]) -> None:
    """Compile the libraries for all cases in parallel."""
    with ThreadPoolExecutor() as pool:
        list(pool.map(_library, cases))


def _library(case: Case) -> ctypes.CDLL:
    return load("nvcc", FLAGS, "shear_chain.cu", **macros_of(case))


def measure(case: Case) -> Measured:
    """Integrate a case, and return the time of the kernel and the peak drifts."""
    seconds, results, note = run(case)
    return Measured(seconds, results[: case.storeys].T, note)


def run(case: Case) -> tuple[float, np.ndarray, str]:
    """Integrate a case; return kernel time [s], results, shape [row, sample], and a text on registers and memory."""
    *tables, scale, acceleration = case.arrays()
    arrays = [np.ascontiguousarray(table.T) for table in tables] + [scale, acceleration]
    rows = 3 * case.storeys + 5 if case.recorders == "all" else case.storeys
    results = np.full((rows, case.samples), np.nan, case.dtype)
    seconds, registers, local = ctypes.c_double(), ctypes.c_int(), ctypes.c_int()
    library = _library(case)
    error = library.shear_chain(
        *(ctypes.c_void_p(array.ctypes.data) for array in arrays),
        case.steps,
        ctypes.c_double(case.step),
        case.samples,
        ctypes.c_double(HEIGHT),
        ctypes.c_double(TIMED_FOR),
        ctypes.c_void_p(results.ctypes.data),
        ctypes.byref(seconds),
        ctypes.byref(registers),
        ctypes.byref(local),
    )
    if error:
        library.error_text.restype = ctypes.c_char_p
        raise RuntimeError(
            f"the CUDA kernel of {case.samples} samples failed: {library.error_text(error).decode()}; if memory is "
            "short, choose fewer samples"
        )
    return seconds.value, results, f"{registers.value} registers, {local.value} bytes of local memory"
