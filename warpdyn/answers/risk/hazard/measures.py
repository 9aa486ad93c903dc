"""Units of the intensities of hazard curves."""

from __future__ import annotations

from warpdyn.foundations.core.checks import checked_text
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.measures.names import measure_named

# Units that are converted: the unit in which a hazard curve is stored, and the factor to this unit.
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


def units_of_hazard(measure: str, units: str | None) -> tuple[str, float]:
    """Return the units in which a hazard curve stores its intensities, and the factor to these units.

    Args:
        measure: Name of the intensity measure.
        units: Units in which the intensities are given; None: g, which is allowed only for accelerations.

    Raises:
        ValueError: If the measure cannot have these units, or `units` is missing and the measure is not an
            acceleration.
    """
    found = measure_named(measure)
    allowed = tuple(dict.fromkeys((found.level_units, found.units))) if found else ()
    if units is None:
        if allowed and "g" not in allowed:
            raise ValueError(
                f"a hazard curve of {measure!r} is not in g, the default unit of intensities: give units={allowed[0]!r}"
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
