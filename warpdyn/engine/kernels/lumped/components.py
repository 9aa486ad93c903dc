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


def settle_lane():
    for k in range(MOTIONS):
        begin, change = sampled(loads, motion[j], interval, live_intervals[j], MOTIONS, k, scale[j])
        ground_begin[k, j] = begin
        ground_change[k, j] = change


def begin_walk():
    slot("position_of_stage")
    for k in range(MOTIONS):
        ground[k, j] = ground_begin[k, j] + at * ground_change[k, j]
