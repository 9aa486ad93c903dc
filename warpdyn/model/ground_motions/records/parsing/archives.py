"""Files inside compressed files and archives: gzip, zip and tar."""

from __future__ import annotations

import gzip
import io
import tarfile
import zipfile
import zlib
from collections.abc import Iterator
from fnmatch import fnmatchcase
from os import PathLike
from pathlib import Path, PurePath, PurePosixPath

LARGEST_FILE = 500_000_000  # bytes; records have less than 100 MB, and a damaged archive must not exhaust the memory
DEEPEST = 3  # levels of archives inside archives; CESMD puts one zip file per station into a zip file

_LITTER = ("._*", ".*", "~$*", "*~", "#*#", "*.bak", "*.swp", "*.swo", "*.tmp", "*.orig", "*.part", "*.crdownload")
_LITTER_OF_SYSTEMS = ("thumbs.db", "ehthumbs.db", "desktop.ini", "icon\r", "__macosx", "$recycle.bin")


class Member(PathLike):
    """A file inside an archive. Its path consists of the path of the archive, a slash, and the name in the archive."""

    def __init__(self, archive: str | PathLike, name: str, data: bytes) -> None:
        self.path, self.data = f"{archive}/{name}", data

    def __fspath__(self) -> str:
        return self.path

    def __str__(self) -> str:
        return self.path


def is_litter(name: str | PurePath) -> bool:
    """Return whether a file is an auxiliary file that a file manager or an editor made, judging by its path.

    For example, macOS adds a file "._X.AT2" to each file X.AT2 on disks of other systems, and a folder "__MACOSX" to
    archives.
    """
    parts = [part.lower() for part in PurePath(name).parts]
    if not parts:
        return True
    return any(part in _LITTER_OF_SYSTEMS for part in parts) or any(fnmatchcase(parts[-1], each) for each in _LITTER)


def is_gzip(data: bytes) -> bool:
    """Return whether a file, given by its bytes, is compressed by gzip."""
    return data[:2] == b"\x1f\x8b"


def is_tar(data: bytes) -> bool:
    """Return whether a file, given by its bytes, is a tar archive."""
    return data[257:262] == b"ustar"


def zip_names(data: bytes) -> list[str] | None:
    """Return the names of the files in a zip archive, given by its bytes; None if it is not a zip archive."""
    if data[:4] not in (b"PK\x03\x04", b"PK\x05\x06"):
        return None
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return archive.namelist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        return []


def is_archive(data: bytes) -> bool:
    """Return whether a file, given by its bytes, is an archive that `members` opens.

    Excel files and NumPy files are zip archives, too, but are not opened.
    """
    names = zip_names(data)
    if names is not None:
        return not ("[Content_Types].xml" in names or (names and all(name.endswith(".npy") for name in names)))
    return is_gzip(data) or is_tar(data)


def members(path: str | PathLike, data: bytes, depth: int = 1) -> Iterator[Member]:
    """Yield the files in an archive and in archives inside it, except folders, empty files and auxiliary files.

    Args:
        path: The archive.
        data: Bytes of the archive.
        depth: Level of the archive; 1: it is not inside another archive.

    Raises:
        ValueError: If the archive is damaged, encrypted, too large or nested too deeply.
    """
    if depth > DEEPEST:
        raise ValueError(f"{path}: archives inside archives, more than {DEEPEST} deep: unpack the outer ones first")
    try:
        for name, content in _unpacked(path, data):
            # A file in a gzip file is not skipped as auxiliary, because the user chose its name.
            if not content or (not is_gzip(data) and is_litter(PurePosixPath(name.replace("\\", "/")))):
                continue
            member = Member(path, name, content)
            if is_archive(content):
                yield from members(member, content, depth + 1)
            else:
                yield member
    except (zipfile.BadZipFile, tarfile.TarError, zlib.error, EOFError, OSError, NotImplementedError) as error:
        raise ValueError(f"{path}: the archive is damaged ({error}): download it again") from error


def _unpacked(path: str | PathLike, data: bytes) -> Iterator[tuple[str, bytes]]:
    """Yield the name and the bytes of each file in one archive."""
    if is_gzip(data):
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
            content = file.read(LARGEST_FILE + 1)
        _check_size(path, len(content))
        yield Path(path).stem if Path(path).suffix.lower() in (".gz", ".tgz") else Path(path).name, content
    elif is_tar(data):
        with tarfile.open(fileobj=io.BytesIO(data)) as archive:
            for entry in archive:
                if entry.isfile():
                    _check_size(f"{path}/{entry.name}", entry.size)
                    file_of_entry = archive.extractfile(entry)
                    yield entry.name, file_of_entry.read() if file_of_entry else b""
    else:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for info in archive.infolist():
                if info.is_dir():
                    continue
                if info.flag_bits & 1:
                    raise ValueError(f"{path}/{info.filename}: is encrypted: unpack it with its password first")
                _check_size(f"{path}/{info.filename}", info.file_size)
                yield info.filename, archive.read(info)


def _check_size(path: str | PathLike, size: int) -> None:
    if size > LARGEST_FILE:
        raise ValueError(
            f"{path}: it unpacks to more than {LARGEST_FILE // 1_000_000} MB, too much for a record: unpack it, "
            "and give the files of the records"
        )
