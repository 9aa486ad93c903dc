"""Recorder of response histories: the state and the storey forces at every step, or at every n-th step."""

from warpdyn.foundations.core.output_variables import Variable

order = 60
HISTORY = {  # names are those of the fields of the struct History
    "displacement": Variable(("dof",), "m", "displacement relative to the base"),
    "velocity": Variable(("dof",), "m s-1", "velocity relative to the base"),
    "acceleration": Variable(("dof",), "m s-2", "absolute acceleration"),
    "storey_force": Variable(("storey",), "N", "storey restoring force"),
}

OF_SPRINGS = {  # of lumped structures
    "spring_deformation": Variable(("spring",), "m", "deformation of the spring"),
    "spring_force": Variable(("spring",), "N", "force of the spring's law"),
}

BORROWS = {"adaptivity": ("attempt",)}
FIELDS = {
    "Control": {"every": "int32"},  # number of steps from one recorded state to the next
    "History": {name: "float[,,]" for name in (*HISTORY, *OF_SPRINGS)},  # [history, time, dof]
}


def wanted(plan):
    return "history" in plan.recorders


def names(plan):
    from warpdyn.engine.kernels.functions.recording import keep_force, keep_spring, keep_state

    return {"keep_force": keep_force, "keep_spring": keep_spring, "keep_state": keep_state}


def declare():
    every = control.every


def see_forces():
    if HAS_BEFORE_FORCE_ENDS and (not ADAPTIVITY or attempt == 0):
        slot("before_force_ends")
        floor = position[j] if PROPAGATED else u[i, j]
        keep_state(history, samples.order[sample[j]], index, every, i, floor, vi, before_end)
        if IS_CHAIN:
            keep_force(history, samples.order[sample[j]], index, every, i, restoring)
    elif not ADAPTIVITY or attempt == 0:
        keep_state(history, samples.order[sample[j]], index, every, i, position[j] if PROPAGATED else u[i, j], vi, ai)
        if IS_CHAIN:
            keep_force(history, samples.order[sample[j]], index, every, i, restoring)


def see_spring():
    keep_spring(history, samples.order[sample[j]], index, every, i, drift, restoring)
