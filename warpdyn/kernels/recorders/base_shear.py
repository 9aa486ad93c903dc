"""The largest restoring force of the first storey."""


def wanted(plan):
    return "base_shear" in plan.recorders


def declare():
    peak_shear = row()


def see_forces():
    if i == 0:
        peak_shear[j] = larger(peak_shear[j], wp.abs(restoring))


def write():
    output.peak_base_shear[o] = peak_shear[j]
