"""Find implausible values of actuators that depend on the structure and on the motions of a scene."""

from __future__ import annotations

import numpy as np

from warpdyn.engine.controllers.built_in import ConstantCommand, ContinuousSkyhook, OnOffSkyhook, SkyhookDamper
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.plausibility.table import CHECKS
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.control.actuators import Actuator, VariableDamper
from warpdyn.model.control.control import UNITS, Control
from warpdyn.model.control.state_space import state_space
from warpdyn.model.ground_motions.designs import OneMotionPerStructure, Stripes
from warpdyn.model.ground_motions.excitation import Excitation
from warpdyn.model.ground_motions.filtered_noise import FilteredNoise
from warpdyn.model.ground_motions.forces import FreeVibration
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.motions_at_sites import MotionsAtSites
from warpdyn.model.ground_motions.plausibility import peak_of_noise
from warpdyn.model.structures.structure import Structure

CONSTANT_FORCE = 0.1 * STANDARD_GRAVITY  # m/s2; constant forces are compared with this acceleration


def add_control(
    findings: PlausibilityFindings, control: Control, structure: Structure, peak: float | None, of: str
) -> None:
    """Add forces and coefficients of actuators that are too small to have an effect to `findings`.

    Args:
        findings: Implausible values found so far.
        control: The control of the structure.
        structure: The structure, which has neither free motions nor buckles. Its nominal parameters are used.
        peak: Acceleration with which forces of actuators are compared [m/s2]; None: unknown, or they are not checked.
        of: Words for this acceleration.
    """
    system = state_space(structure, ())
    places = np.stack([each.influence(structure) for each in control.actuators], axis=1)
    mobility = np.einsum("da,da->a", places, np.linalg.solve(system.mass, places))  # 1/kg
    if peak:
        given = [each.force_limit if isinstance(each, Actuator) else None for each in control.actuators]
        limits = np.array([np.nan if limit is None else limit for limit in given])
        findings.add("actuator_acceleration", limits * mobility / peak, f" {of},", along="actuator")
        forces = np.array([getattr(each, "hysteretic_force", np.nan) for each in control.actuators])
        findings.add("mr_damper_acceleration", forces * mobility / peak, f" {of},", along="actuator")
    constant = control.controller.value if isinstance(control.controller, ConstantCommand) else 0.0
    if constant and not structure.is_machine:
        pushed = [isinstance(each, Actuator) for each in control.actuators]
        held = np.where(pushed, abs(constant), np.nan)
        where = f" {CONSTANT_FORCE:.3g} m/s2,"
        findings.add("constant_force_acceleration", held * mobility / CONSTANT_FORCE, where, along="actuator")
    is_damper = np.array([isinstance(each, VariableDamper) for each in control.actuators])
    sky = control.controller.coefficient if isinstance(control.controller, SkyhookDamper) else 0.0
    if not is_damper.any() and not sky:
        return
    factor = np.linalg.inv(np.linalg.cholesky(system.mass))
    squared, shapes = np.linalg.eigh(factor @ system.stiffness @ factor.T)
    shapes = factor.T @ shapes
    of_modes = places.T @ shapes  # displacement between the ends of each actuator
    if is_damper.any():
        high = np.array([each.high if isinstance(each, VariableDamper) else 0.0 for each in control.actuators])
        is_weak = findings.add("variable_damper_ratio", (high @ of_modes**2 / (2 * np.sqrt(squared))).max())
        if isinstance(control.controller, OnOffSkyhook | ContinuousSkyhook) and not is_weak:
            closed = np.minimum(high, control.controller.high)
            findings.add("high_command_ratio", (closed @ of_modes**2 / (2 * np.sqrt(squared))).max())
        if constant > 0:
            closed = np.where(is_damper, constant, 0.0)
            findings.add("constant_damper_ratio", (closed @ of_modes**2 / (2 * np.sqrt(squared))).max())
    if sky:
        upper = shapes[[each.rules(structure).rows[0][0] for each in control.actuators]]
        ratios = sky * np.abs((of_modes * upper).sum(axis=0)) / (2 * np.sqrt(squared))
        findings.add("skyhook_ratio", ratios.max())


def add_delay(findings: PlausibilityFindings, delay: float, period: float, duration: float | None) -> None:
    """Add a delay of the control that is longer than the first period, 1 s or the run to `findings`.

    Args:
        findings: Implausible values found so far.
        delay: The delay [s].
        period: First period of the structure [s]; 0: unknown.
        duration: Duration of the shortest run [s]; None: unknown.
    """
    if 0 < period < delay:
        findings.add("control_delay_over_period", delay / period, f" of {period:.3g} s")
    elif duration is not None and delay >= duration:
        where = f", at least as long as the run of {duration:.3g} s,"
        findings.add("control_delay", delay, where, high=duration / 2)
    else:
        findings.add("control_delay", delay)


def add_sensors(
    findings: PlausibilityFindings, control: Control, structure: Structure, excitation: Excitation, *, is_live: bool
) -> None:
    """Add noise and resolutions of sensors that hide the response of a structure to `findings`.

    The expected peaks are those of an oscillator with the first period under a constant acceleration a, the peak of the
    strongest motion: a, a / omega and a / omega**2. Records amplify them 2 to 3 times, harmonic motions more. They are
    not known for all excitations.

    Args:
        findings: Implausible values found so far.
        control: The control of the structure.
        structure: The structure, which has neither free motions nor buckles.
        excitation: The excitation.
        is_live: Whether the motions are only the form of one that arrives later; then a is that of a usual earthquake.
    """
    peak = CHECKS["peak_ground_acceleration"].typical if is_live else _strongest_motion(excitation, structure)
    if not peak:
        return
    rate = float(np.abs(np.linalg.eigvals(state_space(structure, ()).dynamics)).min())
    expected = {"displacement": peak / rate**2, "velocity": peak / rate, "acceleration": peak}
    for name in ("noise", "resolution"):
        for kind, size in expected.items():
            where = f" {size:.3g} {UNITS[kind]},"
            findings.add(f"sensor_{name}_of_{kind}", getattr(control, name).get(kind, 0.0) / size, where)


def compared_peak(excitation: Excitation, structure: Structure, *, is_live: bool) -> tuple[float | None, str]:
    """Return the peak acceleration with which actuators are compared [m/s2], None if unknown, and words for it."""
    if is_live:
        low = CHECKS["strongest_motion"].low
        return low, f"{low:.3g} m/s2 (a weak earthquake)"
    if isinstance(excitation, FilteredNoise):
        return peak_of_noise(excitation), "the peak of the noise"
    if isinstance(excitation, FreeVibration):
        return _of_free_vibration(excitation, structure), "that of the free vibration in the first mode"
    peaks = _peaks_of_motions(excitation)
    return None if peaks is None else float(peaks.min()), "the peak of the weakest motion"


def _strongest_motion(excitation: Excitation, structure: Structure) -> float | None:
    """Return the peak acceleration of the strongest motion or of a free vibration [m/s2]; None if it is not known."""
    if isinstance(excitation, FilteredNoise):
        return peak_of_noise(excitation)
    if isinstance(excitation, FreeVibration):
        return _of_free_vibration(excitation, structure)
    peaks = _peaks_of_motions(excitation)
    return None if peaks is None else float(peaks.max())


def _of_free_vibration(excitation: FreeVibration, structure: Structure) -> float:
    """Return the acceleration of a start in the first mode, which has the least acceleration [m/s2]."""
    displacement, velocity = (np.abs(each).max() for each in excitation.initial_state(structure.dofs))
    rate = float(np.abs(np.linalg.eigvals(state_space(structure, ()).dynamics)).min())
    return max(rate**2 * displacement, rate * velocity)


def _peaks_of_motions(excitation: Excitation) -> np.ndarray | None:
    """Return the peak accelerations of the motions after scaling [m/s2]; None if they are not known."""
    motions = [each for each in excitation.motions if isinstance(each, GroundMotion)] if excitation.is_design else []
    if not motions or len(motions) < len(excitation.motions):
        return None
    peaks = np.array([motion.peak_ground_acceleration for motion in motions])
    if isinstance(excitation, Stripes):
        motion, level = excitation.places
        levels = np.asarray(excitation.levels)[level]
        peaks = peaks[motion] * excitation.measure.scale_factors(levels, excitation.intensities[motion])
    elif isinstance(excitation, OneMotionPerStructure | MotionsAtSites):
        scale = np.asarray(excitation.scale)
        peaks = np.append(peaks.min() * scale, peaks.max() * scale)  # which motion each scale belongs to may be random
    return peaks
