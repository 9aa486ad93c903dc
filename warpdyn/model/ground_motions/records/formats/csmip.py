"""Reader of V1 and V2 files of CSMIP and CESMD, and of agencies that write similar files (BHRC, RENADIC, USC)."""

from __future__ import annotations

import re
from os import PathLike

import numpy as np

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.orientations import azimuth_label, orientation
from warpdyn.model.ground_motions.records.parsing.fixed_width import Layout, RecordText, block, layout_of_lines
from warpdyn.model.ground_motions.records.parsing.header_checks import (
    check_duration,
    check_printed_peak,
    check_time_of_peak,
    printed_precision,
    stated_count,
    stated_step,
)
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.parsing.uneven import at_equal_steps
from warpdyn.model.ground_motions.records.units import unit_factor

_CORRECTED = re.compile(r"\s*corrected\s+accelerogram\b", re.IGNORECASE)
_UNCORRECTED = re.compile(r"\s*(file\s+\d+\s+of\s+)?uncorrected\s+accelerogram\b", re.IGNORECASE)
_BHRC = re.compile(r"\*\s*VOL1DS\s+FILE\s*:\s*(?P<record>\S+)", re.IGNORECASE)  # files of Iran: g/10, without times
_TEXT_LINES, _REAL_LINES = {"V1": 13, "V2": 25}, {"V1": 7, "V2": 13}
_INTEGER_LINES = 7  # 100 whole numbers, 16 per line
_END = re.compile(r"\s*/&", re.IGNORECASE)
# Lines before the values: "13200 Accelerogram points at 200 pts/sec in units of g .  Format: (8f9.6)" and
# "3251 POINTS OF ACCEL DATA EQUALLY SPACED AT  .020 SEC.  (UNITS: CM/SEC/SEC)"
_DATA = re.compile(
    r"\s*(?P<count>\d+)\s+(?:points\s+of\s+)?(?P<quantity>acc|vel|dis)\w*(?:\s+points|\s+data\s+equally\s+spaced)\s+at\s+"
    r"(?P<time>\d*\.?\d+)\s*(?P<of_time>pts/sec|sec)[.,\s]*"
    r"(?:(?:in\s+units\s+of|\(units:|in\s+units|in)\s+(?P<unit>[a-z/0-9]+))?[\s.,)]*(?P<rest>.*)",
    re.IGNORECASE,
)
_COUNT = re.compile(r"no\.\s*of\s*points\s*=\s*(\d+)", re.IGNORECASE)
_DURATION = re.compile(r"(?:record\s+length|duration)\s*=\s*(\d*\.?\d+)\s*sec", re.IGNORECASE)
_UNIT_OF_PAIRS = re.compile(r"units\s.*\bsec\s+and\s+(?P<unit>g(?:/10)?|cm/sec/sec)(?=[\s.,]|$)", re.IGNORECASE)
_TIME = r"\s*,?\s*at\s+(?P<time>\d*\.\d+)\s*sec"
_PEAK = {
    "V1": re.compile(rf"max\s*=\s*(?P<peak>[-+]?\d*\.\d+)\s*(?P<unit>g){_TIME}", re.IGNORECASE),
    "V2": re.compile(
        rf"peak\s+acceleration\s*=\s*(?P<peak>[-+]?\d*\.\d+)\s+(?P<unit>cms?/sec/sec|g){_TIME}", re.IGNORECASE
    ),
}
_CHANNELS = re.compile(r"\((?P<count>\d+)\s*chns?\s+of\s", re.IGNORECASE)
_CHANNEL = re.compile(r"\s*(?:chan(?:nel)?\s*(?P<number>\d+)\s*:|comp)\s*(?P<label>.*)", re.IGNORECASE)
# Labels such as "360 DegR" are measured from the reference north of a building.
_LABEL = re.compile(r"\s*(?P<label>\d{1,3}(?=\s*degr?\b)|[NS]\s*\d{1,2}\s*[EW]\b|[A-Z]+\d?\b)", re.IGNORECASE)
_LOCATION = re.compile(r"location:\s*(?P<location>.*?)\s*$", re.IGNORECASE)
_STATION = re.compile(r"station\s*(?:no\.|id\.?|usc#)\s*(?P<code>\w[\w-]*)(?![.\w])", re.IGNORECASE)


def is_csmip(first_lines: list[str]) -> bool:
    """Return whether a file is a V1 or V2 file, judging by its first line."""
    return any(pattern.match(first_lines[0]) for pattern in (_CORRECTED, _UNCORRECTED, _BHRC))


def read_csmip(path: str | PathLike, step: float | None = None) -> list[GroundMotion]:
    """Return the accelerations in a V1 (uncorrected) or V2 (corrected) file, one motion per channel.

    Source: California Strong Motion Instrumentation Program, report OSMS 85-03, and its revisions.
    """
    record = RecordText.of(path)
    motions: list[GroundMotion] = []
    at = 0
    while at < len(record.lines):
        if not record.lines[at].strip():
            at += 1
            continue
        volume = "V2" if _CORRECTED.match(record.lines[at]) else "V1"
        if not is_csmip(record.lines[at:]):
            raise ValueError(
                f"{record.place(at)}: expected the header of the next channel, 'Uncorrected accelerogram' or "
                f"'Corrected accelerogram', got {record.lines[at].strip()[:60]!r}: lines are missing or were added "
                "above. Get another copy of the file, or correct it"
            )
        motion, at = _channel(record, at, volume, step)
        motions.append(motion)
    stated = _CHANNELS.search("\n".join(record.lines[:8]))
    if stated and 1 < len(motions) < int(stated["count"]):  # CESMD also writes one file per channel
        warn_caller(
            f"{path}: the header states {stated['count']} channels, the file contains {len(motions)}: it may be "
            "truncated. Compare it with a complete copy"
        )
    return motions


def _channel(record: RecordText, first: int, volume: str, wanted_step: float | None) -> tuple[GroundMotion, int]:
    """Return the acceleration of the channel that starts at line `first` [m/s2], and the index of the line after it.

    Args:
        record: Lines of the file.
        first: Index of the first line of the channel.
        volume: "V1" (uncorrected) or "V2" (corrected).
        wanted_step: Step [s] to which values at uneven times are interpolated; None: the user gave no step.
    """
    data = first + _TEXT_LINES[volume] + _INTEGER_LINES + _REAL_LINES[volume]
    record.line(data, "the values of the channel")
    head = record.lines[first : first + _TEXT_LINES[volume]]
    _check_numeric_header(record, first + len(head), data)
    if found := _DATA.match(record.lines[data]):
        if found["quantity"].lower() != "acc":
            raise ValueError(
                f"{record.place(data)}: the channel begins with {found['quantity'].lower()}..., not with its "
                "acceleration: take the file that contains the accelerations"
            )
        # Some files of USC name the unit only in the line of the peak.
        peak = _found(_PEAK["V2"], head, record, first)
        values, step, after = _equal_steps(record, data, found, peak[0]["unit"] if peak else None)
        while (other := _DATA.match(record.lines[after]) if after < len(record.lines) else None) is not None:
            if other["quantity"].lower() == "acc":
                raise damaged(f"{record.place(after)}: a second acceleration of the same channel: lines are missing")
            after = _equal_steps(record, after, other)[2]
        precision = 0.0 if found["of_time"].lower() == "pts/sec" else printed_precision(found["time"])
        _check_header(record, head, first, volume, values, step, precision)
    elif _BHRC.match(head[0]):
        values, step, after = _values_of_bhrc(record, head, first, data)
    else:
        times, values, after = _pairs_of_values(record, head, first, data)
        digits = printed_precision(record.lines[data].split()[0])
        _check_header(record, head, first, volume, values, float(times[-1]) / values.size, digits, is_pairs=True)
        values, step = at_equal_steps(times, values, wanted_step, record.path, digits)
    if after < len(record.lines) and _END.match(record.lines[after]):
        after += 1
    elif after < len(record.lines) and not is_csmip(record.lines[after:]):
        raise damaged(
            f"{record.place(after)}: expected the end of the channel, '/&', got {record.lines[after].strip()[:60]!r}: "
            "there are more values than the header states"
        )
    name, component = _names(head)
    return record.motion(values, step, component, name), after


def _check_numeric_header(record: RecordText, first: int, data: int) -> None:
    """Raise a ValueError if a line between text header and values is not numeric: a line was lost or added."""
    for i in range(first, data):
        if re.search(r"[^-+\d.\sEe*]", record.lines[i]) or not record.lines[i].strip():
            raise damaged(f"{record.place(i)}: expected numbers of the header, got {record.lines[i].strip()[:60]!r}")
    if re.search(r"\.", record.lines[first]) or not re.search(r"\.", record.lines[first + _INTEGER_LINES]):
        raise damaged(f"{record.place(first)}: expected 7 lines of whole numbers, then lines of decimal numbers")


def _equal_steps(
    record: RecordText, at: int, found: re.Match[str], unit: str | None = None
) -> tuple[np.ndarray, float, int]:
    """Return accelerations at equal steps [m/s2], the step [s], and the index of the line after the values.

    Args:
        record: Lines of the file.
        at: Index of the line that states number, step and unit of the values.
        found: Match of the pattern _DATA in this line.
        unit: Unit of the accelerations if the line does not state it.
    """
    unit, place = found["unit"] or unit, record.place(at)
    count = stated_count(found["count"], place)
    step = stated_step(found["time"], place, is_rate=found["of_time"].lower() == "pts/sec")
    layout = Layout.of(found["rest"]) or layout_of_lines(record, at + 1)
    factor = 1.0
    if found["quantity"].lower() == "acc":
        if unit is None:
            raise damaged(f"{place}: expected the unit of the values, such as 'IN UNITS CM/SEC/SEC'")
        factor = _factor(unit, place)
    values, after = block(record, at + 1, count, layout)
    return factor * values, step, after


def _values_of_bhrc(record: RecordText, head: list[str], first: int, data: int) -> tuple[np.ndarray, float, int]:
    """Return accelerations of a BHRC file [m/s2], the step [s], and the index of the line after the values."""
    place = record.place(first + 10)
    counted, duration = _COUNT.search(head[10]), re.search(r"duration\s*=\s*(\d*\.?\d+)", head[10], re.IGNORECASE)
    if counted is None or duration is None or not re.search(r"seconds\s+and\s+g/10", head[11], re.IGNORECASE):
        raise damaged(
            f"{place}: expected the number of points, the duration, and values in g/10, got {head[10].strip()!r}"
        )
    count = stated_count(counted[1], place)
    step = stated_step(f"{float(duration[1]) / count:.6g}", place)
    values, after = block(record, data, count, layout_of_lines(record, data))
    return _factor("g/10", place) * values, step, after


def _pairs_of_values(record: RecordText, head: list[str], first: int, data: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Return times [s] and accelerations [m/s2] that are written as pairs, and the index of the line after them."""
    unit = _found(_UNIT_OF_PAIRS, head, record, first)
    if unit is None:
        raise damaged(
            f"{record.place(data)}: expected '9999 points of accel data equally spaced at .020 sec', got "
            f"{record.lines[data].strip()[:60]!r}"
        )
    counted = _found(_COUNT, head, record, first)
    if counted is None:
        raise damaged(f"{record.path}: the header states no number of points, such as 'No. of Points = 1000'")
    count = stated_count(counted[0][1], counted[1])
    numbers, after = block(record, data, 2 * count, layout_of_lines(record, data))
    return numbers[::2], _factor(unit[0]["unit"], unit[1]) * numbers[1::2], after


def _found(
    pattern: re.Pattern[str], head: list[str], record: RecordText, first: int
) -> tuple[re.Match[str], str] | None:
    """Return the first match of a pattern in the text header and its place (path and line); None without a match."""
    places = ((pattern.search(line), record.place(first + i)) for i, line in enumerate(head))
    return next(((match, place) for match, place in places if match), None)


def _factor(unit: str, place: str) -> float:
    """Return the factor that converts a unit, as written in these files (such as "cms/sec/sec"), to m/s2."""
    return unit_factor(unit.lower().replace("cms", "cm"), place)


def _check_header(
    record: RecordText,
    head: list[str],
    first: int,
    volume: str,
    values: np.ndarray,
    step: float,
    precision: float,
    *,
    is_pairs: bool = False,
) -> None:
    """Raise a ValueError if number, duration or peak of the values differ from the text header.

    The time of the peak is compared only for values at equal steps, because some agencies count the times of uneven
    values from another zero.
    """
    for i, line in enumerate(head):
        place = record.place(first + i)
        if volume == "V1" and (found := _COUNT.search(line)) and int(found[1]) != values.size:
            raise damaged(f"{place}: the header states {found[1]} points, but {values.size} follow")
        if (found := _DURATION.search(line)) and (volume == "V1" or "record" in line.lower()):
            check_duration(values.size, step, found[1], place, precision)
        if found := _PEAK[volume].search(line):
            in_unit = values / _factor(found["unit"], place)
            digits = 1e-4 * float(np.abs(in_unit).max())
            check_printed_peak(in_unit, found["peak"], place, digits)
            if not is_pairs:
                check_time_of_peak(in_unit, step, found["time"], place, digits)


def _names(head: list[str]) -> tuple[str, str]:
    """Return the name of the record, which all channels of one sensor share, and the component of the channel."""
    if file := _BHRC.match(head[0]):
        azimuths = re.search(r"azimuth\s+L\s*(?P<L>\d+)\s+T\s*(?P<T>\d+)", head[7], re.IGNORECASE)
        axis = head[6].strip().upper().removeprefix("COMP").strip()[:1]
        of_axis = azimuth_label(float(azimuths[axis])) if azimuths and axis in ("L", "T") else axis
        return f"{head[7].split('Station')[0].strip()} {file['record']}", of_axis
    first_of_volume_1 = 1 if _CORRECTED.match(head[0]) else 0
    named = head[first_of_volume_1 + 5].strip()
    station = next((match["code"] for line in head if (match := _STATION.search(line))), re.split(r"\s{3,}", named)[0])
    channel = _CHANNEL.match(head[first_of_volume_1 + 6])
    found = _LABEL.match(channel["label"]) if channel else None
    location = _LOCATION.search(channel["label"]) if channel else None
    event = re.split(r"\s{3,}", head[first_of_volume_1 + 1].strip())[0]
    accession = head[first_of_volume_1 + 3].split()
    record_id = accession[0] if accession and re.match(r"\w+[-.]\S+$", accession[0]) else event
    name = " ".join(filter(None, [station, record_id, location["location"] if location else ""]))
    return name, orientation(found["label"] if found else "").known_label
