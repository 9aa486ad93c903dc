"""A frame whose joints are a grid of floors and column lines: its unbalanced moments, storey by storey.

On a GPU each thread of a warp computes the columns of one storey and the beams above them, with all their values in
registers; all threads integrate all floors. The threads exchange the rotations of the joints below, and moments at the
lower ends of the columns above (`shared_warp.py`). The top storey gets the values of an idle thread, which has
no members. On a CPU a thread computes all storeys.

Unknowns and balance are those of `joint_frame.py`; `storey_relaxation.py` contains the linear system.
"""

from warpdyn.engine.kernels.hinges.layout import VALUES_OF_MEMBER

order = 5

BORROWS = {
    "massless_rotations": ("turn", "unbalanced", "largest_moment", "worst_balance"),
    "shared_warp": ("section", "lowest", "thread", "first_thread", "thread_above", "thread_below"),
}


def wanted(plan):
    return plan.frame_storeys is not None


def values_held(plan):
    line = plan.line_of_thread
    return 3 * line.free + 4 + line.values


def names(plan):
    import warp as wp

    from warpdyn.engine.device.warp_exchange import EXCHANGES, LARGEST, number_at
    from warpdyn.engine.kernels.plan import DTYPES

    storeys, line, first, threads = plan.frame_storeys, plan.line_of_thread, plan.pattern.first_of_line, plan.sections
    floors, lines = storeys.count // threads, storeys.lines
    terms = [place for thread in range(threads) for place in storeys.terms_of(thread, threads)]
    dtype, lanes = DTYPES[plan.dtype], plan.lanes
    return {
        "LINES": lines,
        "BEAMS": lines - 1,
        "MEMBERS": line.members,
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
        "NO_MEMBERS": VALUES_OF_MEMBER * line.members,
        "frame_term": number_at([place if place < 0 else first + place for place in terms]),
        "spring_number": number_at([spring for each in range(threads) for spring in storeys.springs_of(each, threads)]),
        "shared_from": EXCHANGES[plan.dtype][0],
        "over_frame": LARGEST[plan.dtype],
        "storey_row": wp.types.matrix(shape=(floors, lanes), dtype=dtype),
        "line_rows": wp.types.matrix(shape=((floors + 1) * lines, lanes), dtype=dtype),
    }


def place():
    is_idle = int(0)  # whether the thread has no storey
    first_of_frame = int(0)  # the first thread of the frame
    next_storey = int(1)  # distance of the threads of successive storeys
    if THREADS > 1:
        first_of_frame = first_thread
        if HAS_IDLE_THREADS:
            if block == AFTER_LAST_SAMPLE:
                is_idle = 1
                first_of_frame = int(SAMPLES_OF_WARP * THREADS)
                next_storey = 0


def declare():
    drift_then = storey_row()  # drifts of the thread's storeys to which the unbalanced moments belong
    own_drift = row()
    storey_shear = storey_row()
    lifted = line_rows()  # rotations of the joints below each storey
    passed = line_rows()  # what each column passes on to the joint below it; last those of the storey above


def read_sample():
    for q in range(VALUES_OF_FRAME):
        at_term = frame_term(section * VALUES_OF_FRAME + q)
        terms[FIRST_VALUE + q, j] = dtype(0.0)
        if at_term >= 0:
            terms[FIRST_VALUE + q, j] = structures.terms[at_term, s]
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
        largest_moment[j] = terms[LEAST_MOMENT, j]


def pass_down():
    if THREADS > 1:
        for passing in range(LINES):
            for j in range(LANES):
                passed[JOINTS + passing, j] = from_thread(passed[passing, j], thread_above)


def tilt_columns():
    for floor in range(FLOORS):
        for j in range(LANES):
            if THREADS > 1:
                own_drift[j] = dtype(0.0)
                for storey in range(N):
                    drift_of_storey = deformation[storey, j]
                    if HAS_LOADS:
                        drift_of_storey += terms[FIRST_DRIFT + storey, j]
                    own_drift[j] = wp.where(storey == section and is_idle == 0, drift_of_storey, own_drift[j])
            else:
                own_drift[j] = deformation[floor, j]
                if HAS_LOADS:
                    own_drift[j] += terms[FIRST_DRIFT + floor, j]
        for q in range(LINES):
            first_value = FIRST_MEMBER + VALUES_OF_MEMBER * (floor * MEMBERS_OF_STOREY + q)
            end_row = JOINTS + 2 * (floor * MEMBERS_OF_STOREY + q)
            joint = floor * LINES + q
            for j in range(LANES):
                tilt = terms[FIRST_CHORD_STOREY + joint, j] * (own_drift[j] - drift_then[floor, j])
                at_start = (terms[first_value, j] + terms[first_value + 1, j]) * tilt
                at_end = (terms[first_value + 1, j] + terms[first_value + 2, j]) * tilt
                unbalanced[end_row, j] -= at_start
                unbalanced[end_row + 1, j] -= at_end
                unbalanced[joint, j] -= at_end
                passed[joint, j] = at_start
        for j in range(LANES):
            drift_then[floor, j] = own_drift[j]
    slot("pass_down")
    for joint in range(JOINTS):
        for j in range(LANES):
            unbalanced[joint, j] -= passed[joint + LINES, j]


def find_joints_below():
    for lower_line in range(LINES):
        for j in range(LANES):
            lifted[lower_line, j] = dtype(0.0)
            if THREADS > 1:
                lifted[lower_line, j] = from_thread(turn[JOINTS - LINES + lower_line, j], thread_below)
    for lower_joint in range(JOINTS - LINES):
        for j in range(LANES):
            lifted[lower_joint + LINES, j] = turn[lower_joint, j]


def unbalance_line():
    slot("find_joints_below")
    for j in range(LANES):
        worst_balance[j] = dtype(0.0)
    for joint in range(JOINTS):
        for j in range(LANES):
            unbalanced[joint, j] = dtype(0.0)
            if JOINT_LOADS:
                unbalanced[joint, j] = -terms[FIRST_LOAD + joint, j]
    for floor in range(FLOORS):
        for j in range(LANES):
            storey_shear[floor, j] = dtype(0.0)
        for q in range(MEMBERS_OF_STOREY):
            member = floor * MEMBERS_OF_STOREY + q
            first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
            end_row = JOINTS + 2 * member
            i = N + 2 * member
            joint = floor * LINES + q % LINES
            for j in range(LANES):
                start_turn = turn[end_row, j]
                end_turn = turn[end_row + 1, j]
                if q < LINES:
                    chord = terms[FIRST_CHORD_STOREY + joint, j] * drift_then[floor, j]
                    start_turn += lifted[joint, j] - chord
                    end_turn += turn[joint, j] - chord
                else:
                    start_turn += turn[joint, j]
                    end_turn += turn[joint + 1, j]
                at_start = terms[first_value, j] * start_turn + terms[first_value + 1, j] * end_turn
                at_end = terms[first_value + 1, j] * start_turn + terms[first_value + 2, j] * end_turn
                if MEMBER_LOADS:
                    at_start += terms[FIRST_MEMBER_LOAD + 2 * member, j]
                    at_end += terms[FIRST_MEMBER_LOAD + 2 * member + 1, j]
                largest_moment[j] = larger(largest_moment[j], larger(wp.abs(at_start), wp.abs(at_end)))
                left_start = at_start + spring_force[i, j]
                left_end = at_end + spring_force[i + 1, j]
                worst_balance[j] = larger(worst_balance[j], larger(wp.abs(left_start), wp.abs(left_end)))
                unbalanced[end_row, j] = left_start
                unbalanced[end_row + 1, j] = left_end
                if q < LINES:
                    storey_shear[floor, j] -= terms[FIRST_CHORD_STOREY + joint, j] * (at_start + at_end)
                    passed[joint, j] = at_start
                    unbalanced[joint, j] += at_end
                else:
                    unbalanced[joint, j] += at_start
                    unbalanced[joint + 1, j] += at_end
    slot("pass_down")
    for joint in range(JOINTS):
        for j in range(LANES):
            left_moment = unbalanced[joint, j] + passed[joint + LINES, j]
            unbalanced[joint, j] = left_moment
            worst_balance[j] = larger(worst_balance[j], wp.abs(left_moment))
    for floor in range(N):
        for j in range(LANES):
            if THREADS > 1:
                spring_force[floor, j] = shared_from(storey_shear[0, j], first_of_frame + floor * next_storey)
            else:
                spring_force[floor, j] = storey_shear[floor, j]
            if HAS_LOADS:
                spring_force[floor, j] -= terms[FIRST_SHEAR + floor, j]
    if THREADS > 1:
        for j in range(LANES):
            worst_balance[j] = over_frame(worst_balance[j], first_of_frame, THREADS)
            largest_moment[j] = over_frame(largest_moment[j], first_of_frame, THREADS)
