"""Load patterns on lumped structures, and the degree of freedom whose displacement a pushover prescribes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import checked_text, finite_numbers, one_of
from warpdyn.model.structures.frames.reduced_frame import ReducedFrame
from warpdyn.model.structures.lumped.names import check_known, checked_coefficients, row_of
from warpdyn.model.structures.lumped.structure import LumpedStructure

PATTERNS = ("first_mode", "triangular", "uniform")
LEAST_SHARE = 1e-9  # of the loads' sizes; a smaller resultant in the direction of the base motion is rounding


def dof_loads(structure: LumpedStructure, pattern: str | Mapping[str, float] | ArrayLike) -> tuple[np.ndarray, int]:
    """Return the loads of a pattern, and the component of base motion in whose direction their resultant is 1.

    The resultant in the direction of a component is the sum of the loads times the displacements under a unit
    displacement of the base: the base shear. The component is that with the largest resultant.

    Args:
        structure: The structure.
        pattern: "first_mode" (load mass times first mode shape), "triangular" (load mass times height above the ground,
            for frames), "uniform" (load mass times the influence vector, for a structure with one component of base
            motion), or loads of any scale: {degree of freedom: load}, or shape [dof].

    Returns:
        Loads per unit of the base shear, shape [dof]; index of the component.

    Raises:
        ValueError: If the pattern is unknown, names an unknown degree of freedom, has a wrong number of loads, or has
            no resultant in the direction of a base motion.
    """
    one = {name: values[None] for name, values in structure.parameters.items()}
    if isinstance(pattern, str):
        loads = structure.load_masses(one)[0] @ _shape_of(structure, pattern)
    elif isinstance(pattern, Mapping):
        given = checked_coefficients("pattern", pattern)
        check_known("pattern", given, structure.dof_names)
        loads = row_of(given, structure.dof_names)
    else:
        loads = finite_numbers("pattern", pattern)
        if loads.shape != (structure.dofs,):
            raise ValueError(
                f"pattern must be one load per degree of freedom, shape [{structure.dofs}], got shape {loads.shape}"
            )
    terms = structure.influence * loads[:, None]
    resultants = terms.sum(axis=0)
    component = int(np.abs(resultants).argmax())
    if abs(resultants[component]) <= LEAST_SHARE * np.abs(terms).sum():
        what = f"the loads of pattern={pattern!r}" if isinstance(pattern, str) else "the given loads"
        raise ValueError(
            f"{what} have no resultant in the direction of a base motion, so that the base shear is 0: give loads in "
            f"the direction of influence, such as pattern={{{_moved(structure)!r}: 1.0}}"
        )
    return loads / resultants[component], component


def _shape_of(structure: LumpedStructure, pattern: str) -> np.ndarray:
    """Return the displacements whose product with the load mass is a pattern, shape [dof]."""
    one_of("load pattern", pattern, PATTERNS)
    if pattern == "first_mode":
        found: np.ndarray = structure.modal()["shape"].values[0]
        return found
    if pattern == "triangular":
        if not isinstance(structure, ReducedFrame) or structure.reduction != "static":
            raise ValueError(
                "a lumped structure that is not a frame has no heights for pattern='triangular': give the loads, such "
                f"as pattern={{{structure.dof_names[0]!r}: 1.0}}"
            )
        return structure.frame.elevations(structure.frame.numbering.free[structure.kept])
    if structure.components > 1:
        raise ValueError(
            f"pattern='uniform' has no direction: the structure has {structure.components} components of base "
            f"motion. Give the loads, such as pattern={{{structure.dof_names[0]!r}: 1.0}}"
        )
    return structure.influence[:, 0]


def control_dof(structure: LumpedStructure, loads: np.ndarray, control: str | None) -> int:
    """Return the index of the degree of freedom whose displacement is prescribed.

    Args:
        structure: The structure.
        loads: Loads, shape [dof].
        control: Name of the degree of freedom; None: the translation with the largest positive displacement under the
            loads in elastic equilibrium.

    Raises:
        ValueError: If the name is unknown, the loads do not move this degree of freedom in their direction, or no
            translation has a positive displacement.
    """
    one = {name: values[None] for name, values in structure.parameters.items()}
    moves = np.linalg.solve(structure.stiffness_matrices(one)[0], loads)
    least = LEAST_SHARE * np.abs(moves).max()
    if control is None:
        moves = np.where(structure.kinds.rotating["dof"], -np.inf, moves)
        if moves.max() <= least:
            raise ValueError(
                "control is missing: no translation has a positive displacement under the loads. Name the degree of "
                f"freedom whose displacement is prescribed, such as control={structure.dof_names[0]!r}"
            )
        return int(moves.argmax())
    check_known("control", [checked_text("control", control)], structure.dof_names)
    place = structure.dof_names.index(control)
    if moves[place] <= least:
        raise ValueError(
            f"control={control!r}: the loads do not move this degree of freedom in the direction of the base shear: "
            "choose another one, or omit control="
        )
    return place


def _moved(structure: LumpedStructure) -> str:
    """Return the name of a degree of freedom that the base motion moves."""
    return structure.dof_names[int(np.abs(structure.influence).sum(axis=1).argmax())]
