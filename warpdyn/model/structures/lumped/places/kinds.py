"""Kinds of the places of a lumped structure: which are rotations, their units, and the groups that they belong to."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from warpdyn.foundations.core.checks import checked_text, shortened
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.foundations.core.output_variables import ADDED_GROUPS, BUILDING
from warpdyn.model.structures.lumped.biaxial_spring import Component
from warpdyn.model.structures.lumped.names import check_known
from warpdyn.model.structures.lumped.spring import Spring

# A degree of freedom whose name contains one of these words, also with the name of an axis, is a rotation, unless
# `rotations` is given.
ROTATION = re.compile(r"(theta|rotation|rot|rocking|pitch|roll|yaw|phi|psi|torsion|twist|r(?=[xyz]))[xyz]?")
WORD = re.compile("[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
# Units of a translation -> units of a rotation.
OF_ROTATION = {
    "m": "rad",
    "m s-1": "rad s-1",
    "m s-2": "rad s-2",
    "N": "N m",
    "N m-1": "N m rad-1",
    "N s m-1": "N m s rad-1",
    "kg": "kg m2",
}


@dataclass(frozen=True, eq=False)
class Kinds:
    """Kinds of the degrees of freedom, springs and outputs of a lumped structure.

    Args:
        rotating: For "dof" and "spring", whether each place rotates.
        groups: For "dof" and "spring", the name of the group of each place; BUILDING if it is in no group.
        output_units: Units of each output; "" if they are unknown.
        given: The arguments from which the kinds follow, for the JSON of the structure.
    """

    rotating: Mapping[str, tuple[bool, ...]]
    groups: Mapping[str, tuple[str, ...]]
    output_units: tuple[str, ...]
    given: Mapping[str, Any]

    def units(self, dim: str, units: str) -> str:
        """Return the units of a variable along a dimension whose translations have the units `units`.

        If some of the places are rotations, the result names both units, such as "m (rad for rotations)".
        """
        if dim == "output":
            known = set(self.output_units)
            return known.pop() or units if len(known) == 1 else units
        rotating = self.rotating.get(dim, ())
        if not any(rotating) or units not in OF_ROTATION:
            return units
        return OF_ROTATION[units] if all(rotating) else f"{units} ({OF_ROTATION[units]} for rotations)"

    def of_building(self, dim: str) -> np.ndarray:
        """Return whether each place along a dimension counts in the largest demand of the building, shape [place].

        If all places are in the groups ADDED_GROUPS, all of them count.
        """
        own = ~np.isin(self.groups[dim], ADDED_GROUPS) if dim in self.groups else np.ones(len(self.output_units), bool)
        return own if own.any() else ~own

    def named(self, dim: str, names: Sequence[str], only: Collection[str]) -> tuple[np.ndarray, list[str]]:
        """Return which places along a dimension have or belong to one of the names in `only`, and unknown names.

        Args:
            dim: "dof" or "spring".
            names: Names of the places.
            only: Names of places, of biaxial springs or of groups.
        """
        found, unknown = np.zeros(len(names), dtype=bool), []
        for each in only:
            own = np.isin(self.groups[dim], [each]) | np.isin(names, [each, f"{each} x", f"{each} y"])
            unknown += [] if own.any() else [each]
            found |= own
        return found, unknown

    def unit_problem(self, demand: str, dim: str, *, added_storeys: bool = False) -> str | None:
        """Return why the largest value of a demand along a dimension is meaningless; None if all units are equal.

        Args:
            demand: Name of the demand.
            dim: Name of the dimension of its places.
            added_storeys: Whether the places in the groups ADDED_GROUPS count.
        """
        if dim == "storey":
            return None
        own = np.ones_like(self.of_building(dim)) if added_storeys else self.of_building(dim)
        if dim == "output":
            units = [unit or "an unknown unit" for unit in self.output_units]
        else:
            units = ["rad" if each else "m" for each, counts in zip(self.rotating[dim], own, strict=True) if counts]
        if len(set(units)) < 2 and (len(units) < 2 or "an unknown unit" not in units):
            return None
        remedy = "give output_units= to the LumpedStructure, or " if dim == "output" else ""
        return (
            f"the largest {demand} of all places would compare {' with '.join(dict.fromkeys(units))}: {remedy}simulate "
            f"without statistics, and select places of one unit, such as run.isel({dim}=[0])"
        )

    def coordinates(self, dims: Collection[str]) -> dict[str, tuple]:
        """Return the coordinates `..._unit` (if not all places are translations) and `..._group` (if there are groups).

        Args:
            dims: Names of dimensions.
        """
        found: dict[str, tuple] = {}
        for dim, rotating in self.rotating.items():
            if dim in dims and any(rotating):
                units = np.array(["rad" if each else "m" for each in rotating])
                found[f"{dim}_unit"] = (dim, units, {"long_name": f"unit of the displacement of the {dim}"})
            if dim in dims and set(self.groups[dim]) != {BUILDING}:
                found[f"{dim}_group"] = (dim, np.array(self.groups[dim]), {"long_name": f"group of the {dim}"})
        if "output" in dims and any(self.output_units):
            found["output_unit"] = ("output", np.array(self.output_units), {"long_name": "unit of the output"})
        return found


def kinds_of(
    dofs: Sequence[str],
    springs: Sequence[Spring | Component],
    outputs: Collection[str],
    rotations: object,
    groups: object,
    output_units: object,
) -> Kinds:
    """Return the kinds of a structure's places, or raise an error that names a wrong argument.

    Args:
        dofs: Names of the degrees of freedom.
        springs: The springs.
        outputs: Names of the outputs.
        rotations, groups, output_units: Arguments of a LumpedStructure.
    """
    given: dict[str, Any] = {}
    if rotations is None:
        rotating = {dof for dof in dofs if any(ROTATION.fullmatch(word.lower()) for word in WORD.findall(dof))}
    else:
        rotating = {checked_text("rotations: a name", each) for each in _names_in("rotations", rotations)}
        check_known("rotations", sorted(rotating), dofs)
        given["rotations"] = [dof for dof in dofs if dof in rotating]
    rotating_springs = tuple(_rotates(spring, rotating) for spring in springs)
    units = _output_units(outputs, output_units)
    if any(units):
        given["output_units"] = dict(zip(outputs, units, strict=True))
    by_name = _groups(dofs, [spring.name for spring in springs], groups)
    if by_name:
        given["groups"] = {group: [*names] for group, names in groups.items()}  # type: ignore[attr-defined] # checked
    names = {"dof": tuple(dofs), "spring": tuple(spring.name for spring in springs)}
    return Kinds(
        {"dof": tuple(dof in rotating for dof in dofs), "spring": rotating_springs},
        {dim: tuple(by_name.get(name, BUILDING) for name in own) for dim, own in names.items()},
        units,
        given,
    )


def _names_in(what: str, given: object) -> list[object]:
    if isinstance(given, str) or not isinstance(given, Collection):
        raise TypeError(f"{what} must be a list of names, such as ['theta'], got {shortened(given)}")
    return list(given)


def _rotates(spring: Spring | Component, rotating: Collection[str]) -> bool:
    """Return whether a spring's deformation is a rotation: a sum of rotations with coefficients 1 or -1, if not given.

    A spring between rotations with other coefficients has lever arms, so that its deformation is a displacement.
    """
    own = getattr(spring, "rotational", None)
    if own is not None:
        return bool(own)
    used = {dof: value for dof, value in spring.direction.items() if value}
    return all(dof in rotating and abs(value) == 1 for dof, value in used.items())


def _output_units(outputs: Collection[str], given: object) -> tuple[str, ...]:
    """Return the unit of each output, "" if it is unknown."""
    if given is None:
        return ("",) * len(outputs)
    if not isinstance(given, Mapping):
        raise TypeError(f"output_units must be a dictionary, such as {{'corner': 'm'}}, got {shortened(given)}")
    for name, unit in given.items():
        if name not in outputs:
            hint = did_you_mean(str(name), list(outputs))
            raise ValueError(f"output_units names the unknown output {name!r}{hint}: there are {', '.join(outputs)}")
        checked_text(f"output_units[{name!r}]", unit)
    return tuple(given.get(name, "") for name in outputs)


def _groups(dofs: Sequence[str], springs: Sequence[str], given: object) -> dict[str, str]:
    """Return {name of a degree of freedom or spring: name of its group}."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise TypeError(f"groups must be a dictionary, such as {{'soil': ['sway', 'rocking']}}, got {shortened(given)}")
    known, found = {*dofs, *springs}, dict[str, str]()
    for group, names in given.items():
        own_names = _names_in(f"groups[{group!r}]", names)
        if checked_text("groups: a name", group) == BUILDING or (group in known and group not in own_names):
            raise ValueError(f"groups: {group!r} is already a name of the structure: give the group another name")
        for name in own_names:
            own = [each for each in (name, f"{name} x", f"{name} y") if each in known]
            if not own:
                hint = did_you_mean(str(name), sorted(known))
                raise ValueError(
                    f"groups[{group!r}] names {name!r}, but no degree of freedom or spring has this name{hint}"
                )
            for each in own:
                if each in found:
                    raise ValueError(f"groups: {each!r} is in two groups, {found[each]!r} and {group!r}: remove one")
                found[each] = group
    return found
