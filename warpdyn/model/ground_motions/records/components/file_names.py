"""Find the record and the component in the names of files.

A file name may contain the component after a separator ("ELC-UP", "STA.HNZ"), directly after the code of a station
("ELC180", "05C00EW", "CHY074V"), in the middle ("IV.ACER..HNE.D.20161030.ACC") or as the suffix
("AKT0131103111446.EW2"). Each part that may be a label is a candidate. Candidates are ranked by three criteria: how
distinctive the label is, its position, and whether other files of the folder have the same name except for a label of
another direction.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import PurePath

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.ground_motions.records.components.orientations import Orientation, angle_between, orientation

_PEER_NUMBER = re.compile(r"(?:NGA[A-Z]*)?RSN_?\d+", re.IGNORECASE)
_PACKED = re.compile(r"\.(?:gz|bz2|xz|zip)$", re.IGNORECASE)
_SUFFIX = re.compile(r"\.(?P<suffix>[A-Za-z][A-Za-z0-9]{0,5})$")
_TOKEN = re.compile(r"[^\s\-_.,;()\[\]{}+#=~]+")
# Words that programs add after the component, such as "acc" in "ELC180_acc" or "hor1" in "ELC180-hor1".
_PROCESSING = re.compile(
    r"ACC\w{0,10}|RAWACC|A|AT2?|VT2|DT2|C|COR\w*|UNCOR\w*|UNC|RAW|PROC\w*|FILT\w*|BP|BPF|SCALED?|FINAL|ORIG\w*|TH|TS|TXT|"
    r"DAT|CSV|COMP|COMPONENT|DIR|G|GAL|CMS2|MS2|SEC|DT\w*|COPY|NEW|HOR\d?|BASELINE|BLC|DETREND\w*|RESAMPLED?|\d+|--",
    re.IGNORECASE,
)
# Kinds of component that programs add after PEER's file names, such as "-hor1" in "ELC180-hor1", "-up" in "PULDWN-up".
_ADDED_KIND = re.compile(r"[-_](?:HOR\d?|UP|VER)", re.IGNORECASE)
_NAMES_NET_STATION = re.compile(
    r"(?P<net>[A-Z0-9]{1,2})\.(?P<station>[A-Z0-9]{1,7})\.(?P<location>[A-Z0-9-]{0,2})\.$", re.I
)
_GLUED_AZIMUTH = re.compile(r"(?P<code>.*[A-Za-z].*?|[A-Za-z])(?P<label>\d{3})$")
_GLUED_WORD = re.compile(
    r"(?P<code>.+?)(?P<label>(?:EW|WE|NS|UD)[12]?|UP|DN|DWN|DOWN|VER|VERT|VRT|LONG|TRAN|[NS]\d{2}[EW]|[EHB][HNL][ENZ12])$",
    re.IGNORECASE,
)
_GLUED_LETTER = re.compile(r"(?P<code>.+)(?P<label>[NSEWVZULTXY]|[LTV][1-9])$", re.IGNORECASE)
_YEAR_OR_DATE = re.compile(r"(?:19|20)\d\d(?:\d\d){0,5}$|\d{7,}$")
# How distinctive a label is: surely a component, usually, possibly, or only if other files have matching labels.
_SURE, _USUAL, _POSSIBLE, _ONLY_IN_SETS = 3, 2, 1, 0


@dataclass(frozen=True)
class _Candidate:
    """A part of a file name that may be the label of a component."""

    orientation: Orientation
    before: str
    after: str
    distinctive: int
    is_last: bool  # whether no other text follows, except words that programs add

    @property
    def key(self) -> tuple[str, str]:
        return self.before.rstrip(" -_.~").upper(), self.after.strip(" -_.~").upper()

    @property
    def ending(self) -> tuple[str, str]:
        return self.orientation.label, self.after

    @property
    def record(self) -> str:
        after = self.after.strip(" -_.~") if not _is_added(self.after) else ""
        return f"{self.before.rstrip(' -_.~')} {after}".strip()


def record_and_component(name: str, header: str = "", among: Iterable[str] = (), place: str = "") -> tuple[str, str]:
    """Return the record and the component of a file; each is "" if neither the header nor the file name contains it.

    For example, `record_and_component("RSN6_IMPVALL.I_I-ELC180")` is `("RSN6", "180")`; the record is PEER's number
    alone, because it is unique.

    Args:
        name: Name of the file, with or without folder and suffix, such as "RSN6_IMPVALL.I_I-ELC180.AT2".
        header: Label of the component in the file's header; "" if the header has no label. The label in the header is
            preferred. The label in the file name is used if the label in the header is not a direction, or if the file
            name clearly marks a vertical component.
        among: Names of other files of the same set. Parts of the name that vary within the set may be labels.
        place: Name of the file, for a warning if header and name contradict each other; "": no warning.
    """
    return records_and_components([name, *among], [header], [place])[0]


def records_and_components(
    names: Sequence[str], headers: Sequence[str] = (), places: Sequence[str] = ()
) -> list[tuple[str, str]]:
    """Return the record and the component of each file of a set, as `record_and_component` does.

    Args:
        names: Names of the files.
        headers: Labels of components in the headers of the files; the list may be shorter than `names`.
        places: Paths of the files, for warnings; the list may be shorter than `names`.
    """
    stems = [_stem(name) for name in names]
    found = [list(_candidates(stem)) for stem in stems]
    directions: defaultdict[tuple[str, str], set[Orientation]] = defaultdict(set)
    for candidates in found:
        for candidate in candidates:
            directions[candidate.key].add(candidate.orientation)
    # An ending that all names have, such as ".T1", is not the label of a component.
    endings = [{each.ending for each in candidates} for candidates in found]
    common = set.intersection(*endings) if len(endings) > 1 else set()
    answers = []
    for i, (stem, header, place) in enumerate(zip_longest(stems, headers, places, fillvalue="")):
        in_header = orientation(header)
        best, is_sure = _best(stem, found[i], directions, in_header, common)
        label = _settled(in_header, best.orientation if best else orientation(""), is_sure, place)
        number = _PEER_NUMBER.match(stem)
        record = number[0].upper() if number else best.record if best and label else ""
        answers.append((record, label))
    return answers


def _settled(header: Orientation, name: Orientation, is_sure: bool, place: str) -> str:
    """Return the label in the header, or the label in the file name if the header has none or the name is vertical.

    Args:
        header: Direction in the header.
        name: Direction in the file name.
        is_sure: Whether the label in the file name is clear enough to contradict the header.
        place: Name of the file for a warning if both contradict each other; "": no warning.
    """
    if header.kind == "unknown":
        return name.label or (header.label if header.family else "")
    if name.kind == "unknown" or not is_sure:
        return header.label
    is_turned = False
    if header.azimuth is not None and name.azimuth is not None:
        is_turned = angle_between(header.azimuth, name.azimuth) > 45.0
    used = name.label if name.kind == "vertical" != header.kind else header.label
    if (header.kind != name.kind or is_turned) and place:
        warn_caller(
            f"{place}: the component is {header.label!r} in the header and {name.label!r} in the file's name; "
            f"{used!r} is used. Compare the file with its source, and rename it"
        )
    return used


def numbered_record(name: str) -> str:
    """Return a file name without suffix and without the number or letter of the component: "0111" for "0111b.smc".

    The result is "" if the name itself is a label of a component.
    """
    stem = _stem(name)
    return "" if orientation(stem).family else re.sub(r"[-_. ]?(?:0?[1-9]|[a-c])$", "", stem, flags=re.IGNORECASE)


def _stem(name: str) -> str:
    """Return a file name without folder and suffix; a suffix that is a component, such as ".EW" of K-NET, is kept."""
    stem = _PACKED.sub("", PurePath(name).name)
    suffix = _SUFFIX.search(stem)
    if suffix is None or len(suffix[0]) == len(stem):
        return stem
    is_label = orientation(suffix["suffix"]).kind != "unknown" and not re.fullmatch(r"V[1-4]", suffix["suffix"], re.I)
    return stem if is_label else stem[: suffix.start()]


def _candidates(stem: str) -> Iterator[_Candidate]:
    tokens = list(_TOKEN.finditer(stem))
    for i, token in enumerate(tokens):
        # Some labels consist of two tokens, such as "N-S" and "FAULT_NORMAL".
        for last in (i + 1, i):
            if last < len(tokens):
                before, label, after = (
                    stem[: token.start()],
                    stem[token.start() : tokens[last].end()],
                    stem[tokens[last].end() :],
                )
                distinctive = _of_whole(label, before, last - i)
                is_volume = re.fullmatch(r"V[1-4]", label, re.IGNORECASE) and not before.endswith("-")
                if (distinctive == _POSSIBLE and label == stem) or is_volume:
                    distinctive = _ONLY_IN_SETS  # such as "x" in "x.csv", or "V2" (volume 2) in "90_V2"
                if distinctive is not None:
                    yield _Candidate(orientation(label), before, after, distinctive, _is_added(after))
        before, after = stem[: token.start()], stem[token.end() :]
        for label, distinctive in _glued(token[0], stem):
            code = token[0][: -len(label)]
            yield _Candidate(orientation(label), before + code, after, distinctive, _is_added(after))
    yield from _letters_within(stem)


def _letters_within(stem: str) -> Iterator[_Candidate]:
    """Yield candidates: single letters next to a digit, such as x, y and z in "000055xa", "000055ya", "000055za"."""
    for found in re.finditer(r"(?<=\d)[NSEWVZULTXY](?=[A-Z])|(?<=[A-Z])[NSEWVZULTXY](?=\d)", stem, re.IGNORECASE):
        before, after = stem[: found.start()], stem[found.end() :]
        yield _Candidate(orientation(found[0]), before, after, _ONLY_IN_SETS, False)


def _is_added(after: str) -> bool:
    """Return whether a text after a label consists only of words that programs add to file names, such as "acc"."""
    return all(_PROCESSING.fullmatch(token[0]) for token in _TOKEN.finditer(after))


def _of_whole(label: str, before: str, separators: int) -> int | None:
    """Return how distinctive a label between separators is, from _ONLY_IN_SETS to _SURE; None if it is not a label.

    Args:
        label: The text that may be a label.
        before: The part of the file name before it.
        separators: Number of separators within the label, 0 or 1.
    """
    found = orientation(label)
    if found.kind == "unknown" and found.family != "seed":
        return None
    letters = re.sub(r"[^A-Z]", "", found.label)
    if separators:
        is_axis = found.family in ("compass axes", "numbered") or found.label in ("UD", "UPDOWN") or len(letters) >= 8
        return _SURE if is_axis else None
    if found.family == "azimuth":
        digits = re.sub(r"\D", "", label)
        if letters or not label.isdigit():
            return _SURE  # such as "N26W" and "90deg"
        return _USUAL if len(digits) == 3 else _ONLY_IN_SETS
    if found.family == "seed":
        return _SURE if _NAMES_NET_STATION.search(before) else _USUAL
    if len(letters) == 1 or found.label in ("SN", "SP", "H"):
        return _POSSIBLE
    return _SURE


def _glued(token: str, stem: str) -> Iterator[tuple[str, int]]:
    """Yield labels that follow the code of a station without separator, each with a measure of its distinctiveness.

    Args:
        token: The part of the file name, between separators, that may end with a label.
        stem: The file name without suffix.
    """
    if (found := _GLUED_AZIMUTH.match(token)) and int(found["label"]) <= 360:
        # "E06140" in "H-E06140" is a station (E06) and an azimuth (140); longer numbers are dates.
        digits = len(token) - len(token.rstrip("0123456789"))
        if digits <= 6:
            yield found["label"], _USUAL if digits == 3 or _PEER_NUMBER.match(stem) else _POSSIBLE
    elif re.fullmatch(r"\d{4,}", token) and int(token[-3:]) <= 360:
        if _PEER_NUMBER.match(stem):
            yield token[-3:], _USUAL
        elif not _YEAR_OR_DATE.match(token):
            yield token[-3:], _ONLY_IN_SETS
    if found := _GLUED_WORD.match(token):
        behind_digit = found["code"][-1].isdigit()
        # Many names of places end with "VER" or "UP", but hardly any with "DWN".
        is_known = found["label"] == "DWN" or found["label"][1].isdigit() or bool(_PEER_NUMBER.match(stem))
        yield found["label"], _USUAL if behind_digit else _POSSIBLE if is_known else _ONLY_IN_SETS
    if found := _GLUED_LETTER.match(token):
        behind_digit = found["code"][-1].isdigit() and found["label"].isupper() and len(found["code"]) > 2
        yield found["label"], _POSSIBLE if behind_digit else _ONLY_IN_SETS


def _best(
    stem: str,
    candidates: Sequence[_Candidate],
    directions: dict[tuple[str, str], set[Orientation]],
    header: Orientation,
    common: set[tuple[str, str]],
) -> tuple[_Candidate | None, bool]:
    """Return the most likely candidate for the label of a component, and whether it may contradict the header.

    Args:
        stem: The file name without suffix.
        candidates: Parts of the file name that may be labels.
        directions: Rest of a file name (without a label) -> directions of the labels that files of the set have there.
        header: Direction in the header.
        common: Labels with the text after them that all file names of the set have.

    Returns:
        The candidate, or None if no part can be a label; and whether it is clear enough to contradict the header.
    """
    ranked: list[tuple[tuple[float, ...], _Candidate, bool]] = []
    for i, candidate in enumerate(candidates):
        present = directions[candidate.key]
        others = {each for each in present if _is_other_direction(each, candidate.orientation)}
        kinds = {each.kind for each in others} | {candidate.orientation.kind}
        is_triple = len(others) >= 2 and "vertical" in kinds
        # A pair, such as "219_90" and "219_360", but not records that are numbered from 1 to 100.
        is_pair = candidate.orientation.family == "azimuth" and bool(others) and len(present) <= 3
        is_text_of_header = candidate.orientation.label == header.label
        agrees = is_text_of_header or (
            candidate.distinctive > _ONLY_IN_SETS and _is_same_direction(header, candidate.orientation)
        )
        is_needed = candidate.distinctive == _ONLY_IN_SETS or (not candidate.is_last and candidate.distinctive < _SURE)
        if is_needed and not (is_triple or is_pair or (others and candidate.distinctive) or agrees):
            continue
        is_bare = candidate.orientation.family == "azimuth" and not others and not _PEER_NUMBER.match(stem)
        if is_bare and len(present) > 1:
            continue  # such numbers identify stations, as in TCU045 and TCU052
        is_common = candidate.ending in common and not others
        place = 3 * candidate.is_last - 4 * is_common
        rank = (3 * agrees + 3 * min(len(others), 2) + candidate.distinctive + place, float(i))
        ranked.append((rank, candidate, bool(others) or candidate.distinctive >= _USUAL))
    if not ranked:
        return None, False
    _, best, is_sure = max(ranked, key=lambda each: each[0])
    added = stem[len(best.before.rstrip("-_")) :]
    if _ADDED_KIND.fullmatch(added):
        for each in candidates:
            is_same = each.orientation.kind == best.orientation.kind and each.after == added
            if is_same and each.distinctive > _ONLY_IN_SETS:
                return each, is_sure
    return best, is_sure


def _is_same_direction(one: Orientation, other: Orientation) -> bool:
    """Return whether two labels describe the same direction, with azimuths at most 15 degrees apart."""
    if one.kind != other.kind or one.kind == "unknown":
        return False
    if one.azimuth is not None and other.azimuth is not None:
        return angle_between(one.azimuth, other.azimuth) <= 15.0
    return one.kind == "vertical" or one.label == other.label


def _is_other_direction(one: Orientation, other: Orientation) -> bool:
    """Return whether two labels may be different directions of one sensor: perpendicular, or axes of one system."""
    if one.sensor != other.sensor:
        return False
    if one.kind == other.kind == "vertical" or "unknown" in (one.kind, other.kind):
        return "unknown" in (one.kind, other.kind) and one.label != other.label
    if one.kind != other.kind:
        return True
    if one.azimuth is not None and other.azimuth is not None:
        return abs(angle_between(one.azimuth, other.azimuth) - 90.0) <= 15.0
    return one.family == other.family and one.label != other.label
