"""Maps of buildings: what the cells hold, counted one by one, and what is drawn of few and of many."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import PathCollection, QuadMesh
from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar

import warpdyn as wd
from warpdyn.interfaces.plots import maps

pytestmark = pytest.mark.fast

DEGREE = 6371.0 * np.pi / 180  # km


def make_results(count, seed=0):
    """Build what `building_results` returns of some buildings at random places."""
    random = np.random.default_rng(seed)
    shares = random.dirichlet([4, 2, 1], count)
    names = ("none", "slight", "complete")
    frame = pd.DataFrame(
        {
            "id": np.arange(count).astype(str),
            "longitude": random.uniform(10.0, 10.4, count),
            "latitude": random.uniform(59.8, 60.0, count),
            "number": random.integers(1, 20, count).astype(float),
            "replacement_cost": random.uniform(1e5, 1e6, count),
            "expected_loss_ratio": random.random(count),
        }
    )
    for place, name in enumerate(names):
        frame[f"probability_{name}"], frame[f"standard_error_{name}"] = shares[:, place], 0.1
    return frame


def of_kind(axes, kind):
    (found,) = (each for each in axes.collections if isinstance(each, kind))
    return found


@pytest.mark.parametrize(
    ("state", "weight"), [(None, "replacement_cost"), ("slight", "number"), ("complete", "number")]
)
def test_cells_hold_the_weighted_means_of_their_buildings(state, weight):
    results = make_results(400)
    figure = wd.plots.damage_map(results, state, cell=2.5)
    mesh = of_kind(figure.axes[0], QuadMesh)
    corners = mesh.get_coordinates()
    east, north = corners[0, :, 0], corners[:, 0, 1]
    # Squares of 2.5 km on a sphere of 6371 km; the middle latitude of these buildings is 59.9 degrees to some 0.001.
    np.testing.assert_allclose(np.diff(north), 2.5 / DEGREE, rtol=1e-4)
    np.testing.assert_allclose(np.diff(east), 2.5 / (DEGREE * np.cos(np.radians(59.9))), rtol=2e-4)
    values = {
        None: results["expected_loss_ratio"],
        "slight": results["probability_slight"] + results["probability_complete"],
        "complete": results["probability_complete"],
    }[state]
    found = mesh.get_array().reshape(north.size - 1, east.size - 1)
    counted = 0
    for row in range(north.size - 1):
        for column in range(east.size - 1):
            inside = results["longitude"].between(*east[column : column + 2]) & results["latitude"].between(
                *north[row : row + 2]
            )
            counted += inside.sum()
            if not inside.any():
                assert np.ma.getmaskarray(found)[row, column]
                continue
            expected = np.average(values[inside], weights=results[weight][inside])
            assert found[row, column] == pytest.approx(expected, rel=1e-12)
    assert counted == 400


def test_few_buildings_are_points_and_many_are_cells(monkeypatch):
    results = make_results(50)
    points = of_kind(wd.plots.damage_map(results).axes[0], PathCollection)
    order = np.argsort(results["expected_loss_ratio"].to_numpy())
    np.testing.assert_allclose(points.get_offsets(), results[["longitude", "latitude"]].to_numpy()[order])
    assert np.diff(points.get_array()).min() > 0  # the worst on top
    monkeypatch.setattr(maps, "MOST_BUILDINGS", 49)
    cells = of_kind(wd.plots.damage_map(results).axes[0], QuadMesh)
    assert max(cells.get_coordinates().shape) == pytest.approx(maps.CELLS, abs=2)


def test_a_kilometre_is_as_long_to_the_east_as_to_the_north():
    axes = wd.plots.damage_map(make_results(50), "slight").axes[0]
    # At 59.9 degrees a degree of longitude is half one of latitude.
    assert axes.get_aspect() == pytest.approx(1 / np.cos(np.radians(59.9)), rel=1e-3)
    axes.figure.draw_without_rendering()
    box, (west, east), (south, north) = axes.get_window_extent(), axes.get_xlim(), axes.get_ylim()
    per_degree = box.width / (east - west), box.height / (north - south)
    assert per_degree[0] / per_degree[1] == pytest.approx(np.cos(np.radians(59.9)), rel=0.01)


def test_scale_bar_has_the_length_that_it_names():
    axes = wd.plots.damage_map(make_results(50), "slight").axes[0]
    axes.figure.draw_without_rendering()
    (bar,) = (each for each in axes.get_children() if isinstance(each, AnchoredSizeBar))
    kilometres = float(bar.txt_label.get_text().removesuffix(" km"))
    box, (west, east) = bar.size_bar.get_children()[0], axes.get_xlim()
    degrees = box.get_width()
    # On a sphere with a circumference of 40,030 km, at 59.9 degrees north.
    assert degrees * 40_030 / 360 * np.cos(np.radians(59.9)) == pytest.approx(kilometres, rel=1e-3)
    assert 0.1 < degrees / (east - west) <= 0.25


def test_a_column_of_the_users_own_is_no_damage_state():
    results = make_results(50)
    own = results.assign(probability_of_flooding=0.5)
    expected, found = (of_kind(wd.plots.damage_map(each, "slight").axes[0], PathCollection) for each in (results, own))
    np.testing.assert_array_equal(found.get_array(), expected.get_array())
    with pytest.raises(ValueError, match=r"unknown damage state 'of_flooding'.*allowed: 'none', 'slight', 'complete'$"):
        wd.plots.damage_map(own, "of_flooding")


def test_what_the_map_is_of_is_written_on_it():
    results = make_results(50)
    figure = wd.plots.damage_map(results, "slight")
    assert figure.axes[0].get_title() == f"50 rows of {results['number'].sum():,.0f} buildings"
    assert figure.axes[1].get_ylabel() == "Share of buildings in slight damage or worse"
    assert wd.plots.damage_map(results, "complete").axes[1].get_ylabel() == "Share of buildings in complete damage"
    one_each = wd.plots.damage_map(results.assign(number=1.0), cell=5.0)
    assert one_each.axes[0].get_title() == "50 buildings, cells of 5 km"
    assert one_each.axes[1].get_ylabel() == "Expected loss divided by replacement cost"


def test_buildings_without_a_value_and_undamaged_ones():
    results = make_results(50)
    results.loc[:9, "probability_complete"] = np.nan  # all their samples failed
    points = of_kind(wd.plots.damage_map(results, "slight").axes[0], PathCollection)
    assert len(points.get_offsets()) == 40
    none = wd.plots.damage_map(results.assign(expected_loss_ratio=0.0))
    assert of_kind(none.axes[0], PathCollection).get_clim() == (0, 1)
    single = wd.plots.damage_map(make_results(1), cell=1.0)
    single.draw_without_rendering()


@pytest.mark.parametrize(
    ("changed", "how", "message"),
    [
        ([], {"state": "sligt"}, r"unknown damage state 'sligt' \(did you mean 'slight'\?\)"),
        (["expected_loss_ratio"], {}, "the table has no losses: give state="),
        (["number"], {"state": "slight"}, "the table has no column 'number'"),
        (["replacement_cost"], {}, "the table has no column 'replacement_cost'"),
        (
            [f"standard_error_{state}" for state in ("none", "slight", "complete")],
            {"state": "slight"},
            r"no probabilities of damage and standard errors: draw the result of building_results",
        ),
        ([], {"cell": 0.0}, "cell must be a finite number above 0"),
    ],
)
def test_what_cannot_be_drawn_is_refused(changed, how, message):
    with pytest.raises(ValueError, match=message):
        wd.plots.damage_map(make_results(5).drop(columns=changed), **how)
    with pytest.raises(TypeError, match=r"damage_map\(\) takes a DataFrame, got dict"):
        wd.plots.damage_map({})
    with pytest.raises(ValueError, match="no building has a value"):
        wd.plots.damage_map(make_results(5).assign(expected_loss_ratio=np.nan))
    with pytest.raises(ValueError, match="no building has a replacement_cost above 0"):
        wd.plots.damage_map(make_results(5).assign(replacement_cost=0.0))
