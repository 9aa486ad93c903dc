"""The acceleration of the base, which every mass feels: what recorded and random motions have in common."""

from warpdyn.kernels.loads import LOADS

FIELDS = {"Load": {"intervals": "int32[]"}}  # of each motion, between its samples


def wanted(plan):
    return LOADS[plan.load].is_base


def declare():
    a0 = row()  # base acceleration at the interval's start and at this stage, and its change over a step
    base = row()
    da = row()
    base_last = row()  # at the end of the step before


def begin_walk():
    base[j] = a0[j] + dtype(substep) * da[j] + node[stage] * da[j]
    if ADAPTIVITY:
        base[j] = a0[j] + dtype(substep) * da[j] + (done[j] + node[stage] * part[j]) * da[j]


def add_base():
    ai -= base[j]


def add_supply_of_walk():
    if TRAPEZOIDAL:
        # A motion may end one step with one value and start the next with another.
        if stage == 0:
            impulse = dtype(0.5) * (h_last[j] * base_last[j] + h[j] * base[j])
            energy_in[j] -= impulse * momentum[j]
    else:
        power_in[j] -= base[j] * momentum[j]


def keep_end_of_step():
    base_last[j] = a0[j] + dtype(substep) * da[j] + da[j]
