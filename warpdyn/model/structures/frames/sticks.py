"""Equivalent sticks of frames: shear buildings and flexural-shear buildings with periods of the frame."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.foundations.core.checks import check_kind, one_of
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.structures.builders.flexural_shear_building import FlexuralShearBuilding
from warpdyn.model.structures.frames.frame import Frame
from warpdyn.model.structures.shear_building import ShearBuilding

KINDS = ("shear", "flexural_shear")
LEAST_ALPHA0, MOST_ALPHA0 = 1e-2, 1e3


@suggests_names
def equivalent_stick(
    frame: Frame,
    kind: str = "shear",
    *,
    damping: str = "none",
    damping_ratio: float | None = None,
    damping_modes: tuple[int, int] | None = None,
) -> ShearBuilding | FlexuralShearBuilding:
    """Return an elastic stick with the floor masses of a frame and its first period, or its first two periods.

    - "shear": a ShearBuilding whose storey stiffness is the storey shear over the drift in the first mode of the frame.
      It has exactly the first period and the first mode shape of the frame; its other periods differ.
    - "flexural_shear": a FlexuralShearBuilding with exactly the first two periods of the frame. Its stiffness is that
      of a uniform building, so that its mode shapes differ.

    Args:
        frame: A frame with rigid floors, which have all masses.
        kind: "shear" or "flexural_shear".
        damping: Inherent damping of the stick.
        damping_ratio: Viscous damping ratio [1].
        damping_modes: The two modes of Rayleigh damping, counted from 1.

    Returns:
        The stick, without P-Delta.

    Raises:
        ValueError: If a mass is not on a rigid floor, a storey is stiffer than in any shear building (its drift has the
            opposite sign of its shear), or no flexural-shear building has these periods.
        TypeError: If `frame` is not a Frame.

    Example:
        >>> stick = wd.equivalent_stick(portal, damping="rayleigh", damping_ratio=0.05)
        >>> round(stick.fundamental_period, 4), portal.modal()["period"].values.round(4)
        (0.5925, array([0.5925]))
    """
    check_kind("equivalent_stick", "a Frame", frame, Frame, argument="frame")
    one_of("kind", kind, KINDS)
    storeys = list(frame.storey_drifts.values())
    floors = [upper for upper, _, _ in storeys]
    heights = np.array([height for _, _, height in storeys])
    modal = frame.modal()
    names = [str(name) for name in modal["dof"].values]
    for name in names:
        if name not in floors:
            raise ValueError(
                f"equivalent_stick(): {name!r} has mass, but is not the displacement of a storey's floor: give masses "
                "to diaphragms only, and no mass_per_length"
            )
    places = [names.index(floor) for floor in floors]
    free = list(frame.numbering.free_names)
    mass = frame.mass()[frame.numbering.free].toarray()[:, frame.numbering.free]
    masses = np.array([mass[free.index(floor), free.index(floor)] for floor in floors])
    shared = {"damping": damping, "damping_ratio": damping_ratio, "damping_modes": damping_modes}
    given = {name: value for name, value in shared.items() if value is not None}
    if kind == "shear":
        shape = modal["shape"].values[0, places]
        shear = np.cumsum((masses * shape)[::-1])[::-1] * modal["circular_frequency"].values[0] ** 2
        stiffness = shear / np.diff(shape, prepend=0.0)
        for storey in np.flatnonzero(~(stiffness > 0)):
            raise ValueError(
                f"equivalent_stick(): storey {storey + 1} has a drift against its shear in the first mode, so that no "
                "shear building is equivalent: give kind='flexural_shear'"
            )
        return ShearBuilding(masses, stiffness, heights, **given)  # type: ignore[arg-type]
    return _flexural(masses, heights, modal["period"].values, given)


def _flexural(
    masses: np.ndarray, heights: np.ndarray, periods: np.ndarray, given: Mapping[str, object]
) -> FlexuralShearBuilding:
    """Return the flexural-shear building with the first two of some periods."""
    from scipy.optimize import brentq

    if periods.size < 2:
        raise ValueError("equivalent_stick(): a flexural-shear stick needs a frame with at least two storeys")

    def building(log_alpha0: float) -> FlexuralShearBuilding:
        alpha0 = float(np.exp(log_alpha0))
        return FlexuralShearBuilding(masses, heights, period=float(periods[0]), alpha0=alpha0, **given)  # type: ignore[arg-type]

    def residual(log_alpha0: float) -> float:
        return float(building(log_alpha0).modal()["period"].values[1] - periods[1])

    low, high = np.log(LEAST_ALPHA0), np.log(MOST_ALPHA0)
    ends = residual(low), residual(high)
    if not ends[0] < 0 < ends[1]:
        raise ValueError(
            f"equivalent_stick(): the ratio T2 / T1 of the frame is {periods[1] / periods[0]:.4g}, but uniform "
            f"flexural-shear buildings with these masses have {(ends[0] + periods[1]) / periods[0]:.4g} to "
            f"{(ends[1] + periods[1]) / periods[0]:.4g}: give kind='shear'"
        )
    return building(brentq(residual, low, high, xtol=1e-12, rtol=1e-14))
