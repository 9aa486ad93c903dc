"""Force histories on the floors (or on the degrees of freedom of full matrices)."""

from warpdyn.engine.kernels.loads import LOADS, sampled

BORROWS = {"adaptivity": ("done",), "energy": ("rise",)}
FIELDS = {
    # Values of all histories in one array [time x floor], index of the first value of each history, and number of
    # intervals between its points.
    "Load": {"values": "float[]", "first": "int32[]", "intervals": "int32[]"},
}


def wanted(plan):
    load = LOADS[plan.load]
    return load.is_history and not load.is_base


def declare():
    f0 = matrix()  # the force at the interval's start, and its change over it
    df = matrix()
    one_force = row()  # force on one degree of freedom, and its change
    one_change = row()
    force_end = matrix()  # force at the end of this step (implicit methods)
    # A history that does not end with zero drops to zero at its last sample. Recorders use both values at that
    # instant: with the last force (of full matrices and modes: the acceleration by it), and without force.
    final_force = matrix()
    final_index = indices()  # -1 if the run ends with the history
    final_felt = row()  # acceleration by the last force, summed up over modes


def read_sample():
    intervals_of_history = loads.intervals[motion[j]]
    final_index[j] = int(-1)
    if intervals_of_history < live_intervals[j]:
        final_index[j] = intervals_of_history * substeps


def read_storey():
    at_final = (loads.first[motion[j]] + loads.intervals[motion[j]]) * STOREYS + g
    final_force[i, j] = loads.values[at_final] * scale[j]


def read_entry():
    at_final = (loads.first[motion[j]] + loads.intervals[motion[j]]) * N + k
    final_force[i, j] += structures.flexibility_of_mass[i, k] * loads.values[at_final] * scale[j] / of_mass


def start():
    if PROPAGATED:
        for k in range(N):
            for j in range(LANES):
                one_force[j] = loads.values[(loads.first[motion[j]] + loads.intervals[motion[j]]) * N + k] * scale[j]
            for i in range(N):  # mode i
                for j in range(LANES):
                    final_force[i, j] += structures.modal_load[k * N + i, pair[j]] * one_force[j]


def begin_floor():
    final_felt[j] = dtype(0.0)


def add_mode_to_floor():
    final_felt[j] += of_mode * final_force[m, j]


def before_force_ends():
    before_end = ai
    is_final = index == final_index[j]
    if ADAPTIVITY:
        is_final = is_final and done[j] == dtype(0.0)
    if is_final:
        if PROPAGATED:
            before_end += final_felt[j]
        elif DENSE:
            before_end += final_force[i, j]
        elif not EXPLICIT_LUMPED:
            before_end += final_force[i, j] * inverse_mass[i, j]


def settle_lane():
    if STOREY_LAWS:
        for i in range(N):
            slot("number_storey")
            if not HAS_PADS or g < STOREYS:
                begin, change = sampled(loads, motion[j], interval, live_intervals[j], STOREYS, g, scale[j])
                f0[i, j] = begin
                df[i, j] = change


def in_interval():
    if IMPLICIT_CHAIN:
        # If a history does not end with zero, the acceleration jumps at its end.
        for i in range(N):
            for j in range(LANES):
                a[i, j] += (f0[i, j] - force_end[i, j]) * inverse_mass[i, j]
    if DENSE:
        for i in range(N):
            for j in range(LANES):
                f0[i, j] = dtype(0.0)
                df[i, j] = dtype(0.0)
                for k in range(N):
                    share = structures.flexibility_of_mass[i, k] / structures.mass_factor[structure[j]]
                    begin, change = sampled(loads, motion[j], interval, live_intervals[j], N, k, scale[j])
                    f0[i, j] += share * begin
                    df[i, j] += share * change
    if PROPAGATED:
        for i in range(N):  # mode i
            for j in range(LANES):
                f0[i, j] = dtype(0.0)
                df[i, j] = dtype(0.0)
        for k in range(N):
            for j in range(LANES):
                begin, change = sampled(loads, motion[j], interval, live_intervals[j], N, k, scale[j])
                one_force[j] = begin
                one_change[j] = change
            for i in range(N):
                for j in range(LANES):
                    share = structures.modal_load[k * N + i, pair[j]]
                    f0[i, j] += share * one_force[j]
                    df[i, j] += share * one_change[j]


def begin_step():
    if PROPAGATED:
        for k in range(N):
            for j in range(LANES):
                load_start[k, j] = f0[k, j] + dtype(substep) * inverse_substeps * df[k, j]
                load_end[k, j] = f0[k, j] + dtype(substep + 1) * inverse_substeps * df[k, j]
                rise[k, j] = inverse_substeps * df[k, j]


def begin_search_of_storey():
    force_end[i, j] = f0[i, j] + position_end * df[i, j]


def add_load():
    if IMPLICIT_CHAIN:
        force = f0[i, j] + position * df[i, j]
        net += force + load_reach * (force_end[i, j] - force)
    else:
        slot("position_of_stage")
        force = f0[i, j] + at * df[i, j]
        net += force


def add_supply():
    power_in[j] += force * vi
    if TRAPEZOIDAL and not LAGS:
        # If the history does not end with zero, its last force acts until the end of the last step; here its energy is
        # added. (Methods whose velocities are half a step behind do not apply this force to the velocity.)
        if stage == 0 and index == final_index[j]:
            energy_in[j] += dtype(0.5) * h_last[j] * final_force[i, j] * vi


def add_supply_of_entry():
    slot("position_of_stage")
    power_in[j] += momentum_of_entry * (f0[k, j] + at * df[k, j])


def add_supply_at_state():
    # If the force jumps, a step may end with another value than the next one starts with.
    energy_in[j] += dtype(0.5) * (h_last[j] * force_end[i, j] + h[j] * force) * vi
