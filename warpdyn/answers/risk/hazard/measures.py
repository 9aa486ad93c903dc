"""Names of intensity measures in the notations of OpenQuake, the USGS and warpdyn."""

from __future__ import annotations

import re
from dataclasses import dataclass

from warpdyn.foundations.core.checks import checked_text
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.foundations.core.output_variables import UNNAMED
from warpdyn.foundations.core.units import STANDARD_GRAVITY

SAME_PERIOD = 0.01  # relative; periods of spectral accelerations have two or three digits in names
# OpenQuake's names (openquake.hazardlib.imt) of measures without a period, by the names that are read.
KINDS = {
    "PGA": "PGA",
    "PGV": "PGV",
    "PGD": "PGD",
    "IA": "IA",
    "Arias intensity": "IA",
    "CAV": "CAV",
    "D5-95": "RSD595",
    "RSD595": "RSD595",
    "D5-75": "RSD575",
    "RSD575": "RSD575",
    "D20-80": "RSD2080",
    "RSD2080": "RSD2080",
}
UNDERSTOOD = (
    "PGA, PGV, PGD, IA or 'Arias intensity', CAV, D5-95, D5-75, D20-80, SA(0.75) or 'Sa(0.75 s, 5 %)', SA0P75 and "
    "AvgSA, each also as 'geometric mean of ...' or 'RotD50 ...'"
)

# Allowed units of a hazard curve, by OpenQuake's name of the measure; messages recommend the first one.
UNITS = {
    **dict.fromkeys(("PGA", "SA", "AvgSA"), ("g", "m s-2")),
    **dict.fromkeys(("PGV", "IA", "CAV"), ("m s-1",)),
    "PGD": ("m",),
    **dict.fromkeys(("RSD595", "RSD575", "RSD2080"), ("s",)),
}
# Units that are read, with the unit that intensities are converted to and the factor.
_READ_AS = {
    **dict.fromkeys(("m s-1", "m s^-1", "m/s", "m/sec"), ("m s-1", 1.0)),
    **dict.fromkeys(("cm s-1", "cm s^-1", "cm/s", "cm/sec"), ("m s-1", 0.01)),
    **dict.fromkeys(("mm s-1", "mm/s"), ("m s-1", 0.001)),
    **dict.fromkeys(("m s-2", "m s^-2", "m/s2", "m/s^2", "m/s**2"), ("m s-2", 1.0)),
    **dict.fromkeys(("cm s-2", "cm s^-2", "cm/s2", "cm/s^2", "gal", "Gal"), ("m s-2", 0.01)),
    "cm": ("m", 0.01),
    "mm": ("m", 0.001),
    **dict.fromkeys(("g s", "g.s", "g*s"), ("m s-1", STANDARD_GRAVITY)),
}
_KEPT = ("g", "m s-2", "m s-1", "m", "s")

_NUMBER = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_COMPONENTS = re.compile(r"(geometric mean|RotD\d+)(?: of)? +", re.IGNORECASE)
_AVERAGE = re.compile(
    rf"(?:AvgSA|Sa_avg)(?:\((?:(?P<low>{_NUMBER})(?: *s)? to (?P<high>{_NUMBER}) *s)?.*?"
    rf"(?:, *(?P<damping>{_NUMBER}) *%)?\))?",
    re.IGNORECASE,
)
_SPECTRAL = re.compile(rf"SA\((?P<period>{_NUMBER})\s*s?(?:,\s*(?P<damping>{_NUMBER})\s*%?)?\)", re.IGNORECASE)
_USGS_PERIOD = re.compile(r"SA(\d+)P(\d+)")
_BY_LOWER_CASE = {name.casefold(): kind for name, kind in KINDS.items()}


@dataclass(frozen=True)
class Measure:
    """An intensity measure.

    Args:
        kind: OpenQuake's name without the period, such as "PGA", "SA" or "AvgSA".
        period: Period of a spectral acceleration [s]; 0 for other measures.
        damping: Its damping ratio [%]; 5 if the name has none, 0 for measures without damping.
        components: How two components are combined, "geometric mean" or for example "RotD50"; "" if unknown.
        span: Least and largest period of an average [s]; () for other measures, and if the name has none.
    """

    kind: str
    period: float = 0.0
    damping: float = 0.0
    components: str = ""
    span: tuple[float, ...] = ()


def measure_named(name: str) -> Measure | None:
    """Return the measure of a name such as "SA(0.3)", "SA0P3" or "Sa(0.3 s, 5 %)"; None if it is not understood."""
    text, components = spectral_name(name.strip()), ""
    of_components = _COMPONENTS.match(text)
    if of_components:
        text, components = text[of_components.end() :], of_components[1]
    if text.casefold() in _BY_LOWER_CASE:
        return Measure(_BY_LOWER_CASE[text.casefold()], components=components)
    average, spectral = _AVERAGE.fullmatch(text), _SPECTRAL.fullmatch(text)
    if average:
        span = tuple(float(average[end]) for end in ("low", "high") if average[end])
        return Measure("AvgSA", 0.0, float(average["damping"] or 5), components, span)
    if spectral and float(spectral["period"]) > 0:
        return Measure("SA", float(spectral["period"]), float(spectral["damping"] or 5), components)
    return None


def units_of_hazard(measure: str, units: str | None) -> tuple[str, float]:
    """Return the units to which the intensities of a hazard curve are converted, and the factor.

    Args:
        measure: Name of the intensity measure.
        units: Given units; None is g, which only accelerations may omit.

    Raises:
        ValueError: If the measure does not have these units, or units are missing and it is not an acceleration.
    """
    found = measure_named(measure)
    allowed = UNITS[found.kind] if found else ()
    if units is None:
        if allowed and "g" not in allowed:
            raise ValueError(
                f"a hazard curve of {measure!r} is not in g, the unit of intensities without units=: give "
                f"units={allowed[0]!r}"
            )
        return "g", 1.0
    words = " ".join(checked_text("units", units).split())
    kept, factor = _READ_AS.get(words, (words, 1.0))
    if allowed and kept not in allowed:
        read = [name for name, (unit, _) in _READ_AS.items() if unit in allowed and name not in allowed]
        raise ValueError(
            f"the units of a hazard curve of {measure!r} are {' or '.join(map(repr, allowed))}, got {units!r}"
            + (f"; {', '.join(map(repr, read))} are converted" if read else "")
        )
    if kept not in _KEPT:
        hint = did_you_mean(words, [*_KEPT, *_READ_AS])
        raise ValueError(f"unknown units {units!r} of a hazard curve{hint}; allowed: {', '.join(map(repr, _KEPT))}")
    return kept, factor


def spectral_name(name: str) -> str:
    """Return "SA(0.2)" for the USGS's "SA0P2", and other names unchanged."""
    found = _USGS_PERIOD.fullmatch(name)
    return f"SA({float(f'{found[1]}.{found[2]}'):g})" if found else name


def same_measure(one: str, other: str) -> bool | None:
    """Return whether two names mean one intensity measure, or None if they differ and one is not understood.

    The combination of two components is not compared, because names of hazards do not contain it.

    Args:
        one: A name; "" if it is unknown.
        other: The other name.
    """
    if one.strip() == other.strip():
        return True
    first, second = measure_named(one), measure_named(other)
    if first is None or second is None:
        return None
    if first.kind != second.kind:
        return False
    pairs = [(first.period, second.period), (first.damping, second.damping)]
    if first.span and second.span:
        pairs += zip(first.span, second.span, strict=True)
    return all(abs(a - b) <= SAME_PERIOD * max(a, b) for a, b in pairs)


def warn_unless_compared(what: str, one: str, other: str) -> None:
    """Warn if two names of measures cannot be compared because one of them is not understood.

    Args:
        what: The things that have these measures, such as "annual_rates: the hazard and the curves".
        one: A name; there is no warning if it names no measure.
        other: The other name.
    """
    if one in UNNAMED or other in UNNAMED or same_measure(one, other) is not None:
        return
    unknown = " and ".join(repr(name) for name in (one, other) if measure_named(name) is None)
    warn_caller(
        f"{what} are of {one!r} and {other!r}, which are not compared, because {unknown} is not understood; understood "
        f"are {UNDERSTOOD}. Give such a name, or measure='' if both have the same measure"
    )
