"""Random base motions that follow from given standard normal values, one motion per structure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from warpdyn.foundations.core.checks import check_memory
from warpdyn.foundations.core.frozen_values import FrozenArrays
from warpdyn.model.ground_motions.excitation import THE_NOISE, Assignment, SingleLoad, Timeline, substeps_of
from warpdyn.model.ground_motions.filtered_noise import FilteredNoise

BYTES_OF_A_VALUE = 24  # of an acceleration: float64 here, and copies for the kernel


@dataclass(frozen=True, eq=False)
class NoiseOfNormals(FrozenArrays, SingleLoad):
    """Base motions of a FilteredNoise for given normal values: one motion per structure, linear between nodes.

    Args:
        values: Acceleration at the nodes [m/s2], shape [structure, node].
        interval: Time between nodes [s].
    """

    values: np.ndarray
    interval: float

    is_same_for_all = False
    kernel_load = "base_acceleration"

    @classmethod
    def of(cls, noise: FilteredNoise, normals: np.ndarray) -> NoiseOfNormals:
        """Return the motions for standard normal values, shape [structure, variable]; `variables_of_noise` of each.

        The values of the first node come first: one value per state of the noise, then those of the next node.
        """
        process, envelope = noise.spectrum.recursion(noise.interval), noise.envelope_at_nodes()
        structures, states = len(normals), process.output.size
        what = f"{structures} motions of {envelope.size} nodes"
        check_memory(what, float(BYTES_OF_A_VALUE) * structures * envelope.size, "reduce samples")
        # Arrays [node, structure, ...] are contiguous for each node.
        drawn = normals.reshape(structures, envelope.size, states).transpose(1, 0, 2)
        path, kicks = drawn[0] @ process.start.T, drawn[1:] @ process.kick.T
        accelerations = np.empty((envelope.size, structures))
        accelerations[0] = path @ process.output
        for node, kick in enumerate(kicks, 1):
            path = path @ process.growth.T + kick
            accelerations[node] = path @ process.output
        values = np.ascontiguousarray((envelope[:, None] * accelerations).T)
        return cls(values, noise.interval)

    @property
    def duration(self) -> float:
        """Duration of the motions [s]."""
        return self.interval * (self.values.shape[1] - 1)

    @property
    def structures_given(self) -> int:
        """Number of motions, which is the number of structures."""
        return len(self.values)

    def assign(self, structures: np.ndarray, seed: int, event: int = 0) -> Assignment:
        """Return one sample for each structure with a given index, with the motion of the same index."""
        index = np.asarray(structures, dtype=np.int32)
        return Assignment(index, index, np.ones(index.size))

    def timeline(self, step: float | None, target: float, *, resample: bool) -> Timeline:
        """Return the time grid: integration steps that divide the interval between nodes."""
        count, nodes = self.values.shape
        substeps = substeps_of(self.interval, step, target, THE_NOISE)
        shared: Any = self  # the values of all motions
        return Timeline((shared,), np.full(count, self.interval), np.full(count, substeps), np.full(count, nodes - 1))

    def pack_values(self, timeline: Timeline) -> dict[str, np.ndarray]:
        """Return the values of all motions in one array, and the index of the first value of each motion."""
        count, nodes = self.values.shape
        return {"values": self.values.ravel(), "first": nodes * np.arange(count)}


def variables_of_noise(noise: FilteredNoise) -> int:
    """Return the number of standard normal variables of a motion: the states of the noise at each node."""
    return (noise.intervals + 1) * noise.spectrum.recursion(noise.interval).output.size
