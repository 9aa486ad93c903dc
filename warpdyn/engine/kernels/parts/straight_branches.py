"""Storey laws with straight branches: the full rules of a law run only if a storey leaves its branch (rare)."""

from warpdyn.engine.kernels.hinges.column_storeys import has_line
from warpdyn.engine.kernels.plan import keeps_drifts, tableau
from warpdyn.engine.laws.springs import spring_row
from warpdyn.engine.methods.table import METHODS


def wanted(plan):
    if plan.family not in ("chain", "lumped") or has_line(plan):
        return False
    if plan.pattern is not None and plan.kind == "implicit":
        return False
    law = spring_row(plan.law)
    return law.leaves_line is not None and law.rate is None and not METHODS[plan.method].is_adaptive


def names(plan):
    import warp as wp

    law = spring_row(plan.law)
    common = {
        "memory_on_line": law.memory_on_line,
        "leaves_line": law.leaves_line,
        "tangent_on_line": law.tangent_on_line,
        "CHANGED": law.values_on_line or law.memory,
    }
    if plan.kind == "implicit":
        # The first state may be on any branch; the force of later accepted states is known.
        return common | {"MOVES": "(walk > 0 or index == 0)", "STANDS": "(walk == 0 and index > 0)"}
    if keeps_drifts(plan):
        return common | {"MOVES": "ONCE", "STANDS": "not ONCE", "LAST_STAGE": wp.constant(0)}
    return common | {"MOVES": "stage > 0", "STANDS": "stage == 0", "LAST_STAGE": wp.constant(tableau(plan).stages - 1)}


def declare():
    reached_drift = row()
    reached_force = row()
    reached_slope = row()
    has_left = indices()  # 1 if the storey leaves its branch in this step, else 0


def before_storey():
    # Each lane follows its branch first; lanes that leave it are computed again by the full rules.
    # Therefore the bits of a sample do not depend on the other lanes.
    if MAPS_IN_STAGE:
        is_last = stage == LAST_STAGE
    if MOVES:
        leaving = int(0)
        for j in range(LANES):
            slot("reached_drift", u=us)
            slot("storey_coefficients")
            memory = memory_vector()
            for m in range(M):
                memory[m] = z[i * M + m, j]
            has_left[j] = wp.where(leaves_line(reached_drift[j], memory, c), 1, 0)
            leaving += has_left[j]
            after = memory_on_line(reached_drift[j], memory, c)
            reached_force[j] = held_of(reached_drift[j], after, c)
            if IMPLICIT_CHAIN:
                reached_slope[j] = tangent_on_line(reached_drift[j], memory, c)
            if MAPS_IN_STAGE:
                if is_last:
                    for m in range(CHANGED):
                        z[i * M + m, j] = updated(has_left[j] == 0, after[m], memory[m])
        if leaving > 0:
            for j in range(LANES):
                slot("follow_rules")
                force_then = held_of(reached_drift[j], after, c)
                reached_force[j] = updated(has_left[j] > 0, force_then, reached_force[j])
                if IMPLICIT_CHAIN:
                    slot("accepted_drift")
                    slope_then = tangent_of(reached_drift[j], reached_drift[j] - drift, memory, after, c)
                    reached_slope[j] = updated(has_left[j] > 0, slope_then, reached_slope[j])
                if MAPS_IN_STAGE:
                    if is_last:
                        for m in range(M):
                            z[i * M + m, j] = updated(has_left[j] > 0, after[m], memory[m])


def follow_rules():
    slot("storey_coefficients")
    memory = memory_vector()
    for m in range(M):
        memory[m] = z[i * M + m, j]
    after = mapped_memory(reached_drift[j], memory, c)


def restore():
    f = reached_force[j]
    if STANDS:
        f = held_of(drift, memory, c)
    if IMPLICIT_CHAIN:
        stiffness = reached_slope[j]


def restore_foot():
    after = memory
    if MOVES:
        after = memory_on_line(drift, memory, c)
        if leaves_line(drift, memory, c):
            after = mapped_memory(drift, memory, c)
    f = held_of(drift, after, c)


def end_step():
    if not MAPS_IN_STAGE:
        for i in range(SPRINGS):
            leaving = int(0)
            for j in range(LANES):
                slot("reached_drift")
                slot("storey_coefficients")
                slot("accepted_memory")
                has_left[j] = wp.where(leaves_line(reached_drift[j], memory, c), 1, 0)
                leaving += has_left[j]
                after = memory_on_line(reached_drift[j], memory, c)
                for m in range(CHANGED):
                    z[i * M + m, j] = updated(has_left[j] == 0, after[m], memory[m])
            if leaving > 0:
                for j in range(LANES):
                    slot("follow_rules")
                    for m in range(M):
                        z[i * M + m, j] = updated(has_left[j] > 0, after[m], memory[m])
