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
from warpdyn.ensemble import Ensemble
from warpdyn.kernels.build import checked_device, device_name
from warpdyn.methods import METHODS
from warpdyn.motions import Assignment
from warpdyn.results import DIVERGED, UNSTABLE_STEP, history_variables, label
from warpdyn.sample import draw
from warpdyn.scene import Scene
from warpdyn.structures import one_of
from warpdyn.timeline import Timeline, build_timeline


@dataclass(frozen=True)
class Histories:
    """Samples whose whole histories are kept.

    Args:
        samples: Indices along the dimension `sample`.
        every: Keep every so many steps, the first included.
    """

    samples: Sequence[int] = (0,)
    every: int = 1


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
    one_of("method", method, METHODS)
    one_of("dtype", dtype, ("float32", "float64"))
    for name, value, least in (("samples", samples, 1), ("seed", seed, 0), ("threads", threads, 1)):
        _check_whole(name, value, least)
    _check_whole("samples_per_chunk", samples_per_chunk, 1)
    device = checked_device(device)
    drawn = draw(scene.structure, scene.scatter, scene.correlation, scene.sampling, samples, seed)
    parameters = pack.all_parameters(scene, drawn)
    assignment = scene.excitation.assign(samples, seed)
    kept = _checked_histories(histories, assignment.structure.size)
    polynomial = METHODS[method].stability_polynomial
    nominal = {name: values[None] for name, values in scene.structure.parameters.items()}
    timeline = build_timeline(scene, step, float(pack.stable_steps(scene, nominal, polynomial)[0]))
    unstable = _unstable_samples(scene, parameters, assignment, timeline, polynomial)
    run = Ensemble(scene, parameters, assignment, timeline, method, dtype, device, threads or _cores())
    if kept is not None:
        run.check_common_step(kept.samples)
    sampled = time.perf_counter()
    outputs = run.integrate(samples_per_chunk)
    integrated = time.perf_counter()
    _warn_of_failures(outputs["status"][~unstable])
    outputs["status"][unstable] = UNSTABLE_STEP
    _blank_failed(outputs)
    dataset = label(scene, outputs, drawn, assignment, timeline)
    if kept is not None:
        time_grid, values = run.integrate_histories(kept.samples, kept.every)
        dataset = dataset.merge(history_variables(kept.samples, time_grid, values))
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


def _check_whole(name: str, value: int | None, least: int) -> None:
    if value is not None and (isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least):
        raise ValueError(f"{name} must be a whole number of at least {least}, got {value!r}")


def _checked_histories(histories: Histories | None, total: int) -> Histories | None:
    if histories is None:
        return None
    _check_whole("histories.every", histories.every, 1)
    for sample in histories.samples:
        _check_whole("histories.samples", sample, 0)
        if sample >= total:
            raise ValueError(f"histories ask for sample {sample}, but the run has samples 0 to {total - 1}")
    return Histories(tuple(int(sample) for sample in histories.samples), histories.every) if histories.samples else None


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _unstable_samples(
    scene: Scene,
    parameters: dict[str, np.ndarray],
    assignment: Assignment,
    timeline: Timeline,
    polynomial: tuple[float, ...],
) -> np.ndarray:
    """Return which samples' step is beyond the method's stability limit, after saying so."""
    longest = pack.stable_steps(scene, parameters, polynomial)
    longest = longest[assignment.structure] if longest.size > 1 else longest
    unstable = timeline.step[assignment.motion] > longest
    if unstable.any():
        warnings.warn(
            f"the step is beyond the stability limit of {unstable.sum()} of {unstable.size} samples; their status is "
            f"unstable_step and their demands are NaN. A step of at most {longest.min():.3g} s holds for all",
            stacklevel=3,
        )
    return unstable


def _warn_of_failures(status: np.ndarray) -> None:
    """Say how many samples failed while they ran."""
    for code, reason in (
        (DIVERGED, "diverged: their state is not finite at the end"),
        (
            UNSTABLE_STEP,
            "are flagged unstable_step: the step is too long for their storey law (Bouc-Wen: yield drift "
            "over velocity and exponent)",
        ),
    ):
        count = np.count_nonzero(status == code)
        if count:
            text = f"{count} of {status.size} samples {reason}; their demands are NaN. A shorter step may hold"
            warnings.warn(text, stacklevel=3)


def _blank_failed(outputs: dict[str, np.ndarray]) -> None:
    """Set the demands of failed samples to NaN, so that no statistic takes a blow-up for a response."""
    failed = outputs["status"] >= DIVERGED
    if failed.any():
        for values in outputs.values():
            if np.issubdtype(values.dtype, np.floating):
                values[..., failed] = np.nan
