"""Queues of GPUs that a process keeps, with their memory, for its next run."""

from __future__ import annotations

import atexit
from collections.abc import Sequence

from warpdyn.engine.kernels.queues import CudaQueue, Queue

# Page-locked memory takes 0.4 s for each GB, and every allocation at least 0.1 ms: a third of the time of a run of 8
# million samples on four GPUs. Queues that hold more than this [bytes] are deleted after their run, so that the memory
# is free for other programs.
MOST_PAGE_LOCKED, MOST_ON_GPUS = 2**30, 4 * 2**30

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
    if found and _bytes(found, page_locked=True) <= MOST_PAGE_LOCKED and _bytes(found) <= MOST_ON_GPUS:
        for queue in found:
            queue.begin()
        _kept[tuple(dict.fromkeys(queue.device for queue in found))] = found


def _bytes(queues: Sequence[CudaQueue], *, page_locked: bool = False) -> int:
    """Return the size of the arrays that queues hold on GPUs, or in page-locked memory of the host [bytes]."""
    arrays = (array for queue in queues for array in queue.held.values())
    return sum(array.capacity for array in arrays if array.pinned == page_locked)
