"""Forces on the floors that go to and fro as a sine, all in phase."""

from warpdyn.kernels.loads import LOADS, harmonic

FIELDS = {"Load": {"amplitude": "float[]", "circular_frequency": "float64[]", "phase": "float64[]"}}


def wanted(plan):
    return LOADS[plan.load].is_harmonic


def declare():
    amplitude = matrix()
    frequency = row64()
    phase = row64()
    sine = row()


def read_sample():
    frequency[j] = loads.circular_frequency[0]
    phase[j] = loads.phase[0]


def read_storey():
    amplitude[i, j] = loads.amplitude[g] * scale[j]


def begin_stage():
    for j in range(LANES):
        whole = wp.float64(index) + wp.float64(node[stage])
        if ADAPTIVITY:
            whole = wp.float64(index) + wp.float64(done[j] + node[stage] * part[j])
        sine[j] = harmonic(whole, step[j], frequency[j], phase[j])


def add_load():
    net += amplitude[i, j] * sine[j]


def add_supply():
    power_in[j] += amplitude[i, j] * sine[j] * vi
