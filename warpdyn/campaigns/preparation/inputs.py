"""Inputs of samples (structure, motion, parameters), which depend only on the seed and on the structures' numbers."""

from __future__ import annotations

import copy
from functools import cached_property

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.run import Run
from warpdyn.model.ground_motions.excitation import Assignment


class Inputs:
    """Inputs of all samples of some structures; each input is computed when it is first needed.

    Args:
        run: The prepared run.
        structures: Indices of the structures in the run, increasing, shape [structure].
    """

    def __init__(self, run: Run, structures: np.ndarray) -> None:
        self.scene, self.structures = run.model.scene, structures
        self._sampler, self._seed, self._threads = run.sampler, run.model.seed, run.execution.cores
        self.samples_per_structure = run.samples // run.structures

    def select(self, structures: np.ndarray) -> Inputs:
        """Return the inputs of other structures of the run (increasing indices)."""
        part = copy.copy(self)
        for name in ("assignment", "drawn", "height"):
            part.__dict__.pop(name, None)
        part.structures = structures
        return part

    @property
    def sample(self) -> np.ndarray:
        """Index of each sample in the run, shape [sample]."""
        each = self.samples_per_structure
        return np.add.outer(self.structures * each, np.arange(each)).astype(np.int32).ravel()

    @cached_property
    def assignment(self) -> Assignment:
        """Structure, motion and scale factor of each sample."""
        return self.scene.excitation.assign(self.structures, self._seed)

    @cached_property
    def drawn(self) -> Arrays:
        """Scattered parameters of the structures by name; the first dimension is the structure."""
        return self._sampler.draw(self.structures, self._threads)

    @cached_property
    def height(self) -> np.ndarray:
        """Scattered storey heights [m], shape [structure, storey]."""
        if "drawn" in self.__dict__:
            return self.drawn["height"]
        return self._sampler.draw(self.structures, self._threads, is_all=False, only=("height",))["height"]
