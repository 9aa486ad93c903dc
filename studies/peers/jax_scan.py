"""JAX: RK4 in a lax.scan over the steps, a vmap over the samples, compiled by jit; a sample's storeys are an array.

How one writes it in JAX. XLA makes a step into a few fused kernels; the state goes through memory between them.
"""

from __future__ import annotations

from peers.case import Case, Measured
from peers.chain_in_jax import drifts, scan_rk4, slopes


def measure(case: Case) -> Measured:
    """Return the time of the compiled function and the peak drifts."""
    return scan_rk4(case, slopes, drifts, split=lambda values: values)
