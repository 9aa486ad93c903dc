"""Limits of the intensities of fragility curves, as in OpenQuake's NRML files: noDamageLimit, minIML and maxIML.

The OpenQuake engine clips intensities to minIML and maxIML, and sets the probability to 0 at or below noDamageLimit
(openquake.risklib.scientific, FragilityFunctionContinuous). For curves given as points, noDamageLimit is an additional
point with probability 0, if it is below the first point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from warpdyn.answers.risk.curves.shapes import Shape, Table
from warpdyn.answers.risk.hazard_curves import HazardLogicTree
from warpdyn.answers.risk.integrals.quadrature import NumericalShape
from warpdyn.foundations.core.checks import real_number

NO_DAMAGE, MINIMUM, MAXIMUM = "no_damage_limit", "minimum_intensity", "maximum_intensity"
REACH = 9.0  # number of dispersions from the median beyond which a lognormal curve is 0 or 1 to rounding
ABOVE = 1 + 1e-9  # factor from noDamageLimit to the next point, if a function jumps at the limit


@dataclass(frozen=True)
class IntensityLimits:
    """Limits of the intensities of one dataset of curves.

    Args:
        no_damage: Largest intensity without damage [units of the curves]; 0 if there is no such limit.
        minimum: Intensity below which curves are constant [units of the curves]; 0 if there is no such limit.
        maximum: Intensity above which curves are constant [units of the curves]; infinite if there is no such limit.
    """

    no_damage: float = 0.0
    minimum: float = 0.0
    maximum: float = np.inf

    @classmethod
    def of(cls, function: str, curves: xr.Dataset) -> IntensityLimits:
        """Return the limits that the attributes of a dataset contain (set by `read_nrml_fragility`), after a check."""
        given = {
            name: real_number(f"{function}: attribute {name!r} of the curves", curves.attrs[name], least=0)
            for name in (NO_DAMAGE, MINIMUM, MAXIMUM)
            if name in curves.attrs
        }
        found = cls(given.get(NO_DAMAGE, 0.0), given.get(MINIMUM, 0.0), given.get(MAXIMUM, np.inf))
        if not found.maximum > found.minimum:
            raise ValueError(
                f"{function}: the attribute {MAXIMUM!r} of the curves is {found.maximum:g}; it must be above the "
                f"attribute {MINIMUM!r}, {found.minimum:g}: correct curves.attrs"
            )
        return found

    @property
    def begin(self) -> float:
        """Intensity below which the probability is constant: 0 (no damage), or the probability at the minimum."""
        return max(self.no_damage, self.minimum)

    def __bool__(self) -> bool:
        return self != IntensityLimits()

    def clipped(self, intensity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return intensities limited to minimum and maximum, and whether each is above the limit of no damage."""
        found = np.clip(intensity, self.minimum, self.maximum)
        return found, found > self.no_damage

    def rate_below_minimum(self, hazard: HazardLogicTree) -> float:
        """Return the annual rate [1/year] of damaging intensities between the first hazard point and the minimum."""
        if self.minimum <= self.no_damage:
            return 0.0
        parts = [max(0.0, each.annual_rate[0] - float(each.rate_of(self.minimum))) for each in hazard.curves]
        return float(hazard.weights @ parts)

    def with_step(self, levels: np.ndarray) -> np.ndarray:
        """Return the intensities `levels`, with two points added at the jump at noDamageLimit if they enclose it."""
        if self.no_damage < self.minimum or not levels[0] <= self.no_damage < levels[-1]:
            return levels
        return np.union1d(levels, [self.no_damage, self.no_damage * ABOVE])


def limited_shape(shape: Shape, limits: IntensityLimits, median: np.ndarray, dispersion: np.ndarray) -> NumericalShape:
    """Return the shape of fragility curves after limits of the intensities are applied.

    Args:
        shape: Shape of the curves without limits.
        limits: The limits.
        median: Medians of the curves [units], shape [damage_state].
        dispersion: Dispersions of the curves [1], shape [damage_state].
    """

    def curve(intensity: np.ndarray, medians: np.ndarray, dispersions: np.ndarray) -> np.ndarray:
        clipped, is_damaged = limits.clipped(intensity)
        return np.where(is_damaged, shape.probability(clipped, medians[..., 0], dispersions[..., 0]), 0.0)

    reach, tail, width = REACH * np.array([[-1.0], [1.0]]) * np.ones(median.size), np.inf, 1.0
    if isinstance(shape, NumericalShape):
        reach, tail, width = shape.reach, shape.tail, min(shape.width, 1.0)
    ends = np.array([limits.begin, limits.maximum])
    kinks = np.array([each for each in {limits.no_damage, limits.minimum, limits.maximum} if 0 < each < np.inf])
    if limits.begin > 0:
        # A constant probability above 0 extends down to the first point of the hazard curve, as for tables.
        begin = np.log(limits.begin / median) / dispersion
        reach, tail = np.stack([begin, np.maximum(reach[1], begin)]), np.inf
    low, high = shape.usual(median, dispersion)
    drawn = np.log([np.clip(low, *ends), np.clip(high, *ends)] / median) / dispersion
    return NumericalShape(f"{shape.name} with limits", curve, reach, drawn, width=width, tail=tail, kinks=kinks)


def limited_table(table: Table, limits: IntensityLimits) -> Table:
    """Return a table of fragility curves after limits of intensities are applied; points are added at the limits."""
    name, levels, probable = table
    if 0 < limits.no_damage < levels[0]:
        levels = np.append(limits.no_damage, levels)
        probable = np.concatenate([np.zeros((len(probable), 1)), probable], axis=1)
    more = [each for each in (limits.no_damage, limits.minimum, limits.maximum) if levels[0] < each < levels[-1]]
    points = np.union1d(levels, more)
    points = points[points >= limits.no_damage]
    clipped = np.clip(points, limits.minimum, limits.maximum)
    return Table(name, points, np.stack([np.interp(clipped, levels, row) for row in probable]))
