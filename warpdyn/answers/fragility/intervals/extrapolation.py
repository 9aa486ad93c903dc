"""Medians that lie outside the intensities that were run: marked as extrapolations, or not given at all.

A curve through levels that all lie on one side of its median is extrapolated along its slope, which few exceedances
hardly tell. If 1.96 standard errors of the median's logarithm are more than ln(4), so that four times the median and a
fourth of it are within reach, or if a single record decides whether there is a fit, the data do not determine it. The
quantile is that of a normal distribution, so that few groups of structures do not decide.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.answers.fragility.estimators.binomial import PENALISED, UNDETERMINED
from warpdyn.answers.fragility.intervals.jackknife import FARTHEST_DRAW, LeftOut, trusted
from warpdyn.foundations.core.output_variables import EXTRAPOLATED, MEDIAN_MEANINGS, NO_MEDIAN, WITHIN_LEVELS

# Advised levels reach from so many to so many times the highest level: two digits of three levels within a ratio of
# 1.25 differ from the highest one, and further levels are not advised at once.
LEAST_BEYOND, MOST_BEYOND = 1.25, 4.0
DIGITS = 2  # of advised levels
REACH = 1.96  # standard errors: the 97.5 % quantile of a normal distribution


@dataclass(frozen=True, eq=False)
class Marked:
    """Fits in which medians that the data do not determine are NaN.

    Args:
        left: The fits.
        outcome: Outcome of each, an index into `FIT_MEANINGS`, shape [row ...].
        status: Where each median lies, an index into `MEDIAN_MEANINGS`, shape [row ...].
        fitted: Medians as they were fitted, also those that are not determined, shape [row ...].
    """

    left: LeftOut
    outcome: np.ndarray
    status: np.ndarray
    fitted: np.ndarray


def mark(
    left: LeftOut,
    outcome: np.ndarray,
    lowest: ArrayLike,
    highest: ArrayLike,
) -> Marked:
    """Return fits whose medians are marked, and NaN where they are outside the intensities and not determined.

    Args:
        left: The fits, whole and with parts left out.
        outcome: Outcome of each fit, an index into `FIT_MEANINGS`, shape [row ...].
        lowest, highest: Ends of the intensities that were run, which broadcast to [row ...].
    """
    fitted = np.exp(left.whole[0])
    is_outside = (fitted < lowest) | (fitted > highest)
    spread = left.spread
    error, has_interval = spread.standard_error[0], trusted(left, outcome)
    if len(left.records) < 2:  # nothing is known of the variance among records
        error = np.sqrt(left.binomial[0])
        has_interval = np.isfinite(error)
    with np.errstate(invalid="ignore"):
        unsure = (outcome == PENALISED) | ~has_interval | (REACH * error > FARTHEST_DRAW)
    missing = is_outside & unsure
    status = np.where(is_outside, EXTRAPOLATED, WITHIN_LEVELS)
    status = np.where(missing | ~np.isfinite(fitted), NO_MEDIAN, status).astype(np.int8)
    whole = np.where(missing, np.nan, left.whole)
    return Marked(replace(left, whole=whole), np.where(missing, UNDETERMINED, outcome), status, fitted)


def status_attributes() -> dict[str, Any]:
    """Return the attributes of the flag variable of `MEDIAN_MEANINGS`, beside its `long_name`."""
    return {"flag_values": np.arange(len(MEDIAN_MEANINGS), dtype=np.int8), "flag_meanings": " ".join(MEDIAN_MEANINGS)}


def levels_towards(median: float, lowest: float, highest: float, units: str) -> str:
    """Return which levels to add on the way to a median outside the levels.

    Args:
        median: The fitted median [units].
        lowest, highest: Ends of the levels [units].
        units: Units of the levels.
    """
    begin = highest if median > highest else lowest
    beyond = np.clip(max(median / begin, begin / median), LEAST_BEYOND, MOST_BEYOND)
    end = begin * beyond if median > highest else begin / beyond
    levels = sorted(float(f"{level:.{DIGITS}g}") for level in np.geomspace(begin, end, 4)[1:])
    side = "above" if median > highest else "below"
    return f"add levels {side} {begin:g} {units}, such as {', '.join(f'{level:g}' for level in dict.fromkeys(levels))}"


def sentences(
    names: tuple[str, ...],
    status: np.ndarray,
    outcome: np.ndarray,
    fitted: np.ndarray,
    lowest: ArrayLike,
    highest: ArrayLike,
    units: str,
) -> list[str]:
    """Return what is to be told of medians outside the intensities, one sentence a damage state.

    Args:
        names: Names of the damage states.
        status: Where each median lies, shape [damage_state].
        outcome: Outcome of each fit, shape [damage_state].
        fitted: Medians as they were fitted, shape [damage_state].
        lowest, highest: Ends of the intensities that were run, one for all or shape [damage_state].
        units: Their units.
    """
    lowest, highest = (np.broadcast_to(np.asarray(end, dtype=float), fitted.shape) for end in (lowest, highest))
    told = []
    for name, place, fit, median, low, high in zip(names, status, outcome, fitted, lowest, highest, strict=True):
        if place != EXTRAPOLATED and fit != UNDETERMINED:
            continue
        side, end = ("above the highest", high) if median > high else ("below the lowest", low)
        advice = levels_towards(float(median), float(low), float(high), units)
        where = f"{side} intensity that was run, {end:g} {units}"
        what = f"of {median:.3g} {units}"
        if fit == UNDETERMINED:
            told.append(
                f"damage state {name!r}: the data do not determine the curve, so its median and dispersion are NaN; "
                f"the fit has a median {what}, an extrapolation {where}; {advice}"
            )
        else:
            told.append(f"damage state {name!r}: the median {what} is an extrapolation, {where}; {advice}")
    return told
