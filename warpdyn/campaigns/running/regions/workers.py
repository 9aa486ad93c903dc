"""Execution of a run by this process, which integrates its regions (ranges of structures) one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future as LocalFuture
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.campaigns.integration.settings import Execution
from warpdyn.campaigns.running.regions.job import Host, Job, Layout, machines_of
from warpdyn.campaigns.running.regions.region import Region
from warpdyn.campaigns.running.regions.report import Report
from warpdyn.engine.kernels.compilation import compile_side_by_side, compiling, loading
from warpdyn.engine.kernels.plan import Plan
from warpdyn.foundations.core.interruption import stop_if_asked
from warpdyn.foundations.core.messages import collected_warnings, warn_caller
from warpdyn.foundations.core.thread_pool import Ahead

Division = tuple[int, int, int | None]  # workers, workers that share a machine, largest memory of a worker [bytes]
Call = tuple[Any, ...]  # a key, a function of (host, job, other arguments), the job, the other arguments


@dataclass(eq=False, kw_only=True)
class Part:
    """A group of structures that share a kernel, divided into regions (ranges of structures).

    Args:
        number: Number of the group in the run.
        job: Everything that a process needs to run the regions.
        layout: Properties of the group that are known before its first region.
        regions: Range of structures of each region, numbered within the group.
        named: Function that returns a context in which messages contain the name of the group.
        buildings: Number in the portfolio of each structure of the group; None: the scene has one structure.
        reports: Reports of the finished regions, by the number of the region.
    """

    number: int
    job: Job
    layout: Layout
    regions: list[range]
    named: Callable[[], AbstractContextManager[object]]
    buildings: np.ndarray | None = None
    reports: dict[int, Report] = field(default_factory=dict)

    @property
    def samples(self) -> int:
        """Number of samples of the group."""
        return self.layout.samples_by_event[-1]

    @property
    def histories(self) -> int:
        """Number of response histories of the group, summed over all events."""
        return sum(self.layout.samples_by_event)

    @property
    def along(self) -> dict[str, xr.Variable]:
        """Variables of the dataset that have one value for each sample, by name, without samples."""
        return {str(k): v for k, v in self.layout.template.variables.items() if v.dims[:1] == ("sample",)}

    def first_sample(self, structure: int) -> int:
        """Return the number of the first sample of a structure, within the group."""
        return structure * (self.samples // self.job.structures)

    def numbers(self, place: int) -> np.ndarray:
        """Return the number in the whole run of each structure of region number `place`, shape [structure]."""
        region = np.asarray(self.regions[place])
        return region if self.buildings is None else self.buildings[region]


# An order to run a region: its group, its number in the group, and additional constructor arguments of `Region`.
Order = tuple[Part, int, dict[str, Any]]


class Here:
    """The current process as the only worker of a run; the class `OnCluster` has the same methods.

    Args:
        execution: Devices, threads and memory.

    Attributes:
        machines: Product names of the devices, from `machines_of`.
        layout: Number of workers, number of workers that share a machine, and largest memory of a worker [bytes].
    """

    def __init__(self, execution: Execution) -> None:
        self.execution, self.host = execution, Host()
        self.machines = machines_of(execution)
        self.layout: Division = (1, 1, None)

    def ask(self, function: Callable, job: Job, *arguments: object) -> Any:
        """Execute one function call in this process, and return its result."""
        return function(self.host, job, *arguments)

    def each(self, calls: Iterable[Call]) -> Iterator[tuple[Any, Any]]:
        """Execute calls one after the other; yield the (key, result) of each call."""
        for key, function, *arguments in calls:
            stop_if_asked()
            yield key, function(self.host, *arguments)

    def regions(
        self, parts: Sequence[Part], orders: Iterable[Order], advance: Callable[[int], object]
    ) -> Iterator[tuple[Part, int, Report]]:
        """Integrate regions in their order; yield (group, number of the region, report) of each.

        Args:
            parts: The groups that have unfinished regions.
            orders: The regions.
            advance: Called with the number of histories done since its last call.

        The preparation of a region begins while the previous region runs, so that a GPU does not wait for its first
        block. If `memory` is limited, the preparation begins after the previous region has finished. A single region
        needs no thread for it.
        """
        execution, begun = self.execution, list[Region]()
        jobs = [part.job for part in parts]
        plans = {part.number: self.host.prepared(part.job).plans for part in parts}

        def begin(order: Order) -> tuple[Order, LocalFuture[Region], list[tuple[str, type[Warning]]]]:
            """Begin a region in another thread; return it as a future, with its warnings."""
            future: LocalFuture[Region] = LocalFuture()
            with collected_warnings() as found:  # the line of the user's code is not known in this thread
                try:
                    part, place, given = order
                    region = Region(self.host, part.job, part.regions[place], **given)
                    begun.append(region)
                    future.set_result(region)
                except BaseException as error:
                    future.set_exception(error)
            return order, future, found

        with ExitStack() as stack:
            preparations = [self.host.prepared(job).preparation for job in jobs]
            kernels = [kernel for each in preparations if each is not None for kernel in each.kernels]
            stack.enter_context(loading(kernels, execution.devices[0], execution.cores))
            wait_for: Callable[[list[Plan]], object]
            if len(jobs) > 1:
                every = chain(*plans.values())
                wait_for = stack.enter_context(compiling(every, execution.devices[0], execution.cores))
            else:

                def wait_for(some: list[Plan]) -> None:
                    compile_side_by_side(some, execution.devices[0], execution.cores)

            left = sum(len(part.regions) - len(part.reports) for part in parts)
            upcoming = Ahead(begin, orders, int(execution.memory is None and left > 1))
            stack.callback(_close, begun)
            stack.callback(upcoming.close)
            for (part, place, _), future, found in upcoming:
                stop_if_asked()
                with part.named():
                    for message, category in found:
                        warn_caller(message, category)
                    region = future.result()
                    wait_for(plans.pop(part.number, []))
                    report = region.finish(advance)
                begun.remove(region)
                yield part, place, report


def _close(regions: list[Region]) -> None:
    """Stop the preparation of further blocks in all regions that have begun."""
    for region in regions:
        region.close()
