"""Harmonic forces on the floors, with one frequency and one phase for all floors."""

from warpdyn.engine.kernels.loads import LOADS, harmonic

BORROWS = {"adaptivity": ("done", "part"), "energy": ("rise", "last_load", "last_rise")}
FIELDS = {"Load": {"amplitude": "float[]", "circular_frequency": "float64[]", "phase": "float64[]"}}


def wanted(plan):
    return LOADS[plan.load].is_harmonic


def names(plan):
    import math

    import warp as wp

    # The exact method needs sine and cosine at the start of a step, other methods the sine at its start and end.
    is_exact = plan.kind == "exact"
    return {
        "quarter_turn": wp.constant(wp.float64(math.pi / 2)),
        "lead": wp.constant(wp.float64(math.pi / 2 if is_exact else 0)),
        "later": wp.constant(wp.float64(0 if is_exact else 1)),
    }


def declare():
    amplitude = matrix()
    frequency = row64()
    phase = row64()
    sine = row()
    sine_end = row()


def read_sample():
    frequency[j] = loads.circular_frequency[0]
    phase[j] = loads.phase[0]


def read_storey():
    amplitude[i, j] = loads.amplitude[g] * scale[j]


def read_entry():
    amplitude[i, j] += structures.flexibility_of_mass[i, k] * loads.amplitude[k] * scale[j] / of_mass


def begin_step():
    if PROPAGATED:
        for j in range(LANES):
            here = wp.float64(index)
            load_start[0, j] = scale[j] * harmonic(here, step[j], frequency[j], phase[j])
            load_end[0, j] = scale[j] * harmonic(here + later, step[j], frequency[j], phase[j] + lead)
            last_load[0, j] = load_start[0, j]
            cosine = harmonic(here, step[j], frequency[j], phase[j] + quarter_turn)
            rise[0, j] = scale[j] * cosine * dtype(frequency[j]) * step[j]
            last_rise[0, j] = rise[0, j]
    if IMPLICIT_CHAIN:
        for j in range(LANES):
            sine[j] = harmonic(wp.float64(index), step[j], frequency[j], phase[j])
            sine_end[j] = harmonic(wp.float64(index + 1), step[j], frequency[j], phase[j])


def begin_stage():
    for j in range(LANES):
        whole = wp.float64(index) + wp.float64(node[stage])
        if ADAPTIVITY:
            whole = wp.float64(index) + wp.float64(done[j] + node[stage] * part[j])
        sine[j] = harmonic(whole, step[j], frequency[j], phase[j])


def add_load():
    if IMPLICIT_CHAIN:
        net += amplitude[i, j] * (sine[j] + load_reach * (sine_end[j] - sine[j]))
    else:
        net += amplitude[i, j] * sine[j]


def add_supply():
    power_in[j] += amplitude[i, j] * sine[j] * vi


def add_supply_of_entry():
    power_in[j] += momentum_of_entry * amplitude[k, j] * sine[j]


def add_supply_at_state():
    energy_in[j] += weight * amplitude[i, j] * sine[j] * vi
