"""`wd.records.read`: formats of strong-motion networks, recognised by their first lines."""

import warnings
from pathlib import Path

import network_files
import numpy as np
import pytest
import record_files

import warpdyn as wd

pytestmark = pytest.mark.fast

VALUES = np.round(np.random.default_rng(5).normal(scale=40, size=203), 4)  # gal
TABLE = np.round(np.column_stack([VALUES, -VALUES / 2, VALUES[::-1]]), 4)
TIMES = np.round(np.cumsum(np.random.default_rng(6).uniform(0.003, 0.008, 203)), 3)
# Text of each format, its accelerations [gal], and half a unit in the last place that the format prints.
FILES = {
    "AT2": (record_files.at2(VALUES / 980.665), VALUES, 1e-4),  # 7 digits
    "ESM": (record_files.esm(VALUES), VALUES, 0.0),
    "COSMOS": (record_files.cosmos(VALUES), VALUES, 0.0),
    "CSMIP V1": (network_files.csmip_v1(VALUES / 1000), 0.980665 * VALUES, 0.5e-6 * 980.665),
    "BHRC": (network_files.bhrc(VALUES / 98.0665), VALUES, 0.5e-5 * 98.0665),  # 6 digits of values below 10
    "CSMIP V2": (network_files.csmip_v2(VALUES), VALUES, 0.0),
    "SMC": (network_files.smc(VALUES), VALUES, 0.5e-2),  # 5 digits of values up to 999
    "GeoNet": (network_files.geonet(10 * VALUES), VALUES, 0.5e-2),
    "ASA": (network_files.asa(TABLE), VALUES, 0.0),
    "AFAD": (network_files.afad(TABLE), VALUES, 0.0),
    "CWA": (network_files.cwa(TABLE), VALUES, 0.5e-3),
}


def write(folder: Path, content: str | bytes, name: str = "record.txt") -> Path:
    file = folder / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


@pytest.mark.parametrize("name", FILES)
def test_values_of_each_format(tmp_path, name):
    text, gal, rounding = FILES[name]
    motion = wd.records.read(write(tmp_path, text))[0]
    np.testing.assert_allclose(100 * motion.acceleration, gal, rtol=4e-16, atol=rounding + 1e-12)
    assert motion.step == (0.005 if name not in ("AT2", "AFAD", "CWA") else 0.01)
    assert motion.source.endswith("record.txt")


@pytest.mark.parametrize(
    ("text", "components", "record"),
    [
        (network_files.knet(VALUES), ["NS"], "MYG001 2030/01/01 12:01:00"),
        (network_files.knet(VALUES, **{"Dir.": "3"}), ["UD1"], "MYG001 2030/01/01 12:01:00"),
        (network_files.bhrc(VALUES / 100), ["352", "V", "082"], "Nowhere 5520/01"),
        (network_files.csmip_v1(VALUES / 1000, label=" Up"), ["UP"], "89146 89146-L2500-12044.02"),
        (
            network_files.csmip_v1(VALUES / 1000, label="270 DegR   Location: Roof"),
            ["270"],
            "89146 89146-L2500-12044.02 Roof",
        ),
        (
            network_files.csmip_v2(VALUES, label="Long (Sta Chn: 4)    Location: Deck"),
            ["LONG"],
            "89146 89146-L2500-12044.02 Deck",
        ),
        (network_files.smc(VALUES, azimuth=90), ["360"], "Nowhere, 1295 Shafter, F 2030 01 01 0004 No Earthquake, CA"),
        (network_files.smc(VALUES, up=0), ["UP"], "Nowhere, 1295 Shafter, F 2030 01 01 0004 No Earthquake, CA"),
        (network_files.geonet(VALUES), ["N10E", "N80W", "UP"], "HSES 20300101_110256_HSES_20"),
        (network_files.asa(TABLE), ["V", "N00E", "N90E"], "ACAC 2030/01/01 18:14:18"),
        (network_files.afad(TABLE), ["NS", "EW", "UD"], "0921 01/01/2030 22:30:58.000000 (GMT)"),
        (network_files.cwa(TABLE), ["U", "N", "E"], "EAS 2030/01/01-23:50:29.000"),
    ],
)
def test_components_and_records(tmp_path, text, components, record):
    motions = wd.records.read(write(tmp_path, text))
    assert [motion.component for motion in motions] == components
    assert {motion.record for motion in motions} == {record}
    vertical = [name for name in components if name in ("UP", "UD", "UD1", "U", "V")]
    if vertical:
        assert [m.component for m in wd.records.read(write(tmp_path, text), components="vertical")] == vertical
    else:
        with pytest.raises(ValueError, match=r"no component of this file \(.*\) is vertical: give components='all'"):
            wd.records.read(write(tmp_path, text), components="vertical")


def test_several_channels(tmp_path):
    """Channels follow each other; a wide value leaves no blank before it, as in files of the COSMOS and V2 formats."""
    other = VALUES.copy()
    other[3] = -3456.78912
    text = network_files.csmip_v2(VALUES, channels=2) + network_files.csmip_v2(
        other, label="360 Deg", channel=2, channels=2
    )
    assert "-3456.78912" not in text  # 11 characters: printed as asterisks or, here, moved into its neighbour
    other[3] = -345.67891
    text = network_files.csmip_v2(VALUES, channels=2) + network_files.csmip_v2(
        other, label="360 Deg", channel=2, channels=2
    )
    first, second = wd.records.read(write(tmp_path, text))
    np.testing.assert_allclose(100 * second.acceleration, other, atol=0.5e-5)
    assert wd.records.pairs([first, second]) == [(first, second)]
    with pytest.warns(UserWarning, match="states 3 channels, the file contains 2: it may be truncated"):
        wd.records.read(write(tmp_path, text.replace("(2 Chns", "(3 Chns")))


def test_knet_agrees_with_obspy(tmp_path):
    """obspy keeps the offset of the instrument; the header's peak is without it."""
    obspy = pytest.importorskip("obspy")
    file = write(tmp_path, network_files.knet(VALUES), "MYG0010301011201.NS")
    (trace,) = obspy.read(file)
    expected = trace.data * trace.stats.calib
    (motion,) = wd.records.read(file)
    # Two ways to sum 203 values of 0.4 m/s2: their mean is rounded by at most 203 units in the last place.
    np.testing.assert_allclose(
        motion.acceleration, expected - expected.mean(), atol=203 * 1.2e-16 * np.abs(expected).max()
    )
    assert (motion.step, motion.component) == (trace.stats.delta, trace.stats.channel)


@pytest.mark.parametrize("make", [network_files.csmip_pairs, lambda v, t: network_files.smc(100 * v, times=t)])
def test_uneven_times_are_interpolated_if_a_step_is_given(tmp_path, make):
    values = np.round(VALUES / 100, 3)  # g/10 or gal / 100
    file = write(tmp_path, make(values, TIMES))
    with pytest.raises(ValueError, match=r"digitised at uneven times, 0\.003.* Give step= to interpolate it"):
        wd.records.read(file)
    (motion,) = wd.records.read(file, step=0.002)
    expected = np.interp(TIMES[0] + 0.002 * np.arange(motion.acceleration.size), TIMES, values)
    assert TIMES[-1] - TIMES[0] - motion.duration < 0.002
    factor = 0.980665 if make is network_files.csmip_pairs else 1.0
    # Rounding of print, 5 digits of an SMC file, also of its times, on slopes of up to 300 units per second.
    np.testing.assert_allclose(motion.acceleration, factor * expected, atol=2e-4 + 300 * 5e-5)
    with pytest.raises(ValueError, match=r"makes more than 10,000,000 values: give step= in seconds"):
        wd.records.read(file, step=1e-9)


def test_even_times_of_a_digitised_record(tmp_path):
    times = np.round(0.005 * np.arange(203), 3)
    (motion,) = wd.records.read(write(tmp_path, network_files.csmip_pairs(np.round(VALUES / 100, 3), times)))
    assert (motion.step, motion.acceleration.size) == (0.005, 203)


GEONET = network_files.geonet(10 * VALUES)
V1, V2, SMC = network_files.csmip_v1(VALUES / 1000), network_files.csmip_v2(VALUES), network_files.smc(VALUES)
ASA, AFAD, KNET = network_files.asa(TABLE), network_files.afad(TABLE), network_files.knet(VALUES)
RUNNING = network_files.running(VALUES)


def replaced(text: str, old: str, new: str) -> str:
    assert old in text, old
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        # Number of values, duration and step.
        (replaced(KNET, "100Hz", "200Hz"), r"txt:12: truncated: 203 values follow, but 2.03 s at 200Hz are 406"),
        (replaced(KNET, "100Hz", "0Hz"), r"txt:11: the sampling rate must be above 0"),
        (
            replaced(V1, "No. of Points =  203", "No. of Points =  204"),
            r"txt:11: the header states 204 points, but 203 follow",
        ),
        (replaced(V1, "at 200 pts", "at 100 pts"), r"txt:11: the header states a duration of 1.015 s, but 203 values"),
        (
            replaced(V1, " 203 Accel", " 195 Accel"),
            r"txt:53: expected the end of the channel|txt:53: this line must have 3",
        ),
        (replaced(V2, "spaced at  0.005", "spaced at  0.006"), r"txt:12: the header states a duration of 1.015 s"),
        (replaced(SMC, "0.2000000E+03", "0.1000000E+03"), "states an extremum at .* the sampling rate is wrong"),
        (
            replaced(SMC, "       203", "       202"),
            "more follows than the values that the header states|this line must have",
        ),
        (
            replaced(GEONET, "intervals of 0.005", "intervals of 0.010"),
            r"txt:10: the header states a duration of 1.0[12] s",
        ),
        (
            replaced(GEONET, "points  203", "points  213"),
            r"txt:10: 213 points, but value 34 of the whole numbers is 203",
        ),
        (replaced(ASA, "/0.005/0.005", "/0.005/0.004"), "200 samples per second, but the step is 0.004 s"),
        (replaced(ASA, "/203/203", "/203/204"), r"the channels have different numbers of values, \[203, 204\]"),
        (
            replaced(AFAD, "DATA          : 203", "DATA          : 204"),
            r"truncated: 203 values follow, not the 204",
        ),
        (replaced(AFAD, "(sec) : 0.01", "(sec) : 10.0"), r"a step of 10 s is not that of a strong-motion record"),
        # Peaks, units and quantities.
        (
            replaced(KNET, "Max. Acc. (gal)   ", "Max. Acc. (gal)   9"),
            r"txt:15: the header states a peak of 9.*, but the largest",
        ),
        (replaced(KNET, "(gal)/", "(mm)/"), r"txt:14: expected a scale factor such as 3920\(gal\)/6182761"),
        (replaced(V1, "Max  =   ", "Max  =   9"), r"txt:12: the header states a peak of 9"),
        (replaced(V1, "units of g ", "units of cm "), r"txt:28: unknown unit 'cm'"),
        (replaced(V2, "in cm/sec2.", "in m/sec2."), r"txt:18: the header states a peak of"),
        (
            replaced(V2, "points of accel", "points of veloc"),
            r"txt:46: the channel begins with vel..., not with its acceleration",
        ),
        (
            replaced(SMC, "2 CORRECTED ACCELEROGRAM", "3 VELOCITY"),
            "this SMC file contains velocity .*take the file '2 CORR",
        ),
        (replaced(SMC, "2 CORRECTED ACCELEROGRAM", "5 RESPONSE SPECTRA"), "this SMC file contains response spectra"),
        (replaced(GEONET, "Peak   ", "Peak   9"), r"txt:14: the header states a peak of 9"),
        (replaced(ASA, "Gal (cm/s/s)", "cm/s"), r"unknown unit 'cm/s'"),
        (
            replaced(ASA, "ACEL. MAX.(Gal), C1-C6                 : /", "ACEL. MAX.(Gal), C1-C6                 : /9"),
            "states a peak of 9",
        ),
        (replaced(AFAD, "(gal)", "(g)"), r"expected 'RAW PGA VALUES \(gal\)', which names the unit"),
        (replaced(AFAD, "(N-S) ", "(N-S) 9"), "the header states a peak of 9"),
        (
            replaced(record_files.esm(VALUES), "ACCELERATION", "DISPLACEMENT"),
            r"take the acceleration file of the same record",
        ),
        (
            record_files.cosmos(VALUES, unit="counts(50)").replace("acceleration pts", "raw accel. pts"),
            "raw values in counts, not acc",
        ),
        (
            replaced(record_files.cosmos(VALUES, unit="cm/sec(05)"), "acceleration pts", "velocity pts"),
            "but no accelerations: take",
        ),
        (
            replaced(record_files.at2(VALUES), "ACCELERATION", "VELOCITY"),
            r"txt:3: the file contains a velocity history.*take the .AT2 file",
        ),
        # Files that are cut, values that are missing, do not fit or are not numbers.
        (V2[: V2.index("points of veloc")], "expected the end of the channel|truncated"),
        (
            replaced(network_files.bhrc(VALUES / 100), "POINTS =  203", "POINTS =  204"),
            "this line must have 4 values|truncated",
        ),
        (V1[:-200], "truncated: the file ends at line|this line must have"),
        (SMC[:-15], "this line must have 3 values of 10 characters|truncated"),
        (GEONET[: len(GEONET) // 2], "truncated|this line must have|expected numbers in columns"),
        (ASA[:-40], "truncated|this line must have"),
        (KNET[:-30], "truncated: .* values follow"),
        (
            V2.replace(f"{VALUES[9]:10.5f}".replace("-0.", " -."), "*" * 10, 1),
            r"replaces a value that did not fit its field",
        ),
        (V2.replace(f"{VALUES[9]:10.5f}".replace("-0.", " -."), "       NaN", 1), "'NaN' is not a finite number"),
        (V2.replace(f"{VALUES[9]:10.5f}".replace("-0.", " -."), " " * 10, 1), "'' is not a finite number"),
        (AFAD.replace(f"{VALUES[9]:14.6f}", f"{99999.9:14.6f}", 1), r"marks a missing value|states a peak of"),
        (
            replaced(
                record_files.at2(VALUES / 980), record_files.fortran(VALUES[9] / 980), record_files.fortran(-9999.0)
            ),
            r"txt:6: the value -9999 \(1 time in the file\) marks a missing value, since all others are at most",
        ),
        (KNET.replace("Scale Factor", "Scale factor"), r"the header of this K-NET file lacks the line 'Scale Factor'"),
        (replaced(KNET, "N-S", "Q"), r"txt:13: the direction must be N-S, E-W, U-D or a number from 1 to 6, got 'Q'"),
        (replaced(SMC, "|ref - none", "ref - none"), r"txt:29: expected a comment"),
        (replaced(ASA, "NUMERO DE CANALES", "NUMERO DE CANALOS"), "this ASA file lacks the line 'NUMERO DE CANALES'"),
        (replaced(V1, "Uncorrected Acc", "\nUncorrected Acc").replace("/&", "", 1), "expected the end of the channel"),
    ],
)
def test_contradictions_and_damage(tmp_path, content, message):
    with pytest.raises(ValueError, match=message):
        wd.records.read(write(tmp_path, content))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            "Response and Fourier amplitude spectra (86 periods)   for\nCorrected accelerogram\n",
            "V3.*take the V2 or V1 file",
        ),
        ("* VOL1DS FILE:  5520/01\nInst Type = SSA-2\n", "truncated: the file ends at line 2"),
        (
            "#Earthquake Information\n#Origin Time(GMT+08): 2030\n 0.0 1.0\n",
            "the header of this CWA file lacks the line '#AmplitudeUnit'",
        ),
        ("hello\nworld\n", "the format is unknown: its first line is 'hello'"),
    ],
)
def test_text_without_accelerations(tmp_path, content, message):
    with pytest.raises(ValueError, match=message):
        wd.records.read(write(tmp_path, content))


def test_unit_and_step_are_compared_with_the_file(tmp_path):
    file = write(tmp_path, KNET)
    with pytest.raises(ValueError, match=r"unit is 'g', but this K-NET file states its unit: leave out unit="):
        wd.records.read(file, unit="g")
    with pytest.raises(ValueError, match=r"step is 0.02 s, but this K-NET file states 0.01 s: leave out step="):
        wd.records.read(file, step=0.02)
    assert wd.records.read(file, step=0.01)[0].step == 0.01
    with pytest.raises(ValueError, match=r"unknown components 'up'; allowed"):
        wd.records.read(file, components="up")
    with pytest.raises(FileNotFoundError, match="there is no such file: correct the path"):
        wd.records.read(tmp_path / "none.V2")
    with pytest.raises(IsADirectoryError, match="is a directory"):
        wd.records.read(tmp_path)
    with pytest.raises(TypeError, match="path must be the name of a file"):
        wd.records.read(None)


def test_number_and_step_before_two_columns(tmp_path):
    rows = "".join(f"{0.01 * i:9.3f}{value:12.4f}\n" for i, value in enumerate(VALUES))
    (motion,) = wd.records.read(write(tmp_path, f"203   0.01\n{rows}"), unit="gal")
    np.testing.assert_allclose(100 * motion.acceleration, VALUES, rtol=4e-16)
    with pytest.raises(ValueError, match=r"columns|times must increase evenly|states"):
        wd.records.read(write(tmp_path, f"204   0.01\n{rows}"), unit="gal")


@pytest.mark.parametrize("per_line", [1, 5, 8, 203])
@pytest.mark.parametrize("header", ["", "recorded by us\n", "203 0.01\n", "Station 5, 1994\nNPTS= 203, DT= .01\n"])
def test_running_values(tmp_path, per_line, header):
    lines = ["".join(f"{value:10.4f}" for value in VALUES[i : i + per_line]) for i in range(0, 203, per_line)]
    if per_line == 203 and header[:3] == "203":
        pytest.skip("two lines of numbers of different lengths are no record of a known layout")
    (motion,) = wd.records.read(write(tmp_path, header + "\n".join(lines) + "\n"), unit="gal", step=0.01)
    np.testing.assert_allclose(100 * motion.acceleration, VALUES, rtol=4e-16)
    if "0.01" in header or ".01" in header:
        (motion,) = wd.records.read(tmp_path / "record.txt", unit="gal")
        assert motion.step == 0.01


def test_running_values_that_touch(tmp_path):
    lines = ["".join(f"{value:8.3f}" for value in 2 * VALUES[i : i + 8]) for i in range(0, 203, 8)]
    assert any("-" in line.lstrip("-").replace(" -", "") for line in lines)
    (motion,) = wd.records.read(write(tmp_path, "\n".join(lines) + "\n"), unit="gal", step=0.01)
    np.testing.assert_allclose(100 * motion.acceleration, 2 * VALUES, atol=0.5e-3)
    exponents = "\n".join("".join(f"{value:14.6E}" for value in VALUES[i : i + 5]) for i in range(0, 203, 5)) + "\n"
    (motion,) = wd.records.read(write(tmp_path, exponents.replace("E", "D")), unit="gal", step=0.01)
    np.testing.assert_allclose(100 * motion.acceleration, VALUES, rtol=5e-7)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            replaced(RUNNING, "NPTS= 203", "NPTS= 204"),
            "truncated: 203 values follow, not the 204 that the header states",
        ),
        (replaced(RUNNING, "DT= 0.01", "DT= 0.02"), "the step is 0.01 s, but the header states 0.02 s"),
        (
            replaced(RUNNING, "Record of nowhere, component 90", "Velocity time history in cm/s"),
            "velocity",
        ),
        (RUNNING.replace(f"{VALUES[17]:10.4f}", "", 1), "txt:5: 7 values, but the first line has 8"),
        (RUNNING.replace(f"{VALUES[17]:10.4f}", "       nan", 1), "'nan' is not a finite number"),
        (
            RUNNING.replace(f"{VALUES[17]:10.4f}", "*" * 10, 1),
            "txt:5: asterisks replace a value that did not fit its field",
        ),
        (RUNNING.replace(".", ","), "seems to have decimal commas: replace the commas by points"),
        (
            "\n".join(RUNNING.split("\n")[2:]).replace(f"{VALUES[0]:10.4f}", "       nan", 1),
            "'nan' is not a finite number",
        ),
        (RUNNING[:-4], "truncated within its last value"),
    ],
)
def test_damaged_running_values(tmp_path, content, message):
    with pytest.raises(ValueError, match=message):
        wd.records.read(write(tmp_path, content), unit="gal", step=0.01)


def test_text_needs_its_unit(tmp_path):
    file = write(tmp_path, record_files.text(VALUES))
    with pytest.raises(ValueError, match=r"does not state the unit of its values: give unit=, such as unit="):
        wd.records.read(file)
    (motion,) = wd.records.read(file, unit="gal")
    assert motion.step == 0.01
    columns = "t;NS;EW;UD\n" + "".join(f"{0.01 * i:.2f};{v};{v};{v}\n" for i, v in enumerate(VALUES))
    with pytest.raises(ValueError, match=r"give acceleration_column=.* call wd.records.read_text"):
        wd.records.read(write(tmp_path, columns), unit="gal")


def test_a_sound_file_gives_no_warning(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for text, _, _ in FILES.values():
            wd.records.read(write(tmp_path, text))


def test_the_page_about_new_readers_shows_the_reader():
    source = (Path(wd.__file__).parent / "model/ground_motions/records/formats/cwa.py").read_text()
    page = Path(__file__).parents[1] / "docs/extending/reader.md"
    assert f"```python\n{source}```" in page.read_text()
