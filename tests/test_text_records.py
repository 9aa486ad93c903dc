"""Reading of text files: columns, header lines, delimiters, times, and what is wrong with them."""

from pathlib import Path

import numpy as np
import pytest

import warpdyn as wd

pytestmark = pytest.mark.fast


def write(folder: Path, content: str, name: str = "record.AT2") -> Path:
    file = folder / name
    file.write_bytes(content.encode())
    return file


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
