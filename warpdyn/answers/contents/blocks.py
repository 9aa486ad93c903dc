"""Rigid blocks: their geometry and friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from warpdyn.foundations.core.checks import real_number, shortened
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.units import STANDARD_GRAVITY

LARGEST_BLOCK = 20.0  # [m], half width or half height; larger numbers are probably in cm or mm
Block = TypeVar("Block", "RockingBlock", "SlidingBlock")


@with_suggestions
@dataclass(frozen=True)
class RockingBlock:
    """A rigid rectangular block that rocks on its base without sliding (Housner 1963).

    With the size R = sqrt(b^2 + h^2) and the angle alpha = atan(b / h), the rotation theta about a corner follows
    theta'' = -p^2 (sin(s alpha - theta) + (a / g) cos(s alpha - theta)), with s = sign(theta), p = sqrt(3 g / (4 R))
    and the horizontal base acceleration a. The block starts to rock if abs(a) > g tan(alpha). At each impact the
    angular velocity is multiplied by the coefficient of restitution.

    Args:
        half_width: Half of the width b [m], in the direction of the motion.
        half_height: Half of the height h [m].
        restitution: Angular velocity after an impact divided by that before [1], above 0 and at most 1. None: 1 - 1.5
            sin(alpha)^2, which conserves the angular momentum about the new corner (Housner).

    Raises:
        ValueError: If a length is not finite and above 0, the restitution is out of its range, or the block is so wide
            (alpha above 54.7 degrees) that Housner's restitution is not positive.

    Example:
        >>> cabinet = wd.RockingBlock(half_width=0.25, half_height=1.0)
        >>> round(cabinet.slenderness, 3), round(cabinet.frequency, 3), round(cabinet.coefficient_of_restitution, 3)
        (0.245, 2.671, 0.912)
    """

    half_width: float
    half_height: float
    restitution: float | None = None

    def __post_init__(self) -> None:
        for name in ("half_width", "half_height"):
            value = real_number(f"RockingBlock.{name} [m]", getattr(self, name), above=0)
            if value > LARGEST_BLOCK:
                warn_caller(f"RockingBlock: {name} is {value:g} m: give lengths in m, not in cm or mm")
            object.__setattr__(self, name, value)
        if self.restitution is None:
            if self.coefficient_of_restitution <= 0:
                raise ValueError(
                    f"RockingBlock: a block of half width {self.half_width:g} m and half height {self.half_height:g} m "
                    "does not rock: Housner's restitution, 1 - 1.5 sin(alpha)^2, is "
                    f"{self.coefficient_of_restitution:.2g}. Exchange half_width= and half_height=, or use SlidingBlock"
                )
            if self.half_width > self.half_height:
                warn_caller(
                    f"RockingBlock: the block is wider ({self.half_width:g} m) than high ({self.half_height:g} m), and "
                    "probably slides: check half_width= and half_height="
                )
            return
        restitution = real_number("RockingBlock.restitution", self.restitution, above=0)
        if restitution > 1:
            raise ValueError(f"RockingBlock.restitution must be at most 1, got {restitution:g}")
        object.__setattr__(self, "restitution", restitution)

    @property
    def slenderness(self) -> float:
        """Angle alpha = atan(b / h) [rad]."""
        return float(np.arctan2(self.half_width, self.half_height))

    @property
    def frequency(self) -> float:
        """Frequency parameter p = sqrt(3 g / (4 R)) [rad/s]."""
        return float(np.sqrt(0.75 * STANDARD_GRAVITY / np.hypot(self.half_width, self.half_height)))

    @property
    def static_acceleration(self) -> float:
        """Base acceleration g tan(alpha) at which the block starts to rock [m/s2]."""
        return STANDARD_GRAVITY * self.half_width / self.half_height

    @property
    def coefficient_of_restitution(self) -> float:
        """Angular velocity after an impact divided by that before [1]: given, or Housner's value."""
        return float(1 - 1.5 * np.sin(self.slenderness) ** 2) if self.restitution is None else self.restitution


@with_suggestions
@dataclass(frozen=True)
class SlidingBlock:
    """A rigid block that slides on its base with Coulomb friction, without rocking (Newmark 1965).

    The velocity v relative to the base follows v' = -a - mu g sign(v) while the block slides; it starts to slide if
    abs(a) > mu g.

    Args:
        friction: Friction coefficient mu [1].

    Raises:
        ValueError: If the coefficient is not finite and above 0.

    Example:
        >>> wd.SlidingBlock(friction=0.3).resistance.__round__(3)  # m/s2
        2.942
    """

    friction: float

    def __post_init__(self) -> None:
        friction = real_number("SlidingBlock.friction", self.friction, above=0)
        if friction > 2:
            warn_caller(f"SlidingBlock: a friction coefficient of {friction:g} is implausible: 30 % is 0.3")
        object.__setattr__(self, "friction", friction)

    @property
    def resistance(self) -> float:
        """Base acceleration mu g at which the block starts to slide [m/s2]."""
        return self.friction * STANDARD_GRAVITY


def checked_blocks(function: str, blocks: object, kind: type[Block]) -> dict[str, Block]:
    """Return blocks by name after a check; one block without a name is named "block".

    Args:
        function: Name of the public function, for messages.
        blocks: One block, or a mapping from names to blocks.
        kind: Class of the blocks.
    """
    if isinstance(blocks, kind):
        return {"block": blocks}
    if not isinstance(blocks, Mapping) or not blocks:
        raise TypeError(
            f"{function}: blocks must be a {kind.__name__}, or a dictionary of names and {kind.__name__} objects, got "
            f"{shortened(blocks)}"
        )
    for name, each in blocks.items():
        if not isinstance(name, str) or not isinstance(each, kind):
            raise TypeError(
                f"{function}: blocks[{name!r}] must be a {kind.__name__} with a name (text), got {shortened(each)}"
            )
    return dict(blocks)
