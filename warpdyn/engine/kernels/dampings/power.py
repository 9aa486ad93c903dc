"""Nonlinear viscous dampers in the storeys, whose force is proportional to a power of the storey's drift velocity."""

from warpdyn.engine.laws.devices.viscous_damper import VALUES, damper_force, damper_tangent

order = 10

FIELDS = {"Structure": {"viscous_damper": "float[,]"}}  # [storey x value, structure]


def wanted(plan):
    return plan.viscous_dampers == "power"


def values_held(plan):
    return VALUES * plan.dofs


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    storeys = plan.storeys_of_thread
    return {"dampers": wp.types.matrix(shape=(storeys * VALUES, plan.lanes), dtype=DTYPES[plan.dtype])}


def declare():
    power_damper = dampers()


def read_storey():
    for q in range(VALUES):
        power_damper[i * VALUES + q, j] = structures.viscous_damper[g * VALUES + q, s]


def add_to_dashpot():
    of_velocity_power = damper_force(
        rate,
        power_damper[i * VALUES, j],
        power_damper[i * VALUES + 1, j],
        power_damper[i * VALUES + 2, j],
    )
    dashpot += of_velocity_power


def add_to_storey():
    of_velocity_power = damper_tangent(
        rate,
        power_damper[i * VALUES, j],
        power_damper[i * VALUES + 1, j],
        power_damper[i * VALUES + 2, j],
    )
    storey += force_share * gamma * theta * h[j] * of_velocity_power


def add_to_foot():
    f += damper_force(rate, power_damper[0, j], power_damper[1, j], power_damper[2, j])
