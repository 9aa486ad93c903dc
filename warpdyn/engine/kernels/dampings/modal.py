"""Modal damping of a chain: each mode has a damping ratio, so that the damping matrix couples all floors."""

FIELDS = {"Structure": {"damping_matrix": "float[,]"}}  # [floor x floor, structure]


def wanted(plan):
    return plan.damping == "modal"


def values_held(plan):
    return plan.dofs**2


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    return {"square": wp.types.matrix(shape=(plan.dofs**2, plan.lanes), dtype=DTYPES[plan.dtype])}


def declare():
    damping_matrix = square()
    damping_force = matrix()


def read_sample():
    for i in range(N * N):
        damping_matrix[i, j] = structures.damping_matrix[i, s]


def read_storey():
    if IMPLICIT_CHAIN:
        # The matrix contains only the middle three diagonals; iteration accounts for the rest. It converges for any
        # chain: M^-1/2 K M^-1/2 is an M-matrix, so is its root (Alefeld and Schneider 1982, Linear Algebra
        # Appl. 42), and entries left out of one make a regular splitting (Varga 2000, 3.29).
        solved_mass[i, j] += of_damping * damping_matrix[i * N + i, j]
        if i > 0:
            solved_mass[i, j] += of_damping * damping_matrix[i * N + i - 1, j]
            solved_damping[i, j] -= of_damping * damping_matrix[i * N + i - 1, j]
        if i < N - 1:
            solved_mass[i, j] += of_damping * damping_matrix[i * N + i + 1, j]


def begin_stage():
    slot("damp_modes")


def damp_modes():
    for i in range(N):
        for j in range(LANES):
            damping_force[i, j] = dtype(0.0)
        for k in range(N):
            for j in range(LANES):
                vk = vs[k, j]
                if EXPLICIT_CHAIN and not KEEPS_SLOPES:
                    if stage == 0:
                        vk = v[k, j]
                damping_force[i, j] += damping_matrix[i * N + k, j] * vk


def add_to_net():
    net -= damping_force[i, j]


def add_loss():
    power_viscous[j] += damping_force[i, j] * vi


def add_loss_at_state():
    energy_viscous[j] += weight * damping_force[i, j] * vi
