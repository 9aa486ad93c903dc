"""Lumped structures in other degrees of freedom, or with additional ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from warpdyn.engine.methods.undamped_modes import undamped
from warpdyn.foundations.core.checks import check_kind
from warpdyn.model.structures.builders.chains import lumped_chain
from warpdyn.model.structures.lumped.biaxial_spring import BiaxialSpring, Component
from warpdyn.model.structures.lumped.spring import Spring
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.shear_building import ShearBuilding


def arguments_after(structure: LumpedStructure, dofs: Sequence[str], old: np.ndarray) -> dict[str, Any]:
    """Return arguments of a LumpedStructure with other degrees of freedom, except for masses and influence.

    Inherent damping becomes a matrix, because proportional or modal damping of the new structure would be different.

    Args:
        structure: The structure.
        dofs: Names of the new degrees of freedom.
        old: Displacements of the old degrees of freedom per unit displacement of each new one, shape [old, new].
    """

    def placed(matrix: np.ndarray) -> np.ndarray:
        return old.T @ matrix @ old

    def row_in_new(row: Mapping[str, float]) -> dict[str, float]:
        given = np.array([row.get(dof, 0.0) for dof in structure.dof_names])
        return {dof: float(value) for dof, value in zip(dofs, given @ old, strict=True) if value}

    found: dict[str, Any] = {
        name: placed(structure.matrices[name])
        for name in ("stiffness_matrix", "geometric_stiffness")
        if name in structure.matrices
    }
    found["is_machine"] = structure.is_machine
    damping = inherent_damping(structure)
    if damping.any():
        found["damping_matrix"] = placed(damping)
    springs: list[Spring | BiaxialSpring] = []
    components: list[Component] = []
    for spring in structure.springs:
        if isinstance(spring, Component):
            components.append(replace(spring, direction=row_in_new(spring.direction)))
        else:
            moved = copy(spring)
            moved.direction = row_in_new(spring.direction)
            springs.append(moved)
    springs += [BiaxialSpring.of_components(*pair) for pair in zip(components[::2], components[1::2], strict=True)]
    # Outputs of a frame whose nominal coefficients are 0 remain 0, because the sections are no longer random.
    placed_rows = {name: [row_in_new(row) for row in rows] for name, rows in structure.outputs.items()}
    found["outputs"] = {name: rows for name, rows in placed_rows.items() if any(rows)}
    kinds = dict(structure.kinds.given)
    if "output_units" in kinds:
        kinds["output_units"] = {name: kinds["output_units"][name] for name in found["outputs"]}
    if structure.storey_springs:
        names = structure.names_along("spring")
        found["storey_height"] = structure.parameters["height"]
        found["storey_springs"] = [[names[place] for place in own] for own in structure.storey_springs]
    return {**found, **kinds, "springs": springs}


def lumped(function: str, structure: LumpedStructure | ShearBuilding) -> LumpedStructure:
    """Return a structure as a LumpedStructure; raise a TypeError that names the function for another class."""
    if isinstance(structure, ShearBuilding):
        return lumped_chain(structure)
    check_kind(function, "a LumpedStructure or ShearBuilding", structure, LumpedStructure)
    return structure


def modes(structure: LumpedStructure) -> tuple[np.ndarray, np.ndarray]:
    """Return squared circular frequencies [rad2/s2] and shapes of unit modal mass, shape [dof, mode]."""
    one = values_of_one(structure)
    squared, shapes = undamped(structure.mass_matrices(one), structure.stiffness_matrices(one))
    return squared[0], shapes[0]


def values_of_one(structure: LumpedStructure) -> dict[str, np.ndarray]:
    """Return the parameters of a structure with a first dimension of length 1."""
    return {name: values[None] for name, values in structure.parameters.items()}


def whole_mass(structure: LumpedStructure) -> np.ndarray:
    """Return the mass matrix [kg], shape [dof, dof]."""
    return structure.mass_matrices(values_of_one(structure))[0]


def inherent_damping(structure: LumpedStructure) -> np.ndarray:
    """Return the damping matrix without the dashpots of the springs [N s/m], shape [dof, dof]."""
    one = values_of_one(structure)
    dashpots = one.get("damping_coefficient", np.zeros((1, len(structure.springs))))
    found: np.ndarray = structure.central_matrices(structure.parameters)["damping"] - structure.of_springs(dashpots)[0]
    return np.where(np.abs(found) > 1e-13 * np.abs(found).max(), found, 0.0)


def with_group(structure: LumpedStructure, group: str, *names: str) -> dict[str, list[str]]:
    """Return the groups of a structure after names of degrees of freedom and springs were added to one of them."""
    found = {known: [*own] for known, own in structure.kinds.given.get("groups", {}).items()}
    found[group] = [*found.get(group, ()), *names]
    return found
