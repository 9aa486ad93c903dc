"""The search for the state at the end of an implicit step, if one solution of the linear system is not sufficient.

Newton's method is used if storeys yield or dashpots are nonlinear. The matrix of modal damping is full, but the linear
system contains only its three middle diagonals; iteration accounts for its other entries.
"""

from warpdyn.engine.laws.springs import spring_row
from warpdyn.engine.methods.table import METHODS

# The search ends if the unbalanced force, relative to the largest force of the sample so far, is at most this value. It
# also ends if the unbalanced force no longer decreases and is at most ROUNDINGS times stiffness times displacement: the
# rounding of this product limits it (float32, tall buildings).
TOLERANCE = {"float32": 1e-6, "float64": 1e-12}
ROUNDINGS = {"float32": 4e-6, "float64": 1e-14}

BORROWS = {"elimination": ("eliminated", "inverse_pivot")}


def is_newton(plan):
    has_tangent = METHODS[plan.method].beta > 0 and spring_row(plan.law).memory_after is not None
    return has_tangent or plan.viscous_dampers == "power"


def wanted(plan):
    is_implicit = plan.family == "chain" and plan.kind == "implicit"
    return is_implicit and (is_newton(plan) or plan.damping == "modal")


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    dtype = DTYPES[plan.dtype]
    return {
        "tolerance": wp.constant(dtype(TOLERANCE[plan.dtype])),
        "roundings": wp.constant(dtype(ROUNDINGS[plan.dtype])),
    }


def declare():
    initial_stiffness = matrix()
    correction = matrix()
    unbalanced = row()
    unbalanced_last = row()
    force_size = row()  # sum of the forces of this iteration; then stiffness times displacement; largest force so far
    rounded = row()
    largest_force = row()
    slope = row()  # of the residual along the correction: at its start, at its end, and at the next one's start
    slope_end = row()
    slope_next = row()
    mode = indices()  # state of a lane's search: 0 finished, 1 continues, 2 halves the last correction
    failed = indices()


def start_storey():
    slot("storey_coefficients")
    initial_stiffness[i, j] = tangent_of(dtype(0.0), dtype(0.0), memory_vector(), memory_vector(), c)


def begin_search():
    mode[j] = wp.where(h[j] > dtype(0.0), 1, 0)


def begin_walk():
    unbalanced_last[j] = unbalanced[j]
    unbalanced[j] = dtype(0.0)
    force_size[j] = dtype(0.0)
    rounded[j] = dtype(0.0)
    slope_end[j] = dtype(0.0)
    slope_next[j] = dtype(0.0)


def add_to_imbalance():
    unbalanced[j] += wp.abs(residual)
    force_size[j] += wp.abs(f) + mass[i, j] * wp.abs(inertia)
    if SOLVES_DRIFT:
        part = beta * (theta * h[j]) * (theta * h[j]) * rise[i, j]
        rounded[j] += initial_stiffness[i, j] * (wp.abs(us[i, j]) + wp.abs(part))


def follow_slope():
    if NEWTON:
        slope_end[j] += residual * correction[i, j]
        slope_next[j] += eliminated[i, j] * eliminated[i, j] * inverse_pivot[i, j]


def judge_walk():
    for j in range(LANES):
        if mode[j] > 0:
            mode[j] = 1
            if unbalanced[j] <= tolerance * wp.max(largest_force[j], force_size[j]):
                mode[j] = 0
                largest_force[j] = wp.max(largest_force[j], force_size[j])
            elif walk == 1:
                # A state that is not finite ends the search.
                if not wp.isfinite(unbalanced[j]):
                    mode[j] = 0
            elif (
                unbalanced[j] <= roundings * (force_size[j] + rounded[j])
                and unbalanced[j] > dtype(0.5) * unbalanced_last[j]
            ):
                mode[j] = 0
            elif NEWTON:
                # A step minimises a convex function; `slope` is its slope along the correction.
                # A correction beyond the minimum, as between the two sides of a yield point,
                # is halved (Matthies and Strang 1979, IJNME 14).
                if not (slope_end[j] >= -dtype(0.5) * slope[j]):
                    mode[j] = 2
            slope[j] = wp.where(mode[j] == 2, dtype(0.5) * slope[j], slope_next[j])
        waiting = wp.max(waiting, mode[j])


def choose_change():
    if mode[j] == 1:
        change = found
    if NEWTON:
        if mode[j] == 2:
            change = -dtype(0.5) * correction[i, j]
        correction[i, j] = wp.where(mode[j] == 2, -change, change)


def end_search():
    if mode[j] > 0:
        failed[j] = 1


def judge_state():
    if failed[j] > 0:
        status = not_converged
