"""Rotations of a fish-bone frame with elastic columns and bilinear hinges, found in each stage.

A hinge and the half-beam in series with it are one bilinear spring between the joint and the ground: of the initial
stiffness k = S K / (S + K), with the stiffnesses S of the half-beam and K of the hinge, of the tangent after yielding
from the same formula, and of the yield moment of the hinge. The rotations of joints are the only unknowns. Each spring
is on one of three straight branches; with fixed branches one solution of the tridiagonal system is exact. The first
solution uses the branches of the last state. The next ones use those that were found, until no moment changes by more
than the tolerance.

Hardening is not negative, so the state of equilibrium is the minimum of a convex energy. If solutions alternate between
branches, the joints are brought into equilibrium one after the other, in sweeps from the base to the top. The sweeps
converge, because each joint lowers the energy; one divides the error by more than 4 if shear deformation is small.
A sample that needs more than MOST_SWEEPS has the status not_converged.
"""

from warpdyn.engine.kernels.hinges.column_storeys import has_joint_springs

order = 5

# Largest error of a moment, relative to the largest mean moment at the ends of a column so far.
TOLERANCE = {"float32": 5e-5, "float64": 1e-9}
MOST_SOLUTIONS = 20
MOST_SWEEPS = 2000

FIELDS = {"Output": {"spring_without_equilibrium": "int32[]"}}
OF_HINGES = {"spring", "history", "residual"}  # recorders that read rotations or moments of hinges


def wanted(plan):
    return has_joint_springs(plan)


def values_held(plan):
    return 10 * (plan.dofs + 1)


def names(plan):
    import warp as wp

    from warpdyn.engine.device.extrema import limited
    from warpdyn.engine.device.quotients import reciprocal
    from warpdyn.engine.device.warp_exchange import number_at
    from warpdyn.engine.kernels.lumped.pattern import PLACES_OF_STOREY, VALUES_OF_STOREY
    from warpdyn.engine.kernels.plan import DTYPES
    from warpdyn.engine.laws.bilinear.parameters import Coefficient

    dtype, line, lanes = DTYPES[plan.dtype], plan.pattern.line, plan.lanes
    hinges = [line.base_hinge, *line.springs[PLACES_OF_STOREY - 1 :: PLACES_OF_STOREY]]
    return {
        "limited": limited,
        "reciprocal": reciprocal,
        "balance": wp.constant(dtype(TOLERANCE[plan.dtype])),
        "MOST_SOLUTIONS": MOST_SOLUTIONS,
        "MOST_SWEEPS": MOST_SWEEPS,
        "JOINTS": line.storeys + 1,
        "FIRST_JOINT": 0 if line.base_hinge >= 0 else 1,  # that rotates
        "VALUES": VALUES_OF_STOREY,
        "FIRST_OF_LINE": plan.pattern.first_of_line,
        "KEEPS_HINGES": bool(OF_HINGES & set(plan.recorders)),
        "ONE_LANE": lanes == 1,
        "HARDENING_STIFFNESS": int(Coefficient.HARDENING_STIFFNESS),
        "YIELDING_STIFFNESS": int(Coefficient.YIELDING_STIFFNESS),
        "YIELD_DRIFT": int(Coefficient.YIELD_DRIFT),
        "hinge_of_joint": number_at(hinges),
        "joint_of_spring": number_at(
            [hinges.index(spring) if spring in hinges else 0 for spring in range(plan.springs_of_thread)]
        ),
        "joint_rows": wp.types.matrix(shape=(line.storeys + 1, lanes), dtype=dtype),
    }


def declare():
    # Each spring is an elastic one (hardening) and an elastic-perfectly-plastic one (yielding) in parallel.
    hardening = joint_rows()
    stiffness_of_joint = joint_rows()  # of its columns and the elastic spring
    yielding = joint_rows()  # stiffness
    yield_rotation = joint_rows()
    plastic = joint_rows()  # plastic rotation of the accepted state
    # The branch of a spring: moment = hardening x turn + yielding x (elastic_share x turn - offset). The elastic share
    # is 1 or, if the spring yields, 0. The offset is then its yield rotation, with the opposite sign of its moment.
    elastic_share = joint_rows()
    offset = joint_rows()
    turn = joint_rows()
    reduced = joint_rows()
    inverse_pivot = joint_rows()
    half_of_ends = matrix()  # 0.5 times the stiffness of a column if both ends rotate
    twice_chord = matrix()  # 2 times the rotation of a column's chord per drift
    chord_moment = matrix()  # at both ends of a column whose joints do not rotate
    largest_moment = row()  # mean moment at the ends of a column, so far
    allowed_share = row()  # of this moment: the allowed gap
    allowed_gap = row()
    largest_gap = row()  # change of a moment by the last solution, divided by the largest stiffness of half-beams
    stiffness_of_beams = row()  # the largest one of half-beams and their hinges
    weight_of_base = row()  # its stiffness divided by that of half-beams
    seeks = indices()  # whether a lane seeks its rotations
    joint_of_gap = indices(FIRST_JOINT)
    unsolved = indices()  # 1 + the hinge without equilibrium
    states_found = int(0)


def read_storey():
    column = FIRST_OF_LINE + VALUES * i
    half_of_ends[i, j] = dtype(0.5) * (terms[column, j] + terms[column + 1, j])
    twice_chord[i, j] = dtype(2.0) * terms[column + 3, j]
    stiffness_of_joint[i, j] += terms[column, j]
    stiffness_of_joint[i + 1, j] += terms[column, j]


def read_spring_row():
    if i >= N:
        slot("storey_coefficients")
        joint = joint_of_spring(i)
        initial = c[HARDENING_STIFFNESS] + c[YIELDING_STIFFNESS]
        yield_moment = initial * c[YIELD_DRIFT]
        hardening[joint, j] = c[HARDENING_STIFFNESS]
        if joint > 0:
            half_beam = terms[FIRST_OF_LINE + VALUES * (joint - 1) + 2, j]
            after_yielding = c[HARDENING_STIFFNESS]
            hardening[joint, j] = half_beam * after_yielding / (half_beam + after_yielding)
            initial = half_beam * initial / (half_beam + initial)
        yielding[joint, j] = initial - hardening[joint, j]
        yield_rotation[joint, j] = yield_moment / initial
        elastic_share[joint, j] = dtype(1.0)
        stiffness_of_joint[joint, j] += hardening[joint, j]
        if joint > 0:
            stiffness_of_beams[j] = larger(stiffness_of_beams[j], yielding[joint, j])
        # Right only after the last spring, because the largest stiffness is then known.
        allowed_share[j] = balance / stiffness_of_beams[j]
        weight_of_base[j] = yielding[0, j] / stiffness_of_beams[j]


def gather_springs():
    seeking = int(0)
    for j in range(LANES):
        # A lane that has finished keeps its state.
        seeks[j] = wp.where(h[j] > dtype(0.0) or states_found == 0, 1, 0)
        seeking += seeks[j]
        allowed_gap[j] = allowed_share[j] * largest_moment[j]
    for floor in range(N):
        for j in range(LANES):
            chord_moment[floor, j] = half_of_ends[floor, j] * (twice_chord[floor, j] * deformation[floor, j])
    solution = int(0)
    while seeking > 0 and solution < MOST_SOLUTIONS:
        slot("solve_joint_springs")
        slot("judge_gap")
        solution += 1
    if seeking > 0:
        slot("relax_joint_springs")
    states_found += 1
    slot("find_shears_of_columns")


def judge_gap():
    seeking = int(0)
    for j in range(LANES):
        seeks[j] = wp.where(largest_gap[j] > allowed_gap[j], seeks[j], 0)
        seeking += seeks[j]


def solve_joint_springs():
    for joint in range(FIRST_JOINT, JOINTS):
        for j in range(LANES):
            pivot = stiffness_of_joint[joint, j] + elastic_share[joint, j] * yielding[joint, j]
            moment_sum = yielding[joint, j] * offset[joint, j]
            slot("add_chord_moments")
            if joint > FIRST_JOINT:
                between = terms[FIRST_OF_LINE + VALUES * (joint - 1) + 1, j]
                share = between * inverse_pivot[joint - 1, j]
                pivot -= share * between
                moment_sum -= share * reduced[joint - 1, j]
            inverse_pivot[joint, j] = reciprocal(pivot)
            reduced[joint, j] = moment_sum
    for j in range(LANES):
        largest_gap[j] = dtype(0.0)
    for down in range(JOINTS - FIRST_JOINT):
        joint = JOINTS - 1 - down
        for j in range(LANES):
            moment_left = reduced[joint, j]
            if joint < N:
                moment_left -= terms[FIRST_OF_LINE + VALUES * joint + 1, j] * turn[joint + 1, j]
            turn_now = moment_left * inverse_pivot[joint, j]
            back = plastic[joint, j] - turn_now
            back_limited = limited(back, yield_rotation[joint, j])
            gap_now = back_limited - (offset[joint, j] - elastic_share[joint, j] * turn_now)
            if joint == 0:
                gap_now *= weight_of_base[j]
            largest_gap[j] = larger(largest_gap[j], wp.abs(gap_now))
            slot("store_turn")


def add_chord_moments():
    if joint > 0:
        moment_sum += chord_moment[joint - 1, j]
    if joint < N:
        moment_sum += chord_moment[joint, j]


def store_turn():
    is_elastic = back_limited == back
    share_now = wp.where(is_elastic, dtype(1.0), dtype(0.0))
    offset_now = wp.where(is_elastic, plastic[joint, j], back_limited)
    if ONE_LANE:
        turn[joint, j] = turn_now
        elastic_share[joint, j] = share_now
        offset[joint, j] = offset_now
    else:
        turn[joint, j] = updated(seeks[j] > 0, turn_now, turn[joint, j])
        elastic_share[joint, j] = updated(seeks[j] > 0, share_now, elastic_share[joint, j])
        offset[joint, j] = updated(seeks[j] > 0, offset_now, offset[joint, j])


def relax_joint_springs():
    while seeking > 0 and solution < MOST_SOLUTIONS + MOST_SWEEPS:
        for j in range(LANES):
            largest_gap[j] = dtype(0.0)
        for joint in range(FIRST_JOINT, JOINTS):
            for j in range(LANES):
                moment_sum = dtype(0.0)
                slot("add_chord_moments")
                if joint > 0:
                    moment_sum -= terms[FIRST_OF_LINE + VALUES * (joint - 1) + 1, j] * turn[joint - 1, j]
                if joint < N:
                    moment_sum -= terms[FIRST_OF_LINE + VALUES * joint + 1, j] * turn[joint + 1, j]
                initial = stiffness_of_joint[joint, j] + yielding[joint, j]
                back = plastic[joint, j] - (moment_sum + yielding[joint, j] * plastic[joint, j]) / initial
                back_limited = limited(back, yield_rotation[joint, j])
                turn_now = (moment_sum + yielding[joint, j] * back_limited) / stiffness_of_joint[joint, j]
                gap = initial * wp.abs(turn_now - turn[joint, j]) / stiffness_of_beams[j]
                joint_of_gap[j] = wp.where(gap > largest_gap[j], joint, joint_of_gap[j])
                largest_gap[j] = larger(largest_gap[j], gap)
                slot("store_turn")
        slot("judge_gap")
        solution += 1
    for j in range(LANES):
        if seeks[j] > 0 and unsolved[j] == 0:
            unsolved[j] = 1 + hinge_of_joint(joint_of_gap[j])


def find_shears_of_columns():
    for floor in range(N):
        for j in range(LANES):
            mean_moment = chord_moment[floor, j] - half_of_ends[floor, j] * (turn[floor, j] + turn[floor + 1, j])
            largest_moment[j] = larger(largest_moment[j], wp.abs(mean_moment))
            spring_force[floor, j] = twice_chord[floor, j] * mean_moment
    if KEEPS_HINGES:
        for joint in range(FIRST_JOINT, JOINTS):
            hinge = hinge_of_joint(joint)
            for j in range(LANES):
                elastic_part = elastic_share[joint, j] * turn[joint, j] - offset[joint, j]
                moment_of_joint = hardening[joint, j] * turn[joint, j] + yielding[joint, j] * elastic_part
                if joint > 0:  # the rotations of the hinge and of the half-beam add up to that of the joint
                    rotation_of_beam = moment_of_joint / terms[FIRST_OF_LINE + VALUES * (joint - 1) + 2, j]
                    deformation[hinge, j] = rotation_of_beam - turn[joint, j]
                    spring_force[hinge, j] = -moment_of_joint
                else:
                    deformation[hinge, j] = turn[joint, j]
                    spring_force[hinge, j] = moment_of_joint


def end_step():
    for joint in range(FIRST_JOINT, JOINTS):
        for j in range(LANES):
            yields = elastic_share[joint, j] == dtype(0.0)
            plastic[joint, j] = updated(yields, turn[joint, j] + offset[joint, j], plastic[joint, j])


def restore():
    f = spring_force[i, j]


def judge_state():
    if unsolved[j] > 0:
        status = not_converged


def write():
    output.spring_without_equilibrium[o] = unsolved[j] - 1
