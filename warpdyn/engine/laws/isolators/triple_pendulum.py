"""Triple friction pendulums in one direction, as a storey law with several corners."""

from __future__ import annotations

from collections.abc import Sequence

from warpdyn.engine.laws.multilinear.parameters import Quadrilinear, Trilinear
from warpdyn.foundations.core.checks import finite_numbers, real_number
from warpdyn.foundations.core.near_misses import suggests_names


@suggests_names
def triple_pendulum(
    *,
    weight: float,
    outer_radii: Sequence[float],
    inner_radii: Sequence[float],
    outer_friction: Sequence[float],
    inner_friction: float,
    yield_displacement: float = 1e-4,
) -> dict[str, object]:
    """Return law and stiffness of a triple friction pendulum in one direction (Fenz and Constantinou 2008).

    The surfaces are counted from below: 1 and 4 are the outer ones, 2 and 3 the inner ones. R are effective radii and
    mu friction coefficients. With increasing displacement u, the force per weight is

    - in regime I (surfaces 2 and 3 slide): mu2 + u / (R2 + R3), until u* = (mu1 - mu2) (R2 + R3);
    - in regime II (surface 1 slides instead of 2): the slope is 1 / (R1 + R3), until
      u** = u* + (mu4 - mu1) (R1 + R3);
    - in regime III (surface 4 slides instead of 3): the slope is 1 / (R1 + R4).

    The law is valid until the slider reaches the stop of surface 1, whose displacement capacity is d1, at
    u = u** + d1 (1 + R4 / R1) - (mu4 - mu1) (R1 + R4). It does not contain the regimes IV and V beyond this stop.

    Args:
        weight: Weight on the bearing [N].
        outer_radii: R1 and R4 [m].
        inner_radii: R2 and R3 [m], below R1 and R4.
        outer_friction: mu1 and mu4 [1], mu1 at most mu4.
        inner_friction: mu2 = mu3 [1], below mu1.
        yield_displacement: Displacement [m] before the first sliding; a rigid bearing would have 0.

    Returns:
        `law`, a `Quadrilinear` (a `Trilinear` if mu1 = mu4), and `stiffness` [N/m]: arguments of a `wd.Spring`, or of a
        storey of a building.

    Raises:
        ValueError: If a value is not finite or not above 0, or radii, friction coefficients or the yield displacement
            are not in this order.

    Example:
        >>> bearing = wd.laws.triple_pendulum(
        ...     weight=2e6,
        ...     outer_radii=(1.25, 1.25),
        ...     inner_radii=(0.36, 0.36),
        ...     outer_friction=(0.052, 0.14),
        ...     inner_friction=0.012,
        ... )
        >>> wd.Spring("bearing", {"x": 1.0}, **bearing).law.name
        'quadrilinear'
    """
    weight = real_number("weight [N]", weight, above=0)
    (r1, r4), (r2, r3) = _pair("outer_radii", outer_radii, "m"), _pair("inner_radii", inner_radii, "m")
    mu1, mu4 = _pair("outer_friction", outer_friction, "1")
    mu2 = real_number("inner_friction", inner_friction, above=0)
    yields = real_number("yield_displacement [m]", yield_displacement, above=0)
    if not (r2 < r1 and r3 < r4):
        raise ValueError(
            f"inner_radii are {r2:g} and {r3:g} m; they must be below the outer_radii, {r1:g} and {r4:g} m: correct "
            "them, or exchange both arguments"
        )
    if not mu2 < mu1 <= mu4:
        raise ValueError(
            f"inner_friction is {mu2:g} and outer_friction is {mu1:g} and {mu4:g}; they must increase from the inner "
            "surfaces to surface 1 and then 4: count the surfaces so that surface 1 slides before surface 4"
        )
    second = (mu1 - mu2) * (r2 + r3)
    if not yields < second:
        raise ValueError(
            f"yield_displacement is {yields:g} m; it must be below the displacement at which surface 1 slides, "
            f"{second:g} m"
        )
    force = weight * (mu2 + yields / (r2 + r3))
    stiffness = force / yields
    hardening = weight / (r1 + r4) / stiffness
    corner_2 = {"ductility_2": second / yields, "force_ratio_2": weight * mu1 / force}
    if mu1 == mu4:
        return {"law": Trilinear(yield_force=force, **corner_2, hardening_ratio=hardening), "stiffness": stiffness}
    third = second + (mu4 - mu1) * (r1 + r3)
    corner_3 = {"ductility_3": third / yields, "force_ratio_3": weight * mu4 / force}
    law = Quadrilinear(yield_force=force, **corner_2, **corner_3, hardening_ratio=hardening)
    return {"law": law, "stiffness": stiffness}


def _pair(name: str, given: Sequence[float], units: str) -> tuple[float, float]:
    """Return two values above 0, or raise a ValueError."""
    values = finite_numbers(name, given, units)
    if values.shape != (2,) or (values <= 0).any():
        raise ValueError(f"{name} must be two values above 0 [{units}], got {given!r}")
    return float(values[0]), float(values[1])
