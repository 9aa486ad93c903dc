"""What is implausible in isolators, dampers and stops: parameters by themselves, and beside the building's own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.structures.shear_building import ShearBuilding

Values = Mapping[str, np.ndarray]


def add_isolators(findings: PlausibilityFindings, building: ShearBuilding, values: Values, where: str) -> None:
    """Add what is implausible in isolators.

    Args:
        findings: What has been found so far.
        building: The building.
        values: Its parameters, or those of several of its kind, shape [row, storey].
        where: Which building it is, in words, or nothing.
    """
    mass = np.cumsum(values["mass"][:, ::-1], axis=1)[:, ::-1]  # above each storey
    weight = STANDARD_GRAVITY * mass
    if "radius" in values:
        findings.add("pendulum_radius", values["radius"], where, along="storey")
    if "friction_coefficient" in values:
        friction = np.where(values["friction_coefficient"] > 0, values["friction_coefficient"], np.nan)
        findings.add("friction_coefficient", friction, where, along="storey")
    if "weight" in values:
        findings.add("bearing_weight_over_weight", values["weight"] / weight, where, along="storey")
    is_isolated = ~building.own_storeys
    is_isolated[1:] &= np.arange(1, building.storeys) < building.storeys - 1  # the last one is a tuned mass damper
    if not is_isolated.any():
        return
    after = _stiffness_after_yield(building, values)
    with np.errstate(divide="ignore", invalid="ignore"):
        period = np.where(is_isolated & (after > 0), 2 * np.pi * np.sqrt(mass / after), np.nan)
    if "yield_force" in values:
        strength = np.where(is_isolated, values["yield_force"], np.nan)
        findings.add("isolator_strength_over_weight", strength / weight, where, along="storey")
        findings.add("isolator_yield_displacement", strength / values["stiffness"], where, along="storey")
    findings.add("isolated_period", period, where, along="storey")
    if is_isolated[0] and building.storeys > 1:
        findings.add("base_mass_over_floor", values["mass"][:, 0] / values["mass"][:, 1], where)
    if "damper_coefficient" in values:
        coefficient = np.where(is_isolated & (values["damper_coefficient"] > 0), values["damper_coefficient"], np.nan)
        findings.add("damper_force_over_weight", coefficient / weight, where, along="storey")


def _stiffness_after_yield(building: ShearBuilding, values: Values) -> np.ndarray:
    """Return the stiffness of each storey after yield [N/m], shape [row, storey]; NaN where its law has none."""
    laws = building.storey_laws * (building.storeys if len(building.storey_laws) == 1 else 1)
    after = np.full(values["stiffness"].shape, np.nan)
    for storey, law in enumerate(laws):
        if law == "lead_rubber_bearing":
            after[:, storey] = values["post_yield_stiffness"][:, storey]
        elif law == "friction_pendulum":
            after[:, storey] = values["weight"][:, storey] / values["radius"][:, storey]
        elif law in ("bilinear", "bouc_wen"):
            after[:, storey] = (values["hardening_ratio"] * values["stiffness"])[:, storey]
        elif law == "elastic":
            after[:, storey] = values["stiffness"][:, storey]
    return after


def add_devices(findings: PlausibilityFindings, values: Values, where: str) -> None:
    """Add what is implausible in friction dampers, viscous dampers and stops; arguments as of `add_isolators`."""
    if "slip_force" in values:
        is_there = (values["slip_force"] > 0) & (values["brace_stiffness"] > 0)
        brace = np.where(is_there, values["brace_stiffness"], np.nan)
        findings.add("slip_drift_ratio", values["slip_force"] / brace / values["height"], where, along="storey")
    if "damper_coefficient" in values:
        is_there = values["damper_coefficient"] > 0
        findings.add(
            "velocity_exponent", np.where(is_there, values["velocity_exponent"], np.nan), where, along="storey"
        )
        is_there = is_there & (values["velocity_exponent"] < 1)
        if "linear_velocity" in values:
            linear = np.where(is_there, values["linear_velocity"], np.nan)
            findings.add("linear_velocity", linear, where, along="storey")
    if "contact_stiffness" in values:
        is_there = values["contact_stiffness"] > 0
        stop = np.where(is_there, values["contact_stiffness"], np.nan)
        findings.add("stop_stiffness_over_storey", stop / values["stiffness"], where, along="storey")
        findings.add("restitution", np.where(is_there, values["restitution"], np.nan), where, along="storey")
