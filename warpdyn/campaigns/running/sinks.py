"""Sinks of a run, which receive the results of its regions (ranges of structures): memory, files, or statistics.

A region is a range of structures that one process integrates. A part is a group of structures (one kernel and default
step) with its regions; a scene of one structure has one part, a portfolio several.
"""

from __future__ import annotations

from collections.abc import Set
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.portfolio.labels import Joined
from warpdyn.campaigns.reductions.reduction import Reduction
from warpdyn.campaigns.running.labels import filled
from warpdyn.campaigns.running.regions.checkpoint import Checkpoint, region_file
from warpdyn.campaigns.running.regions.deferred import deferred_variables
from warpdyn.campaigns.running.regions.job import Asked, Host
from warpdyn.campaigns.running.regions.report import Report, RowsOfRegions, rows_in
from warpdyn.campaigns.running.regions.workers import Part
from warpdyn.foundations.core.checks import check_memory
from warpdyn.foundations.files.netcdf import GrowingFile, write_at_once
from warpdyn.foundations.files.removal import remove_tree
from warpdyn.foundations.files.unfinished import STORE_SUFFIX
from warpdyn.foundations.files.zarr_stores import complete, damaged_regions, is_laid_out, lay_out
from warpdyn.model.scene.portfolio import Portfolio


def _joined(portfolio: Portfolio, parts: list[Part], rows: list[dict[str, Any]], rest: xr.Dataset) -> Joined:
    """Return the samples of all groups of a portfolio, in the order of the portfolio's buildings.

    Args:
        portfolio: The portfolio.
        parts: The groups of buildings.
        rows: Values of each group's samples, by variable name.
        rest: Variables and attributes of the run that do not belong to samples.
    """
    buildings = [part.buildings for part in parts if part.buildings is not None]
    each = parts[0].samples // parts[0].job.structures
    return Joined(portfolio, buildings, [part.layout.template for part in parts], rows, each, rest)


class Memory:
    """Sink that keeps the samples in memory.

    Args:
        host: This process if it integrates the regions, which then write directly to the arrays of this sink. None:
            other processes integrate them and return their samples.
    """

    def __init__(self, host: Host | None) -> None:
        self._host, self._rows = host, dict[int, Arrays]()

    def begin(self, parts: list[Part]) -> None:
        """Raise an error if the samples of all groups do not fit in memory."""
        path = "run.nc" if self._host is not None else "run.zarr"
        check_memory(
            f"the dataset of {sum(part.samples for part in parts):,} samples (structures times motions)",
            sum(part.samples * part.layout.bytes_per_sample for part in parts),
            f'give path="{path}", which writes the samples to a file block by block, or remove recorders from '
            "Scene(recorders=...)",
        )

    def given_to(self, part: Part, place: int) -> dict[str, Any]:
        """Return additional constructor arguments of a `Region`: the arrays that it writes its samples to."""
        if self._host is None:
            return {}
        span = slice(*(part.first_sample(edge) for edge in (part.regions[place].start, part.regions[place].stop)))
        return {"rows": {name: values[span] for name, values in self._rows_of(part).items()}}

    def take(self, part: Part, place: int, report: Report) -> None:
        """Copy the samples of a region's report, if it contains any, to the arrays of the run, and keep the report."""
        first = part.first_sample(part.regions[place].start)
        for name, values in report.rows.items():
            self._rows_of(part)[name][first : first + len(values)] = values
        report.rows = {}
        part.reports[place] = report

    def finish(self, parts: list[Part], rest: xr.Dataset, portfolio: Portfolio | None) -> xr.Dataset:
        """Return the dataset of the run.

        Args:
            parts: The groups.
            rest: Variables and attributes of the run that do not belong to samples.
            portfolio: The portfolio; None for a scene of one structure.
        """
        if portfolio is not None:
            return _joined(portfolio, parts, [self._rows.pop(part.number) for part in parts], rest).in_memory()
        [part] = parts
        rows: dict[str, Any] = self._rows[0]
        if deferred := self._deferred(part):
            assert self._host is not None
            template = {name: part.along[name] for name in deferred}
            rows = rows | deferred_variables(self._host.prepared(part.job).run, template)
        dataset = filled(part.layout.template, rows)
        return (dataset.merge(rest) if rest.variables else dataset).assign_attrs(rest.attrs)

    def _rows_of(self, part: Part) -> Arrays:
        """Return arrays for all samples of a group, which are allocated when its first region begins."""
        if part.number not in self._rows:
            along = {name: v for name, v in part.along.items() if name not in self._deferred(part)}
            self._rows[part.number] = {n: np.empty((part.samples, *v.shape[1:]), v.dtype) for n, v in along.items()}
        return self._rows[part.number]

    def _deferred(self, part: Part) -> Set[str]:
        """Return the names of the variables that are computed when they are read; empty for a portfolio."""
        return set() if self._host is None or part.buildings is not None else part.layout.deferred


class Files:
    """Sink that joins the files of finished regions into a netCDF file (for a portfolio: also into a Zarr store).

    Args:
        checkpoint: Checkpoint of the run: the folder with one file for each finished region.
    """

    def __init__(self, checkpoint: Checkpoint) -> None:
        self.checkpoint, self.unfinished = checkpoint, checkpoint.unfinished

    def begin(self, parts: list[Part]) -> None:
        """Read the reports of the regions that an earlier, interrupted call has finished."""
        for part in parts:
            for place, report in enumerate(self._reports_of(part)):
                if report is not None:
                    self._add(part, place, report)

    def _reports_of(self, part: Part) -> list[Report | None]:
        """Return the report of each region of a group from its file; None if the region has no complete file."""
        return [Report.load(path) for path in self._paths(part)]

    def given_to(self, part: Part, place: int) -> dict[str, Any]:
        """Return no additional constructor arguments of a `Region`: the region writes its samples to its file."""
        return {}

    def take(self, part: Part, place: int, report: Report) -> None:
        """Keep the report of a region, whose samples are already in its file."""
        self._add(part, place, report)

    def _add(self, part: Part, place: int, report: Report) -> None:
        part.reports[place] = report

    def finish(self, parts: list[Part], rest: xr.Dataset, portfolio: Portfolio | None) -> xr.Dataset:
        """Write the file or the store of the run, and return it as an opened dataset; arguments: see `Memory`."""
        if portfolio is not None:
            joined = _joined(portfolio, parts, [self._columns(part) for part in parts], rest)
            is_store = self.unfinished.path.suffix == STORE_SUFFIX
            return joined.in_store(self.unfinished) if is_store else joined.in_file(self.unfinished)
        [part] = parts
        with GrowingFile(self.unfinished, part.samples) as file:
            for path in self._paths(part):
                rows = rows_in(path, part.along, self.unfinished.path)
                file.append(rows, lambda first: filled(part.layout.template, first))
            file.finish(rest)
        return xr.open_dataset(self.unfinished.path, engine="netcdf4")

    def _paths(self, part: Part) -> list[Path]:
        return [region_file(self.checkpoint.folder, part.number, region) for region in part.regions]

    def _columns(self, part: Part) -> dict[str, RowsOfRegions]:
        first = [part.first_sample(region.start) for region in part.regions]
        paths = self._paths(part)
        return {name: RowsOfRegions(name, paths, first, self.unfinished.path) for name in part.along}


class Store(Files):
    """Sink for a scene of one structure: processes write the samples of each region to chunks of a Zarr store."""

    def begin(self, parts: list[Part]) -> None:
        """Create the store, or read the reports of the regions that an earlier, interrupted call has written to it."""
        [part], settled = parts, self.checkpoint.settled
        assert part.job.store is not None
        if not is_laid_out(part.job.store, settled.get("store")):
            for path in self._paths(part):  # these reports belong to a store that is damaged
                path.unlink(missing_ok=True)
            chunk = part.first_sample(len(part.regions[0]))
            with self.unfinished.named_errors():
                files = lay_out(part.job.store, filled(part.layout.template, {}), part.samples, chunk)
            self.checkpoint.settle({"store": files})
        super().begin(parts)

    def _reports_of(self, part: Part) -> list[Report | None]:
        assert part.job.store is not None
        reports = super()._reports_of(part)
        digests = [{} if report is None else report.chunks for report in reports]
        for place in damaged_regions(part.job.store, digests):
            reports[place] = None
        return reports

    def finish(self, parts: list[Part], rest: xr.Dataset, portfolio: Portfolio | None) -> xr.Dataset:
        """Complete the store and move it to the path of the run; return it as an opened dataset."""
        store = parts[0].job.store
        assert store is not None
        with self.unfinished.named_errors():
            complete(store, rest)
            self.unfinished.move_in_store(store)
        return xr.open_zarr(self.unfinished.path)


class Statistics(Files):
    """Sink that adds the regions to statistics; the samples themselves are not kept.

    Args:
        reduction: The statistics of the run, over all its groups.
        asked: The same statistics in the form that is sent to other processes.
        checkpoint: Checkpoint of the run, with a file for each region; None: no files are written.
        is_partial: Whether each region returns its contribution with its report. False: regions add their samples
            directly to the statistics of this process.
    """

    def __init__(self, reduction: Reduction, asked: Asked, checkpoint: Checkpoint | None, *, is_partial: bool) -> None:
        self.reduction, self.asked, self._is_partial = reduction, asked, is_partial
        self._checkpoint = checkpoint
        if checkpoint is not None:
            super().__init__(checkpoint)

    def begin(self, parts: list[Part]) -> None:
        """Read the reports of the regions that an earlier, interrupted call has finished, if the run has a path."""
        if self._checkpoint is not None:
            super().begin(parts)

    def given_to(self, part: Part, place: int) -> dict[str, Any]:
        """Return additional constructor arguments of a `Region`: the statistics and the numbers of its structures."""
        return {"asked": self.asked, "numbers": part.numbers(place), "is_partial": self._is_partial}

    def take(self, part: Part, place: int, report: Report) -> None:
        """Add a region's contribution to the statistics; if the run has a path, write the region's file before."""
        if self._checkpoint is not None:
            with self.unfinished.named_errors():
                report.save(region_file(self.checkpoint.folder, part.number, part.regions[place]))
        self._add(part, place, report)

    def _add(self, part: Part, place: int, report: Report) -> None:
        if self._is_partial:
            self.reduction.include(report.statistics)
        report.statistics = {}
        part.reports[place] = report

    def finish(self, parts: list[Part], rest: xr.Dataset, portfolio: Portfolio | None) -> xr.Dataset:
        """Return the dataset of statistics; if the run has a path, also write it there."""
        result = self.reduction.dataset(rest)
        if self._checkpoint is None:
            return result
        if self.unfinished.path.suffix != STORE_SUFFIX:
            write_at_once(result, self.unfinished)
            return result
        store = self.unfinished.kept / f"statistics{STORE_SUFFIX}"
        with self.unfinished.named_errors():
            if store.is_dir():  # incomplete, from a process that was killed
                remove_tree(store)
            complete(store, result)
            self.unfinished.move_in_store(store)
        return result


Sink = Memory | Files  # and its subclasses Store and Statistics
