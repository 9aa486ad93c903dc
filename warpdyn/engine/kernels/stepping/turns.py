"""Adaptive methods and laws with a return mapping: the error if the velocity of a storey changes sign within a step.

If a storey turns within a step, its drift passes a larger value than its drift at the end of the step. The error
estimate of the method does not contain the resulting error.
"""

from warpdyn.engine.laws.springs import spring_row
from warpdyn.engine.methods.table import METHODS


def wanted(plan):
    method = METHODS[plan.method]
    is_adaptive = method.kind == "explicit" and method.is_adaptive
    return is_adaptive and plan.family == "chain" and spring_row(plan.law).return_mapping is not None


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    dtype, memory = DTYPES[plan.dtype], spring_row(plan.law).memory
    nothing = wp.types.vector(length=max(1, memory), dtype=dtype)()
    return {"zero": wp.constant(dtype(0.0)), "no_memory": wp.constant(nothing)}


def miss_turns():
    # A storey that turns inside the part was farther than at its end.
    drift = un[i, j]
    rate = vn[i, j]
    begin_drift = u[i, j]
    begin_rate = v[i, j]
    if i > 0:
        drift -= un[i - 1, j]
        rate -= vn[i - 1, j]
        begin_drift -= u[i - 1, j]
        begin_rate -= v[i - 1, j]
    slot("storey_coefficients")
    before = memory_vector(z[i * M, j])
    for m in range(1, M):
        before[m] = z[i * M + m, j]
    if IS_RATE:
        for m in range(M):
            before[m] = zn[i * M + m, j]
    after = mapped_memory(drift, before, c)
    if begin_rate * rate < dtype(0.0):
        # By a parabola from each end; if they differ, the turn may be farther.
        turn = h[j] * begin_rate / (begin_rate - rate)
        early = begin_drift + dtype(0.5) * begin_rate * turn
        late = drift - dtype(0.5) * rate * (h[j] - turn)
        farthest = dtype(0.5) * (early + late)
        beyond = farthest + wp.sign(begin_rate) * wp.abs(early - late)
        turned = mapped_memory(drift, mapped_memory(beyond, before, c), c)
        missed = force_of(drift, turned, c) - force_of(drift, after, c)
        initial_stiffness = tangent_of(zero, zero, no_memory, no_memory, c)
        of_u = wp.max(of_u, LASTING * wp.abs(missed) / initial_stiffness)
        after = mapped_memory(drift, mapped_memory(farthest, before, c), c)
    for m in range(M):
        zn[i * M + m, j] = after[m]
