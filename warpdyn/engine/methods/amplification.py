"""Step length above which an integration method amplifies the free vibration of an oscillator.

The equation of motion is u'' + 2 zeta w u' + w^2 u = 0, with the circular frequency w and the damping ratio zeta.
"""

from __future__ import annotations

from itertools import combinations
from math import factorial

import numpy as np

from warpdyn.engine.methods.kinds import ExplicitMethod, ImplicitMethod, Method, MultistepMethod

# Values of w h times `limit_scale` at which amplification matrices are evaluated (h: step, w: circular frequency). An
# explicit method of s stages amplifies every motion beyond 2 s^2. A method that does not amplify at the last of these
# values has no limit.
SCANNED_STEPS = np.geomspace(0.05, 1000, 500)
STEPS_AT_A_TIME = 100
ROUNDING = 1e-13  # tolerance of a condition on an amplification matrix; rounding errors are about 2e-15
BISECTIONS = 50
DAMPING_RATIOS_AT_A_TIME = 128


def oscillator_limits(method: Method, damping_ratio: np.ndarray) -> np.ndarray:
    """Return stability limits: the largest frequency times step w h without amplification, times `limit_scale`.

    w is the circular frequency of an oscillator and h the step.

    Args:
        method: The method.
        damping_ratio: Damping ratio [-], 0 or above, shape [ratio].

    Returns:
        Limits [-], shape [ratio]; 0 if every step amplifies, infinite if no step does.
    """
    if method.kind == "exact" or method.is_adaptive:
        return np.full(damping_ratio.size, np.inf)
    if isinstance(method, ExplicitMethod) and not method.is_nystroem:
        return polynomial_limits(method.stability_polynomial, np.minimum(damping_ratio, 1.0))
    return _scanned_limits(method, damping_ratio)


def limit_scale(method: Method, damping_ratio: np.ndarray) -> np.ndarray:
    """Return a factor, shape [ratio]; limits of w h times this factor vary little with the damping ratio.

    The factor is the larger root of the characteristic equation of the oscillator divided by w; for implicit methods it
    is 1.
    """
    if method.kind == "implicit":
        return np.ones_like(damping_ratio)
    over = np.maximum(damping_ratio, 1.0)
    return over + np.sqrt(over**2 - 1)


def polynomial_limits(stability_polynomial: tuple[float, ...], damping_ratio: np.ndarray) -> np.ndarray:
    """Return the largest w h up to which |R(z)| is at most 1 along z = w h (-zeta +- i sqrt(1 - zeta^2)).

    R(z) is the factor by which a step h of a Runge-Kutta method multiplies a motion; w is the circular frequency of an
    oscillator and zeta its damping ratio.

    Args:
        stability_polynomial: Coefficients r_k of R(z) = sum r_k z^k; the first two are 1, shape [power].
        damping_ratio: Damping ratio [-], from 0 to 1, shape [ratio].

    Returns:
        Limits [-], shape [ratio].
    """
    coefficients = _without_rounding(stability_polynomial)
    stages = len(coefficients) - 1
    order = next((k - 1 for k, c in enumerate(coefficients) if c != 1 / factorial(k)), stages)
    chebyshev = np.polynomial.chebyshev.chebvander(-damping_ratio, 2 * stages)  # cos(m angle), exact at zeta = 0
    # Coefficients of (|R|^2 - 1) / x as a polynomial in x = w h. Up to the order of the method they are equal to those
    # of exp(-2 zeta x), which are used because of cancellation at low damping.
    growth = np.zeros((damping_ratio.size, 2 * stages))
    for power in range(1, 2 * stages + 1):
        if power <= order:
            growth[:, power - 1] = (-2 * damping_ratio) ** power / factorial(power)
        else:
            for j in range(max(0, power - stages), min(stages, power) + 1):
                growth[:, power - 1] += coefficients[j] * coefficients[power - j] * chebyshev[:, abs(2 * j - power)]
    degree = 2 * stages - 1
    companion = np.zeros((damping_ratio.size, degree, degree))
    companion[:, np.arange(1, degree), np.arange(degree - 1)] = 1
    companion[:, :, -1] = -growth[:, :-1] / growth[:, -1:]
    roots = np.linalg.eigvals(companion)
    # Rounding may split a double root into a complex pair. Additional candidates do no harm, because the signs between
    # the roots decide.
    real = (np.abs(roots.imag) <= 1e-5 * np.abs(roots)) & (roots.real > 0)
    ends = np.sort(np.where(real, roots.real, np.inf), axis=1)
    edge = np.zeros((damping_ratio.size, 1))
    ends = np.concatenate([edge, ends, edge + np.inf], axis=1)
    with np.errstate(invalid="ignore"):
        middle = np.where(np.isfinite(ends[:, 1:]), (ends[:, :-1] + ends[:, 1:]) / 2, 2 * ends[:, :-1] + 1)
        value = np.zeros_like(middle)
        for column in growth.T[::-1]:
            value = value * middle + column[:, None]
    # Beyond the last root |R| grows, so there is always an interval with |R| > 1.
    first = (~(value <= 0)).argmax(axis=1)
    return ends[np.arange(damping_ratio.size), first]


def _without_rounding(stability_polynomial: tuple[float, ...]) -> tuple[float, ...]:
    """Return a polynomial without zeros at its end, and without rounding errors in coefficients equal to 1 / k!."""
    values = np.trim_zeros(np.array(stability_polynomial), "b")
    exact = [1 / factorial(k) for k in range(values.size)]
    return tuple(np.where(np.isclose(values, exact, rtol=1e-12, atol=0), exact, values).tolist())


def _scanned_limits(method: ExplicitMethod | MultistepMethod | ImplicitMethod, damping_ratio: np.ndarray) -> np.ndarray:
    scale = limit_scale(method, damping_ratio)
    # The matrices of many steps are computed in parts that fit in the cache, those of one step all at once.
    parts = np.array_split(damping_ratio, 1 + damping_ratio.size // DAMPING_RATIOS_AT_A_TIME)
    brackets = zip(*(_bracket(method, part) for part in parts), strict=True)
    ends, starts_unstable, low, high = (np.concatenate(each) for each in brackets)
    # Bisection finds the zero of a condition that is violated at the end of the bracket; other conditions may be 0
    # everywhere, except for rounding.
    broken = _conditions(method, high / scale, damping_ratio) < -ROUNDING
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        beyond = (broken & (_conditions(method, middle / scale, damping_ratio) < 0)).any(axis=0)
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return np.where(ends, np.where(starts_unstable, 0.0, low), np.inf)


def _bracket(
    method: ExplicitMethod | MultistepMethod | ImplicitMethod, damping_ratio: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return brackets of limits: is there a limit, does the first step amplify, last stable and first unstable step.

    Steps beyond the limits of all damping ratios are not evaluated. Shapes are [ratio]; steps are values of w h times
    `limit_scale`.
    """
    scale = limit_scale(method, damping_ratio)
    scanned: list[np.ndarray] = []
    ends = np.zeros(damping_ratio.size, dtype=bool)
    for start in range(0, SCANNED_STEPS.size, STEPS_AT_A_TIME):
        step = SCANNED_STEPS[start : start + STEPS_AT_A_TIME, None]
        scanned.append(_conditions(method, step / scale, damping_ratio))
        ends |= (scanned[-1] < -ROUNDING).any(axis=(0, 1))
        if ends.all():
            break
    conditions = np.concatenate(scanned, axis=1)
    first = np.any(conditions < -ROUNDING, axis=0).argmax(axis=0)
    low, high = SCANNED_STEPS[np.maximum(first - 1, 0)], SCANNED_STEPS[first]
    for column, start, bottom in _dips(method, conditions, damping_ratio):
        if not ends[column] or bottom < high[column]:
            ends[column], first[column], low[column], high[column] = True, start + 1, SCANNED_STEPS[start], bottom
    return ends, first == 0, low, high


def _dips(
    method: ExplicitMethod | MultistepMethod | ImplicitMethod, conditions: np.ndarray, damping_ratio: np.ndarray
) -> list[tuple[int, int, float]]:
    """Return (column, index, unstable step) of conditions that are violated only between two scanned steps.

    The index is that of the scanned step before the unstable step. The unstable step is the minimum of the parabola
    through three scanned values whose middle value is the lowest.
    """
    before, here, after = conditions[:, :-2], conditions[:, 1:-1], conditions[:, 2:]
    low = np.nonzero((here > ROUNDING) & (here <= before) & (here < after))
    before, here, after = before[low], here[low], after[low]
    shift = (before - after) / (before - 2 * here + after) / 2
    _, start, column = low
    bottom = SCANNED_STEPS[start + 1] * (SCANNED_STEPS[1] / SCANNED_STEPS[0]) ** shift
    ratio = damping_ratio[column]
    grows = (_conditions(method, bottom / limit_scale(method, ratio), ratio) < -ROUNDING).any(axis=0)
    return [(column[i], start[i], bottom[i]) for i in np.flatnonzero(grows)]


def _conditions(
    method: ExplicitMethod | MultistepMethod | ImplicitMethod, frequency_step: np.ndarray, damping_ratio: np.ndarray
) -> np.ndarray:
    """Return values that are 0 or above if all eigenvalues of a method's step are within the unit circle (Jury 1962).

    The first value is 0 if an eigenvalue is 1, the second if an eigenvalue is -1, the third if the product of two
    eigenvalues is 1. Unlike the spectral radius, these values cross 0 with a finite slope if a double eigenvalue
    splits. For multistep methods there is only one value: 1 minus the spectral radius.
    """
    matrix = method.amplification(frequency_step, damping_ratio)
    if isinstance(method, MultistepMethod):
        return _conditions_of_four(matrix)
    size = matrix.shape[-1]
    entry = np.moveaxis(matrix, (-2, -1), (0, 1))
    trace = sum(entry[i, i] for i in range(size))
    minors = sum(entry[i, i] * entry[j, j] - entry[i, j] * entry[j, i] for i, j in combinations(range(size), 2))
    determinant = np.linalg.det(matrix) if size == 3 else np.zeros_like(trace)
    return np.stack(
        [
            1 - trace + minors - determinant,
            1 + trace + minors + determinant,
            1 - determinant**2 - np.abs(determinant * trace - minors),
        ]
    )


def _conditions_of_four(matrix: np.ndarray) -> np.ndarray:
    """Return conditions that are 0 or above if all four eigenvalues of a multistep method are within the unit circle.

    The map (1 + s) / (1 - s) of the characteristic polynomial moves the unit circle to the imaginary axis, where the
    criterion of Lienard and Chipart (1914) applies. The last two rows of the matrix shift changes by one step, so that
    the coefficients of the polynomial follow from the first two rows.
    """
    (a, a0, a1, a2), (b, b0, b1, b2) = np.moveaxis(matrix[..., :2, :], (-2, -1), (0, 1))
    cubic, square, linear, constant = -(b0 + a), a * b0 - b1 - b * a0, a * b1 - b2 - b * a1, a * b2 - b * a2
    s4 = 1 - cubic + square - linear + constant
    s3 = 4 - 2 * cubic + 2 * linear - 4 * constant
    s2 = 6 - 2 * square + 6 * constant
    s1 = 4 + 2 * cubic - 2 * linear - 4 * constant
    s0 = 1 + cubic + square + linear + constant
    terms = np.stack([s1 * s2 * s3, -s4 * s1**2, -s0 * s3**2])
    largest = np.abs(terms).sum(axis=0)  # 0 for an eigenvalue of 0 and others on the unit circle
    return np.stack([s0, s4, s3, s2, terms.sum(axis=0) / np.where(largest > 0, largest, 1.0)])
