"""Checks of the scene of a live ensemble: what can be integrated while the motion arrives."""

from __future__ import annotations

from warpdyn.campaigns.integration.settings import is_grid
from warpdyn.engine.methods.kinds import MultistepMethod
from warpdyn.engine.methods.table import METHODS
from warpdyn.foundations.core.checks import check_kind
from warpdyn.model.ground_motions.designs import Cloud, OneMotionPerStructure
from warpdyn.model.scene.portfolio import Portfolio
from warpdyn.model.scene.scene import Scene


def check_scene(scene: Scene) -> None:
    """Raise an error if the structures of a scene cannot be integrated while its motion arrives.

    Raises:
        TypeError: If `scene` is not a Scene.
        ValueError: If it has several motions, levels of intensity, forces or a portfolio, or records what is known
            only from the whole motion.
    """
    check_kind("Live", "a Scene", scene, Scene)
    design = scene.excitation
    if isinstance(scene.structure, Portfolio):
        raise ValueError(
            "Live takes a scene of one structure, got a Portfolio: make a Live for each archetype, and push each "
            "packet to all of them"
        )
    if not isinstance(design, Cloud | OneMotionPerStructure):
        raise ValueError(
            f"Live takes a scene with one motion, got {type(design).__name__}: give Scene(structure, motion) with a "
            "GroundMotion or PairOfMotions whose step is that of the packets. A scale factor is given by "
            "OneMotionPerStructure([motion], scale=...)"
        )
    if len(design.motions) != 1:
        raise ValueError(
            f"Live takes a scene with one motion, got {len(design.motions)}: give the motion with the step and the "
            "components of the packets, and make a Live for each station"
        )
    if not scene.recorders:
        raise ValueError("the scene has no recorders, so that nothing would be answered: add recorders=(...)")
    if scene.record_from > 0:
        raise ValueError("Live records from the first sample on: remove record_from from the scene")


def check_method(method: str, scene: Scene) -> None:
    """Raise a ValueError if a method does not give the bits of `simulate` while the motion arrives.

    The compiler fuses products and sums of these kernels in another way if they can pause; measured differences of peak
    drifts were up to 2e-5 (adaptive steps) and 1e-7 (implicit methods of lumped structures).

    Args:
        method: Name of the integration method.
        scene: The scene, which `check_scene` has accepted.
    """
    row = METHODS[method]
    if is_grid(scene) and isinstance(row, MultistepMethod):
        raise ValueError(
            f"Live does not support method {method!r} (the default of simulate) for a frame whose members all have "
            "hinges, because the kernel of such frames cannot pause: give integration=wd.Integration(method='rk4') to "
            "Live, and method='rk4' to simulate if you compare both"
        )
    if row.is_adaptive or (row.kind == "implicit" and scene.structure.family == "lumped"):
        what = "adaptive steps" if row.is_adaptive else "an implicit method of a LumpedStructure"
        raise ValueError(
            f"Live does not support method {method!r} ({what}), because its last bits would differ from those of "
            "simulate: give integration=wd.Integration(method='rk4')"
        )
