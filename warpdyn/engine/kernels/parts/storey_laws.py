"""The storeys of a chain or springs of a lumped structure: drifts, coefficients and memory of the storey law."""

order = -90

BORROWS = {"half_steps": ("drifts",)}
FIELDS = {
    "Structure": {
        "mass": "float[,]",  # [storey, structure], as those below
        "inverse_mass": "float[,]",
        "inverse_height": "float[,]",
        "coefficients": "float[,]",  # coefficients of the storey law, [storey x coefficient, structure]
    },
    "Load": {"initial_displacement": "float[]", "initial_velocity": "float[]"},
}


def wanted(plan):
    return plan.family in ("chain", "lumped") and plan.kind != "exact"


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES, keeps_drifts
    from warpdyn.engine.laws.springs import spring_row

    dtype, lanes, law = DTYPES[plan.dtype], plan.lanes, spring_row(plan.law)
    storeys, memory, coefficients = plan.springs_of_thread, law.memory, law.coefficients
    functions = {
        "force_of": law.force,
        "held_of": law.force_at_accepted_state or law.force,
        "followed_of": law.force_after_mapping or law.force_at_accepted_state or law.force,
        "recoverable_of": law.elastic_energy,
        "tangent_of": law.tangent,
        "mapped_memory": law.return_mapping,
        "rate_of": law.rate,
        "advance": law.memory_after,
    }
    # If a thread integrates all storeys of a sample, its storey i is storey i of the building.
    number = {} if plan.sections > 1 else {"g": "i", "number_of_spring": "i"}
    if plan.storeys is not None:
        number = {
            "g": "dof_number(lowest * WIDTH + i)",
            "number_of_spring": "spring_number(lowest * SPRINGS_OF_STOREY + i)",
        }
    if plan.frame_storeys is not None:
        number = {"g": "section * N + i", "number_of_spring": "spring_number(section * SPRINGS + i)"}
    return {
        **number,
        "KEEPS_DRIFTS": keeps_drifts(plan),
        "SPRINGS": "N" if plan.pattern is None else storeys,  # biaxial springs do not count
        "C": coefficients,
        "M": memory,
        "IS_MAPPING": law.return_mapping is not None,
        "IS_RATE": law.rate is not None,
        "HAS_MEMORY": law.memory_after is not None,
        "HOLDS_FORCE": law.force_at_accepted_state is not None,
        "HAS_PADS": plan.pattern is None and storeys * plan.sections > plan.dofs,
        "table": wp.types.matrix(shape=(max(1, storeys * coefficients), lanes), dtype=dtype),
        # Memory of all storeys, one after the other; without memory there is one row, which is not used.
        "memories": wp.types.matrix(shape=(max(1, storeys * memory), lanes), dtype=dtype),
        "coefficient_vector": wp.types.vector(length=coefficients, dtype=dtype),
        "memory_vector": wp.types.vector(length=max(1, memory), dtype=dtype),
        **{name: function for name, function in functions.items() if function is not None},
    }


def accepted_drift():
    """Set `drift` to the drift of storey i in the accepted state; `foot_u` is the displacement below a section."""
    if EXPLICIT_LUMPED:
        drift = deformation[i, j]
    elif KEEPS_DRIFTS:
        drift = drifts[i, j]
    else:
        drift = u[i, j]
        if i > 0:
            drift -= u[i - 1, j]
        elif SECTIONS:
            drift -= foot_u[j]


def storey_coefficients():
    c = coefficient_vector()
    for q in range(C):
        c[q] = coefficients[i * C + q, j]


def accepted_memory():
    memory = memory_vector(z[i * M, j])
    for m in range(1, M):
        memory[m] = z[i * M + m, j]


def reached_drift():
    """Set `reached_drift` of all lanes (samples) to the accepted drift; if `u` is `us`, to that of a stage's state."""
    if EXPLICIT_LUMPED:
        reached_drift[j] = deformation[i, j]
    elif KEEPS_DRIFTS:
        reached_drift[j] = drifts[i, j]
    else:
        reached_drift[j] = u[i, j]
        if i > 0:
            reached_drift[j] -= u[i - 1, j]
        elif SECTIONS:
            reached_drift[j] -= foot_u[j]
    if HAS_PADS:
        if lowest + i >= STOREYS:
            reached_drift[j] = dtype(0.0)
