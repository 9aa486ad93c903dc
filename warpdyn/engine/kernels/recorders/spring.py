"""The largest deformation and force of every spring of a lumped structure.

The deformation of a hinge of a frame counts until its strength is lost, because the member then turns freely.
"""

from warpdyn.foundations.core.output_variables import Variable

order = 0
BORROWS = {"hinge_failure": ("is_sound",)}
VARIABLES = {
    "lumped": {
        "peak_spring_deformation": Variable(("spring",), "m", "peak absolute deformation of the spring"),
        "peak_spring_force": Variable(("spring",), "N", "peak absolute force of the spring's law"),
    },
}


def wanted(plan):
    return "spring" in plan.recorders


def values_held(plan):
    return 2 * plan.pattern.springs


def declare():
    peak_deformation = spring_rows()
    peak_force = spring_rows()


def see_spring():
    size = wp.abs(drift)
    size_of_force = wp.abs(restoring)
    if SPRING_COLLAPSE:
        size = size * stands[j]
        size_of_force = size_of_force * stands[j]
    if HINGE_FAILURE:
        size = size * is_sound[i, j]
    peak_deformation[i, j] = larger(peak_deformation[i, j], size)
    peak_force[i, j] = larger(peak_force[i, j], size_of_force)


def restart_recorders():
    for i in range(ROWS):
        peak_deformation[i, j] = dtype(0.0)
        peak_force[i, j] = dtype(0.0)


def finish_spring_row():
    output.peak_spring_deformation[number_of_spring, o] = peak_deformation[i, j]
    output.peak_spring_force[number_of_spring, o] = peak_force[i, j]
