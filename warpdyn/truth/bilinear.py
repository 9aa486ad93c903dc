"""Exact response of shear chains with bilinear storeys, as a reference for tests and figures."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import comb

from warpdyn.truth.chain import ShearChain, YieldingResponse

# A piece of the motion lasts at most 1 rad of the highest frequency, and its Taylor series ends with this power: the
# remainder is below 2^(21/2) / 21! = 3e-17, because the norm of drift and memory is sqrt(2).
DEGREE = 20
POWERS = np.arange(DEGREE + 1)
BINOMIAL = comb(POWERS[:, None], POWERS)
# Matrices from the coefficients of a polynomial on [0, 1] to its Bernstein coefficients, which bound its values, and
# from these to the Bernstein coefficients of each half.
BERNSTEIN = BINOMIAL / BINOMIAL[-1]
FIRST_HALF = BINOMIAL / 2.0 ** POWERS[:, None]
SECOND_HALF = FIRST_HALF[::-1, ::-1]
# Tolerance as a share of the yield force. Without it, rounding would make a storey at rest at its yield force yield and
# unload alternately.
YIELD_SLACK = 1e-13
LARGEST_CACHE = 10**8  # bytes of cached exponentials; there is one exponential per set of yielding storeys


def bilinear_chain_response(
    mass: ArrayLike,
    stiffness: ArrayLike,
    yield_force: ArrayLike,
    hardening_ratio: ArrayLike,
    damping: ArrayLike,
    force: ArrayLike,
    step: float,
    initial_velocity: ArrayLike = 0.0,
    initial_displacement: ArrayLike = 0.0,
) -> YieldingResponse:
    """Return the response of bilinear storeys with kinematic hardening, exact between yielding and unloading instants.

    Between these instants the motion is linear. The matrix exponential of the state, augmented with the load and its
    rate, is a Taylor series in time, so that each storey's drift, drift rate and memory are polynomials of time.
    Bernstein coefficients are bounds of a polynomial. If they stay within yield (or, for the drift rate of a yielding
    storey, do not change sign), there is no instant of yielding or unloading in the interval. Otherwise the interval is
    halved until each root is isolated. No instant is missed, even if two are very close.

    Args:
        mass: Floor mass [kg], shape [storey].
        stiffness: Elastic storey stiffness from the ground up [N/m], shape [storey] or one for all.
        yield_force: Storey yield force [N], shape [storey] or one for all.
        hardening_ratio: Stiffness after yield over elastic stiffness [-], from 0 (perfectly plastic) to below 1, shape
            [storey] or one for all.
        damping: Viscous damping matrix of the floors [N s/m], shape [storey, storey].
        force: Force on each floor [N], linear between samples, shape [time, storey]; a ground acceleration a_g is the
            force -mass a_g.
        step: Time between samples [s].
        initial_velocity: Floor velocity at the first sample [m/s], shape [storey] or one for all.
        initial_displacement: Floor displacement at the first sample [m], within yield, shape [storey] or one for all.

    Raises:
        ValueError: If a value is out of its range or a shape does not fit.
        RuntimeError: If yielding and unloading alternate without time passing.

    Example:
        >>> force = np.full((101, 1), 10.0)  # N, applied at once
        >>> system = dict(mass=[2.0], stiffness=200.0, yield_force=15.0, hardening_ratio=0.1, damping=[[0.0]])
        >>> found = wd.truth.bilinear_chain_response(**system, force=force, step=0.01)
        >>> found.peak_storey_drift.round(4)  # m; by energy 0.075 + (sqrt(32.5) - 5) / 20
        array([0.11])
    """
    chain = ShearChain(mass, stiffness, yield_force, hardening_ratio, damping, force, step)
    storeys = chain.storeys
    state = chain.start(initial_displacement, initial_velocity)
    state[2 * storeys :] = memory = state[:storeys] / chain.yield_drift
    if not (np.abs(memory) <= 1 + YIELD_SLACK).all():
        storey = np.abs(memory).argmax()
        raise ValueError(
            f"initial_displacement puts storey {storey + 1} at {state[storey]:g} m; "
            f"it must be within yield, {chain.yield_drift[storey]:g} m: give a smaller initial_displacement="
        )
    pieces = max(1, int(np.ceil(step * chain.fastest)))

    @lru_cache(maxsize=max(1, LARGEST_CACHE // (storeys**2 * 15 * 8 * POWERS.size)))
    def exponential(elastic: bytes) -> np.ndarray:
        return _exponential_series(chain, np.frombuffer(elastic, dtype=bool), step / pieces)

    flow = np.zeros(storeys)  # direction of yielding: -1, 0 (elastic) or 1
    peak, dissipated = np.abs(state[:storeys]), np.zeros(storeys)
    history = [np.concatenate([state, dissipated])]
    for i in range(len(chain.load) - 1):
        rate = (chain.load[i + 1] - chain.load[i]) / pieces
        for j in range(pieces):
            left, switches = 1.0, 0
            while left > 0:
                load = chain.load[i] + rate * (j + 1 - left)
                series = exponential((flow == 0).tobytes()) @ np.concatenate([state, load, rate])
                series = series.reshape(POWERS.size, -1)
                if left < 1:
                    series *= left ** POWERS[:, None]
                hull = BERNSTEIN @ series
                bounds = hull.min(axis=0), hull.max(axis=0)
                part, switching = _first_switch(series, bounds, flow)
                before, state = state, series.sum(axis=0) if part == 1 else part**POWERS @ series
                _raise_peak(peak, series, bounds, state, part)
                dissipated = dissipated + flow * chain.hysteretic_force * (state - before)[:storeys]
                if switching is not None:  # set the exact value: drift rate 0, or full yield
                    if flow[switching]:
                        flow[switching] = state[storeys + switching] = 0.0
                    else:
                        flow[switching] = state[2 * storeys + switching] = np.sign(state[2 * storeys + switching])
                    switches += 1
                    if switches > 50 * storeys:
                        raise RuntimeError(
                            f"yielding and unloading alternate without end after force[{i}]: "
                            "change the force slightly, because this case has no exact solution here"
                        )
                left -= left * part
        history.append(np.concatenate([state, dissipated]))
    return chain.response(np.array(history), peak)


def _exponential_series(chain: ShearChain, elastic: np.ndarray, duration: float) -> np.ndarray:
    """Return the Taylor coefficients of the state after a duration, as factors on the initial state and the load.

    The state is (drift, drift rate, memory). `elastic` marks the storeys that do not yield, shape [storey].
    """
    n = chain.storeys
    # Columns of a term of the series, each of shape [3 storey, storey].
    of_drift, of_rate, of_memory = np.split(np.eye(3 * n), 3, axis=1)
    of_load = of_increment = np.zeros((3 * n, n))
    terms = [np.hstack([of_drift, of_rate, of_memory, of_load, of_increment])]
    for power in POWERS[1:]:
        by_rate = of_drift + of_memory * (elastic / chain.yield_drift)
        by_motion = np.split(of_rate @ chain.generator, 3, axis=1)
        of_load, of_increment = of_rate * (duration / power), of_load / power
        of_drift, of_rate, of_memory = (part * (duration / power) for part in by_motion)
        of_rate += by_rate * (duration / power)
        terms.append(np.hstack([of_drift, of_rate, of_memory, of_load, of_increment]))
    return np.concatenate(terms)


def _first_switch(series: np.ndarray, bounds: tuple[np.ndarray, ...], flow: np.ndarray) -> tuple[float, int | None]:
    """Return the instant in [0, 1] at which a storey first yields or unloads, and this storey; (1, None) without one.

    Args:
        series: Polynomials of drifts, drift rates and memories in time, shape [power, 3 storey].
        bounds: Lower and upper bounds of the polynomials, each of shape [3 storey].
        flow: Direction of yielding of each storey: -1, 0 (elastic) or 1.
    """
    n = flow.size
    (low, high), limit = bounds, 1 + YIELD_SLACK
    elastic = flow == 0
    may_yield = elastic & ((high[2 * n :] > limit) | (low[2 * n :] < -limit))
    may_unload = np.where(flow > 0, low[n : 2 * n] < 0, ~elastic & (high[n : 2 * n] > 0))
    first, switching = 1.0, None
    for storey in np.flatnonzero(may_yield | may_unload):
        instants = []
        if elastic[storey]:
            memory = series[:, 2 * n + storey]
            for sign in (1, -1):
                margin = -sign * memory
                margin[0] += limit
                for instant in _descents(margin):
                    # The instant is beyond yield by the slack; follow the slope back to yield itself.
                    slope = sign * (POWERS[1:] * instant ** POWERS[:-1]) @ memory[1:]
                    back = YIELD_SLACK / slope if slope > 0 else 0.0
                    instants.append(max(0.0, instant - back))
                    break
        else:
            instants += [*_descents(flow[storey] * series[:, n + storey])][:1]
        if instants and (switching is None or min(instants) < first):
            first, switching = min(instants), int(storey)
    return first, switching


def _raise_peak(
    peak: np.ndarray, series: np.ndarray, bounds: tuple[np.ndarray, ...], state: np.ndarray, part: float
) -> None:
    """Increase the peak of each storey to its largest absolute drift in the part [0, part] of a piece of the motion.

    Args:
        peak: Largest absolute drift of each storey so far [m], which is changed.
        series: Polynomials of drifts, drift rates and memories in time, shape [power, 3 storey].
        bounds: Lower and upper bounds of the polynomials.
        state: Drifts, drift rates and memories at the end of the part.
        part: End of the part, as a share of the piece.
    """
    n = peak.size
    np.maximum(peak, np.abs(state[:n]), out=peak)
    for storey in np.flatnonzero(np.maximum(bounds[1][:n], -bounds[0][:n]) > peak):
        for sign in (1, -1):
            for instant in _descents(sign * series[:, n + storey]):
                if instant < part:
                    peak[storey] = max(peak[storey], abs(instant**POWERS @ series[:, storey]))


def _descents(series: np.ndarray) -> Iterator[float]:
    """Yield the instants in [0, 1] at which a polynomial becomes negative, increasing; 0 if it is negative at 0."""
    coefficients = series[::-1].tolist()

    def value(instant: float) -> float:
        result = 0.0
        for coefficient in coefficients:
            result = result * instant + coefficient
        return result

    negative = False
    parts = [(0.0, 1.0, BERNSTEIN @ series)]
    while parts:
        start, end, hull = parts.pop()
        positive = hull[hull != 0] > 0
        changes = np.count_nonzero(positive[1:] != positive[:-1])
        if changes > 1 and end - start > 1e-12:  # two roots closer than this are ignored
            middle = (start + end) / 2
            parts += [(middle, end, SECOND_HALF @ hull), (start, middle, FIRST_HALF @ hull)]
        elif positive.size:
            if not positive[0] and not negative:
                yield start
            elif positive[0] and not positive[-1]:
                if value(start) <= 0:
                    yield start
                elif value(end) >= 0:
                    yield end
                else:
                    yield brentq(value, start, end, xtol=1e-16, rtol=1e-15)
            negative = not positive[-1]
