"""Parameters of shear buildings from a capacity curve, whose displacements and forces are distributed over storeys."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.backbone import LARGEST_LAST_RISE
from warpdyn.foundations.core.checks import one_of
from warpdyn.model.structures.capacity.backbones import CORNERS, KINEMATIC, law_parameters
from warpdyn.model.structures.capacity.bilinear_curve import bilinear_curve, checked_curve
from warpdyn.model.structures.lateral_loads import floor_loads, storey_shears
from warpdyn.model.structures.modal import chain_stiffness_matrix, modal_properties

CURVES = ("pushover", "spectrum")
DISTRIBUTIONS = ("triangular", "first_mode", "frame", "soft_storey")
SOFTENING = ("one_storey", "every_storey")
# From GEM's Vulnerability Modellers ToolKit: exponent of the height in the first mode of frames, largest number of
# storeys of a frame, and ratio of the stiffness of a soft first storey to the stiffness of the other storeys.
FRAME_EXPONENT, MOST_FRAME_STOREYS = 0.6, 12
SOFT_STOREY_STIFFNESS = 0.2
MOST_POINTS = 4  # of a curve for laws with a backbone
LARGEST_EXCESS = 0.01  # times the peak; a bilinear curve may be this much above the given curve beyond the peak


@dataclass(frozen=True)
class Pushed:
    """A pushover curve of a chain (shear building), and the distribution of shears and stiffnesses over its storeys.

    Args:
        displacement: Roof displacements [m], shape [point].
        base_shear: Base shears [N], shape [point].
        shear: Storey shears divided by the base shear [1], shape [storey].
        stiffness: Initial storey stiffness [N/m], shape [storey].
    """

    displacement: np.ndarray
    base_shear: np.ndarray
    shear: np.ndarray
    stiffness: np.ndarray


def capacity_chain(
    displacement: ArrayLike,
    capacity: ArrayLike,
    mass: np.ndarray,
    height: np.ndarray,
    *,
    curve: str,
    distribution: str,
    law: str,
    softening: str,
    unloading_exponent: ArrayLike = 0.0,
) -> tuple[dict[str, np.ndarray | float], np.ndarray]:
    """Return parameters for `from_capacity`, and the storey drifts at the end of the curve [m], shape [storey].

    The parameters are `stiffness` [N/m], `yield_force` [N], both of shape [storey], and the parameters of the backbone
    of the law. The arguments are those of `ShearBuilding.from_capacity`; `mass` and `height` have shape [storey].
    """
    one_of("capacity curve", curve, CURVES)
    one_of("distribution over the storeys", distribution, DISTRIBUTIONS)
    one_of("softening", softening, SOFTENING)
    hardening: dict[str, float] = {}
    if law in CORNERS:
        x, y = _checked_points(displacement, capacity, law)
    else:
        at, strength, ratio = bilinear_curve(displacement, capacity)
        _refuse_falling_branch(displacement, capacity, (at, strength, ratio), law)
        x, y = checked_curve(displacement, capacity)
        end = x[y.argmax()]
        x, y = np.array([at, end]), strength * np.array([1, 1 + ratio * (end / at - 1)])
        hardening = {"hardening_ratio": ratio}
    pushed = _distributed(x, y, mass, height, curve, distribution)
    yield_force = pushed.shear * pushed.base_shear[0]
    drift = _storey_drifts(pushed, softening, unloading_exponent)
    chain: dict[str, np.ndarray | float] = {"stiffness": pushed.stiffness, "yield_force": yield_force, **hardening}
    if law in CORNERS:
        chain |= law_parameters(law, drift, pushed.base_shear[:, None] * pushed.shear)
    return chain, drift[-1]


def _distributed(
    x: np.ndarray, y: np.ndarray, mass: np.ndarray, height: np.ndarray, curve: str, distribution: str
) -> Pushed:
    """Return a pushover curve, converted from a spectrum if necessary, with its distribution over the storeys."""
    storeys = len(mass)
    uniform = modal_properties(mass, chain_stiffness_matrix(np.ones(storeys))).isel(mode=0)
    if distribution == "frame":
        if storeys > MOST_FRAME_STOREYS:
            raise ValueError(
                f"distribution 'frame' has at most {MOST_FRAME_STOREYS} storeys, got {storeys}: use "
                "distribution='first_mode', as GEM's toolkit does"
            )
        shape = (np.cumsum(height) / height.sum()) ** FRAME_EXPONENT
    elif distribution == "soft_storey" and storeys > 1:
        relative = np.array([SOFT_STOREY_STIFFNESS, *np.ones(storeys - 1)])
        shape = modal_properties(mass, chain_stiffness_matrix(relative))["shape"].values[0]
    else:
        # Lu's chains and GEM's "first_mode" chains convert spectra with the first mode of equal storey stiffnesses.
        shape = uniform["shape"].values
    period = 2 * np.pi * np.sqrt(x[0] / y[0])
    if curve == "spectrum":
        moment = mass @ shape
        x = x * (moment / (mass @ shape**2) * shape[-1])
        y = y * (moment**2 / (mass @ shape**2))
    if distribution != "triangular":
        shear = storey_shears(mass * shape / (mass @ shape))
        stiffness = shear * y[0] / (x[0] * np.diff(shape, prepend=0.0) / shape[-1])
        return Pushed(x, y, shear, stiffness)
    shear = storey_shears(floor_loads("triangular", mass, height))
    equal = (float(uniform["period"]) / period) ** 2 if curve == "spectrum" else shear.sum() * y[0] / x[0]
    # A chain with the period of the spectrum yields at a roof displacement that differs by some percent from the curve.
    return Pushed(x * (shear.sum() * y[0] / equal / x[0]), y, shear, np.full(storeys, equal))


def _storey_drifts(pushed: Pushed, softening: str, unloading_exponent: ArrayLike) -> np.ndarray:
    """Return the storey drifts at the points of the curve [m], shape [point, storey].

    Up to the peak, storey drifts are proportional to the roof displacement. Beyond the peak, with softening
    "one_storey", the drift of each storey is computed as if it softened alone: the roof displacement minus the drifts
    of the other storeys, which unload with their unloading stiffness. The roof then follows the curve, whichever storey
    softens.
    """
    shear, u, v = pushed.shear, pushed.displacement, pushed.base_shear
    share = shear / pushed.stiffness * v[0] / u[0]
    drift = u[:, None] * share
    peak = _peak(v)
    if softening == "every_storey" or peak == len(v) - 1:
        return drift
    ductility, strength = u[peak] / u[0], v[peak] / v[0]
    softer = np.minimum(ductility ** np.asarray(unloading_exponent, float), ductility / max(strength, 1.0))
    given_back = (v[peak] - v[peak + 1 :, None]) * shear / pushed.stiffness * softer
    others = given_back.sum(axis=1, keepdims=True) - given_back
    drift[peak + 1 :] = drift[peak] + (u[peak + 1 :, None] - u[peak]) + others
    return drift


def _peak(capacity: np.ndarray) -> int:
    """Return the index of the first point after which the capacity falls; if it never falls, of the last point."""
    falls = np.flatnonzero(np.diff(capacity) < 0)
    return int(falls[0]) if falls.size else len(capacity) - 1


def _refuse_falling_branch(
    displacement: ArrayLike, capacity: ArrayLike, bilinear: tuple[float, float, float], law: str
) -> None:
    """Raise a ValueError if the curve falls more than 1 % below `bilinear` (yield point, strength, hardening ratio)."""
    x, y, (at, strength, ratio) = np.asarray(displacement, float), np.asarray(capacity, float), bilinear
    peak = int(np.flatnonzero(y == y.max())[-1])
    force = strength * (1 + ratio * (x / at - 1))
    for point in np.flatnonzero(force[peak + 1 :] > y[peak + 1 :] + LARGEST_EXCESS * y[peak]) + peak + 1:
        falling = ", ".join(repr(name) for name in CORNERS if name not in KINEMATIC)
        raise ValueError(
            f"the capacity curve falls after its peak, point {peak}, from {y[peak]:g} to {y[point]:g} at point "
            f"{point}, where law {law!r} has {force[point]:g}, because it cannot fall: use a law that falls "
            f"({falling}) with a curve of two to four points, or remove the points after the peak"
        )


def _checked_points(displacement: ArrayLike, capacity: ArrayLike, law: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the points of a capacity curve without the origin, which become corners of a backbone, shape [point].

    Raises:
        ValueError: If there are not two to four points, a branch is stiffer than the first branch, or a branch rises
            after the peak.
    """
    x, y = (values[1:] for values in checked_curve(displacement, capacity))
    given = np.size(displacement) - len(x)  # 1 if the user gave the origin; messages count points as the user does
    if len(x) > MOST_POINTS:
        raise ValueError(
            f"the capacity curve has {len(x)} points without the origin, but law {law!r} needs two to {MOST_POINTS}, "
            "the corners of its backbone: give only the points at which the curve bends"
        )
    rise, length = np.diff(y, prepend=0.0), np.diff(x, prepend=0.0)
    for point in np.flatnonzero(rise > y[0] / x[0] * length * (1 + 1e-9)):
        raise ValueError(
            f"the capacity curve is stiffer before point {point + given} than at the origin, but a backbone cannot "
            "stiffen: remove the points before it or correct the curve"
        )
    peak = _peak(y)
    if law in KINEMATIC and peak < len(y) - 1:
        raise ValueError(
            f"the capacity curve falls after point {peak + given}, but law {law!r} cannot fall: use law='pinching4', "
            "'hysteretic' or 'ibarra_medina_krawinkler_...'"
        )
    for point in np.flatnonzero(rise[peak + 1 :] > 0) + peak + 1:
        if point < len(y) - 1 or y[point] > LARGEST_LAST_RISE * y[point - 1]:
            raise ValueError(
                f"the capacity curve rises again at point {point + given}, from {y[point - 1]:g} to {y[point]:g}, "
                f"after falling from point {peak + given}: only the last point may be higher than the point before, by "
                "at most 1 %. Correct the curve, or remove the points after the fall"
            )
    return x, y
