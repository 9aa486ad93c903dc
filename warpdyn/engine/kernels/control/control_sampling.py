"""Sensors and controller: at each sampling instant the kernel measures the state and computes a command per actuator.

A command is held until the next sampling instant. With a delay of d intervals, the command of a sampling instant acts
d instants later; until then commands are 0. The first command belongs to the start of the run.
"""

from warpdyn.engine.controllers.rules import OF_DOFS

order = 1

BORROWS = {"base": ("a0", "da"), "control_actuators": ("control_force",)}
FIELDS = {
    "Control": {"key": "uint64"},
    "Samples": {"number": "uint64[]", "steps_of_sampling": "int32[]"},  # integration steps in a sampling interval
    "Load": {
        "command_low": "float[]",  # [actuator], as the next two
        "command_high": "float[]",
        "stroke_limit": "float[]",
        "sensor_noise": "float[]",  # standard deviations [sensor value]
        "sensor_resolution": "float[]",  # [sensor value]; 0: not rounded
        "regulator_gain": "float[]",  # [actuator x sensor value]
        "estimate_gain": "float[]",  # [actuator x state], as the gain of the observer's states
        "estimate_growth": "float[]",  # [state x state]
        "estimate_correction": "float[]",  # [state x sensor value]
        "estimate_input": "float[]",  # [state x actuator]
        "controller_coefficients": "float[]",
    },
}


def wanted(plan):
    return plan.control is not None


def values_held(plan):
    rules = plan.control
    per_actuator = 3 + rules.memory + rules.delay
    return plan.dofs + per_actuator * len(rules.actuators) + 2 * rules.states


def names(plan):
    import warp as wp

    from warpdyn.engine.device.random_numbers import normal_pair
    from warpdyn.engine.kernels.functions.controllers import command_function, measured_function
    from warpdyn.engine.kernels.loads import LOADS
    from warpdyn.engine.kernels.plan import DTYPES
    from warpdyn.foundations.core.output_variables import CONTROL_FAILED
    from warpdyn.foundations.core.random_numbers import Purpose

    rules, dtype = plan.control, DTYPES[plan.dtype]
    count, of_dofs = len(rules.actuators), rules.sensors * plan.dofs
    size = of_dofs + count
    coefficients = 0 if rules.written is None else len(rules.written.coefficients)

    def rows(number):
        return wp.types.matrix(shape=(max(1, number), plan.lanes), dtype=dtype)

    def vector(number):
        return wp.types.vector(length=max(1, number), dtype=dtype)

    return {
        "ACTUATORS": count,
        "SENSED": size,
        "OF_DOFS": of_dofs,
        "SENSES_ACCELERATION": rules.sensors == len(OF_DOFS),
        "SENSES_GROUND": rules.senses_ground and LOADS[plan.load].is_base,
        "HAS_SENSOR_NOISE": rules.is_noisy,
        "NOISE_PAIRS": (size + 1) // 2,
        "NOISE_PURPOSE": int(Purpose.SENSOR_NOISE),
        "HAS_RESOLUTION": rules.is_rounded,
        "HAS_REGULATOR": rules.has_regulator,
        "ESTIMATES": rules.states,
        "HAS_CONTROLLER": rules.written is not None,
        "CONTROLLER_MEMORY": rules.memory,
        "CONTROLLER_COEFFICIENTS": coefficients,
        "DELAY": rules.delay,
        "FAILS_AT_LIMITS": rules.fails_at_limits,
        "HAS_STROKE_LIMIT": rules.is_limited,
        "actuator_rows": rows(count),
        "delay_rows": rows(count * rules.delay),
        "estimate_rows": rows(rules.states),
        "controller_memory_rows": rows(count * rules.memory),
        "sensor_vector": vector(size),
        "actuator_vector": vector(count),
        "controller_memory_vector": vector(rules.memory),
        "controller_vector": vector(coefficients),
        "measured_of": measured_function(plan.dofs, rules.sensors, count, plan.dtype),
        "normal_pair": normal_pair,
        "control_failed": wp.int8(CONTROL_FAILED),
        "not_known": wp.constant(dtype(float("nan"))),
        "SENSED_MOTIONS": _sensed_motions(rules, plan.dofs),
        **({} if rules.written is None else {"command_of": command_function(rules.written)}),
    }


def _sensed_motions(rules, dofs):
    """Return statements that set the measured drifts and rates of the actuators, and the velocities of upper ends.

    An upper end consists of the degrees of freedom with positive factors; without any, it is the base.
    """
    lines = []
    for actuator, each in enumerate(rules.actuators):
        upper = [(dof, factor) for dof, factor in each.rows if factor > 0]
        for target, first, rows in (
            ("sensed_drift", 0, each.rows),
            ("sensed_rate", dofs, each.rows),
            ("upper_rate", dofs, upper),
        ):
            terms = [f"dtype({factor!r}) * sensed[{first + dof}]" for dof, factor in rows] or ["dtype(0.0)"]
            lines.append(f"{target}[{actuator}] = {' + '.join(terms)}")
    return "\n".join(lines)


def declare():
    command = actuator_rows()  # the commands that act
    commanded = actuator_rows()  # the commands of this sampling instant
    queued = delay_rows()  # commands that do not act yet
    controller_memory = controller_memory_rows()
    estimate = estimate_rows()  # states of the observer
    next_estimate = estimate_rows()
    sensed_acceleration = matrix()  # absolute accelerations at the end of the last step
    ground_velocity = row()
    steps_of_sampling = indices()
    failure = indices()  # 0, or the reason why the control failed
    failure_time = row()
    samplings = row()
    limited_samplings = row()


def read_sample():
    steps_of_sampling[j] = samples.steps_of_sampling[samples.order[sample[j]]]
    failure_time[j] = not_known


def begin_step():
    for j in range(LANES):
        if index % steps_of_sampling[j] == 0 and h[j] > dtype(0.0):
            sampling = index // steps_of_sampling[j]
            sensed = sensor_vector()
            for k in range(N):
                sensed[k] = u[k, j]
                sensed[N + k] = v[k, j]
                if SENSES_ACCELERATION:
                    sensed[2 * N + k] = sensed_acceleration[k, j]
            for q in range(ACTUATORS):
                sensed[OF_DOFS + q] = control_force[q, j]
            if HAS_SENSOR_NOISE:
                for k in range(NOISE_PAIRS):
                    drawn = normal_pair(
                        control.key,
                        samples.number[samples.order[sample[j]]],
                        NOISE_PURPOSE,
                        wp.uint32(sampling * NOISE_PAIRS + k),
                    )
                    sensed[2 * k] += loads.sensor_noise[2 * k] * dtype(drawn[0])
                    if 2 * k + 1 < SENSED:
                        sensed[2 * k + 1] += loads.sensor_noise[2 * k + 1] * dtype(drawn[1])
            if HAS_RESOLUTION:
                for k in range(SENSED):
                    unit = loads.sensor_resolution[k]
                    if unit > dtype(0.0):
                        sensed[k] = unit * wp.floor(sensed[k] / unit + dtype(0.5))
            sensed_drift = actuator_vector()
            sensed_rate = actuator_vector()
            upper_rate = actuator_vector()
            SENSED_MOTIONS
            is_limited = dtype(0.0)
            for q in range(ACTUATORS):
                desired = dtype(0.0)
                if HAS_REGULATOR:
                    for k in range(OF_DOFS):
                        desired -= loads.regulator_gain[q * OF_DOFS + k] * sensed[k]
                    for k in range(ESTIMATES):
                        desired -= loads.estimate_gain[q * ESTIMATES + k] * estimate[k, j]
                asked = desired
                if HAS_CONTROLLER:
                    measured = measured_of(
                        dtype(index) * step[j],
                        desired,
                        sensed_drift[q],
                        sensed_rate[q],
                        upper_rate[q],
                        ground_velocity[j],
                        q,
                        sensed,
                    )
                    held = controller_memory_vector()
                    for k in range(CONTROLLER_MEMORY):
                        held[k] = controller_memory[q * CONTROLLER_MEMORY + k, j]
                    constants = controller_vector()
                    for k in range(CONTROLLER_COEFFICIENTS):
                        constants[k] = loads.controller_coefficients[k]
                    if CONTROLLER_MEMORY > 0:
                        asked, held = command_of(measured, held, constants)
                        for k in range(CONTROLLER_MEMORY):
                            controller_memory[q * CONTROLLER_MEMORY + k, j] = held[k]
                    else:
                        asked = command_of(measured, held, constants)
                if not wp.isfinite(asked):
                    asked = dtype(0.0)
                    if failure[j] == 0:
                        failure[j] = 1
                        failure_time[j] = dtype(index) * step[j]
                inside = wp.clamp(asked, loads.command_low[q], loads.command_high[q])
                if inside != asked:
                    is_limited = dtype(1.0)
                    if FAILS_AT_LIMITS and failure[j] == 0:
                        failure[j] = 2
                        failure_time[j] = dtype(index) * step[j]
                commanded[q, j] = inside
                if failure[j] > 0:
                    commanded[q, j] = dtype(0.0)
                if DELAY > 0:
                    place = q * DELAY + sampling % DELAY
                    command[q, j] = queued[place, j]
                    queued[place, j] = commanded[q, j]
                else:
                    command[q, j] = commanded[q, j]
                if failure[j] > 0:
                    command[q, j] = dtype(0.0)
            samplings[j] += dtype(1.0)
            limited_samplings[j] += is_limited
            if ESTIMATES > 0:
                for k in range(ESTIMATES):
                    next_estimate[k, j] = dtype(0.0)
                    for q in range(ESTIMATES):
                        next_estimate[k, j] += loads.estimate_growth[k * ESTIMATES + q] * estimate[q, j]
                    for q in range(OF_DOFS):
                        next_estimate[k, j] += loads.estimate_correction[k * OF_DOFS + q] * sensed[q]
                    for q in range(ACTUATORS):
                        next_estimate[k, j] += loads.estimate_input[k * ACTUATORS + q] * command[q, j]
                for k in range(ESTIMATES):
                    estimate[k, j] = next_estimate[k, j]


def add_base():
    if SENSES_ACCELERATION and EXPLICIT_CHAIN:
        sensed_acceleration[i, j] = ai


def add_to_acceleration():
    if SENSES_ACCELERATION and EXPLICIT_LUMPED:
        sensed_acceleration[i, j] = ai


def end_step():
    if SENSES_GROUND:
        for j in range(LANES):
            if EXPLICIT_CHAIN:
                ground_velocity[j] += h[j] * (a0[j] + (dtype(substep) + dtype(0.5)) * da[j])
            else:
                ground_velocity[j] += h[j] * (a0[j] + (dtype(substep) + dtype(0.5)) * inverse_substeps * da[j])


def judge_step():
    if failure[j] > 0 and status == ok:
        status = control_failed
