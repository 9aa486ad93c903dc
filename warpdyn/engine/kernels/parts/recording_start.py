"""Start time of the recorders: peaks before it do not count, for example those of a transient.

At the first step at or after this time, recorders of peaks start again from the accepted state. A sample that has
collapsed before keeps its demands up to the collapse.
"""

FIELDS = {"Samples": {"first_recorded": "int32[]"}}  # step whose start is the first state that recorders of peaks count


def wanted(plan):
    return plan.records_late


def declare():
    first_recorded = indices()


def read_sample():
    first_recorded[j] = samples.first_recorded[samples.order[sample[j]]]


def begin_step():
    some_begin = int(0)
    for j in range(LANES):
        some_begin = some_begin | wp.where(index == first_recorded[j], 1, 0)
    if some_begin > 0:
        for j in range(LANES):
            begins = wp.where(index == first_recorded[j], 1, 0)
            if COLLAPSE:
                if stands[j] == dtype(0.0):
                    begins = int(0)
            if begins > 0:
                slot("restart_recorders")
