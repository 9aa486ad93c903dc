"""Reader of the record files in a directory."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from fnmatch import fnmatchcase
from os import PathLike
from pathlib import Path

from warpdyn.foundations.core.checks import checked_text, one_of
from warpdyn.foundations.core.messages import amount_of
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.file_names import numbered_record, records_and_components
from warpdyn.model.ground_motions.records.components.selection import COMPONENTS, chosen_components
from warpdyn.model.ground_motions.records.formats.reading import FileOfMotions, read_archive, read_file
from warpdyn.model.ground_motions.records.parsing.archives import is_archive, is_litter
from warpdyn.model.ground_motions.records.parsing.content import bytes_of
from warpdyn.model.ground_motions.records.parsing.not_a_record import NotARecordError


def read_directory(
    path: str | PathLike,
    pattern: str = "*.AT2",
    components: str = "horizontal",
    unit: str | None = None,
    step: float | None = None,
) -> list[GroundMotion]:
    """Read the record files of a directory whose names match a pattern; by default only horizontal components.

    Files may have any format of `read`. The component of a file is read from its header (", UP", ", 180" in line 2 of
    an AT2 file), otherwise from its name ("-UP", "DWN", "-V1"), which is compared with the names of all other files.
    Hidden files, "._" files of macOS and backup copies of editors are skipped.

    Args:
        path: The directory; subdirectories are not searched.
        pattern: Pattern of the file names, such as `"*.V2"`; upper and lower case are not distinguished.
        components: "horizontal", "vertical" or "all". If a record's component is unknown, it counts as horizontal if
            the directory has no vertical record; otherwise it is not read. A warning is given in both cases.
        unit: Unit of the accelerations, one of `UNITS`, for files that do not contain it: text, SAC and MiniSEED.
        step: Step [s] for files that do not contain it, as in `read`.

    Returns:
        The motions [m/s2], in the order of their file names, with `record` and `component` if they are known.

    Raises:
        FileNotFoundError: If the directory does not exist, no file matches, or no file has a wanted component.
        ValueError: If `read` raises an error for a matching file, or `components` is invalid.
        TypeError: If `path` is not the name of a directory.

    Example:
        >>> [motion.name for motion in wd.records.read_directory(".", pattern="RSN*.AT2")]
        ['RSN6_IMPVALL.I_I-ELC180']
    """
    one_of("components", components, COMPONENTS)
    if not isinstance(path, str | PathLike):
        raise TypeError(f"path must be the name of a directory, got {path!r}")
    checked_text("pattern", pattern)
    directory = Path(path)
    if not directory.is_dir():
        raise FileNotFoundError(
            f"{path}: there is no such directory, so no records {pattern!r} can be read: correct the path"
        )
    present = sorted(
        (file for file in directory.iterdir() if not is_litter(file.name) and file.is_file()),
        key=lambda file: (file.name.lower(), file.name),
    )
    matching = [file for file in present if fnmatchcase(file.name.lower(), pattern.lower())]
    if not matching:
        raise FileNotFoundError(f"{path}: no file in this directory matches {pattern!r}{_other_patterns(present)}")
    files = [part for file in matching for part in _parts_of(file, unit, step)]
    motions = _with_names(files, directory.resolve().name)
    names = [file.name if len(file.motions) == 1 else motion.name for file in files for motion in file.motions]
    chosen = chosen_components(
        [motion.component for motion in motions], components, names, [motion.record for motion in motions], str(path)
    )
    if not any(chosen):
        raise FileNotFoundError(
            f"{path}: no file of the {len(matching)} that match {pattern!r} is a {components} component: give "
            "components='all'"
        )
    return [motion for motion, is_chosen in zip(motions, chosen, strict=True) if is_chosen]


def _other_patterns(present: list[Path]) -> str:
    """Return the end of an error message: advice to use the most frequent suffix in the directory as pattern."""
    suffixes = Counter(file.suffix for file in present if file.suffix)
    if not suffixes:
        return ": correct path or pattern="
    suffix, count = suffixes.most_common(1)[0]
    found = amount_of(count, "file")
    return f"; it contains {found} {'*' + suffix!r}: give pattern={'*' + suffix!r} if these are the records"


def _parts_of(file: Path, unit: str | None, step: float | None) -> list[FileOfMotions]:
    """Return the motions of a file as a list with one element, or one element for each file in an archive."""
    data = bytes_of(file)
    try:
        return read_archive(file, data, unit, step) if is_archive(data) else [read_file(file, data, unit, step)]
    except NotARecordError as error:
        raise NotARecordError(
            f"{error}. If the file is not a record, give a pattern= that matches only records, such as pattern='*.V2'"
        ) from error


def _with_names(files: list[FileOfMotions], folder: str) -> list[GroundMotion]:
    """Return the motions of all files. A record or component that a header lacks is taken from the file name.

    Args:
        files: The files with their motions.
        folder: Name of the folder, which names records whose file names are only components.
    """
    single = [file for file in files if len(file.motions) == 1]
    found = records_and_components(
        [file.name for file in single],
        [file.motions[0].component for file in single],
        [str(file.path) if file.is_typed else "" for file in single],
    )
    of_name = {id(file): each for file, each in zip(single, found, strict=True)}
    motions: list[GroundMotion] = []
    for file in files:
        if not file.uses_name:
            motions += file.motions
            continue
        motion = file.named(*of_name[id(file)])
        if motion.component and not motion.record:
            # The file names are numbers of components, or the folder contains only files such as "EW.AT2" and "NS.AT2".
            motion = replace(motion, record=numbered_record(file.name) or folder)
        motions.append(motion)
    return motions
