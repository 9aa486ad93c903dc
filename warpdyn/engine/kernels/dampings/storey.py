"""Linear dashpots in the storeys: stiffness-proportional damping, storey damping, linear viscous dampers."""

order = -10  # before the other viscous parts of a storey

FIELDS = {"Structure": {"storey_damping": "float[,]"}}


def wanted(plan):
    is_damped = plan.damping in ("storey", "rayleigh") or plan.viscous_dampers == "linear"
    return is_damped and plan.kind != "exact"


def values_held(plan):
    return plan.dofs


def declare():
    damping = matrix()


def read_storey():
    damping[i, j] = structures.storey_damping[g, s]
    if IMPLICIT_CHAIN:
        solved_damping[i, j] = of_damping * damping[i, j]


def add_to_dashpot():
    dashpot = damping[i, j] * rate


def add_to_foot():
    f += damping[0, j] * rate
