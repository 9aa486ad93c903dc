"""Names of intensity measures in the notations of OpenQuake, the USGS and warpdyn."""

from __future__ import annotations

import re
from collections.abc import Sequence

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.output_variables import UNNAMED
from warpdyn.model.ground_motions.measures.measure import ACCELERATION, IntensityMeasure
from warpdyn.model.ground_motions.measures.one_component import (
    AriasIntensity,
    CumulativeAbsoluteVelocity,
    PeakGroundAcceleration,
    PeakGroundDisplacement,
    PeakGroundVelocity,
    SignificantDuration,
    SpectralAcceleration,
)
from warpdyn.model.ground_motions.measures.pairs import GeometricMean, LargerComponent, RotatedSpectralAcceleration
from warpdyn.model.ground_motions.motions import GroundMotion

UNDERSTOOD = (
    "PGA, PGV, PGD, IA or 'Arias intensity', CAV, D5-95, D5-75, D20-80, SA(0.75) or 'Sa(0.75 s, 5 %)', SA0P75 and "
    "AvgSA, each also as 'geometric mean of ...', 'larger component of ...' or 'RotD50 ...'"
)
_WITHOUT_PERIOD: tuple[IntensityMeasure, ...] = (
    PeakGroundAcceleration(),
    PeakGroundVelocity(),
    PeakGroundDisplacement(),
    AriasIntensity(),
    CumulativeAbsoluteVelocity(),
    SignificantDuration(0.05, 0.95),
    SignificantDuration(0.05, 0.75),
    SignificantDuration(0.2, 0.8),
)
_BY_NAME = {name.casefold(): measure for measure in _WITHOUT_PERIOD for name in (measure.name, measure.kind)}

_NUMBER = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_COMPONENTS = re.compile(
    r"(?P<mean>geometric mean)(?: of)? +|(?P<larger>larger component)(?: of)? +|RotD(?P<percentile>\d+)(?: of)? +",
    re.IGNORECASE,
)
_AVERAGE = re.compile(
    rf"(?:AvgSA|Sa_avg)(?:\((?:(?P<low>{_NUMBER})(?: *s)? to (?P<high>{_NUMBER}) *s)?.*?"
    rf"(?:, *(?P<damping>{_NUMBER}) *%)?\))?",
    re.IGNORECASE,
)
_SPECTRAL = re.compile(
    rf"SA\((?:T *= *)?(?P<period>{_NUMBER})\s*s?(?:,\s*(?P<damping>{_NUMBER})\s*%?)?\)", re.IGNORECASE
)
_USGS_PERIOD = re.compile(r"SA(\d+)P(\d+)")


class NamedMeasure(IntensityMeasure):
    """A measure that is known only by its name, such as an average over periods that are not in the name.

    Args:
        name: The name.
        units: SI units of the values, a UDUNITS string.
        kind: OpenQuake's name of the measure.
        components: Combination of two components; "" for a single component.
        parameters: Damping ratio [%] and periods [s], if the name contains them.
    """

    name, kind, components, units = "", "", "", ""
    parameters: tuple[float, ...] = ()

    def __init__(
        self, name: str, units: str, kind: str, components: str = "", parameters: Sequence[float] = ()
    ) -> None:
        vars(self).update(name=name, units=units, kind=kind, components=components, parameters=tuple(parameters))

    def value(self, motion: GroundMotion) -> float:
        """Raise a ValueError: the name alone does not define how the value of a motion is computed."""
        raise ValueError(f"warpdyn cannot compute {self.name!r}: give a measure such as wd.SpectralAcceleration(1.0)")


def measure_named(name: str) -> IntensityMeasure | None:
    """Return the intensity measure that has a given name; None if warpdyn does not know the name.

    Args:
        name: A name in the notation of OpenQuake, the USGS or warpdyn, such as "PGA", "SA(0.3)", "SA0P3" or
            "Sa(0.3 s, 5 %)". The damping ratio is 5 % if the name does not contain it.
    """
    text = spectral_name(name.strip())
    combined = _COMPONENTS.match(text)
    if not combined:
        return _of_one_component(text)
    measure = _of_one_component(text[combined.end() :])
    if measure is None:
        return None
    if combined["mean"] or combined["larger"]:
        return GeometricMean(measure) if combined["mean"] else LargerComponent(measure)
    percentile = int(combined["percentile"])
    if isinstance(measure, SpectralAcceleration) and percentile <= 100:
        return RotatedSpectralAcceleration(measure.period, measure.damping_ratio, percentile)
    return NamedMeasure(text, measure.units, measure.kind, f"RotD{percentile:02d}", measure.parameters)


def _of_one_component(text: str) -> IntensityMeasure | None:
    average, spectral = _AVERAGE.fullmatch(text), _SPECTRAL.fullmatch(text)
    if average:
        span = [float(average[end]) for end in ("low", "high") if average[end]]
        return NamedMeasure(text, ACCELERATION, "AvgSA", parameters=[float(average["damping"] or 5), *span])
    if not spectral:
        return _BY_NAME.get(text.casefold())
    try:
        return SpectralAcceleration(float(spectral["period"]), float(spectral["damping"] or 5) / 100)
    except ValueError:  # the name contains a period of 0 or a damping ratio of 100 %
        return None


def spectral_name(name: str) -> str:
    """Return the name with a spectral acceleration of the USGS, such as "SA0P2", converted to the form "SA(0.2)"."""
    found = _USGS_PERIOD.fullmatch(name)
    return f"SA({float(f'{found[1]}.{found[2]}'):g})" if found else name


def same_measure(one: str, other: str) -> bool | None:
    """Return whether two names denote the same intensity measure; None if warpdyn does not know one of the names.

    Args:
        one: The first name; "" if a dataset does not name the intensity measure.
        other: The second name.
    """
    if one.strip() == other.strip():
        return True
    first, second = measure_named(one), measure_named(other)
    return None if first is None or second is None else first.is_like(second)


def warn_unless_compared(what: str, one: str, other: str) -> None:
    """Warn if two names of measures cannot be compared, because warpdyn does not know one of them.

    Args:
        what: The objects with these names, such as "annual_rates: the hazard and the curves".
        one: The first name; "": missing. If a name is missing, there is no warning.
        other: The second name.
    """
    if one in UNNAMED or other in UNNAMED or same_measure(one, other) is not None:
        return
    unknown = " and ".join(repr(name) for name in (one, other) if measure_named(name) is None)
    warn_caller(
        f"{what} are of {one!r} and {other!r}, which cannot be compared, because warpdyn does not know the intensity "
        f"measure {unknown}. Give a name that it knows, or measure='' if both are the same measure. It knows "
        f"{UNDERSTOOD}"
    )
