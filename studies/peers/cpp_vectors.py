"""Hand-written C++ (shear_chain.cpp): RK4, with samples in vector registers, on one thread.

The code does the same as warpdyn's kernel with the recorder of drifts, except that it does not locate the largest drift
ratio and does not test for divergence. It has no other features. Vectors of 8, 16 and 32 samples are tried, and the
fastest counts. Vectors of 64 samples would be faster only for a single storey (1.5 times).
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from peers.case import Case, Measured, least_seconds
from peers.compiled import load, macros_of

FLAGS = ("-std=c++17", "-O3", "-march=native", "-ffast-math", "-fPIC", "-w")
ROWS = (8, 16, 32)  # numbers of samples that are integrated together


def prepare(cases: Sequence[Case]) -> None:
    """Compile the libraries for all cases and all sizes of vectors in parallel."""
    with ThreadPoolExecutor() as pool:
        list(pool.map(lambda job: _library(*job), [(case, row) for case in cases for row in ROWS]))


def _library(case: Case, row: int) -> ctypes.CDLL:
    return load("g++", FLAGS, "shear_chain.cpp", **macros_of(case), LANES=row)


def _aligned(shape: tuple[int, ...], dtype: str) -> np.ndarray:
    """Return an array of zeros whose address is a multiple of 256 bytes, as vector registers need."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    raw = np.zeros(size + 256, np.uint8)
    first = -raw.ctypes.data % 256
    return raw[first : first + size].view(dtype).reshape(shape)


def measure(case: Case) -> Measured:
    """Integrate a case with each size of vectors; return the shortest time and the peak drifts of the fastest."""
    return min((_measure(case, row) for row in ROWS), key=lambda measured: measured.seconds)


def _measure(case: Case, row: int) -> Measured:
    *tables, scale, acceleration = case.arrays()
    blocks = -(-case.samples // row)
    filled = np.arange(blocks * row) % case.samples  # the last block is filled with the first samples again
    packed = []
    for table in tables:
        packed.append(_aligned((blocks, case.storeys, row), case.dtype))
        packed[-1][:] = table[filled].reshape(blocks, row, case.storeys).transpose(0, 2, 1)
    scales, peaks = _aligned((blocks, row), case.dtype), _aligned((blocks, case.storeys, row), case.dtype)
    scales[:] = scale[filled].reshape(blocks, row)
    run = _library(case, row).shear_chain
    pointers = [ctypes.c_void_p(array.ctypes.data) for array in (*packed, scales, acceleration, peaks)]
    seconds = least_seconds(lambda: run(*pointers[:-1], case.steps, ctypes.c_double(case.step), blocks, pointers[-1]))
    drift = peaks.transpose(0, 2, 1).reshape(-1, case.storeys)[: case.samples]
    return Measured(seconds, drift, f"rows of {row} samples")
