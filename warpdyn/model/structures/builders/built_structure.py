"""The base class of lumped structures that builders make from properties of a building, a tank or a vehicle."""

from __future__ import annotations

from typing import Any, ClassVar

from warpdyn.model.structures.lumped.structure import LumpedStructure

BASE_SHEAR = "base shear"  # output of builders whose outputs are forces


class BuiltStructure(LumpedStructure):
    """Base class of lumped structures whose scenes are read from JSON as those of a LumpedStructure.

    Attributes:
        names_of_builder: Names of the attributes that a LumpedStructure does not have.
    """

    names_of_builder: ClassVar[tuple[str, ...]] = ()

    @property
    def read_from_json(self) -> LumpedStructure:
        """The LumpedStructure that a scene read from JSON has instead, by which fingerprints identify the structure."""
        found = object.__new__(LumpedStructure)
        vars(found).update({name: each for name, each in vars(self).items() if name not in self.names_of_builder})
        return found

    def scatter_problem(self, name: str, *, is_common_factor: bool) -> str | None:
        """Return why the stiffness cannot be random if outputs are forces; None for other parameters."""
        if name != "stiffness" or BASE_SHEAR not in self.outputs:
            return super().scatter_problem(name, is_common_factor=is_common_factor)
        return (
            f"the outputs {BASE_SHEAR!r} and the moments are computed from the nominal stiffness, and would be wrong "
            f"for a random one: build the structure with {type(self).__name__}(..., force_outputs=False)"
        )

    def description(self) -> dict[str, Any]:
        """Return the structure as a dictionary, for its JSON."""
        return {**super().description(), "type": LumpedStructure.__name__}
