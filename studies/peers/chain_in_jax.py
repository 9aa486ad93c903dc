"""Shear chain in JAX, for the compared programs (peers) that use JAX: the equation of motion, and RK4 in a lax.scan."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from peers.case import HARDENING_RATIO, YIELD_DRIFT, Case, Measured, Missing, least_seconds


def devices_of(case: Case) -> list:
    """Return the devices of JAX for a case, and set JAX to 64 bits if the case has the dtype float64.

    Raises:
        Missing: If JAX does not find a device of this kind.
    """
    jax.config.update("jax_enable_x64", case.dtype == "float64")
    try:
        return jax.devices("cpu" if case.device == "cpu" else "gpu")
    except RuntimeError as error:
        raise Missing(f"JAX finds no device of this kind ({error}); for a GPU install jax[cuda12]") from error


def drifts(displacement):
    """Return the storey drifts of floor displacements, shape [storey]."""
    return jnp.diff(displacement, prepend=0)


def slopes(state, ground, stiffness, damping, inverse_mass, law: str):
    """Return the time derivative of the state (u, v, z), or (u, v) of an elastic chain, each of shape [storey]."""
    displacement, velocity, *memory = state
    drift, rate = drifts(displacement), drifts(velocity)
    if law == "bouc_wen":
        (z,) = memory
        force = stiffness * (HARDENING_RATIO * drift + (1 - HARDENING_RATIO) * YIELD_DRIFT * z) + damping * rate
        growth = ((rate - 0.5 * (jnp.abs(rate) * z + rate * jnp.abs(z))) / YIELD_DRIFT,)
    else:
        force, growth = stiffness * drift + damping * rate, ()
    return velocity, (jnp.append(force[1:], 0) - force) * inverse_mass - ground, *growth


def rest(case: Case):
    """Return the state of a chain at rest: zeros of shape [storey] for displacement, velocity and memory."""
    return (jnp.zeros(case.storeys, case.dtype),) * (3 if case.law == "bouc_wen" else 2)


def timed(run: Callable, parameters: list) -> Measured:
    """Run a compiled function of the parameters; return its shortest time [s] and the peak drifts that it returns."""
    peaks = run(*parameters).block_until_ready()
    return Measured(least_seconds(lambda: run(*parameters).block_until_ready()), np.asarray(peaks))


def scan_rk4(case: Case, slopes: Callable, drifts: Callable, split: Callable) -> Measured:
    """Return run time and peak drifts of RK4 in a lax.scan over the steps and a vmap over the samples.

    Args:
        case: The case that is integrated.
        slopes: Function that returns the time derivative of a state, such as `slopes` in this module.
        drifts: Function that returns the storey drifts of displacements.
        split: Function that converts an array of shape [storey] into the form of a part of the state.
    """
    with jax.default_device(devices_of(case)[0]):
        *parameters, acceleration = (jnp.asarray(array) for array in case.arrays())
        step = np.dtype(case.dtype).type(case.step)

        def moved(state, reach, slope):
            return jax.tree.map(lambda x, rate: x + reach * rate, state, slope)

        def one(stiffness, damping, inverse_mass, scale):
            own = (split(stiffness), split(damping), split(inverse_mass), case.law)

            def advance(carry, ground):
                state, peak = carry
                before, after = (value * scale for value in ground)
                middle = 0.5 * (before + after)
                first = slopes(state, before, *own)
                second = slopes(moved(state, step / 2, first), middle, *own)
                third = slopes(moved(state, step / 2, second), middle, *own)
                fourth = slopes(moved(state, step, third), after, *own)
                state = jax.tree.map(
                    lambda x, a, b, c, d: x + step / 6 * (a + 2 * b + 2 * c + d), state, first, second, third, fourth
                )
                peak = jax.tree.map(lambda p, drift: jnp.maximum(p, jnp.abs(drift)), peak, drifts(state[0]))
                return (state, peak), None

            start = tuple(split(zeros) for zeros in rest(case))
            (_, peak), _ = jax.lax.scan(advance, (start, start[0]), (acceleration[:-1], acceleration[1:]))
            return jnp.stack(peak) if isinstance(peak, tuple) else peak

        return timed(jax.jit(jax.vmap(one)), parameters)
