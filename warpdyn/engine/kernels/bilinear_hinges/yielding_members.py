"""Members with bilinear hinges of a frame whose joints are a grid: branches of the hinges are found in each solution.

This is for the threads of a GPU, which have few registers. The flexibility F of a member includes its hinges before
they yield. With q, the rotations of its joints relative to its chord, p, the plastic rotations of its hinges, and m,
the moments at its ends, q = F m + p. A hinge that does not yield keeps p. One that yields has |m - H p| = M, with the
yield moment M and H, the moment per plastic rotation, so that p = m / H - M / H or m / H + M / H. Therefore
m = T q - b, where T is the inverse of F, with 1 / H added for hinges that yield, and b is the product of T with p of
hinges that do not yield, and with -M / H or M / H of those that do.

With fixed branches one solution is exact. The next one uses the branches that were found. Hardening is positive, so
these are the conditions of a complementarity problem with lower and upper bounds and a positive definite matrix. Its
solution is unique. If there are only lower bounds, it is found if each solution changes the branch of only the first
hinge whose branch is wrong (Murty, 1974, Linear Algebra and its Applications 7). All wrong branches are changed
together in the first solutions, which is faster but may not end (Judice and Pires, 1994, Computers and Operations
Research 21).
A sample without a solution after MOST_SOLUTIONS has the status not_converged.
"""

from warpdyn.engine.kernels.hinges.frame_storeys import has_yielding_members

order = 5

BORROWS = {
    "storey_members": (
        "largest_moment",
        "drift_now",
        "give",
        "tie",
        "bias",
        "passed",
        "pace",
        "failed_spring",
        "grown",
        "states_found",
        "open_threads",
        "solution",
        "is_idle",
        "first_of_frame",
    ),
    "joint_matrix": ("solved", "is_open", "joint_load"),
    "shared_warp": ("section",),
}

MOST_TOGETHER = 8
MOST_SOLUTIONS = 300
NO_MEMBER = 1e15  # flexibility, rad/(N m)
LEAST_HARDENING = 1e-9  # relative to the initial stiffness of a hinge


def wanted(plan):
    return has_yielding_members(plan)


def values_held(plan):
    line = plan.line_of_thread
    return 3 * line.members + 4 * line.hinges + 2


def names(plan):
    import warp as wp

    from warpdyn.engine.device.extrema import times_sign_of
    from warpdyn.engine.kernels.grids.joint_rotations import TOLERANCE
    from warpdyn.engine.kernels.plan import DTYPES
    from warpdyn.engine.laws.bilinear.parameters import Coefficient

    dtype = DTYPES[plan.dtype]
    return {
        "times_sign_of": times_sign_of,
        # Of a moment, relative to the largest mean moment at the ends of a column so far.
        "balance": wp.constant(dtype(TOLERANCE[plan.dtype])),
        "least_hardening": wp.constant(dtype(LEAST_HARDENING)),
        "no_member": wp.constant(dtype(NO_MEMBER)),
        "MOST_SOLUTIONS": MOST_SOLUTIONS,
        "MOST_TOGETHER": MOST_TOGETHER,
        "HARDENING_STIFFNESS": int(Coefficient.HARDENING_STIFFNESS),
        "YIELDING_STIFFNESS": int(Coefficient.YIELDING_STIFFNESS),
        "YIELD_DRIFT": int(Coefficient.YIELD_DRIFT),
    }


def declare():
    flexibility = member_rows()  # of a member and its hinges before they yield: start, minus mixed, end
    softness = end_rows()  # plastic rotation per moment of a hinge that yields
    # Plastic rotation without hardening at the yield moment, with the opposite sign of the moment of a yielding hinge.
    yield_reach = end_rows()
    plastic = end_rows()  # plastic rotation of the last accepted state, minus the rotation by loads on the member
    plastic_now = end_rows()
    turn_of_loads = end_rows()  # rotation of the ends by loads on the member, if both ends rotate freely
    hinge_flexibility = end_rows()  # of hinges before they yield, if they are recorded
    yields = indices()  # a bit for each hinge that yields
    wrong = indices()  # a bit for each hinge with the wrong branch


def read_sample():
    for member in range(MEMBERS):
        flexibility[3 * member, j] = wp.where(is_idle > 0, no_member, give[3 * member, j])
        flexibility[3 * member + 1, j] = -give[3 * member + 1, j]
        flexibility[3 * member + 2, j] = wp.where(is_idle > 0, no_member, give[3 * member + 2, j])
        if MEMBER_LOADS:
            load_of_start = terms[FIRST_MEMBER_LOAD + 2 * member, j]
            load_of_end = terms[FIRST_MEMBER_LOAD + 2 * member + 1, j]
            of_both = give[3 * member + 1, j]
            turn_of_loads[2 * member, j] = give[3 * member, j] * load_of_start + of_both * load_of_end
            turn_of_loads[2 * member + 1, j] = give[3 * member + 2, j] * load_of_end + of_both * load_of_start


def read_spring_row():
    if i >= N:
        slot("storey_coefficients")
        stiffness_of_hinge = c[HARDENING_STIFFNESS] + c[YIELDING_STIFFNESS]
        hardening_of_hinge = wp.max(c[HARDENING_STIFFNESS], least_hardening * stiffness_of_hinge)
        softness[i - N, j] = c[YIELDING_STIFFNESS] / stiffness_of_hinge / hardening_of_hinge
        yield_reach[i - N, j] = softness[i - N, j] * stiffness_of_hinge * c[YIELD_DRIFT]
        end_of_member = 3 * ((i - N) // 2) + 2 * ((i - N) % 2)
        flexibility[end_of_member, j] += dtype(1.0) / stiffness_of_hinge
        if KEEPS_HINGES:
            hinge_flexibility[i - N, j] = dtype(1.0) / stiffness_of_hinge
        if MEMBER_LOADS:
            plastic[i - N, j] -= turn_of_loads[i - N, j]


def gather_springs():
    for j in range(LANES):
        drift_now[0, j] = deformation[0, j]
        if HAS_LOADS:
            drift_now[0, j] += terms[FIRST_DRIFT, j]
        # A lane that has finished does not move.
        moves_now = wp.where(h[j] > dtype(0.0), 1, wp.where(states_found == 0, 1, 0))
        pace[j] = wp.where(failed_spring[j] == 0, moves_now, 0)
    slot("continue_turns")
    seeking = int(1)
    solution = int(0)
    while seeking > 0 and solution < MOST_SOLUTIONS:
        slot("tie_members")
        slot("factorise_joints")
        slot("load_yielding_joints")
        slot("solve_joints")
        slot("find_branches")
        slot("judge_moves")  # the largest moment may have grown since the last sweep
        slot("change_branches")
        solution += 1
    if seeking > 0:
        slot("name_hinge")
    states_found += 1


def tie_members():
    for member in range(MEMBERS):
        for j in range(LANES):
            start_yields = (yields[j] & (1 << (2 * member))) != 0
            end_yields = (yields[j] & (1 << (2 * member + 1))) != 0
            of_start = flexibility[3 * member, j] + wp.where(start_yields, softness[2 * member, j], dtype(0.0))
            of_end = flexibility[3 * member + 2, j] + wp.where(end_yields, softness[2 * member + 1, j], dtype(0.0))
            of_both = flexibility[3 * member + 1, j]
            inverse = reciprocal(of_start * of_end - of_both * of_both)
            tie[3 * member, j] = of_end * inverse
            tie[3 * member + 1, j] = of_both * inverse
            tie[3 * member + 2, j] = of_start * inverse
            free_turn_of_start = yield_reach[2 * member, j]
            free_turn_of_end = yield_reach[2 * member + 1, j]
            if MEMBER_LOADS:
                free_turn_of_start -= turn_of_loads[2 * member, j]
                free_turn_of_end -= turn_of_loads[2 * member + 1, j]
            free_turn_of_start = wp.where(start_yields, free_turn_of_start, plastic[2 * member, j])
            free_turn_of_end = wp.where(end_yields, free_turn_of_end, plastic[2 * member + 1, j])
            if member < LINES:
                chord = terms[FIRST_CHORD_STOREY + member, j] * drift_now[0, j]
                free_turn_of_start += chord
                free_turn_of_end += chord
            start_share = tie[3 * member, j] * free_turn_of_start
            bias[2 * member, j] = start_share + tie[3 * member + 1, j] * free_turn_of_end
            end_share = tie[3 * member + 1, j] * free_turn_of_start
            bias[2 * member + 1, j] = end_share + tie[3 * member + 2, j] * free_turn_of_end


def load_yielding_joints():
    for joint in range(JOINTS):
        for j in range(LANES):
            passed[joint, j] = bias[2 * joint, j]
            joint_load[joint, j] = bias[2 * joint + 1, j]
            if JOINT_LOADS:
                joint_load[joint, j] += terms[FIRST_LOAD + joint, j]
    for beam in range(BEAMS):
        for j in range(LANES):
            joint_load[beam, j] += bias[2 * (LINES + beam), j]
        for j in range(LANES):
            joint_load[beam + 1, j] += bias[2 * (LINES + beam) + 1, j]
    slot("pass_down")
    for joint in range(JOINTS):
        for j in range(LANES):
            joint_load[joint, j] += passed[joint + LINES, j]


def find_branches():
    grown = int(0)
    for j in range(LANES):
        wrong[j] = 0
        beyond_limit = int(0)  # a bit for each hinge whose moment is larger than its limit
        shear_now = dtype(0.0)
        allowed_moment = balance * largest_moment[j]
        for member in range(MEMBERS):
            start_turn = solved[member, j]
            end_turn = solved[member + LINES - (LINES - 1) * (member // LINES), j]
            at_start = tie[3 * member, j] * start_turn - bias[2 * member, j] + tie[3 * member + 1, j] * end_turn
            at_end = tie[3 * member + 1, j] * start_turn - bias[2 * member + 1, j] + tie[3 * member + 2, j] * end_turn
            if member < LINES:
                sum_of_ends = at_start + at_end
                shear_now -= terms[FIRST_CHORD_STOREY + member, j] * sum_of_ends
                largest_end = dtype(0.5) * wp.abs(sum_of_ends)
                grown = wp.where(largest_end > largest_moment[j], 1, grown)
                largest_moment[j] = larger(largest_moment[j], largest_end)
                chord = terms[FIRST_CHORD_STOREY + member, j] * drift_now[0, j]
                start_turn -= chord
                end_turn -= chord
            opposite_flexibility = flexibility[3 * member + 1, j]
            judged = 2 * member
            own_turn = start_turn
            own_moment = at_start
            other_moment = at_end
            own_flexibility = flexibility[3 * member, j]
            slot("judge_hinge")
            judged = 2 * member + 1
            own_turn = end_turn
            own_moment = at_end
            other_moment = at_start
            own_flexibility = flexibility[3 * member + 2, j]
            slot("judge_hinge")
        if HAS_LOADS:
            shear_now -= terms[FIRST_SHEAR, j]
        spring_force[0, j] = shear_now
        wrong[j] = wrong[j] | (beyond_limit & ~yields[j])
    slot("share_moment")


def judge_hinge():
    is_yielding = (yields[j] & (1 << judged)) != 0
    plastic_then = plastic[judged, j]
    found_plastic = own_turn - own_flexibility * own_moment + opposite_flexibility * other_moment
    found_plastic = wp.where(is_yielding, found_plastic, plastic_then)
    plastic_now[judged, j] = found_plastic
    # Minus the plastic rotation that a hinge without hardening would have at the present moment.
    back = found_plastic - softness[judged, j] * own_moment
    if MEMBER_LOADS:
        back += turn_of_loads[judged, j]
    reach = yield_reach[judged, j]
    turned_back = times_sign_of(found_plastic - plastic_then, reach) - allowed_moment * own_flexibility
    yield_reach[judged, j] = wp.copysign(reach, back)
    # `and` and `or` would be branches of the program, which keep the compiler from mixing the work of several hinges.
    wrong[j] = wp.where(turned_back > dtype(0.0), wrong[j] | (1 << judged), wrong[j])
    beyond_limit = wp.where(wp.abs(back) > wp.abs(reach), beyond_limit | (1 << judged), beyond_limit)
    if KEEPS_HINGES:
        i = N + judged
        rotation_of_hinge = found_plastic + own_moment * hinge_flexibility[judged, j]
        if MEMBER_LOADS:
            rotation_of_hinge += turn_of_loads[judged, j]
        deformation[i, j] = dtype(0.0) - rotation_of_hinge
        spring_force[i, j] = dtype(0.0) - own_moment


def change_branches():
    open_threads = int(0)
    for j in range(LANES):
        if solution >= MOST_TOGETHER:
            slot("keep_first_wrong_branch")
        yields[j] = yields[j] ^ wp.where(pace[j] > 0, wrong[j], 0)
        pace[j] = wp.where(any_of_frame(wrong[j] + is_open[j], first_of_frame, THREADS) > 0, pace[j], 0)
        open_threads += pace[j]
    seeking = any_in_warp(open_threads)


def keep_first_wrong_branch():
    rank = wp.where(wrong[j] != 0, dtype(THREADS - section), dtype(0.0))
    is_first = rank == over_frame(rank, first_of_frame, THREADS)
    wrong[j] = wp.where(is_first, wrong[j] & -wrong[j], 0)


def name_hinge():
    for j in range(LANES):
        lowest_bit = int(HINGES)
        for down in range(HINGES):
            wrong_bit = wrong[j] & (1 << (HINGES - 1 - down))
            lowest_bit = wp.where(wrong_bit != 0, HINGES - 1 - down, lowest_bit)
        named = int(0)
        if lowest_bit < HINGES:
            named = 1 + spring_number(section * SPRINGS + N + lowest_bit)
        named = wp.max(1, int(over_frame(dtype(named), first_of_frame, THREADS)))
        failed_spring[j] = wp.where(pace[j] > 0, named, failed_spring[j])


def end_step():
    for hinge in range(HINGES):
        for j in range(LANES):
            plastic[hinge, j] = plastic_now[hinge, j]
