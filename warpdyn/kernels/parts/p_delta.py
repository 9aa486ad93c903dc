"""Gravity, which pushes leaning storeys over: P-Delta on the storeys' own drifts."""

from typing import Any

import warp as wp

order = -5
FIELDS = {"Structure": {"storey_weight_over_height": "float[,]"}}


@wp.func
def is_pushed_out(outward: Any, drift: Any, rate: Any):
    """Return whether the net force on a storey and its velocity are outward."""
    zero = type(drift)(0.0)
    return outward * drift > zero and rate * drift > zero


@wp.func
def has_overturned(outward: Any, drift: Any, rate: Any, step: Any, ratio: Any, limit: Any):
    """Return whether a storey whose drift ratio has passed a limit was pushed over by gravity, and did not blow up.

    Gravity wins slowly: the net force is outward, so is the velocity, and within a step the drift grows by a fraction.
    What a step too long amplifies goes to and fro from step to step, and is far beyond the limit once it is seen.
    """
    is_slow = wp.abs(rate) * step < type(drift)(0.5) * wp.abs(drift) and ratio < type(drift)(2.0) * limit
    return is_pushed_out(outward, drift, rate) and is_slow


@wp.func
def keeps_falling(outward: Any, drift: Any, rate: Any, peak: Any):
    """Return whether a storey at its largest drift so far is pushed further out by gravity: it will not stop."""
    return is_pushed_out(outward, drift, rate) and wp.abs(drift) >= peak


def wanted(plan):
    return "p_delta" in plan.physics


def values_held(plan):
    return plan.dofs


def names(plan):
    from warpdyn.kernels.plan import DTYPES

    dtype = DTYPES[plan.dtype]
    return {"fell": wp.constant(dtype(1.0)), "burst": wp.constant(dtype(2.0))}  # what became of a storey


def declare():
    weight_over_height = matrix()
    fallen = row()  # while it runs the largest drift ratio, at the end the code `fell` or `burst`
    lifted = row()  # what gravity gave, from upright: the work of lifting the storeys again
    if not SECTIONS:
        foot_u = row()


def read_storey():
    weight_over_height[i, j] = structures.storey_weight_over_height[g, s]


def add_to_initial_energy():
    initial_energy[j] -= dtype(0.5) * weight_over_height[i, j] * drift * drift


def begin_interval():
    for j in range(LANES):
        fallen[j] = dtype(0.0)
        foot_u[j] = dtype(0.0)
        if SECTIONS:
            foot_u[j] = below(u[N - 1, j], section, THREADS)
    for i in range(N):
        for j in range(LANES):
            drift = u[i, j] - foot_u[j]
            foot_u[j] = u[i, j]
            fallen[j] = larger(fallen[j], wp.abs(drift) * inverse_height[i, j])
    if SECTIONS:
        for j in range(LANES):
            fallen[j] = across(fallen[j], THREADS)


def stop_lane():
    # A storey that fell over would go on, ever faster, until nothing of it is finite.
    if fallen[j] > blown_up:
        h[j] = dtype(0.0)


def add_to_force():
    f -= weight_over_height[i, j] * drift


def add_to_stiffness():
    stiffness -= weight_over_height[i, j]


def finish():
    fallen[j] = dtype(0.0)


def finish_drift():
    overturning = weight_over_height[i, j] * drift
    lifted[j] += dtype(0.5) * overturning * drift
    ratio = wp.abs(drift) * inverse_height[i, j]
    rate = v[i, j]
    if i > 0:
        rate -= v[i - 1, j]
    elif SECTIONS:
        rate -= foot_v[j]
    outward = overturning - held_of(drift, memory, c)
    if DRIFT:
        if keeps_falling(outward, drift, rate, peak_drift[i, j]):
            fallen[j] = larger(fallen[j], fell)
    if ratio > blown_up:
        overturned = has_overturned(outward, drift, rate, step[j], ratio, blown_up)
        fallen[j] = larger(fallen[j], wp.where(overturned, fell, burst))


def after_finish():
    if SECTIONS:
        fallen[j] = across(fallen[j], THREADS)
        lifted[j] = together(lifted[j], THREADS)


def judge_state():
    if fallen[j] == fell:
        status = collapsed
    if fallen[j] == burst:
        status = diverged


def add_to_supplied():
    unaccounted += lifted[j]  # what gravity gave was supplied too
    most += lifted[j]
