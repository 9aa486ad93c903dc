"""A footing that lifts off: vertical contacts without tension, pressed onto the soil by the weight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpdyn.engine.laws.contacts.parameters import PreloadedContact
from warpdyn.foundations.core.checks import real_number, shortened
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.structures.lumped.spring import Spring

FEWEST_POINTS, MOST_POINTS = 2, 40


@with_suggestions
@dataclass(frozen=True)
class FoundationUplift:
    """How a footing may lift off the soil; for `wd.structure_on_soil(..., uplift=...)`.

    The footing is rigid and rests on `points` vertical contacts (Winkler springs without tension) in the direction of
    the motion. The weight presses them onto the soil, so that all of them settle equally. Together they have the
    vertical stiffness and the rocking stiffness of the foundation:

    - two contacts have equal stiffness and the distance sqrt(rocking stiffness / vertical stiffness) to the centre;
    - more contacts are equally spaced from edge to edge of the footing, `half_width` being the distance of the edges to
      the centre; the two edges have another stiffness than the contacts between them.

    Args:
        points: Number of contacts, 2 to 40.
        half_width: Distance of the edges of the footing to its centre, in the direction of the motion [m]; only for
            three or more contacts.
        weight: Weight on the soil [N]; None: the weight of all masses of structure and foundation.

    Raises:
        ValueError: If a value is out of its range, or `half_width` is missing or has no effect.
        TypeError: If `points` is not a whole number.

    Example:
        >>> wd.FoundationUplift(points=9, half_width=6.0).points
        9
    """

    points: int = 2
    half_width: float | None = None
    weight: float | None = None

    def __post_init__(self) -> None:
        if isinstance(self.points, bool) or not isinstance(self.points, int | np.integer):
            raise TypeError(f"points must be a whole number of contacts, got {shortened(self.points)}")
        if not FEWEST_POINTS <= self.points <= MOST_POINTS:
            raise ValueError(f"points must be from {FEWEST_POINTS} to {MOST_POINTS}, got {self.points}")
        if self.points > FEWEST_POINTS and self.half_width is None:
            raise ValueError(
                f"half_width is missing: {self.points} contacts lie between the edges of the footing; give the "
                "distance of its edges to its centre in m, or points=2"
            )
        if self.points == FEWEST_POINTS and self.half_width is not None:
            raise ValueError(
                "half_width has no effect on two contacts, whose distance follows from the vertical and the rocking "
                "stiffness: give points=3 or more, or remove half_width="
            )
        for name, units in (("half_width", "m"), ("weight", "N")):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, real_number(f"{name} [{units}]", getattr(self, name), above=0))

    def positions_and_stiffness(
        self, vertical_stiffness: float, rocking_stiffness: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return distance to the centre [m] and stiffness [N/m] of each contact, shape [contact].

        Args:
            vertical_stiffness: Sum of the stiffnesses [N/m].
            rocking_stiffness: Sum of the stiffnesses times their squared distances [N m].

        Raises:
            ValueError: If contacts between these edges cannot have both stiffnesses.
        """
        squared = rocking_stiffness / vertical_stiffness
        if self.half_width is None:
            return np.array([-1.0, 1.0]) * np.sqrt(squared), np.full(2, vertical_stiffness / 2)
        relative = np.linspace(-1.0, 1.0, self.points)
        # Stiffness of an edge and of a contact between the edges, from their sum and their second moment.
        within = float((relative[1:-1] ** 2).sum())
        sums = np.array([[2.0, self.points - 2.0], [2.0, within]])
        edge, between = np.linalg.solve(sums, [1.0, squared / self.half_width**2])
        if min(edge, between) <= 0:
            least = self.half_width * np.sqrt(within / (self.points - 2))
            raise ValueError(
                f"{self.points} contacts with a half_width of {self.half_width:g} m cannot have the vertical and the "
                f"rocking stiffness of the foundation: the root of their ratio is {np.sqrt(squared):.4g} m, and must "
                f"be above {least:.4g} m and below {self.half_width:g} m. Correct the stiffnesses or half_width=, or "
                "give points=2"
            )
        stiffness = np.full(self.points, between)
        stiffness[[0, -1]] = edge
        return self.half_width * relative, vertical_stiffness * stiffness

    def contacts(
        self, vertical_stiffness: float, rocking_stiffness: float, rocking_dashpot: float, weight: float
    ) -> list[Spring]:
        """Return the contacts as springs between the degrees of freedom "heave" and "rocking" and the ground.

        Args:
            vertical_stiffness: Vertical stiffness of the foundation [N/m].
            rocking_stiffness: Rocking stiffness of the foundation [N m].
            rocking_dashpot: Coefficient of the rocking dashpot [N m s]; each contact has a share of it.
            weight: Weight on the soil [N].
        """
        places, stiffness = self.positions_and_stiffness(vertical_stiffness, rocking_stiffness)
        return [
            Spring(
                f"contact {number}",
                {"heave": 1.0, "rocking": float(place)},
                law=PreloadedContact(
                    preload=float(weight * own / vertical_stiffness),
                    contact_damping=float(rocking_dashpot * own / rocking_stiffness),
                ),
                stiffness=float(own),
                rotational=False,
            )
            for number, (place, own) in enumerate(zip(places, stiffness, strict=True), start=1)
        ]
