"""The kernel of shear chains under explicit methods: a whole history in registers, for any law, load and recorders.

A thread carries `lanes` samples: one on a GPU, the vector width on a CPU. The walk runs from the top storey down, so
that the force from above is at hand, and updates the state in place; loops over lanes stay innermost and rolled on a
CPU, where LLVM turns them into vector instructions. Branches on names in capitals are decided when the kernel is built.
"""

import functools

import warp as wp

from warpdyn.kernels.loads import LOADS, harmonic, sampled
from warpdyn.kernels.plan import DTYPES, Plan, row_types, stiff_limit, structs, tableau
from warpdyn.kernels.recorders import add_to_mean, balance_error, keep_force, keep_state
from warpdyn.kernels.springs import SPRINGS
from warpdyn.recorders import COLLAPSED, DIVERGED, OK, UNSTABLE_STEP


@functools.cache
def chain_kernel(plan: Plan) -> wp.Kernel:
    """Return the kernel that integrates shear chains as the plan says."""
    dtype, types = DTYPES[plan.dtype], structs(plan.dtype)
    spring, load = SPRINGS[plan.law], LOADS[plan.load]
    N, LANES, C = plan.dofs, plan.lanes, spring.coefficients
    HAS_MEMORY, IS_RATE, IS_STIFF = spring.evolve is not None, spring.is_rate, spring.relaxation is not None
    IS_MAPPING = HAS_MEMORY and not IS_RATE
    # Warp looks names up in branches that are never built too, so each must be some function.
    force_of, recoverable_of = spring.force, spring.recoverable
    evolve, relaxation_of = spring.evolve or spring.force, spring.relaxation or spring.force
    IS_BASE, IS_HARMONIC, IS_FORCE_HISTORY = load.is_base, load.is_harmonic, load.is_history and not load.is_base
    STOREY_DAMPING, MASS_DAMPING = plan.damping in ("storey", "rayleigh"), plan.damping == "rayleigh"
    MODAL_DAMPING = plan.damping == "modal"
    DRIFT, ACCELERATION, SHEAR, RESIDUAL, ENERGY, HISTORY = (
        name in plan.recorders for name in ("drift", "acceleration", "base_shear", "residual", "energy", "history")
    )
    matrix = wp.types.matrix(shape=(N, LANES), dtype=dtype)
    square = wp.types.matrix(shape=(N * N if MODAL_DAMPING else 1, LANES), dtype=dtype)
    table = wp.types.matrix(shape=(N * C, LANES), dtype=dtype)
    row, row64, indices = row_types(plan)
    STAGES, weight, reach, node, first_stage = tableau(plan)
    coefficient_vector = wp.types.vector(length=C, dtype=dtype)
    memory_vector = wp.types.vector(length=1, dtype=dtype)
    ok, collapsed, diverged, unstable_step = (wp.int8(code) for code in (OK, COLLAPSED, DIVERGED, UNSTABLE_STEP))
    longest_relaxed_step = wp.constant(dtype(stiff_limit(plan)))

    @wp.kernel(module="unique", enable_backward=False, module_options={"max_unroll": plan.max_unroll})
    def integrate_chain(
        first_block: int,
        count: int,
        substeps: int,
        every: int,
        collapse_drift_ratio: dtype,
        samples: types.Samples,
        structures: types.Structure,
        loads: types.Load,
        output: types.Output,
        history: types.History,
    ):
        block = first_block + wp.tid()
        sample = indices()
        motion = indices()
        live_intervals = indices()
        inverse_mass = matrix()
        mass = matrix()
        inverse_height = matrix()
        damping = matrix()
        damping_matrix = square()
        mass_damping = row()
        coefficients = table()
        amplitude = matrix()
        frequency = row64()
        phase = row64()
        scale = row()
        step = row()
        u = matrix()  # accepted state: displacement, velocity, memory of the law
        v = matrix()
        z = matrix()
        us = matrix()  # this stage's state
        vs = matrix()
        zs = matrix()
        un = matrix()  # the next accepted state, summed up stage by stage
        vn = matrix()
        zn = matrix()
        peak_drift = matrix()
        worst_ratio = row()
        worst_time = row()
        worst_storey = indices()
        peak_acceleration = matrix()
        peak_shear = row()
        energy_in = row()
        energy_viscous = row()
        absorbed = matrix()
        initial_energy = row()
        supplied = row()  # the most energy the sample ever held: what the balance error is relative to
        relaxation = row()
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
            step[j] = loads.step[motion[j]]
            if IS_HARMONIC:
                frequency[j] = loads.circular_frequency[0]
                phase[j] = loads.phase[0]
            if MASS_DAMPING:
                mass_damping[j] = structures.mass_damping[s]
            if MODAL_DAMPING:
                for i in range(N * N):
                    damping_matrix[i, j] = structures.damping_matrix[i, s]
            for i in range(N):
                inverse_mass[i, j] = structures.inverse_mass[i, s]
                if ENERGY:
                    mass[i, j] = structures.mass[i, s]
                if DRIFT or RESIDUAL:
                    inverse_height[i, j] = structures.inverse_height[i, s]
                if STOREY_DAMPING:
                    damping[i, j] = structures.storey_damping[i, s]
                if IS_HARMONIC:
                    amplitude[i, j] = loads.amplitude[i] * scale[j]
                for q in range(C):
                    coefficients[i * C + q, j] = structures.coefficients[i * C + q, s]
                u[i, j] = loads.initial_displacement[i]
                v[i, j] = loads.initial_velocity[i]
        for i in range(N):
            for j in range(LANES):
                us[i, j] = u[i, j]
                vs[i, j] = v[i, j]
                un[i, j] = u[i, j]
                vn[i, j] = v[i, j]
                drift = u[i, j]
                if i > 0:
                    drift -= u[i - 1, j]
                if DRIFT:
                    peak_drift[i, j] = wp.abs(drift)
                    if peak_drift[i, j] * inverse_height[i, j] > worst_ratio[j]:
                        worst_ratio[j] = peak_drift[i, j] * inverse_height[i, j]
                        worst_storey[j] = i
                if ENERGY:
                    c = coefficient_vector()
                    for q in range(C):
                        c[q] = coefficients[i * C + q, j]
                    absorbed[i, j] = recoverable_of(drift, memory_vector(z[i, j]), c)
                    initial_energy[j] += absorbed[i, j] + dtype(0.5) * mass[i, j] * v[i, j] * v[i, j]

        a0 = row()  # base acceleration at the interval's start, and its change over it
        da = row()
        f0 = matrix()  # the same for nodal forces
        df = matrix()
        damping_force = matrix()
        above = row()
        sine = row()
        h = row()
        seen = row()
        power_in = row()
        power_viscous = row()
        inverse_substeps = dtype(1.0) / dtype(substeps)
        # One interval more than the longest run: its first stage sees the forces of the last state.
        for interval in range(intervals + 1):
            for j in range(LANES):
                # A lane that is done waits for the others with a step of zero: its state and its sums stand still.
                h[j] = dtype(0.0)
                seen[j] = dtype(0.0)
                if interval < live_intervals[j]:
                    h[j] = step[j]
                if interval <= live_intervals[j]:
                    seen[j] = dtype(1.0)
                if IS_BASE:
                    begin, change = sampled(loads, motion[j], interval, live_intervals[j], 1, 0, scale[j])
                    a0[j] = begin
                    da[j] = change
                if IS_FORCE_HISTORY:
                    for i in range(N):
                        begin, change = sampled(loads, motion[j], interval, live_intervals[j], N, i, scale[j])
                        f0[i, j] = begin
                        df[i, j] = change
            for substep in range(substeps):
                index = interval * substeps + substep
                for stage in range(STAGES):
                    position = (dtype(substep) + node[stage]) * inverse_substeps
                    if IS_HARMONIC:
                        for j in range(LANES):
                            whole = wp.float64(index) + wp.float64(node[stage])
                            sine[j] = harmonic(whole, step[j], frequency[j], phase[j])
                    if MODAL_DAMPING:
                        for i in range(N):
                            for j in range(LANES):
                                damping_force[i, j] = dtype(0.0)
                            for k in range(N):
                                for j in range(LANES):
                                    damping_force[i, j] += damping_matrix[i * N + k, j] * vs[k, j]
                    for j in range(LANES):
                        above[j] = dtype(0.0)
                        power_in[j] = dtype(0.0)
                        power_viscous[j] = dtype(0.0)
                    for down in range(N):
                        i = N - 1 - down
                        for j in range(LANES):
                            ui = us[i, j]
                            vi = vs[i, j]
                            drift = ui
                            rate = vi
                            if i > 0:
                                drift -= us[i - 1, j]
                                rate -= vs[i - 1, j]
                            hb = h[j] * weight[stage]
                            ha = h[j] * reach[stage]
                            gate = seen[j] * first_stage[stage]
                            c = coefficient_vector()
                            for q in range(C):
                                c[q] = coefficients[i * C + q, j]
                            memory = memory_vector(zs[i, j])
                            restoring = force_of(drift, memory, c)
                            f = restoring
                            if STOREY_DAMPING:
                                f += damping[i, j] * rate
                            # What acts on the floor: absolute acceleration times its mass, but for base motion.
                            net = above[j] - f
                            if MODAL_DAMPING:
                                net -= damping_force[i, j]
                            if IS_HARMONIC:
                                net += amplitude[i, j] * sine[j]
                            if IS_FORCE_HISTORY:
                                force = f0[i, j] + position * df[i, j]
                                net += force
                            ai = net * inverse_mass[i, j]
                            if MASS_DAMPING:
                                nodal = mass_damping[j] * vi
                                ai -= nodal
                            if ACCELERATION:
                                peak_acceleration[i, j] = wp.max(peak_acceleration[i, j], wp.abs(ai) * gate)
                            if SHEAR:
                                if i == 0:
                                    peak_shear[j] = wp.max(peak_shear[j], wp.abs(restoring) * gate)
                            if HISTORY:
                                if stage == 0:
                                    keep_state(history, samples.output[sample[j]], index, every, i, ui, vi, ai)
                                    keep_force(history, samples.output[sample[j]], index, every, i, restoring)
                            if IS_BASE:
                                base = a0[j] + position * da[j]
                                ai -= base
                            if ENERGY:
                                absorbed[i, j] += hb * restoring * rate
                                if IS_BASE:
                                    power_in[j] -= mass[i, j] * base * vi
                                if IS_HARMONIC:
                                    power_in[j] += amplitude[i, j] * sine[j] * vi
                                if IS_FORCE_HISTORY:
                                    power_in[j] += force * vi
                                if STOREY_DAMPING:
                                    power_viscous[j] += damping[i, j] * rate * rate
                                if MASS_DAMPING:
                                    power_viscous[j] += mass[i, j] * nodal * vi
                                if MODAL_DAMPING:
                                    power_viscous[j] += damping_force[i, j] * vi
                            above[j] = f
                            un[i, j] += hb * vi
                            vn[i, j] += hb * ai
                            us[i, j] = u[i, j] + ha * vi
                            vs[i, j] = v[i, j] + ha * ai
                            if IS_STIFF:
                                relaxation[j] = wp.max(relaxation[j], relaxation_of(rate, c))
                            if IS_RATE:
                                z_rate = evolve(rate, memory, c)
                                zn[i, j] += hb * z_rate[0]
                                zs[i, j] = z[i, j] + ha * z_rate[0]
                    if ENERGY:
                        for j in range(LANES):
                            energy_in[j] += h[j] * weight[stage] * power_in[j]
                            energy_viscous[j] += h[j] * weight[stage] * power_viscous[j]
                            supplied[j] = wp.max(supplied[j], wp.abs(initial_energy[j] + energy_in[j]))
                for j in range(LANES):
                    seen[j] = h[j] / step[j]  # 1, and 0 for a lane whose last state has been seen
                for i in range(N):
                    for j in range(LANES):
                        drift = un[i, j]
                        if i > 0:
                            drift -= un[i - 1, j]
                        if IS_MAPPING:
                            c = coefficient_vector()
                            for q in range(C):
                                c[q] = coefficients[i * C + q, j]
                            mapped = evolve(drift, memory_vector(z[i, j]), c)
                            zn[i, j] = mapped[0]
                        u[i, j] = un[i, j]
                        v[i, j] = vn[i, j]
                        us[i, j] = un[i, j]
                        vs[i, j] = vn[i, j]
                        if HAS_MEMORY:
                            z[i, j] = zn[i, j]
                            zs[i, j] = zn[i, j]
                        if DRIFT:
                            peak_drift[i, j] = wp.max(peak_drift[i, j], wp.abs(drift))
                            ratio = wp.abs(drift) * inverse_height[i, j]
                            if ratio > worst_ratio[j]:
                                worst_ratio[j] = ratio
                                worst_storey[j] = i
                                worst_time[j] = dtype(index + 1) * step[j]
                if RESIDUAL:
                    if index >= residual_start:
                        for j in range(LANES):
                            steps = samples.residual_steps[sample[j]]
                            since = index - (live_intervals[j] * substeps - steps)
                            # A lane that repeats the last sample must not add to its mean again.
                            if since >= 0 and since < steps and block * LANES + j < count:
                                for i in range(N):
                                    drift = u[i, j]
                                    if i > 0:
                                        drift -= u[i - 1, j]
                                    ratio = drift * inverse_height[i, j]
                                    add_to_mean(
                                        output.residual_drift_ratio, i, samples.output[sample[j]], ratio, since, steps
                                    )

        for j in range(LANES):
            o = samples.output[sample[j]]
            total = dtype(0.0)
            unaccounted = initial_energy[j] + energy_in[j] - energy_viscous[j]
            for i in range(N):
                total += u[i, j] + v[i, j] + z[i, j]
                if DRIFT:
                    output.peak_storey_drift[i, o] = peak_drift[i, j]
                if ACCELERATION:
                    output.peak_floor_acceleration[i, o] = peak_acceleration[i, j]
                if ENERGY:
                    drift = u[i, j]
                    if i > 0:
                        drift -= u[i - 1, j]
                    c = coefficient_vector()
                    for q in range(C):
                        c[q] = coefficients[i * C + q, j]
                    stored = recoverable_of(drift, memory_vector(z[i, j]), c)
                    output.hysteretic_energy[i, o] = absorbed[i, j] - stored
                    unaccounted -= absorbed[i, j] + dtype(0.5) * mass[i, j] * v[i, j] * v[i, j]
            status = ok
            if DRIFT:
                output.time_of_peak_drift[o] = worst_time[j]
                output.storey_of_peak_drift[o] = worst_storey[j] + 1
                if worst_ratio[j] > collapse_drift_ratio:
                    status = collapsed
            if IS_STIFF:
                if relaxation[j] * step[j] > longest_relaxed_step:
                    status = unstable_step
            # Infinities and NaN never leave a sum: a finite one clears the whole state.
            if not wp.isfinite(total):
                status = diverged
            output.status[o] = status
            if SHEAR:
                output.peak_base_shear[o] = peak_shear[j]
            if ENERGY:
                output.input_energy[o] = energy_in[j]
                output.viscous_energy[o] = energy_viscous[j]
                output.energy_balance_error[o] = balance_error(unaccounted, wp.max(supplied[j], initial_energy[j]))

    return integrate_chain
