"""The linear system of the joints of a grid on a CPU, where a thread computes all storeys: a banded matrix.

Joints are numbered floor by floor, so the half bandwidth is the number of column lines. The factors are kept until the
line of a hinge changes. Sweeps as in `joint_relaxation.py` would be sequential.
"""

from warpdyn.engine.kernels.hinges.banded_rows import factor_of_row, reduction_of_row, solution_of_row

order = 6

BORROWS = {
    "joint_matrix": ("solved", "joint_load", "joint_stiffness"),
    "storey_members": ("tie", "pace"),
}


def wanted(plan):
    return plan.frame_storeys is not None and plan.sections == 1


def values_held(plan):
    lines, free = plan.frame_storeys.lines, plan.line_of_thread.free
    return (lines + 4) * (free + lines)


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    lines, free = plan.frame_storeys.lines, plan.line_of_thread.free
    dtype, lanes = DTYPES[plan.dtype], plan.lanes
    return {
        "BAND": lines,
        "FACTORISE_BANDED_ROW": factor_of_row(lines),
        "REDUCE_BANDED_ROW": reduction_of_row(lines),
        "SOLVE_BANDED_ROW": solution_of_row(lines).replace("solved[", "found_turn["),
        "factor_rows": wp.types.matrix(shape=((lines + 1) * (free + 2 * lines), lanes), dtype=dtype),
        "found_rows": wp.types.matrix(shape=(free + lines, lanes), dtype=dtype),
    }


def declare():
    lower_factor = factor_rows()
    inverse_pivot = found_rows()
    reduced = found_rows()  # right side after the forward substitution
    found_turn = found_rows()
    entry_now = row()


def factorise_joints():
    for k in range(JOINTS):
        first_place = (BAND + 1) * k
        row_place = (BAND + 1) * (k + BAND)
        of_column = 3 * ((k // LINES) * MEMBERS_OF_STOREY + k % LINES) + 1
        for q in range(BAND):
            for j in range(LANES):
                lower_factor[row_place + q, j] = dtype(0.0)
        if k >= LINES:
            for j in range(LANES):
                lower_factor[row_place, j] = tie[of_column, j]
        if k % LINES > 0:
            for j in range(LANES):
                lower_factor[row_place + BAND - 1, j] += tie[of_column + 3 * BEAMS, j]
        for j in range(LANES):
            lower_factor[row_place + BAND, j] = joint_stiffness[k, j]
            FACTORISE_BANDED_ROW


def solve_joints():
    for k in range(JOINTS):
        row_place = (BAND + 1) * (k + BAND)
        for j in range(LANES):
            entry_now[j] = joint_load[k, j]
            REDUCE_BANDED_ROW
    for down in range(JOINTS):
        k = JOINTS - 1 - down
        row_place = (BAND + 1) * (k + BAND)
        for j in range(LANES):
            SOLVE_BANDED_ROW
            solved[k + LINES, j] = updated(pace[j] > 0, found_turn[k, j], solved[k + LINES, j])
