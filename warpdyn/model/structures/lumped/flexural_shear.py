"""Flexural-shear cantilever: a continuous flexural beam and a shear beam with equal displacements at every height.

EI u'''' - GA u'' + rho u_tt = 0 with the lateral stiffness ratio alpha0 = H sqrt(GA / EI). Mode i has the eigenvalue
gamma_i and beta_i = sqrt(alpha0^2 + gamma_i^2). For alpha0 = 0 the cantilever is a flexural beam (a shear wall); for
large alpha0 it is a shear beam (a moment frame).

Sources: Miranda and Taghavi (2005), "Approximate floor acceleration demands in multistory buildings I: formulation";
Xiong, Lu, Guan and co-authors (2016), "A nonlinear computational model for regional seismic simulation of tall
buildings".
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, real_number, whole_number
from warpdyn.foundations.core.near_misses import suggests_names

MOST_MODES = 1000
LARGEST_ALPHA0 = 1e6  # the first eigenvalue differs from that of a shear beam by 1.6e-6
SHEAR_BEAM_PERIOD_RATIO = 1 / 3  # T2 / T1 for an infinite alpha0


@suggests_names
def flexural_shear_eigenvalues(alpha0: float, modes: int) -> np.ndarray:
    """Return the eigenvalues gamma_i of a flexural-shear cantilever.

    They solve 2 + (2 + alpha0^4 / (gamma^2 beta^2)) cos(gamma) cosh(beta) + alpha0^2 / (gamma beta) sin(gamma)
    sinh(beta) = 0, which is divided by cosh(beta) here. Each interval from (i - 1) pi to i pi contains one eigenvalue.

    Source: Miranda and Taghavi (2005).

    Args:
        alpha0: Lateral stiffness ratio H sqrt(GA / EI) [1], from 0 to 1e6.
        modes: Number of modes, at most 1000.

    Returns:
        Eigenvalues [1], increasing, shape [mode].

    Raises:
        ValueError: If `alpha0` or `modes` is out of its range.

    Example:
        >>> flexural_shear_eigenvalues(alpha0=5.0, modes=3).round(4)
        array([1.8667, 4.9873, 8.0096])
    """
    from scipy.optimize import brentq  # its import takes a tenth of a second

    alpha0, modes = _checked_ratio_and_modes(alpha0, modes)

    def residual(gamma: float) -> float:
        beta = np.hypot(alpha0, gamma)
        ratio = (alpha0 / gamma) * (alpha0 / beta)
        decay = np.exp(-beta)
        inverse_cosh = 2 * decay / (1 + decay**2)
        return float(2 * inverse_cosh + (2 + ratio**2) * np.cos(gamma) + ratio * np.sin(gamma) * np.tanh(beta))

    # The first eigenvalue is between those of a shear beam (pi / 2) and of a flexural beam (1.875).
    lower = [np.pi / 2, *(np.pi * np.arange(1, modes))]
    roots = [brentq(residual, low, np.pi * (i + 1), xtol=1e-14, rtol=1e-14) for i, low in enumerate(lower)]
    return np.array(roots)


@suggests_names
def flexural_shear_period_ratios(alpha0: float, modes: int) -> np.ndarray:
    """Return the periods T_i / T_1 of a flexural-shear cantilever.

    T_i / T_1 = (gamma_1 / gamma_i) sqrt((gamma_1^2 + alpha0^2) / (gamma_i^2 + alpha0^2)).

    Source: Miranda and Taghavi (2005).

    Args:
        alpha0: Lateral stiffness ratio H sqrt(GA / EI) [1], from 0 to 1e6.
        modes: Number of modes, at most 1000.

    Returns:
        Periods over the first period [1], shape [mode].

    Raises:
        ValueError: If `alpha0` or `modes` is out of its range.

    Example:
        >>> flexural_shear_period_ratios(alpha0=5.0, modes=3).round(4)
        array([1.    , 0.2829, 0.1317])
    """
    gamma = flexural_shear_eigenvalues(alpha0, modes)
    frequency = gamma * np.hypot(gamma, float(alpha0))
    return frequency[0] / frequency


@suggests_names
def flexural_shear_mode_shapes(alpha0: float, modes: int, height_ratio: ArrayLike) -> np.ndarray:
    """Return the mode shapes of a flexural-shear cantilever, 1 at the top.

    sin(g x) - (g / b) sinh(b x) + eta (cosh(b x) - cos(g x)) with g = gamma_i, b = beta_i and eta = (g^2 sin(g) + g b
    sinh(b)) / (g^2 cos(g) + b^2 cosh(b)). The hyperbolic functions are replaced by exponentials that do not overflow
    and do not cancel for large b.

    Source: Miranda and Taghavi (2005).

    Args:
        alpha0: Lateral stiffness ratio H sqrt(GA / EI) [1], from 0 to 1e6.
        modes: Number of modes, at most 1000.
        height_ratio: Heights above the base over the total height [1], from 0 to 1, shape [height].

    Returns:
        Mode shapes [1], shape [mode, height].

    Raises:
        ValueError: If `alpha0` or `modes` is out of its range, or a height ratio is outside 0 to 1.

    Example:
        >>> flexural_shear_mode_shapes(alpha0=5.0, modes=2, height_ratio=[0.25, 0.5, 1.0]).round(3)
        array([[ 0.194,  0.528,  1.   ],
               [-0.487, -0.676,  1.   ]])
    """
    gamma = flexural_shear_eigenvalues(alpha0, modes)
    x = np.atleast_1d(finite_numbers("height_ratio", height_ratio))
    if x.ndim != 1 or np.any((x < 0) | (x > 1)):
        raise ValueError(
            f"height_ratio must be one row of heights over the total height, from 0 to 1, got {height_ratio!r}: divide "
            "heights in metres by the total height"
        )
    b, eta, rising, falling = _shape_terms(gamma, float(alpha0))
    shape = np.sin(gamma[:, None] * x) - eta[:, None] * np.cos(gamma[:, None] * x)
    shape += rising[:, None] * np.exp(b[:, None] * (x - 1)) + falling[:, None] * np.exp(-b[:, None] * x)
    return shape / _top(gamma, b, eta, rising, falling)[:, None]


@suggests_names
def flexural_shear_participation(alpha0: float, modes: int) -> np.ndarray:
    """Return the participation factors of a flexural-shear cantilever with uniform mass, for shapes with 1 at the top.

    Gamma_i = int phi_i dx / int phi_i^2 dx; the integrals are evaluated in closed form.

    Source: Miranda and Taghavi (2005).

    Args:
        alpha0: Lateral stiffness ratio H sqrt(GA / EI) [1], from 0 to 1e6.
        modes: Number of modes, at most 1000.

    Returns:
        Participation factors [1], shape [mode].

    Raises:
        ValueError: If `alpha0` or `modes` is out of its range.

    Example:
        >>> flexural_shear_participation(alpha0=5.0, modes=2).round(4)
        array([ 1.3943, -0.6634])
    """
    g = flexural_shear_eigenvalues(alpha0, modes)
    b, eta, rising, falling = _shape_terms(g, float(alpha0))
    # The equation of motion, integrated over the height: the base shear is the inertia force.
    integral = (1 + (g / b) ** 2) / g
    # The trigonometric part is the real part of c e^(i g x).
    c, decay, wave = -eta - 1j, np.exp(-b), np.exp(1j * g)
    square = (1 + eta**2) / 2 + np.real(c**2 * (wave**2 - 1) / (2j * g)) / 2
    square += 2 * rising * np.real(c * (wave - decay) / (b + 1j * g))
    square += 2 * falling * np.real(c * (1 - wave * decay) / (b - 1j * g))
    square += (rising**2 + falling**2) * (1 - decay**2) / (2 * b) + 2 * rising * falling * decay
    return integral / square * _top(g, b, eta, rising, falling)


@suggests_names
def flexural_shear_stiffness(
    period: float, height: float, mass_per_height: float, alpha0: float
) -> tuple[float, float]:
    """Return the bending stiffness EI and the shear stiffness GA of a flexural-shear cantilever with a given period.

    EI = (2 pi / T1)^2 rho H^4 / (gamma_1^2 (gamma_1^2 + alpha0^2)), GA = (alpha0 / H)^2 EI. A stick with one mass per
    floor has another first period than the continuous cantilever; `stick_of_period` corrects the difference.

    Source: Xiong, Lu, Guan and co-authors (2016), equations 5 and 6.

    Args:
        period: First period T1 [s].
        height: Total height H [m].
        mass_per_height: Mass per height rho [kg/m].
        alpha0: Lateral stiffness ratio H sqrt(GA / EI) [1], from 0 to 1e6.

    Returns:
        EI [N m2] and GA [N].

    Raises:
        ValueError: If a value is not finite and above 0, or `alpha0` is out of its range.

    Example:
        >>> bending, shear = flexural_shear_stiffness(period=2.0, height=60.0, mass_per_height=4e5 / 3, alpha0=4.0)
        >>> f"{bending:.4g} N m2, {shear:.4g} N"
        '2.393e+11 N m2, 1.063e+09 N'
    """
    period = real_number("period [s]", period, above=0)
    height = real_number("height [m]", height, above=0)
    mass_per_height = real_number("mass_per_height [kg/m]", mass_per_height, above=0)
    (gamma,) = flexural_shear_eigenvalues(alpha0, 1)
    product = gamma * np.hypot(gamma, float(alpha0))
    bending = (2 * np.pi / period) ** 2 * mass_per_height * height**4 / product**2
    return float(bending), float((float(alpha0) / height) ** 2 * bending)


@suggests_names
def flexural_shear_periods(
    bending_stiffness: float, shear_stiffness: float, height: float, mass_per_height: float, modes: int
) -> np.ndarray:
    """Return the natural periods of a flexural-shear cantilever with uniform stiffness and mass.

    omega_i^2 = gamma_i^2 (gamma_i^2 + alpha0^2) EI / (rho H^4).

    Source: Miranda and Taghavi (2005).

    Args:
        bending_stiffness: Bending stiffness EI [N m2].
        shear_stiffness: Shear stiffness GA [N], 0 for a flexural beam.
        height: Total height H [m].
        mass_per_height: Mass per height rho [kg/m].
        modes: Number of modes, at most 1000.

    Returns:
        Natural periods [s], shape [mode].

    Raises:
        ValueError: If a value is not finite, or is below its bound, or H sqrt(GA / EI) is above 1e6.

    Example:
        >>> flexural_shear_periods(2.39250923e11, 1.06333744e9, height=60.0, mass_per_height=4e5 / 3, modes=2).round(4)
        array([2.    , 0.5392])
    """
    bending_stiffness = real_number("bending_stiffness [N m2]", bending_stiffness, above=0)
    shear_stiffness = real_number("shear_stiffness [N]", shear_stiffness, least=0)
    height = real_number("height [m]", height, above=0)
    mass_per_height = real_number("mass_per_height [kg/m]", mass_per_height, above=0)
    alpha0 = height * np.sqrt(shear_stiffness / bending_stiffness)
    gamma = flexural_shear_eigenvalues(alpha0, modes)
    omega = gamma * np.hypot(gamma, alpha0) * np.sqrt(bending_stiffness / (mass_per_height * height**4))
    return 2 * np.pi / omega


@suggests_names
def alpha0_of_period_ratio(period_ratio: float) -> float:
    """Return the lateral stiffness ratio alpha0 of a flexural-shear cantilever from its first two periods.

    T2 / T1 increases with alpha0, from 0.1596 (flexural beam) towards 1/3 (shear beam), so that alpha0 is unique.

    Args:
        period_ratio: Second period over the first period T2 / T1 [1], from 0.1596 to 0.333333.

    Returns:
        Lateral stiffness ratio H sqrt(GA / EI) [1].

    Raises:
        ValueError: If no flexural-shear cantilever with `alpha0` from 0 to 1e6 has this ratio of periods.

    Example:
        >>> round(alpha0_of_period_ratio(0.25), 4)
        3.0238
    """
    from scipy.optimize import brentq

    ratio = real_number("period_ratio", period_ratio, above=0)

    def residual(log_ratio: float) -> float:
        return float(flexural_shear_period_ratios(np.expm1(log_ratio), 2)[1] - ratio)

    highest = float(np.log1p(LARGEST_ALPHA0) * (1 - 1e-12))
    least, most = residual(0.0), residual(highest)
    if abs(least) < 1e-13:  # rounding of the ratio of a flexural beam
        return 0.0
    if not least < 0 <= most:
        raise ValueError(
            f"period_ratio T2 / T1 is {ratio:.6g}, but flexural-shear cantilevers have {ratio + least:.6g} (flexural "
            f"beam) to {SHEAR_BEAM_PERIOD_RATIO:.6g} (shear beam): correct the periods, or give alpha0="
        )
    return float(np.expm1(brentq(residual, 0.0, highest, xtol=1e-14, rtol=1e-14)))


def _checked_ratio_and_modes(alpha0: float, modes: int) -> tuple[float, int]:
    alpha0 = real_number("alpha0", alpha0, least=0)
    if alpha0 > LARGEST_ALPHA0:
        raise ValueError(
            f"alpha0 is {alpha0:g}; it must be at most {LARGEST_ALPHA0:g}: for a shear beam give alpha0=1e6, or use a "
            "ShearBuilding"
        )
    return alpha0, whole_number("modes", modes, 1, MOST_MODES)


def _shape_terms(g: np.ndarray, alpha0: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return b, eta, P and Q of the shape sin(g x) - eta cos(g x) + P exp(b (x - 1)) + Q exp(-b x).

    P exp(-b) = (eta - g / b) / 2 is the difference of nearly equal numbers; here its numerator is simplified.
    """
    b = np.hypot(g, alpha0)
    decay = np.exp(-b)
    divisor = g**2 * np.cos(g) * decay + b**2 * (1 + decay**2) / 2  # times exp(b)
    eta = (g**2 * np.sin(g) * decay + g * b * (1 - decay**2) / 2) / divisor
    rising = (g**2 * np.sin(g) - g**3 / b * np.cos(g) - g * b * decay) / (2 * divisor)
    falling = (eta + g / b) / 2
    return b, eta, rising, falling


def _top(g: np.ndarray, b: np.ndarray, eta: np.ndarray, rising: np.ndarray, falling: np.ndarray) -> np.ndarray:
    return np.asarray(np.sin(g) - eta * np.cos(g) + rising + falling * np.exp(-b))
