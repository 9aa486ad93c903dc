"""The design of motions at sites: each sample is the history of its building under its motion at its scale."""

import numpy as np
import pandas as pd
import pytest
from test_portfolio import CITY, SETTINGS, chain, simulate
from test_simulate import MOTIONS

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given("first_period", "yield_base_shear_coefficient", "scale_factor")

BUILDINGS, DRAWS, SITES, EARTHQUAKES = CITY.buildings, 3, 4, 2


def make_design(**changes):
    random = np.random.default_rng(8)
    shape = (SITES, EARTHQUAKES, 2)
    given = {
        "motion": random.integers(0, len(MOTIONS), shape),
        "scale": random.uniform(0.5, 2.0, shape),
        "site": random.integers(0, SITES, (BUILDINGS, DRAWS)),
        "names": ["first", "second"],
    }
    return wd.MotionsAtSites(MOTIONS, **(given | changes))


def expected_samples(design):
    """Return motion and scale of each sample, by loops over what was given."""
    found = []
    for building in range(BUILDINGS):
        for draw in range(DRAWS):
            site = np.asarray(design.site)[building, draw]
            for component in range(2):
                place = site, draw % EARTHQUAKES, component
                found.append((design.motion[place], design.scale[place]))
    return tuple(np.array(each) for each in zip(*found, strict=True))


@pytest.fixture(scope="module")
def run():
    design = make_design()
    return design, simulate(CITY, design, seed=5, device="cpu", **SETTINGS)


def test_every_sample_has_its_motion_and_scale(run):
    design, found = run
    motion, scale = expected_samples(design)
    assert np.array_equal(found["motion_index"].values, motion)
    assert np.array_equal(found["scale_factor_of_motion"].values, scale)
    assert np.array_equal(found["building"].values, np.repeat(np.arange(BUILDINGS), 2 * DRAWS))
    peaks = np.array([each.peak_ground_acceleration for each in MOTIONS]) / 9.80665
    assert found["im_level"].values == pytest.approx(scale * peaks[motion], rel=1e-12)


def test_histories_are_those_of_the_buildings_under_one_motion(run):
    # Each sample by itself, through a design that has its own tests: the same buildings, a motion and a scale each.
    design, found = run
    motion, scale = (each.reshape(BUILDINGS, -1) for each in expected_samples(design))
    for draw in range(2 * DRAWS):
        alone = wd.OneMotionPerStructure(MOTIONS, motion[:, draw], scale[:, draw])
        one = simulate(CITY, alone, seed=5, device="cpu", **SETTINGS)
        for name in ("peak_storey_drift", "status"):
            np.testing.assert_array_equal(found[name].values[draw :: 2 * DRAWS], one[name].values)


def test_a_file_holds_the_same(run, tmp_path):
    design, found = run
    written = simulate(CITY, design, seed=5, device="cpu", path=tmp_path / "run.nc", **SETTINGS)
    with written:
        np.testing.assert_array_equal(written["peak_storey_drift"].values, found["peak_storey_drift"].values)
        assert written.attrs["fingerprint"]


def test_samples_are_labelled(run):
    design, found = run
    part = found.isel(sample=slice(4, None, 3))  # labels go by the samples' numbers
    labelled = wd.sites.label_samples(part, design)
    number = np.arange(BUILDINGS * DRAWS * 2)[4::3]
    building, draw = number // (DRAWS * 2), number % (DRAWS * 2) // 2
    assert np.array_equal(labelled["draw_index"].values, draw)
    assert np.array_equal(labelled["earthquake_index"].values, draw % EARTHQUAKES)
    assert np.array_equal(labelled["site_index"].values, np.asarray(design.site)[building, draw])
    assert labelled["earthquake_name"].values.tolist() == ["first", "second"]
    with pytest.raises(ValueError, match="75 or more structures, but the design has 2"):
        wd.sites.label_samples(found, make_design(site=[[0], [1]]))


def test_damage_is_counted_by_draw(run):
    design, found = run
    limits = {name: {"light": 0.002, "heavy": 0.01} for name in CITY.archetypes}
    labelled = wd.sites.label_samples(found, design)
    shares = wd.damage_shares(labelled, limits, events=labelled["draw_index"])
    drift = np.nanmax(found["peak_storey_drift_ratio"].values, axis=1).reshape(BUILDINGS, DRAWS, 2)
    collapsed = (found["status"].values == 1).reshape(drift.shape)
    state = np.where(collapsed, 2, (drift[..., None] > [0.002, 0.01]).sum(axis=-1)).max(axis=2)  # the worse component
    expected = [[np.mean(state[:, draw] == each) for each in range(3)] for draw in range(DRAWS)]
    assert shares["damage_share"].values == pytest.approx(np.array(expected))
    assert shares["event"].values.tolist() == [0, 1, 2]
    with pytest.raises(ValueError, match=r"events must have the shape \[150\], one event per sample"):
        wd.damage_shares(labelled, limits, events=labelled["draw_index"][:3])


def test_one_building_at_many_sites():
    # Not a portfolio: as many structures as have sites.
    design = wd.MotionsAtSites(MOTIONS, [[[0]], [[1]]], [[[1.0]], [[0.0]]], site=[[0], [1], [1]])
    found = wd.simulate(wd.Scene(chain(2), design, recorders=("drift",), **SETTINGS), device="cpu")
    assert found["motion_index"].values.tolist() == [0, 1, 1]
    drift = found["peak_storey_drift"].values
    assert drift[0].min() > 0
    assert np.all(drift[1:] == 0)  # no shaking at the second site
    scene = wd.Scene.from_json(wd.Scene(chain(2), design).to_json(), motions=MOTIONS)
    assert np.array_equal(scene.excitation.site, design.site)


def test_the_portfolio_of_an_inventory_at_its_sites(tmp_path):
    random = np.random.default_rng(4)
    count = 30
    frame = pd.DataFrame(
        {
            "id": [f"b{i}" for i in range(count)],
            "longitude": random.uniform(0, 0.02, count),
            "latitude": random.uniform(0, 0.02, count),
            "structure_type": random.choice(["W1", "S1L", "C1L"], count),
            "storeys": 2,
            "year": 1990,
        }
    )
    inventory = wd.inventories.from_table(frame)
    stock = wd.inventories.portfolio(inventory)
    grid = wd.sites.MotionGrid(
        *(each.ravel() for each in np.meshgrid([0, 0.01, 0.02], [0, 0.01, 0.02])),
        MOTIONS[:3],
        np.arange(9).reshape(9, 1, 1) % 3,
        np.ones((9, 1, 1)),
        [str(i) for i in range(9)],
        ["0"],
    )
    design = grid.at(inventory, stock.rows, neighbours=1)
    scene = wd.Scene(stock.portfolio, design, recorders=("drift",))
    run = wd.simulate(scene, device="cpu", method="rk4", keep_inputs=False)
    # The nearest point of a building, and the history of its own type under that point's motion.
    for place in (0, 11, 29):
        row = inventory.iloc[stock.rows[place]]
        x, y = round(row["longitude"] / 0.01), round(row["latitude"] / 0.01)
        motion = (3 * y + x) % 3
        assert run["motion_index"].values[place] == motion
        building = wd.ShearBuilding.from_hazus(row["structure_type"], "high", 2)
        longest = float(run["integration_step"].values[place])
        one = wd.simulate(
            wd.Scene(building, wd.Cloud([MOTIONS[motion]]), recorders=("drift",)), device="cpu", longest_step=longest
        )
        assert run["peak_storey_drift"].values[place, :2] == pytest.approx(one["peak_storey_drift"].values[0], rel=1e-5)


WRONG = {
    "motion": ({"motion": [[[9]]]}, "motion must be from 0 to"),
    "motion's shape": ({"motion": [[0]]}, r"whole numbers of the shape \[site, earthquake, component\]"),
    "scale": ({"scale": -1.0}, r"scale\[0, 0, 0\] is -1.0: factors must be finite and at least 0"),
    "scale's shape": ({"scale": np.ones(3)}, r"scale has shape \(3,\), and motion has shape"),
    "site": ({"site": [[4]]}, "site must be from 0 to 3, got 4 to 4"),
    "earthquake": ({"earthquake": [0]}, "earthquake has 1 value, and site has 3 draws"),
    "names": ({"names": ["one"]}, "names has 1 value, and motion has 2 earthquakes"),
}


@pytest.mark.fast
@pytest.mark.parametrize("what", WRONG)
def test_designs_that_cannot_be(what):
    changed, message = WRONG[what]
    with pytest.raises(ValueError, match=message):
        make_design(**changed)


@pytest.mark.fast
def test_a_design_is_for_so_many_structures():
    with pytest.raises(ValueError, match=r"MotionsAtSites\.site has 2 rows, but the run has"):
        simulate(CITY, make_design(site=[[0], [1]]), device="cpu", **SETTINGS)
    assert repr(make_design()) == (
        f"MotionsAtSites({BUILDINGS} structures at 4 sites, 3 draws of 2 earthquakes, both components)"
    )
