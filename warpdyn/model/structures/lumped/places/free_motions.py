"""Motions of a lumped structure that lack mass or resistance."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.engine.methods.undamped_modes import are_diagonal, have_only_eigenvalues_above, scaled_stiffness, undamped
from warpdyn.model.structures.lumped.matrices import OF_STRUCTURE, LumpedMatrices

LEAST_OF_STIFFNESS = 1e-13  # least squared frequency of a structure that cannot move freely, over the highest one
LEAST_OF_MASS = 1e-12  # least eigenvalue of the mass matrix, scaled to a diagonal of ones


def mass_problem(structure: LumpedMatrices, values: Mapping[str, np.ndarray]) -> str | None:
    """Return a sentence on a degree of freedom or a motion without mass in one of the structures, or None."""
    given = np.atleast_2d(values["mass"])
    with np.errstate(invalid="ignore"):  # masses that are negative or NaN
        mass = structure.mass_matrices({**values, "mass": given})
    diagonal = np.einsum("sii->si", mass)
    wrong = np.argwhere(~(diagonal > 0))
    if wrong.size:
        first, place = wrong[0]
        dof = structure.dof_names[place]
        where = f" in structure {first} ({given[first, place]:g} kg)" if len(given) == len(diagonal) > 1 else ""
        return (
            f"degree of freedom {dof!r} has no mass{where}: give it a mass above 0, or eliminate it by static "
            "condensation"
        )
    if problem := structure.coupled_mass_problem(values):
        return problem
    if are_diagonal(mass).all():
        return None
    root = np.sqrt(diagonal)
    scaled = mass / root[:, :, None] / root[:, None, :]
    if have_only_eigenvalues_above(scaled, np.full(len(scaled), LEAST_OF_MASS)):
        return None
    least, shape = np.linalg.eigh(scaled)
    if (least[:, 0] <= LEAST_OF_MASS).any():
        first = int(np.argmax(least[:, 0] <= LEAST_OF_MASS))
        dof = structure.dof_names[int(np.abs(shape[first, :, 0]).argmax())]
        return (
            "the mass matrix is singular or has a negative eigenvalue: a motion in which degree of freedom "
            f"{dof!r} takes most part has no mass. Correct mass_matrix, or eliminate this motion by static "
            "condensation"
        )
    return None


def stiffness_problem(structure: LumpedMatrices, values: Mapping[str, np.ndarray]) -> str | None:
    """Return a sentence on a motion without resistance in one of the structures, or None."""
    whole = {name: np.atleast_2d(each) for name, each in values.items() if name not in OF_STRUCTURE}
    count = max(map(len, whole.values()))
    whole = {name: np.broadcast_to(each, (count, each.shape[1])) for name, each in whole.items()}
    mass, stiffness = structure.mass_matrices(whole), structure.stiffness_matrices(whole)
    scaled = scaled_stiffness(mass, stiffness)[1]
    # The sum of the eigenvalues is at least the highest one if none is negative.
    if have_only_eigenvalues_above(scaled, LEAST_OF_STIFFNESS * np.trace(scaled, axis1=1, axis2=2)):
        return None
    squared = np.linalg.eigvalsh(scaled)
    free = squared[:, 0] <= LEAST_OF_STIFFNESS * squared[:, -1]
    if not free.any():
        return None
    first = int(free.argmax())
    _, shape = undamped(mass[[first]], stiffness[[first]], is_clipped=False)
    motion = shape[0, :, 0] * np.sqrt(np.diag(mass[first]))
    dof = structure.dof_names[int(np.abs(motion).argmax())]
    return structure.free_motion_problem(dof, first, whole)
