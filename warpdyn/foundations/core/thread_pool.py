"""Computing in threads that Ctrl-C can stop: many small parts that fit in the CPU's cache, or one long call."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache, partial
from itertools import islice
from queue import Empty, SimpleQueue
from threading import Thread
from typing import TypeVar

from threadpoolctl import ThreadpoolController

from warpdyn.foundations.core.interruption import stop_if_asked

STRUCTURES_AT_A_TIME = 2**13  # default number of structures in a part
LEAST_AT_A_TIME = 2**10  # least number of structures for which another thread is used: fewer cost more than they gain
MOST_THREADS = 2**12  # more than the number of cores of any machine
PATIENCE = 0.1  # [s] between two checks whether a signal has arrived

Item = TypeVar("Item")
Result = TypeVar("Result")

_idle: list[SimpleQueue[Callable[[], None]]] = []  # queues of threads of `in_background` that wait for a call
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_idle.clear)  # a forked process does not have the threads


def cores() -> int:
    """Return the number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_parts(
    work: Callable[[slice], Result], structures: int, threads: int, at_a_time: int = STRUCTURES_AT_A_TIME
) -> list[Result]:
    """Divide structures into parts, compute each part in one of several threads, and return the results in order.

    If several parts fail, the error of the first failed part is raised.

    Args:
        work: Function from a part (a slice of the structures) to its result.
        structures: Number of structures.
        threads: Number of CPU threads.
        at_a_time: Number of structures in a part.
    """
    parts = [slice(first, min(first + at_a_time, structures)) for first in range(0, structures, at_a_time)]
    if structures <= 1:
        return [work(part) for part in parts]
    # The matrices of structures are small, and several threads of BLAS would mostly wait for each other: eigenvalues of
    # 512 matrices of 30 rows take 1/8 of the time with one thread (2 cores). If several threads are here at once, the
    # first one sets and restores the number.
    with _libraries().limit(limits=1, user_api="blas"):
        if len(parts) == 1:
            return [work(parts[0])]
        pool = ThreadPoolExecutor(threads)
        try:
            tasks = [pool.submit(work, part) for part in parts]
            for _ in as_finished(tasks):
                pass
            return [task.result() for task in tasks]
        finally:
            pool.shutdown(cancel_futures=True)


def structures_of_a_part(structures: int, threads: int) -> int:
    """Return the number of structures in a part if each thread computes about the same number of structures."""
    return min(max(-(-structures // threads), LEAST_AT_A_TIME), STRUCTURES_AT_A_TIME)


@cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController()


def as_finished(tasks: Iterable[Future[Result]]) -> Iterator[Future[Result]]:
    """Yield tasks in the order in which they finish; Ctrl-C interrupts the wait."""
    tasks, done = list(tasks), SimpleQueue[Future[Result]]()
    for task in tasks:
        task.add_done_callback(done.put)
    for _ in tasks:
        while True:
            stop_if_asked()
            try:
                finished = done.get(timeout=PATIENCE)
            except Empty:
                continue
            break
        yield finished


def result_of(task: Future[Result]) -> Result:
    """Wait for a task and return its result; Ctrl-C interrupts the wait."""
    for _ in as_finished([task]):
        pass
    return task.result()


class Ahead(Iterator[Result]):
    """Iterator over the results of a function for a sequence of items. Other threads compute the next results ahead.

    Args:
        work: The function.
        items: Arguments of the function, one per call.
        depth: Number of results computed in advance; 0: each result is computed when it is requested, without threads.
    """

    def __init__(self, work: Callable[[Item], Result], items: Iterable[Item], depth: int) -> None:
        self._work, self._items = work, iter(items)
        self._threads = ThreadPoolExecutor(depth) if depth else None
        self._waiting = deque[Future[Result]]()
        for _ in range(depth):
            self._submit()

    def _submit(self) -> None:
        for item in islice(self._items, 1):
            assert self._threads is not None
            self._waiting.append(self._threads.submit(self._work, item))

    def __next__(self) -> Result:
        if self._threads is None:
            return self._work(next(self._items))
        self._submit()
        if not self._waiting:
            raise StopIteration
        return result_of(self._waiting.popleft())

    def close(self) -> None:
        """Cancel the calls that have not started, and wait until the running calls are finished."""
        if self._threads is not None:
            self._threads.shutdown(cancel_futures=True)


def in_background(work: Callable[[], Result], told_after: float, tell: Callable[[], object]) -> Result:
    """Return the result of a long call that cannot be stopped; Ctrl-C raises its error without waiting for the call.

    Successive calls run in the same thread, because Warp needs 2 s to precompile its headers in each thread that
    compiles kernels.

    Args:
        work: Function without arguments that computes the result.
        told_after: Time after which `tell` is called once [s].
        tell: Function that reports to the user what is running.
    """
    task, calls = Future[Result](), _waiting_thread()

    def call() -> None:
        try:
            finish = partial(task.set_result, work())
        except BaseException as error:
            finish = partial(task.set_exception, error)
        _idle.append(calls)  # before the caller continues, so that its next call uses this thread
        finish()

    done = SimpleQueue[object]()
    task.add_done_callback(done.put)
    calls.put(call)
    waited = 0.0
    while True:
        stop_if_asked()
        try:
            done.get(timeout=PATIENCE)
        except Empty:
            waited += PATIENCE
            if waited - PATIENCE < told_after <= waited:
                tell()
            continue
        return task.result()


def _waiting_thread() -> SimpleQueue[Callable[[], None]]:
    """Return the queue of an idle thread, which waits for a function to call; if no thread is idle, start a thread."""
    try:
        return _idle.pop()
    except IndexError:
        calls = SimpleQueue[Callable[[], None]]()
    # A plain thread, not a pool: before it exits, the interpreter waits for the threads of pools.
    Thread(target=_work_off, args=(calls,), daemon=True, name="warpdyn").start()
    return calls


def _work_off(calls: SimpleQueue[Callable[[], None]]) -> None:
    while True:
        calls.get()()
