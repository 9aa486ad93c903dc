"""Medians outside the intensities that were run: marked as extrapolations, or NaN.

If all levels are on one side of the median, the curve is extrapolated along its slope, which few exceedances determine
poorly. The data do not determine the median if 1.96 standard errors of its logarithm are more than ln(4), so that a
quarter of the median and four times the median are possible, or if leaving out one record leaves no fit. The quantile
is that of a normal distribution, so that a small number of structures has no effect.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.answers.fragility.estimators.binomial import PENALISED, UNDETERMINED
from warpdyn.answers.fragility.intervals.jackknife import FARTHEST_DRAW, LeftOut, trusted
from warpdyn.foundations.core.output_variables import EXTRAPOLATED, MEDIAN_MEANINGS, NO_MEDIAN, WITHIN_LEVELS

# Recommended levels reach to a ratio between LEAST_BEYOND and MOST_BEYOND of the end of the levels: three levels
# within a ratio of 1.25 still differ in two digits.
LEAST_BEYOND, MOST_BEYOND = 1.25, 4.0
DIGITS = 2  # of recommended levels
REACH = 1.96  # standard errors: the 97.5 % quantile of a normal distribution


@dataclass(frozen=True, eq=False)
class Marked:
    """Fits in which medians that the data do not determine are NaN.

    Args:
        left: The fits.
        outcome: Outcome of each, an index into `FIT_MEANINGS`, shape [row ...].
        status: Position of each median, an index into `MEDIAN_MEANINGS`, shape [row ...].
        fitted: All fitted medians, shape [row ...].
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
    """Return fits with the positions of their medians; medians outside that are not determined are NaN.

    Args:
        left: The fits, whole and with parts left out.
        outcome: Outcome of each fit, an index into `FIT_MEANINGS`, shape [row ...].
        lowest, highest: Ends of the intensities that were run, which broadcast to [row ...].
    """
    fitted = np.exp(left.whole[0])
    is_outside = (fitted < lowest) | (fitted > highest)
    spread = left.spread
    error, has_interval = spread.standard_error[0], trusted(left, outcome)
    if len(left.records) < 2:  # the variance among records is unknown
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
    """Return the attributes of the flag variable of `MEDIAN_MEANINGS`, without `long_name`."""
    return {"flag_values": np.arange(len(MEDIAN_MEANINGS), dtype=np.int8), "flag_meanings": " ".join(MEDIAN_MEANINGS)}


def levels_towards(median: float, lowest: float, highest: float, units: str) -> str:
    """Return a sentence with levels to add in the direction of a median outside the levels [units]."""
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
    """Return one sentence per damage state whose median is outside the intensities.

    Args:
        names: Names of the damage states.
        status: Position of each median, shape [damage_state].
        outcome: Outcome of each fit, shape [damage_state].
        fitted: All fitted medians, shape [damage_state].
        lowest, highest: Ends of the intensities that were run, one for all or shape [damage_state].
        units: Their units.
    """
    lowest, highest = (np.broadcast_to(np.asarray(end, dtype=float), fitted.shape) for end in (lowest, highest))
    found = []
    for name, place, fit, median, low, high in zip(names, status, outcome, fitted, lowest, highest, strict=True):
        if place != EXTRAPOLATED and fit != UNDETERMINED:
            continue
        side, end = ("above the highest", high) if median > high else ("below the lowest", low)
        advice = levels_towards(float(median), float(low), float(high), units)
        where = f"{side} intensity that was run, {end:g} {units}"
        what = f"of {median:.3g} {units}"
        if fit == UNDETERMINED:
            found.append(
                f"damage state {name!r}: the data do not determine the curve, so its median and dispersion are NaN; "
                f"the fit has a median {what}, an extrapolation {where}; {advice}"
            )
        else:
            found.append(f"damage state {name!r}: the median {what} is an extrapolation, {where}; {advice}")
    return found
