"""Recorder of the peak base shear: the largest restoring force of the first storey."""

from warpdyn.foundations.core.output_variables import Variable

order = 30
VARIABLES = {"chain": {"peak_base_shear": Variable((), "N", "peak restoring force of the first storey")}}


def wanted(plan):
    return "base_shear" in plan.recorders


def values_held(plan):
    return 1


def declare():
    peak_shear = row()
    if PROPAGATED and COLLAPSE:
        # Value of the previous state; whether the building collapses in this state is not known yet.
        earlier_shear = row()


def see_forces():
    if i == 0:
        shear = wp.abs(restoring)
        if COLLAPSE:
            if PROPAGATED:
                present_shear = shear
                shear = earlier_shear[j]
                earlier_shear[j] = present_shear
            shear = shear * stands[j]
        peak_shear[j] = larger(peak_shear[j], shear)


def restart_recorders():
    peak_shear[j] = dtype(0.0)
    if PROPAGATED and COLLAPSE:
        earlier_shear[j] = dtype(0.0)


def finish():
    if PROPAGATED and COLLAPSE:
        peak_shear[j] = larger(peak_shear[j], earlier_shear[j] * stands[j])


def write():
    output.peak_base_shear[o] = peak_shear[j]
