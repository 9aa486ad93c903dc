"""JAX as in jax_scan, but with a separate scalar for each storey, so that XLA can fuse a step.

Python loops over the storeys are unrolled when JAX traces the function. Compilation by XLA is slow with more than about
ten storeys.
"""

from __future__ import annotations

from itertools import pairwise

from peers.case import HARDENING_RATIO, YIELD_DRIFT, Case, Measured
from peers.chain_in_jax import scan_rk4


def measure(case: Case) -> Measured:
    """Integrate a case, and return the time of the compiled function and the peak drifts."""
    return scan_rk4(case, _slopes, _drifts, split=tuple)


def _drifts(displacement):
    return (displacement[0], *(upper - lower for lower, upper in pairwise(displacement)))


def _slopes(state, ground, stiffness, damping, inverse_mass, law: str):
    displacement, velocity, *memory = state
    drift, rate = _drifts(displacement), _drifts(velocity)
    storeys = range(len(drift))
    if law == "bouc_wen":
        (z,) = memory
        of_z = (1 - HARDENING_RATIO) * YIELD_DRIFT
        spring = [stiffness[i] * (HARDENING_RATIO * drift[i] + of_z * z[i]) for i in storeys]
        growth = (tuple((rate[i] - 0.5 * (abs(rate[i]) * z[i] + rate[i] * abs(z[i]))) / YIELD_DRIFT for i in storeys),)
    else:
        spring, growth = [stiffness[i] * drift[i] for i in storeys], ()
    force = [spring[i] + damping[i] * rate[i] for i in storeys] + [0.0]
    return velocity, tuple((force[i + 1] - force[i]) * inverse_mass[i] - ground for i in storeys), *growth
