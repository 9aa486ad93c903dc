"""Hazard curves of a site (annual rates of exceedance, interpolated in logarithms), and logic trees of such curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.answers.risk.hazard import files
from warpdyn.answers.risk.hazard.measures import units_of_hazard
from warpdyn.answers.risk.hazard.plausible import warn_of_implausible_hazard
from warpdyn.foundations.core.checks import check_kind, checked_text, finite_numbers, real_number, real_numbers
from warpdyn.foundations.core.frozen_values import FrozenArrays
from warpdyn.foundations.core.messages import amount_of, warn_caller
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.ground_motions.measures.names import same_measure, warn_unless_compared

WEIGHT_TOLERANCE = 1e-6  # for the sum of a logic tree's weights, which files contain with about seven digits


@with_suggestions
@dataclass(frozen=True, eq=False)
class HazardCurve(FrozenArrays):
    """The seismic hazard of a site: the annual rate at which each intensity is exceeded.

    Between the points, ln(rate) is linear in ln(intensity). Below the first point and above the last point, the slope
    of the end segment continues; results contain the share that is from these extrapolated intensities.

    A warning is given if the curve is above the highest hazard of any site. Usual causes are m/s2 instead of g, cm/s
    instead of m/s, or probabilities in 50 years instead of annual rates. For a site with low hazard these mistakes are
    not detected, because the wrong curve is plausible for a site with high hazard.

    Args:
        intensity: Intensity measure [units], shape [point], positive and increasing.
        annual_rate: Mean annual rate of exceedance [1/year], shape [point], positive; it must not increase.
        measure: Name of the intensity measure, such as "PGA", "SA(0.75)" or "Sa(0.75 s, 5 %)". Fragility curves of
            another measure then cause an error; a name that warpdyn does not know causes a warning. None: missing,
            which causes a warning if the fragility curves name their measure. "": no check.
        units: Units of the intensity, which must be those of the fragility curves: "g" or SI units such as "m s-1"
            (also written "m/s"; "cm/s" is converted). None: "g", which is allowed only for accelerations.

    Raises:
        ValueError: If there are fewer than two points, values are not positive and finite, intensities do not increase,
            or rates increase; if the last two rates are equal, because the rate would then never fall to 0; if the
            measure cannot have these units.
        TypeError: If `measure` or `units` is not text.

    Attributes:
        is_unnamed: Whether the argument `measure` is missing.

    Example:
        >>> hazard = wd.HazardCurve([0.1, 0.3, 1.0], [1e-2, 1e-3, 5e-5], measure="SA(0.75)")
        >>> float(hazard.intensity_of(1 / 475).round(2))  # g
        0.21
        >>> of_velocity = wd.HazardCurve([0.03, 0.1, 1.0], [4e-2, 8e-3, 3e-5], measure="PGV", units="m s-1")
        >>> float(of_velocity.rate_of(0.1).round(4))  # 1/year
        0.008
    """

    intensity: np.ndarray
    annual_rate: np.ndarray
    measure: str = ""
    units: str = "g"
    is_unnamed: bool = field(default=False, init=False, repr=False)

    def __init__(
        self, intensity: ArrayLike, annual_rate: ArrayLike, *, measure: str | None = None, units: str | None = None
    ) -> None:
        object.__setattr__(self, "is_unnamed", measure is None)
        measure = checked_text("measure", "" if measure is None else measure)
        given, (units, factor) = units, units_of_hazard(measure, units)
        intensity = _positive_points("intensity", intensity, given or units)
        rate = _positive_points("annual_rate", annual_rate)
        intensity *= factor
        if intensity.size != rate.size:
            raise ValueError(
                f"intensity has {amount_of(intensity.size, 'value')} and annual_rate has {rate.size}: give one rate "
                "per intensity"
            )
        if intensity.size < 2:
            raise ValueError("a hazard curve needs at least 2 points, got 1: add the rate at another intensity")
        if (np.diff(intensity) < 0).all() and (np.diff(rate) > 0).all():
            raise ValueError(
                "intensity decreases and annual_rate increases: the arguments seem to be swapped. Give the intensities "
                "first, HazardCurve(intensity, annual_rate), or, if they are in order, sort the points by intensity"
            )
        for i in np.flatnonzero(np.diff(intensity) <= 0):
            raise ValueError(
                f"intensity must increase, but {intensity[i]:g} is followed by {intensity[i + 1]:g}: sort the points "
                "by intensity"
            )
        for i in np.flatnonzero(np.diff(rate) > 0):
            raise ValueError(
                f"a hazard curve never rises, but annual_rate goes from {rate[i]:g} at {intensity[i]:g} {units} to "
                f"{rate[i + 1]:g} at {intensity[i + 1]:g} {units}; give rates of exceedance, not of occurrence; "
                "of return periods in years, give 1 / return_period"
            )
        if rate[-1] == rate[-2]:
            raise ValueError(
                f"the last two annual rates are equal ({rate[-1]:g}), so the rate would be constant at all larger "
                "intensities: remove the last point"
            )
        warn_of_implausible_hazard(intensity, rate, measure, units)
        for name, values in (("intensity", intensity), ("annual_rate", rate)):
            values.setflags(write=False)
            object.__setattr__(self, name, values)
        object.__setattr__(self, "measure", measure)
        object.__setattr__(self, "units", units)

    @classmethod
    def from_probabilities(
        cls,
        intensity: ArrayLike,
        probability: ArrayLike,
        years: float,
        *,
        measure: str | None = None,
        units: str | None = None,
    ) -> HazardCurve:
        """Return a curve from probabilities of exceedance in a number of years, for a Poisson process.

        Args:
            intensity: Intensity measure [units], shape [point].
            probability: Probability of at least one exceedance in these years [1], shape [point].
            years: The investigation time [year].
            measure: Name of the intensity measure; see `HazardCurve`.
            units: Units of the intensity; see `HazardCurve`.

        Raises:
            ValueError: For the reasons in `HazardCurve`, or if a probability is not above 0 and below 1.

        Example:
            >>> hazard = wd.HazardCurve.from_probabilities([0.1, 0.5], [0.39, 0.02], years=50)
            >>> hazard.annual_rate.round(5)
            array([0.00989, 0.0004 ])
        """
        years = real_number("years", years, above=0)
        values = _positive_points("probability", probability)
        for i in np.flatnonzero(values >= 1):
            raise ValueError(
                f"probability[{i}] is {values[i]:g}; it must be below 1: give annual rates to HazardCurve(...), and "
                "remove points whose probability is rounded to 1"
            )
        return cls(intensity, -np.log1p(-values) / years, measure=measure, units=units)

    @classmethod
    def from_openquake_csv(cls, path: str | Path, *, site: tuple[float, float] | None = None) -> HazardCurve:
        """Read a hazard curve that the OpenQuake engine exported, such as `hazard_curve-mean-SA(0.75)_1.csv`.

        Probabilities in the file's investigation time are converted to annual rates of a Poisson process. Points with
        probability 0, or with a probability that the file rounds to 1, are omitted. Accelerations are in g; velocities
        (cm/s in the file) and displacements (cm) are converted to SI units. A warning is given if the file contains a
        quantile or the maximum over the logic tree instead of the mean.

        Args:
            path: The file.
            site: Longitude and latitude [degree]; None: the file has one site.

        Raises:
            ValueError: If the first line has no investigation_time or imt, the columns `poe-...` are missing, the file
                is of kind='std', a value is not a number, or no site is within 0.001 degrees of `site`; or for the
                reasons in `HazardCurve`.
            FileNotFoundError: If the file does not exist.

        Example:
            >>> hazard = wd.HazardCurve.from_openquake_csv("hazard_curve-mean-PGA_1.csv", site=(-122.4, 37.8))
            >>> hazard.measure
            'PGA'
        """
        intensity, rate, measure, units = files.read_openquake_csv(path, site)
        return cls._of_file(path, intensity, rate, measure, units)

    @classmethod
    def from_usgs(
        cls, path: str | Path, *, measure: str | None = None, site: str | tuple[float, float] | None = None
    ) -> HazardCurve:
        """Read a hazard curve of the USGS: JSON of its web services, or CSV of its program nshmp-haz.

        The files contain annual rates of exceedance and intensities in g. Points with rate 0 are omitted. From a JSON
        file, the component "Total" is read.

        Args:
            path: The file. For a CSV file, the name of its folder is the measure, as in `curves/SA0P2/total.csv`.
            measure: The intensity measure, such as "PGA" or "SA(0.2)"; required for a JSON file with several measures,
                and for a CSV file whose folder has another name.
            site: Name of the site, or its longitude and latitude [degree]; required for a CSV file with several sites.

        Raises:
            ValueError: If the file has another format, the measure or the site is missing, or a value is not a number;
                or for the reasons in `HazardCurve`.
            FileNotFoundError: If the file does not exist.
            TypeError: If `measure` is not text.

        Example:
            >>> hazard = wd.HazardCurve.from_usgs("hazard.json", measure="SA(0.75)")
            >>> hazard.measure
            'SA(0.75)'
        """
        if measure is not None:
            checked_text("measure", measure)
        intensity, rate, measure = files.read_usgs(path, measure, site)
        return cls._of_file(path, intensity, rate, measure, None)

    @classmethod
    def _of_file(
        cls, path: str | Path, intensity: np.ndarray, rate: np.ndarray, measure: str, units: str | None
    ) -> HazardCurve:
        """Return the hazard curve with the values of a file; error messages begin with the name of the file."""
        try:
            return cls(intensity, rate, measure=measure, units=units)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None

    @property
    def slopes(self) -> np.ndarray:
        """Slope -d ln(rate) / d ln(intensity) [1] between neighbouring points, shape [number of points - 1]."""
        return -np.diff(np.log(self.annual_rate)) / np.diff(np.log(self.intensity))

    def rate_of(self, intensity: ArrayLike) -> np.ndarray:
        """Return the annual rates at which intensities are exceeded [1/year]; 0 for infinite intensities.

        Args:
            intensity: Intensity measure [units], above 0, of any shape.

        Raises:
            ValueError: If an intensity is not above 0.
        """
        values = real_numbers("intensity", intensity)
        if not np.all(values > 0):
            raise ValueError(f"rate_of: every intensity must be above 0, got {values.min():g}")
        log_x, log_rate = np.log(self.intensity), np.log(self.annual_rate)
        u = np.log(values)
        segment = np.clip(np.searchsorted(log_x, u, side="right") - 1, 0, log_x.size - 2)
        with np.errstate(over="ignore"):  # far below the first point: infinite
            return np.exp(log_rate[segment] - self.slopes[segment] * (u - log_x[segment]))

    def intensity_of(self, rate: ArrayLike) -> np.ndarray:
        """Return the intensities [units] that are exceeded at given annual rates.

        If the rate is constant between two points, the result is the largest intensity with this rate.

        Args:
            rate: Annual rate [1/year], above 0, of any shape; `1 / return_period`. A warning is given for rates that
                are outside the range of the points.

        Raises:
            ValueError: If a rate is not above 0, or above the first rate of a curve whose first two rates are equal.
        """
        values = real_numbers("rate", rate)
        if not np.all(values > 0):
            raise ValueError(f"intensity_of: every rate must be above 0, got {values.min():g}")
        log_x, log_rate = np.log(self.intensity), np.log(self.annual_rate)
        v = np.log(values)
        if np.any((values > self.annual_rate[0]) & (self.slopes[0] == 0)):
            raise ValueError(
                f"no intensity is exceeded more often than {self.annual_rate[0]:g} times per year: give a smaller rate"
            )
        if np.any((values > self.annual_rate[0] * (1 + 1e-12)) | (values < self.annual_rate[-1] * (1 - 1e-12))):
            warn_caller(
                f"the hazard curve has rates from {self.annual_rate[-1]:.3g} to {self.annual_rate[0]:.3g} per year: "
                "intensities of other rates are extrapolated; give a hazard curve that reaches further"
            )
        segment = np.clip(np.searchsorted(-log_rate, -v, side="right") - 1, 0, log_x.size - 2)
        return np.exp(log_x[segment] - (v - log_rate[segment]) / self.slopes[segment])


@with_suggestions
@dataclass(frozen=True, eq=False)
class HazardLogicTree(FrozenArrays):
    """Several hazard curves of one site, with weights that describe the uncertainty of the hazard.

    Args:
        curves: Hazard curves of the end branches, of the same intensity measure and unit; their points may differ.
        weights: Weight of each branch [1], positive; the weights must sum up to 1.

    Raises:
        ValueError: If there is no curve, the number of weights is not the number of curves, weights are not positive or
            their sum is not 1, or the curves have different measures or units.
        TypeError: If `curves` is not a sequence, or a branch is not a HazardCurve.

    Example:
        >>> low, high = wd.HazardCurve([0.1, 1.0], [5e-3, 2e-5]), wd.HazardCurve([0.1, 1.0], [2e-2, 2e-4])
        >>> tree = wd.HazardLogicTree([low, hazard, high], [0.2, 0.6, 0.2])
        >>> float(tree.rate_of(0.1).round(4))  # 1/year
        0.0096
    """

    curves: tuple[HazardCurve, ...]
    weights: np.ndarray

    def __init__(self, curves: Sequence[HazardCurve], weights: Sequence[float]) -> None:
        if isinstance(curves, HazardCurve | str | range) or not isinstance(curves, Sequence):
            raise TypeError(
                f"HazardLogicTree() needs a list of HazardCurves, such as [curve], got {type(curves).__name__}"
            )
        branches = tuple(curves)
        if not branches:
            raise ValueError("a logic tree needs at least one hazard curve: give HazardLogicTree([curve])")
        for each in branches:
            check_kind("HazardLogicTree", "HazardCurves", each, HazardCurve, argument="curves")
        values = _positive_points("weights", weights)
        if values.size != len(branches):
            raise ValueError(
                f"the logic tree has {amount_of(len(branches), 'curve')} and {amount_of(values.size, 'weight')}: give "
                "one weight per curve"
            )
        if abs(values.sum() - 1) > WEIGHT_TOLERANCE:
            raise ValueError(
                f"the weights of a logic tree must sum up to 1, got a sum of {values.sum():.9g}: give weights / "
                "sum(weights)"
            )
        first = branches[0]
        for each in branches[1:]:
            if each.units != first.units or same_measure(each.measure, first.measure) is False:
                raise ValueError(
                    f"all curves of a logic tree must have the same measure and unit, got {first.measure!r} in "
                    f"{first.units} and {each.measure!r} in {each.units}: convert or remove one of them"
                )
            warn_unless_compared("HazardLogicTree: two curves", each.measure, first.measure)
        values /= values.sum()
        values.setflags(write=False)
        object.__setattr__(self, "curves", branches)
        object.__setattr__(self, "weights", values)

    @property
    def measure(self) -> str:
        """Name of the intensity measure, which all branches share."""
        return self.curves[0].measure

    @property
    def units(self) -> str:
        """Units of the intensity measure, which all branches share."""
        return self.curves[0].units

    @property
    def is_unnamed(self) -> bool:
        """Whether the argument `measure` is missing in all branches."""
        return all(curve.is_unnamed for curve in self.curves)

    def rate_of(self, intensity: ArrayLike) -> np.ndarray:
        """Return the annual rates at which intensities are exceeded [1/year], as the weighted mean over the branches.

        Args:
            intensity: Intensity measure [units], above 0, of any shape.

        Raises:
            ValueError: If an intensity is not above 0.
        """
        return np.tensordot(self.weights, np.stack([curve.rate_of(intensity) for curve in self.curves]), 1)


Hazard = HazardCurve | HazardLogicTree


def branches_of(function: str, hazard: Hazard) -> HazardLogicTree:
    """Return a hazard as a logic tree; a single curve becomes a tree with one branch."""
    if isinstance(hazard, HazardCurve):
        return HazardLogicTree([hazard], [1.0])
    check_kind(function, "a HazardCurve or a HazardLogicTree as hazard", hazard, HazardLogicTree)
    return hazard


def _positive_points(what: str, values: ArrayLike, units: str | None = None) -> np.ndarray:
    """Return values as an array [point]; raise a ValueError that names the first one that is not finite and above 0."""
    array = finite_numbers(what, values, units)
    if array.ndim != 1 or not array.size:
        raise ValueError(f"{what} must be a row of numbers, got an array of shape {array.shape}")
    for i in np.flatnonzero(array <= 0):
        raise ValueError(f"{what}[{i}] is {array[i]:g}; it must be above 0 (remove points with a rate of 0)")
    return array
