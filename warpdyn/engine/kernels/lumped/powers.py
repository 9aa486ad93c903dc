"""Powers and energies of lumped structures, which the recorder of energies integrates."""

order = 20

BORROWS = {
    "energy": ("absorbed", "initial_energy", "power_in", "power_viscous", "momentum", "h_last"),
}


def wanted(plan):
    return plan.pattern is not None and "energy" in plan.recorders


def values_held(plan):
    return 4 * plan.dofs


def names(plan):
    from warpdyn.engine.kernels.lumped.assembly import element, first_places
    from warpdyn.engine.kernels.lumped.pattern import products, transposed
    from warpdyn.engine.kernels.plan import state_of_stage

    pattern = plan.pattern
    first = first_places(pattern)
    along = transposed(pattern.pull, pattern.components)
    us, vs = state_of_stage(plan)
    single = pattern.components == 1

    def total(row):
        return "momentum[j]" if single else f"momentum_along[{row}, j]"

    def product(name, vector, target):
        return products(pattern.tables[name], "terms", element(vector), element(target), first=first[name]) or "pass"

    return {
        "HAS_MATRIX": not pattern.stiffness.is_empty,
        "HAS_DAMPING_MATRIX": not pattern.damping.is_empty,
        "MOMENTA": product("mass", vs, "momentum_of"),
        "MOMENTA_ALONG": products(along, "terms", element(vs), total, first=first["pull"]) or "pass",
        "DAMPED": product("damping", vs, "damped"),
        "SPRUNG": product("stiffness", us, "sprung"),
    }


def declare():
    momentum_of = matrix()  # mass matrix times velocity
    damped = matrix()  # forces of the damping matrix
    sprung = matrix()  # forces of the elastic matrix


def start():
    slot("energy_of_state")
    for j in range(LANES):
        for i in range(N):
            initial_energy[j] += dtype(0.5) * (momentum_of[i, j] * vs[i, j] + sprung[i, j] * us[i, j])
        for i in range(SPRINGS):
            slot("accepted_drift")
            slot("storey_coefficients")
            slot("accepted_memory")
            absorbed[i, j] = recoverable_of(drift, memory, c)
            initial_energy[j] += absorbed[i, j]


def energy_of_state():
    MOMENTA
    if HAS_MATRIX:
        SPRUNG


def see_power_of_spring():
    if TRAPEZOIDAL:
        if stage == 0:
            absorbed[i, j] += dtype(0.5) * (h_last[j] + h[j]) * restoring * rate
    else:
        absorbed[i, j] += h[j] * weight[stage] * restoring * rate
    if HAS_ADD_TO_DASHPOT:
        power_viscous[j] += dashpot * rate


def before_finish():
    slot("energy_of_state")


def see_powers():
    MOMENTA
    MOMENTA_ALONG
    if HAS_DAMPING_MATRIX:
        DAMPED
    for i in range(N):
        for j in range(LANES):
            vi = vs[i, j]
            momentum_of_floor = momentum_of[i, j]
            if HAS_DAMPING_MATRIX:
                power_viscous[j] += damped[i, j] * vi
            slot("add_loss")
