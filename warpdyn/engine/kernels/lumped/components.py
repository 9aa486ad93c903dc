"""Several components of a recorded base motion, which act together on a lumped structure."""

from warpdyn.engine.kernels.loads import LOADS, sampled

FIELDS = {
    # Values of all motions in one array [time x component], index of the first sample of each, number of its intervals.
    "Load": {"values": "float[]", "first": "int32[]", "intervals": "int32[]"},
}


def wanted(plan):
    return plan.pattern is not None and plan.pattern.components > 1 and LOADS[plan.load].is_base


def values_held(plan):
    return 3 * plan.pattern.components


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    shape = plan.pattern.components, plan.lanes
    return {"MOTIONS": plan.pattern.components, "components": wp.types.matrix(shape=shape, dtype=DTYPES[plan.dtype])}


def declare():
    ground_begin = components()  # base acceleration at the start of the interval, and its change over the interval
    ground_change = components()
    ground = components()
    ground_last = components()  # at the end of the last step
    momentum_along = components()  # of the load mass, along each component


def settle_lane():
    for k in range(MOTIONS):
        begin, change = sampled(loads, motion[j], interval, live_intervals[j], MOTIONS, k, scale[j])
        ground_begin[k, j] = begin
        ground_change[k, j] = change


def add_supply_of_walk():
    for k in range(MOTIONS):
        if TRAPEZOIDAL:
            # If the motion jumps, a step may end with another value than the next one starts with.
            if stage == 0:
                impulse = dtype(0.5) * (h_last[j] * ground_last[k, j] + h[j] * ground[k, j])
                energy_in[j] -= impulse * momentum_along[k, j]
        else:
            power_in[j] -= ground[k, j] * momentum_along[k, j]


def keep_end_of_step():
    for k in range(MOTIONS):
        ground_last[k, j] = ground_begin[k, j] + dtype(substep + 1) * inverse_substeps * ground_change[k, j]


def begin_walk():
    slot("position_of_stage")
    for k in range(MOTIONS):
        ground[k, j] = ground_begin[k, j] + at * ground_change[k, j]
