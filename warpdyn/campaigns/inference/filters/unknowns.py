"""The unknown constants of a filter: parameters of the structure, and an offset of each sensor."""

from __future__ import annotations

import numpy as np

from warpdyn.campaigns.inference.posterior import QUANTILES, flat_columns, weighted_quantiles
from warpdyn.campaigns.inference.priors import Prior
from warpdyn.model.scene.distributions.distribution import Distribution


class Unknowns:
    """The unknown constants of a filter as functions of standard normal variables, shape [member, variable].

    Args:
        prior: Prior of the parameters; None: no unknown parameter.
        offset: Prior of the offset of each sensor; None: no offset.
        sensors: Number of sensors.
    """

    def __init__(self, prior: Prior | None, offset: Distribution | None, sensors: int) -> None:
        self.prior, self.offset, self.sensors = prior, offset, sensors

    @property
    def of_parameters(self) -> int:
        """Number of variables of the parameters of the structure, which come first."""
        return 0 if self.prior is None else self.prior.variables

    @property
    def variables(self) -> int:
        """Number of variables."""
        return self.of_parameters + (0 if self.offset is None else self.sensors)

    def offsets(self, normals: np.ndarray) -> np.ndarray:
        """Return the offsets of the sensors, shape [member, sensor]."""
        if self.offset is None:
            return np.zeros((len(normals), self.sensors))
        return np.asarray(self.offset.from_standard_normal(normals[:, self.of_parameters :]))

    def values(self, normals: np.ndarray) -> dict[str, np.ndarray]:
        """Return the values of each unknown by name, shape [member], [member, storey] or [member, sensor]."""
        found: dict[str, np.ndarray] = {}
        if self.prior is not None:
            found = self.prior.shown(self.prior.values(normals[:, : self.of_parameters]))
        if self.offset is not None:
            found["sensor_offset"] = self.offsets(normals)
        return found

    def columns(self, normals: np.ndarray) -> dict[str, np.ndarray]:
        """Return the values of each scalar unknown by name, shape [member]."""
        return flat_columns(self.values(normals))

    def summary(self, normals: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Return mean, standard deviation and the QUANTILES of each scalar unknown, shape [5, unknown]."""
        if not self.variables:
            return np.zeros((2 + len(QUANTILES), 0))
        values = np.stack(list(self.columns(normals).values()), axis=1)
        mean = weights @ values
        deviation = np.sqrt(weights @ np.square(values - mean))
        return np.stack([mean, deviation, *weighted_quantiles(values, weights)])
