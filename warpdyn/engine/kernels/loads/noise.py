"""Random base motions, which the kernel generates interval by interval and does not store."""

from warpdyn.engine.kernels.loads import LOADS

order = -1

BORROWS = {"base": ("a0", "da")}
FIELDS = {
    "Control": {"key": "uint64"},  # key of the random numbers, from the seed
    "Samples": {"number": "uint64[]"},  # the sample's index in the run
    # The values of filtered_noise.py in this order: the matrices growth, kick and start, row by row; the vector output;
    # and the envelope at its nodes.
    "Load": {"noise": "float64[]"},
}


def wanted(plan):
    return LOADS[plan.load].noise_states > 0


def values_held(plan):
    return LOADS[plan.load].noise_states * (2 if plan.dtype == "float32" else 1)  # in float64


def names(plan):
    from warpdyn.engine.kernels.functions.noise import noise_of

    noise = noise_of(plan)
    return {"Processes": noise.Processes, "Numbers": noise.Numbers, "noise_over_interval": noise.over_interval}


def start():
    processes = Processes()
    number = Numbers()
    for j in range(LANES):
        number[j] = samples.number[samples.order[sample[j]]]


def begin_interval():
    a0, da, processes = noise_over_interval(loads, control.key, number, interval, live_intervals, scale, processes)
    if EXPLICIT_CHAIN:
        for j in range(LANES):
            da[j] = da[j] * inverse_substeps
