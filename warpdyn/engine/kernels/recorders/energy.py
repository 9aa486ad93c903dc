"""Recorder of energies: supplied by the load, dissipated by dampers and storeys, and error of the energy balance."""

from warpdyn.foundations.core.output_variables import Variable

order = 50
BORROWS = {"powers": ("momentum_of", "sprung")}
SUPPLIED = ("input_energy", "viscous_energy")
OF_ALL = {
    "input_energy": Variable((), "J", "energy put in by the load"),
    "viscous_energy": Variable((), "J", "energy dissipated by viscous damping", scale=SUPPLIED),
    "energy_balance_error": Variable((), "1", "unaccounted energy over the largest energy supplied", is_demand=False),
}
OF_SPRINGS = Variable(("spring",), "J", "energy dissipated by the spring's law", scale=SUPPLIED)
OF_STOREYS = Variable(("storey",), "J", "energy dissipated by the storey's hysteresis", scale=SUPPLIED)
VARIABLES = {
    "chain": {**OF_ALL, "hysteretic_energy": OF_STOREYS},
    "lumped": {**OF_ALL, "hysteretic_energy": OF_SPRINGS},
    "dense": OF_ALL,
}


def wanted(plan):
    return "energy" in plan.recorders


def names(plan):
    from warpdyn.engine.kernels.functions.powers import lost_share, supplied_share
    from warpdyn.engine.kernels.functions.recording import balance_error

    return {"balance_error": balance_error, "lost_share": lost_share, "supplied_share": supplied_share}


def values_held(plan):
    return 2 * plan.dofs + 4


def declare():
    energy_in = row()
    energy_viscous = row()
    absorbed = spring_rows() if EXPLICIT_LUMPED else matrix()
    initial_energy = row()
    supplied = row()  # the largest energy of the sample so far, to which the balance error is relative
    if EXPLICIT_CHAIN or EXPLICIT_LUMPED:
        h_last = row()
    power_in = row()
    momentum = row()
    power_viscous = row()
    work_in = row()  # work in a step, divided by the length of the step
    work_viscous = row()
    safe_in = row()  # values that a rejected part of a step must not change
    safe_viscous = row()
    safe_absorbed = matrix()
    last_drift = matrix()  # drift at the start of an implicit step
    last_force = matrix()
    last_dashpot = matrix()
    # Methods whose velocities are half a step behind also use the three variables above. The velocity at the instant of
    # the displacement:
    last_velocity = matrix()
    # For full matrices: the elastic energy, integrated from its power.
    energy_elastic = row()
    power_elastic = row()
    safe_elastic = row()
    safe_supplied = row()
    if PROPAGATED:
        modal_mass = row()
        behind = row()  # the step before this state
        rise = inputs()  # rate of the load at this state times this step, and times the last step
        last_rise = inputs()
        last_load = inputs()  # the load at this state, at the end of the last step


def read_sample():
    if PROPAGATED:
        modal_mass[j] = structures.modal_mass[s]


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
        last_drift[i, j] = drift
        slot("add_to_initial_energy")


def start():
    if SECTIONS:
        for j in range(LANES):
            initial_energy[j] = together(initial_energy[j], THREADS)
    if DENSE:
        for i in range(N):
            for k in range(N):
                for j in range(LANES):
                    momentum_of_entry = dtype(0.5) * mass[i * N + k, j] * v[i, j]
                    initial_energy[j] += momentum_of_entry * v[k, j]
                    for q in range(N):
                        energy_elastic[j] += (
                            dtype(0.5) * u[i, j] * mass[i * N + k, j] * stiffness[k * N + q, j] * u[q, j]
                        )
        for j in range(LANES):
            initial_energy[j] += energy_elastic[j]
    if PROPAGATED:
        for m in range(N):
            for j in range(LANES):
                swing = x[N + m, j] * x[N + m, j] + stiffness[m, j] * x[m, j] * x[m, j]
                initial_energy[j] += dtype(0.5) * modal_mass[j] * swing


def see_mode():
    speed = x[N + m, j]
    ahead = live[j] * step[j]
    before = dtype(0.0)
    if BASE or HARMONIC or FORCES:
        share = dtype(1.0) if FORCES else modal_load[m, j]
        before = share * last_load[m % WIDTH, j]
        was = share * last_rise[m % WIDTH, j]
        will = share * rise[m % WIDTH, j]
        work = supplied_share(behind[j], ahead, before, driven, was, will, speed, inner)
        energy_in[j] += modal_mass[j] * work
    loss = lost_share(behind[j], ahead, before, driven, speed, inner, total[j])
    energy_viscous[j] += modal_mass[j] * loss


def see_modes():
    for j in range(LANES):
        supplied[j] = larger(supplied[j], wp.abs(initial_energy[j] + energy_in[j]))


def save():
    safe_in[j] = energy_in[j]
    safe_viscous[j] = energy_viscous[j]
    if DENSE:
        safe_elastic[j] = energy_elastic[j]
        safe_supplied[j] = supplied[j]
    else:
        for i in range(N):
            safe_absorbed[i, j] = absorbed[i, j]


def restore_saved():
    energy_in[j] = safe_in[j]
    energy_viscous[j] = safe_viscous[j]
    if DENSE:
        energy_elastic[j] = safe_elastic[j]
        supplied[j] = safe_supplied[j]
    else:
        for i in range(N):
            absorbed[i, j] = safe_absorbed[i, j]


def see_products():
    for i in range(N):
        for k in range(N):
            for j in range(LANES):
                momentum_of_entry = mass[i * N + k, j] * vs[i, j]
                power_viscous[j] += momentum_of_entry * viscous[k, j]
                power_elastic[j] += momentum_of_entry * elastic[k, j]
                slot("add_supply_of_entry")
    for j in range(LANES):
        share = h[j] * weight[stage]
        energy_in[j] += share * power_in[j]
        energy_viscous[j] += share * power_viscous[j]
        energy_elastic[j] += share * power_elastic[j]
        supplied[j] = larger(supplied[j], wp.abs(initial_energy[j] + energy_in[j]))


def begin_walk():
    power_in[j] = dtype(0.0)
    momentum[j] = dtype(0.0)
    power_viscous[j] = dtype(0.0)
    power_elastic[j] = dtype(0.0)


def add_powers():
    if IMPLICIT_CHAIN:
        absorbed[i, j] += dtype(0.5) * (last_force[i, j] + restoring) * (drift - last_drift[i, j])
        last_force[i, j] = restoring
        last_drift[i, j] = drift
        # Weight of the state in the trapezoidal rule: half of the steps before and after it.
        weight = dtype(0.5) * (h_last[j] + h[j])
        slot("add_supply_at_state")
        if HAS_ADD_TO_DASHPOT:
            energy_viscous[j] += weight * dashpot * rate
        slot("add_loss_at_state")
        if i == 0:
            supplied[j] = larger(supplied[j], wp.abs(initial_energy[j] + energy_in[j]))
    else:
        if LAGS or KEEPS_DRIFTS:
            # The velocity is half a step behind: half of its change over the step is added.
            # Work is force times the change of the drift, so that an elastic storey returns all its energy.
            if LAGS:
                vi += dtype(0.5) * h_last[j] * ai
            change = dtype(0.5) * (drift - last_drift[i, j])
            absorbed[i, j] += (last_force[i, j] + restoring) * change
            last_force[i, j] = restoring
            if HAS_ADD_TO_DASHPOT:
                energy_viscous[j] += (last_dashpot[i, j] + dashpot) * change
                last_dashpot[i, j] = dashpot
            last_drift[i, j] = drift
            if h_last[j] + h[j] > dtype(0.0):
                last_velocity[i, j] = vi
        elif TRAPEZOIDAL:
            if stage == 0:
                absorbed[i, j] += dtype(0.5) * (h_last[j] + h[j]) * restoring * rate
        else:
            absorbed[i, j] += h[j] * weight[stage] * restoring * rate
        momentum_of_floor = mass[i, j] * vi
        momentum[j] += momentum_of_floor
        slot("add_supply")
        if HAS_ADD_TO_DASHPOT and not (LAGS or KEEPS_DRIFTS):
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
    if EXPLICIT_CHAIN or EXPLICIT_LUMPED:
        for j in range(LANES):
            put_in = energy_in[j]
            if SECTIONS:
                put_in = together(put_in, THREADS)
            supplied[j] = larger(supplied[j], wp.abs(initial_energy[j] + put_in))
    if PROPAGATED:
        if BASE or FORCES:
            for k in range(WIDTH):
                for j in range(LANES):
                    last_load[k, j] = load_end[k, j]
                    last_rise[k, j] = rise[k, j]
        for j in range(LANES):
            behind[j] = live[j] * step[j]


def finish():
    kept = dtype(0.0)  # kinetic energy at the end, and absorbed energy
    if IMPLICIT_CHAIN:
        unaccounted = initial_energy[j] + energy_in[j] - energy_viscous[j]
    if DENSE:
        for i in range(N):
            for k in range(N):
                kept += dtype(0.5) * mass[i * N + k, j] * v[i, j] * v[k, j]


def finish_storey():
    if EXPLICIT_LUMPED:
        kept += dtype(0.5) * (momentum_of[i, j] * v[i, j] + sprung[i, j] * u[i, j])
    if PROPAGATED:
        swing = x[N + i, j] * x[N + i, j] + stiffness[i, j] * x[i, j] * x[i, j]
        kept += dtype(0.5) * modal_mass[j] * swing
        if IS_CHAIN:
            output.hysteretic_energy[i, o] = dtype(0.0)  # elastic storeys return all their energy


def finish_spring():
    slot("accepted_drift")
    slot("storey_coefficients")
    slot("accepted_memory")
    stored = recoverable_of(drift, memory, c)
    output.hysteretic_energy[i, o] = absorbed[i, j] - stored
    kept += absorbed[i, j]


def finish_drift():
    stored = recoverable_of(drift, memory, c)
    output.hysteretic_energy[g, o] = absorbed[i, j] - stored
    if IMPLICIT_CHAIN:
        unaccounted -= absorbed[i, j] + dtype(0.5) * mass[i, j] * v[i, j] * v[i, j]
    elif LAGS:
        kept += absorbed[i, j] + dtype(0.5) * mass[i, j] * last_velocity[i, j] * last_velocity[i, j]
    else:
        kept += absorbed[i, j] + dtype(0.5) * mass[i, j] * v[i, j] * v[i, j]


def after_finish():
    if SECTIONS:
        kept = together(kept, THREADS)
        energy_in[j] = together(energy_in[j], THREADS)
        energy_viscous[j] = together(energy_viscous[j], THREADS)


def write():
    output.input_energy[o] = energy_in[j]
    output.viscous_energy[o] = energy_viscous[j]
    if DENSE:
        unaccounted = initial_energy[j] + energy_in[j] - kept - energy_viscous[j] - energy_elastic[j]
    elif not IMPLICIT_CHAIN:
        unaccounted = initial_energy[j] + energy_in[j] - energy_viscous[j] - kept
    most = wp.max(supplied[j], initial_energy[j])
    slot("add_to_supplied")
    output.energy_balance_error[o] = balance_error(unaccounted, most)
