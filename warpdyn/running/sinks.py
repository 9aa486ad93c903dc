"""Tables that take the samples of a run block by block: in memory, in a file, or into statistics alone."""

from __future__ import annotations

from types import TracebackType
from typing import Protocol, Self

import numpy as np
import xarray as xr

from warpdyn.files.netcdf import GrowingFile
from warpdyn.integration.model import Model
from warpdyn.reduction.reduction import Reduction
from warpdyn.running.labels import Arrays, Column, labelled, lengths


class Table(Protocol):
    """A table that takes the rows of a run's samples, used in a `with` statement.

    Args:
        columns: Variables of the dataset with one value for each sample.
    """

    columns: dict[str, Column]

    def __enter__(self) -> Self: ...

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None: ...

    def rows_for(self, samples: int) -> Arrays:
        """Return memory for the next samples."""

    def add(self, rows: Arrays) -> None:
        """Add samples whose rows are complete, after all earlier samples."""

    def finish(self, rest: xr.Dataset) -> xr.Dataset:
        """Return the dataset, with the variables and attributes that are known only at the end."""


class InMemory:
    """The whole dataset, each variable allocated once.

    Args:
        model: How the samples are integrated.
        columns: Variables of the dataset with one value for each sample.
        samples: Number of samples in the run.
    """

    def __init__(self, model: Model, columns: dict[str, Column], samples: int) -> None:
        self.model, self.columns = model, columns
        self.rows, self._given = blank_rows(model, columns, samples), 0

    def __enter__(self) -> InMemory:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        pass

    def rows_for(self, samples: int) -> Arrays:
        """Return memory for the next samples."""
        self._given += samples
        return {name: values[self._given - samples : self._given] for name, values in self.rows.items()}

    def add(self, rows: Arrays) -> None:
        """Add samples whose rows are complete; nothing is copied, as they are in place."""

    def finish(self, rest: xr.Dataset) -> xr.Dataset:
        """Return the dataset, with the variables and attributes that are known at the end."""
        dataset = labelled(self.model, self.columns, self.rows)
        attributes = dataset.attrs | rest.attrs
        return (dataset.merge(rest) if rest.variables else dataset).assign_attrs(attributes)


class InFile:
    """A netCDF file that grows; a block's rows are freed when they have been written.

    Args:
        model: How the samples are integrated.
        columns: Variables of the dataset with one value for each sample.
        file: The file.
    """

    def __init__(self, model: Model, columns: dict[str, Column], file: GrowingFile) -> None:
        self.model, self.columns, self.file = model, columns, file

    def __enter__(self) -> InFile:
        self.file.__enter__()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.file.__exit__(kind, error, trace)

    def rows_for(self, samples: int) -> Arrays:
        """Return memory for the next samples."""
        return blank_rows(self.model, self.columns, samples)

    def add(self, rows: Arrays) -> None:
        """Take samples whose rows are complete, after all those before them."""
        self.file.append(rows, lambda first: labelled(self.model, self.columns, first))

    def finish(self, rest: xr.Dataset) -> xr.Dataset:
        """Return the dataset as the file has it, with the variables and attributes that are known at the end."""
        self.file.finish(rest)
        return xr.open_dataset(self.file.unfinished.path, engine="netcdf4")


class Reduced:
    """The statistics of a run, to which the rows of blocks are added; the memory of rows serves blocks in turn.

    Args:
        model: How the samples are integrated.
        columns: Variables with one value for each sample, of which those that the statistics read are held.
        reduction: The statistics.
        structures: Numbers of the run's structures among those of the statistics.
    """

    def __init__(self, model: Model, columns: dict[str, Column], reduction: Reduction, structures: np.ndarray) -> None:
        self.model, self.columns = model, {name: columns[name] for name in reduction.needs}
        self._reduction, self._structures, self._done = reduction, structures, 0
        self._samples_per_structure = model.scene.excitation.samples_per_structure
        self._free: list[Arrays] = []

    def __enter__(self) -> Reduced:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        pass

    def rows_for(self, samples: int) -> Arrays:
        """Return memory for the next samples."""
        for place, rows in enumerate(self._free):
            if len(rows["status"]) == samples:
                return self._free.pop(place)
        return blank_rows(self.model, self.columns, samples)

    def add(self, rows: Arrays) -> None:
        """Reduce samples whose rows are complete, after all those before them."""
        first, count = self._done, len(rows["status"]) // self._samples_per_structure
        self._done += count
        self._reduction.add(self._structures[first : self._done], rows)
        self._free.append(rows)

    def finish(self, rest: xr.Dataset) -> xr.Dataset:
        """Return the variables and attributes that are known at the end, without the statistics."""
        return rest


def blank_rows(model: Model, columns: dict[str, Column], samples: int) -> Arrays:
    """Return memory for the columns of some samples."""
    return {name: np.empty((samples, *lengths(model, column)), column.dtype) for name, column in columns.items()}
