"""Recorder of the residual drift ratio of every storey or deformation of every spring: a mean over the run's end.

The kernel of frames and fish-bones whose joints are a grid does not support this recorder. Their default method is
"rk4" with this recorder and "leapfrog" without it, so that other results change by the error of the methods.
"""

from warpdyn.foundations.core.output_variables import Variable

order = 40
VARIABLES = {
    "chain": {
        "residual_drift_ratio": Variable(
            ("storey",),
            "1",
            "storey drift ratio, Hann-weighted mean over the end of the run",
            scale=("peak_storey_drift_ratio",),
        ),
    },
    "lumped": {
        "residual_deformation": Variable(
            ("spring",),
            "m",
            "deformation of the spring, Hann-weighted mean over the end of the run",
            scale=("peak_spring_deformation",),
        ),
    },
}
FIELDS = {"Samples": {"residual_steps": "int32[]"}}  # number of last steps over which the drift is averaged


def wanted(plan):
    return "residual" in plan.recorders


def names(plan):
    from warpdyn.engine.kernels.functions.recording import add_to_mean, weight_in_mean

    return {"add_to_mean": add_to_mean, "weight_in_mean": weight_in_mean}


def values_held(plan):
    return 0 if "time_of_peak" in plan.recorders else plan.dofs


def declare():
    residual_start = int(2147483647)
    # A processor sums up in local variables; a GPU in memory, because these steps are too few for registers.
    share_in_mean = row()  # 0 for a lane that adds nothing in this step
    mean_ratio = spring_rows() if EXPLICIT_LUMPED else matrix()
    steps_of_mean = indices()


def read_sample():
    steps_of_mean[j] = samples.residual_steps[samples.order[sample[j]]]
    start = live_intervals[j] * substeps - steps_of_mean[j]
    if PROPAGATED:
        start += 1  # a state is recorded at the start of the next step
    residual_start = wp.min(residual_start, start)


def see_state():
    if PROPAGATED:
        slot("add_to_means")


def end_step():
    if not PROPAGATED:
        slot("add_to_means")


def add_to_means():
    if index >= residual_start:
        for j in range(LANES):
            steps = steps_of_mean[j]
            since = index - (live_intervals[j] * substeps - steps)
            if PROPAGATED:
                since -= 1
            share = weight_in_mean(step[j], since, steps)
            share = wp.where(since < 0, dtype(0.0), share)
            share_in_mean[j] = wp.where(since < steps, share, dtype(0.0))
        if EXPLICIT_LUMPED:
            for i in range(ROWS):
                for j in range(LANES):
                    if LANES > 1:
                        mean_ratio[i, j] += share_in_mean[j] * deformation[i, j]
                    elif since >= 0 and since < steps and block < control.samples:
                        o = samples.order[sample[j]]
                        add_to_mean(
                            output.residual_deformation,
                            number_of_spring,
                            o,
                            share_in_mean[j] * deformation[i, j],
                            since,
                        )
        else:
            for i in range(N):
                for j in range(LANES):
                    slot("number_storey")
                    if not HAS_PADS or g < STOREYS:
                        if PROPAGATED:
                            ratio = ratio_of_storey[i, j]
                        else:
                            slot("accepted_drift")
                            ratio = drift * inverse_height[i, j]
                        if LANES > 1:
                            mean_ratio[i, j] += share_in_mean[j] * ratio
                        elif since >= 0 and since < steps and block < control.samples:
                            # Threads beyond the last sample repeat it and must not add to its sum again.
                            o = samples.order[sample[j]]
                            add_to_mean(output.residual_drift_ratio, g, o, share_in_mean[j] * ratio, since)


def finish_spring_row():
    if LANES > 1:
        output.residual_deformation[number_of_spring, o] = mean_ratio[i, j]


def finish_storey():
    if LANES > 1 and not EXPLICIT_LUMPED:
        output.residual_drift_ratio[g, o] = mean_ratio[i, j]
