"""The number of structures that a function draws from a scene, and warnings if the number is probably a mistake."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.ground_motions.designs import OneMotionPerStructure, Stripes
from warpdyn.model.ground_motions.motions_at_sites import MotionsAtSites
from warpdyn.model.scene.scatter import GivenValues
from warpdyn.model.scene.scene import Scene

ADVISED = 16  # number of structures that messages suggest, as in the README
STRUCTURES_PER_MOTION = 3  # default for stripes with random structures; see docs/explanation/intervals.md


def with_default_design(scene: Scene, structures: int | None) -> Scene:
    """Return the scene with 3 structures per motion if neither the call nor the scene gives a number of structures.

    This default applies only to a design `Stripes` whose several motions are scaled to every level, and to a building
    with random parameters. Any other scene is returned unchanged.

    Args:
        scene: The scene.
        structures: The number that the user gave; None: not given.
    """
    design = scene.excitation
    if structures is not None or not isinstance(design, Stripes) or scene.structure.is_many:
        return scene
    is_open = design.structures_per_motion is None and design.motions_of_levels is None and len(design.motions) > 1
    is_random = any(not isinstance(spread, GivenValues) for spread in scene.scatter.values())
    if not is_open or not is_random or scene.structures_given:
        return scene
    return replace(scene, excitation=design.nested(STRUCTURES_PER_MOTION))


def number_of_structures(function: str, scene: Scene, structures: int | None) -> int:
    """Return the number of structures to draw from the scene; warn if the number is probably a mistake.

    Args:
        function: Name of the public function, for messages.
        scene: The scene.
        structures: The number that the user gave; None: the number of structures that the scene lists, or 1.
    """
    if structures is not None or scene.structure.is_many:
        _warn_of_copies(scene, structures)
        return 1 if structures is None else structures
    if scene.structures_given:
        return scene.structures_given
    design = scene.excitation
    drawn = [name for name, spread in scene.scatter.items() if not isinstance(spread, GivenValues)]
    what = f"{', '.join(map(repr, drawn))} {'are' if len(drawn) > 1 else 'is'} scattered"
    if not drawn and isinstance(design, OneMotionPerStructure) and len(design.motions) > 1:
        what = f"each structure has a motion drawn from {len(design.motions)}"
    elif not drawn:
        return 1
    warn_caller(
        f"{function}: structures= is missing and {what}, so one random structure is run and the results have no "
        f"variability among structures. Give {function}(..., structures={ADVISED}), or structures=1 if you want one"
    )
    return 1


def _warn_of_copies(scene: Scene, structures: object) -> None:
    """Warn if several identical structures are requested: statistics would count the same history several times."""
    design = scene.excitation
    is_drawn = scene.structure.is_many or scene.scatter or not design.is_design
    one_each = isinstance(design, OneMotionPerStructure | MotionsAtSites)
    one_each |= isinstance(design, Stripes) and design.own_structures == 1
    if is_drawn or one_each or not isinstance(structures, int | np.integer) or structures < 2:
        return
    warn_caller(
        f"nothing is scattered, so that all {structures} structures are the same: each history is run and counted in "
        f"statistics {structures} times. Remove structures=, or give Scene(..., scatter=...)"
    )
