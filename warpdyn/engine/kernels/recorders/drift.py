"""Recorder of the largest drift of every storey."""

from warpdyn.foundations.core.output_variables import Variable

order = 0
VARIABLES = {
    "chain": {
        "peak_storey_drift": Variable(("storey",), "m", "peak absolute storey drift"),
        "storey_of_peak_drift": Variable(
            (), "1", "storey of the largest storey drift ratio", is_demand=False, is_whole=True
        ),
    },
}


def wanted(plan):
    return "drift" in plan.recorders


def names(plan):
    from warpdyn.engine.kernels.functions.recording import worst_storey

    return {"worst_storey": worst_storey}


def values_held(plan):
    return plan.dofs


def declare():
    peak_drift = matrix()


def start_drift():
    peak_drift[i, j] = wp.abs(drift)


def see_drift():
    if not COLLAPSE:  # with COLLAPSE, the part `collapse` records the drifts up to the collapse
        peak_drift[i, j] = larger(peak_drift[i, j], wp.abs(drift))


def restart_recorders():
    for i in range(N):
        peak_drift[i, j] = dtype(0.0)
        if IMPLICIT_CHAIN:  # these methods record the state at the end of a step
            slot("accepted_drift")
            peak_drift[i, j] = wp.abs(drift)


def finish_storey():
    output.peak_storey_drift[g, o] = peak_drift[i, j]


def judge_demand():
    largest = worst_storey(output, structures, o, samples.structure[samples.order[sample[j]]], STOREYS)
    if not PROPAGATED:  # the exact method cannot blow up
        if largest > blown_up:
            status = diverged
