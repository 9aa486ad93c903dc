"""The samples of a thread: one sample on a GPU; on a CPU several samples, one per lane of the vector registers."""

order = -100

BORROWS = {"adaptivity": ("done", "part")}
FIELDS = {
    # Number of samples, and steps per interval of the motion. With `undivided`, each step is an interval of the kernel.
    "Control": {"samples": "int32", "substeps": "int32"},
    "Samples": {
        "order": "int32[]",  # the samples in the order of their launch
        "structure": "int32[]",
        "motion": "int32[]",
        "scale": "float[]",
        "step": "float[]",  # integration step; with an adaptive method the longest step
        "run_intervals": "int32[]",  # number of intervals of the motion and of the free vibration after it
    },
    "Output": {"status": "int8[]"},
}


def wanted(plan):
    return True


def names(plan):
    import warp as wp

    from warpdyn.engine.device.processor import LARGER, UPDATED
    from warpdyn.engine.kernels.composing.user_recorders import users_of
    from warpdyn.engine.kernels.plan import DTYPES, row_types, structs
    from warpdyn.foundations.core.output_variables import (
        COLLAPSED,
        DIVERGED,
        LARGEST_DRIFT_RATIO,
        NOT_CONVERGED,
        OK,
        UNSTABLE_STEP,
    )

    dtype, lanes = DTYPES[plan.dtype], plan.lanes
    row, row64, indices = row_types(plan)
    codes = {"ok": OK, "collapsed": COLLAPSED, "diverged": DIVERGED, "unstable_step": UNSTABLE_STEP}
    codes |= {"not_converged": NOT_CONVERGED}
    return {
        "dtype": dtype,
        **vars(structs(plan.dtype, users_of(plan.recorders))),
        "LANES": lanes,
        "STOREYS": plan.dofs,
        "N": plan.storeys_of_thread,
        "IS_CHAIN": plan.family == "chain",
        "UNDIVIDED": plan.undivided,
        "row": row,
        "row64": row64,
        "indices": indices,
        "matrix": wp.types.matrix(shape=(plan.storeys_of_thread, lanes), dtype=dtype),
        "larger": LARGER[plan.dtype],
        "updated": UPDATED[plan.dtype],
        "blown_up": wp.constant(dtype(LARGEST_DRIFT_RATIO)),
        **{name: wp.int8(code) for name, code in codes.items()},
    }


def declare():
    substeps = int(1) if UNDIVIDED else control.substeps
    sample = indices()
    motion = indices()
    live_intervals = indices()  # number of intervals of the motion and of the free vibration after it
    scale = row()
    step = row()
    intervals = int(0)


def read_lane():
    # Lanes beyond the last sample repeat it and write the same values again.
    sample[j] = wp.min(block * LANES + j, control.samples - 1)
    o = samples.order[sample[j]]
    s = samples.structure[o]
    motion[j] = samples.motion[o]
    live_intervals[j] = samples.run_intervals[o] * control.substeps if UNDIVIDED else samples.run_intervals[o]
    intervals = wp.max(intervals, live_intervals[j])
    scale[j] = samples.scale[o]
    step[j] = samples.step[o]


def position_of_stage():
    # Time of the stage since the start of the interval, divided by its length.
    at = (dtype(substep) + node[stage]) * inverse_substeps
    if ADAPTIVITY:
        at = (dtype(substep) + done[j] + node[stage] * part[j]) * inverse_substeps
