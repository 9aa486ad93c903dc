"""A frame with several bays and hinges: its massless displacements, found in each stage.

Unknowns are the rotations of joints, the vertical displacements of joints over a length, and the rotations of hinges.
The floors' displacements are known in a stage. The moments at both ends of a member are K (z + r): K is its bending
stiffness, z the rotations of its joints relative to its chord, r those of its hinges. With slopes S of the hinges, the
hinges are eliminated in closed form: r = -(K + S)^-1 K z, and the member's stiffness is K (K + S)^-1 S.

Sums of moments are gathered row by row. Additions to rows with run-time indices would be computed lane by lane, because
the compiler cannot know that two rows differ.

Stiffness that does not depend on hinges (axial stiffness of members, braces, springs of supports, members without
hinges) is a list of entries of a symmetric matrix. Forces of all members on the floors are added up to storey shears.

This file contains the moments, `joint_system.py` the linear system, `massless_rotations.py` the loop over solutions,
and `hinge_laws.py` the laws.
"""

from warpdyn.engine.kernels.hinges.layout import VALUES_OF_MEMBER, JointFrame, starts_of

order = 5

BORROWS = {"massless_rotations": ("turn", "unbalanced", "largest_moment", "worst_balance")}


def wanted(plan):
    return plan.pattern is not None and isinstance(plan.pattern.line, JointFrame) and plan.frame_storeys is None


def values_held(plan):
    line = plan.pattern.line
    return 2 * line.storeys + 2 * line.members + 2 + line.values


def names(plan):
    import warp as wp

    from warpdyn.engine.device.warp_exchange import number_at
    from warpdyn.engine.kernels.plan import DTYPES

    line, first = plan.pattern.line, plan.pattern.first_of_line
    chord_rows = [row for rows in line.chords for row in rows]
    chord_storeys = [storey for storeys in line.chord_storeys for storey in storeys]
    tilted = [member for member, storeys in enumerate(line.chord_storeys) if storeys]
    ends = rows_to_ends(line, range(line.members))
    tilted_ends = rows_to_ends(line, tilted)
    chords = rows_to_chords(line.chords, line.free, range(line.members))
    tilted_chords = rows_to_chords(line.chords, line.free, tilted)
    storeys = rows_to_chords(line.chord_storeys, line.storeys, range(line.members))
    return {
        "ZERO": line.rows - 1,
        "FREE": line.free,
        "MEMBERS": line.members,
        "TILTED": len(tilted),
        "UNHINGED": len(line.springs) - line.hinges,
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
        "joint_of": number_at(line.joints),
        "tilted_member": number_at(tilted),
        "unhinged_end": number_at([end for end, spring in enumerate(line.springs) if spring < 0]),
        "spring_at": number_at(line.springs),
        "first_of_member": number_at(starts_of(line.chords)),
        "chord_row": number_at(chord_rows),
        "first_storey_of_member": number_at(starts_of(line.chord_storeys)),
        "chord_storey": number_at(chord_storeys),
        "linear_row": number_at([row for row, _ in line.between_rows]),
        "linear_column": number_at([column for _, column in line.between_rows]),
        "mixed_row": number_at([row for row, _ in line.with_storeys]),
        "mixed_storey": number_at([storey for _, storey in line.with_storeys]),
        "upper_storey": number_at([storey for storey, _ in line.between_storeys]),
        "lower_storey": number_at([storey for _, storey in line.between_storeys]),
        "load_row": number_at(line.loads),
        # Ends of members that act on a row, with the same number of ends for all rows; the last end has no moment.
        "end_at": number_at(padded(ends, 2 * line.members)),
        "tilted_end_at": number_at(padded(tilted_ends, 2 * line.members)),
        "ADD_ENDS": sum_of_ends("end_at", most_ends(ends)),
        "ADD_TILTED_ENDS": sum_of_ends("tilted_end_at", most_ends(tilted_ends)),
        # Chords that act on a row, one row after the other.
        "first_chord": number_at(starts_of(chords)),
        "chord_at": number_at([chord for row in chords for chord, _ in row]),
        "member_of_chord": number_at([member for row in chords for _, member in row]),
        "first_tilted_chord": number_at(starts_of(tilted_chords)),
        "tilted_chord_at": number_at([chord for row in tilted_chords for chord, _ in row]),
        "member_of_tilted_chord": number_at([member for row in tilted_chords for _, member in row]),
        "first_chord_of_storey": number_at(starts_of(storeys)),
        "chord_of_storey": number_at([chord for row in storeys for chord, _ in row]),
        "member_of_storey": number_at([member for row in storeys for _, member in row]),
        "end_rows": wp.types.matrix(shape=(2 * line.members + 1, plan.lanes), dtype=DTYPES[plan.dtype]),
    }


def rows_to_ends(line, members):
    """Return for each row of displacements the ends of these members that rotate with it, as 2 * member + end."""
    found = [[] for _ in range(line.free)]
    for member in members:
        for end in (2 * member, 2 * member + 1):
            if line.joints[end] < line.free:
                found[line.joints[end]].append(end)
    return found


def most_ends(ends):
    """Return the largest number of ends that act on a row, at least 1."""
    return max([1, *map(len, ends)])


def padded(ends, unused):
    """Return the ends that act on each row, one row after the other, filled up with the end `unused`."""
    return [end for row in ends for end in [*row, *[unused] * (most_ends(ends) - len(row))]]


def sum_of_ends(table, count):
    """Return statements that add the moments of the ends that act on row k to row_sum, for lane j."""
    return "\n".join(f"row_sum += end_moment[{table}({count} * k + {place}), j]" for place in range(count))


def rows_to_chords(rows_of_members, count, members):
    """Return for each of `count` rows its (place among all chord values, member), of these members."""
    found = [[] for _ in range(count)]
    places = starts_of(rows_of_members)
    for member in members:
        for place, row in enumerate(rows_of_members[member], start=places[member]):
            found[row].append((place, member))
    return found


def declare():
    drift_then = matrix()  # drifts to which the unbalanced moments belong
    drift_now = matrix()
    chord_turn = row()  # of a member
    end_moment = end_rows()  # moments at both ends of each member
    sum_now = row()


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
    for tilted in range(TILTED):
        member = tilted_member(tilted)
        first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
        end_row = FREE + 2 * member
        for j in range(LANES):
            chord_turn[j] = dtype(0.0)
        q = int(first_storey_of_member(member))
        q_end = first_storey_of_member(member + 1)
        while q < q_end:
            floor = chord_storey(q)
            for j in range(LANES):
                chord_turn[j] += terms[FIRST_CHORD_STOREY + q, j] * (drift_now[floor, j] - drift_then[floor, j])
            q += 1
        for j in range(LANES):
            at_start = (terms[first_value, j] + terms[first_value + 1, j]) * chord_turn[j]
            at_end = (terms[first_value + 1, j] + terms[first_value + 2, j]) * chord_turn[j]
            end_moment[2 * member, j] = at_start
            end_moment[2 * member + 1, j] = at_end
            unbalanced[end_row, j] -= at_start
            unbalanced[end_row + 1, j] -= at_end
    for k in range(FREE):
        for j in range(LANES):
            row_sum = -unbalanced[k, j]
            ADD_TILTED_ENDS
            sum_now[j] = -row_sum
        if CHORDS > 0:
            q = int(first_tilted_chord(k))
            q_end = first_tilted_chord(k + 1)
            while q < q_end:
                at_chord = FIRST_CHORD + tilted_chord_at(q)
                end_place = 2 * member_of_tilted_chord(q)
                for j in range(LANES):
                    sum_now[j] += terms[at_chord, j] * (end_moment[end_place, j] + end_moment[end_place + 1, j])
                q += 1
        for j in range(LANES):
            unbalanced[k, j] = sum_now[j]
    for q in range(UNHINGED):
        end_place = unhinged_end(q)
        for j in range(LANES):
            unbalanced[FREE + end_place, j] = dtype(0.0)
    for floor in range(N):
        for j in range(LANES):
            drift_then[floor, j] = drift_now[floor, j]


def unbalance_line():
    for k in range(FREE):
        for j in range(LANES):
            unbalanced[k, j] = dtype(0.0)
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
        start_joint = joint_of(2 * member)
        end_joint = joint_of(2 * member + 1)
        end_row = FREE + 2 * member
        for j in range(LANES):
            chord_turn[j] = dtype(0.0)
        if CHORDS > 0:
            at_chord = int(first_of_member(member))
            at_chord_end = first_of_member(member + 1)
            while at_chord < at_chord_end:
                chord_line = chord_row(at_chord)
                for j in range(LANES):
                    chord_turn[j] += terms[FIRST_CHORD + at_chord, j] * turn[chord_line, j]
                at_chord += 1
        q = int(first_storey_of_member(member))
        q_end = first_storey_of_member(member + 1)
        while q < q_end:
            floor = chord_storey(q)
            for j in range(LANES):
                chord_turn[j] += terms[FIRST_CHORD_STOREY + q, j] * drift_now[floor, j]
            q += 1
        for j in range(LANES):
            start_turn = turn[start_joint, j] - chord_turn[j] + turn[end_row, j]
            end_turn = turn[end_joint, j] - chord_turn[j] + turn[end_row + 1, j]
            at_start = terms[first_value, j] * start_turn + terms[first_value + 1, j] * end_turn
            at_end = terms[first_value + 1, j] * start_turn + terms[first_value + 2, j] * end_turn
            if MEMBER_LOADS:
                at_start += terms[FIRST_MEMBER_LOAD + 2 * member, j]
                at_end += terms[FIRST_MEMBER_LOAD + 2 * member + 1, j]
            largest_moment[j] = larger(largest_moment[j], larger(wp.abs(at_start), wp.abs(at_end)))
            end_moment[2 * member, j] = at_start
            end_moment[2 * member + 1, j] = at_end
    for j in range(LANES):
        worst_balance[j] = dtype(0.0)
    for hinge in range(HINGES + LINEAR_HINGES):
        i = hinge_spring(hinge)
        hinge_row = hinge_end(hinge)
        for j in range(LANES):
            left_moment = end_moment[hinge_row - FREE, j] + spring_force[i, j]
            unbalanced[hinge_row, j] = left_moment
            worst_balance[j] = larger(worst_balance[j], wp.abs(left_moment))
    for k in range(FREE):
        for j in range(LANES):
            row_sum = unbalanced[k, j]
            ADD_ENDS
            sum_now[j] = row_sum
        if CHORDS > 0:
            q = int(first_chord(k))
            q_end = first_chord(k + 1)
            while q < q_end:
                at_chord = FIRST_CHORD + chord_at(q)
                end_place = 2 * member_of_chord(q)
                for j in range(LANES):
                    sum_now[j] -= terms[at_chord, j] * (end_moment[end_place, j] + end_moment[end_place + 1, j])
                q += 1
        for j in range(LANES):
            unbalanced[k, j] = sum_now[j]
            worst_balance[j] = larger(worst_balance[j], wp.abs(sum_now[j]))
    for floor in range(N):
        q = int(first_chord_of_storey(floor))
        q_end = first_chord_of_storey(floor + 1)
        while q < q_end:
            at_chord = FIRST_CHORD_STOREY + chord_of_storey(q)
            end_place = 2 * member_of_storey(q)
            for j in range(LANES):
                spring_force[floor, j] -= terms[at_chord, j] * (end_moment[end_place, j] + end_moment[end_place + 1, j])
            q += 1
