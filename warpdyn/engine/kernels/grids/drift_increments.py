"""The search for rotations if hinges of a frame leave their lines: the drifts of a step may be applied in increments.

Newton's method on the lines of the hinges usually needs one more solution. It may fail to end, because solutions
alternate between lines, and softening hinges have other equilibria far away. Therefore a solution counts only if no
rotation has changed by more than MOST_TURN. Otherwise the search returns to the last accepted state, and applies half
of the change of the drifts first. Each increment that was found is accepted as a state, so that the hinges follow the
path of the drifts.

In the shortest increment, a joint may have lost its equilibrium, because its hinges soften. It then turns until it
finds another one, for example with a hinge at its residual moment. Newton's method does not find this equilibrium, but
solutions with PUSH of the initial stiffness of the hinges do, because they follow the unbalanced moments. Both kinds of
solutions take turns. If they do not end, the sample has no equilibrium: its status is not_converged.
"""

from warpdyn.engine.kernels.hinges.frame_storeys import has_hinge_lines

order = 5

BORROWS = {
    "joint_rotations": ("drift_then", "drift_wanted"),
    "joint_matrix": ("solved", "is_open", "runs"),
    "storey_members": (
        "largest_moment",
        "drift_now",
        "turn_then",
        "solution",
        "pace",
        "failed_spring",
        "first_of_frame",
    ),
}

MOST_TURN = 0.02  # rad
MOST_SOLUTIONS_OF_INCREMENT = 6
SOLUTIONS_OF_SHORTEST, TURN_OF_SOLUTIONS = 132, 22
PUSH = 0.6  # more than half, so that the moments of elastic hinges do not alternate with growing amplitude
# Of the change of the drifts in a step. With 1/64, 0.2 to 0.3 % of the samples of the four-storey frame found no
# equilibrium and were run again with up to 2^8 times as many steps, which took most of the time of a run on a GPU.
SHORTEST = 1 / 1024
MOST_ROTATION = 1e30  # rad; a larger sum of changes, or NaN, ends the search: the sample diverges


def wanted(plan):
    return has_hinge_lines(plan)


def values_held(plan):
    return 5


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    dtype = DTYPES[plan.dtype]
    return {
        "most_turn": wp.constant(dtype(MOST_TURN)),
        "shortest": wp.constant(dtype(SHORTEST)),
        "most_rotation_sum": wp.constant(dtype(MOST_ROTATION)),
        "of_push": wp.constant(dtype(PUSH)),
        "SOLUTIONS_OF_SHORTEST": SOLUTIONS_OF_SHORTEST,
        "TURN_OF_SOLUTIONS": TURN_OF_SOLUTIONS,
        "SOLUTIONS_OF_INCREMENT": MOST_SOLUTIONS_OF_INCREMENT,
    }


def declare():
    accepts = indices()  # whether the state of a lane is accepted
    returns = indices()  # whether a lane returns to its last accepted state
    solutions_tried = indices()
    pushes = indices()  # whether the next solution follows the unbalanced moments
    reached_share = row()  # of the change of the drifts: in the last accepted state, and in the present solution
    present_share = row()
    differing = indices()  # hinges whose lines have changed
    largest_gap = row()  # largest difference between a hinge's law and its line, and its spring
    spring_of_gap = indices()
    largest_jump = row()  # largest change of a rotation
    turned_in_all = row()
    largest_then = row()  # the largest moment in the last accepted state


def guess_joints():
    for j in range(LANES):
        reached_share[j] = dtype(0.0)
        present_share[j] = dtype(1.0)
        solutions_tried[j] = 0
        pushes[j] = 0
        largest_then[j] = largest_moment[j]


def judge_increment():
    for j in range(LANES):
        turned_in_all[j] = dtype(0.0)
    for joint in range(JOINTS):
        for j in range(LANES):
            turned = wp.abs(solved[joint + LINES, j] - turn_then[joint, j])
            largest_jump[j] = larger(largest_jump[j], turned)
            turned_in_all[j] += turned
    seeking = int(0)
    for j in range(LANES):
        differences = differing[j] + wp.where(is_open[j] > 0, 1, 0)
        if THREADS > 1:
            differences = any_of_frame(differences, first_of_frame, THREADS)
            largest_jump[j] = over_frame(largest_jump[j], first_of_frame, THREADS)
            turned_in_all[j] = over_frame(turned_in_all[j], first_of_frame, THREADS)
            gap_of_frame = over_frame(largest_gap[j], first_of_frame, THREADS)
            named = wp.where(largest_gap[j] >= gap_of_frame, dtype(spring_of_gap[j]), dtype(0.0))
            spring_of_gap[j] = int(over_frame(named, first_of_frame, THREADS))
        is_lost = not (turned_in_all[j] <= most_rotation_sum)
        length = present_share[j] - reached_share[j]
        is_far = largest_jump[j] > most_turn and length > shortest
        is_found = differences == 0 and not is_far
        solutions_tried[j] += 1
        seeks = pace[j] > 0
        ends = seeks and (is_lost or (is_found and present_share[j] >= dtype(1.0)))
        goes_on = seeks and not ends and is_found
        gives_up = seeks and not ends and not is_found
        most_solutions = wp.where(length > shortest, SOLUTIONS_OF_INCREMENT, SOLUTIONS_OF_SHORTEST)
        gives_up = gives_up and (is_far or solutions_tried[j] >= most_solutions)
        # In the last solution that is allowed a sample fails, so that the others of the thread or warp are accepted.
        is_last = solution >= MOST_SOLUTIONS - 1
        fails = (gives_up and length <= shortest) or (seeks and not ends and is_last)
        accepts[j] = wp.where(goes_on and not fails, 1, 0)
        returns[j] = wp.where(gives_up and not fails, 1, 0)
        failed_spring[j] = wp.where(fails, spring_of_gap[j] + 1, failed_spring[j])
        reached_share[j] = updated(goes_on, present_share[j], reached_share[j])
        next_share = wp.min(present_share[j] + length + length, dtype(1.0))
        next_share = wp.where(goes_on, next_share, reached_share[j] + dtype(0.5) * length)
        present_share[j] = updated(goes_on or gives_up, next_share, present_share[j])
        solutions_tried[j] = wp.where(goes_on or gives_up, 0, solutions_tried[j])
        # A hinge takes its next line before the next judgement.
        pushes[j] = wp.where(solutions_tried[j] % TURN_OF_SOLUTIONS >= SOLUTIONS_OF_INCREMENT - 1, 1, 0)
        pushes[j] = wp.where(present_share[j] - reached_share[j] <= shortest, pushes[j], 0)
        pace[j] = wp.where(ends or fails, 0, pace[j])
        seeking += pace[j]
    if THREADS > 1:
        seeking = any_in_warp(seeking)
    if seeking == 0:
        for j in range(LANES):
            accepts[j] = runs[j]
            returns[j] = 0
    else:
        slot("set_increment")


def set_increment():
    for floor in range(FLOORS):
        for j in range(LANES):
            change = drift_wanted[floor, j] - drift_then[floor, j]
            partly = drift_then[floor, j] + present_share[j] * change
            partly = wp.where(present_share[j] < dtype(1.0), partly, drift_wanted[floor, j])
            drift_now[floor, j] = updated(pace[j] > 0, partly, drift_now[floor, j])
    for j in range(LANES):
        largest_then[j] = updated(accepts[j] > 0, largest_moment[j], largest_then[j])
        largest_moment[j] = updated(returns[j] > 0, largest_then[j], largest_moment[j])
    for joint in range(JOINTS):
        for j in range(LANES):
            turn_reached = solved[joint + LINES, j]
            solved[joint + LINES, j] = updated(returns[j] > 0, turn_then[joint, j], turn_reached)
            turn_then[joint, j] = updated(accepts[j] > 0, turn_reached, turn_then[joint, j])
