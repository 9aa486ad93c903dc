"""One-sided spectra of the along-wind turbulence over the frequency in Hz."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, real_number
from warpdyn.foundations.core.near_misses import with_suggestions

UNITS = {
    "friction_velocity": "m/s",
    "reference_speed": "m/s",
    "standard_deviation": "m/s",
    "drag_coefficient": "1",
    "length": "m",
    "numerator": "1",
    "denominator": "1",
}

LARGEST = 1e9  # of any parameter


class WindSpectrum:
    """Base class of spectra of the along-wind turbulence."""

    speeds: ClassVar[tuple[str, ...]] = ()  # fields that are proportional to the mean wind speed

    def __post_init__(self) -> None:
        known: Any = self  # each spectrum is a dataclass
        for field in fields(known):
            value = real_number(
                f"{type(self).__name__}.{field.name} [{UNITS[field.name]}]", getattr(self, field.name), above=0
            )
            if value > LARGEST:  # its square would overflow
                raise ValueError(f"{type(self).__name__}.{field.name} must be at most {LARGEST:g}, got {value:g}")
            object.__setattr__(self, field.name, value)

    def spectral_density(self, frequency: ArrayLike, height: ArrayLike, mean_speed: ArrayLike) -> np.ndarray:
        """Return the one-sided spectral density of the turbulence [m2/s]; the arguments are broadcast.

        Args:
            frequency: Frequencies [Hz], above 0.
            height: Heights above the ground [m].
            mean_speed: Mean wind speeds at these heights [m/s].

        Raises:
            ValueError: If a value is not finite and above 0, or the shapes cannot be broadcast.
        """
        values = []
        for name, given in (("frequency [Hz]", frequency), ("height [m]", height), ("mean_speed [m/s]", mean_speed)):
            value = finite_numbers(name, given)
            if np.any(value <= 0):
                raise ValueError(f"{name} must be above 0, got {value.min():g}")
            values.append(value)
        try:
            np.broadcast_shapes(*(value.shape for value in values))
        except ValueError as error:
            shapes = ", ".join(str(value.shape) for value in values)
            raise ValueError(
                f"frequency, height and mean_speed have the shapes {shapes}, which cannot be broadcast: give one "
                "height and one mean speed, or frequency of shape [frequency, 1]"
            ) from error
        return self._density(*values)

    def _density(self, frequency: np.ndarray, height: np.ndarray, mean_speed: np.ndarray) -> np.ndarray:
        raise NotImplementedError

    @property
    def standard_deviation_of_turbulence(self) -> float:
        """Standard deviation of the turbulence [m/s]: the root of the integral of the spectrum over the frequency."""
        raise NotImplementedError

    def scaled(self, factor: float) -> Self:
        """Return the spectrum for mean wind speeds that are multiplied by `factor` [1]; it must be above 0."""
        factor = real_number("factor", factor, above=0)
        known: Any = self
        found: Self = replace(known, **{name: factor * getattr(self, name) for name in self.speeds})
        return found


@with_suggestions
@dataclass(frozen=True)
class KaimalSpectrum(WindSpectrum):
    """The spectrum of Kaimal et al. (1972): f S / u*^2 = a x / (1 + b x)^(5/3) with x = f z / U.

    The default a = 200 and b = 50 is the form of Simiu and Scanlan, whose variance is 6 u*^2. The form of the surface
    layer in the original paper has a = 105 and b = 33.

    Args:
        friction_velocity: Friction velocity u* [m/s].
        numerator: Coefficient a [1].
        denominator: Coefficient b [1].

    Raises:
        ValueError: If a value is not finite and above 0.

    Example:
        >>> spectrum = wd.KaimalSpectrum(friction_velocity=1.5)
        >>> spectrum.spectral_density([0.01, 0.1, 1.0], height=50.0, mean_speed=30.0).round(3)
        array([273.102,  18.127,   0.462])
    """

    friction_velocity: float
    numerator: float = 200.0
    denominator: float = 50.0

    speeds = ("friction_velocity",)

    @property
    def standard_deviation_of_turbulence(self) -> float:
        """Standard deviation of the turbulence [m/s]: u* (1.5 a / b)^(1/2)."""
        return float(self.friction_velocity * np.sqrt(1.5 * self.numerator / self.denominator))

    def _density(self, frequency: np.ndarray, height: np.ndarray, mean_speed: np.ndarray) -> np.ndarray:
        x = frequency * height / mean_speed
        density: np.ndarray = self.friction_velocity**2 * self.numerator * x / (1 + self.denominator * x) ** (5 / 3)
        return density / frequency


@with_suggestions
@dataclass(frozen=True)
class DavenportSpectrum(WindSpectrum):
    """The spectrum of Davenport (1961), equal at all heights: f S = 4 k U10^2 x^2 / (1 + x^2)^(4/3), x = L f / U10.

    Its variance is 6 k U10^2.

    Args:
        reference_speed: Mean wind speed U10 at a height of 10 m [m/s].
        drag_coefficient: Surface drag coefficient k [1], such as 0.005 for open country.
        length: Length L [m].

    Raises:
        ValueError: If a value is not finite and above 0.

    Example:
        >>> spectrum = wd.DavenportSpectrum(reference_speed=25.0, drag_coefficient=0.005)
        >>> spectrum.spectral_density([0.01, 0.1, 1.0], height=40.0, mean_speed=30.0).round(3)
        array([218.439,  41.509,   0.946])
    """

    reference_speed: float
    drag_coefficient: float
    length: float = 1200.0

    speeds = ("reference_speed",)

    @property
    def standard_deviation_of_turbulence(self) -> float:
        """Standard deviation of the turbulence [m/s]: U10 (6 k)^(1/2)."""
        return float(self.reference_speed * np.sqrt(6 * self.drag_coefficient))

    def _density(self, frequency: np.ndarray, height: np.ndarray, mean_speed: np.ndarray) -> np.ndarray:
        x = frequency * self.length / self.reference_speed
        density = 4 * self.drag_coefficient * self.reference_speed**2 * x**2 / (1 + x**2) ** (4 / 3) / frequency
        return np.broadcast_to(density, np.broadcast_shapes(density.shape, height.shape, mean_speed.shape)).copy()


@with_suggestions
@dataclass(frozen=True)
class VonKarmanSpectrum(WindSpectrum):
    """The spectrum of von Karman: f S / s^2 = 4 x / (1 + 70.8 x^2)^(5/6) with x = f L / U.

    Args:
        standard_deviation: Standard deviation s of the turbulence [m/s].
        length: Integral length L of the turbulence [m].

    Raises:
        ValueError: If a value is not finite and above 0.

    Example:
        >>> spectrum = wd.VonKarmanSpectrum(standard_deviation=3.5, length=120.0)
        >>> spectrum.spectral_density([0.01, 0.1, 1.0], height=50.0, mean_speed=30.0).round(3)
        array([179.233,  24.165,   0.558])
    """

    standard_deviation: float
    length: float

    speeds = ("standard_deviation",)

    @property
    def standard_deviation_of_turbulence(self) -> float:
        """Standard deviation of the turbulence [m/s]."""
        return self.standard_deviation

    def _density(self, frequency: np.ndarray, height: np.ndarray, mean_speed: np.ndarray) -> np.ndarray:
        x = frequency * self.length / mean_speed
        density = 4 * self.standard_deviation**2 * x / (1 + 70.8 * x**2) ** (5 / 6) / frequency
        return np.broadcast_to(density, np.broadcast_shapes(density.shape, height.shape)).copy()
