"""The kernel of linear structures advanced by propagators: the exact method, and implicit ones on full matrices.

The state stands in coordinates of the undamped modes; a step adds to it what the propagator makes of it and of the load
(propagators.py). Increments, unlike a propagator near 1, keep their digits in float32. A state is seen at the start of
the step that leaves it, the last one by a step that leads nowhere. Lanes and names in capitals are as in the chain's
kernel.
"""

import functools
import math

import warp as wp

from warpdyn.core.output_variables import COLLAPSED, DIVERGED, OK
from warpdyn.kernels.loads import LOADS, harmonic, sampled
from warpdyn.kernels.noise import noise_of
from warpdyn.kernels.plan import DTYPES, Plan, row_types, structs
from warpdyn.kernels.powers import lost_share, supplied_share
from warpdyn.kernels.recording import add_to_mean, balance_error, keep_force, keep_state, weight_in_mean, worst_storey
from warpdyn.methods.table import METHODS

# Rows of the largest table of which a processor's thread keeps a copy for its lanes (16 in float64: 512 KiB).
LARGEST_COPY = 4096


@functools.cache
def linear_kernel(plan: Plan) -> wp.Kernel:
    """Return the kernel that advances linear structures as the plan says."""
    dtype, types, method = DTYPES[plan.dtype], structs(plan.dtype), METHODS[plan.method]
    N, LANES, load = plan.dofs, plan.lanes, LOADS[plan.load]
    IS_CHAIN, IS_DENSE = plan.family == "chain", plan.family == "dense"
    IS_IMPLICIT, IS_COUPLED = method.kind == "implicit", plan.damping != "classical"
    IS_BASE, IS_HARMONIC, IS_FORCE_HISTORY = load.is_base, load.is_harmonic, load.is_history and not load.is_base
    IS_NOISE, noise = load.noise_states > 0, noise_of(plan)
    IS_RECORD = IS_BASE and not IS_NOISE
    Processes, Numbers, noise_over_interval = noise.Processes, noise.Numbers, noise.over_interval
    IS_SAMPLED, IS_SHARED, IS_LOADED = load.is_history, IS_BASE or IS_HARMONIC, load.is_history or IS_HARMONIC
    DRIFT, TIME, DISPLACEMENT, ACCELERATION, SHEAR, RESIDUAL, ENERGY, HISTORY = (
        name in plan.recorders
        for name in (
            "drift",
            "time_of_peak",
            "displacement",
            "acceleration",
            "base_shear",
            "residual",
            "energy",
            "history",
        )
    )
    FEELS = ACCELERATION or HISTORY
    MOVES, RATIO = DRIFT or TIME or DISPLACEMENT or SHEAR or RESIDUAL or HISTORY, TIME or RESIDUAL
    OBSERVES, NEEDS_FORCES = FEELS or ENERGY, FEELS or ENERGY or IS_IMPLICIT
    SEES, SEEN = MOVES or FEELS, 1 if set(plan.recorders) <= {"base_shear", "energy"} else N  # storeys
    PARTNERS = N if IS_COUPLED else 1
    # The state is (q, q'), of an implicit method (q, q', q'') with increments of q'' alone; they depend on the states
    # and loads of all modes where these are coupled, else of their own.
    STATES, ROWS = (3 * N, N) if IS_IMPLICIT else (2 * N, 2 * N)
    COLUMNS, WIDTH = (STATES if IS_COUPLED else 2), (N if IS_FORCE_HISTORY else 1)
    INPUTS = 0 if not IS_LOADED else WIDTH if IS_COUPLED else 1
    # Tables are copied to a processor's nearest memory, or to a GPU's registers, where they fit; else read in place.
    largest = max(ROWS * COLUMNS, 2 * ROWS * INPUTS, N * N)
    IS_COPIED = largest <= (LARGEST_COPY if LANES > 1 else plan.max_unroll)
    # Beside its sine, a harmonic load is told to the exact method by its cosine, to others by its sine a step later.
    quarter_turn = wp.constant(wp.float64(math.pi / 2))
    lead = wp.constant(wp.float64(0 if IS_IMPLICIT else math.pi / 2))
    later = wp.constant(wp.float64(1 if IS_IMPLICIT else 0))
    beta = wp.constant(dtype(method.beta if IS_IMPLICIT else 0.0))
    gamma = wp.constant(dtype(method.gamma if IS_IMPLICIT else 0.0))

    def table(rows: int, is_kept: bool = True) -> type:
        return wp.types.matrix(shape=(max(1, rows) if is_kept else 1, LANES), dtype=dtype)

    matrix, states, inputs = table(N), table(STATES), table(WIDTH)
    of_states, of_inputs = table(ROWS * COLUMNS, IS_COPIED), table(2 * ROWS * INPUTS, IS_COPIED)
    of_shapes = table(N * N, IS_COPIED and SEES)
    of_damping = table(N * N if IS_COUPLED else N, IS_COPIED and NEEDS_FORCES)
    row, _, indices = row_types(plan)
    ok, collapsed, diverged = wp.int8(OK), wp.int8(COLLAPSED), wp.int8(DIVERGED)

    @wp.kernel(module="unique", enable_backward=False, module_options={"max_unroll": plan.max_unroll})
    def advance_linear(
        first_block: int,
        control: types.Control,
        samples: types.Samples,
        structures: types.Structure,
        loads: types.Load,
        output: types.Output,
        history: types.History,
    ):
        block = first_block + wp.tid()
        count = control.samples
        substeps = control.substeps
        every = control.every
        inverse_substeps = dtype(1.0) / dtype(substeps)
        frequency = wp.float64(0.0)
        phase = wp.float64(0.0)
        if IS_HARMONIC:
            frequency = loads.circular_frequency[0]
            phase = loads.phase[0]
        sample = indices()
        pair = indices()
        shaped = indices()  # column of the shapes: linear systems have one set, scaled by their modal mass
        motion = indices()
        live_intervals = indices()
        scale = row()
        step = row()
        seen = row()  # 1 at a state that a lane has come to, else 0
        modal_mass = row()
        first_stiffness = row()
        inverse_height = matrix()
        propagator = of_states()
        response = of_inputs()
        shape = of_shapes()
        damping = of_damping()
        stiffness = matrix()
        modal_load = matrix()
        x = states()
        intervals = int(0)
        residual_start = int(2147483647)
        for j in range(LANES):
            # Lanes past the last sample repeat it: they write the same values again.
            sample[j] = wp.min(block * LANES + j, count - 1)
            s = samples.structure[sample[j]]
            pair[j] = s
            if IS_CHAIN:
                shaped[j] = s
            motion[j] = samples.motion[sample[j]]
            live_intervals[j] = samples.run_intervals[sample[j]]
            intervals = wp.max(intervals, live_intervals[j])
            residual_start = wp.min(residual_start, live_intervals[j] * substeps - samples.residual_steps[sample[j]])
            scale[j] = samples.scale[sample[j]]
            step[j] = samples.step[sample[j]]
            seen[j] = dtype(1.0)
            modal_mass[j] = structures.modal_mass[s]
            if SHEAR:
                first_stiffness[j] = structures.coefficients[0, s]
        for m in range(N):
            for j in range(LANES):
                x[m, j] = structures.initial_state[m, pair[j]]
                x[N + m, j] = structures.initial_state[N + m, pair[j]]
                if RATIO:
                    inverse_height[m, j] = structures.inverse_height[m, pair[j]]
                if NEEDS_FORCES:
                    stiffness[m, j] = structures.modal_stiffness[m, pair[j]]
                    if IS_SHARED:
                        modal_load[m, j] = structures.modal_load[m, pair[j]]
        if IS_COPIED:
            for k in range(ROWS * COLUMNS):
                for j in range(LANES):
                    propagator[k, j] = structures.propagator[k, pair[j]]
            for k in range(2 * ROWS * INPUTS):
                for j in range(LANES):
                    response[k, j] = structures.load_response[k, pair[j]]
            if SEES:
                for k in range(N * N):
                    for j in range(LANES):
                        shape[k, j] = structures.mode_shape[k, shaped[j]]
            if NEEDS_FORCES:
                for k in range(N * PARTNERS):
                    for j in range(LANES):
                        damping[k, j] = structures.modal_damping[k, pair[j]]

        live = row()  # 1 in a step that a lane takes, else 0
        behind = row()  # the step that led to this state
        begin = inputs()  # of the interval: the sampled loads, and their change over it
        change = inputs()
        load_start = inputs()  # of the step: the load at its ends, or sine and cosine at its start
        load_end = inputs()
        rise = inputs()  # what the load would gain over this step, and the last one, at its rate at this state
        last_rise = inputs()
        last_load = inputs()  # what the last step had the load at this state
        force = row()
        force_change = row()
        total = row()
        dx = states()
        acceleration = matrix()
        ratio = matrix()
        moved = row()
        position = row()
        velocity = row()
        felt = row()
        peak = matrix()
        time_of_peak = matrix()
        worst_ratio = row()
        worst_time = row()
        peak_acceleration = matrix()
        peak_shear = row()
        energy_in = row()
        energy_viscous = row()
        initial_energy = row()
        supplied = row()
        if ENERGY:
            for m in range(N):
                for j in range(LANES):
                    swing = x[N + m, j] * x[N + m, j] + stiffness[m, j] * x[m, j] * x[m, j]
                    initial_energy[j] += dtype(0.5) * modal_mass[j] * swing
        if IS_NOISE:
            processes = Processes()
            number = Numbers()
            for j in range(LANES):
                number[j] = samples.number[sample[j]]
        # One interval more than the longest run: its first step sees the last state.
        for interval in range(intervals + 1):
            if IS_NOISE:
                value, gain, processes = noise_over_interval(
                    loads, control.key, number, interval, live_intervals, scale, processes
                )
                for j in range(LANES):
                    begin[0, j] = value[j]
                    change[0, j] = gain[j]
            for j in range(LANES):
                live[j] = dtype(0.0)
                if interval < live_intervals[j]:
                    live[j] = dtype(1.0)
                if IS_RECORD:
                    value, gain = sampled(loads, motion[j], interval, live_intervals[j], 1, 0, scale[j])
                    begin[0, j] = value
                    change[0, j] = gain
            if IS_FORCE_HISTORY:
                for m in range(N):
                    for j in range(LANES):
                        begin[m, j] = dtype(0.0)
                        change[m, j] = dtype(0.0)
                for i in range(N):
                    for j in range(LANES):
                        value, gain = sampled(loads, motion[j], interval, live_intervals[j], N, i, scale[j])
                        force[j] = value
                        force_change[j] = gain
                    for m in range(N):
                        for j in range(LANES):
                            share = structures.modal_load[i * N + m, pair[j]]
                            begin[m, j] += share * force[j]
                            change[m, j] += share * force_change[j]
            for substep in range(substeps):
                index = interval * substeps + substep
                if IS_HARMONIC:
                    for j in range(LANES):
                        here = wp.float64(index)
                        load_start[0, j] = scale[j] * harmonic(here, step[j], frequency, phase)
                        load_end[0, j] = scale[j] * harmonic(here + later, step[j], frequency, phase + lead)
                        if ENERGY:
                            last_load[0, j] = load_start[0, j]
                            cosine = harmonic(here, step[j], frequency, phase + quarter_turn)
                            rise[0, j] = scale[j] * cosine * dtype(frequency) * step[j]
                            last_rise[0, j] = rise[0, j]
                if IS_SAMPLED:
                    for k in range(WIDTH):
                        for j in range(LANES):
                            load_start[k, j] = begin[k, j] + dtype(substep) * inverse_substeps * change[k, j]
                            load_end[k, j] = begin[k, j] + dtype(substep + 1) * inverse_substeps * change[k, j]
                            rise[k, j] = inverse_substeps * change[k, j]
                if NEEDS_FORCES:
                    if OBSERVES or index == 0:
                        for m in range(N):
                            for j in range(LANES):
                                total[j] = dtype(0.0)
                            for c in range(PARTNERS):
                                for j in range(LANES):
                                    k = m * PARTNERS + c
                                    share = damping[k, j] if IS_COPIED else structures.modal_damping[k, pair[j]]
                                    total[j] += share * x[N + c if IS_COUPLED else N + m, j]
                            for j in range(LANES):
                                # Springs and dampers alone: the absolute acceleration, but for nodal forces.
                                inner = -total[j] - stiffness[m, j] * x[m, j]
                                driven = dtype(0.0)
                                if IS_SHARED:
                                    driven = modal_load[m, j] * load_start[0, j]
                                if IS_FORCE_HISTORY:
                                    driven = load_start[m, j]
                                if FEELS:
                                    acceleration[m, j] = inner if IS_BASE else inner + driven
                                if IS_IMPLICIT:
                                    if index == 0:
                                        x[2 * N + m, j] = inner + driven
                                if ENERGY:
                                    speed = x[N + m, j]
                                    ahead = live[j] * step[j]
                                    before = dtype(0.0)
                                    if IS_LOADED:
                                        share = modal_load[m, j] if IS_SHARED else dtype(1.0)
                                        before = share * last_load[m % WIDTH, j]
                                        was = share * last_rise[m % WIDTH, j]
                                        will = share * rise[m % WIDTH, j]
                                        work = supplied_share(behind[j], ahead, before, driven, was, will, speed, inner)
                                        energy_in[j] += modal_mass[j] * work
                                    loss = lost_share(behind[j], ahead, before, driven, speed, inner, total[j])
                                    energy_viscous[j] += modal_mass[j] * loss
                        if ENERGY:
                            for j in range(LANES):
                                supplied[j] = wp.max(supplied[j], wp.abs(initial_energy[j] + energy_in[j]))
                if SEES:
                    for i in range(SEEN):
                        for j in range(LANES):
                            moved[j] = dtype(0.0)
                            # What floors do is summed up from the ground over a chain's storeys.
                            if i == 0 or IS_DENSE:
                                position[j] = dtype(0.0)
                                velocity[j] = dtype(0.0)
                                felt[j] = dtype(0.0)
                        for m in range(N):
                            for j in range(LANES):
                                k = i * N + m
                                share = shape[k, j] if IS_COPIED else structures.mode_shape[k, shaped[j]]
                                if MOVES:
                                    moved[j] += share * x[m, j]
                                if FEELS:
                                    felt[j] += share * acceleration[m, j]
                                if HISTORY:
                                    velocity[j] += share * x[N + m, j]
                        for j in range(LANES):
                            size = wp.abs(moved[j])
                            if DRIFT:
                                peak[i, j] = wp.max(peak[i, j], size)
                            if TIME:
                                if size * inverse_height[i, j] > worst_ratio[j]:
                                    worst_ratio[j] = size * inverse_height[i, j]
                                    worst_time[j] = dtype(index) * step[j]
                            if DISPLACEMENT:
                                if size > peak[i, j]:
                                    peak[i, j] = size
                                    time_of_peak[i, j] = dtype(index) * step[j]
                            if ACCELERATION:
                                peak_acceleration[i, j] = wp.max(peak_acceleration[i, j], wp.abs(felt[j]) * seen[j])
                            if SHEAR:
                                if i == 0:
                                    peak_shear[j] = wp.max(peak_shear[j], first_stiffness[j] * size)
                            if RESIDUAL:
                                ratio[i, j] = moved[j] * inverse_height[i, j]
                            if HISTORY:
                                kept = samples.output[sample[j]]
                                position[j] += moved[j]
                                keep_state(history, kept, index, every, i, position[j], velocity[j], felt[j])
                                if IS_CHAIN:
                                    restoring = structures.coefficients[i, pair[j]] * moved[j]
                                    keep_force(history, kept, index, every, i, restoring)
                if RESIDUAL:
                    if index > residual_start:
                        for j in range(LANES):
                            steps = samples.residual_steps[sample[j]]
                            since = index - 1 - (live_intervals[j] * substeps - steps)
                            # A lane that repeats the last sample must not add to its mean again.
                            if since >= 0 and since < steps and block * LANES + j < count:
                                kept = samples.output[sample[j]]
                                share = weight_in_mean(step[j], since, steps)
                                for i in range(N):
                                    add_to_mean(output.residual_drift_ratio, i, kept, share * ratio[i, j], since)
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
                            first = response[k, j] if IS_COPIED else structures.load_response[k, pair[j]]
                            second = response[k + 1, j] if IS_COPIED else structures.load_response[k + 1, pair[j]]
                            total[j] += first * load_start[c if IS_COUPLED else r % WIDTH, j]
                            total[j] += second * load_end[c if IS_COUPLED else r % WIDTH, j]
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
                if IS_SAMPLED:
                    for k in range(WIDTH):
                        for j in range(LANES):
                            last_load[k, j] = load_end[k, j]
                            last_rise[k, j] = rise[k, j]
                for j in range(LANES):
                    seen[j] = live[j]
                    behind[j] = live[j] * step[j]

        for j in range(LANES):
            o = samples.output[sample[j]]
            finite = dtype(0.0)
            stored = dtype(0.0)
            for m in range(N):
                finite += x[m, j] + x[N + m, j]
                if ENERGY:
                    swing = x[N + m, j] * x[N + m, j] + stiffness[m, j] * x[m, j] * x[m, j]
                    stored += dtype(0.5) * modal_mass[j] * swing
                    if IS_CHAIN:
                        output.hysteretic_energy[m, o] = dtype(0.0)  # elastic storeys give back all they take
                if DRIFT:
                    output.peak_storey_drift[m, o] = peak[m, j]
                if DISPLACEMENT:
                    output.peak_displacement[m, o] = peak[m, j]
                    output.time_of_peak_displacement[m, o] = time_of_peak[m, j]
                if ACCELERATION:
                    if IS_CHAIN:
                        output.peak_floor_acceleration[m, o] = peak_acceleration[m, j]
                    else:
                        output.peak_acceleration[m, o] = peak_acceleration[m, j]
            status = ok
            if TIME:
                output.time_of_peak_drift[o] = worst_time[j]
            if DRIFT:
                largest = worst_storey(output, structures, o, pair[j], N)
                if largest > control.collapse_drift_ratio:
                    status = collapsed
            # Infinities and NaN never leave a sum: a finite one clears the whole state.
            if not wp.isfinite(finite):
                status = diverged
            output.status[o] = status
            if SHEAR:
                output.peak_base_shear[o] = peak_shear[j]
            if ENERGY:
                output.input_energy[o] = energy_in[j]
                output.viscous_energy[o] = energy_viscous[j]
                error = initial_energy[j] + energy_in[j] - energy_viscous[j] - stored
                output.energy_balance_error[o] = balance_error(error, wp.max(supplied[j], initial_energy[j]))

    return advance_linear
