"""numba-cuda: RK4, one sample per thread, with its state in local arrays that the compiler may keep in registers.

The code is a translation of the hand-written C++ (shear_chain.cpp) to Python and does the same task. The time is
measured by events, with all data on the device.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import cuda

from peers.case import HARDENING_RATIO, YIELD_DRIFT, Case, Measured, Missing, least_seconds

THREADS_OF_A_BLOCK = 128


def measure(case: Case) -> Measured:
    """Integrate a case, and return the time of the kernel and the peak drifts."""
    if not cuda.is_available():
        raise Missing("numba finds no GPU; it needs an NVIDIA GPU, its driver and the CUDA toolkit")
    *tables, scale, acceleration = case.arrays()
    given = [cuda.to_device(np.ascontiguousarray(table.T)) for table in tables]
    given += [cuda.to_device(scale), cuda.to_device(acceleration)]
    peaks = cuda.to_device(np.full((case.storeys, case.samples), np.nan, case.dtype))
    step = np.dtype(case.dtype).type(case.step)
    kernel = _kernel(case.storeys, case.dtype, case.law == "bouc_wen")
    blocks = -(-case.samples // THREADS_OF_A_BLOCK)

    def run() -> float:
        start, end = cuda.event(), cuda.event()
        start.record()
        kernel[blocks, THREADS_OF_A_BLOCK](*given, step, peaks)
        end.record()
        end.synchronize()
        return start.elapsed_time(end) / 1e3

    run()  # compiles the kernel
    return Measured(least_seconds(run), peaks.copy_to_host().T)


def _kernel(storeys: int, dtype: str, is_bouc_wen: bool) -> Callable:
    real = np.dtype(dtype).type
    zero, half, sixth, two = real(0), real(0.5), real(1 / 6), real(2)
    hardening, of_z, inverse_yield = (
        real(HARDENING_RATIO),
        real((1 - HARDENING_RATIO) * YIELD_DRIFT),
        real(1 / YIELD_DRIFT),
    )

    @cuda.jit(fastmath=True)
    def integrate(stiffness, damping, inverse_masses, scales, acceleration, step, peaks):
        sample = cuda.grid(1)
        if sample >= scales.size:
            return
        k, c, inverse_mass, peak = (
            cuda.local.array(storeys, real),
            cuda.local.array(storeys, real),
            cuda.local.array(storeys, real),
            cuda.local.array(storeys, real),
        )
        u, v, z = cuda.local.array(storeys, real), cuda.local.array(storeys, real), cuda.local.array(storeys, real)
        trial_u, trial_v, trial_z = (
            cuda.local.array(storeys, real),
            cuda.local.array(storeys, real),
            cuda.local.array(storeys, real),
        )
        sum_u, sum_v, sum_z = (
            cuda.local.array(storeys, real),
            cuda.local.array(storeys, real),
            cuda.local.array(storeys, real),
        )
        for i in range(storeys):
            k[i], c[i], inverse_mass[i] = stiffness[i, sample], damping[i, sample], inverse_masses[i, sample]
            u[i] = v[i] = z[i] = trial_u[i] = trial_v[i] = trial_z[i] = peak[i] = zero
        scale = scales[sample]
        for n in range(acceleration.size - 1):
            before, after = acceleration[n] * scale, acceleration[n + 1] * scale
            for stage in range(4):
                ground = before if stage == 0 else (after if stage == 3 else half * (before + after))
                reach = step if stage == 2 else half * step
                above = zero
                for down in range(storeys):
                    i = storeys - 1 - down
                    velocity = trial_v[i]
                    drift, rate = trial_u[i], velocity
                    if i > 0:
                        drift -= trial_u[i - 1]
                        rate -= trial_v[i - 1]
                    growth = zero
                    if is_bouc_wen:
                        memory = trial_z[i]
                        force = k[i] * (hardening * drift + of_z * memory) + c[i] * rate
                        growth = (rate - half * (abs(rate) * memory + rate * abs(memory))) * inverse_yield
                    else:
                        force = k[i] * drift + c[i] * rate
                    slope = (above - force) * inverse_mass[i] - ground
                    above = force
                    if stage == 3:
                        u[i] += sixth * step * (sum_u[i] + velocity)
                        v[i] += sixth * step * (sum_v[i] + slope)
                        z[i] += sixth * step * (sum_z[i] + growth)
                        trial_u[i], trial_v[i], trial_z[i] = u[i], v[i], z[i]
                    else:
                        if stage == 0:
                            sum_u[i], sum_v[i], sum_z[i] = velocity, slope, growth
                        else:
                            sum_u[i] += two * velocity
                            sum_v[i] += two * slope
                            sum_z[i] += two * growth
                        trial_u[i] = u[i] + reach * velocity
                        trial_v[i] = v[i] + reach * slope
                        trial_z[i] = z[i] + reach * growth
            for i in range(storeys):
                drift = u[i]
                if i > 0:
                    drift -= u[i - 1]
                peak[i] = max(peak[i], abs(drift))
        for i in range(storeys):
            peaks[i, sample] = peak[i]

    return integrate
