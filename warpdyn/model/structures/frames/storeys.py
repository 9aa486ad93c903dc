"""Rigid floors and storeys of a frame."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from warpdyn.model.structures.frames.members.numbering import Numbering
from warpdyn.model.structures.frames.tables.table import Rows


class FrameStoreys:
    """Properties of a Frame that describe its floors and storeys."""

    nodes: Rows
    supports: dict[str, dict[str, bool | float]]
    diaphragms: dict[str, list[str]]
    coordinates: np.ndarray
    numbering: Numbering

    @property
    def floors(self) -> tuple[str, ...]:
        """Diaphragms from the lowest to the highest."""
        return tuple(sorted(self.diaphragms, key=self.level_of))

    def level_of(self, diaphragm: str) -> float:
        """Return the height of a diaphragm [m]."""
        return float(self.nodes[self.diaphragms[diaphragm][0]]["y"])

    def elevations(self, numbers: np.ndarray) -> np.ndarray:
        """Return the heights of horizontal degrees of freedom above the lowest support [m], 0 for others.

        Args:
            numbers: Numbers of the degrees of freedom, shape [dof].
        """
        found, height = np.zeros(numbers.size), self.coordinates[:, 1]
        base = min((self.nodes[name]["y"] for name in self.supports), default=float(height.min()))
        for node, number in enumerate(self.numbering.places[:, 0]):
            found[numbers == number] = height[node] - base
        return found

    @cached_property
    def storey_drifts(self) -> dict[str, tuple[str, str | None, float]]:
        """Storeys from the ground up, {"drift 1": (upper floor, lower floor or None for the ground, height [m])}."""
        found: dict[str, tuple[str, str | None, float]] = {}
        free = self.numbering.free_names
        base = min((self.nodes[name]["y"] for name in self.supports), default=float(self.coordinates[:, 1].min()))
        below: str | None = None
        level = base
        for floor in self.floors:
            height = self.level_of(floor) - level
            if floor in free and height > 0:
                found[f"drift {len(found) + 1}"] = (floor, below, height)
                below = floor
            elif floor not in free:
                below = None
            level = self.level_of(floor)
        return found
