"""The equation of motion of a controlled structure at rest, in state space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.devices.parameters import ViscousDamper
from warpdyn.foundations.core.checks import finite_numbers
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.modal import chain_stiffness_matrix
from warpdyn.model.structures.physics import effective_stiffness
from warpdyn.model.structures.shear_building import ShearBuilding
from warpdyn.model.structures.structure import Structure

CONTROLLED = "a ShearBuilding or a LumpedStructure with one component of base motion"


class StateSpace(NamedTuple):
    """A linear structure with actuators, x' = A x + B f + E a(t), with the state x = (displacements, velocities).

    Args:
        dynamics: A, shape [state, state].
        input: B: influence of the actuators' forces, shape [state, actuator].
        ground: E: influence of the base acceleration, shape [state].
        mass: Mass matrix [kg], shape [dof, dof].
        damping: Damping matrix [N s/m], shape [dof, dof].
        stiffness: Stiffness matrix [N/m], shape [dof, dof].
    """

    dynamics: np.ndarray
    input: np.ndarray
    ground: np.ndarray
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray

    @property
    def accelerations(self) -> tuple[np.ndarray, np.ndarray]:
        """Absolute accelerations as a = C x + D f: the matrices C [dof, state] and D [dof, actuator]."""
        dofs = len(self.mass)
        return self.dynamics[dofs:], self.input[dofs:]


def check_structure(structure: Any, purpose: str = "can be controlled") -> Structure:
    """Return the structure; raise a TypeError or ValueError unless it can be controlled, or serve another purpose."""
    if not isinstance(structure, ShearBuilding | LumpedStructure):
        raise TypeError(f"only {CONTROLLED} {purpose}, got {type(structure).__name__}")
    if structure.components > 1:
        raise ValueError(f"only {CONTROLLED} {purpose}, but this structure has {structure.components} components")
    if isinstance(structure, LumpedStructure) and structure.column_line is not None:
        raise ValueError(f"only {CONTROLLED} {purpose}, not a frame with hinges")
    return structure


def state_space(
    structure: Structure, actuators: Sequence[Any], parameters: Mapping[str, ArrayLike] | None = None
) -> StateSpace:
    """Return the matrices of a structure with actuators, for its initial stiffness and small vibrations.

    Forces of dampers with a variable coefficient and of magnetorheological dampers are inputs: they are not part of A.

    Args:
        structure: A ShearBuilding or a LumpedStructure.
        actuators: The actuators.
        parameters: Values that replace parameters of the structure, such as those of a drawn building: {name: values}.

    Raises:
        TypeError, ValueError: If the structure cannot be controlled, an actuator does not fit it, or a parameter is
            unknown.

    Example:
        >>> loop = wd.control.state_space(building, [wd.control.Actuator(1)])
        >>> loop.dynamics.shape, loop.input.shape
        ((4, 4), (4, 1))
    """
    check_structure(structure)
    if not isinstance(actuators, list | tuple):
        raise TypeError(f"actuators must be a list, got {type(actuators).__name__}: give [actuator]")
    values = {name: np.asarray(each, float) for name, each in structure.nominal_values.items()}
    for name, given in (parameters or {}).items():
        if name not in values:
            raise ValueError(f"the structure has no parameter {name!r}{did_you_mean(name, list(values))}")
        values[name] = np.broadcast_to(finite_numbers(name, given), values[name].shape)
        known = structure.parameter_table.get(name)
        if known is not None and (wrong := known.violations(values[name])).any():
            raise ValueError(f"{name} in parameters must be {known.allowed}, got {values[name][wrong][0]:g}")
    if isinstance(structure, LumpedStructure):
        found = structure.central_matrices(values)
        mass, damping, stiffness = found["mass"], found["damping"], found["stiffness"]
        one = {name: each[None] for name, each in values.items()}
        pull = (structure.load_masses(one) @ structure.influences(one))[0, :, 0]
    else:
        assert isinstance(structure, ShearBuilding)
        one = {name: each[None] for name, each in values.items()}
        mass = np.diag(values["mass"])
        stiffness = chain_stiffness_matrix(effective_stiffness(one))[0]
        root = np.sqrt(values["mass"])
        squared = np.linalg.eigvalsh(stiffness / np.outer(root, root))
        rayleigh = structure.inherent_damping.rayleigh(one, np.sqrt(np.maximum(squared, 0.0))[:, None])
        slope = one["damper_coefficient"] if ViscousDamper.name in structure.devices else 0.0
        damping = structure.inherent_damping.matrix(one, rayleigh, slope)[0]
        pull = values["mass"]
    dofs = len(mass)
    inverse = np.linalg.inv(mass)
    places = np.stack([each.influence(structure) for each in actuators], axis=1) if actuators else np.zeros((dofs, 0))
    dynamics = np.block([[np.zeros((dofs, dofs)), np.eye(dofs)], [-inverse @ stiffness, -inverse @ damping]])
    zeros = np.zeros((dofs, places.shape[1]))
    ground = np.concatenate([np.zeros(dofs), -inverse @ pull])
    return StateSpace(dynamics, np.vstack([zeros, inverse @ places]), ground, mass, damping, stiffness)
