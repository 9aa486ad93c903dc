"""Dashpots in the storeys: damping in proportion to stiffness, storey dashpots, linear viscous dampers."""

order = -10  # the first of what is viscous in a storey


def wanted(plan):
    return plan.damping in ("storey", "rayleigh") or plan.viscous_dampers == "linear"


def declare():
    damping = matrix()


def read_storey():
    damping[i, j] = structures.storey_damping[g, s]


def add_to_dashpot():
    dashpot = damping[i, j] * rate


def add_to_foot():
    f += damping[0, j] * rate
