"""Cone models of a rigid disk on a half-space: springs, dashpots and masses that do not vary with frequency.

Sources: Wolf (1994), "Foundation vibration analysis using simple physical models"; Wolf and Deeks (2004), "Foundation
vibration analysis: a strength-of-materials approach". The apex height of rotational cones is remembered from these
books; it was confirmed by the static stiffness, which equals that of the exact solution.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, one_of, real_number
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.structures.lumped.foundations.footing import Soil

MOTIONS = ("horizontal", "vertical", "rocking", "torsion")
NEARLY_INCOMPRESSIBLE = 1 / 3  # Poisson's ratio above which part of the soil moves with the disk


@dataclass(frozen=True)
class Cone:
    """Spring, dashpots and masses of a disk in one direction of motion; see `disk_cone`.

    A translational cone is a spring and a dashpot in parallel. A rotational cone is a spring, and a dashpot between the
    rotation of the disk and an additional rotation, which has only the moment of inertia `inner_inertia`.

    Args:
        motion: "horizontal", "vertical", "rocking" or "torsion".
        stiffness: Static stiffness [N/m] or [N m].
        dashpot: Dashpot coefficient [N s/m] or [N m s].
        trapped_mass: Mass [kg] or moment of inertia [kg m2] of soil that moves with the disk.
        inner_inertia: Moment of inertia of the additional rotation [kg m2]; 0 for translations.
        apex_height: Height of the apex above the disk z0 [m].
        wave_speed: Speed of the waves in the cone c [m/s].
    """

    motion: str
    stiffness: float
    dashpot: float
    trapped_mass: float
    inner_inertia: float
    apex_height: float
    wave_speed: float

    def dynamic_stiffness(self, circular_frequency: ArrayLike) -> np.ndarray:
        """Return the complex stiffness, amplitude of force over amplitude of displacement [N/m] or [N m].

        Args:
            circular_frequency: Circular frequency [rad/s], any shape.

        Raises:
            ValueError: If a frequency is not finite.
        """
        omega = finite_numbers("circular_frequency [rad/s]", circular_frequency)
        damper = 1j * omega * self.dashpot
        if self.inner_inertia:
            inertia = -(omega**2) * self.inner_inertia
            damper = damper * inertia / (damper + inertia + (omega == 0))
        return np.asarray(self.stiffness - omega**2 * self.trapped_mass + damper)


@suggests_names
def disk_cone(motion: str, radius: float, soil: Soil, *, trapped_inertia: float | None = None) -> Cone:
    """Return the cone model of a rigid disk on the surface of a homogeneous half-space.

    Translations: K = rho c^2 A / z0 and C = rho c A. Rotations: K = 3 rho c^2 I / z0, C = rho c I and an additional
    moment of inertia rho z0 I. The speed c is that of shear waves for horizontal motion and torsion; for vertical
    motion and rocking it is that of pressure waves for Poisson's ratios up to 1/3, and 2 Vs above. Above 1/3, soil is
    trapped below the disk: a mass of 2.4 (nu - 1/3) rho pi r^3 for vertical motion. The moment of inertia of trapped
    soil in rocking could not be confirmed in a source and must be given.

    Source: Wolf and Deeks (2004).

    Args:
        motion: "horizontal", "vertical", "rocking" or "torsion".
        radius: Radius r of the disk [m].
        soil: The soil.
        trapped_inertia: Moment of inertia of trapped soil [kg m2], 0 or above, for rocking on soil with a Poisson's
            ratio above 1/3 only.

    Returns:
        Spring, dashpot and masses.

    Raises:
        ValueError: If the motion is unknown, a value is out of its range, or `trapped_inertia` is missing or has no
            effect.
        TypeError: If `soil` is not a Soil.

    Example:
        >>> cone = disk_cone("horizontal", 5.0, Soil(poisson_ratio=0.25, density=1800.0, shear_wave_velocity=200.0))
        >>> f"{cone.stiffness:.4g} N/m, {cone.dashpot:.4g} N s/m"
        '1.646e+09 N/m, 2.827e+07 N s/m'
    """
    one_of("motion", motion, MOTIONS)
    radius = real_number("radius [m]", radius, above=0)
    if not isinstance(soil, Soil):
        raise TypeError(
            f"disk_cone() takes a Soil, got {type(soil).__name__}; give soil=Soil(poisson_ratio, density, "
            "shear_wave_velocity=...)"
        )
    nu, rho, vs = soil.poisson_ratio, soil.density, soil.shear_wave_velocity
    is_dilatational = motion in ("vertical", "rocking")
    is_trapping = is_dilatational and nu > NEARLY_INCOMPRESSIBLE
    speed = vs if not is_dilatational else 2 * vs if is_trapping else float(soil.pressure_wave_velocity)
    apex = {
        "horizontal": np.pi / 8 * (2 - nu),
        "vertical": np.pi / 4 * (1 - nu) * (speed / vs) ** 2,
        "rocking": 9 * np.pi / 32 * (1 - nu) * (speed / vs) ** 2,
        "torsion": 9 * np.pi / 32,
    }[motion] * radius
    trapped = _trapped_mass(motion, radius, soil, is_trapping, trapped_inertia)
    if motion in ("horizontal", "vertical"):
        area = np.pi * radius**2
        return Cone(motion, float(rho * speed**2 * area / apex), rho * speed * area, trapped, 0.0, apex, speed)
    inertia = np.pi * radius**4 / (4 if motion == "rocking" else 2)
    stiffness = 3 * rho * speed**2 * inertia / apex
    return Cone(motion, float(stiffness), rho * speed * inertia, trapped, rho * apex * inertia, apex, speed)


def _trapped_mass(motion: str, radius: float, soil: Soil, is_trapping: bool, trapped_inertia: float | None) -> float:
    """Return the mass or the moment of inertia of soil that moves with the disk."""
    if motion == "rocking" and is_trapping:
        if trapped_inertia is None:
            raise ValueError(
                f"trapped_inertia is missing: for Poisson's ratio {soil.poisson_ratio:g}, above 1/3, soil moves with "
                "a rocking disk, and its moment of inertia could not be confirmed in a source. Give trapped_inertia= "
                "[kg m2]; 0 neglects it"
            )
        return real_number("trapped_inertia [kg m2]", trapped_inertia, least=0)
    if trapped_inertia is not None:
        raise ValueError(
            f"trapped_inertia has no effect for motion {motion!r} with Poisson's ratio {soil.poisson_ratio:g}: remove "
            "trapped_inertia="
        )
    if motion == "vertical" and is_trapping:
        return 2.4 * (soil.poisson_ratio - NEARLY_INCOMPRESSIBLE) * soil.density * np.pi * radius**3
    return 0.0
