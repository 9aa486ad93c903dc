"""Base class of intensity measures: name, units, levels, and OpenQuake's name and unit."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from warpdyn.foundations.core.output_variables import DAMPING, MEASURE, PERIOD, PERIODS
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.motions import GroundMotion

ACCELERATION = "m s-2"
SAME = 0.01  # two periods or damping ratios are equal up to printed digits if their relative difference is at most this
# Kind of measure -> its unit in OpenQuake (openquake.hazardlib.imt), and the size of this unit in SI units.
OPENQUAKE_UNITS = {
    **dict.fromkeys(("PGA", "SA", "AvgSA"), ("g", STANDARD_GRAVITY)),
    "PGV": ("cm s-1", 0.01),
    "PGD": ("cm", 0.01),
    "IA": ("m s-1", 1.0),
    "CAV": ("g s", STANDARD_GRAVITY),
    **dict.fromkeys(("RSD595", "RSD575", "RSD2080"), ("s", 1.0)),
}


class IntensityMeasure(ABC):
    """Base class of intensity measures: one number that describes the strength of a ground motion.

    A subclass defines `units`, `name` and `value`. `measure_named` returns the measure with a given name.

    Attributes:
        units: SI units of the values, a UDUNITS string.
        power: If a motion is multiplied by c, the measure is multiplied by c^power; 0 for a duration.
    """

    units: ClassVar[str]
    power: ClassVar[int] = 1

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the intensity measure in results and figures."""

    @property
    def kind(self) -> str:
        """OpenQuake's name of the measure without period, such as "PGA" or "SA"; "" if OpenQuake does not have it."""
        return ""

    @property
    def components(self) -> str:
        """How two components are combined, such as "geometric mean" or "RotD50"; "" for a single component."""
        return ""

    @property
    def parameters(self) -> tuple[float, ...]:
        """Damping ratio [%] followed by periods [s], if the measure has them; otherwise ()."""
        return ()

    @abstractmethod
    def value(self, motion: GroundMotion) -> float:
        """Return the value of the intensity measure for a ground motion [units]."""

    def values(self, motions: Sequence[GroundMotion]) -> np.ndarray:
        """Return the value of the intensity measure for each ground motion [units], shape [motion]."""
        return np.array([self.value(motion) for motion in motions])

    @property
    def level_units(self) -> str:
        """Units of levels and of intensities in datasets: "g" for an acceleration, otherwise `units`."""
        return "g" if self.units == ACCELERATION else self.units

    def level_values(self, motions: Sequence[GroundMotion]) -> np.ndarray:
        """Return the value of the intensity measure for each motion [level_units], shape [motion]."""
        return self.values(motions) / self.unit_size(self.level_units)

    def scale_factors(self, levels: np.ndarray, intensities: np.ndarray) -> np.ndarray:
        """Return the factors that scale motions from `intensities` to `levels`; both have the same units."""
        return (levels / intensities) ** (1 / self.power)

    def scaled_levels(self, factors: np.ndarray, intensities: np.ndarray) -> np.ndarray:
        """Return the intensities after motions with `intensities` are multiplied by `factors`."""
        return factors**self.power * intensities

    def unit_size(self, units: object) -> float:
        """Return the factor from a unit of intensities, `units` or `level_units`, to SI units.

        Raises:
            ValueError: If the unit is neither `units` nor `level_units`.
        """
        if units == self.units:
            return 1.0
        if units == self.level_units:
            return STANDARD_GRAVITY
        allowed = " or ".join(map(repr, dict.fromkeys((self.level_units, self.units))))
        raise ValueError(f"{self.name} must be in {allowed}, got {units!r}: convert the values, and correct the unit")

    def from_openquake(self) -> tuple[str, float]:
        """Return `level_units` and the factor from OpenQuake's unit to them; the measure must have a `kind`."""
        return self.level_units, OPENQUAKE_UNITS[self.kind][1] / self.unit_size(self.level_units)

    def is_like(self, other: IntensityMeasure) -> bool:
        """Return whether two measures are equal, except for the combination of components.

        The combination is not compared, because names in hazard files do not contain it. Periods are compared only if
        both measures have them.
        """
        pairs = zip(self.parameters, other.parameters, strict=False)
        is_of_one_kind = (self.kind or self.name) == (other.kind or other.name)
        return is_of_one_kind and all(abs(a - b) <= SAME * max(a, b) for a, b in pairs)

    def attributes(self) -> dict[str, object]:
        """Return the attributes that describe the measure in a dataset: name, and period and damping if it has them."""
        known = {PERIOD: "period", PERIODS: "periods", DAMPING: "damping_ratio"}
        found = {key: getattr(self, name) for key, name in known.items() if hasattr(self, name)}
        return {MEASURE: self.name} | {key: np.asarray(value, dtype=float)[()] for key, value in found.items()}
