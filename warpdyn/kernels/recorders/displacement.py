"""The largest displacement of every degree of freedom, and when it was reached."""

from warpdyn.core.output_variables import Variable

order = 0
VARIABLES = {
    "dense": {
        "peak_displacement": Variable(("dof",), "m", "peak absolute displacement relative to the base"),
        "time_of_peak_displacement": Variable(("dof",), "s", "time of the peak displacement", is_demand=False),
    },
}


def wanted(plan):
    return "displacement" in plan.recorders


def values_held(plan):
    return 2 * plan.dofs
