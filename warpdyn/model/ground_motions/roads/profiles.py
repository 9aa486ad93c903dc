"""Road profiles for vehicles: random roads of ISO 8608, sine waves and bumps, as motion of a wheel's contact point.

A vehicle at constant speed v on the profile z(x) is excited by the displacement z(v t), or by the acceleration
v^2 z''(v t) in degrees of freedom that are relative to the road. An axle behind another one passes the same profile
later: `motion_of_axles`, or `start` with the distance between the axles and a minus sign.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import check_memory, finite_numbers, one_of, real_number, whole_number
from warpdyn.foundations.core.near_misses import suggests_names, with_suggestions
from warpdyn.foundations.core.random_numbers import Purpose, uniforms
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.pairs_of_motions import PairOfMotions

REFERENCE_FREQUENCY = 0.1  # n0, cycle/m
#: Geometric mean of the spectral density at 0.1 cycle/m of each road class of ISO 8608 [m2/(cycle/m)].
ROAD_CLASSES = {name: 16e-6 * 4**place for place, name in enumerate("ABCDEFGH")}
#: Limits of the road classes of ISO 8608 [m2/(cycle/m)]: those between A and B, B and C, and so on.
ROAD_CLASS_LIMITS = tuple(2 * value for value in list(ROAD_CLASSES.values())[:-1])
MOST_WAVES = 10**6
LEAST_SAMPLES = 2  # per shortest wave of a profile; fewer samples do not contain the wave
VALUES_AT_A_TIME = 2**22  # products of place and wave number in memory


@suggests_names
def road_spectral_density(spatial_frequency: ArrayLike, roughness: str | float) -> np.ndarray:
    """Return the one-sided spectral density of the elevation of a road.

    G(n) = G(n0) (n / n0)^-2 with n0 = 0.1 cycle/m.

    Source: ISO 8608, "Mechanical vibration: road surface profiles: reporting of measured data".

    Args:
        spatial_frequency: Spatial frequencies n [1/m], above 0, any shape; in cycles, not radians, per metre.
        roughness: Road class "A" (very good) to "H" (geometric mean of the class), or the spectral density at 0.1
            cycle/m [m2/(cycle/m)].

    Returns:
        Spectral density [m2/(cycle/m)], with the shape of `spatial_frequency`.

    Raises:
        ValueError: If a value is not finite and above 0, or the class is unknown.

    Example:
        >>> road_spectral_density([0.1, 1.0], roughness="C")
        array([2.56e-04, 2.56e-06])
    """
    n = finite_numbers("spatial_frequency [1/m]", spatial_frequency)
    if np.any(n <= 0):
        raise ValueError(f"spatial_frequency must be above 0, got {n.min():g} 1/m")
    return _roughness(roughness) * (n / REFERENCE_FREQUENCY) ** -2


@suggests_names
def road_velocity_density(roughness: str | float, speed: float) -> float:
    """Return the one-sided spectral density of the vertical velocity of a wheel's contact point, which is white.

    (2 pi n0)^2 G(n0) v; divide by 4 pi for the two-sided density over circular frequency.

    Args:
        roughness: Road class "A" to "H", or the spectral density at 0.1 cycle/m [m2/(cycle/m)].
        speed: Speed of the vehicle v [m/s].

    Returns:
        Spectral density [m2/s2/Hz].

    Raises:
        ValueError: If a value is not finite and above 0, or the class is unknown.

    Example:
        >>> round(road_velocity_density("C", speed=20.0), 9)
        0.002021295
    """
    factor = (2 * np.pi * REFERENCE_FREQUENCY) ** 2
    return float(factor * _roughness(roughness) * real_number("speed [m/s]", speed, above=0))


class Road:
    """Base class of road profiles."""

    #: Length of the shortest wave of the profile [m].
    shortest_wave: float

    def elevation(self, place: ArrayLike) -> np.ndarray:
        """Return the elevation of the road [m].

        Args:
            place: Distances along the road [m], any shape.

        Raises:
            ValueError: If a distance is not finite.
        """
        return self._derivative(finite_numbers("place [m]", place), 0)

    def slope(self, place: ArrayLike) -> np.ndarray:
        """Return the slope of the road [1].

        Args:
            place: Distances along the road [m], any shape.

        Raises:
            ValueError: If a distance is not finite.
        """
        return self._derivative(finite_numbers("place [m]", place), 1)

    def curvature(self, place: ArrayLike) -> np.ndarray:
        """Return the second derivative of the elevation [1/m].

        Args:
            place: Distances along the road [m], any shape.

        Raises:
            ValueError: If a distance is not finite.
        """
        return self._derivative(finite_numbers("place [m]", place), 2)

    def motion(
        self, speed: float, duration: float, step: float, *, start: float = 0.0, name: str = "road"
    ) -> GroundMotion:
        """Return the vertical acceleration of a wheel's contact point at constant speed, v^2 z''(start + v t).

        A structure that is at rest relative to this motion at t = 0 moves upwards with the speed v times the slope at
        `start`. Between samples the acceleration is linear; use at least 20 samples per shortest wave that matters.

        Args:
            speed: Speed of the vehicle v [m/s].
            duration: Duration of the motion [s].
            step: Step of the samples [s].
            start: Place of the wheel at t = 0 [m]; minus the distance of the axles for an axle behind another one.
            name: Name of the motion in results.

        Returns:
            The motion.

        Raises:
            ValueError: If a value is not finite, is below its bound, or the step is longer than half of the shortest
                wave takes.

        Example:
            >>> road = wd.SineRoad(amplitude=0.01, wavelength=5.0)
            >>> road.motion(speed=20.0, duration=2.0, step=0.005)
            GroundMotion('road', 2 s at steps of 0.005 s, PGA 0.6428 g (6.304 m/s2))
        """
        speed = real_number("speed [m/s]", speed, above=0)
        duration = real_number("duration [s]", duration, above=0)
        step = real_number("step [s]", step, above=0)
        start = real_number("start [m]", start)
        longest = self.shortest_wave / speed / LEAST_SAMPLES
        if step > longest:
            raise ValueError(
                f"step is {step:g} s, but the shortest wave of the road, {self.shortest_wave:.4g} m, takes "
                f"{LEAST_SAMPLES * longest:.4g} s at {speed:g} m/s: give a step of at most {longest:.3g} s, better "
                f"{longest / 10:.2g} s"
            )
        count = int(np.ceil(duration / step * (1 - 1e-12))) + 1
        check_memory(f"{count} samples", 8.0 * 4 * count, "give a shorter duration= or a longer step=")
        places = start + speed * step * np.arange(max(count, 2))
        return GroundMotion(speed**2 * self.curvature(places), step, name, repr(self))

    def motion_of_axles(
        self, distance: float, speed: float, duration: float, step: float, *, name: str = "road"
    ) -> PairOfMotions:
        """Return the vertical accelerations of the road below a front and a rear axle, for `wd.HalfCar`.

        The front axle is at the place 0 of the road at t = 0; the rear axle passes the same places later.

        Args:
            distance: Distance between the axles [m], such as `car.wheelbase`.
            speed: Speed of the vehicle [m/s].
            duration: Duration of the motion [s].
            step: Step of the samples [s].
            name: Name of the motion in results.

        Returns:
            The two motions; see `motion`.

        Raises:
            ValueError: If a value is not finite, is below its bound, or the step is longer than half of the shortest
                wave takes.

        Example:
            >>> wd.RoadBump(height=0.05, length=2.0).motion_of_axles(2.1, speed=10.0, duration=2.0, step=0.005).duration
            2.0
        """
        behind = real_number("distance [m]", distance, above=0)
        front = self.motion(speed, duration, step, name=f"{name}, front axle")
        rear = self.motion(speed, duration, step, start=-behind, name=f"{name}, rear axle")
        return PairOfMotions(front, rear, name=name)

    def _derivative(self, place: np.ndarray, order: int) -> np.ndarray:
        """Return the elevation (order 0), its first or its second derivative."""
        raise NotImplementedError


@with_suggestions
@dataclass(frozen=True)
class RandomRoad(Road):
    """A random road with the spectral density of ISO 8608.

    z(x) = sum of sqrt(2 G(n_i) dn) cos(2 pi n_i x + phi_i), with spatial frequencies n_i in the middle of equal
    intervals dn, and random phases. After the distance 1 / dn all waves have the same phase differences again, so that
    a longer road is not random: increase `waves` until 1 / dn exceeds the length of the road.

    Args:
        roughness: Road class "A" (very good) to "H" (geometric mean of the class), or the spectral density at 0.1
            cycle/m [m2/(cycle/m)].
        lowest: Lower end of the spatial frequencies [1/m].
        highest: Upper end of the spatial frequencies [1/m].
        waves: Number of waves, at most 1,000,000.
        profile: Index of the profile; profiles of different indices are independent.
        seed: Seed of the random phases.

    Raises:
        ValueError: If a value is out of its range.

    Example:
        >>> road = wd.RandomRoad("C", lowest=0.01, highest=4.0, waves=2000, seed=1)
        >>> road.elevation([0.0, 10.0]).shape
        (2,)
        >>> round(road.standard_deviation, 4)
        0.016
    """

    roughness: str | float
    lowest: float
    highest: float
    waves: int
    profile: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        _roughness(self.roughness)
        lowest = real_number("lowest [1/m]", self.lowest, above=0)
        highest = real_number("highest [1/m]", self.highest, above=0)
        if highest <= lowest:
            raise ValueError(f"highest is {highest:g} 1/m; it must be above lowest, {lowest:g} 1/m")
        for name, least, most in (("waves", 1, MOST_WAVES), ("profile", 0, 2**63 - 1), ("seed", 0, 2**63 - 1)):
            object.__setattr__(self, name, whole_number(name, getattr(self, name), least, most))
        object.__setattr__(self, "lowest", lowest)
        object.__setattr__(self, "highest", highest)

    @property
    def shortest_wave(self) -> float:  # type: ignore[override] # computed, not set
        """Length of the shortest wave [m]."""
        return 1 / self.highest

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of the elevation [m]."""
        return float(np.sqrt((self._waves[1] ** 2).sum() / 2))

    @cached_property
    def _waves(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Wave numbers 2 pi n [rad/m], amplitudes [m] and phases [rad]."""
        width = (self.highest - self.lowest) / self.waves
        n = self.lowest + width * (np.arange(self.waves) + 0.5)
        amplitude = np.sqrt(2 * road_spectral_density(n, self.roughness) * width)
        drawn = uniforms(self.seed, self.profile, Purpose.ROAD, np.arange(-(-self.waves // 2)))
        return 2 * np.pi * n, amplitude, 2 * np.pi * drawn.ravel()[: self.waves]

    def _derivative(self, place: np.ndarray, order: int) -> np.ndarray:
        number, amplitude, phase = self._waves
        flat = place.ravel()
        found = np.empty(flat.size)
        count = max(1, VALUES_AT_A_TIME // self.waves)
        for first in range(0, flat.size, count):
            angle = np.outer(flat[first : first + count], number) + (phase + order * np.pi / 2)
            found[first : first + count] = np.cos(angle) @ (amplitude * number**order)
        return found.reshape(place.shape)


@with_suggestions
@dataclass(frozen=True)
class SineRoad(Road):
    """A road with the elevation A sin(2 pi x / L).

    Args:
        amplitude: Amplitude A [m].
        wavelength: Length of a wave L [m].

    Raises:
        ValueError: If a value is not finite and above 0.

    Example:
        >>> wd.SineRoad(amplitude=0.01, wavelength=5.0).elevation([0.0, 1.25])
        array([0.  , 0.01])
    """

    amplitude: float
    wavelength: float

    def __post_init__(self) -> None:
        for name in ("amplitude", "wavelength"):
            object.__setattr__(self, name, real_number(f"{name} [m]", getattr(self, name), above=0))

    @property
    def shortest_wave(self) -> float:  # type: ignore[override] # computed, not set
        """Length of the wave [m]."""
        return self.wavelength

    def _derivative(self, place: np.ndarray, order: int) -> np.ndarray:
        number = 2 * np.pi / self.wavelength
        return self.amplitude * number**order * np.sin(number * place + order * np.pi / 2)


@with_suggestions
@dataclass(frozen=True)
class RoadBump(Road):
    """A bump with the elevation h sin^4(pi x / L) for x from 0 to L; the road is level before and after.

    Elevation, slope and curvature are continuous at the ends of the bump.

    Args:
        height: Height of the bump h [m]; negative for a pothole.
        length: Length of the bump L [m].

    Raises:
        ValueError: If the height is not finite, or the length is not finite and above 0.

    Example:
        >>> wd.RoadBump(height=0.08, length=2.0).elevation([-1.0, 0.0, 1.0, 2.0]).round(4)
        array([0.  , 0.  , 0.08, 0.  ])
    """

    height: float
    length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "height", real_number("height [m]", self.height))
        object.__setattr__(self, "length", real_number("length [m]", self.length, above=0))

    @property
    def shortest_wave(self) -> float:  # type: ignore[override] # computed, not set
        """Half the length of the bump [m]: the shorter of its two waves."""
        return self.length / 2

    def _derivative(self, place: np.ndarray, order: int) -> np.ndarray:
        # sin^4(q) = 3/8 - cos(2 q) / 2 + cos(4 q) / 8
        number = 2 * np.pi / self.length
        angle, shift = number * place, order * np.pi / 2
        waves = -(number**order) * np.cos(angle + shift) / 2 + (2 * number) ** order * np.cos(2 * angle + shift) / 8
        is_on = (place > 0) & (place < self.length)
        return np.where(is_on, self.height * (waves + (3 / 8 if order == 0 else 0.0)), 0.0)


def _roughness(value: str | float) -> float:
    """Return the spectral density at 0.1 cycle/m of a class or a number."""
    if isinstance(value, str):
        one_of("road class", value, ROAD_CLASSES)
        return ROAD_CLASSES[value]
    return real_number("roughness", value, above=0)
