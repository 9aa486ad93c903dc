"""Units of acceleration, and steps of time."""

from __future__ import annotations

import re
from numbers import Real

import numpy as np

from warpdyn.core.units import STANDARD_GRAVITY

#: Factor from each unit of acceleration to m/s2. Case does not matter, and "CM/SEC^2" is read as "cm/s2".
UNITS = {"m/s2": 1.0, "m s-2": 1.0, "cm/s2": 0.01, "cm s-2": 0.01, "gal": 0.01, "g": STANDARD_GRAVITY}
ALLOWED_UNITS = ", ".join(repr(unit) for unit in UNITS)

# Times are printed with few digits (1/128 s as .0078, which is off by up to 0.64 % of the step, and two such times by
# 1.28 %), but a lost or doubled value moves the others by half a step or more. 2 % of a step distinguishes the two.
TIME_TOLERANCE = 0.02


def unit_factor(unit: str, place: str) -> float:
    """Return the factor from a unit to m/s2, or raise a ValueError that names its place."""
    known = re.sub(r"\s+", " ", re.sub(r"\s*([/*^])\s*", r"\1", str(unit).strip().lower()))
    known = known.replace("**", "").replace("^", "").replace("sec", "s").replace("/s/s", "/s2")
    if known not in UNITS:
        raise ValueError(f"{place}: unknown unit {unit!r}, allowed are {ALLOWED_UNITS}")
    return UNITS[known]


def checked_step(step: float, place: str) -> float:
    if not isinstance(step, Real) or not np.isfinite(step) or step <= 0:
        raise ValueError(f"{place} must be a finite number above 0 s, got {step!r}")
    return float(step)


def step_of_times(times: np.ndarray, step: float | None, place: str) -> float:
    """Return the given step, or that of the times [s] if it is None; raise unless the times follow it."""
    if step is None:
        # The mean has rounding errors in its last digits; no record's step has twelve of its own.
        step = float(f"{(times[-1] - times[0]) / (times.size - 1):.12g}")
    off = np.abs(times - times[0] - step * np.arange(times.size))
    if not (step > 0 and np.all(off <= TIME_TOLERANCE * step)):
        i = int(np.argmax(np.abs(np.diff(times) - step)))
        raise ValueError(
            f"{place}: the times must increase evenly, here by {step:.6g} s within {TIME_TOLERANCE:.0%} of it, but "
            f"sample {i} is at {times[i]:.6g} s and sample {i + 1} at {times[i + 1]:.6g} s"
        )
    return step
