"""Hand-written CUDA (stoermer_chain.cu): Stoermer's method, one sample per thread, all state in registers, float32.

The code does the same as warpdyn's kernel of `stoermer` with the recorder of drifts, except that it does not locate the
largest drift ratio. It has no other features. The docstring of `cpp_stoermer` lists the differences of the method. With
20 yielding storeys, its variables no longer fit in registers. The time is measured by events, with all data on the
device.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from peers.case import TIMED_FOR, Case, Measured
from peers.compiled import load, macros_of, multistep_arrays
from peers.cuda_registers import FLAGS


def prepare(cases: Sequence[Case]) -> None:
    """Compile the libraries for all cases in parallel."""
    with ThreadPoolExecutor() as pool:
        list(pool.map(_library, cases))


def _library(case: Case) -> ctypes.CDLL:
    return load("nvcc", FLAGS, "stoermer_chain.cu", **macros_of(case))


def measure(case: Case) -> Measured:
    """Integrate a case, and return the time of the kernel and the peak drifts."""
    arrays, library = multistep_arrays(case), _library(case)
    peaks = np.full((case.storeys, case.samples), np.nan, case.dtype)
    seconds, registers, local = ctypes.c_double(), ctypes.c_int(), ctypes.c_int()
    error = library.stoermer_chain(
        *(ctypes.c_void_p(array.ctypes.data) for array in arrays),
        case.steps,
        ctypes.c_double(case.step),
        case.samples,
        ctypes.c_double(TIMED_FOR),
        ctypes.c_void_p(peaks.ctypes.data),
        ctypes.byref(seconds),
        ctypes.byref(registers),
        ctypes.byref(local),
    )
    if error:
        library.error_text.restype = ctypes.c_char_p
        raise RuntimeError(f"CUDA: {library.error_text(error).decode()}")
    return Measured(seconds.value, peaks.T, f"{registers.value} registers, {local.value} bytes of local memory")
