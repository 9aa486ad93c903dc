"""Samples of a run on stripes, counted by record, stripe, storey and damage state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from warpdyn.core.output_variables import COLLAPSED, DIVERGED, OK, STATUS_MEANINGS, STRIPED

LARGEST_EXCLUDED_FRACTION = 0.01  # with a larger fraction of failed samples an error is raised

_CHUNK = 1 << 16  # samples counted at a time
_NEEDS_STRIPES = (
    "curves are fitted to stripes, where each record is scaled to each of a list of levels; "
    "a cloud of unscaled records and a motion for each sample have none"
)


@dataclass(frozen=True, eq=False)
class StripeCounts:
    """Samples counted by record and stripe.

    Args:
        levels: Intensity of each stripe [g], shape [im_level], increasing.
        storeys: Storey labels, shape [storey].
        exceeding: Exceeding samples, shape [record, im_level, storey + 1, damage_state]; the worst storey is the last.
        valid: Samples counted, shape [record, im_level].
        excluded: Number of samples kept out, by status.
        least_drift: Least drift ratio at which a sample collapsed [1]; infinite where none did.
    """

    levels: np.ndarray
    storeys: np.ndarray
    exceeding: np.ndarray
    valid: np.ndarray
    excluded: dict[str, int]
    least_drift: float


def count_stripes(dataset: xr.Dataset, limit: np.ndarray) -> StripeCounts:
    """Count the samples of each record and stripe whose drift ratio is above each limit, at each storey and the worst.

    Args:
        dataset: A run on stripes, as `warpdyn.statistics.fragility_curves.fragility` takes it.
        limit: Storey drift ratio limits [1], shape [damage_state], increasing.

    Raises:
        ValueError: If the dataset is not such a run, or more than 1 % of its samples failed (diverged and the like).
    """
    drift, status, record, level, labels, record_index, levels, stripe = _checked_inputs(dataset)
    excluded = {name: int((status == STATUS_MEANINGS.index(name)).sum()) for name in STATUS_MEANINGS[DIVERGED:]}
    kept = status <= COLLAPSED
    if sum(excluded.values()) > LARGEST_EXCLUDED_FRACTION * status.size:
        raise ValueError(_refusal(excluded, record[~kept], level[~kept], status.size))

    if not kept.all():
        drift, stripe, record_index, status = drift[kept], stripe[kept], record_index[kept], status[kept]
    collapsed = status == COLLAPSED
    # Records whose samples are all excluded are left out.
    has_samples = np.bincount(record_index, minlength=labels.size) > 0
    record_index = (np.cumsum(has_samples) - 1)[record_index]
    records, storeys, states = int(has_samples.sum()), drift.shape[1], limit.size
    cell = record_index * levels.size + stripe
    valid = np.bincount(cell, minlength=records * levels.size)

    # Every collapse counts as exceeding every limit, also a limit that no drift of theirs is known to exceed.
    least = float(np.nanmin(drift[collapsed].max(axis=1), initial=np.inf))

    # A histogram of how many limits each demand exceeds; as limits increase, sums from above give every state.
    shape = (records, levels.size, storeys + 1, states + 1)
    histogram = np.zeros(shape, dtype=np.int64)
    for start in range(0, cell.size, _CHUNK):
        part = slice(start, start + _CHUNK)
        demand = drift[part].astype(np.float64)
        demand = np.concatenate([demand, demand.max(axis=1, keepdims=True)], axis=1)
        passed = np.searchsorted(limit, demand, side="left")  # left: a demand equal to a limit does not pass it
        passed[collapsed[part]] = states
        bins = (cell[part][:, None] * (storeys + 1) + np.arange(storeys + 1)) * (states + 1) + passed
        histogram += np.bincount(bins.ravel(), minlength=histogram.size).reshape(shape)
    exceeding = histogram[..., :0:-1].cumsum(axis=-1)[..., ::-1]
    storey_labels = dataset["storey"].values if "storey" in dataset.coords else np.arange(1, storeys + 1)
    return StripeCounts(levels, storey_labels, exceeding, valid.reshape(records, levels.size), excluded, least)


def _refusal(excluded: dict[str, int], record: np.ndarray, level: np.ndarray, samples: int) -> str:
    """Return an error message with the number of excluded samples and where they are."""
    places = []
    for what, values in (("motion_index", record), ("im_level", level)):
        found, number = np.unique(values, return_counts=True)
        most = np.argsort(-number, kind="stable")[:3]
        places.append(f"{what} " + ", ".join(f"{found[i]} ({number[i]})" for i in most))
    total = sum(excluded.values())
    return (
        f"{total} of {samples} samples ({100 * total / samples:.2f} %) are kept out "
        f"({', '.join(f'{number} {status}' for status, number in excluded.items())}); at most "
        f"{100 * LARGEST_EXCLUDED_FRACTION:g} % may be. Most are in {'; and in '.join(places)} g. "
        "Take a smaller step or another method"
    )


def _checked_inputs(dataset: xr.Dataset) -> tuple[np.ndarray, ...]:
    """Return drift ratio, status as an index into `STATUS_MEANINGS`, motion and level of every sample.

    Then follow the distinct motions and every sample's index into them, and the same for the levels.
    """
    if "im_level" not in dataset:
        raise ValueError(f"the dataset has no 'im_level': {_NEEDS_STRIPES}")
    needed = {
        "peak_storey_drift_ratio": ("sample", "storey"),
        "status": ("sample",),
        "motion_index": ("sample",),
        "im_level": ("sample",),
    }
    for name, dimensions in needed.items():
        if name not in dataset:
            raise ValueError(f"the dataset has no {name!r}; needed are {', '.join(needed)}")
        if set(dataset[name].dims) != set(dimensions):
            of_one = "; take one event by `select_event`" if "event" in dataset[name].dims else ""
            raise ValueError(f"{name!r} has dimensions {dataset[name].dims}; they must be {dimensions}{of_one}")
    if dataset.sizes["sample"] == 0 or dataset.sizes["storey"] == 0:
        raise ValueError(f"the dataset is empty: {dict(dataset.sizes)}")
    drift = dataset["peak_storey_drift_ratio"].transpose("sample", "storey").values
    record, level = dataset["motion_index"].values, dataset["im_level"].values.astype(np.float64)
    if dataset["im_level"].attrs.get("design", STRIPED) != STRIPED:
        raise ValueError(f"'im_level' is {dataset['im_level'].attrs['design']}: {_NEEDS_STRIPES}")
    units = dataset["im_level"].attrs.get("units", "g")
    if units != "g":
        raise ValueError(f"'im_level' is in {units!r}; it must be in 'g'")
    bad = np.flatnonzero(~(np.isfinite(level) & (level > 0)))
    if bad.size:
        raise ValueError(f"'im_level' of sample {bad[0]} is {level[bad[0]]}; every level must be finite and above 0 g")
    (records, record_index), (levels, stripe) = _indexed(record), _indexed(level)
    if levels.size < 2:
        raise ValueError(f"all samples are on the stripe of {level[0]} g; a curve needs at least 2 stripes")
    # Motions that share no level are no stripes, although every sample has a level.
    pairs = np.count_nonzero(np.bincount(record_index * levels.size + stripe, minlength=1))
    if pairs < 2 * levels.size and records.size > 1:
        raise ValueError(f"'im_level' has {levels.size} values for {pairs} pairs of record and level: {_NEEDS_STRIPES}")
    status = decoded_status(dataset["status"])
    unusable = ~np.isfinite(drift).all(axis=1) | ~(drift >= 0).all(axis=1)
    bad = np.flatnonzero(unusable & (status == OK))
    if bad.size:
        if "archetype_index" in dataset and "archetype" in dataset:  # a run of one archetype does not name them all
            raise ValueError(
                "this is a run of a portfolio whose buildings differ in storeys: fragility() takes one archetype, "
                "select_archetype(run, name), and damage_shares(run, limits) counts all, with limits for each of "
                f"{', '.join(map(repr, dataset['archetype'].values.tolist()))}"
            )
        raise ValueError(
            f"sample {bad[0]} (motion_index {record[bad[0]]}, im_level {level[bad[0]]} g) is 'ok' but its "
            f"peak_storey_drift_ratio is {drift[bad[0]].tolist()}; it must be finite and not negative "
            f"({bad.size} of {level.size} samples)"
        )
    return drift, status, record, level, records, record_index, levels, stripe


def _indexed(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct values, sorted, and the index of each value among them."""
    distinct = np.unique(values)
    return distinct, np.searchsorted(distinct, values)


def decoded_status(status: xr.DataArray) -> np.ndarray:
    """Return the status by the meanings of the flags, whatever codes a file has for them."""
    meanings = str(status.attrs.get("flag_meanings", "")).split()
    codes = np.atleast_1d(status.attrs.get("flag_values", ()))
    known = {"ok", "collapsed"} <= set(meanings) <= set(STATUS_MEANINGS) and len(set(meanings)) == len(meanings)
    if not known or len(codes) != len(meanings):
        raise ValueError(
            f"'status' has flag_meanings {meanings} and flag_values {list(codes)}; "
            f"it needs a value for each of those it has among {', '.join(STATUS_MEANINGS)}, ok and collapsed at least"
        )
    decoded = np.full(status.shape, -1, dtype=np.int8)
    for code, meaning in zip(codes, meanings, strict=True):
        decoded[status.values == code] = STATUS_MEANINGS.index(meaning)
    bad = np.flatnonzero(decoded < 0)
    if bad.size:
        raise ValueError(f"'status' of sample {bad[0]} is {status.values[bad[0]]}; allowed are {list(codes)}")
    return decoded
