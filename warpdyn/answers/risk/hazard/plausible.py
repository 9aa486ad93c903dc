"""Plausibility of hazard curves: is the rate higher than at any site, or nearly constant and near 1 per year?

The highest hazard is a generous bound: a PGA of 0.1 g once in 5 years, and 1.45 g in 475 years (the global map of GEM
from 2018, Pagani and others 2020, Earthquake Spectra 36(1 suppl.), has PGA up to about 1.5 g for 475 years). The bound
is the power law through these two points. Other measures are converted to the corresponding PGA.
"""

from __future__ import annotations

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.plausibility.check import HIGHEST_HAZARD_SLOPE
from warpdyn.model.ground_motions.measures.names import measure_named

HIGHEST_RATE, AT_INTENSITY = 0.2, 0.1  # rate [1/year] at a PGA [g]
# Spectral acceleration divided by PGA on the plateau of design spectra, and the period at the end of the plateau, for
# soft ground.
PLATEAU, END_OF_PLATEAU = 2.5, 0.7
# Measures that are not accelerations, by OpenQuake's name: name in the plausibility bands, unit, value at a PGA of 0.1
# g, power of the PGA, and largest plausible first and last intensity of a curve. The value at 0.1 g is 2.5 times (the
# plateau of spectral accelerations) the median ratio to the PGA in the 100 records of the far-field and near-field sets
# of FEMA P-695: 1.09 m/s, 0.43 m and 28.7 m/s per g, and 12.0 m/s of Arias intensity per g2.
OTHERS = {
    "PGV": ("velocity", "m s-1", 0.27, 1.0, 1.0, 10.0),
    "PGD": ("displacement", "m", 0.11, 1.0, 1.0, 20.0),
    "CAV": ("absolute_velocity", "m s-1", 7.2, 1.0, 30.0, 200.0),
    "IA": ("arias", "m s-1", 0.30, 2.0, 5.0, 200.0),
}
NEAR_ONE = 0.9  # rate [1/year] above which values may be probabilities in many years instead of rates
LEVEL = 0.25  # a curve is nearly constant if its slope -d ln(rate) / d ln(intensity) is below this


def warn_of_implausible_hazard(intensity: np.ndarray, rate: np.ndarray, measure: str, units: str) -> None:
    """Warn if a hazard curve is probably in another unit, or contains probabilities or percent instead of rates.

    Args:
        intensity: Intensities [units], shape [point].
        rate: Annual rates of exceedance [1/year], shape [point].
        measure: Name of the intensity measure; an unknown measure is compared with spectral accelerations.
        units: Units of the intensity. Only accelerations in g, and other measures in SI units, are compared with the
            highest hazard.
    """
    findings = PlausibilityFindings()
    findings.add("annual_rate", rate)
    # Probabilities of exceedance in many years approach 1 at low intensities; rates do not.
    slope = -np.log(rate[1] / rate[0]) / np.log(intensity[1] / intensity[0])
    if rate.size > 2 and NEAR_ONE < rate[0] <= 1.0 and (rate[1] > NEAR_ONE or slope < LEVEL):
        findings.add("annual_rate_near_one", rate[0])
    found = measure_named(measure)
    other = OTHERS.get(found.kind) if found else None
    of_kind = ""
    if other is not None and units == other[1]:
        of_kind = f"{other[0]}_"
        name, first, last = f"hazard_{other[0]}", *other[4:]
        has_warning = findings.add(name, intensity[0], " at its first point", high=first)
        has_warning = has_warning or findings.add(name, intensity[-1], " at its last point", high=last)
    else:
        has_warning = units != "g" or findings.add("hazard_intensity", intensity[0])
    if not has_warning:
        # Rates above 1 per year are covered by another warning.
        over = np.where(rate <= 1, rate, 0.0) / highest_rate(intensity, measure)
        worst = int(np.argmax(over))
        where = f" ({rate[worst]:.3g} per year at {intensity[worst]:.3g} {units})"
        findings.add(f"hazard_{of_kind}over_highest", over[worst], where)
    findings.warn()


def highest_rate(intensity: np.ndarray, measure: str) -> np.ndarray:
    """Return the annual rate [1/year] at which an intensity is exceeded at the site with the highest plausible hazard.

    Args:
        intensity: Intensities [g, or SI units of a measure that is not an acceleration], of any shape.
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
