"""Search for collapses after groups of STEPS steps; a search in each step costs as much as a step of some methods.

At the end of a group, the peak drifts show whether a storey has exceeded its capacity in the group. If so, the state
before the group is restored, and its steps are repeated in groups of one step, until the step of the collapse is found.
"""

from warpdyn.engine.kernels.parts import settling
from warpdyn.engine.kernels.plan import holds_step, keeps_drifts

order = 11
STEPS = 32  # number of steps of a group
# Largest number of storeys. The state before a group occupies registers that the kernel then lacks. Measured on an H200
# with 1, 2, 3, 5 and 8 storeys, kernels of stoermer in groups instead of step by step: 0.52 to 0.68 of the time (1
# storey), 0.73 to 0.85 (5 and 8 storeys).
MOST_STOREYS = 8
BORROWS = {
    "collapse": ("inverse_capacity", "over", "stands"),
    "drift": ("peak_drift",),
    "half_steps": ("drifts", "rates", "path", "moves", "carried", "turns"),
    "record": ("base_at_end",),
}


def wanted(plan):
    # Other recorders, event sequences and the part `settling` keep values that a repetition would not restore.
    is_alone = holds_step(plan) and plan.undivided and plan.dofs <= MOST_STOREYS and keeps_drifts(plan)
    changes_nothing_else = plan.recorders == ("drift",) and plan.damping != "modal" and not settling.wanted(plan)
    return plan.collapses and is_alone and changes_nothing_else and not (plan.resumes or plan.records_late)


def names(plan):
    return {"STEPS_OF_A_GROUP": STEPS}


def declare():
    group = int(STEPS_OF_A_GROUP)  # steps of the next group
    kept_drifts = matrix()  # the state before the group
    kept_rates = matrix()
    kept_path = matrix()
    kept_moves = matrix()
    kept_carried = matrix()
    kept_turns = matrix()
    kept_memory = memories()
    kept_base = row()
    kept_peak = matrix()


def begin_phase():
    interval_until = wp.min(interval_until, interval_from + group)
    for j in range(LANES):
        kept_base[j] = base_at_end[j]
        for i in range(N):
            kept_drifts[i, j] = drifts[i, j]
            kept_rates[i, j] = rates[i, j]
            kept_path[i, j] = path[i, j]
            kept_moves[i, j] = moves[i, j]
            kept_carried[i, j] = carried[i, j]
            kept_turns[i, j] = turns[i, j]
            kept_peak[i, j] = peak_drift[i, j]
            for m in range(M):
                kept_memory[i * M + m, j] = z[i * M + m, j]


def end_phase():
    for j in range(LANES):
        over[j] = dtype(0.0)
        for i in range(N):
            farthest = larger(peak_drift[i, j], wp.abs(drifts[i, j]))
            over[j] = larger(over[j], farthest * inverse_capacity[i, j])
        if over[j] > dtype(1.0):
            if interval_until == interval_from + 1:
                stands[j] = dtype(0.0)
                interval_until = intervals  # ends the run
            else:
                group = int(1)
                interval_until = interval_from
                base_at_end[j] = kept_base[j]
                for i in range(N):
                    drifts[i, j] = kept_drifts[i, j]
                    rates[i, j] = kept_rates[i, j]
                    path[i, j] = kept_path[i, j]
                    moves[i, j] = kept_moves[i, j]
                    carried[i, j] = kept_carried[i, j]
                    turns[i, j] = kept_turns[i, j]
                    peak_drift[i, j] = kept_peak[i, j]
                    for m in range(M):
                        z[i * M + m, j] = kept_memory[i * M + m, j]
