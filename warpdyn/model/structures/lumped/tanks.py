"""Housner's model of liquid in a rigid tank: an impulsive mass that moves with the tank, and a sloshing mass.

Sources: Housner (1963), "The dynamic behavior of water tanks"; ACI 350.3 and API 650, Annex E.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.units import STANDARD_GRAVITY

WIDE_TANK = 4 / 3  # D / H from which the impulsive mass is at 0.375 H
SLENDER_TANK = 0.75  # D / H below which the impulsive mass with base pressure is at 0.45 H


@dataclass(frozen=True)
class TankModel:
    """Masses and heights of Housner's tank model; see `housner_cylinder` and `housner_rectangle`.

    Heights are above the base of the tank. Heights "with base pressure" give the moment below the base, which includes
    the pressure of the liquid on the base.

    Args:
        liquid_mass: Mass of the liquid [kg]. The other two masses add up to 0.84 to 1.08 times this mass.
        impulsive_mass: Mass that moves with the tank [kg].
        convective_mass: Sloshing mass [kg].
        impulsive_height: Height of the impulsive mass [m].
        convective_height: Height of the sloshing mass [m].
        impulsive_height_with_base: Height of the impulsive mass with base pressure [m].
        convective_height_with_base: Height of the sloshing mass with base pressure [m].
        convective_frequency: Circular frequency of sloshing [rad/s].
    """

    liquid_mass: float
    impulsive_mass: float
    convective_mass: float
    impulsive_height: float
    convective_height: float
    impulsive_height_with_base: float
    convective_height_with_base: float
    convective_frequency: float

    @property
    def convective_period(self) -> float:
        """Period of sloshing [s]."""
        return 2 * np.pi / self.convective_frequency

    @property
    def convective_stiffness(self) -> float:
        """Stiffness of the spring between the sloshing mass and the tank [N/m]."""
        return self.convective_mass * self.convective_frequency**2


@suggests_names
def housner_cylinder(radius: float, depth: float, density: float = 1000.0) -> TankModel:
    """Return Housner's model of a vertical cylindrical tank with a rigid wall.

    With D = 2 R, x = 0.866 D / H and y = 3.68 H / D: m_i / m = tanh(x) / x, m_c / m = 0.230 (D / H) tanh(y), omega_c^2
    = 3.68 (g / D) tanh(y).

    Source: Housner (1963); ACI 350.3.

    Args:
        radius: Radius of the tank R [m].
        depth: Depth of the liquid H [m].
        density: Mass density of the liquid [kg/m3].

    Returns:
        Masses, heights and the frequency of sloshing.

    Raises:
        ValueError: If a value is not finite and above 0.

    Example:
        >>> tank = housner_cylinder(radius=10.0, depth=8.0)
        >>> f"{tank.impulsive_mass:.4g} kg, {tank.convective_mass:.4g} kg, {tank.convective_period:.3f} s"
        '1.131e+06 kg, 1.301e+06 kg, 4.931 s'
    """
    radius = real_number("radius [m]", radius, above=0)
    depth = real_number("depth [m]", depth, above=0)
    liquid = real_number("density [kg/m3]", density, above=0) * np.pi * radius**2 * depth
    return _tank(liquid, 2 * radius, depth, share=0.230, slosh=3.68)


@suggests_names
def housner_rectangle(length: float, width: float, depth: float, density: float = 1000.0) -> TankModel:
    """Return Housner's model of a rectangular tank with rigid walls.

    With x = 0.866 L / H and y = 3.16 H / L: m_i / m = tanh(x) / x, m_c / m = 0.264 (L / H) tanh(y), omega_c^2 = 3.16 (g
    / L) tanh(y).

    Source: Housner (1963); ACI 350.3.

    Args:
        length: Length L in the direction of the motion [m].
        width: Width perpendicular to the motion [m].
        depth: Depth of the liquid H [m].
        density: Mass density of the liquid [kg/m3].

    Returns:
        Masses, heights and the frequency of sloshing.

    Raises:
        ValueError: If a value is not finite and above 0.

    Example:
        >>> tank = housner_rectangle(length=20.0, width=10.0, depth=6.0)
        >>> f"{tank.impulsive_mass:.4g} kg, {tank.convective_mass:.4g} kg, {tank.convective_period:.3f} s"
        '4.131e+05 kg, 7.803e+05 kg, 5.872 s'
    """
    length = real_number("length [m]", length, above=0)
    width, depth = real_number("width [m]", width, above=0), real_number("depth [m]", depth, above=0)
    liquid = real_number("density [kg/m3]", density, above=0) * length * width * depth
    return _tank(liquid, length, depth, share=0.264, slosh=3.16)


def _tank(liquid: float, length: float, depth: float, share: float, slosh: float) -> TankModel:
    """Return the model of a tank with a length (or diameter) in the direction of the motion."""
    ratio = length / depth
    x, y = 0.866 * ratio, slosh / ratio
    decay = np.exp(-y)
    inverse_sinh = 2 * decay / (1 - decay**2)
    wide = ratio >= WIDE_TANK
    heights = {
        "impulsive_height": 0.375 if wide else 0.5 - 0.09375 * ratio,
        "convective_height": 1 - np.tanh(y / 2) / y,  # 1 - (cosh(y) - 1) / (y sinh(y))
        "impulsive_height_with_base": 0.45 if ratio < SLENDER_TANK else x / (2 * np.tanh(x)) - 1 / 8,
        "convective_height_with_base": 1 - (np.tanh(y / 2) - 1.01 * inverse_sinh) / y,  # ... (cosh(y) - 2.01) ...
    }
    return TankModel(
        liquid_mass=float(liquid),
        impulsive_mass=float(liquid * np.tanh(x) / x),
        convective_mass=float(liquid * share * ratio * np.tanh(y)),
        convective_frequency=float(np.sqrt(slosh * STANDARD_GRAVITY / length * np.tanh(y))),
        **{name: float(depth * height) for name, height in heights.items()},
    )
