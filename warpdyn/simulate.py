"""The run: a scene is drawn, packed, integrated in chunks on a device, and returned as a labelled dataset."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from warpdyn.checks import one_of, real_number, whole_number
from warpdyn.ensemble import Ensemble
from warpdyn.error_estimate import estimate_errors
from warpdyn.guard import ON_UNSTABLE, blank_failed, guard, integrate_guarded, warn_of_failures
from warpdyn.kernels.build import device_name
from warpdyn.methods import METHODS
from warpdyn.plan import plan
from warpdyn.prepare import prepare
from warpdyn.recorders import DIVERGED, UNSTABLE_STEP
from warpdyn.results import history_variables, label
from warpdyn.scene import Scene


@dataclass(frozen=True)
class Histories:
    """Samples whose whole histories are kept.

    Args:
        samples: Indices along the dimension `sample`, at least one.
        every: Keep every so many steps, the first included.

    Raises:
        ValueError: If a number is not whole or negative, or there is no sample.
    """

    samples: Sequence[int] = (0,)
    every: int = 1

    def __post_init__(self) -> None:
        samples = np.atleast_1d(np.asarray(self.samples))
        if samples.ndim != 1 or samples.size == 0:
            raise ValueError(f"histories.samples must be a row of at least one sample, got {self.samples!r}")
        whole = tuple(whole_number("histories.samples", sample, 0) for sample in samples.tolist())
        object.__setattr__(self, "samples", whole)
        object.__setattr__(self, "every", whole_number("histories.every", self.every, 1))


def simulate(
    scene: Scene,
    *,
    samples: int = 1,
    step: float | None = None,
    longest_step: float | None = None,
    resample: bool = False,
    method: str | None = None,
    dtype: str | None = None,
    tolerance: float | None = None,
    error: float | None = None,
    check: float | None = None,
    on_unstable: str = "substep",
    device: str | None = None,
    seed: int = 0,
    histories: Histories | None = None,
    threads: int | None = None,
    samples_per_chunk: int | None = None,
) -> xr.Dataset:
    """Integrate every sample of a scene and return what it records.

    Args:
        scene: The scene.
        samples: Structures to draw; each runs under every motion (and at every level) of the scene's design.
        step: Integration step [s], which must divide the step of every motion; None to choose one for each motion.
        longest_step: Step [s] that the chosen ones are not longer than, in place of the engine's own rule.
        resample: Whether a motion whose step `step` does not divide is resampled at it, which cuts its corners.
        method: Integration method, a row of METHODS; None for "rk4", or what `error` leads to.
        dtype: "float32" or "float64"; None for "float32", or what `error` leads to.
        tolerance: Relative error a step that an adaptive method allows itself (1e-6 by default); its steps are no
            longer than those of other methods.
        error: Relative error that the peak drift of 95 % of the samples is to stay below, for which `plan` chooses the
            step, and method and dtype if they are not given; None to leave the choice as it is.
        check: Share of the samples (at least 30) that are run again at half the step and in float64, to estimate the
            relative error of every demand; None for none.
        on_unstable: What is done where the step is beyond a structure's stability limit: "substep" (the fewest steps of
            the record's interval that hold, for these samples alone), "raise", or "flag" (status unstable_step).
        device: "cpu" or "cuda:0"; None for the first GPU, or the CPU where there is none.
        seed: Seed of every random draw; the same seed gives the same samples on any device.
        histories: Samples whose whole histories are kept; None for none.
        threads: CPU threads; None for every core this process may use.
        samples_per_chunk: Samples integrated at a time; None to fit the memory at hand. It changes no result.

    Returns:
        Dataset over `sample`, with the demands recorded, the inputs drawn and `status` (ok, collapsed, diverged,
        unstable_step, not_converged). Demands of the last three are NaN.

    Raises:
        ValueError: If an argument is out of its range or a name is unknown; nothing has been run then.
    """
    started = time.perf_counter()
    one_of("on_unstable", on_unstable, ON_UNSTABLE)
    if check is not None and not 0 < real_number("check", check) <= 1:
        raise ValueError(f"check must be a share of the samples, above 0 and at most 1, got {check}")
    if check is not None and resample:
        raise ValueError("check sees nothing of what resample cuts off a motion: leave out one of them")
    if samples_per_chunk is not None:
        samples_per_chunk = whole_number("samples_per_chunk", samples_per_chunk, 1)
    if error is not None:
        if step is not None or longest_step is not None or tolerance is not None:
            raise ValueError("error chooses the step: give simulate() no step, longest_step or tolerance beside it")
        chosen_by = {"seed": seed, "device": device, "threads": threads}
        # What is wrong is said before the pilot runs.
        given = {"method": "rk4" if method is None else method, "dtype": "float32" if dtype is None else dtype}
        prepare(scene, samples=samples, resample=resample, **given, **chosen_by)
        choice = plan(scene, error, samples=samples, method=method, dtype=dtype, **chosen_by)
        method, dtype, longest_step = choice.method, choice.dtype, choice.longest_step
    method, dtype = "rk4" if method is None else method, "float32" if dtype is None else dtype
    run, vibration = prepare(
        scene,
        samples=samples,
        step=step,
        longest_step=longest_step,
        resample=resample,
        method=method,
        tolerance=tolerance,
        device=device,
        dtype=dtype,
        seed=seed,
        threads=threads,
    )
    unstable = guard(run, vibration, on_unstable)
    common_step = None if histories is None else _common_step(histories, run)
    sampled = time.perf_counter()
    outputs = integrate_guarded(run, np.arange(unstable.size), on_unstable, samples_per_chunk)
    integrated = time.perf_counter()
    warn_of_failures(outputs, ~unstable)
    outputs["status"][unstable] = UNSTABLE_STEP
    failed = outputs["status"] >= DIVERGED
    blank_failed(outputs, failed)
    dataset = label(scene, outputs, run.drawn, run.assignment, run.schedule)
    if histories is not None:
        time_grid, values = run.integrate_histories(histories.samples, histories.every, common_step)
        for array in values.values():
            array[failed[list(histories.samples)]] = np.nan
        dataset = dataset.merge(history_variables(histories.samples, time_grid, values))
    if check is not None:
        dataset = dataset.merge(estimate_errors(run, outputs, check, seed))
    steps = np.unique(run.timeline.interval / run.timeline.substeps)
    dataset.attrs |= {
        "seed": seed,
        "method": method,
        "step": steps if steps.size > 1 else float(steps[0]),
        "on_unstable": on_unstable,
        "dtype": dtype,
        "device": device_name(run.device),
        "kernel": run.kernel_name,
        "seconds_sampling": sampled - started,
        "seconds_integrating": integrated - sampled,
    }
    given = {"longest_step": longest_step, "target_error": error, "resampled": "yes" if resample else None}
    dataset.attrs |= {name: value for name, value in given.items() if value is not None}
    if METHODS[method].is_adaptive:
        dataset.attrs["tolerance"] = run.tolerance
    return dataset


def _common_step(histories: Histories, run: Ensemble) -> float:
    """Return the step [s] that all histories asked for are kept at, after checking that they can be."""
    if not isinstance(histories, Histories):
        raise TypeError(f"histories must be Histories(samples, every), got {histories!r}")
    total = run.assignment.structure.size
    for sample in histories.samples:
        if sample >= total:
            raise ValueError(f"histories ask for sample {sample}, but the run has samples 0 to {total - 1}")
    return run.common_step(histories.samples)
