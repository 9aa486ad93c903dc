"""The time loop of kernels for linear structures: the exact method, and implicit methods with full matrices.

The state is in coordinates of the undamped modes. A step adds an increment to the state; the increment is a matrix
(propagator) times the state and the load (propagators.py). Increments are accurate in float32; a product with a matrix
near the identity would not be. Recorders see a state at the start of the next step; after the last step, an additional
step of length zero shows them the last state. The function in this module that contains the time loop is a skeleton:
`compose` replaces each of its `slot(...)` statements by the statements of the chosen parts of the kernel, such as the
load and the recorders.
"""

from __future__ import annotations

from warpdyn.engine.device.processor import align_rows
from warpdyn.engine.kernels.loads import LOADS
from warpdyn.engine.kernels.plan import DTYPES, Plan
from warpdyn.engine.methods.table import METHODS

# Rows of the largest table that a CPU thread copies for its lanes (512 KiB for 16 lanes in float64).
LARGEST_COPY = 4096
FIELDS = {
    "Structure": {
        # In coordinates of the modes; a pair is a structure with a step.
        "propagator": "float[,]",  # matrix from the state to the increments, [row x state, pair]
        "load_response": "float[,]",  # matrix from the loads to the increments, [row x load x 2, pair]
        # Storey drift of a chain, [dof x mode, pair]; displacement of a linear system, [dof x mode, 1].
        "mode_shape": "float[,]",
        "modal_stiffness": "float[,]",  # divided by the modal mass, as are damping and load, [mode, pair]
        "modal_damping": "float[,]",  # [mode, pair], or [mode x mode, pair] if damping couples the modes
        "modal_load": "float[,]",  # [mode, pair]
        "modal_mass": "float[]",  # [pair]
        "initial_state": "float[,]",  # modal displacements and velocities, [2 x mode, pair]
    },
}


def names(plan: Plan) -> dict[str, object]:
    """Return the objects to which names in the text of the time loop refer: {name: constant, type or function}."""
    import warp as wp

    dtype, method, load, n = DTYPES[plan.dtype], METHODS[plan.method], LOADS[plan.load], plan.dofs
    is_implicit, is_coupled = method.kind == "implicit", plan.damping != "classical"
    # The state is (q, q'). For implicit methods it is (q, q', q''), and only q'' has increments. If the modes are
    # coupled, increments depend on the states and loads of all modes, otherwise on those of the same mode.
    states, rows = (3 * n, n) if is_implicit else (2 * n, 2 * n)
    columns, width = (states if is_coupled else 2), (n if load.is_history and not load.is_base else 1)
    inputs = 0 if plan.load == "free_vibration" else width if is_coupled else 1
    # Small tables are copied to a processor's stack or a GPU's registers; others are read from memory.
    largest = max(rows * columns, 2 * rows * inputs, n * n)
    is_copied = largest <= (LARGEST_COPY if plan.lanes > 1 else plan.max_unroll)

    def table(rows: int) -> type:
        return wp.types.matrix(shape=(max(1, rows), plan.lanes), dtype=dtype)

    return {
        "IS_IMPLICIT": is_implicit,
        "IS_COUPLED": is_coupled,
        "IS_COPIED": is_copied,
        "SEEN": 1 if set(plan.recorders) <= {"base_shear", "energy"} and not plan.collapses else n,  # storeys
        "PARTNERS": n if is_coupled else 1,
        "ROWS": rows,
        "COLUMNS": columns,
        "WIDTH": width,
        "INPUTS": inputs,
        "beta": wp.constant(dtype(method.beta if is_implicit else 0.0)),
        "gamma": wp.constant(dtype(method.gamma if is_implicit else 0.0)),
        "states": table(states),
        "inputs": table(width),
        "of_states": table(rows * columns),
        "of_inputs": table(2 * rows * inputs),
        "of_shapes": table(n * n),
        "of_damping": table(n * n if is_coupled else n),
        # A thread has all modes.
        "HAS_PADS": False,
        "g": "i",
    }


def advance_linear(
    first: int, control: Control, samples: Samples, structures: Structure, loads: Load, output: Output, history: History
):
    align_rows()
    block = first + wp.tid()
    pair = indices()
    shaped = indices()  # column of the shapes: linear systems have one set, scaled by their modal mass
    inverse_height = matrix()
    propagator = of_states()
    response = of_inputs()
    shape = of_shapes()
    modal_damping = of_damping()
    stiffness = matrix()
    modal_load = matrix()
    x = states()
    live = row()  # 1, or 0 for a lane that has finished
    load_start = inputs()  # the load at both ends of the step, or its sine and cosine at the start
    load_end = inputs()
    total = row()
    dx = states()
    acceleration = matrix()
    moved = row()
    position = row()
    velocity = row()
    felt = row()
    storey_stiffness = matrix()
    ratio_of_storey = matrix()  # drift ratio at the state that is recorded
    slot("declare")
    inverse_substeps = dtype(1.0) / dtype(substeps)
    for j in range(LANES):
        slot("read_lane")
        pair[j] = s
        if IS_CHAIN:
            shaped[j] = s
        slot("read_sample")
    for m in range(N):
        for j in range(LANES):
            x[m, j] = structures.initial_state[m, pair[j]]
            x[N + m, j] = structures.initial_state[N + m, pair[j]]
            inverse_height[m, j] = structures.inverse_height[m, pair[j]]
            stiffness[m, j] = structures.modal_stiffness[m, pair[j]]
            if BASE or HARMONIC:
                modal_load[m, j] = structures.modal_load[m, pair[j]]
            if IS_CHAIN:
                storey_stiffness[m, j] = structures.coefficients[m, pair[j]]
    if IS_COPIED:
        for k in range(ROWS * COLUMNS):
            for j in range(LANES):
                propagator[k, j] = structures.propagator[k, pair[j]]
        for k in range(2 * ROWS * INPUTS):
            for j in range(LANES):
                response[k, j] = structures.load_response[k, pair[j]]
        for k in range(N * N):
            for j in range(LANES):
                shape[k, j] = structures.mode_shape[k, shaped[j]]
        for k in range(N * PARTNERS):
            for j in range(LANES):
                modal_damping[k, j] = structures.modal_damping[k, pair[j]]
    slot("start")
    # One interval more than the longest run: its first step records the last state.
    for interval in range(intervals + 1):
        slot("begin_interval")
        if COLLAPSE:
            if standing == 0:
                break
        for j in range(LANES):
            live[j] = wp.where(interval < live_intervals[j], dtype(1.0), dtype(0.0))
            slot("settle_lane")
        slot("in_interval")
        for substep in range(substeps):
            index = interval * substeps + substep
            slot("begin_step")
            if ENERGY or ACCELERATION or FLOOR_SPECTRA or HISTORY or (IS_IMPLICIT and index == 0):
                for m in range(N):
                    for j in range(LANES):
                        total[j] = dtype(0.0)
                    for c in range(PARTNERS):
                        for j in range(LANES):
                            k = m * PARTNERS + c
                            share = modal_damping[k, j] if IS_COPIED else structures.modal_damping[k, pair[j]]
                            total[j] += share * x[N + c if IS_COUPLED else N + m, j]
                    for j in range(LANES):
                        # Acceleration by springs and dampers: the absolute acceleration without nodal forces.
                        inner = -total[j] - stiffness[m, j] * x[m, j]
                        driven = dtype(0.0)
                        if BASE or HARMONIC:
                            driven = modal_load[m, j] * load_start[0, j]
                        if FORCES:
                            driven = load_start[m, j]
                        acceleration[m, j] = inner if BASE else inner + driven
                        if IS_IMPLICIT:
                            if index == 0:
                                x[2 * N + m, j] = inner + driven
                        slot("see_mode")
                slot("see_modes")
            if HAS_SEE_DRIFT or HAS_SEE_FORCES or RESIDUAL:
                for i in range(SEEN):
                    for j in range(LANES):
                        moved[j] = dtype(0.0)
                        # The motion of a floor is the sum over the storeys below.
                        if i == 0 or not IS_CHAIN:
                            position[j] = dtype(0.0)
                            velocity[j] = dtype(0.0)
                            felt[j] = dtype(0.0)
                            slot("begin_floor")
                    for m in range(N):
                        for j in range(LANES):
                            k = i * N + m
                            of_mode = shape[k, j] if IS_COPIED else structures.mode_shape[k, shaped[j]]
                            moved[j] += of_mode * x[m, j]
                            felt[j] += of_mode * acceleration[m, j]
                            slot("add_mode_to_floor")
                            velocity[j] += of_mode * x[N + m, j]
                    for j in range(LANES):
                        drift = moved[j]
                        ratio_of_storey[i, j] = drift * inverse_height[i, j]
                        slot("see_drift")
                        position[j] += drift
                        vi = velocity[j]
                        ai = felt[j]
                        restoring = storey_stiffness[i, j] * drift
                        slot("see_forces")
            slot("see_state")
            for r in range(ROWS):
                for j in range(LANES):
                    total[j] = dtype(0.0)
                for c in range(COLUMNS):
                    k = r * COLUMNS + c
                    for j in range(LANES):
                        share = propagator[k, j] if IS_COPIED else structures.propagator[k, pair[j]]
                        total[j] += share * x[c if IS_COUPLED else c * N + r % N, j]
                for c in range(INPUTS):
                    k = 2 * (r * INPUTS + c)
                    for j in range(LANES):
                        at_start = response[k, j] if IS_COPIED else structures.load_response[k, pair[j]]
                        at_end = response[k + 1, j] if IS_COPIED else structures.load_response[k + 1, pair[j]]
                        total[j] += at_start * load_start[c if IS_COUPLED else r % WIDTH, j]
                        total[j] += at_end * load_end[c if IS_COUPLED else r % WIDTH, j]
                for j in range(LANES):
                    dx[r, j] = live[j] * total[j]
            for m in range(N):
                for j in range(LANES):
                    if IS_IMPLICIT:
                        h = live[j] * step[j]
                        curve = h * (dtype(0.5) * x[2 * N + m, j] + beta * dx[m, j])
                        x[m, j] += h * (x[N + m, j] + curve)
                        x[N + m, j] += h * (x[2 * N + m, j] + gamma * dx[m, j])
                        x[2 * N + m, j] += dx[m, j]
                    else:
                        x[m, j] += dx[m, j]
                        x[N + m, j] += dx[N + m, j]
            slot("end_step")
    for j in range(LANES):
        o = samples.order[sample[j]]
        total_of_state = dtype(0.0)
        slot("finish")
        for i in range(N):
            total_of_state += x[i, j] + x[N + i, j]
            slot("finish_storey")
        status = ok
        slot("judge_demand")
        # A sum with an infinite value or NaN is not finite, so one test covers the whole state.
        if not wp.isfinite(total_of_state):
            status = diverged
        output.status[o] = status
        slot("write")
