"""Compile the kernels of several plans in parallel: before the first launch or, on a GPU, while other kernels run.

A plan contains the properties that decide the source of a kernel. Warp generates code in Python and keeps the
interpreter lock meanwhile, so that threads wait for each other. Many kernels are therefore compiled by several
processes, which write compiled kernels to the kernel cache. The package loky starts these processes: processes of the
standard library would run the user's script again if it has no `__main__` guard. A few kernels for a CPU are compiled
by threads, which is faster than starting a process.
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
from warpdyn.engine.kernels.kernel_cache import block_size, folder_of, initialise, is_compiled_in, loaded
from warpdyn.engine.kernels.plan import Plan
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.thread_pool import as_finished, result_of

# A process needs 3 to 4 s for its first kernel, as long as for two further kernels, and 0.5 GB of GPU memory until it
# ends. On 16 CPU cores, more than 8 processes were not faster.
MOST_PROCESSES, FEWEST_KERNELS = 8, 3
# While Warp compiles a large kernel for a CPU, it releases the interpreter lock for 3/4 of the time.
MOST_KERNELS_OF_THREADS = 4
ONE_BY_ONE = "kernels are compiled one by one, because a process that compiled them in parallel failed"
NO_ACTION = "The results are the same and no action is needed; this run only starts later"
LOOKS_FOR_PARENT = 0.5  # seconds between checks that the parent process still runs
CONFIGURATION = (bool, int, float, str, type(None))  # types of the settings of Warp that are passed to a process


def is_compiled(plan: Plan, device: str) -> bool:
    """Return whether the kernel cache contains the compiled kernel of a plan for a device such as "cpu" or "cuda:0"."""
    return is_compiled_in(folder_of(build_kernel(plan).module, block_size(device)), device)


def compile_side_by_side(plans: Iterable[Plan], device: str, threads: int) -> None:
    """Compile those kernels that the kernel cache does not contain yet, on several CPU cores.

    Args:
        plans: Plans of the kernels; equal plans are compiled once.
        device: Device that will run the kernels, such as "cpu" or "cuda:0".
        threads: Number of CPU cores to use.
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
            # Worker processes take the kernels from one end of the list, the slowest ones first. This process is ready
            # at once and takes kernels from the other end. All finish at about the same time.
            helping = [threads_that_wait.submit(_hand_out, left, processes, device) for _ in range(helpers)]
            try:
                while (plan := _taken(left.popleft)) is not None:
                    load_kernel(plan, device)
                for waiting in helping:
                    result_of(waiting)
            except BaseException:  # after Ctrl-C, wait neither for the remaining kernels nor for those that have begun
                left.clear()
                processes.shutdown(wait=False, kill_workers=True)
                raise
        processes.shutdown()
    except (BrokenExecutor, OSError) as error:
        # The other kernels are compiled when they are first launched.
        warn_caller(f"{ONE_BY_ONE} ({error}). {NO_ACTION}")


@contextmanager
def compiling(plans: Iterable[Plan], device: str, threads: int) -> Iterator[Callable[[Iterable[Plan]], None]]:
    """Compile missing kernels; yield `wait_for(plans)`, which returns when the kernels of these plans are compiled.

    For a CPU, all kernels are compiled before the run starts, because a run uses all cores. For a GPU, the first
    kernels run while processes compile the other kernels, in the order of the plans.

    Args:
        plans: Plans of the kernels; equal plans are compiled once.
        device: Device that will run the kernels, such as "cpu" or "cuda:0".
        threads: Number of CPU cores to use.
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

    # A thread looks for missing kernels, which takes 0.1 s per kernel. The caller compiles the first kernel.
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
                warn_caller(f"{ONE_BY_ONE} ({error}). {NO_ACTION}")

        try:
            yield wait_for
        except BaseException:  # after Ctrl-C, wait neither for the remaining kernels nor for those that have begun
            looking.shutdown(wait=False, cancel_futures=True)
            processes.shutdown(wait=False, kill_workers=True)
            raise
    processes.shutdown()


@contextmanager
def loading(kernels: Iterable[wp.Kernel], device: str, threads: int) -> Iterator[None]:
    """Compile and load small kernels in threads of this process while the caller continues.

    A launch waits until its kernel is loaded.

    Args:
        kernels: The kernels, in the order of their first launches.
        device: Device that will run the kernels, such as "cuda:0".
        threads: Number of CPU cores to use.
    """
    distinct = list(dict.fromkeys(kernels))
    if not distinct:
        yield
        return
    if device != "cpu":
        wp.get_stream(device)  # initialises the device, which several threads must not do at the same time
    pool = ThreadPoolExecutor(min(threads, MOST_PROCESSES))
    try:
        for kernel in distinct:
            pool.submit(loaded, kernel, device)  # the launch of the kernel raises an error again
        yield
    finally:  # after Ctrl-C, do not begin further kernels
        pool.shutdown(cancel_futures=True)


def _compile_in_threads(plans: list[Plan], threads: int) -> None:
    """Compile kernels for a CPU in threads of this process, the slowest kernels first."""
    if min(threads, len(plans)) < 2:
        return  # each is compiled when it is first launched
    longest = sorted(plans, key=lambda plan: -plan.dofs * plan.max_unroll)
    pool = ThreadPoolExecutor(min(threads, len(plans)))
    try:
        tasks = [pool.submit(load_kernel, plan, "cpu") for plan in longest]
        for task in as_finished(tasks):
            task.result()
    finally:  # after Ctrl-C, do not begin further kernels
        pool.shutdown(cancel_futures=True)


def _hand_out(left: deque[Plan], processes: Executor, device: str) -> None:
    """Let a worker process compile the kernels of the remaining plans one by one, from the end of the list `left`."""
    while (plan := _taken(left.pop)) is not None:
        processes.submit(_compile, plan, device).result()


def _taken(take: Callable[[], Plan]) -> Plan | None:
    """Return the plan that `take()` removes from the list of plans, or None if the list is empty."""
    try:
        return take()
    except IndexError:
        return None


def _settings() -> dict[str, object]:
    """Return the settings of Warp in this process that can be passed to another process."""
    return {
        name: value
        for name, value in vars(wp.config).items()
        if not name.startswith("_") and isinstance(value, CONFIGURATION) and name != "version"
    }


def _configure(settings: dict[str, object], parent: int) -> None:
    """Configure Warp as in the parent process, so that both use the same entries of the kernel cache.

    Args:
        settings: The result of `_settings` in the parent process.
        parent: Process ID of the parent; this process ends when the parent ends.
    """
    Thread(target=_end_with, args=(parent,), daemon=True, name="warpdyn parent").start()
    initialise()  # first: it appends Warp's version to the cache folder, and the folder in `settings` has it already
    for name, value in settings.items():
        setattr(wp.config, name, value)


def _end_with(parent: int) -> None:
    """End this worker process when its parent process has ended or was killed.

    Linux has a signal for this purpose (PR_SET_PDEATHSIG), but it is sent when the *thread* that started the process
    ends, and loky starts processes in threads that end early.
    """
    if os.name == "nt":
        _wait_on_windows(parent)
    else:
        while os.getppid() == parent:  # if the parent ends, the system assigns another parent
            time.sleep(LOOKS_FOR_PARENT)
    os._exit(1)  # the only call that ends the process while another thread compiles


def _wait_on_windows(parent: int) -> None:
    """Wait until the parent process ends, on Windows, where getppid() does not change when the parent ends."""
    import ctypes

    kernel, synchronize, forever = ctypes.WinDLL("kernel32"), 0x00100000, 0xFFFFFFFF  # type: ignore[attr-defined]
    kernel.OpenProcess.restype = ctypes.c_void_p
    handle = kernel.OpenProcess(synchronize, False, parent)
    if handle:
        kernel.WaitForSingleObject(ctypes.c_void_p(handle), forever)


def _compile(plan: Plan, device: str) -> None:
    load_kernel(plan, device)
