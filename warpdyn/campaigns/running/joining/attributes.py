"""Attributes of a joined run, and checks that the joined runs are comparable."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.foundations.core.output_variables import measure_of_dataset
from warpdyn.foundations.files.netcdf import trace

OF_ONE = ("fingerprint", "history", "Conventions", "source", "scene")  # attributes that are not combined
WHOLE = "of the whole history"  # replaces the missing comment of a peak variable in messages


def joined_attributes(function: str, runs: Sequence[xr.Dataset]) -> dict[str, object]:
    """Return the attributes of a joined run: the common value of all runs or, if the runs differ, all their values.

    Args:
        function: Name of the public function, for the attribute `history`.
        runs: The runs.
    """
    titles = dict.fromkeys(str(run.attrs.get("title", "")) for run in runs)
    found: dict[str, object] = dict(trace("; ".join(titles), function))
    names = dict.fromkeys(str(name) for run in runs for name in run.attrs)
    for name in names:
        values = [run.attrs[name] for run in runs if name in run.attrs]
        if name in ("title", *OF_ONE):
            continue
        if name.startswith("seconds_"):
            found[name] = float(sum(values))
        elif all(np.array_equal(value, values[0]) for value in values):
            found[name] = values[0]
        elif all(np.asarray(value).dtype.kind in "iuf" for value in values):
            found[name] = np.unique(np.concatenate([np.atleast_1d(value) for value in values]))
        else:
            found[name] = "; ".join(dict.fromkeys(map(str, values)))
    scenes = dict.fromkeys(str(run.attrs.get("scene", "")) for run in runs)
    if len(scenes) == 1:
        found["scene"] = next(iter(scenes))
    return found | {"joined_runs": sum(int(run.attrs.get("joined_runs", 1)) for run in runs)}


def check_start_times(runs: Sequence[xr.Dataset]) -> None:
    """Raise a ValueError unless the peaks of all runs are recorded from the same time (`record_from`) on.

    The comment of each peak variable contains this time, also in joined runs, which may lack the attribute `scene`.
    Capacities have no peak variables; their time is in the attribute `scene`.
    """
    for place, run in enumerate(runs[1:], start=1):
        for name in (str(each) for each in run.data_vars if "peak" in str(each) and each in runs[0]):
            first, other = (each[name].attrs.get("comment", WHOLE) for each in (runs[0], run))
            if first != other:
                raise ValueError(
                    f"join: {name!r} of run {place} is {other}, and that of run 0 is {first}, so that they cannot be "
                    "compared: join runs whose scenes have the same record_from"
                )
        starts = [json.loads(each.attrs.get("scene", "{}")).get("record_from", 0.0) for each in (runs[0], run)]
        if "scene" in runs[0].attrs and "scene" in run.attrs and starts[0] != starts[1]:
            raise ValueError(
                f"join: the scene of run {place} has record_from={starts[1]:g} s, and the scene of run 0 has "
                f"record_from={starts[0]:g} s, so that the two runs cannot be compared: join runs whose scenes have "
                "the same record_from"
            )


def check_comparable(runs: Sequence[xr.Dataset]) -> None:
    """Raise a ValueError unless all runs have the same intensity measure, unit and design (stripes or cloud)."""
    first = runs[0]
    for place, run in enumerate(runs[1:], start=1):
        if ("im_level" in run.coords) != ("im_level" in first.coords):
            raise ValueError(f"join: run 0 or run {place} has no 'im_level'; join runs under ground motions only")
        one, other = (dict[str, Any](measure_of_dataset(each)) for each in (first, run))
        if one.keys() != other.keys() or any(not np.array_equal(one[key], other[key]) for key in one):
            raise ValueError(
                f"join: the intensity measure of run {place} is {other.get('intensity_measure')!r}, and that of run 0 "
                f"is {one.get('intensity_measure')!r}, so that they cannot be compared: join runs of one intensity "
                "measure"
            )
        for key in ("units", "design") if "im_level" in run.coords else ():
            mine, theirs = first["im_level"].attrs.get(key), run["im_level"].attrs.get(key)
            if mine != theirs:
                raise ValueError(
                    f"join: 'im_level' of run {place} has {key} {theirs!r}, and that of run 0 {mine!r}: join runs on "
                    "stripes, or runs of clouds, in one unit"
                )
