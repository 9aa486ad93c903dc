"""Base class of the distributions of one variable."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np


class Distribution(ABC):
    """Base class: a distribution of one variable, whose values follow from a standard normal variable."""

    @abstractmethod
    def from_standard_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the values with the same cumulative probabilities as standard normal values z, in the shape of z."""

    @abstractmethod
    def to_standard_normal(self, value: float) -> float:
        """Return the standard normal value with the same cumulative probability as a value [units of the variable]."""
