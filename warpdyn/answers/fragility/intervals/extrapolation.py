"""Medians outside the range of intensities that were run: they are marked as extrapolations, or replaced by NaN.

If all levels are on one side of the median, the curve is extrapolated, and a few exceedances determine its slope only
poorly. The data do not determine the median in two cases: if 1.96 standard errors of ln(median) are more than ln(4), so
that the true median may be 4 times larger or smaller, or if the fit fails when one of the records is left out. The
quantile 1.96 is that of a normal distribution, so that the result does not depend on the number of structures.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.answers.fragility.estimators.binomial import PENALISED, UNDETERMINED
from warpdyn.answers.fragility.intervals.jackknife import FARTHEST_DRAW, LeftOut, trusted
from warpdyn.foundations.core.output_variables import EXTRAPOLATED, MEDIAN_MEANINGS, NO_MEDIAN, WITHIN_LEVELS

# The recommended levels end at LEAST_BEYOND to MOST_BEYOND times the highest level (or at the lowest level divided by
# this factor): with a factor of 1.25, three levels still differ in two digits.
LEAST_BEYOND, MOST_BEYOND = 1.25, 4.0
DIGITS = 2  # number of significant digits of recommended levels
REACH = 1.96  # number of standard errors: the 97.5 % quantile of a normal distribution


@dataclass(frozen=True, eq=False)
class Marked:
    """Fits of fragility curves, and whether each median is below, within or above the intensities that were run.

    A median that the data do not determine is NaN (see the module's docstring).

    Args:
        left: The fits.
        outcome: Outcome of each fit, an index into `FIT_MEANINGS`, shape [row ...].
        status: Position of each median among the levels, an index into `MEDIAN_MEANINGS`, shape [row ...].
        fitted: All fitted medians, including undetermined ones, shape [row ...].
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
    """Return fits that state whether a median is below, within or above the levels; uncertain ones outside become NaN.

    Args:
        left: The fits to all samples, and the fits without each record and without each group of structures.
        outcome: Outcome of each fit, an index into `FIT_MEANINGS`, shape [row ...].
        lowest, highest: Lowest and highest intensity that were run, of a shape that broadcasts to [row ...].
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
    """Return the flag attributes (except `long_name`) of the variable `median_status`, see `MEDIAN_MEANINGS`."""
    return {"flag_values": np.arange(len(MEDIAN_MEANINGS), dtype=np.int8), "flag_meanings": " ".join(MEDIAN_MEANINGS)}


def levels_towards(median: float, lowest: float, highest: float, units: str, added: str = "levels") -> str:
    """Return advice, as text, on levels [units] to add between the levels that were run and a median outside them.

    With `added` = "motions", the advice is to add motions with such intensities, because a cloud has no levels.
    """
    begin = highest if median > highest else lowest
    beyond = np.clip(max(median / begin, begin / median), LEAST_BEYOND, MOST_BEYOND)
    end = begin * beyond if median > highest else begin / beyond
    levels = sorted(float(f"{level:.{DIGITS}g}") for level in np.geomspace(begin, end, 4)[1:])
    side = "above" if median > highest else "below"
    what = added if added == "levels" else f"{added} with intensities"
    return f"add {what} {side} {begin:g} {units}, such as {', '.join(f'{level:g}' for level in dict.fromkeys(levels))}"


def sentences(
    names: tuple[str, ...],
    status: np.ndarray,
    outcome: np.ndarray,
    fitted: np.ndarray,
    lowest: ArrayLike,
    highest: ArrayLike,
    units: str,
    added: str = "levels",
) -> list[str]:
    """Return one sentence for each damage state whose median is outside the intensities that were run.

    Args:
        names: Names of the damage states.
        status: Position of each median, an index into `MEDIAN_MEANINGS`, shape [damage_state].
        outcome: Outcome of each fit, an index into `FIT_MEANINGS`, shape [damage_state].
        fitted: All fitted medians, shape [damage_state].
        lowest, highest: Lowest and highest intensity that were run: one value for all states, or shape [damage_state].
        units: Units of the intensities.
        added: Words for the advised addition, "levels" or "motions".
    """
    lowest, highest = (np.broadcast_to(np.asarray(end, dtype=float), fitted.shape) for end in (lowest, highest))
    found = []
    for name, place, fit, median, low, high in zip(names, status, outcome, fitted, lowest, highest, strict=True):
        if place != EXTRAPOLATED and fit != UNDETERMINED:
            continue
        side, end = ("above the highest", high) if median > high else ("below the lowest", low)
        advice = levels_towards(float(median), float(low), float(high), units, added)
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
