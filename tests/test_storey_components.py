"""Components of storeys: fragility with random capacities, losses by storey, tables and files, invalid input."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from plotted_runs import striped_run
from scipy.stats import norm

import warpdyn as wd

DRIFT, ACCELERATION = "peak_storey_drift_ratio", "peak_floor_acceleration"
SPECTRUM = "peak_floor_spectral_acceleration"


def run_with_floors():
    """Return a run on stripes with known drifts, accelerations of three floors and floor spectra of two periods."""
    run = striped_run()
    samples = run.sizes["sample"]
    floors = np.tile([4.0, 6.0, 10.0], (samples, 1))
    spectra = np.stack([floors, 2 * floors], axis=-1)
    return run.assign(
        {ACCELERATION: (("sample", "floor"), floors), SPECTRUM: (("sample", "floor", "period"), spectra)}
    ).assign_coords(period=[0.1, 0.2])


PARTITION = wd.Component(DRIFT, [0.005, 0.02], [0.4, 0.3], costs=[100.0, wd.RepairCost((400.0, 200.0), (2.0, 6.0))])
CEILING = wd.Component(ACCELERATION, [8.0], [0.5], costs=[30.0])


def states_of(demand, medians, dispersions):
    """Return the probabilities of exactly each limit state."""
    exceeding = [norm.cdf(np.log(demand / m) / b) for m, b in zip(medians, dispersions, strict=True)]
    return np.array([exceeding[0] - exceeding[1], exceeding[1]]) if len(exceeding) > 1 else np.array(exceeding)


def test_costs_of_a_sample():
    run = run_with_floors()
    losses = wd.component_losses(
        run, {"partition": PARTITION, "ceiling": CEILING}, {"partition": 4, "ceiling": [0, 5, 7]}, 1e6
    )
    sample = int(np.flatnonzero(run["status"].values == 0)[7])
    drifts = run[DRIFT].values[sample].astype(float)
    damaged = 4 * np.array([states_of(each, [0.005, 0.02], [0.4, 0.3]) for each in drifts])
    per_unit = np.array([100.0, np.interp(damaged[:, 1].sum(), [2.0, 6.0], [400.0, 200.0])])
    partitions = damaged @ per_unit
    ceilings = 30.0 * np.array([0, 5, 7]) * norm.cdf(np.log(np.array([4.0, 6.0, 10.0]) / 8.0) / 0.5)
    np.testing.assert_allclose(losses["repair_cost_by_storey"][sample], partitions + ceilings, rtol=1e-12)
    np.testing.assert_allclose(
        losses["repair_cost_by_component"][sample], [partitions.sum(), ceilings.sum()], rtol=1e-12
    )
    assert float(losses["repair_cost"][sample]) == pytest.approx(partitions.sum() + ceilings.sum(), rel=1e-12)
    collapsed = run["status"].values == 1
    assert (losses["loss_ratio"].values[collapsed] == 1.0).all()
    capped = wd.component_losses(run, {"ceiling": CEILING}, {"ceiling": [0, 5, 7]}, replacement_value=250.0)
    assert float(capped["loss_ratio"].max()) == 1.0


def test_weights_and_crossing_limit_states():
    component = wd.Component(DRIFT, [0.01, 0.012], [0.2, 0.6], weights=[[0.7, 0.3], [1.0]])
    found = component.probabilities([0.005, 0.02])
    first, second = (norm.cdf(np.log(0.02 / m) / b) for m, b in ((0.01, 0.2), (0.012, 0.6)))
    np.testing.assert_allclose(found[1], [0.7 * (first - second), 0.3 * (first - second), second], rtol=1e-12)
    light = norm.cdf(np.log(0.005 / 0.01) / 0.2)  # the heavier state would be more likely
    np.testing.assert_allclose(found[0], [0.0, 0.0, light], atol=1e-15)


def test_floors_below_and_spectra():
    run = run_with_floors()
    peaks = (
        np.arange(1.0, run.sizes["motion"] + 1)
        if "motion" in run.dims
        else np.arange(1.0, 1 + run["motion_index"].max())
    )
    run = run.assign(motion_peak_acceleration=("motion", peaks)).assign_coords(
        scale_factor_of_motion=("sample", np.full(run.sizes["sample"], 2.0))
    )
    below = wd.Component(ACCELERATION, [8.0], [0.5], costs=[1.0], place="floor_below")
    losses = wd.component_losses(run, {"pump": below}, {"pump": 1}, 1e6)
    sample = int(np.flatnonzero(run["status"].values == 0)[0])
    ground = 2.0 * peaks[int(run["motion_index"][sample])]
    expected = norm.cdf(np.log(np.array([ground, 4.0, 6.0]) / 8.0) / 0.5)
    np.testing.assert_allclose(losses["repair_cost_by_storey"][sample], expected, rtol=1e-12)
    rack = wd.Component(SPECTRUM, [8.0], [0.5], costs=[1.0], period=0.2)
    expected = norm.cdf(np.log(2 * np.array([4.0, 6.0, 10.0]) / 8.0) / 0.5)
    found = wd.component_losses(run, {"rack": rack}, {"rack": 1}, 1e6)["repair_cost_by_storey"][sample]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def power_law_run(records=40, levels=10, slope=0.9, dispersion=0.35):
    """Return a run on stripes whose drift ratio is 0.012 im^slope with a lognormal dispersion among the records."""
    im = np.geomspace(0.2, 6.0, levels)
    factor = np.exp(dispersion * norm.ppf((np.arange(records) + 0.5) / records))
    drift = 0.012 * im[:, None] ** slope * factor
    index = {"motion_index": ("sample", np.tile(np.arange(records), levels))}
    index["im_level"] = ("sample", np.repeat(im, records), {"design": "stripes", "units": "g"})
    index["structure"] = ("sample", np.zeros(im.size * records, dtype=int))
    status = (
        "sample",
        np.zeros(drift.size, dtype=np.int8),
        {"flag_values": np.array([0, 1], dtype=np.int8), "flag_meanings": "ok collapsed"},
    )
    data = {DRIFT: (("sample", "storey"), drift.reshape(-1, 1)), "status": status}
    return xr.Dataset(data, index | {"storey": [1], "sample": np.arange(drift.size)})


def test_fragility_with_random_capacities():
    # Closed form: median (C / a)^(1 / b), dispersion sqrt(bD^2 + bC^2) / b.
    curves = wd.component_fragility(
        power_law_run(), wd.Component(DRIFT, [0.02], [0.3]), intervals_over="records", seed=4
    )
    median, dispersion = (0.02 / 0.012) ** (1 / 0.9), np.hypot(0.35, 0.3) / 0.9
    # 400 samples of the capacity: the standard error of the median is about 3 % and that of the dispersion about 5 %.
    assert curves["fragility_median"].item() == pytest.approx(median, rel=0.06)
    assert curves["fragility_dispersion"].item() == pytest.approx(dispersion, rel=0.12)
    assert curves["damage_state"].values.tolist() == ["limit_state_1"]
    again = wd.component_fragility(
        power_law_run(), wd.Component(DRIFT, [0.02], [0.3]), storey=1, intervals_over="records", seed=4
    )
    assert again["fragility_median"].item() == curves["fragility_median"].item()


def test_annual_losses():
    run = power_law_run()
    component = wd.Component(DRIFT, [0.02], [0.3], costs=[1e4])
    losses = wd.component_losses(run, {"wall": component}, {"wall": 3}, replacement_value=1e5)
    hazard = wd.HazardCurve([0.05, 8.0], [4e-5 * 0.05**-2.6, 4e-5 * 8.0**-2.6])  # a power law
    annual = wd.component_annual_losses(losses, hazard)
    # Integral over each record in closed form is not available; by fine quadrature of the interpolated mean cost.
    levels, mean = losses["intensity"].values, losses["mean_cost_by_storey"].values[:, 0]
    x = np.geomspace(levels[0], levels[-1], 200_001)
    rate = 4e-5 * x**-2.6
    cost = np.interp(x, levels, mean)
    expected = -np.trapezoid(cost, rate) + mean[-1] * rate[-1]
    assert annual["expected_annual_loss"].item() == pytest.approx(expected, rel=1e-6)
    assert annual["annual_loss_by_storey"].values == pytest.approx([expected], rel=1e-6)
    assert annual["annual_loss_by_component"].values == pytest.approx([expected], rel=1e-6)
    bounds = annual["expected_annual_loss_lower"].item(), annual["expected_annual_loss_upper"].item()
    assert bounds[0] < expected < bounds[1]


def test_annual_losses_if_the_levels_have_different_records():
    run = power_law_run()
    # Records of one parity at each level, as in a selection of records for each level.
    place = np.searchsorted(np.unique(run["im_level"]), run["im_level"].values)
    run = run.isel(sample=np.flatnonzero(run["motion_index"].values % 2 == place % 2))
    component = wd.Component(DRIFT, [0.02], [0.3], costs=[1e4])
    losses = wd.component_losses(run, {"wall": component}, {"wall": 3}, replacement_value=1e5)
    hazard = wd.HazardCurve([0.05, 8.0], [4e-5 * 0.05**-2.6, 4e-5 * 8.0**-2.6])
    annual = wd.component_annual_losses(losses, hazard)
    expected = wd.expected_annual_loss(losses, hazard, replacement_value=1e5)["expected_annual_loss"].item()
    assert annual["expected_annual_loss"].item() == pytest.approx(expected, rel=1e-12)
    assert annual["annual_loss_by_storey"].values == pytest.approx([expected], rel=1e-12)
    assert np.isnan(annual["expected_annual_loss_upper"])
    assert annual.attrs["interval_method"] == "none"
    # All samples of a record failed at a level.
    complete = wd.component_losses(power_law_run(), {"wall": component}, {"wall": 3}, replacement_value=1e5)
    complete["repair_cost"][7] = np.nan
    with pytest.raises(ValueError, match=r"motion 7 has no valid sample at 0\.2 g: all samples failed"):
        wd.component_annual_losses(complete, hazard)


def test_tables_of_the_user():
    table = pd.DataFrame(
        {
            "component": ["wall", "wall", "tank"],
            "demand": [DRIFT, DRIFT, ACCELERATION],
            "median": [0.01, 0.02, 5.0],
            "dispersion": [0.3, 0.3, 0.4],
            "cost": [1.0, 2.0, 3.0],
            "place": [None, None, "floor_below"],
        }
    )
    found = wd.components_from_table(table)
    assert list(found) == ["wall", "tank"]
    assert (found["wall"].costs, found["tank"].place) == ((1.0, 2.0), "floor_below")
    with pytest.raises(ValueError, match="no column 'median'"):
        wd.components_from_table(table.drop(columns="median"))
    with pytest.raises(ValueError, match=r"'beta'.*allowed are"):
        wd.components_from_table(table.assign(beta=1.0))
    with pytest.raises(ValueError, match="component 'wall' has several values of 'demand'"):
        wd.components_from_table(table.assign(demand=[DRIFT, ACCELERATION, ACCELERATION]))
    with pytest.raises(ValueError, match="row 1 of the table has no name: fill in 'component'"):
        wd.components_from_table(table.assign(component=["wall", None, "tank"]))
    with pytest.raises(ValueError, match=r"component 'wall'.*increasing"):
        wd.components_from_table(table.assign(median=[0.02, 0.01, 5.0]))


HEAD = "ID,Incomplete,Demand-Type,Demand-Unit,Demand-Offset,Demand-Directional,LS1-Family,LS1-Theta_0,LS1-Theta_1,"
HEAD += "LS1-DamageStateWeights,LS2-Family,LS2-Theta_0,LS2-Theta_1,LS2-DamageStateWeights\n"
ROWS = (
    "S.1,0,Peak Interstory Drift Ratio,unitless,0,1,lognormal,0.04,0.4,0.950000 | 0.050000,lognormal,0.08,0.4,\n"
    "A.1,0,Peak Floor Acceleration,g,1,0,lognormal,1.5,0.4,,,,,\n"
    "A.0,0,Peak Floor Acceleration,g,0,0,lognormal,0.5,0.5,,,,,\n"
    "I.1,1,Peak Floor Acceleration,g,1,0,lognormal,0.55,,,,,,\n"
    "V.1,0,Peak Floor Velocity,mps,0,0,lognormal,0.25,0.5,,,,,\n"
)
COSTS = (
    "ID,Incomplete,Quantity-Unit,DV-Unit,DS1-Family,DS1-Theta_0,DS1-Theta_1,DS2-Family,DS2-Theta_0,DS2-Theta_1,"
    "DS3-Family,DS3-Theta_0,DS3-Theta_1\n"
    'S.1-Cost,0,1 EA,USD_2011,,,,normal,"16536,10176|5,20",0.37,lognormal,15564,0.5\n'
    "A.1-Cost,0,1000 LF,USD_2011,lognormal,700,0.6,,,,,,\n"
)


def test_files_of_pelicun(tmp_path):
    functions, costs = tmp_path / "fragility.csv", tmp_path / "consequence_repair.csv"
    functions.write_text(HEAD + ROWS)
    costs.write_text(COSTS)
    found = wd.read_pelicun_components(functions, ["S.1", "A.1"], costs)
    joint = found["S.1"]
    assert (joint.demand, joint.medians, joint.weights) == (DRIFT, (0.04, 0.08), ((0.95, 0.05), (1.0,)))
    assert joint.costs[:2] == (0.0, wd.RepairCost((16536.0, 10176.0), (5.0, 20.0)))
    assert joint.costs[2] == pytest.approx(15564 * np.exp(0.125))
    assert (found["A.1"].place, found["A.1"].unit) == ("floor_above", "1000 LF")
    assert found["A.1"].medians == pytest.approx([1.5 * 9.80665])
    assert wd.read_pelicun_components(functions, ["A.0"])["A.0"].place == "floor_below"
    for name, message in (
        ("I.1", "incomplete"),
        ("V.1", "'Peak Floor Velocity' is not recorded"),
        ("X", "no component"),
    ):
        with pytest.raises(ValueError, match=message):
            wd.read_pelicun_components(functions, [name])
    with pytest.raises(ValueError, match="no column 'Demand-Type'"):
        wd.read_pelicun_components(costs, ["S.1-Cost"])
    with pytest.raises(TypeError, match="list of identifiers"):
        wd.read_pelicun_components(functions, "S.1")
    for old, new, message in (
        ("unitless,0", "unitless,above", "column Demand-Offset must be a number, got 'above'"),
        ("0.950000 |", "most |", "column LS1-DamageStateWeights must be a number, got 'most'"),
    ):
        functions.write_text(HEAD + ROWS.replace(old, new))
        with pytest.raises(ValueError, match=message):
            wd.read_pelicun_components(functions, ["S.1"])
    functions.write_text(HEAD + ROWS.replace("unitless", "percent"))
    with pytest.raises(ValueError, match="unit 'percent'"):
        wd.read_pelicun_components(functions, ["S.1"])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (dict(demand="peak_drift"), "unknown demand of a Component"),
        (dict(place="floor"), "unknown place of a Component"),
        (dict(medians=[0.02, 0.01]), "increasing"),
        (dict(dispersions=[0.4]), "2 numbers above 0"),
        (dict(costs=[1.0]), "2 costs, one for each damage state"),
        (dict(costs=[1.0, -1.0]), "at least 0"),
        (dict(weights=[[0.5, 0.4], [1.0]]), "the sum 1"),
        (dict(weights=[[1.0]]), "one row for each of the 2 limit states"),
        (dict(weights=[0.5, 0.5]), r"such as \[\[1.0\], \[1.0\]\], got \[0.5, 0.5\]"),
        (dict(weights=5), "one row for each of the 2 limit states.*got 5"),
        (dict(period=0.2), "other demands have none"),
        (dict(demand=SPECTRUM, medians=[3.0, 5.0]), "needs period="),
    ],
)
def test_invalid_components(given, message):
    with pytest.raises(ValueError, match=message):
        wd.Component(**(dict(demand=DRIFT, medians=[0.01, 0.02], dispersions=[0.3, 0.3]) | given))


def test_implausible_components_and_invalid_costs():
    with pytest.warns(UserWarning, match="2 % is 0.02"):
        wd.Component(DRIFT, [0.5, 2.0], [0.3, 0.3])
    with pytest.warns(UserWarning, match=r"40 is implausible: 40 % is 0\.4"):
        wd.Component(DRIFT, [0.02], [40])
    with pytest.warns(UserWarning, match=r"in g, multiply them by 9\.80665"):
        wd.Component(ACCELERATION, [0.7], [0.3])
    with pytest.raises(ValueError, match="2 costs"):
        wd.RepairCost((1.0,), (1.0, 2.0))
    with pytest.raises(ValueError, match="2 increasing numbers"):
        wd.RepairCost((2.0, 1.0), (2.0, 1.0))


def test_invalid_losses():
    run, parts = run_with_floors(), {"ceiling": CEILING}
    with pytest.raises(ValueError, match=r"no quantity of \['ceiling'\]"):
        wd.component_losses(run, parts, {}, 1e6)
    with pytest.raises(ValueError, match=r"unknown components \['door'\]"):
        wd.component_losses(run, parts, {"ceiling": 1, "door": 2}, 1e6)
    with pytest.raises(ValueError, match="each of the 3 storeys"):
        wd.component_losses(run, parts, {"ceiling": [1, 2]}, 1e6)
    with pytest.raises(ValueError, match="add 'acceleration' to Scene"):
        wd.component_losses(run.drop_vars(ACCELERATION), parts, {"ceiling": 1}, 1e6)
    rack = wd.Component(SPECTRUM, [8.0], [0.5], period=0.3)
    with pytest.raises(ValueError, match=r"add it to FloorSpectra\(periods=...\)"):
        wd.component_losses(run, {"rack": rack}, {"rack": 1}, 1e6)
    below = wd.Component(SPECTRUM, [8.0], [0.5], period=0.2, place="floor_below")
    with pytest.raises(ValueError, match="quantity 0 in storey 1"):
        wd.component_losses(run, {"rack": below}, {"rack": 1}, 1e6)
    assert wd.component_losses(run, {"rack": below}, {"rack": [0, 1, 1]}, 1e6)["repair_cost"].notnull().all()
    with pytest.warns(UserWarning, match="check the quantities"):
        wd.component_losses(run, parts, {"ceiling": 1e6}, 1e3)
    with pytest.raises(ValueError, match="unknown storey 4"):
        wd.component_fragility(run, CEILING, storey=4)
    with pytest.raises(TypeError, match="no argument 'limits'"):
        wd.component_fragility(run, CEILING, limits={})
    with pytest.raises(ValueError, match="not losses of a run on stripes"):
        wd.component_annual_losses(
            wd.component_losses(run, parts, {"ceiling": 1}, 1e6).drop_dims("intensity"),
            wd.HazardCurve([0.1, 1], [1e-2, 1e-4]),
        )
