"""The method that a run takes where none is given: what the table says, that it holds, and how the dataset tells it."""

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.methods import defaults
from warpdyn.methods.defaults import FALLBACK, MOST_COST, MOST_ERROR, default_method, measured_methods
from warpdyn.methods.table import METHODS

TAKEDA = {"yield_force": 4e5, "hardening_ratio": 0.05, "unloading_exponent": 0.4}


def scene_of(law="takeda", storeys=2, recorders=("drift",), **own):
    """Return a yielding building under noise of 20 ms, where the default step halves the record's."""
    time, random = np.arange(0, 12, 0.02), np.random.default_rng(3)
    motions = [
        wd.GroundMotion(3 * random.normal(size=time.size) * np.exp(-(((time - 4) / 3) ** 2)), 0.02, f"noise {i}")
        for i in range(6)
    ]
    building = wd.ShearBuilding(
        np.full(storeys, 1e5), 4e7, 3.0, law=law, damping="rayleigh", damping_ratio=0.05, **(own or TAKEDA)
    )
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    return wd.Scene(building, wd.Cloud(motions), scatter=scatter, recorders=recorders, tail=1.0)


def run(scene, **terms):
    return wd.simulate(scene, structures=12, device="cpu", seed=2, **terms)


@pytest.mark.fast
def test_rows_are_of_methods_and_laws_that_exist():
    rows = measured_methods()
    keys = [(row.law, row.method, row.steps) for row in rows]
    assert len(set(keys)) == len(keys) > 0
    assert {row.method for row in rows} <= METHODS.keys()
    assert {row.law for row in rows} <= wd.laws.LAWS.keys()


@pytest.mark.fast
@pytest.mark.parametrize("row", measured_methods(), ids=lambda row: f"{row.law}-{row.method}")
def test_a_method_is_default_exactly_where_it_is_as_accurate_and_cheaper(row):
    wins = max(row.median_error, row.error_95) <= MOST_ERROR and row.costs["cpu"] <= MOST_COST
    assert default_method(row.law).method == (row.method if wins else FALLBACK)


@pytest.mark.fast
def test_the_default_falls_back_to_rk4_where_nothing_is_measured(monkeypatch):
    assert default_method("takeda").method == "velocity_verlet"
    unknown = default_method("takeda+one_sided_gap")
    assert (unknown.method, unknown.steps) == ("rk4", 1)
    assert "one_sided_gap" in unknown.reason
    without = [defaults.Measured(r.law, r.method, r.steps, r.median_error, r.error_95, {}) for r in measured_methods()]
    monkeypatch.setattr(defaults, "measured_methods", lambda: tuple(without))
    assert default_method("takeda", is_gpu=True).reason == "no other method has been measured on a GPU"


@pytest.mark.fast
def test_of_several_laws_all_must_be_as_accurate():
    assert default_method("bilinear|pinching4").method == "velocity_verlet"
    assert default_method("bouc_wen|pinching4").method == "rk4"  # whose memory follows the velocity


@pytest.mark.fast
@pytest.mark.parametrize("implicit", [True, False])
def test_a_default_fits_the_damping(monkeypatch, implicit):
    name = "newmark_linear" if implicit else "velocity_verlet"
    row = defaults.Measured("takeda", name, 2, 1.0, 1.0, {"cpu": 0.5})
    monkeypatch.setattr(defaults, "measured_methods", lambda: (row,))
    assert default_method("takeda", "rayleigh_tangent").method == ("rk4" if implicit else name)


def test_a_run_takes_the_default_and_says_why():
    scene = scene_of()
    found, rk4 = run(scene), run(scene, method="rk4")
    assert found.attrs["method"] == "velocity_verlet"
    assert found.attrs["method_chosen_because"] == default_method("takeda", "rayleigh").reason
    assert "method_chosen_because" not in rk4.attrs
    assert np.array_equal(2 * found["integration_step"].values, rk4["integration_step"].values)
    again = run(scene, method="velocity_verlet", step=found.attrs["step"])  # the attributes say all that it takes
    assert np.array_equal(again["peak_storey_drift"].values, found["peak_storey_drift"].values)


def test_a_step_that_is_given_is_rk4s():
    found = run(scene_of(), longest_step=0.01)
    assert found.attrs["method"] == "rk4"
    assert "method_chosen_because" not in found.attrs
    given = run(scene_of(), longest_step=0.01, method="rk4")
    assert np.array_equal(found["peak_storey_drift"].values, given["peak_storey_drift"].values)


def test_the_default_errs_no_more_than_rk4():
    # The truth is a central difference with implicit damping in float64: another skeleton than both. At RK4's step it
    # errs up to five times as much as RK4, and at a sixteenth of it, by its order 2, a fiftieth. What different records
    # change of the ratio of two such errors is the table's MOST_ERROR; of 72 samples it scatters half as much again.
    scene = scene_of()
    rk4 = run(scene, method="rk4")
    truth = run(scene, method="central_difference", dtype="float64", step=rk4.attrs["step"] / 16)["peak_storey_drift"]

    def errors(found):
        off = np.abs(found["peak_storey_drift"] - truth).max("storey") / truth.max("storey")
        return np.quantile(off.values, [0.5, 0.95])

    assert errors(rk4)[0] > 1e-5  # what is compared is more than rounding in float32
    assert (errors(run(scene)) <= 1.5 * MOST_ERROR * errors(rk4)).all()


def test_buildings_of_a_portfolio_have_the_default_of_their_own_law():
    own = {name: scene_of().structure.parameters[name] for name in ("mass", "stiffness", "height", "damping_ratio")}
    takeda = wd.ShearBuilding(**own, law="takeda", damping="rayleigh", **TAKEDA)
    elastic = wd.ShearBuilding(**own, law="elastic", damping="rayleigh")
    archetypes = {"takeda": wd.Archetype(takeda, 2), "elastic": wd.Archetype(elastic, 2)}
    scene = wd.Scene(wd.Portfolio(archetypes), scene_of().excitation, recorders=("drift",), tail=1.0)
    found = wd.simulate(scene, device="cpu")
    assert set(found.attrs["method"].split("; ")) == {"rk4", "velocity_verlet"}
    step = found["integration_step"].groupby(found["archetype_index"]).mean().values
    assert step[0] == step[1] / 2
