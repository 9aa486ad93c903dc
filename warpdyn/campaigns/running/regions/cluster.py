"""Execution of a run by the workers of a Dask cluster, which integrate its regions (ranges of structures)."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from warpdyn.campaigns.integration.settings import Execution
from warpdyn.campaigns.running.regions.checkpoint import DECIDING, versions
from warpdyn.campaigns.running.regions.job import Asked, Job, machines_of, named, on_worker
from warpdyn.campaigns.running.regions.region import run_region
from warpdyn.campaigns.running.regions.report import Report
from warpdyn.campaigns.running.regions.workers import Call, Division, Order, Part
from warpdyn.foundations.core.interruption import stop_if_asked
from warpdyn.foundations.core.messages import say, warn_caller

if TYPE_CHECKING:
    from distributed import Client, Future, Worker

TASKS_PER_WORKER = 2  # one task that runs and one that is ready, so that a worker does not wait for its next task
PATIENCE = 0.3  # time between two checks for Ctrl-C while waiting [s]


@dataclass(frozen=True)
class About:
    """Properties of a worker of a cluster.

    Args:
        host: Name of the worker's machine.
        machines: Product names of the worker's devices.
        gpu: The worker's GPU, with its PCI address, which is unique on the machine; empty for a CPU.
        most_memory: Largest memory that the worker may use [bytes]; None: the memory of the machine.
        problem: Reason why the worker cannot run anything; empty if it can.
    """

    host: str = ""
    machines: list[str] = field(default_factory=list)
    gpu: str = ""
    most_memory: int | None = None
    problem: str = ""


class OnCluster:
    """The workers of a Dask cluster, which integrate the regions of a run (ranges of structures).

    Args:
        client: Client of the cluster.
        device: Device of every worker; None: a worker's first GPU, or its CPU if it has no GPU.
        threads: CPU threads of every worker; None: the number of threads that the worker was started with.

    Raises:
        RuntimeError: If the workers have other versions of warpdyn, Warp, NumPy or SciPy than this process, or have
            devices of different kinds.
        ValueError: If a worker does not have the device.
    """

    def __init__(self, client: Client, device: str | None, threads: int | None) -> None:
        self.client = client
        self._held: dict[Job | Asked, Future] = {}
        self._wait_for_one()
        self._check_versions()
        found: dict[str, About] = client.run(_about, device, threads)
        problems = {worker: about.problem for worker, about in found.items() if about.problem}
        if problems:
            raise ValueError(f"cluster: {_listed(problems)}")
        kinds = {worker: ", ".join(about.machines) for worker, about in found.items()}
        if len(set(kinds.values())) > 1:
            raise RuntimeError(
                "cluster: workers run on devices of different kinds, whose results differ in their last digits: "
                f"{_listed(kinds)}; start workers of one kind, or give device='cpu'"
            )
        self.machines = next(iter(found.values())).machines
        shared = Counter((about.host, about.gpu) for about in found.values() if about.gpu)
        for (host, gpu), count in shared.items():
            if count > 1:
                warn_caller(f"{count} workers share {gpu} of {host}: start one for each GPU, as dask-cuda does")
        hosts = Counter(about.host for about in found.values())
        limits = [about.most_memory for about in found.values() if about.most_memory]
        self.layout: Division = len(found), max(hosts.values()), min(limits, default=None)

    def ask(self, function: Callable, job: Job, *arguments: object) -> Any:
        """Execute one function call on any of the workers, and return its result."""
        return next(iter(self.each([("", function, job, *arguments)])))[1]

    def each(self, calls: Iterable[Call]) -> Iterator[tuple[Any, Any]]:
        """Execute calls on the workers; yield (key, result) of each as it finishes.

        If the caller stops early, the other calls are cancelled.
        """
        waiting: dict[Future, tuple[Any, str]] = {}
        calls = iter(calls)
        try:
            while True:
                most = TASKS_PER_WORKER * max(1, len(self.client.nthreads()))
                while len(waiting) < most and (call := next(calls, None)) is not None:
                    key, function, job, *arguments = call
                    sent = [self._sent(each) if isinstance(each, Asked) else each for each in arguments]
                    future = self.client.submit(on_worker, function, self._sent(job), *sent, pure=False)
                    waiting[future] = key, _text(arguments)
                if not waiting:
                    return
                for future in self._finished(list(waiting)):
                    key, what = waiting.pop(future)
                    result = _result(future, what)
                    future.release()
                    yield key, result
        finally:
            if waiting:
                self.client.cancel(list(waiting), force=True)

    def regions(
        self, parts: Sequence[Part], orders: Iterable[Order], advance: Callable[[int], object]
    ) -> Iterator[tuple[Part, int, Report]]:
        """Integrate regions on the workers; yield (group, number of the region, report) of each as it finishes."""
        calls = (
            ((part, place), run_region, part.job, part.regions[place], given.get("asked"), given.get("numbers"))
            for part, place, given in orders
        )
        for (part, place), report in self.each(calls):
            yield part, place, report
            advance(len(part.regions[place]) * sum(part.job.scene.excitation.samples_by_event))

    def check_store(self, job: Job) -> None:
        """Raise an OSError if a worker cannot write to the folder of a job, for example on another disk."""
        blind = [worker for worker, sees in self.client.run(_sees, str(job.folder)).items() if not sees]
        if blind:
            raise OSError(
                f"cluster: {_some(blind)} cannot write to {job.folder}: give a path on a disk that all workers share"
            )

    def _sent(self, job: Job | Asked) -> Future:
        """Send a job or statistics to the cluster once, and return the future of this object.

        The object is sent as the result of a task, not as scattered data: workers copy it from each other, and if all
        workers with a copy have died, the scheduler runs the task again.
        """
        if job not in self._held:
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", "Sending large graph")  # it is sent once
                self._held[job] = self.client.submit(_same, job, pure=False)
        return self._held[job]

    def _finished(self, futures: list[Future]) -> list[Future]:
        """Wait until at least one of the tasks has finished; return all finished tasks. Ctrl-C stops the wait."""
        from distributed import wait

        while True:
            stop_if_asked()
            try:
                return list(wait(futures, timeout=PATIENCE, return_when="FIRST_COMPLETED").done)
            except TimeoutError:
                continue

    def _wait_for_one(self) -> None:
        """Wait until the cluster has at least one worker, because a batch system may start the workers later."""
        from distributed import TimeoutError as TimedOut

        if not self.client.nthreads():
            say("the cluster has no workers yet, and the run waits for one: start workers, or press Ctrl-C")
        while not self.client.nthreads():
            stop_if_asked()
            try:
                self.client.wait_for_workers(1, timeout=PATIENCE)
            except (TimeoutError, TimedOut):
                continue

    def _check_versions(self) -> None:
        """Raise a RuntimeError if a worker has other versions of the packages DECIDING than this process."""
        own = versions()

        # A nested function is pickled by value, so a worker without warpdyn can still run it.
        def ask(names: tuple[str, ...]) -> tuple[str | None, ...]:
            from importlib.metadata import PackageNotFoundError, version

            found: list[str | None] = []
            for name in names:
                try:
                    if name == "warpdyn":
                        from warpdyn import __version__

                        found.append(__version__)
                    else:
                        found.append(version(name))
                except (ImportError, PackageNotFoundError):
                    found.append(None)
            return tuple(found)

        answers = self.client.run(ask, DECIDING)
        others = {worker: named(found) for worker, found in answers.items() if found != own}
        if others:
            raise RuntimeError(
                f"cluster: workers have other versions than this process, which has {named(own)}: {_listed(others)}; "
                "install the same versions, because results depend on them"
            )


def workers_of(cluster: object, device: object, threads: int | None) -> OnCluster:
    """Return the workers of a Dask cluster, after checks of the user's arguments.

    Args:
        cluster: The value that the user gave as the client of the cluster.
        device: Device of every worker; None: a worker's first GPU, or its CPU.
        threads: CPU threads of every worker; None: the number that the worker was started with.

    Raises:
        TypeError: If `cluster` is not a client, or is a client for asynchronous use.
        ValueError: If the client is closed, or several devices are given.
    """
    try:
        from distributed import Client
    except ImportError:  # without the package `distributed`, no object is a Client
        Client = ()  # type: ignore[assignment,misc]
    if not isinstance(cluster, Client):
        raise TypeError(f"cluster must be a dask.distributed Client, as Client(LocalCluster()), got {cluster!r}")
    if cluster.asynchronous:
        raise TypeError("cluster must be a Client that waits for results: remove asynchronous=True")
    if cluster.status != "running":
        raise ValueError(
            f"cluster must be a Client that is connected to its scheduler; it is {cluster.status}: give a new "
            "Client(address)"
        )
    if device is not None and (not isinstance(device, str) or device == "cuda"):
        raise ValueError(
            f"device must be one device with cluster=, as 'cpu' or 'cuda:0', got {device!r}: a worker has one device, "
            "and dask-cuda starts a worker for each GPU"
        )
    return OnCluster(cluster, device, threads)


def _about(device: str | None, threads: int | None, dask_worker: Worker) -> About:
    """Return the properties of the worker that executes this function; Dask passes the argument `dask_worker`."""
    import socket

    import warp as wp

    try:
        execution = Execution(device=device, threads=threads)
        first = execution.devices[0]
    except ValueError as error:
        return About(problem=str(error))
    gpu = f"{first} ({wp.get_device(first).pci_bus_id})" if execution.is_gpu else ""
    return About(socket.gethostname(), machines_of(execution), gpu, dask_worker.memory_manager.memory_limit)


def _sees(path: str) -> bool:
    import os

    return os.access(path, os.W_OK)


def _same(sent: Job | Asked) -> Job | Asked:
    return sent


def _result(future: Future, what: str) -> Any:
    """Return the result of a finished task, or raise its error; `what` describes the task in error messages."""
    from distributed import KilledWorker

    try:
        return future.result()
    except KilledWorker as error:
        raise RuntimeError(
            f"cluster: {what} was given up, because {error.allowed_failures + 1} workers died while they ran it. If "
            "they ran out of memory, give memory=; if the batch system ended them, ask it for more time"
        ) from error


def _text(arguments: Iterable[object]) -> str:
    """Return a short description of a call from its arguments, for error messages."""
    found = next((each for each in arguments if isinstance(each, range)), None)
    return "the preparation of the run" if found is None else f"structures {found.start} to {found.stop - 1}"


def _listed(by_worker: dict[str, str]) -> str:
    """Return texts of workers as one line, in which equal texts occur once, after the names of their workers."""
    workers: dict[str, list[str]] = {}
    for worker, text in by_worker.items():
        workers.setdefault(text, []).append(worker)
    return "; ".join(f"{_some(found)}: {text}" for text, found in workers.items())


def _some(found: list[str]) -> str:
    """Return the number of workers and the names of the first three, as text."""
    shown = ", ".join(sorted(found)[:3])
    return f"{len(found)} workers ({shown}{', ...' if len(found) > 3 else ''})" if len(found) > 1 else found[0]
