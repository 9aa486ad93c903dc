"""The base class of lumped structures that builders make from properties of a building, a tank or a vehicle."""

from __future__ import annotations

from typing import Any

from warpdyn.model.structures.lumped.structure import LumpedStructure


class BuiltStructure(LumpedStructure):
    """Base class of lumped structures whose scenes are read from JSON as those of a LumpedStructure."""

    def description(self) -> dict[str, Any]:
        """Return the structure as a dictionary, for its JSON."""
        return {**super().description(), "type": LumpedStructure.__name__}
