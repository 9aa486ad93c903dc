"""The kernel of shear chains under explicit methods: a whole history in registers, for any law, load and recorders.

A thread carries `lanes` samples: one on a GPU, the vector width on a CPU. The walk runs from the top storey down, so
that the force from above is at hand, and updates the state in place; loops over lanes stay innermost and rolled on a
CPU, where LLVM turns them into vector instructions. Branches on names in capitals are decided when the kernel is built.
"""

import functools

import warp as wp

from warpdyn.kernels.loads import LOADS, harmonic
from warpdyn.kernels.plan import (
    COLLAPSED,
    DIVERGED,
    DTYPES,
    LARGEST_SATURATION,
    OK,
    UNSTABLE_STEP,
    Plan,
    row_types,
    structs,
    tableau,
)
from warpdyn.kernels.springs import SPRINGS


@functools.cache
def chain_kernel(plan: Plan) -> wp.Kernel:
    """Return the kernel that integrates shear chains as the plan says."""
    dtype = DTYPES[plan.dtype]
    types = structs(plan.dtype)
    spring, load = SPRINGS[plan.law], LOADS[plan.load]
    N, LANES, C = plan.dofs, plan.lanes, spring.coefficients
    spring_force, spring_evolve, spring_recoverable = spring.force, spring.evolve or spring.force, spring.recoverable
    HAS_MEMORY, IS_RATE = spring.evolve is not None, spring.is_rate
    HAS_BOUND, spring_saturation = spring.saturation is not None, spring.saturation or spring.force
    IS_MAPPING = HAS_MEMORY and not IS_RATE
    IS_HISTORY, IS_BASE, IS_HARMONIC = load.is_history, load.is_base, load.is_harmonic
    IS_FORCE_HISTORY = IS_HISTORY and not IS_BASE
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
    ok, collapsed, diverged, unstable_step = (wp.int8(c) for c in (OK, COLLAPSED, DIVERGED, UNSTABLE_STEP))
    largest_saturation = wp.constant(dtype(LARGEST_SATURATION))

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
        intervals = int(0)
        residual_start = int(2147483647)
        for j in range(LANES):
            # Lanes past the last sample repeat it: they write the same values again.
            sample[j] = wp.min(block * LANES + j, count - 1)
            s = samples.structure[sample[j]]
            motion[j] = samples.motion[sample[j]]
            live_intervals[j] = loads.run_intervals[motion[j]]
            intervals = wp.max(intervals, live_intervals[j])
            residual_start = wp.min(residual_start, loads.residual_from[motion[j]])
            scale[j] = samples.scale[sample[j]]
            step[j] = loads.step[motion[j]]
            if IS_HARMONIC:
                frequency[j] = loads.circular_frequency[s]
                phase[j] = loads.phase[s]
            if MASS_DAMPING:
                mass_damping[j] = structures.mass_damping[s]
            for i in range(N):
                inverse_mass[i, j] = structures.inverse_mass[i, s]
                if ENERGY:
                    mass[i, j] = structures.mass[i, s]
                if DRIFT:
                    inverse_height[i, j] = structures.inverse_height[i, s]
                if STOREY_DAMPING:
                    damping[i, j] = structures.storey_damping[i, s]
                if IS_HARMONIC:
                    amplitude[i, j] = loads.amplitude[i, s] * scale[j]
                for q in range(C):
                    coefficients[i * C + q, j] = structures.coefficients[i * C + q, s]
                u[i, j] = loads.initial_displacement[i]
                v[i, j] = loads.initial_velocity[i]
            if MODAL_DAMPING:
                for i in range(N * N):
                    damping_matrix[i, j] = structures.damping_matrix[i, s]
        a0 = row()  # base acceleration at the interval's start, and its change over it
        da = row()
        f0 = matrix()  # the same for nodal forces
        df = matrix()
        damping_force = matrix()
        above = row()
        sine = row()
        live = row()
        h = row()
        power_in = row()
        power_viscous = row()
        saturation = row()
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
                    stored = spring_recoverable(drift, memory_vector(z[i, j]), c)
                    absorbed[i, j] = stored
                    initial_energy[j] = initial_energy[j] + stored + dtype(0.5) * mass[i, j] * v[i, j] * v[i, j]

        inverse_substeps = dtype(1.0) / dtype(substeps)
        for interval in range(intervals):
            for j in range(LANES):
                # A lane that is done waits for the others with a step of zero, its peaks and energies frozen.
                live[j] = dtype(0.0)
                if interval < live_intervals[j]:
                    live[j] = dtype(1.0)
                h[j] = step[j] * live[j]
                if IS_HISTORY:
                    inside = interval < loads.intervals[motion[j]]
                    at = loads.first[motion[j]]
                    if IS_BASE:
                        a0[j] = dtype(0.0)
                        da[j] = dtype(0.0)
                        if inside:
                            a0[j] = loads.values[at + interval] * scale[j]
                            da[j] = loads.values[at + interval + 1] * scale[j] - a0[j]
                    if IS_FORCE_HISTORY:
                        for i in range(N):
                            f0[i, j] = dtype(0.0)
                            df[i, j] = dtype(0.0)
                            if inside:
                                f0[i, j] = loads.values[(at + interval) * N + i] * scale[j]
                                df[i, j] = loads.values[(at + interval + 1) * N + i] * scale[j] - f0[i, j]
            for substep in range(substeps):
                for stage in range(STAGES):
                    position = (dtype(substep) + node[stage]) * inverse_substeps
                    if IS_HARMONIC:
                        whole = wp.float64(interval * substeps + substep) + wp.float64(node[stage])
                        for j in range(LANES):
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
                            zi = zs[i, j]
                            drift = ui
                            rate = vi
                            if i > 0:
                                drift -= us[i - 1, j]
                                rate -= vs[i - 1, j]
                            hb = h[j] * weight[stage]
                            ha = h[j] * reach[stage]
                            gate = live[j] * first_stage[stage]
                            c = coefficient_vector()
                            for q in range(C):
                                c[q] = coefficients[i * C + q, j]
                            z_vector = memory_vector(zi)
                            restoring = spring_force(drift, z_vector, c)
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
                                    index = interval * substeps + substep
                                    if index % every == 0:
                                        if index / every < history.displacement.shape[1]:
                                            kept = samples.output[sample[j]]
                                            history.displacement[kept, index / every, i] = ui
                                            history.velocity[kept, index / every, i] = vi
                                            history.acceleration[kept, index / every, i] = ai
                                            history.storey_force[kept, index / every, i] = restoring
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
                            if IS_RATE:
                                z_rate = spring_evolve(rate, z_vector, c)
                                zn[i, j] += hb * z_rate[0]
                                zs[i, j] = z[i, j] + ha * z_rate[0]
                    if ENERGY:
                        for j in range(LANES):
                            energy_in[j] += h[j] * weight[stage] * power_in[j]
                            energy_viscous[j] += h[j] * weight[stage] * power_viscous[j]
                            supplied[j] = wp.max(supplied[j], wp.abs(initial_energy[j] + energy_in[j]))
                for i in range(N):
                    for j in range(LANES):
                        drift = un[i, j]
                        if i > 0:
                            drift -= un[i - 1, j]
                        if IS_MAPPING or HAS_BOUND:
                            c = coefficient_vector()
                            for q in range(C):
                                c[q] = coefficients[i * C + q, j]
                        if HAS_BOUND:
                            saturation[j] = wp.max(saturation[j], spring_saturation(memory_vector(zn[i, j]), c))
                        if IS_MAPPING:
                            mapped = spring_evolve(drift, memory_vector(z[i, j]), c)
                            zn[i, j] = mapped[0]
                        u[i, j] = un[i, j]
                        v[i, j] = vn[i, j]
                        us[i, j] = un[i, j]
                        vs[i, j] = vn[i, j]
                        if HAS_MEMORY:
                            z[i, j] = zn[i, j]
                            zs[i, j] = zn[i, j]
                        if DRIFT:
                            size = wp.abs(drift)
                            peak_drift[i, j] = wp.max(peak_drift[i, j], size)
                            ratio = size * inverse_height[i, j]
                            if ratio > worst_ratio[j]:
                                worst_ratio[j] = ratio
                                worst_storey[j] = i
                                worst_time[j] = dtype(interval * substeps + substep + 1) * step[j]
                if RESIDUAL:
                    if interval >= residual_start:
                        # Summed up where it is stored, in memory: it is rarely touched, and registers are dear. A lane
                        # that repeats the last sample must not add to it again.
                        for j in range(LANES):
                            start = loads.residual_from[motion[j]]
                            if interval >= start and interval < live_intervals[j] and block * LANES + j < count:
                                o = samples.output[sample[j]]
                                share = dtype(1.0) / dtype((live_intervals[j] - start) * substeps)
                                for i in range(N):
                                    drift = u[i, j]
                                    if i > 0:
                                        drift -= u[i - 1, j]
                                    mean = drift * share
                                    if interval > start or substep > 0:
                                        mean += output.residual_drift[i, o]
                                    output.residual_drift[i, o] = mean

        for j in range(LANES):
            o = samples.output[sample[j]]
            total = dtype(0.0)
            kinetic = dtype(0.0)
            spent = dtype(0.0)
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
                    stored = spring_recoverable(drift, memory_vector(z[i, j]), c)
                    output.hysteretic_energy[i, o] = absorbed[i, j] - stored
                    kinetic += dtype(0.5) * mass[i, j] * v[i, j] * v[i, j]
                    spent += absorbed[i, j]
            # Infinities and NaN never leave a sum: a finite one clears the whole state.
            status = ok
            if DRIFT:
                output.time_of_peak_drift[o] = worst_time[j]
                output.storey_of_peak_drift[o] = worst_storey[j] + 1
                if worst_ratio[j] > collapse_drift_ratio:
                    status = collapsed
            if saturation[j] > largest_saturation:
                status = unstable_step
            if not wp.isfinite(total):
                status = diverged
            output.status[o] = status
            if SHEAR:
                output.peak_base_shear[o] = peak_shear[j]
            if ENERGY:
                output.input_energy[o] = energy_in[j]
                output.viscous_energy[o] = energy_viscous[j]
                error = initial_energy[j] + energy_in[j] - kinetic - energy_viscous[j] - spent
                scale_of_error = wp.max(supplied[j], initial_energy[j])
                output.energy_balance_error[o] = dtype(0.0)
                if scale_of_error != dtype(0.0):  # nothing was supplied; NaN passes
                    output.energy_balance_error[o] = error / scale_of_error

    return integrate_chain
