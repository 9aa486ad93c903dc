"""The largest restoring force of the first storey."""

from warpdyn.core.output_variables import Variable

order = 30
VARIABLES = {"chain": {"peak_base_shear": Variable((), "N", "peak restoring force of the first storey")}}


def wanted(plan):
    return "base_shear" in plan.recorders


def values_held(plan):
    return 1


def declare():
    peak_shear = row()


def see_forces():
    if i == 0:
        peak_shear[j] = larger(peak_shear[j], wp.abs(restoring))


def write():
    output.peak_base_shear[o] = peak_shear[j]
