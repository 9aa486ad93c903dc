"""What hazard curves are seldom: above the highest hazard of any site, or level near a rate of 1 a year.

The highest hazard is a bound with room to spare, not a map: a PGA of 0.1 g once in 5 years, and one of 1.45 g
in 475 years, where GEM's global map of 2018 (Pagani and others 2020, Earthquake Spectra 36(1 suppl.)) colours
PGA of that return period up to some 1.5 g. Between and beyond them it is a power law.
"""

from __future__ import annotations

import numpy as np

from warpdyn.core.plausibility import PlausibilityFindings
from warpdyn.core.plausible_bands import HIGHEST_HAZARD_SLOPE
from warpdyn.risk.hazard.measures import measure_named

HIGHEST_RATE, AT_INTENSITY = 0.2, 0.1  # a year at a PGA [g]
# Spectral over peak ground acceleration: the plateau of design spectra, and the period at which it ends [s], which is
# late enough for soft ground.
PLATEAU, END_OF_PLATEAU = 2.5, 0.7
NEAR_ONE = 0.9  # a year
LEVEL = 0.25  # slope in logarithms; near a probability of 1 the curve of probabilities is level


def warn_of_implausible_hazard(intensity: np.ndarray, rate: np.ndarray, measure: str, units: str) -> None:
    """Warn of a hazard curve that is most likely of another unit, of probabilities or of percent.

    Args:
        intensity: Intensities [units], shape [point].
        rate: Annual rates of exceedance [1/year], shape [point].
        measure: Name of the intensity measure; of one that is not understood the bound of spectral accelerations holds.
        units: Units of the intensity; only accelerations in g are compared with the highest hazard.
    """
    findings = PlausibilityFindings()
    findings.add("annual_rate", rate)
    # Probabilities in many years come close to 1, where rates of a site do not level off.
    slope = -np.log(rate[1] / rate[0]) / np.log(intensity[1] / intensity[0])
    if rate.size > 2 and NEAR_ONE < rate[0] <= 1.0 and (rate[1] > NEAR_ONE or slope < LEVEL):
        findings.add("annual_rate_near_one", rate[0])
    if units == "g" and not findings.add("hazard_intensity", intensity[0]):
        # Rates above 1 a year are told as such.
        over = np.where(rate <= 1, rate, 0.0) / highest_rate(intensity, measure)
        worst = int(np.argmax(over))
        findings.add("hazard_over_highest", over[worst], f" ({rate[worst]:.3g} a year at {intensity[worst]:.3g} g)")
    findings.warn()


def highest_rate(intensity: np.ndarray, measure: str) -> np.ndarray:
    """Return the annual rate that no site is known to pass at an intensity [1/year].

    Args:
        intensity: Intensities [g], any shape.
        measure: Name of the intensity measure.
    """
    found = measure_named(measure)
    if found is not None and found.kind == "PGA":
        amplification = 1.0
    else:
        period = found.period if found is not None else 0.0
        amplification = PLATEAU * min(1.0, END_OF_PLATEAU / period if period > 0 else 1.0)
    return HIGHEST_RATE * (intensity / (amplification * AT_INTENSITY)) ** -HIGHEST_HAZARD_SLOPE
