"""Device functions of a storey law step by step: trial and committed forces, tangents and secant slopes."""

from __future__ import annotations

import functools

import numpy as np
import warp as wp
import xarray as xr
from law_rows import SPRINGS

import warpdyn as wd
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.kernels.plan import DTYPES
from warpdyn.engine.laws import LAWS

CHORD = 1e-7  # of the path's largest drift


@functools.cache
def step_kernel(row: str, dtype_name: str) -> wp.Kernel:
    """Return a kernel that moves a storey along drifts."""
    spring, dtype = SPRINGS[row], DTYPES[dtype_name]
    C = spring.coefficients
    force_of, advance, tangent_of, recoverable_of = (
        spring.force,
        spring.memory_after,
        spring.tangent,
        spring.elastic_energy,
    )
    coefficient_vector = wp.types.vector(length=C, dtype=dtype)
    memory_vector = wp.types.vector(length=spring.memory, dtype=dtype)

    @wp.kernel(module="unique", enable_backward=False)
    def take_steps(
        coefficients: wp.array(dtype=dtype), chord: dtype, drift: wp.array(dtype=dtype), result: wp.array2d(dtype=dtype)
    ):
        c = coefficient_vector()
        for q in range(C):
            c[q] = coefficients[q]
        memory = memory_vector()
        last = dtype(0.0)
        for step in range(drift.shape[0]):
            now = drift[step]
            # A chord back into the step: the law is not asked for drifts beyond it.
            way = wp.where(now < last, -chord, chord)
            after = advance(now, now - last, memory, c)
            back = advance(now - way, now - way - last, memory, c)
            result[0, step] = force_of(now, memory, c)
            result[1, step] = force_of(now, after, c)
            result[2, step] = tangent_of(now, now - last, memory, after, c)
            result[3, step] = (force_of(now, after, c) - force_of(now - way, back, c)) / way
            result[4, step] = recoverable_of(now, after, c)
            memory = after
            last = now

    return take_steps


def steps(building: wd.ShearBuilding, drift: np.ndarray, dtype: str = "float64") -> xr.Dataset:
    """Return the results of a one-storey building's law at each step; NaN where its kernel wrote nothing."""
    parameters = {name: np.atleast_1d(value)[None] for name, value in building.parameters.items()}
    row = LAWS[building.law].spring(parameters)
    coefficients = np.concatenate(np.broadcast_arrays(*LAWS[building.law].coefficients(parameters, row)))[:, 0]
    arrays = [wp.array(values.astype(dtype), dtype=DTYPES[dtype], device="cpu") for values in (coefficients, drift)]
    result = wp.full((5, drift.size), np.nan, dtype=DTYPES[dtype], device="cpu")
    chord = CHORD * np.abs(drift).max()
    wp.launch(loaded(step_kernel(row, dtype)), dim=1, inputs=[arrays[0], chord, arrays[1], result], device="cpu")
    names = ("trial_force", "force", "tangent", "chord", "recoverable")
    return xr.Dataset({name: ("step", values) for name, values in zip(names, result.numpy(), strict=True)})
