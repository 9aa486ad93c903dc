"""Implicit methods for lumped structures: a step solves the equation of motion at its end by Newton's method.

The unknowns are the accelerations of the degrees of freedom at the end of the step (with Wilson's method, at t + theta
h), as in skeletons/implicit_chain.py. Forces are evaluated by the same statements as in a stage of an explicit method.
The matrix of the linear system is found column by column: these statements, with the tangents of the springs, are
applied to a unit change of each acceleration. It is full and solved with pivoting, so that a thread integrates one
sample. If a correction does not reduce the unbalanced acceleration, it is halved.
"""

from warpdyn.engine.laws.springs import Variant, spring_row
from warpdyn.engine.methods.table import METHODS

# The search ends if the unbalanced acceleration, relative to the largest one so far, is at most TOLERANCE. It also ends
# if it no longer decreases and is at most ROUNDINGS: then the rounding of stiff springs limits it.
TOLERANCE = {"float32": 1e-6, "float64": 1e-12}
ROUNDINGS = {"float32": 1e-3, "float64": 1e-9}
MOST_ITERATIONS = 100


def wanted(plan):
    return plan.pattern is not None and plan.kind == "implicit"


def values_held(plan):
    return plan.dofs * (plan.dofs + 9) + 2 * plan.pattern.springs


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.lumped.assembly import element, first_places
    from warpdyn.engine.kernels.lumped.pattern import products
    from warpdyn.engine.kernels.plan import DTYPES

    dtype, method, pattern = DTYPES[plan.dtype], METHODS[plan.method], plan.pattern
    law = spring_row(plan.law)
    numbers = {
        "beta": method.beta,
        "gamma": method.gamma,
        "theta": method.extension,
        "inverse_theta": 1 / method.extension,
        "mass_share": 1 - method.mass_lag,
        "force_lag": method.force_lag,
        "force_share": 1 - method.force_lag,
        "tolerance": TOLERANCE[plan.dtype],
        "roundings": ROUNDINGS[plan.dtype],
    }
    first = first_places(pattern)["inverse_mass"]
    response = products(pattern.inverse_mass, "terms", element("unit_load"), element("unit_response"), first=first)
    return {
        **{name: wp.constant(dtype(float(value))) for name, value in numbers.items()},
        "most_iterations": MOST_ITERATIONS,
        "IS_NEWTON": not (isinstance(plan.law, Variant) and plan.law.name == "elastic"),
        "LAGS_BEHIND": bool(method.mass_lag or method.force_lag) or method.extension != 1,
        "FOLLOWS": law.memory_after is not None,
        "square": wp.types.matrix(shape=(plan.dofs * plan.dofs, plan.lanes), dtype=dtype),
        "UNIT_RESPONSES": response,
    }


def declare():
    method_acceleration = matrix()  # the method's acceleration of the accepted state
    start_acceleration = matrix()  # by the equation of motion at this state
    change_of_acceleration = matrix()
    tried_u = matrix()
    tried_v = matrix()
    unbalanced_of = matrix()
    newton_change = matrix()
    shaken_before = matrix()  # base acceleration at the start and at the end of the step
    shaken_after = matrix()
    unit_load = matrix()
    unit_response = matrix()
    weight_of = matrix()  # root of the mass that a force on this degree of freedom moves
    system = square()
    swapped = matrix()
    earlier = spring_rows()  # deformations of the accepted state
    slope_of = spring_rows()  # tangents
    unbalanced_sum = row()
    unbalanced_before = row()
    largest_sum = row()
    present_sum = row()
    share_taken = row()
    failed_search = indices()
    has_factors = indices()  # 1 after the matrix was factored, once for linear springs: the first steps may be at rest


def memory_of_stage():
    slot("accepted_memory")


def restore():
    f = held_of(drift, memory, c)


def start():
    for j in range(LANES):
        for q in range(N):
            for i in range(N):
                unit_load[i, j] = dtype(0.0)
            unit_load[q, j] = dtype(1.0)
            UNIT_RESPONSES
            weight_of[q, j] = dtype(1.0) / wp.sqrt(unit_response[q, j])


def take_step():
    if h[0] > dtype(0.0):
        slot("begin_implicit_step")
        unsettled = int(1)
        iteration = int(0)
        while unsettled > 0 and iteration < most_iterations:
            slot("evaluate_trial")
            unsettled = int(0)
            for j in range(LANES):
                slot("judge_trial")
            if unsettled == 1:
                for j in range(LANES):
                    slot("correct_trial")
            if unsettled == 2:  # halve the last correction
                for j in range(LANES):
                    share_taken[j] *= dtype(0.5)
                    for i in range(N):
                        change_of_acceleration[i, j] -= share_taken[j] * newton_change[i, j]
            if unsettled > 0:
                for j in range(LANES):
                    reach = theta * h[j]
                    for i in range(N):
                        change = change_of_acceleration[i, j]
                        ahead = dtype(0.5) * method_acceleration[i, j] + beta * change
                        us[i, j] = u[i, j] + reach * (v[i, j] + reach * ahead)
                        vs[i, j] = v[i, j] + reach * (method_acceleration[i, j] + gamma * change)
            iteration += 1
        if unsettled > 0:
            failed_search[0] = 1
        slot("accept_step")


def begin_implicit_step():
    for j in range(LANES):
        reach = theta * h[j]
        for i in range(N):
            vi = vs[i, j]
            ai = felt[i, j]
            slot("add_to_acceleration")
            if IS_SHAKEN:
                ai -= shaken[i, j]
            start_acceleration[i, j] = ai
            if LAGS_BEHIND:
                if index == 0:
                    method_acceleration[i, j] = ai
                elif IS_SHAKEN:  # a motion that does not end with zero jumps at its end
                    method_acceleration[i, j] += shaken_after[i, j] - shaken[i, j]
                shaken_before[i, j] = shaken[i, j]
            else:
                method_acceleration[i, j] = ai
            change_of_acceleration[i, j] = dtype(0.0)
            us[i, j] = u[i, j] + reach * (v[i, j] + dtype(0.5) * reach * method_acceleration[i, j])
            vs[i, j] = v[i, j] + reach * method_acceleration[i, j]
        for i in range(SPRINGS):
            earlier[i, j] = deformation[i, j]
        share_taken[j] = dtype(1.0)
        slot("begin_walk", stage=1)


def evaluate_trial():
    slot("gather_springs")
    for i in range(SPRINGS):
        for j in range(LANES):
            drift = deformation[i, j]
            rate = deformation_rate[i, j]
            slot("storey_coefficients")
            slot("accepted_memory")
            after = memory
            if FOLLOWS:
                after = advance(drift, drift - earlier[i, j], memory, c)
            f = held_of(drift, after, c)
            slope_of[i, j] = tangent_of(drift, drift - earlier[i, j], memory, after, c)
            if HAS_ADD_TO_DASHPOT:
                dashpot = dtype(0.0)
                slot("add_to_dashpot")
                f += dashpot
            spring_force[i, j] = f
    if HAS_ADD_LOAD:
        for i in range(N):
            for j in range(LANES):
                net = dtype(0.0)
                slot("add_load", stage=1)
                applied[i, j] = net
    slot("gather_forces")
    for j in range(LANES):
        unbalanced_sum[j] = dtype(0.0)
        present_sum[j] = dtype(0.0)
        for i in range(N):
            vi = vs[i, j]
            ai = felt[i, j]
            slot("add_to_acceleration")
            if IS_SHAKEN:
                ai -= shaken[i, j]
            inertial = method_acceleration[i, j] + mass_share * change_of_acceleration[i, j]
            inertial -= force_lag * start_acceleration[i, j]
            unbalanced_of[i, j] = force_share * ai - inertial
            unbalanced_sum[j] += weight_of[i, j] * wp.abs(unbalanced_of[i, j])
            present_sum[j] += weight_of[i, j] * (wp.abs(felt[i, j]) + wp.abs(inertial))


def judge_trial():
    largest_sum[j] = wp.max(largest_sum[j], present_sum[j])
    is_stalled = unbalanced_sum[j] > dtype(0.5) * unbalanced_before[j] and iteration > 1
    if unbalanced_sum[j] > tolerance * largest_sum[j]:
        unsettled = int(1)
        if is_stalled and unbalanced_sum[j] <= roundings * largest_sum[j]:
            unsettled = int(0)
        elif iteration > 0 and unbalanced_sum[j] >= unbalanced_before[j] and share_taken[j] > dtype(0.002):
            unsettled = int(2)
    if unsettled == 1:
        unbalanced_before[j] = unbalanced_sum[j]


def correct_trial():
    if IS_NEWTON or has_factors[j] == 0:
        slot("find_system")
        slot("factor_system")
        has_factors[j] = 1
    slot("solve_system")
    share_taken[j] = dtype(1.0)
    for i in range(N):
        change_of_acceleration[i, j] += newton_change[i, j]


def find_system():
    # Column by column: the change of the unbalanced acceleration by a unit change of each acceleration.
    reach = theta * h[j]
    for i in range(N):
        tried_u[i, j] = us[i, j]
        tried_v[i, j] = vs[i, j]
    for q in range(N):
        for i in range(N):
            us[i, j] = dtype(0.0)
            vs[i, j] = dtype(0.0)
            applied[i, j] = dtype(0.0)
        us[q, j] = beta * reach * reach
        vs[q, j] = gamma * reach
        slot("gather_springs")
        for i in range(SPRINGS):
            rate = deformation_rate[i, j]
            f = slope_of[i, j] * deformation[i, j]
            if HAS_ADD_TO_DASHPOT:
                dashpot = dtype(0.0)
                slot("add_to_dashpot")
                f += dashpot
            spring_force[i, j] = f
        slot("gather_forces")
        for i in range(N):
            vi = vs[i, j]
            ai = felt[i, j]
            slot("add_to_acceleration")
            system[i * N + q, j] = -force_share * ai
        system[q * N + q, j] += mass_share
    for i in range(N):
        us[i, j] = tried_u[i, j]
        vs[i, j] = tried_v[i, j]


def factor_system():
    for q in range(N):
        chosen = int(q)
        for i in range(q + 1, N):
            if wp.abs(system[i * N + q, j]) > wp.abs(system[chosen * N + q, j]):
                chosen = int(i)
        swapped[q, j] = dtype(chosen)
        for k in range(N):
            moved = system[q * N + k, j]
            system[q * N + k, j] = system[chosen * N + k, j]
            system[chosen * N + k, j] = moved
        for i in range(q + 1, N):
            quotient = system[i * N + q, j] / system[q * N + q, j]
            system[i * N + q, j] = quotient
            for k in range(q + 1, N):
                system[i * N + k, j] -= quotient * system[q * N + k, j]


def solve_system():
    for i in range(N):
        newton_change[i, j] = unbalanced_of[i, j]
    for q in range(N):
        chosen = int(swapped[q, j])
        moved = newton_change[q, j]
        newton_change[q, j] = newton_change[chosen, j]
        newton_change[chosen, j] = moved
        for i in range(q + 1, N):
            newton_change[i, j] -= system[i * N + q, j] * newton_change[q, j]
    for down in range(N):
        q = N - 1 - down
        for k in range(q + 1, N):
            newton_change[q, j] -= system[q * N + k, j] * newton_change[k, j]
        newton_change[q, j] /= system[q * N + q, j]


def accept_step():
    for j in range(LANES):
        for i in range(N):
            raised = change_of_acceleration[i, j] * inverse_theta
            mean_raised = dtype(0.5) * method_acceleration[i, j] + beta * raised
            u[i, j] += h[j] * (v[i, j] + h[j] * mean_raised)
            v[i, j] += h[j] * (method_acceleration[i, j] + gamma * raised)
            method_acceleration[i, j] += raised
            us[i, j] = u[i, j]
            vs[i, j] = v[i, j]
            if LAGS_BEHIND and IS_SHAKEN:
                shaken_after[i, j] = shaken_before[i, j] + inverse_theta * (shaken[i, j] - shaken_before[i, j])
    if FOLLOWS:
        slot("gather_springs")
        for i in range(SPRINGS):
            for j in range(LANES):
                slot("storey_coefficients")
                slot("accepted_memory")
                after = advance(deformation[i, j], deformation[i, j] - earlier[i, j], memory, c)
                for m in range(M):
                    z[i * M + m, j] = after[m]


def judge_state():
    if failed_search[j] > 0:
        status = not_converged
