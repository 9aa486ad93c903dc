"""Content of a file: its text in any usual encoding, or the kind of file if it is not a record."""

from __future__ import annotations

import codecs
import re
from os import PathLike, fspath
from pathlib import Path

from warpdyn.model.ground_motions.records.parsing.archives import Member, is_gzip, is_tar, zip_names
from warpdyn.model.ground_motions.records.parsing.not_a_record import NotARecordError

_UNPACK = "unpack it first, or give it to wd.records.read if it is a gzip, zip or tar file"
_ARRAY = "load its values and give them to wd.records.from_array(values, step, unit)"
_OBSPY = "read it with wd.records.from_obspy(obspy.read(path), unit=...)"
_AGAIN = "download the file again; the web site may need a login first"
_SHEET = "save its sheet as CSV and read it with wd.records.read_text(path, unit=...)"

# First bytes of files that are not text, the kind of file, and the remedy for the message.
_FIRST_BYTES: tuple[tuple[bytes, str, str], ...] = (
    (b"BZh", "a file compressed with bzip2", "unpack it first: bunzip2 FILE"),
    (b"\xfd7zXZ\x00", "a file compressed with xz", "unpack it first: unxz FILE"),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive", "unpack it first: 7z x FILE"),
    (b"Rar!\x1a\x07", "a RAR archive", "unpack it first: unrar x FILE"),
    (b"\x28\xb5\x2f\xfd", "a file compressed with zstd", "unpack it first: unzstd FILE"),
    (b"\x1f\x9d", "a file compressed with compress (.Z)", "unpack it first: uncompress FILE"),
    (b"\x04\x22\x4d\x18", "a file compressed with lz4", "unpack it first: lz4 -d FILE"),
    (b"%PDF", "a PDF document", "download the data file of the record instead"),
    (b"%!PS", "a PostScript document", "download the data file of the record instead"),
    (b"{\\rtf", "an RTF document", "save it as plain text"),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an old Excel or Word file", _SHEET),
    (b"\x89HDF\r\n\x1a\n", "an HDF5 file (ASDF, netCDF 4, MATLAB 7.3)", _ARRAY),
    (b"CDF\x01", "a netCDF file", "read it with xarray, and give it to wd.records.from_dataset"),
    (b"CDF\x02", "a netCDF file", "read it with xarray, and give it to wd.records.from_dataset"),
    (b"MATLAB 5.0", "a MATLAB file", f"{_ARRAY}; scipy.io.loadmat loads it"),
    (b"\x93NUMPY", "a NumPy file", f"{_ARRAY}; numpy.load loads it"),
    (b"\x89PNG", "a PNG image", "download the data file of the record instead"),
    (b"\xff\xd8\xff", "a JPEG image", "download the data file of the record instead"),
    (b"GIF8", "a GIF image", "download the data file of the record instead"),
    (b"\x55\x3a", "a SEG-2 file", _OBSPY),
    (b"\xc3\x40\xf1", "a SEG-Y file", _OBSPY),
    (b"SQLite format 3", "an SQLite database", _ARRAY),
)
# Patterns at the start of text files that are not records, the kind of file, and the remedy for the message.
_FIRST_TEXT = (
    (r"\s*(<!--.*?-->\s*)*<(!doctype\s+html|html|head|body)\b", "an HTML page, such as an error page", _AGAIN),
    (r"\s*<(\?xml|!doctype|\w+[\s>])", "an XML file", "download the file with the values of the record instead"),
    (r"version https://git-lfs\.github\.com", "a Git LFS pointer, not the file itself", "run: git lfs pull"),
    (r"\S*/annex/objects/", "a git-annex pointer, not the file itself", "run: git annex get FILE"),
    (r"\s*[{\[]\s*[\"{\[]", "a JSON file", f"{_ARRAY}; json.load loads it"),
    (r"WID2 ", "a GSE2 file", _OBSPY),
    (r"TIMESERIES \w+_", "an SLIST or TSPAIR file of seismic data", _OBSPY),
)
_LARGEST_HEAD = 4096  # number of characters at the start of a file that are compared with these patterns


def bytes_of(path: str | PathLike) -> bytes:
    """Return the bytes of a file, or of a file in an archive; raise an error if it does not exist or is empty."""
    if isinstance(path, Member):
        return path.data
    if not isinstance(path, str | PathLike):
        raise TypeError(f"path must be the name of a file, got {path!r}")
    if not fspath(path):
        raise ValueError("path is empty: give the name of a file")
    if Path(path).is_dir():
        raise IsADirectoryError(
            f"{path}: is a directory, not a file; to read the files in it, use wd.records.read_directory(path, "
            "pattern='*.AT2')"
        )
    if not Path(path).is_file():
        raise FileNotFoundError(f"{path}: there is no such file: correct the path")
    data = Path(path).read_bytes()
    if not data.strip(b"\x00\x1a \t\r\n"):
        filling = " (it contains only zero bytes)" if data.strip(b"\x00") != data else ""
        raise ValueError(f"{path}: the file is empty{filling}: copy or download it again")
    return data


def refuse_other_content(path: str | PathLike, data: bytes) -> None:
    """Raise a ValueError that names the kind of file and a remedy, if a file is not text."""
    names = zip_names(data)
    found: tuple[str, str] | None = None
    if names is not None:
        is_office, is_numpy = "[Content_Types].xml" in names, bool(names) and all(n.endswith(".npy") for n in names)
        found = (
            ("an Excel or Word file", _SHEET)
            if is_office
            else ("a NumPy file", f"{_ARRAY}; numpy.load loads it")
            if is_numpy
            else ("a zip archive", _UNPACK)
        )
    elif is_gzip(data):
        found = "a gzip file", _UNPACK
    elif is_tar(data):
        found = "a tar archive", _UNPACK
    elif is_miniseed(data):
        found = "a MiniSEED file", _OBSPY
    elif is_sac(data):
        found = "a SAC file", _OBSPY
    else:
        found = next(((what, remedy) for start, what, remedy in _FIRST_BYTES if data.startswith(start)), None)
    if found is None and b"\x00" in data.rstrip(b"\x00")[:_LARGEST_HEAD] and not _is_utf_16(data):
        found = "a binary file of unknown format", _ARRAY
    if found is not None:
        raise _refusal(path, *found)


def refuse_other_text(path: str | PathLike, text: str) -> None:
    """Raise a ValueError that names the kind of file and a remedy, if a text file contains no record."""
    for pattern, what, remedy in _FIRST_TEXT:
        if re.match(pattern, text[:_LARGEST_HEAD], re.IGNORECASE):
            raise _refusal(path, what, remedy)


def _refusal(path: str | PathLike, what: str, remedy: str) -> NotARecordError:
    return NotARecordError(f"{path}: this is {what}, not a record that this function reads: {remedy}")


def is_miniseed(data: bytes) -> bool:
    """Return whether a file, given by its bytes, has the format MiniSEED, version 2 or 3."""
    return re.match(rb"\d{6}[DRQM][ \x00]|MS\x03", data) is not None


def is_sac(data: bytes) -> bool:
    """Return whether a file, given by its bytes, is a binary SAC file: word 77 of its header is the version, 6 or 7."""
    if len(data) < 632:
        return False
    return any(
        int.from_bytes(data[304:308], order) in (6, 7) and len(data) >= 632 + 4 * int.from_bytes(data[316:320], order)
        for order in ("little", "big")
    )


def _is_utf_16(data: bytes) -> bool:
    """Return whether the bytes of a text are UTF-16: they begin with its byte order mark, or every second byte is 0."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return True
    head = data[: _LARGEST_HEAD - _LARGEST_HEAD % 2]
    odd, even = head[1::2], head[::2]
    return len(head) >= 8 and (
        (odd.count(0) > 0.9 * len(odd) and even.count(0) == 0)
        or (even.count(0) > 0.9 * len(even) and odd.count(0) == 0)
    )


def decoded(data: bytes) -> str:
    """Return the text that the bytes of a file encode, with LF at the end of every line.

    The encoding is UTF-8, UTF-16 or, otherwise, Latin-1. Lines may end with LF, CR LF, CR, LF CR or CR CR LF (written
    by programs that convert CR LF twice). Control-Z and zero bytes after the last line, which DOS programs add, are
    removed.
    """
    if _is_utf_16(data):
        is_big = data.startswith(codecs.BOM_UTF16_BE) or (data[0] == 0 and not data.startswith(codecs.BOM_UTF16_LE))
        text = data.decode("utf-16-be" if is_big else "utf-16-le", errors="replace").removeprefix("\ufeff")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1").removeprefix("\xef\xbb\xbf")
    if "\x1a" in text or "\x00" in text:
        text = re.sub(r"(?:(?<=\n)\x00|\x1a)[\x1a\x00\s]*\Z", "", text)
    if "\r" in text:
        is_lf_cr = re.match(r"[^\r\n]*\n\r", text) is not None and text.count("\r") == text.count("\n")
        text = text.replace("\n\r", "\n") if is_lf_cr else text
        text = re.sub(r"\r+\n|\r", "\n", text)
    return text
