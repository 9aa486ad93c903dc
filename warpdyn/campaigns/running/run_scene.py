"""Runs of scenes of one structure: drawn, integrated and labelled block by block."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp
import xarray as xr

from warpdyn.campaigns.accuracy.error_estimate import ErrorEstimate
from warpdyn.campaigns.accuracy.pilot import choose_method
from warpdyn.campaigns.accuracy.reliability import is_checked
from warpdyn.campaigns.accuracy.sample_errors import ATTRIBUTES, ERROR, SENSITIVE
from warpdyn.campaigns.integration.run import Run, build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.integration.stability_guard import StabilityFindings
from warpdyn.campaigns.integration.time_grid import warn_of_short_tail
from warpdyn.campaigns.reductions.reduction import Reduction
from warpdyn.campaigns.reductions.statistic import Statistic
from warpdyn.campaigns.running.blocks import bytes_per_row, check_room, divide
from warpdyn.campaigns.running.histories import Histories, KeptHistories
from warpdyn.campaigns.running.journal import FINGERPRINT, Journal, fingerprint_of
from warpdyn.campaigns.running.labels import BECAUSE, Column, columns_of
from warpdyn.campaigns.running.pipeline import Pipeline
from warpdyn.campaigns.running.sinks import InFile, InMemory, Reduced, Table
from warpdyn.engine.device.processor import has_wide_registers
from warpdyn.engine.kernels.build import history_plan
from warpdyn.engine.kernels.compilation import compile_side_by_side
from warpdyn.engine.kernels.plan import Plan
from warpdyn.engine.kernels.queues import Queue, device_names, open_queues, seconds_in_kernels
from warpdyn.foundations.core.checks import real_number, whole_number
from warpdyn.foundations.core.progress import counted_histories
from warpdyn.foundations.files.netcdf import GrowingFile
from warpdyn.foundations.files.unfinished import Unfinished
from warpdyn.model.scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class Kept:
    """What is kept of a run besides its demands; arguments as of `simulate`."""

    checked_share: float | None = None
    sample_error: float | None = None
    histories: Histories | None = None
    keep_inputs: bool = True
    statistics: tuple[Statistic, ...] = ()
    overwrite: bool = False

    def __post_init__(self) -> None:
        share = self.checked_share
        if share is not None and not 0 < real_number("checked_share", share) <= 1:
            raise ValueError(f"checked_share must be a share of the samples, above 0 and at most 1, got {share}")
        error = self.sample_error
        if error is not None and not 0 < real_number("sample_error", error) < 1:
            raise ValueError(f"sample_error must be a relative error, above 0 and below 1, got {error}")
        if not isinstance(self.keep_inputs, bool):
            raise TypeError(f"keep_inputs must be True or False, got {self.keep_inputs!r}")
        if not isinstance(self.overwrite, bool):
            raise TypeError(f"overwrite must be True or False, got {self.overwrite!r}")
        if self.histories is not None and not isinstance(self.histories, Histories):
            raise TypeError(f"histories must be Histories(samples, every), got {self.histories!r}")


class SceneRun:
    """A run of a scene of one structure that has begun: it is checked, and its first blocks are being prepared.

    Args:
        scene: The scene.
        structures: Number of structures to draw.
        integration: How they are integrated.
        execution: Devices, threads and memory.
        kept: What is kept of them.
        seed: Seed of every random draw.
        unfinished: Where the file is written that the samples go to; None to return them in memory.
        reduced: Statistics that the samples are reduced to, and the number of each structure in them; all else of the
            run is then returned.
        digest: Fingerprint of the run that this one is a part of; None to find its own.
        queues: Where it runs, one of the runs that share them after the other; None to open its own.
    """

    def __init__(
        self,
        scene: Scene,
        structures: int,
        integration: Integration,
        execution: Execution,
        kept: Kept,
        seed: int,
        unfinished: Unfinished | None,
        reduced: tuple[Reduction, np.ndarray] | None = None,
        digest: str | None = None,
        queues: list[Queue] | None = None,
    ) -> None:
        began = time.perf_counter()
        self.kept = kept
        if digest is None:
            digest = fingerprint_of_run(scene, structures, integration, machines_of(execution), kept, seed)
        self.digest, journal = digest, None
        if unfinished is not None:
            # What cannot run leaves what stands there.
            asked = build_run(scene, structures, integration, execution, seed)
            divide(asked, columns_kept(asked, kept), execution.memory)
            journal = Journal(unfinished, digest, kept.overwrite)
        if journal is not None and "longest_step" in journal.settled:
            integration = replace(integration, **journal.settled)
        elif integration.target_error is not None:
            build_run(scene, structures, integration, execution, seed)  # errors are raised before the pilot runs
            choice = choose_method(
                scene,
                integration.target_error,
                structures=structures,
                method=None if "method" in integration.left_open else integration.method,
                dtype=None if "dtype" in integration.left_open else integration.dtype,
                seed=seed,
                device=execution.device,
                threads=execution.threads,
            )
            chosen: dict[str, Any] = {
                "method": choice.method,
                "dtype": choice.dtype,
                "longest_step": choice.longest_step,
            }
            integration = replace(integration, **chosen)
            if journal is not None:
                journal.settle(**chosen)  # the pilot's timings may choose otherwise next time
        self.run = run = build_run(scene, structures, integration, execution, seed)
        self.integration = integration = run.integration
        self.table = _table(run, columns_kept(run, kept), unfinished, reduced, kept)
        blocks = [] if journal is None else journal.blocks(len(run.samples_by_event), run.structures)
        first = blocks[-1].stop if blocks else 0
        blocks += divide(
            run,
            self.table.columns,
            execution.memory,
            first=first,
            is_journaled=journal is not None,
            is_reduced=self.table.reduces,
        )
        self.queues = queues = open_queues(execution.devices, run.model.threads) if queues is None else queues
        self.findings = _findings(run, blocks, queues[0], integration)
        self.histories = None
        if kept.histories is not None:
            self.histories = KeptHistories(kept.histories, run, queues[0], integration)
        self.estimates = [] if kept.checked_share is None else _estimates(run, kept.checked_share, blocks)
        self.pipeline = Pipeline(
            run,
            integration.on_unstable,
            self.findings,
            self.table,
            self.histories,
            self.estimates,
            journal,
            divides_steps=integration.divides_steps,
            sample_error=kept.sample_error,
        )
        self.pipeline.begin(blocks, queues)
        self.pipeline.seconds_sampling += time.perf_counter() - began

    def close(self) -> None:
        """Prepare nothing more of it."""
        self.pipeline.close()

    def finish(self) -> xr.Dataset:
        """Integrate all samples, and return what `simulate` returns of the scene."""
        run, pipeline = self.run, self.pipeline
        for queue in self.queues:
            queue.spans.clear()  # and nothing else: a GPU may still reduce what the run before left there
        with closing(self):
            compile_side_by_side(plans_of(run, self.kept), run.execution.devices[0], run.model.threads)
            with self.table:
                with counted_histories(sum(run.samples_by_event)) as progress:
                    pipeline.process(progress.update)
                for found in self.findings:
                    found.warn(self.integration.on_unstable)
                warn_of_short_tail(run.model.scene, pipeline.longest_period)
                rest = xr.Dataset() if self.histories is None else self.histories.result()
                if self.estimates:
                    errors = [estimate.result(list(run.model.demands)) for estimate in self.estimates]
                    found_errors = (
                        errors[0] if len(errors) == 1 else xr.concat(errors, "event", combine_attrs="override")
                    )
                    rest = rest.merge(found_errors)
                rest.attrs = attributes_of_run(run, self.integration) | {
                    FINGERPRINT: self.digest,
                    "seconds_sampling": pipeline.seconds_sampling,
                    "seconds_integrating": pipeline.seconds_integrating,
                    "seconds_in_kernels": seconds_in_kernels(self.queues),
                }
                return self.table.finish(rest)


def fingerprint_of_run(
    scene: Scene, structures: int, integration: Integration, machines: Iterable[str], kept: Kept, seed: int
) -> str:
    """Return the fingerprint of all that decides the bits of a run.

    Args:
        scene, structures, integration, kept, seed: As of `SceneRun`.
        machines: What `machines_of` returns where it runs.
    """
    what = kept.checked_share, kept.sample_error, kept.histories, kept.keep_inputs, *kept.statistics
    numbers = whole_number("structures", structures, 1), whole_number("seed", seed, 0)
    return fingerprint_of(scene, numbers[0], integration, list(machines), what, numbers[1])


def machines_of(execution: Execution) -> list[str]:
    """Return what devices are, each once: their makers' names, and how wide a processor's vector registers are.

    Kernels of tall buildings have other rows where registers are wider, and may round otherwise.
    """
    width = " with registers of 512 bits" if has_wide_registers() else ""
    return sorted({wp.get_device(name).name + (width if name == "cpu" else "") for name in execution.devices})


def columns_kept(run: Run, kept: Kept) -> dict[str, Column]:
    """Return the variables of a run's dataset that have one value for each sample, by name."""
    columns = columns_of(run.model, kept.keep_inputs)
    if kept.sample_error is not None:
        columns[ERROR] = Column((), np.dtype("float64"), ATTRIBUTES[ERROR])
        columns[SENSITIVE] = Column((), np.dtype("int8"), ATTRIBUTES[SENSITIVE])
    return columns


def _table(
    run: Run,
    columns: dict[str, Column],
    unfinished: Unfinished | None,
    reduced: tuple[Reduction, np.ndarray] | None,
    kept: Kept,
) -> Table:
    """Return the table that takes the samples of a run."""
    if reduced is not None:
        return Reduced(run, columns, *reduced, is_estimated=kept.checked_share is not None)
    if unfinished is None:
        check_room(run.samples, bytes_per_row(run, columns))
        return InMemory(run.model, columns, run.samples)
    return InFile(run.model, columns, GrowingFile(unfinished, run.samples))


def plans_of(run: Run, kept: Kept) -> Iterator[Plan]:
    """Yield the plans of the kernels that a run launches."""
    for model in run.model.by_event:
        yield model.undivided
        if is_checked(model):
            yield model.plan  # with its steps divided
        if kept.checked_share is not None or kept.sample_error is not None:
            yield model.in_float64(model.tolerance, run.execution.devices[0]).plan  # with its steps divided
    if kept.histories is not None:
        yield history_plan(run.model.plan)


def _findings(run: Run, blocks: list[range], queue: Queue, integration: Integration) -> list[StabilityFindings]:
    """Return the findings of each event; with "raise", raise an error if a step is beyond its limit."""
    events = run.model.scene.excitation.event_names
    counts = zip(run.samples_by_event, events, strict=True)
    findings = [StabilityFindings(count, integration.method, name) for count, name in counts]
    if integration.on_unstable == "raise":
        for structures in blocks:
            for found, part in zip(findings, run.events(np.asarray(structures), queue), strict=True):
                found.add_limits(*part)
        for found in findings:
            found.refuse(any_step=True)
    return findings


def _estimates(run: Run, share: float, blocks: list[range]) -> list[ErrorEstimate]:
    """Return an error estimate for each event, from a share of its samples."""
    return [
        ErrorEstimate(count, share, run.model.seed, len(blocks[0]) * count // run.structures)
        for count in run.samples_by_event
    ]


def attributes_of_run(run: Run, integration: Integration) -> dict[str, object]:
    """Return the attributes of a dataset that say how it was integrated."""
    steps = np.unique(run.model.timeline.steps)
    attributes = {
        "seed": run.model.seed,
        "method": run.integration.method,
        BECAUSE: run.integration.reason or None,
        "step": steps if steps.size > 1 else float(steps[0]),
        "on_unstable": integration.on_unstable,
        "dtype": integration.dtype,
        "device": device_names(run.execution.devices),
        "kernel": run.model.kernel_name,
        "longest_step": integration.longest_step,
        "target_error": integration.target_error,
        "resampled": "yes" if integration.resample else None,
        "tolerance": run.model.tolerance if run.model.method.is_adaptive else None,
    }
    return {name: value for name, value in attributes.items() if value is not None}
