"""Slots of lumped structures: equal storeys, frames with hinges, implicit steps; slots.py contains all others.

Each row contains the index, the text, the variables that a part may read, and those that it may change.
"""

OF_EQUAL_STOREYS: dict[str, tuple[str, ...]] = {
    "share_warp": (
        "kernel",
        "Find the storeys of a thread that shares a sample.",
        "",
        "block section lowest",
    ),
    "find_lower_floor": ("kernel", "Find the state of the floor below the storeys of the thread."),
    "find_accepted_floor": ("kernel", "The same as find_lower_floor, for the accepted displacements."),
    "compare_floors": ("lane", "Find the state of a floor relative to the floor below."),
    "compare_accepted_floors": ("lane", "The same as compare_floors, for the accepted displacements."),
    "leave_floor": ("lane", "Go from a floor to the floor above."),
    "leave_accepted_floor": ("lane", "The same as leave_floor, for the accepted displacements."),
    "visit_spring_of_lane": (
        "spring, lane",
        "Evaluate a spring in a lane (all lumped structures).",
        "memory c",
        "drift rate f restoring dashpot spring_force z zs",
    ),
    "evaluate_storeys": ("kernel", "Evaluate all springs, storey by storey.", "", "i"),
    "sum_up_springs": ("kernel", "Sum up the forces of the springs in each storey."),
    "find_upper_forces": ("kernel", "Find the forces of the storey above the storeys of the thread."),
    "accelerate_floor": ("lane", "Compute the accelerations of a floor."),
    "accelerate_storeys": ("kernel", "Compute the accelerations of all floors.", "", "i"),
    "accelerate_dof": (
        "row, lane",
        "After the accelerations of degree of freedom i are known (all lumped structures).",
        "moving",
        "vi ai",
    ),
}

_STATE = "u v us vs z drift rate f memory c after dashpot net vi ai spring_force deformation applied felt shaken"
OF_IMPLICIT_STEPS: dict[str, tuple[str, ...]] = {
    "take_step": ("kernel", "Take a step of an implicit method from the accepted state.", "", _STATE),
    "begin_implicit_step": ("kernel", "Set the first trial state of the step.", "", _STATE),
    "evaluate_trial": ("kernel", "Evaluate the unbalanced accelerations of the trial state.", "", _STATE),
    "judge_trial": ("lane", "Decide whether the search ends.", "iteration", "unsettled"),
    "correct_trial": ("lane", "Find and add Newton's correction.", "iteration", _STATE),
    "find_system": ("lane", "Find the matrix of the linear system.", "", _STATE),
    "factor_system": ("lane", "Factor the matrix."),
    "solve_system": ("lane", "Solve the linear system."),
    "accept_step": ("kernel", "Accept the state at the end of the step.", "", _STATE),
}

_HINGES = "deformation spring_force"
OF_COLUMN_LINE: dict[str, tuple[str, ...]] = {
    "tilt_columns": ("kernel", "Change the unbalanced moments of a frame with the drifts.", "", "solution"),
    "factorise_line": ("kernel", "Factorise the linear system of the rotations.", "solution", "i"),
    "solve_line": ("kernel", "Solve the linear system of the rotations.", "solution"),
    "turn_all": ("kernel", "Correct all rotations by the first solution.", "solution"),
    "turn_searching": ("kernel", "Correct the rotations of lanes whose moments do not balance.", "solution"),
    "follow_hinges": ("kernel", "Evaluate the laws of all hinges.", "solution", "i deformation spring_force memory c"),
    "follow_branches": (
        "spring",
        "Evaluate a law with straight branches in all lanes.",
        "",
        "deformation spring_force memory c",
    ),
    "solve_joint_springs": ("kernel", "Find the rotations of joints for the present branches of their springs."),
    "add_chord_moments": ("lane", "Add the moments of the columns of a joint whose joints do not rotate."),
    "store_turn": ("lane", "Store the rotation of a joint and the branch of its spring."),
    "judge_gap": ("kernel", "Find the lanes whose moments changed by more than the tolerance.", "", "seeking"),
    "relax_joint_springs": ("kernel", "Find the rotations of joints with initial stiffnesses.", "", "seeking solution"),
    "find_shears_of_columns": (
        "kernel",
        "Compute the storey shears, and the state of hinges for recorders.",
        "",
        _HINGES,
    ),
    "accept_hinges": ("kernel", "Accept the memory of all hinges.", "", "i z memory c spring_force"),
    "unbalance_line": ("kernel", "Compute all unbalanced moments.", "solution", "i spring_force"),
    "judge_balance": ("kernel", "Decide whether the search for rotations continues.", "solution", "seeking"),
    "judge_lanes": ("kernel", "Decide for each lane how its search continues.", "solution", "seeking"),
    "end_balance": ("kernel", "After the search for rotations.", "seeking", "i deformation"),
}

_OF_LAW = "i z memory c spring_force deformation"
OF_GRIDS: dict[str, tuple[str, ...]] = {
    "pass_down": ("kernel", "Get what the columns of the storey above pass on to the joints of a thread."),
    "exchange_turns": ("kernel", "Get the rotations of the joints below and above the storeys of a thread."),
    "find_neighbours": ("kernel", "Find the threads of the joints below and above at a distance."),
    "find_drifts": ("kernel", "Find the drifts of the storeys of a thread."),
    "guess_joints": ("kernel", "Prepare the search for rotations of a step."),
    "drag_limits": ("kernel", "Move the limits of yielding hinges to their rotations.", "", "deformation"),
    "continue_turns": ("kernel", "Continue the rotations of joints along those of the last states."),
    "factorise_joints": ("kernel", "Find the stiffness of members with hinges, and factorise that of the joints."),
    "load_joints": ("kernel", "Find the moments that act on joints."),
    "solve_joints": ("kernel", "Solve the linear system of the joints."),
    "find_moments": (
        "kernel",
        "Compute the moments of all members and the rotations of all hinges.",
        "",
        "i deformation spring_force",
    ),
    "find_moments_of_half_beams": (
        "kernel",
        "Compute the moments of half-beams and the rotations of their hinges.",
        "",
        "i deformation spring_force",
    ),
    "judge_moves": ("kernel", "Decide whether the rotations of the joints of each frame still change."),
    "share_moment": ("kernel", "Share the largest moment of a frame among its threads."),
    "tie_members": ("kernel", "Find the stiffness of members with bilinear hinges."),
    "load_yielding_joints": ("kernel", "Find the moments on joints of members with bilinear hinges."),
    "find_branches": (
        "kernel",
        "Compute the moments of members with bilinear hinges, and find wrong branches.",
        "",
        "i deformation spring_force c",
    ),
    "judge_hinge": (
        "lane",
        "Find the plastic rotation of a hinge, and whether its branch is wrong.",
        "judged own_turn own_moment other_moment own_flexibility opposite_flexibility allowed_moment",
        "beyond_limit i deformation spring_force c",
    ),
    "change_branches": ("kernel", "Change the branches of hinges that are wrong.", "solution", "seeking"),
    "keep_first_wrong_branch": ("lane", "Keep only the first hinge of a frame with a wrong branch."),
    "name_hinge": ("kernel", "Find a hinge with a wrong branch after the last solution."),
    "follow_lines": ("kernel", "Evaluate the laws of hinges that left their lines.", "solution", f"{_OF_LAW} seeking"),
    "follow_line": ("kernel", "Evaluate the law of hinge i and take its tangent as line.", "", _OF_LAW),
    "follow_law": ("kernel", "Evaluate the law of hinge i.", "", _OF_LAW),
    "go_to_limit": ("kernel", "Take hinge i to the limit of the line that it leaves.", "", _OF_LAW),
    "accept_line": ("kernel", "Accept the state of hinge i.", "", _OF_LAW),
    "take_foreseen_line": ("kernel", "Accept hinge i on the line that was foreseen.", "", _OF_LAW),
    "accept_law": ("kernel", "Accept the state of hinge i by its law.", "", _OF_LAW),
    "take_line": ("kernel", "Find the line of hinge i after its state was accepted.", "", _OF_LAW),
    "take_earlier_line": ("kernel", "Return hinge i to the line of the last accepted state.", "", _OF_LAW),
    "drag_lines": ("kernel", "Move the limits of hinges, if the thread has yielding ones.", "", "deformation"),
    "judge_increment": ("kernel", "Decide how the search for rotations continues.", "solution", "seeking"),
    "set_increment": ("kernel", "Set the drifts of the next solution."),
}

OF_LUMPED = {
    "Lumped structures of equal storeys": OF_EQUAL_STOREYS,
    "Frames with hinges": OF_COLUMN_LINE,
    "Frames with hinges whose joints are a grid": OF_GRIDS,
    "Implicit steps of lumped structures": OF_IMPLICIT_STEPS,
}
