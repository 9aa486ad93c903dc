"""Jobs, which are sent to the processes that integrate regions of a run, and their preparation in each process."""

from __future__ import annotations

import sys
import threading
import warnings
from collections import OrderedDict
from collections.abc import Iterator, Set
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

from warpdyn.campaigns.accuracy.error_estimate import ErrorEstimate
from warpdyn.campaigns.accuracy.reliability import is_checked
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.integration.stability_guard import StabilityFindings, structures_of_a_range
from warpdyn.campaigns.preparation.preparation import Preparation, preparation_of
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.reduction import Reduction
from warpdyn.campaigns.reductions.statistic import Statistic
from warpdyn.campaigns.running.blocks import (
    CPU_BLOCK,
    MEMORY_OF_CHUNKS,
    SHARE_OF_FREE_MEMORY,
    WORK_OF_A_BLOCK,
    bytes_per_row,
    divide,
)
from warpdyn.campaigns.running.histories import KeptHistories
from warpdyn.campaigns.running.labels import attributes_of_run, labelled
from warpdyn.campaigns.running.outputs import Outputs
from warpdyn.campaigns.running.regions.checkpoint import DECIDING, versions
from warpdyn.campaigns.running.regions.deferred import deferred_names
from warpdyn.campaigns.running.regions.kept_queues import keep_queues, taken_queues
from warpdyn.campaigns.running.tables import blank_rows, columns_kept
from warpdyn.engine.device.processor import has_wide_registers
from warpdyn.engine.kernels.build import history_plan
from warpdyn.engine.kernels.plan import Plan
from warpdyn.engine.kernels.queues import Queue, free_memory, open_queues
from warpdyn.foundations.core.messages import collected_warnings
from warpdyn.foundations.files.template import Template
from warpdyn.model.scene.scene import Scene

MOST_PREPARED = 4  # number of prepared jobs that a worker of a cluster keeps; it may run many scenes
# Number of regions for each worker, so that all workers end at about the same time; samples of the smallest region on a
# CPU; on a GPU; samples of the largest region on a GPU, in at least two blocks that are processed in parallel.
REGIONS_PER_WORKER, LEAST_CPU_REGION, LEAST_GPU_REGION, GPU_REGION = 4, 2**10, 2**15, 2**19
# Samples of a region whose samples a GPU reduces to statistics: a few seconds of work. At the start and the end of a
# region the GPU waits for the host; in a region of this size, this is a small share of the time.
REDUCED_REGION = 2**24


@dataclass(frozen=True, eq=False)
class Asked:
    """Statistics that a run (with all its groups of structures) requests, in the form that is sent to processes.

    Args:
        statistics: The statistics.
        scene: Scene of the run.
        structures: Number of structures of the scene, or of buildings of the portfolio.
        key: Unique name of this request.
    """

    statistics: tuple[Statistic, ...]
    scene: Scene
    structures: int
    key: str


@dataclass(frozen=True, eq=False, kw_only=True)
class Job:
    """Everything that a process needs to integrate the regions (ranges of structures) of a group.

    Args:
        scene: The scene of the group.
        structures: Number of structures of the group.
        integration: How the structures are integrated.
        chosen: Settings that warpdyn chose for the group: its longest step, or the result of a pilot run.
        execution: Devices, threads and memory of each process.
        outputs: Results of the run, without statistics and path.
        seed: Seed of every random draw.
        key: Unique name of the settings from which `Prepared` is computed: all except `folder`, `store` and `path`.
        group: Number of the group.
        versions: Versions of the packages DECIDING in the process that started the run.
        is_divided: Whether the group is divided into regions; False: one region contains all structures.
        is_reduced: Whether samples are reduced to statistics.
        folder: Folder for the file of each region; None: no files are written.
        store: Zarr store that the samples are written to; None: samples are in the file of the region, or returned.
        path: File or store that the run writes, for error messages.
    """

    scene: Scene
    structures: int
    integration: Integration
    chosen: dict[str, Any]
    execution: Execution
    outputs: Outputs
    seed: int
    key: str
    group: int = 0
    versions: tuple[str | None, ...] = ()
    is_divided: bool = True
    is_reduced: bool = False
    folder: Path | None = None
    store: Path | None = None
    path: Path | None = None


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Properties of a group of structures that are known before its first region (range of structures) is run.

    Args:
        template: Template of the group's dataset.
        attributes: Attributes of the dataset that describe the integration.
        samples_by_event: Number of response histories in each event.
        findings: Findings on stability of each event, still empty.
        demands: Names of the recorded demands.
        bytes_per_sample: Bytes of one sample in the dataset.
        structures_per_region: Number of structures in every region; the last region may have fewer.
        messages: Warnings about the settings.
        deferred: Names of variables that are computed only when a user reads them, in a dataset in memory.
    """

    template: Template
    attributes: dict[str, object]
    samples_by_event: tuple[int, ...]
    findings: list[StabilityFindings]
    demands: tuple[str, ...]
    bytes_per_sample: int
    structures_per_region: int
    messages: list[str]
    deferred: Set[str]


class Prepared:
    """A job with its model, columns and kernels, prepared for execution in this process."""

    def __init__(self, job: Job) -> None:
        execution = job.execution
        if execution.threads is None and (threads := _threads_of_worker()) is not None:
            execution = replace(execution, threads=threads)
        self.job = job
        self.run = build_run(job.scene, job.structures, job.integration, execution, job.seed, **job.chosen)
        self.columns = columns_kept(self.run, job.outputs)
        self.messages: list[str] = []  # warnings that were given during this preparation
        self._chosen: list[np.ndarray | None] = [None] * len(self.run.samples_by_event)

    @cached_property
    def plans(self) -> list[Plan]:
        """Plans of all kernels that the job launches, including those for halved steps, estimates and histories."""
        outputs, found = self.job.outputs, list[Plan]()
        for model in self.run.model.by_event:
            substeps = np.unique(model.timeline.substeps).tolist()
            if is_checked(model):
                substeps.append(2 * substeps[-1])  # the reliability check halves the steps of some samples
            found += [model.launched(each)[0] for each in substeps]
            if outputs.checked_share is not None or outputs.sample_error is not None:
                found.append(model.checking.in_float64(model.tolerance, self.run.execution.devices[0]).plan)
        return found if outputs.histories is None else [*found, history_plan(self.run.model.plan)]

    @cached_property
    def preparation(self) -> Preparation | None:
        """Preparation kernels, by which a device prepares its blocks; None: the host prepares the blocks.

        If samples are run again for an estimate, or their histories are returned, the host prepares all blocks, because
        it must choose these samples from all samples.
        """
        outputs = self.job.outputs
        chooses = (outputs.checked_share, outputs.sample_error, outputs.histories)
        return preparation_of(self.run) if all(each is None for each in chooses) else None

    def estimates(self, block: int) -> list[ErrorEstimate]:
        """Return an empty error estimate for each event; it reruns samples of `block` structures at a time."""
        run, share = self.run, self.job.outputs.checked_share
        if share is None:
            return []
        found = [
            ErrorEstimate(count, share, run.model.seed, block * count // run.structures, chosen)
            for count, chosen in zip(run.samples_by_event, self._chosen, strict=True)
        ]
        self._chosen = [estimate.chosen for estimate in found]
        return found


class Host:
    """State that a process keeps between regions: its prepared jobs, device queues and statistics.

    Args:
        is_worker: Whether the process is a worker of a cluster, whose warnings are sent to the process of the user.
    """

    def __init__(self, *, is_worker: bool = False) -> None:
        self.is_worker = is_worker
        self.reductions: dict[str, Reduction] = {}
        self._jobs = OrderedDict[str, Prepared]()
        self._queues: dict[tuple[object, ...], list[Queue]] = {}

    def prepared(self, job: Job) -> Prepared:
        """Return a job with its model and kernels for this process; the first call prepares it, later calls reuse it.

        Raises:
            RuntimeError: If this process has other versions of the packages DECIDING than the process of the user: a
                worker may have joined after the first check.
        """
        found = self._jobs.get(job.key)
        if found is None:
            if job.versions and job.versions != versions():
                raise RuntimeError(
                    f"a worker that joined the run has {named(versions())}, and not {named(job.versions)}: install the "
                    "same versions on all workers, because results depend on them"
                )
            with self.collected() as messages:
                found = self._jobs[job.key] = Prepared(job)
            found.messages = messages
            while self.is_worker and len(self._jobs) > MOST_PREPARED:
                self._jobs.popitem(last=False)
        self._jobs.move_to_end(job.key)
        return found

    def queues(self, prepared: Prepared) -> list[Queue]:
        """Return the device queues on which the blocks of a job are integrated.

        All jobs share the queues and their memory on a GPU. If `memory` is limited, each job gets new queues instead.
        """
        execution = prepared.run.execution
        key = tuple(execution.devices), execution.cores, prepared.job.key if execution.memory is not None else ""
        if key not in self._queues:
            self._queues.clear()  # frees the memory of the previous queues
            kept = taken_queues(execution.devices)
            if execution.memory is not None:
                kept.clear()  # frees their memory
            self._queues[key] = open_queues(execution.devices, execution.cores, kept)
        return self._queues[key]

    def keep_queues(self) -> None:
        """Keep the queues for the next run of this process, after a run without an error."""
        for (_, _, job_key), queues in self._queues.items():
            if not job_key:
                keep_queues(queues)
        self._queues.clear()

    def reduction(self, asked: Asked, threads: int) -> Reduction:
        """Return the statistics that a run requests; the first call creates them and removes earlier statistics."""
        if asked.key not in self.reductions:
            for earlier in self.reductions.values():
                earlier.__exit__()
            population = Population(asked.scene, asked.structures)
            self.reductions = {asked.key: Reduction(asked.statistics, population, threads)}
        return self.reductions[asked.key]

    def reset(self) -> None:
        """Reset the queues, because an earlier run that was stopped may have left blocks on the devices."""
        for queue in (queue for queues in self._queues.values() for queue in queues):
            queue.begin()

    @contextmanager
    def collected(self) -> Iterator[list[str]]:
        """Yield a list that collects the warnings within a `with` statement, for the process that started the run."""
        messages: list[str] = []
        with warnings.catch_warnings(record=True) if self.is_worker else nullcontext() as caught:
            if self.is_worker:
                warnings.simplefilter("always")
            with collected_warnings() as own:
                yield messages
        messages += dict.fromkeys([*(text for text, _ in own), *(str(each.message) for each in caught or ())])


worker_host = Host(is_worker=True)  # state of this process if it is a worker of a cluster
one_at_a_time = threading.RLock()  # a region uses all threads of its process, or its GPU


def on_worker(function: Any, job: Job, *arguments: object) -> Any:
    """Call a function of (host, job, arguments) on a worker of a cluster, one call at a time; return its result."""
    with one_at_a_time:
        worker_host.reset()
        return function(worker_host, job, *arguments)


def named(found: tuple[str | None, ...]) -> str:
    """Return versions of the packages DECIDING as text, such as "warpdyn 1.0, numpy missing"."""
    return ", ".join(f"{name} {of_it or 'missing'}" for name, of_it in zip(DECIDING, found, strict=True))


def machines_of(execution: Execution) -> list[str]:
    """Return the product names of devices, each once; for a CPU with registers of 512 bits, the name mentions them.

    With wider vector registers, kernels of tall buildings process more samples at a time and may round differently.
    """
    width = " with registers of 512 bits" if has_wide_registers() else ""
    return sorted({wp.get_device(name).name + (width if name == "cpu" else "") for name in execution.devices})


def lay_out_run(host: Host, job: Job, workers: int, neighbours: int, most_memory: int | None) -> Layout:
    """Check a job, and return the properties of its group of structures that are known before the first region.

    Args:
        host: State of this process.
        job: The job.
        workers: Number of processes that will run the job.
        neighbours: Number of these processes that share the memory of a machine.
        most_memory: Largest memory of each process [bytes]; None: the memory of the machine.
    """
    prepared = host.prepared(job)
    run, columns = prepared.run, prepared.columns
    if job.outputs.histories is not None:
        KeptHistories(job.outputs.histories, run, host.queues(prepared)[0])  # raises an error if they are not allowed
    if job.execution.memory is not None:
        divide(run, columns, job.execution.memory)  # raises an error if it is too small
    size = run.structures
    if job.is_divided:
        size = _structures_per_region(prepared, workers, neighbours, most_memory)
    return Layout(
        template=labelled(run.model, columns, blank_rows(run.model, columns, 0)),
        attributes=attributes_of_run(run),
        samples_by_event=run.samples_by_event,
        findings=run.findings,
        demands=tuple(run.model.demands),
        bytes_per_sample=bytes_per_row(run, columns),
        structures_per_region=size,
        messages=prepared.messages,
        deferred=set() if prepared.preparation is None else columns.keys() & deferred_names(job.scene),
    )


def _structures_per_region(prepared: Prepared, workers: int, neighbours: int, most_memory: int | None) -> int:
    """Return the number of structures in a region: about 30 s of work on a CPU, a few launches on a GPU.

    The number is a multiple of `structures_of_a_range`, the number of structures whose failed samples share a limit on
    reruns, and is limited by memory. Arguments: see `lay_out_run`.
    """
    run, job = prepared.run, prepared.job
    samples_each = run.samples // run.structures
    steps = float((run.model.timeline.intervals * run.model.timeline.substeps).mean())
    if run.execution.is_gpu:
        most = (REDUCED_REGION if job.is_reduced else GPU_REGION) * len(run.execution.devices)
        least = LEAST_GPU_REGION
    else:
        work = WORK_OF_A_BLOCK * run.model.threads / (steps * run.model.plan.dofs)
        most, least = min(CPU_BLOCK, max(1, int(work))), LEAST_CPU_REGION
    size = min(most, max(least, -(-run.samples // (REGIONS_PER_WORKER * workers)))) // samples_each
    if not job.is_reduced:  # the samples of a reduced region are never all in memory
        room = SHARE_OF_FREE_MEMORY * min(free_memory("cpu") / neighbours, most_memory or np.inf)
        if job.execution.memory is not None:
            room = (job.execution.memory - MEMORY_OF_CHUNKS) / 2  # the other half is for the region's blocks
        size = min(size, int(room / (samples_each * bytes_per_row(run, prepared.columns))))
    together = structures_of_a_range(samples_each)
    return min(max(together, size // together * together), run.structures)


def _threads_of_worker() -> int | None:
    """Return the number of threads of the Dask worker that executes this task; None outside a Dask task."""
    if "distributed" not in sys.modules:  # a worker has already imported it; the import takes a third of a second
        return None
    from distributed import get_worker

    try:
        return int(get_worker().state.nthreads)
    except ValueError:
        return None
