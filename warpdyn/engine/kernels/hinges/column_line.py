"""A fish-bone frame with hinges: massless rotations of one column line and its half-beams, found in each stage.

Unknowns are the rotations of joints and of member ends; a hinge is a spring of any law between a member end and its
joint. The floors' displacements are known in a stage, so the rotations follow from equilibrium of moments: the ends of
a member are eliminated in closed form, and a tridiagonal system remains for the joints, from the base to the roof.

`massless_rotations.py` contains the loop over solutions, `hinge_laws.py` the laws.
"""

from warpdyn.engine.kernels.hinges.column_storeys import seeks_hinges
from warpdyn.engine.kernels.lumped.pattern import ColumnLine

order = 5

BORROWS = {
    "massless_rotations": (
        "turn",
        "unbalanced",
        "push",
        "largest_moment",
        "worst_balance",
        "largest_turn",
        "energy_slope",
        "factorises",
    ),
    "hinge_laws": ("first_slope", "hinge_slope"),
    "hinge_search": ("pace",),
}


def wanted(plan):
    return seeks_hinges(plan) and isinstance(plan.pattern.line, ColumnLine)


def values_held(plan):
    line = plan.pattern.line
    return (8 if line.has_hinged_columns else 4) * plan.dofs


def names(plan):
    import warp as wp

    from warpdyn.engine.device.warp_exchange import number_at
    from warpdyn.engine.kernels.lumped.pattern import VALUES_OF_STOREY
    from warpdyn.engine.kernels.plan import DTYPES

    dtype, line, storeys, lanes = DTYPES[plan.dtype], plan.pattern.line, plan.dofs, plan.lanes
    is_rigid_base = line.is_fixed and line.base_hinge < 0
    return {
        "JOINTS": storeys + 1,
        "ROTATIONS_OF_STOREY": line.ends_of_storey,
        "VALUES": VALUES_OF_STOREY,
        "FIRST_OF_LINE": plan.pattern.first_of_line,
        "GROUND": plan.pattern.first_of_line + VALUES_OF_STOREY * storeys,
        "RIGID_BASE": is_rigid_base,
        "HINGED_COLUMNS": line.has_hinged_columns,
        "HINGED_BASE": line.base_hinge >= 0,
        "BASE_HINGE": line.base_hinge,
        "spring_at": number_at(line.springs),
        "joint_rows": wp.types.matrix(shape=(storeys + 1, lanes), dtype=dtype),
        "place_rows": wp.types.matrix(shape=(3 * storeys, lanes), dtype=dtype),
    }


def declare():
    slant = matrix()  # drift divided by height, to which the unbalanced moments belong
    stiffness_of_joint = joint_rows()  # of rigid connections
    inverse_pivot = joint_rows()
    passed_on = matrix()  # share of a joint's moment that the joint above takes
    share_of_end = place_rows()  # rotation of a member end per rotation of its joint
    softness = place_rows()  # flexibility of the hinges of columns; rotation of a half-beam's end per moment
    far_share = place_rows()  # rotation of a column's end per rotation of the joint at the other end


def read_storey():
    if not HINGED_COLUMNS:
        stiffness_of_joint[i, j] += terms[FIRST_OF_LINE + VALUES * i, j]
        stiffness_of_joint[i + 1, j] = terms[FIRST_OF_LINE + VALUES * i, j]
    if i == 0:
        stiffness_of_joint[0, j] += terms[GROUND, j]


def tilt_columns():
    for floor in range(N):
        first_value = FIRST_OF_LINE + VALUES * floor
        lower_row = floor
        upper_row = floor + 1
        if HINGED_COLUMNS:
            lower_row = JOINTS + ROTATIONS_OF_STOREY * floor
            upper_row = lower_row + 1
        for j in range(LANES):
            slant_now = deformation[floor, j] * terms[first_value + 3, j]
            tilt = slant_now - slant[floor, j]
            slant[floor, j] = slant_now
            moment_of_tilt = (terms[first_value, j] + terms[first_value + 1, j]) * tilt
            unbalanced[lower_row, j] -= moment_of_tilt
            unbalanced[upper_row, j] -= moment_of_tilt
    if RIGID_BASE:
        for j in range(LANES):
            unbalanced[0, j] = dtype(0.0)


def factorise_line():
    factorises = int(0)
    if HINGED_BASE:
        for j in range(LANES):
            inverse_pivot[0, j] = wp.where(pace[j] == 3, first_slope[BASE_HINGE, j], hinge_slope[BASE_HINGE, j])
    for j in range(LANES):
        if HINGED_BASE:
            inverse_pivot[0, j] += stiffness_of_joint[0, j]
        else:
            inverse_pivot[0, j] = stiffness_of_joint[0, j]
    for floor in range(N):
        first_value = FIRST_OF_LINE + VALUES * floor
        lower_place = 3 * floor
        upper_place = lower_place + 1
        beam_place = lower_place + 2
        i = spring_at(beam_place)
        if i >= 0:
            for j in range(LANES):
                slope_used = wp.where(pace[j] == 3, first_slope[i, j], hinge_slope[i, j])
                inverse_sum = dtype(1.0) / (slope_used + terms[first_value + 2, j])
                softness[beam_place, j] = inverse_sum
                share_of_end[beam_place, j] = slope_used * inverse_sum
        else:
            for j in range(LANES):
                share_of_end[beam_place, j] = dtype(1.0)
        if HINGED_COLUMNS:
            for place in range(lower_place, beam_place):
                i = spring_at(place)
                if i >= 0:
                    for j in range(LANES):
                        slope_used = wp.where(pace[j] == 3, first_slope[i, j], hinge_slope[i, j])
                        softness[place, j] = dtype(1.0) / slope_used
        for j in range(LANES):
            between = terms[first_value + 1, j]
            upper_pivot = stiffness_of_joint[floor + 1, j] + terms[first_value + 2, j] * share_of_end[beam_place, j]
            lower_pivot = inverse_pivot[floor, j]
            if HINGED_COLUMNS:
                own_stiffness = terms[first_value, j]
                other_stiffness = terms[first_value + 1, j]
                soft_below = softness[lower_place, j]
                soft_above = softness[upper_place, j]
                lower_factor = soft_below * own_stiffness + dtype(1.0)
                upper_factor = soft_above * own_stiffness + dtype(1.0)
                coupled = soft_below * soft_above * other_stiffness * other_stiffness
                inverse = dtype(1.0) / (lower_factor * upper_factor - coupled)
                between = other_stiffness * inverse
                share_of_end[lower_place, j] = upper_factor * inverse
                share_of_end[upper_place, j] = lower_factor * inverse
                far_share[lower_place, j] = soft_below * between
                far_share[upper_place, j] = soft_above * between
                lower_pivot += own_stiffness * share_of_end[lower_place, j]
                lower_pivot -= other_stiffness * far_share[upper_place, j]
                upper_pivot += own_stiffness * share_of_end[upper_place, j]
                upper_pivot -= other_stiffness * far_share[lower_place, j]
            pivot_inverted = dtype(1.0) / lower_pivot
            if RIGID_BASE:
                pivot_inverted = wp.where(floor == 0, dtype(0.0), pivot_inverted)
            inverse_pivot[floor, j] = pivot_inverted
            passed_on[floor, j] = between * pivot_inverted
            inverse_pivot[floor + 1, j] = upper_pivot - between * between * pivot_inverted
    for j in range(LANES):
        inverse_pivot[N, j] = dtype(1.0) / inverse_pivot[N, j]


def solve_line():
    for j in range(LANES):
        push[0, j] = -unbalanced[0, j]
    for floor in range(N):
        beam_place = 3 * floor + 2
        end_row = JOINTS + ROTATIONS_OF_STOREY * floor
        beam_row = end_row + ROTATIONS_OF_STOREY - 1
        for j in range(LANES):
            from_below = push[floor, j]
            onto_upper = -unbalanced[floor + 1, j] - share_of_end[beam_place, j] * unbalanced[beam_row, j]
            if HINGED_COLUMNS:
                left_below = unbalanced[end_row, j]
                left_above = unbalanced[end_row + 1, j]
                from_below -= share_of_end[beam_place - 2, j] * left_below - far_share[beam_place - 1, j] * left_above
                onto_upper -= share_of_end[beam_place - 1, j] * left_above - far_share[beam_place - 2, j] * left_below
                push[floor, j] = from_below
            push[floor + 1, j] = onto_upper - passed_on[floor, j] * from_below
    for j in range(LANES):
        push[N, j] = push[N, j] * inverse_pivot[N, j]
        largest_turn[j] = wp.abs(push[N, j])
        energy_slope[j] = unbalanced[N, j] * push[N, j]
    for down in range(N):
        floor = N - 1 - down
        beam_place = 3 * floor + 2
        end_row = JOINTS + ROTATIONS_OF_STOREY * floor
        beam_row = end_row + ROTATIONS_OF_STOREY - 1
        for j in range(LANES):
            push_above = push[floor + 1, j]
            push_below = push[floor, j] * inverse_pivot[floor, j] - passed_on[floor, j] * push_above
            push_beam = share_of_end[beam_place, j] * push_above - softness[beam_place, j] * unbalanced[beam_row, j]
            push[floor, j] = push_below
            push[beam_row, j] = push_beam
            largest_turn[j] = larger(larger(largest_turn[j], wp.abs(push_below)), wp.abs(push_beam))
            energy_slope[j] += unbalanced[floor, j] * push_below + unbalanced[beam_row, j] * push_beam
            if HINGED_COLUMNS:
                of_lower = push_below - softness[beam_place - 2, j] * unbalanced[end_row, j]
                of_upper = push_above - softness[beam_place - 1, j] * unbalanced[end_row + 1, j]
                push_lower = share_of_end[beam_place - 2, j] * of_lower - far_share[beam_place - 2, j] * of_upper
                push_upper = share_of_end[beam_place - 1, j] * of_upper - far_share[beam_place - 1, j] * of_lower
                push[end_row, j] = push_lower
                push[end_row + 1, j] = push_upper
                largest_turn[j] = larger(larger(largest_turn[j], wp.abs(push_lower)), wp.abs(push_upper))
                energy_slope[j] += unbalanced[end_row, j] * push_lower + unbalanced[end_row + 1, j] * push_upper


def unbalance_line():
    for j in range(LANES):
        worst_balance[j] = dtype(0.0)
        unbalanced[0, j] = terms[GROUND, j] * turn[0, j]
    if HINGED_BASE:
        for j in range(LANES):
            unbalanced[0, j] += spring_force[BASE_HINGE, j]
    for floor in range(N):
        first_value = FIRST_OF_LINE + VALUES * floor
        end_row = JOINTS + ROTATIONS_OF_STOREY * floor
        beam_row = end_row + ROTATIONS_OF_STOREY - 1
        lower_row = floor
        upper_row = floor + 1
        if HINGED_COLUMNS:
            lower_row = end_row
            upper_row = end_row + 1
        # Moments that the ends of the half-beam and of the column exert on hinges or joints.
        i = spring_at(3 * floor + 2)
        if i >= 0:
            for j in range(LANES):
                left_moment = terms[first_value + 2, j] * turn[beam_row, j] + spring_force[i, j]
                unbalanced[beam_row, j] = left_moment
                unbalanced[floor + 1, j] = -spring_force[i, j]
                worst_balance[j] = larger(worst_balance[j], wp.abs(left_moment))
        else:
            for j in range(LANES):
                unbalanced[floor + 1, j] = terms[first_value + 2, j] * turn[beam_row, j]
        for j in range(LANES):
            own_stiffness = terms[first_value, j]
            other_stiffness = terms[first_value + 1, j]
            turn_below = turn[lower_row, j] - slant[floor, j]
            turn_above = turn[upper_row, j] - slant[floor, j]
            moment_below = own_stiffness * turn_below + other_stiffness * turn_above
            moment_above = own_stiffness * turn_above + other_stiffness * turn_below
            spring_force[floor, j] = -(moment_below + moment_above) * terms[first_value + 3, j]
            largest_moment[j] = larger(larger(largest_moment[j], wp.abs(moment_below)), wp.abs(moment_above))
            if HINGED_COLUMNS:
                unbalanced[end_row, j] = moment_below
                unbalanced[end_row + 1, j] = moment_above
            else:
                left_moment = unbalanced[floor, j] + moment_below
                if RIGID_BASE:
                    left_moment = wp.where(floor == 0, dtype(0.0), left_moment)
                unbalanced[floor, j] = left_moment
                unbalanced[floor + 1, j] += moment_above
                worst_balance[j] = larger(worst_balance[j], wp.abs(left_moment))
        if HINGED_COLUMNS:
            for kind in range(2):
                member_row = end_row + kind
                joint = floor + kind
                i = spring_at(3 * floor + kind)
                if i >= 0:
                    for j in range(LANES):
                        left_moment = unbalanced[member_row, j] + spring_force[i, j]
                        unbalanced[member_row, j] = left_moment
                        unbalanced[joint, j] -= spring_force[i, j]
                        worst_balance[j] = larger(worst_balance[j], wp.abs(left_moment))
                else:
                    for j in range(LANES):
                        unbalanced[joint, j] += unbalanced[member_row, j]
                        unbalanced[member_row, j] = dtype(0.0)
            for j in range(LANES):
                left_moment = unbalanced[floor, j]
                if RIGID_BASE:
                    left_moment = wp.where(floor == 0, dtype(0.0), left_moment)
                    unbalanced[floor, j] = left_moment
                worst_balance[j] = larger(worst_balance[j], wp.abs(left_moment))
    for j in range(LANES):
        worst_balance[j] = larger(worst_balance[j], wp.abs(unbalanced[N, j]))
