"""Longest steps at which integration methods are stable: they do not amplify motion."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from threading import Lock

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.methods.amplification import limit_scale, oscillator_limits, polynomial_limits
from warpdyn.engine.methods.kinds import ExplicitMethod, Method, MultistepMethod
from warpdyn.engine.methods.table import METHODS
from warpdyn.engine.tracing.arrays import is_traced
from warpdyn.engine.tracing.tables import looked_up

# Largest relative decrease of the tabulated limit from one damping ratio to the next, except at jumps.
TABLE_TOLERANCE = 2e-3
# Damping ratios below this value count as 0, because rounding errors of eigenvalues are about 1e-12.
LEAST_DAMPING_RATIO = 1e-9
LEAST_CELL = 1e-12  # smallest width of a cell; only cells at a jump of the limit become so narrow
TABLE_MARGIN = 1e-5  # largest relative depth of a smooth minimum between two tabulated damping ratios
# Above a damping ratio of a million, a limit times `limit_scale` is constant.
LAST_PLACE = 2 - 1e-6
CELLS = 1000  # number of cells of the table before refinement
COMPUTING = Lock()
Table = Callable[[Method], tuple[np.ndarray, np.ndarray]]


def stability_limit(method: Method, damping_ratio: float) -> float:
    """Return the largest w h up to which a method does not amplify the motion of u'' + 2 zeta w u' + w^2 u = 0.

    w is the circular frequency and h the step. For a Runge-Kutta method, the limit is the first root of |R(z)|^2 = 1
    along z = w h (-zeta +- i sqrt(1 - zeta^2)) beyond which |R| > 1. If zeta > 1, both roots of the characteristic
    equation are real and the faster root governs (Hairer and Wanner, Solving ODEs II, IV.2). For other methods, the
    limit is the first w h at which the amplification matrix has an eigenvalue outside of the unit circle.

    Args:
        method: Integration method, a value of METHODS.
        damping_ratio: Damping ratio zeta [-], 0 or above.

    Returns:
        The limit of w h [-]; 0 if every step amplifies, infinite if no step does. An adaptive method has no limit,
        because its error estimate rejects steps that amplify.

    Raises:
        ValueError: If the damping ratio is not finite and 0 or above.
    """
    zeta = _at_least_zero("damping_ratio", damping_ratio)
    return float(oscillator_limits(method, zeta[None])[0] / limit_scale(method, zeta))


def stable_step(method: Method, frequency: np.ndarray, damping_ratio: np.ndarray) -> np.ndarray:
    """Return the longest stable step of many oscillators, up to 0.21 % below the exact limit and never above it.

    For each method, the limit is tabulated once over the damping ratio; the limit of an oscillator is that of the table
    cell which contains its damping ratio.

    Args:
        method: Integration method, a value of METHODS.
        frequency: Circular frequency [rad/s], shape [...].
        damping_ratio: Damping ratio [-], 0 or above; values below 1e-9 count as 0; shape [...].

    Returns:
        Step [s], of the common shape of the arguments; 0 if every step amplifies, infinite if no step does.

    Raises:
        ValueError: If a frequency is not above 0, or a damping ratio is below 0.
    """
    frequency = _above_zero("frequency", frequency)
    return _looked_up(_table, method, frequency, _at_least_zero("damping_ratio", damping_ratio))


@cache
def amplifies_undamped(method: Method) -> bool:
    """Return whether a method amplifies undamped free vibration at every step, however short."""
    return stability_limit(method, 0.0) == 0


@cache
def relaxation_limit(method: Method) -> float:
    """Return the largest (step * rate) [-] at which a method does not amplify a deviation z with z' = -rate z.

    Deviations that decay in this way occur in the memory (history variables) of storey laws.

    Args:
        method: Integration method. Implicit methods integrate the memory by the classical method RK4.

    Returns:
        The limit [-]; infinite for adaptive methods, and for the exact method, which supports no memory.
    """
    if method.kind == "exact" or method.is_adaptive:
        return np.inf
    of_memory = METHODS["rk4"] if method.kind == "implicit" else method
    assert isinstance(of_memory, ExplicitMethod | MultistepMethod)
    return float(polynomial_limits(of_memory.stability_polynomial, np.ones(1))[0])


def reads_eigenvalues(method: Method) -> bool:
    """Return whether `stable_step_of_eigenvalues` depends on the eigenvalues, as for Runge-Kutta methods."""
    return isinstance(method, ExplicitMethod) and not method.is_nystroem


def stable_step_of_eigenvalues(
    method: Method, eigenvalues: np.ndarray, highest_frequency: np.ndarray, damping_rate: np.ndarray
) -> np.ndarray:
    """Return the longest step at which a method does not amplify a linear system with any damping matrix.

    For a Runge-Kutta method, only the eigenvalue of a motion decides whether the motion is amplified; the limit is that
    of `stable_step`. For other methods, the result is the smallest limit, within 0.5 %, of all oscillators with at most
    the highest frequency and at most the highest damping rate:

    - The equation of a step is linear in M, C and K for implicit methods and for explicit methods with one stage. Let a
      step multiply a shape x by s. Multiply the equation by x*, the conjugate transpose of x: it becomes the equation
      of an oscillator with mass x* M x, damper x* C x and stiffness x* K x. The limit covers this oscillator, so that
      |s| is at most 1. This proves that no motion grows, if M is symmetric and positive, and C and K are symmetric and
      not negative. For Newmark's methods with gamma = 1/2 the limit is exact: there s = -1, and damping has no effect.
    - With more stages (velocity_verlet, nystroem4), products of C and K occur. Then the limit is proved only for
      classical damping; no tested system has contradicted it.

    Args:
        method: Integration method, a value of METHODS.
        eigenvalues: Eigenvalues of the state matrix [1/s], shape [structure, eigenvalue]; an eigenvalue of 0 sets no
            limit.
        highest_frequency: Highest circular frequency without damping [rad/s], shape [structure].
        damping_rate: Result of `highest_damping_rate` [1/s], shape [structure].

    Returns:
        Step [s], shape [structure].

    Raises:
        ValueError: If an eigenvalue is not finite or has a real part above 0 (its motion grows), a frequency is not
            above 0, or a damping rate is below 0.
    """
    eigenvalues = np.asarray(eigenvalues)
    if eigenvalues.ndim != 2 or eigenvalues.shape[1] == 0 or not np.isfinite(eigenvalues).all():
        raise ValueError(
            "eigenvalues must be finite and of shape [structure, eigenvalue], got shape "
            f"{eigenvalues.shape} with {np.count_nonzero(~np.isfinite(eigenvalues))} values that are not finite"
        )
    size = np.abs(eigenvalues)
    growing = eigenvalues.real > 1e-9 * size.max(axis=1, keepdims=True)  # rounding leaves about 1e-13
    if growing.any():
        raise ValueError(
            f"eigenvalues{_first(growing)} is {eigenvalues[growing][0]:.6g} 1/s: a motion that grows freely has no "
            "stable step. Check that the damping and the stiffness are not negative"
        )
    if not reads_eigenvalues(method):
        return stable_step_of_worst(method, highest_frequency, damping_rate)
    moving = size > 0
    size = np.where(moving, size, 1.0)
    ratio = np.clip(-eigenvalues.real / size, 0.0, 1.0)
    return np.where(moving, _looked_up(_table, method, size, ratio), np.inf).min(axis=1)


def stable_step_of_worst(method: Method, highest_frequency: np.ndarray, damping_rate: np.ndarray) -> np.ndarray:
    """Return the smallest limit of all oscillators with at most these frequencies and damping rates [s].

    Arguments and shapes: see `stable_step_of_eigenvalues`.
    """
    frequency = _above_zero("highest_frequency", highest_frequency)
    rate = _at_least_zero("damping_rate", damping_rate)
    return _looked_up(_table_of_worst, method, frequency, rate / (2 * frequency))


def stable_step_of_yielding(
    method: Method, highest_frequency: np.ndarray, damping_rate: np.ndarray, elastic_step: np.ndarray
) -> np.ndarray:
    """Return the longest stable step of a structure whose stiffness decreases by yielding while its damping does not.

    While storeys yield, their stiffness decreases and their damping ratio rises without bound. The larger root of the
    characteristic equation then changes from that of the elastic motion to the damping rate. Projected on a shape x,
    the structure is an oscillator with mass x* M x, damper x* C x and stiffness x* K x. The limit is the smallest limit
    of all oscillators with at most this frequency and damping rate. Methods that amplify every undamped motion (heun,
    midpoint) would have no stable step. For these methods, the result is the smaller of two limits, which is not proved
    between the two cases: the limit of the elastic structure, and that of the damping rate alone.

    Args:
        method: Integration method, a value of METHODS.
        highest_frequency: Highest circular frequency at the stiffest tangent [rad/s], shape [structure].
        damping_rate: Largest eigenvalue of M^-1 C [1/s], shape [structure].
        elastic_step: Longest step at which the elastic structure is stable [s], shape [structure].

    Returns:
        Step [s], shape [structure].
    """
    step = stable_step_of_worst(method, highest_frequency, damping_rate)
    with np.errstate(divide="ignore"):
        return np.minimum(elastic_step, np.where(step > 0, step, relaxation_limit(method) / damping_rate))


def _nodes(method: Method) -> tuple[np.ndarray, np.ndarray]:
    """Return positions of damping ratios (see `_ratio`), and the stability limits there times `limit_scale`.

    The positions are closer where the limit changes rapidly with the damping ratio.
    """
    with COMPUTING:  # otherwise several threads would compute the same limits
        return _computed_nodes(method)


@cache
def _computed_nodes(method: Method) -> tuple[np.ndarray, np.ndarray]:
    place = np.concatenate([[0, LEAST_DAMPING_RATIO], np.linspace(0, LAST_PLACE, CELLS + 1)[1:]])
    limit = oscillator_limits(method, _ratio(place))
    while np.isfinite(limit).all():  # a method has limits at all damping ratios, or at none
        coarse = np.abs(np.diff(limit)) > TABLE_TOLERANCE * np.maximum(limit[:-1], limit[1:])
        coarse &= (place[:-1] > 0) & (np.diff(place) > LEAST_CELL)
        if not coarse.any():
            break
        where = np.flatnonzero(coarse) + 1
        between = (place[where - 1] + place[where]) / 2
        limit = np.insert(limit, where, oscillator_limits(method, _ratio(between)))
        place = np.insert(place, where, between)
    return place, limit


@cache
def _table(method: Method) -> tuple[np.ndarray, np.ndarray]:
    """Return positions of damping ratios (see `_ratio`), and the smallest limit in each cell times `limit_scale`.

    A cell is the interval between two positions; the shapes are [position] and [position - 1].
    """
    place, limit = _nodes(method)
    return place, (1 - TABLE_MARGIN) * np.minimum(limit[:-1], limit[1:])


@cache
def _table_of_worst(method: Method) -> tuple[np.ndarray, np.ndarray]:
    """Return a table like `_table`, but of the smallest limit of all slower and less damped oscillators.

    A slower and less damped oscillator has at most this circular frequency w and at most this damping rate 2 zeta w.
    """
    place, limit = _nodes(method)
    ratio = np.maximum(_ratio(place), LEAST_DAMPING_RATIO)
    scale = limit_scale(method, ratio)
    limit = limit / scale
    # First the limit for this frequency and less damping; then the limit for this damping rate 2 zeta w and a lower
    # frequency.
    slower = np.minimum.accumulate((ratio * limit)[::-1])[::-1]
    limit = scale * np.minimum(np.minimum.accumulate(limit), slower / ratio)
    return place, (1 - TABLE_MARGIN) * np.minimum(limit[:-1], limit[1:])


def _looked_up(table: Table, method: Method, frequency: np.ndarray, zeta: np.ndarray) -> np.ndarray:
    """Return the stable steps [s] of oscillators, looked up in a table of a method.

    Args:
        table: `_table` or `_table_of_worst`.
        method: Integration method, a value of METHODS.
        frequency: Circular frequencies [rad/s], shape [...].
        zeta: Damping ratios [-], shape [...].
    """
    place = np.where(zeta > 1, 2 - 1 / np.maximum(zeta, 1), zeta)
    if is_traced(place):
        limit = looked_up(*table(method), place, _in_undivided_cells(table, method), LAST_PLACE)
        return limit / (limit_scale(method, zeta) * frequency)
    coarse = np.minimum(CELLS / LAST_PLACE * place, CELLS - 1).astype(np.int32)
    limit = np.array(_in_undivided_cells(table, method)[coarse])
    divided = np.isnan(limit)
    if divided.any():
        grid, cell_limit = table(method)
        cell = np.searchsorted(grid, place[divided], side="right") - 1
        limit[divided] = cell_limit[np.clip(cell, 0, cell_limit.size - 1)]
    return limit / (limit_scale(method, zeta) * frequency)


@cache
def _in_undivided_cells(table: Table, method: Method) -> np.ndarray:
    """Return the values of a table in CELLS cells of equal width, shape [cell], which need no search.

    For cells that are divided into smaller cells, the value is NaN.
    """
    grid, cell_limit = table(method)
    edges = np.searchsorted(grid, np.linspace(0, LAST_PLACE, CELLS + 1))
    return np.where(np.diff(edges) > 1, np.nan, cell_limit[edges[:-1]])


def _ratio(place: np.ndarray) -> np.ndarray:
    """Return the damping ratio at a position of a table.

    A position from 0 to 1 is the damping ratio itself. From position 1 to 2, the inverse of the damping ratio decreases
    from 1 to 0.
    """
    return np.where(place > 1, 1 / (2 - np.maximum(place, 1)), place)


def _first(bad: np.ndarray) -> list[int]:
    return [int(i) for i in np.argwhere(bad)[0]]


def _at_least_zero(name: str, value: ArrayLike) -> np.ndarray:
    if is_traced(value):
        return value  # type: ignore[return-value] # its structures are checked on the device
    array = np.asarray(value, dtype=np.float64)
    bad = ~(np.isfinite(array) & (array >= 0))
    if bad.any():
        raise ValueError(f"{name}{_first(bad) or ''} is {array[bad].flat[0]:g}; it must be finite and 0 or above")
    return array


def _above_zero(name: str, value: np.ndarray) -> np.ndarray:
    value = _at_least_zero(name, value)
    if not is_traced(value) and (value == 0).any():
        raise ValueError(f"{name}{_first(value == 0) or ''} is 0; it must be above 0")
    return value
