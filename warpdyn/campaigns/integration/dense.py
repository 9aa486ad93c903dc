"""Equations of motion of linear systems with full matrices: vibration, modes, and the arrays that kernels read."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays, Dynamics, Modes, slowest_decay
from warpdyn.engine.kernels.output_table import HISTORY
from warpdyn.engine.laws import Elastic
from warpdyn.engine.methods.stability_limits import stable_step_of_eigenvalues
from warpdyn.engine.methods.state_matrices import highest_damping_rate, state_eigenvalues
from warpdyn.engine.methods.table import LINEAR, Method
from warpdyn.model.ground_motions.excitation import Excitation
from warpdyn.model.structures.linear_system import LinearSystem
from warpdyn.model.structures.modal import undamped_modes

DIAGONAL_TOLERANCE = 1e-12  # off-diagonal entries up to this share of the largest entry count as rounding
ROUNDED_FREE = 1e-6  # eigenvalues below this share of the largest belong to rigid-body motions (root of rounding error)


class DenseDynamics(Dynamics):
    """Equation of motion of linear systems with full matrices; arguments and attributes: see `Dynamics`.

    Modes count as coupled also if damping couples only modes of the same frequency. The result is then the same as for
    uncoupled modes, but the propagator is a full matrix.
    """

    structure: LinearSystem
    law, forces, damping, viscous_dampers = Elastic.variants["elastic"], LINEAR, "matrix", "none"
    physics, needs_eigenvalues, steps_modes, has_drift_capacity = (), True, True, False
    histories = tuple(name for name in HISTORY if name != "storey_force")
    is_packed_in_parts = False  # all structures share the matrices

    def __init__(self, structure: LinearSystem, representative: Mapping[str, np.ndarray]) -> None:
        super().__init__(structure, representative)
        matrices = structure.parameters
        shape = undamped_modes(matrices["stiffness"], matrices["mass"])[1]
        damping = np.abs(shape.T @ matrices["damping"] @ shape)
        coupling = damping - np.diag(np.diag(damping))
        self.couples_modes = not coupling.max() <= DIAGONAL_TOLERANCE * damping.max()

    def _vibration(self, parameters: Arrays, method: Method) -> tuple[np.ndarray, ...]:
        mass, stiffness, nominal = parameters["mass"], parameters["stiffness"], self.structure.parameters
        mass_matrix, damping_matrix, stiffness_matrix = (
            parameters[name][:, None, None] * nominal[name] for name in ("mass", "damping", "stiffness")
        )
        eigenvalues = state_eigenvalues(mass_matrix, damping_matrix, stiffness_matrix)
        modes = self.structure.modal()["circular_frequency"].values
        if modes[0] == 0:
            # A rigid-body motion has a double eigenvalue 0; a rounding error e moves it by about sqrt(e).
            size = np.abs(eigenvalues)
            eigenvalues = np.where(size <= ROUNDED_FREE * size.max(axis=1, keepdims=True), 0.0, eigenvalues)
        lowest, highest = (mode * np.sqrt(stiffness / mass) for mode in modes[modes > 0][[0, -1]])
        rate = highest_damping_rate(mass_matrix, damping_matrix)
        stable = stable_step_of_eigenvalues(method, eigenvalues, highest, rate)
        return 2 * np.pi / lowest, slowest_decay(eigenvalues), stable, np.zeros((len(mass), 2))

    def modes(self, parameters: Arrays, excitation: Excitation, *, is_coupled: bool) -> Modes:
        """Return the modes of scaled linear systems: nominal mode shapes; the modal mass is the factor on the mass."""
        nominal, mass = self.structure.parameters, parameters["mass"]
        squared, shape = undamped_modes(nominal["stiffness"], nominal["mass"])
        damping = shape.T @ nominal["damping"] @ shape
        if not is_coupled:
            damping = np.diag(damping)
        of_damping = (parameters["damping"] / mass).reshape(-1, *[1] * damping.ndim)
        of_stiffness = (parameters["stiffness"] / mass)[:, None]
        momentum = (nominal["mass"] @ shape)[None]
        load = excitation.modal_load(shape[None], momentum, self.structure.influence)
        start = excitation.modal_start(momentum)
        if excitation.is_force:
            load = load / mass.reshape(-1, *[1] * (load.ndim - 1))
        load = np.broadcast_to(load, (len(mass), *load.shape[1:]))
        start = np.broadcast_to(start, (2, len(mass), self.structure.dofs))
        return Modes(shape[None], of_stiffness * squared, of_damping * damping, mass, load, start)

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> Arrays:
        """Return the arrays that the kernel of linear systems reads, by name: nominal matrices, and factors on them."""
        nominal = self.structure.parameters
        return {
            "mass_matrix": nominal["mass"],
            "rate_of_displacement": np.linalg.solve(nominal["mass"], nominal["stiffness"]),
            "rate_of_velocity": np.linalg.solve(nominal["mass"], nominal["damping"]),
            "flexibility_of_mass": np.linalg.inv(nominal["mass"]),
            "influence": self.structure.influence,
            **{f"{name}_factor": parameters[name] for name in nominal},
        }
