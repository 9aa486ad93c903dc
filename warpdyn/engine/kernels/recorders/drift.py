"""Recorder of the largest drift of every storey.

The drift of a storey of a lumped structure is the largest deformation of its springs (recorder "spring").
"""

from warpdyn.foundations.core.output_variables import Variable

order = 0
OF_STOREYS = {
    "peak_storey_drift": Variable(("storey",), "m", "peak absolute storey drift"),
    "storey_of_peak_drift": Variable(
        (), "1", "storey of the largest storey drift ratio", is_demand=False, is_whole=True
    ),
}
VARIABLES = {"chain": OF_STOREYS, "lumped": OF_STOREYS}
BORROWS = {"spring": ("peak_deformation",), "storey_members": ("first_of_frame", "next_storey")}


def wanted(plan):
    return "drift" in plan.recorders


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.functions.recording import worst_storey
    from warpdyn.engine.kernels.plan import DTYPES

    if plan.pattern is None:
        return {"worst_storey": worst_storey}
    # With equal storeys, rows of springs are in the order of the storeys.
    order = range(plan.pattern.springs) if plan.storeys is None else [s for row in plan.storeys.springs for s in row]
    place = {spring: row for row, spring in enumerate(order)}
    # Of a frame whose floors are shared among threads, each thread has the spring of one storey.
    row = "peak_of_storey" if plan.floors else "peak_deformation"
    lines = []
    for storey, springs in enumerate(plan.pattern.storeys):
        first, *others = [f"{row}[{place[spring]}, j]" for spring in springs]
        lines.append(f"output.peak_storey_drift[{storey}, o] = {first}")
        target = f"output.peak_storey_drift[{storey}, o]"
        lines += [f"{target} = larger({target}, {other})" for other in others]
    return {
        "worst_storey": worst_storey,
        "peaks_of_storeys": wp.types.matrix(shape=(plan.dofs, plan.lanes), dtype=DTYPES[plan.dtype]),
        "NUMBER_OF_STOREYS": len(plan.pattern.storeys),
        "LARGEST_OF_SPRINGS": "\n".join(lines),
    }


def values_held(plan):
    return plan.dofs if plan.pattern is None else 0


def declare():
    if not EXPLICIT_LUMPED:
        peak_drift = matrix()
    if SHARED_FLOORS:
        peak_of_storey = peaks_of_storeys()


def start_drift():
    peak_drift[i, j] = wp.abs(drift)


def see_drift():
    if not COLLAPSE:  # with COLLAPSE, the part `collapse` records the drifts up to the collapse
        peak_drift[i, j] = larger(peak_drift[i, j], wp.abs(drift))


def restart_recorders():
    if not EXPLICIT_LUMPED:
        for i in range(N):
            peak_drift[i, j] = dtype(0.0)
            if IMPLICIT_CHAIN:  # these methods record the state at the end of a step
                slot("accepted_drift")
                peak_drift[i, j] = wp.abs(drift)


def finish_storey():
    if not EXPLICIT_LUMPED:
        output.peak_storey_drift[g, o] = peak_drift[i, j]


def after_finish():
    if SHARED_FLOORS:
        for storey in range(STOREYS):
            peak_of_storey[storey, j] = shared_from(peak_deformation[0, j], first_of_frame + storey * next_storey)


def finish_rows():
    LARGEST_OF_SPRINGS


def judge_demand():
    if EXPLICIT_LUMPED:
        largest = worst_storey(output, structures, o, samples.structure[samples.order[sample[j]]], NUMBER_OF_STOREYS)
    else:
        largest = worst_storey(output, structures, o, samples.structure[samples.order[sample[j]]], STOREYS)
    if not PROPAGATED:  # the exact method cannot blow up
        if largest > blown_up:
            status = diverged
