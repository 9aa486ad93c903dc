"""The largest drift of every storey."""


def wanted(plan):
    return "drift" in plan.recorders


def names(plan):
    from warpdyn.kernels.recorders import worst_storey

    return {"worst_storey": worst_storey}


def declare():
    peak_drift = matrix()


def see_drift():
    peak_drift[i, j] = larger(peak_drift[i, j], wp.abs(drift))


def finish_storey():
    output.peak_storey_drift[g, o] = peak_drift[i, j]


def judge_demand():
    largest = worst_storey(output, structures, o, samples.structure[sample[j]], STOREYS)
    if largest > control.collapse_drift_ratio:
        status = collapsed
    if largest > blown_up:
        status = diverged
