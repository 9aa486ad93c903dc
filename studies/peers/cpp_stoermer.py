"""Hand-written C++ (stoermer_chain.cpp): Stoermer's method, with samples in vector registers, on one thread.

The code does the same as warpdyn's kernel of `stoermer` with the recorder of drifts, except that it does not locate the
largest drift ratio and does not test for divergence. It has no other features. The method differs in three details: the
first step starts from a constant acceleration, dashpots use another extrapolation of the velocity, and a Bouc-Wen
storey uses a formula of third order in the change of the drift.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from peers.case import Case, Measured, least_seconds
from peers.compiled import load, macros_of, multistep_arrays
from peers.cpp_vectors import FLAGS


def prepare(cases: Sequence[Case]) -> None:
    """Compile the libraries for all cases in parallel."""
    with ThreadPoolExecutor() as pool:
        list(pool.map(_function, cases))


def _function(case: Case) -> ctypes._CFuncPtr:
    function = load("g++", FLAGS, "stoermer_chain.cpp", **macros_of(case)).stoermer_chain
    function.restype = ctypes.c_double
    return function


def measure(case: Case) -> Measured:
    """Integrate a case, and return the shortest time and the peak drifts."""
    arrays, function = multistep_arrays(case), _function(case)
    peaks = np.full((case.storeys, case.samples), np.nan, case.dtype)
    pointers = [ctypes.c_void_p(array.ctypes.data) for array in (*arrays, peaks)]

    def run() -> float:
        return float(function(*pointers[:-1], case.steps, ctypes.c_double(case.step), case.samples, pointers[-1]))

    return Measured(least_seconds(run), peaks.T)
