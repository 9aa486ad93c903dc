"""Springs and dashpots of rigid rectangular footings after Pais and Kausel.

Sources: Pais and Kausel (1988), "Approximate formulas for dynamic stiffnesses of rigid foundations", as in NIST GCR
12-917-21 (2012), tables 2-2a, 2-2b, 2-3a and 2-3b, and in ASCE 7-16, section 19.3.

Two formulas are not included, because they could not be confirmed: the radiation damping of torsion, and that of
rocking of embedded footings.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.structures.lumped.foundations.footing import (
    RectangularFooting,
    Soil,
    check_footing,
    frequencies,
)

LARGEST_PSI = 2.5


@suggests_names
def pais_kausel_stiffness(footing: RectangularFooting, soil: Soil) -> dict[str, float]:
    """Return the static stiffness of a footing, including its embedment factor, by mode.

    Args:
        footing: The footing.
        soil: The soil.

    Returns:
        Stiffness of the modes "z", "y", "x" [N/m] and "rx", "ry", "t" [N m].

    Raises:
        TypeError: If `footing` or `soil` is of another class.

    Example:
        >>> soil = Soil(poisson_ratio=0.35, density=1800.0, shear_modulus=40e6)
        >>> stiffness = pais_kausel_stiffness(RectangularFooting(10.0, 6.0), soil)
        >>> {mode: f"{value:.4g}" for mode, value in stiffness.items()}
        {'z': '2.27e+09', 'y': '1.805e+09', 'x': '1.728e+09', 'rx': '8.153e+10', 'ry': '1.725e+11', 't': '1.634e+11'}
    """
    check_footing("pais_kausel_stiffness", footing, soil)
    r, b, nu, g = footing.aspect, footing.half_width, soil.poisson_ratio, soil.shear_modulus
    surface = {
        "z": g * b / (1 - nu) * (3.1 * r**0.75 + 1.6),
        "y": g * b / (2 - nu) * (6.8 * r**0.65 + 0.8 * r + 1.6),
        "x": g * b / (2 - nu) * (6.8 * r**0.65 + 2.4),
        "rx": g * b**3 / (1 - nu) * (3.2 * r + 0.8),
        "ry": g * b**3 / (1 - nu) * (3.73 * r**2.4 + 0.27),
        "t": g * b**3 * (4.25 * r**2.45 + 4.06),
    }
    factors = pais_kausel_embedment_factors(footing)
    return {mode: value * factors[mode] for mode, value in surface.items()}


@suggests_names
def pais_kausel_embedment_factors(footing: RectangularFooting) -> dict[str, float]:
    """Return the static stiffness of an embedded footing over that of a footing at the surface, by mode.

    Args:
        footing: The footing.

    Returns:
        Factors of the modes "z", "y", "x", "rx", "ry" and "t" [1]; all are 1 for a footing at the surface.

    Raises:
        TypeError: If `footing` is of another class.

    Example:
        >>> factors = pais_kausel_embedment_factors(RectangularFooting(10.0, 6.0, embedment=2.0))
        >>> round(factors["z"], 4), round(factors["rx"], 4)
        (1.1661, 1.4215)
    """
    check_footing("pais_kausel_embedment_factors", footing)
    r, depth = footing.aspect, footing.embedment / footing.half_width
    sway = 1 + (0.33 + 1.34 / (1 + r)) * depth**0.8
    return {
        "z": 1 + (0.25 + 0.25 / r) * depth**0.8,
        "y": sway,
        "x": sway,
        "rx": 1 + depth + 1.6 / (0.35 + r) * depth**2,
        "ry": 1 + depth + 1.6 / (0.35 + r**4) * depth**2,
        "t": 1 + (1.3 + 1.32 / r) * depth**0.9,
    }


@suggests_names
def pais_kausel_stiffness_modifiers(footing: RectangularFooting, frequency: ArrayLike) -> dict[str, np.ndarray]:
    """Return alpha, the dynamic stiffness over the static stiffness, by mode; also for embedded footings.

    Args:
        footing: The footing.
        frequency: Dimensionless frequency a0 = omega B / Vs [1], any shape; see `dimensionless_frequency`.

    Returns:
        Modifiers of the modes "z", "y", "x", "rx", "ry" and "t" [1], each with the shape of `frequency`.

    Raises:
        ValueError: If a frequency is not finite or is below 0.
        TypeError: If `footing` is of another class.

    Example:
        >>> modifiers = pais_kausel_stiffness_modifiers(RectangularFooting(10.0, 6.0), 0.5)
        >>> round(float(modifiers["ry"]), 4)
        0.8807
    """
    check_footing("pais_kausel_stiffness_modifiers", footing)
    r, square = footing.aspect, frequencies(frequency) ** 2
    root = np.sqrt(r - 1)
    return {
        "z": 1 - (0.4 + 0.2 / r) * square / (10 / (1 + 3 * (r - 1)) + square),
        "y": np.ones_like(square),
        "x": np.ones_like(square),
        "rx": 1 - (0.55 + 0.01 * root) * square / (2.4 - 0.4 / r**3 + square),
        "ry": 1 - 0.55 * square / (0.6 + 1.4 / r**3 + square),
        "t": 1 - (0.33 - 0.03 * root) * square / (0.8 / (1 + 0.33 * (r - 1)) + square),
    }


@suggests_names
def pais_kausel_radiation_damping(
    footing: RectangularFooting, soil: Soil, frequency: ArrayLike
) -> dict[str, np.ndarray]:
    """Return the damping ratio of a footing by radiation of waves, by mode.

    A dashpot of the coefficient 2 beta alpha K / omega has this damping; see `pais_kausel_impedance`. Damping in the
    soil itself is not included. At high frequencies the dashpot coefficients approach those of plane waves: rho times
    psi Vs times the area (or its second moment) for motion normal to it, rho Vs times the area for sliding.

    Args:
        footing: The footing.
        soil: The soil.
        frequency: Dimensionless frequency a0 = omega B / Vs [1], any shape; see `dimensionless_frequency`.

    Returns:
        Damping ratios of the modes "z", "y", "x" [1] and, for a footing at the surface, "rx" and "ry" [1], each with
        the shape of `frequency`.

    Raises:
        ValueError: If a frequency is not finite or is below 0.
        TypeError: If `footing` or `soil` is of another class.

    Example:
        >>> soil = Soil(poisson_ratio=0.35, density=1800.0, shear_modulus=40e6)
        >>> ratios = pais_kausel_radiation_damping(RectangularFooting(10.0, 6.0), soil, 0.5)
        >>> {mode: round(float(ratio), 4) for mode, ratio in ratios.items()}
        {'z': 0.3807, 'y': 0.2216, 'x': 0.2315, 'rx': 0.0137, 'ry': 0.0423}
    """
    check_footing("pais_kausel_radiation_damping", footing, soil)
    a0 = frequencies(frequency)
    alpha = pais_kausel_stiffness_modifiers(footing, a0)
    stiffness = pais_kausel_stiffness(footing, soil)
    return {
        mode: value * a0 / (2 * alpha[mode]) / (stiffness[mode] / _unit_stiffness(footing, soil, mode))
        for mode, value in _radiation(footing, soil, a0).items()
    }


@suggests_names
def pais_kausel_impedance(
    footing: RectangularFooting, soil: Soil, circular_frequency: ArrayLike
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the dynamic stiffness and the radiation dashpot of a footing at one circular frequency, by mode.

    Both depend on the frequency. For a response-history analysis, use the values at the frequency of the structure on
    soil, 2 pi / T~ (see `period_ratio_on_soil`).

    Args:
        footing: The footing.
        soil: The soil.
        circular_frequency: Circular frequency [rad/s], above 0, any shape.

    Returns:
        Dynamic stiffness alpha K of six modes, [N/m] or [N m]; and dashpot coefficients 2 beta alpha K / omega of the
        modes of `pais_kausel_radiation_damping`, [N s/m] or [N m s]. Each has the shape of `circular_frequency`.

    Raises:
        ValueError: If a frequency is not finite and above 0.
        TypeError: If `footing` or `soil` is of another class.

    Example:
        >>> soil = Soil(poisson_ratio=0.35, density=1800.0, shear_modulus=40e6)
        >>> springs, dashpots = pais_kausel_impedance(RectangularFooting(10.0, 6.0), soil, 13.85)
        >>> f"{springs['rx']:.4g} N m, {dashpots['rx']:.4g} N m s"
        '7.614e+10 N m, 2.062e+08 N m s'
    """
    check_footing("pais_kausel_impedance", footing, soil)
    omega = finite_numbers("circular_frequency [rad/s]", circular_frequency)
    if np.any(omega <= 0):
        raise ValueError(f"circular_frequency must be above 0 rad/s, got {omega.min():g}")
    a0 = dimensionless_frequency(footing, soil, omega)
    alpha = pais_kausel_stiffness_modifiers(footing, a0)
    springs = {mode: value * alpha[mode] for mode, value in pais_kausel_stiffness(footing, soil).items()}
    ratios = pais_kausel_radiation_damping(footing, soil, a0)
    return springs, {mode: 2 * ratio * springs[mode] / omega for mode, ratio in ratios.items()}


@suggests_names
def dimensionless_frequency(footing: RectangularFooting, soil: Soil, circular_frequency: ArrayLike) -> np.ndarray:
    """Return a0 = omega B / Vs with the half-width B of a footing and the shear-wave velocity Vs.

    Args:
        footing: The footing.
        soil: The soil.
        circular_frequency: Circular frequency [rad/s], any shape.

    Returns:
        Dimensionless frequency [1], with the shape of `circular_frequency`.

    Raises:
        ValueError: If a frequency is not finite or is below 0.
        TypeError: If `footing` or `soil` is of another class.

    Example:
        >>> soil = Soil(poisson_ratio=0.35, density=1800.0, shear_modulus=40e6)
        >>> round(float(dimensionless_frequency(RectangularFooting(10.0, 6.0), soil, 13.85)), 4)
        0.5575
    """
    check_footing("dimensionless_frequency", footing, soil)
    return frequencies(circular_frequency) * footing.half_width / soil.shear_wave_velocity


def _unit_stiffness(footing: RectangularFooting, soil: Soil, mode: str) -> float:
    """Return G B of a translation, G B^3 of a rotation."""
    return soil.shear_modulus * footing.half_width ** (1 if mode in ("z", "y", "x") else 3)


def _radiation(footing: RectangularFooting, soil: Soil, a0: np.ndarray) -> dict[str, np.ndarray]:
    """Return beta times the static stiffness over G B (or G B^3), over a0 / (2 alpha)."""
    r, depth, nu = footing.aspect, footing.embedment / footing.half_width, soil.poisson_ratio
    divisor = 1 - 2 * nu
    psi = min(np.sqrt(2 * (1 - nu) / divisor), LARGEST_PSI) if divisor > 0 else LARGEST_PSI
    square = a0**2
    found = {
        "z": 4 * (psi * r + depth * (1 + r)),
        "y": 4 * (r + depth * (1 + psi * r)),
        "x": 4 * (r + depth * (psi + r)),
    }
    if footing.embedment == 0:
        found["rx"] = 4 * psi / 3 * r * square / (2.2 - 0.4 / r**3 + square)
        found["ry"] = 4 * psi / 3 * r**3 * square / (1.8 / (1 + 1.75 * (r - 1)) + square)
    return {mode: np.asarray(value) for mode, value in found.items()}
