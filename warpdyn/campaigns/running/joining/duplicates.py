"""Checks that reject runs joined by xr.concat: samples occur twice, or a number denotes different objects."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.foundations.core.output_variables import EARLIER_HISTORY, OF_SEQUENCE

REMEDY = "join runs by wd.join([run, other]), which counts structures and motions anew and refuses duplicate samples"


def check_numbers(function: str, dataset: xr.Dataset) -> None:
    """Raise a ValueError if a number of a sample occurs twice, as after xr.concat.

    Args:
        function: Name of the public function that was called, for the message.
        dataset: Any dataset; one without numbered samples is accepted.
    """
    if "sample" not in dataset.coords or dataset["sample"].dims != ("sample",):
        return
    numbers = pd.Index(dataset["sample"].values)
    if not numbers.is_unique:
        again = np.flatnonzero(numbers.duplicated())
        raise ValueError(
            f"{function}: sample number {numbers[again[0]]} is in the dataset twice, as are {again.size} of "
            f"{numbers.size} numbers. Several runs put together, as by xr.concat, count structures and motions of "
            f"one run as those of another, so that names of motions may be wrong and intervals are too narrow: {REMEDY}"
        )


def check_samples(function: str, dataset: xr.Dataset) -> None:
    """Raise a ValueError if a dataset contains samples twice, or numbers of structures and motions of several runs.

    The same error is raised for an event of a sequence that was selected by xarray instead of `select_event`, because
    such selections contain each history several times.

    Args:
        function: Name of the public function that was called, for the message.
        dataset: A run of one event.
    """
    if "im_level" in dataset and dataset["im_level"].attrs.get("design") == OF_SEQUENCE:
        raise ValueError(
            f"{function}: the dataset is the run of a sequence, which contains each history of an event several times: "
            "select one event with select_event(run, name)"
        )
    check_numbers(function, dataset)
    for name in ("motion_name", "motion_step", "motion_peak_acceleration"):
        if name in dataset and "sample" in dataset[name].dims:
            raise ValueError(
                f"{function}: {name!r} lies along sample, as after xr.concat of several runs, so that motion_index "
                f"means different motions in different samples: {REMEDY}. If it is one run whose samples were "
                "selected by where(), select them by run.isel(sample=condition.values)"
            )
    label = next((name for name in ("structure", "building") if name in dataset.coords), None)
    is_drawn = '"type":"MotionsAtSites"' in str(dataset.attrs.get("scene", "")) or "samples_per_history" in dataset
    if label is None or is_drawn or not {"motion_index", "im_level"} <= set(dataset.coords):
        return
    names = [label, "motion_index", "im_level"]
    names += [EARLIER_HISTORY] if EARLIER_HISTORY in dataset.coords else []
    if any(dataset[name].dims != ("sample",) for name in names):
        return
    key = np.zeros(dataset.sizes["sample"], dtype=np.int64)
    for name in names:
        codes, distinct = pd.factorize(dataset[name].values)
        key = pd.factorize(key * distinct.size + codes)[0]  # renumbered, so that products do not overflow
    again = pd.Series(key).duplicated().to_numpy()
    if again.any():
        place = int(np.flatnonzero(again)[0])
        told = ", ".join(f"{name} {dataset[name].values[place]}" for name in names)
        raise ValueError(
            f"{function}: {int(again.sum())} of {key.size} samples occur twice, the first of them {told}: samples "
            f"of two runs have the same numbers, or a run was joined with itself. {REMEDY}; remove repeated samples"
        )
