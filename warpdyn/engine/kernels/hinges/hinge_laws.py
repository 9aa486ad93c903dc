"""Laws of the hinges of a frame: moment and slope at a trial rotation, from the memory of the accepted state.

Laws with straight branches are evaluated on the branch of the last state first; lanes that leave it are evaluated again
by all rules. The branch's slope is used in the linear system until it changes.
"""

from warpdyn.engine.kernels.hinges.column_storeys import seeks_hinges
from warpdyn.engine.laws.springs import spring_row

order = 5

BORROWS = {"massless_rotations": ("turn", "factorises"), "hinge_failure": ("is_sound",)}
LEAST_SLOPE = 1e-9  # of the initial stiffness of a hinge, in the matrix only


def wanted(plan):
    return seeks_hinges(plan)


def values_held(plan):
    return 2 * plan.pattern.springs


def names(plan):
    import warp as wp

    from warpdyn.engine.device.warp_exchange import number_at
    from warpdyn.engine.kernels.plan import DTYPES

    dtype, line, law = DTYPES[plan.dtype], plan.pattern.line, spring_row(plan.law)
    hinges = [spring for spring in line.springs if spring >= 0]
    nonlinear = [spring for spring in hinges if spring not in line.linear]
    rows = [line.rows_of(spring) for spring in (*nonlinear, *line.linear)]
    has_branches = law.leaves_line is not None
    of_branches = {
        "memory_on_line": law.memory_on_line,
        "leaves_line": law.leaves_line,
        "tangent_on_line": law.tangent_on_line,
    }
    return {
        "HINGES": len(nonlinear),
        "LINEAR_HINGES": len(line.linear),
        "FIRST_STIFFNESS": plan.pattern.first_of_line + line.values - line.hinges - plan.dofs,
        "HAS_BRANCHES": has_branches,
        "CHANGED": law.values_on_line or law.memory,
        "least_slope": wp.constant(dtype(LEAST_SLOPE)),
        "hinge_spring": number_at([*nonlinear, *line.linear]),
        "hinge_end": number_at([end for end, _ in rows]),
        "hinge_joint": number_at([joint for _, joint in rows]),
        **(of_branches if has_branches else {}),
    }


def declare():
    first_slope = spring_rows()  # initial stiffness of the hinges
    hinge_slope = spring_rows()
    memory_then = memories()  # of the last evaluation
    has_left = indices()  # whether a hinge leaves its branch
    trial_slope = row()
    changed_branch = row()  # largest change of a slope


def read_spring_row():
    if i >= N:
        first_slope[i, j] = terms[FIRST_STIFFNESS + i, j]
        hinge_slope[i, j] = first_slope[i, j]


def follow_hinges():
    for j in range(LANES):
        changed_branch[j] = dtype(0.0)
    for hinge in range(HINGES):
        i = hinge_spring(hinge)
        end_of_hinge = hinge_end(hinge)
        joint_of_hinge = hinge_joint(hinge)
        if HAS_BRANCHES:
            for j in range(LANES):
                deformation[i, j] = turn[end_of_hinge, j] - turn[joint_of_hinge, j]
            slot("follow_branches")
        for j in range(LANES):
            if HAS_BRANCHES:
                slope_now = trial_slope[j]
            else:
                slot("storey_coefficients")
                slot("accepted_memory")
                rotation = turn[end_of_hinge, j] - turn[joint_of_hinge, j]
                deformation[i, j] = rotation
                after = mapped_memory(rotation, memory, c) if IS_MAPPING else memory
                spring_force[i, j] = followed_of(rotation, after, c)
                slope_now = tangent_of(rotation, dtype(0.0), memory, after, c)
                for m in range(M):
                    memory_then[i * M + m, j] = after[m]
            least = least_slope * first_slope[i, j]
            slope_now = wp.where(wp.abs(slope_now) < least, least, slope_now)
            changed_branch[j] = larger(changed_branch[j], wp.abs(slope_now - hinge_slope[i, j]))
            hinge_slope[i, j] = slope_now
    for hinge in range(HINGES, HINGES + LINEAR_HINGES):
        i = hinge_spring(hinge)
        end_of_hinge = hinge_end(hinge)
        joint_of_hinge = hinge_joint(hinge)
        for j in range(LANES):
            rotation = turn[end_of_hinge, j] - turn[joint_of_hinge, j]
            deformation[i, j] = rotation
            spring_force[i, j] = first_slope[i, j] * rotation
    changes = int(0)
    for j in range(LANES):
        changes += wp.where(changed_branch[j] == dtype(0.0), 0, 1)
    if changes > 0:
        factorises = int(1)


def follow_branches():
    leaving = int(0)
    for j in range(LANES):
        slot("storey_coefficients")
        slot("accepted_memory")
        has_left[j] = wp.where(leaves_line(deformation[i, j], memory, c), 1, 0)
        leaving += has_left[j]
        after = memory_on_line(deformation[i, j], memory, c)
        spring_force[i, j] = held_of(deformation[i, j], after, c)
        trial_slope[j] = tangent_on_line(deformation[i, j], memory, c)
    if leaving > 0:
        for j in range(LANES):
            if has_left[j] > 0:
                slot("storey_coefficients")
                slot("accepted_memory")
                after = mapped_memory(deformation[i, j], memory, c)
                spring_force[i, j] = held_of(deformation[i, j], after, c)
                trial_slope[j] = tangent_of(deformation[i, j], dtype(0.0), memory, after, c)


def push_springs():
    # Storeys and linear hinges have no law and no memory.
    for k in range(M):
        for j in range(LANES):
            for floor in range(N):
                z[floor * M + k, j] = dtype(0.0)


def end_step():
    slot("accept_hinges")


def accept_hinges():
    if HINGE_FAILURE:
        for hinge in range(HINGES):
            i = hinge_spring(hinge)
            for j in range(LANES):
                is_flat = hinge_slope[i, j] <= least_slope * first_slope[i, j]
                is_lost = is_flat and spring_force[i, j] == dtype(0.0)
                is_sound[i, j] = updated(is_lost, dtype(0.0), is_sound[i, j])
    for hinge in range(HINGES):
        i = hinge_spring(hinge)
        if HAS_BRANCHES:
            leaving = int(0)
            for j in range(LANES):
                slot("storey_coefficients")
                slot("accepted_memory")
                has_left[j] = wp.where(leaves_line(deformation[i, j], memory, c), 1, 0)
                leaving += has_left[j]
                after = memory_on_line(deformation[i, j], memory, c)
                for m in range(CHANGED):
                    z[i * M + m, j] = updated(has_left[j] == 0, after[m], memory[m])
            if leaving > 0:
                for j in range(LANES):
                    if has_left[j] > 0:
                        slot("storey_coefficients")
                        slot("accepted_memory")
                        after = mapped_memory(deformation[i, j], memory, c)
                        for m in range(M):
                            z[i * M + m, j] = after[m]
        else:  # lanes in the inner loop, because a CPU would otherwise gather and scatter single values
            for m in range(M):
                for j in range(LANES):
                    z[i * M + m, j] = memory_then[i * M + m, j]
