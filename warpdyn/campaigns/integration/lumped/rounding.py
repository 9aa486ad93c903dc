"""Estimate of the error of float32 in lumped structures."""

from __future__ import annotations

import numpy as np

from warpdyn.engine.methods.undamped_modes import undamped
from warpdyn.model.structures.lumped.structure import LumpedStructure

ROUNDING = 6e-8  # relative rounding error of a float32 number, 2^-24
# Largest estimate at which float32 is the default. Measured errors of peaks were 0.7 to 4 times the estimate, for
# flexural-shear buildings of 10 to 60 storeys, so that errors are at most about 0.2 %.
LARGEST_ERROR = 5e-4


def error_of_float32(structure: LumpedStructure) -> float:
    """Return the estimated relative error [1] of peak displacements in float32, from rounding of the forces.

    A force in the first mode is a sum of products, stiffness times displacement. If the rounding errors of all products
    are independent, they move the first mode by ROUNDING sqrt(variance) / omega_1^2, relative to its displacement. The
    entries of the stiffness matrix act on single degrees of freedom. The two ends of a spring have equal and opposite
    forces, so that the error of a stiff spring in series hardly moves the first mode.
    """
    one = {name: values[None] for name, values in structure.parameters.items()}
    squared, shapes = undamped(structure.mass_matrices(one), structure.stiffness_matrices(one))
    shape, rows = shapes[0, :, 0], structure.directions
    fixed = structure.elastic_matrices(one) - structure.geometric_matrices(one)
    matrix = np.broadcast_to(fixed, (1, len(shape), len(shape)))[0]
    of_matrix = shape**2 @ (matrix**2 @ shape**2)
    of_springs = (rows @ shape) ** 2 * structure.parameters["stiffness"] ** 2 @ (rows**2 @ shape**2)
    return float(ROUNDING * np.sqrt(of_matrix + of_springs) / squared[0, 0])
