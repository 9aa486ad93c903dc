"""Record files in other encodings and line ends, in archives, and files that contain something else."""

import builtins
import gzip
import io
import json
import tarfile
import zipfile
from pathlib import Path

import network_files
import numpy as np
import pytest
import record_files

import warpdyn as wd
from warpdyn.model.ground_motions.records.parsing import archives

pytestmark = pytest.mark.fast

VALUES = np.round(np.random.default_rng(5).normal(scale=40, size=103), 4)  # gal
TABLE = np.round(np.column_stack([VALUES, -VALUES / 2, VALUES[::-1]]), 4)
TEXTS = {
    "AT2": record_files.at2(VALUES / 980),
    "ESM": record_files.esm(VALUES),
    "COSMOS": record_files.cosmos(VALUES),
    "K-NET": network_files.knet(VALUES),
    "V1": network_files.csmip_v1(VALUES / 1000),
    "V2": network_files.csmip_v2(VALUES),
    "SMC": network_files.smc(VALUES),
    "GeoNet": network_files.geonet(10 * VALUES),
    "ASA": network_files.asa(TABLE),
    "AFAD": network_files.afad(TABLE),
}
ENCODINGS = {
    "CR LF": lambda text: text.replace("\n", "\r\n").encode(),
    "CR": lambda text: text.replace("\n", "\r").encode(),
    "CR CR LF": lambda text: text.replace("\n", "\r\r\n").encode(),
    "LF CR": lambda text: text.replace("\n", "\n\r").encode(),
    "UTF-8 with a mark": lambda text: b"\xef\xbb\xbf" + text.encode(),
    "UTF-16": lambda text: text.encode("utf-16"),
    "UTF-16 without a mark": lambda text: text.encode("utf-16-be"),
    "Latin-1": lambda text: text.replace("owhere", "owhére").encode("latin-1"),
    "control-Z": lambda text: text.replace("\n", "\r\n").encode() + b"\x1a" * 40,
    "control-Z and zeros": lambda text: text.encode() + b"\x1a" + b"\x00" * 100,
    "blanks at the ends of lines": lambda text: text.replace("\n", "   \n").encode(),
}


def write(folder: Path, content: str | bytes, name: str = "record.txt") -> Path:
    file = folder / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("name", TEXTS)
def test_encodings_and_line_ends(tmp_path, name, encoding):
    expected = wd.records.read(write(tmp_path, TEXTS[name]))
    found = wd.records.read(write(tmp_path, ENCODINGS[encoding](TEXTS[name])))
    assert [motion.component for motion in found] == [motion.component for motion in expected]
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_array_equal(a.acceleration, b.acceleration)


@pytest.mark.parametrize("ends", ["\r\r\n", "\r", "\r\n", "\n\r"])
def test_errors_name_the_line_whatever_ends_it(tmp_path, ends):
    """A reader of AT2 files refused correct files with CR CR LF, and named line 5 for line 3."""
    text = record_files.at2(VALUES / 980)
    motion = wd.records.read_at2(write(tmp_path, text.replace("\n", ends)))
    assert motion.acceleration.size == 103
    with pytest.raises(ValueError, match=r"txt:3: unknown unit 'X'"):
        wd.records.read_at2(write(tmp_path, text.replace("UNITS OF G", "UNITS OF X").replace("\n", ends)))
    lines = text.split("\n")
    lines[9] = lines[9].replace("E", "x", 1)
    with pytest.raises(ValueError, match=r"txt:10: .* is not a finite number"):
        wd.records.read_at2(write(tmp_path, ends.join(lines)))


ONE_COLUMN = [f"{value:.3f}" for value in VALUES]


@pytest.mark.parametrize(
    "line",
    ["#N/A", "#DIV/0!", "#NUM!", "", "  ", "# 0.123", "%0.123", "# a gap", "nan", "NaN", "-", "9999.000", "-9999"],
)
def test_a_missing_value_in_one_column(tmp_path, line):
    """Without times, a line that is passed over moves all later samples by a step."""
    file = write(tmp_path, "\n".join([*ONE_COLUMN[:20], line, *ONE_COLUMN[20:]]) + "\n")
    with pytest.raises(ValueError, match=r"txt:21: "):
        wd.records.read_text(file, unit="gal", step=0.01)
    with pytest.raises(ValueError, match=r"txt:21: "):
        wd.records.read(file, unit="gal", step=0.01)


@pytest.mark.parametrize("line", ["#N/A", "NaN", "N/A", "null"])
def test_a_missing_value_in_the_first_or_last_line(tmp_path, line):
    for lines in ([line, *ONE_COLUMN], [*ONE_COLUMN, line]):
        with pytest.raises(ValueError, match="is not a finite number"):
            wd.records.read_text(write(tmp_path, "\n".join(lines) + "\n"), unit="gal", step=0.01)


def test_lines_without_values_that_hide_none(tmp_path):
    """Blank lines and comments at both ends, and files with a blank line behind each value."""
    for lines in (["# gal", "", *ONE_COLUMN, "", "# end"], [each for value in ONE_COLUMN for each in (value, "")]):
        file = write(tmp_path, "\n".join(lines) + "\n")
        np.testing.assert_allclose(
            100 * wd.records.read_text(file, unit="gal", step=0.01).acceleration, VALUES, atol=5.1e-4
        )
    table = [f"{0.01 * i:.2f},{value}" for i, value in enumerate(ONE_COLUMN)]
    table[20:20] = ["# a comment", ""]
    assert wd.records.read_text(write(tmp_path, "\n".join(table) + "\n"), unit="gal").acceleration.size == 103
    table[20:23] = ["#N/A"]
    with pytest.raises(ValueError, match="txt:21: "):
        wd.records.read_text(write(tmp_path, "\n".join(table) + "\n"), unit="gal")


def zipped(files: dict[str, bytes]) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return content.getvalue()


def tarred(files: dict[str, bytes]) -> bytes:
    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w") as archive:
        for name, data in files.items():
            entry = tarfile.TarInfo(name)
            entry.size = len(data)
            archive.addfile(entry, io.BytesIO(data))
    return content.getvalue()


@pytest.mark.parametrize(("name", "component"), [("X.UD", "UD"), ("X.EW", "NS"), ("X-UP.txt", "UP"), ("X.NS", None)])
def test_k_net_files_with_another_direction_in_their_name(tmp_path, name, component):
    text = TEXTS["K-NET"]
    assert "N-S" in text
    if component is None:  # no contradiction, no warning
        assert [each.component for each in wd.records.read(write(tmp_path, text, name))] == ["NS"]
        return
    with pytest.warns(UserWarning, match=r"the component is 'NS' in the header and '.*' in the file's name"):
        assert [each.component for each in wd.records.read(write(tmp_path, text, name))] == [component]


V2, V3 = TEXTS["V2"].encode(), b"Response and Fourier amplitude spectra (86 periods)   for\nCorrected accelerogram\n"


@pytest.mark.parametrize(
    ("name", "content", "names"),
    [
        ("CE1.V2.gz", gzip.compress(V2), ["CE1 090"]),
        ("CE1.V2.gz", gzip.compress(V2[:999]) + gzip.compress(V2[999:]), ["CE1 090"]),
        ("a.zip", zipped({"CE1.V2": V2}), ["CE1 090"]),
        (
            "a.zip",
            zipped({"b/": b"", "b/CE1.V2": V2, "b/CE2.V2": V2, "__MACOSX/b/._CE1.V2": b"\x00\x05\x16"}),
            ["CE1 090", "CE2 090"],
        ),
        (
            "a.zip",
            zipped({"c.zip": zipped({"CE1.V2": V2}), "d.AT2.gz": gzip.compress(TEXTS["AT2"].encode())}),
            ["CE1 090", "d"],
        ),
        ("a.tar", tarred({"CE1.V2": V2}), ["CE1 090"]),
        ("a.tar.gz", gzip.compress(tarred({"CE1.V2": V2, "CE2.V2": V2})), ["CE1 090", "CE2 090"]),
    ],
)
def test_archives(tmp_path, name, content, names):
    motions = wd.records.read(write(tmp_path, content, name))
    assert [motion.name for motion in motions] == names
    expected = wd.records.read(write(tmp_path, V2))[0]
    np.testing.assert_array_equal(motions[0].acceleration, expected.acceleration)


def test_files_in_an_archive_that_are_no_records(tmp_path):
    file = write(tmp_path, zipped({"CE1.V2": V2, "CE1.V3": V3}), "a.zip")
    with pytest.warns(UserWarning, match=r"1 file in this archive left out: .*a.zip/CE1.V3: this is a file of resp"):
        assert len(wd.records.read(file)) == 1
    with pytest.raises(ValueError, match=r"no file in this archive is a record: .*CE1.V3"):
        wd.records.read(write(tmp_path, zipped({"CE1.V3": V3}), "b.zip"))
    with pytest.raises(ValueError, match=r"no file in this archive is a record: it is empty"):
        wd.records.read(write(tmp_path, zipped({}), "c.zip"))
    at2 = TEXTS["AT2"].encode()
    velocity = at2.replace(b"ACCELERATION TIME SERIES IN UNITS OF G", b"VELOCITY TIME SERIES IN UNITS OF CM/S")
    assert velocity != at2
    with pytest.warns(
        UserWarning, match=r"1 file in this archive left out: .*p.zip/q.VT2:3: the file contains a velocity"
    ):
        (motion,) = wd.records.read(write(tmp_path, zipped({"q.AT2": at2, "q.VT2": velocity}), "p.zip"))
    np.testing.assert_array_equal(motion.acceleration, wd.records.read(write(tmp_path, at2, "q.AT2"))[0].acceleration)
    table = b"-- Scaled Spectra used in Search --\nT (sec), pSa (g)\n0.01,0.30\n0.02,0.31\n0.03,0.32\n0.04,0.33\n"
    beside = {"q.AT2": at2, "_SearchResults.csv": table, "photo.png": b"\x89PNG\r\n\x1a\n", "terms.pdf": b"%PDF-1.4\n"}
    left_out = r"3 files .*_SearchResults.csv: text without .*give unit=.*: .*r.zip/photo.png, .*/terms.pdf. No action"
    with pytest.warns(UserWarning, match=left_out):
        assert len(wd.records.read(write(tmp_path, zipped(beside), "r.zip"))) == 1
    with pytest.raises(ValueError, match=r"no file in this archive is a record: .*s.zip/q.txt: .*give unit="):
        wd.records.read(write(tmp_path, zipped({"q.txt": table}), "s.zip"))
    damaged = V2.replace(b"/&", b"xx")
    with pytest.raises(ValueError, match=r"d.zip/CE1.V2:\d+: expected the end of the channel"):
        wd.records.read(write(tmp_path, zipped({"CE1.V2": damaged}), "d.zip"))


def test_damaged_archives(tmp_path, monkeypatch):
    whole = gzip.compress(V2)
    with pytest.raises(ValueError, match="the archive is damaged"):
        wd.records.read(write(tmp_path, whole[: len(whole) // 2], "a.V2.gz"))
    broken = bytearray(zipped({"CE1.V2": V2}))
    broken[len(broken) // 3] ^= 255
    with pytest.raises(ValueError, match="the archive is damaged"):
        wd.records.read(write(tmp_path, bytes(broken), "a.zip"))
    locked = bytearray(zipped({"CE1.V2": V2}))
    for start in (locked.index(b"PK\x03\x04") + 6, locked.index(b"PK\x01\x02") + 8):
        locked[start] |= 1
    with pytest.raises(ValueError, match="is encrypted: unpack it with its password first"):
        wd.records.read(write(tmp_path, bytes(locked), "a.zip"))
    monkeypatch.setattr(archives, "LARGEST_FILE", 1000)
    for name, content in (("a.zip", zipped({"CE1.V2": V2})), ("a.V2.gz", whole), ("a.tar", tarred({"CE1.V2": V2}))):
        with pytest.raises(ValueError, match="it unpacks to more than"):
            wd.records.read(write(tmp_path, content, name))
    nested = zipped({"CE1.V2": b"1"})
    for _ in range(4):
        nested = zipped({"a.zip": nested})
    with pytest.raises(ValueError, match="archives inside archives, more than 3 deep"):
        wd.records.read(write(tmp_path, nested, "a.zip"))


NUMPY = io.BytesIO()
np.savez(NUMPY, acceleration=VALUES)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"\n \r\n", "the file is empty"),
        (b"\x00" * 4096, r"the file is empty \(it contains only zero bytes\): copy or download it again"),
        (b"<!DOCTYPE html>\n<html><head><title>404</title>", "an HTML page, such as an error page.*login"),
        (b"\xef\xbb\xbf  <html>", "an HTML page"),
        (b'<?xml version="1.0"?><q:quakeml>', "an XML file"),
        (
            b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n",
            "a Git LFS pointer.*git lfs pull",
        ),
        (b"../.git/annex/objects/Xx/zK/SHA256E-s1--a.AT2", "a git-annex pointer.*git annex get"),
        (json.dumps({"dt": 0.01, "a": [1, 2]}).encode(), "a JSON file.*from_array"),
        (b"%PDF-1.7\n%\xe2\xe3", "a PDF document"),
        (b"{\\rtf1\\ansi NPTS= 3", "an RTF document"),
        (
            zipped({"[Content_Types].xml": b"<x/>", "xl/workbook.xml": b"<x/>"}),
            "an Excel or Word file.*as CSV.*read_text",
        ),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\x00" * 600, "an old Excel or Word file"),
        (NUMPY.getvalue(), "a NumPy file.*numpy.load"),
        (b"\x93NUMPY\x01\x00v\x00", "a NumPy file"),
        (b"MATLAB 5.0 MAT-file, Platform: GLNXA64", "a MATLAB file.*scipy.io.loadmat"),
        (b"\x89HDF\r\n\x1a\n\x00\x00", "an HDF5 file"),
        (b"CDF\x01\x00\x00", "a netCDF file"),
        (b"BZh91AY&SY", "compressed with bzip2.*bunzip2"),
        (b"\xfd7zXZ\x00\x00", "compressed with xz.*unxz"),
        (b"7z\xbc\xaf\x27\x1c\x00\x04", "a 7-Zip archive"),
        (b"Rar!\x1a\x07\x01\x00", "a RAR archive"),
        (b"\x28\xb5\x2f\xfd\x04", "compressed with zstd"),
        (b"\x1f\x9d\x90", r"compressed with compress \(.Z\)"),
        (b"\x89PNG\r\n\x1a\n", "a PNG image"),
        (b"WID2 2030/01/01", "a GSE2 file.*obspy.read"),
        (b"\x01\x02\x00\x00\x07\x00binary", "a binary file of unknown format"),
    ],
)
def test_content_that_is_no_record(tmp_path, content, message):
    """A file that was saved under a record's name is named, by every reader."""
    file = write(tmp_path, content, "RSN1_A.AT2")
    readers = (wd.records.read, wd.records.read_at2, wd.records.read_esm, wd.records.read_cosmos)
    for reader in (*readers, lambda path: wd.records.read_text(path, unit="g", step=0.01)):
        with pytest.raises(ValueError, match=message):
            reader(file)


def test_readers_of_one_format_name_archives_and_seismic_files(tmp_path):
    for content, message in (
        (gzip.compress(V2), "a gzip file.*wd.records.read"),
        (zipped({"CE1.V2": V2}), "a zip archive.*wd.records.read"),
        (tarred({"CE1.V2": V2}), "a tar archive.*wd.records.read"),
        (b"000001D STA1    HNNXX", "a MiniSEED file.*obspy.read"),
    ):
        with pytest.raises(ValueError, match=message):
            wd.records.read_at2(write(tmp_path, content, "a.AT2"))


@pytest.fixture
def trace():
    obspy = pytest.importorskip("obspy")
    header = {"network": "XX", "station": "STA1", "channel": "HNN", "delta": 0.01}
    return obspy.Trace(VALUES.astype(np.float32), header)


def test_sac(tmp_path, trace):
    file = tmp_path / "quake.sac"
    trace.write(str(file), "SAC")
    (motion,) = wd.records.read(file, unit="gal")
    np.testing.assert_allclose(100 * motion.acceleration, VALUES.astype(np.float32), rtol=4e-16)
    # The step of a SAC file is in single precision.
    assert motion.step == pytest.approx(0.01, rel=6e-8)
    assert (motion.name, motion.component, motion.source) == ("quake", "HNN", str(file))
    with pytest.raises(ValueError, match=r"a SAC file does not state the unit of its values: give unit="):
        wd.records.read(file)
    with pytest.raises(ValueError, match=r"step is 0.02 s, but this SAC file states 0.01 s"):
        wd.records.read(file, unit="gal", step=0.02)
    data = bytearray(file.read_bytes())
    data[632 + 4 * int(np.argmax(np.abs(VALUES))) + 3] ^= 0x40  # the exponent of the largest value
    with pytest.raises(ValueError, match="the header of this SAC file states an extremum of"):
        wd.records.read(write(tmp_path, bytes(data), "damaged.sac"), unit="gal")
    with pytest.raises(ValueError, match=r"obspy cannot read this SAC file|unknown format"):
        wd.records.read(write(tmp_path, bytes(data[:700]), "cut.sac"), unit="gal")
    for code, quantity in ((6, "displacements"), (7, "velocities")):
        trace.stats.sac = {"idep": code}
        trace.write(str(file), "SAC")
        with pytest.raises(ValueError, match=f"its values are {quantity}, not accelerations"):
            wd.records.read(file, unit="gal")


def test_miniseed(tmp_path, trace):
    file = tmp_path / "quake.mseed"
    trace.write(str(file), "MSEED")
    (motion,) = wd.records.read(file, unit="gal")
    np.testing.assert_allclose(100 * motion.acceleration, VALUES.astype(np.float32), rtol=4e-16)
    assert motion.component == "HNN"
    with pytest.raises(ValueError, match=r"a MiniSEED file does not state the unit of its values: give unit="):
        wd.records.read(file)
    trace.stats.channel = "BHZ"
    trace.write(str(file), "MSEED")
    with pytest.warns(UserWarning, match=r"quake\S*: trace XX.STA1..BHZ: channel BHZ is a seismometer, which measures"):
        assert wd.records.read(file, unit="gal", components="vertical")
    counts = trace.copy()
    counts.data = np.arange(200, dtype=np.int32)
    counts.write(str(file), "MSEED")
    with pytest.raises(ValueError, match=r"quake\.mseed: trace XX.STA1..BHZ: its values are whole numbers"):
        wd.records.read(file, unit="gal")
    later = trace.copy()
    later.stats.starttime += 100
    import obspy

    obspy.Stream([trace, later]).write(str(file), "MSEED")
    with pytest.raises(ValueError, match=r"the channel XX.STA1..BHZ has gaps: it has 2 parts"):
        wd.records.read(file, unit="gal")


def test_seismic_files_without_obspy(tmp_path, monkeypatch):
    imported = builtins.__import__

    def without_obspy(name, *arguments, **options):
        if name.partition(".")[0] == "obspy":
            raise ImportError(name)
        return imported(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", without_obspy)
    with pytest.raises(ModuleNotFoundError, match="this is a MiniSEED file, which obspy reads: pip install obspy"):
        wd.records.read(write(tmp_path, b"000001D STA1    HNNXX"), unit="g")
