"""The courses of integration that kernels follow, with slots for the parts that a scene wants."""

# Of the linear kernels, which are not composed yet.
FIELDS = {
    "Structure": {
        # A linear system's matrices are those of the nominal system, [dof, dof]; each structure scales them.
        "mass_matrix": "float[,]",
        "rate_of_displacement": "float[,]",  # M^-1 K
        "rate_of_velocity": "float[,]",  # M^-1 C
        "flexibility_of_mass": "float[,]",  # M^-1
        "influence": "float[]",  # [dof]
        "mass_factor": "float[]",  # [structure]
        "damping_factor": "float[]",
        "stiffness_factor": "float[]",
        # Of a linear structure in coordinates of its modes, last index: pair of a structure and a step.
        "propagator": "float[,]",  # increments by the state, [row x state, pair]
        "load_response": "float[,]",  # increments by the loads, [row x load x 2, pair]
        # Storey drift of a chain, [dof x mode, pair]; displacement of a linear system, [dof x mode, 1].
        "mode_shape": "float[,]",
        "modal_stiffness": "float[,]",  # over modal mass, as all but that, [mode, pair]
        "modal_damping": "float[,]",  # [mode, pair], [mode x mode, pair] where modes couple
        "modal_load": "float[,]",  # [mode, pair]
        "modal_mass": "float[]",  # [pair]
        "initial_state": "float[,]",  # modal displacements and velocities, [2 x mode, pair]
    },
}
