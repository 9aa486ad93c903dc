"""Find the component and the record in header lines of files."""

from __future__ import annotations

import re

from warpdyn.model.ground_motions.records.components.orientations import Orientation, orientation

# Such as "COMP S00E", "Component S16W  Longitudinal", "component=   up", "Chan  1: 90 Deg", "CHANNEL 2, N-S".
_NAMED = re.compile(
    r"\b(?:COMP(?:ONENTE?)?|CMP|CHAN(?:NEL)?\s*\d+|DIR(?:ECTION)?|ORIENTATION|AZIMUTH)\b\s*[.:=,]*\s*(?P<label>[^\s,;:=].*)$",
    re.IGNORECASE,
)
_REMARK = re.compile(r"\([^()]*\)|\[[^\[\]]*\]")
_NUMBER_OF = re.compile(r"(?:STATION|STA|STN|SITE|NO|NUMBER|NR|EVENT|RECORD|ARRAY|CHAN|CHANNEL)\W*$|#$", re.IGNORECASE)
_MOST_WORDS = 3  # largest number of words in a label, such as "N 26 W"


def component_of_header(line: str) -> str:
    """Return the label of the component in a header line such as "Kobe, 1/16/1995, KJMA, 000"; "" without a label.

    The label follows "COMP", "CHAN 1:" or "Dir.", or is the last field between commas, or is the last word.
    """
    if label := named_component(line):
        return label
    fields = [field.strip() for field in re.split(r"[,;|]", line)]
    if len(fields) > 1:
        for i, field in enumerate(reversed(fields[1:])):
            found = _whole(field)
            # In earlier fields, a short number or a single letter may have another meaning.
            if found and (i == 0 or (found.family != "azimuth" and len(found.label) > 1)):
                return found.label
    return _at_end(fields[-1])


def named_component(line: str) -> str:
    """Return the label that follows "COMP", "CHAN 1:" or "Dir." in a header line; "" if there is no such label."""
    named = _NAMED.search(line)
    return _at_start(named["label"]) if named else ""


def record_of_header(line: str) -> str:
    """Return a header line without its component, such as "Kobe, 1/16/1995, KJMA"; "" if it has no component."""
    if not component_of_header(line):
        return ""
    named = _NAMED.search(line)
    before = line[: named.start()] if named else line.rpartition(",")[0] or line.rpartition(" ")[0]
    return " ".join(before.split()).strip(" ,;:-")


def _whole(field: str) -> Orientation | None:
    """Return the direction if a whole field (apart from remarks in brackets) is a label; otherwise None."""
    for text in (field, _REMARK.sub(" ", field)):
        found = orientation(text)
        if found.kind != "unknown" or found.family == "seed":
            return found
    return None


def _at_start(text: str) -> str:
    words = text.split()
    for count in range(min(_MOST_WORDS, len(words)), 0, -1):
        if found := _whole(" ".join(words[:count]).rstrip(",;:")):
            return found.label
    return ""


def _at_end(text: str) -> str:
    """Return the label at the end of a text; "" without a label. Single letters and short numbers are not labels."""
    words = _REMARK.sub(" ", text).split()
    for count in range(min(_MOST_WORDS, len(words) - 1), 0, -1):
        label = " ".join(words[-count:])
        found = orientation(label)
        is_short = len(re.sub(r"\W", "", label)) < (3 if found.family == "azimuth" else 2)
        is_number = found.family == "azimuth" and _NUMBER_OF.search(words[-count - 1])
        if found.kind != "unknown" and not is_short and not is_number:
            return found.label
    return ""
