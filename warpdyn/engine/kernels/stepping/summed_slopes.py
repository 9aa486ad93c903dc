"""Explicit methods whose stages need only the last slope: the kernel adds the sum of all slopes once per step."""

from warpdyn.engine.kernels.plan import keeps_drifts, keeps_slopes, tableau
from warpdyn.engine.methods.table import METHODS


def wanted(plan):
    method = METHODS[plan.method]
    return method.kind == "explicit" and not keeps_slopes(method) and not keeps_drifts(plan)


def names(plan):
    method = tableau(plan)
    # In units of the first weight the first stage's slopes need no factor.
    return {"reach": method.reach, "unit_weight": method.unit_weight, "times_unit": method.times_unit}


def declare():
    if HANDS_DOWN:
        own_u = row()
        own_v = row()


def begin_walk():
    if HANDS_DOWN:
        own_u[j] = wp.where(stage == 0, u[N - 1, j], us[N - 1, j])
        own_v[j] = wp.where(stage == 0, v[N - 1, j], vs[N - 1, j])


def state_of_stage():
    """Set the drift and the velocity of a stage; the first stage starts from the accepted state."""
    if HANDS_DOWN:
        drift = own_u[j]
        vi = own_v[j]
    else:
        drift = wp.where(stage == 0, u[i, j], us[i, j])
        vi = wp.where(stage == 0, v[i, j], vs[i, j])


def memory_of_stage():
    if TAKES_MEMORY:
        memory = memory_vector(wp.where(stage == 0, z[i * M, j], zs[i * M, j]))
        for m in range(1, M):
            memory[m] = wp.where(stage == 0, z[i * M + m, j], zs[i * M + m, j])
    else:
        slot("accepted_memory")


def state_below():
    if HANDS_DOWN:
        own_u[j] = wp.where(stage == 0, u[i - 1, j], us[i - 1, j])
        own_v[j] = wp.where(stage == 0, v[i - 1, j], vs[i - 1, j])
        drift -= own_u[j]
        rate -= own_v[j]
    else:
        drift -= wp.where(stage == 0, u[i - 1, j], us[i - 1, j])
        rate -= wp.where(stage == 0, v[i - 1, j], vs[i - 1, j])


def end_storey():
    ha = h[j] * reach[stage]
    if DENSE or (EXPLICIT_LUMPED and not BY_STOREY):
        un[i, j] += weight[stage] * vi
        vn[i, j] += weight[stage] * ai
        us[i, j] = u[i, j] + ha * vi
        vs[i, j] = v[i, j] + ha * ai
    else:
        slot("sum_up_slopes")


def sum_up_slopes():
    if IS_RATE and not EXPLICIT_LUMPED:
        z_rate = rate_of(rate, memory, c)
    # Slopes are summed up, so that the state is rounded once per step, not per stage.
    u_slope = times_unit[stage] * vi
    v_slope = times_unit[stage] * ai
    # The first slope of the displacement is the accepted velocity.
    if stage == 1:
        u_slope += times_unit[0] * v[i, j]
    if stage > 1:
        u_slope += un[i, j]
    if stage > 0:
        v_slope += vn[i, j]
    if IS_RATE and not EXPLICIT_LUMPED:
        z_slope = times_unit[stage] * z_rate
        if stage > 0:
            for m in range(M):
                z_slope[m] += zn[i * M + m, j]
    if stage < STAGES - 1:
        if stage > 0:
            un[i, j] = u_slope
        vn[i, j] = v_slope
        us[i, j] = u[i, j] + ha * vi
        vs[i, j] = v[i, j] + ha * ai
        if IS_RATE and not EXPLICIT_LUMPED:
            for m in range(M):
                zn[i * M + m, j] = z_slope[m]
                zs[i * M + m, j] = z[i * M + m, j] + ha * z_rate[m]
    else:
        unit_share = h[j] * unit_weight
        u[i, j] += unit_share * u_slope
        v[i, j] += unit_share * v_slope
        if IS_RATE and not EXPLICIT_LUMPED:
            for m in range(M):
                z[i * M + m, j] += unit_share * z_slope[m]


def add_to_total():
    total += u[i, j] + v[i, j]
