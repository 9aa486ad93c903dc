"""Bounds on the records of a selection: which records satisfy them, and messages if too few do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from warpdyn.foundations.core.checks import real_numbers
from warpdyn.model.ground_motions.selection.record_spectra import NUMBERS, RecordSpectra
from warpdyn.model.ground_motions.selection.target import TargetSpectrum

ROUNDING = 1e-9  # relative tolerance of bounds


def checked_bounds(name: str, bounds: Sequence[float] | None) -> tuple[float, float] | None:
    """Return a pair (least, most) of numbers of at least 0; None if there is no bound."""
    if bounds is None:
        return None
    row = real_numbers(f"select_records: {name}", bounds)
    if row.shape != (2,) or np.any(np.isnan(row)) or row[0] < 0 or row[0] > row[1]:
        raise ValueError(
            f"select_records: {name} must be two numbers of at least 0, the least and the largest value, got {bounds!r}"
        )
    return float(row[0]), float(row[1])


def screened(
    records: RecordSpectra,
    target: TargetSpectrum,
    bounds: dict[str, tuple[float, float] | None],
    factors: np.ndarray | None,
    scale: tuple[float, float],
) -> tuple[np.ndarray, dict[str, int]]:
    """Return which records satisfy all bounds, and the number of records that each bound alone leaves.

    Args:
        records: The records.
        target: The target; its longest period must be usable.
        bounds: Name of a column of the table -> its least and largest value.
        factors: Scale factor of each record to the level of the target; None: unconditional.
        scale: Smallest and largest scale factor.
    """
    passes = np.ones(records.number, bool)
    left: dict[str, int] = {}

    def apply(bound: str, good: np.ndarray) -> None:
        nonlocal passes
        left[bound] = int(good.sum())
        passes = passes & good

    assert records.table is not None  # from its constructor
    for name, pair in bounds.items():
        if pair is None:
            continue
        if name not in records.table:
            raise ValueError(
                f"select_records: {name}={pair} needs the {name} of each record, but the table of the records has the "
                f"columns {', '.join(map(str, records.table.columns))}: add a column {name!r}, or remove {name}="
            )
        values = finite_or_nan(records, name)
        apply(f"{name} {pair[0]:g} to {pair[1]:g}{NUMBERS[name]}", (values >= pair[0]) & (values <= pair[1]))
    if "longest_usable_period" in records.table:
        usable, longest = finite_or_nan(records, "longest_usable_period"), float(np.asarray(target.periods)[-1])
        # An unknown usable period does not exclude a record.
        apply(f"usable up to {longest:g} s", ~(usable < longest * (1 - ROUNDING)))
    if factors is not None:
        good = (factors >= scale[0] * (1 - ROUNDING)) & (factors <= scale[1] * (1 + ROUNDING))
        apply(f"scale factor {scale[0]:g} to {scale[1]:g}", good)
    return passes, left


def finite_or_nan(records: RecordSpectra, name: str) -> np.ndarray:
    """Return a column of numbers of the table; missing values are NaN."""
    assert records.table is not None
    return records.table[name].to_numpy(float)


def check_enough(number: int, available: int, records: int, left: dict[str, int], level: float | None) -> None:
    """Raise a ValueError that lists how many records each bound leaves, if too few satisfy all bounds."""
    if available >= number:
        return
    of_level = "" if level is None else f" for the level {level:.4g} g"
    each = "; ".join(f"{name}: {count}" for name, count in left.items())
    strictest = min(left, key=lambda name: left[name]) if left else ""
    advice = "Give a smaller number="
    if number > records:
        advice = f"Add records: wider bounds leave at most {records}; or give number={records} or less"
    elif left:
        advice = f"Widen the bound on {strictest!r} first, or give a smaller number="
    alone = f" Records that each bound alone leaves: {each}." if left else ""
    raise ValueError(
        f"select_records: {available} of {records} records satisfy all bounds{of_level}, fewer than number={number}."
        f"{alone} {advice}"
    )


def events_of(records: RecordSpectra) -> np.ndarray:
    """Return the index of the event of each record; each record without an event counts as a separate event."""
    assert records.table is not None
    if "event" not in records.table:
        return np.arange(records.number)
    column = records.table["event"]
    codes = column.astype(str).rank(method="dense").to_numpy(int) - 1
    alone = column.isna().to_numpy()
    codes[alone] = codes.max(initial=0) + 1 + np.arange(alone.sum())
    return codes


def check_events(chosen: int, events: np.ndarray, most_per_event: int, number: int) -> None:
    """Raise a ValueError if the limit of records per event makes the number of records impossible."""
    possible = int(np.minimum(np.bincount(events), most_per_event).sum())
    if possible < number:
        raise ValueError(
            f"select_records: {chosen} records of {np.unique(events).size} events satisfy all bounds, so that at most "
            f"{possible} can be selected with most_per_event={most_per_event}, fewer than number={number}: increase "
            "most_per_event="
        )
