"""diffrax: Tsit5 with a constant step in diffeqsolve, a vmap over the samples, compiled by jit.

This is the usual way of using diffrax. Tsit5 has order 5 and evaluates the equation of motion six times per step; RK4
evaluates it four times. A solve cannot keep a running peak, so the drifts of all steps are saved, and their maximum is
computed afterwards, on the device.
"""

from __future__ import annotations

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from peers.case import Case, Measured
from peers.chain_in_jax import devices_of, drifts, rest, slopes, timed


def field_of(case: Case, acceleration):
    """Return the equation of motion for diffrax; the motion is indexed by its uniform steps, without a search."""
    step = np.dtype(case.dtype).type(case.step)

    def field(time, state, parameters):
        stiffness, damping, inverse_mass, scale = parameters
        place = time / step
        before = jnp.clip(place.astype(int), 0, case.steps - 1)
        after = acceleration[before + 1]
        ground = acceleration[before] + (place - before) * (after - acceleration[before])
        return slopes(state, ground * scale, stiffness, damping, inverse_mass, case.law)

    return field


def measure(case: Case) -> Measured:
    """Integrate a case, and return the time of the compiled solve and the peak drifts."""
    with jax.default_device(devices_of(case)[0]):
        *parameters, acceleration = (jnp.asarray(array) for array in case.arrays())
        times = jnp.arange(case.steps + 1) * np.dtype(case.dtype).type(case.step)
        term = diffrax.ODETerm(field_of(case, acceleration))
        saved = diffrax.SaveAt(ts=times, fn=lambda time, state, parameters: drifts(state[0]))

        def one(*own):
            solved = diffrax.diffeqsolve(
                term,
                diffrax.Tsit5(),
                times[0],
                times[-1],
                case.step,
                rest(case),
                own,
                saveat=saved,
                max_steps=case.steps + 16,  # because of rounding, there may be a tiny last step
            )
            return jnp.abs(solved.ys).max(axis=0)

        return timed(jax.jit(jax.vmap(one)), parameters)
