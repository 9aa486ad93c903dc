"""Fragility curves as hazard and losses take them: medians, dispersions and replicates of them, checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.core.checks import check_dataset, one_of
from warpdyn.risk.hazard.measures import same_measure, warn_unless_compared
from warpdyn.risk.hazard_curves import Hazard
from warpdyn.statistics.estimators import LOGNORMAL

ADVICE = "give what fragility(run, limits) returned"


@dataclass(frozen=True, eq=False)
class Curves:
    """Lognormal fragility curves of the damage states of one building.

    Args:
        names: Damage states, from the lightest on.
        median: Median capacity [units], shape [damage_state].
        dispersion: Dispersion [1], shape [damage_state].
        replicate_median: Draws from the sampling distribution of the medians, shape [replicate, damage_state], NaN
            where a state has none; None if there are none at all.
        replicate_dispersion: Those of the dispersions.
        units: Units of the medians.
        measure: Name of the intensity measure.
    """

    names: tuple[str, ...]
    median: np.ndarray
    dispersion: np.ndarray
    replicate_median: np.ndarray | None
    replicate_dispersion: np.ndarray | None
    units: str
    measure: str


def curves_of(function: str, curves: xr.Dataset, hazard: Hazard | None = None) -> Curves:
    """Return the curves of a dataset, or raise an error that names the state without a fit.

    Args:
        function: The public function.
        curves: What `fragility` returned, or a dataset of `fragility_median` and `fragility_dispersion`.
        hazard: What the curves are to be put together with: of the same units and intensity measure.

    Raises:
        TypeError: If `curves` is no Dataset.
        ValueError: If a variable is missing, curves are not lognormal, a state has no fit, or units or measure are not
            the hazard's.
    """
    check_dataset(function, curves, "fragility_median", "fragility_dispersion", "damage_state", advice=ADVICE)
    shape = curves.attrs.get("fragility_shape", LOGNORMAL.name)
    if shape != LOGNORMAL.name:
        raise ValueError(
            f"{function}: the curves are of the shape {shape!r}, and what is computed here is of lognormal curves; fit "
            "these: estimator='lognormal' or 'ordinal' of fragility(), 'censored' of fragility_of_cloud()"
        )
    if not curves["damage_state"].ndim:  # one that was selected, as by curves.sel(damage_state="complete")
        curves = curves[[name for name in curves if str(name).startswith(("fragility", "replicate"))]]
        curves = curves.expand_dims("damage_state")
    names = tuple(str(name) for name in curves["damage_state"].values)
    if not names:
        raise ValueError(f"{function}: the fragility curves have no damage state; give a selection that holds some")
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
    units = str(curves["fragility_median"].attrs.get("units", "g"))
    measure = str(curves.attrs.get("intensity_measure", ""))
    if hazard is not None:
        check_hazard(function, hazard, units, measure)
    return Curves(names, median, dispersion, *_replicates(curves, len(names)), units, measure)


def check_hazard(function: str, hazard: Hazard, units: str, measure: str) -> None:
    """Raise a ValueError unless a hazard is of these units and this intensity measure."""
    if hazard.units != units:
        raise ValueError(
            f"{function}: the hazard is in {hazard.units!r} and the medians in {units!r}: convert the hazard's "
            "intensities"
        )
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
