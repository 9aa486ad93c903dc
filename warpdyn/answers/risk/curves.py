"""Fragility curves as hazard and losses take them: of one shape, with replicates, checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.estimators import FIT_MEANINGS
from warpdyn.answers.risk.curve_shapes import OF_CLOUD, Shape, shape_of, table_of
from warpdyn.answers.risk.hazard_curves import Hazard, HazardCurve, HazardLogicTree
from warpdyn.answers.risk.integrals.intensity_limits import IntensityLimits, limited_shape, limited_table
from warpdyn.answers.risk.integrals.linear import begin_of
from warpdyn.foundations.core.checks import check_dataset, one_of
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.output_variables import EXTRAPOLATED, MEDIAN_STATUS, UNNAMED
from warpdyn.model.ground_motions.measures.names import same_measure, warn_unless_compared

ADVICE = "give what fragility(run, limits) returned"
# Of a rate, from beyond the ends of a table: with more a warning is given.
CUT_SHARE = 0.05
CROSSING = 0.01  # probability by which a heavier state may be likelier than a lighter one, without a warning
AS_LIKELY = "is taken to be as likely as the lighter one there"  # of losses, in which each state comes after the other


@dataclass(frozen=True, eq=False)
class Curves:
    """Fragility curves of the damage states of one building, of one shape.

    Args:
        names: Damage states, from the lightest on.
        shape: What makes probabilities and rates of medians and dispersions.
        median: Median capacity [units], shape [damage_state]; 1 of a table.
        dispersion: Dispersion [1], shape [damage_state]; 1 of a table.
        replicate_median: Draws from the sampling distribution of the medians, shape [replicate, damage_state], NaN
            where a state has none; None if there are none at all.
        replicate_dispersion: Those of the dispersions.
        units: Units of the medians.
        measure: Name of the intensity measure.
        table: Intensities and probabilities, shape [point] and [damage_state, point], of curves that were given by
            points alone.
        limits: Limits of the intensities, which shape and table follow.
    """

    names: tuple[str, ...]
    shape: Shape
    median: np.ndarray
    dispersion: np.ndarray
    replicate_median: np.ndarray | None
    replicate_dispersion: np.ndarray | None
    units: str
    measure: str
    table: tuple[np.ndarray, np.ndarray] | None = None
    limits: IntensityLimits = IntensityLimits()  # noqa: RUF009 (frozen)

    def probability(self, intensity: np.ndarray) -> np.ndarray:
        """Return the probability of exceedance at intensities [units], shape [damage_state, point]."""
        return self.shape.probability(intensity, self.median, self.dispersion)

    def replicate_probability(self, intensity: np.ndarray) -> np.ndarray | None:
        """Return the probability by each replicate, shape [replicate, damage_state, point]; None without them."""
        if self.replicate_median is None or self.replicate_dispersion is None:
            return None
        return self.shape.probability(intensity, self.replicate_median, self.replicate_dispersion)

    def rates(self, hazard: HazardLogicTree, *, ordered: bool = False) -> np.ndarray:
        """Return the annual rates of the states by each branch of a hazard [1/year], shape [branch, damage_state].

        Args:
            hazard: The hazard.
            ordered: Whether a heavier state is taken to be no likelier than a lighter one at any intensity.
        """
        found = []
        for each in hazard.curves:
            found.append(self.shape.rates(each, self.median, self.dispersion, ordered=ordered))
            self._check_bounded(each, found[-1])
        return np.stack(found)

    def sampled_rates(self, hazard: HazardLogicTree, *, ordered: bool = False) -> np.ndarray:
        """Return the rates by each replicate and branch, shape [replicate, branch, damage_state].

        Without replicates there is one, the curves themselves; a rate that has no bound is NaN.
        """
        if self.replicate_median is None or self.replicate_dispersion is None:
            return self.rates(hazard, ordered=ordered)[None]
        found = [
            self.shape.rates(each, self.replicate_median, self.replicate_dispersion, ordered=ordered)
            for each in hazard.curves
        ]
        return np.where(np.isfinite(found), found, np.nan).swapaxes(0, 1)

    def rates_by_bin(self, hazard: HazardCurve, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the rates from the intensities of each bin, shape [damage_state, bin], and from below and above."""
        parts = self.shape.rates_by_bin(hazard, edges, self.median, self.dispersion)
        self._check_bounded(hazard, parts[1])
        return parts

    def _check_bounded(self, hazard: HazardCurve, rates: np.ndarray) -> None:
        """Raise a ValueError if the rate of a state is infinite."""
        for state in np.flatnonzero(~np.isfinite(rates)):
            raise ValueError(
                f"the annual rate of {self.names[state]!r} has no bound: below the first point of the hazard curve "
                f"({hazard.intensity[0]:.3g} {hazard.units}) the extrapolated hazard rises faster than the tail of the "
                "fragility curve falls; give a hazard curve that begins at a lower intensity, where it is less steep, "
                "or fit lognormal curves"
            )

    def shares_beyond(self, hazard: HazardLogicTree) -> np.ndarray:
        """Return the shares of the rates from intensities below and above the hazard's points, shape [2, state]."""
        parts = 0.0
        for weight, each in zip(hazard.weights, hazard.curves, strict=True):
            within, below, above = self.rates_by_bin(each, each.intensity[[0, -1]])
            parts = parts + weight * np.stack([below, above, within.sum(axis=-1)])
        return np.asarray(parts)[:2] / np.sum(parts, axis=0)


def curves_of(function: str, curves: xr.Dataset, hazard: Hazard | None = None) -> Curves:
    """Return the curves of a dataset, or raise an error that names the state without a fit.

    Args:
        function: The public function.
        curves: What `fragility` or another function of fragility curves returned; a dataset of `fragility_median` and
            `fragility_dispersion`; or a table, `fragility_curve(damage_state, intensity)` or
            `exceedance_fraction(damage_state, stripe)`, that is linear between its points. Limits of the intensities,
            which `read_nrml_fragility` sets as attributes, are applied.
        hazard: What the curves are to be put together with: of the same units and intensity measure.

    Raises:
        TypeError: If `curves` is no Dataset.
        ValueError: If a variable is missing, a state has no fit, or units or measure are not the hazard's; if the rate
            of a curve has no bound, as its tail falls no faster than the extrapolated hazard rises.
    """
    check_dataset(function, curves, "damage_state", advice=ADVICE, argument="curves")
    if not curves["damage_state"].ndim:  # one that was selected, as by curves.sel(damage_state="complete")
        own = ("fragility", "replicate", "exceedance_fraction", "fit_status", MEDIAN_STATUS, *OF_CLOUD)
        curves = curves[[name for name in curves if str(name).startswith(own)]].expand_dims("damage_state")
    names = tuple(str(name) for name in np.atleast_1d(curves["damage_state"].values))
    if not names:
        raise ValueError(f"{function}: the fragility curves have no damage state; give a selection that holds some")
    table, limits = table_of(function, curves, names), IntensityLimits.of(function, curves)
    if table is not None and limits:
        table = limited_table(*table, limits)
    if table is not None:
        median = dispersion = np.ones(len(names))
        intensity = curves["intensity" if "fragility_curve" in curves else "stripe"]
        of_units = intensity.attrs
    else:
        check_dataset(function, curves, "fragility_median", "fragility_dispersion", advice=ADVICE, argument="curves")
        median, dispersion = _checked_parameters(function, curves, names)
        of_units = curves["fragility_median"].attrs
    units, measure = str(of_units.get("units", "g")), str(curves.attrs.get("intensity_measure", ""))
    if hazard is not None:
        check_hazard(function, hazard, units, measure)
    shape = shape_of(function, curves, table, median, dispersion)
    if table is None and limits:
        shape = limited_shape(shape, limits, median, dispersion)
    warn_of_penalised(curves, names)
    warn_of_extrapolated(curves, names)
    replicates = (None, None) if table is not None else _replicates(curves, len(names))
    return Curves(names, shape, median, dispersion, *replicates, units, measure, table, limits)


def _checked_parameters(function: str, curves: xr.Dataset, names: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return medians and dispersions, shape [damage_state], once every state has them."""
    median, dispersion = (
        curves[name].values.astype(np.float64) for name in ("fragility_median", "fragility_dispersion")
    )
    if median.shape != (len(names),) or dispersion.shape != median.shape:
        raise ValueError(f"{function}: fragility_median and fragility_dispersion must lie along damage_state alone")
    for name, theta, beta in zip(names, median, dispersion, strict=True):
        if not (np.isfinite(theta) and np.isfinite(beta) and theta > 0 and beta > 0):
            raise ValueError(
                f"{function}: damage state {name!r} has no fragility curve (median {theta:g}, dispersion {beta:g}): "
                "leave it out, as in curves.sel(damage_state=[...]), or add levels to the run that give it a fit"
            )
    return median, dispersion


def warn_of_penalised(curves: xr.Dataset, names: tuple[str, ...]) -> None:
    """Warn of states whose stripes hardly tell a dispersion, which rates and losses depend on."""
    if "fit_status" not in curves or curves["fit_status"].dims != ("damage_state",):
        return
    place = FIT_MEANINGS.index("penalised")
    penalised = [repr(name) for name, each in zip(names, curves["fit_status"].values, strict=True) if each == place]
    if penalised:
        warn_caller(
            f"the fragility curve of {' and '.join(penalised)} is of stripes that are separated: its dispersion comes "
            "of a penalised likelihood, as the stripes hardly tell it, and it has no interval, nor has what follows "
            "from it: add levels to the run where some samples exceed the state and some do not"
        )


def extrapolated(curves: xr.Dataset, names: tuple[str, ...]) -> list[str]:
    """Return the names of the states whose medians are extrapolated, with their values."""
    if MEDIAN_STATUS not in curves or curves[MEDIAN_STATUS].dims != ("damage_state",):
        return []
    median = curves["fragility_median"]
    units = median.attrs.get("units", "g")
    rows = zip(names, curves[MEDIAN_STATUS].values, median.values, strict=True)
    return [f"{name!r} ({value:.3g} {units})" for name, status, value in rows if status == EXTRAPOLATED]


def warn_of_extrapolated(curves: xr.Dataset, names: tuple[str, ...]) -> None:
    """Warn of states whose medians lie outside the intensities that were run."""
    found = extrapolated(curves, names)
    if found:
        warn_caller(
            f"the median of {' and '.join(found)} is an extrapolation, outside the intensities that were run, and so "
            "is what follows from it: add levels to the run about the median"
        )


def warn_of_crossing(found: Curves, taken: str = AS_LIKELY) -> None:
    """Warn of states whose fitted curves cross where it matters.

    Args:
        found: The curves.
        taken: What the caller makes of the heavier state there.
    """
    ends = found.shape.usual(found.median, found.dispersion)
    levels = np.unique(np.geomspace(*ends, 61))
    excess = np.diff(found.probability(levels), axis=0).max(axis=1, initial=0.0)
    for i in np.flatnonzero(excess > CROSSING):
        warn_caller(
            f"the fragility curves of {found.names[i]!r} and {found.names[i + 1]!r} cross: the heavier state is "
            f"likelier by up to {100 * excess[i]:.2g} %, and {taken}"
        )


def warn_of_table_ends(function: str, curves: Curves, hazard: HazardLogicTree, rate: np.ndarray) -> None:
    """Warn of tables whose first or last probability decides the annual rates, as nothing is known beyond."""
    _warn_of_minimum(function, curves, hazard, rate)
    if curves.table is None:
        return
    levels, probable = curves.table
    for name, whole, row in zip(curves.names, rate, probable, strict=True):
        begins = [begin_of(each, levels) for each in hazard.curves]
        at_begin = [
            np.interp(x, levels, row) * float(each.rate_of(x)) for x, each in zip(begins, hazard.curves, strict=True)
        ]
        is_limit = 0 < levels[0] <= curves.limits.no_damage  # below which there is no damage
        if hazard.weights @ at_begin > CUT_SHARE * whole > 0 and not is_limit:
            begin = max(begins)
            advice = "begin where it is next to 0" if levels[0] > 0 else "give a hazard curve that begins lower"
            warn_caller(
                f"{function}: the fragility curve of {name!r} begins at {begin:g} {curves.units} with a "
                f"probability of {np.interp(begin, levels, row):.3g}, and is taken to be 0 below"
                f"{'' if levels[0] > 0 else ', where the hazard curve has no point'}: {advice}"
            )
        is_maximum = levels[-1] >= curves.limits.maximum  # above which the curve is said to stay
        if (1 - row[-1]) * float(hazard.rate_of(levels[-1])) > CUT_SHARE * whole and not is_maximum:
            warn_caller(
                f"{function}: the fragility curve of {name!r} ends at {levels[-1]:g} {curves.units} with a probability "
                f"of {row[-1]:.3g}, and is taken to stay there: go on to higher intensities"
            )


def _warn_of_minimum(function: str, curves: Curves, hazard: HazardLogicTree, rate: np.ndarray) -> None:
    """Warn of curves that keep a probability below their minimum intensity, if that decides the annual rates."""
    least, below = curves.limits.minimum, curves.limits.rate_below_minimum(hazard)
    if below == 0:
        return
    for name, whole, probable in zip(curves.names, rate, curves.probability(np.array([least]))[:, 0], strict=True):
        if probable * below > CUT_SHARE * whole > 0:
            warn_caller(
                f"{function}: below its minimum intensity of {least:g} {curves.units} (minIML) the fragility curve of "
                f"{name!r} keeps its probability of {probable:.3g}, which makes {100 * probable * below / whole:.2g} % "
                "of the rate, down to the first point of the hazard curve: set curves.attrs['no_damage_limit'] to an "
                "intensity that causes no damage"
            )


def check_hazard(function: str, hazard: Hazard, units: str, measure: str) -> None:
    """Raise a ValueError unless a hazard is of these units and this intensity measure."""
    if hazard.units != units:
        advice = f"convert the hazard's intensities to {units!r}"
        if hazard.units == "g" and hazard.measure in UNNAMED:
            # As of a curve that was made without units, which is what users forget.
            of_measure = f"measure={measure!r}, " if measure not in UNNAMED else ""
            advice = (
                f"a HazardCurve without units is taken in g; if its intensities are in {units!r}, say so by "
                f"HazardCurve(..., {of_measure}units={units!r}), else {advice}"
            )
        raise ValueError(f"{function}: the hazard is in {hazard.units!r} and the medians in {units!r}: {advice}")
    warn_unless_compared(f"{function}: the hazard and the curves", hazard.measure, measure)
    if same_measure(hazard.measure, measure) is False:
        raise ValueError(
            f"{function}: the hazard is of {hazard.measure!r} and the curves are of {measure!r}; take the hazard of "
            "that measure (interpolate between periods), or measure='' if they are to be taken as one"
        )


def place_of_state(function: str, curves: Curves, damage_state: str | None) -> int:
    """Return the place of a damage state, the last where none is named."""
    if damage_state is None:
        return len(curves.names) - 1
    one_of(f"damage state of {function}", damage_state, curves.names)
    return curves.names.index(damage_state)


def interval_attributes(curves: Curves, branches: int, confidence: float) -> dict[str, Any]:
    """Return attributes that say what an interval is of."""
    parts = []
    if curves.replicate_median is not None:
        parts.append(f"{len(curves.replicate_median)} replicates of the fragility curves")
    if branches > 1:
        parts.append(f"{branches} weighted branches of the hazard's logic tree")
    said = f"percentiles over {' and '.join(parts)}" if parts else "none: neither replicates nor branches"
    return {"confidence": float(confidence), "interval_method": said}


def _replicates(curves: xr.Dataset, states: int) -> tuple[np.ndarray | None, np.ndarray | None]:
    if "replicate_median" not in curves or "replicate_dispersion" not in curves:
        return None, None
    median, dispersion = (
        curves[name].transpose("replicate", "damage_state").values.astype(np.float64).reshape(-1, states)
        for name in ("replicate_median", "replicate_dispersion")
    )
    good = np.isfinite(median) & np.isfinite(dispersion) & (median > 0) & (dispersion > 0)
    if len(good) < 2 or not good.any():
        return None, None
    return np.where(good, median, np.nan), np.where(good, dispersion, np.nan)
