"""Summary of a run as a few lines of text."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.campaigns.running.labels import BECAUSE
from warpdyn.campaigns.running.selections import select_event
from warpdyn.engine.methods.kinds import MultistepMethod
from warpdyn.engine.methods.table import METHODS
from warpdyn.foundations.core.checks import check_dataset
from warpdyn.foundations.core.description import Text
from warpdyn.foundations.core.output_variables import STATUS_MEANINGS, STOREY_KIND, STOREY_KINDS


def summary(run: xr.Dataset) -> str:
    """Return a few lines of text on a run: status counts, method and steps, collapses, and estimated errors.

    Args:
        run: Result of `simulate`. For a run with `statistics=`, the summary contains the number of failed samples, the
            method and the steps.

    Raises:
        ValueError, TypeError: If `run` is not a result of `simulate`, or contains no samples.

    Example:
        >>> print(wd.summary(run).splitlines()[0])
        144 samples: 144 ok
    """
    # A result of `damage_shares` also contains `failed_samples`, but without the dimension `failure`.
    is_of_statistics = isinstance(run, xr.Dataset) and "failed_samples" in run and "failure" in run.dims
    needed = ("step",) if is_of_statistics else ("status", "integration_step")
    check_dataset("summary", run, *needed, advice="pass the result of simulate()", argument="run")
    check_dataset(
        "summary",
        run,
        "method",
        "dtype",
        "device",
        "seconds_integrating",
        advice="pass the run with its attributes",
    )
    if is_of_statistics:
        failed = run["failed_samples"].to_series()
        counts = ", ".join(f"{count:,} {name}" for name, count in failed.items() if count) or "0"
        head = f"statistics without samples; failed samples: {counts}"
        return Text("\n".join([head, *_integration(run, np.atleast_1d(run.attrs["step"]))]))
    if "sample" not in run.dims:
        raise ValueError("summary: the run has no dimension sample: select a single sample by isel(sample=[number])")
    if not run.sizes["sample"]:
        raise ValueError("summary: the run has no samples: check the condition by which you selected samples")
    if "event" in run.dims:
        names = run["event"].values.tolist()
        return Text("\n".join(f"{name}\n{summary(select_event(run, name))}" for name in names))
    status = np.bincount(run["status"].values, minlength=len(STATUS_MEANINGS))
    outcomes = ", ".join(f"{count:,} {name}" for count, name in zip(status, STATUS_MEANINGS, strict=True) if count)
    lines = [
        f"{run.sizes['sample']:,} samples: {outcomes}",
        *_nested_design(run),
        *_integration(run, run["integration_step"].values),
        *_collapses(run),
    ]
    if "estimated_relative_error" in run:
        table = run["estimated_relative_error"]
        heads = "".join(f"{name:>12}" for name in table["error_statistic"].values)
        lines.append(f"{'estimated relative error':<26}{heads}")
        if isinstance(METHODS.get(str(run.attrs["method"])), MultistepMethod):
            lines.append("(differences of the checked samples from rk4 at half the step, in float64)")
        for demand in table["demand"].values:
            row = "".join(f"{value:>12.2e}" for value in table.sel(demand=demand).values)
            lines.append(f"{demand:<26}{row}")
    return Text("\n".join(lines))


def _nested_design(run: xr.Dataset) -> list[str]:
    """Return a line of text on a nested design (each motion has separate structures); [] for other designs."""
    if not {"structure", "motion_index", "im_level"} <= set(run.variables):
        return []
    structure, motion = run["structure"].values, run["motion_index"].values
    another_structure, another_motion = np.diff(structure) != 0, np.diff(motion) != 0
    is_nested = another_motion.any() and not (another_motion & ~another_structure).any()
    if run["im_level"].attrs.get("design") != "stripes" or not is_nested:
        return []
    structures, motions = 1 + another_structure.sum(), 1 + another_motion.sum()
    return [f"nested design: {structures:,} structures, each under one of {motions:,} motions"]


def _integration(run: xr.Dataset, steps: np.ndarray) -> list[str]:
    """Return lines of text on the integration: method, reason for it, shortest and longest step [s], and time [s]."""
    method = run.attrs["method"]
    return [
        f"{method} in {run.attrs['dtype']} on {run.attrs['device']}, "
        f"steps {steps.min():.4g} to {steps.max():.4g} s, {run.attrs['seconds_integrating']:.3g} s integrating",
        *([f"{method}: {run.attrs[BECAUSE]}"] if BECAUSE in run.attrs else []),
    ]


def _collapses(run: xr.Dataset) -> list[str]:
    """Return a line of text on the storeys or springs, and the times [s], of collapses; [] if no sample collapsed."""
    if "spring_of_collapse" in run:
        springs = ", ".join(f"spring {name!r} ({count:,})" for name, count in collapses_of_springs(run))
        return [f"collapsed in {springs}{_times(run)}"] if springs else []
    if "storey_of_collapse" not in run:
        return []
    storey = run["storey_of_collapse"].values
    if not (storey > 0).any():
        return []
    storeys, counts = np.unique(storey[storey > 0], return_counts=True)
    where = ", ".join(
        f"storey {names_of_storeys(run, number)} ({count:,})" for number, count in zip(storeys, counts, strict=True)
    )
    return [f"collapsed in {where}{_times(run)}"]


def _times(run: xr.Dataset) -> str:
    """Return the first and the last time of collapse [s] as text."""
    time = run["time_of_collapse"].values
    times = time[np.isfinite(time)]
    return f", at {times.min():.4g} to {times.max():.4g} s" if times.size else ""


def collapses_of_springs(run: xr.Dataset) -> list[tuple[str, int]]:
    """Return the names of the springs that collapsed first, with the number of samples."""
    place = run["spring_of_collapse"].values
    places, counts = np.unique(place[place >= 0], return_counts=True)
    names = run["spring"].values
    return [(str(names[each]), int(count)) for each, count in zip(places, counts, strict=True) if each < names.size]


def names_of_storeys(run: xr.Dataset, number: int) -> str:
    """Return the number of a storey as text; isolators and a tuned mass damper are named after the number."""
    if STOREY_KIND not in run.coords:
        return str(number)
    kind = int(run[STOREY_KIND].values[run["storey"].values == number][0])
    return f"{number}, {STOREY_KINDS[kind].replace('_', ' ')}" if kind else str(number)
