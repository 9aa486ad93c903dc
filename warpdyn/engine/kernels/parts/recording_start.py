"""Start time of the recorders (`record_from` of a scene): earlier peaks, for example of a transient, are ignored.

At the first step that starts at or after this time, peaks are set to the values of the present state. If a sample has
collapsed before this time, its peaks up to the collapse are kept.
"""

FIELDS = {"Samples": {"first_recorded": "int32[]"}}  # index of the first step whose initial state counts for peaks


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
            if COLLAPSE or SPRING_COLLAPSE:
                if stands[j] == dtype(0.0):
                    begins = int(0)
            if begins > 0:
                slot("restart_recorders")
