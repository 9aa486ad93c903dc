"""The skeleton for lumped structures: degrees of freedom, springs and outputs are separate.

A stage computes the deformations of all springs from the displacements, then the forces of all springs by their laws,
and then the accelerations from these forces. The first and the last of these steps consist of one statement for each
spring or degree of freedom, which names only entries that are not 0 (see kernels/lumped/pattern.py). Multistep and
implicit methods have one stage, at the accepted state; implicit ones then search the end of the step
(kernels/stepping/implicit_step.py).
"""

from __future__ import annotations

from warpdyn.engine.device.processor import align_rows
from warpdyn.engine.kernels.parts import straight_branches
from warpdyn.engine.kernels.plan import Plan, keeps_drifts, tableau
from warpdyn.engine.laws.springs import spring_row


def names(plan: Plan) -> dict[str, object]:
    """Return the constants, types and functions in the skeleton's text."""
    method, law = tableau(plan), spring_row(plan.law)
    is_mapping, is_multistep, is_implicit = law.return_mapping is not None, keeps_drifts(plan), plan.kind == "implicit"
    maps_in_stage = is_mapping and law.rate is None and (is_multistep or method.ends_in_stage)
    return {
        "STAGES": method.stages,
        "weight": method.weight,
        "node": method.node,
        "ONCE": True,
        "KEEPS_SLOPES": method.keeps_slopes,
        # The stage's state includes the memory of laws with a rate.
        "TAKES_MEMORY": law.rate is not None and not (is_multistep or is_implicit),
        # If the last stage is at the end of the step, its memory is the memory at the end of the step.
        "MAPS_IN_STAGE": maps_in_stage,
        "HANDS_DOWN": False,
        # If the last stage is at the end of the step, its velocity is not the final velocity of the step. Then energies
        # are integrated by the trapezoidal rule over accepted states.
        "TRAPEZOIDAL": is_multistep or is_implicit or method.ends_in_stage,
        "LAGS": False,
        # Whether parts read the deformations of the accepted state after a step.
        "GATHERS_AT_END": plan.storeys is None or "residual" in plan.recorders or (is_mapping and not maps_in_stage),
        # Whether one loop over the storeys computes deformations and forces, and another one all of a floor. Laws with
        # straight branches and methods that keep slopes need more loops. On a CPU separate loops are faster: with rk4
        # 5 times, with stoermer 1.3 times (ten torsional storeys, AVX-512).
        "FUSES": plan.storeys is not None and plan.lanes == 1 and not straight_branches.wanted(plan),
        "FUSES_FLOORS": plan.storeys is not None and plan.lanes == 1 and not method.keeps_slopes,
    }


def visit_spring():
    """Evaluate the force of spring i in a stage."""
    slot("before_storey")
    for j in range(LANES):
        slot("visit_spring_of_lane")


def visit_spring_of_lane():
    drift = deformation[i, j]
    rate = deformation_rate[i, j]
    slot("storey_coefficients")
    slot("memory_of_stage")
    if not HAS_RESTORE:
        f = force_of(drift, memory, c)
    slot("restore")
    slot("add_velocity_force")
    restoring = f
    if HAS_ADD_TO_DASHPOT:
        dashpot = dtype(0.0)
        slot("add_to_dashpot")
        f += dashpot
    if stage == 0:
        slot("see_spring")
    slot("see_power_of_spring")
    spring_force[i, j] = f
    slot("end_spring")


def accelerate_dof():
    """Statements after the accelerations of degree of freedom i by springs and base motion are known."""
    vi = vs[i, j]
    ai = felt[i, j]
    slot("add_to_acceleration")
    moving = ai - shaken[i, j]
    if stage == 0:
        if HAS_UNMOVED:
            ai += unmoved[i, j]
        slot("see_forces")
    ai = moving
    slot("end_storey")


def integrate_lumped(
    first: int, control: Control, samples: Samples, structures: Structure, loads: Load, output: Output, history: History
):
    align_rows()
    block = first + wp.tid()
    slot("place")
    coefficients = table()
    terms = term_rows()  # values of the entries of all matrices
    u = matrix()  # accepted state: displacement and velocity of degrees of freedom, memory of springs
    v = matrix()
    z = memories()
    us = matrix()  # this stage's state
    vs = matrix()
    zs = memories()
    un = matrix()  # slopes summed up stage by stage, then the next accepted state
    vn = matrix()
    zn = memories()
    deformation = spring_rows()  # of this stage, or of the accepted state
    deformation_rate = spring_rows()
    spring_force = spring_rows()
    applied = matrix()  # forces on the degrees of freedom
    felt = matrix()  # accelerations by these forces
    shaken = matrix()  # accelerations by the base motion
    unmoved = matrix()  # base accelerations minus these
    h = row()  # the step, 0 for a lane that has finished
    slot("declare")
    for j in range(LANES):
        slot("read_lane")
        slot("read_sample")
        for i in range(SPRINGS):
            for q in range(C):
                coefficients[i * C + q, j] = structures.coefficients[number_of_spring * C + q, s]
            slot("read_spring")
        for i in range(ROWS):
            slot("read_spring_row")
        for i in range(N):
            u[i, j] = loads.initial_displacement[g]
            v[i, j] = loads.initial_velocity[g]
            slot("read_storey")
            us[i, j] = u[i, j]
            vs[i, j] = v[i, j]
            slot("start_row")
    inverse_substeps = dtype(1.0) / dtype(substeps)
    slot("gather_springs")
    slot("push_springs")
    slot("start")
    # One interval more than the longest run: its first stage records the last state.
    for interval in range(intervals + 1):
        slot("begin_interval")
        if SPRING_COLLAPSE:
            if standing == 0:
                break
        for j in range(LANES):
            # A lane that has finished waits for the others with a step of zero: its state and sums do not change.
            h[j] = wp.where(interval < live_intervals[j], step[j], dtype(0.0))
            slot("stop_lane")
            slot("settle_lane")
        slot("in_interval")
        for substep in range(substeps):
            index = interval * substeps + substep
            slot("begin_step")
            for stage in range(STAGES):
                slot("begin_stage")
                for j in range(LANES):
                    slot("begin_walk")
                if FUSES and (stage > 0 or not GATHERS_AT_END):
                    slot("evaluate_storeys")
                else:
                    if (stage > 0 and STAGES > 1) or not GATHERS_AT_END:
                        slot("gather_springs")
                    for i in range(SPRINGS):
                        slot("visit_spring")
                    if BY_STOREY:
                        slot("sum_up_springs")
                slot("visit_pairs")
                if HAS_ADD_LOAD:
                    for i in range(N):
                        for j in range(LANES):
                            net = dtype(0.0)
                            slot("add_load")
                            applied[i, j] = net
                            if ENERGY:
                                vi = vs[i, j]
                                slot("add_supply")
                if FUSES_FLOORS:
                    slot("accelerate_storeys")
                else:
                    slot("gather_forces")
                    slot("see_powers")
                    for i in range(N):
                        for j in range(LANES):
                            slot("accelerate_dof")
                        slot("after_storey")
                if stage == 0:
                    slot("see_state")
                slot("end_stage")
            slot("end_stages")
            if BY_STOREY and not (KEEPS_SLOPES or KEEPS_DRIFTS):
                for i in range(N):
                    for j in range(LANES):
                        us[i, j] = u[i, j]
                        vs[i, j] = v[i, j]
            elif not (KEEPS_SLOPES or KEEPS_DRIFTS or IMPLICIT_STEP):
                for i in range(N):
                    for j in range(LANES):
                        u[i, j] += h[j] * un[i, j]
                        v[i, j] += h[j] * vn[i, j]
                        un[i, j] = dtype(0.0)
                        vn[i, j] = dtype(0.0)
                        us[i, j] = u[i, j]
                        vs[i, j] = v[i, j]
            slot("take_step")
            slot("end_attempt")
            slot("accept_springs")
            if GATHERS_AT_END:
                slot("gather_springs")
            slot("end_step")
    slot("before_finish")
    for j in range(LANES):
        o = samples.order[sample[j]]
        total = dtype(0.0)
        slot("finish")
        for i in range(N):
            total += u[i, j] + v[i, j]
        for i in range(SPRINGS):
            for m in range(M):
                total += z[i * M + m, j]
        slot("after_finish")
        # Threads that share a sample with others write only if the sample exists.
        if block < control.samples if THREADS > 1 else ONCE:
            for i in range(N):
                slot("finish_storey")
            for i in range(SPRINGS):
                slot("finish_spring")
            for i in range(ROWS):
                slot("finish_spring_row")
            slot("finish_rows")
            if section == 0 if THREADS > 1 else ONCE:
                status = ok
                slot("judge_demand")
                slot("judge_state")
                if not wp.isfinite(total):  # a sum with an infinite value or NaN is not finite
                    status = diverged
                slot("judge_step")
                output.status[o] = status
                slot("write")
