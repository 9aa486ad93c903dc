"""Reader of the PEER .AT2 files of a directory."""

from __future__ import annotations

from dataclasses import replace
from fnmatch import fnmatchcase
from os import PathLike
from pathlib import Path

from warpdyn.core.checks import checked_text, one_of
from warpdyn.ground_motions.motions import GroundMotion
from warpdyn.ground_motions.records.at2 import read_at2_and_title
from warpdyn.ground_motions.records.components import (
    COMPONENTS,
    chosen_components,
    component_of_header,
    numbered_record,
    record_of_header,
    records_and_components,
)

_LITTER = ("._*", ".*", "~$*", "*~", "#*#", "*.bak", "*.swp", "*.swo", "*.tmp", "*.orig", "*.part", "*.crdownload")
_LITTER_OF_SYSTEMS = ("thumbs.db", "ehthumbs.db", "desktop.ini", "icon\r", "__macosx", "$recycle.bin")
_BYTES_OF_HEADER = 2000


def is_litter(name: str | Path) -> bool:
    """Return whether a file was left by a file manager, an editor or a download, and is not a record.

    macOS writes "._X.AT2" beside each file X.AT2 on other systems' disks and in archives (folder "__MACOSX").

    Args:
        name: Path of the file, within its folder or archive.
    """
    parts = [part.lower() for part in Path(name).parts]
    if not parts:
        return False
    return any(part in _LITTER_OF_SYSTEMS for part in parts) or any(fnmatchcase(parts[-1], each) for each in _LITTER)


def read_directory(path: str | Path, pattern: str = "*.AT2", components: str = "horizontal") -> list[GroundMotion]:
    """Read every PEER .AT2 file of a directory whose name matches a pattern, except vertical components.

    The component is the one that line 2 of each file contains (", UP", ", 180"), else the one of its name ("-UP",
    "DWN", "-V1"). Hidden files, "._" files of macOS and copies that editors leave are skipped.

    Args:
        path: The directory; its subdirectories are not searched.
        pattern: Shell pattern of the file names, upper and lower case alike.
        components: "horizontal", "vertical" or "all". A record whose component is not known counts as horizontal, with
            a warning, if no vertical record is in the directory; otherwise it is left out, with a warning.

    Returns:
        The motions [m/s2], in the order of their file names, with `record` and `component` if they are known.

    Raises:
        FileNotFoundError: If there is no such directory, or no file in it matches, or no file is such a component.
        ValueError: If a file is not a sound record, as `read_at2` says, or `components` is another word.
        TypeError: If `path` names no directory.

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
        raise FileNotFoundError(f"{path}: no such directory (to read records {pattern!r} from)")
    files = sorted(
        (
            file
            for file in directory.iterdir()
            if fnmatchcase(file.name.lower(), pattern.lower()) and not is_litter(file.name) and file.is_file()
        ),
        key=lambda file: (file.name.lower(), file.name),
    )
    if not files:
        others = sorted(file.name for file in directory.iterdir() if file.is_file() and not is_litter(file.name))
        hint = (
            f"; files of other formats, such as {others[0]!r}, are read one by one by wd.records.read" if others else ""
        )
        raise FileNotFoundError(f"{path}: no file in this directory matches {pattern!r}{hint}")
    titles = [_title_of(file) for file in files]
    found = records_and_components(
        [file.name for file in files], [component_of_header(title) for title in titles], [str(file) for file in files]
    )
    # A header that tells event and station, names that count components, or a folder of "EW.AT2" and "NS.AT2".
    records = [
        record or record_of_header(title) or ((numbered_record(file.name) or directory.resolve().name) if label else "")
        for (record, label), title, file in zip(found, titles, files, strict=True)
    ]
    labels = [label for _, label in found]
    chosen = chosen_components(labels, components, [file.name for file in files], records, str(path))
    if not any(chosen):
        raise FileNotFoundError(
            f"{path}: none of the {len(files)} files that match {pattern!r} is a {components} component; "
            "components='all' reads them"
        )
    return [
        replace(read_at2_and_title(file)[0], record=record, component=label)
        for file, record, label, is_chosen in zip(files, records, labels, chosen, strict=True)
        if is_chosen
    ]


def _title_of(file: Path) -> str:
    """Return line 2 of a file; empty if there is none, which its reader refuses."""
    with file.open("rb") as opened:
        text = opened.read(_BYTES_OF_HEADER).decode("utf-8-sig", errors="replace")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return lines[1] if len(lines) > 2 else ""
