"""A frame with several bays and hinges: its massless displacements, found in each stage.

Unknowns are the rotations of joints, the vertical displacements of joints over a length, and the rotations of hinges.
The floors' displacements are known in a stage. The moments at both ends of a member are K (z + r): K is its bending
stiffness, z the rotations of its joints relative to its chord, r those of its hinges. With flexibilities f of the
hinges, the hinges are eliminated in closed form: the member's stiffness is K E with E = (1 + f K)^-1. The remaining
matrix is factorised as L D L^T, row by row, without the zeros before the first entry of each row.

Stiffness that does not depend on hinges (axial stiffness of members, braces, springs of supports, members without
hinges) is a list of entries of a symmetric matrix. Forces of all members on the floors are added up to storey shears.

`massless_rotations.py` contains the loop over solutions, `hinge_laws.py` the laws.
"""

from warpdyn.engine.kernels.hinges.layout import VALUES_OF_MEMBER, JointFrame

order = 5

BORROWS = {
    "massless_rotations": (
        "turn",
        "unbalanced",
        "push",
        "largest_moment",
        "worst_balance",
        "largest_turn",
        "energy_slope",
        "factorises",
    ),
    "hinge_laws": ("first_slope", "hinge_slope"),
    "hinge_search": ("pace",),
}


def wanted(plan):
    return plan.pattern is not None and isinstance(plan.pattern.line, JointFrame)


def values_held(plan):
    line = plan.pattern.line
    return line.entries + line.free + 6 * line.members + 3 * line.storeys + line.values


def names(plan):
    import warp as wp

    from warpdyn.engine.device.warp_exchange import number_at
    from warpdyn.engine.kernels.plan import DTYPES

    dtype, line, lanes = DTYPES[plan.dtype], plan.pattern.line, plan.lanes
    bases, zero = line.bases, line.rows - 1
    place = {(row, column): bases[row] + column for row in range(line.free) for column in range(row + 1)}

    def entry(row, column):
        return place[max(row, column), min(row, column)]

    of_joints, of_chords, first_of_chords, ends_of_chords = [], [], [0], []
    pairs, first_of_pairs, chord = [], [0], 0
    for member, rows in enumerate(line.chords):
        start, end = line.joints[2 * member : 2 * member + 2]
        for row, column in ((start, start), (start, end), (end, end)):
            # Entries of supports are added to an unused place behind the matrix.
            of_joints.append(entry(row, column) if max(row, column) < zero else line.entries)
        for first, row in enumerate(rows):
            for kind, joint in enumerate((start, end)):
                if joint < zero:
                    # An entry on the diagonal gets the product twice.
                    for _ in range(1 + (row == joint)):
                        of_chords.append(entry(row, joint))
                        ends_of_chords.append((chord + first, kind))
            for second, column in enumerate(rows[: first + 1]):
                pairs.append((entry(row, column), chord + first, chord + second))
        first_of_chords.append(len(of_chords))
        first_of_pairs.append(len(pairs))
        chord += len(rows)
    chord_rows = [row for rows in line.chords for row in rows]
    chord_storeys = [storey for storeys in line.chord_storeys for storey in storeys]

    def starts(lists):
        found = [0]
        for each in lists:
            found.append(found[-1] + len(each))
        return found

    first = plan.pattern.first_of_line
    return {
        "FREE": line.free,
        "ENTRIES": line.entries,
        "ZERO": zero,
        "UNUSED": line.unused,
        "MEMBERS": line.members,
        "VALUES_OF_MEMBER": VALUES_OF_MEMBER,
        "FIRST_MEMBER": first + line.first("member"),
        "MEMBER_LOADS": line.has_member_loads,
        "FIRST_MEMBER_LOAD": first + line.first("member_load"),
        "CHORDS": len(chord_rows),
        "FIRST_CHORD": first + line.first("chord"),
        "FIRST_CHORD_STOREY": first + line.first("chord_storey"),
        "BETWEEN_ROWS": len(line.between_rows),
        "FIRST_BETWEEN_ROWS": first + line.first("between_rows"),
        "WITH_STOREYS": len(line.with_storeys),
        "FIRST_WITH_STOREYS": first + line.first("with_storeys"),
        "BETWEEN_STOREYS": len(line.between_storeys),
        "FIRST_BETWEEN_STOREYS": first + line.first("between_storeys"),
        "LOADS": len(line.loads),
        "HAS_LOADS": bool(line.lengths["moment"]),
        "FIRST_LOAD": first + line.first("load"),
        "FIRST_DRIFT": first + line.first("drift"),
        "FIRST_SHEAR": first + line.first("shear"),
        "LEAST_MOMENT": first + line.first("moment"),
        "base_of_row": number_at(bases),
        "first_column": number_at(line.first_columns),
        "joint_of": number_at(line.joints),
        "end_of": number_at(line.ends),
        "spring_at": number_at(line.springs),
        "first_of_member": number_at(starts(line.chords)),
        "chord_row": number_at(chord_rows),
        "first_storey_of_member": number_at(starts(line.chord_storeys)),
        "chord_storey": number_at(chord_storeys),
        "entry_of_joints": number_at(of_joints),
        "first_of_chords": number_at(first_of_chords),
        "entry_of_chord": number_at(of_chords),
        "chord_of_entry": number_at([each for each, _ in ends_of_chords]),
        "end_of_entry": number_at([each for _, each in ends_of_chords]),
        "first_of_pairs": number_at(first_of_pairs),
        "entry_of_pair": number_at([each for each, _, _ in pairs]),
        "pair_row": number_at([each for _, each, _ in pairs]),
        "pair_column": number_at([each for _, _, each in pairs]),
        "linear_entry": number_at([entry(*each) for each in line.between_rows]),
        "linear_row": number_at([row for row, _ in line.between_rows]),
        "linear_column": number_at([column for _, column in line.between_rows]),
        "mixed_row": number_at([row for row, _ in line.with_storeys]),
        "mixed_storey": number_at([storey for _, storey in line.with_storeys]),
        "upper_storey": number_at([storey for storey, _ in line.between_storeys]),
        "lower_storey": number_at([storey for _, storey in line.between_storeys]),
        "load_row": number_at(line.loads),
        "entry_rows": wp.types.matrix(shape=(line.entries + 1, lanes), dtype=dtype),
        "free_rows": wp.types.matrix(shape=(max(1, line.free), lanes), dtype=dtype),
        "pair_rows": wp.types.matrix(shape=(max(1, 2 * line.members), lanes), dtype=dtype),
        "share_rows": wp.types.matrix(shape=(max(1, 4 * line.members), lanes), dtype=dtype),
        "sum_rows": wp.types.matrix(shape=(2, lanes), dtype=dtype),
    }


def declare():
    lower_factor = entry_rows()  # the matrix, then its factor L
    inverse_pivot = free_rows()
    entry_now = row()
    drift_then = matrix()  # drifts to which the unbalanced moments belong
    drift_now = matrix()
    softness = pair_rows()  # flexibility of the hinges at both ends of the members
    share_of_ends = share_rows()  # E of each member: rotation of an end relative to the chord per rotation of a joint
    row_sum = sum_rows()  # moments at both ends of a member per rotation of its chord
    chord_turn = row()  # of a member
    moment_sum = row()  # of both ends of a member


def read_sample():
    if HAS_LOADS:
        largest_moment[j] = terms[LEAST_MOMENT, j]


def tilt_columns():
    for floor in range(N):
        for j in range(LANES):
            drift_now[floor, j] = deformation[floor, j]
            if HAS_LOADS:
                drift_now[floor, j] += terms[FIRST_DRIFT + floor, j]
    for q in range(WITH_STOREYS):
        row_of_value = mixed_row(q)
        floor = mixed_storey(q)
        for j in range(LANES):
            change = drift_now[floor, j] - drift_then[floor, j]
            unbalanced[row_of_value, j] += terms[FIRST_WITH_STOREYS + q, j] * change
    for member in range(MEMBERS):
        for q in range(first_storey_of_member(member), first_storey_of_member(member + 1)):
            floor = chord_storey(q)
            first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
            start_row = joint_of(2 * member)
            end_row = joint_of(2 * member + 1)
            start_hinge = end_of(2 * member)
            end_hinge = end_of(2 * member + 1)
            for j in range(LANES):
                tilt = terms[FIRST_CHORD_STOREY + q, j] * (drift_now[floor, j] - drift_then[floor, j])
                at_start = (terms[first_value, j] + terms[first_value + 1, j]) * tilt
                at_end = (terms[first_value + 1, j] + terms[first_value + 2, j]) * tilt
                unbalanced[start_row, j] -= at_start
                unbalanced[end_row, j] -= at_end
                unbalanced[start_hinge, j] -= at_start
                unbalanced[end_hinge, j] -= at_end
                moment_sum[j] = at_start + at_end
            for at_chord in range(first_of_member(member), first_of_member(member + 1)):
                chord_line = chord_row(at_chord)
                for j in range(LANES):
                    unbalanced[chord_line, j] += terms[FIRST_CHORD + at_chord, j] * moment_sum[j]
    for floor in range(N):
        for j in range(LANES):
            drift_then[floor, j] = drift_now[floor, j]
    for j in range(LANES):
        unbalanced[UNUSED, j] = dtype(0.0)


def factorise_line():
    factorises = int(0)
    for q in range(ENTRIES):
        for j in range(LANES):
            lower_factor[q, j] = dtype(0.0)
    for q in range(BETWEEN_ROWS):
        at_entry = linear_entry(q)
        for j in range(LANES):
            lower_factor[at_entry, j] += terms[FIRST_BETWEEN_ROWS + q, j]
    for member in range(MEMBERS):
        first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
        for side in range(2):
            i = spring_at(2 * member + side)
            if i >= 0:
                for j in range(LANES):
                    slope_used = wp.where(pace[j] == 3, first_slope[i, j], hinge_slope[i, j])
                    softness[2 * member + side, j] = dtype(1.0) / slope_used
        start_entry = entry_of_joints(3 * member)
        mixed_entry = entry_of_joints(3 * member + 1)
        end_entry = entry_of_joints(3 * member + 2)
        for j in range(LANES):
            start_stiffness = terms[first_value, j]
            mixed_stiffness = terms[first_value + 1, j]
            end_stiffness = terms[first_value + 2, j]
            start_soft = softness[2 * member, j]
            end_soft = softness[2 * member + 1, j]
            start_factor = dtype(1.0) + start_soft * start_stiffness
            end_factor = dtype(1.0) + end_soft * end_stiffness
            of_start = start_soft * mixed_stiffness
            of_end = end_soft * mixed_stiffness
            inverse = dtype(1.0) / (start_factor * end_factor - of_start * of_end)
            share_of_ends[4 * member, j] = end_factor * inverse
            share_of_ends[4 * member + 1, j] = -of_start * inverse
            share_of_ends[4 * member + 2, j] = -of_end * inverse
            share_of_ends[4 * member + 3, j] = start_factor * inverse
            between = mixed_stiffness * inverse
            own_start = start_stiffness * end_factor * inverse - mixed_stiffness * of_end * inverse
            own_end = end_stiffness * start_factor * inverse - mixed_stiffness * of_start * inverse
            row_sum[0, j] = own_start + between
            row_sum[1, j] = own_end + between
            lower_factor[start_entry, j] += own_start
            lower_factor[mixed_entry, j] += between
            lower_factor[end_entry, j] += own_end
        for q in range(first_of_chords(member), first_of_chords(member + 1)):
            at_entry = entry_of_chord(q)
            first_coefficient = FIRST_CHORD + chord_of_entry(q)
            side = end_of_entry(q)
            for j in range(LANES):
                lower_factor[at_entry, j] -= terms[first_coefficient, j] * row_sum[side, j]
        for q in range(first_of_pairs(member), first_of_pairs(member + 1)):
            at_entry = entry_of_pair(q)
            first_coefficient = FIRST_CHORD + pair_row(q)
            second_coefficient = FIRST_CHORD + pair_column(q)
            for j in range(LANES):
                lower_factor[at_entry, j] += (
                    terms[first_coefficient, j] * terms[second_coefficient, j] * (row_sum[0, j] + row_sum[1, j])
                )
    for k in range(FREE):
        base_place = base_of_row(k)
        first_entry = first_column(k)
        for other_row in range(first_entry, k):
            other_base = base_of_row(other_row)
            at_entry = base_place + other_row
            for j in range(LANES):
                entry_now[j] = lower_factor[at_entry, j]
            for q in range(wp.max(first_entry, first_column(other_row)), other_row):
                for j in range(LANES):
                    entry_now[j] -= lower_factor[base_place + q, j] * lower_factor[other_base + q, j]
            for j in range(LANES):
                lower_factor[at_entry, j] = entry_now[j]
        at_entry = base_place + k
        for j in range(LANES):
            entry_now[j] = lower_factor[at_entry, j]
        for other_row in range(first_entry, k):
            for j in range(LANES):
                scaled = lower_factor[base_place + other_row, j] * inverse_pivot[other_row, j]
                entry_now[j] -= lower_factor[base_place + other_row, j] * scaled
                lower_factor[base_place + other_row, j] = scaled
        for j in range(LANES):
            inverse_pivot[k, j] = dtype(1.0) / entry_now[j]


def solve_line():
    for k in range(FREE):
        for j in range(LANES):
            push[k, j] = -unbalanced[k, j]
    for member in range(MEMBERS):
        start_row = joint_of(2 * member)
        end_row = joint_of(2 * member + 1)
        start_hinge = end_of(2 * member)
        end_hinge = end_of(2 * member + 1)
        for j in range(LANES):
            left_start = unbalanced[start_hinge, j]
            left_end = unbalanced[end_hinge, j]
            at_start = (
                share_of_ends[4 * member, j] * left_start + share_of_ends[4 * member + 2, j] * left_end - left_start
            )
            at_end = (
                share_of_ends[4 * member + 1, j] * left_start + share_of_ends[4 * member + 3, j] * left_end - left_end
            )
            push[start_row, j] -= at_start
            push[end_row, j] -= at_end
            if CHORDS > 0:
                moment_sum[j] = at_start + at_end
        if CHORDS > 0:
            for at_chord in range(first_of_member(member), first_of_member(member + 1)):
                chord_line = chord_row(at_chord)
                for j in range(LANES):
                    push[chord_line, j] += terms[FIRST_CHORD + at_chord, j] * moment_sum[j]
    for k in range(FREE):
        base_place = base_of_row(k)
        for j in range(LANES):
            entry_now[j] = push[k, j]
        for other_row in range(first_column(k), k):
            for j in range(LANES):
                entry_now[j] -= lower_factor[base_place + other_row, j] * push[other_row, j]
        for j in range(LANES):
            push[k, j] = entry_now[j]
    for k in range(FREE):
        for j in range(LANES):
            push[k, j] = push[k, j] * inverse_pivot[k, j]
    for j in range(LANES):
        largest_turn[j] = dtype(0.0)
        energy_slope[j] = dtype(0.0)
        push[ZERO, j] = dtype(0.0)
    for down in range(FREE):
        k = FREE - 1 - down
        base_place = base_of_row(k)
        for other_row in range(first_column(k), k):
            for j in range(LANES):
                push[other_row, j] -= lower_factor[base_place + other_row, j] * push[k, j]
    for member in range(MEMBERS):
        start_row = joint_of(2 * member)
        end_row = joint_of(2 * member + 1)
        start_hinge = end_of(2 * member)
        end_hinge = end_of(2 * member + 1)
        if CHORDS > 0:
            for j in range(LANES):
                chord_turn[j] = dtype(0.0)
            for at_chord in range(first_of_member(member), first_of_member(member + 1)):
                chord_line = chord_row(at_chord)
                for j in range(LANES):
                    chord_turn[j] += terms[FIRST_CHORD + at_chord, j] * push[chord_line, j]
        for j in range(LANES):
            start_turn = push[start_row, j]
            end_turn = push[end_row, j]
            if CHORDS > 0:
                start_turn -= chord_turn[j]
                end_turn -= chord_turn[j]
            of_start = start_turn - softness[2 * member, j] * unbalanced[start_hinge, j]
            of_end = end_turn - softness[2 * member + 1, j] * unbalanced[end_hinge, j]
            push[start_hinge, j] = (
                share_of_ends[4 * member, j] * of_start + share_of_ends[4 * member + 1, j] * of_end - start_turn
            )
            push[end_hinge, j] = (
                share_of_ends[4 * member + 2, j] * of_start + share_of_ends[4 * member + 3, j] * of_end - end_turn
            )
    for j in range(LANES):
        push[UNUSED, j] = dtype(0.0)
    for k in range(ROTATIONS):
        for j in range(LANES):
            largest_turn[j] = larger(largest_turn[j], wp.abs(push[k, j]))
            energy_slope[j] += unbalanced[k, j] * push[k, j]


def unbalance_line():
    for k in range(ROTATIONS):
        for j in range(LANES):
            unbalanced[k, j] = dtype(0.0)
    for hinge in range(HINGES + LINEAR_HINGES):
        i = hinge_spring(hinge)
        hinge_row = hinge_end(hinge)
        for j in range(LANES):
            unbalanced[hinge_row, j] = spring_force[i, j]
    for floor in range(N):
        for j in range(LANES):
            spring_force[floor, j] = dtype(0.0)
            if HAS_LOADS:
                spring_force[floor, j] = -terms[FIRST_SHEAR + floor, j]
    for q in range(LOADS):
        row_of_value = load_row(q)
        for j in range(LANES):
            unbalanced[row_of_value, j] -= terms[FIRST_LOAD + q, j]
    for q in range(BETWEEN_ROWS):
        row_of_value = linear_row(q)
        other_row = linear_column(q)
        if row_of_value == other_row:
            for j in range(LANES):
                unbalanced[row_of_value, j] += terms[FIRST_BETWEEN_ROWS + q, j] * turn[row_of_value, j]
        else:
            for j in range(LANES):
                unbalanced[row_of_value, j] += terms[FIRST_BETWEEN_ROWS + q, j] * turn[other_row, j]
                unbalanced[other_row, j] += terms[FIRST_BETWEEN_ROWS + q, j] * turn[row_of_value, j]
    for q in range(WITH_STOREYS):
        row_of_value = mixed_row(q)
        floor = mixed_storey(q)
        for j in range(LANES):
            unbalanced[row_of_value, j] += terms[FIRST_WITH_STOREYS + q, j] * drift_now[floor, j]
            spring_force[floor, j] += terms[FIRST_WITH_STOREYS + q, j] * turn[row_of_value, j]
    for q in range(BETWEEN_STOREYS):
        floor = upper_storey(q)
        lower_floor = lower_storey(q)
        if floor == lower_floor:
            for j in range(LANES):
                spring_force[floor, j] += terms[FIRST_BETWEEN_STOREYS + q, j] * drift_now[floor, j]
        else:
            for j in range(LANES):
                spring_force[floor, j] += terms[FIRST_BETWEEN_STOREYS + q, j] * drift_now[lower_floor, j]
                spring_force[lower_floor, j] += terms[FIRST_BETWEEN_STOREYS + q, j] * drift_now[floor, j]
    for member in range(MEMBERS):
        first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
        start_row = joint_of(2 * member)
        end_row = joint_of(2 * member + 1)
        start_hinge = end_of(2 * member)
        end_hinge = end_of(2 * member + 1)
        for j in range(LANES):
            chord_turn[j] = dtype(0.0)
        if CHORDS > 0:
            for at_chord in range(first_of_member(member), first_of_member(member + 1)):
                chord_line = chord_row(at_chord)
                for j in range(LANES):
                    chord_turn[j] += terms[FIRST_CHORD + at_chord, j] * turn[chord_line, j]
        for q in range(first_storey_of_member(member), first_storey_of_member(member + 1)):
            floor = chord_storey(q)
            for j in range(LANES):
                chord_turn[j] += terms[FIRST_CHORD_STOREY + q, j] * drift_now[floor, j]
        for j in range(LANES):
            start_turn = turn[start_row, j] - chord_turn[j] + turn[start_hinge, j]
            end_turn = turn[end_row, j] - chord_turn[j] + turn[end_hinge, j]
            at_start = terms[first_value, j] * start_turn + terms[first_value + 1, j] * end_turn
            at_end = terms[first_value + 1, j] * start_turn + terms[first_value + 2, j] * end_turn
            if MEMBER_LOADS:
                at_start += terms[FIRST_MEMBER_LOAD + 2 * member, j]
                at_end += terms[FIRST_MEMBER_LOAD + 2 * member + 1, j]
            largest_moment[j] = larger(largest_moment[j], larger(wp.abs(at_start), wp.abs(at_end)))
            unbalanced[start_row, j] += at_start
            unbalanced[end_row, j] += at_end
            unbalanced[start_hinge, j] += at_start
            unbalanced[end_hinge, j] += at_end
            moment_sum[j] = at_start + at_end
        if CHORDS > 0:
            for at_chord in range(first_of_member(member), first_of_member(member + 1)):
                chord_line = chord_row(at_chord)
                for j in range(LANES):
                    unbalanced[chord_line, j] -= terms[FIRST_CHORD + at_chord, j] * moment_sum[j]
        for q in range(first_storey_of_member(member), first_storey_of_member(member + 1)):
            floor = chord_storey(q)
            for j in range(LANES):
                spring_force[floor, j] -= terms[FIRST_CHORD_STOREY + q, j] * moment_sum[j]
    for j in range(LANES):
        unbalanced[UNUSED, j] = dtype(0.0)
        worst_balance[j] = dtype(0.0)
    for k in range(ROTATIONS):
        for j in range(LANES):
            worst_balance[j] = larger(worst_balance[j], wp.abs(unbalanced[k, j]))
