"""Conditional spectra: the distribution of a spectrum, given its value at a period or its average over periods."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, one_of, real_number, shortened
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.files.text import existing_file, read_csv
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.measures.one_component import AverageSpectralAcceleration, SpectralAcceleration
from warpdyn.model.ground_motions.response_spectra import checked_periods
from warpdyn.model.ground_motions.selection.correlation import spectral_correlation
from warpdyn.model.ground_motions.selection.target import TargetSpectrum, index_of_period

ROUNDING = 1e-6  # of correlations, such as printed digits
Correlation = Callable[[np.ndarray, np.ndarray], np.ndarray]


@suggests_names
def conditional_spectrum(
    periods: ArrayLike,
    median: ArrayLike,
    dispersion: ArrayLike,
    conditioning: IntensityMeasure,
    *,
    level: float | None = None,
    epsilon: float | None = None,
    weights: ArrayLike | None = None,
    correlation: Correlation = spectral_correlation,
) -> TargetSpectrum:
    """Return the conditional spectrum: mean and covariance of ln Sa, given a spectral acceleration or its average.

    For one earthquake scenario, `median` and `dispersion` are those of a ground-motion model, shape [period]. For
    several causal scenarios, they have one row per scenario, and `weights` are the shares from the disaggregation at
    this level.

    Source: Baker (2011), "Conditional mean spectrum: tool for ground-motion selection", Journal of Structural
    Engineering 137(3); several scenarios: Lin et al. (2013), Bulletin of the Seismological Society of America 103(2A).

    Args:
        periods: Natural periods [s], increasing, shape [period]. They contain the periods of `conditioning`.
        median: Median of Sa [g], shape [period] or [scenario, period].
        dispersion: Standard deviation of ln Sa [1], as `median`.
        conditioning: SpectralAcceleration(period), or AverageSpectralAcceleration(periods).
        level: Level of the conditioning measure [g].
        epsilon: Number of standard deviations between the level and the median [1], instead of `level`; only for
            one scenario.
        weights: Share of each scenario [1], shape [scenario]; they are divided by their sum. None: equal shares.
        correlation: Function of two arrays of periods [s] that returns the correlation of ln Sa.

    Raises:
        ValueError: If shapes differ, a value is out of range, a period of `conditioning` is missing, not exactly one of
            `level` and `epsilon` is given, `correlation` returns no correlations, or the covariance is not positive
            semidefinite.
        TypeError: If `conditioning` is not one of the two intensity measures.

    Example:
        >>> periods = [0.2, 0.5, 1.0, 2.0]
        >>> model = dict(median=[0.62, 0.26, 0.14, 0.07], dispersion=[0.52, 0.57, 0.60, 0.63])  # g
        >>> target = wd.conditional_spectrum(periods, **model, conditioning=wd.SpectralAcceleration(1.0), epsilon=1.5)
        >>> target.median.round(3)
        array([0.877, 0.493, 0.344, 0.142])
        >>> target.dispersion.round(3)
        array([0.466, 0.378, 0.   , 0.417])
    """
    row = checked_periods(periods, "conditional_spectrum: periods")
    if row.ndim != 1 or np.any(np.diff(row) <= 0):
        raise ValueError(
            f"conditional_spectrum: periods must be one row of increasing values, got {shortened(periods)}"
        )
    means, sigmas = _scenarios(median, dispersion, row.size)
    shares = _shares(weights, means.shape[0])
    rho = _correlations(correlation, row, "conditional_spectrum")
    places = _places_of_measure(conditioning, row)
    # ln of the conditioning measure is the mean of ln Sa at these periods.
    of_measure = means[:, places].mean(axis=1)
    covariances = rho * sigmas[:, :, None] * sigmas[:, None, :]
    with_measure = covariances[:, :, places].mean(axis=2)  # covariance of ln Sa and the measure, [scenario, period]
    variance = with_measure[:, places].mean(axis=1)
    if (level is None) == (epsilon is None):
        raise ValueError(
            f"conditional_spectrum: give either level= [g] or epsilon=, got level={level!r} and epsilon={epsilon!r}"
        )
    if epsilon is not None:
        if shares.size > 1:
            raise ValueError("conditional_spectrum: epsilon differs between scenarios: give level= [g] instead")
        ln_level = float(of_measure[0] + real_number("epsilon", epsilon) * np.sqrt(variance[0]))
    else:
        ln_level = float(np.log(real_number("level [g]", level, above=0, units="g")))
    findings = PlausibilityFindings()
    findings.add("median_spectral_acceleration", np.exp(means).max())
    # One of several causal scenarios must reach the level.
    findings.add("conditioning_epsilon", np.abs((ln_level - of_measure) / np.sqrt(variance)).min())
    findings.warn()
    # A normal distribution, given the value of a linear combination.
    given = means + with_measure / variance[:, None] * (ln_level - of_measure)[:, None]
    left = covariances - with_measure[:, :, None] * with_measure[:, None, :] / variance[:, None, None]
    mean = shares @ given
    apart = given - mean
    covariance = np.einsum("s,sij->ij", shares, left + apart[:, :, None] * apart[:, None, :])
    if isinstance(conditioning, SpectralAcceleration):  # remove the rounding errors at the conditioning period
        covariance[places[0]] = covariance[:, places[0]] = 0.0
        mean[places[0]] = ln_level
    return TargetSpectrum(row, np.exp(mean), covariance, conditioning, float(np.exp(ln_level)))


def _scenarios(median: ArrayLike, dispersion: ArrayLike, periods: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the means and standard deviations of ln Sa, each of shape [scenario, period]."""
    rows = []
    for name, values, units in (("median [g]", median, "g"), ("dispersion", dispersion, None)):
        row = np.atleast_2d(finite_numbers(f"conditional_spectrum: {name}", values, units))
        if row.ndim != 2 or row.shape[1] != periods or np.any(row <= 0):
            raise ValueError(
                f"conditional_spectrum: {name} must be values above 0 for {periods} periods, shape [period] or "
                f"[scenario, period], got shape {np.shape(values)}"
                + (f" with the value {row.min():g}" if np.any(row <= 0) else "")
            )
        rows.append(row)
    if rows[0].shape != rows[1].shape:
        raise ValueError(
            f"conditional_spectrum: median has {rows[0].shape[0]} scenarios and dispersion {rows[1].shape[0]}: give "
            "both for the same scenarios"
        )
    return np.log(rows[0]), rows[1]


def _correlations(correlation: Correlation, periods: np.ndarray, function: str) -> np.ndarray:
    """Return the correlations of ln Sa, shape [period, period], after a check."""
    number = periods.size
    rho = finite_numbers(f"{function}: correlation", correlation(periods[:, None], periods[None, :]))
    what = f"{function}: correlation must return the correlations of all periods, shape [{number}, {number}]"
    if rho.shape != (number, number):
        raise ValueError(f"{what}, got shape {rho.shape}: write it with NumPy functions that broadcast")
    for fault, bad in (
        ("a correlation of a period with itself that is not 1", np.diag(np.abs(np.diag(rho) - 1) > ROUNDING)),
        ("values that differ if both periods are exchanged", np.abs(rho - rho.T) > ROUNDING),
        ("a value outside -1 to 1", np.abs(rho) > 1 + ROUNDING),
    ):
        if bad.any():
            i, j = np.argwhere(bad)[0]
            raise ValueError(
                f"{what}, got {fault}: {rho[i, j]:g} for {periods[i]:g} and {periods[j]:g} s: give a function such as "
                "wd.spectral_correlation"
            )
    return rho


def _shares(weights: ArrayLike | None, scenarios: int) -> np.ndarray:
    shares = np.ones(scenarios) if weights is None else finite_numbers("conditional_spectrum: weights", weights)
    if shares.shape != (scenarios,) or np.any(shares < 0) or shares.sum() <= 0:
        raise ValueError(
            f"conditional_spectrum: weights must be {scenarios} numbers of at least 0, one per scenario, got "
            f"{shortened(weights)}"
        )
    return shares / shares.sum()


def _places_of_measure(conditioning: IntensityMeasure, periods: np.ndarray) -> list[int]:
    """Return the indices of the periods of the conditioning measure."""
    if isinstance(conditioning, SpectralAcceleration):
        wanted: tuple[float, ...] = (conditioning.period,)
    elif isinstance(conditioning, AverageSpectralAcceleration):
        wanted = tuple(np.asarray(conditioning.periods).tolist())
    else:
        raise TypeError(
            "conditional_spectrum: conditioning must be wd.SpectralAcceleration(period) or "
            f"wd.AverageSpectralAcceleration(periods), got {conditioning!r}"
        )
    found = [index_of_period(periods, period) for period in wanted]
    missing = [period for period, place in zip(wanted, found, strict=True) if place is None]
    if missing:
        raise ValueError(
            f"conditional_spectrum: the periods of {conditioning.name} must be among periods=, but {missing[0]:g} s is "
            "missing: add it, with its median and dispersion"
        )
    return [place for place in found if place is not None]


@suggests_names
def read_openquake_spectrum(
    path: str | os.PathLike,
    conditioning: SpectralAcceleration,
    *,
    statistic: str = "mean",
    correlation: Correlation = spectral_correlation,
) -> list[TargetSpectrum]:
    """Read the conditional spectra of one site from a CSV file of the OpenQuake engine.

    The file `conditional-spectrum-<site>.csv` contains the median [g] and the standard deviation of ln Sa at each
    period, for each probability of exceedance, but no correlations. The covariance is computed from the standard
    deviations and the conditional correlation (rho_ij - rho_i rho_j) / sqrt((1 - rho_i^2) (1 - rho_j^2)). Rows of PGA
    (period 0) are not used.

    Args:
        path: The file, with the columns `poe`, `period`, `mea` and `std` (version 3.14 of the engine or later).
        conditioning: The reference intensity measure of the calculation (`imt_ref`).
        statistic: Rows to read, by their value in the column `stat`, such as "mean" or "quantile-0.5".
        correlation: Function of two arrays of periods [s] that returns the correlation of ln Sa.

    Returns:
        One target per probability of exceedance, ordered by increasing level.

    Raises:
        ValueError: If columns are missing, a value is out of range, the conditioning period or the statistic is not in
            the file, or `correlation` returns no correlations.
        TypeError: If `conditioning` is not a SpectralAcceleration.
        FileNotFoundError: If the file does not exist.

    Example:
        >>> targets = wd.read_openquake_spectrum("conditional-spectrum-0.csv", wd.SpectralAcceleration(1.0))
        >>> [round(target.level, 3) for target in targets]
        [0.2, 0.45]
    """
    table = read_csv(existing_file("read_openquake_spectrum", path), comment="#")
    missing = {"poe", "period", "mea", "std"} - set(table.columns)
    if missing:
        raise ValueError(
            f"{path} has no column {', '.join(sorted(missing))}: give the file conditional-spectrum-<site>.csv that "
            "OpenQuake 3.14 or later exports from a calculation with calculation_mode = conditional_spectrum"
        )
    if not isinstance(conditioning, SpectralAcceleration):
        raise TypeError(
            f"read_openquake_spectrum: conditioning must be wd.SpectralAcceleration(period), got {conditioning!r}"
        )
    if "stat" in table:
        one_of("statistic", statistic, table["stat"].astype(str).unique().tolist())
        table = table[table["stat"].astype(str) == statistic]
    targets = [_of_rows(rows, conditioning, correlation, path) for _, rows in table.groupby("poe")]
    return sorted(targets, key=lambda target: target.level or 0.0)


def _of_rows(
    rows: pd.DataFrame, conditioning: SpectralAcceleration, correlation: Correlation, path: str | os.PathLike
) -> TargetSpectrum:
    """Return the target in the rows of one probability of exceedance."""
    rows = rows[rows["period"] > 0].sort_values("period")
    periods, sigma = rows["period"].to_numpy(float), rows["std"].to_numpy(float, copy=True)
    place = index_of_period(periods, conditioning.period) if periods.size else None
    if place is None:
        raise ValueError(
            f"{path} has no row for the conditioning period {conditioning.period:g} s: its periods are "
            f"{periods.tolist()}; give conditioning=wd.SpectralAcceleration(period) with the period of imt_ref"
        )
    rho = _correlations(correlation, periods, "read_openquake_spectrum")
    to_it = rho[:, place]
    left = np.sqrt(np.maximum(1 - to_it**2, 0.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        partial = (rho - to_it[:, None] * to_it) / (left[:, None] * left)
    partial[place] = partial[:, place] = 0.0
    sigma[place] = 0.0
    np.fill_diagonal(partial, 1.0)
    covariance = partial * sigma[:, None] * sigma
    return TargetSpectrum(periods, rows["mea"].to_numpy(float), covariance, conditioning)
