"""The table of all slots: when their statements run, and which variables a part may read and write there.

A slot is a place in the time loop of a kernel, to which parts (modules with statements) contribute. `compose` checks
each part against this table. In every slot, a part may also read the variables of COMMON and those that the part
declares.
"""

from __future__ import annotations

from typing import NamedTuple

from warpdyn.engine.kernels.composing.storey_slots import OF_LUMPED

# Loop variables that the statements of a slot may use. g is the index of a storey in the building, i its index in the
# thread; they differ only if several threads share a sample.
INDICES = {
    "kernel": (),
    "lane": ("j",),
    "storey": ("i", "g"),
    "storey, lane": ("i", "g", "j"),
    "spring": ("i",),
    "spring, lane": ("i", "j"),
    "row, lane": ("i", "j"),
    "entry, lane": ("i", "k", "j"),
    "mode, lane": ("m", "j"),
    "floor, mode, lane": ("i", "m", "j"),
}


class Slot(NamedTuple):
    """A slot: a place in the time loop of a kernel that parts (modules with statements) fill with statements.

    Args:
        index: Key of INDICES: the loops around the slot, whose variables the statements may use.
        text: When the statements run, and their purpose.
        reads: Variables of the surrounding statements that a part may read.
        writes: Variables of the surrounding statements that a part may read and change.
    """

    index: str
    text: str
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()


# Variables that a part may read in every slot, if they exist in the skeleton.
COMMON = {
    "block": "index of the thread",
    "sample": "[lane] index of the sample in the launch",
    "pair": "[lane] column of the modal tables (skeleton propagated)",
    "structure": "[lane] index of the structure (skeleton dense)",
    "motion": "[lane] index of the motion",
    "scale": "[lane] factor on the motion or load",
    "step": "[lane] time step [s]",
    "intervals": "intervals of the longest run in the thread",
    "live_intervals": "[lane] intervals of the lane's run",
    "substeps": "time steps per interval",
    "inverse_substeps": "1 / substeps",
    "interval": "index of the interval",
    "substep": "index of the time step in its interval",
    "index": "index of the time step since the start of the run",
    "stage": "index of the method's stage (explicit methods)",
    "h": "[lane] time step [s], 0 for a lane that has finished",
    "h_last": "[lane] previous time step [s]",
    "live": "[lane] 1, or 0 for a lane that has finished (skeleton propagated)",
    "mass": "[storey, lane] mass of the floor [kg]; matrix of full matrices",
    "inverse_mass": "[storey, lane] 1 / mass",
    "inverse_height": "[storey, lane] 1 / storey height [1/m]",
    "coefficients": "[storey x coefficient, lane] coefficients of the storey law",
    "u": "[storey, lane] displacement of the accepted state [m] (all skeletons except propagated)",
    "v": "[storey, lane] velocity of the accepted state [m/s]",
    "a": "[storey, lane] acceleration of an implicit method [m/s2]",
    "z": "[storey x value, lane] memory of the storey law in the accepted state",
    "us": "[storey, lane] displacement of this stage or iteration",
    "vs": "[storey, lane] velocity of this stage or iteration",
    "zs": "[storey x value, lane] memory of this stage",
    "un": "[storey, lane] sum of the slopes, then the next displacement",
    "vn": "[storey, lane] sum of the slopes, then the next velocity",
    "zn": "[storey x value, lane] sum of the slopes, then the next memory",
    "x": "[2 x mode, lane] modal displacements and velocities (skeleton propagated)",
    "deformation": "[spring, lane] deformation of this stage, or of the accepted state [m] (lumped structures)",
    "deformation_rate": "[spring, lane] its rate [m/s]",
    "ground": "[component, lane] base acceleration of this stage [m/s2] (lumped structures, several components)",
    "spring_force": "[spring, lane] force of this stage, with that of its dashpot [N] (lumped structures)",
    "applied": "[dof, lane] forces on the degrees of freedom [N] (lumped structures)",
    "terms": "[value, lane] values of the matrices' entries that are not 0 (lumped structures)",
    "section": "index of the thread among the threads of a sample",
    "lowest": "index of the lowest storey of the section",
    "foot_u": "[lane] displacement of the floor below the section",
    "foot_v": "[lane] velocity of the floor below the section",
    "stands": "[lane] 1, or 0 once the building has collapsed (if the scene has a collapse limit)",
}

# Temporary variables that skeletons do not read after a slot; a part may use the same names.
SCRATCH = ("share", "change", "after", "reach", "k")

STATE = "u v us vs un vn z zs zn"


def _slot(index: str, text: str, reads: str = "", writes: str = "") -> Slot:
    return Slot(index, text, tuple(reads.split()), tuple(writes.split()))


GROUPS: dict[str, dict[str, Slot]] = {
    "Before the first step": {
        "declare": _slot(
            "kernel", "Declare variables: row() has one value per lane, matrix() one per storey and lane."
        ),
        "place": _slot("kernel", "Find the storeys and samples of the thread.", "", "block section lowest g"),
        "read_lane": _slot("lane", "Find the sample of the lane.", "", "o s intervals scale"),
        "read_sample": _slot("lane", "Read values of the sample in lane j and of its structure s.", "s", "terms"),
        "read_storey": _slot(
            "storey, lane",
            "Read values of a storey of structure s.",
            "s of_damping",
            "u v z zs memory c solved_mass solved_damping",
        ),
        "read_entry": _slot("entry, lane", "Read an entry of full matrices.", "s of_mass"),
        "start_row": _slot("row, lane", "Read a row of full matrices."),
        "read_spring_row": _slot("spring, lane", "As read_spring, also for components of biaxial springs.", "s"),
        "read_spring": _slot(
            "spring, lane", "Read values of a spring of structure s (lumped structures).", "s", "z zs"
        ),
        "number_storey": _slot("storey", "Set g, the index of storey i in the building.", "", "g"),
        "fill_pad": _slot("storey, lane", "Set the values of a storey that pads a section.", "s", "coefficients"),
        "exchange_states": _slot("kernel", "Exchange states with the threads that share a sample.", "", "intervals"),
        "start_storey": _slot("storey, lane", "Start a storey.", "", "us vs c memory drift"),
        "start_drift": _slot("storey, lane", "Record the drift before the first step (implicit methods).", "drift"),
        "start": _slot("kernel", "Start the sample, before the first interval.", "stiffness", "intervals inverse_mass"),
    },
    "Every interval": {
        "begin_phase": _slot(
            "kernel",
            "Begin the intervals from interval_from on, and end them at interval_until (one sample per thread).",
            "interval_from",
            "interval_until",
        ),
        "end_phase": _slot(
            "kernel",
            "After the intervals from interval_from on; the next ones begin at interval_until (one sample per thread).",
            "interval_from",
            "interval_until z",
        ),
        "end_steps": _slot("kernel", "After the last interval (one sample per thread)."),
        "see_last": _slot("kernel", "After the last state was recorded (one sample per thread)."),
        "begin_interval": _slot("kernel", "Begin an interval; standing = 0 ends the run.", "", "standing"),
        "change_lanes": _slot(
            "kernel",
            "After the steps of some lanes have changed; find the next change (several samples per thread).",
            "changed",
            "next_change",
        ),
        "stop_lane": _slot("lane", "Set the step of a lane that is to stop to 0.", "", "h"),
        "settle_lane": _slot("lane", "After the step of the lane in this interval is known.", "", "live"),
        "in_interval": _slot("kernel", "Evaluate loads at the start of the interval and their change.", "changed", "a"),
        "value_of_interval": _slot("kernel", "Evaluate a recorded motion at the end of the interval."),
    },
    "Every step": {
        "begin_step": _slot(
            "kernel", "Before a step, with the accepted state.", "position", "load_start load_end pending"
        ),
        "end_step": _slot("kernel", "After a step, with the accepted state.", "load_end", "z zs c drift memory"),
        "restart_recorders": _slot("lane", "Start peaks again from the accepted state (record_from).", "", "drift"),
        "begin_attempt": _slot("kernel", "Before the stages of a step, or of a part of it.", "", "h pending"),
        "end_attempt": _slot("kernel", "After the stages of a step, or of a part of it.", "", f"{STATE} pending"),
        "end_part": _slot("kernel", "After an attempt, with the accepted state (chains)."),
        "save": _slot("lane", "Save values that a rejected attempt must not change."),
        "restore_saved": _slot("lane", "Restore the saved values."),
        "miss_turns": _slot(
            "storey, lane",
            "Add the error due to storeys that turn, which the error estimate does not contain.",
            "",
            "of_u drift rate c zn",
        ),
        "position_of_stage": _slot(
            "lane", "Set at, the time of the stage since the start of the interval / its length.", "", "at"
        ),
        "begin_stage": _slot("kernel", "Before a stage of the method.", "", "c drift rate memory f"),
        "end_stage": _slot("kernel", "After a stage of the method."),
        "end_stages": _slot("kernel", "After the last stage of the step."),
        "begin_search": _slot(
            "lane", "Before an implicit method searches for the state at the end of the step.", "position_end"
        ),
        "begin_search_of_storey": _slot(
            "storey, lane", "Before the search for the state at the end of the step, for each storey.", "position_end"
        ),
        "end_search": _slot("lane", "After the search for the state at the end of the step."),
        "damp_modes": _slot("kernel", "Evaluate the forces of modal damping for the velocities vs."),
    },
    "Every loop over the storeys, from the top down": {
        "visit_storey": _slot(
            "storey",
            "Evaluate a stage of an explicit method in a storey.",
            "vi memory c",
            "above drift rate f restoring dashpot net ai",
        ),
        "begin_walk": _slot("lane", "Before the loop over the storeys.", "at", "above"),
        "before_storey": _slot(
            "storey", "Before the loop over the lanes of a storey.", "", "z us c memory after drift"
        ),
        "after_storey": _slot("storey", "After the loop over the lanes of a storey.", "", STATE),
        "state_of_stage": _slot(
            "storey, lane", "Set drift, vi (and rate) to the state of the stage.", "", "drift vi rate"
        ),
        "state_below": _slot(
            "storey, lane", "Subtract the state of the floor below from drift and rate.", "", "drift rate"
        ),
        "leave_pad": _slot("storey, lane", "Keep a storey that pads a section at rest.", "", "drift rate"),
        "memory_of_stage": _slot("storey, lane", "Set memory to the law's memory in the stage.", "c", "memory z"),
        "follow_turn": _slot(
            "storey, lane", "Let memory follow the last change of the drift (rate laws, multistep).", "c", "memory"
        ),
        "accepted_drift": _slot("storey, lane", "Set drift to the drift of the accepted state.", "", "drift"),
        "storey_coefficients": _slot("storey, lane", "Set c to the coefficients of the law.", "", "c"),
        "accepted_memory": _slot("storey, lane", "Set memory to the memory of the accepted state.", "", "memory"),
        "reached_drift": _slot(
            "storey, lane", "Set reached_drift[j] to the drift; with u=us that of the stage.", "", "reached_drift"
        ),
        "follow_rules": _slot(
            "storey, lane", "Set after to the memory at reached_drift[j] by all rules of the law.", "", "after memory c"
        ),
        "restore": _slot(
            "storey, lane",
            "Set f to the force of the law; for implicit methods also stiffness, its slope.",
            "drift memory c",
            "f stiffness z",
        ),
        "restore_foot": _slot(
            "lane", "Set f to the force of the lowest storey of the section above.", "drift memory c", "f"
        ),
        "add_velocity_force": _slot(
            "spring, lane", "Add forces that depend on the rate (lumped structures).", "drift rate memory c", "f"
        ),
        "add_to_force": _slot("storey, lane", "Add forces that depend on the drift.", "drift", "f"),
        "add_to_stiffness": _slot(
            "storey, lane",
            "Add the slopes of forces that depend on the drift (implicit methods).",
            "drift",
            "stiffness",
        ),
        "add_to_dashpot": _slot(
            "storey, lane", "Add viscous forces of the storey to dashpot.", "drift rate memory c tangent", "dashpot"
        ),
        "add_to_foot": _slot(
            "lane",
            "Add viscous forces to the force of the lowest storey of the section above.",
            "drift rate memory c tangent",
            "f",
        ),
        "tangent_ahead": _slot(
            "storey, lane", "Set tangent to the stiffness just ahead of drift.", "drift rate memory c", "tangent"
        ),
        "add_to_net": _slot("storey, lane", "Add forces of dampers to the ground to net.", "rate vi", "net"),
        "add_load": _slot("storey, lane", "Add loads to net, the force on the floor.", "at position load_reach", "net"),
        "keep_acceleration": _slot("storey, lane", "Keep ai, before dampers to the ground are added.", "ai"),
        "visit_spring": _slot(
            "spring",
            "Evaluate a spring in a stage (lumped structures).",
            "memory c",
            "drift rate f restoring dashpot",
        ),
        "visit_pairs": _slot(
            "kernel",
            "Evaluate the forces of all biaxial springs in a stage (lumped structures).",
            "",
            "drift rate f restoring dashpot spring_force",
        ),
        "push_springs": _slot("kernel", "Set the first memory of springs (lumped structures).", "", "z zs memory c"),
        "end_spring": _slot(
            "spring, lane", "After the force of a spring is known (lumped structures).", "rate memory c", "z zs zn"
        ),
        "see_power_of_spring": _slot(
            "spring, lane", "Sum up the powers of a spring in a stage (lumped structures).", "restoring dashpot rate"
        ),
        "see_powers": _slot("kernel", "Sum up the powers of a stage (lumped structures)."),
        "energy_of_state": _slot("kernel", "Compute momenta and elastic forces of the matrices (lumped structures)."),
        "gather_springs": _slot("kernel", "Compute the deformations of all springs (lumped structures)."),
        "gather_forces": _slot("kernel", "Compute the accelerations by all springs and matrices (lumped structures)."),
        "accept_springs": _slot("kernel", "Accept the memory of all springs (lumped structures).", "", "z zs zn"),
        "add_to_acceleration": _slot("storey, lane", "Add accelerations by dampers to the ground to ai.", "vi", "ai"),
        "add_base": _slot("storey, lane", "Subtract the base acceleration from ai.", "", "ai"),
        "add_base_to_net": _slot(
            "storey, lane", "Subtract the force of the base motion from net.", "load_reach", "net"
        ),
        "add_powers": _slot(
            "storey, lane", "Sum up the powers of the storey's forces.", "drift rate ai restoring dashpot", "vi"
        ),
        "end_storey": _slot("storey, lane", "After vi and ai are known.", "vi ai rate memory c", "un vn us vs ha"),
        "move_storey": _slot(
            "lane",
            "Move moved_storey by a step, from the accelerations of its floors (multistep).",
            "moved_storey",
            STATE,
        ),
        "count_resting": _slot("kernel", "Count the lanes that have finished (multistep)."),
        "correct_start": _slot("kernel", "Correct the start after the first step (multistep).", "", "u v"),
        "correct_second_step": _slot("kernel", "Correct the start after the second step (multistep).", "", "u v"),
        "sum_up_slopes": _slot(
            "storey, lane",
            "Add the slopes of the stage, and set the state of the next stage.",
            "vi ai rate memory c ha",
            STATE,
        ),
        "add_to_storey": _slot(
            "storey, lane", "Add to the coefficient of an implicit method's system.", "rate", "storey"
        ),
        "add_to_imbalance": _slot("storey, lane", "Sum up the unbalanced forces.", "f inertia residual rise"),
        "eliminate": _slot("storey, lane", "Eliminate a row of the system.", "residual stiffness", "storey"),
        "follow_slope": _slot("storey, lane", "Sum up the product of residual and correction.", "residual"),
        "judge_walk": _slot("kernel", "Decide whether the search ends.", "walk", "waiting"),
        "substitute": _slot("kernel", "Solve the system upwards.", "", "rise us vs change found"),
        "choose_change": _slot("storey, lane", "Choose the change of the acceleration.", "found", "change"),
        "settle_storey": _slot(
            "storey, lane",
            "After an implicit step: drift is the new drift, memory is still the old one.",
            "drift drift_before memory c",
        ),
    },
    "Accepted states": {
        "see_forces": _slot(
            "storey, lane",
            "Record restoring (force of the law), ai (absolute acceleration of the floor) or vi (its velocity).",
            "restoring ai vi position before_end",
        ),
        "before_force_ends": _slot(
            "storey, lane",
            "Set before_end to the acceleration with the last force of a history, otherwise to ai.",
            "ai",
            "before_end",
        ),
        "see_spring": _slot(
            "spring, lane", "Record the deformation or the force of a spring (lumped structures).", "drift restoring"
        ),
        "see_drift": _slot("storey, lane", "Record the drift of the storey.", "drift drift_before"),
        "see_state": _slot("kernel", "After see_drift and see_forces of all storeys.", "ratio_of_storey", "live"),
        "begin_floor": _slot("row, lane", "Before the accelerations of a floor are summed up over the modes."),
        "add_mode_to_floor": _slot("floor, mode, lane", "Add a mode to a floor.", "of_mode"),
        "add_to_means": _slot("kernel", "Add to means over the end of the run.", "ratio_of_storey", "drift g o"),
    },
    "Collapse": {
        "watch_drifts": _slot("kernel", "Find whether a storey of an accepted state passes its capacity.", "", "drift"),
        "watch_lanes": _slot("kernel", "Find whether a lane collapses."),
        "collapse_here": _slot("lane", "Mark the sample as collapsed.", "", "h"),
        "find_first_to_pass": _slot("lane", "Find which storey passes its capacity first, and when.", "", "drift g"),
        "compare_sections": _slot(
            "lane", "Find the first storey to pass its capacity among the threads that share a sample."
        ),
        "see_drifts_at_collapse": _slot("lane", "Record the drifts at the instant of collapse.", "", "drift"),
    },
    "Energy": {
        "add_to_initial_energy": _slot("storey, lane", "Add to the energy at the start.", "drift", "initial_energy"),
        "remember": _slot("storey, lane", "Set memory to the memory at the start.", "", "memory"),
        "add_supply": _slot("storey, lane", "Add the power of loads.", "vi", "power_in energy_in"),
        "add_supply_of_walk": _slot("lane", "Add the power of the base motion.", "momentum", "power_in energy_in"),
        "add_supply_of_entry": _slot(
            "entry, lane", "Add the power of loads (full matrices).", "momentum_of_entry at", "power_in"
        ),
        "add_loss": _slot(
            "storey, lane", "Add the power of dampers to the ground.", "vi momentum_of_floor", "power_viscous"
        ),
        "add_supply_at_state": _slot(
            "storey, lane", "Add the work of loads (implicit methods).", "vi weight", "energy_in"
        ),
        "add_loss_at_state": _slot(
            "storey, lane", "Add the loss by dampers to the ground (implicit methods).", "vi weight", "energy_viscous"
        ),
        "keep_end_of_step": _slot("lane", "Keep values of a load that the next step needs."),
        "add_to_supplied": _slot("lane", "At the end, add energies from other sources.", "", "unaccounted most"),
        "see_products": _slot("kernel", "After the products of full matrices.", "elastic viscous"),
        "see_mode": _slot("mode, lane", "Record a mode.", "inner driven total modal_load"),
        "see_modes": _slot("kernel", "After the slot see_mode of all modes."),
    },
    "End of the run": {
        "before_finish": _slot("kernel", "After the last step (lumped structures)."),
        "finish": _slot("lane", "Before the loop over the storeys; o is the column of the sample in the outputs.", "o"),
        "finish_storey": _slot("storey, lane", "Write the outputs of a storey to column o.", "o stiffness"),
        "finish_drift": _slot(
            "storey, lane",
            "Write outputs that need drift, memory or c (chains, except with the exact method).",
            "o drift memory c",
            "rate",
        ),
        "pair_energy": _slot("lane", "Set stored_in_pair to the elastic energies of a biaxial spring."),
        "finish_rows": _slot(
            "lane", "Write the outputs of biaxial springs and of named outputs (lumped structures).", "o"
        ),
        "finish_spring_row": _slot("spring, lane", "As finish_spring, also for components of biaxial springs.", "o"),
        "finish_spring": _slot("spring, lane", "Write the outputs of a spring to column o (lumped structures).", "o"),
        "add_to_total": _slot("storey, lane", "Add the state to total, which must be finite.", "", "total"),
        "after_finish": _slot("lane", "After the loop over the storeys.", "", "total"),
        "judge_demand": _slot(
            "lane", "Set status by demands; judge_state and judge_step may change it.", "o", "status"
        ),
        "judge_state": _slot("lane", "Set status by the state.", "", "status"),
        "judge_step": _slot("lane", "Set status by the step.", "", "status"),
        "write": _slot("lane", "Write the outputs of a sample to column o.", "o status"),
    },
}
GROUPS |= {title: {name: _slot(*row) for name, row in rows.items()} for title, rows in OF_LUMPED.items()}
SLOTS = {name: slot for group in GROUPS.values() for name, slot in group.items()}
