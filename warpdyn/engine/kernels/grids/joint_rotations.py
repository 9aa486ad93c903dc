"""Rotations of joints and hinges of a frame whose joints are a grid, found in each step; the floors are integrated.

Each hinge is on a straight line of its law: moment = slope x rotation + intercept. With these lines the hinges of a
member are eliminated in closed form (`hinged_members.py`), so that the rotations of joints are the only unknowns of a
linear system, which is solved by `joint_band.py` on a CPU and by `joint_relaxation.py` (fish-bones:
`joint_reduction.py`) on a GPU. The solution is exact if no hinge leaves its line, which is the case in most steps; this
is checked for each hinge in each solution. Otherwise `hinge_lines.py` evaluates the laws of the hinges that left their
lines, and `drift_increments.py` decides how the search continues.

This file contains the loop. On a GPU each thread of a warp has the members of one storey (`shared_warp.py`) and the
floor above it (`shared_floors.py`); on a CPU a thread has all storeys.
"""

from warpdyn.engine.kernels.hinges.frame_storeys import has_hinge_lines

order = 5

BORROWS = {
    "storey_members": (
        "largest_moment",
        "drift_now",
        "turn_then",
        "pace",
        "failed_spring",
        "states_found",
        "open_threads",
        "solution",
    ),
    "hinged_members": ("leaving",),
    "joint_matrix": ("solved", "runs", "is_open"),
    "drift_increments": ("accepts", "returns", "present_share"),
}
# Of a step: enough for a few increments of the shortest length, which have up to 132 solutions each.
MOST_SOLUTIONS = 1500
# Largest error of a moment, relative to the largest moment of the sample so far.
TOLERANCE = {"float32": 5e-5, "float64": 1e-9}


def wanted(plan):
    return has_hinge_lines(plan)


def values_held(plan):
    return 2 * plan.line_of_thread.free // plan.frame_storeys.lines + 3


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    dtype = DTYPES[plan.dtype]
    return {
        "balance": wp.constant(dtype(TOLERANCE[plan.dtype])),
        "MOST_SOLUTIONS": MOST_SOLUTIONS,
    }


def declare():
    drift_then = storey_row()  # drifts of the thread's storeys in the last accepted state
    drift_wanted = storey_row()  # drifts in the present state
    factorises = int(1)  # whether a line has changed


def gather_springs():
    slot("find_drifts")
    slot("guess_joints")
    seeking = int(1)
    solution = int(0)
    while seeking > 0 and solution < MOST_SOLUTIONS:
        if THREADS > 1:
            factorises = any_in_warp(factorises)
        if factorises > 0:
            slot("factorise_joints")
            factorises = int(0)
        slot("load_joints")
        slot("solve_joints")
        slot("find_moments")
        open_threads = int(0)
        for j in range(LANES):
            # A lane that seeks a part of the step continues; one that has ended is accepted with the last lane.
            is_partial = wp.where(present_share[j] < dtype(1.0), 1, 0)
            open_threads += wp.where(pace[j] > 0, leaving[j] + is_open[j] + is_partial, runs[j])
        if THREADS > 1:
            open_threads = any_in_warp(open_threads)
        if open_threads > 0:
            slot("follow_lines")
        else:
            seeking = int(0)
            slot("drag_lines")
        solution += 1
    for floor in range(FLOORS):
        for j in range(LANES):
            drift_then[floor, j] = drift_wanted[floor, j]
    states_found += 1


def find_drifts():
    for floor in range(FLOORS):
        for j in range(LANES):
            present_drift = deformation[floor, j]
            if HAS_LOADS:
                present_drift += terms[FIRST_DRIFT + floor, j]
            drift_wanted[floor, j] = present_drift
            drift_now[floor, j] = present_drift


def guess_joints():
    for j in range(LANES):
        # A lane that has finished does not move.
        pace[j] = wp.where((h[j] > dtype(0.0) or states_found == 0) and failed_spring[j] == 0, 1, 0)
        runs[j] = pace[j]
        accepts[j] = pace[j]
        returns[j] = 0
    if JOINT_RELAXATION:
        slot("continue_turns")
    else:
        for joint in range(JOINTS):
            for j in range(LANES):
                turn_then[joint, j] = solved[joint + LINES, j]
