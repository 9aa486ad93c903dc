"""P-Delta effect: the gravity loads on the drifting storeys reduce the restoring force by weight / height * drift."""

from typing import Any

import warp as wp

order = -5

BORROWS = {"half_steps": ("rates",), "drift": ("peak_drift",), "collapse": ("collapse_storey", "collapse_time")}
FIELDS = {"Structure": {"storey_weight_over_height": "float[,]"}}


@wp.func
def keeps_falling(outward: Any, drift: Any, rate: Any, peak: Any):
    """Return whether gravity pushes a storey beyond its largest drift so far, so that the storey will not stop.

    Args:
        outward: P-Delta force minus the force of the storey law [N].
        drift: Present drift [m].
        rate: Drift velocity [m/s].
        peak: Largest absolute drift so far [m].
    """
    zero = type(drift)(0.0)
    return outward * drift > zero and rate * drift > zero and wp.abs(drift) >= peak


def wanted(plan):
    return "p_delta" in plan.physics


def values_held(plan):
    return plan.dofs if "drift" in plan.recorders else 2 * plan.dofs


def declare():
    weight_over_height = matrix()
    if not DRIFT:
        farthest_drift = matrix()  # the largest drift so far
    falling = row()  # the storey that is still falling at the end of the run, counted from 1
    lifted = row()  # energy that gravity supplied since the upright state


def read_storey():
    weight_over_height[i, j] = structures.storey_weight_over_height[g, s]


def add_to_initial_energy():
    initial_energy[j] -= dtype(0.5) * weight_over_height[i, j] * drift * drift


def add_to_force():
    f -= weight_over_height[i, j] * drift


def add_to_stiffness():
    stiffness -= weight_over_height[i, j]


def see_drift():
    if not DRIFT:
        farthest_drift[i, j] = larger(farthest_drift[i, j], wp.abs(drift))


def finish():
    falling[j] = dtype(0.0)


def finish_drift():
    overturning = weight_over_height[i, j] * drift
    lifted[j] += dtype(0.5) * overturning * drift
    if KEEPS_DRIFTS:
        rate = rates[i, j]
    else:
        rate = v[i, j]
        if i > 0:
            rate -= v[i - 1, j]
        elif SECTIONS:
            rate -= foot_v[j]
    outward = overturning - held_of(drift, memory, c)
    largest_drift = peak_drift[i, j] if DRIFT else farthest_drift[i, j]
    if keeps_falling(outward, drift, rate, largest_drift):
        falling[j] = dtype(g + 1)


def after_finish():
    if SECTIONS:
        falling[j] = across(falling[j], THREADS)
        lifted[j] = together(lifted[j], THREADS)


def judge_state():
    if falling[j] > dtype(0.0) and status == ok:
        status = collapsed
        collapse_storey[j] = falling[j]
        collapse_time[j] = dtype(live_intervals[j] * substeps) * step[j]  # the end of the run


def add_to_supplied():
    unaccounted += lifted[j]  # gravity supplied energy, too
    most += lifted[j]
