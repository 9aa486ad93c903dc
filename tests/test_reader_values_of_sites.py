"""Readers of motions and intensities at sites: correct results, and values and columns that they refuse."""

import json
import warnings

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.foundations.core.units import STANDARD_GRAVITY

pytestmark = pytest.mark.fast

GRID = "GP_file,Longitude,Latitude\na.csv,-122,37\nb.csv,-121.98,37\nc.csv,-121.96,37\n"


def grid(folder, *stations, text=GRID):
    """Write an EventGrid.csv with the text of its stations' files."""
    (folder / "EventGrid.csv").write_text(text)
    for name, of_station in zip("abc", stations, strict=False):
        (folder / f"{name}.csv").write_text(of_station)
    return folder


def file(folder, text, name="file.csv"):
    path = folder / name
    path.write_text(text)
    return path


# Units of grids of intensities (case 24).


@pytest.mark.parametrize(
    ("header", "unit", "factor"),
    [
        ("PGA,SA_0.3", "inps2", 0.0254),
        ("PGA,SA_0.3", "in/s2", 0.0254),
        ("PGA,SA_0.3", "mps2", 1.0),
        ("PGA,SA_0.3", "ftps2", 0.3048),
        ("PGA,SA_0.3", "g", STANDARD_GRAVITY),
        ("PGA [in/s2],SA_0.3 [in/s2]", None, 0.0254),
        ("PGA [g],SA(0.3) [g]", None, STANDARD_GRAVITY),
        ("PGA [cm/s2],SA_0.3 [cm/s2]", None, 0.01),
        ("PGA [inps2],SA_0.3", "inps2", 0.0254),
    ],
)
def test_intensities_are_in_the_unit_that_is_said(header, unit, factor, tmp_path):
    text = f"{header}\n3.0,7.5\n"
    found = wd.sites.read_intensity_grid(grid(tmp_path, text, text, text), unit)
    assert found["PGA"].values * STANDARD_GRAVITY == pytest.approx(3.0 * factor)
    assert found["SA(0.3)"].values * STANDARD_GRAVITY == pytest.approx(7.5 * factor)
    assert found["PGA"].attrs["units"] == "g"


@pytest.mark.parametrize("other", ["PGA [in/s2]\n0.1\n", "PGV [cm/s]\n0.1\n", "PGA [g],PGV [cm/s]\n0.1,1\n"])
def test_points_with_other_columns_are_refused(other, tmp_path):
    """A column of another unit or measure is not a missing value."""
    text = "PGA [g]\n0.1\n"
    with pytest.raises(ValueError, match=r"b\.csv has the columns .* and a\.csv has PGA \[g\]: all points must"):
        wd.sites.read_intensity_grid(grid(tmp_path, text, other, text))


def test_the_unit_of_intensities_has_no_default(tmp_path):
    text = "PGA,PGV [in/s],PGD [cm]\n0.3,10,20\n"
    folder = grid(tmp_path, text, text, text)
    with pytest.raises(ValueError, match=r"EventGrid.csv: column 'PGA' of a.csv does not give the unit.*unit='inps2'"):
        wd.sites.read_intensity_grid(folder)
    found = wd.sites.read_intensity_grid(folder, unit="g")
    assert found["PGV"].values == pytest.approx(0.254)
    assert found["PGV"].attrs["units"] == "m s-1"
    assert found["PGD"].values == pytest.approx(0.2)
    for header, message in (
        ("PGA [g]", "unit='inps2' is given"),
        ("PGA [furlong]", "unknown unit 'furlong'"),
        ("PGA,PGV [g]", "has the unit 'g'; allowed are m/s"),
        ("PGA,SA_0.3,SA(0.3)", r"SA\(0.3\) in two columns"),
        ("PGA,pga", "differ only in upper and lower case"),
        ("PGA, PGA", "'PGA' twice"),
    ):
        values = ",".join(["1"] * (header.count(",") + 1))
        text = f"{header}\n{values}\n"
        with pytest.raises(ValueError, match=message):
            wd.sites.read_intensity_grid(grid(tmp_path, text, text, text), "inps2")


@pytest.mark.parametrize("bad", ["nan", "NaN", "", "N/A"])
def test_a_station_with_nan_is_left_out(bad, tmp_path):
    good = "PGA,SA_0.3\n0.1,0.2\n0.3,0.4\n"
    folder = grid(tmp_path, good, good.replace("0.3,", f"{bad},"), good)
    with pytest.warns(
        UserWarning, match=r"EventGrid.csv: 1 \(b.csv\) of 3 grid points have NaN among their intensities"
    ):
        found = wd.sites.read_intensity_grid(folder, "g")
    assert found["longitude"].values.tolist() == [-122, -121.96]
    assert found["PGA"].values.tolist() == [[0.1, 0.1], [0.3, 0.3]]
    with pytest.raises(ValueError, match=r"all of 3 grid points"):
        wd.sites.read_intensity_grid(grid(tmp_path, *[good.replace("0.3,", f"{bad},")] * 3), "g")


def test_a_station_without_a_place_is_left_out(tmp_path):
    good = "PGA\n0.1\n"
    folder = grid(tmp_path, good, good, good, text=GRID.replace("-121.98", "nan"))
    with pytest.warns(UserWarning, match=r"1 \(b.csv\) of 3 grid points have no longitude or latitude"):
        assert wd.sites.read_intensity_grid(folder, "g")["PGA"].values.tolist() == [[0.1, 0.1]]


@pytest.mark.parametrize(
    ("value", "message"),
    [("-0.1", "of at least 0, got '-0.1'"), ("inf", "finite number"), ("x", "finite number"), ("1;2", "finite number")],
)
def test_impossible_intensities_are_refused_with_the_file(value, message, tmp_path):
    good = "PGA\n0.1\n"
    with pytest.raises(ValueError, match=message) as raised:
        wd.sites.read_intensity_grid(grid(tmp_path, good, good.replace("0.1", value), good), "g")
    assert str(tmp_path / "b.csv") in str(raised.value)


def test_motions_with_nan_leave_their_stations_out(tmp_path):
    wave = np.sin(np.arange(100.0)).tolist()
    for name, values in (("one", wave), ("two", [*wave[:-1], np.nan])):
        (tmp_path / f"{name}.json").write_text(json.dumps({"dT": 0.01, "data_x": values}))
    stations = ["TH_file,factor\none,1\n", "TH_file,factor\ntwo,1\n", "TH_file,factor\none,nan\n"]
    with pytest.warns(UserWarning, match=r"2 \(b.csv, c.csv\) of 3 grid points have NaN"):
        found = wd.sites.read_event_grid(grid(tmp_path, *stations), "g")
    assert found.points == ["a.csv"]
    assert [motion.name for motion in found.motions] == ["one x"]
    (tmp_path / "one.json").write_text('{"dT": -0.01, "data_x": [0, 1, 0]}')
    with pytest.raises(ValueError, match=r"one.json: "):
        wd.sites.read_event_grid(grid(tmp_path, *stations), "g")


# Files outside their folder.


def test_station_files_outside_the_folder_are_refused(tmp_path):
    folder, outside = tmp_path / "grid", tmp_path / "outside"
    folder.mkdir()
    outside.mkdir()
    text = "PGA\n0.1\n"
    (outside / "a.csv").write_text(text)
    grid(folder, text, text, text)
    (folder / "link.csv").symlink_to(outside / "a.csv")
    (folder / "linked").symlink_to(outside)
    for name in ("../outside/a.csv", str(outside / "a.csv"), "link.csv", "linked/a.csv", "x/../../outside/a.csv"):
        (folder / "EventGrid.csv").write_text(GRID.replace("a.csv", name))
        with pytest.raises(ValueError, match=r"EventGrid.csv names the file .* which is outside of"):
            wd.sites.read_intensity_grid(folder, "g")
    (folder / "below").mkdir()
    (folder / "below" / "a.csv").write_text(text)
    (folder / "EventGrid.csv").write_text(GRID.replace("a.csv", "below/a.csv"))
    assert wd.sites.read_intensity_grid(folder, "g").sizes["point"] == 3
    # The folder itself may be a link.
    (tmp_path / "alias").symlink_to(folder)
    assert wd.sites.read_intensity_grid(tmp_path / "alias", "g").sizes["point"] == 3


def test_motions_and_exposures_outside_the_folder_are_refused(tmp_path):
    folder = tmp_path / "grid"
    folder.mkdir()
    (tmp_path / "one.json").write_text(json.dumps({"dT": 0.01, "data_x": [0, 1, 0]}))
    with pytest.raises(ValueError, match=r"a.csv names the file '../one.json', which is outside"):
        wd.sites.read_event_grid(grid(folder, *["TH_file\n../one\n"] * 3), "g")
    file(tmp_path, "id,lon,lat,taxonomy\na,1,2,W1\n", "assets.csv")
    text = "<nrml><exposureModel><conversions/><assets>../assets.csv</assets></exposureModel></nrml>"
    with pytest.raises(ValueError, match=r"model.xml names the file '../assets.csv', which is outside"):
        wd.inventories.read_openquake(file(folder, text, "model.xml"))


# Ground-motion fields (case 25).
MESH = "site_id,lon,lat\n0,10,45\n1,10.1,45\n"


def field(folder, rows, mesh=MESH, **how):
    fields = file(folder, "event_id,gmv_PGA,site_id\n" + rows, "gmf.csv")
    return wd.sites.read_ground_motion_field(fields, file(folder, mesh, "mesh.csv"), **how)


def test_events_without_rows_count_as_zero(tmp_path):
    rows = "0,0.5,0\n3,0.75,0\n0,0.1,1\n"
    with pytest.warns(UserWarning, match=r"2 \(1, 2\) of 4 events have no row.*events=4"):
        found = field(tmp_path, rows)
    assert found["PGA"].mean("earthquake").values == pytest.approx([0.3125, 0.025])  # (0.5 + 0.75) / 4
    assert found["earthquake"].values.tolist() == ["0", "1", "2", "3"]
    with pytest.warns(UserWarning, match=r"6 \(1, 2, 4, ...\) of 8 events have no row"):
        assert field(tmp_path, rows, events=8)["PGA"].mean("earthquake").values == pytest.approx([0.15625, 0.0125])
    listed = file(tmp_path, "#,,\nevent_id,rup_id\n3,1\n0,1\n7,2\n", "events.csv")
    with pytest.warns(UserWarning, match=r"1 \(7\) of 3 events"):
        assert field(tmp_path, rows, events=listed)["PGA"].mean("earthquake").values == pytest.approx(
            [1.25 / 3, 0.1 / 3]
        )
    for given in ([3, 0], np.array([0, 3])):
        assert field(tmp_path, rows, events=given)["PGA"].mean("earthquake").values == pytest.approx([0.625, 0.05])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert field(tmp_path, "1,0.5,0\n0,0.2,1\n").sizes["earthquake"] == 2


@pytest.mark.parametrize(
    ("rows", "how", "message"),
    [
        ("0,0.5,0\n3,0.5,0\n", {"events": 3}, "the event 3 is not among the events, 0 to 2"),
        ("0,0.5,0\n", {"events": [0, 0]}, "ids of events must be whole numbers of at least 0, without repetition"),
        ("0,0.5,0\n", {"events": []}, "ids of events must be whole numbers"),
        ("0,0.5,0\n", {"events": [0.5]}, "ids of events must be whole numbers"),
        ("0,0.5,0\n", {"events": 0}, "events must be a whole number of at least 1"),
        ("0.5,0.5,0\n", {}, "the event .*0.5.* is not a whole number"),
        ("-1,0.5,0\n", {}, "the event .*-1.* is not a whole number"),
        ("x,0.5,0\n", {}, "the event 'x' is not a whole number"),
        (",0.5,0\n", {}, "row 1 .* has no event or no site"),
        ("0,0.5,\n", {}, "row 1 .* has no event or no site"),
        ("4000000000,0.5,0\n", {}, "give events="),
        ("0,nan,0\n", {}, "values of gmv_PGA must be finite numbers of at least 0, but 1 of"),
        ("0,inf,0\n", {}, "values of gmv_PGA must be finite numbers of at least 0, but 1 of"),
        ("0,0.5,0\n0,0.6,0\n", {}, "site 0 has event 0 twice"),
        ("0,0.5\n", {}, "line 2 has 2 values, but there are 3 columns"),
    ],
)
def test_fields_that_cannot_be_are_refused_with_the_file(rows, how, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        field(tmp_path, rows, **how)


def test_meshes_that_cannot_be_are_refused_with_the_file(tmp_path):
    for old, new, message in (
        ("10.1,45", "nan,45", r"mesh.csv: 1 of 2 grid points have a longitude outside"),
        ("10.1,45", "x,45", r"mesh.csv: 1 of 2 grid points have a longitude outside"),
        ("10,45\n1,10.1,45", "45,100\n1,45,101", "latitude outside -90 to 90 .* exchanged"),
        ("lon,lat", "lon,LON", "differ only in upper and lower case"),
    ):
        with pytest.raises(ValueError, match=message):
            field(tmp_path, "0,0.5,0\n0,0.5,1\n", MESH.replace(old, new))


# ShakeMaps.
SHAKEMAP = """<shakemap_grid event_id="made"><event event_id="made" magnitude="7.0"/>
<grid_specification lon_min="10" lat_min="45" lon_max="10.1" lat_max="45.1" nlon="2" nlat="2"/>
<grid_field index="1" name="LON" units="dd"/><grid_field index="2" name="LAT" units="dd"/>
<grid_field index="3" name="PGA" units="%g"/><grid_field index="4" name="MMI" units="intensity"/>
<grid_field index="5" name="SVEL" units="m/s"/><grid_field index="6" name="STDPGA" units="ln(%g)"/>
<grid_data>
10 45.1 21 6.1 300 0.5
10.1 45.1 22 6.2 300 0.5
10 45 23 6.3 300 0.5
10.1 45 24 6.4 300 0.5
</grid_data></shakemap_grid>
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("45.1 22 6", "45.1 -22 6", "1 of 4 values of PGA are impossible, the first is -22 at point 2"),
        ("45.1 22 6", "45.1 nan 6", "1 of 4 values of PGA are impossible, the first is nan"),
        ("45.1 22 6", "45.1 inf 6", "values of PGA are impossible, the first is inf"),
        (" 6.3 300", " 63 300", "values of MMI are impossible, the first is 63 at point 3; they must be from 0 to 12"),
        ("6.3 300", "6.3 0", "values of SVEL are impossible"),
        ("6.3 300 0.5", "6.3 300 -0.5", "values of STDPGA are impossible"),
        ("10 45.1 21", "45.1 10 21", "LON is from 10 to 45.1.*exchanged"),
        ("10 45.1 21", "nan 45.1 21", "grid_specification|longitude"),
        ('name="MMI" units="intensity"', 'name="pga" units="%g"', "'PGA' twice"),
        ('index="4"', 'index="3"', "indices of <grid_field> must be 1 to 6, each once"),
        ('index="4"', 'index="x"', "index of <grid_field> must be a whole number above 0, got 'x'"),
        ('nlon="2"', 'nlon="2.5"', "nlon of <grid_specification> must be a whole number"),
        ('nlon="2"', 'nlon="3"', "24 values, but its grid has 6 points of 6 fields"),
        ('lon_min="10"', 'lon_min="x"', "lon_min and lon_max of <grid_specification> must be numbers"),
        ('units="%g"', 'units="furlong"', "PGA has the unit 'furlong'"),
    ],
)
def test_shakemaps_that_cannot_be_are_refused_with_the_file(old, new, message, tmp_path):
    path = file(tmp_path, SHAKEMAP, "grid.xml")
    assert wd.sites.read_shakemap(path)["PGA"].values == pytest.approx(np.array([[0.21, 0.22, 0.23, 0.24]]))
    path.write_text(SHAKEMAP.replace(old, new, 1))
    with pytest.raises(ValueError, match=message) as raised:
        wd.sites.read_shakemap(path)
    assert str(path) in str(raised.value)


def test_a_shakemap_in_another_unit_is_warned_of(tmp_path):
    path = file(tmp_path, SHAKEMAP.replace('name="PGA" units="%g"', 'name="PGA" units="g"'), "grid.xml")
    with pytest.warns(
        UserWarning, match=r"grid.xml: the largest PGA is 24 g, and no earthquake is known with more than 5 g"
    ):
        wd.sites.read_shakemap(path)


def test_a_map_that_is_given_twice_is_refused(tmp_path):
    path = file(tmp_path, SHAKEMAP, "grid.xml")
    with pytest.raises(ValueError, match=r"grid.xml is the same map as .*grid.xml, so that its earthquake would count"):
        wd.sites.read_shakemap(path, path)
    other = file(tmp_path, SHAKEMAP.replace("10 45.1 21", "10 45.1 25"), "other.xml")
    assert wd.sites.read_shakemap(path, other).sizes["earthquake"] == 2
