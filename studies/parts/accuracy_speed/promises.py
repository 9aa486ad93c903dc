"""Comparison of the choices of `plan`, and of the estimated errors, with the true errors of the study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from parts.accuracy_speed.points import TIMED_RUNS, Point, Settings, every, make_run, statistics, timed
from parts.accuracy_speed.scenes import Charted
from warpdyn.campaigns.accuracy.error_estimate import compare
from warpdyn.campaigns.accuracy.pilot import plan
from warpdyn.campaigns.integration.stability_guard import integrate_guarded

TARGETS = (1e-2, 1e-3, 1e-4)
FACTOR = 2.0  # largest accepted ratio of estimated to true errors, and of true to estimated errors


@dataclass(frozen=True)
class Planned:
    """The choice of `plan` for a target error, and the cheapest charted point that meets it; "" and NaN if missing.

    Args:
        plan_method: Method that `plan` chose.
        plan_dtype: Number type that `plan` chose.
        plan_step: Longest step that `plan` chose [s].
        plan_error: True 95 % quantile of the error of the peak drift with this choice [1].
        plan_seconds_per_sample: Time per sample with this choice [s].
        best_method: Method of the cheapest point.
        best_dtype: Number type of the cheapest point.
        best_step: Longest step of the cheapest point [s].
        best_error: 95 % quantile of the error of the peak drift at the cheapest point [1].
        best_seconds_per_sample: Time per sample of the cheapest point, measured alternately with the choice of `plan`
            [s].
    """

    plan_method: str = ""
    plan_dtype: str = ""
    plan_step: float = np.nan
    plan_error: float = np.nan
    plan_seconds_per_sample: float = np.nan
    best_method: str = ""
    best_dtype: str = ""
    best_step: float = np.nan
    best_error: float = np.nan
    best_seconds_per_sample: float = np.nan


def plan_scene(
    charted: Charted,
    reference: Mapping[str, np.ndarray],
    points: Mapping[tuple[str, str, float], Point],
    settings: Settings,
) -> list[Planned]:
    """Return the choice of `plan` and the best charted point of a scene, for each error in TARGETS."""
    return [_planned(charted, reference, points, target, settings) for target in TARGETS]


def _planned(
    charted: Charted,
    reference: Mapping[str, np.ndarray],
    points: Mapping[tuple[str, str, float], Point],
    target: float,
    settings: Settings,
) -> Planned:
    columns = {}
    # Another seed: `plan` must not see the samples with which its choice is tested.
    try:
        choice = plan(charted.scene, target, seed=settings.seed + 1, device=settings.device)
    except ValueError:  # no candidate reaches the target
        choice = None
    runs = {}
    if choice is not None:
        run, _ = make_run(charted, choice.method, choice.dtype, choice.longest_step, settings)
        outputs = integrate_guarded(run, every(run))
        error = float(statistics(compare(run, outputs, reference, every(run)))[0, 1])
        columns |= {"plan_method": choice.method, "plan_dtype": choice.dtype, "plan_step": choice.longest_step}
        columns["plan_error"] = error
        runs["plan_seconds_per_sample"] = run
    within = {key: point.seconds for key, point in points.items() if point.errors[0, 1] <= target}
    if within:
        key = min(within, key=within.get)
        run, _ = make_run(charted, *key, settings)
        integrate_guarded(run, every(run))  # finds the samples whose law needs shorter steps
        columns |= dict(zip(("best_method", "best_dtype", "best_step"), key, strict=True))
        columns["best_error"] = float(points[key].errors[0, 1])
        runs["best_seconds_per_sample"] = run
    # Both runs are timed alternately, several times, so that a slow phase of the machine affects both.
    seconds = [{name: timed(run) / every(run).size for name, run in runs.items()} for _ in range(TIMED_RUNS)]
    columns |= {name: min(row[name] for row in seconds) for name in runs}
    return Planned(**columns)


def agreement(result: xr.Dataset) -> tuple[np.ndarray, float]:
    """Return the ratio of estimated to true error of every point and demand, and the share within FACTOR."""
    ratio = (result["estimated_error"] / result["error"]).values
    ratio = ratio[np.isfinite(ratio)]
    return ratio, float(np.mean((ratio >= 1 / FACTOR) & (ratio <= FACTOR)))
