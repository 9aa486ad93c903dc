"""Work on several threads that Ctrl-C stops: in parts that fit in a processor's cache, or one long call."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from itertools import islice
from queue import Empty, SimpleQueue
from threading import Thread
from typing import TypeVar

from warpdyn.foundations.core.interruption import stop_if_asked

STRUCTURES_AT_A_TIME = 2**13
MOST_THREADS = 2**12  # beyond the cores of any one machine
PATIENCE = 0.1  # seconds of waiting before a signal is looked for

Item = TypeVar("Item")
Result = TypeVar("Result")

_idle: list[SimpleQueue[Callable[[], None]]] = []  # where threads of `in_background` wait for their next call
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_idle.clear)  # a process that is forked has none of the threads


def cores() -> int:
    """Return the number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_parts(
    work: Callable[[slice], Result], structures: int, threads: int, at_a_time: int = STRUCTURES_AT_A_TIME
) -> list[Result]:
    """Return the result of every part, in order; raise the error of the first part that fails.

    Args:
        work: Function from a part of the structures to its result.
        structures: How many structures there are.
        threads: CPU threads.
        at_a_time: Structures of a part.
    """
    parts = [slice(first, min(first + at_a_time, structures)) for first in range(0, structures, at_a_time)]
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


def as_finished(tasks: Iterable[Future[Result]]) -> Iterator[Future[Result]]:
    """Yield tasks as they finish; Ctrl-C acts while they are waited for."""
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
    """Wait for a task and return its result; Ctrl-C acts meanwhile."""
    for _ in as_finished([task]):
        pass
    return task.result()


class Ahead(Iterator[Result]):
    """The results of work on items in order, while other threads work on some items ahead.

    Args:
        work: The work.
        items: What it is done on.
        depth: How many items ahead of the one that was asked for last, from the first on when this is made; 0 to do
            the work when it is asked for, without threads.
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
        """Work on no more items, and wait for those that are being worked on."""
        if self._threads is not None:
            self._threads.shutdown(cancel_futures=True)


def in_background(work: Callable[[], Result], told_after: float, tell: Callable[[], object]) -> Result:
    """Return the result of a call that cannot be stopped; Ctrl-C does not wait for it to end.

    Calls one after another run in the same thread: Warp precompiles its headers once for each thread that compiles
    kernels, for two seconds.

    Args:
        work: The call.
        told_after: Seconds after which `tell` is called once.
        tell: Says what is going on.
    """
    task: Future[Result] = Future()

    calls = _waiting_thread()

    def call() -> None:
        try:
            finish = partial(task.set_result, work())
        except BaseException as error:
            finish = partial(task.set_exception, error)
        _idle.append(calls)  # before the caller goes on, so that its next call finds this thread
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
    """Return the queue of a thread that waits for calls; start one if none does."""
    try:
        return _idle.pop()
    except IndexError:
        calls = SimpleQueue[Callable[[], None]]()
    # Not of a pool, whose threads the interpreter waits for at its end.
    Thread(target=_work_off, args=(calls,), daemon=True, name="warpdyn").start()
    return calls


def _work_off(calls: SimpleQueue[Callable[[], None]]) -> None:
    while True:
        calls.get()()
