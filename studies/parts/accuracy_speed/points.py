"""Points of work-precision diagrams: error and time of an ensemble for each method, dtype and step."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from tqdm import tqdm

from parts.accuracy_speed.scenes import Charted
from warpdyn.campaigns.accuracy.error_estimate import compare, relative_errors
from warpdyn.campaigns.accuracy.pilot import CANDIDATES
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.run import prepare
from warpdyn.campaigns.integration.stability_guard import guard, integrate_guarded
from warpdyn.engine.kernels.build import load_kernel
from warpdyn.engine.methods.table import METHODS, fitting_methods

# Steps of the charts [s]; each scene begins at its own first step. An adaptive method also has the tolerance below.
STEPS = tuple(0.08 / 2**k for k in range(9))
TOLERANCES = dict(zip(STEPS, 10.0 ** (-0.75 * np.arange(9)), strict=True))
# Methods that are also drawn in float64. The errors of other methods exceed float32 rounding at nearly all steps.
IN_FLOAT64 = ("rk4", "central_difference", "newmark_average", "exact")
DEMANDS = ("peak_storey_drift", "residual_drift_ratio")
STATISTICS = {"median": 0.5, "95 %": 0.95}  # name of each error statistic, and its quantile over the samples
# A point is not drawn if more than this share of the samples exceeds the stability limit at its step. Points with
# shorter steps show the cost of stable steps.
MOST_SUBSTEPPED = 0.5
# A time is the shortest of TIMED_RUNS runs. Fewer runs are made if they take more than TIMED_FOR seconds together.
TIMED_RUNS, TIMED_FOR = 5, 0.5
SHARE_CHECKED, FEWEST_CHECKED = 0.1, 30  # share and least number of samples for the estimated error


@dataclass(frozen=True)
class Settings:
    """Settings that all runs of the study have in common.

    Args:
        samples: Least number of samples in an ensemble.
        device: Warp device, such as "cuda:0"; None: the default device.
        seed: Seed of every random draw.
    """

    samples: int
    device: str | None
    seed: int


@dataclass(frozen=True)
class Point:
    """One point of a work-precision diagram: errors and time of one method, dtype and step.

    Args:
        errors: Relative error of each demand, by statistic, shape [demand, statistic]; NaN for a demand that is not
            recorded.
        estimated: Errors that `checked_share` estimates from some samples, same shape; NaN without an estimate.
        seconds: Integration time per sample [s].
        substepped: Share of the samples that took more steps than requested, in order to be stable [1].
    """

    errors: np.ndarray
    estimated: np.ndarray
    seconds: float
    substepped: float


def make_run(charted: Charted, method: str, dtype: str, step: float, settings: Settings) -> tuple[Ensemble, float]:
    """Return a stable run of an ensemble, and the share of its samples that need shorter steps to be stable."""
    run, vibration = prepare(
        charted.scene,
        structures=charted.structures(settings.samples),
        method=method,
        dtype=dtype,
        longest_step=step,
        tolerance=TOLERANCES.get(step) if METHODS[method].is_adaptive else None,
        device=settings.device,
        seed=settings.seed,
        known=charted.known.setdefault(settings.samples, {}),
    )
    asked = run.schedule.substeps
    guard(run, vibration, "substep")  # shortens the steps of unstable samples; the point contains their share
    return run, float(np.mean(run.schedule.substeps > asked))


def every(run: Ensemble) -> np.ndarray:
    """Return the indices of all samples of a run, shape [sample]."""
    return np.arange(run.assignment.structure.size)


def reference_of(charted: Charted, settings: Settings) -> dict[str, np.ndarray]:
    """Return the outputs of the reference solution: exact or RK4, in float64, at the reference step."""
    method = "exact" if charted.scene.structure.law == "elastic" else "rk4"
    run, _ = make_run(charted, method, "float64", charted.reference_step, settings)
    return integrate_guarded(run, every(run))


def statistics(errors: dict[str, np.ndarray]) -> np.ndarray:
    """Return statistics of the errors, shape [demand, statistic]; a failed sample counts as an infinite error."""
    table = np.full((len(DEMANDS), len(STATISTICS)), np.nan)
    for row, name in enumerate(DEMANDS):
        if name in errors:
            ordered = np.where(np.isfinite(errors[name]), errors[name], np.inf)
            table[row] = np.quantile(ordered, list(STATISTICS.values()), method="higher")
    return table


def timed(run: Ensemble) -> float:
    """Integrate all samples of a run once, and return the time that this takes [s]."""
    started = time.perf_counter()
    run.integrate(every(run))
    return time.perf_counter() - started


def measure(run: Ensemble, substepped: float, reference: dict[str, np.ndarray], is_checked: bool, seed: int) -> Point:
    """Return the point of a run: errors against the reference solution, estimated errors, and time per sample."""
    chosen = every(run)
    # The time of this first run does not count: a kernel for undivided steps may have to be compiled, and samples may
    # have to be run again with shorter steps. The timed runs begin with these shorter steps.
    outputs = integrate_guarded(run, chosen)
    seconds = [timed(run)]
    while len(seconds) < TIMED_RUNS and sum(seconds) < TIMED_FOR:
        seconds.append(timed(run))
    estimated = np.full((len(DEMANDS), len(STATISTICS)), np.nan)
    if is_checked:
        count = min(chosen.size, max(FEWEST_CHECKED, int(SHARE_CHECKED * chosen.size)))
        some = np.sort(np.random.default_rng(seed).choice(chosen, count, replace=False))
        estimated = statistics(relative_errors(run, {name: v[..., some] for name, v in outputs.items()}, some))
    errors = statistics(compare(run, outputs, reference, chosen))
    return Point(errors, estimated, min(seconds) / chosen.size, substepped)


def charted_rows(charted: Charted) -> list[tuple[str, str]]:
    """Return the pairs of method and dtype for which a scene is charted."""
    fitting = fitting_methods(charted.scene.structure.storey_law.forces())
    return [(name, "float32") for name in fitting] + [(name, "float64") for name in IN_FLOAT64 if name in fitting]


def chart(
    charted: Charted, reference: dict[str, np.ndarray], settings: Settings, progress: tqdm
) -> dict[tuple[str, str, float], Point]:
    """Return the points of a scene, with (method, dtype, step) as keys."""
    points: dict[tuple[str, str, float], Point] = {}
    rows, cheapest = charted_rows(charted), np.inf
    for step in STEPS[STEPS.index(charted.first_step) :]:
        for method, dtype in rows:
            run, substepped = make_run(charted, method, dtype, step, settings)
            if substepped > MOST_SUBSTEPPED:
                continue
            is_checked = dtype == "float32" and method in IN_FLOAT64
            points[method, dtype, step] = measure(run, substepped, reference, is_checked, settings.seed)
            cheapest = min(cheapest, points[method, dtype, step].seconds)
            progress.update()
        # A curve ends if its next point, with twice as many steps, would exceed the allowed time.
        dear = {
            row
            for row in rows
            if (*row, step) in points and 2 * points[*row, step].seconds > charted.dearest * cheapest
        }
        rows = [row for row in rows if row not in dear]
    return points


def compile_kernels(scenes: Iterable[Charted], settings: Settings) -> None:
    """Compile every kernel of the study in advance, several at the same time."""
    small = replace(settings, samples=1)
    jobs = []
    for charted in scenes:
        rows = charted_rows(charted)
        jobs += [(charted, *row) for row in rows]
        pilot = replace(charted, scene=replace(charted.scene, recorders=("drift",)))  # runs by which plan() decides
        if pilot.scene.recorders != charted.scene.recorders:
            jobs += [(pilot, *row) for row in rows if row[0] in CANDIDATES]
    # The kernels that take longest to compile come first.
    jobs.sort(key=lambda job: not METHODS[job[1]].is_adaptive)

    def load(job: tuple[Charted, str, str]) -> None:
        run, _ = make_run(*job, STEPS[2], small)
        load_kernel(run.plan, run.queue.device)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(tqdm(pool.map(load, jobs), total=len(jobs), desc="compiling", unit="kernel", disable=None))
