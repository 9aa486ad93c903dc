"""The search for rotations of a frame whose first solution does not balance all moments.

Newton's method ends only if all moments balance. Three guards keep it safe: a rotation changes by at most MOST_TURN in
an iteration; a step beyond the minimum of energy along its direction is shortened (false position); and if
NEWTON_SOLUTIONS were not sufficient, the search starts again from the rotations before the search, with the initial
stiffness of all hinges, over-relaxed, which is the fixed-point iteration on plastic rotations. A sample without a
solution has the status not_converged.
"""

from warpdyn.engine.kernels.hinges.column_storeys import seeks_hinges

order = 5

BORROWS = {
    "massless_rotations": (
        "turn",
        "push",
        "unbalanced",
        "largest_turn",
        "largest_moment",
        "worst_balance",
        "energy_slope",
        "has_begun",
        "factorises",
    ),
}

MOST_TURN = 0.02  # rad
NEWTON_SOLUTIONS = 15
OVER_RELAXATION = 1.7
MOST_MOMENT = 1e30  # a larger unbalanced moment, or NaN, ends the search: the sample diverges

FIELDS = {"Output": {"spring_without_equilibrium": "int32[]"}}


def wanted(plan):
    return seeks_hinges(plan)


def values_held(plan):
    return 2 * plan.pattern.line.rows + 7


def names(plan):
    import warp as wp

    from warpdyn.engine.device.warp_exchange import number_at
    from warpdyn.engine.kernels.plan import DTYPES

    dtype, line = DTYPES[plan.dtype], plan.pattern.line
    return {
        "most_turn": wp.constant(dtype(MOST_TURN)),
        "over_relaxation": wp.constant(dtype(OVER_RELAXATION)),
        "most_moment": wp.constant(dtype(MOST_MOMENT)),
        "NEWTON_SOLUTIONS": NEWTON_SOLUTIONS,
        "spring_of_turn": number_at(line.springs_of_rows),
    }


def declare():
    turn_then = turn_rows()  # before the search
    turn_change = turn_rows()  # direction of the last correction
    pace = indices()  # of a lane's search: 0 finished, 1 Newton's method, 2 shortens the last correction, 3 fallback
    start_slope = row()  # unbalanced moments times the last correction: at its start, at the present point,
    slope_at_start = row()  # of all threads that share the sample
    present_slope = row()
    slope_near = row()  # and at the two points around the minimum
    slope_far = row()
    near_end = row()  # shares of the correction at these points
    far_end = row()
    present_share = row()
    moved_share = row()
    # 1 + the hinge (or the storey of the joint) at the largest unbalanced moment in the first state without equilibrium
    unsolved = indices()


def tilt_columns():
    for j in range(LANES):
        pace[j] = wp.where(unsolved[j] > 0, 0, 1)


def turn_all():
    for j in range(LANES):
        present_share[j] = wp.where(largest_turn[j] > most_turn, most_turn / largest_turn[j], dtype(1.0))
        # A lane that has finished does not move.
        moved_share[j] = wp.where(h[j] > dtype(0.0), present_share[j], dtype(0.0))
        start_slope[j] = energy_slope[j]
    for k in range(ROTATIONS):
        for j in range(LANES):
            turn[k, j] += moved_share[j] * push[k, j]


def turn_searching():
    for j in range(LANES):
        is_new = pace[j] == 1 or pace[j] == 3
        start_slope[j] = updated(is_new, energy_slope[j], start_slope[j])
        full_share = wp.where(pace[j] == 3, over_relaxation, dtype(1.0))
        is_long = largest_turn[j] * full_share > most_turn
        new_share = wp.where(is_long, most_turn / largest_turn[j], full_share)
        width = far_end[j] - near_end[j]
        between_ends = near_end[j] + width * slope_near[j] / (slope_near[j] - slope_far[j])
        next_share = wp.where(is_new, new_share, between_ends)
        moved_share[j] = wp.where(is_new, new_share, between_ends - present_share[j])
        present_share[j] = next_share
    for k in range(ROTATIONS):
        for j in range(LANES):
            change = wp.where(pace[j] == 2, turn_change[k, j], push[k, j])
            turn_change[k, j] = change
            moved = turn[k, j] + moved_share[j] * change
            moved = wp.where(pace[j] == 0, turn[k, j], moved)
            turn[k, j] = wp.where(pace[j] == 4, turn_then[k, j], moved)
    for j in range(LANES):
        pace[j] = wp.where(pace[j] == 4, 3, pace[j])


def judge_balance():
    seeking = int(0)
    for j in range(LANES):
        seeking += wp.where(worst_balance[j] <= balance * largest_moment[j], 0, 1)
    if seeking > 0:
        slot("judge_lanes")


def judge_lanes():
    if solution == 0:
        for k in range(ROTATIONS):
            for j in range(LANES):
                turn_change[k, j] = push[k, j]
                turn_then[k, j] = turn[k, j] - moved_share[j] * push[k, j]
    for j in range(LANES):
        present_slope[j] = dtype(0.0)
    for k in range(ROTATIONS):
        for j in range(LANES):
            present_slope[j] += unbalanced[k, j] * turn_change[k, j]
    for j in range(LANES):
        slope_at_start[j] = start_slope[j]
    seeking = int(0)
    falling = int(0)
    for j in range(LANES):
        falling += wp.where(pace[j] > 2, 1, 0)
        is_done = worst_balance[j] <= balance * largest_moment[j] or not (worst_balance[j] <= most_moment)
        rises = slope_at_start[j] * present_slope[j] < dtype(0.0)
        is_beyond = rises and wp.abs(present_slope[j]) > dtype(0.5) * wp.abs(slope_at_start[j])
        begins = pace[j] == 1 and has_begun > 0 and is_beyond
        is_near_minimum = wp.abs(present_slope[j]) <= dtype(0.2) * wp.abs(slope_at_start[j])
        ends = pace[j] == 2 and is_near_minimum
        goes_on = pace[j] == 2 and not is_near_minimum
        moves_near = goes_on and slope_at_start[j] * present_slope[j] > dtype(0.0)
        moves_far = begins or (goes_on and not moves_near)
        near_end[j] = wp.where(moves_near, present_share[j], wp.where(begins, dtype(0.0), near_end[j]))
        slope_near[j] = wp.where(moves_near, present_slope[j], wp.where(begins, slope_at_start[j], slope_near[j]))
        far_end[j] = updated(moves_far, present_share[j], far_end[j])
        slope_far[j] = updated(moves_far, present_slope[j], slope_far[j])
        pace_next = wp.where(begins, 2, wp.where(ends, 1, pace[j]))
        falls_back = solution == NEWTON_SOLUTIONS and pace_next > 0 and pace_next < 3
        pace[j] = wp.where(is_done, 0, wp.where(falls_back, 4, pace_next))
        falling += wp.where(pace[j] > 2, 1, 0)
        seeking += pace[j]
    if falling > 0:  # the next solution uses other stiffnesses than those of the branches
        factorises = int(1)


def end_balance():
    if seeking > 0:
        for j in range(LANES):
            worst_turn = int(0)
            worst_moment = dtype(0.0)
            for k in range(ROTATIONS):
                size = wp.abs(unbalanced[k, j])
                worst_turn = wp.where(size > worst_moment, k, worst_turn)
                worst_moment = larger(worst_moment, size)
            i = spring_of_turn(worst_turn)
            worst_spring = int(number_of_spring + 1)
            if pace[j] > 0 and unsolved[j] == 0:
                unsolved[j] = worst_spring


def judge_state():
    if unsolved[j] > 0:
        status = not_converged


def write():
    output.spring_without_equilibrium[o] = unsolved[j] - 1
