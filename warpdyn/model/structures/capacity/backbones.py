"""Parameters with which storey laws follow backbones with two to four corners.

A backbone is the curve of storey force over storey drift. It is given by the drifts [m] and forces [N] at its corners,
shape [corner, storey]; the first corner is the yield point.
"""

from __future__ import annotations

import numpy as np

from warpdyn.engine.laws import LAWS, Hysteretic
from warpdyn.engine.laws.backbone import LARGEST_LAST_RISE

CORNERS = {name: law.corners for name, law in LAWS.items() if law.corners}  # law -> number of corners of its backbone
# Laws with kinematic hardening; their backbones cannot fall.
KINEMATIC = tuple(name for name in CORNERS if "hardening_ratio" in LAWS[name].parameters)
# Laws whose backbones may rise to an ultimate strength and then stay level.
SHAPED = tuple(name for name in CORNERS if "ductility_2" in LAWS[name].parameters)
# Ratio of the drifts at the end and at the beginning of a level branch, as in SimCenter's MDOF-LU. It only affects the
# energy by which the law measures damage.
LEVEL_END = 10.0

Parameters = dict[str, np.ndarray]


def law_parameters(law: str, drift: np.ndarray, force: np.ndarray) -> Parameters:
    """Return the parameters with which a storey law follows a backbone, except its stiffness and yield force.

    Args:
        law: Name of a law in `CORNERS`.
        drift: Drifts at two to four corners [m], shape [corner, storey].
        force: Forces at the corners [N], shape [corner, storey].

    Raises:
        ValueError: If the law cannot follow the backbone.
    """
    if law in KINEMATIC:
        return _kinematic(law, drift, force)
    if law not in SHAPED:  # an IMK law
        return _capped(law, drift, force)
    corners = CORNERS[law]
    if len(drift) == corners + 1:
        drift, force = _without_level_end(law, drift, force)
    if law == Hysteretic.name and len(drift) == 2:
        drift, force = np.vstack([drift, LEVEL_END * drift[-1:]]), np.vstack([force, force[-1:]])
    return _over_yield(*_with_more_corners(drift, force, corners))


def _over_yield(drift: np.ndarray, force: np.ndarray) -> Parameters:
    """Return the ratios of the drifts (forces) at the second and later corners to the drift (force) at yield.

    The ratios have shape [storey], under the parameter names `ductility_2`, `force_ratio_2` and so on.
    """
    numbers = range(2, len(drift) + 1)
    ductility = {f"ductility_{i}": drift[i - 1] / drift[0] for i in numbers}
    return ductility | {f"force_ratio_{i}": force[i - 1] / force[0] for i in numbers}


def _with_more_corners(drift: np.ndarray, force: np.ndarray, corners: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a backbone with `corners` corners; missing corners divide its last branch into equal segments.

    This is the rule of GEM's Vulnerability Modellers ToolKit. If the last branch rises after a branch that falls, the
    branch that falls is divided instead.
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
    """Return the parameters of a law with kinematic hardening: its backbone bends down at each corner and never falls.

    If the backbone has one more point than the law has corners, the last point defines the slope after the last corner.
    Otherwise, the backbone is level after its last corner.
    """
    corners = CORNERS[law]
    slope = np.diff(force, axis=0, prepend=0.0) / np.diff(drift, axis=0, prepend=0.0)
    for point in range(1, len(drift)):
        if np.any(slope[point] > slope[point - 1] * (1 + 1e-9)):
            raise ValueError(
                f"the capacity curve bends up at its corner {point}: law {law!r} needs a curve that bends down at each "
                "corner. Use law='pinching4', or correct the curve"
            )
    if len(drift) > corners + 1:
        raise ValueError(
            f"the capacity curve has {len(drift)} points, but law {law!r} needs two to {corners + 1}: for four points "
            "use law='quadrilinear' or 'pinching4'"
        )
    hardening = np.zeros_like(force[0])
    if len(drift) == corners + 1:
        hardening = slope[-1] / slope[0]
        drift, force = drift[:-1], force[:-1]
    return _over_yield(*_with_more_corners(drift, force, corners)) | {"hardening_ratio": hardening}


def _capped(law: str, drift: np.ndarray, force: np.ndarray) -> Parameters:
    """Return the parameters of an IMK law: after its second corner, the backbone falls to a constant residual force."""
    if np.any(force[1] < force[0]):
        raise ValueError(
            f"the capacity curve falls after its yield point, but law {law!r} needs a capping point that is not below "
            "yield: add such a point, or use law='pinching4' or 'hysteretic'"
        )
    values = {"plastic_drift_to_capping": drift[1] - drift[0], "capping_force_ratio": force[1] / force[0]}
    if len(drift) == 2:
        return values
    if np.any(force[2] >= force[1]):
        raise ValueError(
            f"the capacity curve does not fall after its second corner, but law {law!r} needs a fall there (capping "
            "point): use law='pinching4', 'hysteretic', 'trilinear' or 'quadrilinear', or give only yield and capping "
            "point, and post_capping_drift="
        )
    residual = np.zeros_like(force[0])
    if len(drift) == 4:
        drift, force = _without_level_end(law, drift, force)
        residual = force[2] / force[0]
        if np.any(residual >= 1):
            raise ValueError(
                f"the residual strength of the capacity curve (its last two points) is {residual[0]:g} times the yield "
                f"strength, but law {law!r} needs less than 1: use law='pinching4' or 'hysteretic'"
            )
    to_no_force = force[1] * (drift[2] - drift[1]) / (force[1] - force[2])
    return values | {"post_capping_drift": to_no_force, "residual_force_ratio": residual}


def _without_level_end(law: str, drift: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a backbone without its last corner; the new last corner gets the mean force of the last two corners."""
    if np.any(np.abs(force[-1] - force[-2]) > (LARGEST_LAST_RISE - 1) * force[-2]):
        raise ValueError(
            f"the capacity curve has {len(drift)} points, but law {law!r} needs {len(drift) - 1}, or a last point of "
            "constant strength, within 1 % of the point before: use law='pinching4', whose four points are arbitrary"
        )
    force = force.copy()
    force[-2] = 0.5 * (force[-2] + force[-1])
    return drift[:-1], force[:-1]
