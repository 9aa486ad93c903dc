"""Hand-written C++ (stoermer_chain.cpp): Stoermer's method, samples in vector registers, on one thread.

It does what warpdyn's kernel of `stoermer` does with the recorder of drifts, except the location of the largest drift
ratio and the test for divergence; it has no other features. Differences of the method: the first step starts from a
constant acceleration, dashpots use another extrapolation of the velocity, and a Bouc-Wen storey has a formula of third
order in the change of the drift.
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
    """Compile the libraries of the cases in parallel."""
    with ThreadPoolExecutor() as pool:
        list(pool.map(_function, cases))


def _function(case: Case) -> ctypes._CFuncPtr:
    function = load("g++", FLAGS, "stoermer_chain.cpp", **macros_of(case)).stoermer_chain
    function.restype = ctypes.c_double
    return function


def measure(case: Case) -> Measured:
    """Return the time and the peak drifts."""
    arrays, function = multistep_arrays(case), _function(case)
    peaks = np.full((case.storeys, case.samples), np.nan, case.dtype)
    pointers = [ctypes.c_void_p(array.ctypes.data) for array in (*arrays, peaks)]

    def run() -> float:
        return float(function(*pointers[:-1], case.steps, ctypes.c_double(case.step), case.samples, pointers[-1]))

    return Measured(least_seconds(run), peaks.T)
