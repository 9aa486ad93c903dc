"""Regions run by this process."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future as LocalFuture
from contextlib import ExitStack
from itertools import chain
from typing import Any

from warpdyn.campaigns.integration.settings import Execution
from warpdyn.campaigns.running.regions.job import Host, Job, Order, machines_of
from warpdyn.campaigns.running.regions.region import Region
from warpdyn.campaigns.running.regions.report import Report
from warpdyn.engine.kernels.compilation import compile_side_by_side, compiling, loading
from warpdyn.engine.kernels.plan import Plan
from warpdyn.foundations.core.interruption import stop_if_asked
from warpdyn.foundations.core.messages import collected_warnings, warn_caller
from warpdyn.foundations.core.thread_pool import Ahead

Division = tuple[int, int, int | None]
Call = tuple[Any, ...]  # a key, a function of a host, a job and other arguments, the job, these arguments


class Here:
    """This process; `OnCluster` has the same methods.

    Args:
        execution: Devices, threads and memory.

    Attributes:
        machines: Makers' names of the devices, as `machines_of` returns them.
        layout: Number of workers, number of workers that share a machine, and largest memory [bytes] of a worker.
    """

    def __init__(self, execution: Execution) -> None:
        self.execution, self.host = execution, Host()
        self.machines = machines_of(execution)
        self.layout: Division = (1, 1, None)

    def ask(self, function: Callable, job: Job, *arguments: object) -> Any:
        """Return the result of one call."""
        return function(self.host, job, *arguments)

    def each(self, calls: Iterable[Call]) -> Iterator[tuple[Any, Any]]:
        """Yield keys and results of calls, in order."""
        for key, function, *arguments in calls:
            stop_if_asked()
            yield key, function(self.host, *arguments)

    def regions(
        self, jobs: Sequence[Job], orders: Iterable[Order], advance: Callable[[int], object]
    ) -> Iterator[tuple[Order, Report]]:
        """Yield the reports of regions, in order.

        Args:
            jobs: The jobs of all groups.
            orders: The regions.
            advance: Called with the number of histories done since its last call.

        A region begins while the region before it runs, so that a GPU does not wait for its first block; if `memory` is
        limited, it begins after the region before it.
        """
        execution, begun = self.execution, list[Region]()
        plans = {job.key: self.host.prepared(job).plans for job in jobs}

        def begin(order: Order) -> tuple[Order, LocalFuture[Region], list[tuple[str, type[Warning]]]]:
            """Begin a region; its warnings are also returned if it raises an error."""
            future: LocalFuture[Region] = LocalFuture()
            with collected_warnings() as found:  # the line of the user's code is not known in this thread
                try:
                    what = order.job, order.structures, order.asked, order.numbers, order.rows
                    region = Region(self.host, *what, is_partial=order.is_partial)
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

            upcoming = Ahead(begin, orders, int(execution.memory is None))
            stack.callback(_close, begun)
            stack.callback(upcoming.close)
            for order, future, found in upcoming:
                stop_if_asked()
                with order.named():
                    for message, category in found:
                        warn_caller(message, category)
                    region = future.result()
                    wait_for(plans.pop(order.job.key, []))
                    report = region.finish(advance)
                begun.remove(region)
                yield order, report


def _close(regions: list[Region]) -> None:
    """Prepare no more blocks of regions that have begun."""
    for region in regions:
        region.close()
