"""Isolators and tuned mass dampers are no storeys of the building, in whatever counts storeys."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import statsmodels.api as sm
import xarray as xr
from test_damage import made

import warpdyn as wd
from warpdyn.foundations.core.output_variables import KIND_OF_ARCHETYPES, STOREY_KIND

pytestmark = pytest.mark.meant_as_given("drift_limit")
STOREYS = 5
FRAME = {"building_type": "C1M", "design_level": "moderate", "storeys": STOREYS, "damped_storeys": (1, STOREYS)}
LIMITS = {"moderate": 0.006, "extensive": 0.015}
COUNTS = ("motion", "stripe", "structure_group")


def isolated_frame() -> wd.ShearBuilding:
    """Return the frame of the tutorial on isolators, on lead-rubber bearings that fail at 0.5 m."""
    building = wd.ShearBuilding.from_hazus(**FRAME)
    mass = building.parameters["mass"]
    total = mass[0] + mass.sum()
    after_yield = total * (2 * np.pi / 2.5) ** 2
    strength = {"yield_force": 0.05 * total * 9.81, "post_yield_stiffness": after_yield}
    return building.on_isolators(
        "lead_rubber_bearing", mass[0], displacement_capacity=0.5, stiffness=10 * after_yield, **strength
    )


@pytest.fixture(scope="module")
def scene() -> wd.Scene:
    scatter = {name: wd.RandomFactor(wd.Lognormal(1.0, 0.2)) for name in ("stiffness", "yield_force")}
    period = wd.ShearBuilding.from_hazus(**FRAME).fundamental_period
    levels = [0.1, 0.2, 0.35, 0.6, 0.9, 1.3, 1.8, 2.5]
    stripes = wd.Stripes(wd.records.far_field()[::2], levels, wd.SpectralAcceleration(period))
    recorders = ("drift", "acceleration")
    return wd.Scene(isolated_frame(), stripes, scatter, recorders=recorders, collapse_drift_ratio=0.1)


@pytest.fixture(scope="module")
def run(scene) -> xr.Dataset:
    return wd.simulate(scene, structures=4, seed=1, device="cpu")


def probit_median(run: xr.Dataset, limit: float, first: int) -> float:
    """Return the median by statsmodels' probit, of the storeys from a place on."""
    drift = run["peak_storey_drift_ratio"].values[:, first:].max(axis=1)
    exceeds = (drift > limit) | (run["status"].values == 1)
    link = sm.families.Binomial(link=sm.families.links.Probit())
    fit = sm.GLM(exceeds.astype(float), sm.add_constant(np.log(run["im_level"].values)), link).fit(tol=1e-12)
    return float(np.exp(-fit.params[0] / fit.params[1]))


def test_the_run_says_which_storeys_are_isolators(run, tmp_path):
    kind = run[STOREY_KIND]
    assert kind.values.tolist() == [1, 0, 0, 0, 0, 0]
    assert kind.attrs["flag_meanings"].split()[1] == "isolators"
    wd.write(run, tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc") as again:
        assert again[STOREY_KIND].values.tolist() == kind.values.tolist()
        xr.testing.assert_equal(wd.fragility(again, LIMITS, replicates=2), wd.fragility(run, LIMITS, replicates=2))


@pytest.mark.parametrize("function", [wd.fragility, wd.fragility_of_cloud])
def test_curves_leave_out_the_isolators(run, function):
    curves = function(run, LIMITS)
    by_hand = function(wd.select_storeys(run, 2, STOREYS + 1), LIMITS)
    for name in ("fragility_median", "fragility_dispersion", "fragility_median_lower"):
        assert curves[name].values.tolist() == by_hand[name].values.tolist()


def test_medians_are_those_of_another_program_and_seed(run):
    own, counted = (wd.fragility(run, LIMITS, added_storeys=each)["fragility_median"].values for each in (False, True))
    for place, limit in enumerate(LIMITS.values()):
        # statsmodels stops where the deviance changes by 1e-12 of itself.
        assert own[place] == pytest.approx(probit_median(run, limit, first=1), rel=1e-5)
        assert counted[place] == pytest.approx(probit_median(run, limit, first=0), rel=1e-5)
    # Of another draw of four structures; 0.207 and 0.445 g with the isolators. Half the interval is 20 % and more.
    np.testing.assert_allclose(own, [0.763, 1.345], rtol=0.02)
    np.testing.assert_allclose(counted, [0.207, 0.445], rtol=0.02)


def test_the_isolators_alone_count_if_they_are_selected(run):
    alone = wd.select_storeys(run, 1, 1)
    curves = wd.fragility(alone, {"displaced": 0.02})
    assert float(curves["fragility_median"][0]) == pytest.approx(probit_median(alone, 0.02, first=0), rel=1e-5)


def test_statistics_of_a_run_leave_them_out_too(scene, run):
    demand = "peak_storey_drift_ratio"
    asked = [
        wd.DamageCounts(LIMITS, over=COUNTS, each_place=True),
        wd.DemandMoments(demand),
        wd.LargestDemand("peak_floor_acceleration"),
        wd.DemandHistogram(demand, np.geomspace(1e-3, 0.09, 30)),
    ]
    found = wd.simulate(scene, structures=4, seed=1, device="cpu", statistics=asked)
    for name in ("fragility_median", "fragility_median_lower", "exceeding_samples"):
        assert wd.fragility(found)[name].values.tolist() == wd.fragility(run, LIMITS)[name].values.tolist()
    standing = run.isel(sample=np.flatnonzero(run["status"] == 0))
    largest = standing[demand].values[:, 1:].max(axis=1).astype(np.float64)
    # Sums are exact to the last bit of float64; NumPy's pairwise sum of 700 values is within some 1e-14.
    assert float(found[f"{demand}_mean"]) == pytest.approx(largest.mean(), rel=1e-12)
    accelerations = standing["peak_floor_acceleration"].values[:, 1:]
    assert float(found["peak_floor_acceleration_largest"]) == float(accelerations.max())
    edges = np.geomspace(1e-3, 0.09, 30)
    expected = np.bincount(np.searchsorted(edges, largest, side="left"), minlength=31)
    expected[-1] += int((run["status"] == 1).sum())
    assert found[f"{demand}_histogram"].values.tolist() == expected.tolist()
    with_them = wd.DemandMoments(demand, added_storeys=True)
    again = wd.simulate(scene, structures=4, seed=1, device="cpu", statistics=with_them)
    of_all = standing[demand].values.max(axis=1).astype(np.float64)
    assert float(again[f"{demand}_mean"]) == pytest.approx(of_all.mean(), rel=1e-12)


def test_capacities_leave_them_out(scene):
    few = wd.Scene(scene.structure, wd.Cloud(scene.excitation.motions[:3], scene.excitation.measure))
    found = wd.capacities(few, {"moderate": 0.006}, tolerance=0.1, highest=4.0, device="cpu")
    counted = wd.capacities(few, {"moderate": 0.006}, tolerance=0.1, highest=4.0, added_storeys=True, device="cpu")
    # A drift ratio of 0.006 is 0.03 m of the isolators, whose storey has ten times their capacity as its height.
    assert (found["capacity"].values > 1.5 * counted["capacity"].values).all()
    cloud = wd.Stripes(few.excitation.motions, [1e-3, 4.0], few.excitation.measure)
    for motion, level in enumerate(found["capacity_upper"].values.ravel()):
        at_level = wd.Stripes(cloud.motions[motion : motion + 1], [float(level)], cloud.measure)
        above = wd.simulate(wd.Scene(few.structure, at_level, recorders=("drift",)), device="cpu")
        assert float(above["peak_storey_drift_ratio"].values[0, 1:].max()) > 0.006


def test_a_portfolio_leaves_them_out_of_its_archetypes():
    run = made()
    kinds = xr.Variable(("archetype", "storey"), np.array([[0, 0], [1, 0]], dtype=np.int8))
    run = run.assign_coords({KIND_OF_ARCHETYPES: kinds})
    limits = {"light": {"slight": 1.0, "complete": 2.0}, "heavy": {"slight": 10.0, "complete": 20.0}}
    shares = wd.damage_shares(run, limits)["archetype_damage_share"].sel(archetype="heavy")
    # By hand, of the second storey alone: 11, 1, 1, 10 and 5, 5, 10.5, 5.
    np.testing.assert_array_equal(2 * shares, [[1, 1, 0], [2, 0, 0], [1, 1, 0], [2, 0, 0]])
    with_them = wd.damage_shares(run, limits, added_storeys=True)
    xr.testing.assert_equal(with_them, wd.damage_shares(made(), limits).assign_coords(with_them.coords))


def test_a_portfolio_s_run_names_the_storeys_of_its_archetypes(scene):
    building = wd.ShearBuilding.from_hazus(**FRAME)
    city = wd.Portfolio({"fixed": wd.Archetype(building, 1, {}), "isolated": wd.Archetype(isolated_frame(), 1, {})})
    stripes = wd.Stripes(scene.excitation.motions[:2], [0.2, 0.9], scene.excitation.measure)
    run = wd.simulate(wd.Scene(city, stripes, recorders=("drift",), collapse_drift_ratio=0.1), device="cpu")
    assert run[KIND_OF_ARCHETYPES].values.tolist() == [[0] * 6, [1, 0, 0, 0, 0, 0]]
    alone = wd.select_archetype(run, "isolated")
    assert alone[STOREY_KIND].values.tolist() == [1, 0, 0, 0, 0, 0]
    assert STOREY_KIND not in wd.select_archetype(run, "fixed").coords
    limits = {name: LIMITS for name in ("fixed", "isolated")}
    counts = wd.DamageCounts(limits, over=("archetype", "motion", "stripe"))
    asked = wd.simulate(
        wd.Scene(city, stripes, recorders=("drift",), collapse_drift_ratio=0.1), device="cpu", statistics=counts
    )
    expected = wd.damage_shares(run, limits)["archetype_damage_share"]
    np.testing.assert_array_equal(wd.damage_shares(asked)["archetype_damage_share"], expected)


def test_losses_figures_reports_and_exports_leave_them_out(run, tmp_path):
    drift_loss = [0.0, 0.004, 0.01, 0.03], [0.0, 0.02, 0.1, 0.3]
    own = wd.select_storeys(run, 2, STOREYS + 1)
    found, expected = (wd.storey_losses(each, drift_loss)["loss_ratio"] for each in (run, own))
    np.testing.assert_array_equal(found, expected)
    axes = [wd.plots.drift_over_height(each).axes[0].lines[0].get_xdata() for each in (run, own)]
    np.testing.assert_array_equal(*axes)
    tables = []
    for name, each in (("run.csv", run), ("own.csv", own)):
        path = wd.write_pelicun_demands(each, tmp_path / name, level=0.35)
        tables.append(pd.read_csv(path, index_col=0, skiprows=[1]))
    drifts = [name for name in tables[1] if "PID" in name or "PFA-0" not in name]
    pd.testing.assert_frame_equal(tables[0][drifts], tables[1][drifts])
    base = run.isel(sample=np.flatnonzero(run["im_level"] == 0.35))["peak_floor_acceleration"][:, 0]
    np.testing.assert_allclose(tables[0]["1-PFA-0-1"], base, rtol=1e-6)  # float32, as text
    assert "storey 1, isolators" in wd.summary(run)
