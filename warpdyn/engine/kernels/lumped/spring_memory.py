"""The memory of the springs of a lumped structure, for laws whose memory follows a differential equation."""

from warpdyn.engine.kernels.plan import keeps_drifts, tableau
from warpdyn.engine.laws.springs import spring_row


def wanted(plan):
    has_stages = plan.kind == "explicit" and not keeps_drifts(plan)
    return plan.pattern is not None and spring_row(plan.law).rate is not None and has_stages


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    method, memory = tableau(plan), spring_row(plan.law).memory
    rows = plan.pattern.single_springs * method.stages * memory
    return {
        "reach": method.reach,
        "of_velocity": method.a,
        "spring_slopes": wp.types.matrix(shape=(rows, plan.lanes), dtype=DTYPES[plan.dtype]),
    }


def declare():
    spring_rate = spring_slopes()  # rates of the memory in every stage, of methods that keep them


def end_spring():
    z_rate = rate_of(rate, memory, c)
    if KEEPS_SLOPES:
        for m in range(M):
            spring_rate[(stage * SPRINGS + i) * M + m, j] = z_rate[m]
            change_of_memory = dtype(0.0)
            for q in range(STAGES):
                if q <= stage:
                    slope_of_memory = spring_rate[(q * SPRINGS + i) * M + m, j]
                    change_of_memory += of_velocity[(stage + 1) * STAGES + q] * slope_of_memory
            zs[i * M + m, j] = z[i * M + m, j] + h[j] * change_of_memory
    else:
        for m in range(M):
            zn[i * M + m, j] += weight[stage] * z_rate[m]
            zs[i * M + m, j] = z[i * M + m, j] + h[j] * reach[stage] * z_rate[m]


def accept_springs():
    for i in range(SPRINGS):
        for j in range(LANES):
            for m in range(M):
                if KEEPS_SLOPES:
                    z[i * M + m, j] = zs[i * M + m, j]
                else:
                    z[i * M + m, j] += h[j] * zn[i * M + m, j]
                    zn[i * M + m, j] = dtype(0.0)
                    zs[i * M + m, j] = z[i * M + m, j]
