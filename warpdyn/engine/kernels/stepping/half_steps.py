"""Multistep methods: one evaluation of the forces per step; the unknowns are storey drifts and their changes per step.

The acceleration of a drift is the difference of the accelerations of two floors, so that nothing is summed up over the
storeys. Mass-proportional damping acts on the mean of the changes before and after a state. Therefore damping needs no
additional evaluation of forces: w1 (1 + a0 h / 2) = w (1 - a0 h / 2) + A, where w and w1 are the changes of the drift
before and after the state, a0 is the mass factor of the damping, h the step, and A the change by the other
accelerations.

The first step needs the changes of the drifts in the steps before the start. They are computed for a motion with the
initial velocity, the acceleration that the first step finds, and the rate of the acceleration that the second step
finds.
"""

from warpdyn.engine.kernels.plan import keeps_drifts

order = 1
BORROWS = {"mass": ("mass_damping",), "base": ("base",)}


def wanted(plan):
    return keeps_drifts(plan) and plan.family == "chain"


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES
    from warpdyn.engine.methods.table import METHODS

    dtype, method = DTYPES[plan.dtype], METHODS[plan.method]
    latest, before, earlier = method.velocity
    # Velocities and displacements of the floors, sums over the storeys, are not needed for these recorders.
    without_velocities = {"drift", "residual", "time_of_peak", "base_shear"}
    without_displacements = without_velocities | {"acceleration", "energy", "floor_spectra"}
    return {
        # Inverse masses are multiplied by h^2 if no recorder needs accelerations.
        "SCALES": "not HAS_SEE_FORCES",
        "FLOOR_VELOCITIES": plan.damping == "modal" or not set(plan.recorders) <= without_velocities,
        "FLOOR_DISPLACEMENTS": not set(plan.recorders) <= without_displacements,
        "correction": wp.constant(dtype(method.correction)),
        "weight_of_last": wp.constant(dtype(latest)),
        "weight_of_second": wp.constant(dtype(before)),
        "weight_of_third": wp.constant(dtype(earlier)),
        "inverse_weight_of_third": wp.constant(dtype(1 / earlier)),
    }


def declare():
    drifts = matrix()  # drifts in the accepted state [m]
    rates = matrix()  # drift velocities in the accepted state [m/s]
    path = matrix()  # drifts without the correction
    moves = matrix()  # changes of the path in the last step
    carried = matrix()  # share of the last two changes in the rate at the end of the next step
    turns = matrix()  # change of the drift in the last step, which the memory of rate laws has not followed yet
    unit = row()  # h^2 / (1 + a0 h / 2)
    retained = row()  # (1 - a0 h / 2) / (1 + a0 h / 2)
    of_last = row()  # weights of the changes in the rate [1/s]
    of_second = row()
    of_third = row()
    here = row()  # acceleration of the floor above the present storey, and of the floor above that
    upper = row()
    top = row()
    lower = row()  # of the floor below
    foot = row()
    resting = int(0)  # whether a lane has finished; its state must not change
    rested_drifts = matrix()
    rested_rates = matrix()


def start_storey():
    drifts[i, j] = u[i, j]
    rates[i, j] = v[i, j]
    if i > 0:
        drifts[i, j] -= u[i - 1, j]
        rates[i, j] -= v[i - 1, j]
    elif SECTIONS:
        drifts[i, j] -= foot_u[j]
        rates[i, j] -= foot_v[j]
    path[i, j] = drifts[i, j]
    moves[i, j] = step[j] * rates[i, j]


def start():
    for j in range(LANES):
        half = dtype(0.0)
        if MASS:
            half = dtype(0.5) * mass_damping[j] * step[j]
        unit[j] = step[j] * step[j] / (dtype(1.0) + half)
        retained[j] = (dtype(1.0) - half) / (dtype(1.0) + half)
        of_last[j] = weight_of_last / step[j]
        of_second[j] = weight_of_second / step[j]
        of_third[j] = weight_of_third / step[j]
        for i in range(N):
            carried[i, j] = (of_second[j] + of_third[j]) * moves[i, j]
            if SCALES:
                inverse_mass[i, j] = inverse_mass[i, j] * unit[j]


def change_lanes():
    slot("count_resting")


def count_resting():
    resting = int(0)
    for j in range(LANES):
        resting += wp.where(h[j] > dtype(0.0), 0, 1)


def begin_attempt():
    if LANES > 1:
        if not HOLDS_LANES:
            slot("count_resting")
        if resting > 0:
            for i in range(N):
                for j in range(LANES):
                    rested_drifts[i, j] = drifts[i, j]
                    rested_rates[i, j] = rates[i, j]


def state_of_stage():
    drift = drifts[i, j]
    rate = rates[i, j]
    vi = v[i, j]


def follow_turn():
    if IS_RATE:  # the midpoint rule along the drift
        slope = rate_of(turns[i, j], memory, c)
        midway = memory_vector(memory[0] + dtype(0.5) * slope[0])
        for m in range(1, M):
            midway[m] = memory[m] + dtype(0.5) * slope[m]
        slope_after = rate_of(turns[i, j], midway, c)
        for m in range(M):
            memory[m] = memory[m] + slope_after[m]


def memory_of_stage():
    slot("accepted_memory")
    slot("follow_turn")
    if IS_RATE:
        for m in range(M):
            z[i * M + m, j] = memory[m]


def keep_acceleration():
    here[j] = ai
    if SECTIONS and i == N - 1:
        top[j] = ai


def after_storey():
    """Move the storey above: the accelerations of both of its floors are known now."""
    if i < N - 1:
        for j in range(LANES):
            moved_storey = i + 1
            lower[j] = here[j]
            slot("move_storey")
    for j in range(LANES):
        upper[j] = here[j]


def end_stage():
    for j in range(LANES):
        foot[j] = dtype(0.0)
        if BASE:  # the floors move relative to the ground
            foot[j] = base[j] * unit[j] if SCALES else base[j]
        if SECTIONS:
            neighbour = below(top[j], section, THREADS)
            if section > 0:
                foot[j] = neighbour
    for j in range(LANES):
        moved_storey = int(0)
        lower[j] = foot[j]
        slot("move_storey")


def move_storey():
    if LANES > 1 or HOLDS_STEP or h[0] > dtype(0.0):
        pull = upper[j] - lower[j] if SCALES else unit[j] * (upper[j] - lower[j])
        forward = retained[j] * moves[moved_storey, j] + pull if MASS else moves[moved_storey, j] + pull
        path[moved_storey, j] += forward
        new_drift = path[moved_storey, j] + correction * pull
        rates[moved_storey, j] = of_last[j] * forward + carried[moved_storey, j]
        # The changes of two steps are kept in one value, which saves a copy of each change.
        carried[moved_storey, j] = of_second[j] * forward + of_third[j] * moves[moved_storey, j]
        moves[moved_storey, j] = forward
        turns[moved_storey, j] = new_drift - drifts[moved_storey, j]
        drifts[moved_storey, j] = new_drift
    elif IS_RATE:
        # The run has ended, but threads that share the other samples of a warp, and the last evaluation, go on.
        turns[moved_storey, j] = dtype(0.0)


def end_attempt():
    if not (HOLDS_STEP and UNDIVIDED):
        if index == 0:
            slot("correct_start")
        if index == 1:
            slot("correct_second_step")
    if LANES > 1:
        if resting > 0:
            for i in range(N):
                for j in range(LANES):
                    if h[j] == dtype(0.0):
                        drifts[i, j] = rested_drifts[i, j]
                        rates[i, j] = rested_rates[i, j]
                        turns[i, j] = dtype(0.0)
    if HAS_PADS:
        for i in range(N):
            for j in range(LANES):
                if lowest + i >= STOREYS:
                    drifts[i, j] = dtype(0.0)
                    rates[i, j] = dtype(0.0)
                    turns[i, j] = dtype(0.0)
    if FLOOR_VELOCITIES:
        for i in range(N):
            for j in range(LANES):
                v[i, j] = rates[i, j]
                if i > 0:
                    v[i, j] += v[i - 1, j]
                if FLOOR_DISPLACEMENTS:
                    u[i, j] = drifts[i, j]
                    if i > 0:
                        u[i, j] += u[i - 1, j]
        if SECTIONS:
            for j in range(LANES):
                below_u = dtype(0.0)
                below_v = dtype(0.0)
                for q in range(THREADS):
                    if FLOOR_DISPLACEMENTS:
                        below_u = below(below_u + u[N - 1, j], section, THREADS)
                    below_v = below(below_v + v[N - 1, j], section, THREADS)
                for i in range(N):
                    if FLOOR_DISPLACEMENTS:
                        u[i, j] += below_u
                    v[i, j] += below_v


def begin_phase():
    if HOLDS_STEP and UNDIVIDED:  # the first two phases have one step
        if interval_from < 2:
            interval_until = wp.min(interval_until, interval_from + 1)
        if interval_from == 1:
            slot("correct_start")
        if interval_from == 2:
            slot("correct_second_step")


def end_steps():
    if UNDIVIDED:
        if intervals == 1:
            slot("correct_start")
        if intervals == 2:
            slot("correct_second_step")


def correct_start():
    # Until now, the changes before the start were computed for a constant velocity; now, for a constant acceleration.
    for i in range(N):
        for j in range(LANES):
            start_move = (carried[i, j] - of_second[j] * moves[i, j]) * (step[j] * inverse_weight_of_third)
            pull = moves[i, j] - retained[j] * start_move
            # The whole change of the velocity; (1 + retained) / 2 = 1 / (1 + a0 h / 2).
            gain_of_move = dtype(2.0) * (pull + (retained[j] - dtype(1.0)) * start_move) / (dtype(1.0) + retained[j])
            path[i, j] += start_move + dtype(0.5) * gain_of_move - moves[i, j] - correction * pull
            moves[i, j] = start_move + dtype(0.5) * gain_of_move
            move_before = start_move - dtype(0.5) * gain_of_move
            rate_of_two = of_last[j] * moves[i, j] + of_second[j] * move_before
            rates[i, j] = rate_of_two + of_third[j] * (start_move - dtype(1.5) * gain_of_move)
            carried[i, j] = of_second[j] * moves[i, j] + of_third[j] * move_before
            start_drift = drifts[i, j] - turns[i, j]
            drifts[i, j] = path[i, j] + correction * pull
            turns[i, j] = drifts[i, j] - start_drift


def correct_second_step():
    # From the second step on, the rate of the acceleration is known: `jerk` is its change per step.
    for i in range(N):
        for j in range(LANES):
            move_before = (carried[i, j] - of_second[j] * moves[i, j]) * (step[j] * inverse_weight_of_third)
            of_two = of_last[j] * moves[i, j] + of_second[j] * move_before
            earliest = (rates[i, j] - of_two) * (step[j] * inverse_weight_of_third)
            jerk = moves[i, j] - dtype(2.0) * move_before + earliest
            moves[i, j] += correction * jerk
            carried[i, j] += correction * jerk * (of_second[j] + of_third[j])
            rates[i, j] += correction * jerk * (of_last[j] + of_second[j] + of_third[j])
            path[i, j] += dtype(3.0) * correction * jerk
            drifts[i, j] += dtype(3.0) * correction * jerk
            turns[i, j] += dtype(3.0) * correction * jerk


def finish():
    if HAS_FINISH_DRIFT or EVENTS:  # the memory has not followed the last step
        for i in range(N):
            slot("accepted_drift")
            slot("storey_coefficients")
            slot("memory_of_stage")
            if IS_MAPPING:
                memory = mapped_memory(drift, memory, c)
                for m in range(M):
                    z[i * M + m, j] = memory[m]


def add_to_total():
    total += drifts[i, j] + rates[i, j]
