"""Histories of forces on the floors."""

from warpdyn.kernels.loads import LOADS, sampled

FIELDS = {
    # All histories end to end [time x floor], where each starts, and the intervals between its samples.
    "Load": {"values": "float[]", "first": "int32[]", "intervals": "int32[]"},
}


def wanted(plan):
    load = LOADS[plan.load]
    return load.is_history and not load.is_base


def declare():
    f0 = matrix()  # the force at the interval's start, and its change over it
    df = matrix()


def settle_lane():
    for i in range(N):
        slot("number_storey")
        if not HAS_PADS or g < STOREYS:
            begin, change = sampled(loads, motion[j], interval, live_intervals[j], STOREYS, g, scale[j])
            f0[i, j] = begin
            df[i, j] = change


def add_load():
    at = (dtype(substep) + node[stage]) * inverse_substeps
    if ADAPTIVITY:
        at = (dtype(substep) + done[j] + node[stage] * part[j]) * inverse_substeps
    force = f0[i, j] + at * df[i, j]
    net += force


def add_supply():
    power_in[j] += force * vi
