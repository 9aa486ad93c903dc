"""Numba on CPU threads: RK4 in a parallel loop over blocks of samples, which LLVM turns into vector instructions.

A plain loop over the samples is not vectorised and is ten times slower. Vectorisation needs an innermost loop over
several samples, and the whole state of a block in one array, so that LLVM can recognise that its rows do not overlap.
Blocks of 16 and 32 samples are tried, and the faster counts. The task is that of the hand-written C++
(shear_chain.cpp).
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable

import numba
import numpy as np

from peers.case import HARDENING_RATIO, YIELD_DRIFT, Case, Measured, least_seconds

ROWS = (16, 32)  # numbers of samples in a block


def measure(case: Case) -> Measured:
    """Integrate a case with each size of blocks; return the shortest time and the peak drifts of the fastest."""
    numba.set_num_threads(len(os.sched_getaffinity(0)))
    return min((_measure(case, row) for row in ROWS), key=lambda measured: measured.seconds)


def _measure(case: Case, row: int) -> Measured:
    *tables, scale, acceleration = case.arrays()
    filled = np.arange(-(-case.samples // row) * row) % case.samples
    packed = [np.ascontiguousarray(t[filled].reshape(-1, row, case.storeys).transpose(0, 2, 1)) for t in tables]
    peaks = np.zeros_like(packed[0])
    step = np.dtype(case.dtype).type(case.step)
    run = _compiled(case.storeys, row, case.dtype, case.law == "bouc_wen")
    arguments = (*packed, scale[filled].reshape(-1, row), acceleration, step, peaks)
    run(*arguments)
    seconds = least_seconds(lambda: run(*arguments))
    drift = peaks.transpose(0, 2, 1).reshape(-1, case.storeys)[: case.samples]
    return Measured(seconds, drift, f"rows of {row} samples")


@functools.cache
def _compiled(storeys: int, row: int, dtype: str, is_bouc_wen: bool) -> Callable:
    real = np.dtype(dtype).type
    zero, half, sixth, third = real(0), real(0.5), real(1 / 6), real(1 / 3)
    hardening, of_z, inverse_yield = (
        real(HARDENING_RATIO),
        real((1 - HARDENING_RATIO) * YIELD_DRIFT),
        real(1 / YIELD_DRIFT),
    )
    # First index of each variable in the array of a block: index 0 is the ground (zero), followed by one index per
    # storey.
    u, v, z, trial_u, trial_v, trial_z, sum_u, sum_v, sum_z, k, c, inverse_mass, peak = (
        variable * (storeys + 1) for variable in range(13)
    )
    factor = peak + storeys + 1
    above = factor + 1

    @numba.njit(parallel=True, fastmath=True, error_model="numpy")
    def run(stiffness, damping, inverse_masses, scale, acceleration, step, peaks):
        for block in numba.prange(stiffness.shape[0]):
            x = np.zeros((above + 1, row), real)
            for j in range(row):
                x[factor, j] = scale[block, j]
                for i in range(storeys):
                    x[k + i, j] = stiffness[block, i, j]
                    x[c + i, j] = damping[block, i, j]
                    x[inverse_mass + i, j] = inverse_masses[block, i, j]
            for n in range(acceleration.size - 1):
                for stage in range(4):
                    ground = acceleration[n]
                    if stage == 3:
                        ground = acceleration[n + 1]
                    elif stage > 0:
                        ground = half * (acceleration[n] + acceleration[n + 1])
                    weight = step * (third if stage == 1 or stage == 2 else sixth)
                    reach = step if stage == 2 else (zero if stage == 3 else half * step)
                    for j in range(row):
                        x[above, j] = zero
                    for i in range(storeys - 1, -1, -1):
                        for j in range(row):
                            velocity = x[trial_v + i + 1, j]
                            drift = x[trial_u + i + 1, j] - x[trial_u + i, j]
                            rate = velocity - x[trial_v + i, j]
                            if is_bouc_wen:
                                memory = x[trial_z + i, j]
                                force = x[k + i, j] * (hardening * drift + of_z * memory) + x[c + i, j] * rate
                                growth = (rate - half * (abs(rate) * memory + rate * abs(memory))) * inverse_yield
                                x[sum_z + i, j] += weight * growth
                                x[trial_z + i, j] = x[z + i, j] + reach * growth
                            else:
                                force = x[k + i, j] * drift + x[c + i, j] * rate
                            slope = (x[above, j] - force) * x[inverse_mass + i, j] - ground * x[factor, j]
                            x[above, j] = force
                            x[sum_u + i, j] += weight * velocity
                            x[sum_v + i, j] += weight * slope
                            x[trial_u + i + 1, j] = x[u + i, j] + reach * velocity
                            x[trial_v + i + 1, j] = x[v + i, j] + reach * slope
                for i in range(storeys):
                    for j in range(row):
                        x[u + i, j] = x[sum_u + i, j]
                        x[v + i, j] = x[sum_v + i, j]
                        x[z + i, j] = x[sum_z + i, j]
                        x[trial_u + i + 1, j] = x[sum_u + i, j]
                        x[trial_v + i + 1, j] = x[sum_v + i, j]
                        x[trial_z + i, j] = x[sum_z + i, j]
                        x[peak + i, j] = max(x[peak + i, j], abs(x[sum_u + i, j] - x[trial_u + i, j]))
            for i in range(storeys):
                for j in range(row):
                    peaks[block, i, j] = x[peak + i, j]

    return run
