"""Warnings about fragility curves that cross, hazard curves that are extrapolated, and tables that end too early."""

from __future__ import annotations

import numpy as np

from warpdyn.answers.risk.curves.curve_set import CurveSet
from warpdyn.answers.risk.hazard_curves import HazardCurve, HazardLogicTree
from warpdyn.answers.risk.integrals.linear import begin_of, loss_of_year, part_above
from warpdyn.foundations.core.messages import warn_caller

CUT_SHARE = 0.05  # warn if the first or last value of a table decides a larger share of a rate or loss
EXTRAPOLATED_SHARE = 0.01  # warn if a larger share of a result is from intensities beyond the points of the hazard
CROSSING = 0.01  # warn if a heavier state is more likely than a lighter one by more than this probability
AS_LIKELY = "the lower probability counts for both"


def warn_of_crossing(curves: CurveSet, consequence: str = AS_LIKELY) -> None:
    """Warn of damage states whose curves cross, if the probabilities differ by more than `CROSSING`.

    Args:
        curves: The curves.
        consequence: Text that states how the calling function treats crossing curves.
    """
    levels = np.unique(np.geomspace(*curves.limited.usual(curves.median, curves.dispersion), 61))
    excess = np.diff(curves.probability(levels), axis=0).max(axis=1, initial=0.0)
    for i in np.flatnonzero(excess > CROSSING):
        warn_caller(
            f"the fragility curves of {curves.names[i]!r} and {curves.names[i + 1]!r} cross: the probability of "
            f"the heavier state is higher by up to {100 * excess[i]:.2g} %; {consequence}. Use "
            "fragility(..., estimator='ordinal'), which fits curves that do not cross"
        )


def warn_of_extrapolation(
    names: tuple[str, ...], shares: np.ndarray, curves: tuple[HazardCurve, ...], what: str
) -> None:
    """Warn if a share of a result above `EXTRAPOLATED_SHARE` is from intensities beyond the points of the hazard.

    Args:
        names: Names of the damage states, or names of other results that begin with "the".
        shares: Shares of the result from intensities below and above the points, shape [2, name].
        curves: Hazard curves of the branches.
        what: Name of the result for the message, such as "annual rate".
    """
    units = curves[0].units
    ends = (
        f"below the first point of the hazard curve ({min(each.intensity[0] for each in curves):.3g} {units})",
        f"above the last point of the hazard curve ({max(each.intensity[-1] for each in curves):.3g} {units})",
    )
    for side, row in zip(ends, shares, strict=True):
        found = [
            f"{float(f'{100 * share:.2g}'):g} % of {name if name.startswith('the ') else repr(name)}"
            for name, share in zip(names, row, strict=True)
            if share > EXTRAPOLATED_SHARE
        ]
        if found:
            warn_caller(
                f"{what}: {', '.join(found)} comes from intensities {side}, where the hazard is extrapolated with the "
                "slope of its end segment: give a hazard curve that reaches further"
            )


def warn_of_extrapolated_loss(
    function: str, hazard: HazardLogicTree, levels: np.ndarray, loss: np.ndarray, whole: float
) -> None:
    """Warn if a large share of an annual loss is from intensities beyond the points of the hazard.

    Args:
        function: Name of the public function, for the message.
        hazard: The hazard.
        levels: Intensities of the loss, between which it is linear [units of the hazard], shape [point].
        loss: Mean loss or loss ratio, shape [point].
        whole: Annual loss [unit of `loss` per year], above 0.
    """
    outside = np.zeros((2, 1))
    for weight, one in zip(hazard.weights, hazard.curves, strict=True):
        start, end = one.intensity[[0, -1]]
        beyond = [loss_of_year(one, *part_above(level, levels, loss)) for level in (start, end)]
        outside += weight * np.array([[loss_of_year(one, levels, loss) - beyond[0]], [beyond[1]]])
    warn_of_extrapolation(("the expected loss",), outside / whole, hazard.curves, function)


def warn_of_table_ends(function: str, curves: CurveSet, hazard: HazardLogicTree, rate: np.ndarray) -> None:
    """Warn if the first or last probability of a tabulated curve decides more than `CUT_SHARE` of an annual rate."""
    _warn_of_minimum(function, curves, hazard, rate)
    if curves.table is None:
        return
    _, levels, probable = curves.table
    for name, whole, row in zip(curves.names, rate, probable, strict=True):
        begins = [begin_of(each, levels) for each in hazard.curves]
        at_begin = [
            np.interp(x, levels, row) * float(each.rate_of(x)) for x, each in zip(begins, hazard.curves, strict=True)
        ]
        is_limit = 0 < levels[0] <= curves.limits.no_damage  # there is no damage below the first level
        if hazard.weights @ at_begin > CUT_SHARE * whole > 0 and not is_limit:
            begin = max(begins)
            advice = (
                "start the curve where the probability is near 0"
                if levels[0] > 0
                else "the hazard curve has no point there; give a hazard curve that begins lower"
            )
            warn_caller(
                f"{function}: for intensities below {begin:g} {curves.units} the fragility curve of {name!r} counts as "
                f"0, although its probability there is {np.interp(begin, levels, row):.3g}: {advice}"
            )
        is_maximum = levels[-1] >= curves.limits.maximum  # then the curve is constant above by definition
        if (1 - row[-1]) * float(hazard.rate_of(levels[-1])) > CUT_SHARE * whole and not is_maximum:
            warn_caller(
                f"{function}: the fragility curve of {name!r} ends at {levels[-1]:g} {curves.units} with a probability "
                f"of {row[-1]:.3g}, and this value is assumed above: give the curve up to higher intensities"
            )


def _warn_of_minimum(function: str, curves: CurveSet, hazard: HazardLogicTree, rate: np.ndarray) -> None:
    """Warn if the constant probability below the minimum intensity decides more than `CUT_SHARE` of a rate."""
    least, below = curves.limits.minimum, curves.limits.rate_below_minimum(hazard)
    if below == 0:
        return
    for name, whole, probable in zip(curves.names, rate, curves.probability(np.array([least]))[:, 0], strict=True):
        if probable * below > CUT_SHARE * whole > 0:
            warn_caller(
                f"{function}: below its minimum intensity of {least:g} {curves.units} (minIML) the fragility curve of "
                f"{name!r} keeps its probability of {probable:.3g}, which is {100 * probable * below / whole:.2g} % "
                "of the rate, down to the first point of the hazard curve: set curves.attrs['no_damage_limit'] to an "
                "intensity that causes no damage"
            )
