"""Directions of sensors: vertical or horizontal, and the azimuth, from labels such as "N26W" or "UD2"."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Orientation:
    """The direction that a sensor measures, as described by the label of a component.

    Args:
        label: The label in the form of `GroundMotion.component`, such as "090", "EW2" or "UP".
        kind: "vertical", "horizontal", or "unknown" if the label does not contain a direction.
        azimuth: Azimuth of a horizontal sensor [degrees clockwise from north]; None if the label does not contain it.
            Opposite directions have the same azimuth: "EW" and "WE" both have 90.
        sensor: Part of the label that identifies the sensor, not the direction: "2" in "EW2", "HN" in "HNE".
        family: Name of a system of labels, such as "seed" (HNE, HNN, HNZ) or "axes" (L, T).
    """

    label: str
    kind: Literal["vertical", "horizontal", "unknown"]
    azimuth: float | None = None
    sensor: str = ""
    family: str = ""

    @property
    def known_label(self) -> str:
        """The label; "" if the direction is unknown."""
        return self.label if self.kind != "unknown" else ""


# Words for vertical in the languages of agencies that publish records. Accents are removed before a word is looked up.
_VERTICAL = frozenset(
    """
    U UP UPDN UPDO UPDOWN UPWARD UPWARDS UD DU DN DOW DWN DOWN DOWNWARD V VT VR VRT VER VERT
    Z DUSEY DIKEY SUSJOS 上下 上下動 上下方向 垂直 竖向 竖直 垂向 鉛直
    """.split()  # noqa: SIM905
)
_COMPASS = {
    0.0: "N NORTH NORTE NORD NORDUR KUZEY 北",
    180.0: "S SOUTH SUR SUD SUED SUL GUNEY 南",
    90.0: "E EAST ESTE EST OST LESTE DOGU 东 東",
    270.0: "W WEST OESTE OVEST OUEST VEST BATI 西",
}
_AZIMUTHS = {word: azimuth for azimuth, words in _COMPASS.items() for word in words.split()}
# Axes named by two opposite directions. "O" is west in Romance languages and east in German; in a pair it is clear.
_AXES_OF_COMPASS = {"NS": 0.0, "SN": 0.0, "EW": 90.0, "WE": 90.0, "EO": 90.0, "OE": 90.0, "OW": 90.0, "WO": 90.0}
_AXES_OF_COMPASS |= {"南北": 0.0, "北南": 0.0, "东西": 90.0, "東西": 90.0}
_AXES = frozenset(
    """
    L LN LG LNG LON LONG LONGI LONGIT LONGITUDINAL LONGITUDINALE T TR TN TRN TRA TRAN TRANS TRANSV TRANSVERSE
    TRANSVERSAL TRANSVERSALE TRASVERSALE R RD RAD RADIAL TAN TANG TANGENTIAL X Y H HZ HOR HORIZ HORIZONTAL FN FP SP
    STRIKENORMAL STRIKEPARALLEL FAULTNORMAL FAULTPARALLEL MAJOR MINOR 水平
    """.split()  # noqa: SIM905
)
# Numbers of directions, not of sensors: H1 and H2 are the two horizontal directions.
_NUMBERED = re.compile(r"(?:H|HOR|HORIZ|HORIZONTAL|水平)(?P<axis>[123])$")
# Letters for band, instrument and direction (SEED manual, appendix A); the directions R and T refer to the source.
_SEED = re.compile(r"(?P<sensor>[BCDEFGHLMSV][HLNGPM])(?P<axis>[ZNE123RTXYUVW])(?P<location>\d\d)?$")
_BEARING = re.compile(r"(?P<from>[NS])(?P<angle>\d{1,2}(?:\.\d+)?)(?P<to>[EW])$")
_ANGLE = re.compile(r"(?:\+|(?:H|HOR|A)(?=\d{3}$))?(?P<angle>\d{1,3}(?:\.\d*)?)$")
_WORDS_AROUND = re.compile(
    r"\b(?:COMPONENTS?|COMPONENTE|COMP|CMP|BILESEN\w*|DIRECTION|DIR|ORIENTATION|AZIMUTH|AZIM|AZ|DEGREES?|DEGS?|CHANNEL|AXIS|"
    r"ACCELERATION|ACCEL|ACC|TO)\b|(?<=\d)DEG(?:REE)?S?\b|[°º]|成分|方向|分量",
)


def orientation(label: str) -> Orientation:
    """Return the direction (vertical or horizontal, azimuth, sensor) that the label of a component describes.

    Args:
        label: Text from a header or a file name: an azimuth ("180", "90 DEG"), a bearing ("N26W", "S 00 E"), compass
            directions ("EW", "North-South", "Kuzey-Güney"), axes ("L", "TRAN", "FN"), a SEED channel ("HNZ") or a word
            for vertical ("UP", "DWN", "V1"). Numbers of sensors may follow ("EW2", "V1").
    """
    text = _capitals(label)
    stripped = re.sub(r"\s+", " ", _WORDS_AROUND.sub(" ", text)).strip(" .:;,=()[]'\"")
    compact = re.sub(r"[\s\-_/.,()&]+", "", stripped)
    if angle := _ANGLE.match(stripped):
        return _of_azimuth(float(angle["angle"]), text)
    if bearing := _BEARING.match(re.sub(r"[\s\-_]+", "", stripped)):
        return _of_bearing(bearing, compact)
    of_word = _of_word(compact)
    if of_word.kind != "unknown":
        return of_word
    if seed := _SEED.match(compact):
        return _of_channel(seed, compact)
    numbered = re.match(r"(?P<word>\D+)(?P<sensor>\d{1,2})$", compact)
    if numbered and not re.search(r"\s\d+$", stripped):  # after a blank, as in "UP 9", the number is not the sensor's
        found = _of_word(numbered["word"] if not _NUMBERED.match(compact) else "")
        if found.kind != "unknown":
            return Orientation(compact, found.kind, found.azimuth, numbered["sensor"], found.family)
    words = stripped.split()
    # In "Z (UP)" and "EW (EAST)", both words have the same direction; in "CHAN 1 UP" and "STATION N" they have not.
    if len(words) == 2 and (both := [orientation(word.strip("()[]")) for word in words])[0].kind == both[1].kind:
        return both[0]
    return Orientation(text.strip(), "unknown")


def azimuth_label(azimuth: float) -> str:
    """Return the label of an azimuth [degrees], such as "090" or "034.5"; "" if it is outside 0 to 360."""
    if not 0 <= azimuth <= 360:
        return ""
    return f"{azimuth:03.0f}" if float(azimuth).is_integer() else f"{azimuth:05.1f}"


def is_vertical(component: str) -> bool:
    """Return whether a label, such as "UP" or "HNZ", describes a vertical component."""
    return orientation(component).kind == "vertical"


def _capitals(label: str) -> str:
    """Return a text in capital letters, without accents and without blanks at both ends."""
    letters = unicodedata.normalize("NFKD", str(label).replace("\u0131", "i").replace("ß", "ss"))
    return "".join(letter for letter in letters if not unicodedata.combining(letter)).upper().strip()


def _of_azimuth(azimuth: float, text: str) -> Orientation:
    if label := azimuth_label(azimuth):
        return Orientation(label, "horizontal", azimuth % 360.0, family="azimuth")
    return Orientation(text, "unknown")


def _of_bearing(bearing: re.Match[str], label: str) -> Orientation:
    angle = float(bearing["angle"])
    if angle > 90:
        return Orientation(label, "unknown")
    from_north = angle if bearing["from"] == "N" else 180.0 - angle
    azimuth = from_north if bearing["to"] == "E" else -from_north
    return Orientation(label, "horizontal", azimuth % 360.0, family="azimuth")


def _of_word(word: str) -> Orientation:
    if word in _VERTICAL or re.match(r"VERTI(?:C(?:AL(?:E|ES)?)?|K(?:AL)?)?$", word):
        return Orientation(word, "vertical", family="vertical")
    if word in _AXES_OF_COMPASS:
        # "SN" may also mean strike-normal, so that its azimuth is unknown.
        azimuth = None if word == "SN" else _AXES_OF_COMPASS[word]
        return Orientation(word, "horizontal", azimuth, family="compass axes")
    if word in _AZIMUTHS:
        return Orientation(word, "horizontal", _AZIMUTHS[word], family="compass")
    for first, azimuth in _AZIMUTHS.items():
        second = _AZIMUTHS.get(word[len(first) :]) if len(word) > 2 and word.startswith(first) else None
        if second is not None and (azimuth - second) % 360 == 180:
            axis = "NS" if azimuth in (0, 180) else "EW"
            return Orientation(axis, "horizontal", _AXES_OF_COMPASS[axis], family="compass axes")
    if word in _AXES:
        return Orientation(word, "horizontal", family="axes")
    if numbered := _NUMBERED.match(word):
        return Orientation(word, "unknown" if numbered["axis"] == "3" else "horizontal", family="numbered")
    return Orientation(word, "unknown")


def _of_channel(channel: re.Match[str], label: str) -> Orientation:
    axis, sensor = channel["axis"], channel["sensor"] + (channel["location"] or "")
    if axis == "Z":
        return Orientation(label, "vertical", None, sensor, "seed")
    if axis in "3UVW":  # an unnamed third direction, and the oblique axes of Galperin's sensors
        return Orientation(label, "unknown", None, sensor, "seed")
    return Orientation(label, "horizontal", {"N": 0.0, "E": 90.0}.get(axis), sensor, "seed")


def angle_between(one: float, other: float) -> float:
    """Return the angle between two horizontal axes with azimuths `one` and `other` [degrees], from 0 to 90."""
    apart = abs(one - other) % 180.0
    return min(apart, 180.0 - apart)
