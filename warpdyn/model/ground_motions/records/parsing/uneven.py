"""Interpolation of accelerations that were digitised from film at uneven times."""

from __future__ import annotations

from os import PathLike

import numpy as np

from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.units import checked_step

LONGEST_GAP = 0.1  # s; digitised records have gaps of up to 0.04 s in straight parts of the curve
LARGEST_INTERPOLATED = 10_000_000  # samples; a step in a wrong unit must not exhaust the memory


def at_equal_steps(
    times: np.ndarray, values: np.ndarray, step: float | None, path: str | PathLike, digits: float = 0.0
) -> tuple[np.ndarray, float]:
    """Return values at equal steps, shape [time], and the step [s].

    If the times are equally spaced (apart from the rounding of printed digits), the values are unchanged. Otherwise,
    they are interpolated linearly.

    Args:
        times: Times [s].
        values: Values at these times.
        step: Step [s] of the interpolated values; None if the user gave none.
        path: The file.
        digits: Unit in the last place of the times [s].

    Raises:
        ValueError: If times do not increase, or they are uneven and `step` is missing.
    """
    gaps = np.diff(times)
    mean = float((times[-1] - times[0]) / (times.size - 1))
    if not np.all(gaps >= 0) or not mean > 0:
        at = int(np.argmin(gaps))
        raise damaged(f"{path}: the times must increase, but {times[at]:g} s is followed by {times[at + 1]:g} s")
    for even in (float(f"{mean:.3g}"), mean):
        if np.abs(times - times[0] - even * np.arange(times.size)).max() <= max(1.01 * digits, 0.02 * even):
            if step is not None and abs(step - even) > 0.01 * even:
                raise ValueError(
                    f"{path}: step is {step:g} s, but the file has values at steps of {even:g} s: remove step="
                )
            return values, even
    if gaps.max() > max(20 * mean, LONGEST_GAP):
        at = int(np.argmax(gaps))
        raise damaged(
            f"{path}: no values from {times[at]:g} s to {times[at + 1]:g} s, while others are {mean:.4g} s apart: "
            "lines are missing or a time is damaged"
        )
    if step is None:
        raise ValueError(
            f"{path}: the record was digitised at uneven times, {gaps.min():.4g} to {gaps.max():.4g} s apart. Give "
            f"step= to interpolate it, such as wd.records.read(path, step=0.005), or take the corrected file (V2)"
        )
    step = checked_step(step, "step")
    if (times[-1] - times[0]) / step > LARGEST_INTERPOLATED:
        raise ValueError(
            f"{path}: step={step:g} s makes more than {LARGEST_INTERPOLATED:,} values: give step= in seconds"
        )
    grid = np.arange(times[0], times[-1] + 1e-9 * step, step)
    return np.interp(grid, times, values), step
