"""Rectangular footings and homogeneous soil, for the impedance formulas of this folder.

Coordinates: x along the half-length L, y along the half-width B, z up. Modes: "z" vertical, "y" and "x" sway, "rx" and
"ry" rocking about the axes x and y ("rx" is the rocking of a building that sways in y), "t" torsion about z.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, real_number
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.plausibility import PlausibilityFindings

MODES = ("z", "y", "x", "rx", "ry", "t")


@with_suggestions
@dataclass(frozen=True)
class RectangularFooting:
    """A rigid rectangular footing, at the surface or embedded.

    Args:
        half_length: Half-length L, along x [m], at least the half-width.
        half_width: Half-width B, along y [m].
        embedment: Depth D of the base below the surface [m]; 0: a footing at the surface.
        contact_height: Height d of the side walls that is in contact with the soil [m], at most D; None: D. Only the
            formulas of Gazetas use it.

    Raises:
        ValueError: If a value is not finite or is below its bound, L is less than B, or d is above D.

    Example:
        >>> footing = RectangularFooting(half_length=10.0, half_width=6.0, embedment=2.0, contact_height=1.5)
        >>> footing.area, footing.inertia_x, footing.inertia_y
        (240.0, 2880.0, 8000.0)
    """

    half_length: float
    half_width: float
    embedment: float = 0.0
    contact_height: float | None = None

    def __post_init__(self) -> None:
        for name in ("half_length", "half_width"):
            object.__setattr__(self, name, real_number(f"{name} [m]", getattr(self, name), above=0))
        embedment = real_number("embedment [m]", self.embedment, least=0)
        object.__setattr__(self, "embedment", embedment)
        if self.half_length < self.half_width:
            raise ValueError(
                f"half_length {self.half_length:g} m is less than half_width {self.half_width:g} m: exchange the two, "
                "and turn the axes x and y"
            )
        height = self.embedment if self.contact_height is None else self.contact_height
        height = real_number("contact_height [m]", height, least=0)
        if height > embedment:
            raise ValueError(
                f"contact_height {height:g} m is above embedment {embedment:g} m: side walls are in contact with soil "
                "only below the surface; reduce contact_height= or increase embedment="
            )
        object.__setattr__(self, "contact_height", height)
        _warn_of_size(half_length=self.half_length, half_width=self.half_width, embedment=embedment)

    @property
    def aspect(self) -> float:
        """L / B [1], at least 1."""
        return self.half_length / self.half_width

    @property
    def area(self) -> float:
        """Area of the base [m2]."""
        return 4 * self.half_length * self.half_width

    @property
    def inertia_x(self) -> float:
        """Second moment of the base area about x, 4 L B^3 / 3 [m4]."""
        return 4 * self.half_length * self.half_width**3 / 3

    @property
    def inertia_y(self) -> float:
        """Second moment of the base area about y, 4 B L^3 / 3 [m4]."""
        return 4 * self.half_width * self.half_length**3 / 3


@with_suggestions
@dataclass(frozen=True)
class CircularFooting:
    """A rigid disk at the surface, whose springs and dashpots are those of cone models.

    Args:
        radius: Radius [m].

    Raises:
        ValueError: If the radius is not finite or not above 0.

    Example:
        >>> wd.CircularFooting(5.0).radius
        5.0
    """

    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", real_number("radius [m]", self.radius, above=0))
        _warn_of_size(radius=self.radius)


@with_suggestions
@dataclass(frozen=True)
class Soil:
    """A homogeneous linear half-space of soil.

    The shear modulus must be reduced for the strain of the earthquake, before it is given here.

    Args:
        poisson_ratio: Poisson's ratio [1], from 0 to 0.5.
        density: Mass density [kg/m3].
        shear_modulus: Shear modulus G [N/m2].
        shear_wave_velocity: Shear-wave velocity [m/s]; give this or the shear modulus: G = density velocity^2.

    Raises:
        ValueError: If a value is out of its range, or neither `shear_modulus` nor `shear_wave_velocity` is given, or
            both are given and contradict each other.

    Example:
        >>> soil = Soil(poisson_ratio=0.35, density=1800.0, shear_modulus=40e6)
        >>> round(soil.shear_wave_velocity, 2)
        149.07
    """

    poisson_ratio: float
    density: float
    shear_modulus: float = field(default=None, kw_only=True)  # type: ignore[assignment] # set when the soil is made
    shear_wave_velocity: float = field(default=None, kw_only=True)  # type: ignore[assignment] # as above

    def __post_init__(self) -> None:
        ratio = real_number("poisson_ratio", self.poisson_ratio, least=0)
        if ratio > 0.5:
            raise ValueError(f"poisson_ratio is {ratio:g}; it must be from 0 to 0.5 (0.5: saturated clay)")
        density = real_number("density [kg/m3]", self.density, above=0)
        modulus, velocity = self.shear_modulus, self.shear_wave_velocity
        if modulus is None and velocity is None:
            raise ValueError(
                "neither shear_modulus nor shear_wave_velocity is given: give one of them, such as "
                "shear_wave_velocity=200.0"
            )
        if modulus is not None:
            modulus = real_number("shear_modulus [N/m2]", modulus, above=0)
        if velocity is not None:
            velocity = real_number("shear_wave_velocity [m/s]", velocity, above=0)
        if velocity is None:
            velocity = float(np.sqrt(modulus / density))
        elif modulus is None:
            modulus = density * velocity**2
        elif abs(modulus / (density * velocity**2) - 1) > 1e-9:
            raise ValueError(
                f"shear_modulus {modulus:g} N/m2 is not density x shear_wave_velocity^2, {density * velocity**2:g} "
                "N/m2: give only one of the two"
            )
        findings = PlausibilityFindings()
        findings.add("soil_density", density)
        if self.shear_modulus is None:
            findings.add("soil_shear_wave_velocity", velocity)
        else:
            findings.add("soil_shear_modulus", modulus)
        findings.warn()
        values = {"poisson_ratio": ratio, "density": density, "shear_modulus": modulus, "shear_wave_velocity": velocity}
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def pressure_wave_velocity(self) -> float:
        """Velocity of pressure waves, Vs sqrt((2 - 2 nu) / (1 - 2 nu)) [m/s]; infinite for nu = 0.5."""
        divisor = 1 - 2 * self.poisson_ratio
        return self.shear_wave_velocity * np.sqrt((2 - 2 * self.poisson_ratio) / divisor) if divisor else np.inf

    @property
    def lysmer_velocity(self) -> float:
        """Lysmer's analogue velocity 3.4 Vs / (pi (1 - nu)) [m/s]."""
        return 3.4 * self.shear_wave_velocity / (np.pi * (1 - self.poisson_ratio))


def _warn_of_size(**sizes: float) -> None:
    """Warn if a dimension of a footing [m] is implausible."""
    findings = PlausibilityFindings()
    for name, size in sizes.items():
        findings.add("footing_size", size, f" ({name})")
    findings.warn()


def check_footing(function: str, footing: object, soil: object = None, *, can_be_circular: bool = False) -> None:
    """Raise a TypeError if the arguments of a function are not a RectangularFooting and a Soil (None: not given).

    Args:
        function: Name of the function.
        footing: The footing.
        soil: The soil.
        can_be_circular: Whether the footing may be a CircularFooting.
    """
    if not isinstance(footing, RectangularFooting) and not (can_be_circular and isinstance(footing, CircularFooting)):
        raise TypeError(
            f"{function}() takes a RectangularFooting, got {type(footing).__name__}; give footing="
            "RectangularFooting(half_length, half_width)"
        )
    if soil is not None and not isinstance(soil, Soil):
        raise TypeError(
            f"{function}() takes a Soil, got {type(soil).__name__}; give soil=Soil(poisson_ratio, density, "
            "shear_wave_velocity=...)"
        )


def frequencies(values: ArrayLike) -> np.ndarray:
    """Return frequencies as float64; raise a ValueError unless they are finite and at least 0."""
    array = finite_numbers("frequency", values)
    if np.any(array < 0):
        raise ValueError(f"frequency must be at least 0, got {array.min():g}")
    return array
