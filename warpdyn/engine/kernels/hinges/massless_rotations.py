"""Massless rotations of a frame with hinges, found by Newton's method in each stage; the floors are integrated.

With fixed branches of all hinges one solution is exact. The first solution of a stage uses the branches of the last
state, whose unbalanced moments differ from those of the stage only by the change of the drifts; therefore a stage needs
one solution and one evaluation of the hinges if no hinge changes its branch. The moments are always checked. If they do
not balance, `hinge_search.py` continues. The factors of the linear system are kept until a branch changes.

This file contains the loop. `column_line.py` (fish-bones) and `joint_frame.py` with `joint_system.py` (several
bays) contain the moments and the linear system; `hinge_laws.py` contains the laws.
"""

from warpdyn.engine.kernels.hinges.column_storeys import seeks_hinges

order = 5

MOST_SOLUTIONS = 80
# Largest unbalanced moment, relative to the largest moment of the sample so far.
TOLERANCE = {"float32": 5e-5, "float64": 1e-9}


def wanted(plan):
    return seeks_hinges(plan)


def values_held(plan):
    return 3 * plan.pattern.line.rows + 4


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    dtype, line = DTYPES[plan.dtype], plan.pattern.line
    return {
        "balance": wp.constant(dtype(TOLERANCE[plan.dtype])),
        "ROTATIONS": line.rows - 1,  # rows of rotations without the last one, which is 0
        "MOST_SOLUTIONS": MOST_SOLUTIONS,
        "turn_rows": wp.types.matrix(shape=(line.rows, plan.lanes), dtype=dtype),
    }


def declare():
    turn = turn_rows()  # rotations of joints, then those of ends of members or of hinges
    unbalanced = turn_rows()  # moments
    push = turn_rows()  # correction of the rotations
    largest_moment = row()  # of the sample so far
    worst_balance = row()
    largest_turn = row()
    energy_slope = row()  # unbalanced moments times correction
    has_begun = int(0)  # whether the unbalanced moments are those of a state
    factorises = int(1)  # whether a branch has changed


def gather_springs():
    slot("tilt_columns")
    seeking = int(1)
    solution = int(0)
    while seeking > 0 and solution < MOST_SOLUTIONS:
        if has_begun > 0:
            if factorises > 0:
                slot("factorise_line")
            slot("solve_line")
            if solution == 0:
                slot("turn_all")
            else:
                slot("turn_searching")
        slot("follow_hinges")
        slot("unbalance_line")
        slot("judge_balance")
        has_begun = 1
        solution += 1
    slot("end_balance")


def restore():
    f = spring_force[i, j]
