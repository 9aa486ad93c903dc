"""Deformations of the springs of a lumped structure, and its accelerations, as statements for this structure alone."""

from warpdyn.engine.kernels.lumped.pattern import OF_ENERGIES, Table, products, transposed

FIELDS = {
    # Values of the entries of all matrices, of dashpots, and coefficients of biaxial springs, [value, structure].
    "Structure": {"terms": "float[,]"},
}


def wanted(plan):
    return plan.pattern is not None and plan.storeys is None and not plan.floors


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.loads import LOADS
    from warpdyn.engine.kernels.plan import DTYPES, state_of_stage

    dtype, pattern, load = DTYPES[plan.dtype], plan.pattern, LOADS[plan.load]
    is_base, has_load = load.is_base, (load.is_history and not load.is_base) or load.is_harmonic
    has_load = has_load or plan.control is not None
    first = first_places(pattern)
    us, vs = state_of_stage(plan)

    def product(name, vector, target, table=None, **how):
        table = pattern.tables[name] if table is None else table
        return products(table, "terms", element(vector), element(target), first=first[name], **how) or "pass"

    ground = "base" if pattern.components == 1 else "ground"
    by_row = transposed(pattern.deformation, plan.dofs)
    drifts = pattern.deformation
    if pattern.line is not None:  # rotations of hinges do not follow from displacements
        drifts = Table(drifts.rows[: plan.dofs], drifts.values)
    count = pattern.values + pattern.springs * pattern.has_dashpots
    count += (
        pattern.values_of_pairs
        + pattern.values_of_line
        + (pattern.values_of_energies if "energy" in plan.recorders else 0)
    )
    springs = plan.springs_of_thread if plan.frame_storeys else pattern.springs
    if plan.frame_storeys:  # `storey_members.py` reads the values of the members of a thread
        held, count = pattern.first_of_line + plan.line_of_thread.values, pattern.first_of_line
    else:
        held = count
    return {
        **({} if plan.by_storey else {"THREADS": 1}),
        "ROWS": springs,
        "TERMS": count,
        "FIRST_DASHPOT": pattern.values,
        "HAS_UNMOVED": is_base and not pattern.unmoved.is_empty,
        "IS_SHAKEN": is_base,
        "term_rows": wp.types.matrix(shape=(max(1, held), plan.lanes), dtype=dtype),
        "spring_rows": wp.types.matrix(shape=(springs, plan.lanes), dtype=dtype),
        "DEFORMATIONS": product("deformation", us, "deformation", drifts),
        "DEFORMATION_RATES": product("deformation", vs, "deformation_rate", drifts),
        "SPRING_FORCES": product("deformation", "spring_force", "applied", by_row, sign=-1, is_added=has_load),
        "ELASTIC_FORCES": product("stiffness", us, "applied", sign=-1, is_added=True),
        "VISCOUS_FORCES": product("damping", vs, "applied", sign=-1, is_added=True),
        "ACCELERATIONS": product("inverse_mass", "applied", "felt"),
        "BASE_ACCELERATIONS": product("drive", ground, "shaken"),
        "UNMOVED_ACCELERATIONS": product("unmoved", ground, "unmoved"),
    }


def element(name):
    """Return the function from the index of a row to the text of its element in this lane."""
    return lambda row: f"{name}[j]" if name == "base" else f"{name}[{row}, j]"


def first_places(pattern):
    """Return {name of a table: place of its first value among the terms}."""
    found, place = {}, 0
    for name, table in pattern.tables.items():
        if name == OF_ENERGIES[0]:
            place += pattern.springs * pattern.has_dashpots + pattern.values_of_pairs
        found[name] = place
        place += table.values
    return found


def read_sample():
    for q in range(TERMS):
        terms[q, j] = structures.terms[q, s]


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
