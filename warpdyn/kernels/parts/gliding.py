"""Laws whose storeys mostly stay on one straight branch: the full rules run only if a lane leaves its branch."""

from warpdyn.kernels.plan import tableau
from warpdyn.laws.springs import spring_row
from warpdyn.methods.table import METHODS


def wanted(plan):
    if plan.family != "chain" or METHODS[plan.method].kind != "explicit":
        return False
    law = spring_row(plan.law)
    return law.leaves_line is not None and law.rate is None and not tableau(plan).adaptive


def names(plan):
    import warp as wp

    law = spring_row(plan.law)
    last_stage = wp.constant(tableau(plan).stages - 1)
    return {
        "glide": law.memory_on_line,
        "decides": law.leaves_line,
        "CHANGED": law.values_on_line or law.memory,
        "LAST_STAGE": last_stage,
    }


def declare():
    reached_drift = row()
    reached_force = row()
    decided = indices()  # 1 if the storey leaves its branch in this step, else 0


def before_storey():
    # Every lane follows its branch first; lanes that leave it are computed again by the law's full
    # rules. So the result of a sample does not depend on the other lanes, to the last bit.
    is_last = stage == LAST_STAGE
    if stage > 0:
        deciding = int(0)
        for j in range(LANES):
            slot("reached_drift_in_stage")
            slot("storey_coefficients")
            memory = memory_vector()
            for m in range(M):
                memory[m] = z[i * M + m, j]
            decided[j] = wp.where(decides(reached_drift[j], memory, c), 1, 0)
            deciding += decided[j]
            after = glide(reached_drift[j], memory, c)
            reached_force[j] = held_of(reached_drift[j], after, c)
            if MAPS_IN_STAGE:
                if is_last:
                    for m in range(CHANGED):
                        z[i * M + m, j] = wp.where(decided[j] > 0, memory[m], after[m])
        if deciding > 0:
            for j in range(LANES):
                slot("storey_coefficients")
                memory = memory_vector()
                for m in range(M):
                    memory[m] = z[i * M + m, j]
                after = evolve(reached_drift[j], memory, c)
                force_then = held_of(reached_drift[j], after, c)
                reached_force[j] = wp.where(decided[j] > 0, force_then, reached_force[j])
                if MAPS_IN_STAGE:
                    if is_last:
                        for m in range(M):
                            z[i * M + m, j] = wp.where(decided[j] > 0, after[m], memory[m])


def restore():
    f = reached_force[j]
    if stage == 0:
        f = held_of(drift, memory, c)


def restore_foot():
    after = memory
    if stage > 0:
        after = glide(drift, memory, c)
        if decides(drift, memory, c):
            after = evolve(drift, memory, c)
    f = held_of(drift, after, c)


def end_step():
    if not MAPS_IN_STAGE:
        for i in range(N):
            deciding = int(0)
            for j in range(LANES):
                slot("reached_drift")
                slot("storey_coefficients")
                slot("accepted_memory")
                decided[j] = wp.where(decides(reached_drift[j], memory, c), 1, 0)
                deciding += decided[j]
                after = glide(reached_drift[j], memory, c)
                for m in range(CHANGED):
                    z[i * M + m, j] = wp.where(decided[j] > 0, memory[m], after[m])
            if deciding > 0:
                for j in range(LANES):
                    slot("storey_coefficients")
                    memory = memory_vector()
                    for m in range(M):
                        memory[m] = z[i * M + m, j]
                    after = evolve(reached_drift[j], memory, c)
                    for m in range(M):
                        z[i * M + m, j] = wp.where(decided[j] > 0, after[m], memory[m])
