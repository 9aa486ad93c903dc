"""The kernel of linear systems with full mass, damping and stiffness matrices under explicit methods.

The equation of motion is divided by the mass matrix on the host: u'' = load - (M^-1 K) u - (M^-1 C) u'. Lanes and names
in capitals are as in the chain's kernel.
"""

import functools

import warp as wp

from warpdyn.kernels.loads import LOADS, harmonic
from warpdyn.kernels.plan import DIVERGED, DTYPES, OK, Plan, row_types, structs, tableau


@functools.cache
def dense_kernel(plan: Plan) -> wp.Kernel:
    """Return the kernel that integrates linear systems as the plan says."""
    dtype = DTYPES[plan.dtype]
    types = structs(plan.dtype)
    N, LANES = plan.dofs, plan.lanes
    load = LOADS[plan.load]
    IS_HISTORY, IS_BASE, IS_HARMONIC = load.is_history, load.is_base, load.is_harmonic
    IS_FORCE_HISTORY = IS_HISTORY and not IS_BASE
    DISPLACEMENT, ACCELERATION, ENERGY, HISTORY = (
        name in plan.recorders for name in ("displacement", "acceleration", "energy", "history")
    )
    matrix = wp.types.matrix(shape=(N, LANES), dtype=dtype)
    square = wp.types.matrix(shape=(N * N, LANES), dtype=dtype)
    row, row64, indices = row_types(plan)
    STAGES, weight, reach, node, first_stage = tableau(plan)
    ok, diverged = wp.int8(OK), wp.int8(DIVERGED)

    @wp.kernel(module="unique", enable_backward=False, module_options={"max_unroll": plan.max_unroll})
    def integrate_dense(
        first_block: int,
        count: int,
        substeps: int,
        every: int,
        samples: types.Samples,
        structures: types.Structure,
        loads: types.Load,
        output: types.Output,
        history: types.History,
    ):
        block = first_block + wp.tid()
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
            live_intervals[j] = loads.run_intervals[motion[j]]
            intervals = wp.max(intervals, live_intervals[j])
            scale[j] = samples.scale[sample[j]]
            step[j] = loads.step[motion[j]]
            if IS_HARMONIC:
                frequency[j] = loads.circular_frequency[structure[j]]
                phase[j] = loads.phase[structure[j]]
            for i in range(N):
                u[i, j] = loads.initial_displacement[i]
                v[i, j] = loads.initial_velocity[i]
                us[i, j] = u[i, j]
                vs[i, j] = v[i, j]
                un[i, j] = u[i, j]
                vn[i, j] = v[i, j]
                peak_displacement[i, j] = wp.abs(u[i, j])
                if IS_BASE:
                    influence[i, j] = structures.influence[i]
        for i in range(N):
            for k in range(N):
                for j in range(LANES):
                    s = structure[j]
                    stiffness[i * N + k, j] = structures.rate_of_displacement[i * N + k, s]
                    damping[i * N + k, j] = structures.rate_of_velocity[i * N + k, s]
                    if ENERGY:
                        mass[i * N + k, j] = structures.mass_matrix[i * N + k, s]
                    if IS_HARMONIC:
                        force[i, j] += structures.flexibility_of_mass[i * N + k, s] * loads.amplitude[k, s] * scale[j]

        a0 = row()
        da = row()
        f0 = matrix()
        df = matrix()
        elastic = matrix()  # M^-1 K u and M^-1 C v of this stage
        viscous = matrix()
        sine = row()
        live = row()
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
        for interval in range(intervals):
            for j in range(LANES):
                live[j] = dtype(0.0)
                if interval < live_intervals[j]:
                    live[j] = dtype(1.0)
                h[j] = step[j] * live[j]
                if IS_HISTORY:
                    inside = interval < loads.intervals[motion[j]]
                    at = loads.first[motion[j]] + interval
                    if IS_BASE:
                        a0[j] = dtype(0.0)
                        da[j] = dtype(0.0)
                        if inside:
                            a0[j] = loads.values[at] * scale[j]
                            da[j] = loads.values[at + 1] * scale[j] - a0[j]
            if IS_FORCE_HISTORY:
                for i in range(N):
                    for j in range(LANES):
                        f0[i, j] = dtype(0.0)
                        df[i, j] = dtype(0.0)
                        if interval < loads.intervals[motion[j]]:
                            at = loads.first[motion[j]] + interval
                            for k in range(N):
                                share = structures.flexibility_of_mass[i * N + k, structure[j]] * scale[j]
                                begin = loads.values[at * N + k]
                                f0[i, j] += share * begin
                                df[i, j] += share * (loads.values[(at + 1) * N + k] - begin)
            for substep in range(substeps):
                for stage in range(STAGES):
                    position = (dtype(substep) + node[stage]) * inverse_substeps
                    if IS_HARMONIC:
                        whole = wp.float64(interval * substeps + substep) + wp.float64(node[stage])
                        for j in range(LANES):
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
                                        power_in[j] += momentum * (f0[k, j] + position * df[k, j])
                                    if IS_BASE:
                                        power_in[j] -= momentum * influence[k, j] * (a0[j] + position * da[j])
                        for j in range(LANES):
                            hb = h[j] * weight[stage]
                            energy_in[j] += hb * power_in[j]
                            energy_viscous[j] += hb * power_viscous[j]
                            energy_elastic[j] += hb * power_elastic[j]
                            supplied[j] = wp.max(supplied[j], wp.abs(initial_energy[j] + energy_in[j]))
                    for i in range(N):
                        for j in range(LANES):
                            vi = vs[i, j]
                            hb = h[j] * weight[stage]
                            ha = h[j] * reach[stage]
                            gate = live[j] * first_stage[stage]
                            ai = -elastic[i, j] - viscous[i, j]
                            if IS_HARMONIC:
                                ai += force[i, j] * sine[j]
                            if IS_FORCE_HISTORY:
                                ai += f0[i, j] + position * df[i, j]
                            if ACCELERATION:
                                peak_acceleration[i, j] = wp.max(peak_acceleration[i, j], wp.abs(ai) * gate)
                            if HISTORY:
                                if stage == 0:
                                    index = interval * substeps + substep
                                    if index % every == 0:
                                        if index / every < history.displacement.shape[1]:
                                            kept = samples.output[sample[j]]
                                            history.displacement[kept, index / every, i] = us[i, j]
                                            history.velocity[kept, index / every, i] = vi
                                            history.acceleration[kept, index / every, i] = ai
                            if IS_BASE:
                                ai -= influence[i, j] * (a0[j] + position * da[j])
                            un[i, j] += hb * vi
                            vn[i, j] += hb * ai
                            us[i, j] = u[i, j] + ha * vi
                            vs[i, j] = v[i, j] + ha * ai
                for i in range(N):
                    for j in range(LANES):
                        u[i, j] = un[i, j]
                        v[i, j] = vn[i, j]
                        us[i, j] = un[i, j]
                        vs[i, j] = vn[i, j]
                        if DISPLACEMENT:
                            size = wp.abs(u[i, j])
                            if size > peak_displacement[i, j]:
                                peak_displacement[i, j] = size
                                time_of_peak[i, j] = dtype(interval * substeps + substep + 1) * step[j]

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
                scale_of_error = wp.max(supplied[j], initial_energy[j])
                output.energy_balance_error[o] = dtype(0.0)
                if scale_of_error != dtype(0.0):  # nothing was supplied; NaN passes
                    output.energy_balance_error[o] = error / scale_of_error

    return integrate_dense
