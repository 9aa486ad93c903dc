"""Recorder of floor spectra: the peak responses of oscillators that the acceleration of each floor drives.

The displacement of an oscillator is stored as `oscillation` = omega^2 u, and its velocity as `oscillation_rate` = h
omega^2 v, with the step h. Both have the units of an acceleration, so that their increments are exact to rounding in
float32, too. The arrays in Output have the indices [period, floor, sample], because the first index of the dataset is
the last index in the kernel.
"""

from warpdyn.foundations.core.output_variables import Variable

order = 25
OF_DOFS = {"peak_spectral_acceleration": Variable(("dof", "period"), "m s-2", "peak response of an oscillator")}
VARIABLES = {
    "chain": {
        "peak_floor_spectral_acceleration": Variable(
            ("floor", "period"), "m s-2", "peak response of an oscillator on the floor"
        )
    },
    "lumped": OF_DOFS,
    "dense": OF_DOFS,
}
FIELDS = {
    "Load": {
        "oscillator_frequency": "float64[]",  # undamped circular frequency [rad/s], [period]
        "oscillator_damping": "float64[]",  # damping ratio of all oscillators [1], [1]
    }
}


def wanted(plan):
    return "floor_spectra" in plan.recorders


def values_held(plan):
    states = 4 if plan.collapses and plan.kind == "exact" else 3
    return (2 + states * plan.oscillators) * plan.dofs + 7 * plan.oscillators


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.functions.oscillators import largest_between, oscillator_factors
    from warpdyn.engine.kernels.plan import DTYPES

    count, dtype = plan.oscillators, DTYPES[plan.dtype]
    return {
        "PERIODS": count,
        "OSCILLATORS": count * plan.storeys_of_thread,
        "OF_ABSOLUTE": plan.oscillators_are_absolute,
        "oscillators": wp.types.matrix(shape=(count * plan.storeys_of_thread, plan.lanes), dtype=dtype),
        "periods": wp.types.matrix(shape=(count, plan.lanes), dtype=dtype),
        "oscillator_factors": oscillator_factors,
        "largest_between": largest_between,
    }


def declare():
    floor_before = matrix()  # acceleration of the floor in the last state
    floor_now = matrix()
    floor_next = matrix()  # differs from floor_now where the last force of a history ends
    oscillation = oscillators()
    oscillation_rate = oscillators()
    peak_oscillation = oscillators()
    if PROPAGATED and COLLAPSE:
        earlier_oscillation = (
            oscillators()
        )  # value of the previous step; it counts if the building has not collapsed in this one
    of_rate = periods()  # factors of the step, see `oscillator_factors`
    displacement_factor = periods()
    of_change = periods()
    of_force = periods()
    of_damper = periods()
    squared = periods()
    damper = periods()  # damping force / rate
    oscillation_counts = row()  # 1, or 0 once the building has collapsed
    oscillation_moves = row()  # 1, or 0 in the first state and once the run of the lane has ended
    oscillation_restarts = row()  # 1 in the first state of `record_from`, which has no peak before it


def start():
    for p in range(PERIODS):
        for j in range(LANES):
            g0, wg1, wg2, wg0, dg0, w = oscillator_factors(
                loads.oscillator_frequency[p], loads.oscillator_damping[0], wp.float64(step[j])
            )
            of_rate[p, j] = dtype(g0)
            displacement_factor[p, j] = dtype(wg1)
            of_change[p, j] = dtype(wg2)
            of_force[p, j] = dtype(wg0)
            of_damper[p, j] = dtype(dg0)
            squared[p, j] = dtype(w)
            damper[p, j] = dtype(wp.float64(2.0) * loads.oscillator_damping[0] / wp.sqrt(w))


def see_forces():
    floor_now[i, j] = ai
    floor_next[i, j] = ai
    if HAS_BEFORE_FORCE_ENDS:
        slot("before_force_ends")
        floor_now[i, j] = before_end
    if COLLAPSE or SPRING_COLLAPSE:
        oscillation_counts[j] = stands[j]
    else:
        oscillation_counts[j] = dtype(1.0)


def restart_recorders():
    oscillation_restarts[j] = dtype(1.0)


def end_step():
    for j in range(LANES):
        last_index = live_intervals[j] * substeps
        oscillation_moves[j] = wp.where(index > 0 and index <= last_index, dtype(1.0), dtype(0.0))
    oscillator_count = int(OSCILLATORS)  # a variable, so that the loop over the oscillators is not unrolled
    for number in range(oscillator_count):
        floor = number / PERIODS
        period = number - floor * PERIODS
        for j in range(LANES):
            oscillator = oscillation[number, j]
            oscillator_rate = oscillation_rate[number, j]
            floor_start = floor_before[floor, j]
            rise_of_floor = floor_now[floor, j] - floor_start
            pull = oscillator + floor_start
            displacement_rise = (
                of_rate[period, j] * oscillator_rate
                - displacement_factor[period, j] * pull
                - of_change[period, j] * rise_of_floor
            )
            rate_rise = (
                dtype(-1.0) * (displacement_factor[period, j] + of_damper[period, j]) * oscillator_rate
                - of_force[period, j] * pull
                - displacement_factor[period, j] * rise_of_floor
            )
            displacement_rise = displacement_rise * oscillation_moves[j]
            rate_rise = rate_rise * oscillation_moves[j]
            oscillator_end = oscillator + displacement_rise
            oscillator_rate_end = oscillator_rate + rate_rise
            oscillation[number, j] = oscillator_end
            oscillation_rate[number, j] = oscillator_rate_end
            if OF_ABSOLUTE:
                # The sum of the forces of spring and damper, and its rate.
                damping_share = damper[period, j]
                force_rate = oscillator_rate - damping_share * squared[period, j] * (
                    pull + damping_share * oscillator_rate
                )
                force_rate_end = oscillator_rate_end - damping_share * squared[period, j] * (
                    oscillator_end + floor_now[floor, j] + damping_share * oscillator_rate_end
                )
                oscillator = oscillator + damping_share * oscillator_rate
                oscillator_end = oscillator_end + damping_share * oscillator_rate_end
                oscillator_peak = largest_between(oscillator, oscillator_end, force_rate, force_rate_end)
            else:
                oscillator_peak = largest_between(oscillator, oscillator_end, oscillator_rate, oscillator_rate_end)
            if RECORDING_START:
                oscillator_peak = wp.where(
                    oscillation_restarts[j] > dtype(0.0), wp.abs(oscillator_end), oscillator_peak
                )
            oscillator_peak = oscillator_peak * oscillation_moves[j]
            if PROPAGATED and COLLAPSE:
                present_peak = oscillator_peak
                oscillator_peak = earlier_oscillation[number, j]
                earlier_oscillation[number, j] = present_peak
            oscillator_peak = oscillator_peak * oscillation_counts[j]
            peak_before = peak_oscillation[number, j]
            if RECORDING_START:
                peak_before = wp.where(oscillation_restarts[j] > dtype(0.0), dtype(0.0), peak_before)
            peak_oscillation[number, j] = larger(peak_before, oscillator_peak)
    for i in range(N):
        for j in range(LANES):
            floor_before[i, j] = floor_next[i, j]
    if RECORDING_START:
        for j in range(LANES):
            oscillation_restarts[j] = dtype(0.0)


def finish_storey():
    for p in range(PERIODS):
        r = i * PERIODS + p
        if PROPAGATED and COLLAPSE:
            peak_oscillation[r, j] = larger(peak_oscillation[r, j], earlier_oscillation[r, j] * stands[j])
        if IS_CHAIN:
            output.peak_floor_spectral_acceleration[p, g, o] = peak_oscillation[r, j]
        else:
            output.peak_spectral_acceleration[p, g, o] = peak_oscillation[r, j]
