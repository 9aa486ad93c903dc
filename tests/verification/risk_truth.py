"""Independent fragility fits, collapse margins and risk integrals: closed forms and SciPy; no warpdyn here."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq, minimize
from scipy.stats import beta as beta_distribution, lognorm, norm

from .hazard_curves import CURVES
from .problem import Outcome

BAKER_LEVELS = np.array([0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9, 1.0])
BAKER_EXCEEDING, BAKER_TOTAL = np.array([0, 0, 0, 4, 6, 13, 12, 16]), 40
SINGLE = [(0.5, 1), (0.45, 0), (0.3, 0), (0.3, 1), (0.15, 0), (0.25, 0), (0.9, 1), (0.4, 1)]
CAPACITIES = np.array([0.62, 0.81, 0.95, 1.10, 1.18, 1.33, 1.47, 1.71, 2.05, 2.6])
COUNTS = ((0, 40), (4, 40), (40, 40), (11, 44))
POWER_LAWS = ((1e-4, 2.5, 1.0, 0.4), (2e-4, 3.0, 0.8, 0.5))
SPANS = ((0.10, 50), (0.02, 50), (0.05, 50), (0.50, 50))
BETAS = (0.275, 0.3, 0.325, 0.35, 0.375, 0.4, 0.425, 0.45, 0.475, 0.5, 0.525, 0.55, 0.575, 0.6, 0.95)
PERIODS, DUCTILITIES = tuple(np.round(np.arange(0.5, 1.51, 0.1), 1)), (1.0, 1.1, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
RATINGS = {"A": 0.10, "B": 0.20, "C": 0.35, "D": 0.50}
STATES = {"slight": (0.2, 0.5, 0.05), "extensive": (0.6, 0.5, 0.4), "complete": (1.1, 0.6, 1.0)}  # median, beta, loss
LOSS_LEVELS = np.array([0.1, 0.3, 0.6, 1.0, 2.0])
LOSS_HAZARD = (1e-3, 2.2)


def maximum_likelihood(levels, exceeding, total) -> np.ndarray:
    """Return median and dispersion that maximise the binomial likelihood, by Nelder and Mead's search and Newton's."""

    def cost(p):
        score = (np.log(levels) - p[0]) / np.exp(p[1])
        return -np.sum(exceeding * norm.logcdf(score) + (total - exceeding) * norm.logsf(score))

    start = minimize(cost, [np.log(np.median(levels)), np.log(0.4)], method="Nelder-Mead", options={"xatol": 1e-6}).x
    found = minimize(cost, start, method="BFGS", options={"gtol": 1e-11}).x
    return np.exp(found)


def baker() -> Outcome:
    """Maximum of the binomial likelihood."""
    median, dispersion = maximum_likelihood(BAKER_LEVELS, BAKER_EXCEEDING, BAKER_TOTAL)
    grid = np.linspace(0.05, 1.6, 156)
    return Outcome([median, dispersion], {"fragility": (grid, norm.cdf(np.log(grid / median) / dispersion))})


def single_observations() -> Outcome:
    """Maximum of the Bernoulli likelihood."""
    levels, failed = np.array(SINGLE).T
    return Outcome(maximum_likelihood(levels, failed, 1))


def capacities() -> Outcome:
    """scipy.stats.lognorm.fit with the location 0."""
    dispersion, _, median = lognorm.fit(CAPACITIES, floc=0)
    grid = np.linspace(0.3, 3.5, 161)
    return Outcome([median, dispersion], {"fragility": (grid, norm.cdf(np.log(grid / median) / dispersion))})


def binomial_limits() -> Outcome:
    """Quantiles of the beta distribution (Clopper and Pearson 1934), 95 %."""
    values = []
    for count, total in COUNTS:
        values.append(0.0 if count == 0 else beta_distribution.ppf(0.025, count, total - count + 1))
        values.append(1.0 if count == total else beta_distribution.ppf(0.975, count + 1, total - count))
    return Outcome(values)


def power_law_rates() -> Outcome:
    """Cornell: k0 median^-k exp(k^2 beta^2 / 2); probability in 50 years 1 - exp(-50 rate)."""
    rates = [k0 * m**-k * np.exp((k * b) ** 2 / 2) for k0, k, m, b in POWER_LAWS]
    return Outcome([*rates, *(-np.expm1(-50 * np.array(rates)))])


def segments(name):
    """Return ln(intensity) and ln(rate) of a hazard curve, with its end segments continued far."""
    x, y = (np.log(np.array(each)) for each in CURVES[name])
    first, last = (y[1] - y[0]) / (x[1] - x[0]), (y[-1] - y[-2]) / (x[-1] - x[-2])
    return np.array([x[0] - 12, *x, x[-1] + 6]), np.array([y[0] - 12 * first, *y, y[-1] + 6 * last])


def rate(name, median, dispersion) -> float:
    """Return the annual rate of a lognormal fragility curve, by 60 Gauss points in each segment."""
    x, y = segments(name)
    points, weights = np.polynomial.legendre.leggauss(60)
    total = 0.0
    for a, b in pairwise(x):
        for low, high in pairwise(np.linspace(a, b, 9)):
            s = (low + high) / 2 + (high - low) / 2 * points
            density = norm.pdf((s - np.log(median)) / dispersion) / dispersion
            total += (high - low) / 2 * np.sum(weights * np.exp(np.interp(s, x, y)) * density)
    return total


def risk_targets() -> Outcome:
    """Root of rate(median) = -ln(0.99)/50; motion = median exp(-1.2816 * 0.8), times the direction factor."""
    target, values = -np.log(0.99) / 50, []
    for city, period in CURVES:
        name = (city, period)
        median = np.exp(brentq(lambda m, name=name: np.log(rate(name, np.exp(m), 0.8) / target), -4, 3, xtol=1e-12))
        motion = median * np.exp(norm.ppf(0.1) * 0.8)
        x, y = segments(name)
        uniform = np.exp(np.interp(-np.log(-np.log(0.98) / 50), -y, x))
        values += [motion * (1.1 if period == "0.2 s" else 1.3), motion / uniform]
    return Outcome(values)


def return_periods() -> Outcome:
    """-t/ln(1 - p)."""
    return Outcome([-t / np.log1p(-p) for p, t in SPANS])


def acceptable_margins() -> Outcome:
    """exp(-beta Phi^-1(x)), x = 10 % and 20 %."""
    return Outcome([np.exp(-b * norm.ppf(x)) for b in BETAS[:-1] for x in (0.10, 0.20)])


def shape_factors() -> Outcome:
    """exp(b1 (1.5 - e(T))), b1 = 0.14 (mu - 1)^0.42, e(T) = 0.6 (1.5 - T)."""
    return Outcome([np.exp(0.14 * (m - 1) ** 0.42 * (1.5 - 0.6 * (1.5 - t))) for t in PERIODS for m in DUCTILITIES])


def uncertainties() -> Outcome:
    """Root of the sum of squares, rounded to 0.025; mu_T >= 3, so beta_RTR = 0.4."""
    total = [
        np.sqrt(0.4**2 + RATINGS[d] ** 2 + RATINGS[t] ** 2 + RATINGS[m] ** 2)
        for m in "AB"
        for d in "ABCD"
        for t in "ABCD"
    ]
    return Outcome(np.round(np.array(total) / 0.025) * 0.025)


def mean_loss(x) -> float:
    """Return the mean loss ratio at an intensity: sum of P(state) times its loss."""
    p = [norm.cdf(np.log(x / median) / b) for median, b, _ in STATES.values()]
    losses = [loss for *_, loss in STATES.values()]
    return sum((a - b) * loss for a, b, loss in zip(p, [*p[1:], 0.0], losses, strict=True))


def losses() -> Outcome:
    """Mean loss ratios; annual loss of the piecewise linear function by quadrature, constant above 2 g."""
    k0, k = LOSS_HAZARD
    ratios = [mean_loss(x) for x in LOSS_LEVELS]
    annual = k0 * LOSS_LEVELS[0] ** -k * ratios[0]
    for a, b, low, high in zip(LOSS_LEVELS[:-1], LOSS_LEVELS[1:], ratios[:-1], ratios[1:], strict=True):
        annual += quad(lambda x: k0 * x**-k, a, b, epsabs=0, epsrel=1e-12)[0] * (high - low) / (b - a)
    return Outcome([*ratios, annual * 1e3], {"vulnerability": (LOSS_LEVELS, np.array(ratios))})
