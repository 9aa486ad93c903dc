"""Reading of text files: columns, header lines, delimiters, times, and what is wrong with them."""

import time
import warnings
from collections.abc import Callable
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
        "0,1\r\n.02,-2\r\n.04,3.5\r\n",
        "\ufeff  0.00 , 1.0\n  2.0D-2 , -2.0\n  4.0E-2 , 3.5\n",
        "5\t1\n5.02\t-2\n5.04\t3.5\n",
        "Time (s);Acceleration (m/s2)\n0;1\n0.02;-2\n0.04;3.5\n",
        "Time [s], m/s/s\n0,1\n0.02,-2\n0.04,3.5\n",
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
    content = "\n".join(f"{i / 128:.4f} {i % 7}" for i in range(2000)) + "\n"
    file = write(tmp_path, content)
    # 1e-4 s over 1999 steps is the rounding of both ends.
    assert wd.records.read_text(file, unit="g").step == pytest.approx(1 / 128, abs=1e-4 / 1999)
    assert wd.records.read_text(file, unit="g", step=1 / 128).step == 1 / 128


@pytest.mark.parametrize("lost", [1, 50, 98])
def test_a_lost_sample_is_noticed(tmp_path, lost):
    file = write(tmp_path, "\n".join(f"{0.01 * i:.2f} 1" for i in range(100) if i != lost) + "\n")
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
        ("1\n2\n", None, r"record.AT2: a single column has no times, so step= \[s\] must be given"),
        ("1\n2\n", 0.0, r"step must be a finite number above 0 s, got 0.0"),
        ("1\n2\n", -0.01, r"step must be a finite number above 0 s, got -0.01"),
        ("1\n2\n", float("nan"), r"step must be a finite number above 0 s, got nan"),
        ("1\n2\n", "0.01", r"step must be a finite number above 0 s, got '0.01'"),
        ("time,acc\n0,1\n1,2\n", None, r"record.AT2: column 0 counts the samples \(0, 1, ...\), so step \[s\] must"),
        ("0 1\n# c\n\n1 two\n", None, r"record.AT2:4: 'two' is not a finite number"),
        ("0 1\n1 nan\n", None, r"record.AT2:2: 'nan' is not a finite number"),
        ("0,1\n1,\n", None, r"record.AT2:2: '' is not a finite number"),
        ("0 1 2\n1 2 3\n", None, r"record.AT2:1: 3 columns.*: give acceleration_column="),
        ("0 1\n1\n", None, r"record.AT2:2: 1 column"),
        ("0\n1 2\n", 1.0, r"record.AT2:2: 2 columns"),
        ("0 1\n0 2\n0 3\n", None, r"times must increase .* sample 0 is at 0 s and sample 1 at 0 s"),
        ("0 1\n-1 2\n-2 3\n", None, r"times must increase .* sample 0 is at 0 s and sample 1 at -1 s"),
        ("0 1\n1 2\n1 3\n2 3\n", None, r"times must increase evenly by .* sample 1 is at 1 s and sample 2 at 1 s"),
        ("0 1\n.02 2\n.04 3\n", 0.01, r"step=0.01 s, but the times are 0.02 s apart: leave out step="),
    ],
)
def test_bad_text(tmp_path, content, step, message):
    with pytest.raises(ValueError, match=message):
        wd.records.read_text(write(tmp_path, content), unit="g", step=step)


def test_bad_unit(tmp_path):
    file = write(tmp_path, "1\n2\n")
    for unit in ("furlong/s2", "", None):
        with pytest.raises(ValueError, match=r"unknown unit .*, allowed are 'm/s2', 'm s-2', 'cm/s2', .*'gal', 'g'"):
            wd.records.read_text(file, unit=unit, step=0.01)
        with pytest.raises(ValueError, match=r"motion 'A': unknown unit .*, allowed are"):
            wd.records.from_array([1.0, 2.0], 0.01, unit, "A")


# Columns


def test_columns_of_a_table(tmp_path):
    """The same numbers, however they are laid out."""
    names, rows = ["time", "NS", "EW"], [[0.0, 1.5, -2.25], [0.01, -3.5, 4.0], [0.02, 0.5, 6.5]]
    for content, options in (
        ("Station 12\n\ntime NS EW\n0.00 1.5 -2.25\n0.01 -3.5 4.0\n0.02 0.5 6.5\n", {"header_lines": 3}),
        ("# time NS EW\n0.00 1.5 -2.25\n0.01 -3.5 4.0\n\n0.02 0.5 6.5\n", {}),
        ('"time","NS","EW"\n0.00,1.5,-2.25\n0.01,-3.5,4.0\n0.02,0.5,6.5\n', {}),
        ("time;NS;EW\n0.00;1.5;-2.25\n0.01;-3.5;4.0\n0.02;0.5;6.5\n", {}),
        ("time;NS;EW\n0,00;1,5;-2,25\n0,01;-3,5;4,0\n0,02;0,5;6,5\n", {"decimal_comma": True}),
        ("time\tNS\tEW\n0,00\t1,5\t-2,25\n0,01\t-3,5\t4,0\n0,02\t0,5\t6,5\n", {"decimal_comma": True}),
        ("time|NS|EW\n0.00|1.5|-2.25\n0.01|-3.5|4.0\n0.02|0.5|6.5\n", {"delimiter": "|"}),
    ):
        file = write(tmp_path, content, "table.csv")
        for column, name in enumerate(names[1:], start=1):
            for chosen in ((column, 0), (name, "time")):
                motion = wd.records.read_text(
                    file, unit="m/s2", acceleration_column=chosen[0], time_column=chosen[1], **options
                )
                assert motion.acceleration.tolist() == [row[column] for row in rows]
                assert motion.step == 0.01


def test_accelerations_side_by_side(tmp_path):
    """Without a column of times, no column is taken for them."""
    file = write(tmp_path, "1.5 -2.5\n3.5 4.5\n")
    motion = wd.records.read_text(file, unit="m/s2", acceleration_column=0, step=0.01)
    assert motion.acceleration.tolist() == [1.5, 3.5]


@pytest.mark.parametrize(
    ("content", "options", "message"),
    [
        ("0 1 2\n1 2 3\n", {"acceleration_column": 3}, "acceleration_column must be at most 2, counted from 0, got 3"),
        ("0 1 2\n1 2 3\n", {"acceleration_column": -1}, "acceleration_column must be a whole number of at least 0"),
        (
            "t NS\n0 1\n1 2\n",
            {"acceleration_column": "NZ"},
            r"'NZ' is not the name of one column.*the names are \(t, NS",
        ),
        ("0 1\n1 2\n", {"acceleration_column": "NS"}, "'NS' is not .*there is no line of names before the numbers"),
        ("0 1 2\n1 2 3\n", {"acceleration_column": 1, "time_column": 1}, "are the same column"),
        ("0 1 2\n1 2 3\n", {"time_column": 0}, "3 columns.*: give acceleration_column="),
        (
            "0,12\n0,13\n",
            {"step": 0.01},
            r"AT2:1: '0,12' may be a number with a decimal comma .*decimal_comma=True.* or .*delimiter",
        ),
        ("0,01 0,12\n0,02 -,13\n", {}, r"AT2:1: '0,01 0,12' may be a number with a decimal comma"),
        ("0,01;0,12\n0,02;0,13\n", {}, r"AT2:1: '0,01;0,12' seems to have decimal commas: give decimal_comma=True"),
        ("t,a\n0,01,0,12\n0,02,0,13\n", {}, r"AT2:2: 4 columns, but 2 names .* decimal commas. Save the file with"),
        ("0,01;0,12\n0.02;0,13\n", {"decimal_comma": True}, "AT2:2: has a decimal point, but decimal_comma"),
        ("1 2\n", {"delimiter": "ab"}, "delimiter must be one character that is not part of a number, got 'ab'"),
        ("1 2\n", {"delimiter": "."}, "delimiter must be one character"),
        ("1,2\n", {"delimiter": ",", "decimal_comma": True}, "remove decimal_comma="),
        ("t a\nt a\n", {}, "at least 2 samples, found 0"),
        ("O.1 1\n0.2 2\n", {}, "AT2:1: 'O.1' is not a finite number"),
        ("O.1\n0.2\n0.3\n", {"step": 0.01}, "AT2:1: 'O.1' is not a finite number"),
        ("nan\n0.2\n0.3\n", {"step": 0.01}, "AT2:1: 'nan' is not a finite number"),
        ("0 5\n5 6\n10 7\n", {"time_unit": "us"}, "unknown time_unit 'us'"),
        ("time_(ms) a\n0 5\n5 6\n10 7\n", {}, r"the times are in 'time_\(ms\)': give time_unit='ms'"),
        ("1 5\n2 6\n3 7\n", {}, r"column 0 counts the samples \(1, 2, ...\), so step \[s\] must be given"),
    ],
)
def test_bad_columns(tmp_path, content, options, message):
    with pytest.raises(ValueError, match=message):
        wd.records.read_text(write(tmp_path, content), unit="g", **options)


def test_index_and_milliseconds(tmp_path):
    index = write(tmp_path, "1 5\n2 6\n3 7\n")
    assert wd.records.read_text(index, unit="g", step=0.02).step == 0.02
    assert wd.records.read_text(index, unit="g", time_unit="s").step == 1.0
    milliseconds = write(tmp_path, "0 5\n5 6\n10 7\n")
    assert wd.records.read_text(milliseconds, unit="g", time_unit="ms").step == 0.005
    with pytest.warns(UserWarning, match="5 s apart, too far for a record: give time_unit='ms'"):
        assert wd.records.read_text(milliseconds, unit="g").step == 5.0
    with warnings.catch_warnings(action="error"):
        wd.records.read_text(milliseconds, unit="g", time_unit="s")


def shaken(format_of: Callable[[float, float], str], count: int = 60) -> str:
    values = np.random.default_rng(1).normal(size=count)
    return "".join(format_of(0.01 * i, value) + "\n" for i, value in enumerate(values))


@pytest.mark.parametrize("digits", [1, 3, 5, 6, 7])
def test_cut_in_its_last_value(tmp_path, digits):
    content = shaken(lambda t, a: f"{t:.2f},{a:.6f}")
    wd.records.read_text(write(tmp_path, content), unit="g")
    with pytest.raises(ValueError, match=r"truncated within its last value|is not a finite number|columns"):
        wd.records.read_text(write(tmp_path, content[: -1 - digits]), unit="g")


def test_damaged_number(tmp_path):
    content = shaken(lambda t, a: f"{t:.2f},{a:.6f}")
    lines = content.split("\n")
    for damage in (lambda text: text.replace(".", ""), lambda text: text[:-1], lambda text: text + "0"):
        time_text, value = lines[20].split(",")
        damaged = "\n".join([*lines[:20], f"{time_text},{damage(value)}", *lines[21:]])
        with pytest.warns(UserWarning, match=r"AT2:21: '.*' is written in another form than the column's other"):
            wd.records.read_text(write(tmp_path, damaged), unit="g")


def test_lost_sign(tmp_path):
    content = shaken(lambda t, a: f"{t:8.2f}{a:14.6f}")
    lines = content.split("\n")
    row = next(i for i, line in enumerate(lines) if i > 5 and "-" in line)
    damaged = "\n".join([*lines[:row], lines[row].replace("-", ""), *lines[row + 1 :]])
    with pytest.warns(UserWarning, match=rf"AT2:{row + 1}: the values of this line are not in the columns"):
        wd.records.read_text(write(tmp_path, damaged), unit="g")


@pytest.mark.parametrize("format_of", [lambda t, a: f"{t:.2f},{a:.6f}", lambda t, a: f"{t:.2f} {a:.6f}"])
def test_a_blank_in_the_place_of_a_sign(tmp_path, format_of):
    lines = shaken(format_of).split("\n")
    row = next(i for i, line in enumerate(lines) if i > 5 and "-" in line)
    damaged = "\n".join([*lines[:row], lines[row].replace("-", " "), *lines[row + 1 :]])
    with pytest.warns(UserWarning, match=rf"AT2:{row + 1}: the values of this line are not in the columns"):
        wd.records.read_text(write(tmp_path, damaged), unit="g")


@pytest.mark.parametrize(
    "format_of",
    [
        lambda t, a: f"{t:.2f} {a:12.6f}",
        lambda t, a: f"{t:.2f}, {a:.6f}",
        lambda t, a: f"{t} {a}",
        lambda t, a: f"{t:g},{a:g}",
        lambda t, a: f"{round(t, 4)};{round(a, 3)}",
        lambda t, a: f"{t:.2f}\t{0 if abs(a) < 0.3 else f'{a:.5f}'}",
    ],
)
def test_sound_files_warn_of_nothing(tmp_path, format_of):
    """1,010 samples of .01 s: the times of the last ten have one more digit."""
    with warnings.catch_warnings(action="error"):
        wd.records.read_text(write(tmp_path, shaken(format_of, 1010)), unit="g")


def running(count: int) -> np.ndarray:
    """Return a record of .01 s with vibrations of up to 8 Hz."""
    time, random = 0.01 * np.arange(count), np.random.default_rng(2)
    return sum(
        np.sin(2 * np.pi * f * time + p)
        for f, p in zip(random.uniform(0.5, 8, 20), random.uniform(0, 2 * np.pi, 20), strict=True)
    )


@pytest.mark.parametrize("options", [{}, {"acceleration_column": 0}, {"acceleration_column": 0, "header_lines": 4}])
@pytest.mark.parametrize("width", [2, 5, 8])
def test_values_that_run_on_are_no_columns(tmp_path, width, options):
    rows = running(50 * width).reshape(-1, width)
    body = "".join("".join(f"{value:14.6e}" for value in row) + "\n" for row in rows)
    # The last line of the header has as many words as some files have values a line.
    file = write(tmp_path, "PEER\nA quake\nACCELERATION IN UNITS OF G\nNPTS= N, DT= s SEC,\n" + body)
    if width == 2 and not options:  # two columns are times and accelerations
        with pytest.raises(ValueError, match="times must increase"):
            wd.records.read_text(file, unit="g")
        return
    with pytest.raises(ValueError, match=rf"AT2:5: .* {width} successive .* every {width}th .*skiprows=4"):
        wd.records.read_text(file, unit="g", step=0.01, **options)


def test_a_short_last_line_is_no_lost_column(tmp_path):
    with pytest.raises(
        ValueError,
        match=r"AT2:2: 1 column, .* 3: correct the line, .* successive values, "
        "use .* from_array",
    ):
        wd.records.read_text(write(tmp_path, "1 2 3\n4\n"), unit="g", step=0.01, acceleration_column=0)


def test_columns_side_by_side_do_not_run_on(tmp_path):
    """Three components, and the floors of a building that nearly move together."""
    component, floors = running(1000), np.linspace(0.3, 1.0, 6)
    for table in (np.stack([component, np.roll(component, 300), np.roll(component, 600)]), np.outer(floors, component)):
        np.savetxt(tmp_path / "table.txt", table.T)
        motion = wd.records.read_text(tmp_path / "table.txt", unit="m/s2", step=0.01, acceleration_column=1)
        np.testing.assert_array_equal(motion.acceleration, table[1])


def test_a_last_line_without_a_newline(tmp_path):
    for ends_with, warns in (("0.5", False), ("-0.125", False), ("0", True)):
        file = write(tmp_path, "0.25\n-0.5\n0.125\n" + ends_with)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            motion = wd.records.read_text(file, unit="m/s2", step=0.01)
        assert motion.acceleration[-1] == float(ends_with)
        assert bool(caught) == warns
        assert all("fewer characters than any other" in str(each.message) for each in caught)


@pytest.mark.thorough
@pytest.mark.parametrize("columns", [2, 3])
def test_speed(tmp_path, columns):
    """Reading with all its checks takes about twice as long as numpy.loadtxt, which checks next to nothing.

    It was 1.4 to 2.5 times as long on two cores that did other work, which moves the figure by a half: the bound is to
    notice a reader that checks each number separately, which took 6 to 13 times as long.
    """
    count = 200_000
    values = np.random.default_rng(0).normal(size=(count, columns))
    values[:, 0] = 0.005 * np.arange(count)
    np.savetxt(tmp_path / "table.txt", values, fmt=["%.3f", *["%.7e"] * (columns - 1)])

    def quickest(read: Callable[[], object]) -> float:
        times = []
        for _ in range(7):
            start = time.perf_counter()
            read()
            times.append(time.perf_counter() - start)
        return min(times)

    ours = quickest(
        lambda: wd.records.read_text(tmp_path / "table.txt", unit="g", acceleration_column=1, time_column=0)
    )
    assert ours < 4 * quickest(lambda: np.loadtxt(tmp_path / "table.txt"))
