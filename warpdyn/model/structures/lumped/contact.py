"""Constants of contact laws for pounding between buildings, from the coefficient of restitution.

d is the penetration, d' its rate, v the relative velocity at first touch, e the coefficient of restitution (velocity
after over velocity before a free impact), and m_r = m1 m2 / (m1 + m2) the reduced mass. Laws:

- Kelvin-Voigt: k d + c d';
- Hertz: kh d^1.5;
- Hertz-damp: kh d^1.5 (1 + factor d' / v);
- Jankowski: on approach kh d^1.5 + 2 xi sqrt(kh sqrt(d) m_r) d', on return kh d^1.5;
- bilinear impact: slopes K1 and K2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from warpdyn.engine.laws.contacts.parameters import (
    jankowski_ratio,
    muthukumar_des_roches_factor,
    viscous_ratio,
    ye_li_zhu_factor,
)
from warpdyn.foundations.core.checks import one_of, real_number
from warpdyn.foundations.core.near_misses import suggests_names

HERTZ_DAMP_FORMS = ("exact", "muthukumar_desroches_2006", "ye_li_zhu_2009")


@suggests_names
def reduced_mass(first_mass: float, second_mass: float) -> float:
    """Return the reduced mass m1 m2 / (m1 + m2) of two colliding masses.

    Args:
        first_mass: Mass of one body [kg].
        second_mass: Mass of the other body [kg]; for a rigid obstacle, use the first mass as reduced mass instead.

    Returns:
        Reduced mass [kg].

    Raises:
        ValueError: If a mass is not finite and above 0.

    Example:
        >>> round(reduced_mass(200e3, 350e3), 1)
        127272.7
    """
    first = real_number("first_mass [kg]", first_mass, above=0)
    second = real_number("second_mass [kg]", second_mass, above=0)
    return first / (1 + first / second)


@suggests_names
def kelvin_voigt_damping_ratio(restitution: float) -> float:
    """Return the damping ratio xi of Kelvin-Voigt contact for a coefficient of restitution.

    xi = -ln(e) / sqrt(pi^2 + ln(e)^2). It is exact if the force acts until the penetration is 0, with a small tension
    at the end. If the tension is cut off, the restitution is larger: 0.675 instead of 0.65.

    Source: Anagnostopoulos (1988), "Pounding of buildings in series during earthquakes".

    Args:
        restitution: Coefficient of restitution [1], above 0 and at most 1.

    Returns:
        Damping ratio [1].

    Raises:
        ValueError: If the coefficient is out of its range.

    Example:
        >>> round(kelvin_voigt_damping_ratio(0.65), 6)
        0.135851
    """
    return float(viscous_ratio(np.array(_restitution(restitution)))) + 0.0  # not -0.0 for e = 1


@suggests_names
def kelvin_voigt_dashpot(restitution: float, stiffness: float, reduced_mass: float) -> float:
    """Return the dashpot coefficient c = 2 xi sqrt(k m_r) of Kelvin-Voigt contact for a coefficient of restitution.

    Source: Anagnostopoulos (1988), "Pounding of buildings in series during earthquakes".

    Args:
        restitution: Coefficient of restitution [1], above 0 and at most 1.
        stiffness: Contact stiffness k [N/m].
        reduced_mass: Reduced mass m_r of the two bodies [kg], see `reduced_mass`.

    Returns:
        Dashpot coefficient [N s/m].

    Raises:
        ValueError: If a value is out of its range.

    Example:
        >>> round(kelvin_voigt_dashpot(0.65, stiffness=93.5e6, reduced_mass=reduced_mass(200e3, 350e3)), 1)
        937275.1
    """
    stiffness = real_number("stiffness [N/m]", stiffness, above=0)
    mass = real_number("reduced_mass [kg]", reduced_mass, above=0)
    return 2 * kelvin_voigt_damping_ratio(restitution) * float(np.sqrt(stiffness * mass))


@suggests_names
def hertz_damp_factor(restitution: float, form: str) -> float:
    """Return the factor of d' / v in Hertz-damp contact for a coefficient of restitution.

    The force is kh d^1.5 (1 + factor d' / v). Forms:

    - "exact": the restitution is exactly e; found from `hertz_damp_restitution`;
    - "ye_li_zhu_2009": 8 (1 - e) / (5 e), for e = 0.65 the restitution is 0.630;
    - "muthukumar_desroches_2006": 3 (1 - e^2) / 4, for e = 0.65 the restitution is 0.775, so that it is suitable only
      for e near 1.

    Source: Ye, Li and Zhu (2009), "A note on the Hertz contact model with nonlinear damping for pounding simulation";
    Muthukumar and DesRoches (2006), "A Hertz contact model with non-linear damping for pounding simulation".

    Args:
        restitution: Coefficient of restitution e [1], above 0 and at most 1; "exact": at least 0.01.
        form: "exact", "ye_li_zhu_2009" or "muthukumar_desroches_2006".

    Returns:
        Dimensionless factor [1]; OpenSees' Hertzdamp takes it too.

    Raises:
        ValueError: If the coefficient is out of its range, or the form is unknown.

    Example:
        >>> [round(hertz_damp_factor(0.65, form), 4) for form in HERTZ_DAMP_FORMS]
        [0.7931, 0.4331, 0.8615]
    """
    e = _restitution(restitution)
    one_of("form", form, HERTZ_DAMP_FORMS)
    if form == "muthukumar_desroches_2006":
        return float(muthukumar_des_roches_factor(np.array(e)))
    approximate = float(ye_li_zhu_factor(np.array(e)))
    if form == "ye_li_zhu_2009" or e == 1:
        return approximate
    if e < 0.01:
        raise ValueError(f"restitution is {e:g}; it must be at least 0.01 for form='exact'")
    from scipy.optimize import brentq  # its import takes a tenth of a second

    return float(brentq(lambda factor: hertz_damp_restitution(factor) - e, 1e-9, 2 * approximate + 1, xtol=1e-15))


@suggests_names
def hertz_damp_restitution(factor: float) -> float:
    """Return the coefficient of restitution of a free impact with Hertz-damp contact.

    Both phases of the impact dissipate so that factor - ln(1 + factor) = -factor e - ln(1 - factor e). The result does
    not depend on stiffness, masses, velocity and the exponent 1.5.

    Args:
        factor: Factor of d' / v [1], 0 or above, at most 1000.

    Returns:
        Coefficient of restitution [1].

    Raises:
        ValueError: If the factor is out of its range.

    Example:
        >>> round(hertz_damp_restitution(8 * (1 - 0.65) / (5 * 0.65)), 5)
        0.63033
    """
    from scipy.optimize import brentq

    q = real_number("factor", factor, least=0)
    if q > 1000:
        raise ValueError(f"factor is {q:g}; it must be at most 1000, for which the restitution is 0.001")
    if q < 1e-4:  # the equation loses digits; the second-order term of its series
        return 1 - 2 * q / 3 + 4 * q**2 / 9
    # With w = -ln(1 - factor e), the second side is w - 1 + exp(-w).
    approach = q - np.log1p(q)
    w = brentq(lambda w: w + np.expm1(-w) - approach, 0.0, approach + 1, xtol=1e-17, rtol=1e-14)
    return float(-np.expm1(-w) / q)


@suggests_names
def jankowski_damping_ratio(restitution: float) -> float:
    """Return the damping ratio xi of Jankowski's nonlinear viscoelastic contact for a coefficient of restitution.

    xi = 9 sqrt(5) / 2 (1 - e^2) / (e (e (9 pi - 16) + 16)). Damping acts on approach only; for e = 0.65 the restitution
    is 0.647.

    Source: Jankowski (2005), "Non-linear viscoelastic modelling of earthquake-induced structural pounding"; relation as
    in OpenSees' JankowskiImpact.

    Args:
        restitution: Coefficient of restitution e [1], above 0 and at most 1.

    Returns:
        Damping ratio [1].

    Raises:
        ValueError: If the coefficient is out of its range.

    Example:
        >>> round(jankowski_damping_ratio(0.65), 4)
        0.3728
    """
    return float(jankowski_ratio(np.array(_restitution(restitution))))


class HertzImpact(NamedTuple):
    """Largest penetration [m], duration [s] and largest force [N] of a free impact without damping."""

    penetration: float
    duration: float
    force: float


@suggests_names
def hertz_impact(stiffness: float, reduced_mass: float, velocity: float) -> HertzImpact:
    """Return penetration, duration and force of a free impact with Hertz contact without damping.

    d_m = (5 m_r v^2 / (4 kh))^0.4; the duration is 2 d_m / v times the integral of 1 / sqrt(1 - x^2.5) from 0 to 1.

    Args:
        stiffness: Contact stiffness kh [N m-1.5].
        reduced_mass: Reduced mass m_r of the two bodies [kg], see `reduced_mass`.
        velocity: Relative velocity at first touch v [m/s].

    Returns:
        Penetration [m], duration [s] and force [N].

    Raises:
        ValueError: If a value is not finite and above 0.

    Example:
        >>> impact = hertz_impact(2.75e9, reduced_mass=reduced_mass(200e3, 350e3), velocity=1.0)
        >>> f"{1000 * impact.penetration:.2f} mm in {impact.duration:.4f} s, {impact.force / 1e6:.3f} MN"
        '20.18 mm in 0.0594 s, 7.884 MN'
    """
    from scipy.special import beta

    kh = real_number("stiffness [N m-1.5]", stiffness, above=0)
    mass = real_number("reduced_mass [kg]", reduced_mass, above=0)
    v = real_number("velocity [m/s]", velocity, above=0)
    deepest = (5 * mass * v**2 / (4 * kh)) ** 0.4
    return HertzImpact(deepest, float(2 * deepest / v * 0.4 * beta(0.4, 0.5)), kh * deepest**1.5)


class BilinearImpact(NamedTuple):
    """Slopes K1 and K2 [N/m] and penetration at the change of slope [m] of bilinear impact contact."""

    first_stiffness: float
    second_stiffness: float
    yield_penetration: float


@suggests_names
def bilinear_impact(
    restitution: float, stiffness: float, largest_penetration: float, yield_share: float
) -> BilinearImpact:
    """Return the slopes of bilinear impact contact that dissipates as much energy as Hertz contact with restitution.

    With k_eff = kh sqrt(d_m) and dE = kh d_m^2.5 (1 - e^2) / 2.5: K1 = k_eff + dE / (a d_m^2) up to the penetration
    a d_m, then K2 = k_eff - dE / ((1 - a) d_m^2). Then the force at d_m is that of Hertz contact, and a cycle that
    unloads with K1 down to the line of slope K2 through the origin, and along it, dissipates dE. The elements of
    OpenSees, ImpactMaterial, have the same K1; K2 was derived here from the force at d_m.

    Source: Muthukumar and DesRoches (2006), "A Hertz contact model with non-linear damping for pounding simulation".

    Args:
        restitution: Coefficient of restitution e [1], above 0 and at most 1.
        stiffness: Stiffness of Hertz contact kh [N m-1.5].
        largest_penetration: Expected largest penetration d_m [m], such as that of `hertz_impact`.
        yield_share: Penetration at the change of slope over the largest one, a [1], between 0 and 1; often 0.1.

    Returns:
        K1 [N/m], K2 [N/m] and the penetration at the change of slope [m].

    Raises:
        ValueError: If a value is out of its range, or K2 would not be above 0.

    Example:
        >>> slopes = bilinear_impact(0.65, stiffness=2.75e9, largest_penetration=0.02, yield_share=0.1)
        >>> f"{slopes.first_stiffness:.4g} N/m, {slopes.second_stiffness:.4g} N/m"
        '1.287e+09 N/m, 2.891e+08 N/m'
    """
    e = _restitution(restitution)
    kh = real_number("stiffness [N m-1.5]", stiffness, above=0)
    deepest = real_number("largest_penetration [m]", largest_penetration, above=0)
    share = real_number("yield_share", yield_share, above=0)
    if share >= 1:
        raise ValueError(f"yield_share is {share:g}; it must be below 1, such as 0.1")
    effective = kh * np.sqrt(deepest)
    loss = effective * (1 - e**2) / 2.5  # energy over d_m^2
    second = effective - loss / (1 - share)
    if second <= 0:
        raise ValueError(
            f"the second slope would be {second:.4g} N/m for restitution {e:g} and yield_share {share:g}; it must be "
            f"above 0: give yield_share= below {1 - (1 - e**2) / 2.5:.4g}"
        )
    return BilinearImpact(float(effective + loss / share), float(second), share * deepest)


def _restitution(value: float) -> float:
    e = real_number("restitution", value, above=0)
    if e > 1:
        raise ValueError(f"restitution is {e:g}; it must be above 0 and at most 1 (1: no energy is lost in the impact)")
    return e
