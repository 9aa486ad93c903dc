"""Explicit methods whose stages need the slopes of several earlier stages: the kernel keeps all slopes of a step."""

from warpdyn.engine.kernels.plan import keeps_slopes, tableau
from warpdyn.engine.methods.table import METHODS

order = 1


def wanted(plan):
    method = METHODS[plan.method]
    return method.kind == "explicit" and keeps_slopes(method)


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES
    from warpdyn.engine.laws.springs import spring_row

    method, dtype, memory = tableau(plan), DTYPES[plan.dtype], spring_row(plan.law).memory
    rows = plan.dofs * method.stages
    return {
        "of_velocity": method.a,
        "of_displacement": method.a_displacement,
        "of_step": method.ends,
        "slopes": wp.types.matrix(shape=(rows, plan.lanes), dtype=dtype),
        "memory_slopes": wp.types.matrix(shape=(max(1, rows * memory), plan.lanes), dtype=dtype),
        "memory_sums": wp.types.matrix(shape=(max(1, memory), plan.lanes), dtype=dtype),
        # The final velocities of the previous event are half a step behind already.
        "HALVES_FIRST_STEP": method.halfway and not plan.resumes,
    }


def declare():
    acceleration = slopes()  # of every stage, and the rates of the memory
    memory_rate = memory_slopes()
    to_displacement = row()
    to_velocity = row()
    to_memory = memory_sums()


def start_storey():
    us[i, j] = u[i, j]
    vs[i, j] = v[i, j]


def state_of_stage():
    drift = us[i, j]
    vi = vs[i, j]


def memory_of_stage():
    if TAKES_MEMORY:
        memory = memory_vector(zs[i * M, j])
        for m in range(1, M):
            memory[m] = zs[i * M + m, j]
    else:
        slot("accepted_memory")


def state_below():
    drift -= us[i - 1, j]
    rate -= vs[i - 1, j]


def end_storey():
    if IS_RATE and not EXPLICIT_LUMPED:
        z_rate = rate_of(rate, memory, c)
    acceleration[stage * N + i, j] = ai
    if IS_RATE and not EXPLICIT_LUMPED:
        for m in range(M):
            memory_rate[(stage * N + i) * M + m, j] = z_rate[m]


def after_storey():
    for j in range(LANES):
        to_displacement[j] = dtype(0.0)
        to_velocity[j] = dtype(0.0)
        if not EXPLICIT_LUMPED:
            for m in range(M):
                to_memory[m, j] = dtype(0.0)
    for q in range(STAGES):
        if q <= stage:
            for j in range(LANES):
                slope = acceleration[q * N + i, j]
                to_displacement[j] += of_displacement[(stage + 1) * STAGES + q] * slope
                to_velocity[j] += of_velocity[(stage + 1) * STAGES + q] * slope
                if IS_RATE and not EXPLICIT_LUMPED:
                    for m in range(M):
                        z_slope = memory_rate[(q * N + i) * M + m, j]
                        to_memory[m, j] += of_velocity[(stage + 1) * STAGES + q] * z_slope
    for j in range(LANES):
        if HALVES_FIRST_STEP:
            if index == 0:
                to_displacement[j] *= dtype(0.5)
                to_velocity[j] *= dtype(0.5)
        us[i, j] = u[i, j] + h[j] * (of_step[stage + 1] * v[i, j] + h[j] * to_displacement[j])
        vs[i, j] = v[i, j] + h[j] * to_velocity[j]
        un[i, j] = us[i, j]
        vn[i, j] = vs[i, j]
        if IS_RATE and not EXPLICIT_LUMPED:
            for m in range(M):
                zs[i * M + m, j] = z[i * M + m, j] + h[j] * to_memory[m, j]
                zn[i * M + m, j] = zs[i * M + m, j]


def end_attempt():
    for i in range(N):
        for j in range(LANES):
            u[i, j] = un[i, j]
            v[i, j] = vn[i, j]
            us[i, j] = un[i, j]
            vs[i, j] = vn[i, j]
            if TAKES_MEMORY and not EXPLICIT_LUMPED:
                for m in range(M):
                    z[i * M + m, j] = zn[i * M + m, j]
                    zs[i * M + m, j] = zn[i * M + m, j]


def add_to_total():
    total += u[i, j] + v[i, j]
