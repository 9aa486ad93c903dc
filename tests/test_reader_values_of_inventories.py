"""Readers of inventories: correct results, and values and columns that they refuse."""

import json

import numpy as np
import pandas as pd
import pytest

import warpdyn as wd

pytestmark = pytest.mark.fast


def file(folder, text, name="file.csv"):
    path = folder / name
    path.write_text(text)
    return path


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
    with pytest.raises(
        ValueError, match=r"Exposure_Res_Italy_Adm1.csv has ids .* instead of coordinates: give places="
    ):
        wd.inventories.read_openquake(path)
    # pandas reads these ids as numbers: so do the places.
    places = PLACES.assign(ID_1=[9, 12, 13])
    with pytest.warns(UserWarning, match=r"1 of 4 rows have 0 buildings, by rounding"):
        found = wd.inventories.read_openquake(path, costs=("structural", "contents"), places=places)
    assert found["longitude"].tolist() == [11.2, 11.2, 12.6]
    assert found["latitude"].tolist() == [43.5, 43.5, 42.0]
    assert found["number"].tolist() == [120, 40.5, 7]
    assert found["replacement_cost"].tolist() == [550, 350, 45]
    assert found["structure_type"].tolist()[0] == "CR/LFINF+DUL/H:2/RES"
    assert found["occupancy"].tolist() == ["Res"] * 3
    assert found["id"].tolist() == [f"Exposure_Res_Italy_Adm1 {row}" for row in (1, 2, 4)]
    csv = file(tmp_path, "id_1,LON,Lat\n9,11.2,43.5\n12,12.6,42\n", "places.csv")
    with pytest.warns(UserWarning, match=r"0 buildings"):
        again = wd.inventories.read_openquake(path, costs=("structural", "contents"), places=csv)
    pd.testing.assert_frame_equal(again, found)


def test_places_that_do_not_fit_are_refused(tmp_path):
    path = file(tmp_path, GEM, "gem.csv")
    numbered = PLACES.assign(ID_1=[9, 12, 13])
    for places, message in (
        (numbered[:1], r"places has no row for 1 \('12'\) units of ID_1, with 2 of 4 assets"),
        (pd.concat([numbered, numbered[:1]]), "the unit '9' of ID_1 has two rows"),
        (numbered.drop(columns="ID_1"), "both need a column of ids with the same name, such as ID_1"),
        (numbered.drop(columns="latitude"), "places: there is no column 'latitude'"),
        (numbered.assign(latitude=[43.5, 142.0, 41.0]), "1 of 3 rows have no place on Earth, the first is row 1"),
        (numbered.assign(latitude=[43.5, np.nan, 41.0]), "1 of 3 rows have no place on Earth"),
        (numbered.assign(ID_1=[9, 12, np.nan]), "places: 1 of 3 rows have no ID_1, the first is row 2"),
        (numbered.assign(Latitude=1.0), "differ only in upper and lower case"),
    ):
        with pytest.raises(ValueError, match=message):
            wd.inventories.read_openquake(path, places=places)
    without_unit = file(tmp_path, GEM.replace("ITA,Italy,12", "ITA,Italy,"), "gem.csv")
    with pytest.raises(ValueError, match=r"gem\.csv: 2 of 4 rows have no ID_1, the first is row 2, so that their"):
        wd.inventories.read_openquake(without_unit, places=numbered)
    path = file(tmp_path, GEM, "gem.csv")
    with pytest.raises(TypeError, match=r"places must be a pandas DataFrame or the path"):
        wd.inventories.read_openquake(path, places=5)
    with pytest.raises(ValueError, match=r"has coordinates: remove places="):
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
    with pytest.warns(
        UserWarning, match=r"of 2 buildings 1 \('0'\) have .* more than 1 km .*exchanged in the properties"
    ):
        found = wd.inventories.read_geojson(path)
    # The second building's properties agree with its geometry, and stay.
    assert found[["longitude", "latitude"]].values.tolist() == [[-12.3, 37.8], [-12.4, 37.9]]
    path = geojson(
        tmp_path, ({"Longitude": 10.0, "Latitude": 45.0}, [11.0, 45.0]), ({"Longitude": None, "Latitude": 1.0}, [3, 4])
    )
    missing = r"1 \('1'\) have no number as Longitude or Latitude: the coordinates of their geometries are used"
    far = r"1 \('0'\) have .* more than 1 km away .*the properties are wrong"
    with pytest.warns(UserWarning, match=missing), pytest.warns(UserWarning, match=far):
        assert wd.inventories.read_geojson(path)["longitude"].tolist() == [11.0, 3.0]
    path = geojson(
        tmp_path,
        ({"Longitude": 10.0, "Latitude": 45.0}, None),
        ({"Longitude": 179.9999, "Latitude": 1.0}, [-179.9999, 1.0]),
    )
    assert wd.inventories.read_geojson(path)["longitude"].tolist() == [10.0, 179.9999]
    path = geojson(tmp_path, ({"YearBuilt": 1990, "yearbuilt": 1991}, [1.0, 2.0]))
    with pytest.raises(ValueError, match=r"buildings.geojson: of the properties, .* differ only in upper"):
        wd.inventories.read_geojson(path)


BUILDINGS = "id,Longitude,Latitude,NumberOfStories,YearBuilt,PlanArea,StructureType\n1,-122,37.8,2,1990,1000,W1\n"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Latitude", "LONGITUDE", "differ only in upper and lower case"),
        ("Latitude", " Longitude", "'Longitude' twice"),
        ("-122,37.8", "nan,37.8", "1 .* have a longitude outside"),
        ("-122,37.8", "inf,37.8", "1 .* have a longitude outside"),
        ("-122,37.8", "37.8,-122", "longitude and latitude seem to be exchanged"),
        ("-122,37.8", "238,37.8", "longitudes seem to be from 0 to 360: subtract 360"),
        ("1990", "1990.5", "year that is not a whole number from 1000 to 2100"),
        ("1000", "inf", "plan area below 0 or infinite"),
        ("1000", "-1", "plan area below 0"),
        (",2,", ",2.5,", "storeys that are not a whole number"),
        (",1000,W1", ",1000", "line 2 has 6 values, but there are 7 columns"),
        (",1000,W1", ",1000,W1,9", "line 2 has 8 values, but there are 7 columns"),
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
    with pytest.raises(ValueError, match=r"file.csv: ") as raised:
        reader(file(tmp_path, text + "\n"))
    assert what in str(raised.value)


def test_blanks_and_unknown_places_of_buildings(tmp_path):
    path = file(tmp_path, BUILDINGS.replace("W1", "W1 ") + "2,-122,37.9,1,1990,1000,W1\n3,0,0,1,1990,1000,W1\n")
    with pytest.warns(UserWarning, match=r"of 3 buildings 1 \('3'\) are at longitude 0 and latitude 0"):
        found = wd.inventories.read_r2d(path)
    assert found["structure_type"].cat.categories.tolist() == ["W1"]


OF_EUROPE = "id;longitude;latitude\na;-122,3;37,8\nb;-122,3;37,8\n"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, r"no column 'id'.* separated by ';' \(semicolons\): give the table pandas\.read_csv\(path, sep=';'\)"),
        ({"sep": ";"}, r"\('a' \(-122,3\), .*has a decimal comma: .* pandas\.read_csv\(path, sep=';', decimal=','\)"),
    ],
)
def test_tables_with_semicolons_and_decimal_commas_say_how_they_are_read(options, message, tmp_path):
    path = tmp_path / "europe.csv"
    path.write_text(OF_EUROPE)
    with pytest.raises(ValueError, match=message):
        wd.inventories.from_table(pd.read_csv(path, **options))
    assert len(wd.inventories.from_table(pd.read_csv(path, sep=";", decimal=","))) == 2


def test_more_values_than_columns_may_be_decimal_commas(tmp_path):
    path = tmp_path / "commas.csv"
    path.write_text("id,Latitude,Longitude\n1,37,5,-122,5\n")
    with pytest.raises(ValueError, match=r"line 2 has 5 values, but there are 3 columns: .* decimal points, not comm"):
        wd.inventories.read_r2d(path)
