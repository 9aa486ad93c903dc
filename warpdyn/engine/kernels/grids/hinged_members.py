"""Members with hinges at both ends of a frame whose joints are a grid: stiffness, moments and rotations of hinges.

A member has the bending stiffness S. With q, the rotations of its joints relative to its chord, x, the rotations of its
hinges, and L, the moments of gravity loads at fixed ends, the moments at its ends are m = S (q + x) + L. Those of its
hinges are K x + c, with slopes K and intercepts c of their lines, and m = -(K x + c). Therefore m = T q + b with
F = (S + K)^-1, T = K F S and b = K F L - S F c, and the rotations of the hinges are x = S^-1 (m - L) - q.
T and b change only if a hinge leaves its line.
"""

from warpdyn.engine.kernels.hinges.frame_storeys import has_hinge_lines

order = 5

BORROWS = {
    "joint_matrix": ("solved", "runs"),
    "storey_members": (
        "largest_moment",
        "drift_now",
        "tie",
        "bias",
        "grown",
        "give",
        "is_idle",
    ),
    "hinge_lines": ("line_slope", "line_intercept", "least_rotation", "most_rotation"),
}


def wanted(plan):
    return has_hinge_lines(plan)


def values_held(plan):
    return plan.frame_storeys.count // plan.sections + 4


def names(plan):
    from warpdyn.engine.device.extrema import maximum

    return {"maximum": maximum}


def declare():
    leaving = indices()  # whether a hinge of the thread has left its line
    storey_shear = storey_row()
    turn_of_start = row()  # of the present member's joints, relative to its chord
    turn_of_end = row()
    moment_of_member = row()


def factorise_joints():
    for member in range(MEMBERS):
        first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
        # No difference of nearly equal numbers: hinges may be much softer or stiffer than the member.
        for j in range(LANES):
            start_stiffness = terms[first_value, j]
            mixed_stiffness = terms[first_value + 1, j]
            end_stiffness = terms[first_value + 2, j]
            start_slope = line_slope[2 * member, j]
            end_slope = line_slope[2 * member + 1, j]
            determinant = start_stiffness * end_stiffness - mixed_stiffness * mixed_stiffness
            start_sum = start_slope * end_stiffness + determinant
            end_sum = end_slope * start_stiffness + determinant
            inverse = reciprocal(start_slope * end_slope + start_sum + end_slope * start_stiffness)
            of_start = start_slope * inverse
            of_end = end_slope * inverse
            tie[3 * member, j] = of_start * end_sum
            tie[3 * member + 1, j] = of_start * (end_slope * mixed_stiffness)
            tie[3 * member + 2, j] = of_end * start_sum
            start_intercept = line_intercept[2 * member, j] * inverse
            end_intercept = line_intercept[2 * member + 1, j] * inverse
            bias_of_start = -(end_sum * start_intercept + mixed_stiffness * start_slope * end_intercept)
            bias_of_end = -(mixed_stiffness * end_slope * start_intercept + start_sum * end_intercept)
            if MEMBER_LOADS:
                load_of_start = terms[FIRST_MEMBER_LOAD + 2 * member, j]
                load_of_end = terms[FIRST_MEMBER_LOAD + 2 * member + 1, j]
                end_part = (end_stiffness + end_slope) * load_of_start - mixed_stiffness * load_of_end
                bias_of_start += of_start * end_part
                start_part = (start_stiffness + start_slope) * load_of_end - mixed_stiffness * load_of_start
                bias_of_end += of_end * start_part
            bias[2 * member, j] = bias_of_start
            bias[2 * member + 1, j] = bias_of_end


def find_moments():
    grown = int(0)
    for j in range(LANES):
        leaving[j] = 0
    for floor in range(FLOORS):
        for j in range(LANES):
            storey_shear[floor, j] = dtype(0.0)
        for q in range(MEMBERS_OF_STOREY):
            member = floor * MEMBERS_OF_STOREY + q
            i = N + 2 * member
            joint = floor * LINES + q  # place of the member's first joint in `solved`
            second_joint = joint + LINES - (LINES - 1) * (q // LINES)
            for j in range(LANES):
                turn_of_start[j] = solved[joint, j]
                turn_of_end[j] = solved[second_joint, j]
            if q < LINES:
                for j in range(LANES):
                    chord = terms[FIRST_CHORD_STOREY + floor * LINES + q, j] * drift_now[floor, j]
                    turn_of_start[j] -= chord
                    turn_of_end[j] -= chord
            for j in range(LANES):
                start_turn = turn_of_start[j]
                end_turn = turn_of_end[j]
                at_start = bias[2 * member, j] + tie[3 * member, j] * start_turn
                at_start += tie[3 * member + 1, j] * end_turn
                at_end = bias[2 * member + 1, j] + tie[3 * member + 1, j] * start_turn
                at_end += tie[3 * member + 2, j] * end_turn
                of_start = at_start
                of_end = at_end
                if MEMBER_LOADS:
                    of_start -= terms[FIRST_MEMBER_LOAD + 2 * member, j]
                    of_end -= terms[FIRST_MEMBER_LOAD + 2 * member + 1, j]
                start_rotation = give[3 * member, j] * of_start - start_turn + give[3 * member + 1, j] * of_end
                end_rotation = give[3 * member + 1, j] * of_start - end_turn + give[3 * member + 2, j] * of_end
                # NaN is outside of the limits of a line.
                if THREADS > 1:
                    is_on_line = start_rotation >= least_rotation[2 * member, j]
                    is_on_line = is_on_line and start_rotation <= most_rotation[2 * member, j]
                    is_on_line = is_on_line and end_rotation >= least_rotation[2 * member + 1, j]
                    is_on_line = is_on_line and end_rotation <= most_rotation[2 * member + 1, j]
                    leaving[j] = wp.where(is_on_line, leaving[j], 1)
                else:
                    # Not above zero if both hinges are within the limits of their lines.
                    below_start = least_rotation[2 * member, j] - start_rotation
                    above_start = start_rotation - most_rotation[2 * member, j]
                    below_end = least_rotation[2 * member + 1, j] - end_rotation
                    above_end = end_rotation - most_rotation[2 * member + 1, j]
                    beyond_start = maximum(below_start, above_start)
                    beyond_end = maximum(below_end, above_end)
                    leaving[j] += wp.where(beyond_start <= dtype(0.0), 0, 1)
                    leaving[j] += wp.where(beyond_end <= dtype(0.0), 0, 1)
                # A lane that has finished keeps its bits, also if lines have changed.
                goes_on = runs[j] > 0 if KEEPS_HINGES else ONCE
                deformation[i, j] = updated(goes_on, start_rotation, deformation[i, j])
                deformation[i + 1, j] = updated(goes_on, end_rotation, deformation[i + 1, j])
                spring_force[i, j] = updated(goes_on, -at_start, spring_force[i, j])
                spring_force[i + 1, j] = updated(goes_on, -at_end, spring_force[i + 1, j])
                largest_end = larger(wp.abs(at_start), wp.abs(at_end))
                if THREADS > 1:
                    grown = wp.where(largest_end > largest_moment[j], 1, grown)
                largest_moment[j] = larger(largest_moment[j], largest_end)
                moment_of_member[j] = at_start + at_end
            if q < LINES:
                for j in range(LANES):
                    storey_shear[floor, j] -= terms[FIRST_CHORD_STOREY + floor * LINES + q, j] * moment_of_member[j]
    slot("find_moments_of_half_beams")
    for floor in range(N):
        for j in range(LANES):
            shear_now = storey_shear[floor, j]
            if HAS_LOADS:
                shear_now -= terms[FIRST_SHEAR + floor, j]
            spring_force[floor, j] = updated(runs[j] > 0, shear_now, spring_force[floor, j])
    slot("share_moment")
