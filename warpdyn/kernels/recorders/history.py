"""Whole histories: the state and the storeys' forces at every step, or at every so many."""


def wanted(plan):
    return "history" in plan.recorders


def names(plan):
    from warpdyn.kernels.recorders import keep_force, keep_state

    return {"keep_force": keep_force, "keep_state": keep_state}


def declare():
    every = control.every


def see_forces():
    if not ADAPTIVITY or attempt == 0:
        keep_state(history, samples.output[sample[j]], index, every, i, u[i, j], vi, ai)
        keep_force(history, samples.output[sample[j]], index, every, i, restoring)
