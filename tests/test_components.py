"""Components of records: labels, header lines, contradictions, unknown components, and pairs of skew sensors."""

import gzip
import warnings
import zipfile

import network_files
import numpy as np
import pytest
import record_files
from scipy import signal

import warpdyn as wd
from warpdyn.model.ground_motions.records.components.file_names import record_and_component
from warpdyn.model.ground_motions.records.components.headers import component_of_header, record_of_header
from warpdyn.model.ground_motions.records.components.orientations import orientation
from warpdyn.model.ground_motions.records.parsing.archives import is_litter

pytestmark = pytest.mark.fast


@pytest.mark.parametrize(
    ("label", "stored", "kind", "azimuth"),
    [
        ("180", "180", "horizontal", 180.0),
        ("67", "067", "horizontal", 67.0),
        ("360.0", "360", "horizontal", 0.0),
        ("90 Deg", "090", "horizontal", 90.0),
        ("90deg", "090", "horizontal", 90.0),
        ("azimuth = 34.5", "034.5", "horizontal", 34.5),
        ("H090", "090", "horizontal", 90.0),
        ("N26W", "N26W", "horizontal", 334.0),
        ("S 00 E", "S00E", "horizontal", 180.0),
        ("S90W", "S90W", "horizontal", 270.0),
        ("N-S", "NS", "horizontal", 0.0),
        ("WE", "WE", "horizontal", 90.0),
        ("North-South", "NS", "horizontal", 0.0),
        ("South-North", "NS", "horizontal", 0.0),
        ("West-East", "EW", "horizontal", 90.0),
        ("Kuzey-Güney", "NS", "horizontal", 0.0),
        ("Do\u011fu-Bat\u0131", "EW", "horizontal", 90.0),
        ("Este-Oeste", "EW", "horizontal", 90.0),
        ("東西", "東西", "horizontal", 90.0),
        ("EW2", "EW2", "horizontal", 90.0),
        ("HNE", "HNE", "horizontal", 90.0),
        ("HN1", "HN1", "horizontal", None),
        ("BHZ00", "BHZ00", "vertical", None),
        ("LN", "LN", "horizontal", None),
        ("TR", "TR", "horizontal", None),
        ("T1", "T1", "horizontal", None),
        ("fault normal", "FAULTNORMAL", "horizontal", None),
        ("H2", "H2", "horizontal", None),
        ("V1", "V1", "vertical", None),
        ("UD2", "UD2", "vertical", None),
        ("Vertical (Z)", "VERTICAL", "vertical", None),
        ("Comp: up", "UP", "vertical", None),
        ("DWN", "DWN", "vertical", None),
        ("UPDO", "UPDO", "vertical", None),
        ("Düşey", "DUSEY", "vertical", None),
        ("上下", "上下", "vertical", None),
        ("H3", "H3", "unknown", None),
        ("400", "400", "unknown", None),
        ("N95E", "N95E", "unknown", None),
        ("river", "RIVER", "unknown", None),
        ("", "", "unknown", None),
    ],
)
def test_labels(label, stored, kind, azimuth):
    found = orientation(label)
    assert (found.label, found.kind, found.azimuth) == (stored, kind, azimuth)


@pytest.mark.parametrize(
    ("line", "label", "record"),
    [
        ("Imperial Valley-02, 5/19/1940, El Centro, 180", "180", "Imperial Valley-02, 5/19/1940, El Centro"),
        ("KOBE 01/16/95 2046, KJMA, 000 (USGS STATION 117)", "000", "KOBE 01/16/95 2046, KJMA"),
        ("ComalTX11-10-20, 10/20/2011, CCM, BHZ00", "BHZ00", "ComalTX11-10-20, 10/20/2011, CCM"),
        ("TAIWAN SMART1(5) 01/29/81, 05C00, DN", "DN", "TAIWAN SMART1(5) 01/29/81, 05C00"),
        ("Landers, Vertical, processed", "VERTICAL", "Landers, Vertical"),
        ("station = San Francisco, F component=   up", "UP", "station = San Francisco, F"),
        ("Chan  1: 90 Deg   (STA CHN:  1)", "090", ""),
        ("COMP N08W      9", "N08W", ""),
        ("COMP UP      9", "UP", ""),
        ("Component S16W  Longitudinal Accelerometer Axis", "S16W", ""),
        ("Dir.              E-W", "EW", ""),
        ("El Centro 1940 NS", "NS", "El Centro 1940"),
        ("quake N 21 E", "N21E", "quake N 21"),
        ("Somewhere, station 117", "", ""),
        ("Station 12 V", "", ""),
        ("PEER NGA STRONG MOTION DATABASE RECORD", "", ""),
    ],
)  # fmt: skip
def test_header_lines(line, label, record):
    assert component_of_header(line) == label
    assert record_of_header(line) == record


def at2(folder, name: str, title: str = "no component") -> None:
    values = "".join(f"{value:15.7E}\n" for value in np.sin(np.arange(8.0) + len(name)))
    content = f"PEER\n{title}\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS=  8, DT=  .0100 SEC\n{values}"
    (folder / name).write_text(content)


def test_the_header_comes_before_the_name(tmp_path):
    at2(tmp_path, "RSN626_WHITTIER.A_A-116-UP.AT2", "Whittier, 10/1/1987, LA - 116th St School, UP")
    at2(tmp_path, "quake90.AT2", "Somewhere, 1/1/2030, STA1, 137")
    motion = wd.records.read_at2(tmp_path / "RSN626_WHITTIER.A_A-116-UP.AT2")
    assert (motion.record, motion.component) == ("RSN626", "UP")
    motion = wd.records.read_at2(tmp_path / "quake90.AT2")
    assert (motion.record, motion.component) == ("Somewhere, 1/1/2030, STA1", "137")


@pytest.mark.parametrize(
    ("name", "title", "used", "selected"),
    [
        ("RSN1_X_ABC180.AT2", "X, ABC, UP", "UP", "vertical"),
        ("RSN1_X_ABC-UP.AT2", "X, ABC, 180", "UP", "vertical"),
        ("X_ABC_EW.AT2", "X, ABC, NS", "NS", "horizontal"),
    ],
)
def test_header_and_name_contradict_each_other(tmp_path, name, title, used, selected):
    """A record that either of them calls vertical is not read as horizontal."""
    at2(tmp_path, name, title)
    with pytest.warns(UserWarning, match=rf"in the header and .* in the file's name; '{used}' is used"):
        assert wd.records.read_at2(tmp_path / name).component == used
    with pytest.warns(UserWarning, match="in the header and"):
        assert len(wd.records.read_directory(tmp_path, components=selected)) == 1


def test_names_that_are_no_contradiction(tmp_path):
    """A station whose code ends in V, and a station's number."""
    for name, title in (("X_ABC1V.AT2", "X, ABC1V, 180"), ("arica0911131_1.AT2", "CHAN  1: EW")):
        at2(tmp_path, name, title)
        with warnings.catch_warnings(action="error"):
            assert wd.records.read_at2(tmp_path / name).component in ("180", "EW")


def test_unknown_components(tmp_path):
    """They count as horizontal, with a warning, only if no vertical record is in the folder."""
    at2(tmp_path, "alpha.AT2")
    at2(tmp_path, "beta.AT2")
    with pytest.warns(UserWarning, match="of 'alpha.AT2', 'beta.AT2' contains the component, .* they are read as hor"):
        assert len(wd.records.read_directory(tmp_path)) == 2
    at2(tmp_path, "gamma-UP.AT2")
    with pytest.raises(FileNotFoundError, match="is a horizontal component"):  # noqa: SIM117
        with pytest.warns(UserWarning, match="the vertical component may be among them, so they are left out"):
            wd.records.read_directory(tmp_path)
    at2(tmp_path, "gamma000.AT2")
    at2(tmp_path, "gamma090.AT2")
    with pytest.warns(UserWarning, match="they are left out"):
        assert [each.component for each in wd.records.read_directory(tmp_path)] == ["000", "090"]
    assert len(wd.records.read_directory(tmp_path, components="all")) == 5


def test_a_third_direction_of_one_sensor_is_not_horizontal(tmp_path):
    for channel in ("BH1", "BH2", "BH3"):
        at2(tmp_path, f"XX.STA..{channel}.AT2")
    with pytest.warns(UserWarning, match="they are left out"):
        assert [each.component for each in wd.records.read_directory(tmp_path)] == ["BH1", "BH2"]


LITTER = ("._RSN1_X_ABC180.AT2", ".DS_Store", "Thumbs.db", "desktop.ini", "RSN1_X_ABC180.AT2~", "#RSN1.AT2#",
          ".RSN1.AT2.swp", "RSN1_X_ABC180.AT2.bak", "~$RSN1.AT2", "RSN1_X_ABC180.AT2.part")  # fmt: skip


def test_litter_is_skipped(tmp_path):
    at2(tmp_path, "RSN1_X_ABC180.AT2")
    for name in LITTER:
        (tmp_path / name).write_bytes(b"\x00\x05\x16\x07\x00\x02\x00\x00Mac OS X")
        assert is_litter(name)
    assert is_litter("__MACOSX/records/RSN1_X_ABC180.AT2")
    assert not is_litter("records/RSN1_X_ABC180.AT2")
    for pattern in ("*.AT2", "*"):
        assert [each.name for each in wd.records.read_directory(tmp_path, pattern)] == ["RSN1_X_ABC180"]


def waves(i: int) -> np.ndarray:
    """Return values in gal that differ between files."""
    return 30 * np.random.default_rng(i).normal(size=200)


@pytest.mark.parametrize(
    ("pattern", "files", "horizontal", "vertical"),
    [
        ("*.v2", {f"CHAN{i}.V2": network_files.csmip_v2(waves(i), label=label)
                  for i, label in enumerate(("360 Deg", "Up", "90 Deg"))}, ["360", "090"], ["UP"]),
        ("MYG*", {f"MYG0011103111446.{suffix}": network_files.knet(waves(i), **{"Dir.": label})
                  for i, (suffix, label) in enumerate((("EW", "E-W"), ("NS", "N-S"), ("UD", "U-D")))},
         ["EW", "NS"], ["UD"]),
        ("*", {"a.asc": network_files.afad(np.column_stack([waves(i) for i in range(3)]))}, ["NS", "EW"], ["UD"]),
        ("*.asc", {f"XX.STA1..{channel}.ASC": record_files.esm(waves(i), STREAM=channel)
                   for i, channel in enumerate(("HNE", "HNN", "HNZ"))}, ["HNE", "HNN"], ["HNZ"]),
    ],
    ids=["CSMIP", "K-NET", "AFAD", "ESM"],
)  # fmt: skip
def test_directory_of_any_format(tmp_path, pattern, files, horizontal, vertical):
    for name, content in files.items():
        (tmp_path / name).write_text(content)
    with warnings.catch_warnings(action="error"):
        found = wd.records.read_directory(tmp_path, pattern)
        ups = wd.records.read_directory(tmp_path, pattern, components="vertical")
        whole = wd.records.read_directory(tmp_path, pattern, components="all")
    assert [each.component for each in found] == horizontal
    assert [each.component for each in ups] == vertical
    assert len(wd.records.pairs(found)) == 1
    same = [motion for name in files for motion in wd.records.read(tmp_path / name)]
    assert sorted((m.name, m.record, m.component) for m in whole) == sorted(
        (m.name, m.record, m.component) for m in same
    )
    for motion in same:
        (read,) = (each for each in whole if each.name == motion.name)
        np.testing.assert_array_equal(read.acceleration, motion.acceleration)


def test_directory_with_an_archive(tmp_path):
    """Names in the archive are compared, too, so that the vertical record is not read as horizontal."""
    with zipfile.ZipFile(tmp_path / "quake.zip", "w") as archive:
        for i, name in enumerate(("sta1EW.txt", "sta1NS.txt", "sta1UD.txt")):
            archive.writestr(name, record_files.table(waves(i)))
        archive.writestr("records/.DS_Store", b"\x00\x00\x00\x01Bud1" + bytes(200))
    found = wd.records.read_directory(tmp_path, "*.zip", unit="gal")
    assert [(each.record, each.component) for each in found] == [("sta1", "EW"), ("sta1", "NS")]
    np.testing.assert_allclose(found[1].acceleration, 0.01 * waves(1), rtol=0, atol=6e-9)  # 6 decimals of a gal


def test_a_gzip_file_is_read_whatever_its_name(tmp_path):
    path = tmp_path / "quake-EW.tmp.gz"
    path.write_bytes(gzip.compress(record_files.table(waves(0)).encode()))
    (motion,) = wd.records.read(path, unit="gal")
    np.testing.assert_allclose(motion.acceleration, 0.01 * waves(0), rtol=0, atol=6e-9)  # 6 decimals of a gal


def test_numbers_of_stations_in_names_of_text_files(tmp_path):
    for i in (45, 52):
        (tmp_path / f"TCU0{i}.txt").write_text(record_files.table(waves(i)))
    with pytest.warns(UserWarning, match=r"neither the header nor the name of 'TCU045.txt', 'TCU052.txt'"):
        found = wd.records.read_directory(tmp_path, "*.txt", unit="gal")
    assert [each.component for each in found] == ["", ""]


def test_directory_with_text_that_contradicts_its_name(tmp_path):
    (tmp_path / "quake-UP.txt").write_text("component N26W\ntime acceleration\n" + record_files.table(waves(1)))
    with pytest.warns(UserWarning, match="'N26W' in the header and 'UP' in the file's name; 'UP' is used"):
        (found,) = wd.records.read_directory(tmp_path, "*.txt", components="vertical", unit="gal")
    assert found.component == "UP"


def test_directory_whose_files_cannot_be_read(tmp_path):
    (tmp_path / "quake-EW.txt").write_text(record_files.table(waves(1)))
    (tmp_path / "quake-NS.txt").write_text(record_files.table(waves(2)))
    with pytest.raises(ValueError, match=r"quake-EW\.txt: text .* does not state the unit .*unit='g'"):
        wd.records.read_directory(tmp_path, "*.txt")
    with pytest.raises(ValueError, match=r"quake-EW\.txt: step=0\.02 s, but the times are 0\.01 s apart"):
        wd.records.read_directory(tmp_path, "*.txt", unit="gal", step=0.02)
    with pytest.raises(FileNotFoundError, match=r"matches '\*\.AT2'; it contains 2 files .* give pattern='\*\.txt'"):
        wd.records.read_directory(tmp_path)
    (tmp_path / "readme.txt").write_text("These are records\nof a station.\n")
    with pytest.raises(ValueError, match=r"readme\.txt: the format is unknown: .* give a pattern= that matches only"):
        wd.records.read_directory(tmp_path, "*.txt", unit="gal")
    at2(tmp_path, "RSN1_X_ABC180.AT2")
    with pytest.raises(ValueError, match=r"RSN1_X_ABC180\.AT2: unit is 'g', but this AT2 file states its unit"):
        wd.records.read_directory(tmp_path, unit="g")


def test_a_folder_of_other_formats_is_named(tmp_path):
    (tmp_path / ".DS_Store").write_bytes(b"1")
    with pytest.raises(FileNotFoundError, match=r"no file .* matches '\*.AT2': correct path or pattern=$"):
        wd.records.read_directory(tmp_path)
    (tmp_path / "X.NS").write_text("Origin Time")
    with pytest.raises(FileNotFoundError, match=r"it contains 1 file '\*\.NS': give pattern='\*\.NS' if these"):
        wd.records.read_directory(tmp_path)


def motion(component: str, seed: int = 0, record: str = "r") -> wd.GroundMotion:
    values = np.random.default_rng(seed).normal(size=300)
    return wd.GroundMotion(values, 0.01, f"{record} {component}", record=record, component=component)


@pytest.mark.parametrize(
    "labels",
    [
        ("N26W", "S64W"),
        ("LN", "TR"),
        ("L1", "T1"),
        ("NS", "WE"),
        ("003", "092"),
        ("h1", "H2"),
        ("north", "East"),
        ("a", "b"),
    ],
)
def test_pairs(labels):
    both = wd.records.pairs([motion(label, i) for i, label in enumerate(labels)])
    assert [[each.component for each in pair] for pair in both] == [list(labels)]


@pytest.mark.parametrize("vertical", ["UP", "up", "Vertical", "-UP", "V1", "UD2", "HNZ", "dn", "Z", "DWN", "U"])
def test_vertical_components_are_in_no_pair(vertical):
    ((first, second),) = wd.records.pairs([motion("EW"), motion(vertical, 1), motion("NS", 2)])
    assert (first.component, second.component) == ("EW", "NS")


def test_sensors_of_one_record():
    labels = ("EW1", "EW2", "NS1", "NS2", "UD1", "UD2")
    both = wd.records.pairs([motion(label, i) for i, label in enumerate(labels)])
    assert [[each.component for each in pair] for pair in both] == [["EW1", "NS1"], ["EW2", "NS2"]]
    # Each sensor has its own measure.
    motions = [motion(label, i) for i, label in enumerate(labels[:4])]
    values = wd.GeometricMean(wd.PeakGroundAcceleration()).values(motions)
    peaks = [each.peak_ground_acceleration for each in motions]
    # Square root and product: two roundings.
    np.testing.assert_allclose(values[:2], np.sqrt([peaks[0] * peaks[2], peaks[1] * peaks[3]]), rtol=4.5e-16)
    assert values.tolist() == [*values[:2], *values[:2]]


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        (("N", "N"), "are not 90 degrees apart: N and N"),
        (("L", "L"), "have the direction 'L'"),
        (("010", "040"), "are not 90 degrees apart: 010 and 040"),
        (("N", "", "UP"), "component '' of motion 'r ' may not be horizontal"),
        (("N", "E", "S", "W"), "must have 2 horizontal components, has 4.*give each instrument its own `record`"),
        (("HNE", "BHN"), "must have 2 horizontal components, has 1: 'r HNE'"),
    ],
)
def test_bad_pairs(labels, message):
    with pytest.raises(ValueError, match=message):
        wd.records.pairs([motion(label, i) for i, label in enumerate(labels)])


def test_far_from_perpendicular():
    with pytest.warns(UserWarning, match="are 65 degrees apart, not 90"):
        wd.records.pairs([motion("000"), motion("065", 1)])


def test_rotated_measures_of_skew_sensors():
    """By scipy: the same ground motion, recorded along 0 and 90 degrees, and along 20 and 100 degrees."""
    north, east = motion("000", 1), motion("090", 2)
    rows = [
        np.cos(np.radians(azimuth)) * north.acceleration + np.sin(np.radians(azimuth)) * east.acceleration
        for azimuth in (20, 100)
    ]
    skew = [
        wd.GroundMotion(row, 0.01, f"{i}", record="s", component=f"{20 + 80 * i:03d}") for i, row in enumerate(rows)
    ]
    w = 2 * np.pi / 0.5
    system = signal.lti([-1.0], [1.0, 2 * 0.05 * w, w**2])
    fine = 0.01 / 100 * np.arange(100 * 600)  # at a hundred times in each step, and three seconds after the record
    x, y = (
        signal.lsim(system, np.interp(fine, 0.01 * np.arange(300), each.acceleration, right=0.0), fine)[1]
        for each in (north, east)
    )
    truth = w**2 * max(np.abs(np.cos(t) * x + np.sin(t) * y).max() for t in np.radians(np.arange(180)))
    measure = wd.RotatedSpectralAcceleration(0.5, 0.05, 100)
    # As in tests/test_pairs.py: peaks between times that are a hundredth of a step apart.
    assert measure.values([north, east])[0] == pytest.approx(truth, rel=1.4e-6)
    # The directions are the same 180, whatever the first one is.
    assert measure.values(skew)[0] == pytest.approx(truth, rel=1.4e-6)


@pytest.mark.parametrize("label", ["N", "E", "Z", "SN", "SP", "H"])
def test_short_labels_within_a_name_are_no_component(label):
    # They may be initials of a place or an event.
    assert record_and_component(f"site_{label}_old.txt") == ("", "")
    assert record_and_component(f"{label}_quake.txt") == ("", "")
    assert record_and_component("site_NORTH_old.txt") == ("site old", "NORTH")


def test_record_and_component_with_header():
    assert record_and_component("RSN6_IMPVALL.I_I-ELC180", "UP")[1] == "UP"
    assert record_and_component("0111b.smc", "270") == ("", "270")
