"""The time loop of kernels for shear chains and explicit methods; the state stays in registers during the history.

A stage visits the storeys from the top down, so that the force of the storey above is known, and updates the state in
place. A lane is one of the samples that a thread integrates at once. On a CPU the loops over lanes are innermost and
not unrolled, so that LLVM vectorises them. The function in this module that contains the time loop is a skeleton:
`compose` replaces each of its `slot(...)` statements by the statements of the chosen parts of the kernel, such as the
method, the load and the recorders.
"""

from __future__ import annotations

from warpdyn.engine.device.processor import align_rows
from warpdyn.engine.device.warp_exchange import see_neighbours
from warpdyn.engine.kernels.plan import Plan, holds_step, keeps_drifts, tableau
from warpdyn.engine.laws.springs import spring_row


def names(plan: Plan) -> dict[str, object]:
    """Return the objects to which names in the text of the time loop refer: {name: constant, type or function}."""
    method, law = tableau(plan), spring_row(plan.law)
    is_adaptive, is_mapping = method.adaptive, law.return_mapping is not None
    # If the storeys are visited in a loop, the code for the lowest storey follows the loop; otherwise each storey would
    # test whether there is a storey below it. For laws with straight branches this second copy would be too long.
    ends_on_ground = plan.lanes > 1 and 1 < plan.max_unroll < plan.dofs and law.leaves_line is None
    is_multistep = keeps_drifts(plan)
    ends_on_ground = ends_on_ground and not is_multistep
    return {
        "STAGES": method.stages,
        "weight": method.weight,
        "node": method.node,
        "ONCE": True,
        "KEEPS_SLOPES": method.keeps_slopes,
        # The stage's state includes the memory of laws with a rate, and of all laws if a step is tried before it is
        # accepted.
        "TAKES_MEMORY": (law.rate is not None and not is_multistep) or (is_mapping and is_adaptive),
        # If the last stage is at the end of the step, its velocity is not the final velocity of the step. Then energies
        # are integrated by the trapezoidal rule over accepted states. The same rule is used if velocities are half a
        # step behind.
        "TRAPEZOIDAL": (method.ends_in_stage and not is_adaptive) or method.halfway or is_multistep,
        "LAGS": method.halfway,
        # If the last stage is at the end of the step, its memory is the memory at the end of the step. In multistep
        # methods the memory follows the last step in the stage.
        "MAPS_IN_STAGE": is_mapping
        and law.rate is None
        and (is_multistep or (method.ends_in_stage and not is_adaptive)),
        # In an unrolled loop the top storey needs no force from above.
        "BEGINS_AT_TOP": plan.sections == 1 and plan.dofs <= plan.max_unroll,
        "ENDS_ON_GROUND": ends_on_ground,
        "IN_LOOP": plan.storeys_of_thread - ends_on_ground,  # storeys in the loop
        # On a CPU each storey passes the state of the floor below to the next storey, which would otherwise reload it.
        "HANDS_DOWN": plan.lanes > 1,
        # One sample per thread without recorders of forces: the forces of the last state are not evaluated.
        "HOLDS_STEP": f"({holds_step(plan)} and not (HAS_SEE_FORCES or (ENERGY and TRAPEZOIDAL)))",
        # Several samples per thread: their steps change only where a run ends, or where a motion ends within a run.
        "HOLDS_LANES": "(LANES > 1 and not (ADAPTIVITY or COLLAPSE))",
    }


def visit_storey():
    """Statements that evaluate one stage of the method in storey i."""
    slot("before_storey")
    for j in range(LANES):
        slot("state_of_stage")
        if not KEEPS_DRIFTS:
            rate = vi
            if i > 0:
                slot("state_below")
            elif SECTIONS:
                drift -= foot_u[j]
                rate -= foot_v[j]
        slot("leave_pad")
        slot("storey_coefficients")
        slot("memory_of_stage")
        if not HAS_RESTORE:
            f = force_of(drift, memory, c)
        slot("restore")
        restoring = f
        slot("add_to_force")
        if HAS_ADD_TO_DASHPOT:
            if not STOREY:
                dashpot = dtype(0.0)
            slot("add_to_dashpot")
            f += dashpot
        # Force on the floor: its absolute acceleration times its mass.
        # A factor of -1 costs nothing; Warp writes -f as a subtraction from zero.
        net = dtype(-1.0) * f if BEGINS_AT_TOP and i == N - 1 else above[j] - f
        slot("add_to_net")
        slot("add_load")
        ai = net * inverse_mass[i, j]
        slot("keep_acceleration")
        slot("add_to_acceleration")
        if stage == 0:
            slot("see_drift")
            slot("see_forces")
        slot("add_base")
        slot("add_powers")
        above[j] = f
        slot("end_storey")
    slot("after_storey")


def integrate_chain(
    first: int, control: Control, samples: Samples, structures: Structure, loads: Load, output: Output, history: History
):
    align_rows()
    block = first + wp.tid()
    slot("place")
    inverse_mass = matrix()
    mass = matrix()
    inverse_height = matrix()
    coefficients = table()
    u = matrix()  # accepted state: displacement, velocity, memory of the law
    v = matrix()
    z = memories()
    us = matrix()  # this stage's state
    vs = matrix()
    zs = memories()
    un = matrix()  # slopes summed up stage by stage, then the next accepted state
    vn = matrix()
    zn = memories()
    h = row()  # the step, 0 for a lane that has finished
    above = row()  # the force from above
    slot("declare")
    for j in range(LANES):
        slot("read_lane")
        slot("read_sample")
        for i in range(N):
            slot("number_storey")
            if not HAS_PADS or g < STOREYS:
                inverse_mass[i, j] = structures.inverse_mass[g, s]
                mass[i, j] = structures.mass[g, s]
                inverse_height[i, j] = structures.inverse_height[g, s]
                for q in range(C):
                    coefficients[i * C + q, j] = structures.coefficients[g * C + q, s]
                u[i, j] = loads.initial_displacement[g]
                v[i, j] = loads.initial_velocity[g]
                slot("read_storey")
            slot("fill_pad")
    slot("exchange_states")
    for i in range(N):
        for j in range(LANES):
            slot("start_storey")
    inverse_substeps = dtype(1.0) / dtype(substeps)
    slot("start")
    if HOLDS_LANES:
        changed = int(0)  # the last interval at whose start a lane changed, and the next one
        next_change = int(0)
    if HOLDS_STEP:
        for j in range(LANES):
            h[j] = step[j]
    # One interval more than the longest run, except if the step is held: its first stage records the last state.
    if HOLDS_STEP:
        interval_from = int(0)
    if HOLDS_STEP and COLLAPSE:
        index = int(0)  # index of the step in which the building collapses
    while interval_from < intervals if HOLDS_STEP else ONCE:
        if HOLDS_STEP:
            interval_until = intervals
            slot("begin_phase")
        for interval in range(interval_from if HOLDS_STEP else 0, interval_until if HOLDS_STEP else intervals + 1):
            slot("begin_interval")
            if COLLAPSE and not (SECTIONS or HOLDS_STEP):
                # (Threads that share a sample must exchange values to the end.)
                if standing == 0:
                    break
            # A lane that has finished waits for the others with a step of zero: its state and sums do not change.
            if HOLDS_LANES:
                if interval >= next_change:
                    changed = interval
                    next_change = int(2147483647)
                    for j in range(LANES):
                        h[j] = wp.where(interval < live_intervals[j], step[j], dtype(0.0))
                        next_change = wp.min(
                            next_change, wp.where(interval < live_intervals[j], live_intervals[j], 2147483647)
                        )
                    slot("change_lanes")
            for j in range(LANES):
                if not (HOLDS_STEP or HOLDS_LANES):
                    h[j] = wp.where(interval < live_intervals[j], step[j], dtype(0.0))
                slot("stop_lane")
                slot("settle_lane")
            slot("in_interval")
            for substep in range(substeps):
                index = interval * substeps + substep
                slot("begin_step")
                while pending > 0 if ADAPTIVITY else ONCE:
                    slot("begin_attempt")
                    for stage in range(STAGES):
                        slot("begin_stage")
                        for j in range(LANES):
                            if not SECTIONS and not BEGINS_AT_TOP:
                                above[j] = dtype(0.0)
                            slot("begin_walk")
                        for down in range(IN_LOOP):
                            i = N - 1 - down
                            slot("visit_storey")
                        if ENDS_ON_GROUND:
                            slot("visit_storey", i=0, g=0)
                        if stage == 0:
                            slot("see_state")
                        slot("end_stage")
                    slot("end_stages")
                    slot("end_attempt")
                    slot("end_part")
                slot("end_step")
                if HOLDS_STEP and COLLAPSE and not COLLAPSE_GROUPS:
                    if stands[0] == dtype(0.0):
                        break
            if HOLDS_STEP and COLLAPSE and not COLLAPSE_GROUPS:
                if stands[0] == dtype(0.0):
                    interval_until = intervals  # ends the run
                    break
        if HOLDS_STEP:
            slot("end_phase")
            interval_from = interval_until
    if HOLDS_STEP:
        slot("end_steps")
        if HAS_SEE_DRIFT:
            # The loop has not recorded the last state.
            index = index + 1 if COLLAPSE and stands[0] == dtype(0.0) else intervals * substeps
            for i in range(N):
                for j in range(LANES):
                    slot("accepted_drift")
                    slot("see_drift")
            slot("see_state")
            slot("see_last")
    for j in range(LANES):
        o = samples.order[sample[j]]
        total = dtype(0.0)
        slot("finish")
        for i in range(N):
            slot("number_storey")
            slot("add_to_total")
            total += z[i * M, j]
            for m in range(1, M):
                total += z[i * M + m, j]
            if not HAS_PADS or g < STOREYS:
                slot("finish_storey")
                if HAS_FINISH_DRIFT:
                    slot("accepted_drift")
                    slot("storey_coefficients")
                    slot("accepted_memory")
                    slot("finish_drift")
        slot("after_finish")
        if SECTIONS:
            see_neighbours()
        if not SECTIONS or section == 0:
            status = ok
            slot("judge_demand")
            slot("judge_state")
            if not wp.isfinite(total):  # a sum with an infinite value or NaN is not finite
                status = diverged
            slot("judge_step")
            output.status[o] = status
            slot("write")
