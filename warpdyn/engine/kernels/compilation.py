"""Compile the kernels of several plans side by side: before the first of them is launched or, on a GPU, while it runs.

Warp generates a kernel's code in Python, which holds the interpreter's lock, so that threads wait for each other. Many
kernels are shared with processes instead, which leave their results in the kernel cache. They come from loky, whose
processes do not run the user's script again, as those of the standard library do where it has no `__main__` guard. A
few kernels of a processor are compiled by threads before a process would have begun.
"""

import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from threading import Thread

import warp as wp
from loky import ProcessPoolExecutor

from warpdyn.engine.kernels.build import build_kernel, load_kernel
from warpdyn.engine.kernels.kernel_cache import block_size, folder_of, is_compiled_in
from warpdyn.engine.kernels.plan import Plan
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.thread_pool import as_finished, result_of

# A process takes three to four seconds until it has compiled its first kernel, as long as two kernels take, and half a
# gigabyte of a GPU's memory until it ends: more of them were no faster on 16 processor cores.
MOST_PROCESSES, FEWEST_KERNELS = 8, 3
# A processor's compiler leaves the interpreter's lock, for three quarters of a large kernel's time.
MOST_KERNELS_OF_THREADS = 4
ONE_BY_ONE = "kernels are compiled one by one: a process that compiled them side by side failed"
LOOKS_FOR_PARENT = 0.5  # seconds between looks
CONFIGURATION = (bool, int, float, str, type(None))  # types of settings that a process is started with


def is_compiled(plan: Plan, device: str) -> bool:
    """Return whether the kernel of a plan is in the kernel cache, compiled for a kind of device."""
    return is_compiled_in(folder_of(build_kernel(plan).module, block_size(device)), device)


def compile_side_by_side(plans: Iterable[Plan], device: str, threads: int) -> None:
    """Compile the kernels of plans that are not in the kernel cache, on several processor cores at once.

    Args:
        plans: The plans; one that is there twice is compiled once.
        device: Device that they will run on, such as "cpu" or "cuda:0".
        threads: Processor cores to use.
    """
    missing = [plan for plan in dict.fromkeys(plans) if not is_compiled(plan, device)]
    if device == "cpu" and len(missing) <= MOST_KERNELS_OF_THREADS:
        _compile_in_threads(missing, threads)
        return
    helpers = min(threads, MOST_PROCESSES, len(missing)) - 1
    if helpers < 1 or len(missing) < FEWEST_KERNELS:
        return  # each is compiled when it is first launched
    missing.sort(key=lambda plan: plan.dofs)
    left = deque(missing)
    try:
        processes = ProcessPoolExecutor(helpers, initializer=_configure, initargs=(_settings(), os.getpid()))
        with ThreadPoolExecutor(helpers) as threads_that_wait:
            # Helpers begin with what takes longest. This process is ready at once: it compiles from the other end. None
            # is handed a kernel before it has done the last one, so that all end at about the same time.
            helping = [threads_that_wait.submit(_hand_out, left, processes, device) for _ in range(helpers)]
            try:
                while (plan := _taken(left.popleft)) is not None:
                    load_kernel(plan, device)
                for waiting in helping:
                    result_of(waiting)
            except BaseException:  # an interrupted user waits neither for the rest nor for what has begun
                left.clear()
                processes.shutdown(wait=False, kill_workers=True)
                raise
        processes.shutdown()
    except (BrokenExecutor, OSError) as error:
        # Each is compiled when it is first launched.
        warn_caller(f"{ONE_BY_ONE} ({error})")


@contextmanager
def compiling(plans: Iterable[Plan], device: str, threads: int) -> Iterator[Callable[[Iterable[Plan]], None]]:
    """Compile the kernels of plans that are not in the kernel cache; yield what waits until some of them are compiled.

    On a processor they are compiled before the first is waited for, since a run takes all of its cores. On a GPU the
    first of them run while processes compile the rest, in the order of the plans.

    Args:
        plans: The plans; one that is there twice is compiled once.
        device: Device that they will run on, such as "cpu" or "cuda:0".
        threads: Processor cores to use.
    """
    if device == "cpu" or threads < FEWEST_KERNELS:
        compile_side_by_side(plans, device, threads)
        yield lambda some: None
        return
    others = list(dict.fromkeys(plans))[1:]
    helpers = min(threads - 1, MOST_PROCESSES, len(others))
    if helpers < 1:
        yield lambda some: None
        return
    processes = ProcessPoolExecutor(helpers, initializer=_configure, initargs=(_settings(), os.getpid()))

    def compile_missing(plan: Plan) -> Future[None] | None:
        return None if is_compiled(plan, device) else processes.submit(_compile, plan, device)

    # A thread looks for what is missing, which takes Python a tenth of a second for each; the first is compiled here.
    with ThreadPoolExecutor(1) as looking:
        tasks = {plan: looking.submit(compile_missing, plan) for plan in others}

        def wait_for(some: Iterable[Plan]) -> None:
            try:
                for plan in some:
                    task = result_of(tasks[plan]) if plan in tasks else None
                    if task is not None:
                        result_of(task)
            except (BrokenExecutor, OSError) as error:
                tasks.clear()
                warn_caller(f"{ONE_BY_ONE} ({error})")

        try:
            yield wait_for
        except BaseException:  # an interrupted user waits neither for the rest nor for what has begun
            looking.shutdown(wait=False, cancel_futures=True)
            processes.shutdown(wait=False, kill_workers=True)
            raise
    processes.shutdown()


def _compile_in_threads(plans: list[Plan], threads: int) -> None:
    """Compile the kernels of plans for a processor in threads of this process, those that take longest first."""
    if min(threads, len(plans)) < 2:
        return  # each is compiled when it is first launched
    longest = sorted(plans, key=lambda plan: -plan.dofs * plan.max_unroll)
    pool = ThreadPoolExecutor(min(threads, len(plans)))
    try:
        tasks = [pool.submit(load_kernel, plan, "cpu") for plan in longest]
        for task in as_finished(tasks):
            task.result()
    finally:  # an interrupted user does not wait for what has not begun
        pool.shutdown(cancel_futures=True)


def _hand_out(left: deque[Plan], processes: Executor, device: str) -> None:
    """Have processes compile plans that are left, from the last on, one at a time."""
    while (plan := _taken(left.pop)) is not None:
        processes.submit(_compile, plan, device).result()


def _taken(take: Callable[[], Plan]) -> Plan | None:
    """Return what is taken, or None if nothing is left."""
    try:
        return take()
    except IndexError:
        return None


def _settings() -> dict[str, object]:
    """Return how Warp is configured here."""
    return {
        name: value
        for name, value in vars(wp.config).items()
        if not name.startswith("_") and isinstance(value, CONFIGURATION) and name != "version"
    }


def _configure(settings: dict[str, object], parent: int) -> None:
    """Configure Warp in a process as in the one that started it, so that they share the cache's entries.

    Args:
        settings: What `_settings` returned there.
        parent: Number of the process that started it, with which it ends.
    """
    Thread(target=_end_with, args=(parent,), daemon=True, name="warpdyn parent").start()
    wp.init()  # which would add the version to the cache's folder, once more
    for name, value in settings.items():
        setattr(wp.config, name, value)


def _end_with(parent: int) -> None:
    """End this process when the one that started it has ended, also by a kill, which tells nobody.

    Linux could send a signal instead (PR_SET_PDEATHSIG), but does so as soon as the *thread* ends that started the
    process, and loky starts processes in threads that end before the processes are done.
    """
    if os.name == "nt":
        _wait_on_windows(parent)
    else:
        while os.getppid() == parent:  # a process whose parent has ended is given another one
            time.sleep(LOOKS_FOR_PARENT)
    os._exit(1)  # also while another thread compiles, which nothing else stops


def _wait_on_windows(parent: int) -> None:
    """Wait for the end of a process on Windows, where the number of a parent stays when it has ended."""
    import ctypes

    kernel, synchronize, forever = ctypes.WinDLL("kernel32"), 0x00100000, 0xFFFFFFFF  # type: ignore[attr-defined]
    kernel.OpenProcess.restype = ctypes.c_void_p
    handle = kernel.OpenProcess(synchronize, False, parent)
    if handle:
        kernel.WaitForSingleObject(ctypes.c_void_p(handle), forever)


def _compile(plan: Plan, device: str) -> None:
    load_kernel(plan, device)
