"""Buildings in a row that collide with their neighbours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from warpdyn.engine.laws.law import StoreyElement
from warpdyn.foundations.core.checks import checked_text, finite_numbers, real_number, shortened
from warpdyn.foundations.core.near_misses import did_you_mean, suggests_names
from warpdyn.foundations.core.output_variables import ADDED_GROUPS, BUILDING
from warpdyn.model.structures.builders.changed_structures import arguments_after, lumped, values_of_one, whole_mass
from warpdyn.model.structures.builders.flexural_shear_building import FlexuralShearBuilding
from warpdyn.model.structures.builders.rows.contacts import CONTACT_GROUP, contact_class, contact_spring
from warpdyn.model.structures.lumped.spring import Spring
from warpdyn.model.structures.lumped.structure import MOST_DOFS, LumpedStructure
from warpdyn.model.structures.shear_building import ShearBuilding

Building = ShearBuilding | LumpedStructure
# Largest difference of the levels of two floors that collide [m]: half the thickness of a thick slab.
SAME_LEVEL = 0.15
MATRICES = ("stiffness_matrix", "damping_matrix", "geometric_stiffness")
FORCES = ("N", "N m")  # units of outputs that are computed from the nominal stiffness


@suggests_names
def pounding_row(
    buildings: Mapping[str, Building],
    gaps: Sequence[float | Sequence[float] | Mapping[tuple[str, str], float]],
    *,
    contact: str | type[StoreyElement],
    **parameters: float,
) -> LumpedStructure:
    """Return buildings in a row whose floors collide with those of their neighbours (pounding).

    All bases have the same motion, along the row. A displacement is positive if the floor moves from the first building
    towards the last one. Names have the name of the building in front: degree of freedom "left u2", spring "left storey
    2", output "left drift 2" (storey drift [m], of a ShearBuilding or FlexuralShearBuilding), group "left". Contacts
    have names such as "contact left u2 - right u2"; they are in the group "contact", which does not count in the
    largest demand. A contact acts while its deformation, the displacement of the left floor less that of the
    right one, exceeds the gap, which is the parameter `clearance` of the contact and may be random.

    Inherent damping of each building is the constant damping matrix of this building alone, so that `damping_ratio`
    cannot be random. Outputs of a LumpedStructure that are forces are left out, because they would be wrong for a
    random stiffness.

    Sources: Anagnostopoulos (1988), "Pounding of buildings in series during earthquakes"; the contact laws name theirs.

    Args:
        buildings: The buildings from the first to the last, {name: building}, each with one component of base motion.
        gaps: The gap between each building and the next one [m], one entry for each pair of neighbours: one value for
            all floors, a list with one value per common level from the ground up, or a dictionary {(floor of the first
            building, floor of the second one): gap}, such as {("u2", "u3"): 0.05}. The first two need floors at equal
            levels (within 0.15 m) up to the top of the lower building, and buildings that are a ShearBuilding or a
            FlexuralShearBuilding.
        contact: Name or class of the contact law of all contacts: "one_sided_gap" (linear, or with a restitution by
            different slopes), or one of `warpdyn.laws.CONTACTS`, such as "kelvin_voigt_contact" or "ye_li_zhu_contact".
        **parameters: Parameters of the contact law except `clearance`, one value each, such as `contact_stiffness`
            [N/m] or `hertz_stiffness` [N/m^1.5], and `restitution` [1]. `impact_mass` [kg] is that of the two floors,
            m1 m2 / (m1 + m2), if it is not given.

    Returns:
        The row.

    Raises:
        ValueError: If there are fewer than two buildings, a number of gaps is wrong, a gap is negative, floors are at
            different levels, a name is unknown, a parameter is wrong, or there are more than 64 degrees of freedom.
        TypeError: If `buildings` or `gaps` is of another type, or a building of another class.

    Example:
        >>> row = wd.pounding_row(
        ...     {"left": building, "right": building}, [0.03],
        ...     contact="ye_li_zhu_contact", hertz_stiffness=2.75e9, restitution=0.65,
        ... )
        >>> row.dof_names
        ('left u1', 'left u2', 'right u1', 'right u2')
        >>> row.names_along("spring")[-2:]
        ('contact left u1 - right u1', 'contact left u2 - right u2')
    """
    if not isinstance(buildings, Mapping):
        raise TypeError(
            "pounding_row(): buildings must be a dictionary from the first to the last building, such as {'left': ..., "
            f"'right': ...}}, got {shortened(buildings)}"
        )
    if len(buildings) < 2:
        raise ValueError(f"pounding_row(): buildings must contain at least two buildings, got {len(buildings)}")
    names = [_name(name) for name in buildings]
    wholes = {name: lumped("pounding_row", building) for name, building in buildings.items()}
    _check(wholes)
    law = contact_class("pounding_row(): contact", contact)
    if isinstance(gaps, str | Mapping) or not isinstance(gaps, Sequence | np.ndarray):
        raise TypeError(
            f"pounding_row(): gaps must be a list with one entry per pair of neighbours, got {shortened(gaps)}"
        )
    if len(gaps) != len(names) - 1:
        raise ValueError(
            f"pounding_row(): gaps has {len(gaps)} entries, but {len(names)} buildings have {len(names) - 1} pairs of "
            "neighbours: give one entry per pair"
        )
    parts = {name: _renamed(name, whole, buildings[name]) for name, whole in wholes.items()}
    masses = {
        f"{name} {dof}": float(mass)
        for name, whole in wholes.items()
        for dof, mass in zip(whole.dof_names, np.diag(whole_mass(whole)), strict=True)
    }
    contacts = []
    for place, (left, right) in enumerate(pairwise(names)):
        for (first, second), gap in _gaps(place, gaps[place], buildings, wholes, (left, right)).items():
            ends = f"{left} {first}", f"{right} {second}"
            directions = {ends[0]: 1.0, ends[1]: -1.0}
            of_ends = masses[ends[0]], masses[ends[1]]
            title = f"contact {ends[0]} - {ends[1]}"
            contacts.append(contact_spring(title, directions, law, gap, of_ends, parameters))
    return _whole_row(wholes, parts, contacts)


def _name(given: object) -> str:
    name = checked_text("pounding_row(): a name of a building", given)
    if name in (BUILDING, *ADDED_GROUPS):
        raise ValueError(
            f"pounding_row(): a building cannot have the name {name!r}, which is that of a group: rename it"
        )
    return name


def _check(wholes: Mapping[str, LumpedStructure]) -> None:
    """Raise a ValueError if a building has several components of base motion, or if there are too many floors."""
    for name, whole in wholes.items():
        if whole.components > 1:
            raise ValueError(
                f"pounding_row(): building {name!r} has {whole.components} components of base motion; give one, along "
                "the row, such as influence={'u1': 1.0}"
            )
    dofs = {name: whole.dofs for name, whole in wholes.items()}
    if sum(dofs.values()) > MOST_DOFS:
        raise ValueError(
            f"pounding_row(): the buildings have {' + '.join(map(str, dofs.values()))} = {sum(dofs.values())} degrees "
            f"of freedom, at most {MOST_DOFS} are possible: combine storeys, or give fewer buildings"
        )


def _levels(building: Building, whole: LumpedStructure) -> dict[str, float] | None:
    """Return the level of each floor above the ground [m]; None if it is unknown."""
    if isinstance(building, ShearBuilding):
        return dict(zip(whole.dof_names, np.cumsum(building.parameters["height"]).tolist(), strict=True))
    if isinstance(building, FlexuralShearBuilding):
        heights = building.floor_heights.tolist()
        return dict(zip(whole.dof_names[-len(heights) :], heights, strict=True))
    return None


def _gaps(
    place: int,
    given: Any,
    buildings: Mapping[str, Building],
    wholes: Mapping[str, LumpedStructure],
    names: tuple[str, str],
) -> dict[tuple[str, str], float]:
    """Return the gap of each pair of floors [m], {(floor of the left building, floor of the right one): gap}."""
    what = f"pounding_row(): gaps[{place}]"
    if isinstance(given, Mapping):
        if not given:
            raise ValueError(f"{what} is an empty dictionary: give at least one pair of floors")
        found = {}
        for pair, gap in given.items():
            if not isinstance(pair, tuple) or len(pair) != 2:
                raise TypeError(f"{what}: a key must be a pair of floors, such as ('u2', 'u2'), got {shortened(pair)}")
            for name, dof in zip(names, pair, strict=True):
                known = wholes[name].dof_names
                if dof not in known:
                    hint = did_you_mean(str(dof), list(known))
                    listed = ", ".join(map(repr, known[:12])) + (" ..." if len(known) > 12 else "")
                    raise ValueError(
                        f"{what} names the floor {dof!r}, but building {name!r} has no such degree of freedom{hint}; "
                        f"there are {listed}"
                    )
            found[pair] = real_number(f"{what}[{pair!r}] [m]", gap, least=0)
        return found
    pairs = _pairs_at_equal_levels(what, buildings, wholes, names)
    values = finite_numbers(what, given, "m")
    if values.shape not in ((), (len(pairs),)):
        raise ValueError(
            f"{what} must be one value or one per common level of {names[0]!r} and {names[1]!r} ({len(pairs)}), from "
            f"the ground up, got shape {list(values.shape)}"
        )
    if (values < 0).any():
        raise ValueError(f"{what} is {values.min():g} m; it must be at least 0")
    return dict(zip(pairs, np.broadcast_to(values, len(pairs)).tolist(), strict=True))


def _pairs_at_equal_levels(
    what: str, buildings: Mapping[str, Building], wholes: Mapping[str, LumpedStructure], names: tuple[str, str]
) -> list[tuple[str, str]]:
    """Return the pairs of floors at equal levels, from the ground up; refuse a floor without a partner."""
    both = []
    for name in names:
        levels = _levels(buildings[name], wholes[name])
        if levels is None:
            raise ValueError(
                f"{what}: the levels of the floors of {name!r} are unknown, because it is neither a ShearBuilding nor "
                "a FlexuralShearBuilding: give a dictionary, such as {('u2', 'u2'): 0.05}"
            )
        both.append(levels)
    top = min(max(levels.values()) for levels in both) + SAME_LEVEL
    lower = [{dof: level for dof, level in levels.items() if level <= top} for levels in both]
    for own, other, (name, neighbour) in zip(lower, lower[::-1], (names, names[::-1]), strict=True):
        for dof, level in own.items():
            if not any(abs(level - each) <= SAME_LEVEL for each in other.values()):
                raise ValueError(
                    f"{what}: floor {dof!r} of {name!r} at {level:g} m is not at the level of a floor of "
                    f"{neighbour!r}: impacts of a floor on columns are not modelled: to choose floors that "
                    "collide, give a dictionary, such as {('u2', 'u2'): 0.05}"
                )
    first, second = lower
    return [(dof, min(second, key=lambda each: abs(second[each] - level))) for dof, level in first.items()]


def _renamed(name: str, whole: LumpedStructure, building: Building) -> dict[str, Any]:
    """Return arguments of a LumpedStructure for one building, with its name in front of all names."""
    dofs = [f"{name} {dof}" for dof in whole.dof_names]
    found = arguments_after(whole, dofs, np.eye(whole.dofs))
    springs = []
    for spring in found["springs"]:
        own = copy(spring)
        own.name = f"{name} {spring.name}"
        springs.append(own)
    units = dict(zip(whole.outputs, whole.kinds.output_units, strict=True))
    outputs = {f"{name} {each}": rows for each, rows in found["outputs"].items() if units[each] not in FORCES}
    output_units = {f"{name} {each}": unit for each, unit in units.items() if unit and unit not in FORCES}
    if isinstance(building, ShearBuilding):
        for storey, dof in enumerate(dofs):
            below = {dofs[storey - 1]: -1.0} if storey else {}
            outputs[f"{name} drift {storey + 1}"] = [{dof: 1.0, **below}]
            output_units[f"{name} drift {storey + 1}"] = "m"
    groups: dict[str, list[str]] = {}
    for dim in ("dof", "spring"):
        for place, group in zip(whole.names_along(dim), whole.kinds.groups[dim], strict=True):
            groups.setdefault(group if group in ADDED_GROUPS else name, []).append(f"{name} {place}")
    rotating = zip(dofs, whole.kinds.rotating["dof"], strict=True)
    return found | {
        "dofs": dofs,
        "springs": springs,
        "outputs": outputs,
        "output_units": output_units,
        "groups": groups,
        "rotations": [dof for dof, rotates in rotating if rotates],
    }


def _whole_row(
    wholes: Mapping[str, LumpedStructure], parts: Mapping[str, dict[str, Any]], contacts: list[Spring]
) -> LumpedStructure:
    """Return all buildings and contacts as one structure."""
    given = [(wholes[name], part) for name, part in parts.items()]
    dofs = [dof for _, part in given for dof in part["dofs"]]
    masses = np.concatenate([whole.parameters["mass"] for whole, _ in given])
    coupling = block_diag(*[whole_mass(whole) for whole, _ in given]) - np.diag(masses)
    matrices = {}
    for name in MATRICES:
        if any(name in part for _, part in given):
            matrices[name] = block_diag(*[part.get(name, np.zeros((whole.dofs, whole.dofs))) for whole, part in given])
    load = None
    if any(whole.load_mass is not None for whole, _ in given):
        load = block_diag(*[whole.load_masses(values_of_one(whole))[0] for whole, _ in given])
    groups: dict[str, list[str]] = {CONTACT_GROUP: [contact.name for contact in contacts]}
    for _, part in given:
        for group, names in part["groups"].items():
            groups.setdefault(group, []).extend(names)
    influence = np.concatenate([whole.influence[:, 0] for whole, _ in given]).tolist()
    return LumpedStructure(
        dict(zip(dofs, masses.tolist(), strict=True)),
        [spring for _, part in given for spring in part["springs"]] + contacts,
        influence=dict(zip(dofs, influence, strict=True)),
        mass_matrix=coupling if coupling.any() else None,
        load_mass=load,
        outputs={name: rows for _, part in given for name, rows in part["outputs"].items()} or None,
        output_units={name: unit for _, part in given for name, unit in part["output_units"].items()} or None,
        rotations=[name for _, part in given for name in part["rotations"]],
        groups=groups,
        **matrices,
    )
