"""The members of the storeys of a thread, for frames whose joints are a grid: their values, and those of their joints.

On a GPU the threads exchange the rotations of the joints below, and moments at the lower ends of the columns above.
The top storey gets the values of an idle thread, which has no members.
"""

from warpdyn.engine.kernels.hinges.layout import VALUES_OF_MEMBER

order = 4

BORROWS = {"shared_warp": ("section", "first_thread", "thread_above")}
FIELDS = {"Output": {"spring_without_equilibrium": "int32[]"}}


def wanted(plan):
    return plan.frame_storeys is not None


def first_value(plan):
    """Return the place of the first value of a thread's members, after those of the matrices of its floors."""
    return plan.floors.count if plan.floors else plan.pattern.first_of_line


def values_held(plan):
    line = plan.line_of_thread
    return 8 * line.members + 4 * line.free + 4 + line.values


def names(plan):
    import warp as wp

    from warpdyn.engine.device.quotients import reciprocal
    from warpdyn.engine.device.warp_exchange import LARGEST, any_in_warp, any_of_frame, number_at
    from warpdyn.engine.kernels.plan import DTYPES

    storeys, line, first, threads = plan.frame_storeys, plan.line_of_thread, first_value(plan), plan.sections
    floors, lines, members = storeys.count // threads, storeys.lines, line.members - storeys.half_beams // threads
    terms = [place for thread in range(threads) for place in storeys.terms_of(thread, threads)]
    dtype, lanes = DTYPES[plan.dtype], plan.lanes
    return {
        "any_in_warp": any_in_warp,
        "any_of_frame": any_of_frame,
        "reciprocal": reciprocal,
        "LINES": lines,
        "BEAMS": lines - 1,
        "MEMBERS": members,
        "MEMBERS_OF_STOREY": 2 * lines - 1,
        "JOINTS": line.free,
        "HINGES": line.hinges,
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
        "storey_row": wp.types.matrix(shape=(floors, lanes), dtype=dtype),
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
    drift_now = storey_row()  # drifts of the present solution
    passed = line_rows()  # what each column passes on to the joint below it; last those of the storey above
    give = member_rows()  # rotations of the ends of a member without hinges per moment: start, mixed, end
    tie = member_rows()  # stiffness of a member with hinges: start, mixed, end
    bias = end_rows()  # moments at the ends of a member whose joints do not turn relative to its chord
    turn_then = joint_rows()  # rotations of joints in the last accepted state
    pace = indices()  # 1 while a lane seeks its rotations, else 0
    failed_spring = indices()  # 1 + the hinge without equilibrium, or the first hinge if joints did not converge
    grown = int(0)  # whether the largest moment has grown
    states_found = int(0)
    open_threads = int(0)
    solution = int(0)  # number of the present solution in the step


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


def share_moment():
    if THREADS > 1:
        if any_in_warp(grown) > 0:
            for j in range(LANES):
                largest_moment[j] = over_frame(largest_moment[j], first_of_frame, THREADS)


def restore():
    f = spring_force[i, j]


def judge_state():
    if failed_spring[j] > 0:
        status = not_converged


def write():
    output.spring_without_equilibrium[o] = failed_spring[j] - 1
