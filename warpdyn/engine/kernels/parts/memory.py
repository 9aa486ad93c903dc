"""Storey laws with a return mapping: the memory is updated once per step, and all stages use its value at the start.

The memory of a storey contains the values that its law keeps from step to step, such as a plastic drift. A return
mapping computes the new memory from the drift at the end of the step.
"""

from warpdyn.engine.kernels.hinges.column_storeys import has_line
from warpdyn.engine.kernels.parts import straight_branches
from warpdyn.engine.laws.springs import spring_row


def wanted(plan):
    if plan.family not in ("chain", "lumped") or plan.kind != "explicit" or has_line(plan):
        return False
    law = spring_row(plan.law)
    has_memory = law.return_mapping is not None or law.force_at_accepted_state is not None
    return has_memory and not straight_branches.wanted(plan)


def restore():
    if MAPS_IN_STAGE:
        if stage == STAGES - 1:
            reached = mapped_memory(drift, memory, c)
            f = followed_of(drift, reached, c) if KEEPS_DRIFTS else held_of(drift, reached, c)
            for m in range(M):
                z[i * M + m, j] = reached[m]
        elif stage == 0:
            f = held_of(drift, memory, c)
        else:
            f = force_of(drift, memory, c)
    elif BY_STOREY and stage == 0:
        f = followed_of(drift, memory, c)
    elif HOLDS_FORCE:
        f = held_of(drift, memory, c)
        if stage > 0:
            f = force_of(drift, memory, c)
    else:
        f = force_of(drift, memory, c)


def end_step():
    if IS_MAPPING and not ADAPTIVITY and not MAPS_IN_STAGE:
        for i in range(SPRINGS):
            for j in range(LANES):
                slot("accepted_drift")
                if HAS_PADS:
                    if lowest + i >= STOREYS:
                        drift = dtype(0.0)
                slot("storey_coefficients")
                slot("accepted_memory")
                memory = mapped_memory(drift, memory, c)
                for m in range(M):
                    z[i * M + m, j] = memory[m]
                    if TAKES_MEMORY:
                        zs[i * M + m, j] = memory[m]
