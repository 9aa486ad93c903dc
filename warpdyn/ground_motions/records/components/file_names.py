"""Record and component from the name of a file."""

from __future__ import annotations

import re

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
