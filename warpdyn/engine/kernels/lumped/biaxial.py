"""Biaxial springs of a lumped structure: two deformations, two forces and one memory.

Their rows of deformations and forces follow those of the other springs; their coefficients are the last terms.
"""

from warpdyn.engine.kernels.lumped.pattern import PAIR
from warpdyn.engine.kernels.plan import tableau
from warpdyn.engine.laws.springs import spring_row

order = 20
BORROWS = {"settling": ("fastest",), "energy": ("absorbed", "initial_energy", "kept")}


def wanted(plan):
    return plan.pattern is not None and plan.pattern.pairs > 0


def values_held(plan):
    from warpdyn.engine.laws.biaxial.functions import biaxial_functions

    return 3 * plan.pattern.pairs * biaxial_functions(plan.pattern.biaxial_law).memory


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES
    from warpdyn.engine.laws.biaxial.functions import biaxial_functions

    dtype, pattern, method = DTYPES[plan.dtype], plan.pattern, tableau(plan)
    law = biaxial_functions(pattern.biaxial_law)
    values = pattern.pairs * law.memory
    functions = {
        "pair_force_of": law.force,
        "pair_energy_of": law.elastic_energy,
        "pair_rate_of": law.rate,
        "pair_relaxation_of": law.relaxation_rate,
        "pair_mapping_of": law.mapping,
        "advance_pair": law.memory_after,
    }
    return {
        "PAIRS": pattern.pairs,
        "PAIR_C": law.coefficients,
        "PAIR_M": law.memory,
        "FIRST_OF_PAIRS": pattern.values + pattern.springs * pattern.has_dashpots,
        "PAIRS_MOVE": law.rate is not None,
        "PAIRS_MAP": law.mapping is not None,
        "RESUMES": plan.resumes,
        "LEAVES_STATE": "state" in plan.recorders,
        "FIRST_VALUE": pattern.single_springs * spring_row(plan.law).memory,
        "PUSHES": plan.starts_displaced,
        "PUSHED_STEPS": 1000,
        "pushed_share": wp.constant(dtype(1e-3)),
        "pair_memories": wp.types.matrix(shape=(values, plan.lanes), dtype=dtype),
        "pair_slopes": wp.types.matrix(shape=(values * method.stages, plan.lanes), dtype=dtype),
        "two_values": wp.types.vector(length=PAIR, dtype=dtype),
        "pair_coefficients": wp.types.vector(length=law.coefficients, dtype=dtype),
        "pair_memory": wp.types.vector(length=law.memory, dtype=dtype),
        "reach": getattr(method, "reach", method.weight),  # multistep methods do not support memory that moves
        "of_velocity": getattr(method, "a", method.weight),
        **{name: function for name, function in functions.items() if function is not None},
    }


def declare():
    zp = pair_memories()  # memory of the accepted state
    zps = pair_memories()  # of this stage
    zpn = pair_memories()  # slopes summed up stage by stage
    pair_slope = pair_slopes()  # rates of the memory in every stage, of methods that keep them


def read_sample():
    if RESUMES:
        for m in range(PAIRS * PAIR_M):
            zp[m, j] = structures.initial_memory[FIRST_VALUE + m, s]
            zps[m, j] = zp[m, j]


def push_springs():
    if PUSHES:
        for pair in range(PAIRS):
            for j in range(LANES):
                own = pair_coefficients()
                for q in range(PAIR_C):
                    own[q] = terms[FIRST_OF_PAIRS + pair * PAIR_C + q, j]
                pair_values = pair_memory()
                whole = two_values(deformation[SPRINGS + 2 * pair, j], deformation[SPRINGS + 2 * pair + 1, j])
                for increment in range(PUSHED_STEPS):
                    pulled = dtype(increment + 1) * pushed_share
                    pair_values = advance_pair(pulled * whole, pushed_share * whole, pair_values, own)
                for m in range(PAIR_M):
                    zp[pair * PAIR_M + m, j] = pair_values[m]
                    zps[pair * PAIR_M + m, j] = pair_values[m]


def start():
    if ENERGY:
        for j in range(LANES):
            for pair in range(PAIRS):
                slot("pair_energy")
                for side in range(2):
                    absorbed[SPRINGS + 2 * pair + side, j] = stored_in_pair[side]
                    initial_energy[j] += stored_in_pair[side]


def pair_energy():
    own = pair_coefficients()
    for q in range(PAIR_C):
        own[q] = terms[FIRST_OF_PAIRS + pair * PAIR_C + q, j]
    pair_values = pair_memory()
    for m in range(PAIR_M):
        pair_values[m] = zp[pair * PAIR_M + m, j]
    pair_drift = two_values(deformation[SPRINGS + 2 * pair, j], deformation[SPRINGS + 2 * pair + 1, j])
    stored_in_pair = pair_energy_of(pair_drift, pair_values, own)


def finish_rows():
    if ENERGY:
        for pair in range(PAIRS):
            slot("pair_energy")
            for side in range(2):
                place = SPRINGS + 2 * pair + side
                output.hysteretic_energy[place, o] = absorbed[place, j] - stored_in_pair[side]
                kept += absorbed[place, j]


def visit_pairs():
    for pair in range(PAIRS):
        for j in range(LANES):
            own = pair_coefficients()
            for q in range(PAIR_C):
                own[q] = terms[FIRST_OF_PAIRS + pair * PAIR_C + q, j]
            pair_values = pair_memory()
            for m in range(PAIR_M):
                pair_values[m] = zps[pair * PAIR_M + m, j]
            row_of_x = SPRINGS + 2 * pair
            pair_drift = two_values(deformation[row_of_x, j], deformation[row_of_x + 1, j])
            speeds = two_values(deformation_rate[row_of_x, j], deformation_rate[row_of_x + 1, j])
            forces = pair_force_of(pair_drift, speeds, pair_values, own)
            for side in range(2):
                place = row_of_x + side
                drift = pair_drift[side]
                rate = speeds[side]
                f = forces[side]
                restoring = f
                if HAS_ADD_TO_DASHPOT:
                    dashpot = dtype(0.0)
                    slot("add_to_dashpot", i=place)
                    f += dashpot
                if stage == 0:
                    slot("see_spring", i=place)
                slot("see_power_of_spring", i=place)
                spring_force[place, j] = f
            if PAIRS_MOVE:
                slope_of_pair = pair_rate_of(speeds, pair_values, own)
                if SETTLING:
                    fastest[j] = larger(fastest[j], pair_relaxation_of(speeds, pair_values, own))
                if KEEPS_SLOPES:
                    for m in range(PAIR_M):
                        pair_slope[(stage * PAIRS + pair) * PAIR_M + m, j] = slope_of_pair[m]
                        change_of_pair = dtype(0.0)
                        for q in range(STAGES):
                            if q <= stage:
                                earlier_slope = pair_slope[(q * PAIRS + pair) * PAIR_M + m, j]
                                change_of_pair += of_velocity[(stage + 1) * STAGES + q] * earlier_slope
                        zps[pair * PAIR_M + m, j] = zp[pair * PAIR_M + m, j] + h[j] * change_of_pair
                else:
                    for m in range(PAIR_M):
                        zpn[pair * PAIR_M + m, j] += weight[stage] * slope_of_pair[m]
                        moved_by = h[j] * reach[stage] * slope_of_pair[m]
                        zps[pair * PAIR_M + m, j] = zp[pair * PAIR_M + m, j] + moved_by


def accept_springs():
    if PAIRS_MOVE:
        for m in range(PAIRS * PAIR_M):
            for j in range(LANES):
                if KEEPS_SLOPES:
                    zp[m, j] = zps[m, j]
                else:
                    zp[m, j] += h[j] * zpn[m, j]
                    zpn[m, j] = dtype(0.0)
                    zps[m, j] = zp[m, j]


def end_step():
    if PAIRS_MAP:
        for pair in range(PAIRS):
            for j in range(LANES):
                own = pair_coefficients()
                for q in range(PAIR_C):
                    own[q] = terms[FIRST_OF_PAIRS + pair * PAIR_C + q, j]
                pair_values = pair_memory()
                for m in range(PAIR_M):
                    pair_values[m] = zp[pair * PAIR_M + m, j]
                pair_drift = two_values(deformation[SPRINGS + 2 * pair, j], deformation[SPRINGS + 2 * pair + 1, j])
                pair_values = pair_mapping_of(pair_drift, pair_values, own)
                for m in range(PAIR_M):
                    zp[pair * PAIR_M + m, j] = pair_values[m]
                    zps[pair * PAIR_M + m, j] = pair_values[m]


def write():
    if LEAVES_STATE:
        for m in range(PAIRS * PAIR_M):
            output.final_memory[FIRST_VALUE + m, o] = zp[m, j]


def after_finish():
    for m in range(PAIRS * PAIR_M):
        total += zp[m, j]
