"""Damage states that the samples of a run have reached, from their demands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from warpdyn.campaigns.reductions.limits import DRIFT, DamageLimits, magnitudes
from warpdyn.campaigns.running.selections import check_one_unit
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.foundations.core.output_variables import COLLAPSED, OK, STATUS_MEANINGS


@dataclass(frozen=True, eq=False)
class Damage:
    """The damage states that samples have reached.

    Args:
        passed: Number of damage states that each sample has reached, shape [place + 1, sample]. A sample has reached a
            state if its demand exceeds the limit of this state or of a heavier state. The last row is the worst of all
            places (storeys or floors).
        dim: Name of the dimension of the places, such as "storey"; "" if only the worst place is known.
        places: Labels of the places, shape [place].
    """

    passed: np.ndarray
    dim: str
    places: np.ndarray


def refuse_portfolio(function: str, dataset: xr.Dataset, others: str = "") -> None:
    """Raise a ValueError for the run of a portfolio; `others` is a text that names functions that accept such a run."""
    if "archetype_index" in dataset and "archetype" in dataset:
        raise ValueError(
            f"this is a run of a portfolio with several archetypes, but {function}() needs a run of one archetype: "
            "give "
            f"select_archetype(run, name){others}. The names are "
            f"{', '.join(map(repr, dataset['archetype'].values.tolist()))}"
        )


def refuse_failed_samples(function: str, status: np.ndarray) -> None:
    """Raise a ValueError if a sample is neither ok nor collapsed.

    Args:
        function: Name of the public function, for the message.
        status: Outcome of each sample, an index into STATUS_MEANINGS, shape [sample].
    """
    failed = ~np.isin(status, (OK, COLLAPSED))
    if failed.any():
        raise ValueError(
            f"{function}: {int(failed.sum())} of {status.size} samples failed; the first is sample "
            f"{int(failed.argmax())} with the status {STATUS_MEANINGS[status[failed.argmax()]]!r}: use a shorter step"
        )


def damage_of(function: str, dataset: xr.Dataset, limits: DamageLimits, status: np.ndarray) -> Damage:
    """Return the damage states that the samples of a run have reached; a collapsed sample has reached all states.

    Args:
        function: Name of the public function, for messages.
        dataset: The run.
        limits: Limits of the damage states.
        status: Outcome of each sample, an index into STATUS_MEANINGS, shape [sample].

    Raises:
        ValueError: If a demand is missing or has several dimensions in addition to `sample`, or if it is negative or
            not finite for a sample that is ok.
    """
    refuse_portfolio(function, dataset, ", or use damage_shares(run, limits), with limits of each archetype")
    single, dim, places = limits.single, "", np.arange(0)
    worst = np.zeros(status.size, dtype=np.uint8)
    columns: list[np.ndarray] = []
    for name, values in zip(limits.demands, limits.values, strict=True):
        demand = checked_demand(function, dataset, name, status)
        reached = [_reached(row, values) for row in demand]
        for each in reached:
            np.maximum(worst, each, out=worst)
        if single is not None and dataset[name].ndim == 2:
            (dim,) = (str(each) for each in dataset[name].dims if each != "sample")
            places = dataset[dim].values if dim in dataset.coords else np.arange(1, len(reached) + 1)
            columns = reached
    passed = np.stack([*columns, worst])
    passed[:, status == COLLAPSED] = len(limits.states)
    return Damage(passed, dim, places)


def _reached(demand: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Return, for each demand of shape [sample], the number (from 1) of the heaviest state whose limit it exceeds."""
    reached = np.zeros(demand.shape, dtype=np.uint8)
    for number, limit in enumerate(limits, start=1):
        if np.isfinite(limit):
            # A float32 value exceeds the limit if it exceeds the largest float32 number that is not above the limit.
            bound = demand.dtype.type(limit)
            if bound > limit:
                bound = np.nextafter(bound, demand.dtype.type(0))
            np.maximum(reached, (demand > bound).view(np.uint8) * np.uint8(number), out=reached)
    return reached


def checked_demand(function: str, dataset: xr.Dataset, name: str, status: np.ndarray) -> np.ndarray:
    """Return the values of a demand that are compared with limits, shape [storey or floor, sample], after a check.

    Args:
        function: Name of the public function, for messages.
        dataset: The run.
        name: Name of the demand.
        status: Outcome of each sample, an index into STATUS_MEANINGS, shape [sample].
    """
    if name not in dataset:
        known = [str(each) for each, values in dataset.data_vars.items() if str(each).startswith(("peak_", "residual"))]
        advice = "add its recorder to Scene(recorders=...)" + (f"; the run has {', '.join(known)}" if known else "")
        # The name of a recorder, such as "drift", is part of the name of its variable.
        named = [each for each in (DRIFT, *known) if each in known and str(name).lower() in each.split("_")]
        if name == DRIFT and "spring" in dataset.dims:
            listed = ", ".join(known)
            # Runs of frames have the coordinate "member".
            needs = "a LumpedStructure needs storeys (storey_height= and storey_springs=)"
            needs = "the Frame needs rigid floors (diaphragms=)" if "member" in dataset.dims else needs
            advice = (
                f"add the recorder 'drift', such as Scene(..., recorders=('drift', 'spring')), for which {needs}; "
                "otherwise give demand=, such as demand='peak_spring_deformation'"
            )
            advice += f"; the run has {listed}" if known else ""
        hint = f" (did you mean {named[0]!r}?)" if named else did_you_mean(name, known)
        raise ValueError(f"the dataset has no {name!r}{hint}: {advice}")
    variable = dataset[name]
    if "sample" not in variable.dims or variable.ndim > 2:
        of_one = ": select one event by select_event(run, name)" if "event" in variable.dims else ""
        if "period" in variable.dims and "period" in dataset.coords:
            of_one = f": select one period, such as run.sel(period={float(dataset['period'][0]):g})"
        raise ValueError(
            f"{name!r} has dimensions {variable.dims}; they must be 'sample' and at most one more, such as ('sample', "
            f"'storey'){of_one}"
        )
    if not np.issubdtype(variable.dtype, np.floating):
        raise ValueError(
            f"{name!r} is not a demand: its values are of type {variable.dtype}. Choose a "
            "variable with numbers, such as 'peak_storey_drift_ratio'"
        )
    check_one_unit(function, dataset, name)
    if variable.size == 0:
        raise ValueError(f"the dataset is empty, its sizes are {dict(dataset.sizes)}: check how you selected samples")
    values = variable.transpose("sample", ...).values
    values = magnitudes(name, np.ascontiguousarray(values.reshape(len(values), -1).T))
    # Values of failed and collapsed samples are not used, so they are not checked.
    is_good = np.ones(status.size, dtype=bool)
    for row in values:
        is_good &= (row >= 0) & (row < np.inf)
    bad = np.flatnonzero(~is_good & (status == OK))
    if bad.size:
        first = bad[0]
        where = " and ".join(
            f"{key} {dataset[key].values[first]}" for key in ("motion_index", "im_level") if key in dataset
        )
        raise ValueError(
            f"sample {first} ({where}) is 'ok' but its {name} is {values[:, first].tolist()}; it must be finite, "
            f"and a peak must not be negative ({bad.size} of {status.size} samples). Give the run as "
            "simulate() returned it"
        )
    return values
