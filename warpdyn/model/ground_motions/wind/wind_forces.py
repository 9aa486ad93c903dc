"""Random wind forces on the floors of a building: mean wind, turbulence with a spectrum, and vertical coherence."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import irfft, next_fast_len

from warpdyn.foundations.core.checks import check_memory, finite_numbers, real_number, shortened, whole_number
from warpdyn.foundations.core.near_misses import suggests_names, with_suggestions
from warpdyn.foundations.core.plausibility import PlausibilityFindings, meant_as_given
from warpdyn.foundations.core.plausibility.forces import CHECKS_OF_WIND
from warpdyn.foundations.core.random_numbers import Purpose, normals
from warpdyn.model.ground_motions.forces import ForceHistory
from warpdyn.model.ground_motions.intensities import checked_levels
from warpdyn.model.ground_motions.wind.force_stripes import ForceStripes
from warpdyn.model.ground_motions.wind.spectra import WindSpectrum

LEAST_SAMPLES, MOST_SAMPLES = 16, 2**22
NEGATIVE = 1e-6  # largest negative eigenvalue of a spectral matrix that is rounded to 0, over the largest one
MATRICES = 4  # arrays of the size of the spectral matrices that exist at the same time
STARTING = 0.1  # part of the duration in which forces increase from 0, if `rise` is not given


@with_suggestions
@dataclass(frozen=True, eq=False)
class WindForces:
    """Random along-wind forces on the floors of a building.

    The force on a floor is the mean force r C A U^2 / 2 plus r C A U u(t), with the mean wind speed U and the
    turbulence u(t); the term in u^2 and the motion of the building are neglected. u(t) is a stationary Gaussian
    process with a spectrum; between two floors the cross-spectrum is the coherence exp(-C_z f abs(z1 - z2) / U_mean)
    (Davenport) times the root of the product of both spectra.

    Args:
        height: Height of each floor above the ground [m], shape [dof].
        mean_speed: Mean wind speed at each floor [m/s], shape [dof].
        area: Area of the face of each floor [m2], shape [dof], or one for all.
        drag_coefficient: Drag coefficient C [1], shape [dof], or one for all.
        spectrum: KaimalSpectrum, DavenportSpectrum or VonKarmanSpectrum.
        decay_coefficient: Coefficient C_z of the coherence [1].
        air_density: Density of the air r [kg/m3].

    Raises:
        ValueError: If a value is not finite and above 0, or numbers of values differ.
        TypeError: If the spectrum is not a spectrum of wind.

    Example:
        >>> wind = wd.WindForces(
        ...     height=[4.0, 8.0],
        ...     mean_speed=[22.9, 26.7],
        ...     area=100.0,
        ...     drag_coefficient=1.3,
        ...     spectrum=wd.KaimalSpectrum(1.8),
        ... )
        >>> wind.mean_force.round(0)
        array([42608., 57922.])
        >>> wind.force_history(duration=60.0, step=0.1, seed=1)
        ForceHistory(601 values every 0.1 s, 2 degrees of freedom)
    """

    height: ArrayLike
    mean_speed: ArrayLike
    area: ArrayLike
    drag_coefficient: ArrayLike
    spectrum: WindSpectrum
    decay_coefficient: float = 10.0
    air_density: float = 1.25

    def __post_init__(self) -> None:
        if not isinstance(self.spectrum, WindSpectrum):
            raise TypeError(
                f"WindForces.spectrum must be a KaimalSpectrum, DavenportSpectrum or VonKarmanSpectrum, got "
                f"{self.spectrum!r}"
            )
        values = {}
        units = {"height": "m", "mean_speed": "m/s", "area": "m2", "drag_coefficient": "1"}
        for name, unit in units.items():
            value = np.atleast_1d(finite_numbers(f"WindForces.{name} [{unit}]", getattr(self, name)))
            if value.ndim != 1 or np.any(value <= 0):
                raise ValueError(f"WindForces.{name} must be a row of values above 0 {unit}, got {getattr(self, name)}")
            values[name] = value
        floors = values["height"].size
        if values["mean_speed"].size != floors:
            raise ValueError(
                f"WindForces.mean_speed has {values['mean_speed'].size} values and height has {floors}: give one mean "
                "wind speed per floor"
            )
        for name in ("area", "drag_coefficient"):
            if values[name].size not in (1, floors):
                raise ValueError(f"WindForces.{name} has {values[name].size} values: give 1 or {floors}")
        for name, value in values.items():
            object.__setattr__(self, name, np.broadcast_to(value, floors).copy())
        for name, unit in (("decay_coefficient", "1"), ("air_density", "kg/m3")):
            number = real_number(f"WindForces.{name} [{unit}]", getattr(self, name), above=0)
            object.__setattr__(self, name, number)
        self._warn_if_implausible()

    def _warn_if_implausible(self) -> None:
        """Give one warning of implausible heights, wind speeds, areas, coefficients and turbulence."""
        height, speed = np.asarray(self.height), np.asarray(self.mean_speed)
        findings = PlausibilityFindings()
        findings.add("wind_height", height, along="floor")
        findings.add("wind_height_over_floor_below", height[1:] / height[:-1])
        findings.add("wind_speed", speed, along="floor")
        if height.size > 1 and np.all(np.diff(height) > 0):
            findings.add("wind_profile_exponent", np.log(speed[-1] / speed[0]) / np.log(height[-1] / height[0]))
        findings.add("wind_area", self.area, along="floor")
        findings.add("wind_drag_coefficient", self.drag_coefficient, along="floor")
        findings.add("wind_decay_coefficient", self.decay_coefficient)
        findings.add("air_density", self.air_density)
        findings.add("turbulence_intensity", self.spectrum.standard_deviation_of_turbulence / speed, along="floor")
        findings.add("turbulence_length", getattr(self.spectrum, "length", np.nan))
        findings.warn()

    @property
    def _per_speed(self) -> np.ndarray:
        """Force per wind speed at the mean wind speed [N s/m], shape [dof]."""
        speed, area = np.asarray(self.mean_speed), np.asarray(self.area)
        force: np.ndarray = self.air_density * np.asarray(self.drag_coefficient) * area * speed
        return force

    @property
    def mean_force(self) -> np.ndarray:
        """Mean force on each floor [N], shape [dof]."""
        return 0.5 * self._per_speed * np.asarray(self.mean_speed)

    def coherence(self, frequency: ArrayLike) -> np.ndarray:
        """Return the coherence (root of the squared coherence) between floors [1], shape [frequency, dof, dof].

        Args:
            frequency: Frequencies [Hz], at least 0, shape [frequency].

        Raises:
            ValueError: If a frequency is not finite or below 0.

        Example:
            >>> wind = wd.WindForces([4.0, 8.0], [22.9, 26.7], 100.0, 1.3, wd.KaimalSpectrum(1.8))
            >>> wind.coherence([0.1, 1.0])[:, 0, 1].round(3)
            array([0.851, 0.199])
        """
        values = np.atleast_1d(finite_numbers("frequency [Hz]", frequency))
        if values.ndim != 1 or np.any(values < 0):
            raise ValueError(f"frequency must be a row of values of at least 0 Hz, got {shortened(frequency)}")
        z, speed = np.asarray(self.height), np.asarray(self.mean_speed)
        between = np.abs(z[:, None] - z) / (0.5 * (speed[:, None] + speed))
        coherence: np.ndarray = np.exp(-self.decay_coefficient * values[:, None, None] * between)
        return coherence

    def spectral_matrix(self, frequency: ArrayLike) -> np.ndarray:
        """Return the one-sided cross-spectral density of the turbulence [m2/s], shape [frequency, dof, dof].

        Args:
            frequency: Frequencies [Hz], above 0, shape [frequency].

        Raises:
            ValueError: If a frequency is not finite and above 0.

        Example:
            >>> wind = wd.WindForces([4.0, 8.0], [22.9, 26.7], 100.0, 1.3, wd.KaimalSpectrum(1.8))
            >>> wind.spectral_matrix([0.1])[0].round(2)
            array([[39.76, 34.87],
                   [34.87, 42.21]])
        """
        values = np.atleast_1d(finite_numbers("frequency [Hz]", frequency))
        if values.ndim != 1:
            raise ValueError(f"frequency must be a row of values [Hz], got shape {values.shape}")
        root = np.sqrt(self.spectrum.spectral_density(values[:, None], self.height, self.mean_speed))
        return self.coherence(values) * root[:, :, None] * root[:, None, :]

    def at_speed(self, factor: float) -> WindForces:
        """Return the wind forces for mean wind speeds times `factor`; the turbulence intensity stays the same.

        Args:
            factor: Factor on the mean wind speeds [1].

        Raises:
            ValueError: If the factor is not finite and above 0.

        Example:
            >>> wind = wd.WindForces([4.0, 8.0], [22.9, 26.7], 100.0, 1.3, wd.KaimalSpectrum(1.8))
            >>> wind.at_speed(2.0).mean_speed
            array([45.8, 53.4])
        """
        factor = real_number("factor", factor, above=0)
        return replace(self, mean_speed=factor * np.asarray(self.mean_speed), spectrum=self.spectrum.scaled(factor))

    @suggests_names
    def force_histories(
        self,
        number: int,
        duration: float,
        step: float,
        *,
        seed: int = 0,
        first: int = 0,
        rise: float | None = None,
    ) -> list[ForceHistory]:
        """Return random force histories; a history depends only on the seed and on its index.

        The turbulence is a sum of harmonics with random amplitudes at multiples of about 1 / duration. Its variance at
        frequencies above 1 / (2 step) and below half of 1 / duration is missing.

        Args:
            number: Number of histories.
            duration: Duration [s].
            step: Sampling step [s], at most 1/10 of the shortest period of interest: the turbulence has no frequencies
                above 1 / (2 step), and the forces, which are linear between samples, are too small by 3 % at 1 / (10
                step).
            seed: Seed of the random numbers.
            first: Index of the first history.
            rise: Time in which the forces increase from 0 [s], so that the mean wind does not act as an impact; None: a
                tenth of the duration. Record demands from then on: `Scene(..., record_from=rise)`.

        Raises:
            ValueError: If an argument is out of range, or the coherence is impossible (the spectral matrix has negative
                eigenvalues).

        Example:
            >>> wind = wd.WindForces([4.0, 8.0], [22.9, 26.7], 100.0, 1.3, wd.KaimalSpectrum(1.8))
            >>> wind.force_histories(3, duration=60.0, step=0.1, seed=1)[2]
            ForceHistory(601 values every 0.1 s, 2 degrees of freedom)
        """
        number = whole_number("number", number, 1, 2**24)
        first, seed = whole_number("first", first, 0, 2**40), whole_number("seed", seed, 0)
        duration, step = self._checked_times(duration, step)
        rise = STARTING * duration if rise is None else real_number("rise [s]", rise, least=0)
        if rise >= duration:
            raise ValueError(f"rise={rise:g} s must be shorter than duration={duration:g} s")
        self._check_memory(number, duration, step, "a smaller number=")
        findings = PlausibilityFindings()
        findings.add("wind_step", step)
        findings.add("wind_duration", duration)
        findings.warn()
        samples, floors = round(duration / step) + 1, np.size(self.height)
        length = next_fast_len(samples, real=True)
        factors = self._amplitudes(length, step)
        ramp = np.minimum(step * np.arange(samples), rise) / rise if rise else np.ones(samples)
        found = []
        for index in range(first, first + number):
            drawn = normals(seed, index, Purpose.WIND, np.arange(len(factors) * floors)).reshape(-1, floors, 2)
            waves = np.zeros((length // 2 + 1, floors), dtype=complex)
            complex_normal = drawn[..., 0] - 1j * drawn[..., 1]
            waves[1 : len(factors) + 1] = 0.5 * length * np.einsum("kij,kj->ki", factors, complex_normal)
            turbulence = irfft(waves, length, axis=0)[:samples]
            found.append(ForceHistory(ramp[:, None] * (self.mean_force + self._per_speed * turbulence), step))
        return found

    @suggests_names
    def force_history(
        self, duration: float, step: float, *, seed: int = 0, index: int = 0, rise: float | None = None
    ) -> ForceHistory:
        """Return one random force history; arguments and errors as in `force_histories`.

        Example:
            >>> wind = wd.WindForces([4.0, 8.0], [22.9, 26.7], 100.0, 1.3, wd.KaimalSpectrum(1.8))
            >>> wind.force_history(duration=60.0, step=0.1, seed=1, rise=6.0).values[0]  # N
            array([0., 0.])
        """
        return self.force_histories(1, duration, step, seed=seed, first=index, rise=rise)[0]

    @suggests_names
    def stripes(
        self,
        levels: ArrayLike,
        reference_speed: float,
        histories: int,
        duration: float,
        step: float,
        *,
        seed: int = 0,
        rise: float | None = None,
        structures_per_history: int | None = None,
    ) -> ForceStripes:
        """Return wind forces for several levels of the mean wind speed, with different histories for each level.

        Args:
            levels: Mean wind speeds at the height of `reference_speed` [m/s], increasing, shape [im_level].
            reference_speed: Mean wind speed that belongs to `mean_speed`, such as the speed at a height of 10 m [m/s].
            histories: Number of force histories per level.
            duration: Duration [s].
            step: Sampling step [s], as in `force_histories`.
            seed: Seed of the random numbers.
            rise: Time in which the forces increase from 0 [s]; None: 10 % of the duration.
            structures_per_history: As in `ForceStripes`.

        Raises:
            ValueError: If an argument is out of range.

        Example:
            >>> wind = wd.WindForces([4.0, 8.0], [22.9, 26.7], 100.0, 1.3, wd.KaimalSpectrum(1.8))
            >>> wind.stripes([20.0, 40.0], reference_speed=28.0, histories=3, duration=60.0, step=0.1)
            ForceStripes(2 levels of mean wind speed [m s-1], 3 histories each)
        """
        reference = real_number("reference_speed [m/s]", reference_speed, above=0)
        count = whole_number("histories", histories, 1, 2**20)
        speeds = checked_levels(levels, "m s-1")
        duration, step = self._checked_times(duration, step)
        self._check_memory(count * speeds.size, duration, step, "fewer levels= or histories=")
        floors = np.asarray(self.mean_speed)
        findings = PlausibilityFindings()
        findings.add("wind_reference_speed", reference / floors[-1])
        findings.add("wind_speed", speeds, " of levels")
        findings.add("wind_speed", speeds[:, None] / reference * floors, " on a floor at the highest level")
        findings.add("wind_step", step)
        findings.add("wind_duration", duration)
        findings.warn()
        with meant_as_given(*CHECKS_OF_WIND):  # the warning above
            found = [
                self.at_speed(float(speed) / reference).force_histories(
                    count, duration, step, seed=seed, first=place * count, rise=rise
                )
                for place, speed in enumerate(speeds)
            ]
        return ForceStripes(found, speeds, structures_per_history=structures_per_history)

    @staticmethod
    def _checked_times(duration: float, step: float) -> tuple[float, float]:
        """Return duration and step [s]; raise a ValueError if they are out of range."""
        duration = real_number("duration [s]", duration, above=0)
        step = real_number("step [s]", step, above=0)
        if not LEAST_SAMPLES <= duration / step <= MOST_SAMPLES:
            raise ValueError(
                f"duration over step is {duration / step:,.0f}; it must be from {LEAST_SAMPLES} to {MOST_SAMPLES:,}: "
                "change step="
            )
        return duration, step

    def _check_memory(self, number: int, duration: float, step: float, fewer: str) -> None:
        """Raise an error if the memory is too small for the histories and the spectral matrices of half the samples."""
        floors, samples = np.size(self.height), duration / step + 1
        values = floors * samples * (number + 0.5 * MATRICES * floors)
        check_memory(f"{number} force histories", 8.0 * values, f"give {fewer}, or a longer step=")

    def _amplitudes(self, length: int, step: float) -> np.ndarray:
        """Return factors of the amplitudes of harmonics [m/s], shape [frequency, dof, dof]: F F = S df."""
        spacing = 1 / (length * step)
        frequency = spacing * np.arange(1, (length - 1) // 2 + 1)
        values, vectors = np.linalg.eigh(self.spectral_matrix(frequency) * spacing)
        least = values.min(axis=1) / values.max(axis=1)
        if least.min() < -NEGATIVE:
            worst = int(least.argmin())
            raise ValueError(
                f"WindForces: the coherence at {frequency[worst]:.3g} Hz is impossible for these mean speeds (the "
                f"spectral matrix has an eigenvalue of {least[worst]:.2g} times the largest one): give mean "
                "speeds that change less between neighbouring floors"
            )
        # The symmetric root F, which is unique: signs and order of eigenvectors depend on the LAPACK library.
        return vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :] @ np.swapaxes(vectors, -1, -2)
