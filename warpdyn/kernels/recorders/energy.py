"""The energy that the load puts in and that dampers and storeys take out, and the error of their balance."""

from warpdyn.core.output_variables import Variable

order = 50
SUPPLIED = ("input_energy", "viscous_energy")
OF_ALL = {
    "input_energy": Variable((), "J", "energy put in by the load"),
    "viscous_energy": Variable((), "J", "energy dissipated by viscous damping", scale=SUPPLIED),
    "energy_balance_error": Variable((), "1", "unaccounted energy over the largest energy supplied", is_demand=False),
}
OF_STOREYS = Variable(("storey",), "J", "energy dissipated by the storey's hysteresis", scale=SUPPLIED)
VARIABLES = {"chain": {**OF_ALL, "hysteretic_energy": OF_STOREYS}, "dense": OF_ALL}


def wanted(plan):
    return "energy" in plan.recorders


def names(plan):
    from warpdyn.kernels.recording import balance_error

    return {"balance_error": balance_error}


def values_held(plan):
    return 2 * plan.dofs + 4


def declare():
    energy_in = row()
    energy_viscous = row()
    absorbed = matrix()
    initial_energy = row()
    supplied = row()  # the most energy the sample ever held: what the balance error is relative to
    h_last = row()
    power_in = row()
    momentum = row()
    power_viscous = row()
    work_in = row()  # in a step, over its length
    work_viscous = row()
    safe_in = row()  # what a rejected part of a step must not leave behind
    safe_viscous = row()
    safe_absorbed = matrix()


def start_storey():
    if HAS_PADS:
        slot("number_storey")
    if not HAS_PADS or g < STOREYS:
        slot("accepted_drift")
        slot("storey_coefficients")
        memory = memory_vector()
        slot("remember")
        absorbed[i, j] = recoverable_of(drift, memory, c)
        initial_energy[j] += absorbed[i, j] + dtype(0.5) * mass[i, j] * v[i, j] * v[i, j]
        slot("add_to_initial_energy")


def start():
    if SECTIONS:
        for j in range(LANES):
            initial_energy[j] = together(initial_energy[j], THREADS)


def save():
    safe_in[j] = energy_in[j]
    safe_viscous[j] = energy_viscous[j]
    for i in range(N):
        safe_absorbed[i, j] = absorbed[i, j]


def take_back():
    energy_in[j] = safe_in[j]
    energy_viscous[j] = safe_viscous[j]
    for i in range(N):
        absorbed[i, j] = safe_absorbed[i, j]


def begin_walk():
    power_in[j] = dtype(0.0)
    momentum[j] = dtype(0.0)
    power_viscous[j] = dtype(0.0)


def add_powers():
    if TRAPEZOIDAL:
        if stage == 0:
            absorbed[i, j] += dtype(0.5) * (h_last[j] + h[j]) * restoring * rate
    else:
        absorbed[i, j] += h[j] * weight[stage] * restoring * rate
    momentum_of_floor = mass[i, j] * vi
    momentum[j] += momentum_of_floor
    slot("add_supply")
    if HAS_ADD_TO_DASHPOT:
        power_viscous[j] += dashpot * rate
    slot("add_loss")


def end_stage():
    for j in range(LANES):
        slot("add_supply_of_walk")
        if TRAPEZOIDAL:
            if stage == 0:
                energy_in[j] += dtype(0.5) * (h_last[j] + h[j]) * power_in[j]
                energy_viscous[j] += dtype(0.5) * (h_last[j] + h[j]) * power_viscous[j]
        else:
            work_in[j] += weight[stage] * power_in[j]
            work_viscous[j] += weight[stage] * power_viscous[j]


def end_stages():
    for j in range(LANES):
        if TRAPEZOIDAL:
            h_last[j] = h[j]
            slot("keep_end_of_step")
        else:
            energy_in[j] += h[j] * work_in[j]
            energy_viscous[j] += h[j] * work_viscous[j]
            work_in[j] = dtype(0.0)
            work_viscous[j] = dtype(0.0)


def end_step():
    for j in range(LANES):
        put_in = energy_in[j]
        if SECTIONS:
            put_in = together(put_in, THREADS)
        supplied[j] = wp.max(supplied[j], wp.abs(initial_energy[j] + put_in))


def finish():
    kept = dtype(0.0)  # energy that is still there, or was absorbed


def finish_drift():
    stored = recoverable_of(drift, memory, c)
    output.hysteretic_energy[g, o] = absorbed[i, j] - stored
    kept += absorbed[i, j] + dtype(0.5) * mass[i, j] * v[i, j] * v[i, j]


def after_finish():
    if SECTIONS:
        kept = together(kept, THREADS)
        energy_in[j] = together(energy_in[j], THREADS)
        energy_viscous[j] = together(energy_viscous[j], THREADS)


def write():
    output.input_energy[o] = energy_in[j]
    output.viscous_energy[o] = energy_viscous[j]
    unaccounted = initial_energy[j] + energy_in[j] - energy_viscous[j] - kept
    most = wp.max(supplied[j], initial_energy[j])
    slot("add_to_supplied")
    output.energy_balance_error[o] = balance_error(unaccounted, most)
