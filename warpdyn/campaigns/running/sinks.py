"""Where the regions of a run are delivered to: memory, a netCDF file, a Zarr store, or statistics."""

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
    """Return the samples of a portfolio's groups in the order of the buildings."""
    buildings = [part.buildings for part in parts if part.buildings is not None]
    each = parts[0].samples // parts[0].job.structures
    return Joined(portfolio, buildings, [part.layout.template for part in parts], rows, each, rest)


class Memory:
    """Samples that are returned in memory.

    Args:
        host: This process if it runs the regions, which then write to the memory of the run; otherwise None.
    """

    def __init__(self, host: Host | None) -> None:
        self._host, self._rows = host, dict[int, Arrays]()

    def begin(self, parts: list[Part]) -> None:
        """Check that the samples fit in memory."""
        path = "run.nc" if self._host is not None else "run.zarr"
        check_memory(
            f"the dataset of {sum(part.samples for part in parts):,} samples (structures times motions)",
            sum(part.samples * part.layout.bytes_per_sample for part in parts),
            f'give path="{path}", which writes the samples to a file block by block, or remove recorders from '
            "Scene(recorders=...)",
        )

    def given_to(self, part: Part, place: int) -> dict[str, Any]:
        """Return further arguments of `Region`: memory for its samples."""
        if self._host is None:
            return {}
        span = slice(*(part.first_sample(edge) for edge in (part.regions[place].start, part.regions[place].stop)))
        return {"rows": {name: values[span] for name, values in self._rows_of(part).items()}}

    def take(self, part: Part, place: int, report: Report) -> None:
        """Take the samples of a region."""
        first = part.first_sample(part.regions[place].start)
        for name, values in report.rows.items():
            self._rows_of(part)[name][first : first + len(values)] = values
        report.rows = {}
        part.reports[place] = report

    def finish(self, parts: list[Part], rest: xr.Dataset, portfolio: Portfolio | None) -> xr.Dataset:
        """Return the dataset.

        Args:
            parts: The groups.
            rest: Variables and attributes of the run besides its samples.
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
        """Return memory for all samples of a group, which is taken when its first region begins."""
        if part.number not in self._rows:
            along = {name: v for name, v in part.along.items() if name not in self._deferred(part)}
            self._rows[part.number] = {n: np.empty((part.samples, *v.shape[1:]), v.dtype) for n, v in along.items()}
        return self._rows[part.number]

    def _deferred(self, part: Part) -> Set[str]:
        """Return the variables that are computed when they are read; none in the dataset of a portfolio."""
        return set() if self._host is None or part.buildings is not None else part.layout.deferred


class Files:
    """Samples that are written from the files of the regions to a netCDF file (portfolios: also to a Zarr store).

    Args:
        checkpoint: The folder of these files.
    """

    def __init__(self, checkpoint: Checkpoint) -> None:
        self.checkpoint, self.unfinished = checkpoint, checkpoint.unfinished

    def begin(self, parts: list[Part]) -> None:
        """Take the regions that an earlier call has finished."""
        for part in parts:
            for place, report in enumerate(self._reports_of(part)):
                if report is not None:
                    self._add(part, place, report)

    def _reports_of(self, part: Part) -> list[Report | None]:
        """Return the reports in the files of a group's regions."""
        return [Report.load(path) for path in self._paths(part)]

    def given_to(self, part: Part, place: int) -> dict[str, Any]:
        """Return no further arguments of `Region`: the process that runs the region writes its file."""
        return {}

    def take(self, part: Part, place: int, report: Report) -> None:
        """Take the report of a region whose file is written."""
        self._add(part, place, report)

    def _add(self, part: Part, place: int, report: Report) -> None:
        part.reports[place] = report

    def finish(self, parts: list[Part], rest: xr.Dataset, portfolio: Portfolio | None) -> xr.Dataset:
        """Return the dataset of the file or the store; arguments: see `Memory`."""
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
    """Samples of one structure's scene that the processes write to a Zarr store, each region to its own chunks."""

    def begin(self, parts: list[Part]) -> None:
        """Lay out the store, or take the regions that an earlier call has written."""
        [part], settled = parts, self.checkpoint.settled
        assert part.job.store is not None
        if not is_laid_out(part.job.store, settled.get("store")):
            for path in self._paths(part):  # reports on a store that was damaged
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
        """Return the dataset of the store."""
        store = parts[0].job.store
        assert store is not None
        with self.unfinished.named_errors():
            complete(store, rest)
            self.unfinished.move_in_store(store)
        return xr.open_zarr(self.unfinished.path)


class Statistics(Files):
    """Statistics that the samples are reduced to; the samples themselves are not kept.

    Args:
        reduction: The statistics, of all groups.
        asked: The same statistics, in the form that is sent to other processes.
        checkpoint: The folder of the files of regions; None: no files are written.
        is_partial: Whether regions return their contribution; otherwise they add it to the statistics of this process.
    """

    def __init__(self, reduction: Reduction, asked: Asked, checkpoint: Checkpoint | None, *, is_partial: bool) -> None:
        self.reduction, self.asked, self._is_partial = reduction, asked, is_partial
        self._checkpoint = checkpoint
        if checkpoint is not None:
            super().__init__(checkpoint)

    def begin(self, parts: list[Part]) -> None:
        """Take the regions that an earlier call has finished."""
        if self._checkpoint is not None:
            super().begin(parts)

    def given_to(self, part: Part, place: int) -> dict[str, Any]:
        """Return further arguments of `Region`: the statistics."""
        return {"asked": self.asked, "numbers": part.numbers(place), "is_partial": self._is_partial}

    def take(self, part: Part, place: int, report: Report) -> None:
        """Add a region to the statistics, after its file is written if the run has a path."""
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
        """Return the statistics, and write them if the run has a path."""
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
