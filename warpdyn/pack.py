"""From a scene and its drawn parameters to the plain arrays a kernel reads, named as its structs name them."""

from __future__ import annotations

import numpy as np

from warpdyn.laws import LAWS
from warpdyn.modal import (
    chain_stiffness_matrix,
    circular_frequencies,
    modal_damping_matrix,
    rayleigh_coefficients,
)
from warpdyn.motions import ForceHistory, FreeVibration, GroundMotion, HarmonicForce
from warpdyn.scene import Scene
from warpdyn.stability import stable_step, stable_step_of_eigenvalues, state_eigenvalues
from warpdyn.timeline import motions_of

Arrays = dict[str, np.ndarray]


def all_parameters(scene: Scene, drawn: Arrays) -> Arrays:
    """Return every parameter, scattered or not, with `structure` as first index; one structure where none is drawn."""
    structures = len(next(iter(drawn.values()))) if drawn else 1
    return {
        name: drawn.get(name, np.broadcast_to(nominal, (structures, *nominal.shape)))
        for name, nominal in scene.structure.parameters.items()
    }


def spring_of(scene: Scene, parameters: Arrays) -> str:
    """Return the row of the kernels' SPRINGS table that holds for all drawn structures."""
    return LAWS[scene.structure.law].spring(parameters)


def load_of(scene: Scene) -> str:
    """Return the row of the kernels' LOADS table."""
    kinds = {HarmonicForce: "harmonic_force", ForceHistory: "force_history", FreeVibration: "free_vibration"}
    return kinds.get(type(scene.excitation), "base_acceleration")


def _rayleigh(scene: Scene, parameters: Arrays) -> tuple[np.ndarray, np.ndarray]:
    frequencies = circular_frequencies(parameters["mass"], parameters["stiffness"])
    first, second = (frequencies[:, mode - 1] for mode in scene.structure.damping_modes)
    return rayleigh_coefficients(first, second, parameters["damping_ratio"])


def pack_chain(scene: Scene, parameters: Arrays) -> Arrays:
    """Return the arrays of the chain's kernel, structures last."""
    mass, stiffness = parameters["mass"], parameters["stiffness"]
    structures, storeys = mass.shape
    coefficients = np.stack(LAWS[scene.structure.law].coefficients(parameters), axis=2)
    packed = {
        "mass": mass.T,
        "inverse_mass": 1 / mass.T,
        "inverse_height": 1 / parameters["height"].T,
        "coefficients": coefficients.reshape(structures, -1).T,
    }
    if scene.structure.damping == "storey":
        packed["storey_damping"] = parameters["damping_coefficient"].T
    elif scene.structure.damping == "rayleigh":
        of_mass, of_stiffness = _rayleigh(scene, parameters)
        packed["storey_damping"] = (of_stiffness[:, None] * stiffness).T
        packed["mass_damping"] = of_mass
    elif scene.structure.damping == "modal":
        matrices = modal_damping_matrix(mass, chain_stiffness_matrix(stiffness), parameters["damping_ratio"])
        packed["damping_matrix"] = matrices.reshape(structures, storeys * storeys).T
    return packed


def pack_dense(scene: Scene, parameters: Arrays) -> Arrays:
    """Return the arrays of the dense kernel, structures last."""
    mass = parameters["mass"]
    structures, dofs = mass.shape[:2]

    def flat(matrices: np.ndarray) -> np.ndarray:
        return matrices.reshape(structures, dofs * dofs).T

    return {
        "mass_matrix": flat(mass),
        "rate_of_displacement": flat(np.linalg.solve(mass, parameters["stiffness"])),
        "rate_of_velocity": flat(np.linalg.solve(mass, parameters["damping"])),
        "flexibility_of_mass": flat(np.linalg.inv(mass)),
        "influence": scene.structure.influence,
    }


def pack_load(scene: Scene, structures: int) -> Arrays:
    """Return what the load's struct holds beside the time grid."""
    excitation, dofs = scene.excitation, scene.structure.dofs
    packed: Arrays = {"initial_displacement": np.zeros(dofs), "initial_velocity": np.zeros(dofs)}
    if isinstance(excitation, HarmonicForce):
        packed["amplitude"] = np.repeat(excitation.amplitude[:, None], structures, axis=1)
        packed["circular_frequency"] = np.full(structures, excitation.circular_frequency)
        packed["phase"] = np.full(structures, excitation.phase)
    elif isinstance(excitation, FreeVibration):
        packed["initial_displacement"] = np.broadcast_to(excitation.displacement, dofs)
        packed["initial_velocity"] = np.broadcast_to(excitation.velocity, dofs)
    else:
        values = [m.acceleration if isinstance(m, GroundMotion) else m.force for m in motions_of(scene)]
        packed["values"] = np.concatenate([v.ravel() for v in values])
        lengths = [len(v) for v in values]
        packed["first"] = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    return packed


def stable_steps(scene: Scene, parameters: Arrays, stability_polynomial: tuple[float, ...]) -> np.ndarray:
    """Return the longest step at which a method is stable for each structure at its initial stiffness [s]."""
    mass, stiffness = parameters["mass"], parameters["stiffness"]
    damping = scene.structure.damping
    if damping in ("none", "rayleigh", "modal"):
        # Classical damping: each mode is an oscillator of its own, no complex eigenvalues to solve for.
        frequencies = circular_frequencies(mass, stiffness)
        ratios = np.zeros_like(frequencies)
        if damping == "modal":
            ratios += parameters["damping_ratio"][:, None]
        elif damping == "rayleigh":
            of_mass, of_stiffness = _rayleigh(scene, parameters)
            ratios += (of_mass[:, None] / frequencies + of_stiffness[:, None] * frequencies) / 2
        return stable_step(stability_polynomial, frequencies, ratios).min(axis=1)
    if scene.structure.family == "chain":
        matrices = (mass, chain_stiffness_matrix(parameters["damping_coefficient"]), chain_stiffness_matrix(stiffness))
    else:
        matrices = (mass, parameters["damping"], stiffness)
    return stable_step_of_eigenvalues(stability_polynomial, state_eigenvalues(*matrices))
