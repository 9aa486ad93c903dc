"""Find implausible values of actuators that depend on the structure and on the motions of a scene."""

from __future__ import annotations

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.model.control.actuators import Actuator, VariableDamper
from warpdyn.model.control.control import Control
from warpdyn.model.control.state_space import state_space
from warpdyn.model.structures.structure import Structure


def add_control(
    findings: PlausibilityFindings, control: Control, structure: Structure, weakest_peak: float | None
) -> None:
    """Add force limits and coefficients of actuators that are too small to have an effect to `findings`.

    Args:
        findings: Implausible values found so far.
        control: The control of the structure.
        structure: The structure, which has neither free motions nor buckles. Its nominal parameters are used.
        weakest_peak: Peak acceleration of the weakest motion [m/s2]; None: unknown, or force limits are not checked.
    """
    system = state_space(structure, ())
    places = np.stack([each.influence(structure) for each in control.actuators], axis=1)
    mobility = np.einsum("da,da->a", places, np.linalg.solve(system.mass, places))  # 1/kg
    if weakest_peak:
        given = [each.force_limit if isinstance(each, Actuator) else None for each in control.actuators]
        limits = np.array([np.nan if limit is None else limit for limit in given])
        findings.add("actuator_acceleration", limits * mobility / weakest_peak, along="actuator")
    high = np.array([each.high if isinstance(each, VariableDamper) else 0.0 for each in control.actuators])
    if high.any():
        factor = np.linalg.inv(np.linalg.cholesky(system.mass))
        squared, shapes = np.linalg.eigh(factor @ system.stiffness @ factor.T)
        of_modes = places.T @ factor.T @ shapes  # displacement between the ends of each actuator
        findings.add("variable_damper_ratio", (high @ of_modes**2 / (2 * np.sqrt(squared))).max())
