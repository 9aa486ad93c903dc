"""Exact increments of an oscillator q'' + damping q' + stiffness q = p over one step, for linear and harmonic loads.

Every required function of the 2 x 2 matrix of an oscillator is a polynomial of degree 1 in this matrix. Time is divided
by the step; w = (omega h)^2 and d = 2 zeta omega h. From rest, a constant load 1 leads to (q, q') = (g1, g0), and a
load that rises from 0 to 1 leads to (g2, g1). g0, g1 and g2 are computed by power series for a short fraction of the
step, where few terms suffice; the fraction is then doubled until it is the whole step. Small, equal or complex roots
cause no loss of accuracy.
"""

from __future__ import annotations

from math import factorial

import numpy as np

LARGEST_NORM = 0.5  # largest (1 + 2 zeta) omega h for which the series is summed
HIGHEST_POWER = 14  # highest power of the series; the first omitted term is at most 0.5^15 / 16! = 1e-18


def halvings_of(norm: np.ndarray) -> np.ndarray:
    """Return how often a step must be halved until its norm (1 + 2 zeta) omega h is at most LARGEST_NORM."""
    return np.maximum(np.frexp(norm)[1] + 1, 0)


def oscillator_increments(
    stiffness: np.ndarray, damping: np.ndarray, h: np.ndarray, frequency: float | None, halvings: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the increments of oscillators over a step: those due to their state and those due to a load of 1.

    The equation of motion is q'' + damping q' + stiffness q = load.

    Args:
        stiffness: Squared circular frequencies [rad2/s2], shape [case, oscillator].
        damping: Twice damping ratio times circular frequency [1/s], shape [case, oscillator].
        h: Step [s], shape [case, 1].
        frequency: Circular frequency of a harmonic load [rad/s]; None for a load that is linear within the step.
        halvings: Number of halvings of the step, from `halvings_of`.

    Returns:
        Increments of (q, q') per unit of q and q', shape [case, 2, oscillator, 2]. Increments per unit of the load at
        the start and end of the step, or per unit of the sine and cosine of a harmonic load at the start of the step,
        shape [case, 2, oscillator, 2].
    """
    w, d = np.ldexp(stiffness * h**2, -2 * halvings), np.ldexp(damping * h, -halvings)
    turn = 1j * np.ldexp((frequency or 0.0) * h, -halvings)
    g1, g2 = np.zeros_like(w), np.zeros_like(w)
    driven_q, driven_v, share = 0j * w, 0j * w, 0 * turn  # response to a load exp(i angle)
    for power in range(HIGHEST_POWER, -1, -1):
        g1, g2 = 1 / factorial(power + 2) - w * g2 - d * g1, g1
        if frequency is not None:
            share = 1 / factorial(power + 1) + turn * share
            driven_q, driven_v = driven_v, share - w * driven_q - d * driven_v
    g0 = 1 - d * g1 - w * g2
    for _ in range(halvings):
        if frequency is not None:
            both = 1 + np.exp(turn) - w * g1
            driven_q, driven_v = (
                (both * driven_q + g0 * driven_v) / 4,
                ((both - d * g0) * driven_v - w * g0 * driven_q) / 2,
            )
        g0, g1, g2 = (
            (1 - w * g1 - d * g0 / 2) * g0,
            (g0**2 - w * g1**2 + 2 * g1) / 4,
            (2 * g0 * g1 + d * g1**2 + 2 * g2) / 8,
        )
        w, d, turn = 4 * w, 2 * d, 2 * turn
    increments = [[-w * g1, h * g0], [-w * g0 / h, -w * g1 - d * g0]]
    response = [[(g1 - g2) * h**2, g2 * h**2], [(g0 - g1) * h, g1 * h]]
    if frequency is not None:
        response = [[driven_q.real * h**2, driven_q.imag * h**2], [driven_v.real * h, driven_v.imag * h]]
    return np.transpose(increments, (2, 0, 3, 1)), np.transpose(response, (2, 0, 3, 1))
