"""Find implausible values of lumped structures: of their springs, and of the buildings that builders make."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.engine.methods.undamped_modes import undamped
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.plausibility.check import Mistakes
from warpdyn.foundations.core.plausibility.frames import FRAME_PERIOD, FRAME_YIELD
from warpdyn.foundations.core.plausibility.table import CHECKS
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.scene.scatter import GivenFactors, GivenValues, Scatter, combined
from warpdyn.model.structures.builders.flexural_shear_building import FlexuralShearBuilding
from warpdyn.model.structures.builders.torsional_building import TorsionalBuilding
from warpdyn.model.structures.lumped.matrices import OF_MEMBERS
from warpdyn.model.structures.lumped.structure import LumpedStructure

FREE = 1e-12  # a motion is free if its squared frequency is at most this share of the highest one (rounding)
LOW_SHARE, LOW = 0.05, -1.6449  # share of structures, and the standard normal value that it does not exceed
FEWEST_STRUCTURES = 3  # structures whose median is compared with each of them
MAY_BE_SMALL = ("area", "second_moment")  # given values, for example of a damaged member in one structure
LEAST_STOREY_HEIGHT = 1.5  # m; the springs of a lower storey may be bearings
# Parameter of springs -> name of its check.
OF_SPRINGS = {
    "deformation_capacity": "spring_deformation_capacity",
    "clearance": "spring_clearance",
    "hertz_stiffness": "hertz_stiffness",
    "contact_stiffness": "spring_contact_stiffness",
    "radius": "spring_radius",
    "restitution": "restitution",
}


STIFF_HINGE = 100.0  # usual hinges are 10 to 60 times as stiff as their members


def add_lumped(
    findings: PlausibilityFindings, structure: LumpedStructure, values: Mapping[str, np.ndarray], where: str
) -> None:
    """Add implausible values of springs, heights and plans of a lumped structure to `findings`.

    Args:
        findings: Implausible values found so far.
        structure: The structure.
        values: Its parameters.
        where: Words that identify the structure, such as " of archetype 'old'", or "".
    """
    rotates = np.array(structure.kinds.rotating["spring"])
    is_frame = hasattr(structure, "frame")  # runs of other structures do not import frames
    names = structure.names_along("spring")

    def add(check: str, quantity: np.ndarray, mistakes: Mistakes | None = None) -> None:
        found = quantity.tolist()
        findings.add_each(check, found, lambda place: f" of spring {names[place]!r}{where}", mistakes=mistakes)

    capacity = getattr(structure, "drift_capacity", None)  # of frames, which runs of other structures do not import
    if capacity is not None:
        findings.add("collapse_drift_ratio", capacity, f" (drift_capacity){where}")
        values = {name: each for name, each in values.items() if name != "deformation_capacity"}  # follows from it
    for name, check in OF_SPRINGS.items():
        if name in values:
            own = values[name] if name == "restitution" else np.where(rotates, np.nan, values[name])
            add(check, np.broadcast_to(own, rotates.shape))
    if "yield_force" in values:
        with np.errstate(divide="ignore", invalid="ignore"):
            yields = np.where(values["stiffness"] > 0, values["yield_force"] / values["stiffness"], np.nan)
        is_nominal = values["yield_force"] == structure.parameters["yield_force"]
        is_warned = is_nominal & np.isin(names, list(getattr(structure, "implausible_hinges", ())))
        yields = np.where(is_warned, np.nan, yields)
        if is_frame:
            from warpdyn.model.structures.frames.hinges.plausibility import STRONG_ROTATION

            # The constructor compares nominal hinges with their members. They may be much stiffer, or stay elastic.
            is_usual = (yields >= CHECKS["spring_yield_rotation"].low) & (yields < STRONG_ROTATION / STIFF_HINGE)
            yields = np.where(rotates & ((is_nominal & ~is_usual) | (yields >= STRONG_ROTATION)), np.nan, yields)
        add("spring_yield_deformation", np.where(rotates, np.nan, yields), FRAME_YIELD[False] if is_frame else None)
        add("spring_yield_rotation", np.where(rotates, yields, np.nan), FRAME_YIELD[True] if is_frame else None)
        strength = np.nansum(np.where(rotates, np.nan, values["yield_force"]))
        moving = values["mass"][~np.array(structure.kinds.rotating["dof"])].sum()
        if strength > 0 and moving > 0 and not is_warned.any():
            findings.add("springs_yield_over_weight", strength / (STANDARD_GRAVITY * moving), where)
    if structure.storeys:
        heights = values["height"]
        if not isinstance(structure, FlexuralShearBuilding | TorsionalBuilding):
            heights = np.where(heights < LEAST_STOREY_HEIGHT, np.nan, heights)  # may be bearings
        findings.add("storey_height", heights, where, along="storey")
    if (is_frame or isinstance(structure, FlexuralShearBuilding)) and structure.storeys > 1:
        ratio = structure.fundamental_period / values["height"].sum()
        findings.add("first_period_over_height", ratio, where, mistakes=FRAME_PERIOD if is_frame else None)
    if isinstance(structure, TorsionalBuilding):
        sides = np.diff(structure.plan, axis=1).ravel()
        findings.add("plan_side", sides, where)
        radii = np.sqrt(values["mass"][2::3] / values["mass"][0::3])
        findings.add("gyration_over_plan", radii / (0.5 * np.hypot(*sides)), where, along="floor")
    one = {name: np.asarray(each)[None] for name, each in values.items()}
    if "weight" in values:
        findings.add("slider_weight_over_weight", _weight_over_freed(structure, one), where)
    if "impact_mass" in values:
        add("impact_mass_over_masses", values["impact_mass"] / _masses_of_impact(structure, one))


def add_scatter_of_frame(
    findings: PlausibilityFindings, structure: LumpedStructure, scatter: Scatter, where: str
) -> None:
    """Add implausible given masses and sections and random yield moments of a frame to `findings`.

    Args:
        findings: Implausible values found so far.
        structure: The frame.
        scatter: Its scatter.
        where: Words that identify the structure, such as " of archetype 'old'", or "".
    """
    for name in (*OF_MEMBERS, "mass") if hasattr(structure, "frame") else ():
        spread, nominal = scatter.get(name), structure.nominal_values[name]
        if isinstance(spread, GivenValues) and not isinstance(spread, GivenFactors):
            given = spread.in_structures(nominal).reshape(len(spread.values), -1)
            median = np.median(given, axis=0)
            # The run refuses values that are not above 0.
            is_given = (nominal > 0) & (median > 0)
            ratios = np.where(is_given, median, np.nan) / np.where(is_given, nominal, np.nan)
            along = "dof" if name == "mass" else "member"
            places = [f" of {along} {place!r}{where}" for place in structure.names_along(along)]
            findings.add_each(f"given_{name}", ratios.tolist(), places.__getitem__)
            _add_one_given(findings, name, np.where((given > 0) & is_given, given, np.nan), places)
    spread, moments = scatter.get("yield_force"), getattr(structure, "gravity_moments", np.zeros(0))
    if spread is None or not moments.any():
        return
    nominal = structure.nominal_values["yield_force"]
    if isinstance(spread, GivenValues):
        low = np.broadcast_to(np.quantile(spread.in_structures(nominal), LOW_SHARE, axis=0), nominal.shape)
    else:
        normals = np.full((spread.variables(len(nominal)), 1), LOW)
        low = combined(nominal, spread, normals, slice(0, 1), spread.varied("yield_force", structure))[:, 0]
    first = len(nominal) - len(moments)
    own, low = nominal[first:], low[first:]
    # The constructor has warned of moments above the nominal ones.
    over = np.where((low > 0) & (moments <= own), moments / np.where(low > 0, low, 1.0), np.nan)
    names = structure.names_along("spring")[first:]
    findings.add_each("gravity_over_random_yield", over.tolist(), lambda place: f" of {names[place]!r}{where}")


def _add_one_given(findings: PlausibilityFindings, name: str, given: np.ndarray, places: list[str]) -> None:
    """Add the given value that differs most from the median of the structures, if it does implausibly, to `findings`.

    Args:
        findings: Implausible values found so far.
        name: Name of the parameter.
        given: Its values in structures, NaN for values that are not checked, shape [structure, place].
        places: Words for each place, such as " of member 'C1'".
    """
    if len(given) < FEWEST_STRUCTURES:
        return
    over = given / np.median(given, axis=0)
    distance = np.log(over) if name in MAY_BE_SMALL else np.abs(np.log(over))
    if np.isfinite(distance).any():
        structure, place = np.unravel_index(int(np.nanargmax(distance)), over.shape)
        words = f"{places[place]} in structure {structure} over the median of all structures"
        findings.add(f"one_given_{name}", over[structure, place], words)


def _weight_over_freed(structure: LumpedStructure, one: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the weights on sliders over the weight that moves freely without them, shape [component].

    NaN for a component of the base motion in which other springs hold the structure, or without sliders.

    Args:
        structure: The structure.
        one: Its parameters, with a leading dimension of length 1.
    """
    weights = np.nan_to_num(one["weight"][0])
    others = np.where(weights > 0, 0.0, np.nan_to_num(one["stiffness"]))
    mass = structure.mass_matrices(one)
    squared, shapes = undamped(mass, structure.stiffness_matrices(one, others, has_gravity=False), is_clipped=False)
    free = shapes[0][:, squared[0] <= FREE * squared[0, -1]]
    load = structure.load_masses(one)[0] @ structure.influence
    moves = free @ (free.T @ load)  # displacements of the freed part under unit displacements, shape [dof, component]
    slides = structure.directions @ moves
    freed = STANDARD_GRAVITY * np.einsum("ic,ic->c", moves, load)
    return np.where(freed > 0, weights @ slides**2, np.nan) / np.where(freed > 0, freed, 1.0)


def _masses_of_impact(structure: LumpedStructure, one: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the mass of an impact along each spring [kg], shape [spring]: m1 m2 / (m1 + m2) between two masses."""
    inverse = np.linalg.inv(structure.mass_matrices(one)[0])
    return 1 / np.einsum("ki,ij,kj->k", structure.directions, inverse, structure.directions)
