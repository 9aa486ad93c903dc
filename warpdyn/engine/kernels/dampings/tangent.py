"""Damping proportional to the tangent stiffness of each storey, as a dashpot in the storey."""

SHARE_OF_STEP_AHEAD = 2.0**-7  # the tangent stiffness is evaluated at the drift after this fraction of a step

FIELDS = {"Structure": {"tangent_damping": "float[]"}}  # Rayleigh's factor of the tangent stiffness


def wanted(plan):
    return plan.damping == "rayleigh_tangent"


def values_held(plan):
    return 1


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    return {"AHEAD": wp.constant(DTYPES[plan.dtype](SHARE_OF_STEP_AHEAD))}


def declare():
    tangent_damping = row()


def read_sample():
    tangent_damping[j] = structures.tangent_damping[s]


def tangent_ahead():
    # The tangent just ahead of the drift: at a yield point, rounding would decide the branch.
    # On a falling branch the dashpot is 0: a negative one would supply energy.
    ahead = drift + AHEAD * h[j] * rate
    after = memory
    if IS_MAPPING:
        after = mapped_memory(ahead, memory, c)
    tangent = wp.max(tangent_of(ahead, rate, memory, after, c), dtype(0.0))


def add_to_dashpot():
    slot("tangent_ahead")
    dashpot += tangent_damping[j] * tangent * rate


def add_to_foot():
    slot("tangent_ahead")
    f += tangent_damping[j] * tangent * rate
