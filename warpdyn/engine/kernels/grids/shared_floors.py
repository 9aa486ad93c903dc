"""Floors of a frame with hinges that the threads of a GPU's warp share: each thread integrates one floor.

The statements for its row of each matrix are those of `floor_matrices.py`.
"""

from warpdyn.engine.kernels.hinges.floor_matrices import ABOVE, BELOW, OWN, row_product, statements_of

order = 3  # deformations of storeys precede the search for rotations

BORROWS = {
    "storey_members": ("is_idle", "first_of_frame", "next_storey"),
    "shared_warp": ("section", "thread_below", "thread_above"),
}


def wanted(plan):
    return plan.floors is not None


def values_held(plan):
    return plan.floors.count


def names(plan):
    import warp as wp

    from warpdyn.engine.device.warp_exchange import EXCHANGES, number_at
    from warpdyn.engine.kernels.loads import LOADS
    from warpdyn.engine.kernels.plan import DTYPES, state_of_stage

    dtype, load = DTYPES[plan.dtype], LOADS[plan.load]
    floors, threads = plan.floors, plan.sections
    has_load = (load.is_history and not load.is_base) or load.is_harmonic
    us, vs = state_of_stage(plan)

    def product(name, vector, target, sign=1, is_added=False):
        rows = floors.rows[name]
        if not rows:
            return "pass" if is_added else statements_of([f"{target} = dtype(0.0)"])
        start = [] if is_added else [f"{target} = dtype(0.0)"]
        return statements_of(start + row_product(rows[0], target, element(vector, rows[0].is_full), sign=sign))

    def motion(name, target):
        rows = floors.rows[name]
        return statements_of(
            [f"{target} = dtype(0.0)", *(row_product(rows[0], target, lambda _: "base[j]") if rows else [])]
        )

    return {
        "ROWS": plan.springs_of_thread,
        "FLOOR_VALUES": floors.count,
        "HAS_UNMOVED": load.is_base and bool(floors.rows["unmoved"]),
        "IS_SHAKEN": load.is_base,
        "term_rows": wp.types.matrix(
            shape=(max(1, floors.count + plan.line_of_thread.values), plan.lanes), dtype=dtype
        ),
        "spring_rows": wp.types.matrix(shape=(plan.springs_of_thread, plan.lanes), dtype=dtype),
        "code_of_value": number_at([codes[thread] for thread in range(threads) for codes in floors.codes]),
        "shared_from": EXCHANGES[plan.dtype][0],
        "DEFORMATIONS": product("deformation", us, "deformation[0, j]"),
        "DEFORMATION_RATES": product("deformation", vs, "deformation_rate[0, j]"),
        "SPRING_FORCES": product("force", "spring_force", "applied[0, j]", sign=-1, is_added=has_load),
        "ELASTIC_FORCES": product("stiffness", us, "applied[0, j]", sign=-1, is_added=True),
        "VISCOUS_FORCES": product("damping", vs, "applied[0, j]", sign=-1, is_added=True),
        "ACCELERATIONS": product("inverse_mass", "applied", "felt[0, j]"),
        "BASE_ACCELERATIONS": motion("drive", "shaken[0, j]"),
        "UNMOVED_ACCELERATIONS": motion("unmoved", "unmoved[0, j]"),
    }


def element(vector, is_full):
    """Return the function from an entry of a row to the text of the vector's element that it multiplies."""
    own = f"{vector}[0, j]"
    neighbours = {OWN: own, BELOW: f"from_thread({own}, thread_below)", ABOVE: f"from_thread({own}, thread_above)"}
    if is_full:
        return lambda entry: f"shared_from({own}, first_of_frame + {entry.where} * next_storey)"
    return lambda entry: neighbours[entry.where]


def read_sample():
    for q in range(FLOOR_VALUES):
        code = code_of_value(section * FLOOR_VALUES + q)
        terms[q, j] = dtype(code)
        if code > 1:
            terms[q, j] = structures.terms[code - 2, s]
        if code < -1:
            terms[q, j] = -structures.terms[-code - 2, s]
        if is_idle > 0:
            terms[q, j] = dtype(0.0)


def read_storey():
    if is_idle > 0:  # the ground below the first storey does not move
        u[i, j] = dtype(0.0)
        v[i, j] = dtype(0.0)


def gather_springs():
    DEFORMATIONS
    DEFORMATION_RATES


def gather_forces():
    SPRING_FORCES
    ELASTIC_FORCES
    VISCOUS_FORCES
    ACCELERATIONS
    if IS_SHAKEN:
        BASE_ACCELERATIONS
    if HAS_UNMOVED:
        UNMOVED_ACCELERATIONS
