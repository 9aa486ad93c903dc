"""Multistep methods for lumped structures: one evaluation of the forces per step.

The unknowns are the displacements u and their changes per step, the moves. With A, the step squared times the
acceleration, a step is w1 = w + A and u1 = u + w1 + correction (A - A of the last step). `path` is u without the
correction. As for chains (stepping/half_steps.py), mass-proportional damping acts on the mean of the moves before and
after a state, and the first step needs the moves before the start: they are computed for the initial velocity, the
acceleration that the first step finds, and the rate of the acceleration that the second step finds.

Dashpots of springs need the velocity at the end of the step, which is extrapolated from the moves.
"""

from warpdyn.engine.kernels.plan import keeps_drifts

order = 10
BORROWS = {"mass": ("mass_damping",)}


def wanted(plan):
    return keeps_drifts(plan) and plan.family == "lumped"


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES
    from warpdyn.engine.methods.table import METHODS

    dtype, method = DTYPES[plan.dtype], METHODS[plan.method]
    latest, before, earlier = method.velocity
    return {
        "CORRECTS": method.correction != 0,
        "correction": wp.constant(dtype(method.correction)),
        "weight_of_last": wp.constant(dtype(latest)),
        "weight_of_second": wp.constant(dtype(before)),
        "weight_of_third": wp.constant(dtype(earlier)),
        "inverse_weight": wp.constant(dtype(1 / (earlier or before))),
        # The only stage is at the accepted state.
        "us": "u",
        "vs": "v",
    }


def declare():
    path = matrix()  # displacements without the correction
    moves = matrix()  # changes of the path in the last step
    carried = matrix()  # share of the last two moves in the velocity at the end of the next step
    unit = row()  # h^2 / (1 + a0 h / 2)
    retained = row()  # (1 - a0 h / 2) / (1 + a0 h / 2)
    of_last = row()  # weights of the moves in the velocity [1/s]
    of_second = row()
    of_third = row()
    followed_deformation = spring_rows()  # to which the memory of rate laws has followed
    resting = int(0)  # whether a lane has finished; its state must not change
    rested_u = matrix()
    rested_v = matrix()


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
            path[i, j] = u[i, j]
            moves[i, j] = step[j] * v[i, j]
            carried[i, j] = (of_second[j] + of_third[j]) * moves[i, j]
    if IS_RATE:
        for i in range(SPRINGS):
            for j in range(LANES):
                followed_deformation[i, j] = deformation[i, j]


def begin_step():
    if LANES > 1:
        resting = int(0)
        for j in range(LANES):
            resting += wp.where(h[j] > dtype(0.0), 0, 1)
        if resting > 0:
            for i in range(N):
                for j in range(LANES):
                    rested_u[i, j] = u[i, j]
                    rested_v[i, j] = v[i, j]


def memory_of_stage():
    slot("accepted_memory")
    if IS_RATE:  # the midpoint rule along the change of the deformation
        turned = drift - followed_deformation[i, j]
        slope = rate_of(turned, memory, c)
        midway = memory_vector(memory[0] + dtype(0.5) * slope[0])
        for m in range(1, M):
            midway[m] = memory[m] + dtype(0.5) * slope[m]
        slope_after = rate_of(turned, midway, c)
        for m in range(M):
            memory[m] = memory[m] + slope_after[m]
            z[i * M + m, j] = memory[m]
        followed_deformation[i, j] = drift


def end_stage():
    if LANES > 1 or h[0] > dtype(0.0):
        for i in range(N):
            for j in range(LANES):
                slot("move_storey", moved_storey=i)


def move_storey():
    pull = unit[j] * (felt[moved_storey, j] - shaken[moved_storey, j])
    forward = retained[j] * moves[moved_storey, j] + pull if MASS else moves[moved_storey, j] + pull
    if CORRECTS:
        path[moved_storey, j] += forward
        u[moved_storey, j] = path[moved_storey, j] + correction * pull
        v[moved_storey, j] = of_last[j] * forward + carried[moved_storey, j]
        # The moves of two steps are kept in one value, which saves a copy of each move.
        carried[moved_storey, j] = of_second[j] * forward + of_third[j] * moves[moved_storey, j]
    else:
        u[moved_storey, j] += forward
        v[moved_storey, j] = of_last[j] * forward + of_second[j] * moves[moved_storey, j]
    moves[moved_storey, j] = forward


def end_attempt():
    if index < 2:
        if index == 0:
            slot("correct_start")
        elif CORRECTS:
            slot("correct_second_step")
    if LANES > 1:
        if resting > 0:
            for i in range(N):
                for j in range(LANES):
                    if h[j] == dtype(0.0):
                        u[i, j] = rested_u[i, j]
                        v[i, j] = rested_v[i, j]


def correct_start():
    # Until now, the moves before the start were computed for a constant velocity; now, for a constant acceleration.
    for i in range(N):
        for j in range(LANES):
            if CORRECTS:
                start_move = (carried[i, j] - of_second[j] * moves[i, j]) * (step[j] * inverse_weight)
            else:
                start_move = (v[i, j] - of_last[j] * moves[i, j]) * (step[j] * inverse_weight)
            pull = moves[i, j] - retained[j] * start_move
            # The whole change of the velocity; (1 + retained) / 2 = 1 / (1 + a0 h / 2).
            gain_of_move = dtype(2.0) * (pull + (retained[j] - dtype(1.0)) * start_move) / (dtype(1.0) + retained[j])
            change_of_path = start_move + dtype(0.5) * gain_of_move - moves[i, j]
            moves[i, j] = start_move + dtype(0.5) * gain_of_move
            move_before = start_move - dtype(0.5) * gain_of_move
            v[i, j] = of_last[j] * moves[i, j] + of_second[j] * move_before
            if CORRECTS:
                path[i, j] += change_of_path - correction * pull
                u[i, j] = path[i, j] + correction * pull
                v[i, j] += of_third[j] * (start_move - dtype(1.5) * gain_of_move)
                carried[i, j] = of_second[j] * moves[i, j] + of_third[j] * move_before
            else:
                u[i, j] += change_of_path


def correct_second_step():
    # From the second step on, the rate of the acceleration is known: `jerk` is its change per step.
    for i in range(N):
        for j in range(LANES):
            move_before = (carried[i, j] - of_second[j] * moves[i, j]) * (step[j] * inverse_weight)
            of_two = of_last[j] * moves[i, j] + of_second[j] * move_before
            earliest = (v[i, j] - of_two) * (step[j] * inverse_weight)
            jerk = moves[i, j] - dtype(2.0) * move_before + earliest
            moves[i, j] += correction * jerk
            carried[i, j] += correction * jerk * (of_second[j] + of_third[j])
            v[i, j] += correction * jerk * (of_last[j] + of_second[j] + of_third[j])
            path[i, j] += dtype(3.0) * correction * jerk
            u[i, j] += dtype(3.0) * correction * jerk
