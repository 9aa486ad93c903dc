"""Half-beams of a fish-bone frame: members with a hinge at the joint, whose other end rotates freely.

With the bending stiffness S of the half-beam, the rotation p of its joint and the line K x + c of its hinge, the moment
at the joint is m = S (p + x) = -(K x + c). Therefore m = (S K p - S c) / (S + K), and x = m / S - p.
"""

from warpdyn.engine.kernels.grids.storey_members import first_value
from warpdyn.engine.kernels.hinges.layout import VALUES_OF_MEMBER

order = 6

BORROWS = {
    "joint_matrix": ("solved", "runs", "joint_stiffness", "joint_load"),
    "storey_members": ("largest_moment", "grown", "is_idle"),
    "hinged_members": ("leaving",),
    "hinge_lines": ("line_slope", "line_intercept", "least_rotation", "most_rotation"),
}


def wanted(plan):
    return plan.frame_storeys is not None and plan.frame_storeys.half_beams > 0


def values_held(plan):
    return 3 * plan.frame_storeys.half_beams // plan.sections


def names(plan):
    line, count = plan.line_of_thread, plan.frame_storeys.half_beams // plan.sections
    first = first_value(plan) + line.first("member")
    return {
        "FIRST_HALF_BEAM": first + VALUES_OF_MEMBER * (line.members - count),
        "FIRST_HINGE_OF_HALF_BEAM": line.hinges - count,
    }


def declare():
    stiffness_in_series = storey_row()  # of the half-beam and its hinge
    moment_at_rest = storey_row()  # of the half-beam if its joint does not rotate
    give_of_half_beam = storey_row()  # 1 / S; 0 in an idle thread, which has no half-beam


def read_sample():
    if is_idle == 0:
        for floor in range(FLOORS):
            give_of_half_beam[floor, j] = dtype(1.0) / terms[FIRST_HALF_BEAM + VALUES_OF_MEMBER * floor, j]


def factorise_joints():
    for floor in range(FLOORS):
        hinge = FIRST_HINGE_OF_HALF_BEAM + floor
        for j in range(LANES):
            own_stiffness = terms[FIRST_HALF_BEAM + VALUES_OF_MEMBER * floor, j]
            of_hinge = line_slope[hinge, j]
            share = own_stiffness * reciprocal(own_stiffness + of_hinge)
            stiffness_in_series[floor, j] = share * of_hinge
            moment_at_rest[floor, j] = -share * line_intercept[hinge, j]
            joint_stiffness[floor, j] += share * of_hinge


def load_joints():
    for floor in range(FLOORS):
        for j in range(LANES):
            joint_load[floor, j] -= moment_at_rest[floor, j]


def find_moments_of_half_beams():
    for floor in range(FLOORS):
        hinge = FIRST_HINGE_OF_HALF_BEAM + floor
        i = N + hinge
        for j in range(LANES):
            turn_of_joint = solved[floor + LINES, j]
            at_joint = stiffness_in_series[floor, j] * turn_of_joint + moment_at_rest[floor, j]
            rotation_of_hinge = give_of_half_beam[floor, j] * at_joint - turn_of_joint
            if THREADS > 1:
                stays_on_line = rotation_of_hinge >= least_rotation[hinge, j]
                stays_on_line = stays_on_line and rotation_of_hinge <= most_rotation[hinge, j]
                leaving[j] = wp.where(stays_on_line, leaving[j], 1)
            else:
                below_limit = least_rotation[hinge, j] - rotation_of_hinge
                above_limit = rotation_of_hinge - most_rotation[hinge, j]
                leaving[j] += wp.where(maximum(below_limit, above_limit) <= dtype(0.0), 0, 1)
            moves_now = runs[j] > 0 if KEEPS_HINGES else ONCE
            deformation[i, j] = updated(moves_now, rotation_of_hinge, deformation[i, j])
            spring_force[i, j] = updated(moves_now, -at_joint, spring_force[i, j])
            if THREADS > 1:
                grown = wp.where(wp.abs(at_joint) > largest_moment[j], 1, grown)
            largest_moment[j] = larger(largest_moment[j], wp.abs(at_joint))
