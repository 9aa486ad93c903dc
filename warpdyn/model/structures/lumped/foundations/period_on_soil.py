"""Period and damping of a structure on flexible soil, and the model with sway and rocking of the base.

Sources: Veletsos and Meek (1974), "Dynamic behaviour of building-foundation systems"; NIST GCR 12-917-21 (2012);
ASCE 7-16, section 19.3.
"""

from __future__ import annotations

import numpy as np

from warpdyn.foundations.core.checks import one_of, real_number
from warpdyn.foundations.core.near_misses import suggests_names

EXPONENTS = {"hysteretic": 2, "viscous": 3}  # of the period ratio, which divides the damping of the structure


@suggests_names
def period_ratio_on_soil(stiffness: float, height: float, sway_stiffness: float, rocking_stiffness: float) -> float:
    """Return the period of a structure on soil over its period on a fixed base.

    T~ / T = sqrt(1 + k / K_x + k h^2 / K_r).

    Source: Veletsos and Meek (1974).

    Args:
        stiffness: Stiffness k of the structure on a fixed base [N/m], (2 pi / T)^2 times its mass.
        height: Height h of the mass above the base of the foundation [m].
        sway_stiffness: Horizontal stiffness K_x of the foundation [N/m].
        rocking_stiffness: Rocking stiffness K_r of the foundation [N m].

    Returns:
        Ratio of periods [1], above 1.

    Raises:
        ValueError: If a value is not finite and above 0.

    Example:
        >>> round(period_ratio_on_soil(1.2337e8, 12.0, 1.805265e9, 8.152615e10), 4)
        1.1341
    """
    k = real_number("stiffness [N/m]", stiffness, above=0)
    h = real_number("height [m]", height, above=0)
    sway = real_number("sway_stiffness [N/m]", sway_stiffness, above=0)
    rocking = real_number("rocking_stiffness [N m]", rocking_stiffness, above=0)
    return float(np.sqrt(1 + k / sway + k * h**2 / rocking))


@suggests_names
def effective_period_ratio_on_soil(period_ratio: float, ductility: float) -> float:
    """Return the period ratio T~ / T of a yielding structure on soil.

    sqrt(1 + ((T~ / T)^2 - 1) / mu): yielding makes the structure softer, so that the soil is relatively stiffer.

    Source: NIST GCR 12-917-21 (2012); ASCE 7-16, section 19.3.

    Args:
        period_ratio: Ratio T~ / T of the elastic structure [1], at least 1.
        ductility: Ductility demand mu of the structure [1], at least 1.

    Returns:
        Effective ratio of periods [1].

    Raises:
        ValueError: If a value is not finite and at least 1.

    Example:
        >>> round(effective_period_ratio_on_soil(1.2, ductility=4.0), 4)
        1.0536
    """
    ratio = real_number("period_ratio", period_ratio, least=1)
    return float(np.sqrt(1 + (ratio**2 - 1) / real_number("ductility", ductility, least=1)))


@suggests_names
def foundation_damping_ratio(
    period: float,
    period_ratio: float,
    mass: float,
    height: float,
    sway_stiffness: float,
    rocking_stiffness: float,
    sway_damping_ratio: float,
    rocking_damping_ratio: float,
    soil_damping_ratio: float,
) -> float:
    """Return the damping ratio that the foundation adds to a structure on soil.

    beta_f = ((T~/T)^2 - 1) / (T~/T)^2 beta_s + beta_x / (T~/T_x)^2 + beta_r / (T~/T_r)^2 with T_x = 2 pi sqrt(m / K_x)
    and T_r = 2 pi sqrt(m h^2 / K_r).

    Source: NIST GCR 12-917-21 (2012); ASCE 7-16, section 19.3.

    Args:
        period: Period on soil T~ [s].
        period_ratio: Ratio T~ / T [1], at least 1, or the effective one of a yielding structure.
        mass: Mass of the structure (of its first mode) [kg].
        height: Height h of the mass above the base of the foundation [m].
        sway_stiffness: Horizontal stiffness K_x of the foundation [N/m].
        rocking_stiffness: Rocking stiffness K_r of the foundation [N m].
        sway_damping_ratio: Radiation damping beta_x of the foundation in sway [1], at the period T~.
        rocking_damping_ratio: Radiation damping beta_r of the foundation in rocking [1], at the period T~.
        soil_damping_ratio: Hysteretic damping beta_s of the soil [1].

    Returns:
        Damping ratio [1].

    Raises:
        ValueError: If a value is not finite, or is below its bound.

    Example:
        >>> round(foundation_damping_ratio(0.456, 1.141, 5e5, 12.0, 1.805e9, 7.614e10, 0.247, 0.0188, 0.0), 4)
        0.0164
    """
    period = real_number("period [s]", period, above=0)
    ratio = real_number("period_ratio", period_ratio, least=1)
    mass, height = real_number("mass [kg]", mass, above=0), real_number("height [m]", height, above=0)
    sway = real_number("sway_stiffness [N/m]", sway_stiffness, above=0)
    rocking = real_number("rocking_stiffness [N m]", rocking_stiffness, above=0)
    ratios = {
        "sway_damping_ratio": sway_damping_ratio,
        "rocking_damping_ratio": rocking_damping_ratio,
        "soil_damping_ratio": soil_damping_ratio,
    }
    beta_x, beta_r, beta_s = (real_number(name, value, least=0) for name, value in ratios.items())
    square = (2 * np.pi / period) ** 2 * mass
    return float((1 - 1 / ratio**2) * beta_s + beta_x * square / sway + beta_r * square * height**2 / rocking)


@suggests_names
def damping_ratio_on_soil(
    structure_damping_ratio: float, foundation_damping_ratio: float, period_ratio: float, *, structure_damping: str
) -> float:
    """Return the damping ratio of a structure on soil.

    beta_0 = beta_f + beta_i / (T~ / T)^n with n = 3 for viscous and n = 2 for hysteretic damping of the structure.
    ASCE 7-16 uses n = 2 with the effective period ratio, and limits the result to 0.20; apply this limit separately.

    Source: NIST GCR 12-917-21 (2012).

    Args:
        structure_damping_ratio: Damping ratio beta_i of the structure on a fixed base [1].
        foundation_damping_ratio: Damping ratio beta_f that the foundation adds [1], see `foundation_damping_ratio`.
        period_ratio: Ratio T~ / T [1], at least 1.
        structure_damping: "viscous" or "hysteretic".

    Returns:
        Damping ratio [1].

    Raises:
        ValueError: If a value is not finite, is below its bound, or `structure_damping` is unknown.

    Example:
        >>> round(damping_ratio_on_soil(0.05, 0.0163, 1.141, structure_damping="viscous"), 4)
        0.05
    """
    beta_i = real_number("structure_damping_ratio", structure_damping_ratio, least=0)
    beta_f = real_number("foundation_damping_ratio", foundation_damping_ratio, least=0)
    one_of("structure_damping", structure_damping, EXPONENTS)
    return beta_f + beta_i / real_number("period_ratio", period_ratio, least=1) ** EXPONENTS[structure_damping]


@suggests_names
def sway_rocking_matrices(
    mass: float, height: float, foundation_mass: float, rocking_inertia: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mass matrix and the load masses of a structure on a base that sways and rocks.

    Degrees of freedom: deformation u of the structure, sway of the base u_f, rocking of the base. Because each has its
    own spring and dashpot, the stiffness matrix diag(k, K_x, K_r) and the damping matrix diag(c, c_x, c_r) are
    diagonal. The total displacement of the mass relative to the ground is u + u_f + h times the rocking angle.

    Source: Veletsos and Meek (1974).

    Args:
        mass: Mass m of the structure [kg].
        height: Height h of the mass above the base of the foundation [m].
        foundation_mass: Mass of the foundation [kg], 0 or above.
        rocking_inertia: Moment of inertia of foundation and floor about the centre of the base [kg m2], 0 or above.

    Returns:
        Mass matrix, shape [3, 3] ([kg], [kg m], [kg m2]), and the load per unit ground acceleration, which acts in the
        direction opposite to it, shape [3] ([kg], [kg], [kg m]).

    Raises:
        ValueError: If a value is not finite, or is below its bound.

    Example:
        >>> matrix, load = sway_rocking_matrices(5e5, 12.0, foundation_mass=1.5e5, rocking_inertia=2e6)
        >>> matrix / 1e6
        array([[ 0.5 ,  0.5 ,  6.  ],
               [ 0.5 ,  0.65,  6.  ],
               [ 6.  ,  6.  , 74.  ]])
        >>> load
        array([ 500000.,  650000., 6000000.])
    """
    m = real_number("mass [kg]", mass, above=0)
    h = real_number("height [m]", height, above=0)
    base = real_number("foundation_mass [kg]", foundation_mass, least=0)
    inertia = real_number("rocking_inertia [kg m2]", rocking_inertia, least=0)
    matrix = np.array([[m, m, m * h], [m, m + base, m * h], [m * h, m * h, m * h**2 + inertia]])
    return matrix, matrix[1].copy()  # the ground moves all masses as sway of the base does
