"""A set of fragility curves: the curves of all damage states of one building, with one shape, checked once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.estimators import FIT_MEANINGS
from warpdyn.answers.risk.curves.shapes import CLOUD_VARIABLES, Shape, Table, points_of, shape_of
from warpdyn.answers.risk.hazard_curves import Hazard, HazardCurve, HazardLogicTree
from warpdyn.answers.risk.integrals.intensity_limits import IntensityLimits, limited_shape, limited_table
from warpdyn.foundations.core.checks import check_dataset, one_of
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.output_variables import EXTRAPOLATED, MEDIAN_STATUS, UNNAMED
from warpdyn.model.ground_motions.measures.names import same_measure, warn_unless_compared

ADVICE = "give the result of fragility(run, limits)"


@dataclass(frozen=True, eq=False)
class CurveSet:
    """Fragility curves of all damage states of one building; all curves have the same shape (such as lognormal).

    Args:
        names: Names of the damage states, from the lightest to the heaviest.
        shape: Shape of the curves, before limits of the intensities are applied.
        median: Median capacity [units], shape [damage_state]; 1 if the curves are a table.
        dispersion: Dispersion [1], shape [damage_state]; 1 if the curves are a table.
        units: Units of the intensities.
        measure: Name of the intensity measure; "" if it is unknown.
        replicate_median: Draws from the sampling distribution of the medians, shape [replicate, damage_state]; NaN for
            damage states without draws. None: the curves have no draws.
        replicate_dispersion: Draws of the dispersions, of the same shape.
        table: For curves given as points: intensities, shape [point], and probabilities, shape [damage_state, point],
            after limits of the intensities were applied. None: curves with parameters.
        limits: Limits of the intensities (noDamageLimit, minIML and maxIML in OpenQuake's NRML files).
    """

    names: tuple[str, ...]
    shape: Shape
    median: np.ndarray
    dispersion: np.ndarray
    units: str = "g"
    measure: str = ""
    replicate_median: np.ndarray | None = None
    replicate_dispersion: np.ndarray | None = None
    table: Table | None = None
    limits: IntensityLimits = IntensityLimits()  # noqa: RUF009 (frozen)

    @classmethod
    def from_dataset(
        cls, function: str, curves: xr.Dataset, hazard: Hazard | None = None, *, points: str = ""
    ) -> CurveSet:
        """Return the curves of a dataset, after checks.

        Args:
            function: Name of the public function that was called, for messages.
            curves: The result of `fragility`, of another function that returns fragility curves, or of
                `read_nrml_fragility`; or a dataset with medians and dispersions, or with a table of points, as
                described in `annual_rates`.
            hazard: A hazard that must have the same units and intensity measure as the curves; None: no such check.
            points: Name of a variable that is read as a table of points even if the dataset has medians, such as
                "exceedance_fraction"; the limits of the intensities are not applied to it. "": no such variable.

        Raises:
            TypeError: If `curves` is not a Dataset.
            ValueError: If a variable is missing, two damage states have the same name, a state has no fit, or the
                hazard has other units or another measure.
        """
        check_dataset(function, curves, "damage_state", advice=ADVICE, argument="curves")
        if not curves["damage_state"].ndim:  # a single state, as from curves.sel(damage_state="complete")
            kept = ("fragility", "replicate", "exceedance_fraction", "fit_status", MEDIAN_STATUS, *CLOUD_VARIABLES)
            curves = curves[[name for name in curves if str(name).startswith(kept)]].expand_dims("damage_state")
        names = tuple(str(name) for name in curves["damage_state"].values)
        if not names:
            raise ValueError(f"{function}: the fragility curves have no damage state: select at least one")
        if len(set(names)) < len(names):
            raise ValueError(
                f"{function}: two damage states have the same name: {', '.join(names)}: "
                "rename one of them in curves['damage_state']"
            )
        limits, table = IntensityLimits.of(function, curves), points_of(function, curves, names, points)
        draws: tuple[np.ndarray | None, np.ndarray | None] = (None, None)
        if table is not None:
            median = dispersion = np.ones(len(names))
            attributes = curves["intensity" if table.name == "fragility_curve" else "stripe"].attrs
            table = limited_table(table, limits) if limits and not points else table
        else:
            median, dispersion = _parameters(function, curves, names)
            attributes, draws = curves["fragility_median"].attrs, _replicates(curves, len(names))
        units, measure = str(attributes.get("units", "g")), str(curves.attrs.get("intensity_measure", ""))
        if hazard is not None:
            check_hazard(function, hazard, units, measure)
        shape = shape_of(function, curves, table, median, dispersion)
        if not points:
            warn_of_unsure_fits(curves, names)
        return cls(names, shape, median, dispersion, units, measure, *draws, table, limits)

    @cached_property
    def limited(self) -> Shape:
        """The shape of the curves after limits of the intensities are applied."""
        if self.table is not None or not self.limits:
            return self.shape
        return limited_shape(self.shape, self.limits, self.median, self.dispersion)

    @property
    def rising_range(self) -> tuple[float, float]:
        """Lowest and highest intensity [units] of the range in which the curves rise from nearly 0 to nearly 1."""
        low, high = self.limited.usual(self.median, self.dispersion)
        return low.min(), high.max()

    def probability(self, intensity: np.ndarray) -> np.ndarray:
        """Return the probability of exceedance at intensities [units], shape [damage_state, point]."""
        return self.limited.probability(intensity, self.median, self.dispersion)

    def replicate_probability(self, intensity: np.ndarray) -> np.ndarray | None:
        """Return the exceedance probabilities of the draws, [replicate, damage_state, point]; None without draws."""
        if self.replicate_median is None or self.replicate_dispersion is None:
            return None
        return self.limited.probability(intensity, self.replicate_median, self.replicate_dispersion)

    def rates(self, hazard: HazardLogicTree, *, ordered: bool = False) -> np.ndarray:
        """Return the annual rate of reaching each damage state [1/year], for each branch of a hazard.

        Args:
            hazard: The hazard.
            ordered: Whether crossing curves are corrected, so that a heavier state is at most as likely as a lighter
                one at every intensity.

        Returns:
            Rates, shape [branch, damage_state].

        Raises:
            ValueError: If a rate is infinite.
        """
        found = []
        for each in hazard.curves:
            found.append(self.limited.rates(each, self.median, self.dispersion, ordered=ordered))
            self._check_bounded(each, found[-1])
        return np.stack(found)

    def sampled_rates(self, hazard: HazardLogicTree, *, ordered: bool = False) -> np.ndarray:
        """Return the annual rates [1/year] for each draw of the curves and each branch of a hazard; NaN if infinite.

        The shape is [replicate, branch, damage_state]. If the curves have no draws, the fitted curves are the only
        replicate. Arguments: see `rates`.
        """
        if self.replicate_median is None or self.replicate_dispersion is None:
            return self.rates(hazard, ordered=ordered)[None]
        found = [
            self.limited.rates(each, self.replicate_median, self.replicate_dispersion, ordered=ordered)
            for each in hazard.curves
        ]
        return np.where(np.isfinite(found), found, np.nan).swapaxes(0, 1)

    def rates_by_bin(self, hazard: HazardCurve, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return annual rates [1/year] from intensities within each bin, below all bins and above all bins.

        Args:
            hazard: The hazard curve.
            edges: Edges of the bins [units], increasing.

        Returns:
            Rates within the bins, shape [damage_state, bin]; below them, shape [damage_state]; above them, of this
            shape.
        """
        parts = self.limited.rates_by_bin(hazard, edges, self.median, self.dispersion)
        self._check_bounded(hazard, parts[1])
        return parts

    def _check_bounded(self, hazard: HazardCurve, rates: np.ndarray) -> None:
        for state in np.flatnonzero(~np.isfinite(rates)):
            raise ValueError(
                f"the annual rate of {self.names[state]!r} is infinite: below the first point of the hazard curve "
                f"({hazard.intensity[0]:.3g} {hazard.units}) the extrapolated hazard rises faster than the fragility "
                "curve falls. Give a hazard curve that starts at a lower intensity, where it is less steep, or fit "
                "lognormal curves"
            )

    def shares_beyond(self, hazard: HazardLogicTree) -> np.ndarray:
        """Return the shares of the annual rates [1] that are from intensities beyond the hazard points.

        The first row contains the shares below the first point, the second row the shares above the last point; the
        shape is [2, damage_state].
        """
        parts = 0.0
        for weight, each in zip(hazard.weights, hazard.curves, strict=True):
            within, below, above = self.rates_by_bin(each, each.intensity[[0, -1]])
            parts = parts + weight * np.stack([below, above, within.sum(axis=-1)])
        return np.asarray(parts)[:2] / np.sum(parts, axis=0)

    def place_of(self, function: str, damage_state: str | None) -> int:
        """Return the index of a damage state, given by its name; None: the heaviest damage state."""
        if damage_state is None:
            return len(self.names) - 1
        one_of(f"damage state of {function}", damage_state, self.names)
        return self.names.index(damage_state)

    def interval_attributes(self, branches: int, confidence: float) -> dict[str, Any]:
        """Return the attributes `confidence` and `interval_method` of a result, for `branches` hazard branches."""
        parts = []
        if self.replicate_median is not None:
            parts.append(f"{len(self.replicate_median)} replicates of the fragility curves")
        if branches > 1:
            parts.append(f"{branches} weighted branches of the hazard's logic tree")
        words = f"percentiles over {' and '.join(parts)}" if parts else "none: neither replicates nor branches"
        return {"confidence": float(confidence), "interval_method": words}


def _parameters(function: str, curves: xr.Dataset, names: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return the medians and dispersions of a dataset, shape [damage_state]; raise an error if a state lacks them."""
    keys = "fragility_median", "fragility_dispersion"
    check_dataset(function, curves, *keys, advice=ADVICE, argument="curves")
    median, dispersion = (curves[key].values.astype(np.float64) for key in keys)
    if median.shape != (len(names),) or dispersion.shape != median.shape:
        raise ValueError(
            f"{function}: fragility_median and fragility_dispersion must have the dimension damage_state: {ADVICE}"
        )
    for name, theta, beta in zip(names, median, dispersion, strict=True):
        if not (0 < theta < np.inf and 0 < beta < np.inf):
            raise ValueError(
                f"{function}: damage state {name!r} has no fragility curve (median {theta:g}, dispersion {beta:g}). "
                "Add levels to the run at which some samples exceed it and some do not, or leave the state out: "
                f"curves.drop_sel(damage_state={name!r})"
            )
    return median, dispersion


def _replicates(curves: xr.Dataset, states: int) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the draws of medians and dispersions, shape [replicate, damage_state]; (None, None) without draws."""
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


def check_hazard(function: str, hazard: Hazard, units: str, measure: str) -> None:
    """Raise a ValueError unless the hazard has the units and the intensity measure of the fragility curves.

    Warn if the hazard does not name its measure, because curves of another period would not be detected.
    """
    if hazard.units != units:
        advice = f"convert the hazard's intensities to {units!r}"
        if hazard.units == "g" and hazard.measure in UNNAMED:  # the user may have forgotten to give the units
            named = f"measure={measure!r}, " if measure not in UNNAMED else ""
            advice = (
                f"a HazardCurve without units is in g. If its intensities are in {units!r}, write "
                f"HazardCurve(..., {named}units={units!r}); otherwise {advice}"
            )
        raise ValueError(f"{function}: the hazard is in {hazard.units!r} and the medians in {units!r}: {advice}")
    if hazard.is_unnamed and measure not in UNNAMED:
        warn_caller(
            f"{function}: the hazard does not name its intensity measure, so that a hazard of another measure or "
            f"period than that of the curves ({measure!r}) is not detected. Give HazardCurve(..., "
            f"measure={measure!r}), or measure='' to skip this check"
        )
    warn_unless_compared(f"{function}: the hazard and the curves", hazard.measure, measure)
    if same_measure(hazard.measure, measure) is False:
        raise ValueError(
            f"{function}: the measure of the hazard is {hazard.measure!r} and that of the curves is "
            f"{measure!r}. Give the hazard of the measure {measure!r} (interpolate between periods), or "
            "HazardCurve(..., measure='') to skip this check"
        )


def extrapolated(curves: xr.Dataset, names: tuple[str, ...]) -> list[str]:
    """Return a text for each damage state whose median is extrapolated, with its name and median, for a message."""
    if MEDIAN_STATUS not in curves or curves[MEDIAN_STATUS].dims != ("damage_state",):
        return []
    median = curves["fragility_median"]
    units = median.attrs.get("units", "g")
    rows = zip(names, curves[MEDIAN_STATUS].values, median.values, strict=True)
    return [f"{name!r} ({value:.3g} {units})" for name, status, value in rows if status == EXTRAPOLATED]


def warn_of_unsure_fits(curves: xr.Dataset, names: tuple[str, ...]) -> None:
    """Warn of medians that are extrapolated, and of penalised fits, whose dispersion is uncertain."""
    if "fit_status" in curves and curves["fit_status"].dims == ("damage_state",):
        place = FIT_MEANINGS.index("penalised")
        found = [repr(name) for name, each in zip(names, curves["fit_status"].values, strict=True) if each == place]
        if found:
            warn_caller(
                f"the stripes of {' and '.join(found)} are separated: the dispersion is from a penalised likelihood "
                "and has no interval, so results that depend on it have none. Add levels to the run at which some "
                "samples exceed the state and some do not"
            )
    found = extrapolated(curves, names)
    if found:
        warn_caller(
            f"the median of {' and '.join(found)} is an extrapolation, outside the intensities that were run, and so "
            "are the results that depend on it: add levels to the run near the median"
        )
