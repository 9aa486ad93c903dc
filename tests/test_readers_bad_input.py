"""Readers of inventories, sites and records refuse in one way what is no file, and columns that cannot be meant."""

import numpy as np
import pytest
import xarray as xr

import warpdyn as wd

pytestmark = pytest.mark.fast

READERS = {
    "read_r2d": wd.inventories.read_r2d,
    "read_geojson": wd.inventories.read_geojson,
    "read_openquake": wd.inventories.read_openquake,
    "read_ground_motion_field": lambda path: wd.sites.read_ground_motion_field(path, path),
    "read_shakemap": wd.sites.read_shakemap,
    "read_event_grid": lambda path: wd.sites.read_event_grid(path, "g"),
    "read_intensity_grid": lambda path: wd.sites.read_intensity_grid(path, "g"),
}


@pytest.mark.parametrize("name", READERS)
def test_what_is_no_file_is_told_with_the_function(name, tmp_path):
    for path in (5, None):  # Python would take a number for an open file
        with pytest.raises(TypeError, match=f"^{name}: (path|fields) must name a file, got {path}$"):
            READERS[name](path)
    with pytest.raises(FileNotFoundError, match=f"^{name}: there is no file .*missing.csv: correct the path$"):
        READERS[name](tmp_path / "missing.csv")
    of_folder = {"read_event_grid": FileNotFoundError, "read_intensity_grid": FileNotFoundError}
    with pytest.raises(of_folder.get(name, IsADirectoryError), match=f"^{name}: "):
        READERS[name](tmp_path)


def test_a_record_of_a_header_alone_has_no_samples(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("0.1\n0.2\n0.3\n")
    with pytest.raises(ValueError, match="a record needs at least 2 samples, found 0"):
        wd.records.read_text(path, unit="g", step=0.01, header_lines=99)


@pytest.mark.parametrize("given", [5, "x", None, xr])
def test_what_is_no_dataset_is_told(given):
    with pytest.raises(TypeError, match="takes an xarray Dataset or DataArray, got"):
        wd.records.from_dataset(given)


def test_the_shortest_record_of_a_dataset_has_two_samples():
    def of(count):
        time = {"time": 0.01 * np.arange(count)}
        return xr.DataArray(np.arange(count) / 4, time, dims="time", name="a", attrs={"units": "m/s2"})

    (motion,) = wd.records.from_dataset(of(2))
    np.testing.assert_array_equal(motion.acceleration, [0, 0.25])
    with pytest.raises(ValueError, match="a: a record needs at least 2 samples along 'time', found 1"):
        wd.records.from_dataset(of(1))


def test_a_column_has_one_meaning():
    table = xr.Dataset({name: ("building", [10.0]) for name in ("id", "longitude", "latitude")})
    with pytest.raises(ValueError, match="'longitude' cannot be both 'longitude' and 'latitude'"):
        wd.inventories.from_table(table, {"latitude": "longitude"})


@pytest.mark.parametrize("columns", [["id"], "id", 5, {"id": ["a"]}])
def test_columns_that_are_no_names_are_told(columns):
    with pytest.raises(TypeError, match="from_table: columns must map meanings to names of columns"):
        wd.inventories.from_table(xr.Dataset({"id": ("building", ["a"])}), columns)
