"""The target of a selection of records: mean and covariance of ln Sa at several periods."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import check_kind, finite_numbers, real_number, shortened
from warpdyn.foundations.core.frozen_values import FrozenArrays
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.ground_motions.measures.measure import SAME, IntensityMeasure
from warpdyn.model.ground_motions.measures.one_component import AverageSpectralAcceleration, SpectralAcceleration
from warpdyn.model.ground_motions.response_spectra import checked_periods

LEAST_EIGENVALUE = -1e-6  # least eigenvalue of a covariance, divided by the largest one (rounding of printed digits)
DAMPING_RATIO = 0.05  # of spectra of records
MOST_SIGMA = 2.0  # largest standard deviation of ln Sa that is accepted; ground-motion models have 0.5 to 0.9
REPAIR = "values, vectors = np.linalg.eigh(covariance); covariance = vectors @ np.diag(values.clip(0)) @ vectors.T"


@with_suggestions
@dataclass(frozen=True, eq=False, repr=False)
class TargetSpectrum(FrozenArrays):
    """Mean and covariance of ln Sa at several periods, to which records are selected.

    `conditional_spectrum` computes the target of a conditional spectrum. A target with `conditioning` belongs to one
    level of an intensity measure: all selected records are scaled to this level.

    Args:
        periods: Natural periods [s], increasing, shape [period].
        median: Median of Sa, i.e. exp of the mean of ln Sa [g], shape [period].
        covariance: Covariance of ln Sa [1], shape [period, period], or standard deviations, shape [period], of
            uncorrelated values.
        conditioning: SpectralAcceleration(period) whose period is one of `periods`, or AverageSpectralAcceleration;
            None: the target is unconditional.
        level: Level of `conditioning` [g]; None: the median of the target at the conditioning period.

    Raises:
        ValueError: If periods do not increase, shapes differ, a median is not positive, the covariance is not symmetric
            or not positive semidefinite, or the conditioning period is not among the periods or has another damping
            ratio than 5 %.
        TypeError: If `conditioning` is not one of the two intensity measures.

    Example:
        >>> target = wd.TargetSpectrum([0.2, 0.5, 1.0], median=[0.8, 0.6, 0.3], covariance=[0.5, 0.55, 0.6])
        >>> target.dispersion
        array([0.5 , 0.55, 0.6 ])
    """

    periods: ArrayLike
    median: ArrayLike
    covariance: ArrayLike
    conditioning: IntensityMeasure | None = None
    level: float | None = None

    def __post_init__(self) -> None:
        periods = checked_periods(self.periods, "TargetSpectrum.periods")
        if periods.ndim != 1 or periods.size == 0 or np.any(np.diff(periods) <= 0):
            raise ValueError(
                f"TargetSpectrum.periods must be one row of increasing periods [s], got {shortened(self.periods)}"
            )
        median = finite_numbers("TargetSpectrum.median [g]", self.median, "g")
        if median.shape != periods.shape or np.any(median <= 0):
            raise ValueError(
                f"TargetSpectrum.median must be {periods.size} values above 0 g, one per period, got "
                f"{shortened(self.median)}"
            )
        object.__setattr__(self, "periods", periods)
        object.__setattr__(self, "median", median)
        object.__setattr__(self, "covariance", _checked_covariance(self.covariance, periods))
        self._check_conditioning()
        for name in ("periods", "median", "covariance"):
            getattr(self, name).flags.writeable = False

    def _check_conditioning(self) -> None:
        measure = self.conditioning
        if measure is None:
            if self.level is not None:
                raise ValueError("TargetSpectrum.level belongs to a conditioning measure: give conditioning= too")
            return
        kinds = SpectralAcceleration | AverageSpectralAcceleration
        if not isinstance(measure, kinds):
            check_kind(
                *("TargetSpectrum", "wd.SpectralAcceleration(period)", measure, SpectralAcceleration),
                argument="conditioning",
            )
        if (ratio := measure.damping_ratio) != DAMPING_RATIO:  # type: ignore[attr-defined]
            raise ValueError(
                f"TargetSpectrum: conditioning has the damping ratio {ratio:g}, but the spectra of records are for "
                f"{DAMPING_RATIO:g}: give a measure without damping_ratio="
            )
        if isinstance(measure, SpectralAcceleration):
            index = index_of_period(np.asarray(self.periods), measure.period)
            if index is None:
                raise ValueError(
                    f"TargetSpectrum: the conditioning period {measure.period:g} s is not one of periods="
                    f"{np.asarray(self.periods).tolist()}: add it to periods="
                )
            if self.level is None:
                object.__setattr__(self, "level", float(np.asarray(self.median)[index]))
        if self.level is None:
            raise ValueError("TargetSpectrum.level is missing: give the level of the average spectral acceleration [g]")
        object.__setattr__(self, "level", real_number("TargetSpectrum.level [g]", self.level, above=0, units="g"))

    @property
    def mean(self) -> np.ndarray:
        """Mean of ln Sa, with Sa in g, shape [period]."""
        return np.log(np.asarray(self.median))

    @property
    def dispersion(self) -> np.ndarray:
        """Standard deviation of ln Sa [1], shape [period]."""
        return np.sqrt(np.diag(np.asarray(self.covariance)))

    @property
    def factor(self) -> np.ndarray:
        """Matrix A with A A^T = covariance, shape [period, period]; simulated spectra are mean + A n."""
        values, vectors = np.linalg.eigh(np.asarray(self.covariance))
        return vectors * np.sqrt(values.clip(0.0))

    @property
    def conditioning_periods(self) -> np.ndarray:
        """Periods of the conditioning measure [s]; empty if the target is unconditional."""
        measure = self.conditioning
        if isinstance(measure, SpectralAcceleration):
            return np.array([measure.period])
        return np.array([] if measure is None else measure.periods)  # type: ignore[attr-defined]

    @property
    def fixed(self) -> np.ndarray:
        """Whether the spectral acceleration at each period is prescribed by the conditioning, shape [period]."""
        periods = np.asarray(self.periods)
        if not isinstance(self.conditioning, SpectralAcceleration):
            return np.zeros(periods.size, bool)
        return np.arange(periods.size) == index_of_period(periods, self.conditioning.period)

    def __repr__(self) -> str:
        periods = np.asarray(self.periods)
        text = f"TargetSpectrum({periods.size} periods from {periods[0]:g} to {periods[-1]:g} s"
        if self.conditioning is not None:
            text += f", {self.conditioning.name} = {self.level:.4g} g"
        return text + ")"


def index_of_period(periods: np.ndarray, period: float) -> int | None:
    """Return the index of a period in a row of periods; None if no period is equal except for printed digits."""
    index = int(np.argmin(np.abs(np.log(periods / period))))
    return index if abs(periods[index] - period) <= SAME * 0.01 * period else None


def _checked_covariance(given: ArrayLike, periods: np.ndarray) -> np.ndarray:
    values = finite_numbers("TargetSpectrum.covariance", given)
    if values.ndim == 1:
        if np.any(values < 0):
            raise ValueError(
                f"TargetSpectrum.covariance: standard deviations must be at least 0, got {shortened(given)}"
            )
        values = np.diag(values**2)
    if values.shape != (periods.size, periods.size):
        raise ValueError(
            f"TargetSpectrum.covariance must have shape [{periods.size}, {periods.size}], one row per period, or be "
            f"{periods.size} standard deviations, got shape {np.shape(given)}"
        )
    largest = np.abs(values).max()
    if not np.allclose(values, values.T, rtol=0, atol=1e-9 * largest):
        i, j = np.argwhere(np.abs(values - values.T) > 1e-9 * largest)[0]
        raise ValueError(
            f"TargetSpectrum.covariance is not symmetric: {values[i, j]:g} and {values[j, i]:g} for "
            f"{periods[i]:g} and {periods[j]:g} s: give (covariance + covariance.T) / 2 if this is rounding"
        )
    values = (values + values.T) / 2
    eigenvalues = np.linalg.eigvalsh(values)
    if eigenvalues[0] < LEAST_EIGENVALUE * max(eigenvalues[-1], 0.0) or np.any(np.diag(values) < 0):
        raise ValueError(
            f"TargetSpectrum.covariance is not positive semidefinite (least eigenvalue {eigenvalues[0]:.3g}, largest "
            f"{eigenvalues[-1]:.3g}), so no spectra can have it. If correlations were rounded, replace it by the "
            f"nearest covariance: {REPAIR}"
        )
    worst = int(np.argmax(np.diag(values)))
    if values[worst, worst] > MOST_SIGMA**2:
        raise ValueError(
            f"TargetSpectrum.covariance has a standard deviation of ln Sa of {np.sqrt(values[worst, worst]):.3g} at "
            f"{periods[worst]:g} s, more than {MOST_SIGMA:g}: give the covariance of natural logarithms"
        )
    return values
