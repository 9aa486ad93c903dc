"""A fish-bone frame with hinges: massless rotations of one column line and its half-beams, found in each stage.

Unknowns are the rotations of joints and of member ends; a hinge is a spring of any law between a member end and its
joint. The floors' displacements are known in a stage, so the rotations follow from equilibrium of moments: the ends of
a member are eliminated in closed form, and a tridiagonal system remains for the joints, from the base to the roof.

With fixed branches of all hinges one solution is exact. Newton's method starts from the branches of the last state, and
ends only if all moments balance. Three guards keep it safe: a rotation changes by at most MOST_TURN in an iteration; a
step beyond the minimum of energy along its direction is shortened (false position); and if NEWTON_SOLUTIONS were not
sufficient, the search starts again from the rotations of the accepted state with the initial stiffness of all hinges,
over-relaxed, which is the fixed-point iteration on plastic rotations. A sample without a solution has the status
not_converged.
"""

order = 5

PLACES = 3  # ends of members per storey: lower and upper end of the column, start of the half-beam
VALUES = 4  # per storey: stiffness of the column (own end, other end), of the half-beam [N m/rad], 1 / height [1/m]
MOST_TURN = 0.02  # rad
NEWTON_SOLUTIONS = 15
MOST_SOLUTIONS = 80
OVER_RELAXATION = 1.7
LEAST_SLOPE = 1e-9  # of the initial stiffness of a hinge, in the matrix only
# Largest unbalanced moment, relative to the largest moment of the sample so far.
TOLERANCE = {"float32": 5e-5, "float64": 1e-9}

FIELDS = {"Output": {"spring_without_equilibrium": "int32[]"}}


def wanted(plan):
    return plan.pattern is not None and plan.pattern.line is not None


def values_held(plan):
    return (5 * PLACES + VALUES + 7) * plan.dofs


def names(plan):
    import warp as wp

    from warpdyn.engine.device.warp_exchange import number_at
    from warpdyn.engine.kernels.plan import DTYPES

    dtype, line, storeys = DTYPES[plan.dtype], plan.pattern.line, plan.dofs
    numbers = {
        "most_turn": MOST_TURN,
        "over_relaxation": OVER_RELAXATION,
        "least_slope": LEAST_SLOPE,
        "balance": TOLERANCE[plan.dtype],
    }
    return {
        **{name: wp.constant(dtype(value)) for name, value in numbers.items()},
        "JOINTS": storeys + 1,
        "PLACES": PLACES * storeys,
        "VALUES": VALUES,
        "FIRST_OF_LINE": plan.pattern.first_of_line,
        "GROUND": plan.pattern.first_of_line + VALUES * storeys,
        "BASE_IS_FIXED": line.is_fixed,
        "NEWTON_SOLUTIONS": NEWTON_SOLUTIONS,
        "MOST_SOLUTIONS": MOST_SOLUTIONS,
        "spring_at": number_at(line.springs),
        "joint_rows": wp.types.matrix(shape=(storeys + 1, plan.lanes), dtype=dtype),
        "place_rows": wp.types.matrix(shape=(PLACES * storeys, plan.lanes), dtype=dtype),
    }


def declare():
    turn = joint_rows()  # rotations of joints, and of member ends
    end_turn = place_rows()
    turn_then = joint_rows()  # of the accepted state
    end_turn_then = place_rows()
    turn_change = joint_rows()  # direction of the last correction
    end_change = place_rows()
    flexibility = place_rows()  # of the hinges; 0 for a rigid connection
    unbalanced_end = place_rows()  # moments
    unbalanced_joint = joint_rows()
    pivot = joint_rows()
    push = joint_rows()
    first_slope = spring_rows()  # initial stiffness of the hinges
    coupling = matrix()
    storey_shear = matrix()
    largest_moment = row()  # of the sample so far
    worst_balance = row()
    worst_place = indices()
    pace = indices()  # of a lane's search: 0 finished, 1 Newton's method, 2 shortens the last correction, 3 fallback
    energy_slope = row()  # unbalanced moments times the last correction: at its start, at the present point,
    present_slope = row()
    slope_near = row()  # and at the two points around the minimum
    slope_far = row()
    near_share = row()  # shares of the correction at these points
    far_share = row()
    present_share = row()
    moved_share = row()
    largest_turn = row()
    unsolved = indices()  # 1 + the hinge at the largest unbalanced moment in the first state without equilibrium


def read_spring_row():
    slot("storey_coefficients")
    first_slope[i, j] = tangent_of(dtype(0.0), dtype(0.0), memory_vector(), memory_vector(), c)


def gather_springs():
    slot("begin_balance")
    seeking = int(1)
    solution = int(0)
    while seeking > 0 and solution < MOST_SOLUTIONS:
        slot("unbalance_hinges")
        slot("judge_balance")
        if seeking > 0:
            slot("eliminate_joints")
            slot("correct_turns")
        solution += 1
    slot("end_balance")


def begin_balance():
    for j in range(LANES):
        pace[j] = 1
        energy_slope[j] = dtype(0.0)


def unbalance_hinges():
    for j in range(LANES):
        worst_balance[j] = dtype(0.0)
        present_slope[j] = dtype(0.0)
        worst_place[j] = 0
    for joint in range(JOINTS):
        for j in range(LANES):
            unbalanced_joint[joint, j] = dtype(0.0)
    for j in range(LANES):
        unbalanced_joint[0, j] = -terms[GROUND, j] * turn[0, j]
    for floor in range(N):
        for j in range(LANES):
            storey_shear[floor, j] = dtype(0.0)
    for place in range(PLACES):
        floor = place // 3
        kind = place - 3 * floor
        joint = floor + wp.min(kind, 1)
        i = spring_at(place)
        first_value = FIRST_OF_LINE + VALUES * floor
        for j in range(LANES):
            bending = terms[first_value + 2, j] * end_turn[place, j]
            if kind < 2:
                own_stiffness = terms[first_value, j]
                other_stiffness = terms[first_value + 1, j]
                slant = deformation[floor, j] * terms[first_value + 3, j]
                bending = own_stiffness * (end_turn[place, j] - slant)
                bending += other_stiffness * (end_turn[3 * floor + 1 - kind, j] - slant)
                storey_shear[floor, j] -= bending * terms[first_value + 3, j]
            hinge_moment = -bending
            flexible = dtype(0.0)
            if i >= 0:
                slot("storey_coefficients")
                slot("accepted_memory")
                hinge_turn = end_turn[place, j] - turn[joint, j]
                hinge_moment = force_of(hinge_turn, memory, c)
                hinge_slope = tangent_of(hinge_turn, dtype(0.0), memory, memory, c)
                if pace[j] == 3:
                    hinge_slope = first_slope[i, j]
                if wp.abs(hinge_slope) < least_slope * first_slope[i, j]:
                    hinge_slope = least_slope * first_slope[i, j]
                flexible = dtype(1.0) / hinge_slope
            flexibility[place, j] = flexible
            unbalanced_end[place, j] = bending + hinge_moment
            unbalanced_joint[joint, j] += hinge_moment
            largest_moment[j] = larger(largest_moment[j], wp.abs(hinge_moment))
            size_of_balance = wp.abs(bending + hinge_moment)
            if not (size_of_balance <= worst_balance[j]):
                worst_balance[j] = size_of_balance
                worst_place[j] = place
            present_slope[j] += unbalanced_end[place, j] * end_change[place, j]
    for joint in range(JOINTS):
        for j in range(LANES):
            size_of_balance = wp.abs(unbalanced_joint[joint, j])
            if joint > 0 or not BASE_IS_FIXED:
                if not (size_of_balance <= worst_balance[j]):
                    worst_balance[j] = size_of_balance
                    worst_place[j] = 3 * wp.max(joint - 1, 0) + wp.min(joint, 1)
                present_slope[j] -= unbalanced_joint[joint, j] * turn_change[joint, j]


def judge_balance():
    seeking = int(0)
    for j in range(LANES):
        if pace[j] > 0:
            if worst_balance[j] <= balance * largest_moment[j] or not wp.isfinite(worst_balance[j]):
                pace[j] = 0
            elif pace[j] == 1 and solution > 0:
                if energy_slope[j] * present_slope[j] < dtype(0.0) and wp.abs(present_slope[j]) > dtype(0.5) * wp.abs(
                    energy_slope[j]
                ):
                    pace[j] = 2
                    near_share[j] = dtype(0.0)
                    slope_near[j] = energy_slope[j]
                    far_share[j] = present_share[j]
                    slope_far[j] = present_slope[j]
            elif pace[j] == 2:
                if wp.abs(present_slope[j]) <= dtype(0.2) * wp.abs(energy_slope[j]):
                    pace[j] = 1
                elif energy_slope[j] * present_slope[j] > dtype(0.0):
                    near_share[j] = present_share[j]
                    slope_near[j] = present_slope[j]
                else:
                    far_share[j] = present_share[j]
                    slope_far[j] = present_slope[j]
            if pace[j] > 0 and pace[j] < 3 and solution == NEWTON_SOLUTIONS:
                pace[j] = 4
        seeking = wp.max(seeking, pace[j])


def eliminate_joints():
    for j in range(LANES):
        pivot[0, j] = terms[GROUND, j]
        push[0, j] = unbalanced_joint[0, j]
    for floor in range(N):
        first_value = FIRST_OF_LINE + VALUES * floor
        for j in range(LANES):
            own_stiffness = terms[first_value, j]
            other_stiffness = terms[first_value + 1, j]
            beam_stiffness = terms[first_value + 2, j]
            soft_below = flexibility[3 * floor, j]
            soft_above = flexibility[3 * floor + 1, j]
            left_below = unbalanced_end[3 * floor, j]
            left_above = unbalanced_end[3 * floor + 1, j]
            lower_factor = soft_below * own_stiffness + dtype(1.0)
            upper_factor = soft_above * own_stiffness + dtype(1.0)
            square = other_stiffness * other_stiffness
            inverse = dtype(1.0) / (lower_factor * upper_factor - soft_below * soft_above * square)
            between = other_stiffness * inverse
            pivot[floor, j] += (own_stiffness * upper_factor - soft_above * square) * inverse
            push[floor, j] -= upper_factor * inverse * left_below - soft_above * between * left_above
            of_upper = (own_stiffness * lower_factor - soft_below * square) * inverse
            push_upper = unbalanced_joint[floor + 1, j] - lower_factor * inverse * left_above
            push_upper += soft_below * between * left_below
            inverse_beam = dtype(1.0) / (dtype(1.0) + flexibility[3 * floor + 2, j] * beam_stiffness)
            of_upper += beam_stiffness * inverse_beam
            push_upper -= unbalanced_end[3 * floor + 2, j] * inverse_beam
            if BASE_IS_FIXED and floor == 0:
                push[0, j] = dtype(0.0)
            else:
                passed_on = between / pivot[floor, j]
                of_upper -= passed_on * between
                push_upper -= passed_on * push[floor, j]
            coupling[floor, j] = between
            pivot[floor + 1, j] = of_upper
            push[floor + 1, j] = push_upper
    # The result replaces the right-hand side.
    for j in range(LANES):
        push[JOINTS - 1, j] = push[JOINTS - 1, j] / pivot[JOINTS - 1, j]
    for down in range(N):
        floor = N - 1 - down
        for j in range(LANES):
            if floor > 0 or not BASE_IS_FIXED:
                push[floor, j] = (push[floor, j] - coupling[floor, j] * push[floor + 1, j]) / pivot[floor, j]


def correct_turns():
    # Corrections of joints and ends, for lanes that search for a new direction.
    for j in range(LANES):
        largest_turn[j] = dtype(0.0)
        if pace[j] != 2:
            energy_slope[j] = dtype(0.0)
    for joint in range(JOINTS):
        for j in range(LANES):
            if pace[j] == 1 or pace[j] == 3:
                turn_change[joint, j] = push[joint, j]
                largest_turn[j] = larger(largest_turn[j], wp.abs(push[joint, j]))
                energy_slope[j] -= unbalanced_joint[joint, j] * push[joint, j]
    for floor in range(N):
        first_value = FIRST_OF_LINE + VALUES * floor
        for j in range(LANES):
            if pace[j] == 1 or pace[j] == 3:
                own_stiffness = terms[first_value, j]
                other_stiffness = terms[first_value + 1, j]
                soft_below = flexibility[3 * floor, j]
                soft_above = flexibility[3 * floor + 1, j]
                soft_beam = flexibility[3 * floor + 2, j]
                lower_factor = soft_below * own_stiffness + dtype(1.0)
                upper_factor = soft_above * own_stiffness + dtype(1.0)
                inverse = dtype(1.0) / (
                    lower_factor * upper_factor - soft_below * soft_above * other_stiffness * other_stiffness
                )
                wish_below = push[floor, j] - soft_below * unbalanced_end[3 * floor, j]
                wish_above = push[floor + 1, j] - soft_above * unbalanced_end[3 * floor + 1, j]
                wish_beam = push[floor + 1, j] - soft_beam * unbalanced_end[3 * floor + 2, j]
                end_change[3 * floor, j] = inverse * (
                    upper_factor * wish_below - other_stiffness * soft_below * wish_above
                )
                end_change[3 * floor + 1, j] = inverse * (
                    lower_factor * wish_above - other_stiffness * soft_above * wish_below
                )
                end_change[3 * floor + 2, j] = wish_beam / (dtype(1.0) + soft_beam * terms[first_value + 2, j])
    for place in range(PLACES):
        for j in range(LANES):
            if pace[j] == 1 or pace[j] == 3:
                largest_turn[j] = larger(largest_turn[j], wp.abs(end_change[place, j]))
                energy_slope[j] += unbalanced_end[place, j] * end_change[place, j]
    for j in range(LANES):
        moved_share[j] = dtype(0.0)
        if pace[j] == 1 or pace[j] == 3:
            share_of_turn = dtype(1.0)
            if pace[j] == 3:
                share_of_turn = over_relaxation
            if largest_turn[j] * share_of_turn > most_turn:
                share_of_turn = most_turn / largest_turn[j]
            moved_share[j] = share_of_turn
            present_share[j] = share_of_turn
        if pace[j] == 2:
            width = far_share[j] - near_share[j]
            share_of_turn = near_share[j] + width * slope_near[j] / (slope_near[j] - slope_far[j])
            moved_share[j] = share_of_turn - present_share[j]
            present_share[j] = share_of_turn
    for joint in range(JOINTS):
        for j in range(LANES):
            turn[joint, j] += moved_share[j] * turn_change[joint, j]
            if pace[j] == 4:
                turn[joint, j] = turn_then[joint, j]
    for place in range(PLACES):
        for j in range(LANES):
            end_turn[place, j] += moved_share[j] * end_change[place, j]
            if pace[j] == 4:
                end_turn[place, j] = end_turn_then[place, j]
    for j in range(LANES):
        if pace[j] == 4:
            pace[j] = 3


def end_balance():
    for j in range(LANES):
        if pace[j] > 0 and unsolved[j] == 0:
            unsolved[j] = spring_at(worst_place[j]) + 1
            if unsolved[j] == 0:  # a rigid connection: the storey
                unsolved[j] = worst_place[j] // 3 + 1
    for place in range(PLACES):
        i = spring_at(place)
        if i >= 0:
            floor = place // 3
            joint = floor + wp.min(place - 3 * floor, 1)
            for j in range(LANES):
                deformation[i, j] = end_turn[place, j] - turn[joint, j]


def add_velocity_force():
    if i < N:
        f += storey_shear[i, j]


def end_step():
    for joint in range(JOINTS):
        for j in range(LANES):
            turn_then[joint, j] = turn[joint, j]
    for place in range(PLACES):
        for j in range(LANES):
            end_turn_then[place, j] = end_turn[place, j]


def judge_state():
    if unsolved[j] > 0:
        status = not_converged


def write():
    output.spring_without_equilibrium[o] = unsolved[j] - 1
