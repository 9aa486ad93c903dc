"""The run: a scene is drawn, packed, integrated in chunks on a device, and returned as a labelled dataset."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from warpdyn import pack
from warpdyn.checks import one_of, whole_number
from warpdyn.ensemble import Ensemble
from warpdyn.kernels.build import checked_device, device_name
from warpdyn.methods import METHODS
from warpdyn.motions import Assignment
from warpdyn.recorders import DIVERGED, UNSTABLE_STEP
from warpdyn.results import history_variables, label
from warpdyn.sample import draw
from warpdyn.scene import Scene
from warpdyn.timeline import Timeline, Vibration, build_timeline, run_lengths

LARGEST_ENERGY_ERROR = 0.02  # of the energy supplied; a well-resolved run is a hundred times below it


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
    method: str = "rk4",
    device: str | None = None,
    dtype: str = "float32",
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
        method: Integration method, a row of METHODS.
        device: "cpu" or "cuda:0"; None for the first GPU, or the CPU where there is none.
        dtype: "float32" or "float64".
        seed: Seed of every random draw; the same seed gives the same samples on any device.
        histories: Samples whose whole histories are kept; None for none.
        threads: CPU threads; None for every core this process may use.
        samples_per_chunk: Samples integrated at a time; None to fit the memory at hand. It changes no result.

    Returns:
        Dataset over `sample`, with the demands recorded, the inputs drawn and `status` (ok, collapsed, diverged,
        unstable_step). Demands of diverged and unstable samples are NaN.

    Raises:
        ValueError: If an argument is out of its range or a name is unknown; nothing has been run then.
    """
    started = time.perf_counter()
    if not isinstance(scene, Scene):
        raise TypeError(f"simulate() takes a Scene, got {type(scene).__name__}")
    one_of("method", method, METHODS)
    one_of("dtype", dtype, ("float32", "float64"))
    samples, seed = whole_number("samples", samples, 1), whole_number("seed", seed, 0)
    threads = _cores() if threads is None else whole_number("threads", threads, 1)
    if samples_per_chunk is not None:
        samples_per_chunk = whole_number("samples_per_chunk", samples_per_chunk, 1)
    device = checked_device(device)
    polynomial = METHODS[method].stability_polynomial
    drawn = draw(scene.structure, scene.scatter, scene.correlation, scene.sampling, samples, seed)
    central = pack.vibration_of(scene, {n: v[None] for n, v in scene.central_parameters.items()}, polynomial)
    timeline = build_timeline(scene, step, central)
    assignment = scene.excitation.assign(samples, seed)
    vibration = pack.vibration_of(scene, drawn, polynomial)
    run_intervals, residual_steps = run_lengths(scene, timeline, vibration, assignment)
    unstable = _unstable_samples(vibration, assignment, timeline)
    run = Ensemble(
        scene,
        drawn,
        assignment,
        timeline,
        run_intervals,
        residual_steps,
        method=method,
        dtype=dtype,
        device=device,
        threads=threads,
    )
    if histories is not None:
        _check_histories(histories, run, assignment.structure.size)
    sampled = time.perf_counter()
    outputs = run.integrate(samples_per_chunk)
    integrated = time.perf_counter()
    _warn_of_failures(outputs, ~unstable)
    outputs["status"][unstable] = UNSTABLE_STEP
    failed = outputs["status"] >= DIVERGED
    _blank_failed(outputs, failed)
    dataset = label(scene, outputs, drawn, assignment, timeline)
    if histories is not None:
        time_grid, values = run.integrate_histories(histories.samples, histories.every)
        for array in values.values():
            array[failed[list(histories.samples)]] = np.nan
        dataset = dataset.merge(history_variables(histories.samples, time_grid, values))
    steps = np.unique(timeline.step)
    dataset.attrs |= {
        "seed": seed,
        "method": method,
        "step": steps if steps.size > 1 else float(steps[0]),
        "dtype": dtype,
        "device": device_name(device),
        "kernel": run.kernel_name,
        "seconds_sampling": sampled - started,
        "seconds_integrating": integrated - sampled,
    }
    return dataset


def _check_histories(histories: Histories, run: Ensemble, total: int) -> None:
    if not isinstance(histories, Histories):
        raise TypeError(f"histories must be Histories(samples, every), got {histories!r}")
    for sample in histories.samples:
        if sample >= total:
            raise ValueError(f"histories ask for sample {sample}, but the run has samples 0 to {total - 1}")
    run.check_common_step(histories.samples)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _unstable_samples(vibration: Vibration, assignment: Assignment, timeline: Timeline) -> np.ndarray:
    """Return which samples' step is beyond the method's stability limit, after saying so."""
    longest = vibration.stable_step
    longest = longest[assignment.structure] if longest.size > 1 else longest
    unstable = timeline.step[assignment.motion] > longest
    if unstable.any():
        warnings.warn(
            f"the step is beyond the stability limit of {unstable.sum()} of {unstable.size} samples; their status is "
            f"unstable_step and their demands are NaN. A step of at most {longest.min():.3g} s holds for all",
            stacklevel=3,
        )
    return unstable


def _warn_of_failures(outputs: dict[str, np.ndarray], stable: np.ndarray) -> None:
    """Say how many samples of a stable step failed all the same, and how many lost track of their energy."""
    status = outputs["status"]
    law = "are flagged unstable_step: the step is too long for the memory of their storey law"
    reasons = {DIVERGED: "diverged: their state is not finite at the end", UNSTABLE_STEP: law}
    for code, reason in reasons.items():
        count = np.count_nonzero((status == code) & stable)
        if count:
            text = f"{count} of {status.size} samples {reason}; their demands are NaN. A shorter step may hold"
            warnings.warn(text, stacklevel=3)
    if "energy_balance_error" in outputs:
        unsure = stable & (status < DIVERGED) & (np.abs(outputs["energy_balance_error"]) > LARGEST_ENERGY_ERROR)
        if unsure.any():
            warnings.warn(
                f"the energy balance of {np.count_nonzero(unsure)} of {status.size} samples is off by more than "
                f"{100 * LARGEST_ENERGY_ERROR:g} %: the step is too long for them to be accurate",
                stacklevel=3,
            )


def _blank_failed(outputs: dict[str, np.ndarray], failed: np.ndarray) -> None:
    """Blank the demands of failed samples, so that no statistic takes a blow-up for a response."""
    for name, values in outputs.items():
        if name != "status" and failed.any():
            values[..., failed] = np.nan if np.issubdtype(values.dtype, np.floating) else -1
