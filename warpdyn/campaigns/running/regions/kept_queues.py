"""Queues of GPUs that a process keeps, with their memory, for its next run."""

from __future__ import annotations

import atexit
from collections.abc import Sequence

from warpdyn.engine.kernels.queues import CudaQueue, Queue, free_memory

# Page-locked memory takes 0.4 s for each GB, and every allocation at least 0.1 ms: 35 % of the time of a run of 8
# million samples on four GPUs. Queues that hold more page-locked memory [bytes], or a larger share of the free memory
# of a GPU, are deleted after their run, so that the memory is free for other programs.
MOST_PAGE_LOCKED, SHARE_OF_A_GPU = 2**30, 1 / 32

_kept: dict[tuple[str, ...], list[CudaQueue]] = {}  # devices -> queues that no run uses now
atexit.register(_kept.clear)  # while Warp can still free their memory


def taken_queues(devices: Sequence[str]) -> list[CudaQueue]:
    """Return the queues that the last run of this process has left on these GPUs, if any."""
    kept = _kept.pop(tuple(devices), [])
    _kept.clear()  # the memory of one run is kept at most
    return kept


def keep_queues(queues: Sequence[Queue]) -> None:
    """Keep the queues of a run that has finished, whose arrays are not read any more, for the next run."""
    found = [queue for queue in queues if isinstance(queue, CudaQueue)]
    devices = tuple(dict.fromkeys(queue.device for queue in found))
    arrays = [(queue.device, array) for queue in found for array in queue.held.values()]
    sizes = {device: sum(a.capacity for name, a in arrays if name == device and not a.pinned) for device in devices}
    page_locked = sum(array.capacity for _, array in arrays if array.pinned)
    is_little = all(size <= SHARE_OF_A_GPU * free_memory(device) for device, size in sizes.items())
    if found and page_locked <= MOST_PAGE_LOCKED and is_little:
        for queue in found:
            queue.begin()
        _kept[devices] = found
