"""Tall chains on a GPU: several threads of a warp share a sample; each thread integrates a section of the storeys.

The floor below a section and the storey above it belong to other threads. If the number of storeys is not a multiple of
the number of sections, the last sections contain additional storeys without mass (padding), which remain undeformed.
"""

from warpdyn.engine.device.warp_exchange import across_warp

order = -10

BORROWS = {"half_steps": ("drifts", "rates")}


def wanted(plan):
    return plan.sections > 1 and plan.pattern is None


def names(plan):
    from warpdyn.engine.device.warp_exchange import NEIGHBOURS

    below, above_of, across, together = NEIGHBOURS[plan.dtype]
    functions = {"below": below, "above_of": above_of, "across": across, "together": together}
    return {"THREADS": plan.sections, **functions}


def place():
    section = block % THREADS
    block = block // THREADS
    lowest = section * N


def declare():
    foot_u = row()  # displacement and velocity of the floor below the section, and the force from above it
    foot_v = row()
    roof = row()


def number_storey():
    g = lowest + i


def fill_pad():
    if HAS_PADS:
        if g >= STOREYS:
            for q in range(C):  # coefficients of zero could cause a division by zero
                coefficients[i * C + q, j] = structures.coefficients[(STOREYS - 1) * C + q, s]


def exchange_states():
    intervals = across_warp(intervals)  # the threads of a warp exchange values at every stage
    for j in range(LANES):
        foot_u[j] = below(u[N - 1, j], section, THREADS)
        foot_v[j] = below(v[N - 1, j], section, THREADS)


def begin_stage():
    # The thread above computes the force of its lowest storey here, and again when it visits that storey.
    for j in range(LANES):
        top_u = us[N - 1, j]
        top_v = vs[N - 1, j]
        drift = us[0, j]
        rate = vs[0, j]
        zi = z[0, j]
        if TAKES_MEMORY:
            zi = zs[0, j]
        if stage == 0:
            top_u = u[N - 1, j]
            top_v = v[N - 1, j]
            drift = u[0, j]
            rate = v[0, j]
            zi = z[0, j]
        foot_u[j] = below(top_u, section, THREADS)
        foot_v[j] = below(top_v, section, THREADS)
        drift -= foot_u[j]
        rate -= foot_v[j]
        if KEEPS_DRIFTS:
            drift = drifts[0, j]
            rate = rates[0, j]
        if HAS_PADS:
            if lowest >= STOREYS:
                drift = dtype(0.0)
                rate = dtype(0.0)
        c = coefficient_vector()
        for q in range(C):
            c[q] = coefficients[q, j]
        memory = memory_vector(zi)
        for m in range(1, M):
            memory[m] = z[m, j]
            if TAKES_MEMORY:
                if stage > 0:
                    memory[m] = zs[m, j]
        slot("follow_turn", i=0)
        if not STRAIGHT_BRANCHES:
            f = force_of(drift, memory, c)
        slot("restore_foot")
        slot("add_to_force", i=0)
        slot("add_to_foot")
        roof[j] = above_of(f, section, THREADS)


def begin_walk():
    above[j] = roof[j]


def leave_pad():
    if HAS_PADS:
        if lowest + i >= STOREYS:
            drift = dtype(0.0)
            rate = dtype(0.0)


def end_step():
    if IS_MAPPING or RESIDUAL or COLLAPSE:
        for j in range(LANES):
            foot_u[j] = below(u[N - 1, j], section, THREADS)


def finish():
    if HAS_FINISH_DRIFT:
        foot_u[j] = below(u[N - 1, j], section, THREADS)
    if P_DELTA:
        foot_v[j] = below(v[N - 1, j], section, THREADS)


def after_finish():
    total = together(total, THREADS)
