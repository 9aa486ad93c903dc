"""Collapse: what a sample tells that ends where a storey passes its drift capacity, by every kind of method."""

import warnings

import numpy as np
import pytest
from combination_cases import SOURCES, springs_of_laws
from method_sources import shown, source_of, thorough_unless

import warpdyn as wd
from warpdyn.campaigns.integration import stability_guard
from warpdyn.engine.methods.table import METHODS, StoreyForces, fitting_methods
from warpdyn.foundations.core.output_variables import COLLAPSED, OK, UNSTABLE_STEP

MASS, STIFFNESS, HEIGHT = [3e4, 2e4, 1e4], [2e7, 1.5e7, 8e6], [4.0, 3.0, 3.0]
# One pulse after the other, each larger, so that it passes one limit after the other.
PULSES = wd.GroundMotion(np.linspace(0, 9, 400) * np.sin(np.arange(400) * 0.12), 0.01, "growing")
RUN = {"step": 0.005, "dtype": "float64", "device": "cpu", "histories": wd.Histories((0,))}
LIMIT = 0.012


def building(law="bilinear", **parameters):
    given = {} if law == "elastic" else {"yield_force": [4e5, 3e5, 1.6e5], "hardening_ratio": 0.05}
    return wd.ShearBuilding(
        MASS, STIFFNESS, HEIGHT, law=law, damping="rayleigh", damping_ratio=0.03, **given | parameters
    )


def run(structure, method, **settings):
    return wd.simulate(wd.Scene(structure, PULSES, tail=0.0, **settings), method=method, **RUN)


METHOD_CASES = [
    thorough_unless(name in ("rk4", "newmark_average"), name) for name in shown(fitting_methods(StoreyForces()))
]


@pytest.mark.filterwarnings("ignore:.*energy balance:UserWarning")
@pytest.mark.parametrize("method", [*METHOD_CASES, "exact"])
def test_demands_are_those_of_the_history_up_to_the_collapse(method):
    structure = building("elastic" if method == "exact" else "bilinear")
    whole, ended = (
        wd.simulate(wd.Scene(structure, PULSES, tail=0.0, collapse_drift_ratio=limit), method=method, **RUN)
        for limit in (None, LIMIT)
    )
    ratio = np.abs(np.diff(whole["displacement"].values[0], axis=1, prepend=0)) / HEIGHT
    last = int(np.argmax(ratio.max(axis=1) > LIMIT))
    assert 50 < last < len(ratio) - 50
    assert ended["status"].item() == COLLAPSED
    assert whole["status"].item() == OK
    # Between the two states, on a line.
    before, after = ratio[last - 1].max(), ratio[last].max()
    exact = whole["time"].values[last - 1] + (LIMIT - before) / (after - before) * RUN["step"]
    assert ended["time_of_collapse"].item() == pytest.approx(exact, rel=1e-9)
    assert ended["storey_of_collapse"].item() == ratio[last].argmax() + 1
    # The histories hold the states that the demands are taken of; adaptive methods see parts of steps too.
    rtol = 1e-3 if METHODS[method].is_adaptive else 1e-10
    # The drifts are those at the collapse, on lines between their states.
    at_collapse = ratio[last - 1] + (LIMIT - before) / (after - before) * (ratio[last] - ratio[last - 1])
    peaks = np.maximum(ratio[:last].max(axis=0), at_collapse)
    found = ended["peak_storey_drift_ratio"].values[0]
    np.testing.assert_allclose(found, peaks, rtol=rtol)
    assert found[ratio[last].argmax()] == pytest.approx(LIMIT, rel=rtol)
    acceleration = np.abs(whole["acceleration"].values[0, :last]).max(axis=0)
    np.testing.assert_allclose(ended["peak_floor_acceleration"][0], acceleration, rtol=10 * rtol)
    assert (found <= LIMIT * (1 + 1e-12)).all()
    assert ended["time_of_peak_drift"].item() <= ended["time_of_collapse"].item()
    assert np.isnan(ended["residual_drift_ratio"]).all()
    kept = last if METHODS[method].is_adaptive else last + 1  # where it stands still within a step, or at its end
    for name in ("displacement", "velocity", "acceleration", "storey_force"):
        one, other = (each[name].values[0] for each in (ended, whole))
        # The compiler may fuse other products: what a rounding in each of some hundred steps makes.
        np.testing.assert_allclose(one[:kept], other[:kept], rtol=0, atol=1e-10 * np.abs(other).max())
        assert np.isnan(one[kept:]).all(), name
    # Lagged forces and long steps leave a balance of their own; a frozen sample adds nothing to it.
    usual = abs(whole["energy_balance_error"].item())
    assert abs(ended["energy_balance_error"].item()) < max(0.02, 3 * usual)


@pytest.mark.meant_as_given("collapse_drift_ratio")
def test_storeys_have_capacities_of_their_own():
    ratio = run(building(), "rk4")["peak_storey_drift_ratio"].values[0]
    strong = np.full(3, 1.0)
    for storey in range(3):
        capacity = np.where(np.arange(3) == storey, 0.5 * ratio, strong)
        by_ratio = run(building(drift_ratio_capacity=capacity), "rk4")
        by_drift = run(building(drift_capacity=capacity * HEIGHT), "rk4")
        for each in (by_ratio, by_drift):
            assert each["status"].item() == COLLAPSED
            assert each["storey_of_collapse"].item() == storey + 1
            passed = each["peak_storey_drift_ratio"].values[0, storey]
            assert passed == pytest.approx(0.5 * ratio[storey], rel=1e-12)
        assert by_ratio["time_of_collapse"].item() == by_drift["time_of_collapse"].item()
    first = run(building(drift_ratio_capacity=0.5 * ratio, drift_capacity=strong), "rk4", collapse_drift_ratio=0.9)
    assert first["status"].item() == COLLAPSED


@pytest.mark.meant_as_given("collapse_drift_ratio")
def test_capacities_can_be_scattered():
    scatter = {"drift_ratio_capacity": wd.GivenValues([0.004, 0.008, 1.0])}
    scene = wd.Scene(building(drift_ratio_capacity=0.01), PULSES, scatter, tail=0.0)
    found = wd.simulate(scene, structures=3, step=0.005, dtype="float64", device="cpu")
    assert found["status"].values.tolist() == [COLLAPSED, COLLAPSED, OK]
    assert found["time_of_collapse"].values[0] < found["time_of_collapse"].values[1]
    peak = found["peak_storey_drift_ratio"].max("storey").values
    np.testing.assert_allclose(peak[:2], [0.004, 0.008], rtol=1e-12)


@pytest.mark.meant_as_given("storey_height")
@pytest.mark.parametrize("method", ["rk4", "velocity_verlet", "newmark_average", "dormand_prince54"])
def test_gravity_takes_a_bouc_wen_storey_past_its_limit(method):
    # By scipy's DOP853 (rtol 1e-10) the storey passes 0.1 m at .15349017 s; it does not come back.
    storey = wd.ShearBuilding(
        1.0, 100.0, 1.0, law="bouc_wen", yield_force=2.0, hardening_ratio=0.0, exponent=5.0, gravity_load=10.0
    )
    scene = wd.Scene(storey, wd.FreeVibration(6.0, velocity=0.75), collapse_drift_ratio=0.1, recorders=("drift",))
    found = wd.simulate(scene, method=method, device="cpu")
    assert found["status"].item() == COLLAPSED
    # On a line between two states: the acceleration of 2 m/s2 bends it by 2 h^2 / 8 over a velocity of .6 m/s.
    assert found["time_of_collapse"].item() == pytest.approx(0.15349017, abs=1e-4)
    assert found["peak_storey_drift_ratio"].item() == pytest.approx(0.1, rel=1e-6)


def test_a_building_that_begins_beyond_its_capacity_has_collapsed():
    scene = wd.Scene(
        building("elastic"), wd.FreeVibration(1.0, displacement=[0.1, 0.2, 0.3]), collapse_drift_ratio=0.02
    )
    found = wd.simulate(scene, dtype="float64", device="cpu", step=0.005)
    assert found["status"].item() == COLLAPSED
    assert found["time_of_collapse"].item() == 0
    assert found["storey_of_collapse"].item() == 2
    np.testing.assert_allclose(found["peak_storey_drift"][0], 0.1, rtol=1e-12)


@pytest.mark.meant_as_given(
    "storey_height",
    "no_damping",
    "first_period_over_height",
    "initial_velocity",
    "integration_step",
    "collapse_drift_ratio",
)
def test_an_adaptive_method_sees_a_collapse_between_the_states_of_its_grid():
    # A sin 10 t at 25 steps a period: the states of the grid reach sin(2 pi 6 / 25) = .99803 of A, and its parts, of
    # some .07 rad by this tolerance, at least cos .035 = .9994.
    storey = wd.ShearBuilding(1.0, 100.0, 1.0, damping="none")
    step = 2 * np.pi / 10 / 25
    load = wd.FreeVibration(10 * step, velocity=0.5)
    scene = wd.Scene(storey, load, collapse_drift_ratio=0.9985 * 0.05, recorders=("drift",))
    given = {"method": "dormand_prince54", "tolerance": 1e-12, "dtype": "float64", "device": "cpu"}
    found = wd.simulate(scene, step=step, **given)
    assert found["status"].item() == COLLAPSED
    assert found["time_of_collapse"].item() == pytest.approx(np.arcsin(0.9985) / 10, abs=step / 2)
    assert found["peak_storey_drift"].item() == pytest.approx(0.9985 * 0.05, rel=1e-12)


@pytest.mark.meant_as_given(
    "storey_height",
    "no_damping",
    "first_period_over_height",
    "initial_drift_ratio",
    "first_period",
    "initial_velocity",
    "tail",
)
@pytest.mark.parametrize("method", ["rk4", "exact", pytest.param("newmark_average", marks=pytest.mark.thorough)])
def test_of_two_storeys_that_pass_in_one_step_the_first_collapses(method):
    # Storeys so soft that they drift on at their velocities: the first one from .95 to 1.02 of its capacity in a step,
    # the second from .7 to 1.15, which passes it first, after 2/3 of the step.
    step, capacity = 0.01, np.array([0.1, 0.2])
    start, end = np.array([0.95, 0.7]) * capacity, np.array([1.02, 1.15]) * capacity
    load = wd.FreeVibration(2 * step, displacement=np.cumsum(start), velocity=np.cumsum(end - start) / step)
    building = wd.ShearBuilding([1.0, 1.0], 1e-6, 3.0, damping="none", drift_capacity=capacity)
    scene = wd.Scene(building, load, recorders=("drift",))
    found = wd.simulate(scene, method=method, step=step, dtype="float64", device="cpu")
    assert found["status"].item() == COLLAPSED
    assert found["storey_of_collapse"].item() == 2
    # 1e-6 N/m bend the lines by 1e-10 in a step.
    assert found["time_of_collapse"].item() == pytest.approx(2 / 3 * step, rel=1e-8)
    np.testing.assert_allclose(found["peak_storey_drift"][0], [0.1 * (0.95 + 0.07 * 2 / 3), 0.2], rtol=1e-8)


@pytest.mark.meant_as_given(
    "storey_height",
    "no_damping",
    "first_period_over_height",
    "initial_velocity",
    "integration_step",
    "collapse_drift_ratio",
)
def test_a_step_too_long_to_tell_a_collapse_is_said_to_be(monkeypatch):
    # 2 sin 10 t passes .1 m at asin(.05) / 10 = .00500209 s, in the first step, at the end of which it is at .2 m.
    storey = wd.ShearBuilding(1.0, 100.0, 1.0, damping="none")
    scene = wd.Scene(storey, wd.FreeVibration(0.5, velocity=20.0), collapse_drift_ratio=0.1, recorders=("drift",))
    given = {"structures": 1, "step": 0.01, "dtype": "float64", "device": "cpu"}
    found = wd.simulate(scene, **given)
    assert found["status"].item() == COLLAPSED
    assert found["integration_step"].item() <= 0.1 / 2 / 20.0  # half the capacity at 20 m/s
    assert found["time_of_collapse"].item() == pytest.approx(np.arcsin(0.05) / 10, rel=1e-4)
    told = "1 of 1 samples is flagged unstable_step: in the step in which a storey passed its drift capacity, its drift"
    for on_unstable in ("flag", "raise", "substep"):
        if on_unstable == "substep":  # of which nothing can be afforded
            monkeypatch.setattr(stability_guard, "MOST_COST", 0)
            monkeypatch.setattr(stability_guard, "ALWAYS_AFFORDED", 0)
        with pytest.warns(UserWarning, match=told) as caught:
            found = wd.simulate(scene, on_unstable=on_unstable, **given)
        assert len(caught) == 1
        assert found["status"].item() == UNSTABLE_STEP
        assert np.isnan(found["peak_storey_drift"]).all()
        assert np.isnan(found["time_of_collapse"]).all()
        assert found["storey_of_collapse"].item() == -1


@pytest.mark.meant_as_given("first_period", "initial_velocity", "storey_height", "collapse_drift_ratio")
@pytest.mark.parametrize("method", ["rk4", "velocity_verlet"])
def test_a_move_of_more_than_half_the_capacity_is_no_collapse(method):
    # The storey is so soft that it moves at a constant velocity: by 48 or 52 % of its capacity of 0.1 m in the step in
    # which it passes it, from 0.06 m.
    storey = wd.ShearBuilding(1.0, 1e-4, 1.0, damping="none")
    for share, status in ((0.48, COLLAPSED), (0.52, UNSTABLE_STEP)):
        load = wd.FreeVibration(0.5, displacement=0.06, velocity=share * 0.1 / 0.01)
        scene = wd.Scene(storey, load, collapse_drift_ratio=0.1, recorders=("drift",))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the status
            given = {"step": 0.01, "dtype": "float64", "device": "cpu", "on_unstable": "flag"}
            found = wd.simulate(scene, structures=1, method=method, **given)
        assert found["status"].item() == status
    # At half the step the faster storey moves by 26 %, and collapses.
    found = wd.simulate(scene, structures=1, method=method, step=0.005, dtype="float64", device="cpu")
    assert found["status"].item() == COLLAPSED


YIELDING = [spring for spring in springs_of_laws() if spring != "elastic"]


@pytest.mark.thorough
@pytest.mark.usefixtures("unoptimised")
@pytest.mark.filterwarnings("ignore:.*energy balance:UserWarning")
@pytest.mark.parametrize("spring", YIELDING)
def test_every_law_collapses_alike_by_every_kind_of_method(spring):
    law, values = springs_of_laws()[spring]
    structure = wd.ShearBuilding(
        np.full(3, 1e3),
        4e5,
        3.0,
        law=law,
        damping="rayleigh",
        gravity_load=[6e4, 4e4, 2e4],
        **values | {"damping_ratio": 0.05},
    )
    growing = wd.GroundMotion(np.linspace(0, 3, 600) * np.sin(np.arange(600) * 0.05), 0.02, "growing")
    scene = wd.Scene(structure, growing, collapse_drift_ratio=0.1, recorders=("drift",), tail=0.0)
    runs = [
        wd.simulate(scene, method=method, step=0.002, dtype="float64", device="cpu")
        for method in ("rk4", "velocity_verlet", "newmark_average")
    ]
    for found in runs:
        assert found["status"].item() == COLLAPSED
        assert found["storey_of_collapse"].item() == runs[0]["storey_of_collapse"].item()
        assert found["time_of_collapse"].item() == pytest.approx(runs[0]["time_of_collapse"].item(), abs=2e-3)
        assert found["peak_storey_drift_ratio"].max() == pytest.approx(0.1, rel=1e-9)
        # Deteriorating laws tell turns at other steps: 2 % between methods of second order at this step.
        np.testing.assert_allclose(
            found["peak_storey_drift_ratio"], runs[0]["peak_storey_drift_ratio"], rtol=0.02, atol=2e-5
        )


def test_every_source_of_methods_is_met():
    assert {source_of(case.values[0]) for case in METHOD_CASES} | {source_of("exact")} == set(SOURCES)
