"""Components of a record: their names, and the pairs that two horizontal ones make."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from warpdyn.ground_motions.motions import GroundMotion, checked_motions

VERTICAL = ("UP", "DN", "DOWN", "DWN", "VER", "VERT", "VRT", "V", "Z", "UD", "UD1", "UD2")
HORIZONTAL = ("N", "S", "E", "W", "NS", "EW", "NS1", "NS2", "EW1", "EW2", "L", "T", "H1", "H2", "X", "Y")
# A component stands at the end of a file's name, behind a separator, or is glued to the station's code: an azimuth of
# three digits or "DWN". Some tools add "-hor1" or "-up" to PEER's names.
_COMPONENT = re.compile(
    rf"[-_.]+(?P<apart>{'|'.join(sorted((*VERTICAL, *HORIZONTAL), key=len, reverse=True))}|\d{{3}}|[BEH][HLN][NEZ12])"
    r"(?:[-_](?:hor\d?|up|ver))?$|(?P<glued>\d{3}|DWN)(?:[-_](?:hor\d?|up|ver))?$",
    re.IGNORECASE,
)
_PEER_NUMBER = re.compile(r"RSN\d+", re.IGNORECASE)


def record_and_component(name: str) -> tuple[str, str]:
    """Return the record and the component that the name of a PEER file tells; both are empty where it tells none.

    Args:
        name: The name without suffix, such as "RSN6_IMPVALL.I_I-ELC180".

    Example:
        `record_and_component("RSN6_IMPVALL.I_I-ELC180")` is `("RSN6", "180")`: PEER's numbers are unique.
    """
    found = _COMPONENT.search(name)
    if not found or ((found["glued"] or found["apart"]).isdigit() and int(found["glued"] or found["apart"]) > 360):
        return "", ""
    number = _PEER_NUMBER.match(name)
    return number[0].upper() if number else name[: found.start()], (found["apart"] or found["glued"]).upper()


def is_vertical(component: str) -> bool:
    """Return whether a component, by its name, is a vertical one."""
    return component in VERTICAL or re.fullmatch(r"[BEH][HLN]Z", component) is not None


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
