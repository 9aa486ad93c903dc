"""Jobs, which are sent to the processes that run regions, and their preparation in each process."""

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
from warpdyn.campaigns.running.tables import blank_rows, columns_kept
from warpdyn.engine.device.processor import has_wide_registers
from warpdyn.engine.kernels.build import history_plan
from warpdyn.engine.kernels.plan import Plan
from warpdyn.engine.kernels.queues import Queue, free_memory, open_queues
from warpdyn.foundations.core.messages import collected_warnings
from warpdyn.foundations.files.template import Template
from warpdyn.model.scene.scene import Scene

MOST_PREPARED = 4  # jobs that a worker of a cluster remembers, which runs many scenes
# Regions for each worker, so that all workers end at about the same time; samples of the smallest region on a CPU and
# on a GPU; samples of the largest region on a GPU, in at least two blocks that are processed in parallel.
REGIONS_PER_WORKER, LEAST_CPU_REGION, LEAST_GPU_REGION, GPU_REGION = 4, 2**10, 2**15, 2**19
# Samples of a region on a GPU if they are reduced to statistics: a few seconds of work. At the start and the end of a
# region the GPU waits for the host, which then takes a small share of the time.
REDUCED_REGION = 2**24


@dataclass(frozen=True, eq=False)
class Asked:
    """Statistics of a run (of all its groups), in the form that is sent to processes.

    Args:
        statistics: The statistics.
        scene: The scene.
        structures: Number of its structures, or of a portfolio's buildings.
        key: Unique name of these statistics.
    """

    statistics: tuple[Statistic, ...]
    scene: Scene
    structures: int
    key: str


@dataclass(frozen=True, eq=False, kw_only=True)
class Job:
    """Everything that a process needs to run the regions of a group.

    Args:
        scene: The scene of the group.
        structures: Number of structures of the group.
        integration: How they are integrated.
        chosen: Settings that warpdyn chose for the group: its longest step, or the result of a pilot.
        execution: Devices, threads and memory of each process.
        outputs: Results of the run, without statistics and path.
        seed: Seed of every random draw.
        key: Unique name of what `Prepared` computes from the job: all but the folder, the store and the path.
        group: Number of the group.
        versions: Versions of DECIDING in the process that started the run.
        is_divided: Whether the run is divided into regions; otherwise one region has all structures.
        is_reduced: Whether samples are reduced to statistics.
        folder: Folder for the file of each region; None: no files.
        store: Zarr store that the samples are written to; None: they are in the file of the region, or returned.
        path: The file or store of the run, for messages.
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
    """Properties of a group that are known before its first region.

    Args:
        template: Template of its dataset.
        attributes: Attributes that describe its integration.
        samples_by_event: Number of histories of each event.
        findings: Empty findings of each event.
        demands: Names of the demands.
        bytes_per_sample: Bytes of a sample in the dataset.
        structures_per_region: Structures of every region but the last.
        messages: Warnings about the settings.
        deferred: Variables that a dataset in memory computes when they are read.
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
    """A job that is prepared to run in this process."""

    def __init__(self, job: Job) -> None:
        execution = job.execution
        if execution.threads is None and (threads := _threads_of_worker()) is not None:
            execution = replace(execution, threads=threads)
        self.job = job
        self.run = build_run(job.scene, job.structures, job.integration, execution, job.seed, **job.chosen)
        self.columns = columns_kept(self.run, job.outputs)
        self.messages: list[str] = []  # warnings that were given when it was built
        self._chosen: list[np.ndarray | None] = [None] * len(self.run.samples_by_event)

    @cached_property
    def plans(self) -> list[Plan]:
        """The kernels that are launched."""
        outputs, found = self.job.outputs, list[Plan]()
        for model in self.run.model.by_event:
            substeps = np.unique(model.timeline.substeps).tolist()
            if is_checked(model):
                substeps.append(2 * substeps[-1])  # its steps are divided
            found += [model.launched(each)[0] for each in substeps]
            if outputs.checked_share is not None or outputs.sample_error is not None:
                found.append(model.checking.in_float64(model.tolerance, self.run.execution.devices[0]).plan)
        return found if outputs.histories is None else [*found, history_plan(self.run.model.plan)]

    @cached_property
    def preparation(self) -> Preparation | None:
        """Preparation of the blocks on their devices; None: the host prepares them.

        The host prepares samples that are chosen for further runs or for histories, because it needs all of them.
        """
        outputs = self.job.outputs
        chooses = (outputs.checked_share, outputs.sample_error, outputs.histories)
        return preparation_of(self.run) if all(each is None for each in chooses) else None

    def estimates(self, block: int) -> list[ErrorEstimate]:
        """Return an error estimate for each event; `block` is the number of structures that are run again at a time."""
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
    """The jobs, the device queues and the statistics that a process keeps from one region to the next.

    Args:
        is_worker: Whether it is a worker of a cluster, whose messages go to the process that started the run.
    """

    def __init__(self, *, is_worker: bool = False) -> None:
        self.is_worker = is_worker
        self.reductions: dict[str, Reduction] = {}
        self._jobs = OrderedDict[str, Prepared]()
        self._queues: dict[tuple[object, ...], list[Queue]] = {}

    def prepared(self, job: Job) -> Prepared:
        """Return a job that is prepared to run in this process; it is prepared once.

        Raises:
            RuntimeError: If this process has other versions of DECIDING, as a worker may have that joined late.
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
        """Return the device queues for the blocks of a job.

        All jobs share the queues and their memory on a GPU, unless `memory` limits it: then each job gets new queues.
        """
        execution = prepared.run.execution
        key = tuple(execution.devices), execution.cores, prepared.job.key if execution.memory is not None else ""
        if key not in self._queues:
            self._queues.clear()  # frees the memory of the others
            self._queues[key] = open_queues(execution.devices, execution.cores)
        return self._queues[key]

    def reduction(self, asked: Asked, threads: int) -> Reduction:
        """Return the reduction of the regions of a run, made at the first call; it allocates memory for cells later."""
        if asked.key not in self.reductions:
            for earlier in self.reductions.values():
                earlier.__exit__()
            population = Population(asked.scene, asked.structures)
            self.reductions = {asked.key: Reduction(asked.statistics, population, threads)}
        return self.reductions[asked.key]

    def reset(self) -> None:
        """Reset the queues: an earlier run that was stopped may have left blocks on the devices."""
        for queue in (queue for queues in self._queues.values() for queue in queues):
            queue.begin()

    @contextmanager
    def collected(self) -> Iterator[list[str]]:
        """Collect the warnings of a block, each once, for the process that started the run."""
        messages: list[str] = []
        with warnings.catch_warnings(record=True) if self.is_worker else nullcontext() as caught:
            if self.is_worker:
                warnings.simplefilter("always")
            with collected_warnings() as own:
                yield messages
        messages += dict.fromkeys([*(text for text, _ in own), *(str(each.message) for each in caught or ())])


worker_host = Host(is_worker=True)  # of a process that is a worker of a cluster
one_at_a_time = threading.RLock()  # a region takes all threads of its process, or its GPU


def on_worker(function: Any, job: Job, *arguments: object) -> Any:
    """Call a function of this module or of `region` on a worker of a cluster."""
    with one_at_a_time:
        worker_host.reset()
        return function(worker_host, job, *arguments)


def named(found: tuple[str | None, ...]) -> str:
    """Return versions of DECIDING as text."""
    return ", ".join(f"{name} {of_it or 'missing'}" for name, of_it in zip(DECIDING, found, strict=True))


def machines_of(execution: Execution) -> list[str]:
    """Return the makers' names of devices, each once, and how wide the vector registers of a CPU are.

    Kernels of tall buildings have other rows of samples if registers are wider, and may round differently.
    """
    width = " with registers of 512 bits" if has_wide_registers() else ""
    return sorted({wp.get_device(name).name + (width if name == "cpu" else "") for name in execution.devices})


def lay_out_run(host: Host, job: Job, workers: int, neighbours: int, most_memory: int | None) -> Layout:
    """Check a job, and return the properties of its group that are known before the first region.

    Args:
        host: The process.
        job: The job.
        workers: Number of processes that will run it.
        neighbours: How many of them share the memory of a machine.
        most_memory: Bytes that each of them may take; None: the memory of the machine.
    """
    prepared = host.prepared(job)
    run, columns = prepared.run, prepared.columns
    if job.outputs.histories is not None:
        KeptHistories(job.outputs.histories, run, host.queues(prepared)[0])  # checks the histories
    divide(run, columns, job.execution.memory)
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
    """Return the structures of a region: 30 s of work on a CPU, a few launches on a GPU.

    A region has whole ranges of structures, whose failed samples share a limit on reruns.
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
    if not job.is_reduced:  # a region that is reduced is never in memory as a whole
        room = SHARE_OF_FREE_MEMORY * min(free_memory("cpu") / neighbours, most_memory or np.inf)
        if job.execution.memory is not None:
            room = (job.execution.memory - MEMORY_OF_CHUNKS) / 2  # the other half is for its blocks
        size = min(size, int(room / (samples_each * bytes_per_row(run, prepared.columns))))
    together = structures_of_a_range(samples_each)
    return min(max(together, size // together * together), run.structures)


def _threads_of_worker() -> int | None:
    """Return the threads of the Dask worker that runs this task; None outside of a task."""
    if "distributed" not in sys.modules:  # a worker has imported it; its import takes a third of a second
        return None
    from distributed import get_worker

    try:
        return int(get_worker().state.nthreads)
    except ValueError:
        return None
