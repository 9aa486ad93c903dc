"""What figures draw of a run's samples: those that did not fail, the demand of each, and fractiles with collapses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.campaigns.running.selections import of_building, without_added_storeys
from warpdyn.foundations.core.checks import check_dataset
from warpdyn.foundations.core.output_variables import COLLAPSED, STRIPED, measure_name

SHARES = (0.16, 0.5, 0.84)


@dataclass(frozen=True, eq=False)
class Demands:
    """A demand of the samples of a run that did not fail.

    Args:
        values: The demand, shape [sample] or [sample, storey]; of a collapsed sample the one up to its collapse.
        collapsed: Which samples collapsed, shape [sample].
        level: Intensity measure of each sample, shape [sample].
        structure: Index of each sample's structure, shape [sample].
        motion: Index of each sample's motion, shape [sample].
        is_striped: Whether each level has many samples.
        measure: The intensity measure with its units, for the label of an axis.
        measure_name: Its name alone.
        units: Its units alone.
        beyond: Where a demand exceeds every value: of a collapsed sample everywhere, or of demands by storey in the
            storey that collapsed; the shape of `values`.
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
        """The distinct levels, increasing."""
        return np.unique(self.level)

    @property
    def unlimited(self) -> np.ndarray:
        """The demand, infinite where it is beyond every value: what it would have come to, nothing says."""
        return np.where(self.beyond, np.inf, self.values.astype(np.float64))

    def fractiles(self) -> np.ndarray:
        """Return the 16, 50 and 84 % fractiles of each level, shape [level, share, ...]; NaN where undefined."""
        demand = self.unlimited
        return np.array([fractiles(demand[self.level == level]) for level in self.levels])

    def collapsed_share(self) -> np.ndarray:
        """Return the share of collapses of each level."""
        return np.array([self.collapsed[self.level == level].mean() for level in self.levels])


def fractiles(demand: np.ndarray, shares: tuple[float, ...] = SHARES) -> np.ndarray:
    """Return fractiles along the first axis, NaN where more than the rest of the samples collapsed.

    The median is undefined where more than half of the samples collapsed, the 84 % fractile where more than 16 % did.

    Args:
        demand: Demands, infinite where a sample collapsed, shape [sample, ...].
        shares: Shares of the samples that are below.

    Returns:
        Shape [share, ...].
    """
    counted = np.quantile(demand, shares, axis=0, method="inverted_cdf")
    with np.errstate(invalid="ignore"):
        between = np.quantile(demand, shares, axis=0)
    # Halfway to a collapse there is nothing; the sample before it is what so many samples do not exceed.
    found = np.where(np.isfinite(between), between, counted)
    return np.where(np.isfinite(found), found, np.nan)


def check_run(function: str, run: object, *names: str, advice: str) -> None:
    """Raise an error with advice unless a figure is given a run with these variables, one event and some samples."""
    check_dataset(f"plots.{function}", run, *names, advice=advice)
    assert isinstance(run, xr.Dataset)
    if "event" in run.dims:
        raise ValueError(f"plots.{function} draws one event: take it by select_event(run, name)")
    if run.sizes.get("sample", 1) == 0:
        raise ValueError(f"plots.{function}: the run has no samples: the selection it was taken by left none")


def demands_of(
    function: str, run: xr.Dataset, demand: str, advice: str, *, by_storey: bool = False, by_level: bool = True
) -> Demands:
    """Return a demand of a run, the largest of all storeys or that of each, but of isolators and mass dampers.

    Args:
        function: The plot, for errors.
        run: The run.
        demand: Name of the variable, which lies along `sample` and `storey`.
        advice: What to draw instead of a dataset that lacks something.
        by_storey: Whether storeys are kept apart.
        by_level: Whether levels must be known; without them, as under random motions, they are NaN.

    Raises:
        ValueError: If the run lacks something, or no sample of it has a result.
        TypeError: If it is no Dataset.
    """
    if isinstance(run, xr.Dataset) and "capacity" in run:
        raise ValueError(
            f"plots.{function} draws a run, and these are capacities: plots.capacities(found) draws them, with the "
            "curves they were found on where capacities(..., keep_curves=True) kept these"
        )
    check_run(function, run, demand, "status", *["im_level"] * by_level, advice=advice)
    if "sample" not in run["status"].dims:
        raise ValueError(f"plots.{function}: the run has no dimension sample: select one by isel(sample=[number])")
    status = decoded_status(run["status"])
    kept = np.flatnonzero(status <= COLLAPSED)
    if not kept.size:
        raise ValueError(f"plots.{function}: all {status.size} samples failed, and there is nothing to draw")
    run = without_added_storeys(run)
    values = np.abs(of_building(run, demand).transpose("sample", ...).values[kept])  # residual drifts have a sign
    if by_storey and "archetype_index" in run.coords and np.isnan(values).any():
        raise ValueError(f"plots.{function} draws buildings of as many storeys: take some by select_archetype")
    if by_storey and values.ndim < 2:
        raise ValueError(f"plots.{function}: the run has no dimension storey: select one by isel(storey=[number])")
    if not by_storey and values.ndim > 1:
        values = np.fmax.reduce(values, axis=1)  # storeys that a building of a portfolio does not have are NaN
    sample = np.arange(status.size)
    of_sample = {name: run[name].values if name in run else 0 * sample for name in ("structure", "motion_index")}
    collapsed = status[kept] == COLLAPSED
    beyond = np.broadcast_to(collapsed.reshape(-1, *[1] * (values.ndim - 1)), values.shape)
    if values.ndim > 1 and {"storey_of_collapse", "storey"} <= run.keys() | run.coords.keys():
        # Other storeys stand: their demands up to the collapse count, if they have any.
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
    """Return the intensity measure of a run or of its fragility curves with its units, as the label of an axis."""
    if "im_level" in run:
        attributes = run["im_level"].attrs
        return f"{measure_name(run)} [{attributes.get('units', 'g')}]"
    units = run["intensity"].attrs.get("units", "g") if "intensity" in run.coords else "g"
    return f"{measure_name(run)} [{units}]"


def percent(share: float) -> str:
    """Return a share in percent, with two digits where it is small."""
    return f"{100 * share:.2g} %" if share < 0.1 else f"{100 * share:.0f} %"
