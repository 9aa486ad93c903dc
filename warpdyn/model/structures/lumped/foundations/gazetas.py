"""Springs and dashpots of rigid rectangular footings after Gazetas.

Sources: Gazetas (1991), "Formulas and charts for impedances of surface and embedded foundations"; Mylonakis,
Nikolaou and Gazetas (2006), "Footings under seismic loading: analysis and design issues with emphasis on bridge
foundations".

Published forms of the embedment factor for rocking about y differ; the form must be named. The values of the charts
were digitised at four frequencies and three aspect ratios, and are interpolated linearly between these.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import one_of
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.structures.lumped.foundations.footing import (
    RectangularFooting,
    Soil,
    check_footing,
    frequencies,
)

ROCKING_FORMS = ("contact_over_width", "mylonakis_2006")
CHART_FREQUENCIES = (0.444, 0.889, 1.333, 2.0)
CHART_ASPECTS = (1.0, 2.0, 4.0)
# Rows: L / B of CHART_ASPECTS; columns: a0 of CHART_FREQUENCIES.
STIFFNESS_CHARTS = {
    "z": ((0.989, 0.922, 0.815, 0.600), (1.007, 0.965, 0.866, 0.642), (1.032, 1.023, 0.935, 0.699)),
    "y": ((1.035, 0.987, 0.935, 0.889), (1.087, 1.090, 1.083, 1.092), (1.165, 1.248, 1.280, 1.263)),
}
DAMPING_CHARTS = {
    "z": ((0.933, 0.948, 0.963, 1.001), (0.985, 0.999, 1.011, 1.037), (1.095, 1.080, 1.061, 1.061)),
    "y": ((0.795, 0.770, 0.759, 0.812), (0.996, 0.963, 0.895, 0.860), (1.164, 1.038, 0.961, 0.922)),
    "rx": ((0.107, 0.262, 0.384, 0.507), (0.153, 0.324, 0.432, 0.552), (0.192, 0.358, 0.458, 0.581)),
    "ry": ((0.108, 0.269, 0.411, 0.549), (0.288, 0.533, 0.688, 0.839), (0.702, 0.818, 0.882, 0.980)),
    "t": ((0.094, 0.256, 0.440, 0.717), (0.260, 0.541, 0.719, 0.887), (0.650, 0.919, 0.965, 0.971)),
}
LARGEST_POISSON_RATIO = 0.4  # of the charts of vertical motion
INCOMPRESSIBLE = 0.45  # Poisson's ratio from which rocking about y has another stiffness modifier


@suggests_names
def gazetas_stiffness(footing: RectangularFooting, soil: Soil) -> dict[str, float]:
    """Return the static stiffness of a rectangular footing at the surface, by mode.

    The embedment of the footing is not considered; multiply by `gazetas_embedment_factors`.

    Args:
        footing: The footing.
        soil: The soil.

    Returns:
        Stiffness of the modes "z", "y", "x" [N/m] and "rx", "ry", "t" [N m].

    Raises:
        TypeError: If `footing` or `soil` is of another class.

    Example:
        >>> soil = Soil(poisson_ratio=0.35, density=1800.0, shear_modulus=40e6)
        >>> stiffness = gazetas_stiffness(RectangularFooting(10.0, 6.0), soil)
        >>> {mode: f"{value:.4g}" for mode, value in stiffness.items()}
        {'z': '2.191e+09', 'y': '1.755e+09', 'x': '1.675e+09', 'rx': '7.422e+10', 'ry': '1.686e+11', 't': '1.705e+11'}
    """
    check_footing("gazetas_stiffness", footing, soil)
    length, g, nu = footing.half_length, soil.shear_modulus, soil.poisson_ratio
    flat = 1 / footing.aspect  # B / L
    sway = 2 * g * length / (2 - nu) * (2 + 2.5 * flat**0.85)
    polar = footing.inertia_x + footing.inertia_y
    return {
        "z": 2 * g * length / (1 - nu) * (0.73 + 1.54 * flat**0.75),
        "y": sway,
        "x": sway - 0.2 / (0.75 - nu) * g * length * (1 - flat),
        "rx": g / (1 - nu) * footing.inertia_x**0.75 * footing.aspect**0.25 * (2.4 + 0.5 * flat),
        "ry": 3 * g / (1 - nu) * footing.inertia_y**0.75 * footing.aspect**0.15,
        "t": g * polar**0.75 * (4 + 11 * (1 - flat) ** 10),
    }


@suggests_names
def gazetas_embedment_factors(footing: RectangularFooting, *, rocking_form: str) -> dict[str, float]:
    """Return the static stiffness of an embedded footing over that of a footing at the surface, by mode.

    The published forms of the factor for rocking about y (d: height of the side walls in contact with soil, D: depth
    of the base) differ, and it is not known which form is correct; for L / B = 4 and d = D = B the second form is 1.8
    times the first:

    - "contact_over_width": 1 + 0.92 (d/B)^0.6 (1.5 + (d/L)^1.9 (d/D)^-0.6);
    - "mylonakis_2006": 1 + 0.92 (d/B)^0.6 (1.5 + (d/D)^1.9 (B/L)^-0.6).

    For embedded footings that rock, `pais_kausel_embedment_factors` has no such ambiguity.

    Args:
        footing: The footing.
        rocking_form: Form of the factor for rocking about y, "contact_over_width" or "mylonakis_2006".

    Returns:
        Factors of the modes "z", "y", "x", "rx", "ry" and "t" [1]; all are 1 for a footing at the surface.

    Raises:
        ValueError: If the form is unknown.
        TypeError: If `footing` is of another class.

    Example:
        >>> footing = RectangularFooting(10.0, 6.0, embedment=2.0, contact_height=1.5)
        >>> factors = gazetas_embedment_factors(footing, rocking_form="contact_over_width")
        >>> round(factors["z"], 4), round(factors["rx"], 4), round(factors["ry"], 4)
        (1.1399, 1.3796, 1.6136)
    """
    check_footing("gazetas_embedment_factors", footing)
    one_of("rocking_form", rocking_form, ROCKING_FORMS)
    length, b, depth = footing.half_length, footing.half_width, footing.embedment
    contact = footing.contact_height or 0.0
    flat, wall = b / length, 4 * contact * (length + b)  # area of the side walls in contact
    middle = depth - contact / 2  # depth of the middle of the walls in contact
    base = 1 + 0.15 * np.sqrt(depth / b)
    share = contact / depth if depth else 1.0  # d / D; without contact the terms with d vanish
    rocking_x = rocking_y = 1.0
    if contact:
        rocking_x += 1.26 * (contact / b) * (1 + contact / b * share**-0.2 * flat**0.5)
        if rocking_form == "contact_over_width":
            second = (contact / length) ** 1.9 * share**-0.6
        else:
            second = share**1.9 * flat**-0.6
        rocking_y += 0.92 * (contact / b) ** 0.6 * (1.5 + second)
    return {
        "z": (1 + depth / (21 * b) * (1 + 1.3 * flat)) * (1 + 0.2 * (wall / footing.area) ** (2 / 3)),
        "y": float(base * (1 + 0.52 * (middle * wall / (b * length**2)) ** 0.4)),
        "x": float(base * (1 + 0.52 * (middle * wall / (length * b**2)) ** 0.4)),
        "rx": rocking_x,
        "ry": rocking_y,
        "t": 1 + 1.4 * (1 + flat) * (contact / b) ** 0.9,
    }


@suggests_names
def gazetas_stiffness_modifiers(footing: RectangularFooting, soil: Soil, frequency: ArrayLike) -> dict[str, np.ndarray]:
    """Return the dynamic stiffness over the static stiffness of a footing at the surface, by mode.

    "rx", "ry", "x" and "t" are formulas. "z" and "y" are charts, which are interpolated between 1 at a0 = 0 and values
    at a0 = 0.444, 0.889, 1.333 and 2, for L / B = 1, 2 and 4; "z" is in the result if Poisson's ratio is at most 0.4,
    and both if L / B is at most 4.

    Args:
        footing: The footing.
        soil: The soil.
        frequency: Dimensionless frequency a0 = omega B / Vs [1], from 0 to 2, any shape.

    Returns:
        Modifiers [1] by mode, each with the shape of `frequency`.

    Raises:
        ValueError: If a frequency is outside 0 to 2.
        TypeError: If `footing` or `soil` is of another class.

    Example:
        >>> soil = Soil(poisson_ratio=0.35, density=1800.0, shear_modulus=40e6)
        >>> modifiers = gazetas_stiffness_modifiers(RectangularFooting(10.0, 6.0), soil, 0.5)
        >>> {mode: round(float(value), 3) for mode, value in modifiers.items()}
        {'z': 0.995, 'y': 1.068, 'x': 1.0, 'rx': 0.9, 'ry': 0.85, 't': 0.93}
    """
    check_footing("gazetas_stiffness_modifiers", footing, soil)
    a0 = frequencies(frequency)
    _check_frequencies(a0, 0.0)
    slope = 0.30 if soil.poisson_ratio < INCOMPRESSIBLE else 0.25 * footing.aspect**0.30
    found = {"x": np.ones_like(a0), "rx": 1 - 0.20 * a0, "ry": 1 - slope * a0, "t": 1 - 0.14 * a0}
    charts: dict[str, np.ndarray] = {}
    if footing.aspect <= CHART_ASPECTS[-1]:
        of = {mode: np.c_[np.ones(len(CHART_ASPECTS)), STIFFNESS_CHARTS[mode]] for mode in STIFFNESS_CHARTS}
        charts = {mode: _from_chart(of[mode], (0.0, *CHART_FREQUENCIES), footing.aspect, a0) for mode in of}
        if soil.poisson_ratio > LARGEST_POISSON_RATIO:
            del charts["z"]
    return charts | found


@suggests_names
def gazetas_radiation_dashpots(footing: RectangularFooting, soil: Soil, frequency: ArrayLike) -> dict[str, np.ndarray]:
    """Return the dashpot coefficients of a footing at the surface by radiation of waves, by mode.

    C_z = rho V_La A c_z, C_y = rho Vs A c_y, C_x = rho Vs A, C_rx = rho V_La I_x c_rx, C_ry = rho V_La I_y c_ry, C_t =
    rho Vs J c_t with Lysmer's analogue velocity V_La = 3.4 Vs / (pi (1 - nu)). The factors c are charts (c_z for
    Poisson's ratios up to 0.4, c_y for 0.3), which are interpolated between a0 = 0.444, 0.889, 1.333 and 2 and between
    L / B = 1, 2 and 4. "z" is in the result if Poisson's ratio is at most 0.4.

    Args:
        footing: The footing.
        soil: The soil.
        frequency: Dimensionless frequency a0 = omega B / Vs [1], from 0.444 to 2, any shape.

    Returns:
        Dashpot coefficients of translations [N s/m] and rotations [N m s], each with the shape of `frequency`.

    Raises:
        ValueError: If a frequency is outside 0.444 to 2, or L / B is above 4.
        TypeError: If `footing` or `soil` is of another class.

    Example:
        >>> soil = Soil(poisson_ratio=0.35, density=1800.0, shear_modulus=40e6)
        >>> dashpots = gazetas_radiation_dashpots(RectangularFooting(10.0, 6.0), soil, 0.5)
        >>> f"{dashpots['x']:.4g} N s/m, {dashpots['rx']:.4g} N m s"
        '6.44e+07 N s/m, 2.04e+08 N m s'
    """
    check_footing("gazetas_radiation_dashpots", footing, soil)
    a0 = frequencies(frequency)
    _check_frequencies(a0, CHART_FREQUENCIES[0])
    if footing.aspect > CHART_ASPECTS[-1]:
        raise ValueError(
            f"L / B is {footing.aspect:.4g}, but the charts end at {CHART_ASPECTS[-1]:g}: use pais_kausel_impedance()"
        )
    rho, vs, va = soil.density, soil.shear_wave_velocity, soil.lysmer_velocity
    scale = {
        "z": rho * va * footing.area,
        "y": rho * vs * footing.area,
        "rx": rho * va * footing.inertia_x,
        "ry": rho * va * footing.inertia_y,
        "t": rho * vs * (footing.inertia_x + footing.inertia_y),
    }
    found = {
        mode: factor * _from_chart(np.array(DAMPING_CHARTS[mode]), CHART_FREQUENCIES, footing.aspect, a0)
        for mode, factor in scale.items()
        if mode != "z" or soil.poisson_ratio <= LARGEST_POISSON_RATIO
    }
    return found | {"x": np.full_like(a0, rho * vs * footing.area)}


def _check_frequencies(a0: np.ndarray, least: float) -> None:
    bad = a0[(a0 < least) | (a0 > CHART_FREQUENCIES[-1])]
    if bad.size:
        raise ValueError(
            f"the dimensionless frequency {bad.flat[0]:.4g} is outside the charts, {least:g} to "
            f"{CHART_FREQUENCIES[-1]:g}: use pais_kausel_impedance()"
        )


def _from_chart(rows: np.ndarray, columns: tuple[float, ...], aspect: float, a0: np.ndarray) -> np.ndarray:
    """Interpolate linearly, first along the frequency, then along L / B."""
    at_frequency = [np.interp(a0, columns, row) for row in rows]
    upper = int(np.clip(np.searchsorted(CHART_ASPECTS, aspect), 1, len(CHART_ASPECTS) - 1))
    low, high = CHART_ASPECTS[upper - 1 : upper + 1]
    part = (aspect - low) / (high - low)
    return np.asarray((1 - part) * at_frequency[upper - 1] + part * at_frequency[upper])
