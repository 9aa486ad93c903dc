"""Actuators: forces on the degrees of freedom in each stage of a step, and the states of dampers and of lagging forces.

A positive force pushes the upper end of an actuator (the degrees of freedom with positive factors) in the positive
direction. Forces of dampers depend on the state of the stage; the command is constant during a step.
"""

from warpdyn.engine.controllers.rules import DAMPER, MAGNETORHEOLOGICAL

BORROWS = {"control_sampling": ("failure", "failure_time")}
FIELDS = {
    "Load": {
        # [actuator x parameter] of magnetorheological dampers; of a lagging force, the two rates of its equation
        "damper_parameters": "float[]",
        "first_voltage": "float[]",  # [actuator]
    }
}


def wanted(plan):
    return plan.control is not None


def values_held(plan):
    each = 5 + (8 if plan.control.is_magnetorheological else 0) + (6 if plan.control.is_lagging else 0)
    return plan.dofs + each * len(plan.control.actuators)


def names(plan):
    from warpdyn.engine.controllers.device_functions import damper_response, followed_loop

    rules = plan.control
    return {
        "HAS_LOOPS": rules.is_magnetorheological,
        "HAS_LAGS": rules.is_lagging,
        "MOTIONS_OF_STATE": _motions(rules, "u", "v"),
        "MOTIONS_OF_STAGE": _motions(rules, "us", "vs"),
        "ACTUATOR_FORCES": _forces(rules),
        "FLOOR_FORCES": _floor_forces(rules),
        "FOLLOW_LOOPS": _loops(rules),
        "FOLLOW_LAGS": _lags(rules),
        "damper_response": damper_response,
        "followed_loop": followed_loop,
    }


def _in_lanes(lines):
    return "\n    ".join(["for j in range(LANES):", *lines])


def _motions(rules, displacement, velocity):
    lines = []
    for actuator, each in enumerate(rules.actuators):
        for target, of_dofs in (("actuator_drift", displacement), ("actuator_rate", velocity)):
            terms = [f"dtype({factor!r}) * {of_dofs}[{dof}, j]" for dof, factor in each.rows]
            lines.append(f"{target}[{actuator}, j] = {' + '.join(terms)}")
    return _in_lanes(lines)


def _forces(rules):
    from warpdyn.engine.controllers.device_functions import WIDTH

    lines = []
    for a, each in enumerate(rules.actuators):
        if each.kind == MAGNETORHEOLOGICAL:
            arguments = [
                *("loads.damper_parameters", f"{a * WIDTH}", f"actuator_drift[{a}, j]", f"actuator_rate[{a}, j]"),
                *(f"{name}[{a}, j]" for name in ("inner_of_stage", "volts_of_stage", "loop", "loop_drift", "command")),
            ]
            lines += [
                f"response, inner_rate, volts_rate = damper_response({', '.join(arguments)})",
                f"control_force[{a}, j] = response",
                f"inner_sum[{a}, j] += weight[stage] * inner_rate",
                f"volts_sum[{a}, j] += weight[stage] * volts_rate",
                f"inner_of_stage[{a}, j] = inner[{a}, j] + h[j] * reach[stage] * inner_rate",
                f"volts_of_stage[{a}, j] = volts[{a}, j] + h[j] * reach[stage] * volts_rate",
            ]
        elif each.kind == DAMPER:
            lines.append(f"control_force[{a}, j] = dtype(-1.0) * command[{a}, j] * actuator_rate[{a}, j]")
        elif each.order:
            lines += _lagging(a, each.order)
        else:
            lines.append(f"control_force[{a}, j] = command[{a}, j]")
        lines.append(f"work_sum[{a}, j] += weight[stage] * control_force[{a}, j] * actuator_rate[{a}, j]")
    return _in_lanes(lines)


def _lagging(a, order):
    """Return statements for the force f of an actuator that follows the command c.

    First order: f' = (c - f) / T. Second order: f'' = w^2 (c - f) - 2 zeta w f'. The parameters are 1 / T, or w^2 and
    2 zeta w. f and f' are integrated by the stages of the method.
    """
    from warpdyn.engine.controllers.device_functions import WIDTH

    pull = f"loads.damper_parameters[{a * WIDTH}] * (command[{a}, j] - delivered_of_stage[{a}, j])"
    lines = [f"control_force[{a}, j] = delivered_of_stage[{a}, j]"]
    if order == 1:
        slope = pull
    else:
        slope = f"growth_of_stage[{a}, j]"
        drag = f"loads.damper_parameters[{a * WIDTH + 1}] * growth_of_stage[{a}, j]"
        lines.append(f"growth_rate = {pull} - {drag}")
    lines.append(f"delivered_rate = {slope}")
    names = {"delivered": "delivered_rate"} | ({"growth": "growth_rate"} if order == 2 else {})
    for name, rate in names.items():
        lines += [
            f"{name}_sum[{a}, j] += weight[stage] * {rate}",
            f"{name}_of_stage[{a}, j] = {name}[{a}, j] + h[j] * reach[stage] * {rate}",
        ]
    return lines


def _lags(rules):
    lines = []
    for a, each in enumerate(rules.actuators):
        for name in ("delivered", "growth")[: each.order]:
            lines += [
                f"{name}[{a}, j] += h[j] * {name}_sum[{a}, j]",
                f"{name}_of_stage[{a}, j] = {name}[{a}, j]",
                f"{name}_sum[{a}, j] = dtype(0.0)",
            ]
        if each.order:
            lines.append(f"control_force[{a}, j] = delivered[{a}, j]")
    return _in_lanes(lines) if lines else "pass"


def _floor_forces(rules):
    lines, reached = [], set()
    for actuator, each in enumerate(rules.actuators):
        for dof, factor in each.rows:
            sign = "+=" if dof in reached else "="
            lines.append(f"floor_force[{dof}, j] {sign} dtype({factor!r}) * control_force[{actuator}, j]")
            reached.add(dof)
    return _in_lanes(lines)


def _loops(rules):
    from warpdyn.engine.controllers.device_functions import BETA, GAMMA, SLOPE, WIDTH

    lines = []
    for a, each in enumerate(rules.actuators):
        if each.kind != MAGNETORHEOLOGICAL:
            continue
        parameters = ", ".join(f"loads.damper_parameters[{a * WIDTH + place}]" for place in (GAMMA, BETA, SLOPE))
        lines += [
            f"inner[{a}, j] += h[j] * inner_sum[{a}, j]",
            f"volts[{a}, j] += h[j] * volts_sum[{a}, j]",
            f"inner_of_stage[{a}, j] = inner[{a}, j]",
            f"volts_of_stage[{a}, j] = volts[{a}, j]",
            f"inner_sum[{a}, j] = dtype(0.0)",
            f"volts_sum[{a}, j] = dtype(0.0)",
            f"moved = actuator_drift[{a}, j] - inner[{a}, j]",
            f"loop[{a}, j] = followed_loop(loop[{a}, j], moved - loop_drift[{a}, j], {parameters})",
            f"loop_drift[{a}, j] = moved",
        ]
    return _in_lanes(lines) if lines else "pass"


def declare():
    control_force = actuator_rows()  # force on the upper end in this stage
    floor_force = matrix()  # sum of these forces for each degree of freedom
    actuator_drift = actuator_rows()  # displacement between the ends in this stage
    actuator_rate = actuator_rows()
    actuator_work = actuator_rows()
    work_sum = actuator_rows()
    if HAS_LOOPS:
        inner = actuator_rows()  # inner displacement, filtered voltage and evolutionary variable of dampers
        volts = actuator_rows()
        loop = actuator_rows()
        loop_drift = actuator_rows()  # drift minus inner displacement, at the start of the step
        inner_of_stage = actuator_rows()
        volts_of_stage = actuator_rows()
        inner_sum = actuator_rows()
        volts_sum = actuator_rows()
    if HAS_LAGS:
        delivered = actuator_rows()  # force that follows the command, and its rate of change
        growth = actuator_rows()
        delivered_of_stage = actuator_rows()
        growth_of_stage = actuator_rows()
        delivered_sum = actuator_rows()
        growth_sum = actuator_rows()


def start():
    MOTIONS_OF_STATE
    if HAS_LOOPS:
        for q in range(ACTUATORS):
            for j in range(LANES):
                volts[q, j] = loads.first_voltage[q]
                volts_of_stage[q, j] = volts[q, j]
                loop_drift[q, j] = actuator_drift[q, j]


def begin_stage():
    if stage == 0:
        MOTIONS_OF_STATE
    else:
        MOTIONS_OF_STAGE
    ACTUATOR_FORCES
    FLOOR_FORCES


def add_load():
    net += floor_force[i, j]


def add_supply():
    power_in[j] += floor_force[i, j] * vi


def end_step():
    MOTIONS_OF_STATE
    if HAS_LOOPS:
        FOLLOW_LOOPS
    if HAS_LAGS:
        FOLLOW_LAGS
    for q in range(ACTUATORS):
        for j in range(LANES):
            actuator_work[q, j] += h[j] * work_sum[q, j]
            work_sum[q, j] = dtype(0.0)
            if HAS_STROKE_LIMIT:
                if wp.abs(actuator_drift[q, j]) > loads.stroke_limit[q] and failure[j] == 0:
                    failure[j] = 3
                    failure_time[j] = dtype(index + 1) * step[j]
