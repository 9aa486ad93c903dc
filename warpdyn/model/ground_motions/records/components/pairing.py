"""Pairs of horizontal components that were recorded by the same instrument."""

from __future__ import annotations

from collections.abc import Sequence

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions
from warpdyn.model.ground_motions.records.components.orientations import Orientation, angle_between, orientation

# Azimuths in files are rounded to degrees, and sensors are installed within a few degrees of their nominal direction.
SKEW_WITHOUT_WARNING = 15.0  # degrees
LARGEST_SKEW = 45.0  # degrees


def pairs(motions: Sequence[GroundMotion]) -> list[tuple[GroundMotion, GroundMotion]]:
    """Return the pairs of horizontal components of each record, for runs with motions in both directions.

    If labels show that a record contains several sensors, each sensor has a pair: EW1 and NS1 in a borehole, EW2 and
    NS2 at the surface; HNE and HNN of an accelerometer, BHE and BHN of a seismometer at the same station. The azimuths
    of a pair need not be exactly 90 degrees apart.

    Args:
        motions: The motions, with `record` and `component`; vertical components are ignored.

    Returns:
        One pair per sensor of each record, in the order in which the sensors first appear.

    Raises:
        ValueError: If a motion has no `record`; if a sensor has one horizontal component or more than two; if both
            components have the same direction, or azimuths that are less than 45 degrees apart; or if a component is
            unknown although the record has a vertical component.
        TypeError: If a motion is not a GroundMotion.

    Example:
        >>> both = dict(step=0.02, record="quake")
        >>> components = [wd.GroundMotion(noise[i], **both, component="NE"[i]) for i in (0, 1)]
        >>> [[motion.component for motion in pair] for pair in wd.records.pairs(components)]
        [['N', 'E']]
    """
    found = [_checked_pair(record, members) for record, members in _by_record(motions)]
    return [pair for of_record in found for pair in of_record]


def instrument_of(motion: GroundMotion) -> tuple[str, str]:
    """Return the record of a motion and the part of its component label that identifies the sensor, such as "HN"."""
    return motion.record, orientation(motion.component).sensor


def _by_record(motions: Sequence[GroundMotion]) -> list[tuple[str, list[GroundMotion]]]:
    by_record: dict[str, list[GroundMotion]] = {}
    for motion in checked_motions(motions):
        if not motion.record:
            raise ValueError(f"motion {motion.name!r} has no record: give GroundMotion(record=..., component=...)")
        by_record.setdefault(motion.record, []).append(motion)
    return list(by_record.items())


def _checked_pair(record: str, members: Sequence[GroundMotion]) -> list[tuple[GroundMotion, GroundMotion]]:
    """Return the pairs of horizontal components of a record, one per sensor; raise a ValueError for other motions."""
    labels = {id(motion): orientation(motion.component) for motion in members}
    remaining = [motion for motion in members if labels[id(motion)].kind != "vertical"]
    unknown = [motion for motion in remaining if labels[id(motion)].kind == "unknown"]
    if unknown and len(remaining) < len(members):
        raise ValueError(
            f"record {record!r} has a vertical component, and the component {unknown[0].component!r} of motion "
            f"{unknown[0].name!r} may not be horizontal: give it a direction, such as dataclasses.replace(motion, "
            "component='N')"
        )
    sensors: dict[str, list[GroundMotion]] = {}
    for motion in remaining:
        sensors.setdefault(labels[id(motion)].sensor, []).append(motion)
    is_numbered_by_direction = all(len(each) == 1 for each in sensors.values()) and not any(
        labels[id(motion)].family == "seed" for motion in remaining
    )
    groups = [remaining] if is_numbered_by_direction and remaining else list(sensors.values())
    return [_pair_of(record, group, [labels[id(motion)] for motion in group]) for group in groups]


def _pair_of(
    record: str, members: Sequence[GroundMotion], labels: Sequence[Orientation]
) -> tuple[GroundMotion, GroundMotion]:
    names = ", ".join(repr(motion.name) for motion in members)
    if len(members) != 2:
        hint = (
            "; if several instruments recorded them, give each instrument its own `record`, such as "
            "dataclasses.replace(motion, record='station, 2nd instrument')"
            if len(members) > 2
            else "; add its other component, or remove the motion"
        )
        raise ValueError(f"record {record!r} must have 2 horizontal components, has {len(members)}: {names}{hint}")
    first, second = labels
    if first.azimuth is not None and second.azimuth is not None:
        skew = 90.0 - angle_between(first.azimuth, second.azimuth)
        if skew > LARGEST_SKEW:
            raise ValueError(
                f"record {record!r}: the components {names} are not 90 degrees apart: {first.label} and "
                f"{second.label}. Compare the labels with the source of the record"
            )
        if skew > SKEW_WITHOUT_WARNING:
            warn_caller(
                f"record {record!r}: the components {names} are {90 - skew:g} degrees apart, not 90 "
                f"({first.label} and {second.label}): compare the azimuths with the source of the record"
            )
    elif first.kind == "horizontal" and first.label == second.label:
        raise ValueError(
            f"record {record!r}: both components {names} have the direction {first.label!r}: "
            "correct the component of one, such as dataclasses.replace(motion, component='N')"
        )
    return members[0], members[1]
