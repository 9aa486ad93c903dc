"""Published models of the spatial correlation of within-event residuals, with an exponential function of distance."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, one_of, real_number, true_or_false
from warpdyn.foundations.core.near_misses import with_suggestions


class SpatialCorrelation(ABC):
    """Base class of models: correlation of the within-event residuals of ln(intensity) as a function of distance.

    Example:
        >>> model = wd.sites.JayaramBaker2009(1.0)  # a SpatialCorrelation
        >>> model.correlation([0.0, 10e3, 50e3]).round(3)  # at distances in m
        array([1.   , 0.311, 0.003])
    """

    @property
    @abstractmethod
    def correlation_range(self) -> float:
        """Range of the model [m]: the distance at which the correlation is exp(-3) = 0.05."""

    def correlation(self, distance: ArrayLike) -> np.ndarray:
        """Return the correlation [1] of residuals at places with distance h: exp(-3 h / b), where b is the range.

        Args:
            distance: Distances between two places [m], any shape.

        Raises:
            ValueError: If a distance is not a finite number.
        """
        return np.exp(-3 * finite_numbers("distance [m]", distance) / self.correlation_range)


@with_suggestions
@dataclass(frozen=True)
class JayaramBaker2009(SpatialCorrelation):
    """The model of Jayaram and Baker (2009) for spectral accelerations: exp(-3 h / b).

    The range b [km] at periods T below 1 s is 8.5 + 17.2 T if Vs30 is not clustered (case 1), and 40.7 - 15.0 T if
    Vs30 is clustered, i.e. neighbouring sites have similar soils (case 2). From 1 s it is 22.0 + 3.7 T in both cases.

    Jayaram, Baker (2009), Correlation model for spatially distributed ground-motion intensities, Earthquake Engineering
    and Structural Dynamics 38(15), 1687-1708: their predictive model.

    Args:
        period: Period T of the spectral acceleration [s], 0 to 10; 0 for the peak ground acceleration.
        is_clustered: Whether Vs30 is clustered.

    Raises:
        ValueError: If the period is outside its range.
        TypeError: If `is_clustered` is not True or False.

    Example:
        >>> wd.sites.JayaramBaker2009(1.0).correlation_range
        25700.0
    """

    period: float
    is_clustered: bool = False

    def __post_init__(self) -> None:
        _check_period(self.period, 0.0, 10.0)
        true_or_false("is_clustered", self.is_clustered)

    @property
    def correlation_range(self) -> float:
        """Range b of the model [m]: the distance at which the correlation is exp(-3) = 0.05."""
        if self.period >= 1:
            return round(1000 * (22.0 + 3.7 * self.period), 6)
        return round(1000 * (40.7 - 15.0 * self.period if self.is_clustered else 8.5 + 17.2 * self.period), 6)


@with_suggestions
@dataclass(frozen=True)
class EspositoIervolino2012(SpatialCorrelation):
    """The model of Esposito and Iervolino for European earthquakes: exp(-3 h / b).

    The range b [km] of spectral accelerations at the period T is 11.7 + 12.7 T from the European Strong-motion Database
    and 8.6 + 11.6 T from the Italian database. For the peak ground acceleration it is 13.5 (Europe) and 11.5 (Italy).

    Esposito, Iervolino (2012), Spatial correlation of spectral acceleration in European data, Bulletin of the
    Seismological Society of America 102(6), 2781-2788; and (2011), PGA and PGV spatial correlation models based on
    European multievent datasets, 101(5), 2532-2541.

    Args:
        period: Period T of the spectral acceleration [s], 0.1 to 2; 0 for the peak ground acceleration.
        region: "Europe" or "Italy".

    Raises:
        ValueError: If the period is outside its range, or the region is unknown.

    Example:
        >>> wd.sites.EspositoIervolino2012(1.0, "Italy").correlation_range
        20200.0
    """

    period: float
    region: str = "Europe"

    def __post_init__(self) -> None:
        one_of("region", self.region, ("Europe", "Italy"))
        if real_number("period [s]", self.period, least=0) != 0:
            _check_period(self.period, 0.1, 2.0)

    @property
    def correlation_range(self) -> float:
        """Range b of the model [m]: the distance at which the correlation is exp(-3) = 0.05."""
        is_italian = self.region == "Italy"
        if self.period == 0:
            return 11_500.0 if is_italian else 13_500.0
        return round(1000 * (8.6 + 11.6 * self.period if is_italian else 11.7 + 12.7 * self.period), 6)


def _check_period(period: float, least: float, most: float) -> None:
    if not least <= real_number("period", period, least=0) <= most:
        raise ValueError(
            f"period is {period:g} s, but the model is for {least:g} to {most:g} s: choose a period in this range, or "
            "another model"
        )
