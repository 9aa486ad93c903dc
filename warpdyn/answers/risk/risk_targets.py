"""Risk targets of ASCE 7: the risk-targeted intensity of a site, and whether a building meets the target."""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy.optimize import brentq
from scipy.special import ndtri

from warpdyn.answers.risk.annual_rates import warn_of_extrapolation
from warpdyn.answers.risk.curves import Curves, curves_of, place_of_state
from warpdyn.answers.risk.hazard_curves import Hazard, HazardLogicTree, branches_of
from warpdyn.answers.risk.integrals.lognormal import LognormalShape, rates_by_bin, rates_by_segment
from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.units import STANDARD_GRAVITY

SOURCE = (
    "Luco and others (2007), SEAOC Convention: risk-targeted versus current seismic design maps; ASCE 7-22, 21.2.1.2"
)
UNIFORM_HAZARD = 0.02  # probability in 50 years that the risk coefficient of ASCE 7 refers to
# Units that intensities are often given in, by the one that they are taken in, with the factor to it.
OFTEN_GIVEN = {
    "g": {"m/s2": 1 / STANDARD_GRAVITY, "% g": 0.01, "cm/s2": 0.01 / STANDARD_GRAVITY},
    "m s-1": {"cm/s": 0.01, "mm/s": 0.001},
    "m": {"cm": 0.01, "mm": 0.001},
}
SEARCHED = 12.0  # in ln of the median, each way from the hazard's intensities: far beyond any capacity


@suggests_names
def risk_targeted_intensity(
    hazard: Hazard,
    dispersion: float = 0.6,
    *,
    probability_of_collapse: float = 0.01,
    years: float = 50.0,
    conditional_probability: float = 0.1,
) -> xr.Dataset:
    """Return the design intensity whose buildings collapse with a target probability in a period (MCER of ASCE 7).

    A building designed for the intensity is taken to collapse under it with `conditional_probability`, by a lognormal
    fragility curve of this dispersion; the intensity is the one at which the curve and the hazard meet the target.
    Direction factors, deterministic caps and site factors of the standard are not applied.

    Source: Luco, Ellingwood, Hamburger, Hooper, Kimball and Kircher (2007), "Risk-targeted versus current seismic
    design maps for the conterminous United States"; ASCE 7-22, section 21.2.1.2, whose values are the defaults.

    Args:
        hazard: The hazard; of a logic tree the mean over its branches is taken, as in the maps.
        dispersion: Dispersion of the collapse capacity [1]; ASCE 7 has 0.6, its maps of 2009 had 0.8.
        probability_of_collapse: Target probability of collapse in the period [1].
        years: The period [year].
        conditional_probability: Probability of collapse under the design intensity [1].

    Returns:
        `risk_targeted_intensity`, `uniform_hazard_intensity` (2 % in 50 years) and `collapse_median` [units of the
        hazard]; `risk_coefficient`, the ratio of the first two [1].

    Raises:
        TypeError: If `hazard` is no hazard.
        ValueError: If a probability is not between 0 and 1, or no intensity meets the target.

    Example:
        >>> target = wd.risk_targeted_intensity(hazard)
        >>> float(target["risk_targeted_intensity"].round(2)), float(target["risk_coefficient"].round(2))
        (0.48, 0.92)
    """
    tree = branches_of("risk_targeted_intensity", hazard)
    dispersion = real_number("dispersion", dispersion, above=0)
    findings = PlausibilityFindings()
    findings.add("dispersion", dispersion)
    findings.warn()
    years = real_number("years", years, above=0)
    target = -np.log1p(-_share("probability_of_collapse", probability_of_collapse)) / years
    score = ndtri(_share("conditional_probability", conditional_probability))

    def excess(log_median: float) -> float:
        return float(np.log(_mean_rate(tree, np.exp(log_median), dispersion) / target))

    low = np.log(min(each.intensity[0] for each in tree.curves)) - SEARCHED
    high = np.log(max(each.intensity[-1] for each in tree.curves)) + SEARCHED
    if excess(low) < 0 or excess(high) > 0:
        raise ValueError(
            f"no building of dispersion {dispersion:g} has an annual rate of collapse of {target:.3g} under this "
            f"hazard, as probability_of_collapse={probability_of_collapse:g} in years={years:g} asks for"
        )
    median = float(np.exp(brentq(excess, low, high, xtol=1e-14, rtol=1e-14)))
    _warn_of_extrapolation(tree, median, dispersion, "the risk-targeted intensity")
    intensity = median * np.exp(score * dispersion)
    uniform = _intensity_of_mean_rate(tree, -np.log1p(-UNIFORM_HAZARD) / 50.0)
    length = {"units": tree.units}
    return xr.Dataset(
        {
            "risk_targeted_intensity": ((), intensity, length | {"long_name": "risk-targeted design intensity"}),
            "uniform_hazard_intensity": (
                (),
                uniform,
                length | {"long_name": "intensity that is exceeded with 2 % in 50 years"},
            ),
            "collapse_median": ((), median, length | {"long_name": "median collapse capacity that meets the target"}),
            "risk_coefficient": (
                (),
                intensity / uniform,
                {"units": "1", "long_name": "risk-targeted over uniform-hazard intensity"},
            ),
        },
        attrs={
            "intensity_measure": tree.measure,
            "dispersion": dispersion,
            "probability_of_collapse": float(probability_of_collapse),
            "years": years,
            "conditional_probability": float(conditional_probability),
            "source": SOURCE,
        },
    )


@suggests_names
def check_risk_target(
    curves: xr.Dataset,
    hazard: Hazard,
    design_intensity: float | None = None,
    *,
    damage_state: str | None = None,
    probability_of_collapse: float = 0.01,
    years: float = 50.0,
    conditional_probability: float = 0.1,
) -> xr.Dataset:
    """Return whether a building meets the collapse targets of ASCE 7: in 50 years, and under the design intensity.

    Args:
        curves: As of `annual_rates`, with collapse or a state that stands for it.
        hazard: The hazard of the curves' intensity measure; the mean over the branches of a logic tree is taken.
        design_intensity: The intensity (MCER) at which the conditional probability is checked [units of the curves];
            by default, of lognormal curves, that of `risk_targeted_intensity` with the dispersion of the curve.
        damage_state: The state that counts as collapse; the last by default.
        probability_of_collapse: Allowed probability in the period [1].
        years: The period [year].
        conditional_probability: Allowed probability under the design intensity [1]: 0.1 of risk categories I and II of
            ASCE 7, 0.05 of III and 0.025 of IV (ASCE 7-16, table 1.3-2).

    Returns:
        `probability_of_collapse` in the period and `conditional_probability` under the design intensity [1],
        `design_intensity` [units], `meets_risk_target` and `meets_conditional_target`.

    Raises:
        TypeError, ValueError: As of `annual_rates` and `risk_targeted_intensity`.

    Example:
        >>> found = wd.check_risk_target(curves, hazard, design_intensity=1.0)
        >>> bool(found["meets_risk_target"]), bool(found["meets_conditional_target"])
        (True, False)
    """
    function = "check_risk_target"
    tree = branches_of(function, hazard)
    found: Curves = curves_of(function, curves, tree)
    place = place_of_state(function, found, damage_state)
    allowed = _share("probability_of_collapse", probability_of_collapse)
    conditional = _share("conditional_probability", conditional_probability)
    years = real_number("years", years, above=0)
    if design_intensity is None:
        if not isinstance(found.shape, LognormalShape):
            raise ValueError(
                f"{function}: without design_intensity that of a lognormal curve is taken, and these curves are of "
                f"another shape: give design_intensity [{found.units}]"
            )
        targeted = risk_targeted_intensity(
            tree,
            float(found.dispersion[place]),
            probability_of_collapse=allowed,
            years=years,
            conditional_probability=conditional,
        )
        design_intensity = float(targeted["risk_targeted_intensity"])
    design_intensity = real_number("design_intensity", design_intensity, above=0)
    _warn_of_far_intensity(function, design_intensity, tree)
    rate, shares = float(tree.weights @ found.rates(tree)[:, place]), found.shares_beyond(tree)[:, [place]]
    warn_of_extrapolation(("the rate",), shares, tree.curves, f"the annual rate of {found.names[place]!r}")
    in_period = -np.expm1(-years * rate)
    under_design = float(found.probability(np.array([design_intensity]))[place, 0])
    unit = {"units": "1"}
    return xr.Dataset(
        {
            "probability_of_collapse": ((), in_period, unit | {"long_name": f"probability in {years:g} years"}),
            "conditional_probability": (
                (),
                under_design,
                unit | {"long_name": "probability under the design intensity"},
            ),
            "design_intensity": ((), design_intensity, {"units": found.units, "long_name": "design intensity"}),
            "meets_risk_target": ((), bool(in_period <= allowed), {"long_name": f"at most {allowed:g} in the period"}),
            "meets_conditional_target": (
                (),
                bool(under_design <= conditional),
                {"long_name": f"at most {conditional:g} under the design intensity"},
            ),
        },
        attrs={"intensity_measure": tree.measure or found.measure, "damage_state": found.names[place], "years": years},
    )


def _warn_of_far_intensity(function: str, intensity: float, tree: HazardLogicTree) -> None:
    """Warn of a design intensity beyond all points of the hazard, which is most often in another unit."""
    first, last = min(c.intensity[0] for c in tree.curves), max(c.intensity[-1] for c in tree.curves)
    if first <= intensity <= last:
        return
    factors = OFTEN_GIVEN.get(tree.units, {})
    meant = [
        f"{intensity:g} {u} would be {f * intensity:.3g}" for u, f in factors.items() if first <= f * intensity <= last
    ]
    hint = f"; {', '.join(meant)} {tree.units}" if meant else ""
    warn_caller(
        f"{function}: design_intensity is {intensity:g} {tree.units}, and the points of the hazard curve go from "
        f"{first:.3g} to {last:.3g} {tree.units}{hint}"
    )


def _mean_rate(tree: HazardLogicTree, median: float, dispersion: float) -> float:
    theta, beta = np.array(median), np.array(dispersion)
    each = [rates_by_segment(curve, theta, beta).sum() for curve in tree.curves]
    return float(tree.weights @ np.array(each))


def _intensity_of_mean_rate(tree: HazardLogicTree, rate: float) -> float:
    """Return the intensity that is exceeded at a mean rate over the branches."""
    if len(tree.curves) == 1:
        return float(tree.curves[0].intensity_of(rate))
    low = np.log(min(each.intensity[0] for each in tree.curves)) - SEARCHED
    high = np.log(max(each.intensity[-1] for each in tree.curves)) + SEARCHED
    return float(np.exp(brentq(lambda u: float(np.log(tree.rate_of(np.exp(u)) / rate)), low, high, xtol=1e-14)))


def _warn_of_extrapolation(tree: HazardLogicTree, median: float, dispersion: float, what: str) -> None:
    theta, beta = np.array([median]), np.array([dispersion])
    outside = np.zeros((2, 1))
    for weight, each in zip(tree.weights, tree.curves, strict=True):
        outside += weight * np.stack(rates_by_bin(each, each.intensity[[0, -1]], theta, beta)[1:])
    warn_of_extrapolation(("the rate",), outside / _mean_rate(tree, median, dispersion), tree.curves, what)


def _share(what: str, value: float) -> float:
    number = real_number(what, value, above=0)
    if number >= 1:
        raise ValueError(f"{what} must be below 1, got {value!r}; 1 % is 0.01")
    return number
