"""Risk targets of ASCE 7: the risk-targeted intensity of a site, and whether a building meets the target."""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy.optimize import brentq
from scipy.special import ndtri

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.risk.curves.curve_set import CurveSet
from warpdyn.answers.risk.curves.curve_warnings import warn_of_extrapolation
from warpdyn.answers.risk.hazard_curves import Hazard, HazardLogicTree, branches_of
from warpdyn.answers.risk.integrals.lognormal import LognormalShape, rates_by_segment
from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.units import STANDARD_GRAVITY

SOURCE = (
    "Luco and others (2007), SEAOC Convention: risk-targeted versus current seismic design maps; ASCE 7-22, 21.2.1.2"
)
UNIFORM_HAZARD = 0.02  # probability of exceedance in 50 years that defines ASCE 7's uniform-hazard intensity
# Units in which users often give intensities by mistake, by the expected unit, with the factor to the expected unit.
OFTEN_GIVEN = {
    "g": {"m/s2": 1 / STANDARD_GRAVITY, "% g": 0.01, "cm/s2": 0.01 / STANDARD_GRAVITY},
    "m s-1": {"cm/s": 0.01, "mm/s": 0.001},
    "m": {"cm": 0.01, "mm": 0.001},
}
SEARCHED = 12.0  # the search in ln(median) extends this far below and above the intensities of the hazard


@suggests_names
def risk_targeted_intensity(
    hazard: Hazard,
    dispersion: float = 0.6,
    *,
    probability_of_collapse: float = 0.01,
    years: float = 50.0,
    conditional_probability: float = 0.1,
) -> xr.Dataset:
    """Return the risk-targeted design intensity of ASCE 7 (MCER): buildings designed for it meet a risk target.

    The target is the probability of collapse in a period of years. A building that is designed for the intensity is
    assumed to have a lognormal collapse fragility curve with the given dispersion, and with the probability
    `conditional_probability` of collapse at this intensity. Direction factors, deterministic caps and site factors of
    the standard are not applied.

    Source: Luco, Ellingwood, Hamburger, Hooper, Kimball and Kircher (2007), "Risk-targeted versus current seismic
    design maps for the conterminous United States"; ASCE 7-22, section 21.2.1.2, whose values are the defaults.

    Args:
        hazard: The hazard; for a logic tree, its mean over the branches is used, as in the maps of ASCE 7.
        dispersion: Dispersion of the collapse capacity [1]; 0.6 in ASCE 7 (0.8 for its maps of 2009).
        probability_of_collapse: Target probability of collapse in the period [1].
        years: The period [year].
        conditional_probability: Probability of collapse at the design intensity [1].

    Returns:
        `risk_targeted_intensity`, `uniform_hazard_intensity` (exceeded with 2 % in 50 years) and `collapse_median`
        [units of the hazard]; `risk_coefficient`, the risk-targeted intensity divided by the uniform-hazard one [1].

    Raises:
        TypeError: If `hazard` is not a HazardCurve or HazardLogicTree.
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
            f"hazard, as probability_of_collapse={probability_of_collapse:g} and years={years:g} require: check their "
            "values, and the rates of the hazard curve"
        )
    median = float(np.exp(brentq(excess, low, high, xtol=1e-14, rtol=1e-14)))
    found = CurveSet(("collapse",), LognormalShape(), np.array([median]), np.array([dispersion]))
    warn_of_extrapolation(("the rate",), found.shares_beyond(tree), tree.curves, "the risk-targeted intensity")
    intensity = median * np.exp(score * dispersion)
    uniform = _intensity_of_mean_rate(tree, -np.log1p(-UNIFORM_HAZARD) / 50.0)
    units, ratio = tree.units, intensity / uniform
    return xr.Dataset(
        {
            "risk_targeted_intensity": variable((), intensity, "risk-targeted design intensity", units=units),
            "uniform_hazard_intensity": variable((), uniform, "intensity exceeded with 2 % in 50 years", units=units),
            "collapse_median": variable((), median, "median collapse capacity that meets the target", units=units),
            "risk_coefficient": variable((), ratio, "risk-targeted over uniform-hazard intensity"),
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
    """Return whether a building meets the two collapse targets of ASCE 7: in a period, and at the design intensity.

    Args:
        curves: Fragility curves, as in `annual_rates`; one damage state must be collapse or represent it.
        hazard: The hazard, of the same intensity measure as the curves; for a logic tree, the mean over its branches.
        design_intensity: The intensity (MCER) at which the conditional probability is checked [units of the curves].
            None (only for lognormal curves): the result of `risk_targeted_intensity` for the dispersion of the curve.
        damage_state: Name of the damage state that counts as collapse; None: the heaviest.
        probability_of_collapse: Allowed probability of collapse in the period [1].
        years: The period [year].
        conditional_probability: Allowed probability of collapse at the design intensity [1]: 0.1 for risk categories I
            and II of ASCE 7, 0.05 for III and 0.025 for IV (ASCE 7-16, table 1.3-2).

    Returns:
        `probability_of_collapse` in the period and `conditional_probability` of collapse at the design intensity [1],
        `design_intensity` [units of the curves], `meets_risk_target` and `meets_conditional_target` (True or False).

    Raises:
        TypeError, ValueError: As in `annual_rates` and `risk_targeted_intensity`.

    Example:
        >>> found = wd.check_risk_target(curves, hazard, design_intensity=1.0)
        >>> bool(found["meets_risk_target"]), bool(found["meets_conditional_target"])
        (True, False)
    """
    function = "check_risk_target"
    tree = branches_of(function, hazard)
    found = CurveSet.from_dataset(function, curves, tree)
    place = found.place_of(function, damage_state)
    allowed = _share("probability_of_collapse", probability_of_collapse)
    conditional = _share("conditional_probability", conditional_probability)
    years = real_number("years", years, above=0)
    if design_intensity is None:
        if not isinstance(found.limited, LognormalShape):
            raise ValueError(
                f"{function}: design_intensity has a default only for lognormal curves, and these curves have "
                f"another shape: give design_intensity= [{found.units}]"
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
    in_years, of_design = f"probability in {years:g} years", "probability under the design intensity"
    return xr.Dataset(
        {
            "probability_of_collapse": variable((), in_period, in_years),
            "conditional_probability": variable((), under_design, of_design),
            "design_intensity": variable((), design_intensity, "design intensity", units=found.units),
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
    """Warn if a design intensity is outside the range of the hazard points, which is often caused by a wrong unit."""
    first, last = min(c.intensity[0] for c in tree.curves), max(c.intensity[-1] for c in tree.curves)
    if first <= intensity <= last:
        return
    factors = OFTEN_GIVEN.get(tree.units, {})
    meant = [f"if it is in {u}, give {f * intensity:.3g}" for u, f in factors.items() if first <= f * intensity <= last]
    hint = (
        f": {', or '.join(meant)} [{tree.units}]"
        if meant
        else ": check its unit, or give a hazard curve that reaches it"
    )
    warn_caller(
        f"{function}: design_intensity is {intensity:g} {tree.units}, and the points of the hazard curve go from "
        f"{first:.3g} to {last:.3g} {tree.units}{hint}"
    )


def _mean_rate(tree: HazardLogicTree, median: float, dispersion: float) -> float:
    theta, beta = np.array(median), np.array(dispersion)
    each = [rates_by_segment(curve, theta, beta).sum() for curve in tree.curves]
    return float(tree.weights @ np.array(each))


def _intensity_of_mean_rate(tree: HazardLogicTree, rate: float) -> float:
    """Return the intensity whose annual rate of exceedance, as the mean over the branches, is `rate` [1/year]."""
    if len(tree.curves) == 1:
        return float(tree.curves[0].intensity_of(rate))
    low = np.log(min(each.intensity[0] for each in tree.curves)) - SEARCHED
    high = np.log(max(each.intensity[-1] for each in tree.curves)) + SEARCHED
    return float(np.exp(brentq(lambda u: float(np.log(tree.rate_of(np.exp(u)) / rate)), low, high, xtol=1e-14)))


def _share(what: str, value: float) -> float:
    number = real_number(what, value, above=0)
    if number >= 1:
        raise ValueError(f"{what} must be below 1, got {value!r}; 1 % is 0.01")
    return number
