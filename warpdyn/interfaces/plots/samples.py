"""Demands of the samples of a run that did not fail, and fractiles of demands with collapses, for figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.campaigns.running.selections import check_one_unit, of_building, without_added_places
from warpdyn.foundations.core.checks import check_dataset
from warpdyn.foundations.core.output_variables import COLLAPSED, STRIPED, measure_name

SHARES = (0.16, 0.5, 0.84)  # fractiles that the figures show


@dataclass(frozen=True, eq=False)
class Demands:
    """One demand, such as the peak drift ratio, of the samples of a run that did not fail.

    Args:
        values: The demand, shape [sample] or [sample, storey]; for a collapsed sample, the demand until its collapse.
        collapsed: True for each sample that collapsed, shape [sample].
        level: Intensity of each sample [units], shape [sample].
        structure: Index of the structure of each sample, shape [sample].
        motion: Index of the ground motion of each sample, shape [sample].
        is_striped: True if many samples share each intensity level (stripes).
        measure: Name and units of the intensity measure, as the label of an axis.
        measure_name: Name of the intensity measure.
        units: Units of the intensity measure.
        beyond: True for each value that counts as infinite because of a collapse; same shape as `values`. If `values`
            has the dimension storey, only the storey that collapsed counts as infinite.
    """

    values: np.ndarray
    collapsed: np.ndarray
    level: np.ndarray
    structure: np.ndarray
    motion: np.ndarray
    is_striped: bool
    measure: str
    measure_name: str
    units: str
    beyond: np.ndarray

    @property
    def levels(self) -> np.ndarray:
        """The different intensity levels of the samples, in increasing order."""
        return np.unique(self.level)

    @property
    def unlimited(self) -> np.ndarray:
        """The demand as float64, with infinity for each value that counts as infinite (`beyond`)."""
        return np.where(self.beyond, np.inf, self.values.astype(np.float64))

    def fractiles(self) -> np.ndarray:
        """Return the 16, 50 and 84 % fractiles at each level, shape [level, share, ...]; NaN if undefined."""
        demand = self.unlimited
        return np.array([fractiles(demand[self.level == level]) for level in self.levels])

    def collapsed_share(self) -> np.ndarray:
        """Return the share of collapsed samples at each intensity level, shape [level]."""
        return np.array([self.collapsed[self.level == level].mean() for level in self.levels])


def fractiles(demand: np.ndarray, shares: tuple[float, ...] = SHARES) -> np.ndarray:
    """Return fractiles of a demand along its first axis; NaN if too many samples collapsed.

    The median is undefined if more than half of the samples collapsed, and the 84 % fractile if more than 16 %
    collapsed.

    Args:
        demand: Demands of the samples, infinite for collapsed samples, shape [sample, ...].
        shares: For each fractile, the share of samples at or below it.

    Returns:
        Fractiles in the unit of the demand, shape [share, ...].
    """
    counted = np.quantile(demand, shares, axis=0, method="inverted_cdf")
    with np.errstate(invalid="ignore"):
        between = np.quantile(demand, shares, axis=0)
    # An interpolation between a finite and an infinite value is infinite; the finite value is used instead.
    found = np.where(np.isfinite(between), between, counted)
    return np.where(np.isfinite(found), found, np.nan)


def check_run(function: str, run: object, *names: str, advice: str) -> None:
    """Raise an error with advice unless a run contains these variables, a single event and at least one sample."""
    check_dataset(f"plots.{function}", run, *names, advice=advice)
    assert isinstance(run, xr.Dataset)
    if "event" in run.dims:
        raise ValueError(f"plots.{function} draws one event: select it by select_event(run, name)")
    if run.sizes.get("sample", 1) == 0:
        raise ValueError(f"plots.{function}: the run has no samples: check the condition by which you selected samples")


def demands_of(
    function: str, run: xr.Dataset, demand: str, advice: str, *, by_storey: bool = False, by_level: bool = True
) -> Demands:
    """Return a demand of the samples that did not fail, without storeys of isolators and of tuned mass dampers.

    Args:
        function: Name of the plot function, for error messages.
        run: Result of `simulate`.
        demand: Name of the variable, with the dimensions `sample` and `storey`.
        advice: Remedy that the error message for a missing variable contains.
        by_storey: If True, return the value of each storey; if False, the largest value over the storeys.
        by_level: If True, the run must have intensity levels; if False, the levels of a run without them are NaN.

    Raises:
        ValueError: If the run lacks a variable, or all samples failed.
        TypeError: If `run` is not a Dataset.
    """
    if isinstance(run, xr.Dataset) and "capacity" in run:
        raise ValueError(
            f"plots.{function} draws a run, but the dataset contains capacities: draw it by plots.capacities(found); "
            "with capacities(..., keep_curves=True) this includes the curves"
        )
    check_run(function, run, demand, "status", *["im_level"] * by_level, advice=advice)
    if "sample" not in run["status"].dims:
        raise ValueError(
            f"plots.{function}: the run has no dimension sample: select a single sample by isel(sample=[number])"
        )
    status = decoded_status(run["status"])
    kept = np.flatnonzero(status <= COLLAPSED)
    if not kept.size:
        raise ValueError(f"plots.{function}: all {status.size} samples failed: run again with a shorter step=")
    run = without_added_places(run)
    if not by_storey:
        check_one_unit(f"plots.{function}", run, demand)
    values = np.abs(of_building(run, demand).transpose("sample", ...).values[kept])  # residual drifts have a sign
    if by_storey and "archetype_index" in run.coords and np.isnan(values).any():
        raise ValueError(
            f"plots.{function} draws buildings with equal numbers of storeys: use select_archetype(run, name)"
        )
    if by_storey and values.ndim < 2:
        raise ValueError(
            f"plots.{function}: the run has no dimension storey: select a single storey by isel(storey=[number])"
        )
    if not by_storey and values.ndim > 1:
        values = np.fmax.reduce(values, axis=1)  # ignores NaN of storeys that a building of a portfolio lacks
    sample = np.arange(status.size)
    of_sample = {name: run[name].values if name in run else 0 * sample for name in ("structure", "motion_index")}
    collapsed = status[kept] == COLLAPSED
    beyond = np.broadcast_to(collapsed.reshape(-1, *[1] * (values.ndim - 1)), values.shape)
    if values.ndim > 1 and {"storey_of_collapse", "storey"} <= run.keys() | run.coords.keys():
        # In a collapsed sample, demands of storeys that did not collapse count if they are finite.
        here = run["storey_of_collapse"].values[kept, None] == run["storey"].values
        beyond = beyond & (here | ~np.isfinite(values))
    level = run["im_level"] if "im_level" in run else xr.DataArray(np.full(status.size, np.nan))
    return Demands(
        values,
        collapsed,
        level.values[kept].astype(np.float64),
        of_sample["structure"][kept],
        of_sample["motion_index"][kept],
        level.attrs.get("design") == STRIPED,
        label_of_measure(run),
        measure_name(run),
        str(level.attrs.get("units", "g")),
        beyond,
    )


def label_of_measure(run: xr.Dataset) -> str:
    """Return the label of the axis for the intensity measure of a run or of fragility curves: name and units."""
    if "im_level" in run:
        attributes = run["im_level"].attrs
        return f"{measure_name(run)} [{attributes.get('units', 'g')}]"
    units = run["intensity"].attrs.get("units", "g") if "intensity" in run.coords else "g"
    return f"{measure_name(run)} [{units}]"


def percent(share: float) -> str:
    """Return a share [1] as text in percent, with two significant digits below 10 % and without decimals above."""
    return f"{100 * share:.2g} %" if share < 0.1 else f"{100 * share:.0f} %"
