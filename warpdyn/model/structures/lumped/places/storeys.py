"""Storeys of a lumped structure: their heights, and the springs whose deformations are storey drifts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import shortened
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.model.structures.lumped.places.storey_values import storey_values

Storeys = tuple[tuple[int, ...], ...]


def needs_storeys(structure: object) -> str:
    """Return words for errors on a structure without storeys: what it needs, and which arguments to give."""
    if hasattr(structure, "frame"):
        return "needs storeys: give the Frame diaphragms= with the nodes of each floor, and keep them in dofs="
    return (
        "needs storeys: use a ShearBuilding, a FlexuralShearBuilding or a TorsionalBuilding with storey_height=, or "
        "give the LumpedStructure storey_height= and storey_springs="
    )


def checked_storeys(
    height: ArrayLike | None, given: object, springs: Sequence[str], rotating: Sequence[bool], pairs: int = 0
) -> tuple[np.ndarray, Storeys]:
    """Return the storey heights [m], shape [storey], and the places of the springs of each storey.

    Args:
        height: Storey heights [m], one value or one per storey.
        given: Names of the springs of each storey: a name or a list of names per storey.
        springs: Names of all springs; a biaxial spring "a" has the components "a x" and "a y".
        rotating: Whether the deformation of each spring is a rotation.
        pairs: Number of biaxial springs, whose components are the last springs.

    Raises:
        ValueError: If one of the two arguments is missing, a name is unknown or given twice, a spring rotates or
            is biaxial, or a height is not above 0; the message names the storey and the spring.
        TypeError: If `given` is not a list.
    """
    if given is None:
        raise ValueError("storey_springs is missing: storey_height needs it; give the springs of each storey")
    if height is None:
        raise ValueError("storey_height is missing: storey_springs needs it; give storey_height= in m, such as 3.5")
    if isinstance(given, str) or not isinstance(given, list | tuple) or not given:
        raise TypeError(
            "storey_springs must list the springs of each storey, such as [['A 1', 'B 1'], ['A 2', 'B 2']], got "
            f"{shortened(given)}"
        )
    heights = storey_values("storey_height", height, len(given), "m")
    owner: dict[int, int] = {}
    found = []
    for storey, own in enumerate(given, start=1):
        names = [own] if isinstance(own, str) else own
        if not isinstance(names, list | tuple) or not names:
            raise TypeError(f"storey_springs: storey {storey} must have the name of a spring, got {shortened(own)}")
        places: list[int] = []
        for name in names:
            here = [place for place, each in enumerate(springs) if each in (name, f"{name} x", f"{name} y")]
            if not here:
                hint = did_you_mean(str(name), list(springs))
                raise ValueError(f"storey_springs: storey {storey} names {name!r}, but no spring has this name{hint}")
            for place in here:
                if place >= len(springs) - 2 * pairs:
                    raise ValueError(
                        f"storey_springs: spring {name!r} of storey {storey} is biaxial, but storey drifts are not "
                        "resultants: remove it. Give its resultant as an output, such as "
                        f"outputs={{'drift {storey}': [{{'x': 1 / height}}, {{'y': 1 / height}}]}}, and collapse by "
                        "deformation_capacity= of the BiaxialSpring"
                    )
                if rotating[place]:
                    raise ValueError(
                        f"storey_springs: the deformation of spring {name!r} of storey {storey} is a rotation, not a "
                        "storey drift in m: name a spring between displacements"
                    )
                if place in owner:
                    raise ValueError(
                        f"storey_springs: spring {name!r} is given in storey {owner[place]} and in storey {storey}: "
                        "remove it from one of them"
                    )
                owner[place] = storey
            places += here
        found.append(tuple(places))
    return heights, tuple(found)


def check_different_storeys(storeys: Storeys, is_connected: np.ndarray, dofs: Sequence[str]) -> None:
    """Raise a ValueError if the springs of two storeys connect the same degrees of freedom: they are one storey.

    Args:
        storeys: Places of the springs of each storey.
        is_connected: Whether each spring is connected to each degree of freedom, shape [spring, dof].
        dofs: Names of the degrees of freedom.
    """
    owner: dict[tuple[str, ...], int] = {}
    for storey, places in enumerate(storeys, start=1):
        connected = tuple(dof for place, dof in enumerate(dofs) if is_connected[list(places), place].any())
        first = owner.setdefault(connected, storey)
        if first != storey:
            raise ValueError(
                f"storey_springs: storeys {first} and {storey} connect the same degrees of freedom "
                f"({', '.join(map(repr, connected))}), so that they are one storey: list the springs of one storey "
                "together, such as storey_springs=[['south 1', 'north 1'], ['south 2', 'north 2']]"
            )
