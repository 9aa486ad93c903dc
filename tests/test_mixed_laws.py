"""Parameters of buildings whose storeys differ in their laws: NaN where a storey's law does not take them."""

import json
import warnings

import numpy as np
import pytest

import warpdyn as wd
from warpdyn import plots

pytestmark = pytest.mark.meant_as_given("yield_drift_ratio")

SHAKE = wd.GroundMotion(3.0 * np.sin(0.3 * np.arange(120)) * np.hanning(120), 0.02)
TAKEN = [False, True, True]


def building(**changed):
    given = {"law": ("elastic", "bilinear", "bilinear"), "yield_force": 3e5, "hardening_ratio": [0.5, 0.02, 0.04]}
    return wd.ShearBuilding(
        [2e5] * 3, [2e8, 1.6e8, 1.2e8], 3.0, damping="rayleigh", damping_ratio=0.05, **given | changed
    )


def run_of(scatter, structures=4, structure=None, **settings):
    scene = wd.Scene(structure or building(), SHAKE, scatter=scatter, **settings)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return wd.simulate(scene, structures=structures, device="cpu", dtype="float64")


def test_values_are_of_storeys_whose_law_takes_them():
    values = building(yield_force=[7e5, 3e5, 2e5]).parameters
    np.testing.assert_array_equal(values["yield_force"], [np.nan, 3e5, 2e5])
    np.testing.assert_array_equal(values["hardening_ratio"], [np.nan, 0.02, 0.04])
    assert np.isfinite(values["stiffness"]).all()
    # A value that its own law would refuse is not looked at elsewhere.
    np.testing.assert_array_equal(building(yield_force=[-1, 3e5, 2e5]).parameters["yield_force"], [np.nan, 3e5, 2e5])
    with pytest.raises(ValueError, match="yield_force is -1 at storey 2; it must be finite and above 0"):
        building(yield_force=[1, -1, 1])


def test_a_dataset_has_values_only_where_they_count():
    spread = wd.Lognormal(1.0, 0.2)
    scatters = [
        {
            "yield_force": wd.RandomFactor(spread, per="storey", storey_correlation=0.4),
            "hardening_ratio": wd.GivenValues([0.03] * 4),
        },
        {"yield_force": wd.RandomValue(wd.Uniform(2e5, 4e5)), "stiffness": wd.RandomFactor(spread)},
        {
            "yield_force": wd.GivenValues(np.linspace(2e5, 4e5, 4)),
            "hardening_ratio": wd.GivenValues(np.full((4, 3), 0.05)),
        },
        {"yield_force": wd.GivenValues(np.array([[np.nan, 2e5, 3e5]] * 4))},
    ]
    for scatter in scatters:
        run = run_of(scatter, correlation={})
        assert (run.status == 0).all()
        assert np.isfinite(run.peak_storey_drift).all()
        for name in scatter:
            found = np.broadcast_to(np.isfinite(run[name]), (4, 3))
            np.testing.assert_array_equal(found, [[True] * 3 if name == "stiffness" else TAKEN] * 4)


def test_an_unscattered_building_is_the_one_whose_values_are_listed():
    nominal = run_of({}, structures=1)
    listed = run_of({"yield_force": wd.GivenValues([[1.0, 3e5, 3e5]])}, structures=1)
    np.testing.assert_array_equal(nominal.peak_storey_drift, listed.peak_storey_drift)
    drift = nominal.peak_storey_drift.values[0]
    assert drift[0] * 2e8 > 3e5  # an elastic storey above the others' yield force
    assert drift[1] > 3e5 / 1.6e8


def test_json_has_null():
    scatter = {"yield_force": wd.GivenValues([[np.nan, 2e5, 3e5]])}
    text = wd.Scene(building(), SHAKE, scatter=scatter).to_json()
    told = json.loads(text, parse_constant=pytest.fail)
    assert told["structure"]["yield_force"] == [None, 3e5, 3e5]
    assert told["scatter"]["yield_force"]["values"] == [[None, 2e5, 3e5]]


def test_a_plot_names_yield_forces_where_there_are_any():
    texts = [text.get_text() for text in plots.building(building()).axes[0].texts]
    assert sum("Fy = 300 kN" in text for text in texts) == 2
    assert not any("nan" in text.lower() for text in texts)


def test_drawn_values_are_checked_where_they_count():
    scatter = {"yield_force": wd.GivenValues([[1, 2e5, 3e5], [1, 2e5, -3e5]])}
    with pytest.raises(ValueError, match="the given yield_force is -300000 at structure 1, storey 3"):
        run_of(scatter, structures=2)
    with pytest.raises(ValueError, match=r"scatter\['yield_force'\] lists nan at storey 3, whose law needs"):
        run_of({"yield_force": wd.GivenValues([[1, 2e5, np.nan]])}, structures=1)
    with pytest.raises(ValueError, match=r"GivenValues.values\[1, 2\] is nan"):
        wd.GivenValues([[1, 2e5, 3e5], [1, 2e5, np.nan]])


def test_a_portfolio_of_them_is_each_by_itself():
    weak, strong = building(), building(yield_force=4e5)
    spread = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    portfolio = wd.Portfolio({"weak": wd.Archetype(weak, 3, spread), "strong": wd.Archetype(strong, 2)})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = wd.Scene(portfolio, wd.Cloud([SHAKE]), recorders=("drift",))
        run = wd.simulate(scene, device="cpu", method="rk4", dtype="float64")
    assert (run.status == 0).all()
    step = float(run.integration_step[-1])
    scene = wd.Scene(strong, wd.Cloud([SHAKE]), recorders=("drift",))
    alone = wd.simulate(scene, device="cpu", dtype="float64", step=step)
    np.testing.assert_allclose(run.peak_storey_drift.values[-1], alone.peak_storey_drift.values[0], rtol=1e-12)


@pytest.mark.fast
def test_each_storey_follows_its_own_law():
    laws = (
        wd.laws.Bilinear(yield_force=3e5, hardening_ratio=0.02),
        wd.laws.BoucWen(yield_force=3e5, hardening_ratio=0.05),
        wd.laws.PeakOriented(yield_force=3e5, hardening_ratio=0.02),
    )
    drift = 0.01 * np.sin(np.linspace(0, 20, 400)) * np.linspace(0, 1, 400)
    together = wd.storey_hysteresis(wd.ShearBuilding([1e5] * 3, 1e8, 3.0, law=laws), np.tile(drift[:, None], 3))
    for storey, law in enumerate(laws):
        alone = wd.storey_hysteresis(wd.ShearBuilding(1e5, 1e8, 3.0, law=law), drift)
        for name in ("storey_force", "dissipated_energy"):
            expected = alone[name].values[:, 0]
            np.testing.assert_allclose(
                together[name].values[:, storey], expected, rtol=0, atol=1e-12 * np.abs(expected).max()
            )


def test_isolators_leave_the_frames_values():
    isolated = building().on_isolators(
        "lead_rubber_bearing", 2e5, 0.5, stiffness=3e7, yield_force=1e5, post_yield_stiffness=3e6
    )
    np.testing.assert_array_equal(isolated.parameters["yield_force"], [1e5, np.nan, 3e5, 3e5])
    np.testing.assert_array_equal(isolated.parameters["post_yield_stiffness"], [3e6, *[np.nan] * 3])
    pushed = wd.pushover(isolated, np.linspace(0, 0.1, 20)[1:])
    assert np.isfinite(pushed["storey_force"]).all()
