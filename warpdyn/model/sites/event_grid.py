"""Ground motions at the stations (grid points) of SimCenter's EventGrid.csv."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np

from warpdyn.foundations.core.messages import counted
from warpdyn.foundations.files.text import inside_folder
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.sites.grid_stations import (
    MOTIONS,
    acceleration_factor,
    number_of_station,
    read_stations,
    warn_of_points_left_out,
)
from warpdyn.model.sites.motion_grid import MotionGrid


def read_event_grid(path: str | os.PathLike, unit: str) -> MotionGrid:
    """Read the ground motions at the points of a grid, in the format of SimCenter's R2D tool.

    The folder contains:

    - EventGrid.csv, with columns `GP_file`, `Longitude` and `Latitude`. Other columns, such as Vs30, are not used.
      (SimCenter gives a building with such a property only points with the same property.)
    - A file for each point, with columns `TH_file` and, if factors are not 1, `factor`. All points have the same number
      of rows: row `i` belongs to earthquake `i`, as in SimCenter's draws.
    - Each motion as `<TH_file>.json`, with `dT` [s], `data_x` and, if there are two components, `data_y`.

    Args:
        path: EventGrid.csv, or its folder.
        unit: Unit of the accelerations, one of `records.UNITS`, such as "g". The files do not contain it.

    Returns:
        The grid of motions. Points without coordinates, or with NaN among their factors or motions, are removed; a
        warning counts and names these points.

    Raises:
        ValueError: If a column is missing, points have no file or no motions (the message counts and names these
            points), numbers of rows differ, a file is outside the folder (also through a symbolic link), a factor is
            not above 0, or a motion's file is invalid.
        FileNotFoundError: If EventGrid.csv does not exist.
        TypeError: If `path` is not a path.

    Example:
        >>> grid = wd.sites.read_event_grid("records/EventGrid.csv", unit="g")
        >>> design = grid.at(inventory, stock, draws=25, neighbours=2, reach=20e3, seed=1)
        >>> design.samples_per_structure
        25
    """
    file, names, places, rows = read_stations("read_event_grid", path)
    if rows[0] and MOTIONS not in rows[0][0]:
        raise ValueError(
            f"{file}: {names[0]} has no column {MOTIONS!r}: if the files contain intensities, use read_intensity_grid"
        )
    factor = acceleration_factor(unit, str(file))
    found: dict[str, int] = {}
    motions: list[list[GroundMotion]] = []
    record, scale = np.zeros((len(rows), len(rows[0])), np.int32), np.ones((len(rows), len(rows[0])))
    missing: list[str] = []
    unknown: set[int] = set()  # indices of motions that contain NaN
    for point, of_point in enumerate(rows):
        for earthquake, row in enumerate(of_point):
            name = row.get(MOTIONS) or ""
            if name not in found:
                found[name] = len(motions)
                source = inside_folder(file.parent, f"{name}.json", str(file.parent / names[point]))
                if source.is_file():
                    read = _read_motion(source, name, factor)
                    if not read:
                        unknown.add(found[name])
                    motions.append(read)
                else:
                    missing.append(f"{name!r} of {names[point]}")
                    motions.append([])
            record[point, earthquake] = found[name]
            where = f"{file.parent / names[point]}, row {earthquake + 1}: factor"
            scale[point, earthquake] = number_of_station(where, row.get("factor") or "1", above=0)
    if missing:
        raise ValueError(
            f"{file}: {counted(missing)} of {len(found):,} motions have no file <{MOTIONS}>.json in its folder. Add "
            "the files, or remove the rows"
        )
    kept = np.array(~np.isnan(scale).any(axis=1) & ~np.isin(record, sorted(unknown)).any(axis=1))
    warn_of_points_left_out(file, names, kept, "NaN among their factors or motions")
    places, record, scale = (places[0][kept], places[1][kept]), record[kept], scale[kept]
    names = [name for name, is_kept in zip(names, kept, strict=True) if is_kept]
    used = np.unique(record)
    motions, record = [motions[each] for each in used], np.searchsorted(used, record).astype(np.int32)
    components = len(motions[0])
    if any(len(each) != components for each in motions):
        raise ValueError(
            f"{file}: some motions have one component and others two: all motions need the same number of components. "
            "Complete the files of motions"
        )
    motion = record[:, :, None] * components + np.arange(components, dtype=np.int32)
    same = (record == record[:1]).all(axis=0)
    labels = list(found)
    earthquakes = [labels[used[record[0, i]]] if same[i] else str(i) for i in range(record.shape[1])]
    flat = [each for both in motions for each in both]
    both = np.broadcast_to(scale[:, :, None], motion.shape)
    return MotionGrid(*places, flat, motion, both, names, earthquakes)


def _read_motion(path: Path, name: str, factor: float) -> list[GroundMotion]:
    """Return the components of the ground motion in a JSON file [m/s2]; an empty list if a component contains NaN."""
    try:
        told = json.loads(path.read_text(encoding="utf-8-sig"))
        step = told["dT"]
        values = {"x": told["data_x"]} | ({"y": told["data_y"]} if "data_y" in told else {})
        arrays = {axis: factor * np.asarray(each, dtype=np.float64) for axis, each in values.items()}
    except (json.JSONDecodeError, UnicodeDecodeError, KeyError, TypeError, ValueError) as error:
        problem = f"the key {error} is missing" if isinstance(error, KeyError) else str(error)
        raise ValueError(f"{path} must be JSON with dT and data_x: {problem}") from None
    if any(np.isnan(each).any() for each in arrays.values()):
        return []
    try:
        # Components of a record may have different lengths.
        return [GroundMotion(each, step, f"{name} {axis}", str(path), name, axis) for axis, each in arrays.items()]
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
