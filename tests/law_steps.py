"""Storey laws evaluated step by step along a path, as in a kernel of whole histories."""

from __future__ import annotations

import functools

import numpy as np
import warp as wp
from law_rows import SPRINGS

import warpdyn as wd
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.kernels.plan import DTYPES
from warpdyn.engine.laws import LAWS


@functools.cache
def _steps_kernel(row: str, dtype_name: str) -> wp.Kernel:
    spring, dtype = SPRINGS[row], DTYPES[dtype_name]
    force, tangent, advance, C = spring.force, spring.tangent, spring.memory_after, spring.coefficients
    coefficient_vector = wp.types.vector(length=C, dtype=dtype)
    memory_vector = wp.types.vector(length=spring.memory, dtype=dtype)

    @wp.kernel(module="unique", enable_backward=False)
    def follow(
        coefficients: wp.array(dtype=dtype),
        drift: wp.array(dtype=dtype),
        nudge: dtype,
        result: wp.array2d(dtype=dtype),
    ):
        c = coefficient_vector()
        for q in range(C):
            c[q] = coefficients[q]
        memory = memory_vector()
        last = dtype(0.0)
        for step in range(drift.shape[0]):
            now = drift[step]
            result[0, step] = force(now, memory, c)
            result[1, step] = force(now - nudge, memory, c)
            result[2, step] = force(now + nudge, memory, c)
            after = advance(now, now - last, memory, c)
            result[3, step] = force(now, after, c)
            result[4, step] = tangent(now, now - last, memory, after, c)
            memory = after
            last = now

    return follow


def law_steps(
    building: wd.ShearBuilding, drift: np.ndarray, dtype: str = "float64", row: str | None = None
) -> dict[str, np.ndarray]:
    """Return the forces [N] and slopes [N/m] of a one-storey building's law at each step, shape [step].

    `trial` is the force before the step is accepted, `committed` after; `tangent` is the law's own slope, `behind` and
    `ahead` are those of chords to 1e-7 of the largest drift on either side, from the memory before the step. The row of
    SPRINGS is the one that the law chooses, unless another is given.
    """
    parameters = {name: np.atleast_1d(value)[None] for name, value in building.parameters.items()}
    law = LAWS[building.law]
    row = row or law.spring(parameters)
    coefficients = np.concatenate(np.broadcast_arrays(*law.coefficients(parameters, row)))[:, 0]
    result = wp.full((5, drift.size), np.nan, dtype=DTYPES[dtype], device="cpu")
    nudge = 1e-7 * np.abs(drift).max()
    arrays = [wp.array(values, dtype=DTYPES[dtype], device="cpu") for values in (coefficients, drift)]
    wp.launch(loaded(_steps_kernel(row, dtype)), dim=1, inputs=[*arrays, nudge, result], device="cpu")
    trial, below, above, committed, tangent = result.numpy()
    return {
        "trial": trial,
        "committed": committed,
        "tangent": tangent,
        "behind": (trial - below) / nudge,
        "ahead": (above - trial) / nudge,
    }


def check_steps(building: wd.ShearBuilding, drift: np.ndarray) -> None:
    """Check that trial and accepted forces agree, that tangents are slopes, and that single precision holds both."""
    found = law_steps(building, drift)
    strength, stiffness = (float(building.parameters[name][0]) for name in ("yield_force", "stiffness"))
    # An ulp or two of drifts of tens of yield drifts.
    np.testing.assert_allclose(found["committed"], found["trial"], rtol=0, atol=1e-13 * strength)
    # Chords lose to rounding; a step that ends on a corner has one slope behind and another ahead.
    misses = [np.abs(found["tangent"] - found[side]) for side in ("behind", "ahead")]
    assert np.minimum(*misses).max() < 1e-5 * stiffness
    assert (np.maximum(*misses) < 1e-5 * stiffness).mean() > 0.9
    assert found["tangent"].max() <= stiffness * (1 + 1e-12)
    single = law_steps(building, drift, "float32")
    for name in ("trial", "committed"):
        np.testing.assert_allclose(single[name], found["trial"], rtol=0, atol=1e-4 * strength)
