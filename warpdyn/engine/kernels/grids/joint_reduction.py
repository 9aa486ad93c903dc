"""The linear system of the joints of a fish-bone on a GPU, where each thread has one joint: cyclic reduction.

The matrix is tridiagonal and symmetric. Each level of the reduction eliminates the two joints at a distance of 1, 2, 4
... storeys from the equation of every joint, which doubles this distance, until each equation contains its own joint
only. The factors are kept until the line of a hinge changes.
"""

order = 6

BORROWS = {
    "joint_matrix": ("solved", "joint_load", "joint_stiffness"),
    "storey_members": ("tie", "pace"),
    "shared_warp": ("section", "thread", "thread_above", "thread_below"),
}


def wanted(plan):
    return plan.frame_storeys is not None and plan.sections > 1 and plan.frame_storeys.lines == 1


def values_held(plan):
    return 2 * levels(plan) + 6


def levels(plan):
    """Return the number of levels: the distance is then at least the number of storeys."""
    return (plan.sections - 1).bit_length()


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    return {
        "LEVELS": levels(plan),
        "level_rows": wp.types.matrix(shape=(levels(plan), plan.lanes), dtype=DTYPES[plan.dtype]),
    }


def declare():
    share_below = level_rows()  # of the equation of the joint below that is added to that of the thread's joint
    share_above = level_rows()
    inverse_pivot = row()  # of the last equation
    coupling_below = row()  # entries of the present equation besides the diagonal
    coupling_upwards = row()
    distance = int(1)  # storeys between the joints of the present equation
    neighbour_below = int(0)
    neighbour_above = int(0)


def find_neighbours():
    # The thread itself, if there is no joint: its coupling is 0 then.
    neighbour_below = thread - wp.where(section >= distance, distance, 0)
    neighbour_above = thread + wp.where(section + distance < THREADS, distance, 0)


def factorise_joints():
    for j in range(LANES):
        coupling_upwards[j] = from_thread(tie[1, j], thread_above)
        coupling_below[j] = wp.where(section > 0, tie[1, j], dtype(0.0))
        coupling_upwards[j] = wp.where(section < THREADS - 1, coupling_upwards[j], dtype(0.0))
        pivot = joint_stiffness[0, j]
        distance = int(1)
        for level in range(LEVELS):
            slot("find_neighbours")
            inverse_pivot[j] = reciprocal(pivot)
            share_below[level, j] = -coupling_below[j] * from_thread(inverse_pivot[j], neighbour_below)
            share_above[level, j] = -coupling_upwards[j] * from_thread(inverse_pivot[j], neighbour_above)
            # The matrix is symmetric: the neighbours have the same couplings with this joint.
            pivot += share_below[level, j] * coupling_below[j] + share_above[level, j] * coupling_upwards[j]
            farther_below = from_thread(coupling_below[j], neighbour_below)
            farther_above = from_thread(coupling_upwards[j], neighbour_above)
            coupling_below[j] = share_below[level, j] * farther_below
            coupling_upwards[j] = share_above[level, j] * farther_above
            distance = distance + distance
        inverse_pivot[j] = reciprocal(pivot)


def exchange_turns():
    for j in range(LANES):
        solved[0, j] = from_thread(solved[1, j], thread_below)
        solved[2, j] = from_thread(solved[1, j], thread_above)


def solve_joints():
    for j in range(LANES):
        reduced_load = joint_load[0, j]
        distance = int(1)
        for level in range(LEVELS):
            slot("find_neighbours")
            load_below = from_thread(reduced_load, neighbour_below)
            load_above = from_thread(reduced_load, neighbour_above)
            reduced_load += share_below[level, j] * load_below + share_above[level, j] * load_above
            distance = distance + distance
        solved[1, j] = updated(pace[j] > 0, reduced_load * inverse_pivot[j], solved[1, j])
    slot("exchange_turns")
