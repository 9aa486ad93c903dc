"""Components of a record: their names, and the pairs that two horizontal ones make."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from warpdyn.ground_motions.motions import GroundMotion, checked_motions
from warpdyn.ground_motions.records.components.orientations import is_vertical, orientation

# Which components are read, by their names.
COMPONENTS: dict[str, Callable[[str], bool]] = {
    "horizontal": lambda component: not is_vertical(component),
    "vertical": is_vertical,
    "all": lambda component: True,
}


def pairs(motions: Sequence[GroundMotion]) -> list[tuple[GroundMotion, GroundMotion]]:
    """Return the two horizontal components of each record, for runs in both directions.

    Args:
        motions: The motions, which name their `record` and `component`; vertical ones are left out.

    Returns:
        A pair for each record, in the order in which the records first appear.

    Raises:
        ValueError: If a motion names no record, a record has one horizontal component or more than two, or the azimuths
            of a pair, where its components are named by them, are not 90 degrees apart.
        TypeError: If a motion is no GroundMotion.

    Example:
        >>> told = dict(step=0.02, record="quake")
        >>> components = [wd.GroundMotion(noise[i], **told, component="NE"[i]) for i in (0, 1)]
        >>> [[motion.component for motion in pair] for pair in wd.records.pairs(components)]
        [['N', 'E']]
    """
    by_record: dict[str, list[GroundMotion]] = {}
    for motion in checked_motions(motions):
        if not motion.record:
            raise ValueError(f"motion {motion.name!r} names no record: give GroundMotion(record=..., component=...)")
        if not is_vertical(motion.component):
            by_record.setdefault(motion.record, []).append(motion)
    for record, members in by_record.items():
        names = ", ".join(repr(motion.name) for motion in members)
        if len(members) != 2:
            raise ValueError(f"record {record!r} must have 2 horizontal components, has {len(members)}: {names}")
        first, second = (motion.component for motion in members)
        if first.isdigit() and second.isdigit() and (int(first) - int(second)) % 180 != 90:
            raise ValueError(f"record {record!r}: the components {names} are not 90 degrees apart")
    return [(first, second) for first, second in by_record.values()]
