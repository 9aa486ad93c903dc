"""Counts of the samples of a run on stripes, by record, group of structures, stripe, storey and damage state."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.answers.fragility.demands import damage_of
from warpdyn.answers.fragility.intervals.strata import strata_of_records
from warpdyn.answers.fragility.reduced_counts import is_reduced, stripe_counts_of
from warpdyn.campaigns.reductions.limits import DRIFT, DamageLimits
from warpdyn.campaigns.reductions.population import group_numbers
from warpdyn.campaigns.running.joining.duplicates import check_samples
from warpdyn.foundations.core.checks import check_memory
from warpdyn.foundations.core.output_variables import COLLAPSED, DIVERGED, LARGEST_EXCLUDED_FRACTION, STATUS_MEANINGS

MOST_LEVELS = 4096  # largest number of levels if each observation has its own level
# Memory that the fit needs, in multiples of the table of counts; measured: 2.8 kB per pair of a record and a level for
# 5 storeys and 3 damage states.
TABLES = 20
_NEEDS_STRIPES = (
    "curves are fitted to stripes, or to single observations at up to "
    f"{MOST_LEVELS:,} levels; for a larger cloud use fragility_of_cloud(dataset, limits)"
)


@dataclass(frozen=True, eq=False)
class StripeCounts:
    """Numbers of samples that exceed damage states, by record, group of structures and stripe.

    Groups of structures are left out one at a time by the jackknife that computes intervals.

    Args:
        levels: Intensity of each stripe, shape [im_level], increasing.
        units: Units of the levels.
        dim: Name of the dimension of the places (storeys or floors) of a demand; "" if only the worst place is known.
        places: Labels of the places, shape [place].
        exceeding: Number of exceeding samples, shape [record, group, im_level, place + 1, damage_state]; the last place
            is the worst of all.
        valid: Number of samples that did not fail, shape [record, group, im_level].
        excluded: Number of failed samples, by status.
        records: Labels of the records, shape [record].
        is_crossed: Whether the same structures run under every record; if not, each structure runs under one record.
        least_drift: Smallest drift ratio at which a sample collapsed [1]; infinite without collapses or drift limits.
    """

    levels: np.ndarray
    units: str
    dim: str
    places: np.ndarray
    exceeding: np.ndarray
    valid: np.ndarray
    excluded: dict[str, int]
    records: np.ndarray
    is_crossed: bool
    least_drift: float

    @cached_property
    def of_records(self) -> np.ndarray:
        """Number of exceeding samples by record, shape [record, im_level, place + 1, damage_state]."""
        return self.exceeding.sum(axis=1)

    @cached_property
    def of_groups(self) -> np.ndarray:
        """Number of exceeding samples by group of structures, shape [group, im_level, place + 1, damage_state]."""
        return self.exceeding.sum(axis=0)

    @cached_property
    def total(self) -> np.ndarray:
        """Number of exceeding samples of all records and groups, shape [place + 1, damage_state, im_level]."""
        return np.moveaxis(self.of_records.sum(axis=0), 0, -1)

    @cached_property
    def strata(self) -> np.ndarray:
        """Number of each record's stratum, shape [record]; see `strata_of_records`."""
        return strata_of_records(self.valid.sum(axis=1) > 0)

    @cached_property
    def trials(self) -> np.ndarray:
        """Number of samples of all records and groups that did not fail, shape [im_level]."""
        return self.valid.sum(axis=(0, 1))


def count_stripes(dataset: xr.Dataset, limits: DamageLimits) -> StripeCounts:
    """Return the counts of samples that exceed each limit, by record and stripe, at each and the worst place.

    A place is a storey or a floor.

    Args:
        dataset: A run on stripes, as for `fragility`, or its damage counts.
        limits: Limits of the damage states; for damage counts, the limits with which they were counted.

    Raises:
        ValueError: If the dataset is not a run on stripes, or more than 1 % of its samples failed.
    """
    if is_reduced(dataset):
        return _counted(stripe_counts_of(dataset, limits))
    status, record, level, units = _checked_inputs(dataset)
    check_samples("fragility", dataset)
    (records, record_index), (levels, stripe) = _indexed(record), _indexed(level)
    if levels.size < 2:
        raise ValueError(
            f"all samples are on the stripe of {levels[0]} {units}, but a curve needs at least "
            "2 stripes: simulate Stripes(motions, [0.2, 0.4, ...], measure)"
        )
    if status.size < 2 * levels.size:  # checked before the large table is allocated
        _check_pairs(np.unique(record_index * levels.size + stripe).size, levels.size, records.size)
    excluded = checked_failures(status, record, level, units)
    kept = status <= COLLAPSED
    damage = damage_of("fragility", dataset, limits, status)
    passed = damage.passed
    own = structure_label(dataset)
    structure = np.arange(status.size) if own is None else own.values
    sampling = "" if own is None else str(own.attrs.get("sampling", ""))
    # Excluded samples do not change the groups of other structures.
    is_crossed, groups, group = structure_groups(structure, record_index, records.size, sampling)
    if not kept.all():
        passed, group = passed[:, kept], group[kept]
        # Records whose samples all failed are omitted.
        (records, record_index), (levels, stripe) = _indexed(record[kept]), _indexed(level[kept])
        if records.size == 1:
            is_crossed, groups, group = False, 1, np.zeros_like(group)
    cell = (record_index * groups + group) * levels.size + stripe
    cells, states = records.size * groups * levels.size, len(limits.states)
    check_memory(
        f"fragility of {records.size:,} records at {levels.size:,} levels",
        8.0 * TABLES * cells * len(passed) * states,
        "use fragility_of_cloud, or fewer records or damage states",
    )
    valid = np.bincount(cell, minlength=cells).reshape(records.size, groups, levels.size)
    _check_stripes(valid)
    cell *= states + 1
    shape = valid.shape
    exceeding = np.empty((*shape, len(passed), states), dtype=np.int64)
    for column, row in enumerate(passed):
        histogram = np.bincount(cell + row, minlength=cells * (states + 1)).reshape(*shape, states + 1)
        reached = np.zeros(shape, dtype=np.int64)
        for state in range(states)[::-1]:  # a sample that has reached a state has also reached all lighter states
            reached += histogram[..., state + 1]
            exceeding[..., column, state] = reached
    return StripeCounts(
        levels,
        units,
        damage.dim,
        damage.places,
        exceeding,
        valid,
        excluded,
        records,
        is_crossed,
        _least_drift(dataset, limits, status),
    )


def _counted(parts: dict[str, Any]) -> StripeCounts:
    """Return the counts of samples, as from `count_stripes`, from the fields of `stripe_counts_of`."""
    failed, valid, records, levels = (parts.pop(name) for name in ("failed", "valid", "records", "levels"))
    exceeding, failures, is_crossed = parts.pop("exceeding"), parts.pop("failures"), parts.pop("is_crossed")
    if levels.size < 2:
        raise ValueError(
            f"all samples are on one stripe ({levels}), but a curve needs at least 2 stripes: "
            "simulate Stripes(motions, [0.2, 0.4, ...], measure)"
        )
    excluded = dict(zip(failures, failed.sum(axis=(0, 1, 2)).tolist(), strict=True))
    samples = int(valid.sum() + failed.sum())
    if not samples:
        raise ValueError("no sample was counted: all counts are 0. Give the counts as simulate() returned them")
    if sum(excluded.values()) > LARGEST_EXCLUDED_FRACTION * samples:
        of_record = np.repeat(records, failed.sum(axis=(1, 2, 3)))
        of_level = np.repeat(levels, failed.sum(axis=(0, 1, 3)))
        raise ValueError(_refusal(excluded, of_record, of_level, samples, parts["units"]))
    # Records whose samples all failed are omitted.
    record, stripe = valid.any(axis=(1, 2)), valid.any(axis=(0, 1))
    valid, exceeding = valid[record][:, :, stripe], exceeding[record][:, :, stripe]
    if len(valid) == 1 and is_crossed:
        is_crossed, valid, exceeding = False, valid.sum(axis=1, keepdims=True), exceeding.sum(axis=1, keepdims=True)
    _check_stripes(valid)
    return StripeCounts(
        levels=levels[stripe],
        records=records[record],
        # A fixed order in memory, because the last bits of later sums depend on it.
        exceeding=np.ascontiguousarray(exceeding),
        valid=np.ascontiguousarray(valid),
        excluded=excluded,
        is_crossed=is_crossed,
        **parts,
    )


def structure_groups(
    structure: np.ndarray, record: np.ndarray, records: int, sampling: str
) -> tuple[bool, int, np.ndarray]:
    """Return whether the design is crossed, and the groups of structures that a jackknife leaves out one at a time.

    Args:
        structure: Index of the structure of each sample, shape [sample].
        record: Index of the record of each sample, shape [sample].
        records: Number of records.
        sampling: Sampling method of the structures.

    Returns:
        Whether structures run under several records (crossed design); number of groups; group of each sample.
    """
    distinct, index = _indexed(structure)
    if records == 1:
        return False, 1, np.zeros(structure.size, dtype=np.int64)
    first = np.full(distinct.size, -1)
    first[index] = record
    if (first[index] == record).all():  # no structure runs under two records
        return False, 1, np.zeros(structure.size, dtype=np.int64)
    group = group_numbers(distinct.size, sampling)[index]
    return True, int(group.max()) + 1, group


def structure_label(dataset: xr.Dataset) -> xr.DataArray | None:
    """Return the number of each sample's structure (or building of a portfolio) as a coordinate; None if unknown."""
    return next((dataset[name] for name in ("structure", "building") if name in dataset.coords), None)


def _least_drift(dataset: xr.Dataset, limits: DamageLimits, status: np.ndarray) -> float:
    """Return the smallest drift ratio [1] at which a storey of the building collapsed; infinite without collapses."""
    collapsed = status == COLLAPSED
    if "storey_of_collapse" in dataset and "storey" in dataset.coords:  # exclude isolators, whose storeys were removed
        collapsed &= np.isin(dataset["storey_of_collapse"].values, dataset["storey"].values)
    if DRIFT not in limits.demands or not collapsed.any():
        return np.inf
    drift = dataset[DRIFT].transpose("sample", ...).values[collapsed]
    return float(np.nanmin(drift.reshape(len(drift), -1).max(axis=1), initial=np.inf))


def checked_failures(status: np.ndarray, record: np.ndarray, level: np.ndarray, units: str) -> dict[str, int]:
    """Return the number of failed samples of each status, or raise a ValueError if more than 1 % of the samples failed.

    Args:
        status: Outcome of each sample, an index into STATUS_MEANINGS, shape [sample].
        record: Index of the motion of each sample, shape [sample].
        level: Intensity of each sample [units], shape [sample].
        units: Units of the intensity.
    """
    excluded = {name: int((status == STATUS_MEANINGS.index(name)).sum()) for name in STATUS_MEANINGS[DIVERGED:]}
    if sum(excluded.values()) > LARGEST_EXCLUDED_FRACTION * status.size:
        failed = status > COLLAPSED
        raise ValueError(_refusal(excluded, record[failed], level[failed], status.size, units))
    return excluded


def _refusal(excluded: dict[str, int], record: np.ndarray, level: np.ndarray, samples: int, units: str) -> str:
    """Return an error message with the number of failed samples, and their most frequent motions and levels."""
    places = []
    for what, values in (("motion_index", record), ("im_level", level)):
        found, number = np.unique(values, return_counts=True)
        most = np.argsort(-number, kind="stable")[:3]
        places.append(f"{what} " + ", ".join(f"{found[i]} ({number[i]})" for i in most))
    total = sum(excluded.values())
    return (
        f"{total} of {samples} samples ({100 * total / samples:.2f} %) failed "
        f"({', '.join(f'{number} {status}' for status, number in excluded.items())}); at most "
        f"{100 * LARGEST_EXCLUDED_FRACTION:g} % may. Most are in {'; and in '.join(places)} {units}. Simulate with a "
        "smaller step= or another method="
    )


def _checked_inputs(dataset: xr.Dataset) -> tuple[np.ndarray, np.ndarray, np.ndarray, str]:
    """Return status (an index into `STATUS_MEANINGS`), motion and level of every sample, and the units of the level."""
    if "im_level" not in dataset:
        raise ValueError(
            "the dataset has no 'im_level' (intensity levels), so it has no fragility curve: for the probability that "
            "a sample exceeds a limit, use wd.exceedance_probability(run, limits); for a curve, simulate "
            "Stripes(motions, levels, measure). The motions of a FilteredNoise are [noise.motion(i, seed=1) for i in "
            "range(64)]"
        )
    check_labels(dataset)
    if dataset.sizes["sample"] == 0:
        raise ValueError(f"the dataset is empty, its sizes are {dict(dataset.sizes)}: check how you selected samples")
    record, level = dataset["motion_index"].values, dataset["im_level"].values.astype(np.float64)
    units = str(dataset["im_level"].attrs.get("units", "g"))
    bad = np.flatnonzero(~(np.isfinite(level) & (level > 0)))
    if bad.size:
        raise ValueError(
            f"'im_level' of sample {bad[0]} is {level[bad[0]]}; every level must be finite and above 0 "
            f"{units}: give the run as simulate() returned it"
        )
    return decoded_status(dataset["status"]), record, level, units


def check_labels(dataset: xr.Dataset, begin: str = "") -> None:
    """Raise a ValueError, whose message begins with `begin`, unless samples have a status, a motion and a level."""
    for name in ("status", "motion_index", "im_level"):
        if name not in dataset:
            raise ValueError(
                f"{begin}the dataset has no {name!r}, but a demand, status, motion_index and "
                "im_level are needed: give the result of simulate()"
            )
        if dataset[name].dims != ("sample",):
            of_one = ": select one event by select_event(run, name)" if "event" in dataset[name].dims else ""
            raise ValueError(f"{begin}{name!r} has dimensions {dataset[name].dims}; they must be ('sample',){of_one}")


def _check_stripes(valid: np.ndarray) -> None:
    """Raise a ValueError unless records share stripes.

    `valid` is the number of samples that did not fail, shape [record, group, im_level].
    """
    records, _, levels = valid.shape
    _check_pairs(int(np.count_nonzero(valid.sum(axis=1))), levels, records)


def _check_pairs(pairs: int, levels: int, records: int) -> None:
    """Raise a ValueError if records share no level and there are more levels than MOST_LEVELS.

    Args:
        pairs: Number of pairs of a record and a level that have samples.
        levels: Number of levels.
        records: Number of records.
    """
    if pairs < 2 * levels and records > 1 and levels > MOST_LEVELS:
        raise ValueError(f"'im_level' has {levels} values for {pairs} pairs of record and level, but {_NEEDS_STRIPES}")


def _indexed(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct values in increasing order, and the index of each value among them."""
    if np.issubdtype(values.dtype, np.integer) and values.size and int(np.ptp(values)) < values.size:
        # Counting needs a third of the time of hashing.
        index = (values - values.min()).astype(np.int64, copy=False)
        is_there = np.bincount(index) > 0
        distinct = np.flatnonzero(is_there) + values.min()
        return distinct, index if is_there.all() else (np.cumsum(is_there) - 1)[index]
    index, distinct = pd.factorize(values)  # hashing is faster than sorting by NumPy
    order = np.argsort(distinct, kind="stable")
    rank = np.empty(order.size, dtype=np.int64)
    rank[order] = np.arange(order.size)
    return distinct[order], rank[index]


def decoded_status(status: xr.DataArray) -> np.ndarray:
    """Return the status of each sample as an index into STATUS_MEANINGS, from the flag attributes of the variable."""
    meanings = str(status.attrs.get("flag_meanings", "")).split()
    codes = np.atleast_1d(status.attrs.get("flag_values", ()))
    known = {"ok", "collapsed"} <= set(meanings) <= set(STATUS_MEANINGS) and len(set(meanings)) == len(meanings)
    if not known or len(codes) != len(meanings):
        raise ValueError(
            f"'status' has flag_meanings {meanings} and flag_values {list(codes)}; "
            "it needs one value per meaning, and the meanings ok, collapsed and any of "
            f"{', '.join(STATUS_MEANINGS[2:])}: give the run as simulate() returned it"
        )
    decoded = np.full(status.shape, -1, dtype=np.int8)
    for code, meaning in zip(codes, meanings, strict=True):
        decoded[status.values == code] = STATUS_MEANINGS.index(meaning)
    bad = np.flatnonzero(decoded < 0)
    if bad.size:
        raise ValueError(
            f"'status' of sample {bad[0]} is {status.values[bad[0]]}; allowed are "
            f"{list(codes)}: give the run as simulate() returned it"
        )
    return decoded
