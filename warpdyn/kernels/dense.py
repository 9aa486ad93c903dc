"""The kernel of linear systems with full mass, damping and stiffness matrices under explicit methods.

The equation of motion is divided by the mass matrix on the host: u'' = load - (M^-1 K) u - (M^-1 C) u'. Lanes and names
in capitals are as in the chain's kernel.
"""

import functools

import warp as wp

from warpdyn.core.output_variables import DIVERGED, OK
from warpdyn.kernels.adaptive import SHORTEST_PART, done_after, excess_of, next_part
from warpdyn.kernels.loads import LOADS, harmonic, sampled
from warpdyn.kernels.noise import noise_of
from warpdyn.kernels.plan import DTYPES, Plan, row_types, structs, tableau
from warpdyn.kernels.recording import balance_error, keep_state


@functools.cache
def dense_kernel(plan: Plan) -> wp.Kernel:
    """Return the kernel that integrates linear systems as the plan says."""
    dtype, types = DTYPES[plan.dtype], structs(plan.dtype)
    N, LANES, load = plan.dofs, plan.lanes, LOADS[plan.load]
    IS_BASE, IS_HARMONIC, IS_FORCE_HISTORY = load.is_base, load.is_harmonic, load.is_history and not load.is_base
    IS_NOISE, noise = load.noise_states > 0, noise_of(plan)
    IS_RECORD = IS_BASE and not IS_NOISE
    Processes, Numbers, noise_over_interval = noise.Processes, noise.Numbers, noise.over_interval
    DISPLACEMENT, ACCELERATION, ENERGY, HISTORY = (
        name in plan.recorders for name in ("displacement", "acceleration", "energy", "history")
    )
    matrix = wp.types.matrix(shape=(N, LANES), dtype=dtype)
    square = wp.types.matrix(shape=(N * N, LANES), dtype=dtype)
    row, row64, indices = row_types(plan)
    method = tableau(plan)
    STAGES, KEEPS_SLOPES, ADAPTIVE, STARTS_HALFWAY = method.stages, method.keeps_slopes, method.adaptive, method.halfway
    COUNTS_STEPS = ADAPTIVE and not HISTORY
    weight, reach, node, first_stage = method.weight, method.reach, method.node, method.first_stage
    of_velocity, of_displacement, ends = method.a, method.a_displacement, method.ends
    error_of_velocity, error_of_displacement = method.error, method.error_displacement
    slopes = wp.types.matrix(shape=(N * STAGES if KEEPS_SLOPES else 1, LANES), dtype=dtype)
    shortest_part = wp.constant(dtype(SHORTEST_PART[plan.dtype]))
    ok, diverged = wp.int8(OK), wp.int8(DIVERGED)

    @wp.kernel(module="unique", enable_backward=False, module_options={"max_unroll": plan.max_unroll})
    def integrate_dense(
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
        structure = indices()
        motion = indices()
        live_intervals = indices()
        stiffness = square()  # M^-1 K
        damping = square()  # M^-1 C
        mass = square()
        force = matrix()  # M^-1 of the harmonic amplitude
        influence = matrix()
        frequency = row64()
        phase = row64()
        scale = row()
        step = row()
        u = matrix()
        v = matrix()
        us = matrix()
        vs = matrix()
        un = matrix()
        vn = matrix()
        peak_displacement = matrix()
        intervals = int(0)
        for j in range(LANES):
            sample[j] = wp.min(block * LANES + j, count - 1)
            structure[j] = samples.structure[sample[j]]
            motion[j] = samples.motion[sample[j]]
            live_intervals[j] = samples.run_intervals[sample[j]]
            intervals = wp.max(intervals, live_intervals[j])
            scale[j] = samples.scale[sample[j]]
            step[j] = samples.step[sample[j]]
            if IS_HARMONIC:
                frequency[j] = loads.circular_frequency[0]
                phase[j] = loads.phase[0]
            for i in range(N):
                u[i, j] = loads.initial_displacement[i]
                v[i, j] = loads.initial_velocity[i]
                us[i, j] = u[i, j]
                vs[i, j] = v[i, j]
                peak_displacement[i, j] = wp.abs(u[i, j])
                if IS_BASE:
                    influence[i, j] = structures.influence[i]
        for i in range(N):
            for k in range(N):
                for j in range(LANES):
                    s = structure[j]
                    of_mass = structures.mass_factor[s]
                    stiffness[i * N + k, j] = (
                        structures.rate_of_displacement[i, k] * structures.stiffness_factor[s] / of_mass
                    )
                    damping[i * N + k, j] = structures.rate_of_velocity[i, k] * structures.damping_factor[s] / of_mass
                    if ENERGY:
                        mass[i * N + k, j] = structures.mass_matrix[i, k] * of_mass
                    if IS_HARMONIC:
                        force[i, j] += structures.flexibility_of_mass[i, k] * loads.amplitude[k] * scale[j] / of_mass

        acceleration = slopes()  # of every stage
        to_displacement = row()
        to_velocity = row()
        at = row()  # where in the interval a stage stands
        # An adaptive method goes through each step in parts of its own: as in the chain's kernel.
        whole_step = row()
        done = row()
        part = row()
        trial = row()
        excess = row()
        size_u = row()
        size_v = row()
        accepted = indices()
        rejected = indices()
        safe_in = row()
        safe_viscous = row()
        safe_elastic = row()
        safe_supplied = row()
        a0 = row()
        da = row()
        f0 = matrix()
        df = matrix()
        elastic = matrix()  # M^-1 K u and M^-1 C v of this stage
        viscous = matrix()
        sine = row()
        seen = row()
        h = row()
        power_in = row()
        power_viscous = row()
        power_elastic = row()
        time_of_peak = matrix()
        peak_acceleration = matrix()
        energy_in = row()
        energy_viscous = row()
        energy_elastic = row()
        initial_energy = row()
        supplied = row()
        if ENERGY:
            for i in range(N):
                for k in range(N):
                    for j in range(LANES):
                        momentum = dtype(0.5) * mass[i * N + k, j] * v[i, j]
                        initial_energy[j] += momentum * v[k, j]
                        for q in range(N):
                            energy_elastic[j] += (
                                dtype(0.5) * u[i, j] * mass[i * N + k, j] * stiffness[k * N + q, j] * u[q, j]
                            )
            for j in range(LANES):
                initial_energy[j] += energy_elastic[j]

        inverse_substeps = dtype(1.0) / dtype(substeps)
        if IS_NOISE:
            processes = Processes()
            number = Numbers()
            for j in range(LANES):
                number[j] = samples.number[sample[j]]
        # One interval more than the longest run: its first stage sees the accelerations of the last state.
        for interval in range(intervals + 1):
            if IS_NOISE:
                a0, da, processes = noise_over_interval(
                    loads, control.key, number, interval, live_intervals, scale, processes
                )
            for j in range(LANES):
                h[j] = dtype(0.0)
                seen[j] = dtype(0.0)
                if interval < live_intervals[j]:
                    h[j] = step[j]
                if ADAPTIVE:
                    whole_step[j] = h[j]
                    if interval == 0:
                        trial[j] = dtype(1.0)
                if interval <= live_intervals[j]:
                    seen[j] = dtype(1.0)
                if IS_RECORD:
                    begin, change = sampled(loads, motion[j], interval, live_intervals[j], 1, 0, scale[j])
                    a0[j] = begin
                    da[j] = change
            if IS_FORCE_HISTORY:
                for i in range(N):
                    for j in range(LANES):
                        f0[i, j] = dtype(0.0)
                        df[i, j] = dtype(0.0)
                        for k in range(N):
                            share = structures.flexibility_of_mass[i, k] / structures.mass_factor[structure[j]]
                            begin, change = sampled(loads, motion[j], interval, live_intervals[j], N, k, scale[j])
                            f0[i, j] += share * begin
                            df[i, j] += share * change
            for substep in range(substeps):
                index = interval * substeps + substep
                pending = int(1)
                attempt = int(0)
                if ADAPTIVE:
                    for j in range(LANES):
                        done[j] = dtype(0.0)
                        part[j] = trial[j]
                # Once, but for an adaptive method: until every lane has gone through the step.
                while pending > 0:
                    pending = int(0)
                    if ADAPTIVE:
                        for j in range(LANES):
                            h[j] = part[j] * whole_step[j]
                            safe_in[j] = energy_in[j]
                            safe_viscous[j] = energy_viscous[j]
                            safe_elastic[j] = energy_elastic[j]
                            safe_supplied[j] = supplied[j]
                    for stage in range(STAGES):
                        for j in range(LANES):
                            at[j] = (dtype(substep) + node[stage]) * inverse_substeps
                            if ADAPTIVE:
                                at[j] = (dtype(substep) + done[j] + node[stage] * part[j]) * inverse_substeps
                        if IS_HARMONIC:
                            for j in range(LANES):
                                whole = wp.float64(index) + wp.float64(node[stage])
                                if ADAPTIVE:
                                    whole = wp.float64(index) + wp.float64(done[j] + node[stage] * part[j])
                                sine[j] = harmonic(whole, step[j], frequency[j], phase[j])
                        for i in range(N):
                            for j in range(LANES):
                                elastic[i, j] = dtype(0.0)
                                viscous[i, j] = dtype(0.0)
                            for k in range(N):
                                for j in range(LANES):
                                    elastic[i, j] += stiffness[i * N + k, j] * us[k, j]
                                    viscous[i, j] += damping[i * N + k, j] * vs[k, j]
                        if ENERGY:
                            for j in range(LANES):
                                power_in[j] = dtype(0.0)
                                power_viscous[j] = dtype(0.0)
                                power_elastic[j] = dtype(0.0)
                            for i in range(N):
                                for k in range(N):
                                    for j in range(LANES):
                                        momentum = mass[i * N + k, j] * vs[i, j]
                                        power_viscous[j] += momentum * viscous[k, j]
                                        power_elastic[j] += momentum * elastic[k, j]
                                        if IS_HARMONIC:
                                            power_in[j] += momentum * force[k, j] * sine[j]
                                        if IS_FORCE_HISTORY:
                                            power_in[j] += momentum * (f0[k, j] + at[j] * df[k, j])
                                        if IS_BASE:
                                            power_in[j] -= momentum * influence[k, j] * (a0[j] + at[j] * da[j])
                            for j in range(LANES):
                                hb = h[j] * weight[stage]
                                energy_in[j] += hb * power_in[j]
                                energy_viscous[j] += hb * power_viscous[j]
                                energy_elastic[j] += hb * power_elastic[j]
                                supplied[j] = wp.max(supplied[j], wp.abs(initial_energy[j] + energy_in[j]))
                        for i in range(N):
                            for j in range(LANES):
                                vi = vs[i, j]
                                ha = h[j] * reach[stage]
                                gate = seen[j] * first_stage[stage]
                                ai = -elastic[i, j] - viscous[i, j]
                                if IS_HARMONIC:
                                    ai += force[i, j] * sine[j]
                                if IS_FORCE_HISTORY:
                                    ai += f0[i, j] + at[j] * df[i, j]
                                if ACCELERATION:
                                    peak_acceleration[i, j] = wp.max(peak_acceleration[i, j], wp.abs(ai) * gate)
                                if HISTORY:
                                    if stage == 0 and attempt == 0:
                                        kept = samples.output[sample[j]]
                                        keep_state(history, kept, index, every, i, us[i, j], vi, ai)
                                if IS_BASE:
                                    ai -= influence[i, j] * (a0[j] + at[j] * da[j])
                                if KEEPS_SLOPES:
                                    acceleration[stage * N + i, j] = ai
                                else:
                                    un[i, j] += weight[stage] * vi
                                    vn[i, j] += weight[stage] * ai
                                    us[i, j] = u[i, j] + ha * vi
                                    vs[i, j] = v[i, j] + ha * ai
                            if KEEPS_SLOPES:
                                for j in range(LANES):
                                    to_displacement[j] = dtype(0.0)
                                    to_velocity[j] = dtype(0.0)
                                for q in range(STAGES):
                                    if q <= stage:
                                        for j in range(LANES):
                                            slope = acceleration[q * N + i, j]
                                            to_displacement[j] += of_displacement[(stage + 1) * STAGES + q] * slope
                                            to_velocity[j] += of_velocity[(stage + 1) * STAGES + q] * slope
                                for j in range(LANES):
                                    if STARTS_HALFWAY:
                                        if index == 0:
                                            to_displacement[j] *= dtype(0.5)
                                            to_velocity[j] *= dtype(0.5)
                                    us[i, j] = u[i, j] + h[j] * (ends[stage + 1] * v[i, j] + h[j] * to_displacement[j])
                                    vs[i, j] = v[i, j] + h[j] * to_velocity[j]
                                    un[i, j] = us[i, j]
                                    vn[i, j] = vs[i, j]
                    if ADAPTIVE:
                        for j in range(LANES):
                            excess[j] = dtype(0.0)
                        for i in range(N):
                            for j in range(LANES):
                                of_u = dtype(0.0)
                                of_v = dtype(0.0)
                                for q in range(STAGES):
                                    of_u += error_of_displacement[q] * acceleration[q * N + i, j]
                                    of_v += error_of_velocity[q] * acceleration[q * N + i, j]
                                size_u[j] = wp.max(size_u[j], wp.abs(u[i, j]))
                                size_v[j] = wp.max(size_v[j], wp.abs(v[i, j]))
                                u_error = wp.abs(of_u) * h[j] * h[j]
                                v_error = wp.abs(of_v) * h[j]
                                worse = excess_of(u_error, size_u[j], un[i, j], v_error, size_v[j], vn[i, j])
                                excess[j] = wp.max(excess[j], worse / control.tolerance)
                        for j in range(LANES):
                            rejects = excess[j] > dtype(1.0) and part[j] > shortest_part
                            trial[j] = next_part(part[j], trial[j], excess[j], shortest_part)
                            if rejects:
                                rejected[j] += 1
                                energy_in[j] = safe_in[j]
                                energy_viscous[j] = safe_viscous[j]
                                energy_elastic[j] = safe_elastic[j]
                                supplied[j] = safe_supplied[j]
                                for i in range(N):
                                    un[i, j] = u[i, j]
                                    vn[i, j] = v[i, j]
                            elif h[j] > dtype(0.0):
                                accepted[j] += 1
                                done[j] = done_after(done[j], part[j], excess[j], shortest_part)
                            part[j] = dtype(0.0)
                            if whole_step[j] > dtype(0.0) and done[j] < dtype(1.0):
                                part[j] = wp.min(trial[j], dtype(1.0) - done[j])
                                pending += 1
                        attempt += 1
                    for i in range(N):
                        for j in range(LANES):
                            # Slopes are summed first and added once, as in the chain's kernel.
                            if KEEPS_SLOPES:
                                u[i, j] = un[i, j]
                                v[i, j] = vn[i, j]
                            else:
                                u[i, j] += h[j] * un[i, j]
                                v[i, j] += h[j] * vn[i, j]
                            us[i, j] = u[i, j]
                            vs[i, j] = v[i, j]
                            un[i, j] = dtype(0.0)
                            vn[i, j] = dtype(0.0)
                            if DISPLACEMENT:
                                size = wp.abs(u[i, j])
                                if size > peak_displacement[i, j]:
                                    peak_displacement[i, j] = size
                                    time_of_peak[i, j] = dtype(index + 1) * step[j]
                                    if ADAPTIVE:
                                        time_of_peak[i, j] = (dtype(index) + done[j]) * step[j]
                for j in range(LANES):
                    # 1, and 0 for a lane whose last state has been seen.
                    if ADAPTIVE:
                        seen[j] = whole_step[j] / step[j]
                    else:
                        seen[j] = h[j] / step[j]

        for j in range(LANES):
            o = samples.output[sample[j]]
            total = dtype(0.0)
            for i in range(N):
                total += u[i, j] + v[i, j]
                if DISPLACEMENT:
                    output.peak_displacement[i, o] = peak_displacement[i, j]
                    output.time_of_peak_displacement[i, o] = time_of_peak[i, j]
                if ACCELERATION:
                    output.peak_acceleration[i, o] = peak_acceleration[i, j]
            output.status[o] = ok
            if COUNTS_STEPS:
                output.accepted_steps[o] = accepted[j]
                output.rejected_steps[o] = rejected[j]
            if not wp.isfinite(total):
                output.status[o] = diverged
            if ENERGY:
                kinetic = dtype(0.0)
                for i in range(N):
                    for k in range(N):
                        kinetic += dtype(0.5) * mass[i * N + k, j] * v[i, j] * v[k, j]
                output.input_energy[o] = energy_in[j]
                output.viscous_energy[o] = energy_viscous[j]
                error = initial_energy[j] + energy_in[j] - kinetic - energy_viscous[j] - energy_elastic[j]
                output.energy_balance_error[o] = balance_error(error, wp.max(supplied[j], initial_energy[j]))

    return integrate_dense
