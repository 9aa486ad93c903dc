"""Dashpots of a chain's storeys: its inherent damping, and viscous dampers that were built in."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.kernels.auxiliary.frequencies import circular_frequencies
from warpdyn.laws.devices.parameters import kind_of_dampers
from warpdyn.scene.scene import Scene
from warpdyn.structures.modal import chain_stiffness_matrix, modal_damping_matrix, rayleigh_coefficients
from warpdyn.structures.p_delta import stiffness_under_gravity
from warpdyn.structures.shear_building import ShearBuilding

Arrays = Mapping[str, np.ndarray]
OF_STIFFNESS = ("rayleigh", "rayleigh_tangent", "stiffness_proportional")  # dashpots in proportion to springs
OF_MASS_AND_STIFFNESS = (*OF_STIFFNESS, "mass_proportional")


def damper_kind(scene: Scene) -> str:
    """Return what the viscous dampers of all structures that can be drawn are: "none", "linear" or "power"."""
    if not scene.structure.devices:
        return "none"
    return kind_of_dampers(scene.structure.devices, {**scene.structure.parameters, **scene.representative_parameters})


def law_to_integrate(scene: Scene) -> str:
    """Return the law that a method must fit: linear viscous dampers are dashpots, which any method has."""
    law = scene.structure.law
    return law.replace("+viscous_damper", "") if damper_kind(scene) == "linear" else law


def kernel_damping(structure: ShearBuilding) -> str:
    """Return the damping that a kernel is built with: what is proportional to stiffness alone is in dashpots alone."""
    of_stiffness = structure.damping == "stiffness_proportional"
    return "storey" if structure.family == "chain" and (structure.damped_storeys or of_stiffness) else structure.damping


def couples_modes(structure: ShearBuilding) -> bool:
    """Return whether a chain's damping couples its undamped modes."""
    # Rayleigh's part of the stiffness is that of the springs alone: what gravity takes off is not in it.
    is_short = structure.damping in OF_STIFFNESS and "gravity_load" in structure.parameters
    is_uneven = structure.damping == "storey" or structure.damped_storeys is not None
    return is_uneven or "viscous_damper" in structure.devices or is_short


def rayleigh_of(structure: ShearBuilding, parameters: Arrays, frequency: np.ndarray) -> np.ndarray:
    """Return the factors of mass [1/s] and stiffness [s] that damping has, shape [2, structure]; 0 without.

    Args:
        structure: The building.
        parameters: Its parameters, `structure` first.
        frequency: Circular frequencies [rad/s], shape [mode, structure].
    """
    factors = np.zeros((2, frequency.shape[1]))
    if structure.damping == "mass_proportional":
        factors[0] = 2 * parameters["damping_ratio"] * frequency[0]
    elif structure.damping == "stiffness_proportional":
        factors[1] = 2 * parameters["damping_ratio"] / frequency[0]
    elif structure.damping_modes is not None:
        first, second = (frequency[mode - 1] for mode in structure.damping_modes)
        factors[:] = rayleigh_coefficients(first, second, parameters["damping_ratio"])
    elif structure.damped_storeys is not None:
        lowest, last = structure.damped_storeys
        own = slice(lowest - 1, last)
        frequency = circular_frequencies(parameters["mass"][:, own], stiffness_under_gravity(parameters)[:, own])
        factors[1] = 2 * parameters["damping_ratio"] / frequency[:, 0]
    return factors


def storey_dashpots(structure: ShearBuilding, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
    """Return the dashpots of inherent damping at rest [N s/m], shape [structure, storey]; None where there are none.

    Args:
        structure: The building.
        parameters: Its parameters, `structure` first.
        of_stiffness: Rayleigh's factor of the stiffness [s], shape [structure].
    """
    if structure.damping == "storey":
        return parameters["damping_coefficient"]
    if structure.damping not in OF_STIFFNESS:
        return None
    dashpots = of_stiffness[:, None] * parameters["stiffness"]
    if structure.damped_storeys is not None:
        first, last = structure.damped_storeys
        storey = np.arange(1, structure.storeys + 1)
        dashpots = np.where((storey >= first) & (storey <= last), dashpots, 0.0)
    return dashpots


def chain_damping_matrix(
    structure: ShearBuilding, parameters: Arrays, rayleigh: np.ndarray, dampers: np.ndarray | float
) -> np.ndarray:
    """Return the damping matrices of chains [N s/m], shape [structure, storey, storey].

    Args:
        structure: The building.
        parameters: Its parameters, `structure` first.
        rayleigh: As `rayleigh_of` returns it.
        dampers: Slopes of the viscous dampers' forces [N s/m], shape [structure, storey], or 0.
    """
    mass = parameters["mass"]
    dashpots = storey_dashpots(structure, parameters, rayleigh[1])
    dashpots = (0.0 if dashpots is None else dashpots) + dampers
    matrix = chain_stiffness_matrix(np.broadcast_to(dashpots, mass.shape))
    matrix += rayleigh[0][:, None, None] * mass[:, :, None] * np.eye(mass.shape[1])
    if structure.damping == "modal":
        elastic = chain_stiffness_matrix(stiffness_under_gravity(parameters))
        matrix += modal_damping_matrix(mass, elastic, parameters["damping_ratio"])
    return matrix
