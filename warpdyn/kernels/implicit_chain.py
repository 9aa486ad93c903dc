"""The kernel of shear chains under implicit methods: a tridiagonal system a step, solved in registers.

The unknown is the acceleration at the step's end (with Wilson's method, beyond it). Its matrix is a chain's, of masses
that carry the dampers to the ground and of storeys s = (1 - force_lag) (gamma theta h c + beta (theta h)^2 k): one walk
from the top down sums the residual up and eliminates, one walk back up substitutes. The pivot of a floor is the storey
below it and what it carries, both positive, so that nothing cancels; where a storey's stiffness is negative (gravity
pushes it over, or it loses strength) it takes little off a mass. Lanes and names in capitals are as in the kernel of
explicit methods.
"""

import functools

import warp as wp

from warpdyn.core.output_variables import COLLAPSED, DIVERGED, LARGEST_DRIFT_RATIO, NOT_CONVERGED, OK, UNSTABLE_STEP
from warpdyn.kernels.dampings.mass import MASS_DAMPED
from warpdyn.kernels.loads import LOADS, harmonic, sampled
from warpdyn.kernels.noise import noise_of
from warpdyn.kernels.parts.p_delta import has_overturned, keeps_falling
from warpdyn.kernels.plan import DTYPES, Plan, constants, row_types, settling_polynomial, structs
from warpdyn.kernels.recording import (
    add_to_mean,
    balance_error,
    keep_force,
    keep_state,
    weight_in_mean,
    worst_storey,
)
from warpdyn.laws.devices.viscous_damper import VALUES, damper_force, damper_tangent
from warpdyn.laws.rate_law import LARGEST_DEVIATION, deviation_after
from warpdyn.laws.springs import spring_row
from warpdyn.methods.table import METHODS

# What of the forces may be left unbalanced: of the largest that the sample has met or, once it falls no further, of
# stiffness times displacement, which bears the roundings: in float32 and in tall buildings the second is met first.
TOLERANCE = {"float32": 1e-6, "float64": 1e-12}
ROUNDINGS = {"float32": 4e-6, "float64": 1e-14}
# Newton's iteration takes one to six; some dozens where a long step takes many storeys to and from yield. With modal
# damping each takes off a constant share of the error, at worst as many.
MOST_ITERATIONS = 100


@functools.cache
def implicit_chain_kernel(plan: Plan) -> wp.Kernel:
    """Return the kernel that integrates shear chains by an implicit method as the plan says."""
    dtype, types = DTYPES[plan.dtype], structs(plan.dtype)
    spring, load, method = spring_row(plan.law), LOADS[plan.load], METHODS[plan.method]
    N, LANES, C, M = plan.dofs, plan.lanes, spring.coefficients, spring.memory
    HAS_MEMORY, IS_STIFF = spring.memory_after is not None, spring.relaxation_rate is not None
    # Warp looks names up in branches that are never built too, so each must be some function.
    held_of, recoverable_of, tangent_of = (
        spring.force_at_accepted_state or spring.force,
        spring.elastic_energy,
        spring.tangent,
    )
    advance, relaxation_along = spring.memory_after or spring.force, spring.relaxation_over_step or spring.force
    IS_BASE, IS_HARMONIC, IS_FORCE_HISTORY = load.is_base, load.is_harmonic, load.is_history and not load.is_base
    IS_NOISE, noise = load.noise_states > 0, noise_of(plan)
    IS_RECORD = IS_BASE and not IS_NOISE
    Processes, Numbers, noise_over_interval = noise.Processes, noise.Numbers, noise.over_interval
    STOREY_DAMPING = plan.damping in ("storey", "rayleigh") or plan.viscous_dampers == "linear"
    POWER_DAMPERS, MASS_DAMPING = plan.viscous_dampers == "power", plan.damping in MASS_DAMPED
    HAS_DASHPOTS = STOREY_DAMPING or POWER_DAMPERS
    MODAL_DAMPING = plan.damping == "modal"
    DRIFT, TIME, ACCELERATION, SHEAR, RESIDUAL, ENERGY, HISTORY = (
        name in plan.recorders
        for name in ("drift", "time_of_peak", "acceleration", "base_shear", "residual", "energy", "history")
    )
    P_DELTA = plan.p_delta
    RATIO, SEES_LAST = TIME or RESIDUAL or P_DELTA, ENERGY or P_DELTA
    RESUMES, STATE = plan.resumes, "state" in plan.recorders
    # With beta = 0 the displacement is known, and so is its restoring force: only the damping is solved for.
    SOLVES_DRIFT = method.beta > 0
    NEWTON = (SOLVES_DRIFT and HAS_MEMORY) or POWER_DAMPERS
    ITERATES = NEWTON or MODAL_DAMPING
    # What needs the forces of every accepted state; the first one's give the first acceleration.
    SEES_FORCES = ACCELERATION or SHEAR or ENERGY or HISTORY or method.force_lag > 0
    beta, gamma, theta, mass_share, force_lag, force_share, inverse_theta = (
        wp.constant(dtype(float(value)))
        for value in (
            method.beta,
            method.gamma,
            method.extension,
            1 - method.mass_lag,
            method.force_lag,
            1 - method.force_lag,
            1 / method.extension,
        )
    )
    tolerance, roundings = wp.constant(dtype(TOLERANCE[plan.dtype])), wp.constant(dtype(ROUNDINGS[plan.dtype]))
    largest_deviation = wp.constant(dtype(LARGEST_DEVIATION))
    settling = constants(plan, settling_polynomial(plan))
    most_walks = wp.constant(1 + (MOST_ITERATIONS if ITERATES else 1))
    half, zero = wp.constant(dtype(0.5)), wp.constant(dtype(0.0))
    matrix = wp.types.matrix(shape=(N, LANES), dtype=dtype)
    square = wp.types.matrix(shape=(N * N if MODAL_DAMPING else 1, LANES), dtype=dtype)
    table = wp.types.matrix(shape=(N * C, LANES), dtype=dtype)
    dampers = wp.types.matrix(shape=(N * VALUES if POWER_DAMPERS else 1, LANES), dtype=dtype)
    row, row64, indices = row_types(plan)
    coefficient_vector = wp.types.vector(length=C, dtype=dtype)
    memory_vector = wp.types.vector(length=max(1, M), dtype=dtype)
    # What the memory of all storeys takes, storey by storey; a law without one has no use for the single row.
    memories = wp.types.matrix(shape=(max(1, N * M), LANES), dtype=dtype)
    ok, collapsed, diverged, unstable_step, not_converged = (
        wp.int8(code) for code in (OK, COLLAPSED, DIVERGED, UNSTABLE_STEP, NOT_CONVERGED)
    )
    blown_up = wp.constant(dtype(LARGEST_DRIFT_RATIO))
    fell, burst = wp.constant(dtype(1.0)), wp.constant(dtype(2.0))  # what became of a storey beyond that

    @wp.kernel(module="unique", enable_backward=False, module_options={"max_unroll": plan.max_unroll})
    def integrate_implicit_chain(
        first_block: int,
        control: types.Control,
        samples: types.Samples,
        structures: types.Structure,
        loads: types.Load,
        output: types.Output,
        history: types.History,
    ):
        block = first_block + wp.tid()
        count = control.samples
        substeps = control.substeps
        every = control.every
        sample = indices()
        motion = indices()
        live_intervals = indices()
        mass = matrix()
        inverse_mass = matrix()
        inverse_height = matrix()
        damping = matrix()
        power_damper = dampers()
        weight_over_height = matrix()
        damping_matrix = square()
        mass_damping = row()
        coefficients = table()
        amplitude = matrix()
        frequency = row64()
        phase = row64()
        scale = row()
        step = row()
        u = matrix()  # accepted state: displacement, velocity, the method's acceleration, memory of the law
        v = matrix()
        a = matrix()
        z = memories()
        last_drift = matrix()
        last_force = matrix()
        peak_drift = matrix()
        worst_ratio = row()
        worst_time = row()
        ratio_now = row()
        peak_acceleration = matrix()
        peak_shear = row()
        energy_in = row()
        energy_viscous = row()
        absorbed = matrix()
        initial_energy = row()
        fallen = row()  # the largest drift ratio, and at the end what became of its storey
        lifted = row()  # what gravity gave, from upright: the work of lifting the storeys again
        supplied = row()  # the most energy the sample ever held: what the balance error is relative to
        settled = row()  # fastest rate at which a memory settled in this step, times the step
        deviation = row()  # what is left, or grown, of a memory's deviation from where it settles
        astray = row()  # the most it ever was
        of_stiffness = row()  # what a stiffness adds to the matrix
        solved_mass = matrix()  # what stands in the matrix beside the tangent stiffness, in a chain's form
        solved_damping = matrix()
        passed = matrix()  # what elimination passes from a floor to the one below, and back
        inverse_pivot = matrix()
        eliminated = matrix()
        carried = row()
        us = matrix()  # the state looked for, where the equation of motion is met
        vs = matrix()
        rise = matrix()  # of the acceleration to it
        correction = matrix()
        start_acceleration = matrix()  # by the equation of motion
        damping_force = matrix()
        f0 = matrix()  # nodal force at an interval's start, its change over it, its value at the last step's end
        df = matrix()
        force_end = matrix()
        a0 = row()  # the same of the base's acceleration, and its value at the step's start
        da = row()
        base = row()
        base_end = row()
        sine = row()
        sine_end = row()
        h = row()
        h_last = row()
        above = row()
        above_eliminated = row()
        unbalanced = row()
        unbalanced_last = row()
        size = row()  # of the forces of this walk, of stiffness times displacement, and of the forces met so far
        rounded = row()
        initial_stiffness = matrix()
        largest = row()
        slope = row()  # of the residual along the correction: at its start, at its end, and at the next one's start
        slope_end = row()
        slope_next = row()
        mode = indices()  # of a lane's search: 0 done, 1 goes on, 2 goes half a correction back
        failed = indices()
        below = row()
        below_before = row()
        intervals = int(0)
        residual_start = int(2147483647)
        for j in range(LANES):
            # Lanes past the last sample repeat it: they write the same values again.
            sample[j] = wp.min(block * LANES + j, count - 1)
            s = samples.structure[sample[j]]
            motion[j] = samples.motion[sample[j]]
            live_intervals[j] = samples.run_intervals[sample[j]]
            intervals = wp.max(intervals, live_intervals[j])
            start = live_intervals[j] * substeps - samples.residual_steps[sample[j]]
            residual_start = wp.min(residual_start, start)
            scale[j] = samples.scale[sample[j]]
            step[j] = samples.step[sample[j]]
            reach = theta * step[j]
            of_damping = force_share * gamma * reach
            of_stiffness[j] = force_share * beta * reach * reach
            if IS_HARMONIC:
                frequency[j] = loads.circular_frequency[0]
                phase[j] = loads.phase[0]
            if MASS_DAMPING:
                mass_damping[j] = structures.mass_damping[s]
            if MODAL_DAMPING:
                for i in range(N * N):
                    damping_matrix[i, j] = structures.damping_matrix[i, s]
            for i in range(N):
                mass[i, j] = structures.mass[i, s]
                inverse_mass[i, j] = structures.inverse_mass[i, s]
                solved_mass[i, j] = mass_share * mass[i, j]
                if RATIO:
                    inverse_height[i, j] = structures.inverse_height[i, s]
                if P_DELTA:
                    weight_over_height[i, j] = structures.storey_weight_over_height[i, s]
                if IS_HARMONIC:
                    amplitude[i, j] = loads.amplitude[i] * scale[j]
                if STOREY_DAMPING:
                    damping[i, j] = structures.storey_damping[i, s]
                    solved_damping[i, j] = of_damping * damping[i, j]
                if POWER_DAMPERS:
                    for q in range(VALUES):
                        power_damper[i * VALUES + q, j] = structures.viscous_damper[i * VALUES + q, s]
                if MASS_DAMPING:
                    solved_mass[i, j] += of_damping * mass_damping[j] * mass[i, j]
                if MODAL_DAMPING:
                    # The matrix has the middle three diagonals alone, and iteration sees to the rest. It converges for
                    # any chain: M^-1/2 K M^-1/2 is an M-matrix, so is its root (Alefeld and Schneider 1982, Linear
                    # Algebra Appl. 42), and entries left out of one make a regular splitting (Varga 2000, 3.29).
                    solved_mass[i, j] += of_damping * damping_matrix[i * N + i, j]
                    if i > 0:
                        solved_mass[i, j] += of_damping * damping_matrix[i * N + i - 1, j]
                        solved_damping[i, j] -= of_damping * damping_matrix[i * N + i - 1, j]
                    if i < N - 1:
                        solved_mass[i, j] += of_damping * damping_matrix[i * N + i + 1, j]
                c = coefficient_vector()
                for q in range(C):
                    c[q] = structures.coefficients[i * C + q, s]
                    coefficients[i * C + q, j] = c[q]
                initial_stiffness[i, j] = tangent_of(zero, zero, memory_vector(), memory_vector(), c)
                u[i, j] = loads.initial_displacement[i]
                v[i, j] = loads.initial_velocity[i]
                memory = memory_vector()
                if RESUMES:
                    u[i, j] = structures.initial_displacement[i, s]
                    v[i, j] = structures.initial_velocity[i, s]
                    for m in range(M):
                        z[i * M + m, j] = structures.initial_memory[i * M + m, s]
                        memory[m] = z[i * M + m, j]
                us[i, j] = u[i, j]
                vs[i, j] = v[i, j]
                drift = u[i, j]
                if i > 0:
                    drift -= u[i - 1, j]
                if DRIFT:
                    peak_drift[i, j] = wp.abs(drift)
                if TIME:
                    worst_ratio[j] = wp.max(worst_ratio[j], wp.abs(drift) * inverse_height[i, j])
                if ENERGY:
                    last_drift[i, j] = drift
                    absorbed[i, j] = recoverable_of(drift, memory, c)
                    initial_energy[j] += absorbed[i, j] + half * mass[i, j] * v[i, j] * v[i, j]
                    if P_DELTA:
                        initial_energy[j] -= half * weight_over_height[i, j] * drift * drift

        if IS_NOISE:
            processes = Processes()
            number = Numbers()
            for j in range(LANES):
                number[j] = samples.number[sample[j]]
        # One interval more than the longest run, of a single step: it sees the forces of the last state.
        for interval in range(intervals + 1):
            if IS_NOISE:
                a0, da, processes = noise_over_interval(
                    loads, control.key, number, interval, live_intervals, scale, processes
                )
            if P_DELTA:
                for j in range(LANES):
                    fallen[j] = zero
                    below[j] = zero
                for i in range(N):
                    for j in range(LANES):
                        fallen[j] = wp.max(fallen[j], wp.abs(u[i, j] - below[j]) * inverse_height[i, j])
                        below[j] = u[i, j]
            for j in range(LANES):
                # A lane that is done waits for the others with a step of zero: its state and its sums stand still.
                h[j] = zero
                if interval < live_intervals[j]:
                    h[j] = step[j]
                if P_DELTA:
                    # A storey that fell over would go on, ever faster, until nothing of it is finite.
                    if fallen[j] > blown_up:
                        h[j] = zero
                if IS_RECORD:
                    begin, change = sampled(loads, motion[j], interval, live_intervals[j], 1, 0, scale[j])
                    a0[j] = begin
                    da[j] = change
            for i in range(N):
                for j in range(LANES):
                    # Where a motion ends other than in zero, the acceleration jumps with it.
                    if IS_BASE:
                        a[i, j] -= a0[j] - base_end[j]
                    if IS_FORCE_HISTORY:
                        begin, change = sampled(loads, motion[j], interval, live_intervals[j], N, i, scale[j])
                        f0[i, j] = begin
                        df[i, j] = change
                        a[i, j] += (begin - force_end[i, j]) * inverse_mass[i, j]
            steps_here = substeps
            if interval == intervals:
                steps_here = 1
            for substep in range(steps_here):
                index = interval * substeps + substep
                position = dtype(substep) / dtype(substeps)
                position_end = dtype(substep + 1) / dtype(substeps)
                for j in range(LANES):
                    if IS_BASE:
                        base[j] = a0[j] + position * da[j]
                    if IS_HARMONIC:
                        sine[j] = harmonic(wp.float64(index), step[j], frequency[j], phase[j])
                        sine_end[j] = harmonic(wp.float64(index + 1), step[j], frequency[j], phase[j])
                waiting = int(1)
                # Walk 0 is of the accepted state, for what is to be seen there; the others look for the next one.
                walk = int(0)
                load_reach = zero  # towards the step's end
                if not SEES_FORCES:
                    if index > 0:
                        walk = int(1)
                while waiting > 0 and walk < most_walks:
                    if walk == 1:
                        # The search starts from the acceleration as it is.
                        load_reach = theta
                        for j in range(LANES):
                            h_last[j] = h[j]
                            mode[j] = wp.where(h[j] > zero, 1, 0)
                            if IS_BASE:
                                base_end[j] = a0[j] + position_end * da[j]
                        for i in range(N):
                            for j in range(LANES):
                                reach = theta * h[j]
                                us[i, j] = u[i, j] + reach * (v[i, j] + half * reach * a[i, j])
                                vs[i, j] = v[i, j] + reach * a[i, j]
                                rise[i, j] = zero
                                if IS_FORCE_HISTORY:
                                    force_end[i, j] = f0[i, j] + position_end * df[i, j]
                    if MODAL_DAMPING:
                        for i in range(N):
                            for j in range(LANES):
                                damping_force[i, j] = zero
                            for k in range(N):
                                for j in range(LANES):
                                    damping_force[i, j] += damping_matrix[i * N + k, j] * vs[k, j]
                    for j in range(LANES):
                        above[j] = zero
                        above_eliminated[j] = zero
                        carried[j] = zero
                        unbalanced_last[j] = unbalanced[j]
                        unbalanced[j] = zero
                        size[j] = zero
                        rounded[j] = zero
                        slope_end[j] = zero
                        slope_next[j] = zero
                    for down in range(N):
                        i = N - 1 - down
                        for j in range(LANES):
                            drift = us[i, j]
                            rate = vs[i, j]
                            drift_before = u[i, j]
                            if i > 0:
                                drift -= us[i - 1, j]
                                rate -= vs[i - 1, j]
                                drift_before -= u[i - 1, j]
                            c = coefficient_vector()
                            for q in range(C):
                                c[q] = coefficients[i * C + q, j]
                            before = memory_vector(z[i * M, j])
                            for m in range(1, M):
                                before[m] = z[i * M + m, j]
                            after = before
                            if HAS_MEMORY:
                                after = advance(drift, drift - drift_before, before, c)
                            restoring = held_of(drift, after, c)
                            f = restoring
                            if P_DELTA:
                                f -= weight_over_height[i, j] * drift
                            if STOREY_DAMPING:
                                dashpot = damping[i, j] * rate
                            if POWER_DAMPERS:
                                c0 = power_damper[i * VALUES, j]
                                c1 = power_damper[i * VALUES + 1, j]
                                c2 = power_damper[i * VALUES + 2, j]
                                if STOREY_DAMPING:
                                    dashpot += damper_force(rate, c0, c1, c2)
                                else:
                                    dashpot = damper_force(rate, c0, c1, c2)
                            if HAS_DASHPOTS:
                                f += dashpot
                            # What acts on the floor: absolute acceleration times its mass, but for base motion.
                            net = above[j] - f
                            above[j] = f
                            if MODAL_DAMPING:
                                net -= damping_force[i, j]
                            if MASS_DAMPING:
                                net -= mass_damping[j] * mass[i, j] * vs[i, j]
                            if IS_HARMONIC:
                                net += amplitude[i, j] * (sine[j] + load_reach * (sine_end[j] - sine[j]))
                            if IS_FORCE_HISTORY:
                                force = f0[i, j] + position * df[i, j]
                                net += force + load_reach * (force_end[i, j] - force)
                            if walk == 0:
                                # Half of the steps before and after this state: its weight in the trapezoidal rule.
                                weight = half * (h_last[j] + h[j])
                                vi = v[i, j]
                                ai = net * inverse_mass[i, j]
                                if ACCELERATION:
                                    if weight > zero:
                                        peak_acceleration[i, j] = wp.max(peak_acceleration[i, j], wp.abs(ai))
                                if SHEAR:
                                    if i == 0:
                                        peak_shear[j] = wp.max(peak_shear[j], wp.abs(restoring))
                                if HISTORY:
                                    keep_state(history, samples.output[sample[j]], index, every, i, u[i, j], vi, ai)
                                    keep_force(history, samples.output[sample[j]], index, every, i, restoring)
                                if IS_BASE:
                                    ai -= base[j]
                                start_acceleration[i, j] = ai
                                if index == 0:
                                    a[i, j] = ai
                                if ENERGY:
                                    absorbed[i, j] += half * (last_force[i, j] + restoring) * (drift - last_drift[i, j])
                                    last_force[i, j] = restoring
                                    last_drift[i, j] = drift
                                    # The load may end one step with one value and start the next with another.
                                    if IS_BASE:
                                        impulse = half * (h_last[j] * base_end[j] + h[j] * base[j])
                                        energy_in[j] -= impulse * mass[i, j] * vi
                                    if IS_HARMONIC:
                                        energy_in[j] += weight * amplitude[i, j] * sine[j] * vi
                                    if IS_FORCE_HISTORY:
                                        energy_in[j] += half * (h_last[j] * force_end[i, j] + h[j] * force) * vi
                                    if HAS_DASHPOTS:
                                        energy_viscous[j] += weight * dashpot * rate
                                    if MASS_DAMPING:
                                        energy_viscous[j] += weight * mass_damping[j] * mass[i, j] * vi * vi
                                    if MODAL_DAMPING:
                                        energy_viscous[j] += weight * damping_force[i, j] * vi
                                    if i == 0:
                                        supplied[j] = wp.max(supplied[j], wp.abs(initial_energy[j] + energy_in[j]))
                            if IS_BASE:
                                net -= mass[i, j] * (base[j] + load_reach * (base_end[j] - base[j]))
                            inertia = a[i, j] + mass_share * rise[i, j] - force_lag * start_acceleration[i, j]
                            residual = force_share * net - mass[i, j] * inertia
                            stiffness = tangent_of(drift, drift - drift_before, before, after, c)
                            if P_DELTA:
                                stiffness -= weight_over_height[i, j]
                            if ITERATES:
                                unbalanced[j] += wp.abs(residual)
                                size[j] += wp.abs(f) + mass[i, j] * wp.abs(inertia)
                                if SOLVES_DRIFT:
                                    part = beta * (theta * h[j]) * (theta * h[j]) * rise[i, j]
                                    rounded[j] += initial_stiffness[i, j] * (wp.abs(us[i, j]) + wp.abs(part))
                            if NEWTON or index == 0:
                                # A matrix that stays as it is is factored once a sample.
                                storey = solved_damping[i, j]
                                if SOLVES_DRIFT:
                                    storey += of_stiffness[j] * stiffness
                                if POWER_DAMPERS:
                                    storey += force_share * gamma * theta * h[j] * damper_tangent(rate, c0, c1, c2)
                                above_it = solved_mass[i, j] + carried[j]
                                inverse_pivot[i, j] = dtype(1.0) / (above_it + storey)
                                passed[i, j] = storey * inverse_pivot[i, j]
                                carried[j] = passed[i, j] * above_it
                            eliminated[i, j] = residual + above_eliminated[j]
                            above_eliminated[j] = passed[i, j] * eliminated[i, j]
                            if NEWTON:
                                slope_end[j] += residual * correction[i, j]
                                slope_next[j] += eliminated[i, j] * eliminated[i, j] * inverse_pivot[i, j]
                    if walk > 0:
                        waiting = int(0)
                        if ITERATES:
                            for j in range(LANES):
                                if mode[j] > 0:
                                    mode[j] = 1
                                    if unbalanced[j] <= tolerance * wp.max(largest[j], size[j]):
                                        mode[j] = 0
                                        largest[j] = wp.max(largest[j], size[j])
                                    elif walk == 1:
                                        # A state that is not finite has nothing to look for.
                                        if not wp.isfinite(unbalanced[j]):
                                            mode[j] = 0
                                    elif (
                                        unbalanced[j] <= roundings * (size[j] + rounded[j])
                                        and unbalanced[j] > half * unbalanced_last[j]
                                    ):
                                        mode[j] = 0
                                    elif NEWTON:
                                        # A step minimises a convex function, and `slope` is that along the correction:
                                        # one that overshoots the bottom, as from one side of a yield point to the
                                        # other and back for ever, is halved (Matthies and Strang 1979, IJNME 14).
                                        if not (slope_end[j] >= -half * slope[j]):
                                            mode[j] = 2
                                    slope[j] = wp.where(mode[j] == 2, half * slope[j], slope_next[j])
                                waiting = wp.max(waiting, mode[j])
                        for j in range(LANES):
                            below[j] = zero
                        for i in range(N):
                            for j in range(LANES):
                                found = eliminated[i, j] * inverse_pivot[i, j] + passed[i, j] * below[j]
                                below[j] = found
                                change = zero
                                if mode[j] == 1:
                                    change = found
                                if NEWTON:
                                    if mode[j] == 2:
                                        change = -half * correction[i, j]
                                    correction[i, j] = wp.where(mode[j] == 2, -change, change)
                                reach = theta * h[j]
                                rise[i, j] += change
                                us[i, j] += beta * reach * reach * change
                                vs[i, j] += gamma * reach * change
                    walk += 1

                for j in range(LANES):
                    if ITERATES:
                        if mode[j] > 0:
                            failed[j] = 1
                    below[j] = zero
                    below_before[j] = zero
                for i in range(N):
                    for j in range(LANES):
                        drift_before = u[i, j] - below_before[j]
                        below_before[j] = u[i, j]
                        change = rise[i, j] * inverse_theta
                        u[i, j] += h[j] * (v[i, j] + h[j] * (half * a[i, j] + beta * change))
                        v[i, j] += h[j] * (a[i, j] + gamma * change)
                        a[i, j] += change
                        us[i, j] = u[i, j]
                        vs[i, j] = v[i, j]
                        drift = u[i, j] - below[j]
                        below[j] = u[i, j]
                        c = coefficient_vector()
                        for q in range(C):
                            c[q] = coefficients[i * C + q, j]
                        before = memory_vector(z[i * M, j])
                        for m in range(1, M):
                            before[m] = z[i * M + m, j]
                        if IS_STIFF:
                            settled[j] = wp.max(settled[j], relaxation_along(drift - drift_before, before, c))
                        if HAS_MEMORY:
                            after = advance(drift, drift - drift_before, before, c)
                            for m in range(M):
                                z[i * M + m, j] = after[m]
                        if DRIFT:
                            peak_drift[i, j] = wp.max(peak_drift[i, j], wp.abs(drift))
                        if TIME:
                            ratio_now[j] = wp.max(ratio_now[j], wp.abs(drift) * inverse_height[i, j])
                if TIME:
                    for j in range(LANES):
                        if ratio_now[j] > worst_ratio[j]:
                            worst_ratio[j] = ratio_now[j]
                            worst_time[j] = dtype(index + 1) * step[j]
                        ratio_now[j] = zero
                if IS_STIFF:
                    for j in range(LANES):
                        grown = deviation_after(deviation[j], settled[j], settling)
                        deviation[j] = grown
                        if not grown <= astray[j]:
                            astray[j] = grown
                        settled[j] = zero
                if RESIDUAL:
                    if index >= residual_start and interval < intervals:
                        for j in range(LANES):
                            steps = samples.residual_steps[sample[j]]
                            since = index - (live_intervals[j] * substeps - steps)
                            # A lane that repeats the last sample must not add to its mean again.
                            if since >= 0 and since < steps and block * LANES + j < count:
                                o = samples.output[sample[j]]
                                weight = weight_in_mean(step[j], since, steps)
                                for i in range(N):
                                    drift = u[i, j]
                                    if i > 0:
                                        drift -= u[i - 1, j]
                                    ratio = drift * inverse_height[i, j]
                                    add_to_mean(output.residual_drift_ratio, i, o, weight * ratio, since)

        for j in range(LANES):
            o = samples.output[sample[j]]
            total = zero
            unaccounted = initial_energy[j] + energy_in[j] - energy_viscous[j]
            fallen[j] = zero
            for i in range(N):
                total += u[i, j] + v[i, j] + a[i, j] + z[i * M, j]
                for m in range(1, M):
                    total += z[i * M + m, j]
                if DRIFT:
                    output.peak_storey_drift[i, o] = peak_drift[i, j]
                if ACCELERATION:
                    output.peak_floor_acceleration[i, o] = peak_acceleration[i, j]
                if STATE:
                    output.final_displacement[i, o] = u[i, j]
                    output.final_velocity[i, o] = v[i, j]
                    for m in range(M):
                        output.final_memory[i * M + m, o] = z[i * M + m, j]
                if SEES_LAST:
                    drift = u[i, j]
                    if i > 0:
                        drift -= u[i - 1, j]
                    c = coefficient_vector()
                    for q in range(C):
                        c[q] = coefficients[i * C + q, j]
                    memory = memory_vector(z[i * M, j])
                    for m in range(1, M):
                        memory[m] = z[i * M + m, j]
                if P_DELTA:
                    overturning = weight_over_height[i, j] * drift
                    lifted[j] += half * overturning * drift
                    ratio = wp.abs(drift) * inverse_height[i, j]
                    rate = v[i, j]
                    if i > 0:
                        rate -= v[i - 1, j]
                    outward = overturning - held_of(drift, memory, c)
                    if DRIFT:
                        if keeps_falling(outward, drift, rate, peak_drift[i, j]):
                            fallen[j] = wp.max(fallen[j], fell)
                    if ratio > blown_up:
                        overturned = has_overturned(outward, drift, rate, step[j], ratio, blown_up)
                        fallen[j] = wp.max(fallen[j], wp.where(overturned, fell, burst))
                if ENERGY:
                    stored = recoverable_of(drift, memory, c)
                    output.hysteretic_energy[i, o] = absorbed[i, j] - stored
                    unaccounted -= absorbed[i, j] + half * mass[i, j] * v[i, j] * v[i, j]
            status = ok
            if TIME:
                output.time_of_peak_drift[o] = worst_time[j]
            if DRIFT:
                worst = worst_storey(output, structures, o, samples.structure[sample[j]], N)
                if worst > control.collapse_drift_ratio:
                    status = collapsed
                if worst > blown_up:
                    status = diverged
            if P_DELTA:
                if fallen[j] == fell:
                    status = collapsed
                if fallen[j] == burst:
                    status = diverged
            if ITERATES:
                if failed[j] > 0:
                    status = not_converged
            # Infinities and NaN never leave a sum: a finite one clears the whole state.
            if not wp.isfinite(total):
                status = diverged
            if IS_STIFF:
                # Passed on the way to a state that is not finite too: it tells why.
                if not astray[j] <= largest_deviation:
                    status = unstable_step
            output.status[o] = status
            if SHEAR:
                output.peak_base_shear[o] = peak_shear[j]
            if ENERGY:
                output.input_energy[o] = energy_in[j]
                output.viscous_energy[o] = energy_viscous[j]
                most = wp.max(supplied[j], initial_energy[j])
                if P_DELTA:
                    unaccounted += lifted[j]  # what gravity gave was supplied too
                    most += lifted[j]
                output.energy_balance_error[o] = balance_error(unaccounted, most)

    return integrate_implicit_chain
