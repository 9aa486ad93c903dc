"""Several components of a ground motion that act together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from warpdyn.foundations.core.checks import checked_text, real_number
from warpdyn.foundations.core.description import fingerprint, html_table
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.orientations import orientation
from warpdyn.model.ground_motions.records.components.pairing import pairs

NAMES = ("x", "y", "vertical")
MOST_COSINE = 0.05  # of the angle between both components: 3 degrees off a right angle


@with_suggestions
@dataclass(frozen=True, eq=False, repr=False)
class PairOfMotions:
    """Two horizontal components of a ground motion, and perhaps a vertical one, that act together on a structure.

    The components of base motion of a LumpedStructure are, in this order, `x`, `y` and `vertical`; a scale factor
    multiplies all of them. In a design, a measure of one component, such as the peak ground acceleration, becomes the
    geometric mean of `x` and `y`; `LargerComponent` and `RotatedSpectralAcceleration` (RotD50, RotD100) are other
    measures of pairs. A random angle of incidence is the parameter `incidence_angle` of the structure.

    Args:
        x: Component along the first influence vector of the structure.
        y: Component along the second influence vector, 90 degrees anticlockwise from `x`, seen from above.
        vertical: Component along the third influence vector; None: no vertical motion.
        name: Name of the pair in results; None: that of `x`.

    Raises:
        ValueError: If the components differ in step or number of samples, or `x` or `y` is a vertical component.
        TypeError: If a component is not a GroundMotion.

    Example:
        >>> pair = wd.PairOfMotions(motions[0], motions[1], name="both")
        >>> pair
        PairOfMotions('both', 9.98 s at steps of 0.02 s, PGA 0.7112 g and 0.9043 g)
        >>> np.allclose(pair.turned(90.0).x.acceleration, pair.y.acceleration)
        True
    """

    x: GroundMotion
    y: GroundMotion
    vertical: GroundMotion | None = None
    name: str = None  # type: ignore[assignment]  # text once it is checked

    def __post_init__(self) -> None:
        for name, motion in zip(NAMES, (self.x, self.y, self.vertical), strict=True):
            if not isinstance(motion, GroundMotion) and not (name == "vertical" and motion is None):
                raise TypeError(f"PairOfMotions: {name} must be a GroundMotion, got {type(motion).__name__}")
        object.__setattr__(
            self, "name", checked_text("PairOfMotions.name", self.x.name if self.name is None else self.name)
        )
        for name, motion in zip(NAMES[1:], self.components[1:], strict=False):
            if abs(motion.step - self.x.step) > 1e-9 * self.x.step:
                raise ValueError(
                    f"pair {self.name!r}: x has a step of {self.x.step:g} s and {name} one of {motion.step:g} s; they "
                    f"must be equal: call motion.resampled({min(motion.step, self.x.step):g})"
                )
            if motion.values.size != self.x.values.size:
                raise ValueError(
                    f"pair {self.name!r}: x has {self.x.values.size} samples and {name} has {motion.values.size}; the "
                    "numbers must be equal: call PairOfMotions.from_records(motions), which adds zeros to the shorter "
                    "one, or cut the longer one"
                )
        for name, motion in zip(NAMES[:2], self.components, strict=False):
            if orientation(motion.component).kind == "vertical":
                raise ValueError(
                    f"pair {self.name!r}: {name} is {motion.name!r}, a vertical component ({motion.component!r}): give "
                    "a horizontal one, or vertical="
                )
        first, second = (orientation(motion.component).azimuth for motion in (self.x, self.y))
        if first is not None and second is not None and abs(np.cos(np.radians(first - second))) > MOST_COSINE:
            raise ValueError(
                f"pair {self.name!r}: the components {self.x.component!r} and {self.y.component!r} are not "
                "perpendicular: give two components that are 90 degrees apart"
            )

    @classmethod
    def from_records(cls, motions: Sequence[GroundMotion]) -> list[PairOfMotions]:
        """Return the pair of each record, with the name of the record; zeros are added to the shorter component.

        If the azimuths of both components are known, `y` is 90 degrees anticlockwise from `x`, seen from above, such as
        `x` east and `y` north. Angles of incidence and torsion assume such axes. If they are unknown ("L" and "T", "H1"
        and "H2"), `x` is the component that comes first: for another order, call `PairOfMotions(x, y)`.

        Args:
            motions: The motions, two horizontal ones for each `record`; vertical components are ignored.

        Raises:
            ValueError: If motions are not pairs (see `records.pairs`), or the components of a record have different
                steps or are not perpendicular.
            TypeError: If a motion is not a GroundMotion.

        Example:
            >>> from dataclasses import replace
            >>> recorded = [replace(motions[i], record="quake", component="NE"[i]) for i in (0, 1)]
            >>> wd.PairOfMotions.from_records(recorded)
            [PairOfMotions('quake', 9.98 s at steps of 0.02 s, PGA 0.9043 g and 0.7112 g)]
        """
        found = []
        for first, second in pairs(motions):
            if _is_left_handed(first, second):
                first, second = second, first
            longest = max(first.values.size, second.values.size)
            found.append(cls(first.lengthened(longest), second.lengthened(longest), name=first.record))
        return found

    @property
    def components(self) -> tuple[GroundMotion, ...]:
        """The components: `x`, `y` and, if it is given, `vertical`."""
        return (self.x, self.y) if self.vertical is None else (self.x, self.y, self.vertical)

    @property
    def step(self) -> float:
        """Sampling step [s]."""
        return self.x.step

    @property
    def values(self) -> np.ndarray:
        """Ground accelerations [m/s2], shape [time, component]."""
        return np.stack([motion.acceleration for motion in self.components], axis=1)

    @property
    def label(self) -> str:
        """Name of the pair in the dataset."""
        return self.name

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return self.x.duration

    @property
    def peak_ground_acceleration(self) -> float:
        """Largest absolute acceleration of all components [m/s2]."""
        return max(motion.peak_ground_acceleration for motion in self.components)

    def resampled(self, step: float) -> PairOfMotions:
        """Return the pair at another step [s], by linear interpolation."""
        others = {name: motion.resampled(step) for name, motion in zip(NAMES, self.components, strict=False)}
        return replace(self, **others)  # type: ignore[arg-type] # of GroundMotions

    def turned(self, angle: float) -> PairOfMotions:
        """Return the same motion for a structure whose axes are turned anticlockwise, seen from above.

        Args:
            angle: Angle from the old to the new x axis [degrees].
        """
        turn = np.radians(real_number("angle [degrees]", angle))
        cosine, sine = np.cos(turn), np.sin(turn)
        x, y = self.x.acceleration, self.y.acceleration
        return replace(
            self,
            x=replace(self.x, acceleration=cosine * x + sine * y, component=""),
            y=replace(self.y, acceleration=cosine * y - sine * x, component=""),
        )

    def description(self) -> dict[str, object]:
        """Return the pair as a dictionary for JSON: its name, and number and digest of its samples."""
        said: dict[str, object] = {"name": self.name, "source": self.x.source, "step": self.step}
        said["samples"] = self.x.acceleration.size
        said["components"] = [motion.description() for motion in self.components]
        return said | {"digest": fingerprint(self.values, self.step)[:16]}

    def __repr__(self) -> str:
        peaks = " and ".join(f"{each.peak_ground_acceleration / STANDARD_GRAVITY:.4g} g" for each in self.components)
        return f"PairOfMotions({self.name!r}, {self.duration:.6g} s at steps of {self.step:g} s, PGA {peaks})"

    def _repr_html_(self) -> str:
        rows = [(name, repr(motion)) for name, motion in zip(NAMES, self.components, strict=False)]
        return html_table(f"Pair of motions {self.name!r}", rows)


def _is_left_handed(x: GroundMotion, y: GroundMotion) -> bool:
    """Return whether the azimuths are known and `y` is clockwise from `x`, seen from above."""
    first, second = (orientation(motion.component).azimuth for motion in (x, y))
    return first is not None and second is not None and bool(np.sin(np.radians(first - second)) < 0)


def components_of(motion: GroundMotion | PairOfMotions) -> tuple[GroundMotion, ...]:
    """Return the components of a pair of motions, or the motion itself."""
    return motion.components if isinstance(motion, PairOfMotions) else (motion,)
