"""The linear system of the joints of a grid on a GPU, where each thread computes a storey, solved by relaxation.

The joints of a floor are solved exactly together, even and odd floors alternately. A column couples neighbouring floors
by less than half of the stiffness at its ends, so each sweep divides the error by 10 to 20. Sweeps start from
rotations that continue the last three states. They end when the largest change of a rotation, times the largest
stiffness of a joint of the storey, is within the tolerance, or within MOST_MOVE times the tolerance if no hinge
softens.
"""

order = 6

BORROWS = {
    "joint_matrix": ("solved", "joint_load", "joint_stiffness", "is_open"),
    "storey_members": (
        "largest_moment",
        "tie",
        "first_of_frame",
        "open_threads",
        "turn_then",
        "states_found",
        "pace",
    ),
    "shared_warp": ("lowest", "thread_above", "thread_below"),
}

OVER_RELAXATION = 1.05
MOST_SWEEPS = 20
# Largest change of a moment by the last sweep, in tolerances, if no hinge of the storey softens. A column of constant
# section then couples its ends by less than half of their stiffness. A sweep (of both halves of the floors) divides the
# error by more than 4, so that its change is more than 3 times the error left. Columns with rigid offsets have another
# kernel.
MOST_MOVE = 3.0


def wanted(plan):
    return plan.frame_storeys is not None and plan.sections > 1 and plan.frame_storeys.lines > 1


def values_held(plan):
    return 6 * plan.frame_storeys.lines + 3


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.grids.joint_rotations import TOLERANCE
    from warpdyn.engine.kernels.plan import DTYPES

    dtype = DTYPES[plan.dtype]
    return {
        "most_move": wp.constant(dtype(MOST_MOVE * TOLERANCE[plan.dtype])),
        "MEMBER_ENDS": 3 * plan.line_of_thread.members,
        "of_sweep": wp.constant(dtype(OVER_RELAXATION)),
        "MOST_SWEEPS": MOST_SWEEPS,
        "floor_of_joints": wp.types.matrix(shape=(plan.frame_storeys.lines, plan.lanes), dtype=dtype),
    }


def declare():
    inverse_pivot = floor_of_joints()
    eliminated = floor_of_joints()  # share of a joint's moment that the next joint of its floor takes
    coupling_above = floor_of_joints()  # of the joints at both ends of each column of the storey above
    floor_turn = floor_of_joints()
    change_then = floor_of_joints()  # changes of the rotations in the step before the last one
    allowed_move = row()  # change of a moment by the last sweep, relative to the largest moment
    share_of_move = row()
    moved_turn = row()
    largest_move = row()  # largest change of a rotation by the last sweep
    stiffest = row()  # largest stiffness of a joint


def continue_turns():
    # Along a parabola through the last three states.
    for j in range(LANES):
        share_of_move[j] = wp.where(states_found > 2, dtype(pace[j]), dtype(0.0))
    for joint in range(JOINTS):
        for j in range(LANES):
            reached_turn = solved[joint + LINES, j]
            last_change = reached_turn - turn_then[joint, j]
            continued = dtype(2.0) * last_change - change_then[joint, j]
            solved[joint + LINES, j] = reached_turn + share_of_move[j] * continued
            change_then[joint, j] = last_change
            turn_then[joint, j] = reached_turn


def factorise_joints():
    for j in range(LANES):
        allowed_move[j] = most_move
        if not YIELDING_MEMBERS:
            for place in range(MEMBER_ENDS):
                if place % 3 != 1 and tie[place, j] < dtype(0.0):  # a hinge softens
                    allowed_move[j] = balance
        stiffest[j] = wp.abs(joint_stiffness[0, j])  # below 0 if hinges soften
    for q in range(LINES):
        beam = 3 * (LINES + q) + 1
        for j in range(LANES):
            coupling_above[q, j] = from_thread(tie[3 * q + 1, j], thread_above)
            pivot = joint_stiffness[q, j]
            stiffest[j] = larger(stiffest[j], wp.abs(pivot))
            if q > 0:
                pivot -= eliminated[q - 1, j] * tie[beam - 3, j]
            inverse_pivot[q, j] = reciprocal(pivot)
            if q < BEAMS:
                eliminated[q, j] = tie[beam, j] * inverse_pivot[q, j]


def exchange_turns():
    for edge in range(LINES):
        for j in range(LANES):
            solved[edge, j] = from_thread(solved[LINES + edge, j], thread_below)
            solved[2 * LINES + edge, j] = from_thread(solved[LINES + edge, j], thread_above)


def solve_joints():
    sweep = int(0)
    open_threads = int(1)
    for j in range(LANES):
        is_open[j] = pace[j]
    while open_threads > 0 and sweep < MOST_SWEEPS:
        for j in range(LANES):
            largest_move[j] = dtype(0.0)
        for parity in range(2):
            slot("exchange_turns")
            for j in range(LANES):
                # Samples that have finished do not move, so that their bits do not depend on other samples.
                share_of_move[j] = wp.where(lowest % 2 == parity, dtype(is_open[j]) * of_sweep, dtype(0.0))
                moved_turn[j] = dtype(0.0)
            for q in range(LINES):
                for j in range(LANES):
                    load_left = joint_load[q, j] - tie[3 * q + 1, j] * solved[q, j]
                    load_left -= coupling_above[q, j] * solved[2 * LINES + q, j]
                    if q > 0:
                        load_left -= eliminated[q - 1, j] * floor_turn[q - 1, j]
                    floor_turn[q, j] = load_left
            for down in range(LINES):
                q = LINES - 1 - down
                for j in range(LANES):
                    solved_now = floor_turn[q, j] * inverse_pivot[q, j]
                    if q < BEAMS:
                        solved_now -= eliminated[q, j] * floor_turn[q + 1, j]
                    floor_turn[q, j] = solved_now
                    change = solved_now - solved[LINES + q, j]
                    solved[LINES + q, j] += share_of_move[j] * change
                    moved_turn[j] = larger(moved_turn[j], wp.abs(change))
            for j in range(LANES):
                largest_move[j] = larger(largest_move[j], share_of_move[j] * moved_turn[j])
        open_threads = int(0)
        slot("judge_moves")
        for j in range(LANES):
            open_threads += is_open[j]
        open_threads = any_in_warp(open_threads)
        sweep += 1
    slot("exchange_turns")


def judge_moves():
    for j in range(LANES):
        allowed_turn = allowed_move[j] * largest_moment[j]
        still_moves = wp.where(stiffest[j] * largest_move[j] <= allowed_turn, 0, is_open[j])
        is_open[j] = any_of_frame(still_moves, first_of_frame, THREADS)


def find_moments():
    # The largest moment may have grown since the last sweep.
    slot("judge_moves")
