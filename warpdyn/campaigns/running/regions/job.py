"""What travels to the processes that run regions, and what each of them builds of it, once."""

from __future__ import annotations

import threading
import warnings
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from warpdyn.campaigns.accuracy.error_estimate import ErrorEstimate
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.running.blocks import (
    CPU_BLOCK,
    SHARE_OF_FREE_MEMORY,
    WORK_OF_A_BLOCK,
    bytes_per_row,
    bytes_per_structure,
    divide,
)
from warpdyn.campaigns.running.labels import labelled
from warpdyn.campaigns.running.run_scene import Kept, attributes_of_run, columns_kept
from warpdyn.campaigns.running.sinks import blank_rows
from warpdyn.engine.kernels.queues import free_memory, open_queues
from warpdyn.foundations.core.messages import collected_warnings
from warpdyn.foundations.files.versions import version_of
from warpdyn.model.scene.scene import Scene

DECIDING = ("warpdyn", "warp-lang", "numpy", "scipy")  # packages whose versions decide the bits of a run
MOST_PREPARED = 4  # jobs that a process remembers, each with the memory of its queues on a GPU: groups come in turn
# Regions for each worker, so that the last ones end at about the same time; samples of the smallest region on a CPU and
# on a GPU; samples of the largest on a GPU, in two blocks or more that are under way side by side.
REGIONS_PER_WORKER, LEAST_CPU_REGION, LEAST_GPU_REGION, GPU_REGION = 4, 2**10, 2**15, 2**19
# Samples of a region on a GPU where they are reduced to statistics: some seconds' work, beside which it costs little
# that no kernel runs while the first block of a region is prepared and the last one is collected.
REDUCED_REGION = 2**24


@dataclass(frozen=True, kw_only=True)
class Where:
    """Devices, threads and memory of each process that runs regions; arguments as of `simulate`.

    Unlike an Execution, it does not look for the devices where it is made.
    """

    device: str | Sequence[str] | None = None
    threads: int | None = None
    memory: int | None = None


@dataclass(frozen=True, kw_only=True)
class Job:
    """All that decides what a region holds, and where and how it is run.

    Args:
        scene, structures, integration, kept, seed: As of `SceneRun`.
        where: Devices, threads and memory.
        key: Name that no other job has.
        versions: Versions of DECIDING where the run was asked for.
        store: The Zarr store; None if the samples are handed back, or reduced to statistics.
        is_reduced: Whether they are reduced to statistics.
    """

    scene: Scene
    structures: int
    integration: Integration
    kept: Kept
    seed: int
    where: Where
    key: str = ""
    versions: tuple[str | None, ...] = ()
    store: Path | None = None
    is_reduced: bool = False

    def report_of(self, structures: range) -> Path:
        """Return the file that says that a region is done; with a store alone."""
        assert self.store is not None
        return self.store.with_name(f"{self.store.stem}-{structures.start}-{structures.stop}.npz")


@dataclass(frozen=True, kw_only=True)
class Layout:
    """What is known of a run before its first region.

    Args:
        template: Its dataset without samples.
        attributes: Attributes that say how it is integrated.
        samples_by_event: Number of histories of each event.
        events: Names of the events.
        demands: Names of the demands.
        bytes_per_sample: Bytes of a sample in the dataset.
        structures_per_region: Structures of every region but the last.
        messages: Warnings of what is asked for.
    """

    template: xr.Dataset
    attributes: dict[str, object]
    samples_by_event: tuple[int, ...]
    events: tuple[str, ...]
    demands: tuple[str, ...]
    bytes_per_sample: int
    structures_per_region: int
    messages: list[str]


class Prepared:
    """A job as a process runs it."""

    def __init__(self, job: Job) -> None:
        where = job.where
        threads = _threads_of_worker() if where.threads is None else where.threads
        execution = Execution(device=where.device, threads=threads, memory=where.memory)
        self.run = build_run(job.scene, job.structures, job.integration, execution, job.seed)
        self.columns = columns_kept(self.run, job.kept)
        self.queues = open_queues(execution.devices, self.run.model.threads)
        self.messages: list[str] = []  # what was warned of when it was built
        self._chosen: list[np.ndarray] | None = None

    def estimates(self, share: float | None, structures: int) -> list[ErrorEstimate]:
        """Return an error estimate for each event of a region of so many structures; none if no share is checked."""
        if share is None:
            return []
        run = self.run
        found = []
        for event, count in enumerate(run.samples_by_event):
            together = structures * count // run.structures
            known = None if self._chosen is None else self._chosen[event]
            found.append(ErrorEstimate(count, share, run.model.seed, together, known))
        self._chosen = [estimate.chosen for estimate in found]
        return found


one_at_a_time = threading.RLock()  # a region takes all threads of its process, or its GPU
_prepared: OrderedDict[str, Prepared] = OrderedDict()


def prepared_for(job: Job) -> Prepared:
    """Return a job as this process runs it, which is built once.

    Raises:
        RuntimeError: If this process has other versions of what decides a run's bits, as a worker may that came late.
    """
    found = _prepared.get(job.key)
    if found is None:
        if job.versions and job.versions != versions():
            raise RuntimeError(f"a worker that joined the run has {named(versions())}, and not {named(job.versions)}")
        with messages_caught() as messages:
            found = _prepared[job.key] = Prepared(job)
        found.messages = messages
        while len(_prepared) > MOST_PREPARED:
            _prepared.popitem(last=False)
    _prepared.move_to_end(job.key)
    return found


def versions() -> tuple[str | None, ...]:
    """Return the versions of DECIDING in this process; None of what is not installed."""
    return tuple(version_of(name) for name in DECIDING)


def named(found: tuple[str | None, ...]) -> str:
    """Return versions as text."""
    return ", ".join(f"{name} {of_it or 'missing'}" for name, of_it in zip(DECIDING, found, strict=True))


def lay_out_run(job: Job, workers: int, neighbours: int, most_memory: int | None) -> Layout:
    """Check what a job asks for, and return what is known of its run before its first region.

    Args:
        job: The job.
        workers: Number of processes that will run it.
        neighbours: How many of them share a machine's memory.
        most_memory: Bytes that each of them may take; None for no limit but the machine's.
    """
    with one_at_a_time:
        prepared = prepared_for(job)
        run, columns = prepared.run, prepared.columns
        if job.kept.histories is not None:
            job.kept.histories.check(run.samples)
        divide(run, columns, job.where.memory)
        return Layout(
            template=labelled(run.model, columns, blank_rows(run.model, columns, 0)),
            attributes=attributes_of_run(run, job.integration),
            samples_by_event=run.samples_by_event,
            events=tuple(run.model.scene.excitation.event_names),
            demands=tuple(run.model.demands),
            bytes_per_sample=bytes_per_row(run, columns),
            structures_per_region=_structures_per_region(prepared, job, workers, neighbours, most_memory),
            messages=prepared.messages,
        )


def _structures_per_region(prepared: Prepared, job: Job, workers: int, neighbours: int, most_memory: int | None) -> int:
    """Return how many structures a region has: half a minute of work on a CPU, some launches on a GPU."""
    run, samples_each = prepared.run, prepared.run.samples // prepared.run.structures
    steps = float((run.model.timeline.intervals * run.model.timeline.substeps).mean())
    if run.execution.is_gpu:
        most = REDUCED_REGION if job.is_reduced else GPU_REGION
        most, least = most * len(run.execution.devices), LEAST_GPU_REGION
    else:
        work = WORK_OF_A_BLOCK * run.model.threads / (steps * run.model.plan.dofs)
        most, least = min(CPU_BLOCK, max(1, int(work))), LEAST_CPU_REGION
    samples = min(most, max(least, -(-run.samples // (REGIONS_PER_WORKER * workers))))
    if job.is_reduced:  # which holds blocks alone
        return int(max(1, min(samples // samples_each, run.structures)))
    free = SHARE_OF_FREE_MEMORY * min(free_memory("cpu") / neighbours, most_memory or np.inf)
    room = (job.where.memory or free) / bytes_per_structure(run, prepared.columns)[0]
    return int(max(1, min(samples // samples_each, room, run.structures)))


def _threads_of_worker() -> int | None:
    """Return the threads that a worker of Dask was given, in one of its tasks; None elsewhere."""
    try:
        from distributed import get_worker

        return int(get_worker().state.nthreads)
    except (ImportError, ValueError):
        return None


@contextmanager
def messages_caught() -> Iterator[list[str]]:
    """Collect warnings, each once, for the process that asked for the run."""
    said: list[str] = []
    # Where that process is this one, it may collect those of this package itself.
    with warnings.catch_warnings(record=True) as caught, collected_warnings() as own:
        warnings.simplefilter("always")
        yield said
    said += dict.fromkeys([*(message for message, _ in own), *(str(each.message) for each in caught)])
