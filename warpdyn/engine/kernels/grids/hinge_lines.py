"""Lines of the hinges of a frame whose joints are a grid, and the laws of hinges that leave their lines.

In its last accepted state a hinge is on a straight line of its law, which holds between two rotations. A yielding hinge
leaves its line as soon as it turns back, so one of its limits follows its rotation. A hinge beyond its limits is
evaluated by its law: first at the limit, which is on the line, then at its present rotation. It takes the tangent there
as its line for the next solution. Its limits are then set such that it stays outside of them until its state is
accepted. Laws without a function for lines are evaluated in each solution.
"""

import numpy as np

from warpdyn.engine.kernels.hinges.frame_storeys import has_hinge_lines
from warpdyn.engine.laws.springs import spring_row

order = 5

BORROWS = {
    "joint_rotations": ("factorises",),
    "joint_matrix": ("runs",),
    "storey_members": ("largest_moment", "pace"),
    "drift_increments": (
        "present_share",
        "reached_share",
        "pushes",
        "accepts",
        "returns",
        "differing",
        "largest_gap",
        "spring_of_gap",
        "largest_jump",
    ),
    "hinge_failure": ("is_sound",),
}
# Share of the largest moment of the frame. Lines of laws end 1e-4 yield drifts and 1e-6 of the drift before zero. For a
# hinge whose yield moment is 100 times smaller than the largest moment, 2 % of it are near zero.
NEAR_ZERO = 2e-4
LEAST_SLOPE = 1e-9  # of the initial stiffness of a hinge
BEYOND = 1e30  # a limit that no rotation reaches


def wanted(plan):
    return has_hinge_lines(plan)


def values_held(plan):
    return (12 + 2 * spring_row(plan.law).memory) * plan.line_of_thread.hinges


def names(plan):
    import warp as wp

    from warpdyn.engine.device.extrema import clamped
    from warpdyn.engine.kernels.grids.storey_members import first_value
    from warpdyn.engine.kernels.plan import DTYPES

    dtype, line, law = DTYPES[plan.dtype], plan.line_of_thread, spring_row(plan.law)
    return {
        "FIRST_STIFFNESS": first_value(plan) + line.values - line.hinges - plan.storeys_of_thread,
        "clamped": clamped,
        # Shows the compiler that an index is not negative; otherwise it tests this for each lane.
        "NOT_NEGATIVE": 2**30 - 1,
        "KNOWS_LINES": law.line is not None,
        "FAILS_SUDDENLY": "ibarra_medina_krawinkler" in str(plan.law),
        "hinge_memories": wp.types.matrix(shape=(max(1, line.hinges * law.memory), plan.lanes), dtype=dtype),
        "hinge_list": wp.types.vector(length=line.hinges, dtype=wp.int32),
        "same_slope": wp.constant(dtype(4 * np.finfo(plan.dtype).eps)),
        "near_zero": wp.constant(dtype(NEAR_ZERO)),
        "least_slope": wp.constant(dtype(LEAST_SLOPE)),
        "beyond": wp.constant(dtype(BEYOND)),
        **({"line_of": law.line, "memory_along_line": law.memory_along_line} if law.line is not None else {}),
    }


def declare():
    line_slope = end_rows()
    line_intercept = end_rows()
    least_rotation = end_rows()
    most_rotation = end_rows()
    side = end_rows()  # towards which a hinge yields: 1, -1, or 0 if it is elastic
    outside = int(0)
    yielding_hinges = int(0)  # of a GPU's thread
    is_followed = indices()  # whether the present hinge is evaluated in this lane
    leaves_line_now = indices()
    earlier_memory = hinge_memories()  # before a hinge left its line, for a search that returns
    earlier_slope = end_rows()
    earlier_intercept = end_rows()
    earlier_least = end_rows()
    earlier_most = end_rows()  # below the least rotation if the hinge has not left its line
    foreseen_memory = hinge_memories()  # of a hinge outside of its limits: on the line at its last rotation
    foreseen_least = end_rows()  # limits of this line
    foreseen_most = end_rows()  # below the least rotation if the line is not known
    foreseen_side = end_rows()
    renewed = indices()  # hinges with a new line after the state was accepted
    listed_hinge = hinge_list()  # hinges outside of the limits of their lines


def read_spring_row():
    if i >= N:
        line_slope[i - N, j] = terms[FIRST_STIFFNESS + i, j]
        most_rotation[i - N, j] = -beyond
        earlier_most[i - N, j] = -beyond
        foreseen_most[i - N, j] = -beyond


def follow_lines():
    for j in range(LANES):
        differing[j] = 0
        renewed[j] = 0
        largest_gap[j] = dtype(0.0)
        spring_of_gap[j] = STOREYS
        largest_jump[j] = dtype(0.0)
    listed = int(0)
    for hinge in range(HINGES):
        outside = int(0)
        for j in range(LANES):
            present = deformation[N + hinge, j]
            is_inside = present >= least_rotation[hinge, j] and present <= most_rotation[hinge, j]
            outside += wp.where(is_inside or runs[j] == 0, 0, 1)
        if outside > 0:
            listed_hinge[listed] = hinge
            listed += 1
    place = int(0)
    while place < listed:
        followed = listed_hinge[place] & NOT_NEGATIVE
        i = N + followed
        slot("follow_line")
        place += 1
    for j in range(LANES):
        factorises += differing[j]
    slot("judge_increment")
    accepting = int(0)
    returning = int(0)
    for j in range(LANES):
        accepting += accepts[j]
        returning += returns[j]
    place = wp.where(accepting + returning > 0, int(0), listed)
    while place < listed:
        followed = listed_hinge[place] & NOT_NEGATIVE
        i = N + followed
        if accepting > 0:
            slot("accept_line")
        if KNOWS_LINES:
            if returning > 0:
                slot("take_earlier_line")
        place += 1
    if THREADS > 1:
        yielding_hinges = int(0)
        for hinge in range(HINGES):
            yielding_hinges += wp.where(side[hinge, 0] == dtype(0.0), 0, 1)
    slot("drag_lines")
    for j in range(LANES):
        factorises += renewed[j]


def follow_line():
    leaving_now = int(0)
    evaluating = int(0)
    for j in range(LANES):
        rotation = deformation[i, j]
        smallest_rotation = least_rotation[followed, j]
        largest_rotation = most_rotation[followed, j]
        is_within = rotation >= smallest_rotation and rotation <= largest_rotation
        is_followed[j] = wp.where(is_within, 0, pace[j])
        leaves_line_now[j] = wp.where(smallest_rotation <= largest_rotation, is_followed[j], 0)
        leaving_now += leaves_line_now[j]
        if KNOWS_LINES:
            is_foreseen = rotation >= foreseen_least[followed, j] and rotation <= foreseen_most[followed, j]
            limit_left = wp.where(rotation > largest_rotation, largest_rotation, smallest_rotation)
            limit_left = wp.where(leaves_line_now[j] > 0, limit_left, smallest_rotation)
            jump = wp.where(is_followed[j] > 0, wp.abs(rotation - limit_left), dtype(0.0))
            largest_jump[j] = larger(largest_jump[j], jump)
            is_followed[j] = wp.where(is_foreseen and leaves_line_now[j] == 0, 0, is_followed[j])
        evaluating += is_followed[j]
    if KNOWS_LINES:
        if leaving_now > 0:
            slot("go_to_limit")
    if evaluating > 0:
        slot("follow_law")


def follow_law():
    for j in range(LANES):
        slot("storey_coefficients")
        slot("accepted_memory")
        rotation_now = deformation[i, j]
        after = mapped_memory(rotation_now, memory, c) if IS_MAPPING else memory
        moment = followed_of(rotation_now, after, c)
        if KNOWS_LINES:
            slope_ahead, least_ahead, most_ahead, side_ahead = line_of(rotation_now, after, c)
            slope = slope_ahead
        else:
            slope = tangent_of(rotation_now, dtype(0.0), memory, after, c)
        if FAILS_SUDDENLY:
            # Between the last rotation with and the first one without strength there may be no equilibrium.
            is_short = present_share[j] - reached_share[j] <= shortest
            breaks = is_short and is_followed[j] > 0 and moment == dtype(0.0) and slope == dtype(0.0)
            if breaks if THREADS > 1 else ONCE:
                for m in range(M):
                    z[i * M + m, j] = updated(breaks, after[m], memory[m])
                least_rotation[followed, j] = updated(breaks, rotation_now, least_rotation[followed, j])
        smallest_slope = least_slope * terms[FIRST_STIFFNESS + i, j]
        slope = wp.where(wp.abs(slope) < smallest_slope, smallest_slope, slope)
        slope = wp.where(pushes[j] > 0, of_push * terms[FIRST_STIFFNESS + i, j], slope)
        gap = wp.abs(moment - (line_slope[followed, j] * rotation_now + line_intercept[followed, j]))
        changes = is_followed[j] > 0 and not (gap <= balance * largest_moment[j])
        line_slope[followed, j] = updated(changes, slope, line_slope[followed, j])
        line_intercept[followed, j] = updated(changes, moment - slope * rotation_now, line_intercept[followed, j])
        differing[j] += wp.where(changes, 1, 0)
        gap = wp.where(changes, gap, dtype(0.0))
        spring_of_gap[j] = wp.where(gap > largest_gap[j], number_of_spring, spring_of_gap[j])
        largest_gap[j] = larger(largest_gap[j], gap)
        if KNOWS_LINES:
            is_ahead = is_followed[j] > 0
            # Hinges that lose their strength are evaluated in each solution.
            is_known = wp.abs(slope_ahead - line_slope[followed, j]) <= same_slope * terms[FIRST_STIFFNESS + i, j]
            is_known = is_known and wp.abs(slope_ahead) >= smallest_slope
            # Where the moment changes its sign the rules of a law may change, also if the next solution turns back.
            # Lines of deteriorating laws end just before zero moment: the trial and the next solution pass it once.
            left_at = least_rotation[followed, j]
            moment_at_limit = earlier_slope[followed, j] * left_at + earlier_intercept[followed, j]
            is_near_zero = wp.abs(moment_at_limit) <= near_zero * largest_moment[j]
            is_known = is_known and (is_near_zero or moment * moment_at_limit >= dtype(0.0))
            # A hinge that had no line in its last accepted state has not left one.
            is_known = is_known and earlier_least[followed, j] <= earlier_most[followed, j]
            most_ahead = wp.where(is_known, most_ahead, -beyond)
            if is_ahead if THREADS > 1 else ONCE:
                for m in range(M):
                    ahead_now = foreseen_memory[followed * M + m, j]
                    foreseen_memory[followed * M + m, j] = updated(is_ahead, after[m], ahead_now)
                foreseen_least[followed, j] = updated(is_ahead, least_ahead, foreseen_least[followed, j])
                foreseen_most[followed, j] = updated(is_ahead, most_ahead, foreseen_most[followed, j])
                foreseen_side[followed, j] = updated(is_ahead, side_ahead, foreseen_side[followed, j])


def go_to_limit():
    for j in range(LANES):
        slot("storey_coefficients")
        slot("accepted_memory")
        lower_limit = least_rotation[followed, j]
        upper_limit = most_rotation[followed, j]
        limit = clamped(deformation[i, j], lower_limit, upper_limit)
        moment_at_limit = line_slope[followed, j] * limit + line_intercept[followed, j]
        at_limit = memory_along_line(limit, moment_at_limit, memory, c)
        leaves = leaves_line_now[j] > 0
        for m in range(M):
            earlier = earlier_memory[followed * M + m, j]
            earlier_memory[followed * M + m, j] = updated(leaves, memory[m], earlier)
            z[i * M + m, j] = updated(leaves, at_limit[m], memory[m])
        earlier_slope[followed, j] = updated(leaves, line_slope[followed, j], earlier_slope[followed, j])
        earlier_intercept[followed, j] = updated(leaves, line_intercept[followed, j], earlier_intercept[followed, j])
        earlier_least[followed, j] = updated(leaves, lower_limit, earlier_least[followed, j])
        earlier_most[followed, j] = updated(leaves, upper_limit, earlier_most[followed, j])
        least_rotation[followed, j] = updated(leaves, limit, lower_limit)
        most_rotation[followed, j] = updated(leaves, -beyond, upper_limit)
        foreseen_most[followed, j] = updated(leaves, -beyond, foreseen_most[followed, j])


def accept_line():
    evaluating = int(0)
    for j in range(LANES):
        rotation = deformation[i, j]
        smallest_rotation = least_rotation[followed, j]
        is_within = rotation >= smallest_rotation and rotation <= most_rotation[followed, j]
        is_followed[j] = wp.where(is_within, 0, accepts[j])
        if KNOWS_LINES:
            is_foreseen = rotation >= foreseen_least[followed, j] and rotation <= foreseen_most[followed, j]
            leaves_line_now[j] = wp.where(is_foreseen, is_followed[j], 0)
            is_followed[j] -= leaves_line_now[j]
        evaluating += is_followed[j]
    if KNOWS_LINES:
        slot("take_foreseen_line")
    if evaluating > 0:
        slot("accept_law")


def take_foreseen_line():
    for j in range(LANES):
        takes = leaves_line_now[j] > 0
        if takes if THREADS > 1 else ONCE:
            for m in range(M):
                z[i * M + m, j] = updated(takes, foreseen_memory[followed * M + m, j], z[i * M + m, j])
            least_rotation[followed, j] = updated(takes, foreseen_least[followed, j], least_rotation[followed, j])
            most_rotation[followed, j] = updated(takes, foreseen_most[followed, j], most_rotation[followed, j])
            side[followed, j] = updated(takes, foreseen_side[followed, j], side[followed, j])
            earlier_most[followed, j] = updated(takes, -beyond, earlier_most[followed, j])
            foreseen_most[followed, j] = updated(takes, -beyond, foreseen_most[followed, j])


def accept_law():
    for j in range(LANES):
        rotation_now = deformation[i, j]
        slot("storey_coefficients")
        slot("accepted_memory")
        after = mapped_memory(rotation_now, memory, c) if IS_MAPPING else memory
        for m in range(M):
            z[i * M + m, j] = updated(is_followed[j] > 0, after[m], memory[m])
    if KNOWS_LINES:
        slot("take_line")
    elif HINGE_FAILURE:
        for j in range(LANES):
            is_flat = line_slope[followed, j] <= least_slope * terms[FIRST_STIFFNESS + i, j]
            is_lost = is_followed[j] > 0 and is_flat and spring_force[i, j] == dtype(0.0)
            is_sound[i, j] = updated(is_lost, dtype(0.0), is_sound[i, j])


def take_line():
    for j in range(LANES):
        slot("storey_coefficients")
        slot("accepted_memory")
        is_changed = is_followed[j] > 0
        reached_now = deformation[i, j]
        moment = followed_of(reached_now, memory, c)
        slope, next_least, next_most, next_side = line_of(reached_now, memory, c)
        smallest_slope = least_slope * terms[FIRST_STIFFNESS + i, j]
        if HINGE_FAILURE:
            has_failed = is_changed and moment == dtype(0.0) and wp.abs(slope) <= smallest_slope
            is_sound[i, j] = updated(has_failed, dtype(0.0), is_sound[i, j])
        slope = wp.where(wp.abs(slope) < smallest_slope, smallest_slope, slope)
        # The line of the last solution is kept if it is the same, because a new one costs a factorisation.
        of_line = line_slope[followed, j] * reached_now + line_intercept[followed, j]
        is_same = wp.abs(moment - of_line) <= balance * largest_moment[j]
        is_same = is_same and wp.abs(slope - line_slope[followed, j]) <= same_slope * terms[FIRST_STIFFNESS + i, j]
        is_new = is_changed and not is_same
        line_slope[followed, j] = updated(is_new, slope, line_slope[followed, j])
        line_intercept[followed, j] = updated(is_new, moment - slope * reached_now, line_intercept[followed, j])
        lower_limit = least_rotation[followed, j]
        least_rotation[followed, j] = updated(is_changed, next_least, lower_limit)
        upper_limit = most_rotation[followed, j]
        most_rotation[followed, j] = updated(is_changed, next_most, upper_limit)
        side[followed, j] = updated(is_changed, next_side, side[followed, j])
        earlier_most[followed, j] = updated(is_changed, -beyond, earlier_most[followed, j])
        foreseen_most[followed, j] = updated(is_changed, -beyond, foreseen_most[followed, j])
        renewed[j] += wp.where(is_new, 1, 0)


def take_earlier_line():
    for j in range(LANES):
        returns_now = returns[j] > 0 and earlier_least[followed, j] <= earlier_most[followed, j]
        for m in range(M):
            kept = z[i * M + m, j]
            z[i * M + m, j] = updated(returns_now, earlier_memory[followed * M + m, j], kept)
        line_slope[followed, j] = updated(returns_now, earlier_slope[followed, j], line_slope[followed, j])
        line_intercept[followed, j] = updated(returns_now, earlier_intercept[followed, j], line_intercept[followed, j])
        lower_kept = least_rotation[followed, j]
        least_rotation[followed, j] = updated(returns_now, earlier_least[followed, j], lower_kept)
        upper_kept = most_rotation[followed, j]
        most_rotation[followed, j] = updated(returns_now, earlier_most[followed, j], upper_kept)
        earlier_most[followed, j] = updated(returns_now, -beyond, earlier_most[followed, j])
        renewed[j] += wp.where(returns_now, 1, 0)


def drag_lines():
    # Without a yielding hinge no limit moves. On a CPU the test would need a branch for each lane.
    if yielding_hinges > 0 if THREADS > 1 else ONCE:
        slot("drag_limits")


def drag_limits():
    for hinge in range(HINGES):
        for j in range(LANES):
            rotation_reached = deformation[N + hinge, j]
            lower_now = least_rotation[hinge, j]
            upper_now = most_rotation[hinge, j]
            side_now = wp.where(accepts[j] > 0, side[hinge, j], dtype(0.0))
            least_rotation[hinge, j] = updated(side_now > dtype(0.0), rotation_reached, lower_now)
            most_rotation[hinge, j] = updated(side_now < dtype(0.0), rotation_reached, upper_now)


def push_springs():
    # Storeys have no law and no memory.
    for k in range(M):
        for j in range(LANES):
            for floor in range(N):
                z[floor * M + k, j] = dtype(0.0)
