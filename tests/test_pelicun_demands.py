"""Demand samples of pelicun: names, units, collapses and failures, and the same read back."""

import io
import re

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from plotted_runs import CAPACITY, COLLAPSES, LEVELS, MOTIONS, striped_run

import warpdyn as wd

pytestmark = pytest.mark.fast

G = 9.80665


def complete_run():
    """The run made by hand, with floor accelerations: floor i has i times the ground's of the scaled motion."""
    run = striped_run()
    recorded = 1.0 + np.arange(MOTIONS)  # m/s2
    scale = run["im_level"].values * G / recorded[run["motion_index"].values]
    acceleration = (run["im_level"].values * G)[:, None] * np.array([1.0, 2.0, 3.0])
    said = {"units": "m s-2"}
    run["motion_peak_acceleration"] = "motion", recorded, said
    run["peak_floor_acceleration"] = ("sample", "floor"), acceleration, said
    return run.assign_coords(scale_factor_of_motion=("sample", scale))


def pandas_table(path):
    """Read a file as pelicun does: the first column is the index, the row called Units holds units."""
    table = pd.read_csv(path, index_col=0)
    return table.drop(index="Units").astype(float), table.loc["Units"]


def test_names_units_and_values(tmp_path):
    run = complete_run()
    path = wd.write_pelicun_demands(run, tmp_path / "demands.csv", level=0.2)
    table, units = pandas_table(path)
    floors = [f"1-PFA-{floor}-1" for floor in range(4)]
    storeys = [f"1-{kind}-{storey}-1" for kind in ("PID", "RID") for storey in (1, 2, 3)]
    assert list(table.columns) == [*floors, *storeys, "1-PGA-0-1"]
    assert units.tolist() == ["mps2"] * 4 + ["rad"] * 6 + ["g"]
    assert table.index.astype(int).tolist() == run["sample"].values[:: LEVELS.size].tolist()  # numbers in the run
    # At 0.2 g, by the run's making. 1e-12: products of a few roundings.
    np.testing.assert_allclose(table[floors], 0.2 * G * np.array([1, 1, 2, 3]) * np.ones((MOTIONS, 1)), rtol=1e-12)
    drift = 0.002 * (1.0 + np.arange(MOTIONS))
    np.testing.assert_allclose(table["1-PID-1-1"], drift, rtol=1e-12)
    np.testing.assert_allclose(table["1-PID-3-1"], 0.3 * drift, rtol=1e-12)
    np.testing.assert_allclose(table["1-RID-2-1"], 0.06 * drift, rtol=1e-12)  # without the sign
    assert (table["1-PGA-0-1"] == 0.2).all()


def test_spectral_accelerations_are_named_by_their_period(tmp_path):
    run = complete_run()
    for name, column in (
        ("Sa(0.75 s, 5 %)", "1-SA_0.75-0-1"),
        ("Sa(2 s, 5 %)", "1-SA_2-0-1"),
        ("geometric mean of Sa(1 s, 5 %)", "1-SA_1-0-1"),
    ):
        run["im_level"].attrs["intensity_measure"] = name
        table, _ = pandas_table(wd.write_pelicun_demands(run, tmp_path / "demands.csv", level=0.2, overwrite=True))
        assert table.columns[-1] == column
    run["im_level"].attrs["intensity_measure"] = "Sa_avg(0.1 to 2 s, 20 periods, 5 %)"
    table, _ = pandas_table(wd.write_pelicun_demands(run, tmp_path / "demands.csv", level=0.2, overwrite=True))
    assert table.columns[-1] == "1-RID-3-1"  # pelicun has no such demand


def test_stripes_are_selected(tmp_path):
    run, path = complete_run(), tmp_path / "demands.csv"
    with pytest.raises(ValueError, match=r"4 stripes.*give level=.*0\.2, 0\.4, 0\.8, 1\.6"):
        wd.write_pelicun_demands(run, path)
    with pytest.raises(ValueError, match=r"no stripe at 0\.3; level= may be 0\.2"):
        wd.write_pelicun_demands(run, path, level=0.3)
    assert not path.exists()
    table, _ = pandas_table(wd.write_pelicun_demands(run, path, level=[0.2, 0.4]))
    assert np.unique(table["1-PGA-0-1"]).tolist() == [0.2, 0.4]
    assert len(table) == 2 * MOTIONS
    one = run.isel(sample=np.flatnonzero(run["im_level"] == 0.4))
    table, _ = pandas_table(wd.write_pelicun_demands(one, path))
    assert len(table) == MOTIONS


def test_collapsed_samples_are_at_the_limit_and_have_no_residual_drift(tmp_path, caplog):
    run = complete_run()
    table, _ = pandas_table(wd.write_pelicun_demands(run, tmp_path / "demands.csv", level=0.8))
    # Of 10 motions the 5 strongest collapse, at a drift ratio of 0.1; the others drift by 0.8 % times their number.
    collapsed = table["1-PID-1-1"] >= CAPACITY
    assert collapsed.tolist() == [False] * 5 + [True] * COLLAPSES[2]
    assert table.loc[collapsed, "1-RID-1-1"].isna().all()
    assert table.loc[~collapsed, "1-RID-1-1"].notna().all()
    assert "5 of 10 samples collapsed" in caplog.text
    above, most = re.search(r"to above ([\d.]+) and at most ([\d.]+)", caplog.text).groups()
    assert 0.04 < float(above) < 0.0401  # no standing sample is above it, and any limit between the two will do
    assert float(most) == CAPACITY


def test_a_collapse_below_the_limit_is_raised_to_it_in_its_storey(tmp_path):
    run, path = complete_run(), tmp_path / "demands.csv"
    weak = int(np.flatnonzero((run["im_level"] == 0.8) & (run["motion_index"] == 9))[0])
    run["peak_storey_drift_ratio"][weak] = [0.001, 0.02, 0.001]  # a storey with a capacity of 2 %
    run["storey_of_collapse"][weak] = 2
    with pytest.raises(ValueError, match=r"collapsed sample is 0\.02, the largest of a sample without collapse 0\.04,"):
        wd.write_pelicun_demands(run, path, level=0.8)
    with pytest.raises(ValueError, match=r"sample 18 did not collapse.* 0\.04, which is not below .* = 0\.03 \(2 of 5"):
        wd.write_pelicun_demands(run, path, level=0.8, collapse_drift_ratio=0.03)
    with pytest.raises(UserWarning, match=r"collapse drift ratio is 10 .* given in percent, it would be 0.1"):
        wd.write_pelicun_demands(run, path, level=0.8, collapse_drift_ratio=10)
    table, _ = pandas_table(wd.write_pelicun_demands(run, path, level=0.8, collapse_drift_ratio=0.1))
    assert table.iloc[9][["1-PID-1-1", "1-PID-2-1", "1-PID-3-1"]].tolist() == [0.001, 0.1, 0.001]
    assert (table.filter(like="PID").max(axis=1) >= 0.1).sum() == COLLAPSES[2]
    del run["storey_of_collapse"]
    table, _ = pandas_table(wd.write_pelicun_demands(run, path, level=0.8, collapse_drift_ratio=0.1))
    assert table.iloc[9]["1-PID-2-1"] == 0.1  # the storey of the largest drift


def test_the_scene_s_own_limit_holds_where_the_drift_ended_just_below(tmp_path, caplog):
    # A sample is stopped within its last step, in float32, and its largest drift may lie a rounding below the limit.
    run, path = complete_run(), tmp_path / "demands.csv"
    collapsed = run["status"] == 1
    run["peak_storey_drift_ratio"] = run["peak_storey_drift_ratio"] * xr.where(collapsed, 0.9999, 1.0)
    run.attrs["scene"] = '{"collapse_drift_ratio": 0.1}'
    table, _ = pandas_table(wd.write_pelicun_demands(run, path, level=0.8))
    assert (table["1-PID-1-1"] >= 0.1).sum() == COLLAPSES[2]
    assert "drift ratio of the collapse check, to 0.1" in caplog.text
    run.attrs["scene"] = '{"collapse_drift_ratio": 0.03}'  # storeys with larger capacities of their own stand beyond it
    table, _ = pandas_table(wd.write_pelicun_demands(run, path, level=0.8))
    assert table["1-PID-1-1"].max() == pytest.approx(0.09999, rel=1e-12)


def test_failed_samples_are_marked(tmp_path):
    run, path = complete_run(), tmp_path / "demands.csv"
    run["status"][4] = 2  # diverged
    run["peak_storey_drift_ratio"][4] = np.nan
    table, units = pandas_table(wd.write_pelicun_demands(run, path, level=0.2))
    assert np.isnan(units["1-ERROR-0-1"])
    assert table["1-ERROR-0-1"].tolist() == [0, 1, *[0] * 8]
    again = wd.read_pelicun_demands(path)
    assert again["failed"].values.tolist() == [0, 1, *[0] * 8]
    run["status"][:] = 2
    with pytest.raises(ValueError, match="every sample failed"):
        wd.write_pelicun_demands(run, path, level=0.2)


def test_runs_of_something_else_are_refused(tmp_path):
    run, path = complete_run(), tmp_path / "demands.csv"
    cases = (
        (run.drop_vars("peak_storey_drift_ratio"), "no peak_storey_drift_ratio"),
        (run.expand_dims(event=["shock"]), "select_event"),
        (run.expand_dims(archetype=["house"]), "select_archetype"),
        (run.drop_vars("motion_peak_acceleration"), r"pass run.drop_vars\('peak_floor_acceleration'\)"),
    )
    for dataset, message in cases:
        with pytest.raises(ValueError, match=message):
            wd.write_pelicun_demands(dataset, path, level=0.2)
    cloud = complete_run()
    cloud["im_level"].attrs["design"] = "of a design where every motion has a level of its own"
    with pytest.raises(ValueError, match="level= selects stripes, but the run has none"):
        wd.write_pelicun_demands(cloud, path, level=0.2)
    with pytest.raises(TypeError, match="Dataset"):
        wd.write_pelicun_demands({}, path)


def test_demands_are_read_back(tmp_path):
    run = complete_run()
    again = wd.read_pelicun_demands(wd.write_pelicun_demands(run, tmp_path / "demands.csv", level=0.4))
    stripe = run.isel(sample=np.flatnonzero(run["im_level"] == 0.4))
    for name in ("peak_storey_drift_ratio", "peak_floor_acceleration"):
        np.testing.assert_array_equal(again[name], stripe[name])  # repr of a float is read back as the same float
    np.testing.assert_array_equal(again["residual_drift_ratio"], np.abs(stripe["residual_drift_ratio"]))
    np.testing.assert_allclose(again["peak_ground_acceleration"], 0.4 * G, rtol=1e-12)
    assert (again["im_level"] == 0.4).all()
    assert again["im_level"].attrs["intensity_measure"] == "PGA"
    assert again["storey"].values.tolist() == [1, 2, 3]


FOREIGN = """,PFA-0-1,PFA-1-1,PFA-1-2,PID-2-1,PID-1-1,SA_0.30-0-1,ERROR
units,g,ftps2,g,rad,unitless,mps2,
0,0.5,1.0,9,0.0061,0.02,9.80665,0
1,0.25,2.0,9,,0.01,4.903325,1
"""


def test_another_tool_s_file_is_read_in_si(tmp_path):
    path = tmp_path / "demands.csv"
    path.write_text(FOREIGN)
    demands = wd.read_pelicun_demands(path)
    np.testing.assert_allclose(demands["peak_ground_acceleration"], [0.5 * G, 0.25 * G], rtol=1e-15)
    np.testing.assert_allclose(demands["peak_floor_acceleration"], [[0.3048], [0.6096]], rtol=1e-15)
    np.testing.assert_array_equal(demands["peak_storey_drift_ratio"], [[0.02, 0.0061], [0.01, np.nan]])
    np.testing.assert_allclose(demands["im_level"], [1.0, 0.5], rtol=1e-15)
    assert demands["im_level"].attrs["intensity_measure"] == "Sa(0.3 s, 5 %)"
    assert demands["im_level"].attrs["intensity_measure_period"] == 0.3
    assert demands["failed"].values.tolist() == [0, 1]
    assert wd.read_pelicun_demands(path, direction=2)["peak_floor_acceleration"].values.tolist() == [[9 * G], [9 * G]]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("units,", "0,", "0 rows of units"),
        ("ftps2", "m/s2", r"'PFA-1-1' is in 'm/s2'; units of PFA are mps2"),
        ("ftps2", "", "is in ''"),
        ("PFA-1-1", "PFA-1", "names must be"),
        ("PID-2-1", "PID-1-1", "twice"),  # pandas names the second PID-1-1.1
        ("0.0061", "6.1 mm", "'PID-2-1' must contain numbers: could not convert"),
    ],
)
def test_what_pelicun_would_take_wrongly_is_refused(tmp_path, old, new, message):
    path = tmp_path / "demands.csv"
    assert old in FOREIGN
    path.write_text(FOREIGN.replace(old, new, 1))
    with pytest.raises(ValueError, match=message):
        wd.read_pelicun_demands(path)
    path.write_text(FOREIGN)
    with pytest.raises(ValueError, match="no demand in direction 3"):
        wd.read_pelicun_demands(path, direction=3)


@pytest.mark.usefixtures("unoptimised")  # the file is held to its run
def test_a_run_has_all_that_the_file_needs(tmp_path):
    building = wd.ShearBuilding.from_hazus("C1L", "high", 2)
    pulse = np.sin(np.arange(100) / 5.0)
    motions = [wd.GroundMotion(2 * pulse, 0.02, "one"), wd.GroundMotion(3 * pulse[::-1], 0.02, "two")]
    stripes = wd.Stripes(motions, [0.1, 0.2], wd.PeakGroundAcceleration())
    scene = wd.Scene(building, stripes, recorders=("drift", "acceleration", "residual"))
    run = wd.simulate(scene, device="cpu")
    np.testing.assert_allclose(run["motion_peak_acceleration"], np.abs(pulse).max() * np.array([2, 3]), rtol=1e-15)
    path = wd.write_pelicun_demands(run, tmp_path / "demands.csv", level=0.2)
    text = path.read_text().splitlines()
    assert text[0] == ",1-PFA-0-1,1-PFA-1-1,1-PFA-2-1,1-PID-1-1,1-PID-2-1,1-RID-1-1,1-RID-2-1,1-PGA-0-1"
    assert text[1] == "Units,mps2,mps2,mps2,rad,rad,rad,rad,g"
    table = pd.read_csv(io.StringIO("\n".join(text)), index_col=0, skiprows=[1])
    # Motions scaled to a peak of 0.2 g have that peak; the scale is a quotient and the peak a product, two roundings.
    np.testing.assert_allclose(table["1-PFA-0-1"], 0.2 * G, rtol=1e-14)
    on_stripe = run.isel(sample=np.flatnonzero(run["im_level"] == 0.2))
    drift = table[["1-PID-1-1", "1-PID-2-1"]].values
    np.testing.assert_array_equal(drift, on_stripe["peak_storey_drift_ratio"].values.astype(np.float64))
