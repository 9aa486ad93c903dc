"""Stability of the memory of rate laws, whose memory follows a differential equation.

If a step is too long, deviations of the memory from its steady value grow. This kernel part estimates the growth, and
sets the status unstable_step if it exceeds LARGEST_DEVIATION.
"""

from warpdyn.engine.laws.rate_law import LARGEST_DEVIATION, deviation_after
from warpdyn.engine.laws.springs import spring_row
from warpdyn.engine.methods.table import METHODS


def wanted(plan):
    method = METHODS[plan.method]
    is_followed = method.kind == "implicit" or (method.kind == "explicit" and not method.is_adaptive)
    settles = spring_row(plan.law).relaxation_rate is not None or pairs_settle(plan)
    return plan.family in ("chain", "lumped") and is_followed and settles


def pairs_settle(plan):
    """Return whether the memory of biaxial springs follows a differential equation."""
    if plan.pattern is None or plan.pattern.biaxial_law is None:
        return False
    from warpdyn.engine.laws.biaxial.functions import biaxial_functions

    return biaxial_functions(plan.pattern.biaxial_law).relaxation_rate is not None


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES, constants, settling_limit, settling_polynomial

    is_implicit = plan.kind == "implicit" and plan.pattern is None
    dtype, law = DTYPES[plan.dtype], spring_row(plan.law)
    return {
        **({} if law.relaxation_rate is None else {"relaxation_of": law.relaxation_rate}),
        "SPRINGS_SETTLE": law.relaxation_rate is not None,
        "relaxation_along": law.relaxation_over_step,
        "BY_VELOCITY": law.relaxes_by_velocity,
        "largest_deviation": wp.constant(dtype(LARGEST_DEVIATION)),
        "settling": constants(plan, settling_polynomial(plan)),
        **({} if is_implicit else {"settles_until": wp.constant(dtype(settling_limit(plan)))}),
    }


def declare():
    fastest = row()  # the largest rate at which a memory decays in this step
    deviation = row()  # deviation of a memory from its steady value, relative to the initial deviation
    deviation_so_far = row()  # the largest deviation so far
    watched_from = row()  # rate times step above which deviations grow; negative while one is followed


def read_sample():
    if EXPLICIT_CHAIN or EXPLICIT_LUMPED:
        watched_from[j] = settles_until


def settle_storey():
    fastest[j] = larger(fastest[j], relaxation_along(drift - drift_before, memory, c))


def end_storey():
    if not EXPLICIT_LUMPED:
        if BY_VELOCITY and not KEEPS_DRIFTS:
            if stage == 0:
                settles = relaxation_of(rate, memory, c)
                if i < N - 1:
                    settles = larger(fastest[j], settles)
                fastest[j] = settles
        else:
            fastest[j] = larger(fastest[j], relaxation_of(rate, memory, c))


def end_spring():
    if SPRINGS_SETTLE:
        fastest[j] = larger(fastest[j], relaxation_of(rate, memory, c))


def end_step():
    if EXPLICIT_CHAIN or EXPLICIT_LUMPED:
        # Below the limit deviations decay, so most steps need no test.
        some_may_grow = int(0)
        for j in range(LANES):
            if SECTIONS:
                fastest[j] = across(fastest[j], THREADS)
            some_may_grow = some_may_grow | wp.where(fastest[j] * h[j] <= watched_from[j], 0, 1)
        if some_may_grow > 0:
            for j in range(LANES):
                grown = deviation_after(deviation[j], fastest[j] * h[j], settling)
                deviation[j] = grown
                if not grown <= deviation_so_far[j]:
                    deviation_so_far[j] = grown
                watched_from[j] = settles_until
                if not grown <= dtype(1.0):
                    watched_from[j] = -dtype(1.0)
        if not BY_VELOCITY or KEEPS_DRIFTS or EXPLICIT_LUMPED:
            for j in range(LANES):
                fastest[j] = dtype(0.0)
    if IMPLICIT_CHAIN:
        for j in range(LANES):
            grown = deviation_after(deviation[j], fastest[j], settling)
            deviation[j] = grown
            if not grown <= deviation_so_far[j]:
                deviation_so_far[j] = grown
            fastest[j] = dtype(0.0)


def judge_step():
    # A deviation beyond the limit is also the cause of a state that is not finite: this status overrides diverged.
    if not deviation_so_far[j] <= largest_deviation:
        status = unstable_step
