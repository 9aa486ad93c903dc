"""Adaptive methods: each sample divides each step of the time grid into parts, according to the estimated error."""

from warpdyn.engine.kernels.functions.adaptive import SHORTEST_PART, done_after, excess_of, next_part
from warpdyn.engine.kernels.plan import tableau
from warpdyn.engine.methods.table import METHODS

BORROWS = {"kept_slopes": ("acceleration", "memory_rate")}
FIELDS = {"Control": {"tolerance": "float"}}


def wanted(plan):
    method = METHODS[plan.method]
    return method.kind == "explicit" and method.is_adaptive


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    dtype, method = DTYPES[plan.dtype], tableau(plan)
    return {
        "shortest_part": wp.constant(dtype(SHORTEST_PART[plan.dtype])),
        "error_of_velocity": method.error,
        "error_of_displacement": method.error_displacement,
        # An error of the memory remains for the rest of the run; errors of the motion decay.
        "LASTING": wp.constant(dtype(10.0)),
    }


def declare():
    whole_step = row()
    done = row()  # fractions of the step: finished, tried now, and to be tried next
    part = row()
    trial = row()
    excess = row()  # estimated error / tolerance
    size_u = row()  # the largest displacement and velocity so far, to which errors are relative
    size_v = row()
    accepted = indices()
    rejected = indices()


def settle_lane():
    whole_step[j] = h[j]
    if interval == 0:
        trial[j] = dtype(1.0)


def begin_step():
    pending = int(1)
    attempt = int(0)
    for j in range(LANES):
        done[j] = dtype(0.0)
        part[j] = trial[j]


def begin_attempt():
    # Repeated until each lane has finished the step.
    pending = int(0)
    for j in range(LANES):
        h[j] = part[j] * whole_step[j]
        slot("save")


def end_attempt():
    for j in range(LANES):
        excess[j] = dtype(0.0)
    for i in range(N):
        for j in range(LANES):
            of_u = dtype(0.0)
            of_v = dtype(0.0)
            if STOREY_LAWS:
                of_z = memory_vector()
            for q in range(STAGES):
                of_u += error_of_displacement[q] * acceleration[q * N + i, j]
                of_v += error_of_velocity[q] * acceleration[q * N + i, j]
                if STOREY_LAWS and IS_RATE:
                    for m in range(M):
                        of_z[m] += error_of_velocity[q] * memory_rate[(q * N + i) * M + m, j]
            of_u = wp.abs(of_u) * h[j] * h[j]
            slot("miss_turns")
            size_u[j] = wp.max(size_u[j], wp.abs(u[i, j]))
            size_v[j] = wp.max(size_v[j], wp.abs(v[i, j]))
            v_error = wp.abs(of_v) * h[j]
            worse = excess_of(of_u, size_u[j], un[i, j], v_error, size_v[j], vn[i, j])
            if STOREY_LAWS and IS_RATE:
                for m in range(M):
                    size = wp.max(wp.abs(zn[i * M + m, j]), dtype(1.0))
                    worse = wp.max(worse, wp.abs(of_z[m]) * h[j] / size)
            excess[j] = wp.max(excess[j], worse / control.tolerance)
    for j in range(LANES):
        rejects = excess[j] > dtype(1.0) and part[j] > shortest_part
        trial[j] = next_part(part[j], trial[j], excess[j], shortest_part)
        if rejects:
            rejected[j] += 1
            for i in range(N):
                un[i, j] = u[i, j]
                vn[i, j] = v[i, j]
                if STOREY_LAWS:
                    for m in range(M):
                        zn[i * M + m, j] = z[i * M + m, j]
            slot("restore_saved")
        elif h[j] > dtype(0.0):
            accepted[j] += 1
            done[j] = done_after(done[j], part[j], excess[j], shortest_part)
        part[j] = dtype(0.0)
        if whole_step[j] > dtype(0.0) and done[j] < dtype(1.0):
            part[j] = wp.min(trial[j], dtype(1.0) - done[j])
            pending += 1
    attempt += 1
