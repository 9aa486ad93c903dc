"""Yielding storeys that start displaced: their memory is computed for a slow push from rest to the initial drift.

The memory of a storey contains the values that its law keeps from step to step, such as a plastic drift.
"""

from warpdyn.engine.laws.springs import spring_row

# Number of increments of the push for laws whose memory follows a differential equation; other laws need one increment.
INCREMENTS = 1000


def wanted(plan):
    return plan.starts_displaced and spring_row(plan.law).memory > 0


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    increments = INCREMENTS if spring_row(plan.law).rate is not None else 1
    return {"INCREMENTS": increments, "one_increment": wp.constant(DTYPES[plan.dtype](1.0 / increments))}


def read_storey():
    if not EXPLICIT_LUMPED:
        initial_drift = loads.initial_displacement[g]
        if g > 0:
            initial_drift -= loads.initial_displacement[g - 1]
        slot("storey_coefficients")
        memory = memory_vector()
        for increment in range(INCREMENTS):
            pulled_to = dtype(increment + 1) * one_increment * initial_drift
            memory = advance(pulled_to, one_increment * initial_drift, memory, c)
        for m in range(M):
            z[i * M + m, j] = memory[m]
            if TAKES_MEMORY:
                zs[i * M + m, j] = memory[m]


def push_springs():
    for i in range(SPRINGS):
        for j in range(LANES):
            slot("storey_coefficients")
            memory = memory_vector()
            for increment in range(INCREMENTS):
                pulled_to = dtype(increment + 1) * one_increment * deformation[i, j]
                memory = advance(pulled_to, one_increment * deformation[i, j], memory, c)
            for m in range(M):
                z[i * M + m, j] = memory[m]
                if TAKES_MEMORY:
                    zs[i * M + m, j] = memory[m]


def remember():
    for m in range(M):
        memory[m] = z[i * M + m, j]
