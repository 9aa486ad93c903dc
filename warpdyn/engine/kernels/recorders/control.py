"""Outputs of controlled structures: peak forces and strokes of actuators, work, and whether the control failed."""

from warpdyn.foundations.core.output_variables import Variable

order = 70
OF_ACTUATORS = {
    "peak_control_force": Variable(("actuator",), "N", "peak absolute force of the actuator"),
    "peak_actuator_stroke": Variable(("actuator",), "m", "peak absolute displacement between the actuator's ends"),
    "actuator_work": Variable(
        ("actuator",), "J", "work that the actuator did on the structure; negative if it dissipates", is_demand=False
    ),
    "limited_share": Variable(
        (), "1", "share of the sampling instants at which a command was beyond its limits", is_demand=False
    ),
    "control_failure": Variable(
        (),
        "1",
        "0 none; 1 command that is not finite; 2 command beyond its limits; 3 stroke beyond its limit",
        is_demand=False,
        is_whole=True,
    ),
    "time_of_control_failure": Variable((), "s", "time at which the control failed", is_demand=False),
}
#: Histories of actuators, by the names of the fields of the struct History.
OF_CONTROL = {
    "control_force": Variable(("actuator",), "N", "force of the actuator on its upper end"),
    "actuator_stroke": Variable(("actuator",), "m", "displacement between the actuator's ends"),
    "actuator_command": Variable(("actuator",), "1", "command of the actuator, in its unit"),
}
FIELDS = {
    "History": {name: "float[,,]" for name in OF_CONTROL},
    "Output": {
        "peak_control_force": "float[,]",
        "peak_actuator_stroke": "float[,]",
        "actuator_work": "float[,]",
        "limited_share": "float[]",
        "control_failure": "int32[]",
        "time_of_control_failure": "float[]",
    },
}
BORROWS = {
    "history": ("every",),
    "control_actuators": ("control_force", "actuator_drift", "actuator_work"),
    "control_sampling": ("command", "failure", "failure_time", "samplings", "limited_samplings"),
}


def wanted(plan):
    return plan.control is not None


def values_held(plan):
    return 2 * len(plan.control.actuators)


def names(plan):
    from warpdyn.engine.kernels.functions.recording import keep_actuator

    return {"keep_actuator": keep_actuator, "KEEPS_HISTORY": "history" in plan.recorders}


def declare():
    peak_control_force = actuator_rows()
    peak_stroke = actuator_rows()


def see_state():
    for q in range(ACTUATORS):
        for j in range(LANES):
            if KEEPS_HISTORY:
                keep_actuator(
                    history,
                    samples.order[sample[j]],
                    index,
                    every,
                    q,
                    control_force[q, j],
                    actuator_drift[q, j],
                    command[q, j],
                )
            else:
                size = wp.abs(control_force[q, j])
                stroke = wp.abs(actuator_drift[q, j])
                if COLLAPSE or SPRING_COLLAPSE:
                    size = size * stands[j]
                    stroke = stroke * stands[j]
                peak_control_force[q, j] = larger(peak_control_force[q, j], size)
                peak_stroke[q, j] = larger(peak_stroke[q, j], stroke)


def restart_recorders():
    for q in range(ACTUATORS):
        peak_control_force[q, j] = dtype(0.0)
        peak_stroke[q, j] = dtype(0.0)


def write():
    if not KEEPS_HISTORY:
        for q in range(ACTUATORS):
            output.peak_control_force[q, o] = peak_control_force[q, j]
            output.peak_actuator_stroke[q, o] = peak_stroke[q, j]
            output.actuator_work[q, o] = actuator_work[q, j]
        output.limited_share[o] = limited_samplings[j] / wp.max(samplings[j], dtype(1.0))
        output.control_failure[o] = failure[j]
        output.time_of_control_failure[o] = failure_time[j]
