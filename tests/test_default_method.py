"""The method that a run takes where none is given: what the table says, that it holds, and how the dataset tells it."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from law_rows import forces_of

import warpdyn as wd
from warpdyn.campaigns.integration.settings import Integration, measured_dampings
from warpdyn.engine.methods import defaults
from warpdyn.engine.methods.defaults import (
    ALL_RECORDERS,
    COLUMNS,
    FALLBACK,
    LIGHT_RAYLEIGH,
    MOST_COST,
    MOST_ERROR,
    default_method,
    measured_costs,
    measured_methods,
)
from warpdyn.engine.methods.table import METHODS
from warpdyn.model.structures.damping import DAMPING

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


def row_of(law="takeda", damping="rayleigh", method="stoermer", error=1.0, storeys=5):
    return defaults.Measured(law, damping, storeys, method, 2, error, error)


@pytest.mark.fast
def test_rows_are_of_methods_laws_and_kinds_of_damping_that_exist():
    rows = measured_methods()
    keys = [(row.law, row.damping, row.storeys, row.method, row.steps) for row in rows]
    assert len(set(keys)) == len(keys) > 0
    assert {row.method for row in rows} <= METHODS.keys()
    assert {row.law for row in rows} <= wd.laws.LAWS.keys()
    assert {row.damping for row in rows} == {*DAMPING, LIGHT_RAYLEIGH}
    assert {name for name, _, _ in measured_costs()} <= wd.laws.LAWS.keys()


def cost_of(law, method, steps):
    """Return the measured costs of a method for a law, by column."""
    return measured_costs()[law, method, steps]


def largest_errors():
    """Return the largest 95 % quantile over the measured numbers of storeys, by law, damping, method and steps."""
    found = {}
    for row in measured_methods():
        found.setdefault((row.law, row.damping, row.method, row.steps), {})[row.storeys] = row.error_95
    assert all(by_storeys.keys() == {1, 3, 5, 10, 20} for by_storeys in found.values())
    return {key: max(by_storeys.values()) for key, by_storeys in found.items()}


@pytest.mark.fast
@pytest.mark.parametrize("device", ["cpu", "cuda"])
def test_the_default_errs_no_more_than_rk4_for_every_law_damping_and_height(device):
    known = largest_errors()
    laws = {law for law, _, _ in measured_costs()}
    kinds = (*DAMPING, LIGHT_RAYLEIGH)
    assert {(law, damping) for law, damping, _, _ in known} == set(product(laws, kinds))  # all are measured
    for law, damping in product(wd.laws.LAWS, kinds):
        found = default_method(forces_of(law), (damping,), is_gpu=device == "cuda")
        if found.method != FALLBACK:  # whose ratio is 1
            assert known[law, damping, found.method, found.steps] <= 1.0


@pytest.mark.fast
@pytest.mark.parametrize("column", COLUMNS)
def test_the_cheapest_method_that_is_as_accurate_and_cheaper_is_the_default(column):
    known = largest_errors()
    device = column.removesuffix(ALL_RECORDERS)
    for law, damping in {key[:2] for key in known}:
        within = {
            (method, steps): cost_of(law, method, steps).get(column, cost_of(law, method, steps)[device])
            for (name, kind, method, steps), error in known.items()
            if (name, kind) == (law, damping) and error <= MOST_ERROR
        }
        within = {key: cost for key, cost in within.items() if cost <= MOST_COST}
        terms = {"is_gpu": device == "cuda", "records_only_drifts": column == device}
        found = default_method(forces_of(law), (damping,), **terms)
        assert (found.method, found.steps) == min(within, key=within.get, default=(FALLBACK, 1))


@pytest.mark.fast
def test_the_default_is_rk4_where_nothing_is_measured(monkeypatch):
    assert default_method(forces_of("takeda"), ("rayleigh",)).method == "stoermer"
    unknown = default_method(forces_of("takeda+one_sided_gap"), ("rayleigh",))
    assert (unknown.method, unknown.steps) == ("rk4", 1)
    assert "one_sided_gap" in unknown.reason
    for law in ("friction_pendulum", "takeda+one_sided_gap"):  # no row of the table of costs
        for recorded in (True, False):
            unmeasured = default_method(forces_of(law), ("rayleigh",), records_only_drifts=recorded)
            assert unmeasured.reason.endswith(f"cheaper for storeys of {law.replace('+', ', ')} with rayleigh damping")
    assert default_method(forces_of("takeda"), ("unknown",)).method == "rk4"
    monkeypatch.setattr(defaults, "measured_costs", dict)
    assert default_method(forces_of("takeda"), ("rayleigh",), is_gpu=True).method == "rk4"


@pytest.mark.fast
def test_of_several_laws_and_dampings_the_least_accurate_counts(monkeypatch):
    rows = (row_of(), row_of("pinching4"), row_of("pinching4", "storey", error=1.3), row_of(damping="storey"))
    monkeypatch.setattr(defaults, "measured_methods", lambda: rows)
    assert default_method(forces_of("takeda|pinching4"), ("rayleigh",)).method == "stoermer"
    assert default_method(forces_of("takeda"), ("rayleigh", "storey")).method == "stoermer"
    assert default_method(forces_of("pinching4"), ("rayleigh", "storey")).method == "rk4"
    assert default_method(forces_of("takeda|bouc_wen"), ("rayleigh",)).method == "rk4"  # not measured


@pytest.mark.fast
@pytest.mark.parametrize("implicit", [True, False])
def test_a_default_fits_the_damping(monkeypatch, implicit):
    name = "newmark_linear" if implicit else "stoermer"
    monkeypatch.setattr(defaults, "measured_methods", lambda: (row_of(damping="rayleigh_tangent", method=name),))
    monkeypatch.setattr(defaults, "measured_costs", lambda: {("takeda", name, 2): {"cpu": 0.5}})
    assert default_method(forces_of("takeda"), ("rayleigh_tangent",)).method == ("rk4" if implicit else name)


def building(damping="rayleigh", storeys=3, **own):
    values = {} if damping in ("none", "storey") else {"damping_ratio": 0.05}
    values |= {"damping_coefficient": 1e4} if damping == "storey" else {}
    return wd.ShearBuilding(np.full(storeys, 1e5), 4e7, 3.0, law="takeda", damping=damping, **TAKEDA, **values | own)


@pytest.mark.fast
def test_kinds_of_damping_of_a_building():
    for damping in DAMPING:
        assert measured_dampings(building(damping)) == (damping,)
    # Less damping of the higher modes than in the measured buildings: none, the least accurate case.
    assert measured_dampings(building("modal", damping_ratio=0.04)) == ("none",)
    assert measured_dampings(building("mass_proportional", damping_ratio=0.04)) == ("none",)
    assert measured_dampings(building(damping_ratio=0.04)) == (LIGHT_RAYLEIGH,)
    assert measured_dampings(building(damping_ratio=0.02)) == (LIGHT_RAYLEIGH,)
    assert measured_dampings(building(damping_ratio=0.019)) == ("none",)
    assert measured_dampings(building(damping_ratio=0.08)) == ("rayleigh",)
    assert measured_dampings(building(damping_modes=(1, 3))) == (LIGHT_RAYLEIGH,)
    assert measured_dampings(building(storeys=4, damping_modes=(1, 4))) == ("none",)
    assert measured_dampings(building(damping_modes=(1, 2))) == ("rayleigh",)
    assert measured_dampings(building(damped_storeys=(2, 3))) == ("none",)
    damped = {"devices": ("viscous_damper",), "damper_coefficient": [1e5, 0.0, 0.0]}
    assert measured_dampings(building(**damped)) == ("rayleigh", "storey")
    assert measured_dampings(building("storey", **damped)) == ("storey",)
    power = damped | {"velocity_exponent": 0.5}
    assert default_method(forces_of("takeda"), measured_dampings(building(**power))).method == "rk4"
    isolated = building().on_isolators("bilinear", 1e5, 0.4, stiffness=1e7, yield_force=1e5, hardening_ratio=0.1)
    assert measured_dampings(isolated) == ("none",)
    assert measured_dampings(wd.LinearSystem([1.0], [[0.0]], [[1.0]])) == ("matrix",)


def weakly_damped():
    """Return five Menegotto-Pinto storeys whose higher modes have hardly any damping, under 44 records."""
    relative, mass = np.array([1, 0.933, 0.8, 0.6, 0.333]), np.full(5, 2e5)
    frame = wd.ShearBuilding(
        mass, 2e8 * relative, 3.2, law="menegotto_pinto", yield_force=0.15 * mass.sum() * 9.81 * relative,
        hardening_ratio=0.02, damping="mass_proportional", damping_ratio=0.04,
    )  # fmt: skip
    stripes = wd.Stripes(wd.records.far_field(), [1.0], wd.SpectralAcceleration(frame.fundamental_period))
    return wd.Scene(frame, stripes, recorders=("drift",), tail=0.0)


@pytest.mark.fast
def test_weakly_damped_higher_modes_are_integrated_by_rk4():
    scene = weakly_damped()
    found = Integration()
    assert found.settled(forces_of("menegotto_pinto"), scene, is_gpu=False).method == "rk4"
    assert found.settled(forces_of("menegotto_pinto"), scene, is_gpu=True).method == "rk4"


@pytest.mark.thorough
def test_errors_with_weakly_damped_higher_modes(monkeypatch):
    # Measured independently: 95 % quantile and largest error of the peak drifts, of two digits.
    scene = weakly_damped()
    truth = wd.simulate(scene, method="rk4", dtype="float64", longest_step=3e-4, device="cpu").peak_storey_drift

    def errors():
        found = wd.simulate(scene, device="cpu")
        off = (np.abs(found.peak_storey_drift - truth).max("storey") / truth.max("storey")).values
        return found.attrs["method"], np.quantile(off, 0.95), off.max()

    assert errors() == ("rk4", pytest.approx(9.1e-4, rel=0.05), pytest.approx(1.5e-3, rel=0.05))
    # Were errors of any size accepted, the cheaper method would lose most of the accuracy.
    monkeypatch.setattr(defaults, "MOST_ERROR", np.inf)
    method, error_95, largest = errors()
    assert method == "stoermer"
    assert error_95 > 4 * 9.1e-4
    assert largest > 10 * 1.5e-3


def test_a_run_takes_the_default_and_says_why():
    scene = scene_of()
    found, rk4 = run(scene), run(scene, method="rk4")
    assert found.attrs["method"] == "stoermer"
    assert found.attrs["method_chosen_because"] == default_method(forces_of("takeda"), ("rayleigh",)).reason
    assert "method_chosen_because" not in rk4.attrs
    assert np.array_equal(2 * found["integration_step"].values, rk4["integration_step"].values)
    again = run(scene, method="stoermer", step=found.attrs["step"])  # the attributes say all that it takes
    assert np.array_equal(again["peak_storey_drift"].values, found["peak_storey_drift"].values)


@pytest.mark.parametrize("with_limit", [False, True])
def test_recorders_and_a_collapse_limit_count_in_the_cost(monkeypatch, with_limit):
    costs = {("takeda", "stoermer", 2): {"cpu": 0.5, "cpu" + ALL_RECORDERS: 1.3}}
    monkeypatch.setattr(defaults, "measured_costs", lambda: costs)
    assert run(scene_of()).attrs["method"] == "stoermer"
    more = replace(scene_of(), collapse_drift_ratio=0.2) if with_limit else scene_of(recorders=("drift", "energy"))
    assert run(more).attrs["method"] == "rk4"


@pytest.mark.meant_as_given("strongest_motion", "peak_ground_acceleration")
def test_random_noise_is_integrated_by_rk4():
    """By stoermer with a step per node, the input energy was up to 275 % off; its balance error is of this size."""
    noise = wd.FilteredNoise(wd.WhiteNoise(0.005), duration=10.0, interval=0.01)
    under_noise = wd.Scene(scene_of().structure, noise, recorders=("drift", "energy"))
    found = run(under_noise)
    assert found.attrs["method"] == "rk4"
    assert found.attrs["method_chosen_because"] == "other methods were not measured with random noise"
    assert abs(found["energy_balance_error"]).max() < 2e-3


def test_stoermer_without_a_step_takes_two_for_each_of_rk4():
    found, rk4 = (run(scene_of(), method=method) for method in ("stoermer", "rk4"))
    assert np.array_equal(2 * found["integration_step"].values, rk4["integration_step"].values)
    with_step = run(scene_of(), method="stoermer", longest_step=0.01)
    assert np.all(with_step["integration_step"] == 0.01)


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
    assert set(found.attrs["method"].split("; ")) == {"stoermer"}  # one step, or two, for each step of RK4
    step = found["integration_step"].groupby(found["archetype_index"]).mean().values
    assert step[0] == step[1] / 2


@pytest.mark.fast
def test_a_building_of_little_damping_is_not_called_undamped():
    building = wd.ShearBuilding(2e5, 2e8, 3.0, law="bilinear", yield_force=1e6, hardening_ratio=0.05,
                                damping="rayleigh", damping_ratio=0.01)  # fmt: skip
    reason = default_method(forces_of("bilinear"), measured_dampings(building)).reason
    assert reason.endswith("storeys of bilinear with little or no damping (peak drifts only)")
