"""Hand-written C++ (shear_chain.cpp): RK4, samples side by side in vector registers, on one thread.

It does what warpdyn's kernel does with the recorder of drifts, except the location of the largest drift ratio
and the test for divergence; it has no other features. Rows of 8, 16 and 32 samples are tried; the fastest
counts. Only a single storey would be faster with rows of 64 (1.5 times).
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from peers.case import Case, Measured, least_seconds
from peers.compiled import load, macros_of

FLAGS = ("-std=c++17", "-O3", "-march=native", "-ffast-math", "-fPIC", "-w")
ROWS = (8, 16, 32)  # samples


def prepare(cases: Sequence[Case]) -> None:
    """Compile the libraries of the cases in parallel."""
    with ThreadPoolExecutor() as pool:
        list(pool.map(lambda job: _library(*job), [(case, row) for case in cases for row in ROWS]))


def _library(case: Case, row: int) -> ctypes.CDLL:
    return load("g++", FLAGS, "shear_chain.cpp", **macros_of(case), LANES=row)


def _aligned(shape: tuple[int, ...], dtype: str) -> np.ndarray:
    """Return zeros that start where vector registers may be loaded from."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    raw = np.zeros(size + 256, np.uint8)
    first = -raw.ctypes.data % 256
    return raw[first : first + size].view(dtype).reshape(shape)


def measure(case: Case) -> Measured:
    """Return the time and the peak drifts of the fastest row."""
    return min((_measure(case, row) for row in ROWS), key=lambda measured: measured.seconds)


def _measure(case: Case, row: int) -> Measured:
    *tables, scale, acceleration = case.arrays()
    blocks = -(-case.samples // row)
    filled = np.arange(blocks * row) % case.samples  # the last row's rest repeats the first samples
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
