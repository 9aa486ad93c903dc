"""Dataset of a portfolio: the samples of all groups of buildings, joined in the order of the buildings."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.foundations.core.interruption import stop_if_asked
from warpdyn.foundations.files.netcdf import GrowingFile, trace
from warpdyn.foundations.files.template import Template
from warpdyn.foundations.files.unfinished import STORE_SUFFIX, Unfinished
from warpdyn.foundations.files.zarr_stores import complete, lay_out, write_region
from warpdyn.model.scene.portfolio import Portfolio

SAMPLES_AT_A_TIME = 2**17  # number of samples that are joined in memory before they are written to a file
# Attributes of the variables that identify the building of a sample.
OF_SAMPLE: dict[str, dict[str, str]] = {
    "building": {"long_name": "number of the building in the portfolio", "units": "1"},
    "archetype_index": {"long_name": "index along the dimension archetype", "units": "1"},
}


class Joined:
    """Samples of a portfolio's groups (buildings with the same kernel and step), in the order of the buildings.

    Args:
        portfolio: The portfolio.
        buildings: For each group, the numbers of its buildings in the portfolio, increasing.
        templates: For each group, the template of its dataset.
        rows: For each group, the values of its samples by variable name, as arrays or as objects that return arrays for
            slices.
        samples_per_building: Number of samples of each building.
        rest: Attributes of the dataset, and the error estimate of all groups from `largest_estimate`.
    """

    def __init__(
        self,
        portfolio: Portfolio,
        buildings: list[np.ndarray],
        templates: list[Template],
        rows: list[dict[str, Any]],
        samples_per_building: int,
        rest: xr.Dataset,
    ) -> None:
        self.portfolio, self.samples_per_building = portfolio, samples_per_building
        kept = [{name: v for name, v in each.variables.items() if _is_of_storeys(name, v)} for each in templates]
        for of_group, known in zip(rows, kept, strict=True):
            for name in of_group.keys() - known.keys():
                del of_group[name]
        self.parts = list(zip(buildings, rows, strict=True))
        self.archetype = np.repeat(np.arange(len(portfolio.archetypes), dtype=np.int32), portfolio.counts)
        self.of_run = rest
        # For each variable name: the variable of the first group that has it, and a number type for all groups.
        found: dict[str, xr.Variable] = {}
        for variables in kept:
            found = variables | found
        self.rest = {name: v for name, v in found.items() if v.dims[:1] == ("motion",)}
        self.columns = {name: v for name, v in found.items() if v.dims[:1] == ("sample",)}
        types = {name: [each[name].dtype for each in kept if name in each] for name in self.columns}
        self.dtypes = {name: np.result_type(*of_groups) for name, of_groups in types.items()}
        self.coordinates = {name for template in templates for name in template.coords}

    def in_memory(self) -> xr.Dataset:
        """Return the dataset in memory; the memory of the groups is freed after each variable."""
        joined = {}
        for name in self.columns:
            joined[name] = self._rows(name, 0, self.portfolio.buildings)
            for _, rows in self.parts:
                rows.pop(name, None)
        dataset = self._labelled(self._named(joined, 0))
        return dataset.merge(self.of_run).assign_attrs(dataset.attrs | self.of_run.attrs)

    def in_file(self, unfinished: Unfinished) -> xr.Dataset:
        """Write the dataset to a netCDF file, some buildings at a time, and return it as an opened dataset."""
        together = max(1, SAMPLES_AT_A_TIME // self.samples_per_building)
        with GrowingFile(unfinished, self.portfolio.buildings * self.samples_per_building) as file:
            for first in range(0, self.portfolio.buildings, together):
                last = min(first + together, self.portfolio.buildings)
                rows = {name: self._rows(name, first, last) for name in self.columns}
                file.append(self._named(rows, first), self._labelled)
            file.finish(self.of_run)
        return xr.open_dataset(unfinished.path, engine="netcdf4")

    def in_store(self, unfinished: Unfinished) -> xr.Dataset:
        """Write the dataset to a Zarr store, some buildings at a time, and return it as an opened dataset."""
        together = max(1, SAMPLES_AT_A_TIME // self.samples_per_building)
        store, buildings = unfinished.kept / f"joined{STORE_SUFFIX}", self.portfolio.buildings
        none = self._labelled(self._named({name: self._rows(name, 0, 0) for name in self.columns}, 0))
        with unfinished.named_errors():
            lay_out(store, none, buildings * self.samples_per_building, together * self.samples_per_building)
            for first in range(0, buildings, together):
                stop_if_asked()
                rows = {name: self._rows(name, first, min(first + together, buildings)) for name in self.columns}
                write_region(store, first * self.samples_per_building, self._named(rows, first))
            complete(store, self.of_run.assign_attrs(none.attrs | self.of_run.attrs))
            unfinished.move_in_store(store)
        return xr.open_zarr(unfinished.path)

    def _rows(self, name: str, first: int, last: int) -> np.ndarray:
        """Return a variable for all samples of buildings first to last - 1.

        Storeys that a building lacks have NaN or 0; buildings whose group lacks the variable have NaN or -1.
        """
        widths = (int(self.portfolio.storeys.max()),) * (self.columns[name].ndim - 1)
        dtype = self.dtypes[name]
        rows = np.full((last - first, self.samples_per_building, *widths), np.nan if dtype.kind == "f" else 0, dtype)
        for buildings, of_group in self.parts:
            begin, end = np.searchsorted(buildings, [first, last]).tolist()
            if begin == end:
                continue
            if name not in of_group:
                if dtype.kind == "i":
                    rows[buildings[begin:end] - first] = -1
                continue
            values = of_group[name][begin * self.samples_per_building : end * self.samples_per_building]
            values = values.reshape(end - begin, self.samples_per_building, *values.shape[1:])
            place: tuple[Any, ...] = (slice(None), *(slice(width) for width in values.shape[2:]))
            rows[(buildings[begin:end] - first, *place)] = values
        return rows.reshape(-1, *widths)

    def _named(self, rows: dict[str, np.ndarray], first: int) -> dict[str, np.ndarray]:
        """Return values of samples from building `first` on, with numbers of sample, building and archetype added."""
        count = len(rows["sample"]) // self.samples_per_building
        rows["sample"] = (np.arange(len(rows["sample"])) + first * self.samples_per_building).astype(np.int32)
        del rows["structure"]
        for name, values in (
            ("building", np.arange(count) + first),
            ("archetype_index", self.archetype[first:][:count]),
        ):
            rows[name] = np.repeat(values.astype(np.int32), self.samples_per_building)
        return rows

    def _labelled(self, rows: dict[str, np.ndarray]) -> xr.Dataset:
        """Return the dataset of samples, given by their values by name, with all labels of the portfolio."""
        own: dict[str, tuple] = {name: (("sample",), attributes) for name, attributes in OF_SAMPLE.items()}
        own |= {name: (variable.dims, variable.attrs) for name, variable in self.columns.items()}
        variables = {name: xr.Variable(own[name][0], values, own[name][1]) for name, values in rows.items()}
        coordinates: dict[str, Any] = {
            name: variables.pop(name) for name in list(variables) if name in self.coordinates | OF_SAMPLE.keys()
        }
        variables |= table_of_archetypes(self.portfolio.archetypes, self.portfolio.storeys, self.portfolio.counts)
        coordinates["archetype"] = variables.pop("archetype")
        recorders = ("acceleration",) if "floor" in self.coordinates else ()
        coordinates |= self.portfolio.numbered(recorders)
        attributes = trace(str(self.of_run.attrs["title"]), "simulate")
        return xr.Dataset(variables | self.rest, coordinates, attributes | {"scene": self.of_run.attrs["scene"]})


def _is_of_storeys(name: str, variable: xr.Variable) -> bool:
    """Return whether a portfolio's dataset has a variable of a group: not those of springs and degrees of freedom."""
    return name != "spring_of_collapse" and not {"spring", "dof", "member", "output"} & set(variable.dims)


def table_of_archetypes(names: Iterable[str], storeys: ArrayLike, buildings: ArrayLike) -> dict[str, xr.Variable]:
    """Return the variables along `archetype` (name, number of storeys, number of buildings), by variable name."""
    name = np.array(list(names), dtype=str)
    found = {"archetype": xr.Variable("archetype", name, {"long_name": "name of the archetype"})}
    for what, values in {"storeys": storeys, "buildings": buildings}.items():
        attributes = {"long_name": f"{what} of the archetype", "units": "1"}
        found[f"{what}_of_archetype"] = xr.Variable("archetype", np.asarray(values, dtype=np.int32), attributes)
    return found


def common_attributes(runs: list[xr.Dataset], seconds: float) -> dict[str, object]:
    """Return the attributes of a portfolio's dataset from the datasets of its groups; differing values are all listed.

    `seconds` is the time that was spent before the groups were run [s]; it is added to "seconds_sampling".
    """
    attributes = {name: runs[0].attrs[name] for name in ("on_unstable", "device")}
    for name in ("method", "method_chosen_because", "dtype", "kernel", "resampled"):
        texts = dict.fromkeys(str(run.attrs[name]) for run in runs if name in run.attrs)
        attributes |= {name: "; ".join(texts)} if texts else {}
    for name in ("step", "longest_step", "target_error", "tolerance"):
        values = [np.atleast_1d(run.attrs[name]) for run in runs if name in run.attrs]
        if values:
            found = np.unique(np.concatenate(values))
            attributes[name] = found if found.size > 1 else float(found[0])
    for name in ("sampling", "integrating", "in_kernels"):
        attributes[f"seconds_{name}"] = sum(float(run.attrs[f"seconds_{name}"]) for run in runs)
    attributes["seconds_sampling"] += seconds
    return attributes | {"groups": len(runs)}


def largest_estimate(runs: list[xr.Dataset]) -> xr.Dataset:
    """Return a dataset with the largest error estimate of the groups' datasets; empty if there are no estimates.

    For each quantile, the largest value of the groups is an upper bound for all their samples together.
    """
    found = [run["estimated_relative_error"] for run in runs if "estimated_relative_error" in run]
    if not found:
        return xr.Dataset()
    values = np.fmax.reduce([estimate.values for estimate in found])
    comment = f"the largest of the portfolio's {len(found)} groups; of one: {found[0].attrs['comment']}"
    return found[0].copy(data=values).assign_attrs(comment=comment).to_dataset(name="estimated_relative_error")
