"""How drawn structures vibrate: their periods, how fast they come to rest, and the longest step that holds."""

from __future__ import annotations

import numpy as np

from warpdyn.core.thread_pool import STRUCTURES_AT_A_TIME, in_parts
from warpdyn.integration.damping import (
    OF_MASS_AND_STIFFNESS,
    chain_damping_matrix,
    couples_modes,
    damper_kind,
    rayleigh_of,
)
from warpdyn.integration.packing import kernel_spring, parameters_of
from warpdyn.integration.propagators import damping_of
from warpdyn.integration.time_grid import Vibration
from warpdyn.kernels.auxiliary.frequencies import circular_frequencies
from warpdyn.laws.devices.parameters import steepest_damping
from warpdyn.methods.kinds import Method
from warpdyn.methods.stability_limits import (
    highest_damping_rate,
    stable_step,
    stable_step_of_eigenvalues,
    stable_step_of_yielding,
    state_eigenvalues,
)
from warpdyn.scene.scene import Scene
from warpdyn.structures.modal import chain_stiffness_matrix
from warpdyn.structures.p_delta import stiffness_under_gravity

Arrays = dict[str, np.ndarray]
DOUBLES_AT_A_TIME = 2**20  # in the state matrices of the eigenvalue problems, which are larger than any result


def vibration_of(scene: Scene, drawn: Arrays, method: Method, threads: int = 1) -> Vibration:
    """Return every structure's vibration at its initial stiffness, and a method's longest step at its stiffest."""
    count = len(next(iter(drawn.values()))) if drawn else 1
    at_a_time = STRUCTURES_AT_A_TIME
    if scene.structure.family == "dense" or damping_of(scene) == "general":
        at_a_time = max(1, DOUBLES_AT_A_TIME // threads // (2 * scene.structure.dofs) ** 2)

    def part(structures: slice) -> tuple[np.ndarray, ...]:
        return _vibration(scene, parameters_of(scene, drawn, structures), method)

    found = in_parts(part, count, threads, at_a_time)
    return Vibration(*(np.concatenate(values) for values in zip(*found, strict=True)))


def _vibration(scene: Scene, parameters: Arrays, method: Method) -> tuple[np.ndarray, ...]:
    """Return period [s], slowest decay [1/s], longest stable step [s] and Rayleigh damping of some structures."""
    damping = scene.structure.damping
    mass, stiffness = parameters["mass"], parameters["stiffness"]
    if scene.structure.family == "dense":
        nominal = scene.structure.parameters
        mass_matrix, damping_matrix, stiffness_matrix = (
            parameters[name][:, None, None] * nominal[name] for name in ("mass", "damping", "stiffness")
        )
        eigenvalues = state_eigenvalues(mass_matrix, damping_matrix, stiffness_matrix)
        modes = scene.structure.modal()["circular_frequency"].values
        lowest, highest = (mode * np.sqrt(stiffness / mass) for mode in modes[[0, -1]])
        rate = highest_damping_rate(mass_matrix, damping_matrix)
        stable = stable_step_of_eigenvalues(method, eigenvalues, highest, rate)
        return 2 * np.pi / lowest, _slowest_decay(eigenvalues), stable, np.zeros((len(mass), 2))
    effective = stiffness_under_gravity(parameters)
    frequency = circular_frequencies(mass, effective).T  # [mode, structure]
    period, rayleigh = 2 * np.pi / frequency[0], rayleigh_of(scene.structure, parameters, frequency)
    dampers = damper_kind(scene)
    if couples_modes(scene.structure):
        # Below 1 m/s, a damper's force falls no faster than if it were linear.
        slope = 0.0 if dampers == "none" else parameters["damper_coefficient"]
        matrix, elastic = (
            chain_damping_matrix(scene.structure, parameters, rayleigh, slope),
            chain_stiffness_matrix(effective),
        )
        eigenvalues = state_eigenvalues(mass, matrix, elastic)
        decay = _slowest_decay(eigenvalues)
        if dampers == "power":
            matrix = chain_damping_matrix(scene.structure, parameters, rayleigh, steepest_damping(parameters))
            eigenvalues = state_eigenvalues(mass, matrix, elastic)
        rate = highest_damping_rate(mass, matrix)
        stable = stable_step_of_eigenvalues(method, eigenvalues, frequency[-1], rate)
    else:
        # Classical damping: each mode is an oscillator of its own, no complex eigenvalues to solve for.
        ratios = np.zeros_like(frequency)
        if damping == "modal":
            ratios += parameters["damping_ratio"]
        elif damping in OF_MASS_AND_STIFFNESS:
            ratios += (rayleigh[0] / frequency + rayleigh[1] * frequency) / 2
        stable = stable_step(method, frequency, ratios).min(axis=0)
        rates = ratios * frequency
        rate = 2 * rates.max(axis=0)
        # The slower of an overdamped mode's two rates of decay; the only one of any other mode.
        over = ratios > 1
        rates[over] = frequency[over] / (ratios[over] + np.sqrt(ratios[over] ** 2 - 1))
        decay = rates.min(axis=0)
    if kernel_spring(scene) != "elastic" or dampers == "power":
        stiffest = stiffness_under_gravity(parameters, scene.structure.storey_law.stiffest(parameters))
        highest = circular_frequencies(mass, stiffest)[:, -1] if np.any(stiffest > effective) else frequency[-1]
        if damping == "rayleigh_tangent":
            # What the stiffest tangent adds to the dashpots; gravity takes nothing off them.
            springs = circular_frequencies(mass, scene.structure.storey_law.stiffest(parameters))[:, -1]
            rate = np.maximum(rate, rate + rayleigh[1] * (springs**2 - frequency[-1] ** 2))
        stable = stable_step_of_yielding(method, highest, rate, stable)
    return period, decay, stable, rayleigh.T


def _slowest_decay(eigenvalues: np.ndarray) -> np.ndarray:
    return np.maximum(-eigenvalues.real.max(axis=1), 0.0)
