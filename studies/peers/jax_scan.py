"""JAX: RK4 in a lax.scan over the steps, a vmap over the samples, compiled by jit; storeys are an array.

This is the usual way of writing the chain in JAX. XLA compiles a step to a few fused kernels, which exchange the state
through memory.
"""

from __future__ import annotations

from peers.case import Case, Measured
from peers.chain_in_jax import drifts, scan_rk4, slopes


def measure(case: Case) -> Measured:
    """Integrate a case, and return the time of the compiled function and the peak drifts."""
    return scan_rk4(case, slopes, drifts, split=lambda values: values)
