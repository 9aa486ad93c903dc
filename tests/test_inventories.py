"""Inventories: files with the columns of R2D and OpenQuake, and the portfolios that they make."""

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import warpdyn as wd
from warpdyn.model.inventories.taxonomies import structure_of

pytestmark = pytest.mark.fast

R2D = """id,Latitude,Longitude,PlanArea,NumberOfStories,YearBuilt,ReplacementCost,StructureType,OccupancyClass,Footprint
001,37.80,-122.40,1000,1,1930,250000,W1,RES1,"{""type"":""Feature""}"
1,37.81,-122.41,2000,5,1990,4000000,C1,COM1,
b3,37.82,-122.42,3000.5,2,1960,800000,RM1L,COM4,
b4,37.83,-122.43,1500,2,2010,600000,URM,RES3,
b5,37.84,-122.44,1500,1,1940,100000,W1,RES1,
"""
EXPOSURE = """id,lon,lat,taxonomy,number,structural,nonstructural,area,night,tag_1
a1,28.97,41.01,CR/LFINF+DUL/H:5,12,1000,500,200,30,zone 1
a2,28.98,41.02,MUR+CLBRS/LWAL/HBET:1-2,3.5,100,50,80,9,zone 2
a3,28.99,41.03,W+WLI/LWAL+CDM/HEX:1,1,200,20,100,2,zone 2
"""
MODEL = """<?xml version="1.0" encoding="UTF-8"?>
<nrml xmlns="http://openquake.org/xmlns/nrml/0.5">
<exposureModel id="ex" category="buildings" taxonomySource="GEM">
<description>made for a test</description>
<conversions><costTypes><costType name="structural" type="per_area" unit="EUR"/>
<costType name="nonstructural" type="per_asset" unit="EUR"/></costTypes>
<area type="per_asset" unit="SQM"/></conversions>
<exposureFields><field oq="id" input="ASSET"/><field oq="value" type="structural" input="COST_USD"/></exposureFields>
<occupancyPeriods>night</occupancyPeriods><tagNames>tag_1</tagNames>
<assets>one.csv two.csv</assets>
</exposureModel></nrml>
"""
PLACE = {"longitude": -122.0, "latitude": 37.0}


def table(rows, **columns):
    """Return an inventory of rows of structure type, storeys and year."""
    rows = list(rows)
    kinds, storeys, years = zip(*rows, strict=True)
    names = {"id": [f"b{i}" for i in range(len(rows))]} | PLACE
    return wd.inventories.from_table(
        pd.DataFrame(names | {"structure_type": kinds, "storeys": storeys, "year": years} | columns)
    )


def archetypes_of(stock, inventory):
    """Return the name of each row's archetype by its id."""
    names = np.array(list(stock.portfolio.archetypes))[stock.archetype_index]
    return dict(zip(inventory["id"].iloc[stock.rows], names, strict=True))


def test_an_r2d_file(tmp_path):
    path = tmp_path / "buildings.csv"
    path.write_text(R2D, encoding="utf-8-sig")  # as spreadsheets write it
    inventory = wd.inventories.read_r2d(path)
    assert inventory["id"].tolist() == ["001", "1", "b3", "b4", "b5"]  # "001" and "1" are equal as numbers
    assert inventory["storeys"].tolist() == [1, 5, 2, 2, 1]
    assert inventory["number"].tolist() == [1] * 5
    assert inventory["structure_type"].dtype == "category"
    assert "Footprint" in inventory  # every other column is kept
    # The foot is 0.3048 m.
    assert inventory["plan_area"].to_numpy() == pytest.approx(np.array([1000, 2000, 3000.5, 1500, 1500]) * 0.09290304)
    assert wd.inventories.read_r2d(path, area_unit="m2")["plan_area"].iloc[0] == 1000
    stock = wd.inventories.portfolio(inventory)
    assert archetypes_of(stock, inventory) == {
        "001": "W1 moderate 1",
        "1": "C1M high 5",
        "b3": "RM1L moderate 2",
        "b4": "URML pre 2",
        "b5": "W1 moderate 1",
    }
    assert stock.limits["C1M high 5"] == wd.hazus_drift_limits("C1M", "high")
    assert stock.replacement_values(inventory)["W1 moderate 1"] == 350_000
    assert stock.portfolio.archetypes["C1M high 5"].building.storeys == 5


def test_the_permutation_keeps_rows_in_their_order(tmp_path):
    random = np.random.default_rng(3)
    kinds = random.choice(["W1", "C1", "S3", "PC2"], 500)
    inventory = table(zip(kinds, random.integers(1, 3, 500), random.integers(1900, 2020, 500), strict=True))
    stock = wd.inventories.portfolio(inventory)
    assert np.array_equal(np.sort(stock.rows), np.arange(500))
    ordered = inventory.iloc[stock.rows].reset_index(drop=True)
    names = np.array(list(stock.portfolio.archetypes))[stock.archetype_index]
    for name, part in ordered.groupby(names):
        kind, level, storeys = name.split()
        assert set(part["structure_type"]) == {kind if kind in ("W1", "S3") else kind[:-1]}
        assert set(part["storeys"]) == {int(storeys)}
        low, high = {"pre": (0, 1940), "moderate": (1941 if kind != "W1" else 0, 1975), "high": (1976, 9999)}[level]
        assert part["year"].between(low, high).all()
        assert part["id"].str[1:].astype(int).is_monotonic_increasing


def test_a_geojson_file(tmp_path):
    box = [[-149.0, 61.0], [-149.0, 61.2], [-149.4, 61.2], [-149.4, 61.0], [-149.0, 61.0]]
    own = {"NumberOfStories": 2, "YearBuilt": 1983, "StructureType": "W1", "PlanArea": 100}
    features = [
        {"type": "Feature", "id": "7", "properties": own, "geometry": {"type": "Polygon", "coordinates": [box]}},
        {"type": "Feature", "id": "8", "properties": own, "geometry": {"type": "Point", "coordinates": [-149.1, 61.3]}},
    ]
    path = tmp_path / "buildings.geojson"
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": features}))
    inventory = wd.inventories.read_geojson(path)
    assert inventory["id"].tolist() == ["7", "8"]
    assert inventory["longitude"].to_numpy() == pytest.approx([-149.2, -149.1])
    assert inventory["latitude"].to_numpy() == pytest.approx([61.1, 61.3])
    features[0]["properties"] = own | {"Latitude": 61.5, "Longitude": -149.5, "NumberOfStories": [2, 1]}
    features[1]["properties"] = own | {"Latitude": 61.6, "Longitude": -149.6}
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    # As in a building of SimCenter's example of Anchorage.
    with pytest.raises(ValueError, match=r"1 \('7' \(\[2, 1\]\)\) have no number in the column storeys"):
        wd.inventories.read_geojson(path)
    path.write_text(json.dumps({"features": features, "crs": {"properties": {"name": "EPSG:3857"}}}))
    with pytest.raises(ValueError, match=r"EPSG:3857.*longitudes and latitudes in degrees"):
        wd.inventories.read_geojson(path)


def test_an_exposure_of_openquake(tmp_path):
    path = tmp_path / "exposure.csv"
    path.write_text(EXPOSURE)
    inventory = wd.inventories.read_openquake(path)
    assert inventory["number"].tolist() == [12, 3.5, 1]
    assert inventory["replacement_cost"].tolist() == [1000, 100, 200]
    both = wd.inventories.read_openquake(path, costs=("structural", "nonstructural"))
    assert both["replacement_cost"].tolist() == [1500, 150, 220]
    stock = wd.inventories.portfolio(inventory.assign(year=[1999.0, 1950.0, np.nan]))
    assert archetypes_of(stock, inventory) == {"a1": "C3M low 5", "a2": "URML pre 2", "a3": "W1 moderate 1"}


def test_costs_that_an_exposure_does_not_have(tmp_path):
    path = tmp_path / "exposure.csv"
    path.write_text(EXPOSURE)
    with pytest.raises(TypeError, match=r"a sequence of names, such as \('structural',\), got 'structural'"):
        wd.inventories.read_openquake(path, costs="structural")
    for costs in (["contents"], ["structural", "contents"]):
        with pytest.raises(ValueError, match=r"exposure\.csv: there is no cost 'contents'; the columns are id,"):
            wd.inventories.read_openquake(path, costs=costs)
    with pytest.raises(ValueError, match=r"no cost 'structurall' \(did you mean 'structural'\?\)"):
        wd.inventories.read_openquake(path, costs=("structurall",))
    path.write_text(EXPOSURE.replace(",structural,", ",own,"))
    assert "replacement_cost" not in wd.inventories.read_openquake(path)


def test_an_exposure_model_of_xml(tmp_path):
    head, *rows = EXPOSURE.replace("id,lon", "ASSET,LON").replace("number,structural", "number,COST_USD").splitlines()
    rows[0] = rows[0].replace("a1", "007")
    (tmp_path / "one.csv").write_text("\n".join([head, *rows[:2]]))
    (tmp_path / "two.csv").write_text("\n".join([head, rows[2]]))
    path = tmp_path / "exposure.xml"
    path.write_text(MODEL)
    inventory = wd.inventories.read_openquake(path, costs=("structural", "nonstructural"))
    assert inventory["id"].tolist() == ["007", "a2", "a3"]
    # Per area of one building, times the area and the number; per asset, times the number.
    assert inventory["replacement_cost"].tolist() == [1000 * 200 * 12 + 500 * 12, 100 * 80 * 3.5 + 50 * 3.5, 20_020]
    path.write_text(MODEL.replace("one.csv two.csv", "<asset/>"))
    with pytest.raises(ValueError, match="names no CSV files"):
        wd.inventories.read_openquake(path)
    path.write_text("<nrml/>")
    with pytest.raises(ValueError, match="no <exposureModel>"):
        wd.inventories.read_openquake(path)


def test_tables_of_pandas_and_xarray():
    frame = pd.DataFrame({"name": ["x", "y"], "longitude": [1.0, 2.0], "latitude": [3.0, 4.0], "floors": [1, 2]})
    columns = {"id": "name", "storeys": "floors"}
    inventory = wd.inventories.from_table(frame, columns)
    dataset = xr.Dataset({name: ("asset", frame[name].to_numpy()) for name in frame})
    assert wd.inventories.from_table(dataset, columns)[list(inventory)].equals(inventory)
    with pytest.raises(ValueError, match=r"no column 'flors' \(did you mean 'floors'\?\)"):
        wd.inventories.from_table(frame, {"id": "name", "storeys": "flors"})
    with pytest.raises(ValueError, match=r"unknown meaning 'stories' in columns= \(did you mean 'storeys'\?\)"):
        wd.inventories.from_table(frame, {"stories": "floors"})
    with pytest.raises(ValueError, match="no column 'id'"):
        wd.inventories.from_table(frame)


# Ids in tables, and the text that they become.
IDS = {
    "whole numbers": (np.array([20, 3, -1]), ["20", "3", "-1"]),
    "the largest whole number": (np.array([2**64 - 1, 0, 1], np.uint64), ["18446744073709551615", "0", "1"]),
    "whole numbers that may be missing": (pd.array([20, 3, 1], "Int64"), ["20", "3", "1"]),
    "decimal numbers": ([1.0, 2.5, -3.0], ["1.0", "2.5", "-3.0"]),
    "text with spaces around it": ([" 7", "007 ", "a b"], ["7", "007", "a b"]),
    "text and numbers": ([7, "a", 2.5], ["7", "a", "2.5"]),
    "categories": (pd.Categorical([5, 3, 4]), ["5", "3", "4"]),
}


@pytest.mark.parametrize("what", IDS)
def test_ids_become_text(what):
    given, texts = IDS[what]
    inventory = wd.inventories.from_table(pd.DataFrame({"id": given} | PLACE))
    assert inventory["id"].tolist() == texts
    assert inventory["id"].dtype == pd.Series(["text"]).astype(str).dtype


# Impossible values in a row, and text of the message.
WRONG = {
    "duplicate": ({"id": ["a", "a", "c"]}, r"2 \('a', 'a'\) have an id that is not unique"),
    "a number twice": ({"id": [7, 8, 7]}, r"2 \('7', '7'\) have an id that is not unique"),
    "a number that is text, too": ({"id": [7, 8, " 7 "]}, r"2 \('7', '7'\) have an id that is not unique"),
    "no id": ({"id": ["a", None, "c"]}, r"1 \(row 1\) have no id"),
    "no number for an id": ({"id": [1.0, np.nan, np.nan]}, r"2 \(row 1, row 2\) have no id"),
    "storeys": ({"storeys": [2, -1, 1.5]}, r"2 \('b' \(-1.0\), 'c' \(1.5\)\) have storeys that are not a whole number"),
    "text": ({"storeys": ["2", "two", "3"]}, r"1 \('b' \(two\)\) have no number in the column storeys"),
    "latitude": ({"latitude": [91, 0, 0]}, r"1 \('a' \(91.0\)\) have a latitude outside -90 to 90 degrees"),
    "no place": ({"longitude": [0, np.nan, 0]}, r"1 \('b' \(nan\)\) have a longitude outside"),
    "swapped": ({"longitude": 37.0, "latitude": -122.0}, "longitude and latitude seem to be exchanged"),
    "year": ({"year": [0, 1990, 2000]}, r"1 \('a' \(0.0\)\) have a year that is not a whole number from 1000 to 2100"),
    "cost": ({"replacement_cost": [-1, 0, 2]}, r"1 \('a' \(-1.0\)\) have a replacement cost below 0"),
    "number": ({"number": [0, 1, np.inf]}, r"2 \('a' \(0.0\), 'c' \(inf\)\) have a number of buildings not above 0"),
    "area": ({"plan_area": [0, -1, 2]}, r"1 \('b' \(-1.0\)\) have a plan area below 0"),
}


@pytest.mark.parametrize("what", WRONG)
def test_impossible_values_are_counted_and_named(what):
    changed, message = WRONG[what]
    frame = pd.DataFrame({"id": ["a", "b", "c"]} | PLACE | changed)
    with pytest.raises(ValueError, match=f"of 3 buildings .*{message}"):
        wd.inventories.from_table(frame)


def test_all_problems_are_in_one_message():
    frame = pd.DataFrame({"id": ["a", "a"]} | PLACE | {"storeys": [0, 1], "year": [1, 2]})
    with pytest.raises(ValueError, match=r"have an id that is not unique.*not a whole number.*have a year"):
        wd.inventories.from_table(frame)


# Broken CSV files, and text of the message.
BROKEN = {
    "more values": (R2D.replace("C1,COM1,", "C1,COM1,,,5"), "line 3"),
    "more in every row": ("id,Latitude,Longitude\n1,37,-122,5\n2,37,-122,5\n", "."),
    "a column twice": (R2D.replace("YearBuilt", "NumberOfStories"), "'NumberOfStories' twice"),
    "no places": (R2D.replace("Latitude", "y"), "no column 'Latitude'"),
    "semicolons": (R2D.replace(",", ";"), "columns are separated by ';'"),
    "no rows": (R2D.splitlines()[0] + "\n", "no building"),
    "nothing": ("", "."),
}


@pytest.mark.parametrize("what", BROKEN)
def test_broken_files_are_refused_by_name(what, tmp_path):
    text, message = BROKEN[what]
    path = tmp_path / "broken.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"broken\.csv[\s\S]*{message}"):
        wd.inventories.read_r2d(path)


# The Technical Manual's table of design levels by age: (year, type, zone) and the level.
AGES = [
    *(
        (1940, "C2", "4", "pre"),
        (1941, "C2", "4", "moderate"),
        (1975, "C2", "4", "moderate"),
        (1976, "C2", "4", "high"),
    ),
    *((1940, "W1", "4", "moderate"), (1976, "W1", "4", "high"), (1940, "W2", "4", "pre")),
    *(
        (1990, "C2", "3", "moderate"),
        (1950, "C2", "2B", "low"),
        (1930, "W1", "2B", "low"),
        (1990, "C2", "2B", "moderate"),
    ),
    *((1950, "C2", "2A", "low"), (1950, "C2", "1", "pre"), (1950, "W1", "1", "low"), (2000, "C2", "0", "pre")),
    *((2000, "URM", "4", "pre"), (2000, "C3", "4", "pre"), (2000, "S5", "4", "pre"), (2000, "URML", "4", "pre")),
]


@pytest.mark.parametrize(("year", "kind", "zone", "level"), AGES)
def test_design_levels_by_age(year, kind, zone, level):
    stock = wd.inventories.portfolio(table([(kind, 2, year)]), wd.inventories.HazusRule(zone))
    (name,) = stock.portfolio.archetypes
    assert name.split()[1] == level


def test_classes_of_heights():
    # Hazus Technical Manual, table 5.1: low-rise 1 to 3 (URM 1 to 2), mid-rise 4 to 7, high-rise 8 and more.
    rows = [("C1", n, 2000) for n in (3, 4, 7, 8)] + [("URM", n, 2000) for n in (2, 3)] + [("RM1", 9, 2000)]
    inventory = table(rows)
    names = archetypes_of(wd.inventories.portfolio(inventory), inventory).values()
    assert sorted(name.split()[0] for name in names) == sorted(["C1L", "C1M", "C1M", "C1H", "URML", "URMM", "RM1M"])


# GEM's strings and the Hazus equivalent: family, storeys, design level.
TAXONOMIES = {
    "CR/LFM/H:8": ("C1", 8, ""),
    "CR+CIP/LWAL+CDH/H:12/RES": ("C2", 12, "high"),
    "CR/LDUAL+DUM/HBET:4-7": ("C2", 6, "moderate"),
    "DX+D99/CR/LFINF+DNO/DY+D99/CR/LFINF/HEX:2": ("C3", 2, "pre"),
    "CR+PC/LWAL/H:1": ("PC1", 1, ""),
    "S/LFBR+CDM/H:3": ("S2", 3, "moderate"),
    "S+SL/LFM/HEX:1": ("S3", 1, ""),
    "S/LDUAL/H:10": ("S4", 10, ""),
    "MUR+CLBRS/LWAL/HBET:6,3": ("URM", 5, ""),
    "MR/LWAL/H:2//FC": ("RM2", 2, ""),
    "MR/LWAL/H:2//FW": ("RM1", 2, ""),
    "W/LFM/H:2": ("wood", 2, ""),
    "c1m": ("C1M", np.nan, ""),
    # Without an equivalent: confined masonry, adobe, stone, bamboo, reinforced masonry of unknown floors, and more.
    **dict.fromkeys(("MCF/LWAL/H:2", "MUR+ADO/LWAL/H:1", "MUR+STRUB/LWAL/H:1", "W+WBB/H:1", "MR/LWAL/H:2"), None),
    **dict.fromkeys(("MATO/LN", "CR/LFLS/H:3", "house", "SRC/LFM/H:8"), None),
}


@pytest.mark.parametrize("text", TAXONOMIES)
def test_taxonomies(text):
    found, expected = structure_of(text), TAXONOMIES[text]
    if expected is None:
        assert found.family == ""
    else:
        assert (found.family, found.level) == (expected[0], expected[2])
        np.testing.assert_equal(found.storeys, expected[1])


UNKNOWN = [
    *(("MCF/LWAL/H:2", np.nan, 2000), ("MCF/LWAL/H:2", np.nan, 2000), ("castle", 2, 1200), (None, 2, 2000)),
    *(("C1M", 12, 2000), ("C1", np.nan, 2000), ("C1", 2, np.nan), ("W1", 1, 1990), ("C2", 60, 1990)),
]
REASONS = (
    r"1 \('b3'\) have no structure type",
    r"3 are of unknown types: 'MCF/LWAL/H:2' \(2\), 'castle' \(1\) \(known are Hazus' W1, .*URM.* archetype_of= for",
    r"1 \('b5' \(C1\)\) have no number of storeys",
    r"2 \('b4' \(C1M, 12.0\), 'b8' \(C2, 60.0\)\) have storeys that disagree with their structure type "
    r"\(C1M has 4 to 7, C2 has 1 to 50\)",
    r"1 \('b6'\) have no year of construction",
)


def test_buildings_without_an_archetype_are_counted_and_named():
    inventory = table(UNKNOWN)
    with pytest.raises(ValueError, match="8 of 9 buildings have no archetype: " + ".*".join(REASONS)):
        wd.inventories.portfolio(inventory)
    with pytest.warns(UserWarning, match="portfolio: 8 of 9 .*These buildings are left out"):
        stock = wd.inventories.portfolio(inventory, unknown="leave out")
    assert list(stock.portfolio.archetypes) == ["W1 high 1"]
    assert stock.rows.tolist() == [7]
    assert stock.left_out.tolist() == [0, 1, 2, 3, 4, 5, 6, 8]
    with pytest.raises(ValueError, match="8 of 8"):  # an empty portfolio is not allowed
        wd.inventories.portfolio(inventory.drop(7), unknown="leave out")
    with pytest.raises(ValueError, match="no column structure_type"):
        wd.inventories.portfolio(inventory.drop(columns="structure_type"))


def test_tall_wood_is_reported():
    with pytest.warns(UserWarning, match=r"1 \('b0' \(3.0\)\) buildings of type W1 have more than 2 storeys"):
        wd.inventories.portfolio(table([("W1", 3, 2000), ("W/LFM", 3, 2000)]))


def test_rules_of_the_user():
    inventory = table([("A", 1, 2000), ("B", 5, 2000), ("A", 9, 2000), ("B", 5, 1900)])
    own = {"frame": wd.Archetype(wd.ShearBuilding.from_hazus("C1L", "low", 2))}
    limits = {"frame": {"slight": 0.01}}
    stock = wd.inventories.portfolio(inventory, {"A": "frame", "B": "C2M high 5"}, archetypes=own, limits=limits)
    assert archetypes_of(stock, inventory) == {"b0": "frame", "b1": "C2M high 5", "b2": "frame", "b3": "C2M high 5"}
    assert stock.portfolio.counts.tolist() == [2, 2]
    assert stock.limits["frame"] == {"slight": 0.01}

    def rule(each):
        return np.where(each["year"] < 1950, None, np.where(each["storeys"] > 3, "C2M high 5", "frame"))

    with pytest.raises(ValueError, match=r"1 of 4 .*1 \('b3'\) have no name from archetype_of"):
        wd.inventories.portfolio(inventory, rule, archetypes=own)
    with pytest.warns(UserWarning, match="left out"):
        stock = wd.inventories.portfolio(inventory, rule, archetypes=own, unknown="leave out")
    assert archetypes_of(stock, inventory) == {"b0": "frame", "b1": "C2M high 5", "b2": "C2M high 5"}
    with pytest.raises(ValueError, match=r"'fram' must be a key of archetypes= \(did you mean 'frame'\?\)"):
        wd.inventories.portfolio(inventory, {"A": "fram", "B": "frame"}, archetypes=own)
    with pytest.raises(TypeError, match=r"archetypes\['frame'\] must be an Archetype.*got ShearBuilding\(2 storeys"):
        wd.inventories.portfolio(inventory, {"A": "frame"}, archetypes={"frame": own["frame"].building})
    with pytest.raises(ValueError, match=r"3 names for 4 buildings"):
        wd.inventories.portfolio(inventory, lambda each: ["frame"] * 3, archetypes=own)
    with pytest.raises(ValueError, match=r"'B' \(2\) \(archetype_of has 'A'\)\. .* unknown='leave out'"):
        wd.inventories.portfolio(inventory, {"A": "frame"}, archetypes=own)


def test_buildings_and_scatter_are_the_users():
    scatter = {"mass": wd.RandomFactor(wd.Lognormal(1.0, 0.1))}
    stock = wd.inventories.portfolio(
        table([("C1M", 5, 2000)]),
        building=lambda *of: wd.ShearBuilding.from_hazus(*of, law="hysteretic"),
        scatter=scatter,
    )
    (archetype,) = stock.portfolio.archetypes.values()
    assert archetype.building.law == "hysteretic"
    assert dict(archetype.scatter) == scatter
