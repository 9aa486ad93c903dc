"""Members with hinges at both ends of a frame whose joints are a grid: stiffness, moments and rotations of hinges.

A member has the bending stiffness S. With q, the rotations of its joints relative to its chord, x, the rotations of its
hinges, and L, the moments of gravity loads at fixed ends, the moments at its ends are m = S (q + x) + L. Those of its
hinges are K x + c, with slopes K and intercepts c of their lines, and m = -(K x + c). Therefore m = T q + b with
F = (S + K)^-1, T = K F S and b = K F L - S F c, and the rotations of the hinges are x = S^-1 (m - L) - q.
T and b change only if a hinge leaves its line.

On a GPU the threads exchange the rotations of the joints below, and moments at the lower ends of the columns above.
The top storey gets the values of an idle thread, which has no members.
"""

from warpdyn.engine.kernels.hinges.layout import VALUES_OF_MEMBER

order = 5

BORROWS = {
    "joint_rotations": ("drift_now",),
    "joint_matrix": ("solved", "runs"),
    "shared_warp": ("section", "first_thread", "thread_above"),
    "hinge_lines": ("line_slope", "line_intercept", "least_rotation", "most_rotation"),
}


def wanted(plan):
    return plan.frame_storeys is not None


def first_value(plan):
    """Return the place of the first value of a thread's members, after those of the matrices of its floors."""
    return plan.floors.count if plan.floors else plan.pattern.first_of_line


def values_held(plan):
    line = plan.line_of_thread
    return 8 * line.members + line.free + 4 + line.values


def names(plan):
    import warp as wp

    from warpdyn.engine.device.extrema import maximum
    from warpdyn.engine.device.quotients import reciprocal
    from warpdyn.engine.device.warp_exchange import LARGEST, number_at
    from warpdyn.engine.kernels.plan import DTYPES

    storeys, line, first, threads = plan.frame_storeys, plan.line_of_thread, first_value(plan), plan.sections
    floors, lines, members = storeys.count // threads, storeys.lines, line.members - storeys.half_beams // threads
    terms = [place for thread in range(threads) for place in storeys.terms_of(thread, threads)]
    dtype, lanes = DTYPES[plan.dtype], plan.lanes
    return {
        "maximum": maximum,
        "reciprocal": reciprocal,
        "LINES": lines,
        "BEAMS": lines - 1,
        "MEMBERS": members,
        "MEMBERS_OF_STOREY": 2 * lines - 1,
        "JOINTS": line.free,
        "VALUES_OF_MEMBER": VALUES_OF_MEMBER,
        "VALUES_OF_FRAME": line.values,
        "FIRST_VALUE": first,
        "FIRST_MEMBER": first + line.first("member"),
        "MEMBER_LOADS": line.has_member_loads,
        "FIRST_MEMBER_LOAD": first + line.first("member_load"),
        "FIRST_CHORD_STOREY": first + line.first("chord_storey"),
        "JOINT_LOADS": bool(line.loads),
        "FIRST_LOAD": first + line.first("load"),
        "HAS_LOADS": bool(line.lengths["moment"]),
        "FIRST_DRIFT": first + line.first("drift"),
        "FIRST_SHEAR": first + line.first("shear"),
        "LEAST_MOMENT": first + line.first("moment"),
        # Only the recorder of springs needs rotations and moments of hinges after a step on a GPU. Without it they
        # need no registers.
        "KEEPS_HINGES": threads == 1 or "spring" in plan.recorders,
        "NO_MEMBERS": VALUES_OF_MEMBER * line.members,
        "frame_term": number_at([place if place < 0 else plan.pattern.first_of_line + place for place in terms]),
        "spring_number": number_at([spring for each in range(threads) for spring in storeys.springs_of(each, threads)]),
        "over_frame": LARGEST[plan.dtype],
        "line_rows": wp.types.matrix(shape=((floors + 1) * lines, lanes), dtype=dtype),
        "member_rows": wp.types.matrix(shape=(3 * members, lanes), dtype=dtype),
        "end_rows": wp.types.matrix(shape=(line.hinges, lanes), dtype=dtype),
    }


def place():
    is_idle = int(0)  # whether the thread has no storey
    first_of_frame = int(0)  # the first thread of the frame
    next_storey = int(1)  # distance of the threads of successive storeys; 0 in an idle thread
    if THREADS > 1:
        first_of_frame = first_thread
        if HAS_IDLE_THREADS:
            if block == AFTER_LAST_SAMPLE:
                is_idle = 1
                first_of_frame = int(SAMPLES_OF_WARP * THREADS)
                next_storey = 0


def declare():
    largest_moment = row()  # of the sample so far
    storey_shear = storey_row()
    passed = line_rows()  # what each column passes on to the joint below it; last those of the storey above
    tie = member_rows()  # stiffness of a member with hinges: start, mixed, end
    bias = end_rows()  # moments at the ends of a member whose joints do not turn relative to its chord
    give = member_rows()  # rotations of the ends of a member without hinges per moment: start, mixed, end
    leaving = indices()  # whether a hinge of the thread has left its line
    grown = int(0)
    turn_of_start = row()  # of the present member's joints, relative to its chord
    turn_of_end = row()
    moment_of_member = row()


def read_sample():
    for q in range(VALUES_OF_FRAME):
        at_term = frame_term(section * VALUES_OF_FRAME + q)
        terms[FIRST_VALUE + q, j] = dtype(0.0)
        if at_term >= 0:
            terms[FIRST_VALUE + q, j] = structures.terms[at_term, s]
    for member in range(MEMBERS):
        first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
        start_stiffness = terms[first_value, j]
        mixed_stiffness = terms[first_value + 1, j]
        end_stiffness = terms[first_value + 2, j]
        determinant = start_stiffness * end_stiffness - mixed_stiffness * mixed_stiffness
        inverse = dtype(1 - is_idle) / determinant
        give[3 * member, j] = end_stiffness * inverse
        give[3 * member + 1, j] = -mixed_stiffness * inverse
        give[3 * member + 2, j] = start_stiffness * inverse
    if THREADS > 1:
        if is_idle > 0:
            for q in range(NO_MEMBERS):
                terms[FIRST_MEMBER + q, j] = dtype(0.0)
            if MEMBER_LOADS:
                for q in range(2 * MEMBERS):
                    terms[FIRST_MEMBER_LOAD + q, j] = dtype(0.0)
            if JOINT_LOADS:
                for q in range(JOINTS):
                    terms[FIRST_LOAD + q, j] = dtype(0.0)
            if HAS_LOADS:
                for q in range(FLOORS):
                    terms[FIRST_SHEAR + q, j] = dtype(0.0)
    if HAS_LOADS:
        largest_moment[j] = terms[LEAST_MOMENT, j]


def pass_down():
    if THREADS > 1:
        for passing in range(LINES):
            for j in range(LANES):
                passed[JOINTS + passing, j] = from_thread(passed[passing, j], thread_above)


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
    if THREADS > 1:
        grown = any_in_warp(grown)
        if grown > 0:
            for j in range(LANES):
                largest_moment[j] = over_frame(largest_moment[j], first_of_frame, THREADS)
