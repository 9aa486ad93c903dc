"""Mass-proportional damping: dashpots between the floors and the ground."""

MASS_DAMPED = ("rayleigh", "rayleigh_tangent", "mass_proportional")

FIELDS = {"Structure": {"mass_damping": "float[]"}}  # Rayleigh's factor of the mass


def wanted(plan):
    return plan.damping in MASS_DAMPED


def values_held(plan):
    return 1


def declare():
    mass_damping = row()


def read_sample():
    mass_damping[j] = structures.mass_damping[s]


def read_storey():
    if IMPLICIT_CHAIN:
        solved_mass[i, j] += of_damping * mass_damping[j] * mass[i, j]


def add_to_net():
    if IMPLICIT_CHAIN:
        net -= mass_damping[j] * mass[i, j] * vs[i, j]


def add_to_acceleration():
    if not KEEPS_DRIFTS or HAS_SEE_FORCES:  # in other cases only recorders need the mass term
        ai -= mass_damping[j] * vi


def add_loss():
    if LAGS:  # the velocity, and so the damping force, is that of half a step earlier
        power_viscous[j] += momentum_of_floor * (mass_damping[j] * vs[i, j])
    else:
        power_viscous[j] += momentum_of_floor * (mass_damping[j] * vi)


def add_loss_at_state():
    energy_viscous[j] += weight * mass_damping[j] * mass[i, j] * vi * vi
