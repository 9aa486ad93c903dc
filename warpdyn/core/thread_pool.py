"""Work on several threads that Ctrl-C stops: in parts that fit in a processor's cache, or one long call."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from queue import Empty, SimpleQueue
from threading import Thread
from typing import TypeVar

from warpdyn.core.interruption import stop_if_asked

STRUCTURES_AT_A_TIME = 2**13
PATIENCE = 0.1  # seconds of waiting before a signal is looked for

Result = TypeVar("Result")


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


def in_background(work: Callable[[], Result], told_after: float, tell: Callable[[], object]) -> Result:
    """Return the result of a call that cannot be stopped; Ctrl-C does not wait for it to end.

    Args:
        work: The call.
        told_after: Seconds after which `tell` is called once.
        tell: Says what is going on.
    """
    task: Future[Result] = Future()

    def call() -> None:
        try:
            task.set_result(work())
        except BaseException as error:
            task.set_exception(error)

    done = SimpleQueue[object]()
    task.add_done_callback(done.put)
    # Not of a pool, whose threads the interpreter waits for at its end.
    Thread(target=call, daemon=True, name="warpdyn").start()
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
