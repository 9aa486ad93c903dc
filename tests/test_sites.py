"""Motions at sites: files of SimCenter, ShakeMap and OpenQuake, and which motion each building has."""

import json

import numpy as np
import pandas as pd
import pytest

import warpdyn as wd
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.sites.places import EARTH_RADIUS, grid_spacing, nearest_points

pytestmark = pytest.mark.fast

LONGITUDE, LATITUDE = (each.ravel() for each in np.meshgrid(-122 + 0.02 * np.arange(5), 37 + 0.016 * np.arange(4)))
SHAKEMAP = """<?xml version="1.0" encoding="UTF-8" standalone="yes"?>
<shakemap_grid xmlns="http://earthquake.usgs.gov/eqcenter/shakemap" event_id="{event}" shakemap_version="1"
 code_version="4.0" shakemap_event_type="SCENARIO" map_status="RELEASED">
<event event_id="{event}" magnitude="7.0" depth="8.0" lat="37.5" lon="-122.1" event_timestamp="2030-01-01T00:00:00Z"
 event_description="made for a test" />
<grid_specification lon_min="-122.0" lat_min="37.0" lon_max="-121.98" lat_max="37.02" nominal_lon_spacing="0.02"
 nominal_lat_spacing="0.02" nlon="2" nlat="2" />
<event_specific_uncertainty name="pga" value="0.0" numsta="" />
<grid_field index="1" name="LON" units="dd" />
<grid_field index="2" name="LAT" units="dd" />
<grid_field index="3" name="MMI" units="intensity" />
<grid_field index="4" name="PGA" units="{pga}" />
<grid_field index="5" name="PGV" units="cm/s" />
<grid_field index="6" name="PSA03" units="%g" />
<grid_field index="7" name="PSA10" units="%g" />
<grid_field index="8" name="PSA30" units="%g" />
<grid_field index="9" name="STDPGA" units="ln(%g)" />
<grid_data>
-122.0 37.02 6.1 10 11 21 12 2 0.5
-121.98 37.02 6.2 20 12 22 13 3 0.5
-122.0 37.0 6.3 30 13 23 14 4 0.5
-121.98 37.0 6.4 40 14 24 15 5 0.6
</grid_data>
</shakemap_grid>
"""
GMF = """#,,,,"generated_by='OpenQuake engine 3.23.4', investigation_time=50.0"
event_id,gmv_PGA,gmv_SA(0.3),gmv_PGV,custom_site_id
0,2.0E-01,4.0E-01,10.0,p1
0,3.0E-01,5.0E-01,20.0,p2
1,1.0E-01,2.0E-01,5.0,p1
"""
MESH = """#,,"generated_by='OpenQuake engine 3.23.4'"
custom_site_id,lon,lat
p1,-122.00,37.00
p2,-121.98,37.00
"""


def wave(peak, step=0.01, count=200):
    """Return a row of accelerations."""
    return peak * np.sin(np.linspace(0.0, 40.0, count)) * np.hanning(count)


def motions(count):
    return [wd.GroundMotion(wave(0.5 + i), 0.01, f"wave {i}") for i in range(count)]


def buildings(longitude, latitude):
    frame = {"id": [f"b{i}" for i in range(len(longitude))], "longitude": longitude, "latitude": latitude}
    return wd.inventories.from_table(pd.DataFrame(frame))


def write_grid(folder, both=True):
    """Write an EventGrid.csv of 20 stations with two records each, out of four; return the factors."""
    rows = ["GP_file,Longitude,Latitude,Vs30"]
    factors = np.round(1 + np.arange(40).reshape(20, 2) / 10, 3)
    for i, (lon, lat) in enumerate(zip(LONGITUDE, LATITUDE, strict=True)):
        rows.append(f"site{i}.csv,{lon},{lat},300")
        text = f"TH_file,factor\nRSN{i % 2},{factors[i, 0]}\nRSN{2 + i % 2},{factors[i, 1]}\n"
        (folder / f"site{i}.csv").write_text(text)
    for i in range(4):
        told = {"name": f"RSN{i}", "dT": 0.01, "data_x": wave(0.1 + i).tolist()}
        told |= {"data_y": (2 * wave(0.1 + i)).tolist()} if both else {}
        (folder / f"RSN{i}.json").write_text(json.dumps(told))
    (folder / "EventGrid.csv").write_text("\n".join(rows) + "\n")
    return factors


def haversine(lon, lat, other_lon, other_lat):
    """Return great-circle distances [m] by the haversine formula."""
    lon, lat, other_lon, other_lat = map(np.radians, (lon, lat, other_lon, other_lat))
    a = np.sin((lat - other_lat) / 2) ** 2 + np.cos(lat) * np.cos(other_lat) * np.sin((lon - other_lon) / 2) ** 2
    return 2 * EARTH_RADIUS * np.arcsin(np.sqrt(a))


def test_nearest_points_and_their_distances():
    random = np.random.default_rng(0)
    lon, lat = random.uniform(-122, -121.92, 300), random.uniform(37, 37.048, 300)
    index, distance = nearest_points("test", buildings(lon, lat), np.arange(lon.size), LONGITUDE, LATITUDE, 4)
    every = haversine(lon[:, None], lat[:, None], LONGITUDE, LATITUDE)
    # A chord loses half the digits of a small angle at worst: 1e-16 of the radius over the distance of 100 m and more.
    assert distance == pytest.approx(np.sort(every, axis=1)[:, :4], rel=1e-9)
    assert np.array_equal(index, np.argsort(every, axis=1)[:, :4])
    # The cells are 1.78 km by .016 degrees of 111.195 km; the wider is not more than twice the other.
    assert grid_spacing(LONGITUDE, LATITUDE) == pytest.approx(haversine(0.0, 0.0, 0.0, 0.016), rel=1e-2)


def test_neighbours_across_the_date_line():
    index, distance = nearest_points(
        "test", buildings([179.999], [0.0]), np.arange(1), np.array([-179.999, 179.98]), np.zeros(2), 1
    )
    assert index.tolist() == [[0]]
    assert distance[0, 0] == pytest.approx(haversine(0.0, 0.0, 0.002, 0.0), rel=1e-9)


def test_buildings_outside_the_grid_are_counted_and_named():
    grid = wd.sites.MotionGrid(
        LONGITUDE,
        LATITUDE,
        motions(1),
        np.zeros((20, 1, 1), int),
        np.ones((20, 1, 1)),
        [str(i) for i in range(20)],
        ["0"],
    )
    inside = buildings([-121.99, -122.01], [37.01, 37.01])  # the second within the spacing of the grid's edge
    assert grid.at(inside).structures_given == 2
    outside = buildings([-121.99, -122.10, -121.0, -121.9], [37.01, 37.0, 37.0, 37.2])
    with pytest.raises(
        ValueError, match=r"3 \('b1', 'b2', 'b3'\) of 4 buildings are outside the grid.*spacing is 1\.7\d km"
    ):
        grid.at(outside)
    assert grid.at(outside, reach=100e3).structures_given == 4
    with pytest.raises(ValueError, match=r"4 .* of 4 buildings are outside the grid.*reach is 0\.00 km"):
        grid.at(outside, reach=1.0)
    assert grid.at(outside, [0, 0]).structures_given == 2  # only those of the portfolio count
    exchanged = wd.sites.MotionGrid(
        LATITUDE, LONGITUDE + 180, motions(1), np.zeros((20, 1, 1), int), np.ones((20, 1, 1)), [""] * 20, ["0"]
    )
    with pytest.raises(ValueError, match="longitude and latitude seem to be exchanged"):
        exchanged.at(buildings([58.01], [37.01]))


def test_an_event_grid(tmp_path):
    factors = write_grid(tmp_path)
    grid = wd.sites.read_event_grid(tmp_path / "EventGrid.csv", unit="g")
    assert repr(grid) == "MotionGrid(20 points, 2 earthquakes of 8 motions, both components)"
    assert [motion.name for motion in grid.motions[:3]] == ["RSN0 x", "RSN0 y", "RSN2 x"]
    for point, earthquake, component in ((0, 0, 0), (3, 1, 1), (18, 1, 0)):
        motion = grid.motions[grid.motion[point, earthquake, component]]
        expected = STANDARD_GRAVITY * (1 + component) * wave(0.1 + 2 * earthquake + point % 2)
        assert np.allclose(motion.acceleration, expected, rtol=1e-14)
        assert grid.scale[point, earthquake, component] == factors[point, earthquake]
    pair = wd.records.pairs(grid.motions[:2])
    assert [each.component for each in pair[0]] == ["x", "y"]
    folder = wd.sites.read_event_grid(tmp_path, unit="m/s2")  # the folder may be given instead of the file
    assert folder.motions[0].peak_ground_acceleration == pytest.approx(
        grid.motions[0].peak_ground_acceleration / STANDARD_GRAVITY
    )


def test_draws_have_the_probabilities_of_their_weights(tmp_path):
    factors = write_grid(tmp_path, both=False)
    grid = wd.sites.read_event_grid(tmp_path, unit="g")
    count, draws = 4000, 50
    inventory = buildings(np.full(count, -121.985), np.full(count, 37.019))
    design = grid.at(inventory, draws=draws, seed=3)
    assert design.samples_per_structure == draws
    near = haversine(-121.985, 37.019, LONGITUDE, LATITUDE)
    nearest = np.argsort(near)[:4]
    weight = near[nearest] ** -2.0 / (near[nearest] ** -2.0).sum()
    share = np.bincount(np.asarray(design.site).ravel(), minlength=20)[nearest] / (count * draws)
    # Binomial: 4 standard errors, which one of four such shares passes in 1 of 4,000 seeds.
    assert np.all(np.abs(share - weight) < 4 * np.sqrt(weight * (1 - weight) / (count * draws)))
    assert np.bincount(np.asarray(design.site).ravel(), minlength=20)[nearest].sum() == count * draws
    own = design.assign([2, 7], seed=0)
    assert own.structure.tolist() == [2] * draws + [7] * draws
    earthquake = np.tile(np.arange(draws) % 2, 2)  # the first again after the last
    site = np.asarray(design.site)[[2, 7]].ravel()
    assert np.array_equal(own.motion, grid.motion[site, earthquake, 0])
    assert np.array_equal(own.scale, factors[site, earthquake])
    peaks = np.array([motion.peak_ground_acceleration for motion in grid.motions])
    assert own.im_level == pytest.approx(own.scale * peaks[own.motion] / STANDARD_GRAVITY)


def test_a_stock_has_its_buildings_in_the_order_of_the_portfolio(tmp_path):
    write_grid(tmp_path)
    grid = wd.sites.read_event_grid(tmp_path, unit="g")
    random = np.random.default_rng(1)
    inventory = buildings(random.uniform(-122, -121.92, 60), random.uniform(37, 37.048, 60))
    inventory = inventory.assign(structure_type=["URM", "W1", "C1"] * 20, storeys=1, year=1990)
    stock = wd.inventories.portfolio(inventory)
    assert not np.array_equal(stock.rows, np.arange(60))
    found = np.asarray(grid.at(inventory, stock, draws=5, seed=2).site)
    assert np.array_equal(found, np.asarray(grid.at(inventory, draws=5, seed=2).site)[stock.rows])
    with pytest.raises(ValueError, match="made from another inventory: 60 different ids"):
        grid.at(inventory.iloc[::-1].assign(id=lambda frame: "x" + frame["id"]), stock)


def test_draws_depend_on_the_seed_and_the_row_alone(tmp_path):
    write_grid(tmp_path)
    grid = wd.sites.read_event_grid(tmp_path, unit="g")
    random = np.random.default_rng(1)
    inventory = buildings(random.uniform(-122, -121.92, 60), random.uniform(37, 37.048, 60))
    whole = np.asarray(grid.at(inventory, draws=5, seed=2).site)
    rows = random.permutation(60)[:40]
    assert np.array_equal(np.asarray(grid.at(inventory, rows, draws=5, seed=2).site), whole[rows])
    assert np.array_equal(np.asarray(grid.at(inventory.iloc[:30], draws=5, seed=2).site), whole[:30])
    assert not np.array_equal(np.asarray(grid.at(inventory, draws=5, seed=3).site), whole)
    part = grid.at(inventory, draws=5, seed=2).of_structures(rows, 0)
    assert np.array_equal(part.assign([3], 0).motion, grid.at(inventory, draws=5, seed=2).assign([rows[3]], 0).motion)
    alone = grid.at(buildings(LONGITUDE[[4]], LATITUDE[[4]]), draws=30)
    assert set(np.asarray(alone.site).ravel()) == {4}  # a building at a grid point always has this point


# Changes that break the files of a grid, and text of the message.
POINTS = "GP_file,Longitude,Latitude\n"
WRONG_GRIDS = {
    "station file": (lambda at: (at / "site3.csv").unlink(), r"1 \(site3.csv\) of 20 grid points the file"),
    "no motions": (
        lambda at: (at / "site3.csv").write_text("TH_file,factor\n"),
        r"1 \(site3.csv\) of 20 .* no motions",
    ),
    "one motion": (
        lambda at: (at / "site3.csv").write_text("TH_file\nRSN1\n"),
        r"1 \(site3.csv\) of 20 .* other numbers",
    ),
    "record": (lambda at: (at / "RSN3.json").unlink(), r"1 \('RSN3' of site1.csv\) of 4 motions have no file"),
    "factor": (lambda at: (at / "site3.csv").write_text("TH_file,factor\nRSN1,0\nRSN2,1\n"), "row 1: factor must be"),
    "one component": (
        lambda at: (at / "RSN3.json").write_text('{"dT": 0.01, "data_x": [0, 1, 0]}'),
        "some motions have one component and others two",
    ),
    "no step": (lambda at: (at / "RSN3.json").write_text('{"data_x": [0, 1, 0]}'), r"RSN3.json must be JSON with dT"),
    "no name": (
        lambda at: (at / "EventGrid.csv").write_text(POINTS + ",-1,3\n"),
        r"1 \(row 1\) of 1 grid points have no",
    ),
    "no place": (lambda at: (at / "EventGrid.csv").write_text(POINTS + "b.csv,,3\n"), "all of 1 .* have no longitude"),
    "column": (lambda at: (at / "EventGrid.csv").write_text("GP_file,Latitude\na,1\n"), "no column 'Longitude'"),
    "intensities": (
        lambda at: [(at / f"site{i}.csv").write_text("PGA\n1\n") for i in range(20)],
        "use read_intensity_grid",
    ),
}


@pytest.mark.parametrize("what", WRONG_GRIDS)
def test_broken_event_grids_are_refused_by_name(what, tmp_path):
    write_grid(tmp_path)
    damage, message = WRONG_GRIDS[what]
    damage(tmp_path)
    with pytest.raises(ValueError, match=message):
        wd.sites.read_event_grid(tmp_path, unit="g")


def test_an_event_grid_of_intensities(tmp_path):
    (tmp_path / "EventGrid.csv").write_text("GP_file,Longitude,Latitude\na.csv,-122,37\nb.csv,-121.98,37\n")
    (tmp_path / "a.csv").write_text("PGA,SA_0.3,SA(1.0),PGV\n0.1,0.2,0.3,10\n0.4,0.5,0.6,20\n")
    (tmp_path / "b.csv").write_text("PGA,SA_0.3,SA(1.0),PGV\n0.7,0.8,0.9,30\n1.0,1.1,1.2,40\n")
    found = wd.sites.read_intensity_grid(tmp_path, unit="m/s2")
    assert found["SA(0.3)"].values * STANDARD_GRAVITY == pytest.approx(np.array([[0.2, 0.8], [0.5, 1.1]]))
    assert found["PGV"].values.tolist() == [[10, 30], [20, 40]]
    assert "units" not in found["PGV"].attrs
    with pytest.raises(ValueError, match=r"PGV must be in 'm s-1', got None"):
        wd.sites.scale_records(found["PGV"], motions(1))
    write_grid(tmp_path)
    with pytest.raises(ValueError, match="use read_event_grid"):
        wd.sites.read_intensity_grid(tmp_path, unit="g")


@pytest.mark.parametrize(("unit", "factor"), [("%g", 0.01), ("pctg", 0.01), ("g", 1.0)])
def test_a_shakemap(tmp_path, unit, factor):
    path = tmp_path / "grid.xml"
    path.write_text(SHAKEMAP.format(event="us1", pga=unit))
    found = wd.sites.read_shakemap(path)
    assert found.sizes == {"earthquake": 1, "point": 4}
    assert found["longitude"].values.tolist() == [-122.0, -121.98, -122.0, -121.98]
    assert found["latitude"].values.tolist() == [37.02, 37.02, 37.0, 37.0]
    assert found["PGA"].values == pytest.approx(factor * np.array([[10, 20, 30, 40]]))
    assert found["SA(0.3)"].values == pytest.approx(np.array([[0.21, 0.22, 0.23, 0.24]]))
    assert found["SA(3.0)"].values == pytest.approx(np.array([[0.02, 0.03, 0.04, 0.05]]))
    assert found["PGV"].values == pytest.approx(np.array([[0.11, 0.12, 0.13, 0.14]]))
    assert found["STDPGA"].values.tolist() == [[0.5, 0.5, 0.5, 0.6]]
    assert [found[name].attrs["units"] for name in ("PGA", "SA(1.0)", "PGV", "MMI", "STDPGA")] == [
        *("g", "g", "m s-1", "1", "1")
    ]
    assert found.attrs["magnitude"] == "7.0"
    other = tmp_path / "other.xml"
    other.write_text(SHAKEMAP.format(event="us2", pga=unit))
    assert wd.sites.read_shakemap(path, other)["earthquake"].values.tolist() == ["us1", "us2"]


WRONG_SHAKEMAPS = {
    "unit": (("%g", "furlong"), "PGA has the unit 'furlong'"),
    "values": (("6.4 40 14 24 15 5 0.6", "6.4 40 14"), "has 32 values, but its grid has 4 points of 9 fields"),
    "text": (("6.4 40", "6.4 x"), "must contain only numbers"),
    "no places": (('name="LON"', 'name="X"'), "no field LON"),
    "not one": (("shakemap_grid", "grid"), "is not a ShakeMap"),
    "no XML": (("</grid_data>", ""), "is not XML"),
    "places": (("-122.0 37.02", "37.02 -122.0"), "LON is from -122 to 37.02.*may be exchanged"),
}


@pytest.mark.parametrize("what", WRONG_SHAKEMAPS)
def test_broken_shakemaps_are_refused(what, tmp_path):
    (old, new), message = WRONG_SHAKEMAPS[what]
    path = tmp_path / "grid.xml"
    path.write_text(SHAKEMAP.format(event="us1", pga="%g").replace(old, new))
    with pytest.raises(ValueError, match=message):
        wd.sites.read_shakemap(path)


def test_ground_motion_fields(tmp_path):
    fields, sites = tmp_path / "gmf.csv", tmp_path / "sites.csv"
    fields.write_text(GMF)
    sites.write_text(MESH)
    found = wd.sites.read_ground_motion_field(fields, sites)
    assert found["PGA"].values.tolist() == [[0.2, 0.3], [0.1, 0.0]]  # 0 where the file has no value
    assert found["SA(0.3)"].values.tolist() == [[0.4, 0.5], [0.2, 0.0]]
    assert found["PGV"].values == pytest.approx(np.array([[0.1, 0.2], [0.05, 0.0]]))
    assert found["earthquake"].values.tolist() == ["0", "1"]
    assert found["point_name"].values.tolist() == ["p1", "p2"]
    sites.write_text(MESH + "p3,-121.96,37\n")
    with pytest.warns(UserWarning, match=r"1 of 3 sites \(p3, \.\.\.\) have no value"):
        wd.sites.read_ground_motion_field(fields, sites)
    sites.write_text(MESH)
    for old, new, message in (
        ("0,3.0E-01", "0,-3.0E-01", "finite numbers of at least 0, but 1 of 3 are not: the first is -0.3 at site p2"),
        ("20.0,p2", "20.0,p9", r"sites that are not in .*: 1 \(p9\)"),
        ("20.0,p2", "20.0,p1", "site p1 has event 0 twice"),
        ("gmv_", "", "no columns gmv_<measure>"),
        ("event_id", "event", "no column event_id or eid"),
    ):
        fields.write_text(GMF.replace(old, new))
        with pytest.raises(ValueError, match=message):
            wd.sites.read_ground_motion_field(fields, sites)
    fields.write_text(GMF)
    sites.write_text(MESH.replace("p2", "p1"))
    with pytest.raises(ValueError, match="'p1' has two rows"):
        wd.sites.read_ground_motion_field(fields, sites)


def test_records_are_scaled_to_a_field(tmp_path):
    (tmp_path / "gmf.csv").write_text(GMF)
    (tmp_path / "sites.csv").write_text(MESH)
    field = wd.sites.read_ground_motion_field(tmp_path / "gmf.csv", tmp_path / "sites.csv")
    measure = wd.SpectralAcceleration(0.3)
    records = motions(3)
    grid = wd.sites.scale_records(field["SA(0.3)"], records, seed=4)
    for earthquake in range(2):
        (index,) = set(grid.motion[:, earthquake].ravel())  # one record for all points
        for point in range(2):
            scale = grid.scale[point, earthquake, 0]
            scaled = measure.value(wd.GroundMotion(scale * records[index].acceleration, 0.01)) / STANDARD_GRAVITY
            assert scaled == pytest.approx(field["SA(0.3)"].values[earthquake, point], rel=1e-12, abs=1e-15)
    assert wd.sites.scale_records(field["PGA"], records, record=[2, 0]).motion[0, :, 0].tolist() == [2, 0]
    # A record is repeated only after all others.
    many = field["PGA"].isel(earthquake=[0, 1] * 6).assign_coords(earthquake=[str(i) for i in range(12)])
    drawn = wd.sites.scale_records(many, records, seed=5).motion[0, :, 0]
    assert [sorted(drawn[i : i + 3]) for i in range(0, 12, 3)] == [[0, 1, 2]] * 4
    pairs = [(records[0], records[2]), (records[1], records[0])]
    both = wd.sites.scale_records(field["PGA"], pairs, record=[0, 1])
    assert both.motion.shape == (2, 2, 2)
    peaks = [motion.peak_ground_acceleration for motion in both.motions]
    mean = np.sqrt(peaks[0] * peaks[1])
    assert both.scale[1, 0] == pytest.approx([0.3 * STANDARD_GRAVITY / mean] * 2)


def test_the_mean_of_the_factors_of_near_points(tmp_path):
    path = tmp_path / "grid.xml"
    path.write_text(SHAKEMAP.format(event="us1", pga="%g"))
    grid = wd.sites.scale_records(wd.sites.read_shakemap(path)["PGA"], motions(1))
    lon, lat = np.array([-121.994, -122.0]), np.array([37.007, 37.02])
    design = grid.at(buildings(lon, lat), choice="mean")
    near = haversine(lon[0], lat[0], grid.longitude, grid.latitude)
    expected = (near**-2.0 @ [0.1, 0.2, 0.3, 0.4]) / (near**-2.0).sum()
    assert design.assign([0, 1], 0).im_level == pytest.approx([expected, 0.1])
    nearest = grid.at(buildings(lon, lat), neighbours=1)
    assert nearest.assign([0, 1], 0).im_level == pytest.approx([0.3, 0.1])
    write_grid(tmp_path)
    with pytest.raises(ValueError, match="needs the same motion at all points"):
        wd.sites.read_event_grid(tmp_path, unit="g").at(buildings([-122], [37]), choice="mean")


def test_fields_that_cannot_be_scaled_to(tmp_path):
    path = tmp_path / "grid.xml"
    path.write_text(SHAKEMAP.format(event="us1", pga="%g"))
    found = wd.sites.read_shakemap(path)
    for field, records, message in (
        (found["MMI"], motions(1), "named 'MMI', but its name must be"),
        (found["PGA"].assign_attrs(units="gal"), motions(1), "PGA must be in 'g' or 'm s-2', got 'gal'"),
        (found["PGA"].isel(earthquake=0), motions(1), "must have the dimensions earthquake and point"),
        (
            found["PGA"].copy(data=[[0.1, np.nan, -1, 0]]),
            motions(1),
            "values of PGA must be finite numbers of at least 0, but 2 of",
        ),
        (found["PGA"], [motions(1)[0], tuple(motions(2))], "all single motions, or all pairs"),
        (found["PGA"], [wd.GroundMotion([0.0, 0.0], 0.01, "silence")], "'silence' has PGA = 0"),
    ):
        with pytest.raises(ValueError, match=message):
            wd.sites.scale_records(field, records)
    with pytest.raises(ValueError, match="each of 1 earthquakes"):
        wd.sites.scale_records(found["PGA"], motions(2), record=[2])
