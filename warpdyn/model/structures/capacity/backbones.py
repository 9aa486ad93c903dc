"""Storey backbones of two to four corners as the parameters of the laws that follow them, with their falling branches.

A backbone is given by the drifts [m] and forces [N] of its corners, shape [corner, storey], from yield on.
"""

from __future__ import annotations

import numpy as np

from warpdyn.engine.laws.backbone import LARGEST_LAST_RISE

# Corners of the laws' backbones. Those of the IMK laws are yield, capping point and the beginning of the residual.
CORNERS = {
    "trilinear": 2,
    "quadrilinear": 3,
    "hysteretic": 3,
    "pinching4": 4,
    "ibarra_medina_krawinkler_bilinear": 3,
    "ibarra_medina_krawinkler_peak_oriented": 3,
    "ibarra_medina_krawinkler_pinching": 3,
}
KINEMATIC = ("trilinear", "quadrilinear")  # hardening moves their backbones: none of them falls
SHAPED = (*KINEMATIC, "hysteretic", "pinching4")  # these may rise to an ultimate strength and be level from there
# Drift of a level branch's end over that of its beginning, as SimCenter's MDOF-LU has it: it has no effect but on the
# energy that damage is measured by.
LEVEL_END = 10.0

Parameters = dict[str, np.ndarray]


def law_parameters(law: str, drift: np.ndarray, force: np.ndarray) -> Parameters:
    """Return the parameters of a law that give storeys a backbone, beside stiffness and yield force.

    Args:
        law: One of `CORNERS`.
        drift: Drifts at two to four corners [m], shape [corner, storey].
        force: Forces there [N], shape [corner, storey].

    Raises:
        ValueError: If the law cannot follow such a backbone.
    """
    if law in KINEMATIC:
        return _kinematic(law, drift, force)
    if law.startswith("ibarra"):
        return _capped(law, drift, force)
    corners = CORNERS[law]
    if len(drift) == corners + 1:
        drift, force = _without_level_end(law, drift, force)
    if law == "hysteretic" and len(drift) == 2:
        drift, force = np.vstack([drift, LEVEL_END * drift[-1:]]), np.vstack([force, force[-1:]])
    return _over_yield(*_with_more_corners(drift, force, corners))


def _over_yield(drift: np.ndarray, force: np.ndarray) -> Parameters:
    """Return ductilities and force ratios of the corners after the first."""
    numbers = range(2, len(drift) + 1)
    ductility = {f"ductility_{i}": drift[i - 1] / drift[0] for i in numbers}
    return ductility | {f"force_ratio_{i}": force[i - 1] / force[0] for i in numbers}


def _with_more_corners(drift: np.ndarray, force: np.ndarray, corners: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a backbone with corners put on its last branch: one in the middle, or two at thirds.

    GEM's Vulnerability Modellers ToolKit puts them there. A last branch that rises after one that falls is left whole:
    the one before it is divided.
    """
    missing = corners - len(drift)
    if missing <= 0:
        return drift, force
    rises_at_last = len(drift) > 2 and bool(np.all(force[-1] > force[-2])) and bool(np.all(force[-2] < force[-3]))
    end = len(drift) - 1 - rises_at_last
    share = (np.arange(missing) + 1)[:, None] / (missing + 1)
    return tuple(
        np.vstack([values[:end], values[end - 1] + share * (values[end] - values[end - 1]), values[end:]])
        for values in (drift, force)
    )  # type: ignore[return-value]


def _kinematic(law: str, drift: np.ndarray, force: np.ndarray) -> Parameters:
    """Return the parameters of backbones that bend down at each corner and never fall.

    Up to the law's number of corners, the last point is one, and what follows is level; one point more gives the slope.
    """
    corners = CORNERS[law]
    slope = np.diff(force, axis=0, prepend=0.0) / np.diff(drift, axis=0, prepend=0.0)
    for point in range(1, len(drift)):
        if np.any(slope[point] > slope[point - 1] * (1 + 1e-9)):
            raise ValueError(
                f"the capacity curve bends up at its corner {point}: law {law!r} takes curves that bend down at each"
            )
    if len(drift) > corners + 1:
        raise ValueError(
            f"the capacity curve has {len(drift)} points; law {law!r} takes two to {corners + 1}, 'quadrilinear' "
            "and 'pinching4' four"
        )
    hardening = np.zeros_like(force[0])
    if len(drift) == corners + 1:
        hardening = slope[-1] / slope[0]
        drift, force = drift[:-1], force[:-1]
    return _over_yield(*_with_more_corners(drift, force, corners)) | {"hardening_ratio": hardening}


def _capped(law: str, drift: np.ndarray, force: np.ndarray) -> Parameters:
    """Return the parameters after Ibarra, Medina and Krawinkler, whose third branch falls to a level residual force."""
    if np.any(force[1] < force[0]):
        raise ValueError(
            f"the capacity curve falls from its yield point on, and law {law!r} has a capping point beyond that: give "
            "one, or take 'pinching4' or 'hysteretic'"
        )
    values = {"plastic_drift_to_capping": drift[1] - drift[0], "capping_force_ratio": force[1] / force[0]}
    if len(drift) == 2:
        return values
    if np.any(force[2] >= force[1]):
        raise ValueError(
            f"the capacity curve does not fall after its second corner, where law {law!r} has its capping point: take "
            "'pinching4', 'hysteretic', 'trilinear' or 'quadrilinear', or give yield and capping point alone and "
            "`post_capping_drift`"
        )
    residual = np.zeros_like(force[0])
    if len(drift) == 4:
        drift, force = _without_level_end(law, drift, force)
        residual = force[2] / force[0]
        if np.any(residual >= 1):
            raise ValueError(
                f"the residual strength of the capacity curve, that of its last two points, is {residual[0]:g} of the "
                f"yield strength; law {law!r} takes less than 1: take 'pinching4' or 'hysteretic'"
            )
    to_no_force = force[1] * (drift[2] - drift[1]) / (force[1] - force[2])
    return values | {"post_capping_drift": to_no_force, "residual_force_ratio": residual}


def _without_level_end(law: str, drift: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a backbone without its last corner, which is level with the one before: both have their mean force."""
    if np.any(np.abs(force[-1] - force[-2]) > (LARGEST_LAST_RISE - 1) * force[-2]):
        raise ValueError(
            f"the capacity curve has {len(drift)} points; law {law!r} takes {len(drift) - 1}, and a last one within "
            "1 % of the capacity before it, where its strength stays: take 'pinching4', which takes any four"
        )
    force = force.copy()
    force[-2] = 0.5 * (force[-2] + force[-1])
    return drift[:-1], force[:-1]
