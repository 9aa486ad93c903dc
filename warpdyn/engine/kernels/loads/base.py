"""Base acceleration: statements that recorded and random motions have in common."""

from warpdyn.engine.kernels.loads import LOADS

BORROWS = {"adaptivity": ("done", "part"), "energy": ("rise",)}
FIELDS = {
    "Load": {"intervals": "int32[]"},  # number of intervals between the points of each motion
    "Structure": {"influence": "float[]"},  # factor of the base acceleration in each dof of full matrices, [dof]
}


def wanted(plan):
    return LOADS[plan.load].is_base and (plan.pattern is None or plan.pattern.components == 1)


def declare():
    a0 = row()  # base acceleration: at the interval's start, at this stage, and its change over a step
    base = row()
    da = row()
    base_last = row()  # base acceleration at the end of the previous step
    base_end = row()  # base acceleration at the end of this step (implicit methods)
    influence = matrix()  # factor of the base acceleration for each degree of freedom (full matrices)


def start_row():
    if not EXPLICIT_LUMPED:
        influence[i, j] = structures.influence[i]


def in_interval():
    if IMPLICIT_CHAIN:
        # If a motion does not end with zero, the acceleration jumps at its end.
        for i in range(N):
            for j in range(LANES):
                a[i, j] -= a0[j] - base_end[j]


def begin_step():
    if PROPAGATED:
        for j in range(LANES):
            load_start[0, j] = a0[j] + dtype(substep) * inverse_substeps * da[j]
            load_end[0, j] = a0[j] + dtype(substep + 1) * inverse_substeps * da[j]
            rise[0, j] = inverse_substeps * da[j]
    if IMPLICIT_CHAIN:
        for j in range(LANES):
            base[j] = a0[j] + position * da[j]


def begin_search():
    base_end[j] = a0[j] + position_end * da[j]


def begin_walk():
    if DENSE or EXPLICIT_LUMPED:
        slot("position_of_stage")
        base[j] = a0[j] + at * da[j]
    if EXPLICIT_CHAIN:
        if LANES == 1 and not ADAPTIVITY:  # the first stage is where the step begins
            base[j] = a0[j] if UNDIVIDED else a0[j] + dtype(substep) * da[j]
            if stage > 0:
                base[j] += node[stage] * da[j]
        else:
            base[j] = a0[j] + dtype(substep) * da[j] + node[stage] * da[j]
        if ADAPTIVITY:
            base[j] = a0[j] + dtype(substep) * da[j] + (done[j] + node[stage] * part[j]) * da[j]


def add_base():
    if DENSE:
        ai -= influence[i, j] * base[j]
    elif not (KEEPS_DRIFTS or EXPLICIT_LUMPED):
        ai -= base[j]


def add_base_to_net():
    net -= mass[i, j] * (base[j] + load_reach * (base_end[j] - base[j]))


def add_supply_of_entry():
    power_in[j] -= momentum_of_entry * influence[k, j] * base[j]


def add_supply_of_walk():
    if TRAPEZOIDAL:
        # If the motion jumps, a step may end with another value than the next one starts with.
        if stage == 0:
            impulse = dtype(0.5) * (h_last[j] * base_last[j] + h[j] * base[j])
            energy_in[j] -= impulse * momentum[j]
    else:
        power_in[j] -= base[j] * momentum[j]


def keep_end_of_step():
    if EXPLICIT_LUMPED:
        base_last[j] = a0[j] + dtype(substep + 1) * inverse_substeps * da[j]
    else:
        base_last[j] = a0[j] + dtype(substep) * da[j] + da[j]


def add_supply_at_state():
    # If the motion jumps, a step may end with another value than the next one starts with.
    impulse = dtype(0.5) * (h_last[j] * base_end[j] + h[j] * base[j])
    energy_in[j] -= impulse * mass[i, j] * vi
