"""Inputs of the samples of a dataset in memory, which are computed only when a user reads these variables."""

from __future__ import annotations

from collections.abc import Mapping, Set
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray, BackendEntrypoint
from xarray.core import indexing

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.preparation.inputs import Inputs
from warpdyn.campaigns.running.labels import OF_ASSIGNMENT, fill_inputs, scattered_inputs
from warpdyn.model.scene.scene import Scene


def deferred_names(scene: Scene) -> set[str]:
    """Return the names of a run's variables that can be computed after the run (all inputs except `sample`)."""
    return OF_ASSIGNMENT.keys() - {"sample"} | scattered_inputs(scene).keys()


def deferred_variables(run: Run, template: Mapping[str, xr.Variable]) -> dict[str, xr.Variable]:
    """Return the inputs of all samples of a run as lazy variables; a variable stays in memory once it was read fully.

    Args:
        run: The prepared run.
        template: Names, dimensions and attributes of these variables, without samples.
    """
    opened = xr.open_dataset(Deferred(run, template), engine=_Engine)  # type: ignore[arg-type]
    return {str(name): variable for name, variable in opened.variables.items()}


class Deferred:
    """The inputs (such as structure, motion, drawn parameters) of all samples of a run, computed when they are read.

    All scattered parameters are drawn together: when one parameter is read for all samples, the other parameters are
    computed, too, and kept until they are read.

    Args:
        run: The prepared run.
        template: Names, dimensions and attributes of the variables, without samples.
    """

    def __init__(self, run: Run, template: Mapping[str, xr.Variable]) -> None:
        self._inputs, self._structures = Inputs(run, np.arange(0)), run.structures
        self.samples, self.template = run.samples, dict(template)
        self._scattered = scattered_inputs(run.model.scene).keys() & template.keys()
        self._computed: Arrays = {}  # computed inputs that were not read so far

    def read(self, name: str) -> np.ndarray:
        """Return the values of one input for all samples, shape [sample, ...]."""
        if name not in self._computed:
            together = self._scattered if name in self._scattered else {name}
            self._computed |= self._of(np.arange(self._structures), together)
        return self._computed.pop(name)

    def read_some(self, name: str, samples: np.ndarray) -> np.ndarray:
        """Return the values of one input for some samples, given by their numbers, shape [sample, ...]."""
        each = self._inputs.samples_per_structure
        if not samples.size:
            return self._of(np.arange(1), {name})[name][:0]
        structures, place = np.unique(samples // each, return_inverse=True)
        return self._of(structures, {name})[name][place * each + samples % each]

    def _of(self, structures: np.ndarray, names: Set[str]) -> Arrays:
        """Return the values of some inputs for all samples of some structures, by name, shape [sample, ...]."""
        count = structures.size * self._inputs.samples_per_structure
        rows = {name: np.empty((count, *self.template[name].shape[1:]), self.template[name].dtype) for name in names}
        fill_inputs(self._inputs.select(structures), rows)
        return rows


class _Input(BackendArray):
    """One input as a lazy array for xarray; arguments: see `Deferred.read`."""

    def __init__(self, deferred: Deferred, name: str) -> None:
        variable = deferred.template[name]
        self._deferred, self._name = deferred, name
        self.shape, self.dtype = (deferred.samples, *variable.shape[1:]), variable.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._read)

    def _read(self, key: tuple[Any, ...]) -> np.ndarray:
        """Return the values at a key, which contains an index or a slice for each dimension."""
        first, *others = key
        samples = np.arange(self.shape[0])[first]
        if samples.size == self.shape[0] and isinstance(first, slice):
            values = self._deferred.read(self._name)[first]
        else:
            values = self._deferred.read_some(self._name, np.atleast_1d(samples))
        for axis, of_axis in reversed(list(enumerate(others, 1))):
            values = values[(slice(None),) * axis + (of_axis,)]
        return values if samples.ndim else values[0]


class _Engine(BackendEntrypoint):
    """Engine by which xarray opens a `Deferred` as a dataset, whose variables it reads lazily and then keeps."""

    def open_dataset(self, filename_or_obj: Any, *, drop_variables: object = None) -> xr.Dataset:
        """Return the inputs of a `Deferred` as a dataset of lazy variables."""
        found = {}
        for name, variable in filename_or_obj.template.items():
            values = indexing.LazilyIndexedArray(_Input(filename_or_obj, name))
            found[name] = xr.Variable(variable.dims, values, variable.attrs)
        return xr.Dataset(found)
