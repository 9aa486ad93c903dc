"""Tuned mass dampers with an inerter between absorber and ground (TMDI), and mass matrices of inerters.

An inerter resists with a force of its inertance times the relative acceleration of its ends. It adds to the mass
matrix, but not to the load by base acceleration.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from warpdyn.foundations.core.checks import real_number, whole_number
from warpdyn.foundations.core.near_misses import suggests_names


class OptimumAbsorber(NamedTuple):
    """Frequency of the absorber over that of the structure [1], and damping ratio of the absorber [1]."""

    frequency_ratio: float
    damping_ratio: float


@suggests_names
def optimum_tmdi(mass_ratio: float, inertance_ratio: float = 0.0) -> OptimumAbsorber:
    """Return the absorber that minimises the displacement variance of an undamped structure under white noise.

    The inerter connects the absorber with the ground. With mu = m_t / m, beta = b / m, omega_t^2 = k_t / (m_t + b), p =
    beta (1 - mu) + (2 - mu) (1 + mu) and q = beta (3 - mu) + (4 - mu) (1 + mu): f = sqrt(p / (2 (1 + mu))) / (1 + beta
    + mu) and zeta_t = sqrt((beta + mu) q / (2 (1 + beta + mu) p)) / 2. Without an inerter (beta = 0) these are
    Warburton's formulas for a tuned mass damper.

    Source: Marian and Giaralis (2014), "Optimal design of a novel tuned mass-damper-inerter (TMDI) passive vibration
    control configuration for stochastically support-excited structural systems".

    Args:
        mass_ratio: Mass of the absorber over that of the structure mu [1].
        inertance_ratio: Inertance over the mass of the structure beta [1], 0 or above.

    Returns:
        Frequency ratio f and damping ratio zeta_t [1].

    Raises:
        ValueError: If a value is out of its range, or the formulas have no solution.

    Example:
        >>> f, zeta = optimum_tmdi(mass_ratio=0.02, inertance_ratio=0.1)
        >>> round(f, 4), round(zeta, 4)
        (0.9097, 0.166)
    """
    mu = real_number("mass_ratio", mass_ratio, least=0)
    beta = real_number("inertance_ratio", inertance_ratio, least=0)
    if mu + beta == 0:
        raise ValueError("mass_ratio and inertance_ratio are both 0: give the absorber a mass or an inertance")
    p = beta * (1 - mu) + (2 - mu) * (1 + mu)
    q = beta * (3 - mu) + (4 - mu) * (1 + mu)
    if p <= 0 or q <= 0:
        raise ValueError(
            f"no optimum exists for mass_ratio {mu:g} and inertance_ratio {beta:g}: give mass_ratio= of at most 1"
        )
    frequency = np.sqrt(p / (2 * (1 + mu))) / (1 + beta + mu)
    damping = 0.5 * np.sqrt((beta + mu) * q / (2 * (1 + beta + mu) * p))
    return OptimumAbsorber(float(frequency), float(damping))


class Absorber(NamedTuple):
    """Mass [kg], inertance [kg], stiffness [N/m] and dashpot coefficient [N s/m] of an absorber."""

    mass: float
    inertance: float
    stiffness: float
    dashpot: float


@suggests_names
def tmdi_absorber(
    structure_mass: float,
    period: float,
    mass_ratio: float,
    inertance_ratio: float,
    frequency_ratio: float,
    damping_ratio: float,
) -> Absorber:
    """Return mass, inertance, spring and dashpot of an absorber with an inerter to the ground.

    omega_t = f omega_s, k_t = (m_t + b) omega_t^2 and c_t = 2 zeta_t omega_t (m_t + b).

    Source: Marian and Giaralis (2014), see `optimum_tmdi`.

    Args:
        structure_mass: Mass of the structure (of its first mode) [kg].
        period: Period of the structure without the absorber [s].
        mass_ratio: Mass of the absorber over that of the structure [1].
        inertance_ratio: Inertance over the mass of the structure [1], 0 or above.
        frequency_ratio: Frequency of the absorber over that of the structure f [1], such as the optimum.
        damping_ratio: Damping ratio of the absorber zeta_t [1], such as the optimum.

    Returns:
        Mass [kg], inertance [kg], stiffness [N/m] and dashpot coefficient [N s/m].

    Raises:
        ValueError: If a value is out of its range.

    Example:
        >>> f, zeta = optimum_tmdi(0.02, 0.1)
        >>> absorber = tmdi_absorber(1e6, 2.0, 0.02, 0.1, f, zeta)
        >>> f"{absorber.stiffness:.6g} N/m, {absorber.dashpot:.6g} N s/m"
        '980074 N/m, 113864 N s/m'
    """
    mass = real_number("structure_mass [kg]", structure_mass, above=0)
    omega = 2 * np.pi / real_number("period [s]", period, above=0)
    own = mass * real_number("mass_ratio", mass_ratio, above=0)
    inertance = mass * real_number("inertance_ratio", inertance_ratio, least=0)
    omega = float(omega) * real_number("frequency_ratio", frequency_ratio, above=0)
    ratio = real_number("damping_ratio", damping_ratio, least=0)
    return Absorber(own, inertance, (own + inertance) * omega**2, 2 * ratio * omega * (own + inertance))


@suggests_names
def inertance_matrix(dofs: int, inertance: float, first: int, second: int | None = None) -> np.ndarray:
    """Return the mass matrix of an inerter between two degrees of freedom, or one and the ground.

    b (e_i - e_j) (e_i - e_j)^T. Add it to the mass matrix of a structure, but not to its load masses.

    Args:
        dofs: Number of degrees of freedom of the structure.
        inertance: Inertance b [kg].
        first: Index of one degree of freedom, from 0.
        second: Index of the other degree of freedom; None: the ground.

    Returns:
        Mass matrix [kg], shape [dof, dof].

    Raises:
        ValueError: If the inertance is not finite and 0 or above, an index is out of range, or both indices are equal.

    Example:
        >>> inertance_matrix(2, 5.0, first=0, second=1)
        array([[ 5., -5.],
               [-5.,  5.]])
    """
    count = whole_number("dofs", dofs, 1)
    direction = np.zeros(count)
    direction[whole_number("first", first, 0, count - 1)] = 1.0
    if second is not None:
        if whole_number("second", second, 0, count - 1) == first:
            raise ValueError(
                f"first and second are both {first}, so that the inerter has no effect: give two degrees of freedom, "
                "or second=None for an inerter to the ground"
            )
        direction[second] = -1.0
    return real_number("inertance [kg]", inertance, least=0) * np.outer(direction, direction)
