"""Models of the four-storey frame: the frame, a fish-bone, and two sticks with the capacity curve of the fish-bone."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

import warpdyn as wd
from parts.four_storey_frame.frame import DAMPING_MODES, DAMPING_RATIO, HEIGHTS, MASSES, frame_and_hinges

COLLAPSE_DRIFT_RATIO = 0.10
DAMPED = {"damping": "rayleigh", "damping_ratio": DAMPING_RATIO, "damping_modes": DAMPING_MODES}
LARGEST_ROOF_DRIFT_RATIO = 0.12  # of the pushover analysis
FALLEN = 0.8  # share of the peak shear at the last point of the sticks' capacity curve
SCATTER_OF_STRENGTH, SCATTER_OF_ROTATION = wd.Lognormal(1.0, 0.15), wd.Lognormal(1.0, 0.3)
COMMON = {
    "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.10), per="building"),
    "damping_ratio": wd.RandomFactor(wd.Lognormal(1.0, 0.30), per="building"),
}


class Model(NamedTuple):
    """A structure with its random parameters; `structure` has storeys, so that its demands are storey drift ratios."""

    structure: wd.ShearBuilding | wd.LumpedStructure
    scatter: dict[str, wd.RandomFactor]


def random_strengths(per: str, only: tuple[str, ...] | None = None) -> dict[str, wd.RandomFactor]:
    """Return the random strengths and plastic rotations (or drifts) of hinges or storeys."""
    more = {} if only is None else {"only": only}
    names = {"yield_force": SCATTER_OF_STRENGTH, "plastic_drift_to_capping": SCATTER_OF_ROTATION}
    return COMMON | {name: wd.RandomFactor(scatter, per=per, **more) for name, scatter in names.items()}


def whole_frame() -> Model:
    """Return the frame with its 56 hinges; its columns do not shorten, so that kernels for grids apply."""
    structure = wd.HingedFrame(*frame_and_hinges(columns_shorten=False), drift_capacity=COLLAPSE_DRIFT_RATIO, **DAMPED)
    return Model(structure, random_strengths("spring", structure.hinge_names))


def fish_bone() -> Model:
    """Return the fish-bone of the frame, with 12 hinges."""
    structure = wd.HingedFishbone.from_frame(*frame_and_hinges(), drift_capacity=COLLAPSE_DRIFT_RATIO, **DAMPED)
    return Model(structure, random_strengths("spring", structure.hinge_names))


@cache
def capacity_curve() -> tuple[np.ndarray, np.ndarray]:
    """Return yield point, capping point and a point of the falling branch of the fish-bone without P-Delta [m, N]."""
    bone = wd.HingedFishbone.from_frame(*frame_and_hinges(), p_delta=False)
    path = np.linspace(0.0, LARGEST_ROOF_DRIFT_RATIO * sum(HEIGHTS), 241)
    pushed = wd.pushover(bone, path, pattern="first_mode")
    roof, shear = pushed["roof_displacement"].values, pushed["base_shear"].values
    top = int(shear.argmax())
    stiffness, cap, strength = shear[1] / roof[1], roof[top], shear[top]
    # The yield point lies on the initial tangent; the area up to the peak is that of the pushover curve.
    area = np.trapezoid(shear[: top + 1], roof[: top + 1])
    yields = (area - 0.5 * strength * cap) / (0.5 * (stiffness * cap - strength))
    end = top + int(np.argmax(shear[top:] <= FALLEN * strength))
    return np.array([yields, cap, roof[end]]), np.array([stiffness * yields, strength, shear[end]])


def shear_stick() -> Model:
    """Return a chain with the first period and mode of the fish-bone, and with its pushover curve without P-Delta.

    All storeys reach the yield and the capping point together; then one storey softens alone. The storeys have the
    energy capacity of all hinges that the mechanism of the frame needs: beams and column bases.
    """
    (yields, cap, end), (strength, peak, last) = capacity_curve()
    elastic = wd.equivalent_stick(fish_bone().structure.frame)
    mode = elastic.modal()["shape"].values[0]
    share = np.cumsum((MASSES * mode)[::-1])[::-1] / (MASSES * mode).sum()  # of the base shear
    flexibility = share / elastic.parameters["stiffness"]
    of_roof = flexibility / flexibility.sum()  # share of the roof displacement
    stiffness = strength * share / (yields * of_roof)
    unloading = (share / stiffness).sum() - share / stiffness  # of the other storeys
    falling = share / ((end - cap) / (peak - last) + unloading)
    capacity = energy_capacity() / (strength * share).sum()  # m
    structure = wd.ShearBuilding(
        MASSES,
        stiffness,
        HEIGHTS,
        law="ibarra_medina_krawinkler_bilinear",
        yield_force=strength * share,
        plastic_drift_to_capping=(cap - yields) * of_roof,
        post_capping_drift=peak * share / falling,
        capping_force_ratio=peak / strength,
        strength_deterioration_drift=capacity,
        post_capping_deterioration_drift=capacity,
        unloading_deterioration_drift=capacity,
        gravity_load=weights(),
        drift_capacity=COLLAPSE_DRIFT_RATIO * np.array(HEIGHTS),
        **DAMPED,
    )
    return Model(structure, random_strengths("storey"))


def flexural_shear_stick() -> Model:
    """Return a stick with the first two periods of the fish-bone; its shear springs yield at the drifts of storeys."""
    shear = shear_stick().structure
    bone = fish_bone().structure
    elastic = wd.equivalent_stick(bone.frame, "flexural_shear").stick
    stiffness = elastic.storey_shear_stiffness
    own = ("stiffness", "yield_force", "mass", "height", "gravity_load", "damping_ratio", "drift_capacity")
    law_parameters = {name: each for name, each in shear.parameters.items() if name not in own}
    structure = wd.FlexuralShearBuilding(
        MASSES,
        HEIGHTS,
        bending_stiffness=elastic.bending_stiffness,
        shear_stiffness=stiffness * np.array(HEIGHTS),
        law=shear.law,
        gravity_load=weights(),
        yield_force=stiffness * shear.parameters["yield_force"] / shear.parameters["stiffness"],
        deformation_capacity=COLLAPSE_DRIFT_RATIO * np.array(HEIGHTS),
        **law_parameters,
        **DAMPED,
    )
    return Model(structure, random_strengths("spring"))


def weights() -> np.ndarray:
    """Return the gravity loads of the floors [N]."""
    frame, _ = frame_and_hinges()
    return np.array([sum(frame.nodes[node]["gravity_load"] for node in nodes) for nodes in frame.diaphragms.values()])


def energy_capacity() -> float:
    """Return the sum of yield moment times deterioration rotation of the hinges of beams and column bases [J]."""
    bone = fish_bone().structure
    rows = [row for (member, end), row in bone.hinges.items() if member[0] == "B" or (member, end) == ("C1", "start")]
    return float(sum(row["yield_force"] * row["strength_deterioration_drift"] for row in rows))


MODELS: dict[str, Callable[[], Model]] = {
    "frame": whole_frame,
    "fish-bone": fish_bone,
    "flexural-shear stick": flexural_shear_stick,
    "shear stick": shear_stick,
}
