"""The run: block by block a scene is drawn, packed, integrated on its devices, and labelled as a dataset."""

from __future__ import annotations

import collections.abc
import os
import time

import numpy as np
import xarray as xr

from warpdyn.accuracy.error_estimate import ErrorEstimate
from warpdyn.accuracy.pilot import check_target_error, plan
from warpdyn.core.checks import one_of, real_number, whole_number
from warpdyn.core.netcdf import GrowingFile
from warpdyn.core.progress import counted_histories
from warpdyn.ground_motions.event_sequences import EventSequence
from warpdyn.integration.run import build_run
from warpdyn.integration.stability_guard import ON_UNSTABLE, Findings
from warpdyn.integration.time_grid import warn_of_short_tail
from warpdyn.kernels.queues import device_names, open_queues, seconds_in_kernels
from warpdyn.methods.table import METHODS
from warpdyn.running.blocks import divide
from warpdyn.running.event_pipeline import EventPipeline
from warpdyn.running.histories import Histories, KeptHistories
from warpdyn.running.labels import columns_of
from warpdyn.running.pipeline import Pipeline
from warpdyn.running.sinks import InFile, InMemory
from warpdyn.scene.scene import Scene


def simulate(
    scene: Scene,
    *,
    structures: int = 1,
    seed: int = 0,
    method: str | None = None,
    step: float | None = None,
    longest_step: float | None = None,
    resample: bool = False,
    dtype: str | None = None,
    tolerance: float | None = None,
    target_error: float | None = None,
    on_unstable: str = "substep",
    histories: Histories | None = None,
    keep_inputs: bool = True,
    checked_share: float | None = None,
    path: str | os.PathLike | None = None,
    device: str | collections.abc.Sequence[str] | None = None,
    threads: int | None = None,
    memory: int | None = None,
) -> xr.Dataset:
    """Integrate every sample of a scene and return what it records.

    Structures are drawn, and each of them under each motion (and level) of the scene's design is a sample. A sample's
    values depend on the seed and its own index alone: no division among blocks, threads and devices changes a bit.

    Args:
        scene: The scene.

        structures: Number of structures to draw; each runs under every motion, at every level, of the scene's design.
        seed: Seed of every random draw; the same seed gives the same samples on any device.

        method: Integration method, a row of METHODS; None for "rk4", or the choice made for `target_error`.
        step: Integration step [s], which must divide the step of every motion; None to choose one for each motion.
        longest_step: Upper bound of the chosen steps [s], in place of the default rule.
        resample: Whether a motion whose step is no multiple of `step` is resampled at `step`, which cuts its corners.
        dtype: "float32" or "float64"; None for "float32", or the choice made for `target_error`.
        tolerance: Relative error that an adaptive method allows itself in a step (1e-6 by default); its steps are no
            longer than those of other methods.
        target_error: Relative error that the peak drifts of 95 % of the samples stay below; `plan` chooses the step for
            it, and method and dtype if they are not given. None for no such choice.
        on_unstable: What is done where the step is beyond a structure's stability limit: "substep" (these samples take
            the fewest stable steps in each interval of the record), "raise" (an error before any sample runs), or
            "flag" (status unstable_step).

        histories: Samples whose whole histories are kept; None for none. An EventSequence has none.
        keep_inputs: Whether the drawn parameters of each sample are part of the dataset.
        checked_share: Share of the samples (at least 30 of them) that are run again at half the step and in float64, to
            estimate the relative error of every demand; None for none.
        path: NetCDF file to write the samples to, block by block. It appears when the run has finished; a file that
            stood there before stays until then. The returned dataset reads values from the file when they are asked
            for: close it when done. None to return the dataset in memory.

        device: "cpu" or "cuda:0"; several GPUs as ["cuda:0", "cuda:1"], or "cuda" for all there are, which share the
            samples; None for the first GPU, or the CPU where there is none.
        threads: CPU threads; None for every core this process may use.
        memory: Bytes that the blocks in progress may take on the host, and on each device; None for a share of the free
            memory. A dataset that is returned in memory is not counted.

    Returns:
        Dataset over `sample`, with the demands recorded, the inputs drawn and `status` (ok, collapsed, diverged,
        unstable_step, not_converged). Demands of the last three are NaN. All variables of an EventSequence but its
        drawn inputs also lie along `event` (see `select_event`); a sample that is not ok in an event has no demands in
        later ones.

    Raises:
        ValueError: If an argument is out of its range or a name is unknown, before anything has run; or if a drawn
            value is out of its parameter's bounds, which may come after some blocks have run.
        OSError: If the file cannot be written.
    """
    started = time.perf_counter()
    is_sequence = isinstance(scene, Scene) and isinstance(scene.excitation, EventSequence)
    if histories is not None and is_sequence:
        raise ValueError("histories of an EventSequence are not kept: leave them out, or run its first event by itself")
    check_settings(
        on_unstable, checked_share, resample, keep_inputs, memory, target_error, (step, longest_step, tolerance)
    )
    if target_error is not None:
        chosen_by = {"seed": seed, "device": device, "threads": threads}
        # What is wrong is said before the pilot runs.
        given = {"method": "rk4" if method is None else method, "dtype": "float32" if dtype is None else dtype}
        build_run(scene, structures=structures, resample=resample, **given, **chosen_by)
        choice = plan(scene, target_error, structures=structures, method=method, dtype=dtype, **chosen_by)
        method, dtype, longest_step = choice.method, choice.dtype, choice.longest_step
    method, dtype = "rk4" if method is None else method, "float32" if dtype is None else dtype
    run = build_run(
        scene,
        structures=structures,
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
    columns = columns_of(run.terms, keep_inputs)
    blocks = divide(run, columns, memory)
    queues = open_queues(run.devices, run.terms.threads)
    events = list(scene.excitation.events) if is_sequence else [""]
    findings = [Findings(count, method, name) for count, name in zip(run.samples_by_event, events, strict=True)]
    if on_unstable == "raise":
        for block in blocks:
            for found, part in zip(findings, run.events(block, queues[0]), strict=True):
                found.add_limits(*part)
        for found in findings:
            found.refuse(any_step=True)
    kept = None if histories is None else KeptHistories(histories, run, queues[0], on_unstable)
    estimates = []
    if checked_share is not None:
        together = [len(blocks[0]) * count // run.structures for count in run.samples_by_event]
        estimates = [
            ErrorEstimate(count, checked_share, run.seed, part)
            for count, part in zip(run.samples_by_event, together, strict=True)
        ]
    if path is None:
        table = InMemory(run.terms, columns, run.samples)
    else:
        table = InFile(run.terms, columns, GrowingFile(path, run.samples))
    with table:
        with counted_histories(run.samples) as progress:
            if is_sequence:
                pipeline = EventPipeline(run, on_unstable, findings, table, estimates, progress.update)
            else:
                estimate = estimates[0] if estimates else None
                pipeline = Pipeline(run, on_unstable, findings[0], table, kept, estimate, progress.update)
            pipeline.seconds_sampling += time.perf_counter() - started
            pipeline.process(blocks, queues)
        for found in findings:
            found.warn(on_unstable, stacklevel=2)
        warn_of_short_tail(scene, pipeline.longest_period, stacklevel=2)
        rest = xr.Dataset() if kept is None else kept.result()
        found = [estimate.result(scene.structure.family, scene.recorders) for estimate in estimates]
        if found:
            rest = rest.merge(found[0] if len(found) == 1 else xr.concat(found, "event", combine_attrs="override"))
        steps = np.unique(run.terms.timeline.interval / run.terms.timeline.substeps)
        rest.attrs = {
            "seed": seed,
            "method": method,
            "step": steps if steps.size > 1 else float(steps[0]),
            "on_unstable": on_unstable,
            "dtype": dtype,
            "device": device_names(run.devices),
            "kernel": run.terms.kernel_name,
            "seconds_sampling": pipeline.seconds_sampling,
            "seconds_integrating": pipeline.seconds_integrating,
            "seconds_in_kernels": seconds_in_kernels(queues),
        }
        given = {"longest_step": longest_step, "target_error": target_error, "resampled": "yes" if resample else None}
        rest.attrs |= {name: value for name, value in given.items() if value is not None}
        if METHODS[method].is_adaptive:
            rest.attrs["tolerance"] = run.terms.tolerance
        return table.finish(rest)


def check_settings(
    on_unstable: str = "substep",
    checked_share: float | None = None,
    resample: bool = False,
    keep_inputs: bool = True,
    memory: int | None = None,
    target_error: float | None = None,
    beside_target_error: tuple[float | None, ...] = (),
) -> None:
    """Raise an error if one of these settings of `simulate`, which need no scene to be judged, is not valid.

    Args:
        on_unstable, checked_share, resample, keep_inputs, memory, target_error: As `simulate` takes them.
        beside_target_error: What must be None beside `target_error`.
    """
    one_of("on_unstable", on_unstable, ON_UNSTABLE)
    if checked_share is not None and not 0 < real_number("checked_share", checked_share) <= 1:
        raise ValueError(f"checked_share must be a share of the samples, above 0 and at most 1, got {checked_share}")
    if checked_share is not None and resample:
        raise ValueError("checked_share sees nothing of what resample cuts off a motion: leave out one of them")
    if not isinstance(keep_inputs, bool):
        raise TypeError(f"keep_inputs must be True or False, got {keep_inputs!r}")
    if memory is not None:
        whole_number("memory [bytes]", memory, 1)
    if target_error is not None:
        check_target_error(target_error)
        if any(setting is not None for setting in beside_target_error):
            raise ValueError(
                "target_error chooses the step: give simulate() no step, longest_step or tolerance beside it"
            )
