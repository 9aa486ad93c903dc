"""The linear system of a frame whose joints are a grid of floors and column lines, solved by line relaxation.

The hinges of a member are eliminated in closed form, as in `joint_system.py`. The joints of a floor are solved exactly
(a tridiagonal system), even and odd floors alternately. A column couples neighbouring floors by less than half of the
stiffness at its ends, so each sweep divides the error by 10 to 20. Sweeps start from the correction of the last step,
and continue until the last one changes no moment by more than the tolerance. The balance of all moments is checked
afterwards, as for an exact solution.
"""

from warpdyn.engine.device.processor import across_warp

order = 5

BORROWS = {
    "massless_rotations": (
        "unbalanced",
        "push",
        "largest_turn",
        "energy_slope",
        "factorises",
        "largest_moment",
    ),
    "storey_moments": ("passed", "is_idle", "first_of_frame"),
    "shared_warp": ("lowest", "thread_above", "thread_below"),
    "hinge_laws": ("first_slope", "hinge_slope"),
    "hinge_search": ("pace",),
}

OVER_RELAXATION = 1.05
MOST_SWEEPS = 20


def wanted(plan):
    return plan.frame_storeys is not None


def values_held(plan):
    line = plan.line_of_thread
    return 8 * line.free + 6 * line.members


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    line, lines = plan.line_of_thread, plan.frame_storeys.lines
    dtype, lanes = DTYPES[plan.dtype], plan.lanes
    return {
        "of_sweep": wp.constant(dtype(OVER_RELAXATION)),
        "MOST_SWEEPS": MOST_SWEEPS,
        "joint_rows": wp.types.matrix(shape=(line.free, lanes), dtype=dtype),
        "floor_of_joints": wp.types.matrix(shape=(lines, lanes), dtype=dtype),
        "solved_rows": wp.types.matrix(shape=(line.free + 2 * lines, lanes), dtype=dtype),
        "member_rows": wp.types.matrix(shape=(3 * line.members, lanes), dtype=dtype),
    }


def declare():
    flexibility = member_rows()  # rotations of a member's hinges per moment that acts on them: start, mixed, end
    joint_stiffness = joint_rows()
    inverse_pivot = joint_rows()
    eliminated = joint_rows()  # share of a joint's moment that the next joint of its floor takes
    beam_coupling = joint_rows()
    coupling = line_rows()  # of the joints at both ends of each column; last those of the storey above
    joint_load = joint_rows()
    correction_now = floor_of_joints()
    solved = solved_rows()  # corrections of the joints below, of the thread's joints and of the joints above
    guess = joint_rows()
    share_of_move = row()
    moved_moment = row()
    is_open = indices()


def factorise_line():
    factorises = int(0)
    for joint in range(JOINTS):
        for j in range(LANES):
            joint_stiffness[joint, j] = dtype(is_idle)
    for floor in range(FLOORS):
        for q in range(MEMBERS_OF_STOREY):
            member = floor * MEMBERS_OF_STOREY + q
            first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
            i = N + 2 * member
            joint = floor * LINES + q % LINES
            # No difference of nearly equal numbers: hinges may be much softer or stiffer than the member.
            for j in range(LANES):
                start_stiffness = terms[first_value, j]
                mixed_stiffness = terms[first_value + 1, j]
                end_stiffness = terms[first_value + 2, j]
                start_slope_used = wp.where(pace[j] == 3, first_slope[i, j], hinge_slope[i, j])
                end_slope_used = wp.where(pace[j] == 3, first_slope[i + 1, j], hinge_slope[i + 1, j])
                determinant = start_stiffness * end_stiffness - mixed_stiffness * mixed_stiffness
                start_sum = start_slope_used * end_stiffness + determinant
                end_sum = end_slope_used * start_stiffness + determinant
                inverse = dtype(1.0) / (
                    start_slope_used * end_slope_used + start_sum + end_slope_used * start_stiffness
                )
                flexibility[3 * member, j] = (end_slope_used + end_stiffness) * inverse
                flexibility[3 * member + 1, j] = -mixed_stiffness * inverse
                flexibility[3 * member + 2, j] = (start_slope_used + start_stiffness) * inverse
                start_share = start_slope_used * inverse
                of_start = start_share * end_sum
                between = start_share * (end_slope_used * mixed_stiffness)
                of_end = end_slope_used * inverse * start_sum
                if q < LINES:
                    passed[joint, j] = of_start
                    coupling[joint, j] = between
                    joint_stiffness[joint, j] += of_end
                else:
                    beam_coupling[joint, j] = between
                    joint_stiffness[joint, j] += of_start
                    joint_stiffness[joint + 1, j] += of_end
    slot("pass_down")
    if THREADS > 1:
        for q in range(LINES):
            for j in range(LANES):
                coupling[JOINTS + q, j] = from_thread(coupling[q, j], thread_above)
    for floor in range(FLOORS):
        for q in range(LINES):
            joint = floor * LINES + q
            for j in range(LANES):
                joint_stiffness[joint, j] += passed[joint + LINES, j]
                pivot = joint_stiffness[joint, j]
                if q > 0:
                    pivot -= eliminated[joint - 1, j] * beam_coupling[joint - 1, j]
                inverse_pivot[joint, j] = dtype(1.0) / pivot
                eliminated[joint, j] = beam_coupling[joint, j] * inverse_pivot[joint, j]


def exchange_corrections():
    if THREADS > 1:
        for edge in range(LINES):
            for j in range(LANES):
                solved[edge, j] = from_thread(solved[JOINTS + edge, j], thread_below)
                solved[JOINTS + LINES + edge, j] = from_thread(solved[LINES + edge, j], thread_above)


def solve_line():
    for joint in range(JOINTS):
        for j in range(LANES):
            joint_load[joint, j] = -unbalanced[joint, j]
            solved[joint + LINES, j] = wp.where(solution == 0, guess[joint, j], dtype(0.0))
    for floor in range(FLOORS):
        for q in range(MEMBERS_OF_STOREY):
            member = floor * MEMBERS_OF_STOREY + q
            first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
            end_row = JOINTS + 2 * member
            joint = floor * LINES + q % LINES
            for j in range(LANES):
                left_start = unbalanced[end_row, j]
                left_end = unbalanced[end_row + 1, j]
                start_turn = flexibility[3 * member, j] * left_start + flexibility[3 * member + 1, j] * left_end
                end_turn = flexibility[3 * member + 1, j] * left_start + flexibility[3 * member + 2, j] * left_end
                at_start = terms[first_value, j] * start_turn + terms[first_value + 1, j] * end_turn
                at_end = terms[first_value + 1, j] * start_turn + terms[first_value + 2, j] * end_turn
                if q < LINES:
                    passed[joint, j] = at_start
                    joint_load[joint, j] += at_end
                else:
                    joint_load[joint, j] += at_start
                    joint_load[joint + 1, j] += at_end
    slot("pass_down")
    for joint in range(JOINTS):
        for j in range(LANES):
            joint_load[joint, j] += passed[joint + LINES, j]
    slot("relax_joints")
    for j in range(LANES):
        largest_turn[j] = dtype(0.0)
        energy_slope[j] = dtype(0.0)
    for joint in range(JOINTS):
        for j in range(LANES):
            push_joint = solved[joint + LINES, j]
            guess[joint, j] = wp.where(solution == 0, push_joint, guess[joint, j])
            push[joint, j] = push_joint
            largest_turn[j] = larger(largest_turn[j], wp.abs(push_joint))
            energy_slope[j] += unbalanced[joint, j] * push_joint
    for floor in range(FLOORS):
        for q in range(MEMBERS_OF_STOREY):
            member = floor * MEMBERS_OF_STOREY + q
            first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
            end_row = JOINTS + 2 * member
            joint = floor * LINES + q  # place of the member's first joint in `solved`
            second_joint = joint + LINES - (LINES - 1) * (q // LINES)
            for j in range(LANES):
                start_turn = solved[joint, j]
                end_turn = solved[second_joint, j]
                left_start = unbalanced[end_row, j]
                left_end = unbalanced[end_row + 1, j]
                of_start = terms[first_value, j] * start_turn + terms[first_value + 1, j] * end_turn + left_start
                of_end = terms[first_value + 1, j] * start_turn + terms[first_value + 2, j] * end_turn + left_end
                push_start = -(flexibility[3 * member, j] * of_start + flexibility[3 * member + 1, j] * of_end)
                push_end = -(flexibility[3 * member + 1, j] * of_start + flexibility[3 * member + 2, j] * of_end)
                push[end_row, j] = push_start
                push[end_row + 1, j] = push_end
                largest_turn[j] = larger(largest_turn[j], larger(wp.abs(push_start), wp.abs(push_end)))
                energy_slope[j] += left_start * push_start + left_end * push_end
    if THREADS > 1:
        for j in range(LANES):
            largest_turn[j] = over_frame(largest_turn[j], first_of_frame, THREADS)


def relax_joints():
    open_lanes = int(1)
    sweep = int(0)
    for j in range(LANES):
        is_open[j] = 1
    while open_lanes > 0 and sweep < MOST_SWEEPS:
        for j in range(LANES):
            moved_moment[j] = dtype(0.0)
        for parity in range(2):
            slot("exchange_corrections")
            for relaxed_floor in range(FLOORS):
                is_next = (lowest + relaxed_floor) % 2 == parity
                for j in range(LANES):
                    # Lanes that have finished do not move, so that the bits of a sample do not depend on other lanes.
                    share_of_move[j] = wp.where(is_next and is_open[j] > 0, of_sweep, dtype(0.0))
                for relaxed_line in range(LINES):
                    relaxed_joint = relaxed_floor * LINES + relaxed_line
                    for j in range(LANES):
                        load_left = joint_load[relaxed_joint, j] - coupling[relaxed_joint, j] * solved[relaxed_joint, j]
                        load_left -= coupling[relaxed_joint + LINES, j] * solved[relaxed_joint + 2 * LINES, j]
                        if relaxed_line > 0:
                            load_left -= eliminated[relaxed_joint - 1, j] * correction_now[relaxed_line - 1, j]
                        correction_now[relaxed_line, j] = load_left
                for down in range(LINES):
                    relaxed_line = LINES - 1 - down
                    relaxed_joint = relaxed_floor * LINES + relaxed_line
                    for j in range(LANES):
                        solved_now = correction_now[relaxed_line, j] * inverse_pivot[relaxed_joint, j]
                        if relaxed_line < BEAMS:
                            solved_now -= eliminated[relaxed_joint, j] * correction_now[relaxed_line + 1, j]
                        correction_now[relaxed_line, j] = solved_now
                        change = share_of_move[j] * (solved_now - solved[relaxed_joint + LINES, j])
                        solved[relaxed_joint + LINES, j] += change
                        moved_moment[j] = larger(moved_moment[j], wp.abs(change) * joint_stiffness[relaxed_joint, j])
        open_lanes = int(0)
        for j in range(LANES):
            if THREADS > 1:
                moved_moment[j] = over_frame(moved_moment[j], first_of_frame, THREADS)
            is_open[j] = wp.where(moved_moment[j] > balance * largest_moment[j], is_open[j], 0)
            open_lanes += is_open[j]
        if THREADS > 1:
            open_lanes = across_warp(open_lanes)
        sweep += 1
    slot("exchange_corrections")
