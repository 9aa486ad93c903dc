"""Reader of record files of any known format."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from warpdyn.foundations.core.checks import one_of
from warpdyn.foundations.core.messages import amount_of, warn_caller
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.at2 import read_at2_and_header
from warpdyn.model.ground_motions.records.columns import ColumnChoice, read_columns
from warpdyn.model.ground_motions.records.components.file_names import record_and_component
from warpdyn.model.ground_motions.records.components.selection import COMPONENTS, select_components
from warpdyn.model.ground_motions.records.cosmos import read_cosmos
from warpdyn.model.ground_motions.records.esm import read_esm
from warpdyn.model.ground_motions.records.formats.afad import is_afad, read_afad
from warpdyn.model.ground_motions.records.formats.asa import is_asa, read_asa
from warpdyn.model.ground_motions.records.formats.csmip import is_csmip, read_csmip
from warpdyn.model.ground_motions.records.formats.cwa import is_cwa, read_cwa
from warpdyn.model.ground_motions.records.formats.geonet import is_geonet, read_geonet
from warpdyn.model.ground_motions.records.formats.knet import read_knet
from warpdyn.model.ground_motions.records.formats.running_values import (
    check_against_header,
    header_of,
    read_running_values,
    tokens_of,
)
from warpdyn.model.ground_motions.records.formats.seismic import read_seismic
from warpdyn.model.ground_motions.records.formats.smc import is_smc, read_smc
from warpdyn.model.ground_motions.records.parsing.archives import is_archive, members
from warpdyn.model.ground_motions.records.parsing.content import bytes_of, is_miniseed, is_sac
from warpdyn.model.ground_motions.records.parsing.fixed_width import RecordText
from warpdyn.model.ground_motions.records.parsing.not_a_record import AmbiguousTextError, NotARecordError

_READERS: tuple[tuple[str, Callable[[list[str]], bool], Callable[..., list[GroundMotion]]], ...] = (
    ("K-NET", lambda lines: lines[0].startswith("Origin Time"), read_knet),
    ("AT2", lambda lines: any("NPTS" in line.upper() for line in lines[3:4]), lambda path: [read_at2_and_header(path)]),
    (
        "COSMOS",
        lambda lines: re.search(r"\(Format\s+v\S+\s+with\s+\d+\s+text", lines[0], re.IGNORECASE) is not None,
        lambda path: read_cosmos(path, "all"),
    ),
    ("ESM", lambda lines: lines[0].upper().startswith("EVENT_NAME"), lambda path: [read_esm(path)]),
    ("AFAD", is_afad, read_afad),
    ("CWA", is_cwa, read_cwa),
    ("GeoNet", is_geonet, read_geonet),
    ("ASA", is_asa, read_asa),
    ("SMC", is_smc, read_smc),
    ("CSMIP", is_csmip, read_csmip),
)
FEWEST_RUNNING = 5  # lines with this many values are not columns: tables have a time and up to three components
FEWEST_IN_ONE_LINE = 20  # fewest values of a record that has only one line of numbers
# Formats whose records may have uneven times; such records are interpolated to the argument `step`.
_WITH_STEP = ("CSMIP", "SMC")
# Text files that contain no record: pattern of the first line, what the file is, and what the user can do.
_OTHERS = (
    (
        r"(?i)\s*(response|fourier)\b.*\bspectr",
        "a file of response or Fourier spectra (V3)",
        "take the V2 or V1 file of the same record, which contains its accelerations",
    ),
    (r"(?i)Date/Time|EVENT\s*ID\s*,", "a table of events or stations", "give the file with the values of the record"),
)


@dataclass(frozen=True)
class FileOfMotions:
    """The motions of one file, with the records and components that its header contains.

    People type line 2 of AT2 files and the headers of text files. Therefore, the component in such a header is compared
    with the component in the file name, and the record is taken from the file name. Programs write the headers of other
    formats.

    Args:
        path: The file, or the member of an archive.
        motions: The motions.
        format: Name of the format; "text" for text without a known header.
    """

    path: str | PathLike
    motions: tuple[GroundMotion, ...]
    format: str

    @property
    def name(self) -> str:
        """Name of the file without its folder."""
        return Path(self.path).name

    @property
    def is_typed(self) -> bool:
        """Whether the component was read from a header that a person typed."""
        return self.format == "AT2" or (self.format == "text" and not self.motions[0].record)

    @property
    def uses_name(self) -> bool:
        """Whether record and component must be read from the file name."""
        return len(self.motions) == 1 and (self.is_typed or not self.motions[0].component)

    def named(self, record: str, component: str) -> GroundMotion:
        """Return the only motion of the file, named by `component`, and by `record` or the record in the header."""
        (motion,) = self.motions
        order = (record, motion.record) if self.is_typed else (motion.record, record)
        return replace(motion, record=order[0] or order[1], component=component)


def read(
    path: str | PathLike, *, unit: str | None = None, step: float | None = None, components: str = "all"
) -> list[GroundMotion]:
    """Read the ground motions of a record file, or of the files in a gzip, zip or tar archive, in any known format.

    The format is recognised from the first lines: AT2 (PEER, NGA-West2, NGA-East), COSMOS V1 and V2, V1 and V2 of
    CSMIP, CESMD, RENADIC, USC and BHRC, SMC (USGS), K-NET and KiK-net, ESM and ITACA, AFAD, CWA, V1A and V2A of
    GeoNet, ASA 2.0 (Mexico), SAC and MiniSEED (by obspy), and text in columns or with several values per line.

    Args:
        path: The file. Motions are named by the file's name and the component.
        unit: Unit of the accelerations, one of `UNITS`, for files that do not contain it: text, SAC and MiniSEED.
        step: Step [s] for text without times, and for records that were digitised at uneven times (some V1 and SMC
            files) and are interpolated linearly. For other files, `step` is compared with the step in the file.
        components: "horizontal", "vertical" or "all".

    Returns:
        The motions [m/s2] in the order of the file, with `record` and `component` if the file states them.

    Raises:
        FileNotFoundError, IsADirectoryError: If there is no such file, or it is a directory.
        ModuleNotFoundError: If the file is SAC or MiniSEED, and obspy is not installed.
        ValueError: If the file contains no accelerations (the message names its format and a remedy) or is damaged; if
            `unit` or `step` is missing or differs from the file; or if the file has no wanted component.
        TypeError: If `path` is not the name of a file.

    Example:
        >>> [motion.component for motion in wd.records.read("station.V2C")]
        ['090']
    """
    one_of("components", components, COMPONENTS)
    data = bytes_of(path)
    files = read_archive(path, data, unit, step) if is_archive(data) else [read_file(path, data, unit, step)]
    motions = [motion for file in files for motion in _with_names(file)]
    return select_components(motions, components, path)


def read_archive(path: str | PathLike, data: bytes, unit: str | None, step: float | None) -> list[FileOfMotions]:
    """Return the motions of each file in an archive, as `read_file` returns them; warn of files that are not records.

    Args:
        path: The archive, for messages.
        data: Content of the archive.
        unit: Unit of the accelerations, as in `read`.
        step: Step [s], as in `read`.
    """
    files: list[FileOfMotions] = []
    others: dict[str, str] = {}
    for member in members(path, data):
        try:
            files.append(read_file(member, member.data, unit, step))
        except NotARecordError as error:
            others[str(member)] = str(error)
    if not files:
        found = "; ".join(others.values()) or "it is empty: download it again"
        raise ValueError(f"{path}: no file in this archive is a record: {found}")
    if others:
        first, *more = others
        rest = f". Also left out: {', '.join(more)}" if more else ""
        warn_caller(
            f"{path}: {amount_of(len(others), 'file')} in this archive left out: {others[first]}{rest}. No action is "
            "needed if these are not records"
        )
    return files


def _with_names(file: FileOfMotions) -> list[GroundMotion]:
    """Return the motions of a file. If the header contains no component, it is read from the file name."""
    if not file.uses_name:
        return list(file.motions)
    record, component = record_and_component(file.name, file.motions[0].component, place=str(file.path))
    if file.format == "text" and component:
        record = record or Path(file.name).stem
    return [file.named(record, component)]


def read_file(path: str | PathLike, data: bytes, unit: str | None, step: float | None) -> FileOfMotions:
    """Return the motions of one file, read by the reader of its format, with record and component of its header."""
    if is_miniseed(data) or is_sac(data):
        return FileOfMotions(path, tuple(read_seismic(path, data, unit, step)), "seismic")
    record = RecordText.of(path)
    first = next((i for i, line in enumerate(record.lines) if line.strip()), 0)
    lines = record.lines[first : first + 20]
    for pattern, what, remedy in _OTHERS:
        if re.match(pattern, lines[0]):
            raise NotARecordError(f"{path}: this is {what}, not a record of accelerations: {remedy}")
    for name, is_such, reader in _READERS:
        if is_such(lines):
            if unit is not None:
                raise ValueError(f"{path}: unit is {unit!r}, but this {name} file states its unit: leave out unit=")
            motions = reader(path, step=step) if name in _WITH_STEP else reader(path)
            wrong = [motion for motion in motions if step is not None and abs(motion.step - step) > 1e-3 * step]
            if wrong:
                raise ValueError(
                    f"{path}: step is {step:g} s, but this {name} file states {wrong[0].step:g} s: leave out step="
                )
            return FileOfMotions(path, tuple(motions), name)
    if unit is None and Path(path).suffix.lower() == ".at2":
        return FileOfMotions(path, (read_at2_and_header(path),), "AT2")  # reports the error in the header
    return FileOfMotions(path, tuple(_from_text(record, unit, step)), "text")


def _from_text(record: RecordText, unit: str | None, step: float | None) -> list[GroundMotion]:
    """Return the motion in a text without a known header: in columns, or with several successive values per line."""
    path = record.path
    header = header_of(record)
    rows = [line for line in record.lines[header.lines :] if line.strip()]
    if len(rows) < 2 and sum(len(tokens_of(line)) for line in rows) < FEWEST_IN_ONE_LINE:
        shown = next((line.strip()[:60] for line in record.lines if line.strip()), "")
        raise NotARecordError(
            f"{path}: the format is unknown: its first line is {shown!r}, and no two lines of numbers follow. "
            "For text in columns use wd.records.read_text(path, unit=...)"
        )
    if unit is None:
        # For example, archives of PEER contain a table of spectra, which is such a text.
        raise NotARecordError(
            f"{path}: text without a known header does not state the unit of its values: give unit=, such as unit='g'"
        )
    widths = [len(tokens_of(line)) for line in rows]
    usual, alike = Counter(widths).most_common(1)[0]
    is_full = len(set(widths[:-1])) == 1  # all lines except the last have the same number of values
    is_running = usual > 1 and (
        (usual >= FEWEST_RUNNING and alike >= 0.5 * len(widths)) or (is_full and widths[-1] < widths[0])
    )
    if is_running:
        return read_running_values(path, unit=unit, step=step)
    step = header.step if step is None and widths[0] == 1 else step
    try:
        motion = read_columns(path, unit, step, ColumnChoice(header_lines=header.lines or None))
    except AmbiguousTextError as error:
        raise ValueError(
            f"{error}. read() does not take these arguments: call wd.records.read_text(path, ...)"
        ) from error
    check_against_header(motion, header)
    return [motion]
