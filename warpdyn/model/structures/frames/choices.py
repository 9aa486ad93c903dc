"""Checked choices of a reduced frame: kept degrees of freedom and outputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from warpdyn.foundations.core.checks import one_of, shortened
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.model.structures.frames.tables.table import check_names_known

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame

OUTPUTS = ("drift", "base_shear", "member_force")
DEFAULT_OUTPUTS = ("drift", "base_shear")


def kept_places(frame: Frame, dofs: Sequence[str] | None, mass: np.ndarray, reduction: str) -> np.ndarray:
    """Return the numbers of the kept degrees of freedom among the free ones."""
    names = list(frame.numbering.free_names)
    heavy = np.flatnonzero(np.diagonal(mass) > 0)
    if dofs is None:
        if reduction != "static":
            raise ValueError(f"lumped(): reduction={reduction!r} needs dofs=, such as dofs={list(frame.floors)[:3]}")
        if not heavy.size:
            raise ValueError("lumped(): the frame has no mass: give masses=, or mass_per_length of sections")
        return heavy
    if isinstance(dofs, str) or not isinstance(dofs, list | tuple) or not dofs:
        raise TypeError(f"dofs must be a list of degrees of freedom, such as ['floor 1'], got {shortened(dofs)}")
    kept = []
    for name in dofs:
        if name not in names:
            fixed = " (it is fixed, or no member resists it)" if name in frame.numbering.names else ""
            hint = "" if fixed else did_you_mean(name, names)
            raise ValueError(
                f"dofs: {name!r} is not a free degree of freedom{fixed}{hint}; there are {shortened(names)}"
            )
        if names.index(name) in kept:
            raise ValueError(f"dofs: {name!r} is listed twice")
        kept.append(names.index(name))
    found = np.array(kept)
    if reduction == "static":
        for place in np.setdiff1d(heavy, found):
            raise ValueError(
                f"dofs: {names[place]!r} has the mass {mass[place, place]:g} and is not kept, so that static "
                "condensation is not exact: keep it, or give reduction='guyan' or 'craig_bampton'"
            )
    return found


def checked_outputs(given: Sequence[str]) -> tuple[str, ...]:
    """Return the kinds of outputs, or raise an error that names a wrong one."""
    if isinstance(given, str) or not isinstance(given, list | tuple):
        raise TypeError(f"outputs must be a list such as ['drift', 'member_force'], got {shortened(given)}")
    for name in given:
        one_of("outputs", name, OUTPUTS)
    return tuple(given)


def checked_members(frame: Frame, given: Sequence[str] | None, outputs: Sequence[str]) -> tuple[str, ...]:
    """Return the members of the outputs "member_force", or raise an error that names a wrong one; None: all."""
    if given is None:
        return tuple(frame.members)
    if isinstance(given, str) or not isinstance(given, list | tuple):
        raise TypeError(f"members must be a list of names of members, such as ['beam'], got {shortened(given)}")
    check_names_known("members", given, frame.members, "member")
    for place, name in enumerate(given):
        if name in given[:place]:
            raise ValueError(f"members: {name!r} is listed twice: list it once")
    if not given and "member_force" in outputs:
        raise ValueError(
            "members is empty, so that the outputs 'member_force' would contain no force: name members, or remove "
            "members= for all"
        )
    return tuple(given)
