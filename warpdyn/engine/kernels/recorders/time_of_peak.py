"""Recorder of the time at which the largest storey drift ratio occurs."""

from warpdyn.foundations.core.output_variables import Variable

order = 10
VARIABLES = {
    "chain": {
        "time_of_peak_drift": Variable((), "s", "time of the largest storey drift ratio", is_demand=False),
    },
}

BORROWS = {"adaptivity": ("done",), "collapse": ("collapse_time",)}


def wanted(plan):
    return "time_of_peak" in plan.recorders


def values_held(plan):
    return plan.dofs + 2


def declare():
    worst_ratio = row()
    worst_time = row()
    ratio_now = row()


def start_drift():
    worst_ratio[j] = larger(worst_ratio[j], wp.abs(drift) * inverse_height[i, j])


def see_drift():
    ratio_now[j] = larger(ratio_now[j], wp.abs(drift) * inverse_height[i, j])


def see_state():
    for j in range(LANES):
        if SECTIONS:
            ratio_now[j] = across(ratio_now[j], THREADS)
        if ratio_now[j] > worst_ratio[j]:
            worst_ratio[j] = ratio_now[j]
            worst_time[j] = dtype(index + 1 if IMPLICIT_CHAIN else index) * step[j]
            if ADAPTIVITY:
                worst_time[j] = (dtype(index) + done[j]) * step[j]
        ratio_now[j] = dtype(0.0)


def restart_recorders():
    worst_ratio[j] = dtype(0.0)
    worst_time[j] = dtype(index) * step[j]
    if IMPLICIT_CHAIN:  # these methods record the state at the end of a step
        for i in range(N):
            slot("accepted_drift")
            worst_ratio[j] = larger(worst_ratio[j], wp.abs(drift) * inverse_height[i, j])


def write():
    if COLLAPSE:  # the last state is at the end of the step in which the building collapses
        if collapse_time[j] >= dtype(0.0):
            worst_time[j] = wp.min(worst_time[j], collapse_time[j])
    output.time_of_peak_drift[o] = worst_time[j]
