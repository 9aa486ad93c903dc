"""Recorder of the largest displacement of every degree of freedom, and its time."""

from warpdyn.foundations.core.output_variables import Variable

order = 0
OF_DOFS = {
    "peak_displacement": Variable(("dof",), "m", "peak absolute displacement relative to the base"),
    "time_of_peak_displacement": Variable(("dof",), "s", "time of the peak displacement", is_demand=False),
}
VARIABLES = {"dense": OF_DOFS, "lumped": OF_DOFS}

BORROWS = {"adaptivity": ("done",)}


def wanted(plan):
    return "displacement" in plan.recorders


def values_held(plan):
    return 2 * plan.dofs


def declare():
    peak_displacement = matrix()
    time_of_peak = matrix()


def start_row():
    peak_displacement[i, j] = wp.abs(u[i, j])


def see_drift():
    size = wp.abs(drift)
    if size > peak_displacement[i, j]:
        peak_displacement[i, j] = size
        time_of_peak[i, j] = dtype(index) * step[j]


def end_attempt():
    if not EXPLICIT_LUMPED:
        for i in range(N):
            for j in range(LANES):
                size = wp.abs(u[i, j])
                if size > peak_displacement[i, j]:
                    peak_displacement[i, j] = size
                    time_of_peak[i, j] = dtype(index + 1) * step[j]
                    if ADAPTIVITY:
                        time_of_peak[i, j] = (dtype(index) + done[j]) * step[j]


def see_state():
    if EXPLICIT_LUMPED:
        for i in range(N):
            for j in range(LANES):
                size = wp.abs(u[i, j])
                if SPRING_COLLAPSE:
                    size = size * stands[j]
                if size > peak_displacement[i, j]:
                    peak_displacement[i, j] = size
                    time_of_peak[i, j] = dtype(index) * step[j]


def restart_recorders():
    for i in range(N):
        peak_displacement[i, j] = dtype(0.0)
        if not PROPAGATED:  # these kernels record the state at the end of a step
            peak_displacement[i, j] = wp.abs(u[i, j])
        time_of_peak[i, j] = dtype(index) * step[j]


def finish_storey():
    output.peak_displacement[g, o] = peak_displacement[i, j]
    output.time_of_peak_displacement[g, o] = time_of_peak[i, j]
