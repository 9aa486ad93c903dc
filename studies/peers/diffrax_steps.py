"""diffrax's Tsit5 stepped by hand: its `step` in a lax.scan that keeps running peaks, a vmap over the samples, jit.

The steps are called as in the documentation of diffrax on manual stepping, without a solve, and only the peaks are
stored. Tsit5 evaluates the equation of motion six times per step; RK4 evaluates it four times.
"""

from __future__ import annotations

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from peers.case import Case, Measured
from peers.chain_in_jax import devices_of, drifts, rest, timed
from peers.diffrax_tsit5 import field_of


def measure(case: Case) -> Measured:
    """Integrate a case, and return the time of the compiled scan and the peak drifts."""
    with jax.default_device(devices_of(case)[0]):
        *parameters, acceleration = (jnp.asarray(array) for array in case.arrays())
        times = jnp.arange(case.steps + 1) * np.dtype(case.dtype).type(case.step)
        term, solver = diffrax.ODETerm(field_of(case, acceleration)), diffrax.Tsit5()

        def one(*own):
            start = rest(case)
            memory = solver.init(term, times[0], times[1], start, own)

            def advance(carry, ends):
                state, memory, peak = carry
                state, _, _, memory, _ = solver.step(term, *ends, state, own, memory, made_jump=False)
                return (state, memory, jnp.maximum(peak, jnp.abs(drifts(state[0])))), None

            return jax.lax.scan(advance, (start, memory, start[0]), (times[:-1], times[1:]))[0][2]

        return timed(jax.jit(jax.vmap(one)), parameters)
