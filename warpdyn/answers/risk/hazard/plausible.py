"""What hazard curves are seldom: above the highest hazard of any site, or level near a rate of 1 a year.

The highest hazard is a bound with room to spare, not a map: a PGA of 0.1 g once in 5 years, and one of 1.45 g
in 475 years, where GEM's global map of 2018 (Pagani and others 2020, Earthquake Spectra 36(1 suppl.)) colours
PGA of that return period up to some 1.5 g. Between and beyond them it is a power law. Other measures have the rate of
the PGA that goes with them.
"""

from __future__ import annotations

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.plausibility.table import HIGHEST_HAZARD_SLOPE
from warpdyn.model.ground_motions.measures.names import measure_named

HIGHEST_RATE, AT_INTENSITY = 0.2, 0.1  # a year at a PGA [g]
# Spectral over peak ground acceleration: the plateau of design spectra, and the period at which it ends [s], which is
# late enough for soft ground.
PLATEAU, END_OF_PLATEAU = 2.5, 0.7
# Of measures that are no accelerations, by OpenQuake's name: the bands' name, the unit, the measure at a PGA of 0.1 g,
# the power of the PGA that it goes by, and the largest intensities that a curve begins and ends with. The measure at
# 0.1 g is 2.5 times (as of spectral accelerations) what the median ratio to the PGA of the 100 records of the far-field
# and near-field sets of FEMA P-695 gives: 1.09 m/s, 0.43 m and 28.7 m/s a g, and 12.0 m/s of Arias intensity a g2.
OTHERS = {
    "PGV": ("velocity", "m s-1", 0.27, 1.0, 1.0, 10.0),
    "PGD": ("displacement", "m", 0.11, 1.0, 1.0, 20.0),
    "CAV": ("absolute_velocity", "m s-1", 7.2, 1.0, 30.0, 200.0),
    "IA": ("arias", "m s-1", 0.30, 2.0, 5.0, 200.0),
}
NEAR_ONE = 0.9  # a year
LEVEL = 0.25  # slope in logarithms; near a probability of 1 the curve of probabilities is level


def warn_of_implausible_hazard(intensity: np.ndarray, rate: np.ndarray, measure: str, units: str) -> None:
    """Warn of a hazard curve that is most likely of another unit, of probabilities or of percent.

    Args:
        intensity: Intensities [units], shape [point].
        rate: Annual rates of exceedance [1/year], shape [point].
        measure: Name of the intensity measure; of one that is not understood the bound of spectral accelerations holds.
        units: Units of the intensity; accelerations in g and other measures in SI units are compared with the highest
            hazard.
    """
    findings = PlausibilityFindings()
    findings.add("annual_rate", rate)
    # Probabilities in many years come close to 1, where rates of a site do not level off.
    slope = -np.log(rate[1] / rate[0]) / np.log(intensity[1] / intensity[0])
    if rate.size > 2 and NEAR_ONE < rate[0] <= 1.0 and (rate[1] > NEAR_ONE or slope < LEVEL):
        findings.add("annual_rate_near_one", rate[0])
    found = measure_named(measure)
    other = OTHERS.get(found.kind) if found else None
    of_kind = ""
    if other is not None and units == other[1]:
        of_kind = f"{other[0]}_"
        name, first, last = f"hazard_{other[0]}", *other[4:]
        is_told = findings.add(name, intensity[0], " at its first point", high=first)
        is_told = is_told or findings.add(name, intensity[-1], " at its last point", high=last)
    else:
        is_told = units != "g" or findings.add("hazard_intensity", intensity[0])
    if not is_told:
        # Rates above 1 a year are told as such.
        over = np.where(rate <= 1, rate, 0.0) / highest_rate(intensity, measure)
        worst = int(np.argmax(over))
        where = f" ({rate[worst]:.3g} a year at {intensity[worst]:.3g} {units})"
        findings.add(f"hazard_{of_kind}over_highest", over[worst], where)
    findings.warn()


def highest_rate(intensity: np.ndarray, measure: str) -> np.ndarray:
    """Return the annual rate that no site is known to pass at an intensity [1/year].

    Args:
        intensity: Intensities [g, or SI of a measure that is no acceleration], any shape.
        measure: Name of the intensity measure.
    """
    found = measure_named(measure)
    if found is not None and found.kind in OTHERS:
        _, _, there, power, _, _ = OTHERS[found.kind]
        return HIGHEST_RATE * (intensity / there) ** (-HIGHEST_HAZARD_SLOPE / power)
    if found is not None and found.kind == "PGA":
        amplification = 1.0
    else:
        period = found.parameters[1] if found is not None and found.kind == "SA" else 0.0
        amplification = PLATEAU * min(1.0, END_OF_PLATEAU / period if period > 0 else 1.0)
    return HIGHEST_RATE * (intensity / (amplification * AT_INTENSITY)) ** -HIGHEST_HAZARD_SLOPE
