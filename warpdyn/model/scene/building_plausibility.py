"""What is implausible in a shear building: by what its parameters lead to, which tells wrong units of each of them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.scene.device_plausibility import add_devices, add_isolators
from warpdyn.model.structures.modal import chain_stiffness_matrix
from warpdyn.model.structures.physics import effective_stiffness, storey_weight_over_height
from warpdyn.model.structures.protection import CAPACITY_RATIO
from warpdyn.model.structures.shear_building import ShearBuilding

Values = Mapping[str, np.ndarray]


def add_building(
    findings: PlausibilityFindings, building: ShearBuilding, values: Values, where: str, *, is_shaken: bool
) -> float:
    """Add what is implausible in a building; return its longest first period [s], 0 where no row of it has one.

    Args:
        findings: What has been found so far.
        building: The building.
        values: Its parameters, or those of several of its kind, shape [row, storey] or [row].
        where: Which building it is, in words, or nothing.
        is_shaken: Whether ground motions act on it, so that damping is wanted.
    """
    is_sound = _has_period(values)
    if not is_sound.any():  # the run refuses what is out of bounds
        return 0.0
    values = {name: rows[is_sound] for name, rows in values.items()}
    own = building.own_storeys
    mass, height = values["mass"], values["height"]
    weight = STANDARD_GRAVITY * np.cumsum(mass[:, ::-1], axis=1)[:, ::-1]  # above each storey
    findings.add("storey_height", np.where(own, height, np.nan), where, along="storey")
    findings.add("displacement_capacity", np.where(own, np.nan, height * CAPACITY_RATIO), where, along="storey")
    for name in ("mass", "stiffness", "gravity_load"):
        if name in values:
            findings.add(f"{name}_of_neighbours", _ratio_to_neighbour(np.where(own, values[name], np.nan)), where)
    for name, length in (("drift_capacity", height), ("drift_ratio_capacity", np.ones_like(height))):
        if name in values:
            findings.add("collapse_drift_ratio", np.where(own, values[name] / length, np.nan), where, along="storey")
    if "gravity_load" in values:
        load = values["gravity_load"]
        findings.add("gravity_load_over_weight", load.sum(axis=1) / weight[:, 0], where)
        ratio = storey_weight_over_height(values) / values["stiffness"]
        if load.any():
            findings.add("stability_coefficient", ratio.max(axis=1), where)
    period = _first_mode(values)[0]
    findings.add("first_period", period, where)
    if own.sum() > 1:  # a single storey may be an oscillator, whose height only divides its drift
        findings.add("first_period_over_height", period / np.where(own, height, 0.0).sum(axis=1), where)
    if "yield_force" in values:
        # Isolators yield, or slide, at the least displacement.
        strength = np.where(own, values["yield_force"], np.nan)
        findings.add("yield_drift_ratio", strength / values["stiffness"] / height, where, along="storey")
        if own[0]:
            findings.add("yield_base_shear_coefficient", strength[:, 0] / weight[:, 0], where)
    if "plastic_drift_to_capping" in values:
        findings.add("plastic_drift_ratio", values["plastic_drift_to_capping"] / height, where, along="storey")
    if "clearance" in values:
        clearance = np.where(values["contact_stiffness"] > 0, values["clearance"], np.nan)
        findings.add("clearance_over_height", np.where(own, clearance / height, np.nan), where, along="storey")
    if "slip_force" in values:
        slip = np.where(values["slip_force"] > 0, values["slip_force"], np.nan)  # 0 where there is no damper
        findings.add("slip_force_over_weight", slip / weight, where, along="storey")
    add_devices(findings, values, where)
    add_isolators(findings, building, values, where)
    if "damper_coefficient" in values and own.all():
        # On isolators, or under a mass damper, the first mode hardly moves the other storeys' dampers.
        _add_dampers(findings, values, weight, where)
    _add_damping(findings, building, values, where, is_shaken=is_shaken)
    return float(period.max())


def _add_damping(
    findings: PlausibilityFindings, building: ShearBuilding, values: Values, where: str, *, is_shaken: bool
) -> None:
    """Add a damping ratio that is implausible; that of dashpots is theirs in the first mode."""
    if "damping_ratio" in values:
        ratio = values["damping_ratio"]
    elif "damping_coefficient" in values:
        ratio = _first_mode_damping(values, values["damping_coefficient"])
    else:
        ratio = np.zeros(1)
    if ratio.any():
        findings.add("damping_ratio", ratio, where)
    elif is_shaken and not building.devices and building.own_storeys.all():
        findings.add("no_damping", ratio, where)


def _add_dampers(findings: PlausibilityFindings, values: Values, weight: np.ndarray, where: str) -> None:
    """Add implausible viscous dampers: linear ones by the damping ratio that they add, others by their force."""
    coefficient, is_linear = values["damper_coefficient"], values["velocity_exponent"] == 1
    ratio = _first_mode_damping(values, np.where(is_linear, coefficient, 0.0))
    findings.add("damper_damping_ratio", np.where(ratio > 0, ratio, np.nan), where)  # 0 where there is no damper
    # The damping ratio of a power of the velocity depends on the amplitude.
    force = np.where(~is_linear & (coefficient > 0), coefficient, np.nan)
    findings.add("damper_force_over_weight", force / weight, where, along="storey")


def _first_mode_damping(values: Values, coefficient: np.ndarray) -> np.ndarray:
    """Return the damping ratio of the first mode by storeys' dashpots of these coefficients [N s/m], shape [row]."""
    period, shape = _first_mode(values)
    drift = np.diff(shape, axis=1, prepend=0.0)
    modal_mass = (values["mass"] * shape**2).sum(axis=1)
    return (coefficient * drift**2).sum(axis=1) * period / (4 * np.pi * modal_mass)


def _ratio_to_neighbour(values: np.ndarray) -> np.ndarray:
    """Return the larger of each two neighbouring values over the smaller, NaN beside none or nothing."""
    lower, upper = np.where(values > 0, values, np.nan)[:, :-1], np.where(values > 0, values, np.nan)[:, 1:]
    return np.fmax(lower / upper, upper / lower)


def _has_period(values: Values) -> np.ndarray:
    """Return which rows have a period: masses, stiffnesses and heights above 0."""
    each = [np.isfinite(values[name]) & (values[name] > 0) for name in ("mass", "stiffness", "height")]
    return np.logical_and.reduce(each).all(axis=1)


def _first_mode(values: Values) -> tuple[np.ndarray, np.ndarray]:
    """Return first periods [s], shape [row], infinite where a storey buckles, and mode shapes, shape [row, storey].

    The buildings count as undamped; the arguments are as of `add_building`.
    """
    root = np.sqrt(values["mass"])
    matrix = chain_stiffness_matrix(effective_stiffness(values))
    squared, shapes = np.linalg.eigh(matrix / (root[:, :, None] * root[:, None, :]))
    with np.errstate(divide="ignore"):
        return 2 * np.pi / np.sqrt(np.maximum(squared[:, 0], 0.0)), shapes[:, :, 0] / root
