"""Units of acceleration, and time steps."""

from __future__ import annotations

import re
import unicodedata
from numbers import Real

import numpy as np

from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged

#: Factor from each unit of acceleration to m/s2. Upper and lower case are the same.
#: Other spellings are read too, such as "m/s²", "CM/SEC^2", "cm/s/s", "cm.s-2", "Gals" and "ft/sec/sec".
UNITS = {
    "m/s2": 1.0,
    "m s-2": 1.0,
    "cm/s2": 0.01,
    "cm s-2": 0.01,
    "mm/s2": 1e-3,
    "nm/s2": 1e-9,
    "gal": 0.01,
    "g": STANDARD_GRAVITY,
    "%g": 0.01 * STANDARD_GRAVITY,
    "mg": 1e-3 * STANDARD_GRAVITY,
    "in/s2": 0.0254,
    "ft/s2": 0.3048,
}
ALLOWED_UNITS = ", ".join(repr(unit) for unit in UNITS)
# Names of lengths [m] in units of the form "length per second squared".
_LENGTHS = {
    "m": 1.0, "meter": 1.0, "metre": 1.0, "meters": 1.0, "metres": 1.0, "cm": 0.01, "centimeter": 0.01,
    "centimetre": 0.01, "centimeters": 0.01, "centimetres": 0.01, "mm": 1e-3, "millimeter": 1e-3, "millimetre": 1e-3,
    "millimeters": 1e-3, "millimetres": 1e-3, "nm": 1e-9, "nanometer": 1e-9, "nanometre": 1e-9, "nanometers": 1e-9,
    "nanometres": 1e-9, "in": 0.0254, "inch": 0.0254, "inches": 0.0254, "ft": 0.3048, "foot": 0.3048, "feet": 0.3048,
}  # fmt: skip
_SECONDS = r"s(?:ec(?:ond)?s?)?"
# Text after the length in "m/s2", "m/s/s", "m/(s*s)", "m s-2", "m.s-2", "m*s-2" and "m per second squared".
_PER_SECOND_SQUARED = re.compile(
    rf"(?:/{_SECONDS}/{_SECONDS}|/\(?{_SECONDS}(?:2|[*.]{_SECONDS}|squared)\)?|[ *.]?{_SECONDS}-2)"
)
_GRAVITY = {
    "g": 1.0, "gs": 1.0, "g's": 1.0, "gravity": 1.0, "%g": 0.01, "%ofg": 0.01, "percentg": 0.01, "percentofg": 0.01,
    "pctg": 0.01, "g/100": 0.01, "g/10": 0.1, "mg": 1e-3, "millig": 1e-3, "milli-g": 1e-3,
}  # fmt: skip
_GALS = ("gal", "gals")
_ASCII_SIGNS = str.maketrans("\u2212\u2013\u00b7\u22c5\u2219\u00d7\u2215\u2044\u2019", "--...*//'")

# Times are printed with few digits: 1/128 s is printed as .0078, so that a time is wrong by up to 0.64 % of the step
# and a difference of two times by up to 1.28 %. A lost or repeated value shifts later times by half a step or more. A
# tolerance of 2 % separates both cases.
TIME_TOLERANCE = 0.02


def unit_factor(unit: str, place: str) -> float:
    """Return the factor that converts a unit of acceleration to m/s2; raise a ValueError that begins with `place`."""
    factor = factor_of_unit(unit)
    if factor is None:
        raise ValueError(f"{place}: unknown unit {unit!r}, allowed are {ALLOWED_UNITS}")
    return factor


def factor_of_unit(unit: str) -> float | None:
    """Return the factor that converts a unit of acceleration, in any usual spelling, to m/s2; None for other units."""
    # NFKC normalisation replaces superscripts by ordinary digits.
    text = unicodedata.normalize("NFKC", str(unit)).translate(_ASCII_SIGNS).strip(" \t.,;:").lower()
    text = re.sub(
        r"\s*([/*^.()-])\s*", r"\1", text.replace("**", "").replace("^", "").replace("{", "").replace("}", "")
    )
    text = re.sub(r"\s+", " ", re.sub(r"\s+per\s+", "/", text)).replace(" squared", "squared")
    text = re.sub(r"\s+2$", "2", text)
    together = text.replace(" ", "")
    if together in _GALS:
        return UNITS["gal"]
    if together in _GRAVITY:
        return _GRAVITY[together] * STANDARD_GRAVITY
    length = re.match(r"[a-z]+?(?=[/ *.]|s(?:ec)?-2)", text)
    if length and length[0] in _LENGTHS and _PER_SECOND_SQUARED.fullmatch(text[length.end() :]):
        return _LENGTHS[length[0]]
    return None


def checked_step(step: float, place: str) -> float:
    if not isinstance(step, Real) or not np.isfinite(step) or step <= 0:
        raise ValueError(f"{place} must be a finite number above 0 s, got {step!r}")
    return float(step)


def step_of_times(times: np.ndarray, step: float | None, place: str) -> float:
    """Return the step of times [s], or `step` if it is given; raise a ValueError if times are not equally spaced."""
    if step is None:
        # Rounded to 12 digits, because the mean has rounding errors in its last digits.
        step = float(f"{(times[-1] - times[0]) / (times.size - 1):.12g}")
    off = np.abs(times - times[0] - step * np.arange(times.size))
    if not (step > 0 and np.all(off <= TIME_TOLERANCE * step)):
        i = int(np.argmax(np.abs(np.diff(times) - step)))
        raise damaged(
            f"{place}: the times must increase evenly by {step:.6g} s, with a tolerance of {TIME_TOLERANCE:.0%}, but "
            f"sample {i} is at {times[i]:.6g} s and sample {i + 1} at {times[i + 1]:.6g} s: a sample may be missing"
        )
    return step
