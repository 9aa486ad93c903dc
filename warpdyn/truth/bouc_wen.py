"""Response of shear chains with Bouc-Wen storeys, nearly exact to rounding, as a reference for tests."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import DOP853
from scipy.optimize import brentq

from warpdyn.engine.laws import LAWS
from warpdyn.truth.chain import ShearChain, YieldingResponse

RELATIVE_TOLERANCE = 1e-12  # of the integration
# Absolute tolerance of the integration, as a share of a small drift; near 0 a relative tolerance is too strict.
ABSOLUTE_TOLERANCE = 1e-13


def bouc_wen_chain_response(
    mass: ArrayLike,
    stiffness: ArrayLike,
    yield_force: ArrayLike,
    hardening_ratio: ArrayLike,
    damping: ArrayLike,
    force: ArrayLike,
    step: float,
    initial_velocity: ArrayLike = 0.0,
    *,
    beta: ArrayLike = 0.5,
    gamma: ArrayLike = 0.5,
    exponent: ArrayLike = 1.0,
) -> YieldingResponse:
    """Return the response of Bouc-Wen storeys, by scipy's eighth-order method with a relative tolerance of 1e-12.

    The method integrates from corner to corner. Corners are the samples of the load, and the instants at which a
    storey's drift rate or its memory z changes sign. These instants are computed, so that the system is smooth in each
    step, and steps end at the extremes of the drifts.

    Args:
        mass: Floor mass [kg], shape [storey].
        stiffness: Elastic storey stiffness from the ground up [N/m], shape [storey] or one for all.
        yield_force: Storey yield force Fy [N], shape [storey] or one for all.
        hardening_ratio: Stiffness after yield over elastic stiffness [-], from 0 to below 1, shape [storey] or one for
            all.
        damping: Viscous damping matrix of the floors [N s/m], shape [storey, storey].
        force: Force on each floor [N], linear between samples, shape [time, storey]; a ground acceleration a_g is the
            force -mass a_g.
        step: Time between samples [s].
        initial_velocity: Floor velocity at the first sample, where displacement and z are 0 [m/s], shape [storey] or
            one for all.
        beta: Parameter of `Fy / k z' = d' - |z|^n (beta |d'| sign z + gamma d')` [-], shape [storey] or one for all.
        gamma: Parameter gamma of this law [-], shape [storey] or one for all.
        exponent: Exponent n of this law [-], shape [storey] or one for all.

    Raises:
        ValueError: If a value is out of its range or a shape does not fit.
        RuntimeError: If the tolerance cannot be met.

    Example:
        >>> force = np.full((101, 1), 10.0)  # N, applied at once
        >>> system = dict(mass=[2.0], stiffness=200.0, yield_force=15.0, hardening_ratio=0.1, damping=[[0.0]])
        >>> found = wd.truth.bouc_wen_chain_response(**system, force=force, step=0.01)
        >>> found.peak_storey_drift.round(4)  # m
        array([0.1742])
    """
    chain = ShearChain(mass, stiffness, yield_force, hardening_ratio, damping, force, step)
    n = chain.storeys
    law = LAWS["bouc_wen"]
    given = {
        name: chain.one_per_storey(name, value, law.parameters[name])
        for name, value in {"beta": beta, "gamma": gamma, "exponent": exponent}.items()
    }
    beta, gamma, exponent = given.values()
    problem = law.problem(given)
    if problem:
        raise ValueError(problem)
    odd = exponent % 2 == 1
    any_odd = odd.any()
    power = exponent[0] if (exponent == exponent[0]).all() else exponent  # numpy is fast at one power of 1 or 2
    recoverable = chain.hysteretic_force * chain.yield_drift / 2
    state = np.concatenate([chain.start(0.0, initial_velocity), np.zeros(n)])
    # The smallest expected drift: the drift of the highest mode, or the yield drift if it is smaller.
    least = (np.abs(chain.load).max() / chain.fastest + np.abs(state).max()) / chain.fastest
    scale = np.minimum(chain.yield_drift, least) if least > 0 else chain.yield_drift
    shares = scale / chain.yield_drift
    scales = np.concatenate([scale, scale * chain.fastest, shares, recoverable * shares**2])
    tolerances = {"rtol": RELATIVE_TOLERANCE, "atol": ABSOLUTE_TOLERANCE * scales}
    # The signs of drift rates and memories are kept constant during a step, so that the system is smooth.
    signs = np.where(state[n : 3 * n] < 0, -1.0, 1.0)
    weight = (beta * signs[:n] * signs[n:] + gamma) / chain.yield_drift
    stiff = 1 / chain.yield_drift
    load = rate = np.zeros(n)

    def acceleration(time: float, state: np.ndarray) -> np.ndarray:
        return chain.generator @ state[: 3 * n] + (load + rate * time)

    def slope(time: float, state: np.ndarray) -> np.ndarray:
        drift_rate, memory = state[n : 2 * n], state[2 * n : 3 * n]
        bend = np.abs(memory) ** power
        if any_odd:  # a smooth continuation below 0
            bend = np.copysign(bend, np.where(odd, memory * signs[n:], 1.0))
        return np.concatenate(
            [
                drift_rate,
                acceleration(time, state),
                drift_rate * (stiff - bend * weight),
                chain.hysteretic_force * memory * drift_rate,  # work, recoverable and dissipated
            ]
        )

    history, peak, stride = [state], np.zeros(n), chain.step
    for i in range(len(chain.load) - 1):
        load, rate, time = chain.load[i], (chain.load[i + 1] - chain.load[i]) / chain.step, 0.0
        while time < chain.step:
            first = min(stride, chain.step - time)
            solver, corner = DOP853(slope, time, state, chain.step, first_step=first, **tolerances), None
            while solver.status == "running" and corner is None:
                before = solver.t, solver.y
                _advance(solver, i)
                if (before[0] == time and solver.step_size < first) or solver.step_size > stride:
                    stride = solver.step_size
                corner = _first_corner(solver, acceleration, before[1], signs)
            time, state = solver.t, solver.y
            if corner is not None:  # repeat the last step up to the corner
                time, state = before
                if corner[0] > time:
                    solver = DOP853(slope, time, state, corner[0], first_step=corner[0] - time, **tolerances)
                    while solver.status == "running":
                        _advance(solver, i)
                    time, state = solver.t, solver.y
                state = state.copy()
                state[n : 3 * n][corner[1]] = 0.0
                signs[corner[1]] *= -1
                weight = (beta * signs[:n] * signs[n:] + gamma) / chain.yield_drift
            np.maximum(peak, np.abs(state[:n]), out=peak)
        history.append(state)
    rows = np.array(history)
    rows[:, 3 * n :] -= recoverable * rows[:, 2 * n : 3 * n] ** 2
    return chain.response(rows, peak)


def _advance(solver: DOP853, sample: int) -> None:
    """Make one step of the solver; raise a RuntimeError if the tolerance cannot be met after force[sample]."""
    with np.errstate(over="ignore", invalid="ignore"):  # a trial step may be far too long; it is rejected
        message = solver.step()
    if solver.status == "failed":
        raise RuntimeError(
            f"the tolerance cannot be met after force[{sample}], at {solver.t:g} s "
            f"({message}): change the force slightly"
        )


def _first_corner(
    solver: DOP853, acceleration: Callable[[float, np.ndarray], np.ndarray], before: np.ndarray, signs: np.ndarray
) -> tuple[float, np.ndarray] | None:
    """Return the first instant in the solver's last step at which a drift rate or memory changes its sign.

    Args:
        solver: The solver after its last step.
        acceleration: Function of time and state that returns the accelerations of the drifts.
        before: State at the start of the step.
        signs: Signs of drift rates and memories during the step, shape [2 storey].

    Returns:
        The instant [s] and the indices of the components in `signs` that change; None if no component changes.
    """
    n = signs.size // 2
    watched = slice(n, 3 * n)
    may_leave = signs * solver.y[watched] < 0
    # A drift rate that approaches 0 and then recedes may have crossed 0 twice; a memory reverses only at a corner.
    coming, going = acceleration(solver.t_old, before), acceleration(solver.t, solver.y)
    may_leave[:n] |= (signs[:n] * coming < 0) & (signs[:n] * going > 0)
    candidates = np.flatnonzero(may_leave)
    if not candidates.size:
        return None
    dense, instants = solver.dense_output(), np.linspace(solver.t_old, solver.t, 9)
    values = (signs[:, None] * dense(instants)[watched])[candidates]
    # At both ends use the values of the solver, because the interpolant differs from them by rounding.
    values[:, 0], values[:, -1] = (signs * before[watched])[candidates], (signs * solver.y[watched])[candidates]
    first = np.inf
    changing: list[int] = []
    for row, component in zip(values, candidates.tolist(), strict=True):
        if not (row < 0).any():
            continue
        end = int(np.argmax(row < 0))
        root = instants[max(end - 1, 0)]
        if end and row[end - 1] > 0:

            def value(time: float, component: int = component) -> float:
                return signs[component] * dense(time)[watched][component]

            root = brentq(value, instants[end - 1], instants[end], xtol=1e-16, rtol=1e-15)
        if root <= first:
            first, changing = root, [*(changing if root == first else []), component]
    return (first, np.array(changing)) if changing else None
