"""GPU threads that share a frame with hinges: each has the members of a storey and the floor above it.

As many samples as possible share the 32 threads of a warp: with five sections, for example, six samples. The other
threads of the warp are idle: their state is always 0, as that of the ground below the first storey and of the missing
storey above the last one. On a CPU a thread computes all storeys.
"""

from warpdyn.engine.device.warp_exchange import across_warp

order = -20


def wanted(plan):
    return plan.frame_storeys is not None


def names(plan):
    from warpdyn.engine.device.warp_exchange import EXCHANGES
    from warpdyn.engine.kernels.plan import WARP

    threads = plan.sections
    neighbour, neighbour_or_zero, together = EXCHANGES[plan.dtype]
    return {
        "THREADS": threads,
        "THREADS_OF_WARP": WARP,
        "LAST_THREAD": WARP - 1,  # idle if a warp is not filled by whole samples
        "AFTER_LAST_SAMPLE": 2**30 - 1,
        "SAMPLES_OF_WARP": WARP // threads,
        "HAS_IDLE_THREADS": threads > 1 and WARP % threads > 0,
        "FLOORS": plan.dofs // threads,
        "from_thread": neighbour if WARP % threads else neighbour_or_zero,
        "over_sections": together,
    }


def place():
    section = int(0)
    lowest = int(0)
    if THREADS > 1:
        slot("share_warp")


def share_warp():
    thread = block % THREADS_OF_WARP
    block = (block // THREADS_OF_WARP) * SAMPLES_OF_WARP + thread // THREADS
    section = thread % THREADS
    lowest = section * FLOORS
    thread_below = thread - 1
    thread_above = thread + 1
    first_thread = thread - section
    if HAS_IDLE_THREADS:
        if section == 0:
            thread_below = int(LAST_THREAD)
        if section == THREADS - 1:
            thread_above = int(LAST_THREAD)
        if thread >= SAMPLES_OF_WARP * THREADS:
            thread_below = int(LAST_THREAD)
            thread_above = int(LAST_THREAD)
            block = int(AFTER_LAST_SAMPLE)
    else:
        if section == 0:
            thread_below = int(-1)
        if section == THREADS - 1:
            thread_above = int(-1)


def read_lane():
    if HAS_IDLE_THREADS:
        if thread >= SAMPLES_OF_WARP * THREADS:  # nothing accelerates an idle thread
            scale[j] = dtype(0.0)


def start():
    if THREADS > 1:
        intervals = across_warp(intervals)  # the threads of a warp exchange values at every stage


def after_finish():
    if THREADS > 1:
        total = over_sections(total, first_thread, THREADS)
