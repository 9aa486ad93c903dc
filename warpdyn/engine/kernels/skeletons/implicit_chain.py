"""The time loop of kernels for shear chains and implicit methods: one tridiagonal system per step, solved in registers.

The unknowns of the system are the accelerations at the end of the step (with Wilson's method, at t + theta h). The
matrix has the form of a chain with a mass term per floor (including dampers to the ground) and a storey term s = (1 -
force_lag) (gamma theta h c + beta (theta h)^2 k). A loop from the top down computes the residual and eliminates; a loop
upwards substitutes. The pivot of a floor is the term of the storey below plus a positive term of the floors above, so
that no digits cancel. A negative stiffness (P-Delta, loss of strength) reduces the mass term only a little. The
function in this module that contains the time loop is a skeleton: `compose` replaces each of its `slot(...)` statements
by the statements of the chosen parts of the kernel, such as the method, the load and the recorders.
"""

from __future__ import annotations

from warpdyn.engine.device.processor import align_rows
from warpdyn.engine.kernels.plan import DTYPES, Plan
from warpdyn.engine.kernels.stepping import search
from warpdyn.engine.kernels.stepping.search import is_newton
from warpdyn.engine.methods.table import METHODS

# Newton's method needs 1 to 6 iterations, and 20 to 50 if many storeys start or stop yielding in one long step. With
# modal damping each iteration reduces the error by a constant factor, which in the worst case needs 20 to 50
# iterations, too.
MOST_ITERATIONS = 100


def names(plan: Plan) -> dict[str, object]:
    """Return the objects to which names in the text of the time loop refer: {name: constant, type or function}."""
    import warp as wp

    dtype, method = DTYPES[plan.dtype], METHODS[plan.method]
    numbers = {
        "beta": method.beta,
        "gamma": method.gamma,
        "theta": method.extension,
        "mass_share": 1 - method.mass_lag,
        "force_lag": method.force_lag,
        "force_share": 1 - method.force_lag,
        "inverse_theta": 1 / method.extension,
    }
    return {
        **{name: wp.constant(dtype(float(value))) for name, value in numbers.items()},
        # With beta = 0 the displacement and the restoring force are known; the system contains only mass and damping.
        "SOLVES_DRIFT": method.beta > 0,
        "NEWTON": is_newton(plan),
        # Whether the forces of each accepted state are needed. The forces of the first state always give the first
        # acceleration.
        "SEES_FORCES": method.force_lag > 0,
        "most_walks": wp.constant(1 + (MOST_ITERATIONS if search.wanted(plan) else 1)),
        "TAKES_MEMORY": False,
        "MAPS_IN_STAGE": False,
    }


def integrate_implicit_chain(
    first: int, control: Control, samples: Samples, structures: Structure, loads: Load, output: Output, history: History
):
    align_rows()
    block = first + wp.tid()
    mass = matrix()
    inverse_mass = matrix()
    inverse_height = matrix()
    coefficients = table()
    u = matrix()  # accepted state: displacement, velocity, the method's acceleration, memory of the law
    v = matrix()
    a = matrix()
    z = memories()
    us = matrix()  # the state that satisfies the equation of motion
    vs = matrix()
    rise = matrix()  # change of the acceleration to this state
    start_acceleration = matrix()  # acceleration of the first state, from the equation of motion
    above = row()  # the force from above
    below_now = row()
    below_before = row()
    h = row()  # the step, 0 for a lane that has finished, and the step before
    h_last = row()
    slot("declare")
    for j in range(LANES):
        slot("read_lane")
        reach = theta * step[j]
        of_damping = force_share * gamma * reach
        of_stiffness[j] = force_share * beta * reach * reach
        slot("read_sample")
        for i in range(N):
            mass[i, j] = structures.mass[i, s]
            inverse_mass[i, j] = structures.inverse_mass[i, s]
            solved_mass[i, j] = mass_share * mass[i, j]
            inverse_height[i, j] = structures.inverse_height[i, s]
            for q in range(C):
                coefficients[i * C + q, j] = structures.coefficients[i * C + q, s]
            u[i, j] = loads.initial_displacement[i]
            v[i, j] = loads.initial_velocity[i]
            slot("read_storey")
    for i in range(N):
        for j in range(LANES):
            us[i, j] = u[i, j]
            vs[i, j] = v[i, j]
            if HAS_START_DRIFT:
                slot("accepted_drift")
                slot("start_drift")
            slot("start_storey")
    inverse_substeps = dtype(1.0) / dtype(substeps)
    slot("start")
    # One interval of one step after the longest run: it computes the forces of the last state.
    for interval in range(intervals + 1):
        slot("begin_interval")
        if COLLAPSE:
            if standing == 0:
                break
        for j in range(LANES):
            # A lane that has finished waits for the others with a step of zero: its state and sums do not change.
            h[j] = wp.where(interval < live_intervals[j], step[j], dtype(0.0))
            slot("stop_lane")
            slot("settle_lane")
        slot("in_interval")
        steps_here = substeps
        if interval == intervals:
            steps_here = 1
        for substep in range(steps_here):
            index = interval * substeps + substep
            position = dtype(substep) / dtype(substeps)
            position_end = dtype(substep + 1) / dtype(substeps)
            slot("begin_step")
            waiting = int(1)
            # Iteration 0 evaluates the accepted state for recorders; the others search for the next state.
            walk = int(0)
            load_reach = dtype(0.0)  # towards the step's end
            if not (SEES_FORCES or HAS_SEE_FORCES or ENERGY):
                if index > 0:
                    walk = int(1)
            while waiting > 0 and walk < most_walks:
                if walk == 1:
                    # The search starts from an unchanged acceleration.
                    load_reach = theta
                    for j in range(LANES):
                        h_last[j] = h[j]
                        slot("begin_search")
                    for i in range(N):
                        for j in range(LANES):
                            reach = theta * h[j]
                            us[i, j] = u[i, j] + reach * (v[i, j] + dtype(0.5) * reach * a[i, j])
                            vs[i, j] = v[i, j] + reach * a[i, j]
                            rise[i, j] = dtype(0.0)
                            slot("begin_search_of_storey")
                slot("damp_modes")
                for j in range(LANES):
                    above[j] = dtype(0.0)
                    slot("begin_walk")
                for down in range(N):
                    i = N - 1 - down
                    slot("before_storey")
                    for j in range(LANES):
                        drift = us[i, j]
                        rate = vs[i, j]
                        drift_before = u[i, j]
                        if i > 0:
                            drift -= us[i - 1, j]
                            rate -= vs[i - 1, j]
                            drift_before -= u[i - 1, j]
                        slot("storey_coefficients")
                        slot("accepted_memory")
                        if not HAS_RESTORE:
                            after = memory
                            if HAS_MEMORY:
                                after = advance(drift, drift - drift_before, memory, c)
                            f = held_of(drift, after, c)
                            stiffness = tangent_of(drift, drift - drift_before, memory, after, c)
                        slot("restore")
                        restoring = f
                        slot("add_to_force")
                        if HAS_ADD_TO_DASHPOT:
                            if not STOREY:
                                dashpot = dtype(0.0)
                            slot("add_to_dashpot")
                            f += dashpot
                        # Force on the floor: its absolute acceleration times its mass.
                        net = above[j] - f
                        above[j] = f
                        slot("add_to_net")
                        slot("add_load")
                        if walk == 0:
                            vi = v[i, j]
                            ai = net * inverse_mass[i, j]
                            slot("see_forces")
                            slot("add_base")
                            start_acceleration[i, j] = ai
                            if index == 0:
                                a[i, j] = ai
                            slot("add_powers")
                        slot("add_base_to_net")
                        inertia = a[i, j] + mass_share * rise[i, j] - force_lag * start_acceleration[i, j]
                        residual = force_share * net - mass[i, j] * inertia
                        slot("add_to_stiffness")
                        slot("add_to_imbalance")
                        slot("eliminate")
                        slot("follow_slope")
                if walk > 0:
                    waiting = int(0)
                    slot("judge_walk")
                    slot("substitute")
                walk += 1
            for j in range(LANES):
                slot("end_search")
                below_now[j] = dtype(0.0)
                below_before[j] = dtype(0.0)
            for i in range(N):
                for j in range(LANES):
                    drift_before = u[i, j] - below_before[j]
                    below_before[j] = u[i, j]
                    change = rise[i, j] * inverse_theta
                    u[i, j] += h[j] * (v[i, j] + h[j] * (dtype(0.5) * a[i, j] + beta * change))
                    v[i, j] += h[j] * (a[i, j] + gamma * change)
                    a[i, j] += change
                    us[i, j] = u[i, j]
                    vs[i, j] = v[i, j]
                    drift = u[i, j] - below_now[j]
                    below_now[j] = u[i, j]
                    slot("storey_coefficients")
                    slot("accepted_memory")
                    slot("settle_storey")
                    if HAS_MEMORY and not STRAIGHT_BRANCHES:
                        after = advance(drift, drift - drift_before, memory, c)
                        for m in range(M):
                            z[i * M + m, j] = after[m]
                    slot("see_drift")
            slot("see_state")
            slot("end_step")
    for j in range(LANES):
        o = samples.order[sample[j]]
        total = dtype(0.0)
        slot("finish")
        for i in range(N):
            total += u[i, j] + v[i, j] + a[i, j] + z[i * M, j]
            for m in range(1, M):
                total += z[i * M + m, j]
            slot("finish_storey")
            if HAS_FINISH_DRIFT:
                slot("accepted_drift")
                slot("storey_coefficients")
                slot("accepted_memory")
                slot("finish_drift")
        status = ok
        slot("judge_demand")
        slot("judge_state")
        # A sum with an infinite value or NaN is not finite, so one test covers the whole state.
        if not wp.isfinite(total):
            status = diverged
        slot("judge_step")
        output.status[o] = status
        slot("write")
