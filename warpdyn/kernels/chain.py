"""The kernel of shear chains under explicit methods: a whole history in registers, for any law, load and recorders.

A thread carries `lanes` samples: one on a GPU, the vector width on a CPU. The walk runs from the top storey down, so
that the force from above is at hand, and updates the state in place; loops over lanes stay innermost and rolled on a
CPU, where LLVM turns them into vector instructions. Branches on names in capitals are decided when the kernel is built.
"""

import functools

import warp as wp

from warpdyn.core.output_variables import COLLAPSED, DIVERGED, LARGEST_DRIFT_RATIO, OK, UNSTABLE_STEP
from warpdyn.device.processor import ELEMENT, LARGER, NEIGHBOURS, across_warp, align_rows, see_neighbours
from warpdyn.kernels.adaptive import SHORTEST_PART, done_after, excess_of, next_part
from warpdyn.kernels.loads import LOADS, at_ends, harmonic, sampled
from warpdyn.kernels.noise import noise_of
from warpdyn.kernels.plan import (
    DTYPES,
    MASS_DAMPED,
    Plan,
    constants,
    options,
    row_types,
    settling_limit,
    settling_polynomial,
    structs,
    tableau,
)
from warpdyn.kernels.recorders import (
    add_to_mean,
    balance_error,
    has_overturned,
    keep_force,
    keep_state,
    keeps_falling,
    weight_in_mean,
    worst_storey,
)
from warpdyn.laws.devices.viscous_damper import VALUES, damper_force
from warpdyn.laws.rate_law import LARGEST_DEVIATION, deviation_after
from warpdyn.laws.springs import spring_row

SHARE_OF_STEP_AHEAD = 2.0**-7  # where a storey's tangent stiffness is looked at


@functools.cache
def chain_kernel(plan: Plan) -> wp.Kernel:
    """Return the kernel that integrates shear chains as the plan says."""
    dtype, types = DTYPES[plan.dtype], structs(plan.dtype)
    larger, element = LARGER[plan.dtype], ELEMENT[plan.dtype]
    spring, load = spring_row(plan.law), LOADS[plan.load]
    # A thread carries a section of the storeys, all of them on a processor; N are those of a section.
    STOREYS, SECTIONS, LANES, C, M = plan.dofs, plan.sections, plan.lanes, spring.coefficients, spring.memory
    N = -(-STOREYS // SECTIONS)
    IS_SPLIT = SECTIONS > 1
    HAS_PADS = N * SECTIONS > STOREYS
    SEES_FOOT = IS_SPLIT and ("residual" in plan.recorders or spring.evolve is not None)
    SPLIT_ENERGY, SPLIT_FALL = IS_SPLIT and "energy" in plan.recorders, IS_SPLIT and plan.p_delta
    SEES_LAST, SEES_LAST_FOOT = "energy" in plan.recorders or plan.p_delta, SPLIT_ENERGY or SPLIT_FALL
    SPLIT_TIME = IS_SPLIT and "time_of_peak" in plan.recorders
    SPLIT_STIFF = IS_SPLIT and spring.relaxation is not None
    below, above_of, across, together = NEIGHBOURS[plan.dtype]
    IS_MAPPING, IS_RATE, IS_STIFF = (part is not None for part in (spring.evolve, spring.rate, spring.relaxation))
    # Warp looks names up in branches that are never built too, so each must be some function.
    force_of, recoverable_of, tangent_of = spring.force, spring.recoverable, spring.tangent
    held_of, HOLDS_FORCE = spring.held or spring.force, spring.held is not None
    glide, decides, GLIDING = spring.glide or spring.force, spring.decides or spring.force, spring.gliding or M
    evolve, rate_of, relaxation_of = (part or spring.force for part in (spring.evolve, spring.rate, spring.relaxation))
    IS_BASE, IS_HARMONIC, IS_FORCE_HISTORY = load.is_base, load.is_harmonic, load.is_history and not load.is_base
    IS_NOISE, noise = load.noise_states > 0, noise_of(plan)
    IS_RECORD = IS_BASE and not IS_NOISE
    Processes, Numbers, noise_over_interval = noise.Processes, noise.Numbers, noise.over_interval
    STOREY_DAMPING = plan.damping in ("storey", "rayleigh") or plan.viscous_dampers == "linear"
    POWER_DAMPERS, MASS_DAMPING = plan.viscous_dampers == "power", plan.damping in MASS_DAMPED
    TANGENT_DAMPING, AHEAD = plan.damping == "rayleigh_tangent", wp.constant(dtype(SHARE_OF_STEP_AHEAD))
    HAS_DASHPOTS = STOREY_DAMPING or POWER_DAMPERS or TANGENT_DAMPING
    MODAL_DAMPING = plan.damping == "modal"
    DRIFT, TIME, ACCELERATION, SHEAR, RESIDUAL, ENERGY, HISTORY = (
        name in plan.recorders
        for name in ("drift", "time_of_peak", "acceleration", "base_shear", "residual", "energy", "history")
    )
    P_DELTA = plan.p_delta
    RATIO = TIME or RESIDUAL or P_DELTA
    RESUMES, STATE = plan.resumes, "state" in plan.recorders
    matrix = wp.types.matrix(shape=(N, LANES), dtype=dtype)
    square = wp.types.matrix(shape=(N * N if MODAL_DAMPING else 1, LANES), dtype=dtype)
    table = wp.types.matrix(shape=(N * C, LANES), dtype=dtype)
    dampers = wp.types.matrix(shape=(N * VALUES if POWER_DAMPERS else 1, LANES), dtype=dtype)
    row, row64, indices = row_types(plan)
    method = tableau(plan)
    STAGES, KEEPS_SLOPES, ADAPTIVE = method.stages, method.keeps_slopes, method.adaptive
    # What goes on from an event before has velocities half a step behind already.
    HALVES_FIRST_STEP = method.halfway and not RESUMES
    # The last stage of a method that ends there sees a velocity that is not the motion's: its energies are sums by the
    # trapezoidal rule over accepted states, which close as its displacements do.
    TRAPEZOIDAL = ENERGY and method.ends_in_stage and not ADAPTIVE
    # A last stage that stands where the step ends follows the law there once and for all.
    MAPS_IN_STAGE = IS_MAPPING and method.ends_in_stage and not (ADAPTIVE or IS_RATE)
    # Few storeys turn in a step: where none of a row does, all go on along their lines.
    GLIDES = spring.decides is not None and not (ADAPTIVE or IS_RATE)
    LAST_STAGE = wp.constant(STAGES - 1)
    MAPS_AT_END, IS_STIFF = IS_MAPPING and not (ADAPTIVE or MAPS_IN_STAGE), IS_STIFF and not ADAPTIVE
    STIFF_BY_VELOCITY, STIFF_BY_MEMORY = (
        IS_STIFF and spring.settles_by_velocity,
        IS_STIFF and not spring.settles_by_velocity,
    )
    COUNTS_STEPS = ADAPTIVE and not HISTORY
    # What stands still feels the same acceleration again, unless it is forced.
    GATED = ACCELERATION and (IS_HARMONIC or IS_FORCE_HISTORY)
    # A sample alone in its thread, of which no forces are kept, needs no look at the forces of its last state.
    LOOKS_BACK = ACCELERATION or SHEAR or HISTORY or TRAPEZOIDAL
    HOLDS_STEP = LANES == 1 and not (IS_SPLIT or ADAPTIVE or P_DELTA or LOOKS_BACK)
    LAST_LOOK = wp.constant(0 if HOLDS_STEP else 1)
    FROM_STATE, TAKES_MEMORY = not KEEPS_SLOPES, IS_RATE or (IS_MAPPING and ADAPTIVE)
    weight, reach, node = method.weight, method.reach, method.node
    of_velocity, of_displacement, of_step = method.a, method.a_displacement, method.ends
    error_of_velocity, error_of_displacement = method.error, method.error_displacement
    slopes = wp.types.matrix(shape=(N * STAGES if KEEPS_SLOPES else 1, LANES), dtype=dtype)
    # What the memory of all storeys takes, storey by storey; a law without one has no use for the single row.
    memories = wp.types.matrix(shape=(max(1, N * M), LANES), dtype=dtype)
    memory_slopes = wp.types.matrix(shape=(max(1, N * M * STAGES) if KEEPS_SLOPES else 1, LANES), dtype=dtype)
    memory_sums = wp.types.matrix(shape=(max(1, M), LANES), dtype=dtype)
    # An error of the memory stays for the rest of the run, where those of the motion fade.
    LASTING = wp.constant(dtype(10.0))
    shortest_part = wp.constant(dtype(SHORTEST_PART[plan.dtype]))
    coefficient_vector = wp.types.vector(length=C, dtype=dtype)
    memory_vector = wp.types.vector(length=max(1, M), dtype=dtype)
    zero, no_memory = wp.constant(dtype(0.0)), wp.constant(memory_vector())
    ok, collapsed, diverged, unstable_step = (wp.int8(code) for code in (OK, COLLAPSED, DIVERGED, UNSTABLE_STEP))
    largest_deviation = wp.constant(dtype(LARGEST_DEVIATION))
    settling, settles_until = constants(plan, settling_polynomial(plan)), wp.constant(dtype(settling_limit(plan)))
    blown_up = wp.constant(dtype(LARGEST_DRIFT_RATIO))
    fell, burst = wp.constant(dtype(1.0)), wp.constant(dtype(2.0))  # what became of a storey beyond that

    @wp.kernel(module="unique", enable_backward=False, module_options=options(plan))
    def integrate_chain(
        first_block: int,
        control: types.Control,
        samples: types.Samples,
        structures: types.Structure,
        loads: types.Load,
        output: types.Output,
        history: types.History,
    ):
        align_rows()
        block = (first_block + wp.tid()) // SECTIONS
        section = (first_block + wp.tid()) % SECTIONS
        lowest = section * N
        count = control.samples
        substeps = control.substeps
        every = control.every
        sample = indices()
        motion = indices()
        live_intervals = indices()
        inverse_mass = matrix()
        mass = matrix()
        inverse_height = matrix()
        damping = matrix()
        power_damper = dampers()
        weight_over_height = matrix()
        damping_matrix = square()
        mass_damping = row()
        tangent_damping = row()
        coefficients = table()
        amplitude = matrix()
        frequency = row64()
        phase = row64()
        scale = row()
        step = row()
        u = matrix()  # accepted state: displacement, velocity, memory of the law
        v = matrix()
        z = memories()
        us = matrix()  # this stage's state
        vs = matrix()
        zs = memories()
        un = matrix()  # slopes summed up stage by stage, then the next accepted state
        vn = matrix()
        zn = memories()
        peak_drift = matrix()
        worst_ratio = row()
        worst_time = row()
        ratio_now = row()
        h_last = row()  # step to the state that is seen, and the base's acceleration at its end
        base_last = row()
        reached_drift = row()
        reached_force = row()
        decided = indices()  # 1 where a storey decides something on its way
        peak_acceleration = matrix()
        peak_shear = row()
        energy_in = row()
        energy_viscous = row()
        absorbed = matrix()
        initial_energy = row()
        fallen = row()  # the largest drift ratio, and at the end what became of its storey
        lifted = row()  # what gravity gave, from upright: the work of lifting the storeys again
        supplied = row()  # the most energy the sample ever held: what the balance error is relative to
        fastest = row()  # rate at which a memory settled in this step
        deviation = row()  # what is left, or grown, of a memory's deviation from where it settles
        risky = indices()  # whether it has anything to follow
        astray = row()  # the most it ever was
        watched_from = row()  # rate times step at which one begins to grow; less than any while one is followed
        next_value = indices()  # where the value at the first interval's end stands
        last_value = indices()
        silent_from = indices()
        base_at_end = row()
        gain = row()  # the scale, and 0 after the last sample
        differing_motions = int(0)
        intervals = int(0)
        residual_start = int(2147483647)
        foot_u = row()  # displacement and velocity of the floor below the section, and the force from above it
        foot_v = row()
        roof = row()
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
            if IS_STIFF:
                watched_from[j] = settles_until
            if IS_HARMONIC:
                frequency[j] = loads.circular_frequency[0]
                phase[j] = loads.phase[0]
            if MASS_DAMPING:
                mass_damping[j] = structures.mass_damping[s]
            if TANGENT_DAMPING:
                tangent_damping[j] = structures.tangent_damping[s]
            if MODAL_DAMPING:
                for i in range(N * N):
                    damping_matrix[i, j] = structures.damping_matrix[i, s]
            if IS_RECORD:
                next_value[j] = loads.first[motion[j]] + 1
                last_value[j] = loads.first[motion[j]] + loads.intervals[motion[j]]
                # Nothing shakes after the last sample; a run that ends with it sees it.
                silent_from[j] = int(2147483647)
                if loads.intervals[motion[j]] < live_intervals[j]:
                    silent_from[j] = loads.intervals[motion[j]]
                gain[j] = scale[j]
                base_at_end[j] = loads.values[next_value[j] - 1] * scale[j]
                if motion[j] != motion[0]:
                    differing_motions += 1
            for i in range(N):
                # Sections end with storeys of no mass that stay undeformed where the number of storeys is no multiple.
                g = lowest + i
                if g < STOREYS:
                    inverse_mass[i, j] = structures.inverse_mass[g, s]
                    if ENERGY:
                        mass[i, j] = structures.mass[g, s]
                    if RATIO:
                        inverse_height[i, j] = structures.inverse_height[g, s]
                    if STOREY_DAMPING:
                        damping[i, j] = structures.storey_damping[g, s]
                    if POWER_DAMPERS:
                        for q in range(VALUES):
                            power_damper[i * VALUES + q, j] = structures.viscous_damper[g * VALUES + q, s]
                    if P_DELTA:
                        weight_over_height[i, j] = structures.storey_weight_over_height[g, s]
                    if IS_HARMONIC:
                        amplitude[i, j] = loads.amplitude[g] * scale[j]
                    for q in range(C):
                        coefficients[i * C + q, j] = structures.coefficients[g * C + q, s]
                    u[i, j] = loads.initial_displacement[g]
                    v[i, j] = loads.initial_velocity[g]
                    if RESUMES:
                        u[i, j] = structures.initial_displacement[g, s]
                        v[i, j] = structures.initial_velocity[g, s]
                        for m in range(M):
                            z[i * M + m, j] = structures.initial_memory[g * M + m, s]
                            if TAKES_MEMORY:
                                zs[i * M + m, j] = z[i * M + m, j]
                if HAS_PADS:
                    if g >= STOREYS:
                        for q in range(C):  # a law without coefficients may divide by zero
                            coefficients[i * C + q, j] = structures.coefficients[(STOREYS - 1) * C + q, s]
        if IS_SPLIT:
            intervals = across_warp(intervals)  # the threads of a warp exchange values at every stage
            for j in range(LANES):
                foot_u[j] = below(u[N - 1, j], section, SECTIONS)
        for i in range(N):
            for j in range(LANES):
                us[i, j] = u[i, j]
                vs[i, j] = v[i, j]
                if ENERGY:
                    if lowest + i < STOREYS:
                        drift = u[i, j]
                        if i > 0:
                            drift -= u[i - 1, j]
                        elif IS_SPLIT:
                            drift -= foot_u[j]
                        c = coefficient_vector()
                        for q in range(C):
                            c[q] = coefficients[i * C + q, j]
                        memory = memory_vector()
                        if RESUMES:
                            for m in range(M):
                                memory[m] = z[i * M + m, j]
                        absorbed[i, j] = recoverable_of(drift, memory, c)
                        initial_energy[j] += absorbed[i, j] + dtype(0.5) * mass[i, j] * v[i, j] * v[i, j]
                        if P_DELTA:
                            initial_energy[j] -= dtype(0.5) * weight_over_height[i, j] * drift * drift
        if SPLIT_ENERGY:
            for j in range(LANES):
                initial_energy[j] = together(initial_energy[j], SECTIONS)

        a0 = row()  # base acceleration at the interval's start, the step's and this stage, and its change over a step
        a_step = row()
        base = row()
        da = row()
        f0 = matrix()  # the same for nodal forces
        df = matrix()
        damping_force = matrix()
        above = row()
        sine = row()
        h = row()
        lives = row()  # 1, and 0 for a lane that is done
        seen = row()  # 1, and 0 for a lane whose last state has been seen
        power_in = row()
        momentum = row()
        power_viscous = row()
        work_in = row()  # in a step, over its length
        work_viscous = row()
        acceleration = slopes()  # of every stage, and the rates of the memory
        memory_rate = memory_slopes()
        to_displacement = row()
        to_velocity = row()
        to_memory = memory_sums()
        # An adaptive method goes through each step in parts of its own: those done, this one, and the next to be tried.
        whole_step = row()
        done = row()
        part = row()
        trial = row()
        excess = row()  # estimated error over what is allowed
        size_u = row()  # the largest displacement and velocity so far, to which errors are relative
        size_v = row()
        accepted = indices()
        rejected = indices()
        safe_in = row()  # what a rejected part must not leave behind
        safe_viscous = row()
        safe_absorbed = matrix()
        inverse_substeps = dtype(1.0) / dtype(substeps)
        if IS_NOISE:
            processes = Processes()
            number = Numbers()
            for j in range(LANES):
                number[j] = samples.number[sample[j]]
        if HOLDS_STEP:
            for j in range(LANES):
                h[j] = step[j]
        # One interval more than the longest run, but where the step is held: its first stage sees the last state.
        for interval in range(intervals + LAST_LOOK):
            if IS_NOISE:
                a0, da, processes = noise_over_interval(
                    loads, control.key, number, interval, live_intervals, scale, processes
                )
                for j in range(LANES):
                    da[j] = da[j] * inverse_substeps
            if P_DELTA:
                for j in range(LANES):
                    fallen[j] = dtype(0.0)
                    foot_u[j] = dtype(0.0)
                    if IS_SPLIT:
                        foot_u[j] = below(u[N - 1, j], section, SECTIONS)
                for i in range(N):
                    for j in range(LANES):
                        drift = u[i, j] - foot_u[j]
                        foot_u[j] = u[i, j]
                        fallen[j] = larger(fallen[j], wp.abs(drift) * inverse_height[i, j])
                if IS_SPLIT:
                    for j in range(LANES):
                        fallen[j] = across(fallen[j], SECTIONS)
            for j in range(LANES):
                # A lane that is done waits for the others with a step of zero: its state and its sums stand still.
                if not HOLDS_STEP:
                    h[j] = dtype(0.0)
                    if interval < live_intervals[j]:
                        h[j] = step[j]
                if P_DELTA:
                    # A storey that fell over would go on, ever faster, until nothing of it is finite.
                    if fallen[j] > blown_up:
                        h[j] = dtype(0.0)
                if GATED:
                    lives[j] = dtype(0.0)
                    seen[j] = dtype(0.0)
                    if interval < live_intervals[j]:
                        lives[j] = dtype(1.0)
                    if interval <= live_intervals[j]:
                        seen[j] = dtype(1.0)
                if ADAPTIVE:
                    whole_step[j] = h[j]
                    if interval == 0:
                        trial[j] = dtype(1.0)
                if IS_FORCE_HISTORY:
                    for i in range(N):
                        if lowest + i < STOREYS:
                            begin, change = sampled(
                                loads, motion[j], interval, live_intervals[j], STOREYS, lowest + i, scale[j]
                            )
                            f0[i, j] = begin
                            df[i, j] = change
            if IS_RECORD:
                # Lanes that share a motion read it once: gathering a value a lane costs as much as a storey.
                if differing_motions == 0:
                    value = element(loads.values, wp.min(next_value[0] + interval, last_value[0]))
                    for j in range(LANES):
                        begin, end, factor = at_ends(base_at_end[j], value, gain[j], interval == silent_from[j])
                        a0[j] = begin
                        da[j] = (end - begin) * inverse_substeps
                        base_at_end[j] = end
                        gain[j] = factor
                else:
                    for j in range(LANES):
                        value = element(loads.values, wp.min(next_value[j] + interval, last_value[j]))
                        begin, end, factor = at_ends(base_at_end[j], value, gain[j], interval == silent_from[j])
                        a0[j] = begin
                        da[j] = (end - begin) * inverse_substeps
                        base_at_end[j] = end
                        gain[j] = factor
            for substep in range(substeps):
                index = interval * substeps + substep
                if IS_BASE:
                    for j in range(LANES):
                        a_step[j] = a0[j] + dtype(substep) * da[j]
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
                            if ENERGY:
                                safe_in[j] = energy_in[j]
                                safe_viscous[j] = energy_viscous[j]
                                for i in range(N):
                                    safe_absorbed[i, j] = absorbed[i, j]
                    for stage in range(STAGES):
                        if IS_BASE:
                            for j in range(LANES):
                                base[j] = a_step[j] + node[stage] * da[j]
                                if ADAPTIVE:
                                    base[j] = a_step[j] + (done[j] + node[stage] * part[j]) * da[j]
                        if IS_HARMONIC:
                            for j in range(LANES):
                                whole = wp.float64(index) + wp.float64(node[stage])
                                if ADAPTIVE:
                                    whole = wp.float64(index) + wp.float64(done[j] + node[stage] * part[j])
                                sine[j] = harmonic(whole, step[j], frequency[j], phase[j])
                        if MODAL_DAMPING:
                            for i in range(N):
                                for j in range(LANES):
                                    damping_force[i, j] = dtype(0.0)
                                for k in range(N):
                                    for j in range(LANES):
                                        vk = vs[k, j]
                                        if FROM_STATE:
                                            if stage == 0:
                                                vk = v[k, j]
                                        damping_force[i, j] += damping_matrix[i * N + k, j] * vk
                        if IS_SPLIT:
                            # The floor below is another thread's, and so is the storey above: its force is worked out
                            # there before the walk, and once more when the walk comes to it.
                            for j in range(LANES):
                                top_u = us[N - 1, j]
                                top_v = vs[N - 1, j]
                                drift = us[0, j]
                                rate = vs[0, j]
                                zi = z[0, j]
                                if TAKES_MEMORY:
                                    zi = zs[0, j]
                                if stage == 0:
                                    top_u = u[N - 1, j]
                                    top_v = v[N - 1, j]
                                    drift = u[0, j]
                                    rate = v[0, j]
                                    zi = z[0, j]
                                foot_u[j] = below(top_u, section, SECTIONS)
                                foot_v[j] = below(top_v, section, SECTIONS)
                                drift -= foot_u[j]
                                rate -= foot_v[j]
                                if HAS_PADS:
                                    if lowest >= STOREYS:
                                        drift = dtype(0.0)
                                        rate = dtype(0.0)
                                c = coefficient_vector()
                                for q in range(C):
                                    c[q] = coefficients[q, j]
                                memory = memory_vector(zi)
                                for m in range(1, M):
                                    memory[m] = z[m, j]
                                    if TAKES_MEMORY:
                                        if stage > 0:
                                            memory[m] = zs[m, j]
                                if GLIDES:
                                    after = memory
                                    if stage > 0:
                                        after = glide(drift, memory, c)
                                        if decides(drift, memory, c):
                                            after = evolve(drift, memory, c)
                                    f = held_of(drift, after, c)
                                else:
                                    f = force_of(drift, memory, c)
                                if P_DELTA:
                                    f -= weight_over_height[0, j] * drift
                                if STOREY_DAMPING:
                                    f += damping[0, j] * rate
                                if TANGENT_DAMPING:
                                    ahead = drift + AHEAD * h[j] * rate
                                    after = memory
                                    if IS_MAPPING:
                                        after = evolve(ahead, memory, c)
                                    tangent = larger(tangent_of(ahead, rate, memory, after, c), dtype(0.0))
                                    f += tangent_damping[j] * tangent * rate
                                if POWER_DAMPERS:
                                    f += damper_force(rate, power_damper[0, j], power_damper[1, j], power_damper[2, j])
                                roof[j] = above_of(f, section, SECTIONS)
                        for j in range(LANES):
                            above[j] = roof[j]
                            power_in[j] = dtype(0.0)
                            momentum[j] = dtype(0.0)
                            power_viscous[j] = dtype(0.0)
                        for down in range(N):
                            i = N - 1 - down
                            if GLIDES:
                                # All glide, and those that decide something are gone through again: what becomes of a
                                # sample depends on no other one, to the last bit.
                                is_last = stage == LAST_STAGE
                                if stage > 0:
                                    deciding = int(0)
                                    for j in range(LANES):
                                        reached_drift[j] = us[i, j]
                                        if i > 0:
                                            reached_drift[j] -= us[i - 1, j]
                                        elif IS_SPLIT:
                                            reached_drift[j] -= foot_u[j]
                                        if HAS_PADS:
                                            if lowest + i >= STOREYS:
                                                reached_drift[j] = dtype(0.0)
                                        c = coefficient_vector()
                                        for q in range(C):
                                            c[q] = coefficients[i * C + q, j]
                                        memory = memory_vector()
                                        for m in range(M):
                                            memory[m] = z[i * M + m, j]
                                        decided[j] = wp.where(decides(reached_drift[j], memory, c), 1, 0)
                                        deciding += decided[j]
                                        after = glide(reached_drift[j], memory, c)
                                        reached_force[j] = held_of(reached_drift[j], after, c)
                                        if MAPS_IN_STAGE:
                                            if is_last:
                                                for m in range(GLIDING):
                                                    z[i * M + m, j] = wp.where(decided[j] > 0, memory[m], after[m])
                                    if deciding > 0:
                                        for j in range(LANES):
                                            c = coefficient_vector()
                                            for q in range(C):
                                                c[q] = coefficients[i * C + q, j]
                                            memory = memory_vector()
                                            for m in range(M):
                                                memory[m] = z[i * M + m, j]
                                            after = evolve(reached_drift[j], memory, c)
                                            force_then = held_of(reached_drift[j], after, c)
                                            reached_force[j] = wp.where(decided[j] > 0, force_then, reached_force[j])
                                            if MAPS_IN_STAGE:
                                                if is_last:
                                                    for m in range(M):
                                                        z[i * M + m, j] = wp.where(decided[j] > 0, after[m], memory[m])
                            for j in range(LANES):
                                ui = us[i, j]
                                vi = vs[i, j]
                                zi = z[i * M, j]
                                if TAKES_MEMORY:
                                    zi = zs[i * M, j]
                                if FROM_STATE:
                                    if stage == 0:
                                        ui = u[i, j]
                                        vi = v[i, j]
                                        zi = z[i * M, j]
                                drift = ui
                                rate = vi
                                if i > 0:
                                    u_below = us[i - 1, j]
                                    v_below = vs[i - 1, j]
                                    if FROM_STATE:
                                        if stage == 0:
                                            u_below = u[i - 1, j]
                                            v_below = v[i - 1, j]
                                    drift -= u_below
                                    rate -= v_below
                                elif IS_SPLIT:
                                    drift -= foot_u[j]
                                    rate -= foot_v[j]
                                if HAS_PADS:
                                    if lowest + i >= STOREYS:
                                        drift = dtype(0.0)
                                        rate = dtype(0.0)
                                ha = h[j] * reach[stage]
                                c = coefficient_vector()
                                for q in range(C):
                                    c[q] = coefficients[i * C + q, j]
                                memory = memory_vector(zi)
                                for m in range(1, M):
                                    memory[m] = z[i * M + m, j]
                                    if TAKES_MEMORY:
                                        memory[m] = zs[i * M + m, j]
                                        if FROM_STATE:
                                            if stage == 0:
                                                memory[m] = z[i * M + m, j]
                                if GLIDES:
                                    restoring = reached_force[j]
                                    if stage == 0:
                                        restoring = held_of(drift, memory, c)
                                elif MAPS_IN_STAGE:
                                    if stage == STAGES - 1:
                                        reached = evolve(drift, memory, c)
                                        restoring = held_of(drift, reached, c)
                                        for m in range(M):
                                            z[i * M + m, j] = reached[m]
                                    elif stage == 0:
                                        restoring = held_of(drift, memory, c)
                                    else:
                                        restoring = force_of(drift, memory, c)
                                elif HOLDS_FORCE:
                                    restoring = held_of(drift, memory, c)
                                    if stage > 0:
                                        restoring = force_of(drift, memory, c)
                                else:
                                    restoring = force_of(drift, memory, c)
                                f = restoring
                                if P_DELTA:
                                    f -= weight_over_height[i, j] * drift
                                if HAS_DASHPOTS:
                                    dashpot = dtype(0.0)
                                if STOREY_DAMPING:
                                    dashpot = damping[i, j] * rate
                                if TANGENT_DAMPING:
                                    # As the storey goes on from here; where it stands, rounding would choose a side.
                                    # On a falling branch there is none: a dashpot of less than that gives energy.
                                    ahead = drift + AHEAD * h[j] * rate
                                    after = memory
                                    if IS_MAPPING:
                                        after = evolve(ahead, memory, c)
                                    tangent = larger(tangent_of(ahead, rate, memory, after, c), dtype(0.0))
                                    dashpot += tangent_damping[j] * tangent * rate
                                if POWER_DAMPERS:
                                    of_velocity_power = damper_force(
                                        rate,
                                        power_damper[i * VALUES, j],
                                        power_damper[i * VALUES + 1, j],
                                        power_damper[i * VALUES + 2, j],
                                    )
                                    dashpot += of_velocity_power
                                if HAS_DASHPOTS:
                                    f += dashpot
                                # What acts on the floor: absolute acceleration times its mass, but for base motion.
                                net = above[j] - f
                                if MODAL_DAMPING:
                                    net -= damping_force[i, j]
                                if IS_HARMONIC:
                                    net += amplitude[i, j] * sine[j]
                                if IS_FORCE_HISTORY:
                                    at = (dtype(substep) + node[stage]) * inverse_substeps
                                    if ADAPTIVE:
                                        at = (dtype(substep) + done[j] + node[stage] * part[j]) * inverse_substeps
                                    force = f0[i, j] + at * df[i, j]
                                    net += force
                                ai = net * inverse_mass[i, j]
                                if MASS_DAMPING:
                                    nodal = mass_damping[j] * vi
                                    ai -= nodal
                                if stage == 0:
                                    # The state at the step's start; one that stands still is seen again, to no effect.
                                    if DRIFT:
                                        peak_drift[i, j] = larger(peak_drift[i, j], wp.abs(drift))
                                    if TIME:
                                        ratio_now[j] = larger(ratio_now[j], wp.abs(drift) * inverse_height[i, j])
                                    if ACCELERATION:
                                        size = wp.abs(ai)
                                        if GATED:
                                            size = size * seen[j]
                                        peak_acceleration[i, j] = larger(peak_acceleration[i, j], size)
                                    if SHEAR:
                                        if i == 0:
                                            peak_shear[j] = larger(peak_shear[j], wp.abs(restoring))
                                if HISTORY:
                                    if stage == 0 and attempt == 0:
                                        keep_state(history, samples.output[sample[j]], index, every, i, ui, vi, ai)
                                        keep_force(history, samples.output[sample[j]], index, every, i, restoring)
                                if IS_BASE:
                                    ai -= base[j]
                                if ENERGY:
                                    if TRAPEZOIDAL:
                                        if stage == 0:
                                            absorbed[i, j] += dtype(0.5) * (h_last[j] + h[j]) * restoring * rate
                                    else:
                                        absorbed[i, j] += h[j] * weight[stage] * restoring * rate
                                    momentum_of_floor = mass[i, j] * vi
                                    momentum[j] += momentum_of_floor
                                    if IS_HARMONIC:
                                        power_in[j] += amplitude[i, j] * sine[j] * vi
                                    if IS_FORCE_HISTORY:
                                        power_in[j] += force * vi
                                    if HAS_DASHPOTS:
                                        power_viscous[j] += dashpot * rate
                                    if MASS_DAMPING:
                                        power_viscous[j] += momentum_of_floor * nodal
                                    if MODAL_DAMPING:
                                        power_viscous[j] += damping_force[i, j] * vi
                                above[j] = f
                                if STIFF_BY_MEMORY:
                                    fastest[j] = larger(fastest[j], relaxation_of(rate, memory, c))
                                if STIFF_BY_VELOCITY:
                                    if stage == 0:
                                        settles = relaxation_of(rate, memory, c)
                                        if down > 0:
                                            settles = larger(fastest[j], settles)
                                        fastest[j] = settles
                                if IS_RATE:
                                    z_rate = rate_of(rate, memory, c)
                                if KEEPS_SLOPES:
                                    acceleration[stage * N + i, j] = ai
                                    if IS_RATE:
                                        for m in range(M):
                                            memory_rate[(stage * N + i) * M + m, j] = z_rate[m]
                                else:
                                    # Slopes are summed first, then added: the state is rounded once a step, not once
                                    # a stage.
                                    u_slope = weight[stage] * vi
                                    v_slope = weight[stage] * ai
                                    if stage > 0:
                                        u_slope += un[i, j]
                                        v_slope += vn[i, j]
                                    if IS_RATE:
                                        z_slope = weight[stage] * z_rate
                                        if stage > 0:
                                            for m in range(M):
                                                z_slope[m] += zn[i * M + m, j]
                                    if stage < STAGES - 1:
                                        un[i, j] = u_slope
                                        vn[i, j] = v_slope
                                        us[i, j] = u[i, j] + ha * vi
                                        vs[i, j] = v[i, j] + ha * ai
                                        if IS_RATE:
                                            for m in range(M):
                                                zn[i * M + m, j] = z_slope[m]
                                                zs[i * M + m, j] = z[i * M + m, j] + ha * z_rate[m]
                                    else:
                                        u[i, j] += h[j] * u_slope
                                        v[i, j] += h[j] * v_slope
                                        if IS_RATE:
                                            for m in range(M):
                                                z[i * M + m, j] += h[j] * z_slope[m]
                            if KEEPS_SLOPES:
                                for j in range(LANES):
                                    to_displacement[j] = dtype(0.0)
                                    to_velocity[j] = dtype(0.0)
                                    for m in range(M):
                                        to_memory[m, j] = dtype(0.0)
                                for q in range(STAGES):
                                    if q <= stage:
                                        for j in range(LANES):
                                            slope = acceleration[q * N + i, j]
                                            to_displacement[j] += of_displacement[(stage + 1) * STAGES + q] * slope
                                            to_velocity[j] += of_velocity[(stage + 1) * STAGES + q] * slope
                                            if IS_RATE:
                                                for m in range(M):
                                                    z_slope = memory_rate[(q * N + i) * M + m, j]
                                                    to_memory[m, j] += of_velocity[(stage + 1) * STAGES + q] * z_slope
                                for j in range(LANES):
                                    if HALVES_FIRST_STEP:
                                        if index == 0:
                                            to_displacement[j] *= dtype(0.5)
                                            to_velocity[j] *= dtype(0.5)
                                    us[i, j] = u[i, j] + h[j] * (
                                        of_step[stage + 1] * v[i, j] + h[j] * to_displacement[j]
                                    )
                                    vs[i, j] = v[i, j] + h[j] * to_velocity[j]
                                    un[i, j] = us[i, j]
                                    vn[i, j] = vs[i, j]
                                    if IS_RATE:
                                        for m in range(M):
                                            zs[i * M + m, j] = z[i * M + m, j] + h[j] * to_memory[m, j]
                                            zn[i * M + m, j] = zs[i * M + m, j]
                        if TIME:
                            if stage == 0:
                                for j in range(LANES):
                                    if SPLIT_TIME:
                                        ratio_now[j] = across(ratio_now[j], SECTIONS)
                                    if ratio_now[j] > worst_ratio[j]:
                                        worst_ratio[j] = ratio_now[j]
                                        worst_time[j] = dtype(index) * step[j]
                                        if ADAPTIVE:
                                            worst_time[j] = (dtype(index) + done[j]) * step[j]
                                    ratio_now[j] = dtype(0.0)
                        if ENERGY:
                            for j in range(LANES):
                                if IS_BASE:
                                    if TRAPEZOIDAL:
                                        # A motion may end one step with one value and start the next with another.
                                        if stage == 0:
                                            impulse = dtype(0.5) * (h_last[j] * base_last[j] + h[j] * base[j])
                                            energy_in[j] -= impulse * momentum[j]
                                    else:
                                        power_in[j] -= base[j] * momentum[j]
                                if TRAPEZOIDAL:
                                    if stage == 0:
                                        energy_in[j] += dtype(0.5) * (h_last[j] + h[j]) * power_in[j]
                                        energy_viscous[j] += dtype(0.5) * (h_last[j] + h[j]) * power_viscous[j]
                                else:
                                    work_in[j] += weight[stage] * power_in[j]
                                    work_viscous[j] += weight[stage] * power_viscous[j]
                    if ENERGY:
                        for j in range(LANES):
                            if TRAPEZOIDAL:
                                h_last[j] = h[j]
                                base_last[j] = a_step[j] + da[j]
                            else:
                                energy_in[j] += h[j] * work_in[j]
                                energy_viscous[j] += h[j] * work_viscous[j]
                                work_in[j] = dtype(0.0)
                                work_viscous[j] = dtype(0.0)
                    if ADAPTIVE:
                        for j in range(LANES):
                            excess[j] = dtype(0.0)
                        for i in range(N):
                            for j in range(LANES):
                                of_u = dtype(0.0)
                                of_v = dtype(0.0)
                                of_z = memory_vector()
                                for q in range(STAGES):
                                    of_u += error_of_displacement[q] * acceleration[q * N + i, j]
                                    of_v += error_of_velocity[q] * acceleration[q * N + i, j]
                                    if IS_RATE:
                                        for m in range(M):
                                            of_z[m] += error_of_velocity[q] * memory_rate[(q * N + i) * M + m, j]
                                of_u = wp.abs(of_u) * h[j] * h[j]
                                if IS_MAPPING:
                                    # A storey that turns inside the part has been farther than where it ends.
                                    drift = un[i, j]
                                    rate = vn[i, j]
                                    begin_drift = u[i, j]
                                    begin_rate = v[i, j]
                                    if i > 0:
                                        drift -= un[i - 1, j]
                                        rate -= vn[i - 1, j]
                                        begin_drift -= u[i - 1, j]
                                        begin_rate -= v[i - 1, j]
                                    c = coefficient_vector()
                                    for q in range(C):
                                        c[q] = coefficients[i * C + q, j]
                                    before = memory_vector(z[i * M, j])
                                    for m in range(1, M):
                                        before[m] = z[i * M + m, j]
                                    if IS_RATE:
                                        for m in range(M):
                                            before[m] = zn[i * M + m, j]
                                    after = evolve(drift, before, c)
                                    if begin_rate * rate < dtype(0.0):
                                        # From either end by a parabola; where the two differ, maybe farther still.
                                        turn = h[j] * begin_rate / (begin_rate - rate)
                                        early = begin_drift + dtype(0.5) * begin_rate * turn
                                        late = drift - dtype(0.5) * rate * (h[j] - turn)
                                        farthest = dtype(0.5) * (early + late)
                                        beyond = farthest + wp.sign(begin_rate) * wp.abs(early - late)
                                        turned = evolve(drift, evolve(beyond, before, c), c)
                                        missed = force_of(drift, turned, c) - force_of(drift, after, c)
                                        initial_stiffness = tangent_of(zero, zero, no_memory, no_memory, c)
                                        of_u = wp.max(of_u, LASTING * wp.abs(missed) / initial_stiffness)
                                        after = evolve(drift, evolve(farthest, before, c), c)
                                    for m in range(M):
                                        zn[i * M + m, j] = after[m]
                                size_u[j] = wp.max(size_u[j], wp.abs(u[i, j]))
                                size_v[j] = wp.max(size_v[j], wp.abs(v[i, j]))
                                v_error = wp.abs(of_v) * h[j]
                                worse = excess_of(of_u, size_u[j], un[i, j], v_error, size_v[j], vn[i, j])
                                if IS_RATE:
                                    for m in range(M):
                                        size = wp.max(wp.abs(zn[i * M + m, j]), dtype(1.0))
                                        worse = wp.max(worse, wp.abs(of_z[m]) * h[j] / size)
                                excess[j] = wp.max(excess[j], worse / control.tolerance)
                        for j in range(LANES):
                            rejects = excess[j] > dtype(1.0) and part[j] > shortest_part
                            trial[j] = next_part(part[j], trial[j], excess[j], shortest_part)
                            if rejects:
                                rejected[j] += 1
                                energy_in[j] = safe_in[j]
                                energy_viscous[j] = safe_viscous[j]
                                for i in range(N):
                                    un[i, j] = u[i, j]
                                    vn[i, j] = v[i, j]
                                    for m in range(M):
                                        zn[i * M + m, j] = z[i * M + m, j]
                                    if ENERGY:
                                        absorbed[i, j] = safe_absorbed[i, j]
                            elif h[j] > dtype(0.0):
                                accepted[j] += 1
                                done[j] = done_after(done[j], part[j], excess[j], shortest_part)
                            part[j] = dtype(0.0)
                            if whole_step[j] > dtype(0.0) and done[j] < dtype(1.0):
                                part[j] = wp.min(trial[j], dtype(1.0) - done[j])
                                pending += 1
                        attempt += 1
                    if KEEPS_SLOPES:
                        for i in range(N):
                            for j in range(LANES):
                                u[i, j] = un[i, j]
                                v[i, j] = vn[i, j]
                                us[i, j] = un[i, j]
                                vs[i, j] = vn[i, j]
                                if TAKES_MEMORY:
                                    for m in range(M):
                                        z[i * M + m, j] = zn[i * M + m, j]
                                        zs[i * M + m, j] = zn[i * M + m, j]
                if SEES_FOOT:
                    for j in range(LANES):
                        foot_u[j] = below(u[N - 1, j], section, SECTIONS)
                if MAPS_AT_END:
                    for i in range(N):
                        deciding = int(0)
                        for j in range(LANES):
                            reached_drift[j] = u[i, j]
                            if i > 0:
                                reached_drift[j] -= u[i - 1, j]
                            elif IS_SPLIT:
                                reached_drift[j] -= foot_u[j]
                            if HAS_PADS:
                                if lowest + i >= STOREYS:
                                    reached_drift[j] = dtype(0.0)
                            c = coefficient_vector()
                            for q in range(C):
                                c[q] = coefficients[i * C + q, j]
                            memory = memory_vector(z[i * M, j])
                            for m in range(1, M):
                                memory[m] = z[i * M + m, j]
                            if GLIDES:
                                decided[j] = wp.where(decides(reached_drift[j], memory, c), 1, 0)
                                deciding += decided[j]
                                after = glide(reached_drift[j], memory, c)
                                for m in range(GLIDING):
                                    z[i * M + m, j] = wp.where(decided[j] > 0, memory[m], after[m])
                            else:
                                memory = evolve(reached_drift[j], memory, c)
                                for m in range(M):
                                    z[i * M + m, j] = memory[m]
                                    if TAKES_MEMORY:
                                        zs[i * M + m, j] = memory[m]
                        if GLIDES:
                            if deciding > 0:
                                for j in range(LANES):
                                    c = coefficient_vector()
                                    for q in range(C):
                                        c[q] = coefficients[i * C + q, j]
                                    memory = memory_vector()
                                    for m in range(M):
                                        memory[m] = z[i * M + m, j]
                                    after = evolve(reached_drift[j], memory, c)
                                    for m in range(M):
                                        z[i * M + m, j] = wp.where(decided[j] > 0, after[m], memory[m])
                if ENERGY:
                    for j in range(LANES):
                        put_in = energy_in[j]
                        if SPLIT_ENERGY:
                            put_in = together(put_in, SECTIONS)
                        supplied[j] = wp.max(supplied[j], wp.abs(initial_energy[j] + put_in))
                if IS_STIFF:
                    # Below the limit deviations only fade: most steps have nothing to follow.
                    astray_lanes = int(0)
                    for j in range(LANES):
                        if SPLIT_STIFF:
                            fastest[j] = across(fastest[j], SECTIONS)
                        risky[j] = wp.where(fastest[j] * h[j] <= watched_from[j], 0, 1)
                    for j in range(LANES):
                        astray_lanes += risky[j]
                    if astray_lanes > 0:
                        for j in range(LANES):
                            grown = deviation_after(deviation[j], fastest[j] * h[j], settling)
                            deviation[j] = grown
                            if not grown <= astray[j]:
                                astray[j] = grown
                            watched_from[j] = settles_until
                            if not grown <= dtype(1.0):
                                watched_from[j] = -dtype(1.0)
                if STIFF_BY_MEMORY:
                    for j in range(LANES):
                        fastest[j] = dtype(0.0)
                if GATED:
                    for j in range(LANES):
                        seen[j] = lives[j]
                if RESIDUAL:
                    if index >= residual_start:
                        for j in range(LANES):
                            steps = samples.residual_steps[sample[j]]
                            since = index - (live_intervals[j] * substeps - steps)
                            # A lane that repeats the last sample must not add to its mean again.
                            if since >= 0 and since < steps and block * LANES + j < count:
                                o = samples.output[sample[j]]
                                share = weight_in_mean(step[j], since, steps)
                                for i in range(N):
                                    if lowest + i < STOREYS:
                                        drift = u[i, j]
                                        if i > 0:
                                            drift -= u[i - 1, j]
                                        elif IS_SPLIT:
                                            drift -= foot_u[j]
                                        ratio = drift * inverse_height[i, j]
                                        add_to_mean(output.residual_drift_ratio, lowest + i, o, share * ratio, since)

        if HOLDS_STEP:
            for i in range(N):
                for j in range(LANES):
                    drift = u[i, j]
                    if i > 0:
                        drift -= u[i - 1, j]
                    if DRIFT:
                        peak_drift[i, j] = larger(peak_drift[i, j], wp.abs(drift))
                    if TIME:
                        if wp.abs(drift) * inverse_height[i, j] > worst_ratio[j]:
                            worst_ratio[j] = wp.abs(drift) * inverse_height[i, j]
                            worst_time[j] = dtype(intervals * substeps) * step[j]
        for j in range(LANES):
            o = samples.output[sample[j]]
            total = dtype(0.0)
            kept = dtype(0.0)  # energy that is still there, or was absorbed
            fallen[j] = dtype(0.0)
            if SEES_LAST_FOOT:
                foot_u[j] = below(u[N - 1, j], section, SECTIONS)
            if SPLIT_FALL:
                foot_v[j] = below(v[N - 1, j], section, SECTIONS)
            for i in range(N):
                g = lowest + i
                total += u[i, j] + v[i, j] + z[i * M, j]
                for m in range(1, M):
                    total += z[i * M + m, j]
                if g < STOREYS:
                    if DRIFT:
                        output.peak_storey_drift[g, o] = peak_drift[i, j]
                    if ACCELERATION:
                        output.peak_floor_acceleration[g, o] = peak_acceleration[i, j]
                    if STATE:
                        output.final_displacement[g, o] = u[i, j]
                        output.final_velocity[g, o] = v[i, j]
                        for m in range(M):
                            output.final_memory[g * M + m, o] = z[i * M + m, j]
                    if SEES_LAST:
                        drift = u[i, j]
                        if i > 0:
                            drift -= u[i - 1, j]
                        elif IS_SPLIT:
                            drift -= foot_u[j]
                        c = coefficient_vector()
                        for q in range(C):
                            c[q] = coefficients[i * C + q, j]
                        memory = memory_vector(z[i * M, j])
                        for m in range(1, M):
                            memory[m] = z[i * M + m, j]
                    if P_DELTA:
                        overturning = weight_over_height[i, j] * drift
                        lifted[j] += dtype(0.5) * overturning * drift
                        ratio = wp.abs(drift) * inverse_height[i, j]
                        rate = v[i, j]
                        if i > 0:
                            rate -= v[i - 1, j]
                        elif IS_SPLIT:
                            rate -= foot_v[j]
                        outward = overturning - held_of(drift, memory, c)
                        if DRIFT:
                            if keeps_falling(outward, drift, rate, peak_drift[i, j]):
                                fallen[j] = larger(fallen[j], fell)
                        if ratio > blown_up:
                            overturned = has_overturned(outward, drift, rate, step[j], ratio, blown_up)
                            fallen[j] = larger(fallen[j], wp.where(overturned, fell, burst))
                    if ENERGY:
                        stored = recoverable_of(drift, memory, c)
                        output.hysteretic_energy[g, o] = absorbed[i, j] - stored
                        kept += absorbed[i, j] + dtype(0.5) * mass[i, j] * v[i, j] * v[i, j]
            if IS_SPLIT:
                total = together(total, SECTIONS)
            if SPLIT_FALL:
                fallen[j] = across(fallen[j], SECTIONS)
                lifted[j] = together(lifted[j], SECTIONS)
            if SPLIT_ENERGY:
                kept = together(kept, SECTIONS)
                energy_in[j] = together(energy_in[j], SECTIONS)
                energy_viscous[j] = together(energy_viscous[j], SECTIONS)
            if IS_SPLIT:
                see_neighbours()
            if section == 0:
                status = ok
                if TIME:
                    output.time_of_peak_drift[o] = worst_time[j]
                if DRIFT:
                    largest = worst_storey(output, structures, o, samples.structure[sample[j]], STOREYS)
                    if largest > control.collapse_drift_ratio:
                        status = collapsed
                    if largest > blown_up:
                        status = diverged
                if P_DELTA:
                    if fallen[j] == fell:
                        status = collapsed
                    if fallen[j] == burst:
                        status = diverged
                # Infinities and NaN never leave a sum: a finite one clears the whole state.
                if not wp.isfinite(total):
                    status = diverged
                if IS_STIFF:
                    # Passed on the way to a state that is not finite too: it tells why.
                    if not astray[j] <= largest_deviation:
                        status = unstable_step
                output.status[o] = status
                if COUNTS_STEPS:
                    output.accepted_steps[o] = accepted[j]
                    output.rejected_steps[o] = rejected[j]
                if SHEAR:
                    output.peak_base_shear[o] = peak_shear[j]
                if ENERGY:
                    output.input_energy[o] = energy_in[j]
                    output.viscous_energy[o] = energy_viscous[j]
                    unaccounted = initial_energy[j] + energy_in[j] - energy_viscous[j] - kept
                    most = wp.max(supplied[j], initial_energy[j])
                    if P_DELTA:
                        unaccounted += lifted[j]  # what gravity gave was supplied too
                        most += lifted[j]
                    output.energy_balance_error[o] = balance_error(unaccounted, most)

    return integrate_chain
