"""Reader of all records of a directory."""

from __future__ import annotations

from dataclasses import replace
from fnmatch import fnmatchcase
from os import PathLike
from pathlib import Path

from warpdyn.core.checks import one_of
from warpdyn.ground_motions.motions import GroundMotion
from warpdyn.ground_motions.records.at2 import read_at2
from warpdyn.ground_motions.records.components import COMPONENTS, record_and_component


def read_directory(path: str | Path, pattern: str = "*.AT2", components: str = "horizontal") -> list[GroundMotion]:
    """Read every PEER .AT2 file of a directory whose name matches a pattern, but for vertical components.

    Args:
        path: The directory; its subdirectories are not searched.
        pattern: Shell pattern of the file names, upper and lower case alike.
        components: "horizontal", "vertical" or "all", by the end of the names ("-UP", "DWN", "-V"); a name that tells
            no component counts as horizontal.

    Returns:
        The motions [m/s2], in the order of their file names, with `record` and `component` where the names tell them.

    Raises:
        FileNotFoundError: If there is no such directory, or no file in it matches, or none is such a component.
        ValueError: If a file is not a sound record, as `read_at2` says, or `components` is another word.
        TypeError: If `path` names no directory.

    Example:
        >>> [motion.name for motion in wd.records.read_directory(".", pattern="RSN*.AT2")]
        ['RSN6_IMPVALL.I_I-ELC180']
    """
    one_of("components", components, COMPONENTS)
    if not isinstance(path, str | PathLike):
        raise TypeError(f"path must be the name of a directory, got {path!r}")
    directory = Path(path)
    if not directory.is_dir():
        raise FileNotFoundError(f"{path}: no such directory (to read records {pattern!r} from)")
    files = [file for file in directory.iterdir() if fnmatchcase(file.name.lower(), pattern.lower()) and file.is_file()]
    if not files:
        raise FileNotFoundError(f"{path}: no file in this directory matches {pattern!r}")
    chosen = [file for file in files if COMPONENTS[components](record_and_component(file.stem)[1])]
    if not chosen:
        raise FileNotFoundError(
            f"{path}: none of the {len(files)} files that match {pattern!r} is a {components} component by its name; "
            "components='all' reads them"
        )
    motions = []
    for file in sorted(chosen, key=lambda file: (file.name.lower(), file.name)):
        record, component = record_and_component(file.stem)
        motions.append(replace(read_at2(file), record=record, component=component))
    return motions
