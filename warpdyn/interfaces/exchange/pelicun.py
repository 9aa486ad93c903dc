"""Writer of demand samples for pelicun, SimCenter's engine for loss assessment by FEMA P-58."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.campaigns.running.joining.duplicates import check_samples
from warpdyn.campaigns.running.selections import select_storeys
from warpdyn.foundations.core.checks import check_dataset, real_number, real_numbers
from warpdyn.foundations.core.messages import tell
from warpdyn.foundations.core.output_variables import COLLAPSED, OK, STOREY_KIND, STRIPED, measure_name
from warpdyn.foundations.core.plausibility import warn_of_implausible_limits
from warpdyn.interfaces.exchange.measures import openquake_measure
from warpdyn.interfaces.exchange.text_files import check_same_table, checked_path, write_text

FUNCTION = "write_pelicun_demands"
EVENT, DIRECTION = 1, 1
# Unit of each intensity measure in pelicun. A key consists of the name of the measure in OpenQuake and the unit in the
# run.
INTENSITIES = {("PGA", "g"): "g", ("SA", "g"): "g", ("PGV", "m s-1"): "mps", ("PGD", "m"): "m"}


def write_pelicun_demands(
    run: xr.Dataset,
    path: str | os.PathLike,
    *,
    level: float | Sequence[float] | None = None,
    collapse_drift_ratio: float | None = None,
    overwrite: bool = False,
) -> Path:
    """Write the demands of a run as a demand sample of pelicun, with one row per sample.

    Columns are the peak storey drift ratios (`1-PID-1-1` [rad] for storey 1) and, if they were recorded, residual drift
    ratios (`1-RID-1-1` [rad]) and peak floor accelerations (`1-PFA-1-1` [m/s2]). Floor 0 has the peak ground
    acceleration of the scaled motion. The last column is the intensity measure, if pelicun supports it: `1-SA_0.75-0-1`
    or `1-PGA-0-1` [g], PGV [m/s] or PGD [m]. If a sample failed, the table has the column `1-ERROR-0-1`, by which
    pelicun ignores failed samples. For a building on isolators, storey 1 is the first storey above the isolators, and
    floor 0 is the base slab. The storey of a tuned mass damper is not written.

    FEMA P-58 treats collapses separately, without demands. pelicun recognises a collapse by a storey drift ratio at or
    above a limit: `CensorUpper` of PID in the calibration of its demand model, or the capacity of its collapse check.
    Therefore the row of a collapsed sample contains the drifts reached until collapse and no residual drifts, and the
    drift ratio of the storey that collapsed is at least the limit. Samples without collapse are below the limit. A
    message of the logger "warpdyn" reports the limit that must be set in pelicun.

    Args:
        run: Result of `simulate` for a building, with the recorder "drift". The recorders "acceleration" and "residual"
            add the columns of floor accelerations and residual drifts.
        path: Path of the file that is written; its name ends in ".csv".
        level: Intensity level of the stripe or stripes that are written [unit of `im_level`]; required if the run has
            several.
        collapse_drift_ratio: Storey drift ratio [1] that separates collapsed samples from the others. If a collapsed
            sample ended below it (because of rounding, or of a smaller drift capacity of a storey), the limit is
            written instead. None: the `collapse_drift_ratio` of the scene. If the scene does not define it, or a sample
            without collapse reaches it, drifts are written unchanged; an error is raised if no limit separates the
            collapsed samples from the others.
        overwrite: If True, replace an existing file of any content. If False, replace only a table with the same
            columns.

    Returns:
        Path of the written file.

    Raises:
        ValueError: If the run is that of a portfolio or an event sequence; if the run lacks drifts, the peak
            accelerations of its motions or the stripe; if every sample failed; or if a sample without collapse reaches
            the limit.
        TypeError: If `run` is not a Dataset.
        OSError: If the file cannot be written, or exists with other content and `overwrite` is False.

    Example:
        >>> path = wd.write_pelicun_demands(run, "demands.csv", level=0.4, collapse_drift_ratio=0.1)  # g
        >>> len(wd.read_pelicun_demands(path)["sample"])
        24
    """
    path = checked_path(FUNCTION, path, ".csv")
    needed = ("peak_storey_drift_ratio", "status", "sample")
    check_dataset(
        FUNCTION, run, *needed, advice="pass the result of simulate() with the recorder 'drift'", argument="run"
    )
    for dimension, selection in (("archetype", "select_archetype"), ("event", "select_event")):
        if dimension in run.dims:
            raise ValueError(f"{FUNCTION}: the run has several {dimension}s; select one by {selection}(run, name)")
    check_samples(FUNCTION, run)
    run = _at_levels(run, level)
    ground, run = _building_alone(run)
    status = decoded_status(run["status"])
    if (status > COLLAPSED).all():
        raise ValueError(f"{FUNCTION}: every sample failed: run simulate() with a shorter step=")
    drift = run["peak_storey_drift_ratio"].transpose("sample", "storey").values.astype(np.float64)
    drift = _with_collapses(run, drift, status, collapse_drift_ratio)
    columns: dict[str, tuple[str, np.ndarray]] = {}
    if "peak_floor_acceleration" in run:
        columns[_column("PFA", 0)] = "mps2", _peak_ground_acceleration(run) if ground is None else ground
        floors = run["peak_floor_acceleration"].transpose("floor", "sample").values
        columns |= {_column("PFA", floor): ("mps2", values) for floor, values in enumerate(floors, 1)}
    columns |= {_column("PID", storey): ("rad", values) for storey, values in enumerate(drift.T, 1)}
    if "residual_drift_ratio" in run:
        residual = run["residual_drift_ratio"].transpose("storey", "sample").values
        residual = np.where(status == COLLAPSED, np.nan, np.abs(residual))
        columns |= {_column("RID", storey): ("rad", values) for storey, values in enumerate(residual, 1)}
    columns |= _intensity(run)
    if (status > COLLAPSED).any():
        # pelicun 3.10 ignores a column with the plain name ERROR if the other names have four parts.
        columns[_column("ERROR", 0)] = "", (status > COLLAPSED).astype(np.int8)
    table = pd.DataFrame({name: values for name, (_, values) in columns.items()}, index=run["sample"].values)
    check_same_table(FUNCTION, path, ["", *table.columns], overwrite)
    header, _, rows = table.to_csv(lineterminator="\n").partition("\n")
    units = ",".join(["Units", *(unit for unit, _ in columns.values())])
    return write_text(path, f"{header}\n{units}\n{rows}")


def _column(kind: str, location: int) -> str:
    return f"{EVENT}-{kind}-{location}-{DIRECTION}"


def _at_levels(run: xr.Dataset, level: float | Sequence[float] | None) -> xr.Dataset:
    """Return the samples of a run at the given intensity levels; None: all samples of a run with at most one stripe."""
    has_levels = "im_level" in run.coords
    levels = np.unique(run["im_level"].values) if has_levels else np.empty(0)
    is_striped = has_levels and run["im_level"].attrs.get("design") == STRIPED
    if level is None:
        if is_striped and levels.size > 1:
            raise ValueError(
                f"{FUNCTION}: the run has {levels.size} stripes, but an assessment by FEMA P-58 uses one: give level=, "
                f"one or several of {', '.join(f'{value:g}' for value in levels)}"
            )
        return run
    if not is_striped:
        raise ValueError(f"{FUNCTION}: level= selects stripes, but the run has none: remove level=")
    kept = np.zeros(run.sizes["sample"], dtype=bool)
    for value in np.atleast_1d(real_numbers("level", level)):
        on_stripe = np.isclose(run["im_level"].values, value, rtol=1e-9, atol=0)
        if not on_stripe.any():
            raise ValueError(
                f"{FUNCTION}: the run has no stripe at {value:g}; level= may be "
                f"{', '.join(f'{each:g}' for each in levels)}"
            )
        kept |= on_stripe
    return run.isel(sample=np.flatnonzero(kept))


def _with_collapses(run: xr.Dataset, drift: np.ndarray, status: np.ndarray, limit: float | None) -> np.ndarray:
    """Return drift ratios, shape [sample, storey], in which collapsed samples are at or above the collapse limit."""
    if limit is not None:
        limit = real_number(f"{FUNCTION}: collapse_drift_ratio", limit, above=0)
        warn_of_implausible_limits({"": limit}, "collapse_drift_ratio")
    collapsed, standing = np.flatnonzero(status == COLLAPSED), np.flatnonzero(status == OK)
    largest = drift[standing].max(axis=1, initial=0.0)
    highest = largest.max(initial=0.0)
    if limit is not None and highest >= limit:
        worst = standing[int(np.argmax(largest))]
        raise ValueError(
            f"{FUNCTION}: sample {int(run['sample'].values[worst])} did not collapse and has a storey drift ratio of "
            f"{highest:.4g}, which is not below collapse_drift_ratio = {limit:g} ({np.sum(largest >= limit)} of "
            f"{standing.size} such samples): give collapse_drift_ratio= above {highest:.4g}"
        )
    if not collapsed.size:
        return drift
    if limit is None:
        of_scene = _limit_of_scene(run)
        limit = of_scene if of_scene is not None and of_scene > highest else None
    at_end = np.nan_to_num(drift[collapsed]).max(axis=1)
    if limit is None:
        if at_end.min() <= highest:
            raise ValueError(
                f"{FUNCTION}: the smallest storey drift ratio of a collapsed sample is {at_end.min():.4g}, the largest "
                f"of a sample without collapse {highest:.4g}, so pelicun cannot separate them by a limit: give "
                f"collapse_drift_ratio= above {highest:.4g}; collapsed samples then get at least this value"
            )
        # The smaller bound is rounded up and the larger one down, so that any limit between the printed bounds is
        # valid.
        bounds = np.ceil(highest * 1e5) / 1e5, np.floor(at_end.min() * 1e5) / 1e5
        above, most = bounds if bounds[0] < bounds[1] else (highest, at_end.min())
        allowed = f"above {above:.10g} and at most {most:.10g}"
    else:
        if "storey_of_collapse" in run:
            storey = run["storey_of_collapse"].values[collapsed].astype(np.int64) - 1
            storey = np.where(storey >= 0, storey, np.nan_to_num(drift[collapsed]).argmax(axis=1))
        else:
            storey = np.nan_to_num(drift[collapsed]).argmax(axis=1)
        drift = drift.copy()
        drift[collapsed, storey] = np.fmax(drift[collapsed, storey], limit)
        allowed = f"{limit:g}"
    tell(
        f"{FUNCTION}: {collapsed.size} of {status.size} samples collapsed; in pelicun set CensorUpper of PID, or the "
        f"storey drift ratio of the collapse check, to {allowed}"
    )
    return drift


def _limit_of_scene(run: xr.Dataset) -> float | None:
    """Return the `collapse_drift_ratio` [1] of the scene of a run; None if the run does not contain it."""
    try:
        limit = json.loads(run.attrs.get("scene", "{}")).get("collapse_drift_ratio")
    except (json.JSONDecodeError, AttributeError, TypeError):
        return None
    return limit if isinstance(limit, float) and limit > 0 else None


def _building_alone(run: xr.Dataset) -> tuple[np.ndarray | None, xr.Dataset]:
    """Return the peak accelerations of the base slab, and the run without isolators and tuned mass damper.

    The accelerations [m/s2] have the shape [sample]. They are None if the building has no isolators at its base, or if
    the run has no floor accelerations.
    """
    if STOREY_KIND not in run.coords or not run[STOREY_KIND].values.any():
        return None, run
    own = np.flatnonzero(run[STOREY_KIND].values == 0)
    ground = None
    if own[0] > 0 and "peak_floor_acceleration" in run:
        ground = run["peak_floor_acceleration"].transpose("floor", "sample").values[own[0] - 1]
    return ground, select_storeys(run, int(own[0]) + 1, int(own[-1]) + 1)


def _peak_ground_acceleration(run: xr.Dataset) -> np.ndarray:
    """Return the peak ground acceleration [m/s2] of the scaled motion of each sample, shape [sample]."""
    needed = ("motion_peak_acceleration", "motion_index", "scale_factor_of_motion")
    missing = [name for name in needed if name not in run]
    if missing:
        raise ValueError(
            f"{FUNCTION}: the run has no {missing[0]}, so the peak ground acceleration (floor 0) is unknown; to "
            "write only drifts, pass run.drop_vars('peak_floor_acceleration')"
        )
    return run["motion_peak_acceleration"].values[run["motion_index"].values] * run["scale_factor_of_motion"].values


def _intensity(run: xr.Dataset) -> dict[str, tuple[str, np.ndarray]]:
    """Return name, unit and values of the column for the intensity measure; empty if pelicun does not support it."""
    if "im_level" not in run.coords:
        return {}
    attributes = run["im_level"].attrs
    try:
        measure = openquake_measure(measure_name(run))
    except ValueError:
        return {}
    kind, _, period = measure.rstrip(")").partition("(")
    unit = INTENSITIES.get((kind, attributes.get("units", "")))
    if unit is None:
        return {}
    name = _column(f"SA_{float(period):g}" if kind == "SA" else kind, 0)
    return {name: (unit, run["im_level"].values.astype(np.float64))}
