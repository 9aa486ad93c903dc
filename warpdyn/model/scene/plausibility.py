"""Find implausible values of a scene and of its integration step before samples are drawn and kernels compiled."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.plausibility.check import Mistakes
from warpdyn.foundations.core.plausibility.frames import FRAME_PERIOD
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.designs import OneMotionPerStructure, Stripes
from warpdyn.model.ground_motions.event_sequences import EventSequence
from warpdyn.model.ground_motions.excitation import Excitation
from warpdyn.model.ground_motions.filtered_noise import FilteredNoise
from warpdyn.model.ground_motions.forces import ForceHistory, FreeVibration, HarmonicForce
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.measures.one_component import AverageSpectralAcceleration, SpectralAcceleration
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.motions_at_sites import MotionsAtSites
from warpdyn.model.ground_motions.pairs_of_motions import PairOfMotions, components_of
from warpdyn.model.ground_motions.plausibility import add_motions, add_weakest_motions, peak_of_noise
from warpdyn.model.ground_motions.wind.force_stripes import ForceStripes
from warpdyn.model.scene.building_plausibility import add_building
from warpdyn.model.scene.portfolio import Portfolio
from warpdyn.model.scene.scatter import (
    GivenFactors,
    GivenValues,
    ParameterScatter,
    RandomFactor,
    RandomScatter,
    RandomValue,
    Scatter,
    central,
    combined,
)
from warpdyn.model.scene.scene import Scene
from warpdyn.model.scene.spring_plausibility import add_lumped, add_scatter_of_frame
from warpdyn.model.structures.linear_system import LinearSystem
from warpdyn.model.structures.lumped.matrices import INCIDENCE
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.shear_building import ShearBuilding
from warpdyn.model.structures.structure import Structure

FREE = 1e-12  # a mode is a free motion if its squared frequency is below this share of the highest one (rounding)
MOST_GIVEN = 1024  # of the structures of GivenValues, at most this many are checked, at even distances
LONGEST_FORCE_STEP = 1.0  # s; unlike records, forces are often given at only a few points
LEAST_SAMPLES = 16  # of force histories whose step is compared with the first period; others are pulses of a few points
# OpenQuake's name of an intensity measure -> name of the check of its levels. Accelerations have "intensity_level".
LEVEL_BANDS = {
    "PGV": "velocity_level",
    "PGD": "displacement_level",
    "IA": "arias_level",
    "CAV": "absolute_velocity_level",
}


def warn_of_implausible(
    scene: Scene, *, step: float | None = None, longest_step: float | None = None, is_live: bool = False
) -> None:
    """Give one warning that lists all implausible values of a scene and of its integration step.

    Args:
        scene: The scene.
        step: Integration step [s]; None: the run chooses it.
        longest_step: Upper bound of the step that the run chooses [s]; None: no bound.
        is_live: Whether the motion of the scene is only the form of one that arrives later.
    """
    findings = PlausibilityFindings()
    structure, excitation = scene.structure, scene.excitation
    parts: list[tuple[str, Structure, Scatter]]
    if isinstance(structure, Portfolio):
        parts = [(f" of archetype {n!r}", a.building, a.scatter) for n, a in structure.archetypes.items()]
    else:
        parts = [("", structure, scene.scatter)]
    period = 0.0
    is_shaken = excitation.is_design or isinstance(excitation, EventSequence | FilteredNoise)
    for where, one, scatter in parts:
        if isinstance(one, LumpedStructure) and one.is_machine:  # usual values are those of buildings and earthquakes
            period = max(period, one.fundamental_period)
            continue
        period = max(period, _add_structure(findings, one, scatter, where, is_shaken=is_shaken))
        if isinstance(one, ShearBuilding):
            _add_start_and_forces(findings, excitation, one)
    if not structure.is_machine:
        _add_excitation(findings, excitation, period)
    if scene.control is not None:
        # Runs without control do not import it.
        from warpdyn.model.control.plausibility import add_control, add_delay, add_sensors, compared_peak

        # Tyres and suspensions isolate machines from most of the acceleration of a road.
        peak, of = (None, "") if structure.is_machine else compared_peak(excitation, structure, is_live=is_live)
        add_control(findings, scene.control, structure, peak, of)
        if not structure.is_machine:
            add_sensors(findings, scene.control, structure, excitation, is_live=is_live)
        add_delay(findings, scene.control.delay, period, None if is_live else scene.shortest_run)
    for given in (step, longest_step):
        if isinstance(given, int | float) and period > 0:
            # No method can resolve a vibration if the step is as long as the period.
            findings.add("integration_step", given, f", with a first period of {period:.3g} s,", high=period)
    if scene.tail is not None:
        findings.add("tail", scene.tail)
    if scene.record_from > 0 and (scene.tail is not None or not excitation.has_tail):
        # After `record_from`, the run must continue for at least one period.
        where = f", which leaves less than the first period of {period:.3g} s of the run's {scene.shortest_run:.4g} s,"
        latest = max(scene.shortest_run - period, 1e-3 * scene.record_from)
        findings.add("record_from", scene.record_from, where, high=latest)
    if scene.collapse_drift_ratio is not None:
        findings.add("collapse_drift_ratio", scene.collapse_drift_ratio)
    findings.warn()


def _add_structure(
    findings: PlausibilityFindings, structure: Structure, scatter: Scatter, where: str, *, is_shaken: bool
) -> float:
    """Add implausible values of a structure and its scatter to `findings`; return its longest first period [s]."""
    for name, spread in scatter.items():
        if name == INCIDENCE:
            findings.add("incidence_angle", np.abs(_ends(spread)), where)
        if isinstance(spread, GivenFactors) or (isinstance(spread, GivenValues) and structure.is_scaled):
            given = np.where(spread.values > 0, spread.values, np.nan)  # 0 is valid for damping; others are errors
            findings.add("given_factor", given, f" of {name}{where}")
            # Damping may be varied from 0 to several times the nominal one.
            if name not in ("damping", "damping_ratio") and np.isfinite(given).any():
                findings.add("median_given_factor", np.nanmedian(given), f" of {name}{where}")
        if isinstance(spread, RandomFactor | RandomValue):
            low, high = spread.distribution.from_standard_normal(np.array([0.0, 2.0]))  # median and 98 % quantile
            if isinstance(spread, RandomFactor):
                findings.add("random_factor", [low, high], f" of {name}{where}")
                continue
            nominal = np.abs(structure.nominal_values[name])
            with np.errstate(divide="ignore", invalid="ignore"):
                ratios = np.array([low, high])[:, None] / np.where(nominal > 0, nominal, np.nan).ravel()
            # The check uses both quantiles: the median of a variable near 0, such as a damping ratio, may be small.
            findings.add("random_value", np.abs(ratios), f" of {name}{where}")
    if isinstance(structure, LumpedStructure):
        values = {**structure.parameters, **central(structure, scatter)}
        add_scatter_of_frame(findings, structure, scatter, where)
        if structure.problem(values):
            return 0.0  # the run reports it
        add_lumped(findings, structure, values, where)
        matrices, mistakes = structure.central_matrices(values), FRAME_PERIOD if hasattr(structure, "frame") else None
        return _add_linear_system(findings, matrices, mistakes, is_shaken=is_shaken)
    if isinstance(structure, LinearSystem):
        matrices = {name: structure.parameters[name] for name in structure.parameters}
        factors = central(structure, scatter)
        if any(not factor > 0 for name, factor in factors.items() if name != "damping"):
            return 0.0  # the run itself raises an error for these factors
        matrices |= {name: matrices[name] * factor for name, factor in factors.items()}
        return _add_linear_system(findings, matrices, is_shaken=is_shaken)
    assert isinstance(structure, ShearBuilding)
    return add_building(findings, structure, _values(structure, scatter), where, is_shaken=is_shaken)


def _ends(spread: ParameterScatter) -> np.ndarray:
    """Return the 2 % and 98 % quantiles of a random value, or all given values."""
    if isinstance(spread, GivenValues):
        return np.asarray(spread.values)
    assert isinstance(spread, RandomScatter)
    return spread.distribution.from_standard_normal(np.array([-2.0, 2.0]))


def _values(building: ShearBuilding, scatter: Scatter) -> dict[str, np.ndarray]:
    """Return the parameters of a building, shape [row, storey] or [row].

    With GivenValues, there is one row per given structure (at most MOST_GIVEN), otherwise one row with the medians.
    """
    given = {name: spread for name, spread in scatter.items() if isinstance(spread, GivenValues)}
    count = min((len(spread.values) for spread in given.values()), default=1)
    rows = np.unique(np.linspace(0, count - 1, min(count, MOST_GIVEN)).astype(int))
    values = dict(building.parameters) | central(
        building, {name: spread for name, spread in scatter.items() if name not in given}
    )
    found = {name: np.broadcast_to(value, (rows.size, *np.shape(value))) for name, value in values.items()}
    for name, spread in given.items():
        found[name] = combined(building.nominal_values[name], spread, np.empty((0, rows.size)), rows).T
    return found


def _add_linear_system(
    findings: PlausibilityFindings,
    matrices: Mapping[str, np.ndarray],
    mistakes: Mistakes | None = None,
    *,
    is_shaken: bool,
) -> float:
    """Add implausible values of a linear system to `findings`; return its first period [s].

    Args:
        findings: Implausible values found so far.
        matrices: The matrices "mass", "damping" and "stiffness".
        mistakes: Likely mistakes that lead to an unusual period; None: those of a building.
        is_shaken: Whether the base moves.
    """
    mass, damping, stiffness = matrices["mass"], matrices["damping"], matrices["stiffness"]
    factor = np.linalg.inv(np.linalg.cholesky(mass))
    squared, shapes = np.linalg.eigh(factor @ stiffness @ factor.T)
    first = int((squared > FREE * squared[-1]).argmax())  # the lowest mode with a stiffness
    omega, shape = float(np.sqrt(squared[first])), factor.T @ shapes[:, first]
    period = 2 * np.pi / omega
    findings.add("first_period", period, mistakes=mistakes)
    ratio = float(shape @ damping @ shape) / (2 * omega)
    if damping.any():
        findings.add("damping_ratio", ratio)
    elif is_shaken:
        findings.add("no_damping", 0.0)
    return period


def _add_start_and_forces(findings: PlausibilityFindings, excitation: Excitation, building: ShearBuilding) -> None:
    """Add implausible initial displacements, initial velocities and forces of a building to `findings`."""
    height, mass = building.parameters["height"], building.parameters["mass"]
    if isinstance(excitation, FreeVibration | HarmonicForce | ForceHistory):
        displacement, velocity = excitation.initial_state(building.dofs)
        findings.add("initial_drift_ratio", np.abs(np.diff(displacement, prepend=0.0)) / height, along="storey")
        leads_to = np.abs(velocity).max() * building.fundamental_period / (2 * np.pi)
        findings.add("initial_velocity", leads_to / height.sum())
    if isinstance(excitation, HarmonicForce | ForceHistory | ForceStripes):
        if isinstance(excitation, HarmonicForce):
            at_each = np.abs(excitation.amplitude)
        else:
            at_each = np.max([np.abs(history.values).max(axis=0) for history in excitation.motions], axis=0)
        if at_each.any():
            findings.add("force_over_weight", at_each.max() / (STANDARD_GRAVITY * mass.sum()))
            shear = np.cumsum(at_each[::-1])[::-1]  # shear of each storey if all forces act in the same direction
            findings.add("drift_ratio_of_force", (shear / building.parameters["stiffness"] / height).max())


def _add_excitation(findings: PlausibilityFindings, excitation: Excitation, period: float) -> None:
    """Add implausible values of a scene's excitation (steps, peaks, scale factors, levels) to `findings`.

    Args:
        findings: Implausible values found so far.
        excitation: The excitation.
        period: Longest first period of the structures [s]; 0: unknown.
    """
    if isinstance(excitation, ForceHistory | ForceStripes):
        longest = max(history.step for history in excitation.motions)
        findings.add("record_step", longest, " of the force history", high=LONGEST_FORCE_STEP)
        is_sampled = all(len(history.values) >= LEAST_SAMPLES for history in excitation.motions)
        if isinstance(excitation, ForceStripes) and is_sampled and period > 0:
            findings.add("force_step_over_period", longest / period, f" of {period:.3g} s")
    if isinstance(excitation, FilteredNoise):
        for name in ("ground_damping_ratio", "filter_damping_ratio"):
            if hasattr(excitation.spectrum, name):
                findings.add("ground_damping_ratio", getattr(excitation.spectrum, name), f" ({name}) of the noise")
        findings.add("record_step", excitation.interval, " of the noise")
        findings.add("peak_ground_acceleration", peak_of_noise(excitation), " of the noise")
        return
    designs = excitation.events if isinstance(excitation, EventSequence) else {"": excitation}
    strongest = []
    for event, design in designs.items():
        if not isinstance(design, Excitation) or not design.is_design:
            continue
        where = f" of event {event!r}" if event else ""
        both = [motion for motion in design.motions if isinstance(motion, GroundMotion | PairOfMotions)]
        motions = [component for motion in both for component in components_of(motion)]
        add_motions(findings, motions, where)
        if not isinstance(design, Stripes):  # Stripes scale the motions to levels, so that their unit has no effect
            add_weakest_motions(findings, motions, where)
        if isinstance(measure := getattr(design, "measure", None), IntensityMeasure):
            _add_measure(findings, measure, where)
        if isinstance(design, Stripes):
            _add_levels(findings, design, where)
            strongest.append(np.inf)  # the levels of Stripes are checked instead
        else:
            scale = np.ones(1)
            if isinstance(design, OneMotionPerStructure | MotionsAtSites):
                scale = np.asarray(design.scale)
            findings.add("scale_factor", np.median(scale), where)
            peak, of = (
                np.array([motion.peak_ground_acceleration for motion in both]),
                getattr(design, "motion", None),
            )
            # If the motion of each factor is unknown, assume the largest factor for the strongest motion.
            strongest.append(scale.max() * peak.max() if of is None else (scale * peak[np.asarray(of)]).max())
    # It is sufficient if one event of a sequence is strong: an aftershock may be weak.
    if strongest and max(strongest) < np.inf:
        findings.add("strongest_motion", max(strongest))


def _add_levels(findings: PlausibilityFindings, stripes: Stripes, where: str) -> None:
    """Add implausible intensity levels, and implausible scale factors of motions to these levels, to `findings`."""
    levels, is_acceleration = np.asarray(stripes.levels), stripes.intensity_units == "g"
    band = "intensity_level" if is_acceleration else LEVEL_BANDS.get(stripes.measure.kind)
    if band:  # a measure that a user wrote has no usual values
        findings.add(band, levels, where)
        findings.add(f"lowest_{band}", levels.min(), where)
    motion, level = stripes.places
    factors = stripes.measure.scale_factors(levels[level], stripes.intensities[motion])
    findings.add("scale_factor" if is_acceleration else "scale_factor_to_level", np.median(factors), where)


def _add_measure(findings: PlausibilityFindings, measure: IntensityMeasure, where: str) -> None:
    if isinstance(measure, SpectralAcceleration):
        findings.add("measure_period", measure.period, where)
    elif isinstance(measure, AverageSpectralAcceleration):
        findings.add("measure_period", measure.periods, where)
