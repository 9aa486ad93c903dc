"""Files of building results, read by independent code: JSON, CSV, netCDF, well-known binary, geopandas."""

import csv
import json
import struct
import sys

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from labels import check_labels

import warpdyn as wd
from warpdyn.interfaces.exchange.regional import building_table

pytestmark = pytest.mark.fast

STATES = ("none", "slight", "complete")
SHARES = np.array([[0.5, 0.375, 0.125], [1.0, 0.0, 0.0], [0.25, 0.25, 0.5], [0.25, 0.375, 0.375]])
ERRORS = np.sqrt(SHARES * (1 - SHARES) / 7)


def make_results(rows=4):
    """Return results of some buildings as from `building_results`, with columns of a user."""
    place = np.arange(rows) % 4
    frame = pd.DataFrame(
        {
            "id": [f"{i:03d}" for i in range(rows)],
            "longitude": 20.0 + 1 / 3 + np.arange(rows) / 7,
            "latitude": -40.0 + np.arange(rows) / 11,
            "storeys": np.where(place == 3, np.nan, 2.0),
            "year": 1900.0 + np.arange(rows),
            "structure_type": pd.Categorical(np.array(["CR/LFM", "W", "W", None], dtype=object)[place]),
            "plan_area": 0.3048**2 * 100 * (1 + np.arange(rows)),
            "replacement_cost": 1e5 * (1.0 + np.arange(rows)),
            "number": np.array([1.0, 12.0, 3.5, 2.0])[place],
            "a/name": np.array(['with "quotes", commas\nand a line', "ä", None, ""], dtype=object)[place],
            "checked": place == 1,
            "building": np.arange(rows, dtype=np.int32)[::-1],
            "archetype": pd.Categorical(np.array(["frame", "house"])[place % 2]),
            "sample_count": np.full(rows, 8),
            "failed_count": place % 2,
        }
    )
    for i, state in enumerate(STATES):
        frame[f"probability_{state}"], frame[f"standard_error_{state}"] = SHARES[place, i], ERRORS[place, i]
    ratio = SHARES[place] @ [0.0, 0.1, 1 / 3]
    frame = frame.assign(expected_loss_ratio=ratio, loss_ratio_standard_deviation=0.25)
    frame["expected_loss"] = ratio * frame["replacement_cost"]
    frame["loss_standard_deviation"] = 0.25 * frame["replacement_cost"]
    frame.attrs = {"title": "a town", "history": "2026-11-23T00:00:00Z warpdyn.simulate", "source": "warpdyn 0.1.0"}
    return frame


RESULTS = make_results()


@pytest.fixture
def small_parts(monkeypatch):
    monkeypatch.setattr(building_table, "ROWS_AT_A_TIME", 3)


def points_of(path):
    """Return the points in well-known binary, by its definition: byte order, type, x and y."""
    pq = pytest.importorskip("pyarrow.parquet")
    found = []
    for binary in pq.read_table(path)["geometry"].to_pylist():
        order, kind, x, y = struct.unpack("<BIdd", binary)
        assert (order, kind) == (1, 1)
        found.append((x, y))
    return np.array(found)


@pytest.mark.usefixtures("small_parts")
def test_geoparquet_is_plain_parquet_with_points(tmp_path):
    pq = pytest.importorskip("pyarrow.parquet")
    results = make_results(10)
    path = wd.write_building_results(results, tmp_path / "buildings.parquet")
    found = pd.read_parquet(path)
    pd.testing.assert_frame_equal(found.drop(columns="geometry"), results, check_exact=True)
    assert found.attrs == results.attrs
    np.testing.assert_array_equal(points_of(path), results[["longitude", "latitude"]])
    file = pq.ParquetFile(path)
    assert file.num_row_groups == 4  # written part by part
    # Required by version 1.1.0 of the specification; without `crs` coordinates are longitude and latitude.
    told = json.loads(file.schema_arrow.metadata[b"geo"])
    (column,) = told["columns"].values()
    assert (told["version"], told["primary_column"]) == ("1.1.0", "geometry")
    assert (column["encoding"], column["geometry_types"]) == ("WKB", ["Point"])
    assert "crs" not in column
    edges = [
        results["longitude"].min(),
        results["latitude"].min(),
        results["longitude"].max(),
        results["latitude"].max(),
    ]
    assert column["bbox"] == edges
    assert file.schema_arrow.field("geometry").type == "binary"


def test_geopandas_reads_the_same_points(tmp_path):
    geopandas = pytest.importorskip("geopandas")
    for name, read in (("a.parquet", geopandas.read_parquet), ("a.geojson", geopandas.read_file)):
        found = read(wd.write_building_results(RESULTS, tmp_path / name))
        assert found.crs.equals("OGC:CRS84", ignore_axis_order=True)
        assert found.geometry.x.tolist() == RESULTS["longitude"].tolist()
        assert found.geometry.y.tolist() == RESULTS["latitude"].tolist()
        np.testing.assert_allclose(found["expected_loss_ratio"], RESULTS["expected_loss_ratio"], atol=1e-10)


@pytest.mark.usefixtures("small_parts")
@pytest.mark.parametrize("rows", [1, 4, 6])
def test_geojson_has_a_point_for_each_building(tmp_path, rows):
    results = make_results(rows)
    told = json.loads(wd.write_building_results(results, tmp_path / "a.geojson").read_text(encoding="utf-8"))
    assert told["type"] == "FeatureCollection"
    assert "crs" not in told  # RFC 7946 has none
    assert len(told["features"]) == rows
    for feature, (_, row) in zip(told["features"], results.iterrows(), strict=True):
        assert feature["type"] == "Feature"
        assert feature["geometry"] == {"type": "Point", "coordinates": [row["longitude"], row["latitude"]]}
        own = feature["properties"]
        assert list(own) == [name for name in results.columns if name not in ("longitude", "latitude")]
        for name, value in own.items():
            if value is None:
                assert pd.isna(row[name])
            elif isinstance(value, float):
                assert value == pytest.approx(row[name], abs=0.5e-10, rel=1e-15)  # ten digits are written
            else:
                assert value == row[name]


def test_csv_has_all_columns(tmp_path):
    path = wd.write_building_results(RESULTS, tmp_path / "a.csv")
    with open(path, encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    assert head == RESULTS.columns.tolist()
    assert rows[0][head.index("id")] == "000"
    assert rows[0][head.index("a/name")] == 'with "quotes", commas\nand a line'
    for name in ("longitude", "standard_error_slight", "expected_loss"):
        assert [float(row[head.index(name)]) for row in rows] == RESULTS[name].tolist()  # to the last bit


def test_netcdf_has_dimensions(tmp_path):
    path = wd.write_building_results(RESULTS, tmp_path / "a.nc")
    with xr.open_dataset(path) as found:
        assert found["damage_probability"].dims == ("building", "damage_state")
        assert found["damage_state"].values.tolist() == list(STATES)
        np.testing.assert_array_equal(found["damage_probability"], SHARES)
        np.testing.assert_array_equal(found["damage_probability_standard_error"], ERRORS)
        assert found["building"].values.tolist() == [3, 2, 1, 0]
        assert found["structure_type"].values.tolist() == ["CR/LFM", "W", "W", ""]
        assert found["a_name"].values.tolist() == ['with "quotes", commas\nand a line', "ä", "", ""]
        assert found["longitude"].attrs["units"] == "degrees_east"
        assert np.isnan(found["storeys"].values[3])
        np.testing.assert_array_equal(found["expected_loss"], RESULTS["expected_loss"])
        assert found.attrs["history"].splitlines()[0].endswith("warpdyn.simulate")
        assert found.attrs["title"] == "a town"
        check_labels(found, leave_out=("checked",))  # a user's column has no unit
    wd.write_building_results(RESULTS.iloc[:2], path)  # replaces its file


def test_openquake_damages(tmp_path):
    # Columns and numbers as in avg_damages of engine 3.26: a comment, then buildings in each state.
    results = RESULTS.assign(structure_type=RESULTS["structure_type"].cat.add_categories("S").fillna("S"))
    path = wd.write_openquake_damages(results, tmp_path / "avg_damages-rlz-000_1.csv")
    comment, head, first, second, third, _ = path.read_text().splitlines()
    assert comment.startswith("#,,,,,,,\"generated_by='warpdyn ")
    assert next(csv.reader([comment]))[0] == "#"
    assert len(next(csv.reader([comment]))) == len(head.split(","))
    assert head == (
        "asset_id,taxonomy,lon,lat,structural-no_damage,structural-slight,structural-complete,structural-losses"
    )
    # 0.375 x 0.1 + 0.125 / 3 = 0.0791667 of 100,000.
    assert first == "000,CR/LFM,20.33333,-40.00000,5.000000E-01,3.750000E-01,1.250000E-01,7.916667E+03"
    assert second == "001,W,20.47619,-39.90909,1.200000E+01,0.000000E+00,0.000000E+00,0.000000E+00"
    assert third.split(",")[4:7] == ["8.750000E-01", "8.750000E-01", "1.750000E+00"]  # of 3.5 buildings
    read = pd.read_csv(path, comment="#")
    states = read.filter(regex="no_damage|slight|complete")
    np.testing.assert_allclose(states.sum(axis=1), RESULTS["number"], rtol=1e-6)  # seven digits
    probabilities = results.drop(columns=["expected_loss", "structure_type"])
    path = wd.write_openquake_damages(probabilities, path, loss_type="nonstructural")
    assert path.read_text().splitlines()[1].endswith("nonstructural-complete")
    assert path.read_text().splitlines()[2].startswith("000,frame,")
    with pytest.raises(ValueError, match="unknown loss_type 'bricks'"):
        wd.write_openquake_damages(results, path, loss_type="bricks")
    failed = results.assign(probability_none=results["probability_none"].where(results["id"] != "002"))
    with pytest.raises(ValueError, match="all samples of 1 building failed, such as '002'"):
        wd.write_openquake_damages(failed, path)


def test_r2d_results(tmp_path):
    path = wd.write_r2d_results(RESULTS, tmp_path / "R2D_results.geojson")
    told = json.loads(path.read_text(encoding="utf-8"))
    assert list(told) == ["type", "crs", "metadata", "features"]
    assert told["crs"]["properties"]["name"] == "urn:ogc:def:crs:OGC:1.3:CRS84"
    assert list(told["metadata"]) == ["Name", "Units", "Author", "WorkflowType", "Time"]
    own = [feature["properties"] for feature in told["features"]]
    assert [each["AIM_id"] for each in own] == ["000", "001", "002", "003"]
    assert {each["assetType"] for each in own} == {"Buildings"}
    assert [each["PlanArea"] for each in own] == pytest.approx([100, 200, 300, 400])  # square feet
    assert own[0]["NumberOfStories"] == 2
    # The last building has slight and complete damage equally often.
    assert [each["R2Dres_MostLikelyCriticalDamageState"] for each in own] == [0, 0, 2, 1.5]
    # pandas on samples, as in R2D's results of pelicun.
    for each, shares in zip(own, SHARES, strict=True):
        samples = pd.Series(np.repeat(np.arange(3), np.round(8 * shares).astype(int)))
        assert each["R2Dres_MostLikelyCriticalDamageState"] == samples.mode().mean()
    ratios = SHARES @ [0.0, 0.1, 1 / 3]
    assert [each["R2Dres_mean_RepairCost_loss_ratio"] for each in own] == pytest.approx(ratios, abs=1e-10)
    assert [each["R2Dres_std_RepairCost_loss_ratio"] for each in own] == [0.25] * 4
    assert [each["R2Dres_mean_RepairCost"] for each in own] == pytest.approx(ratios * [1e5, 2e5, 3e5, 4e5])
    assert [each["R2Dres_std_RepairCost"] for each in own] == pytest.approx([2.5e4, 5e4, 7.5e4, 1e5])
    again = wd.inventories.read_geojson(path)
    assert again["id"].tolist() == RESULTS["id"].tolist()
    np.testing.assert_allclose(again["plan_area"], RESULTS["plan_area"], rtol=1e-10)
    assert again["longitude"].to_numpy() == pytest.approx(RESULTS["longitude"].to_numpy(), abs=1e-10)
    with pytest.raises(ValueError, match="unknown area_unit 'acre'"):
        wd.write_r2d_results(RESULTS, path, area_unit="acre")


@pytest.mark.parametrize("name", ["a.csv", "a.geojson"])
def test_readers_of_r2d_read_the_files_back(name, tmp_path):
    path = wd.write_building_results(RESULTS, tmp_path / name)
    read = wd.inventories.read_r2d if name == "a.csv" else wd.inventories.read_geojson
    again = read(path)  # plan_area is always in m2
    assert again["id"].tolist() == RESULTS["id"].tolist()
    np.testing.assert_allclose(again["plan_area"], RESULTS["plan_area"], rtol=1e-10)  # ten digits after the point
    renamed = RESULTS.rename(columns={"plan_area": "PlanArea"})
    with pytest.raises(FileExistsError, match=r"not a table with the same columns.*overwrite=True"):
        wd.write_building_results(renamed, path)
    assert read(wd.write_building_results(RESULTS, path))["id"].tolist() == RESULTS["id"].tolist()
    feet = read(wd.write_building_results(renamed, path, overwrite=True))
    np.testing.assert_allclose(feet["plan_area"], RESULTS["plan_area"] * 0.3048**2, rtol=1e-10)
    renamed = RESULTS.rename(columns={"plan_area": "A"})
    feet = read(wd.write_building_results(renamed, path, overwrite=True), columns={"plan_area": "A"})
    np.testing.assert_allclose(feet["plan_area"], RESULTS["plan_area"] * 0.3048**2, rtol=1e-10)


@pytest.mark.parametrize("write", [wd.write_building_results, wd.write_r2d_results])
def test_geojson_holds_text_with_any_end_of_a_line(write, tmp_path):
    # All line ends of `str.splitlines`, including the separators of Unicode.
    texts = ["a\u2028b", "c\u2029d\x85e", "f\ng\r\nh\x0b\x0c", "\x1ci\x1dj\x1e"]
    path = write(RESULTS.assign(remark=texts), tmp_path / "a.geojson")
    features = json.loads(path.read_text(encoding="utf-8"))["features"]
    assert [each["properties"]["remark"] for each in features] == texts


def test_a_column_named_as_one_of_r2d_is_refused(tmp_path):
    for name in ("AIM_id", "NumberOfStories", "assetType", "R2Dres_mean_RepairCost"):
        with pytest.raises(ValueError, match=f"write_r2d_results: the file needs the name '{name}'"):
            wd.write_r2d_results(RESULTS.assign(**{name: 1}), tmp_path / "a.geojson")
    assert not list(tmp_path.iterdir())
    only = RESULTS.drop(columns="storeys").assign(NumberOfStories=7)  # no other column becomes it
    told = json.loads(wd.write_r2d_results(only, tmp_path / "a.geojson").read_text(encoding="utf-8"))
    assert told["features"][0]["properties"]["NumberOfStories"] == 7


@pytest.mark.parametrize("column", [["one", 2, None, 3], [1.5, b"x", None, 2]])
def test_a_column_that_parquet_has_no_type_for_is_named(column, tmp_path):
    pytest.importorskip("pyarrow")
    with pytest.raises(ValueError, match="write_building_results: column 'mixed' contains values of several types"):
        wd.write_building_results(RESULTS.assign(mixed=pd.Series(column, dtype=object)), tmp_path / "a.parquet")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["A.CSV", "A.GeoJSON", "A.NC", "A.Parquet"])
def test_endings_are_read_in_any_case(name, tmp_path):
    if name == "A.Parquet":
        pytest.importorskip("pyarrow")
    as_usual = wd.write_building_results(RESULTS, tmp_path / f"b{name[1:].lower()}")
    path = wd.write_building_results(RESULTS, tmp_path / name)
    if name == "A.NC":  # a file of HDF5 holds times
        with xr.open_dataset(path) as found, xr.open_dataset(as_usual) as expected:
            xr.testing.assert_equal(found, expected)
    else:
        assert path.read_bytes() == as_usual.read_bytes()


def edited(name, value):
    """Return results with another value of a column in row 1."""
    return RESULTS.assign(**{name: RESULTS[name].astype(float).where(RESULTS["id"] != "001", value)})


WRITERS = {
    "write_building_results": (wd.write_building_results, "a.csv", "'.parquet' or '.csv' or '.geojson' or '.nc'"),
    "write_openquake_damages": (wd.write_openquake_damages, "a.csv", "'.csv'"),
    "write_r2d_results": (wd.write_r2d_results, "a.geojson", "'.geojson'"),
}


@pytest.mark.parametrize("name", WRITERS)
def test_other_tables_are_refused_before_a_file_is_made(name, tmp_path):
    write, file, endings = WRITERS[name]
    with pytest.raises(ValueError, match=rf"{name}: the name of .*a\.shp must end in {endings}"):
        write(RESULTS, tmp_path / "a.shp")
    with pytest.raises(
        TypeError, match=rf"{name}\(\) takes a DataFrame, got Dataset as results; pass the result of building_results"
    ):
        write(xr.Dataset(), tmp_path / file)
    with pytest.raises(
        ValueError, match=f"{name}: the table has no longitude, sample_count: pass the result of building_results"
    ):
        write(RESULTS.drop(columns=["longitude", "sample_count"]), tmp_path / file)
    with pytest.raises(ValueError, match=f"{name}: the table has no probabilities of damage"):
        write(RESULTS.drop(columns=[f"probability_{state}" for state in STATES]), tmp_path / file)
    nowhere = RESULTS.assign(latitude=RESULTS["latitude"].where(RESULTS["id"] != "001"))
    with pytest.raises(ValueError, match=f"{name}: 1 building without longitude and latitude, such as '001'"):
        write(nowhere, tmp_path / file)
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        write(RESULTS, tmp_path / "none" / file)
    swapped = RESULTS.rename(columns={"longitude": "latitude", "latitude": "longitude"})
    swapped["latitude"] += 80
    for changed, message in (
        (
            edited("longitude", np.inf),
            r"longitude of '001' \(row 1\) is inf; it must be from -180 to 180 \[degree\]: correct or drop this row$",
        ),
        (edited("longitude", -180.5), r"longitude of '001' \(row 1\) is -180.5; it must be from -180 to 180"),
        (
            edited("latitude", 90.5),
            r"latitude of '001' .* is 90.5; it must be from -90 to 90 \[degree\]; .* swapped\?",
        ),
        (swapped, r"latitude of '000' .* is 100.333; .* are longitude and latitude swapped\?"),
        (edited("probability_slight", -0.1), r"probability_slight of '001' \(row 1\) is -0.1; it must be from 0 to 1"),
        (edited("probability_slight", 1.1), r"probability_slight of '001' \(row 1\) is 1.1; it must be from 0 to 1"),
        (edited("standard_error_slight", -1), r"standard_error_slight of '001' .* must be finite and at least 0"),
        (edited("number", -2), r"number of '001' \(row 1\) is -2; it must be finite and at least 0"),
        (edited("expected_loss", np.inf), r"expected_loss of '001' .* is inf; it must be finite"),
        (RESULTS.assign(number=["1", "2", "3", "4"]), "column 'number' has the type .*; it must contain numbers"),
    ):
        with pytest.raises(ValueError, match=f"{name}: {message}"):
            write(changed, tmp_path / file)
    assert not list(tmp_path.iterdir())


def test_parquet_needs_its_library_and_its_column(tmp_path, monkeypatch):
    with pytest.raises(ValueError, match="GeoParquet needs the column name 'geometry'"):
        wd.write_building_results(RESULTS.assign(geometry=1), tmp_path / "a.parquet")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ImportError, match=r'pip install "pyarrow>=17", or write CSV, GeoJSON or netCDF'):
        wd.write_building_results(RESULTS, tmp_path / "a.parquet")
    assert not list(tmp_path.iterdir())
    wd.write_building_results(RESULTS, tmp_path / "a.csv")
