"""The time loop of kernels for linear systems with full mass, damping and stiffness matrices and explicit methods.

The host multiplies the equation of motion by M^-1: u'' = M^-1 p - (M^-1 K) u - (M^-1 C) u'. p contains the nodal forces
of the load. The variable `net`, which is a force in kernels of shear chains, is therefore an acceleration in this
kernel.

The function in this module that contains the time loop is a skeleton: `compose` replaces each of its `slot(...)`
statements by the statements of the chosen parts of the kernel, such as the method, the load and the recorders.
"""

from __future__ import annotations

from warpdyn.engine.device.processor import align_rows
from warpdyn.engine.kernels.plan import Plan, tableau

FIELDS = {
    "Structure": {
        # The matrices of the nominal system, [dof, dof]; each structure scales them.
        "mass_matrix": "float[,]",
        "rate_of_displacement": "float[,]",  # M^-1 K
        "rate_of_velocity": "float[,]",  # M^-1 C
        "flexibility_of_mass": "float[,]",  # M^-1
        "mass_factor": "float[]",  # [structure]
        "damping_factor": "float[]",
        "stiffness_factor": "float[]",
    },
}


def names(plan: Plan) -> dict[str, object]:
    """Return the objects to which names in the text of the time loop refer: {name: constant, type or function}."""
    import warp as wp

    from warpdyn.engine.kernels.plan import DTYPES

    method = tableau(plan)
    return {
        "STAGES": method.stages,
        "weight": method.weight,
        "node": method.node,
        "ONCE": True,
        "KEEPS_SLOPES": method.keeps_slopes,
        "square": wp.types.matrix(shape=(plan.dofs**2, plan.lanes), dtype=DTYPES[plan.dtype]),
        # Matrices have no storey laws, and a thread has all of their rows.
        "M": 0,
        "IS_RATE": False,
        "TAKES_MEMORY": False,
        "HAS_PADS": False,
        "g": "i",
    }


def integrate_dense(
    first: int, control: Control, samples: Samples, structures: Structure, loads: Load, output: Output, history: History
):
    align_rows()
    block = first + wp.tid()
    structure = indices()
    stiffness = square()  # M^-1 K
    damping = square()  # M^-1 C
    mass = square()
    u = matrix()  # accepted state
    v = matrix()
    us = matrix()  # this stage's state
    vs = matrix()
    un = matrix()  # slopes summed up stage by stage, then the next accepted state
    vn = matrix()
    elastic = matrix()  # M^-1 K u and M^-1 C v of this stage
    viscous = matrix()
    h = row()  # the step, 0 for a lane that has finished
    slot("declare")
    for j in range(LANES):
        slot("read_lane")
        structure[j] = s
        slot("read_sample")
        for i in range(N):
            u[i, j] = loads.initial_displacement[i]
            v[i, j] = loads.initial_velocity[i]
            us[i, j] = u[i, j]
            vs[i, j] = v[i, j]
            slot("start_row")
    for i in range(N):
        for k in range(N):
            for j in range(LANES):
                s = structure[j]
                of_mass = structures.mass_factor[s]
                stiffness[i * N + k, j] = (
                    structures.rate_of_displacement[i, k] * structures.stiffness_factor[s] / of_mass
                )
                damping[i * N + k, j] = structures.rate_of_velocity[i, k] * structures.damping_factor[s] / of_mass
                mass[i * N + k, j] = structures.mass_matrix[i, k] * of_mass
                slot("read_entry")
    inverse_substeps = dtype(1.0) / dtype(substeps)
    slot("start")
    # One interval more than the longest run: its first stage computes the accelerations of the last state.
    for interval in range(intervals + 1):
        slot("begin_interval")
        for j in range(LANES):
            # A lane that has finished waits for the others with a step of zero: its state and sums do not change.
            h[j] = wp.where(interval < live_intervals[j], step[j], dtype(0.0))
            slot("settle_lane")
        slot("in_interval")
        for substep in range(substeps):
            index = interval * substeps + substep
            slot("begin_step")
            # Once. With an adaptive method, until each lane has finished the step.
            while pending > 0 if ADAPTIVITY else ONCE:
                slot("begin_attempt")
                for stage in range(STAGES):
                    slot("begin_stage")
                    for j in range(LANES):
                        slot("begin_walk")
                    for i in range(N):
                        for j in range(LANES):
                            elastic[i, j] = dtype(0.0)
                            viscous[i, j] = dtype(0.0)
                        for k in range(N):
                            for j in range(LANES):
                                elastic[i, j] += stiffness[i * N + k, j] * us[k, j]
                                viscous[i, j] += damping[i * N + k, j] * vs[k, j]
                    slot("see_products")
                    for i in range(N):
                        # A branch outside of the loop over lanes, so that a processor vectorises the lanes.
                        if HAS_SEE_FORCES:
                            if stage == 0:
                                # Record the state at the start of the step; for a lane that has finished, this changes
                                # nothing.
                                for j in range(LANES):
                                    vi = vs[i, j]
                                    net = -elastic[i, j] - viscous[i, j]
                                    slot("add_load")
                                    ai = net
                                    slot("see_forces")
                        for j in range(LANES):
                            vi = vs[i, j]
                            net = -elastic[i, j] - viscous[i, j]
                            slot("add_load")
                            ai = net
                            slot("add_base")
                            slot("end_storey")
                        slot("after_storey")
                if not KEEPS_SLOPES:
                    for i in range(N):
                        for j in range(LANES):
                            u[i, j] += h[j] * un[i, j]
                            v[i, j] += h[j] * vn[i, j]
                            un[i, j] = dtype(0.0)
                            vn[i, j] = dtype(0.0)
                            us[i, j] = u[i, j]
                            vs[i, j] = v[i, j]
                slot("end_attempt")
            slot("end_step")
    for j in range(LANES):
        o = samples.order[sample[j]]
        total = dtype(0.0)
        slot("finish")
        for i in range(N):
            total += u[i, j] + v[i, j]
            slot("finish_storey")
        status = ok
        # A sum with an infinite value or NaN is not finite, so one test covers the whole state.
        if not wp.isfinite(total):
            status = diverged
        output.status[o] = status
        slot("write")
