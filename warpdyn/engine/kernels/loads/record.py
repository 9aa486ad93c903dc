"""Recorded base motions, in one array that all samples share."""

from warpdyn.engine.kernels.loads import LOADS, at_ends

order = -1

BORROWS = {"base": ("a0", "da")}
FIELDS = {"Load": {"values": "float[]", "first": "int32[]"}}  # all motions in one array; index of each first value


def wanted(plan):
    load = LOADS[plan.load]
    is_single = plan.pattern is None or plan.pattern.components == 1
    return load.is_base and not load.noise_states and is_single


def names(plan):
    from warpdyn.engine.device.processor import ELEMENT

    return {"element": ELEMENT[plan.dtype]}


def declare():
    next_value = indices()  # position of the value at the end of the first interval
    last_value = indices()
    silent_from = indices()  # interval from which the motion is zero; a run that ends with it uses its last sample
    value = row()  # acceleration at the end of the interval
    base_at_end = row()
    gain = row()  # the scale, or 0 after the last sample
    stride = indices()  # 1, or 0 after the last sample
    differing_motions = int(0)


def read_sample():
    last = loads.intervals[motion[j]]
    next_value[j] = loads.first[motion[j]] + 1
    last_value[j] = loads.first[motion[j]] + last
    silent_from[j] = wp.where(last < live_intervals[j], last, 2147483647)
    gain[j] = scale[j]
    stride[j] = int(1)
    base_at_end[j] = loads.values[next_value[j] - 1] * scale[j]
    differing_motions += wp.where(motion[j] != motion[0], 1, 0)


def begin_phase():
    if EXPLICIT_CHAIN and HOLDS_STEP:
        for j in range(LANES):
            if interval_from == silent_from[j]:
                gain[j] = dtype(0.0)
                base_at_end[j] = dtype(0.0)
                stride[j] = int(0)
            elif interval_from < silent_from[j]:
                interval_until = wp.min(interval_until, silent_from[j])


def change_lanes():
    for j in range(LANES):
        next_change = wp.min(next_change, wp.where(interval < silent_from[j], silent_from[j], 2147483647))


def in_interval():
    if EXPLICIT_CHAIN and HOLDS_STEP:
        for j in range(LANES):
            a0[j] = base_at_end[j]
            base_at_end[j] = element(loads.values, next_value[j] + interval * stride[j]) * gain[j]
            da[j] = (base_at_end[j] - a0[j]) * inverse_substeps
    elif EXPLICIT_CHAIN and HOLDS_LANES:
        if differing_motions == 0 and interval != changed:
            sample_at_end = element(loads.values, wp.min(next_value[0] + interval, last_value[0]))
            for j in range(LANES):
                a0[j] = base_at_end[j]
                base_at_end[j] = sample_at_end * gain[j]
                da[j] = (base_at_end[j] - a0[j]) * inverse_substeps
        else:
            slot("value_of_interval")
    else:
        slot("value_of_interval")


def value_of_interval():
    # Lanes that share a motion read it once: reading one value per lane costs as much as a storey.
    if differing_motions == 0:
        shared = element(loads.values, wp.min(next_value[0] + interval, last_value[0]))
        for j in range(LANES):
            value[j] = shared
    else:
        for j in range(LANES):
            value[j] = element(loads.values, wp.min(next_value[j] + interval, last_value[j]))
    for j in range(LANES):
        begin, end, factor = at_ends(base_at_end[j], value[j], gain[j], interval == silent_from[j])
        a0[j] = begin
        da[j] = (end - begin) * inverse_substeps if EXPLICIT_CHAIN else end - begin
        base_at_end[j] = end
        gain[j] = factor
