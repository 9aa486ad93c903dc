"""The joints of a grid: stiffness, moments that act on them, and their rotations."""

order = 5

BORROWS = {
    "storey_members": ("tie", "bias", "passed", "is_idle", "drift_now"),
}


def wanted(plan):
    return plan.frame_storeys is not None


def values_held(plan):
    return 3 * plan.line_of_thread.free + 2 * plan.frame_storeys.lines


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    line, lines = plan.line_of_thread, plan.frame_storeys.lines
    dtype, lanes = DTYPES[plan.dtype], plan.lanes
    return {
        "joint_rows": wp.types.matrix(shape=(line.free, lanes), dtype=dtype),
        "solved_rows": wp.types.matrix(shape=(line.free + 2 * lines, lanes), dtype=dtype),
    }


def declare():
    joint_stiffness = joint_rows()
    joint_load = joint_rows()
    solved = solved_rows()  # rotations of the joints below, of the thread's joints and of the joints above
    runs = indices()  # whether a lane has not yet finished its run
    is_open = indices()  # whether the solution of a lane is not yet exact


def factorise_joints():
    for joint in range(JOINTS):
        for j in range(LANES):
            joint_stiffness[joint, j] = dtype(is_idle)
    for floor in range(FLOORS):
        for q in range(LINES):
            column = 3 * (floor * MEMBERS_OF_STOREY + q)
            joint = floor * LINES + q
            for j in range(LANES):
                passed[joint, j] = tie[column, j]
                joint_stiffness[joint, j] += tie[column + 2, j]
        for q in range(BEAMS):
            beam = 3 * (floor * MEMBERS_OF_STOREY + LINES + q)
            joint = floor * LINES + q
            for j in range(LANES):
                joint_stiffness[joint, j] += tie[beam, j]
            for j in range(LANES):
                joint_stiffness[joint + 1, j] += tie[beam + 2, j]
    slot("pass_down")
    for joint in range(JOINTS):
        for j in range(LANES):
            joint_stiffness[joint, j] += passed[joint + LINES, j]


def load_joints():
    for joint in range(JOINTS):
        for j in range(LANES):
            joint_load[joint, j] = dtype(0.0)
            if JOINT_LOADS:
                joint_load[joint, j] = terms[FIRST_LOAD + joint, j]
    for floor in range(FLOORS):
        for q in range(LINES):
            column = floor * MEMBERS_OF_STOREY + q
            joint = floor * LINES + q
            for j in range(LANES):
                chord = terms[FIRST_CHORD_STOREY + joint, j] * drift_now[floor, j]
                of_chord = tie[3 * column, j] + tie[3 * column + 1, j]
                passed[joint, j] = bias[2 * column, j] - of_chord * chord
                of_chord_at_end = tie[3 * column + 1, j] + tie[3 * column + 2, j]
                joint_load[joint, j] -= bias[2 * column + 1, j] - of_chord_at_end * chord
        for q in range(BEAMS):
            beam = floor * MEMBERS_OF_STOREY + LINES + q
            joint = floor * LINES + q
            for j in range(LANES):
                joint_load[joint, j] -= bias[2 * beam, j]
            for j in range(LANES):
                joint_load[joint + 1, j] -= bias[2 * beam + 1, j]
    slot("pass_down")
    for joint in range(JOINTS):
        for j in range(LANES):
            joint_load[joint, j] -= passed[joint + LINES, j]
