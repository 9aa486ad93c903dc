"""Readers of inventories, sites, hazard and other tools' files: values and columns that cannot be, and the correct ones."""

import json
import warnings

import numpy as np
import pandas as pd
import pytest

import warpdyn as wd
from warpdyn.core.units import STANDARD_GRAVITY

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


def test_the_unit_of_intensities_has_no_default(tmp_path):
    text = "PGA,PGV [in/s],PGD [cm]\n0.3,10,20\n"
    folder = grid(tmp_path, text, text, text)
    with pytest.raises(ValueError, match=r"EventGrid.csv: column 'PGA' of a.csv does not say the unit.*unit='inps2'"):
        wd.sites.read_intensity_grid(folder)
    found = wd.sites.read_intensity_grid(folder, unit="g")
    assert found["PGV"].values == pytest.approx(0.254)
    assert found["PGV"].attrs["units"] == "m s-1"
    assert found["PGD"].values == pytest.approx(0.2)
    for header, message in (
        ("PGA [g]", "unit='inps2' is another"),
        ("PGA [furlong]", "unknown unit 'furlong'"),
        ("PGA,PGV [g]", "has the unit 'g'; allowed are m/s"),
        ("PGA,SA_0.3,SA(0.3)", r"SA\(0.3\) in two columns"),
        ("PGA,pga", "differ in upper and lower case"),
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
    with pytest.raises(ValueError, match="all of 3 grid points"):
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
    with pytest.raises(ValueError, match="one.json: "):
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
        with pytest.raises(ValueError, match="EventGrid.csv names the file .* which lies outside its folder"):
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
    with pytest.raises(ValueError, match=r"a.csv names the file '../one.json', which lies outside"):
        wd.sites.read_event_grid(grid(folder, *["TH_file\n../one\n"] * 3), "g")
    file(tmp_path, "id,lon,lat,taxonomy\na,1,2,W1\n", "assets.csv")
    text = "<nrml><exposureModel><conversions/><assets>../assets.csv</assets></exposureModel></nrml>"
    with pytest.raises(ValueError, match="model.xml names the file '../assets.csv', which lies outside"):
        wd.inventories.read_openquake(file(folder, text, "model.xml"))


# Ground-motion fields (case 25).
MESH = "site_id,lon,lat\n0,10,45\n1,10.1,45\n"


def field(folder, rows, mesh=MESH, **how):
    fields = file(folder, "event_id,gmv_PGA,site_id\n" + rows, "gmf.csv")
    return wd.sites.read_ground_motion_field(fields, file(folder, mesh, "mesh.csv"), **how)


def test_events_without_rows_count_as_zero(tmp_path):
    rows = "0,0.5,0\n3,0.75,0\n0,0.1,1\n"
    with pytest.warns(UserWarning, match=r"2 of 4 events \(1, 2\) have no row.*events=4"):
        found = field(tmp_path, rows)
    assert found["PGA"].mean("earthquake").values == pytest.approx([0.3125, 0.025])  # (0.5 + 0.75) / 4
    assert found["earthquake"].values.tolist() == ["0", "1", "2", "3"]
    with pytest.warns(UserWarning, match=r"6 of 8 events \(1, 2, 4, ...\) have no row"):
        assert field(tmp_path, rows, events=8)["PGA"].mean("earthquake").values == pytest.approx([0.15625, 0.0125])
    listed = file(tmp_path, "#,,\nevent_id,rup_id\n3,1\n0,1\n7,2\n", "events.csv")
    with pytest.warns(UserWarning, match=r"1 of 3 events \(7\)"):
        assert field(tmp_path, rows, events=listed)["PGA"].mean("earthquake").values == pytest.approx(
            [1.25 / 3, 0.1 / 3]
        )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert field(tmp_path, "1,0.5,0\n0,0.2,1\n").sizes["earthquake"] == 2


@pytest.mark.parametrize(
    ("rows", "how", "message"),
    [
        ("0,0.5,0\n3,0.5,0\n", {"events": 3}, "the event 3 is not among the events, 0 to 2"),
        ("0,0.5,0\n", {"events": 0}, "events must be a whole number of at least 1"),
        ("0.5,0.5,0\n", {}, "the event .*0.5.* is no whole number"),
        ("-1,0.5,0\n", {}, "the event .*-1.* is no whole number"),
        ("x,0.5,0\n", {}, "the event 'x' is no whole number"),
        (",0.5,0\n", {}, "row 1 .* has no event or site"),
        ("0,0.5,\n", {}, "row 1 .* has no event or site"),
        ("4000000000,0.5,0\n", {}, "give events="),
        ("0,nan,0\n", {}, "1 values of gmv_PGA are no intensities"),
        ("0,inf,0\n", {}, "1 values of gmv_PGA are no intensities"),
        ("0,0.5,0\n0,0.6,0\n", {}, "site 0 has event 0 twice"),
        ("0,0.5\n", {}, "line 2 has 2 values and there are 3 columns"),
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
        ("lon,lat", "lon,LON", "differ in upper and lower case"),
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
        ("10 45.1 21", "45.1 10 21", "LON goes from 10 to 45.1.*exchanged"),
        ("10 45.1 21", "nan 45.1 21", "grid_specification|longitude"),
        ('name="MMI" units="intensity"', 'name="pga" units="%g"', "'PGA' twice"),
        ('index="4"', 'index="3"', "indices of <grid_field> must be 1 to 6, each once"),
        ('index="4"', 'index="x"', "index of <grid_field> must be a whole number above 0, got 'x'"),
        ('nlon="2"', 'nlon="2.5"', "nlon of <grid_specification> must be a whole number"),
        ('nlon="2"', 'nlon="3"', "24 values, and its grid 6 points of 6 fields"),
        ('lon_min="10"', 'lon_min="x"', "lon_min and lon_max of <grid_specification> must be numbers"),
        ('units="%g"', 'units="furlong"', "PGA is in 'furlong'"),
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


# Inventories (case 24).


def test_values_of_the_engine_s_exports_are_read(tmp_path):
    text = (
        "#,,,,,,\"generated_by='OpenQuake engine 3.20'\"\n"
        "id,lon,lat,taxonomy,value-number,value-area,value-structural,value-nonstructural\n"
        "a,10,45,W1,3,100,500.5,100\nb,10.1,45,C1L,2,80,200,50\n"
    )
    found = wd.inventories.read_openquake(file(tmp_path, text), costs=("structural", "nonstructural"))
    assert found["number"].tolist() == [3, 2]
    assert found["replacement_cost"].tolist() == [600.5, 250]
    assert wd.inventories.read_openquake(file(tmp_path, text))["replacement_cost"].tolist() == [500.5, 200]


GEM = """ID_0,NAME_0,ID_1,NAME_1,SETTLEMENT,OCCUPANCY,TAXONOMY,BUILDINGS,TOTAL_REPL_COST_USD,COST_STRUCTURAL_USD,\
COST_NONSTRUCTURAL_USD,COST_CONTENTS_USD,TOTAL_AREA_SQM,OCCUPANTS_PER_ASSET
ITA,Italy,09,Toscana,Urban,Res,CR/LFINF+DUL/H:2/RES,120,1000,300,450,250,9000,400
ITA,Italy,09,Toscana,Rural,Res,W/LWAL+DNO/H:1/RES,40.5,600,200,250,150,3000,90
ITA,Italy,12,Lazio,Urban,Res,W/LWAL+DNO/H:1/RES,0.0,60,20,25,15,300,9
ITA,Italy,12,Lazio,Urban,Res,S/LFM+DUM/H:3/RES,7,70,30,25,15,700,30
"""
PLACES = pd.DataFrame({"ID_1": ["09", "12", "13"], "longitude": [11.2, 12.6, 13.0], "latitude": [43.5, 42.0, 41.0]})


def test_an_exposure_of_gem_is_joined_with_places(tmp_path):
    path = file(tmp_path, GEM, "Exposure_Res_Italy_Adm1.csv")
    with pytest.raises(ValueError, match=r"Exposure_Res_Italy_Adm1.csv has no coordinates, but ids .* give places="):
        wd.inventories.read_openquake(path)
    # pandas reads these ids as numbers: so do the places.
    places = PLACES.assign(ID_1=[9, 12, 13])
    with pytest.warns(UserWarning, match="1 of 4 rows have 0 buildings, by rounding"):
        found = wd.inventories.read_openquake(path, costs=("structural", "contents"), places=places)
    assert found["longitude"].tolist() == [11.2, 11.2, 12.6]
    assert found["latitude"].tolist() == [43.5, 43.5, 42.0]
    assert found["number"].tolist() == [120, 40.5, 7]
    assert found["replacement_cost"].tolist() == [550, 350, 45]
    assert found["structure_type"].tolist()[0] == "CR/LFINF+DUL/H:2/RES"
    assert found["occupancy"].tolist() == ["Res"] * 3
    assert found["id"].tolist() == [f"Exposure_Res_Italy_Adm1 {row}" for row in (1, 2, 4)]
    csv = file(tmp_path, "id_1,LON,Lat\n9,11.2,43.5\n12,12.6,42\n", "places.csv")
    with pytest.warns(UserWarning, match="0 buildings"):
        again = wd.inventories.read_openquake(path, costs=("structural", "contents"), places=csv)
    pd.testing.assert_frame_equal(again, found)


def test_places_that_do_not_fit_are_refused(tmp_path):
    path = file(tmp_path, GEM, "gem.csv")
    numbered = PLACES.assign(ID_1=[9, 12, 13])
    for places, message in (
        (numbered[:1], "2 of 4 assets are in 1 units of ID_1 that places has no row of: '12'"),
        (pd.concat([numbered, numbered[:1]]), "the unit '9' of ID_1 has two rows"),
        (numbered.drop(columns="ID_1"), "both need a column of ids, such as ID_1"),
        (numbered.drop(columns="latitude"), "places: there is no column 'latitude'"),
        (numbered.assign(latitude=[43.5, 142.0, 41.0]), "1 of 3 rows have no place on Earth, the first is row 1"),
        (numbered.assign(latitude=[43.5, np.nan, 41.0]), "1 of 3 rows have no place on Earth"),
        (numbered.assign(Latitude=1.0), "differ in upper and lower case"),
    ):
        with pytest.raises(ValueError, match=message):
            wd.inventories.read_openquake(path, places=places)
    with pytest.raises(TypeError, match="places must be a pandas DataFrame or a path"):
        wd.inventories.read_openquake(path, places=5)
    with pytest.raises(ValueError, match="has coordinates of its own: leave out places="):
        wd.inventories.read_openquake(file(tmp_path, "id,lon,lat,ID_1\na,1,2,9\n"), places=numbered)


def geojson(folder, *buildings):
    features = [
        {
            "type": "Feature",
            "properties": {"id": str(i), **properties},
            "geometry": place and {"type": "Point", "coordinates": place},
        }
        for i, (properties, place) in enumerate(buildings)
    ]
    return file(folder, json.dumps({"type": "FeatureCollection", "features": features}), "buildings.geojson")


def test_exchanged_properties_do_not_override_the_geometry(tmp_path):
    swapped = {"Longitude": 37.8, "Latitude": -12.3}
    path = geojson(tmp_path, (swapped, [-12.3, 37.8]), ({"Longitude": -12.4, "Latitude": 37.9}, [-12.4001, 37.9001]))
    with pytest.warns(UserWarning, match=r"of 2 buildings 1 \('0'\) are more than 1 km .*exchanged in the properties"):
        found = wd.inventories.read_geojson(path)
    # The second building's properties agree with its geometry, and stay.
    assert found[["longitude", "latitude"]].values.tolist() == [[-12.3, 37.8], [-12.4, 37.9]]
    path = geojson(
        tmp_path, ({"Longitude": 10.0, "Latitude": 45.0}, [11.0, 45.0]), ({"Longitude": None, "Latitude": 1.0}, [3, 4])
    )
    with pytest.warns(UserWarning, match="2 .*the properties are wrong"):
        assert wd.inventories.read_geojson(path)["longitude"].tolist() == [11.0, 3.0]
    path = geojson(
        tmp_path,
        ({"Longitude": 10.0, "Latitude": 45.0}, None),
        ({"Longitude": 179.9999, "Latitude": 1.0}, [-179.9999, 1.0]),
    )
    assert wd.inventories.read_geojson(path)["longitude"].tolist() == [10.0, 179.9999]
    path = geojson(tmp_path, ({"YearBuilt": 1990, "yearbuilt": 1991}, [1.0, 2.0]))
    with pytest.raises(ValueError, match="buildings.geojson: of the properties, .* differ in upper and lower case"):
        wd.inventories.read_geojson(path)


BUILDINGS = "id,Longitude,Latitude,NumberOfStories,YearBuilt,PlanArea,StructureType\n1,-122,37.8,2,1990,1000,W1\n"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Latitude", "LONGITUDE", "differ in upper and lower case"),
        ("Latitude", " Longitude", "'Longitude' twice"),
        ("-122,37.8", "nan,37.8", "1 .* have a longitude outside"),
        ("-122,37.8", "inf,37.8", "1 .* have a longitude outside"),
        ("-122,37.8", "37.8,-122", "longitude and latitude seem to be exchanged"),
        ("-122,37.8", "238,37.8", "longitudes seem to be from 0 to 360: subtract 360"),
        ("1990", "1990.5", "year outside 1000 to 2100, or no whole number"),
        ("1000", "inf", "plan area below 0 or infinite"),
        ("1000", "-1", "plan area below 0"),
        (",2,", ",2.5,", "storeys that are no whole number"),
        (",1000,W1", ",1000", "line 2 has 6 values and there are 7 columns"),
        (",1000,W1", ",1000,W1,9", "line 2 has 8 values and there are 7 columns"),
        ("1,-122", '"1 ",-122', None),
        ("\n", "\r\n", None),
        ("id,", "\ufeffid,", None),
    ],
)
def test_inventories_that_cannot_be_are_refused_with_the_file(old, new, message, tmp_path):
    path = tmp_path / "r2d.csv"
    path.write_bytes(BUILDINGS.replace(old, new).encode())
    if message is None:
        found = wd.inventories.read_r2d(path)
        assert found.loc[0, ["id", "longitude", "storeys", "structure_type"]].tolist() == ["1", -122.0, 2.0, "W1"]
        return
    with pytest.raises(ValueError, match=message) as raised:
        wd.inventories.read_r2d(path)
    assert str(path) in str(raised.value)


@pytest.mark.parametrize(("text", "what"), [("a;b", "';' (semicolons)"), ("a\tb", "'\\t' (tabs)"), ("", "empty")])
@pytest.mark.parametrize("reader", [wd.inventories.read_r2d, wd.inventories.read_openquake])
def test_tables_of_another_separator_are_refused(reader, text, what, tmp_path):
    with pytest.raises(ValueError, match="file.csv: ") as raised:
        reader(file(tmp_path, text + "\n"))
    assert what in str(raised.value)


def test_blanks_and_unknown_places_of_buildings(tmp_path):
    path = file(tmp_path, BUILDINGS.replace("W1", "W1 ") + "2,-122,37.9,1,1990,1000,W1\n3,0,0,1,1990,1000,W1\n")
    with pytest.warns(UserWarning, match=r"of 3 buildings 1 \('3'\) are at longitude 0 and latitude 0"):
        found = wd.inventories.read_r2d(path)
    assert found["structure_type"].cat.categories.tolist() == ["W1"]


# Tables of the engine (cases 24 and 27).


def test_weights_of_repeated_rows_are_added(tmp_path):
    text = "taxonomy,conversion,weight\nCR,C1,0.25\nCR,C2,0.5\nCR,C1,0.25\n"
    assert wd.read_taxonomy_mapping(file(tmp_path, text)) == {"CR": {"C1": 0.5, "C2": 0.5}}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("taxonomy,risk_id,weight\nCR,C1,nan\n", "finite number above 0, got 'nan'"),
        ("taxonomy,risk_id,weight\nCR,C1,-1\nCR,C2,2\n", "finite number above 0, got '-1'"),
        ("taxonomy,risk_id,weight\nCR,C1,0\nCR,C2,1\n", "finite number above 0, got '0'"),
        ("taxonomy,risk_id,weight\nCR,C1,\n", "finite number above 0, got ''"),
        ("taxonomy,risk_id,weight\nCR,C1,0.4\nCR,C1,0.4\n", "sum to 0.8"),
        ("taxonomy,risk_id,Risk_ID\nCR,C1,C2\n", "differ in upper and lower case"),
        ("taxonomy;risk_id\nCR;C1\n", "separated by ';'"),
        ("taxonomy,risk_id,weight\nCR,C1\n", "line 2: fewer values"),
        ("taxonomy,risk_id\n", "no row below"),
        ("taxonomy,risk_id\n,C1\n", "taxonomy '' must be ASCII"),
        ("taxonomy,risk_id\nC R,C1\n", "must be ASCII without spaces"),
    ],
)
def test_mappings_that_cannot_be_are_refused_with_the_file(text, message, tmp_path):
    path = file(tmp_path, text)
    with pytest.raises(ValueError, match=message) as raised:
        wd.read_taxonomy_mapping(path)
    assert str(path) in str(raised.value)


@pytest.mark.parametrize("peril", ["earthquake", "groundshaking", "Earthquake", ""])
def test_consequences_of_earthquakes_are_read(peril, tmp_path):
    text = f"risk_id,consequence,loss_type,peril,slight,complete\nC1,losses,structural,{peril},0.1,1\n"
    text += "C1,losses,structural,liquefaction,0.5,1\n"
    assert wd.read_consequences(file(tmp_path, text)) == {"C1": {"slight": 0.1, "complete": 1.0}}


def test_what_a_file_of_consequences_has_instead_is_named(tmp_path):
    text = "risk_id,consequence,loss_type,peril,slight\nC1,losses,structural,tsunami,0.1\nC1,collapsed,contents,earthquake,0.1\n"
    with pytest.raises(
        ValueError, match="by earthquakes; it has losses of structural by tsunami; collapsed of contents"
    ):
        wd.read_consequences(file(tmp_path, text))
    for values, message in (
        ("0.5,0.1", "the share falls from 0.5 of 'slight' to 0.1"),
        ("0.5,1.1", "from 0 to 1 .*got '1.1'"),
        ("nan,1", "got 'nan'"),
        ("-0.1,1", "got '-0.1'"),
        (",1", "got ''"),
    ):
        text = f"risk_id,consequence,slight,complete\nC1,losses,{values}\n"
        with pytest.raises(ValueError, match=message):
            wd.read_consequences(file(tmp_path, text))


# Hazard curves.
HAZARD = """#,,,,,"generated_by='OpenQuake engine 3.16', kind='{kind}', investigation_time=50.0, imt='PGA'"
lon,lat,depth,poe-0.1,poe-0.2,poe-0.4
10.0,45.0,0.0,0.3,0.1,0.02
"""


def test_only_curves_of_probabilities_are_read(tmp_path):
    for kind in ("mean", "rlz-000"):
        curve = wd.HazardCurve.from_openquake_csv(file(tmp_path, HAZARD.format(kind=kind)))
        assert curve.annual_rate == pytest.approx(-np.log1p(-np.array([0.3, 0.1, 0.02])) / 50)
    for kind in ("std", "xyz", ""):
        with pytest.raises(ValueError, match=f"file.csv: it is of kind='{kind}', .*kind='mean'"):
            wd.HazardCurve.from_openquake_csv(file(tmp_path, HAZARD.format(kind=kind)))
    for kind in ("quantile-0.15", "max"):
        with pytest.warns(UserWarning, match=f"kind='{kind}': rates and losses computed with it are not means"):
            wd.HazardCurve.from_openquake_csv(file(tmp_path, HAZARD.format(kind=kind)))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("poe-0.2", "poe-0.1", "'poe-0.1' twice"),
        ("poe-0.2", "poe-0.5", "intensity must increase"),
        ("poe-0.2", "poe-nan", "'nan' is not a finite number"),
        ("poe-0.1", "poe--0.1", "must be above 0"),
        ("lon,lat", "lon,LON", "differ in upper and lower case"),
        ("0.3,0.1,", "0.1,0.3,", "never rises"),
        ("0.3,0.1,", "0.3,nan,", "not a finite number"),
        ("0.3,0.1,", "0.3,1.5,", "from 0 to 1"),
        ("lon,lat,depth,", "lon;lat;depth;", "columns must be lon, lat"),
    ],
)
def test_hazard_files_that_cannot_be_are_refused_with_the_file(old, new, message, tmp_path):
    path = file(tmp_path, HAZARD.format(kind="mean").replace(old, new))
    with pytest.raises(ValueError, match=message) as raised:
        wd.HazardCurve.from_openquake_csv(path)
    assert str(path) in str(raised.value)


def test_a_site_that_stands_twice_is_refused(tmp_path):
    text = HAZARD.format(kind="mean") + "10.0,45.0,0.0,0.4,0.2,0.03\n"
    with pytest.raises(ValueError, match="several sites at longitude 10, latitude 45: lines 3, 4"):
        wd.HazardCurve.from_openquake_csv(file(tmp_path, text), site=(10.0, 45.0))
    names = "name,lon,lat,0.1,0.2\nA,10,45,0.01,0.001\nA,11,45,0.02,0.002\n"
    with pytest.raises(ValueError, match="has the site 'A' in 2 lines"):
        wd.HazardCurve.from_usgs(file(tmp_path, names), site="A", measure="PGA")


# Responses of pelicun.
RESPONSE = ",1-PFA-0-1,1-PID-1-1,1-RID-1-1,1-SA_0.5-0-1\n0,3.0,0.01,-0.001,0.4\n1,2.0,0.02,0.002,0.5\n"
UNITS = {"PFA": "mps2", "PID": "rad", "RID": "rad", "SA": "g"}


def test_responses_without_a_row_of_units_take_units(tmp_path):
    path = file(tmp_path, RESPONSE)
    with pytest.raises(ValueError, match=r"has 0 rows of units; .*units=\{'PFA': 'mps2'"):
        wd.read_pelicun_demands(path)
    found = wd.read_pelicun_demands(path, units=UNITS)
    assert found["peak_ground_acceleration"].values.tolist() == [3.0, 2.0]
    assert found["peak_storey_drift_ratio"].values.tolist() == [[0.01], [0.02]]
    assert found["im_level"].values.tolist() == [0.4, 0.5]
    in_g = wd.read_pelicun_demands(path, units=UNITS | {"PFA": "g"})
    assert in_g["peak_ground_acceleration"].values == pytest.approx(np.array([3.0, 2.0]) * STANDARD_GRAVITY)
    with_row = RESPONSE.replace("\n0,", "\nUnits,mps2,rad,rad,g\n0,", 1)
    again = wd.read_pelicun_demands(file(tmp_path, with_row), units=UNITS)
    assert again.identical(wd.read_pelicun_demands(file(tmp_path, with_row)))
    with pytest.raises(ValueError, match="column '1-PFA-0-1' is in 'mps2', and units= has 'g' for PFA"):
        wd.read_pelicun_demands(file(tmp_path, with_row), units=UNITS | {"PFA": "g"})


@pytest.mark.parametrize(
    ("old", "new", "units", "message"),
    [
        ("", "", {"PFA": "mps2"}, "units= has no unit of PID: give units={..., 'PID': 'rad'}"),
        ("", "", UNITS | {"PFA": "m/s2"}, "unknown unit of PFA 'm/s2'"),
        ("", "", UNITS | {"PFX": "g"}, "unknown kind of demand in units 'PFX'"),
        ("0.02", "-0.02", UNITS, "1 impossible values, the first is -0.02 of sample 1"),
        ("0.02", "inf", UNITS, "1 impossible values, the first is inf"),
        ("1-RID-1-1", "1-PID-1-1", UNITS, "'1-PID-1-1' twice"),
        ("1-RID-1-1", "1-pid-1-1", UNITS, "differ in upper and lower case"),
        ("1-PFA-0-1,1-PID-1-1", "1-PFA-0-1;1-PID-1-1", UNITS, "names are"),
    ],
)
def test_responses_that_cannot_be_are_refused_with_the_file(old, new, units, message, tmp_path):
    path = file(tmp_path, RESPONSE.replace(old, new, 1))
    with pytest.raises(ValueError, match=message.replace("{", r"\{").replace("...", r"\.\.\.")):
        wd.read_pelicun_demands(path, units=units)


def test_units_of_responses_are_a_mapping(tmp_path):
    with pytest.raises(TypeError, match="units must map kinds"):
        wd.read_pelicun_demands(file(tmp_path, RESPONSE), units="rad")
