"""Equations of motion of shear chains: their linear vibration, their modes, and the arrays that kernels read."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays, Dynamics, Modes, slowest_decay
from warpdyn.engine.kernels.auxiliary.decays import slowest_decays
from warpdyn.engine.kernels.auxiliary.frequencies import circular_frequencies
from warpdyn.engine.kernels.output_table import HISTORY
from warpdyn.engine.laws.devices.parameters import damper_values, kind_of_dampers, steepest_damping
from warpdyn.engine.methods.stability_limits import (
    amplifies_undamped,
    stable_step,
    stable_step_of_eigenvalues,
    stable_step_of_yielding,
)
from warpdyn.engine.methods.state_matrices import highest_damping_rate, state_eigenvalues
from warpdyn.engine.methods.table import Method
from warpdyn.engine.tracing.arrays import may_be_true
from warpdyn.model.ground_motions.excitation import Excitation
from warpdyn.model.structures.modal import chain_stiffness_matrix
from warpdyn.model.structures.physics import (
    PHYSICS,
    capacities_of,
    effective_stiffness,
    inverse_drift_capacity,
    physics_of,
)
from warpdyn.model.structures.shear_building import ShearBuilding

# Least damping rate of a storey without dashpots [1/s]: the eigenvalue solver needs stiffnesses above 0.
LEAST_RATE = 1e-20


class ChainDynamics(Dynamics):
    """The equation of motion of shear buildings; arguments and attributes: see Dynamics."""

    structure: ShearBuilding
    steps_modes = False
    histories = tuple(HISTORY)

    def __init__(self, structure: ShearBuilding, representative: Mapping[str, np.ndarray]) -> None:
        super().__init__(structure, representative)
        values = {**structure.parameters, **representative}
        inherent = structure.inherent_damping
        self.law = structure.storey_law.rules(values)
        self.variants = structure.storey_law.variants(values)
        self.viscous_dampers = kind_of_dampers(structure.devices, values)
        self.forces = structure.storey_law.forces(has_power_dampers=self.viscous_dampers == "power")
        self.damping = inherent.kernel
        self.physics = physics_of(structure.parameters)
        self.has_drift_capacity = bool(capacities_of(structure.parameters))
        self.counts_reversals = structure.storey_law.counts_reversals(values)
        # Under gravity a storey that has yielded may lose its stiffness.
        falls_over = bool(self.physics) and not structure.storey_law.has_only_linear_springs
        self.is_sensitive = falls_over or structure.storey_law.is_sensitive(values)
        # Rayleigh damping is proportional to the stiffness of the springs without P-Delta, because P-Delta adds no
        # dashpots. The damping ratio is given at the frequencies with P-Delta. OpenSees does the same.
        is_short = inherent.is_of_springs and bool(self.physics)
        self.couples_modes = inherent.is_uneven or self.viscous_dampers != "none" or is_short
        self.needs_eigenvalues = self.couples_modes

    def _vibration(self, parameters: Arrays, method: Method) -> tuple[np.ndarray, ...]:
        mass, inherent, law = parameters["mass"], self.structure.inherent_damping, self.structure.storey_law
        effective = effective_stiffness(parameters)
        frequency = circular_frequencies(mass, effective).T  # [mode, structure]
        period, rayleigh = 2 * np.pi / frequency[0], inherent.rayleigh(parameters, frequency)
        if self.couples_modes:
            # For velocities up to 1 m/s, a damper with an exponent a below 1 has a force C |v|^a of at least C |v|, the
            # force of a linear damper with the coefficient C. So the decay is computed with a linear damper.
            slope = 0.0 if self.viscous_dampers == "none" else parameters["damper_coefficient"]
            steepest = steepest_damping(parameters) if self.viscous_dampers == "power" else slope
            if self.forces.is_linear or inherent.has_own_matrix or amplifies_undamped(method):
                matrix, elastic = inherent.matrix(parameters, rayleigh, slope), chain_stiffness_matrix(effective)
                eigenvalues = state_eigenvalues(mass, matrix, elastic)
                decay = slowest_decay(eigenvalues)
                if self.viscous_dampers == "power":
                    matrix = inherent.matrix(parameters, rayleigh, steepest)
                    eigenvalues = state_eigenvalues(mass, matrix, elastic)
                rate = highest_damping_rate(mass, matrix)
                stable = stable_step_of_eigenvalues(method, eigenvalues, frequency[-1], rate)
            else:
                # The stability limit of yielding structures (below) applies to all oscillators with at most this
                # frequency and rate, and each mode of the elastic structure is one of these oscillators.
                decay = slowest_decays(mass, effective, rayleigh[0], inherent.all_dashpots(parameters, rayleigh, slope))
                dashpots = np.maximum(inherent.all_dashpots(parameters, rayleigh, steepest), LEAST_RATE * mass)
                rate = rayleigh[0] + circular_frequencies(mass, dashpots)[:, -1] ** 2
                stable = np.full_like(rate, np.inf)
        else:
            # Classical damping: each mode is a separate oscillator, and no complex eigenvalues are needed.
            ratios = inherent.ratios(parameters, frequency, rayleigh)
            stable = stable_step(method, frequency, ratios).min(axis=0)
            rates = ratios * frequency
            rate = 2 * rates.max(axis=0)
            # An overdamped mode has two rates of decay; the slower one is used.
            over = np.maximum(ratios, 1)
            decay = np.where(ratios > 1, frequency / (over + np.sqrt(over**2 - 1)), rates).min(axis=0)
        if not self.forces.is_linear:
            stiffest = effective_stiffness(parameters, law.stiffest(parameters))
            is_stiffer = may_be_true(stiffest > effective)
            highest = circular_frequencies(mass, stiffest)[:, -1] if is_stiffer else frequency[-1]
            if inherent.follows_tangent:
                # The stiffest tangent of the springs increases the dashpots; P-Delta does not reduce them.
                springs = circular_frequencies(mass, law.stiffest(parameters))[:, -1]
                rate = np.maximum(rate, rate + rayleigh[1] * (springs**2 - frequency[-1] ** 2))
            rate = np.maximum(rate, law.relaxation_rate(parameters).max(axis=-1))
            stable = stable_step_of_yielding(method, highest, rate, stable)
        return period, decay, stable, rayleigh.T

    def modes(self, parameters: Arrays, excitation: Excitation, *, is_coupled: bool) -> Modes:
        """Return the modes of shear chains; mode shapes are storey drifts, with unit modal mass."""
        inherent, mass, stiffness = (
            self.structure.inherent_damping,
            parameters["mass"],
            effective_stiffness(parameters),
        )
        dofs, root = self.structure.dofs, np.sqrt(mass)
        matrix = chain_stiffness_matrix(stiffness) / (root[:, :, None] * root[:, None, :])
        shape = np.linalg.eigh(matrix)[1] / root[:, :, None]
        drift = np.diff(shape, axis=1, prepend=0.0)
        # Squared frequencies from strain energies: sums of positive terms are accurate also for low frequencies, for
        # which the eigenvalues of the matrix lose digits.
        squared = (stiffness[:, None, :] @ drift**2)[:, 0]
        rayleigh = inherent.rayleigh(parameters, np.sqrt(squared).T)
        of_mass = inherent.of_mass(parameters, squared, rayleigh)
        if is_coupled:
            dashpots = inherent.dashpots(parameters, rayleigh[1])
            dashpots = np.zeros_like(mass) if dashpots is None else dashpots
            if self.viscous_dampers != "none":
                dashpots = dashpots + parameters["damper_coefficient"]
            damping = drift.transpose(0, 2, 1) @ (dashpots[:, :, None] * drift)
            damping += inherent.of_modes(parameters, shape, of_mass)
        else:
            damping = of_mass + rayleigh[1][:, None] * squared
        momentum = mass[:, :, None] * shape
        load = excitation.modal_load(shape, momentum, np.ones(dofs))
        return Modes(drift, squared, damping, np.ones(len(mass)), load, excitation.modal_start(momentum))

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> Arrays:
        """Return the arrays that the kernel of shear chains reads, by name; the last dimension is the structure."""
        mass, inherent = parameters["mass"], self.structure.inherent_damping
        structures = len(mass)
        # Values of successive structures are contiguous in memory, both as drawn and as read by kernels.
        read = self.structure.storey_law.coefficients(parameters, self.variants)
        coefficients = np.stack([values.T for values in read], axis=1)
        packed = {
            "mass": mass.T,
            "inverse_mass": 1 / mass.T,
            "inverse_height": 1 / parameters["height"].T,
            "coefficients": coefficients.reshape(-1, structures),
        }
        dashpots = inherent.pack_dashpots(parameters, rayleigh[:, 1])
        if self.viscous_dampers == "linear":
            dashpots = parameters["damper_coefficient"] + (0.0 if dashpots is None else dashpots)
        elif self.viscous_dampers == "power":
            values = np.stack([values.T for values in damper_values(parameters)], axis=1)
            packed["viscous_damper"] = values.reshape(-1, structures)
        if dashpots is not None:
            packed["storey_damping"] = dashpots.T
        packed |= inherent.pack(parameters, rayleigh) | self._pack_capacity(parameters)
        for row in self.physics:
            packed |= {name: values.T for name, values in PHYSICS[row].packed(parameters).items()}
        return packed

    def pack_beside_modes(self, parameters: Arrays) -> Arrays:
        """Return arrays for outputs and status (heights, stiffnesses, drift capacities), shape [storey, structure]."""
        own = {"inverse_height": 1 / parameters["height"].T, "coefficients": parameters["stiffness"].T}
        return own | self._pack_capacity(parameters)

    def _pack_capacity(self, parameters: Arrays) -> Arrays:
        return {"inverse_drift_capacity": inverse_drift_capacity(parameters).T} if self.has_drift_capacity else {}
