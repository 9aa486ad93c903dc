"""The linear system of a frame with several bays and hinges: the massless displacements of its nodes.

The hinges of a member are eliminated in closed form (see `joint_frame.py`). The remaining matrix is factorised as
L D L^T, row by row, without the zeros before the first entry of each row. A narrow matrix is stored with a constant
bandwidth, and the statements of a row are written out (`banded_rows.py`).
"""

from warpdyn.engine.kernels.hinges.banded_rows import factor_of_row, reduction_of_row, solution_of_row
from warpdyn.engine.kernels.hinges.layout import JointFrame, starts_of

order = 5

BORROWS = {
    "massless_rotations": ("unbalanced", "push", "largest_turn", "energy_slope", "factorises"),
    "joint_frame": ("chord_turn", "end_moment"),
    "hinge_laws": ("first_slope", "hinge_slope"),
    "hinge_search": ("pace",),
}

RIGID = {"float32": 1e8, "float64": 1e17}  # stiffness of ends without a hinge, relative to that of their member


def wanted(plan):
    return plan.pattern is not None and isinstance(plan.pattern.line, JointFrame) and plan.frame_storeys is None


def values_held(plan):
    line = plan.pattern.line
    return line.entries + 3 * line.free + 6 * line.members


def names(plan):
    import warp as wp

    from warpdyn.engine.device.warp_exchange import number_at
    from warpdyn.engine.kernels.plan import DTYPES

    dtype, line, lanes = DTYPES[plan.dtype], plan.pattern.line, plan.lanes
    zero, band = line.rows - 1, line.band
    bases = [band * row + band * (band + 2) for row in range(line.free)] if band else line.bases
    place = {(row, column): bases[row] + column for row in range(line.free) for column in range(row + 1)}

    def entry(row, column):
        return place[max(row, column), min(row, column)]

    of_entries = [[] for _ in range((band + 1) * (line.free + 2 * band) if band else line.entries)]
    of_chords, first_of_chords, ends_of_chords = [], [0], []
    pairs, first_of_pairs, chord = [], [0], 0
    for member, rows in enumerate(line.chords):
        start, end = line.joints[2 * member : 2 * member + 2]
        for kind, (row, column) in enumerate(((start, start), (start, end), (end, end))):
            if max(row, column) < zero:
                of_entries[entry(row, column)].append(3 * member + kind)
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
    return {
        "ENTRIES": len(of_entries),
        "MEMBERS_WITH_CHORDS": line.members if chord else 0,
        "BANDED": band > 0,
        "BAND": band,
        "FACTORISE_BANDED_ROW": factor_of_row(band),
        "REDUCE_BANDED_ROW": reduction_of_row(band),
        "SOLVE_BANDED_ROW": solution_of_row(band),
        "base_of_row": number_at(bases),
        "first_column": number_at(line.first_columns),
        "first_of_entry": number_at(starts_of(of_entries)),
        "value_of_entry": number_at([value for values in of_entries for value in values]),
        "solved_of": number_at([min(joint, line.free) for joint in line.joints]),
        "rigid": wp.constant(dtype(RIGID[plan.dtype])),
        "first_of_chords": number_at(first_of_chords),
        "entry_of_chord": number_at(of_chords),
        "chord_of_entry": number_at([each for each, _ in ends_of_chords]),
        "end_of_entry": number_at([each for _, each in ends_of_chords]),
        "first_of_pairs": number_at(first_of_pairs),
        "entry_of_pair": number_at([each for each, _, _ in pairs]),
        "pair_row": number_at([each for _, each, _ in pairs]),
        "pair_column": number_at([each for _, _, each in pairs]),
        "linear_entry": number_at([entry(*each) for each in line.between_rows]),
        "entry_rows": wp.types.matrix(shape=(len(of_entries), lanes), dtype=dtype),
        "free_rows": wp.types.matrix(shape=(line.free + max(1, 2 * band), lanes), dtype=dtype),
        "member_rows": wp.types.matrix(shape=(max(1, 3 * line.members), lanes), dtype=dtype),
        "pair_rows": wp.types.matrix(shape=(2, lanes), dtype=dtype),
    }


def declare():
    lower_factor = entry_rows()  # the matrix, then its factor L
    inverse_pivot = free_rows()
    entry_now = row()
    reduced = free_rows()  # right side after the forward substitution
    solved = free_rows()  # corrections of the displacements of nodes; row FREE, of supports, is 0
    end_slope = pair_rows()  # stiffness of the hinges at both ends of a member
    flexibility = member_rows()  # rotations of a member's hinges per moment that acts on them: start, mixed, end
    condensed = member_rows()  # stiffness of a member with its hinges: start, mixed, end


def factorise_line():
    factorises = int(0)
    for member in range(MEMBERS):
        first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
        for side in range(2):
            i = spring_at(2 * member + side)
            if i >= 0:
                for j in range(LANES):
                    end_slope[side, j] = wp.where(pace[j] == 3, first_slope[i, j], hinge_slope[i, j])
            else:
                for j in range(LANES):
                    end_slope[side, j] = rigid * (terms[first_value, j] + terms[first_value + 2, j])
        # No difference of nearly equal numbers: hinges may be much softer or stiffer than the member.
        for j in range(LANES):
            start_stiffness = terms[first_value, j]
            mixed_stiffness = terms[first_value + 1, j]
            end_stiffness = terms[first_value + 2, j]
            start_slope_used = end_slope[0, j]
            end_slope_used = end_slope[1, j]
            determinant = start_stiffness * end_stiffness - mixed_stiffness * mixed_stiffness
            start_sum = start_slope_used * end_stiffness + determinant
            end_sum = end_slope_used * start_stiffness + determinant
            inverse = dtype(1.0) / (start_slope_used * end_slope_used + start_sum + end_slope_used * start_stiffness)
            flexibility[3 * member, j] = (end_slope_used + end_stiffness) * inverse
            flexibility[3 * member + 1, j] = -mixed_stiffness * inverse
            flexibility[3 * member + 2, j] = (start_slope_used + start_stiffness) * inverse
            start_share = start_slope_used * inverse
            condensed[3 * member, j] = start_share * end_sum
            condensed[3 * member + 1, j] = start_share * (end_slope_used * mixed_stiffness)
            condensed[3 * member + 2, j] = end_slope_used * inverse * start_sum
    for q in range(ENTRIES):
        for j in range(LANES):
            entry_now[j] = dtype(0.0)
        at_sum = int(first_of_entry(q))
        at_sum_end = first_of_entry(q + 1)
        while at_sum < at_sum_end:
            at_value = value_of_entry(at_sum)
            for j in range(LANES):
                entry_now[j] += condensed[at_value, j]
            at_sum += 1
        for j in range(LANES):
            lower_factor[q, j] = entry_now[j]
    for q in range(BETWEEN_ROWS):
        at_entry = linear_entry(q)
        for j in range(LANES):
            lower_factor[at_entry, j] += terms[FIRST_BETWEEN_ROWS + q, j]
    for member in range(MEMBERS_WITH_CHORDS):
        q = int(first_of_chords(member))
        q_end = first_of_chords(member + 1)
        while q < q_end:
            at_entry = entry_of_chord(q)
            first_coefficient = FIRST_CHORD + chord_of_entry(q)
            at_value = 3 * member + 2 * end_of_entry(q)
            for j in range(LANES):
                row_sum = condensed[at_value, j] + condensed[3 * member + 1, j]
                lower_factor[at_entry, j] -= terms[first_coefficient, j] * row_sum
            q += 1
        q = int(first_of_pairs(member))
        q_end = first_of_pairs(member + 1)
        while q < q_end:
            at_entry = entry_of_pair(q)
            first_coefficient = FIRST_CHORD + pair_row(q)
            second_coefficient = FIRST_CHORD + pair_column(q)
            for j in range(LANES):
                of_ends = condensed[3 * member, j] + condensed[3 * member + 2, j]
                row_sum = of_ends + dtype(2.0) * condensed[3 * member + 1, j]
                lower_factor[at_entry, j] += terms[first_coefficient, j] * terms[second_coefficient, j] * row_sum
            q += 1
    if BANDED:
        for k in range(FREE):
            first_place = (BAND + 1) * k
            row_place = (BAND + 1) * (k + BAND)
            for j in range(LANES):
                FACTORISE_BANDED_ROW
    else:
        for k in range(FREE):
            base_place = base_of_row(k)
            first_entry = first_column(k)
            other_row = int(first_entry)
            while other_row < k:
                other_base = base_of_row(other_row)
                at_entry = base_place + other_row
                for j in range(LANES):
                    entry_now[j] = lower_factor[at_entry, j]
                q = int(wp.max(first_entry, first_column(other_row)))
                while q < other_row:
                    for j in range(LANES):
                        entry_now[j] -= lower_factor[base_place + q, j] * lower_factor[other_base + q, j]
                    q += 1
                for j in range(LANES):
                    lower_factor[at_entry, j] = entry_now[j]
                other_row += 1
            at_entry = base_place + k
            for j in range(LANES):
                entry_now[j] = lower_factor[at_entry, j]
            other_row = int(first_entry)
            while other_row < k:
                for j in range(LANES):
                    scaled = lower_factor[base_place + other_row, j] * inverse_pivot[other_row, j]
                    entry_now[j] -= lower_factor[base_place + other_row, j] * scaled
                    lower_factor[base_place + other_row, j] = scaled
                other_row += 1
            for j in range(LANES):
                inverse_pivot[k, j] = dtype(1.0) / entry_now[j]


def solve_line():
    for member in range(MEMBERS):
        first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
        end_row = FREE + 2 * member
        for j in range(LANES):
            left_start = unbalanced[end_row, j]
            left_end = unbalanced[end_row + 1, j]
            start_turn = flexibility[3 * member, j] * left_start + flexibility[3 * member + 1, j] * left_end
            end_turn = flexibility[3 * member + 1, j] * left_start + flexibility[3 * member + 2, j] * left_end
            end_moment[2 * member, j] = terms[first_value, j] * start_turn + terms[first_value + 1, j] * end_turn
            end_moment[2 * member + 1, j] = (
                terms[first_value + 1, j] * start_turn + terms[first_value + 2, j] * end_turn
            )
    for k in range(FREE):
        for j in range(LANES):
            row_sum = -unbalanced[k, j]
            ADD_ENDS
            entry_now[j] = row_sum
        if CHORDS > 0:
            q = int(first_chord(k))
            q_end = first_chord(k + 1)
            while q < q_end:
                at_chord = FIRST_CHORD + chord_at(q)
                end_place = 2 * member_of_chord(q)
                for j in range(LANES):
                    entry_now[j] -= terms[at_chord, j] * (end_moment[end_place, j] + end_moment[end_place + 1, j])
                q += 1
        if BANDED:
            row_place = (BAND + 1) * (k + BAND)
            for j in range(LANES):
                REDUCE_BANDED_ROW
        else:
            base_place = base_of_row(k)
            other_row = int(first_column(k))
            while other_row < k:
                for j in range(LANES):
                    entry_now[j] -= lower_factor[base_place + other_row, j] * reduced[other_row, j]
                other_row += 1
            for j in range(LANES):
                reduced[k, j] = entry_now[j]
                solved[k, j] = entry_now[j] * inverse_pivot[k, j]
    for j in range(LANES):
        largest_turn[j] = dtype(0.0)
        energy_slope[j] = dtype(0.0)
    for down in range(FREE):
        k = FREE - 1 - down
        if BANDED:
            row_place = (BAND + 1) * (k + BAND)
            for j in range(LANES):
                SOLVE_BANDED_ROW
        for j in range(LANES):
            entry_now[j] = solved[k, j]
            push[k, j] = entry_now[j]
            largest_turn[j] = larger(largest_turn[j], wp.abs(entry_now[j]))
            energy_slope[j] += unbalanced[k, j] * entry_now[j]
        if not BANDED:
            base_place = base_of_row(k)
            other_row = int(first_column(k))
            while other_row < k:
                for j in range(LANES):
                    solved[other_row, j] -= lower_factor[base_place + other_row, j] * entry_now[j]
                other_row += 1
    for member in range(MEMBERS):
        first_value = FIRST_MEMBER + VALUES_OF_MEMBER * member
        start_joint = solved_of(2 * member)
        end_joint = solved_of(2 * member + 1)
        end_row = FREE + 2 * member
        if CHORDS > 0:
            for j in range(LANES):
                chord_turn[j] = dtype(0.0)
            at_chord = int(first_of_member(member))
            at_chord_end = first_of_member(member + 1)
            while at_chord < at_chord_end:
                chord_line = chord_row(at_chord)
                for j in range(LANES):
                    chord_turn[j] += terms[FIRST_CHORD + at_chord, j] * solved[chord_line, j]
                at_chord += 1
        for j in range(LANES):
            start_turn = solved[start_joint, j]
            end_turn = solved[end_joint, j]
            if CHORDS > 0:
                start_turn -= chord_turn[j]
                end_turn -= chord_turn[j]
            left_start = unbalanced[end_row, j]
            left_end = unbalanced[end_row + 1, j]
            of_start = terms[first_value, j] * start_turn + terms[first_value + 1, j] * end_turn + left_start
            of_end = terms[first_value + 1, j] * start_turn + terms[first_value + 2, j] * end_turn + left_end
            push_start = -(flexibility[3 * member, j] * of_start + flexibility[3 * member + 1, j] * of_end)
            push_end = -(flexibility[3 * member + 1, j] * of_start + flexibility[3 * member + 2, j] * of_end)
            push[end_row, j] = push_start
            push[end_row + 1, j] = push_end
            largest_turn[j] = larger(largest_turn[j], larger(wp.abs(push_start), wp.abs(push_end)))
            energy_slope[j] += left_start * push_start + left_end * push_end
    for q in range(UNHINGED):
        end_place = unhinged_end(q)
        for j in range(LANES):
            push[FREE + end_place, j] = dtype(0.0)
