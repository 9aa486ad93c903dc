"""A row of the table: a reference result, the result of warpdyn, and the tolerance of their difference."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One quantity.

    Args:
        analysis: Name of the analysis.
        quantity: Name of the quantity, with its unit.
        reference: Reference result.
        found: Result of warpdyn.
        tolerance: Largest difference that the errors of both results explain, in the unit of the quantity.
    """

    analysis: str
    quantity: str
    reference: float
    found: float
    tolerance: float

    @property
    def share(self) -> float:
        """Absolute difference divided by the tolerance."""
        return abs(self.found - self.reference) / self.tolerance
